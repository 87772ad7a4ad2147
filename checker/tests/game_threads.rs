//! Games solved by several threads: everything is the same, however many there are.
//!
//! The winning sets of these games take so many zones that threads are started for them.

use std::sync::Arc;
use std::time::Duration;

use checker::engine::{Answer, CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::search::StopReason;

#[path = "common/games.rs"]
mod games;

use games::{ONE_ON_THE_BRIDGE, trains};

fn check(text: &str, query: &str, options: &Options) -> Answer {
    let mut model = LoadedModel::load("trains.xta", text.as_bytes())
        .unwrap_or_else(|rejection| panic!("{}", rejection.rendered.join("\n")));
    let query = model.add_query(query);
    model
        .check(&query, options)
        .unwrap_or_else(|rejection| panic!("{}", rejection.rendered.join("\n")))
}

#[test]
fn games_do_not_depend_on_the_number_of_threads() {
    for (text, query, strategy) in [
        (trains(4, "-u->"), ONE_ON_THE_BRIDGE, false),
        (trains(3, "-u->"), ONE_ON_THE_BRIDGE, true),
        (trains(12, "->"), "control: A<> Train(0).Bridge", false),
        (trains(3, "->"), "control: A<> Train(0).Bridge", true),
    ] {
        let facts = |threads| {
            let options = Options {
                code: CodeEngine::Interpreter,
                threads,
                strategy,
                ..Options::default()
            };
            let answer = check(&text, query, &options);
            assert_eq!(answer.evidence.strategy.is_some(), strategy);
            let Answer {
                verdict,
                counters,
                evidence,
                ..
            } = answer;
            format!("{verdict:?} {counters:?} {:?}", evidence.strategy)
        };
        let expected = facts(1);
        for threads in [2, 3, 7] {
            assert!(facts(threads) == expected, "{query} by {threads} threads");
        }
    }
}

#[test]
fn limits_stop_all_threads() {
    let text = trains(7, "-u->");
    for threads in [1, 2, 4] {
        let limited = |limits: Limits| {
            let options = Options {
                code: CodeEngine::Interpreter,
                limits,
                threads,
                ..Options::default()
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
            observer: Some(Arc::new(|counters| counters.explored > 1000)),
            ..Limits::default()
        });
        assert_eq!(interrupted, Verdict::Unknown(StopReason::Interrupted));
    }
}
