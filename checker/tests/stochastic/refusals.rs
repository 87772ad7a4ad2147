//! Models and queries that have no stochastic meaning: refused, or failing where they run.

use checker::stochastic::Failure;

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
fn rates_are_positive_numbers() {
    for rate in ["0", "0 - 1", "1.0 / 0.0"] {
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
fn what_is_not_linear_in_time_is_refused() {
    let model = "
        clock x, y;
        process P() { state a { x <= 5 }, b; init a; trans a -> b { guard x * y >= 3; }; }
        system P;";
    refused(model, "Pr[<=9](<> P.b)", "E0283");
    let model = "
        clock x, y;
        process P() { state a { x' == y && x <= 5 }, b; init a; trans a -> b { }; }
        system P;";
    refused(model, "Pr[<=9](<> P.b)", "E0284");
}

#[test]
fn bounds_are_known_numbers() {
    let model = "int n = 3; clock x; process P() { state a; init a; } system P;";
    refused(model, "Pr[<=n](<> P.a)", "E0213");
    refused(model, "Pr[<=0-1](<> P.a)", "E0");
    refused(model, "Pr[n<=3](<> P.a)", "E0268");
    refused(model, "E[<=3](max: x)", "E0");
    refused(model, "E[<=3; 10](max: x >= 2 ? P : 1)", "E0");
}
