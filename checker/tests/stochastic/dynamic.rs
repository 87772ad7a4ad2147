//! Dynamic templates: populations against closed forms, and that runs do not depend on how many
//! slots there are.

use checker::diagnostics::SourceMap;
use checker::engine::{CodeEngine, LoadedModel, Options};
use checker::exec::{Interpreter, Libraries};
use checker::ir::{Asked, QueryKind, Statistical};
use checker::semantics::{self, Reading};
use checker::stochastic::{Outcome, Precision, RunId, Runner};
use checker::syntax;

use super::{executors, expect, load};

/// Everybody makes one more at rate 1; there is one at the beginning.
const YULE: &str = "
    dynamic P();
    process P() { state a { ; 1 }; init a; trans a -> a { assign spawn P(); }; }
    process Init() { state s, done; commit s; init s; trans s -> done { assign spawn P(); }; }
    system Init;";

/// Everybody makes one more at rate 1, and dies at rate 2; there is one at the beginning.
const BIRTHS_AND_DEATHS: &str = "
    dynamic P();
    process P() {
        state a { ; 3 };
        branchpoint b;
        init a;
        trans a -> b { },
            b -> a { assign spawn P(); probability 1; },
            b -> a { assign exit(); probability 2; };
    }
    process Init() { state s, done; commit s; init s; trans s -> done { assign spawn P(); }; }
    system Init;";

/// The estimate of 20,000 runs and half the width of its interval, or why there is none.
fn estimate(model: &str, query: &str, code: CodeEngine) -> Result<(f64, f64), String> {
    let rejected = |error: checker::engine::Rejection| error.rendered.join("\n");
    let mut model = LoadedModel::load("model.xta", model.as_bytes()).map_err(rejected)?;
    let query = model.add_query(query);
    let options = Options {
        code,
        precision: Precision {
            alpha: 1e-6,
            runs: Some(20_000),
            ..Precision::default()
        },
        ..Options::default()
    };
    let answer = model.check(&query, &options).map_err(rejected)?;
    let estimate = answer.estimate.ok_or("no estimate")?;
    Ok((estimate.value, (estimate.upper - estimate.lower) / 2.0))
}

#[track_caller]
fn expect_near(model: &str, query: &str, value: f64) {
    let (found, margin) = match estimate(model, query, CodeEngine::Jit) {
        Ok(found) => found,
        Err(text) => panic!("{text}"),
    };
    assert!(
        (found - value).abs() <= margin,
        "{query}: {found} instead of {value}, more than {margin} apart"
    );
}

#[track_caller]
fn refused(model: &str, query: &str, words: &[&str]) {
    match estimate(model, query, CodeEngine::Jit) {
        Ok(found) => panic!("{query}: {found:?}"),
        Err(text) => {
            for word in words {
                assert!(text.contains(word), "no {word} in\n{text}");
            }
        }
    }
}

#[test]
fn a_population_without_deaths_is_geometric() {
    let (grows, stays) = (1.0 - (-2.0_f64).exp(), (-2.0_f64).exp());
    // That there are five has the probability that four are made.
    expect(YULE, "Pr[<=2](<> numOf(P) >= 5)", grows.powi(4));
    // For this mean the pool must grow.
    expect_near(YULE, "E[<=2;20000](max: numOf(P) + 0.0)", 1.0 / stays);
}

#[test]
fn births_and_deaths_leave_nobody_as_often_as_they_must() {
    let (birth, death, time) = (1.0_f64, 2.0_f64, 1.5_f64);
    let shrinks = ((birth - death) * time).exp();
    let extinct = death * (shrinks - 1.0) / (birth * shrinks - death);
    let query = "Pr[<=1.5](<> Init.done && numOf(P) == 0)";
    let query = query.replace("1.5", "3");
    let model = BIRTHS_AND_DEATHS.replace("; 3 }", "; 1.5 }");
    expect_near(&model, &query, extinct);
    // Of everybody who was there at a moment, `sum` finds as many as the counter counts.
    let same = "Pr[<=3](<> numOf(P) != sum(c : P) 1)";
    expect_near(&model, same, 0.0);
    expect_near(&model, "Pr[<=3]([] forall (c : P) c.a)", 1.0);
}

#[test]
fn instances_have_their_own_arguments_variables_and_clocks() {
    let model = "
        typedef struct { int a; int b; } pair_t;
        dynamic T(int n, const double d, pair_t p, bool late);
        process T(int n, const double d, pair_t p, bool late) {
            int seen = 7;
            clock x;
            state wait { x <= 4 }, done;
            init wait;
            trans wait -> done { guard x >= 2 && !late; assign n++, seen += p.b; };
        }
        process Init() {
            pair_t pair = { 1, 20 };
            state s, t, done;
            commit s, t;
            init s;
            trans s -> t { assign spawn T(10, 0.5, pair, false), pair.b = 30; },
                t -> done { assign spawn T(100, 0.25, pair, true); };
        }
        system Init;";
    let always = |query: &str, probability: f64| expect(model, query, probability);
    always("Pr[<=3](<> exists (c : T) c.done)", 0.5);
    always(
        "Pr[<=4](<> exists (c : T) c.done && c.n == 11 && c.seen == 27)",
        1.0,
    );
    always("Pr[<=4](<> exists (c : T) c.late && c.done)", 0.0);
    always(
        "Pr[<=1](<> Init.done && (sum(c : T) c.n) == 110 && (sum(c : T) c.d) == 0.75)",
        1.0,
    );
    always("Pr[<=1](<> exists (c : T) c.p.b == 30 && c.n == 100)", 1.0);
    always("Pr[<=2](<> exists (c : T) c.x >= 2.5)", 0.0);
    always("Pr[<=3](<> exists (c : T) c.x >= 2.5)", 1.0);
    always("Pr[<=3]([] forall (c : T) c.x <= 2.5)", 0.0);
    always("Pr[<=1](<> (sum(c : T) c.x) >= 1.5)", 1.0);
    always("Pr[<=1](<> exists (c : T) c.location == 1)", 0.0);
}

#[test]
fn channels_are_passed_by_reference() {
    let model = "
        broadcast chan go[3], stop, pair[2];
        int heard[3], stopped, paired;
        dynamic Sender(broadcast chan &c);
        dynamic Pair(broadcast chan &c[2]);
        process Sender(broadcast chan &c) {
            state a { ; 100 }, b; init a; trans a -> b { sync c!; };
        }
        process Pair(broadcast chan &c[2]) {
            state a { ; 100 }, b; init a; trans a -> b { sync c[1]!; };
        }
        process Hears(const int[0,2] i) {
            state a; init a; trans a -> a { sync go[i]?; assign heard[i]++; };
        }
        process Stops() {
            state a; init a;
            trans a -> a { sync stop?; assign stopped++; }, a -> a { sync pair[1]?; assign paired++; };
        }
        process Init() {
            int[0,2] which = 2;
            state s, t, u, done;
            commit s, t, u;
            init s;
            trans s -> t { assign spawn Sender(go[which]); },
                t -> u { assign spawn Sender(stop); },
                u -> done { assign spawn Pair(pair); };
        }
        system Init, Hears, Stops;";
    expect(
        model,
        "Pr[<=9](<> heard[2] == 1 && stopped == 1 && paired == 1)",
        1.0,
    );
    expect(
        model,
        "Pr[<=9](<> heard[0] + heard[1] > 0 || heard[2] > 1)",
        0.0,
    );
}

#[test]
fn runs_do_not_depend_on_the_number_of_slots() {
    let outcomes = |pool: u32| -> Vec<Outcome> {
        let mut sources = SourceMap::default();
        let prelude = syntax::prelude(&mut sources);
        let text = BIRTHS_AND_DEATHS.as_bytes();
        let parsed = syntax::read_model("model.xta", text, &mut sources);
        let (model, _) = semantics::analyse(
            &parsed.document,
            &prelude,
            &sources,
            Reading::Stochastic,
            &Libraries::default(),
            pool,
        );
        let mut model = model.expect("the model is right");
        let span = syntax::add_query_text("Pr[<=1](<> numOf(P) >= 4)", &mut sources);
        let (query, _) = syntax::parse_query(span, &sources);
        let query = query.expect("the query is right");
        let (query, _) = model.compile_query(&query, &sources, &[]);
        let query = query.expect("the query is right");
        let QueryKind::Statistical(asked) = &query.kind else {
            panic!("it is a statistical query");
        };
        let Statistical::Probability(bound, path) = &**asked else {
            panic!("it asks for a probability");
        };
        let network = &model.network;
        let interpreter = Interpreter::new(&network.functions, &network.constants);
        let mut runner = Runner::new(network, &interpreter);
        let runs = 0..200;
        runs.map(|run| {
            runner
                .observe(RunId { seed: 5, run }, bound, Asked::Path(path))
                .expect("no run fails")
        })
        .collect()
    };
    let few = outcomes(6);
    assert!(few.iter().any(|one| one.value != 0.0) && !few.iter().all(|one| one.value != 0.0));
    assert_eq!(few, outcomes(16));
    assert_eq!(few, outcomes(33));
}

#[test]
fn both_engines_give_the_same() {
    let query = "E[<=1;20000](max: numOf(P) + 0.0)";
    let of = |code| estimate(BIRTHS_AND_DEATHS, query, code).expect("no run fails");
    assert_eq!(of(CodeEngine::Interpreter), of(CodeEngine::Jit));
}

#[test]
fn spawning_without_end_is_found() {
    let model = YULE.replace("; 1 }", "; 100 }");
    let words = [
        "E0806",
        "more than",
        "instances of 'P'",
        "spawn seems to have no end",
    ];
    refused(&model, "Pr[<=10](<> numOf(P) < 0)", &words);
}

#[test]
fn misuse_is_refused() {
    let child = "dynamic T(int n); process T(int n) { state a { ; 1 }; init a; trans a -> a { }; }";
    let parent = |update: &str| {
        format!("process P() {{ state a {{ ; 1 }}; init a; trans a -> a {{ assign {update}; }}; }}")
    };
    let query = "Pr[<=1](<> P.a)";
    for (model, code) in [
        (format!("{child} {} system P;", parent("exit()")), "E0297"),
        (
            format!("{child} {} system P;", parent("spawn P()")),
            "E0297",
        ),
        (
            format!("{child} {} system P;", parent("spawn T()")),
            "E0233",
        ),
        (
            format!("{child} {} system P;", parent("spawn T(0.5)")),
            "E0224",
        ),
        (
            format!("dynamic T(); {} system P;", parent("spawn T()")),
            "E0297",
        ),
        (
            format!(
                "{} system P, T;",
                child.replace("int n", "int[0,3] n") + &parent("spawn T(1)")
            ),
            "E0297",
        ),
        (
            format!(
                "{} {} system P;",
                child.replacen("int n", "bool n", 1),
                parent("spawn T(1)")
            ),
            "E0297",
        ),
        (
            format!(
                "{child} int n; {} system P;",
                parent("n = forall (c : T) c.a")
            ),
            "E0297",
        ),
    ] {
        refused(&model, query, &[code]);
    }
    let model = format!("{child} {} system P;", parent("spawn T(1)"));
    refused(
        &model,
        "Pr[<=1](<> numOf(P) > 1)",
        &["E0297", "no dynamic template"],
    );
    refused(&model, "Pr[<=1](<> exists (c : T) c.missing)", &["E0266"]);
    refused(&model, "E<> P.a", &["E0298", "only statistical queries"]);
}

#[test]
fn foreach_shows_the_places_of_instances() {
    let model = BIRTHS_AND_DEATHS;
    let query =
        "simulate[<=3; 20]{numOf(P), foreach (p : P) p.a, foreach (p : P) (p.a ? 2.5 : 7.0)}";
    let (network, query) = load(model, query).unwrap_or_else(|message| panic!("{message}"));
    let Statistical::Simulation(asked) = &query.kind else {
        panic!("{} shows runs", query.text);
    };
    let places = (asked.items.len() - 1) / 2;
    assert!(places > 1);
    assert_eq!(asked.items[1].text, "p.a for p = 0");
    let [interpreter, jit] = executors(&network);
    let mut most = 0.0_f64;
    for executor in [interpreter, jit] {
        let mut runner = Runner::new(&network, &*executor);
        for run in 0..20 {
            let trajectory = runner
                .trajectory(RunId { seed: 1, run }, asked)
                .expect("there is room");
            let at = |row: usize, time: f64| {
                let points = trajectory.points[row].iter();
                points
                    .rev()
                    .find(|point| point.0 <= time)
                    .map_or(0.0, |point| point.1)
            };
            let times = trajectory.points[0].iter().map(|point| point.0);
            for time in times.chain([3.0]) {
                let count = at(0, time);
                most = most.max(count);
                let there: f64 = (1..=places).map(|row| at(row, time)).sum();
                let values: f64 = (1..=places).map(|row| at(places + row, time)).sum();
                assert!((there - count).abs() < 1e-12, "run {run}, {time}");
                // Who is nowhere is worth 0, not 7.
                assert!((values - 2.5 * count).abs() < 1e-12, "run {run}, {time}");
            }
        }
    }
    assert!(most >= 2.0);
}

#[test]
fn foreach_shows_the_values_of_a_range() {
    let model = "int n = 1; process P() { state a { ; 1 }; init a; } system P;";
    let query = "simulate[<=1; 1]{foreach (i : int[2,4]) 10 * i + n, n}";
    let (network, query) = load(model, query).unwrap_or_else(|message| panic!("{message}"));
    let Statistical::Simulation(asked) = &query.kind else {
        panic!("{} shows runs", query.text);
    };
    let [interpreter, _] = executors(&network);
    let mut runner = Runner::new(&network, &*interpreter);
    let trajectory = runner
        .trajectory(RunId { seed: 1, run: 0 }, asked)
        .expect("nothing fails");
    let last = trajectory
        .points
        .iter()
        .map(|points| points.last().map(|one| one.1));
    let last: Vec<Option<f64>> = last.collect();
    assert_eq!(last, [Some(21.0), Some(31.0), Some(41.0), Some(1.0)]);
    let too_many = load(model, "simulate[<=1; 1]{foreach (i : int[0,4096]) i}");
    let message = too_many.map(|_| ()).unwrap_err();
    assert!(message.contains("E0209"), "{message}");
}
