//! Intervals of queries: how often they hold the true value, over many independent repetitions.

use checker::exec::Executor;
use checker::ir::{Network, Statistical};
use checker::stochastic::statistics::Method;
use checker::stochastic::{
    Behaviour, Estimate, Failure, MeanMethod, Precision, RunWatch, Runs, Shown, estimate,
    estimate_jointly,
};

use super::{executors, together};

/// Five flips of a coin that shows heads with a probability of 1/4: n counts them.
const FLIPS: &str = "
    int[0, 5] n = 0;
    int[0, 5] k = 0;
    clock x;
    process P() {
        state A { x <= 1 };
        branchpoint toss;
        init A;
        trans
            A -> toss { guard x >= 1 && k < 5; assign k++, x = 0; },
            A -> A { guard x >= 1 && k == 5; assign x = 0; },
            toss -> A { probability 1; assign n++; },
            toss -> A { probability 3; };
    }
    system P;
";

const REPETITIONS: u64 = 1000;

/// Lets all runs be made.
struct Unwatched;

impl RunWatch for Unwatched {
    fn see(&mut self, _: Shown) {}

    fn ends(&mut self, _: u64) -> bool {
        false
    }
}

fn asked(
    (network, executor): (&Network, &dyn Executor),
    query: &Statistical,
    precision: &Precision,
) -> Result<Estimate, Failure> {
    let runs = Runs {
        behaviour: Behaviour::new(network, executor),
        source: None,
    };
    estimate(runs, query, precision, &mut Unwatched)
}

/// How many of the repetitions have an interval that misses the mean of n, which is 5/4.
fn missed(runs: u64, precision: Precision, method: Method) -> u64 {
    let (network, queries) = together(FLIPS, &["E[<=6; 1](max: n)"]);
    let [_, jit] = executors(&network);
    let mut missed = 0;
    for seed in 0..REPETITIONS {
        let precision = Precision {
            seed,
            runs: Some(runs),
            alpha: 0.1,
            ..precision
        };
        let found = asked((&network, &*jit), &queries[0], &precision).expect("no run fails");
        assert_eq!(found.method, method);
        assert_eq!(found.runs, runs);
        missed += u64::from(!(found.lower <= 1.25 && 1.25 <= found.upper));
    }
    missed
}

#[test]
fn means_of_bounded_values_are_missed_as_seldom_as_promised() {
    // The range of n is known from its declaration.
    let missed_by_bernstein = missed(60, Precision::default(), Method::EmpiricalBernstein);
    assert!(
        missed_by_bernstein <= REPETITIONS / 10,
        "{missed_by_bernstein}"
    );
    let precision = Precision {
        mean_method: MeanMethod::DvoretzkyKieferWolfowitz,
        ..Precision::default()
    };
    let missed_by_band = missed(60, precision, Method::DvoretzkyKieferWolfowitz);
    assert!(missed_by_band <= REPETITIONS / 10, "{missed_by_band}");
}

#[test]
fn student_is_about_right_for_values_that_are_not_skewed_much() {
    let precision = Precision {
        mean_method: MeanMethod::Student,
        ..Precision::default()
    };
    let missed = missed(60, precision, Method::Student);
    assert!((70..=140).contains(&missed), "{missed}");
}

#[test]
fn ranges_are_known_where_they_are_easy_to_see() {
    let range = |value: &str| {
        let (_, mut queries) = together(FLIPS, &[&format!("E[<=6; 1](max: {value})")]);
        let Some(Statistical::Expectation { range, .. }) = queries.pop() else {
            panic!("{value} is no mean");
        };
        range
    };
    assert_eq!(range("n"), Some((0.0, 5.0)));
    assert_eq!(range("n - k"), Some((-5.0, 5.0)));
    assert_eq!(range("n >= 2"), Some((0.0, 1.0)));
    assert_eq!(range("n > k ? n * 0.5 : -1.0"), Some((-1.0, 2.5)));
    assert_eq!(range("(n - 2.0) * (k - 1.0)"), Some((-8.0, 12.0)));
    // P has one location only.
    assert_eq!(range("P.A"), Some((1.0, 1.0)));
    for unknown in ["x", "n + x", "1.0 / n", "sqrt(n)"] {
        assert_eq!(range(unknown), None, "{unknown}");
    }
}

#[test]
fn a_value_outside_the_bounds_ends_everything() {
    let (network, queries) = together(FLIPS, &["E[<=6; 100](max: n)"]);
    let [_, jit] = executors(&network);
    let precision = Precision {
        value_bounds: Some((0.0, 2.0)),
        ..Precision::default()
    };
    let found = asked((&network, &*jit), &queries[0], &precision);
    assert_eq!(found, Err(Failure::ValueOutOfBounds(3.0)));
}

#[test]
fn confidence_sequences_may_be_stopped_by_what_they_show() {
    // P(n >= 2) = 1 - (3/4)^5 - 5/4 (3/4)^4. Whoever stops as soon as the interval excludes a
    // value believes that it is not this one: here always the true value.
    let probability = 1.0 - 0.75_f64.powi(5) - 1.25 * 0.75_f64.powi(4);
    let (network, queries) = together(FLIPS, &["Pr[<=6](<> n >= 2)"]);
    let [_, jit] = executors(&network);
    let precision = Precision {
        anytime: true,
        alpha: 0.1,
        ..Precision::default()
    };
    let mut ever_missed = 0;
    for seed in 0..REPETITIONS / 4 {
        let misses = [10, 30, 100, 300].into_iter().any(|runs| {
            let precision = Precision {
                seed,
                runs: Some(runs),
                ..precision
            };
            let found = asked((&network, &*jit), &queries[0], &precision).expect("no run fails");
            assert_eq!(found.method, Method::ConfidenceSequence);
            !(found.lower <= probability && probability <= found.upper)
        });
        ever_missed += u64::from(misses);
    }
    assert!(ever_missed <= REPETITIONS / 40, "{ever_missed}");
}

#[test]
fn relative_widths_are_reached() {
    let (network, queries) = together(FLIPS, &["Pr[<=6](<> n >= 4)", "E[<=6; 100000](max: n)"]);
    let [_, jit] = executors(&network);
    let precision = Precision {
        relative: Some(0.2),
        ..Precision::default()
    };
    let rare = asked((&network, &*jit), &queries[0], &precision).expect("no run fails");
    // P(n >= 4) = 16 / 1024.
    assert!(rare.lower <= 16.0 / 1024.0 && 16.0 / 1024.0 <= rare.upper);
    assert!(rare.value - rare.lower <= 0.2 * rare.value);
    assert!(rare.upper - rare.value <= 0.2 * rare.value);
    let mean = asked((&network, &*jit), &queries[1], &precision).expect("no run fails");
    assert_eq!(mean.method, Method::EmpiricalBernsteinSequence);
    assert!(mean.runs < 100_000 && mean.is_complete);
    assert!(mean.upper - mean.lower <= 0.4 * mean.value);
}

/// The same precision for all queries.
fn asked_alike<'q>(
    queries: &[&'q Statistical],
    precision: Precision,
) -> Vec<(&'q Statistical, Precision)> {
    queries.iter().map(|query| (*query, precision)).collect()
}

#[test]
fn queries_that_share_runs_have_the_answers_that_they_have_alone() {
    const ASKED: [&str; 6] = [
        "Pr[<=4](<> n >= 2)",
        "Pr[<=4]([] n <= 1)",
        "Pr[<=4](n == 0 U k >= 3)",
        "Pr[<=4](<> n >= 1) >= 0.5",
        "E[<=4; 300](max: n + x)",
        "E[<=4; 40](min: k - n)",
    ];
    let compiled: Vec<(Network, Statistical)> = ASKED
        .iter()
        .map(|query| {
            let (network, mut kinds) = together(FLIPS, &[*query]);
            (network, kinds.remove(0))
        })
        .collect();
    let (network, kinds) = together(FLIPS, &ASKED);
    let [interpreter, jit] = executors(&network);
    let kinds: Vec<&Statistical> = kinds.iter().collect();
    for (threads, executor) in [(1, &interpreter), (1, &jit), (2, &jit)] {
        let precision = Precision {
            seed: 11,
            threads,
            ..Precision::default()
        };
        let found = estimate_jointly(
            Behaviour::new(&network, &**executor),
            &asked_alike(&kinds, precision),
            |_| false,
        )
        .expect("no run fails");
        for ((alone, query), found) in compiled.iter().zip(&found) {
            let [_, jit] = executors(alone);
            let expected = asked((alone, &*jit), query, &precision).expect("no run fails");
            assert_eq!(*found, expected);
        }
    }
}

/// What fails after a query was decided is no matter to it, however long others are watched for.
#[test]
fn a_failure_counts_only_for_queries_that_it_precedes() {
    let model = "
        int n = 0;
        process P() {
            clock x;
            state A { x <= 1 }, B { x <= 6 }, C;
            branchpoint F;
            init A;
            trans A -> B { guard x >= 1; assign n = 1; },
                  B -> F { guard x >= 5; },
                  F -> C { probability 20; },
                  F -> C { assign n = 6 / (n - 1); probability 1; };
        }
        system P;";
    let (network, kinds) = together(model, &["E[<=10; 5](max: n)", "Pr[<=10](<> n == 1)"]);
    let [_, jit] = executors(&network);
    let precision = |seed, runs, threads| Precision {
        seed,
        runs: Some(runs),
        threads,
        ..Precision::default()
    };
    let alone = |kind, seed, runs| asked((&network, &*jit), kind, &precision(seed, runs, 1));
    // The first query has enough before the run that fails, which is made together with others.
    let mut seeds = 0..;
    let seed = seeds
        .find(|&seed| alone(&kinds[0], seed, 5).is_ok() && alone(&kinds[0], seed, 6).is_err())
        .expect("some seed has five runs that do not fail, and one that does");
    let expected = alone(&kinds[1], seed, 2_000).expect("it is decided before");
    for threads in [1, 2] {
        let asked = [
            (&kinds[0], precision(seed, 5, threads)),
            (&kinds[1], precision(seed, 2_000, threads)),
        ];
        let found = estimate_jointly(Behaviour::new(&network, &*jit), &asked, |_| false);
        let found = found.expect("no failure counts");
        assert_eq!(found[0].runs, 5);
        assert_eq!(found[1], expected);
    }
}

#[test]
fn joint_intervals_hold_all_together_as_often_as_promised() {
    let (network, kinds) = together(
        FLIPS,
        &[
            "Pr[<=6](<> n >= 1)",
            "Pr[<=6](<> n >= 2)",
            "Pr[<=6](<> n >= 3)",
        ],
    );
    let at_least = |least: i32| -> f64 {
        let chance = |k: i32| {
            let ways = [1.0, 5.0, 10.0, 10.0, 5.0, 1.0][k as usize];
            ways * 0.25_f64.powi(k) * 0.75_f64.powi(5 - k)
        };
        (least..=5).map(chance).sum()
    };
    let [_, jit] = executors(&network);
    let kinds: Vec<&Statistical> = kinds.iter().collect();
    let mut missed = 0;
    for seed in 0..REPETITIONS {
        let precision = Precision {
            seed,
            runs: Some(40),
            alpha: 0.1 / 3.0,
            ..Precision::default()
        };
        let asked = asked_alike(&kinds, precision);
        let behaviour = Behaviour::new(&network, &*jit);
        let found = estimate_jointly(behaviour, &asked, |_| false).expect("no run fails");
        let holds = found
            .iter()
            .zip(1..)
            .all(|(found, least)| found.lower <= at_least(least) && at_least(least) <= found.upper);
        missed += u64::from(!holds);
    }
    assert!(missed <= REPETITIONS / 10, "{missed}");
}
