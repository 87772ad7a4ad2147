//! Models and queries that have no stochastic meaning: refused, or failing where they run.

use checker::engine::{CodeEngine, LoadedModel, Options, Verdict};
use checker::stochastic::{Failure, Precision};

use super::{load, satisfied};

#[track_caller]
fn failure(model: &str, query: &str) -> Failure {
    let (network, query) = match load(model, query) {
        Ok(loaded) => loaded,
        Err(message) => panic!("{message}"),
    };
    match satisfied(&network, &query, 10) {
        Err(failure) => failure,
        Ok(count) => panic!("no run fails; {count} are satisfied"),
    }
}

#[track_caller]
fn refused(model: &str, query: &str, code: &str) {
    match load(model, query) {
        Err(message) => assert!(message.contains(code), "{message}"),
        Ok(_) => panic!("the query is accepted"),
    }
}

#[test]
fn an_output_needs_a_rate_or_a_bound() {
    let model = "process P() { state a, b; init a; trans a -> b { }; } system P;";
    assert!(matches!(
        failure(model, "Pr[<=1](<> P.b)"),
        Failure::NoRate(_)
    ));
}

#[test]
fn rates_are_finite_and_not_negative() {
    for rate in ["0 - 1", "0.0 - 0.5", "1.0 / 0.0"] {
        let model = format!(
            "process P() {{ state a {{ ; {rate} }}, b; init a; trans a -> b {{ }}; }} system P;"
        );
        assert!(matches!(
            failure(&model, "Pr[<=1](<> P.b)"),
            Failure::Rate(..)
        ));
    }
}

#[test]
fn weights_are_no_negative_numbers_and_not_all_zero() {
    let model = |weight: &str| {
        format!(
            "int w = 0;
             process P() {{
                 state a {{ ; 1 }}; branchpoint b; init a;
                 trans a -> b {{ }}, b -> a {{ probability {weight}; }}, b -> a {{ probability w; }};
             }}
             system P;"
        )
    };
    let asked = "Pr[<=100](<> w > 0)";
    assert!(matches!(failure(&model("0"), asked), Failure::NoWeight(..)));
    assert!(matches!(
        failure(&model("w - 1"), asked),
        Failure::Weight(..)
    ));
}

#[test]
fn time_that_cannot_pass_is_a_failure() {
    let model = "
        clock x;
        process P() { state a { x <= 1 }, b; init a; trans a -> b { guard x >= 2; }; }
        system P;";
    assert!(matches!(
        failure(model, "Pr[<=9](<> P.b)"),
        Failure::TimeLock(_)
    ));
    let model = "process P() { state a; urgent a; init a; } system P;";
    assert!(matches!(
        failure(model, "Pr[<=9](<> false)"),
        Failure::TimeLock(_)
    ));
}

#[test]
fn a_run_that_never_gets_on_is_a_failure() {
    let model = "process P() { state a; urgent a; init a; trans a -> a { }; } system P;";
    assert!(matches!(
        failure(model, "Pr[<=9](<> false)"),
        Failure::Zeno(_)
    ));
}

#[test]
fn a_bound_that_is_never_reached_is_a_failure() {
    let model = "
        clock x;
        process P() { state a { x' == 0 }; init a; }
        system P;";
    assert_eq!(
        failure(model, "Pr[x<=1](<> false)"),
        Failure::BoundNeverReached
    );
}

#[test]
fn a_bound_that_moves_do_not_approach_is_a_failure() {
    let model = "
        clock x;
        process P() {
            state a { x <= 2 };
            init a;
            trans a -> a { guard x >= 2; assign x = 0; };
        }
        system P;";
    assert_eq!(
        failure(model, "Pr[x<=3](<> false)"),
        Failure::BoundNotApproached(2.0)
    );
}

#[test]
fn an_invariant_that_a_move_breaks_is_a_failure() {
    let model = "
        clock x;
        process P() { state a { x <= 5 }, b { x <= 1 }; init a; trans a -> b { guard x >= 3; }; }
        system P;";
    assert!(matches!(
        failure(model, "Pr[<=9](<> false)"),
        Failure::InvariantBroken(_)
    ));
}

#[test]
fn two_rates_in_one_invariant_are_refused() {
    let model = "
        clock x; int n = 2;
        process P() { state a { x' == 2 && x' == n }; init a; }
        system P;";
    refused(model, "Pr[<=9](<> x > 3)", "E0285");
}

#[test]
fn two_rates_of_one_clock_are_a_failure() {
    let model = "
        clock x;
        process P(const int r) { state a { x' == r }; init a; }
        A = P(1); B = P(2);
        system A, B;";
    assert!(matches!(
        failure(model, "Pr[<=9](<> false)"),
        Failure::RatesConflict(..)
    ));
}

#[test]
fn bounds_are_known_numbers() {
    let model = "int n = 3; clock x; process P() { state a; init a; } system P;";
    refused(model, "Pr[<=n](<> P.a)", "E0213");
    refused(model, "Pr[<=0-1](<> P.a)", "E0");
    refused(model, "Pr[n<=3](<> P.a)", "E0268");
    refused(model, "E[<=3; 10](max: x >= 2 ? P : 1)", "E0");
    let model = format!("double f() {{ return random(3); }} {model}");
    refused(&model, "Pr[<=random(3)](<> P.a)", "E0213");
    refused(&model, "Pr[<=f()](<> P.a)", "E0213");
}

#[test]
fn a_model_without_meaning_is_refused_for_what_statistical_queries_cannot_read() {
    let text = "
        clock x, y; double d = 0.5;
        process P() {
            state a { x <= 2.5 && y' == 1 && y' == 2 };
            init a;
            trans a -> a { guard x >= d; };
        }
        system P;";
    let Err(rejection) = LoadedModel::load("model.xta", text.as_bytes()) else {
        panic!("it is accepted");
    };
    let [only] = &rejection.rendered[..] else {
        panic!("there is one mistake: {:?}", rejection.rendered);
    };
    assert!(only.contains("E0285") && only.contains("y' == 2"), "{only}");
    // Only the second of the mistakes in the symbolic reading is one in both.
    let (guard, code) = ("x >= d && y >= missing", "E0201");
    let text = format!(
        "clock x, y; double d = 0.5;
             process P() {{
                 state a {{ x <= 2.5 }};
                 init a;
                 trans a -> a {{ guard {guard}; }};
             }}
             system P;"
    );
    let Err(rejection) = LoadedModel::load("model.xta", text.into_bytes()) else {
        panic!("{guard} is accepted");
    };
    let errors = rejection
        .rendered
        .iter()
        .filter(|one| one.contains("error["));
    let errors: Vec<&String> = errors.collect();
    let [only] = errors[..] else {
        panic!("{guard}: there is one mistake: {errors:?}");
    };
    assert!(only.contains(code), "{guard}: {only}");
}

#[test]
fn a_model_that_zones_cannot_hold_is_asked_statistical_queries() {
    let text = "
        clock x; double d = 0.5;
        process P() {
            state a { x <= 2.5 }, out;
            init a;
            trans a -> out { guard x >= d && random(2) >= 0; };
        }
        system P;";
    let text = text.replace(" && random(2) >= 0", "");
    let mut model = LoadedModel::load("model.xta", text.into_bytes()).expect("it is accepted");
    assert!(model.warnings[0].contains("W0217"), "{:?}", model.warnings);
    let precision = Precision {
        runs: Some(20_000),
        ..Precision::default()
    };
    let options = Options {
        code: CodeEngine::Interpreter,
        precision,
        ..Options::default()
    };
    let query = model.add_query("Pr[<=1.5](<> P.out)");
    let answer = model.check(&query, &options).expect("it is answered");
    assert_eq!(answer.verdict, Verdict::Satisfied);
    let estimate = answer.estimate.expect("it has an estimate");
    assert!((estimate.value - 0.5).abs() < 0.02, "{estimate:?}");
    let query = model.add_query("E<> P.out");
    let refused = model
        .check(&query, &options)
        .expect_err("zones cannot hold it");
    assert!(
        refused.rendered[0].contains("E0243"),
        "{:?}",
        refused.rendered
    );
    assert!(model.prepare_simulation(CodeEngine::Interpreter).is_err());
}
