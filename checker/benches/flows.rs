//! How fast are random runs with differential equations? Three models through the engine, on one
//! thread, against the same law written by hand in C (`flows.c`, compiled with `cc -O2`), and
//! against the time that UPPAAL's authors report for a model of the same size.
//!
//! Prints microseconds a run and the ratio to C; fails if the two disagree about the probability
//! that is asked, or about the number of moves of a run.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

#[path = "support/statistical.rs"]
mod statistical;
mod support;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use checker::exec::Jit;
use checker::ir::{Asked, Statistical};
use checker::stochastic::{RunId, Runner};

use statistical::{DEVIATIONS, Measured, load};
use support::Scratch;

/// The runs that are measured; `RUNS` in the environment sets another number.
const RUNS: u64 = 2_000;
/// The fastest of so many repetitions counts; C and the engine take turns, so that both see the
/// same load.
const REPETITIONS: usize = 5;

/// A model with the name of its program in C, and what is asked of it.
struct Case {
    name: &'static str,
    model: &'static str,
    query: &'static str,
    /// The time of a run of such a model that is published, in microseconds, and of what.
    published: Option<(f64, &'static str)>,
}

const CASES: [Case; 3] = [
    // Five equations, of which one is not linear, over 90 days; crossings of two values.
    Case {
        name: "epidemic",
        model: "
            clock susceptible = 0.998, exposed = 0.002, infectious, ward, recovered;
            double spread = 0.0;
            double contacts = 1.0;
            urgent broadcast chan now;
            process Virus() {
                state Begin, Spreading {
                    susceptible' == -contacts * spread * infectious * susceptible
                    && exposed' == contacts * spread * infectious * susceptible - exposed / 5.0
                    && infectious' == exposed / 5.0 - infectious / 4.0
                    && ward' == infectious / 200.0 - ward / 10.0
                    && recovered' == infectious * 49.0 / 200.0 + ward / 10.0
                };
                commit Begin;
                init Begin;
                trans Begin -> Spreading { assign spread = 0.5 + random(0.6); };
            }
            process Authority() {
                state Open, Closed;
                init Open;
                trans Open -> Closed {
                          guard infectious >= 0.03; sync now!; assign contacts = 0.3;
                      },
                      Closed -> Open {
                          guard infectious <= 0.01; sync now!; assign contacts = 1.0;
                      };
            }
            system Virus, Authority;",
        query: "Pr[<=90](<> ward >= 0.0014)",
        published: Some((164e3, "fluid Covid-19, five equations, ISoLA 2020")),
    },
    // Two linear equations, a guard for each move of the thermostat, chance from the window.
    Case {
        name: "room",
        model: "
            clock air = 19.0, wall = 19.0, energy;
            double heating = 0.0, leak = 0.3;
            urgent broadcast chan now;
            process Room() {
                state Warm {
                    air' == heating - leak * (air - 5.0) - 2.0 * (air - wall)
                    && wall' == (air - wall) / 2.0
                };
                init Warm;
            }
            process Thermostat() {
                state Off { energy' == 0 }, On { energy' == 1 };
                init Off;
                trans Off -> On { guard air <= 18.0; sync now!; assign heating = 30.0; },
                      On -> Off { guard air >= 21.0; sync now!; assign heating = 0.0; };
            }
            process Window() {
                state Closed { ; 1:2 }, Open { ; 4 };
                init Closed;
                trans Closed -> Open { assign leak = 1.5; }, Open -> Closed { assign leak = 0.3; };
            }
            system Room, Thermostat, Window;",
        query: "Pr[<=48](<> energy >= 10)",
        published: None,
    },
    // A polynomial of time, with an equality to be met at each bounce.
    Case {
        name: "ball",
        model: "
            clock p = 10.0, v;
            urgent broadcast chan bounce;
            broadcast chan strike;
            process Ball() {
                state Flying { p' == v && v' == -10.0 };
                init Flying;
                trans Flying -> Flying {
                          guard p == 0.0 && v < 0.0; sync bounce!;
                          assign v = -(0.8 + random(0.12)) * v;
                      },
                      Flying -> Flying {
                          guard p <= 2.0; sync strike?; assign v = 8.0 + 0.6 * fabs(v);
                      };
            }
            process Bat() {
                state Swinging { ; 3 };
                init Swinging;
                trans Swinging -> Swinging { sync strike!; };
            }
            system Ball, Bat;",
        query: "Pr[<=30](<> p >= 17)",
        published: None,
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let runs = match std::env::var("RUNS") {
        Ok(runs) => runs.parse()?,
        Err(_) => RUNS,
    };
    let scratch = Scratch::new()?;
    let program = scratch.compile("benches/flows.c", &[])?;
    for case in &CASES {
        measure(case, &program, runs)?;
    }
    Ok(())
}

fn measure(case: &Case, program: &Path, runs: u64) -> Result<(), Box<dyn Error>> {
    let mut c = Measured::in_c(program, case.name, runs)?;
    let (mut engine, squares) = run(case, runs)?;
    for _ in 1..REPETITIONS {
        let again = Measured::in_c(program, case.name, runs)?;
        c.seconds = c.seconds.min(again.seconds);
        engine.seconds = engine.seconds.min(run(case, runs)?.0.seconds);
    }
    let (ours, theirs) = engine.shares(&c, case.name, runs);
    let count = runs as f64;
    let [moves, moves_c] = [&engine, &c].map(|measured| measured.mean_moves(runs));
    let variance = squares / count - moves * moves;
    assert!(
        (moves - moves_c).abs() <= DEVIATIONS * (2.0 * variance / count).sqrt(),
        "{}: a run has {moves} moves here and {moves_c} in C",
        case.name
    );
    let (micros, micros_c) = (engine.seconds / count * 1e6, c.seconds / count * 1e6);
    println!(
        "{:9} {ours:.4} (C {theirs:.4})  {moves:5.1} moves a run  C {micros_c:7.1} us a run  \
         engine {micros:7.1} us a run, {:6.2} us a move ({:5.2} x C)",
        case.name,
        micros / moves,
        micros / micros_c,
    );
    if let Some((published, of)) = case.published {
        println!(
            "          {:.0} times faster than the {:.0} ms of {of}",
            published / micros,
            published / 1e3
        );
    }
    Ok(())
}

/// Makes the runs, and gives the sum of the squares of their moves too; compiling the model is not
/// measured.
fn run(case: &Case, runs: u64) -> Result<(Measured, f64), Box<dyn Error>> {
    let (network, query) = load(case.model, case.query)?;
    let jit = Jit::new(&network.functions, &network.constants)?;
    let Statistical::Probability(bound, path) = &query else {
        panic!("{query:?} asks for a probability");
    };
    let mut runner = Runner::new(&network, &jit);
    let (mut satisfied, mut moves, mut squares) = (0, 0, 0.0);
    let begin = Instant::now();
    for run in 0..runs {
        let outcome = runner
            .observe(RunId { seed: 1, run }, bound, Asked::Path(path))
            .map_err(|failure| format!("{}: run {run} fails: {failure:?}", case.name))?;
        satisfied += u64::from(outcome.value != 0.0);
        moves += outcome.moves;
        squares += (outcome.moves as f64).powi(2);
    }
    let measured = Measured {
        satisfied,
        moves: Some(moves),
        seconds: begin.elapsed().as_secs_f64(),
    };
    Ok((measured, squares))
}
