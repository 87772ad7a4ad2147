//! How fast are random runs? Three models through the engine, on one thread and on two, against
//! the same law written by hand in C (`stochastic.c`, compiled with `cc -O2`).
//!
//! Prints moves a second and the ratio to C; fails if the two disagree about the probability that
//! is asked, or about the number of moves of a run.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

#[path = "support/statistical.rs"]
mod statistical;
mod support;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use checker::exec::{Executor, Jit};
use checker::ir::{Asked, Network, Statistical};
use checker::stochastic::{Behaviour, Precision, RunId, RunWatch, Runner, Runs, Shown, estimate};

use statistical::{DEVIATIONS, Measured, load};
use support::Scratch;

/// The runs that are measured: those of a long query, of which the first moves, before there is
/// code, are 2 %. `RUNS` in the environment sets another number, and `MODEL` one model alone.
const RUNS: u64 = 1_000_000;
/// The fastest of so many repetitions counts; C and the engine take turns, so that both see the
/// same load.
const REPETITIONS: usize = 5;
/// The runs whose moves are counted in the engine.
const COUNTED_RUNS: u64 = 2_000;

/// A model with the name of its program in C, and what is asked of it.
struct Case {
    name: &'static str,
    model: &'static str,
    query: &'static str,
}

const CASES: [Case; 3] = [
    // A queue in an array, functions, committed and urgent moves, receivers with `select`.
    Case {
        name: "bridge",
        model: "
            const int N = 6;
            typedef int[0, N - 1] Id;
            broadcast chan near[N], halt[N], leave[N];
            urgent broadcast chan go[N];
            Id queue[N];
            int[0, N] length = 0;
            void enqueue(Id truck) { queue[length++] = truck; }
            void dequeue() {
                int i;
                length--;
                for (i = 0; i < length; i++) queue[i] = queue[i + 1];
                queue[length] = 0;
            }
            Id front() { return queue[0]; }
            Id tail() { return queue[length - 1]; }
            process Truck(const Id id) {
                clock x;
                state Away { ; (1 + id):120 }, Near { x <= 16 }, Stopped, Starting { x <= 12 },
                      Crossing { x <= 5 };
                init Away;
                trans Away -> Near { sync near[id]!; assign x = 0; },
                      Near -> Stopped { guard x <= 8; sync halt[id]?; },
                      Near -> Crossing { guard x >= 8; assign x = 0; },
                      Stopped -> Starting { sync go[id]?; assign x = 0; },
                      Starting -> Crossing { guard x >= 6; assign x = 0; },
                      Crossing -> Away { guard x >= 3; sync leave[id]!; };
            }
            process Gate() {
                state Free, Occupied, Stopping;
                commit Stopping;
                init Free;
                trans Free -> Occupied { guard length > 0; sync go[front()]!; },
                      Free -> Occupied {
                          select e : Id; guard length == 0; sync near[e]?; assign enqueue(e);
                      },
                      Occupied -> Stopping { select e : Id; sync near[e]?; assign enqueue(e); },
                      Stopping -> Occupied { sync halt[tail()]!; },
                      Occupied -> Free {
                          select e : Id; guard e == front(); sync leave[e]?; assign dequeue();
                      };
            }
            system Truck, Gate;",
        query: "Pr[<=200](<> length == N)",
    },
    // Clocks of processes alone, exponential and uniform delays, tools that one can hold.
    Case {
        name: "workshop",
        model: "
            const int PEOPLE = 4;
            const int CHORES = 5;
            typedef int[0, PEOPLE - 1] Person;
            const int LEAST[CHORES] = {1, 2, 3, 2, 1};
            const int MOST[CHORES] = {3, 5, 4, 6, 2};
            urgent broadcast chan at_once;
            bool is_taken[CHORES];
            int[0, PEOPLE] ready = 0;
            process Worker(const Person id) {
                clock x;
                int[0, CHORES - 1] chore = id;
                int[0, CHORES] chores = 0;
                state Resting { ; (2 + id):4 }, Waiting, Working { x <= MOST[chore] }, Done;
                init Resting;
                trans Resting -> Waiting { },
                      Waiting -> Working {
                          guard !is_taken[chore]; sync at_once!;
                          assign is_taken[chore] = true, x = 0;
                      },
                      Working -> Resting {
                          guard chores < CHORES - 1 && x >= LEAST[chore];
                          assign is_taken[chore] = false, chores++, chore = (chore + 1) % CHORES;
                      },
                      Working -> Done {
                          guard chores == CHORES - 1 && x >= LEAST[chore];
                          assign is_taken[chore] = false, ready++;
                      };
            }
            system Worker;",
        query: "Pr[<=30](<> ready == PEOPLE)",
    },
    // Few variables, no clock, a broadcast with each move.
    Case {
        name: "queue",
        model: "
            broadcast chan arrive, serve;
            int[0, 15] length = 0;
            int[0, 40] emptied = 0;
            process Arrivals() {
                state Open { ; 9:10 };
                init Open;
                trans Open -> Open { sync arrive!; };
            }
            process Server() {
                state Idle, Busy { ; 1 };
                init Idle;
                trans Idle -> Busy { sync arrive?; assign length++; },
                      Busy -> Busy { sync arrive?; assign length++; },
                      Busy -> Busy { guard length > 1; sync serve!; assign length--; },
                      Busy -> Idle { guard length == 1; sync serve!; assign length--; };
            }
            process Observer() {
                state Watching;
                init Watching;
                trans Watching -> Watching { guard length == 0; sync serve?; assign emptied++; };
            }
            system Arrivals, Server, Observer;",
        query: "Pr[<=100](<> length == 15 || emptied == 40)",
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let runs = match std::env::var("RUNS") {
        Ok(runs) => runs.parse()?,
        Err(_) => RUNS,
    };
    let scratch = Scratch::new()?;
    let program = scratch.compile("benches/stochastic.c", &[])?;
    let only = std::env::var("MODEL").ok();
    let is_wanted = |case: &&Case| only.as_ref().is_none_or(|only| only == case.name);
    for case in CASES.iter().filter(is_wanted) {
        measure(case, &program, runs)?;
    }
    Ok(())
}

fn measure(case: &Case, program: &Path, runs: u64) -> Result<(), Box<dyn Error>> {
    let (network, query) = load(case.model, case.query)?;
    let jit = Jit::new(&network.functions, &network.constants)?;
    let mut c = Measured::in_c(program, case.name, runs)?;
    let mut engine = [1, 2].map(|threads| run(&network, &jit, &query, (runs, threads)));
    for _ in 1..REPETITIONS {
        let again = Measured::in_c(program, case.name, runs)?;
        c.seconds = c.seconds.min(again.seconds);
        for (threads, best) in [1, 2].into_iter().zip(&mut engine) {
            let again = run(&network, &jit, &query, (runs, threads));
            best.seconds = best.seconds.min(again.seconds);
        }
    }
    let [one, two] = engine;
    assert_eq!(one.satisfied, two.satisfied, "threads change no result");
    let (ours, theirs) = one.shares(&c, case.name, runs);
    let moves_c = c.mean_moves(runs);
    let (mean, deviation) = counted_moves(&network, &jit, &query);
    assert!(
        (mean - moves_c).abs() <= DEVIATIONS * deviation,
        "{}: a run has {mean} moves here and {moves_c} in C",
        case.name
    );
    let moves = moves_c * runs as f64;
    println!(
        "{:9} {ours:.4} (C {theirs:.4})  {moves_c:5.1} moves a run  C {:6.2} M moves/s  \
         one thread {:6.2} M/s ({:6.2} x C)  two {:6.2} M/s ({:4.2} x one)",
        case.name,
        moves / c.seconds / 1e6,
        moves / one.seconds / 1e6,
        one.seconds / c.seconds,
        moves / two.seconds / 1e6,
        one.seconds / two.seconds,
    );
    Ok(())
}

/// Lets all runs be made.
struct Unwatched;

impl RunWatch for Unwatched {
    fn see(&mut self, _: Shown) {}

    fn ends(&mut self, _: u64) -> bool {
        false
    }
}

fn run(
    network: &Network,
    executor: &dyn Executor,
    query: &Statistical,
    (runs, threads): (u64, usize),
) -> Measured {
    let precision = Precision {
        runs: Some(runs),
        threads,
        ..Precision::default()
    };
    let begin = Instant::now();
    let runs = Runs {
        behaviour: Behaviour::new(network, executor),
        source: None,
    };
    let estimate = estimate(runs, query, &precision, &mut Unwatched);
    Measured {
        seconds: begin.elapsed().as_secs_f64(),
        satisfied: estimate
            .ok()
            .and_then(|estimate| estimate.satisfied_runs)
            .expect("the runs of the benchmark do not fail"),
        moves: None,
    }
}

/// How many moves a run has: the mean, and its standard deviation.
fn counted_moves(network: &Network, executor: &dyn Executor, query: &Statistical) -> (f64, f64) {
    let Statistical::Probability(bound, path) = query else {
        panic!("{query:?} asks for a probability");
    };
    let mut runner = Runner::new(network, executor);
    let (mut sum, mut squares) = (0.0, 0.0);
    for run in 0..COUNTED_RUNS {
        let outcome = runner.observe(RunId { seed: 0, run }, bound, Asked::Path(path));
        let moves = outcome
            .expect("the runs of the benchmark do not fail")
            .moves as f64;
        sum += moves;
        squares += moves * moves;
    }
    let runs = COUNTED_RUNS as f64;
    let mean = sum / runs;
    (mean, ((squares / runs - mean * mean) / runs).sqrt())
}
