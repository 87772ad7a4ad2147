//! Runs as code of the network against runs that are made move by move: the same, bit by bit,
//! whether the code is compiled or interpreted.
//!
//! `NETWORKS=500 cargo test --release --test stochastic race_code::` tries more random networks.

use checker::engine::{CodeEngine, Options};
use checker::exec::{Executor, Interpreter, Jit};
use checker::ir::{Asked, Network};
use checker::learning::Learning;
use checker::stochastic::{
    Behaviour, Chooser, Chosen, Failure, Guidance, Moment, RunId, Runner, StateView,
};

use crate::checks;
use crate::networks::generate::{Family, network};
use crate::random::Random;
use crate::{StatisticalQuery, load};

/// The runs that are compared of a model.
const RUNS: u64 = 24;

/// The result of a run, its time and its moves, doubles as bits.
type Shown = [u64; 3];

/// Decides at random, and keeps what it was asked.
struct Wanderer {
    sees_time: bool,
    asked: Vec<Question>,
    /// Whether something has happened since it was asked.
    is_renewed: bool,
}

/// What was asked: which moves are possible, whether to wait is, when that was, and whether
/// something had happened before.
type Question = (Vec<u32>, bool, u64, bool);

impl Chooser for Wanderer {
    fn begin(&mut self) {
        self.asked.clear();
        self.is_renewed = false;
    }

    fn renew(&mut self) {
        self.is_renewed = true;
    }

    fn sees_time(&self) -> bool {
        self.sees_time
    }

    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        let time = moment.time.to_bits();
        let moves = moment.moves.to_vec();
        let is_renewed = std::mem::take(&mut self.is_renewed);
        self.asked.push((moves, moment.may_wait, time, is_renewed));
        let count = moment.moves.len() as u32;
        let mut stream = state.stream();
        let drawn = stream.below(count + 2) as usize;
        Ok(if !moment.may_wait || drawn < count as usize {
            Chosen::Move(drawn % count as usize)
        } else if stream.below(2) == 0 {
            Chosen::Draw
        } else {
            Chosen::Wait(3.0 * stream.uniform())
        })
    }
}

/// Who decides: none, or somebody who sees clocks or does not.
#[derive(Clone, Copy)]
enum Decides {
    Nobody,
    Wanderer { sees_time: bool },
}

impl Guidance for Decides {
    fn chooser(&self) -> Box<dyn Chooser> {
        let Decides::Wanderer { sees_time } = *self else {
            unreachable!("nobody decides")
        };
        Box::new(Wanderer {
            sees_time,
            asked: Vec::new(),
            is_renewed: false,
        })
    }
}

impl Decides {
    fn runner<'a>(&'a self, network: &'a Network, executor: &'a dyn Executor) -> Runner<'a> {
        let behaviour = Behaviour::new(network, executor);
        match self {
            Decides::Nobody => Runner::of(behaviour),
            Decides::Wanderer { .. } => Runner::of(Behaviour {
                guidance: Some(self),
                ..behaviour
            }),
        }
    }
}

fn asked(query: &StatisticalQuery) -> Asked<'_> {
    let asked = query.kind.asked();
    asked.unwrap_or_else(|| panic!("{} has no runs to compare", query.text))
}

/// How a run ends.
fn end(runner: &mut Runner<'_>, query: &StatisticalQuery, run: u64) -> Result<Shown, Failure> {
    let outcome = runner.observe(RunId { seed: 3, run }, query.kind.bound(), asked(query))?;
    let (value, time) = (outcome.value.to_bits(), outcome.time.to_bits());
    Ok([value, time, outcome.moves])
}

/// What who decides was asked in the run that has ended.
fn questions<'r>(runner: &'r mut Runner<'_>) -> Option<&'r [Question]> {
    let wanderer: &mut Wanderer = runner.chooser()?;
    Some(&wanderer.asked)
}

/// Writes the runs of a query as code; returns whether there is code.
fn write(runner: &mut Runner<'_>, query: &StatisticalQuery) -> bool {
    runner.write_runs(query.kind.bound(), asked(query))
}

/// Compares runs; returns how many were made by code, or `None` if there is none.
fn compare(model: &str, query: &str, runs: u64) -> Option<u64> {
    compare_under(model, query, runs, Decides::Nobody)
}

/// The same where somebody decides.
fn compare_under(model: &str, query: &str, runs: u64, decides: Decides) -> Option<u64> {
    let (network, query) = load(model, query).unwrap_or_else(|message| panic!("{message}"));
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let jit = Jit::new(&network.functions, &network.constants).expect("it can be compiled");
    let executors: [&dyn Executor; 2] = [&interpreter, &jit];
    let mut known = decides.runner(&network, &interpreter);
    let mut written = executors.map(|executor| decides.runner(&network, executor));
    if !written.iter_mut().all(|runner| write(runner, &query)) {
        return None;
    }
    for run in 0..runs {
        let expected = end(&mut known, &query, run);
        for (number, runner) in written.iter_mut().enumerate() {
            let found = end(runner, &query, run);
            assert_eq!(
                questions(runner),
                questions(&mut known),
                "run {run}, executor {number}\n{}\n{model}",
                query.text
            );
            assert_eq!(
                format!("{found:?}"),
                format!("{expected:?}"),
                "run {run}, executor {number}\n{}\n{model}",
                query.text
            );
        }
    }
    let counts = written.map(|runner| runner.written_runs());
    assert_eq!(counts[0], counts[1], "both give up the same runs");
    Some(counts[0])
}

/// All runs of a model are made by code, and are the same.
fn all_are_written(model: &str, query: &str) {
    assert_eq!(compare(model, query, RUNS), Some(RUNS), "{query}\n{model}");
}

fn check_random_networks(family: Family) {
    let networks = std::env::var("NETWORKS")
        .map_or(8, |number| number.parse::<u64>().expect("it is a number"));
    let mut random = Random(0xc0de);
    let (mut written, mut models) = (0, 0);
    for _ in 0..networks {
        let (net, query) = network(&mut random, family);
        if let Some(runs) = compare(&net.text(), &query.text(), RUNS) {
            models += 1;
            written += runs;
        }
    }
    assert!(
        models * 4 >= networks && written * 2 >= models * RUNS,
        "{family:?}: {written} runs of {models} models"
    );
}

#[test]
fn random_networks_with_rates_make_the_same_runs() {
    check_random_networks(Family::Exponential);
}

#[test]
fn random_networks_with_bounds_make_the_same_runs() {
    check_random_networks(Family::Timed);
}

#[test]
fn random_networks_that_tick_make_the_same_runs() {
    check_random_networks(Family::Ticking);
}

/// The same model in which the environment owns every second edge.
fn shared(model: &str) -> String {
    let mut parts = model.split(" -> ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for (number, part) in parts.enumerate() {
        text += if number % 2 == 0 { " -> " } else { " -u-> " };
        text += part;
    }
    text
}

#[test]
fn who_decides_is_asked_the_same() {
    let networks = std::env::var("NETWORKS")
        .map_or(12, |number| number.parse::<u64>().expect("it is a number"));
    for family in [Family::Exponential, Family::Timed, Family::Ticking] {
        for sees_time in [false, true] {
            let mut random = Random(0xdec1);
            let (mut written, mut models) = (0, 0);
            for _ in 0..networks {
                let (net, query) = network(&mut random, family);
                let model = shared(&net.text());
                let decides = Decides::Wanderer { sees_time };
                if let Some(runs) = compare_under(&model, &query.text(), RUNS, decides) {
                    models += 1;
                    written += runs;
                }
            }
            assert!(
                models * 4 >= networks && written * 2 >= models * RUNS,
                "{family:?}: {written} runs of {models} models"
            );
        }
    }
}

/// A courier who may wait for a bus, whose coming he sees by a clock, or walk; on the way he
/// decides in a committed location, where somebody else can move, too.
const COURIER: &str = "
    double cost;
    clock time;
    int[0, 9] detours;
    broadcast chan come;
    process Bus() {
        clock x;
        state Away { x <= 20 }, Here { x <= 3 };
        init Away;
        trans Away -u-> Here { sync come!; assign x = 0; },
              Here -u-> Away { assign x = 0; };
    }
    process Courier() {
        clock since;
        state Waits { since <= 18 }, Asks, Rides { since <= 5 }, Walks { since <= 12 }, Home;
        commit Asks;
        init Waits;
        trans Waits -u-> Asks { sync come?; },
              Waits -> Walks { assign cost = cost + since, since = 0; },
              Asks -> Rides { assign cost = cost + since + 1, since = 0; },
              Asks -> Walks { assign cost = cost + since, since = 0; },
              Walks -u-> Walks { guard detours < 9 && since >= 1; assign detours++; },
              Walks -u-> Home { guard since >= 6; assign cost = cost + since + detours; },
              Rides -u-> Home { guard since >= 5; assign cost = cost + since; };
    }
    Runner = Courier();
    system Bus, Runner;";

#[test]
fn the_same_is_learned_from_code() {
    for query in [
        "strategy S = minE(cost)[<=60]: <> Runner.Home",
        "strategy S = minE(cost)[<=60]{}->{Runner.since}: <> Runner.Home",
        "strategy S = maxPr[<=11]: <> Runner.Home",
        "strategy S = minE(time)[#<=12]: <> Runner.Home",
    ] {
        let learned = [CodeEngine::Jit, CodeEngine::Interpreter].map(|code| {
            let options = Options {
                code,
                learning: Learning {
                    iterations: 2,
                    learning_runs: Some(40),
                    judging_runs: Some(20),
                    ..Learning::default()
                },
                ..Options::default()
            };
            let model = &mut checks::load(COURIER);
            let answer = checks::try_ask(model, query, &options)
                .unwrap_or_else(|refused| panic!("{query}\n{}", refused.rendered.join("\n")));
            let strategy = answer.evidence.learned.expect("a strategy is learned");
            (answer.estimate, strategy.regressors.clone())
        });
        assert_eq!(learned[0], learned[1], "{query}");
    }
}

/// Windows that overlap, touch and leave gaps, with and without an invariant, some of one moment.
const WINDOWS: &str = "
    clock g;
    double at = 2.5;
    int[0, 30] n = 0;
    process P(const int k) {
        clock x, y;
        state A { x <= 7 }, B { ; 1 + k }, C { x <= 3 + n && y < 20 }, D { ; 2.0 / (1 + n) };
        init A;
        trans A -> B { guard x >= 1 && x <= 2; assign x = 0; },
              A -> C { guard x >= 4 && x < 5 && g > 1; assign x = 0, y = 0; },
              A -> A { guard x > at && x <= 4.25 && n < 30; assign x = 0, n = n + 1; },
              A -> D { guard x == 6; },
              B -> A { guard x >= 2 && x <= 3; assign x = 0; },
              B -> A { guard x >= 2.5 && y >= 1; assign x = 0, y = 0; },
              B -> D { guard x == 1; assign x = 0.5; },
              C -> A { guard x == 2; assign x = 0; },
              C -> B { guard x == 3; assign x = 0; },
              D -> A { assign x = 0, n = n / 2; },
              D -> D { guard n < 3; assign n = n + 1; };
    }
    P1 = P(0); P2 = P(1); P3 = P(3);
    system P1, P2, P3;";

#[test]
fn delays_in_windows_are_the_same() {
    all_are_written(WINDOWS, "Pr[<=200](<> n == 9)");
    all_are_written(WINDOWS, "Pr[<=30]([] n < 4 || P2.A)");
    all_are_written(WINDOWS, "Pr[<=50](!P1.D U P3.C)");
    all_are_written(WINDOWS, "E[<=40; 9](max: n - 3)");
    all_are_written(WINDOWS, "E[<=40; 9](min: P1.B ? -n : n)");
}

#[test]
fn conditions_on_clocks_are_decided_at_the_same_moments() {
    for query in [
        "Pr[<=30](<> P1.x > 6.5 && P2.B)",
        "Pr[<=30](<> g >= 12 && g <= 12.5 && (P1.A || P2.x == 1))",
        "Pr[<=30]([] P1.x <= 6.5 || n < 3)",
        "Pr[<=30](P1.x < 6.9 && g != 17 U P3.C && g > 10)",
        "Pr[<=8](<> g == 8)",
        "Pr[<=8]([] g < 8)",
    ] {
        all_are_written(WINDOWS, query);
    }
    let runs = compare(MEETINGS, "Pr[<=100](<> Listener(1).x > 9)", RUNS);
    assert!(runs.is_some_and(|runs| runs > RUNS / 2), "{runs:?}");
}

/// Clocks that stand still, run backwards, or at rates that depend on variables of others.
const RATES: &str = "
    clock work, cost;
    int[0, 4] load = 1;
    broadcast chan done;
    process Pump() {
        clock x;
        state Off { work' == 0 && x <= 6 },
              On { work' == load && work <= 12; 1 },
              Back { work' == -2 && work >= 1 && x <= 9 };
        init Off;
        trans Off -> On { guard x >= 2; assign work = 0; },
              On -> Back { guard work >= 4 && work <= 10; sync done!; assign x = 0; },
              On -> Off { guard work == 11; assign x = 0; },
              Back -> Off { guard work <= 3; assign x = 0; };
    }
    process Load() {
        state A { ; 2 }, B { cost' == load + 0.5 && cost <= 20 };
        init A;
        trans A -> A { guard load < 4; assign load = load + 1; },
              A -> B { guard load >= 2; assign cost = 0; },
              B -> A { guard cost >= 10; assign cost = -1.5, load = 0; },
              B -> B { guard load > 0 && cost >= 3; sync done?; assign load = load - 1; };
    }
    system Pump, Load;";

#[test]
fn clocks_with_rates_are_the_same() {
    for query in [
        "Pr[<=60](<> Pump.Back && Load.B && load == 4)",
        "Pr[<=40]([] work < 9 || cost < 12)",
        "Pr[<=90](<> work == 0 && cost > 4)",
        "E[<=50; 9](max: load * 2)",
    ] {
        let runs = compare(RATES, query, RUNS);
        assert!(
            runs.is_some_and(|runs| runs > RUNS / 2),
            "{query}: {runs:?}"
        );
    }
}

/// Arrays of channels whose numbers are computed on both sides, several inputs of one process,
/// branches with weights, committed and urgent locations of several processes.
const MEETINGS: &str = "
    const int N = 3;
    broadcast chan call[N], tell;
    urgent broadcast chan hurry;
    int[0, N - 1] turn = 0;
    int[0, 50] heard = 0;
    int weight = 1;
    int next(int one) { return (one + 1) % N; }
    process Caller(const int[0, N - 1] id) {
        state Idle { ; 3 }, Chosen, Told, Ready { ; 1:2 };
        commit Chosen;
        urgent Told;
        init Idle;
        trans Idle -> Chosen { sync call[next(turn)]!; assign turn = id; },
              Chosen -> Told { guard heard < 50; sync tell!; assign weight = 1 + heard % 3; },
              Chosen -> Idle { guard heard >= 10; assign heard = 0; },
              Told -> Ready { },
              Told -> Idle { guard turn == id; },
              Ready -> Idle { guard heard % 2 == 1; sync hurry!; };
    }
    process Listener(const int[0, N - 1] id) {
        clock x;
        state Wait, Answer { x <= 4 }, Lost { ; 5 }, Stuck;
        urgent Stuck;
        branchpoint Fork;
        init Wait;
        trans Wait -> Answer { sync call[id]?; assign x = 0; },
              Wait -> Lost { guard turn != id; sync call[next(turn)]?; },
              Wait -> Wait {
                  select e : int[0, 2]; guard e <= id && heard < 50; sync tell?;
                  assign heard = heard + 1;
              },
              Answer -> Fork { guard x >= 1; },
              Fork -> Wait { probability weight; },
              Fork -> Lost { assign x = 0; probability 2; },
              Fork -> Stuck { probability 1; },
              Stuck -> Wait { sync tell?; },
              Lost -> Wait { };
    }
    system Caller, Listener;";

#[test]
fn meetings_are_the_same() {
    // Where all wait in urgent locations, time is locked, which the race says.
    for query in [
        "Pr[<=100](<> heard == 12)",
        "Pr[<=20]([] heard < 9)",
        "E[<=20; 9](max: heard + weight)",
    ] {
        let runs = compare(MEETINGS, query, RUNS);
        assert!(
            runs.is_some_and(|runs| runs > RUNS / 2),
            "{query}: {runs:?}"
        );
    }
}

#[test]
fn long_runs_are_the_same() {
    let model = "
        clock x;
        int[0, 9999] n = 0;
        process P() {
            clock y;
            state A { y <= 3 };
            init A;
            trans A -> A { guard y >= 1; assign y = 0, n = (n + 7) % 10000; };
        }
        process Q() {
            state A { ; 2 };
            init A;
            trans A -> A { guard x >= 3; assign x = 0; }, A -> A { guard n % 3 == 0; };
        }
        system P, Q;";
    let runs = compare(model, "Pr[<=20000](<> n == 9999 && P.A && Q.A)", 4);
    assert_eq!(runs, Some(4));
}

/// What is rare or goes wrong is left to the race, and ends as it ends there.
#[test]
fn failures_are_those_of_the_race() {
    let model = |rest: &str| {
        format!(
            "int n = 0; clock x; broadcast chan c;
            process P() {{ state A {{ ; 2 }}; init A; trans A -> A {{ sync c!; assign n++; }}; }}
            process Q() {{ {rest} }}
            system P, Q;"
        )
    };
    for rest in [
        // Time is locked at 2, unless `c` comes before.
        "state A { x <= 2 }, B; init A; trans A -> B { sync c?; };",
        // No rate.
        "state A; init A; trans A -> A { guard n == 3; };",
        // An invariant that breaks.
        "state A { n < 4 }; init A; trans A -> A { guard n < 0; };",
        // A division by zero.
        "state A { ; 1 }; init A; trans A -> A { guard 6 / (n - 4) > 2; };",
        // A rate that is none.
        "state A { ; 3 - n }; init A; trans A -> A { };",
        // Weights that are none.
        "state A { ; 1 }; branchpoint B; init A;
         trans A -> B { }, B -> A { probability 3 - n; }, B -> A { probability 3 - n; };",
        // Two in urgent locations, of which one waits.
        "state A, B; urgent A; init A; trans A -> B { sync c?; };",
    ] {
        let runs = compare(&model(rest), "Pr[<=4](<> n == 9)", RUNS);
        assert!(runs.is_some(), "{rest}");
    }
}

#[test]
fn what_the_code_does_not_know_is_left_to_the_race() {
    let model = |global: &str, rest: &str| {
        format!(
            "int n = 0; clock x; {global}
            process P() {{ state A {{ ; 2 }}; init A; trans A -> A {{ assign n++; }}; }}
            process Q() {{ {rest} }}
            system P, Q;"
        )
    };
    let binary = "state A { ; 1 }; init A; trans A -> A { sync c!; }, A -> A { sync c?; };";
    let rated = "state A { x' == y && y' == 1 }; init A;";
    let split = "state A { ; 1 }; init A; trans A -> A { guard x <= 1 || x >= 2; };";
    for (global, rest) in [("chan c;", binary), ("clock y;", rated), ("", split)] {
        let model = model(global, rest);
        assert_eq!(compare(&model, "Pr[<=4](<> n == 9)", 1), None, "{rest}");
    }
    let model = model("", "state A; init A;");
    assert_eq!(compare(&model, "Pr[<=4](<> x * x >= 2)", 1), None);
    assert_eq!(compare(&model, "E[<=4; 9](max: x)", 1), None);
    assert_eq!(compare(&model, "Pr[x<=4](<> n == 9)", 1), None);
}
