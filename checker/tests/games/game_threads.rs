//! Games solved by several threads: everything is the same, however many there are.
//!
//! The winning sets of these games take so many zones that threads are started for them.

use std::sync::Arc;
use std::time::Duration;

use checker::engine::{Answer, Limits, Options, Verdict};
use checker::search::StopReason;

use crate::checks::{check, interpreted};
use crate::families::{ONE_ON_THE_BRIDGE, trains};
use crate::plates::{NONE_FALLEN, plates};

/// All that is answered, with a strategy if one is wanted.
fn facts(text: &str, query: &str, strategy: bool, threads: usize) -> String {
    let options = Options {
        threads,
        strategy,
        ..interpreted()
    };
    let answer = check(text, query, &options);
    assert_eq!(answer.evidence.strategy.is_some(), strategy);
    let Answer {
        verdict,
        counters,
        evidence,
        ..
    } = answer;
    format!("{verdict:?} {counters:?} {:?}", evidence.strategy)
}

#[test]
fn games_do_not_depend_on_the_number_of_threads() {
    for (text, query, strategy) in [
        (trains(4, "-u->"), ONE_ON_THE_BRIDGE, false),
        (trains(3, "-u->"), ONE_ON_THE_BRIDGE, true),
        (trains(12, "->"), "control: A<> Train(0).Bridge", false),
        (trains(3, "->"), "control: A<> Train(0).Bridge", true),
    ] {
        let expected = facts(&text, query, strategy, 1);
        for threads in [2, 3, 7] {
            let by_threads = facts(&text, query, strategy, threads);
            assert!(by_threads == expected, "{query} by {threads} threads");
        }
    }
}

/// Discrete states are tried, and given up when they have taken so many operations, which is when
/// they are nearly done.
#[test]
fn giving_up_does_not_depend_on_the_number_of_threads() {
    let text = plates(5, [12, 12, 12]);
    let by_threads = |threads| facts(&text, NONE_FALLEN, false, threads);
    assert_eq!(by_threads(1), by_threads(2));
}

#[test]
fn limits_stop_all_threads() {
    let text = trains(7, "-u->");
    for threads in [1, 2, 4] {
        let limited = |limits: Limits| {
            let options = Options {
                limits,
                threads,
                ..interpreted()
            };
            check(&text, ONE_ON_THE_BRIDGE, &options).verdict
        };
        let by_time = limited(Limits {
            timeout: Some(Duration::from_millis(500)),
            ..Limits::default()
        });
        assert_eq!(by_time, Verdict::Unknown(StopReason::Time));
        let by_memory = limited(Limits {
            memory_bytes: Some(4 << 20),
            ..Limits::default()
        });
        assert_eq!(by_memory, Verdict::Unknown(StopReason::Memory));
        let interrupted = limited(Limits {
            observer: Some(Arc::new(|counters| {
                (counters.explored > 1000).then_some(StopReason::Interrupted)
            })),
            ..Limits::default()
        });
        assert_eq!(interrupted, Verdict::Unknown(StopReason::Interrupted));
    }
}
