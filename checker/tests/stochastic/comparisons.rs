//! `Pr[…](…) >= Pr[…](…)`, against probabilities with closed forms.

use checker::stochastic::statistics::{Decision, clopper_pearson};
use checker::stochastic::{Behaviour, Estimate, Precision, Runs, compare};

use super::{executors, load};

/// Two delays of rate 1 and 2; P(p within 1) = 0.632, P(q within 1) = 0.865.
const MODEL: &str = "
    process P(const int r) { state a { ; r }, b; init a; trans a -> b { }; }
    A = P(1); B = P(2);
    system A, B;";

fn compared(query: &str, precision: &Precision) -> Estimate {
    let (network, query) = load(MODEL, query).expect("the query is right");
    let [_, jit] = executors(&network);
    let runs = Runs {
        behaviour: Behaviour::new(&network, &*jit),
        source: None,
    };
    compare(runs, &query.kind, precision, |_| false).expect("no run fails")
}

#[test]
fn the_greater_probability_is_found() {
    let precision = Precision::default();
    for (query, decision) in [
        ("Pr[<=1](<> A.b) >= Pr[<=1](<> B.b)", Decision::Below),
        ("Pr[<=1](<> A.b) <= Pr[<=1](<> B.b)", Decision::AtLeast),
        ("Pr[<=1]([] A.a) >= Pr(<>[1,1] B.a)", Decision::AtLeast),
        ("Pr[<=1](<> A.b) >= Pr[<=2](<> A.b)", Decision::Below),
    ] {
        assert_eq!(
            compared(query, &precision).decision,
            Some(decision),
            "{query}"
        );
    }
}

#[test]
fn both_estimates_stand_beside_the_decision() {
    let estimate = compared("Pr[<=1](<> A.b) >= Pr[<=1](<> B.b)", &Precision::default());
    let second = estimate.compared.expect("there are two");
    assert_eq!(estimate.runs, second.runs);
    for (runs, satisfied, lower) in [
        (estimate.runs, estimate.satisfied_runs, estimate.lower),
        (second.runs, second.satisfied_runs, second.lower),
    ] {
        let interval = clopper_pearson(satisfied.expect("a probability"), runs, 0.05);
        assert_eq!(interval.lower.to_bits(), lower.to_bits());
    }
    assert!((estimate.value - 0.632).abs() < 0.1 && (second.value - 0.865).abs() < 0.1);
}

#[test]
fn decisions_do_not_depend_on_threads() {
    let query = "Pr[<=1](<> A.b) >= Pr[<=1](<> B.b)";
    let one = compared(query, &Precision::default());
    let three = compared(
        query,
        &Precision {
            threads: 3,
            ..Precision::default()
        },
    );
    assert_eq!(one, three);
}

#[test]
fn wrong_decisions_are_as_rare_as_promised() {
    // With probabilities 1 - 1/e and 1 - 1/e^2 the ratio of the odds is 1 / (e + 1): that of u0, at
    // which a wrong decision is most likely.
    let odds_ratios = (1.0 / (1.0_f64.exp() + 1.0), 0.5);
    let repetitions = 300;
    let wrong = (0..repetitions)
        .filter(|&seed| {
            let precision = Precision {
                seed,
                odds_ratios,
                ..Precision::default()
            };
            let estimate = compared("Pr[<=1](<> A.b) >= Pr[<=1](<> B.b)", &precision);
            estimate.decision != Some(Decision::Below)
        })
        .count();
    // More than 30 have a probability below 10^-4 if the risk is 5 %.
    assert!(wrong <= 30, "{wrong} of {repetitions} decisions are wrong");
}

#[test]
fn what_never_differs_is_not_decided() {
    let precision = Precision {
        runs: Some(1000),
        ..Precision::default()
    };
    let estimate = compared("Pr[<=1](<> A.a) >= Pr[<=1](<> B.a)", &precision);
    assert_eq!(estimate.decision, None);
    assert_eq!((estimate.runs, estimate.satisfied_runs), (1000, Some(1000)));
}
