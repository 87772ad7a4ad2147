//! Searches by several threads: the same verdicts as one thread, and with the same number of
//! threads everything the same again.
//!
//! The models are large enough that many states wait at once: where few do, one thread runs all
//! shards.

use std::fmt::Write as _;
use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, ThreadId};
use std::time::Duration;

use checker::analysis::{Abstraction, ClockBounds};
use checker::engine::{Answer, Limits, Options, Verdict};
use checker::exec::Interpreter;
use checker::network::{Failure, Stepper, Symbolic};
use checker::search::StopReason;
use checker::search::limits::Unlimited;
use checker::search::reachability::goal::{Goal, SharedGoal};
use checker::search::reachability::report::{Manner, Order};
use checker::search::reachability::search;
use checker::tuning::Tuning;
use checker::zones::Zone;

use crate::checks::{check, load};

const THREADS: [usize; 4] = [1, 2, 3, 4];

/// Machines that take parts in turn, drop or pass them on where it is urgent, and rest for a while:
/// 6,500 states with `machines` 4. `extra` stands among the declarations, `update` is run where a
/// part is passed on.
fn line(machines: usize, extra: &str, update: &str) -> String {
    let mut text = format!("int[0,40] made; bool busy[{machines}]; {extra}\n");
    for index in 0..machines {
        let _ = write!(
            text,
            "process M{index}() {{ clock x; state Rest {{ x <= 3 }}, Work {{ x <= 5 }}, Choose, Full; commit Choose; init Rest; trans
  Rest -> Work {{ guard x >= 1; assign x = 0, busy[{index}] = true; }},
  Work -> Choose {{ guard x >= 2; assign busy[{index}] = false; }},
  Choose -> Rest {{ assign x = 0; }},
  Choose -> Rest {{ guard made < 3; assign made = made + 1, x = 0{update}; }},
  Choose -> Full {{ guard made >= 3; assign x = 0; }},
  Full -> Rest {{ guard x >= 1 && made > 0; assign made = made - 1, x = 0; }};
}}\n"
        );
    }
    let names: Vec<String> = (0..machines).map(|index| format!("M{index}")).collect();
    let _ = writeln!(text, "system {};", names.join(", "));
    text
}

fn options(threads: usize) -> Options {
    Options {
        threads,
        verify: true,
        runs: true,
        ..Options::default()
    }
}

/// Everything about an answer but how long it took.
fn facts(answer: &Answer) -> String {
    let witnesses = answer.evidence.witnesses.iter();
    let witnesses = witnesses.map(|one| format!("{:?} {:?}", one.trace, one.run));
    format!(
        "{:?} {:?} {:?} {}",
        answer.verdict,
        answer.value,
        answer.counters,
        witnesses.collect::<Vec<_>>().join("\n")
    )
}

#[test]
fn verdicts_and_values_do_not_depend_on_the_number_of_threads() {
    let text = line(4, "", "");
    for query in [
        "E<> false",
        "E<> made == 3 and M0.Full and M1.Full and M2.Full",
        "A[] made <= 3",
        "A[] not (M0.Full and M1.Work and M2.Work and M3.Full)",
        "E<> deadlock",
        "bounds{M0.Work}: made, M0.x",
        "sup{M1.Rest && M2.Work}: M3.x",
    ] {
        let expected = check(&text, query, &options(1));
        for threads in THREADS {
            let found = check(&text, query, &options(threads));
            assert_eq!(
                (found.verdict, &found.value),
                (expected.verdict, &expected.value),
                "{query} by {threads} threads"
            );
            let verified = found.evidence.is_verified();
            assert_ne!(verified, Some(false), "{query} by {threads} threads");
            let count = |answer: &Answer| answer.evidence.witnesses.len();
            assert_eq!(count(&found), count(&expected), "{query}");
        }
    }
}

#[test]
fn the_same_number_of_threads_gives_the_same_answer_again() {
    let text = line(4, "", "");
    for query in [
        "E<> false",
        "E<> M0.Full and M1.Full and M2.Full and M3.Work",
    ] {
        for threads in THREADS {
            let first = facts(&check(&text, query, &options(threads)));
            for _ in 0..3 {
                let again = facts(&check(&text, query, &options(threads)));
                assert_eq!(first, again, "{query} by {threads} threads");
            }
        }
    }
}

#[test]
fn traces_are_as_short_as_those_of_one_thread() {
    // Without committed locations every state is stored, and its level is the number of transitions
    // to it.
    let text = line(4, "", "").replace("commit Choose;", "");
    let query = "E<> M0.Full and M1.Full and M2.Full and M3.Full";
    let length = |threads| {
        let answer = check(&text, query, &options(threads));
        assert_eq!(answer.evidence.is_verified(), Some(true));
        answer.evidence.witnesses[0].trace.moves.len()
    };
    for threads in THREADS {
        assert_eq!(length(threads), length(1), "by {threads} threads");
    }
}

#[test]
fn errors_are_found_with_the_way_to_them() {
    // The error comes where three parts are made, after thousands of states.
    let text = line(4, "int[0,2] spare;", ", spare = made");
    for threads in THREADS {
        let first = check(&text, "E<> false", &options(threads));
        assert!(
            matches!(first.verdict, Verdict::Error(Failure::RunTime(_))),
            "{:?} by {threads} threads",
            first.verdict
        );
        assert_eq!(first.evidence.witnesses.len(), 1);
        assert!(!first.evidence.witnesses[0].trace.moves.is_empty());
        let again = check(&text, "E<> false", &options(threads));
        assert_eq!(facts(&first), facts(&again), "by {threads} threads");
    }
}

#[test]
fn error_goes_before_a_state_that_is_found_in_the_same_round() {
    // Each of the states of one level leads to an error or to what is looked for, and each thread
    // ends its round at its first one.
    let text = "int[0,999] v; process P() { state A, B, Won; init A; trans
          A -> B { select i : int[0,999]; assign v = i; },
          B -> Won { guard v % 2 == 0; },
          B -> A { guard v % 2 == 1; assign v = 1000; }; } system P;";
    let verdict = |threads| check(text, "E<> P.Won", &options(threads)).verdict;
    assert_eq!(verdict(1), Verdict::Satisfied);
    assert!(matches!(verdict(16), Verdict::Error(_)));
}

#[test]
fn limits_stop_all_threads() {
    let text = line(5, "", "");
    for threads in THREADS {
        let limited = |limits: Limits| {
            let options = Options {
                limits,
                ..options(threads)
            };
            check(&text, "E<> false", &options)
        };
        let by_states = || {
            limited(Limits {
                states: Some(5000),
                ..Limits::default()
            })
        };
        let first = by_states();
        assert_eq!(first.verdict, Verdict::Unknown(StopReason::States));
        assert_eq!(facts(&first), facts(&by_states()), "by {threads} threads");
        let stored = first.counters.stored;
        assert!((5000..15_000).contains(&stored), "{stored} states");
        let by_time = limited(Limits {
            timeout: Some(Duration::ZERO),
            ..Limits::default()
        });
        assert_eq!(by_time.verdict, Verdict::Unknown(StopReason::Time));
        let interrupted = limited(Limits {
            observer: Some(Arc::new(|_| Some(StopReason::Interrupted))),
            timeout: Some(Duration::from_mins(5)),
            ..Limits::default()
        });
        assert_eq!(
            interrupted.verdict,
            Verdict::Unknown(StopReason::Interrupted)
        );
    }
}

/// Finds nothing; panics in a thread that is not the given one, after some states.
struct Panics {
    caller: ThreadId,
    seen: Arc<AtomicU64>,
}

impl Goal for Panics {
    fn confirms(&mut self, _: &mut Symbolic<'_>, _: &mut [i32], _: &Zone) -> Result<bool, Failure> {
        if thread::current().id() != self.caller {
            let seen = self.seen.fetch_add(1, Ordering::Relaxed);
            assert!(seen < 1000, "a state that no goal can look at");
        }
        Ok(false)
    }
}

impl SharedGoal for Panics {
    fn fork(&self) -> Panics {
        Panics {
            caller: self.caller,
            seen: Arc::clone(&self.seen),
        }
    }

    fn join(&mut self, _: Panics) {}
}

#[test]
fn panic_of_a_thread_ends_the_search_with_it() {
    let text = line(5, "", "");
    let model = load(&text);
    let network = model.network();
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let bounds = ClockBounds::new(network, &[], Abstraction::LowerUpper, Tuning::default());
    let mut symbolic = Symbolic::new(Stepper::new(network, &interpreter), bounds);
    let mut goal = Panics {
        caller: thread::current().id(),
        seen: Arc::default(),
    };
    let manner = Manner {
        order: Order::BreadthFirst,
        threads: 3,
    };
    let result = panic::catch_unwind(panic::AssertUnwindSafe(|| {
        search::search_shared(&mut symbolic, &mut goal, manner, &mut Unlimited)
    }));
    let cause = result.expect_err("the panic comes through");
    let text = cause.downcast_ref::<&str>().copied();
    assert_eq!(text, Some("a state that no goal can look at"));
}
