//! Importance splitting against exact probabilities of rare events.

use checker::ir::{Network, Statistical};
use checker::stochastic::statistics::Method;
use checker::stochastic::{Behaviour, Failure, Precision, Rare, Splitting, estimate_rare};

use super::{executors, together};

/// The estimate of a probability by splitting.
fn split(
    network: &Network,
    kinds: &[Statistical],
    (effort, repetitions): (u64, u64),
    precision: &Precision,
) -> Result<Rare, Failure> {
    let [
        Statistical::Probability(bound, path),
        Statistical::Expectation { value: level, .. },
    ] = kinds
    else {
        panic!("a probability and a level are needed");
    };
    let [_, jit] = executors(network);
    let splitting = Splitting {
        level: *level,
        effort,
        repetitions,
    };
    estimate_rare(
        Behaviour::new(network, &*jit),
        bound,
        path,
        &splitting,
        precision,
        |_| false,
    )
}

/// A walk from 1, up with 3/10, until 0 or 25.
const RUIN: &str = "
    int[0, 25] n = 1;
    process P() {
        state Walk { ; 1 };
        branchpoint step;
        init Walk;
        trans
            Walk -> step { guard n > 0 && n < 25; },
            step -> Walk { probability 3; assign n++; },
            step -> Walk { probability 7; assign n--; };
    }
    system P;
";

#[test]
fn a_ruin_that_one_run_in_a_billion_avoids_is_estimated() {
    let ratio: f64 = 7.0 / 3.0;
    let exact = (ratio - 1.0) / (ratio.powi(25) - 1.0);
    assert!(exact < 1e-9);
    let asked = ["Pr[<=100000](n > 0 U n >= 25)", "E[<=1; 1](max: n)"];
    let (network, kinds) = together(RUIN, &asked);
    let mut held = 0;
    for seed in 0..8 {
        let precision = Precision {
            seed,
            threads: 1 + seed as usize % 2,
            ..Precision::default()
        };
        let found = split(&network, &kinds, (150, 20), &precision).expect("no part fails");
        let Rare {
            estimate,
            thresholds,
            has_reached,
        } = found;
        assert!(has_reached && estimate.is_complete);
        assert_eq!(estimate.method, Method::ImportanceSplitting);
        assert!(
            thresholds.is_sorted() && thresholds.len() >= 8,
            "{thresholds:?}"
        );
        held += u64::from(estimate.lower <= exact && exact <= estimate.upper);
        // Plain runs would need billions to see the event once.
        assert!(estimate.runs < 200_000, "{}", estimate.runs);
        assert!(estimate.upper < 4.0 * estimate.lower, "{estimate:?}");
    }
    assert!(held >= 6, "{held} of 8");
}

#[test]
fn splitting_does_not_depend_on_threads() {
    let asked = ["Pr[<=100000](n > 0 U n >= 12)", "E[<=1; 1](max: n)"];
    let (network, kinds) = together(RUIN, &asked);
    let found: Vec<Rare> = [1, 2, 3]
        .into_iter()
        .map(|threads| {
            let precision = Precision {
                threads,
                ..Precision::default()
            };
            split(&network, &kinds, (100, 10), &precision).expect("no part fails")
        })
        .collect();
    assert!(found.iter().all(|one| *one == found[0]));
}

/// Two queues in a row: the second overflows before both are empty.
const TANDEM: &str = "
    int[0, 60] a = 1;
    int[0, 15] b = 0;
    process Arrivals() { state A { ; 1 }; init A; trans A -> A { guard a < 60; assign a++; }; }
    process First() {
        state A { ; 6 };
        init A;
        trans A -> A { guard a > 0 && b < 15; assign a--, b++; };
    }
    process Second() { state A { ; 4 }; init A; trans A -> A { guard b > 0; assign b--; }; }
    system Arrivals, First, Second;
";

/// The probability of the overflow from each state, by sweeps over the linear equations.
fn overflow() -> f64 {
    const FIRST: usize = 60;
    const SECOND: usize = 15;
    let mut chance = vec![[0.0; SECOND + 1]; FIRST + 1];
    for row in &mut chance {
        row[SECOND] = 1.0;
    }
    loop {
        let mut change: f64 = 0.0;
        for a in 0..=FIRST {
            for b in (0..SECOND).filter(|&b| a + b > 0) {
                let (mut rates, mut sum) = (0.0, 0.0);
                let mut add = |rate: f64, next: f64| {
                    rates += rate;
                    sum += rate * next;
                };
                if a < FIRST {
                    add(1.0, chance[a + 1][b]);
                }
                if a > 0 {
                    add(6.0, chance[a - 1][b + 1]);
                }
                if b > 0 {
                    add(4.0, chance[a][b - 1]);
                }
                let next = sum / rates;
                change = change.max((next - chance[a][b]).abs() / next.max(1e-30));
                chance[a][b] = next;
            }
        }
        if change < 1e-12 {
            return chance[1][0];
        }
    }
}

#[test]
fn an_overflow_of_queues_in_a_row_is_that_of_linear_equations() {
    let exact = overflow();
    assert!((1e-10..1e-8).contains(&exact), "{exact}");
    let asked = [
        "Pr[<=100000](a + b > 0 U b >= 15)",
        "E[<=1; 1](max: 2 * b + a)",
    ];
    let (network, kinds) = together(TANDEM, &asked);
    let found = split(&network, &kinds, (300, 40), &Precision::default()).expect("no part fails");
    let estimate = found.estimate;
    assert!(
        estimate.lower <= exact && exact <= estimate.upper,
        "{exact} is not in {estimate:?}"
    );
    assert!(estimate.upper < 3.0 * estimate.lower, "{estimate:?}");
}

#[test]
fn a_probability_that_is_not_rare_is_that_of_plain_runs() {
    // From 1 to 3 before 0.
    let ratio: f64 = 7.0 / 3.0;
    let exact = (ratio - 1.0) / (ratio.powi(3) - 1.0);
    let asked = ["Pr[<=100000](n > 0 U n >= 3)", "E[<=1; 1](max: n)"];
    let (network, kinds) = together(RUIN, &asked);
    // One interval in twenty misses; that of this seed does not.
    let precision = Precision {
        seed: 1,
        ..Precision::default()
    };
    let found = split(&network, &kinds, (400, 40), &precision).expect("no part fails");
    let estimate = found.estimate;
    assert!(
        estimate.lower <= exact && exact <= estimate.upper,
        "{estimate:?}"
    );
    // And time bounds cut parts as they cut runs: no move within no time.
    let asked = ["Pr[<=0](n > 0 U n >= 3)", "E[<=1; 1](max: n)"];
    let (network, kinds) = together(RUIN, &asked);
    let never = split(&network, &kinds, (50, 5), &Precision::default()).expect("no part fails");
    assert!(!never.has_reached);
    let estimate = never.estimate;
    assert_eq!(
        (estimate.value, estimate.lower, estimate.upper),
        (0.0, 0.0, 1.0)
    );
}
