//! Models and queries that are wrong, as a user sees them: each is answered within its limits, with
//! the place, the cause, and what to do.

use std::time::Duration;

use checker::engine::{CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::stochastic::Precision;

use super::joint;
use crate::checks::{load, try_ask};

fn options(timeout: Option<Duration>) -> Options {
    Options {
        code: CodeEngine::Interpreter,
        limits: Limits {
            timeout,
            ..Limits::default()
        },
        precision: Precision {
            threads: 2,
            ..Precision::default()
        },
        threads: 2,
        ..Options::default()
    }
}

/// Checks that a query is refused by one message that has these words, a place and help.
#[track_caller]
fn refused(model: &str, query: &str, words: &[&str]) {
    let message = match LoadedModel::load("model.xta", model.as_bytes()) {
        Err(rejection) => rejection,
        Ok(mut model) => match try_ask(&mut model, query, &options(None)) {
            Err(rejection) => rejection,
            Ok(answer) => panic!("{query} is answered: {:?}", answer.verdict),
        },
    };
    let [message] = &message.rendered[..] else {
        panic!("one message is enough: {:?}", message.rendered);
    };
    let place = ["model.xta:", "query:"];
    assert!(
        place.iter().any(|one| message.starts_with(one)),
        "{message}"
    );
    for word in words.iter().chain(&["error[E", "hint: "]) {
        assert!(message.contains(word), "{word} is not said: {message}");
    }
}

/// Checks that a query ends by its time limit.
#[track_caller]
fn stopped(model: &str, query: &str) -> checker::engine::Answer {
    let options = options(Some(Duration::from_millis(100)));
    let answer = try_ask(&mut load(model), query, &options);
    let answer = answer.unwrap_or_else(|one| panic!("{}", one.rendered.join("\n")));
    let is_stopped = matches!(answer.verdict, Verdict::Unknown(_));
    assert!(is_stopped, "{query}: {:?}", answer.verdict);
    answer
}

/// A process that leaves a location at a rate, behind declarations.
fn leaving(declarations: &str, rate: &str) -> String {
    format!(
        "{declarations}
         process P() {{ state a {{ ; {rate} }}, b; init a; trans a -> b {{ }}; }}
         system P;"
    )
}

/// A process that updates at once.
fn updating(declarations: &str, update: &str) -> String {
    format!(
        "{declarations}
         process P() {{
             state a {{ ; 100 }};
             init a;
             trans a -> a {{ assign {update}; }};
         }}
         system P;"
    )
}

/// A process with two branches of these weights.
fn branching(declarations: &str, weights: [&str; 2]) -> String {
    let [first, second] = weights;
    format!(
        "{declarations}
         process P() {{
             state a {{ ; 100 }}, b;
             branchpoint c;
             init a;
             trans a -> c {{ }}, c -> b {{ probability {first}; }},
                   c -> a {{ probability {second}; }};
         }}
         system P;"
    )
}

const REACHES: &str = "Pr[<=9](<> P.b)";

#[test]
fn rates_that_are_none_are_refused() {
    for (declarations, rate, found) in [
        ("", "0 - 1", "is -1"),
        ("", "0.0 / 0.0", "is NaN"),
        ("", "1.0 / 0.0", "is inf"),
        ("double d = 1e300;", "d * d", "is inf"),
        ("int z = 0;", "3 : z", "is inf"),
    ] {
        let model = leaving(declarations, rate);
        refused(&model, REACHES, &["exponential rate of P.a", found]);
    }
    let model = leaving("int z = 0;", "3 / z");
    refused(&model, REACHES, &["division by zero", "3 / z"]);
    let model = "
        clock x; double d = 0.0;
        process P() { state a { x' == d / d ; 1 }, b; init a; trans a -> b { }; }
        system P;";
    refused(model, "Pr[<=9](<> x > 3)", &["P.a gives a clock a rate"]);
    let model = "
        clock x, y;
        process P() { state a { x' == 1e308 * cos(y * 1e-9) }; init a; }
        system P;";
    refused(model, "Pr[<=9](<> x < 0)", &["P.a gives a clock a rate"]);
    let model = "process P() { state a, b; init a; trans a -> b { }; } system P;";
    refused(model, REACHES, &["P.a can be left at any time"]);
    let model = "
        clock x;
        process P(const int r) { state a { x' == r }; init a; }
        A = P(1); B = P(2);
        system A, B;";
    refused(model, "Pr[<=9](<> x > 3)", &["A.a and B.a set the rate"]);
}

#[test]
fn weights_that_are_none_are_refused() {
    for (weights, found) in [
        (["0", "z"], "all weights behind P.a are 0"),
        (["z - 1", "2"], "a weight behind P.a is negative"),
        (["3 / z", "1"], "division by zero"),
    ] {
        refused(&branching("int z = 0;", weights), REACHES, &[found]);
    }
}

#[test]
fn random_numbers_without_a_distribution_are_refused() {
    for call in [
        "random_normal(0, 0 - 1)",
        "random_poisson(0 - 1)",
        "random_poisson(1e300)",
        "random_beta(0, 0)",
        "random_gamma(0 - 1, 2)",
        "random_weibull(0, 1)",
        "random_tri(3, 1, 2)",
        "random(1e308 * 10)",
        "random_arcsine(3, 1)",
    ] {
        let name = call.split('(').next().unwrap_or(call);
        let model = updating("double v = 0.0;", &format!("v = {call}"));
        refused(&model, "E[<=9; 50](max: v)", &["out of its domain", name]);
    }
    // Numbers that are great, and negative ones, are no mistake.
    let model = updating(
        "double v = 0.0;",
        "v = random_poisson(1e12) + random(0 - 1)",
    );
    let answer = try_ask(&mut load(&model), "Pr[<=9](<> v > 9e11)", &options(None));
    let answer = answer.unwrap_or_else(|one| panic!("{}", one.rendered.join("\n")));
    let estimate = answer.estimate.expect("a probability is estimated");
    assert_eq!(estimate.satisfied_runs, Some(estimate.runs));
}

#[test]
fn updates_that_fail_are_refused() {
    for (declarations, update, found) in [
        ("int[0, 5] n = 0;", "n++", "out of range"),
        ("int n = 0;", "n = 7 / n", "division by zero"),
        ("int list[2]; int n = 0;", "list[n] = 1, n++", "index"),
    ] {
        let model = updating(declarations, update);
        refused(&model, "Pr[<=9](<> false)", &[found]);
    }
}

#[test]
fn time_that_cannot_pass_is_refused() {
    let model = "
        clock x;
        process P() { state a { x <= 3 }, b; init a; trans a -> b { guard x >= 5; }; }
        system P;";
    refused(model, REACHES, &["P.a lets no more time pass"]);
    let model = "
        clock x;
        process P() { state a { x <= 5 }, b { x <= 1 }; init a; trans a -> b { guard x >= 3; }; }
        system P;";
    refused(
        model,
        "Pr[<=9](<> false)",
        &["P.b is entered while its invariant"],
    );
    let model = "process P() { state a, b; urgent a; init a; trans a -> a { }; } system P;";
    refused(model, REACHES, &["take less than", "P.a", "[#<=1000]"]);
    let model = "clock x; process P() { state a { x' == 0 }, b; init a; } system P;";
    refused(
        model,
        "Pr[x<=9](<> P.b)",
        &["the clock that bounds the run stands still"],
    );
}

#[test]
fn bounds_and_runs_that_are_none_are_refused() {
    let model = leaving("clock x; int n = 3;", "1");
    for (query, found) in [
        ("Pr[<=0 - 1](<> P.b)", "cannot be -1"),
        (
            "Pr[n<=9](<> P.b)",
            "bounded by time, by a clock, or by its moves",
        ),
        ("E[<=9; 0](max: x)", "the number of runs cannot be 0"),
    ] {
        refused(&model, query, &[found]);
    }
}

#[test]
fn runs_without_end_are_stopped_by_the_time_limit() {
    let turning = updating("clock x; int n = 0;", "x = 0, n = (n + 1) % 7");
    for query in [
        "Pr[<=1e300](<> n > 9)",
        "Pr[#<=1000000000](<> n > 9)",
        "Pr[x<=9](<> n > 9)",
        "E[#<=1000000000; 5](max: n)",
        "simulate[#<=1000000000]{n}",
    ] {
        let answer = stopped(&turning, query);
        assert!(answer.estimate.is_none(), "no run came to an end");
    }
    let looping = updating("int n = 0; void f() { while (true) n = 1 - n; }", "f()");
    stopped(&looping, "Pr[<=9](<> n > 5)");
    // Queries that are answered together end alike.
    for (model, query) in [
        (&turning, "Pr[<=1e300](<> n > 9)"),
        (&looping, "Pr[<=9](<> n > 5)"),
    ] {
        let mut model = load(model);
        let queries = [query, "Pr[<=9](<> n > 6)"].map(|query| joint(&mut model, query));
        let options = options(Some(Duration::from_millis(100)));
        let answers = model.check_jointly(&queries, &options);
        let answers = answers.unwrap_or_else(|one| panic!("{}", one.rendered.join("\n")));
        let verdicts = answers.iter().map(|answer| answer.verdict);
        assert!(
            verdicts
                .into_iter()
                .all(|one| matches!(one, Verdict::Unknown(_)))
        );
    }
}

#[test]
fn equations_that_need_tiny_steps_are_stopped_by_the_time_limit() {
    // The first clock follows the second one within 1e-12 units of time.
    let model = "
        clock x, y;
        process P() { state a { x' == 1e12 * (sin(y) - x) }; init a; }
        system P;";
    for query in ["Pr[<=9](<> x > 3)", "E[<=9; 5](max: 0)", "simulate[<=9]{x}"] {
        stopped(model, query);
    }
}

#[test]
fn many_runs_are_stopped_by_the_time_limit_with_what_they_say() {
    let model = leaving("int n = 0;", "1");
    for query in [
        "Pr[<=1; 1000000000](<> P.b)",
        "E[<=1; 1000000000](max: P.b)",
    ] {
        let estimate = stopped(&model, query).estimate;
        let estimate = estimate.expect("some runs were made");
        assert!(!estimate.is_complete && estimate.runs > 0);
        let exact = 1.0 - (-1.0_f64).exp();
        // Some 100 runs at least; the interval is that of the runs until then.
        assert!((estimate.value - exact).abs() < 0.3, "{estimate:?}");
    }
}

#[test]
fn many_selected_values_are_counted_one_by_one() {
    let model = "
        int n = 0;
        process P() {
            state a { ; 1 }, b;
            init a;
            trans a -> b { select i : int[0, 255], j : int[0, 255]; assign n = i == j ? 1 : 2; };
        }
        system P;";
    let options = Options {
        precision: Precision {
            runs: Some(50),
            ..Precision::default()
        },
        ..options(None)
    };
    let answer = try_ask(&mut load(model), "Pr[<=100](<> n == 2)", &options);
    let answer = answer.unwrap_or_else(|one| panic!("{}", one.rendered.join("\n")));
    let estimate = answer.estimate.expect("a probability is estimated");
    // 255 of 256 pairs are such.
    assert!(estimate.satisfied_runs >= Some(45), "{estimate:?}");
}
