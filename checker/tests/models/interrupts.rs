//! Limits and interruptions in the middle of one call of the model's code, of one enumeration of
//! moves, or of one operation on zones.
//!
//! What runs there would end in an error of the model, or take more memory than there is, if
//! nothing ended it before, so that no test measures time.

use std::sync::Arc;
use std::time::Duration;

use checker::engine::{CodeEngine, Limits, Options, Verdict};
use checker::game::Priorities;
use checker::search::StopReason;

use crate::checks::{ask, check, expect, interpreted, load};

/// An update that runs for too many rounds.
const BUSY: &str = "
    int[0,1000003] n;
    void spin() { int[0,200000000] i = 0; while (i < 200000000) { n = (n * 31 + i % 5) % 1000003; i++; } }
    process P() { state S, T; init S; trans S -> S { assign spin(); }, S -> T { guard n == 7; }; }
    process Q() { state A, B, C; urgent A; init A; trans A -> B { }, B -> C { }; }
    system P, Q;";

/// A guard that does.
const SLOW_GUARD: &str = "
    typedef scalar[3] id; id last;
    bool holds() { int[0,200000000] i = 0; while (i < 200000000) i++; return true; }
    process P(const id me) { state S, T; init S; trans S -> T { guard holds(); assign last = me; }; }
    system P;";

/// Broadcasts of more combinations than a state may have moves.
const CROWD: &str = "
    broadcast chan go; int[0,3] n;
    process S() { state S; init S; trans S -> S { sync go!; }; }
    process R(const int[1,24] me) { state A; init A;
      trans A -> A { sync go?; assign n = me % 4; }, A -> A { sync go?; assign n = (n * 3) % 4; }; }
    system S, R;";

/// Where one sender has priority, what is left for the other one is cut out of all valuations, in
/// as many zones as there are sets of receivers that abstain.
const CUTTING: &str = "
    broadcast chan go, first; chan priority go < first; int[0,3] n;
    process S() { state S; init S; trans S -> S { sync go!; assign n = 1; }, S -> S { sync first!; assign n = 2; }; }
    process P(const int[1,30] me) {
      clock x; state S, T; init S;
      trans S -> T { guard x > 3 && x <= 5; sync first?; }, S -> S { guard x > 8; assign n = 3; }; }
    system S, P;";

const ENGINES: [CodeEngine; 2] = [
    CodeEngine::Interpreter,
    #[cfg(feature = "jit")]
    CodeEngine::Jit,
    #[cfg(not(feature = "jit"))]
    CodeEngine::Interpreter,
];

fn limits_of(stop: StopReason) -> Limits {
    match stop {
        StopReason::Time => Limits {
            timeout: Some(Duration::from_millis(5)),
            ..Limits::default()
        },
        StopReason::Memory => Limits {
            memory_bytes: Some(32 << 20),
            ..Limits::default()
        },
        _ => Limits {
            observer: Some(Arc::new(|_| Some(StopReason::Interrupted))),
            ..Limits::default()
        },
    }
}

fn check_stops(text: &str, queries: &[&str], stops: &[StopReason]) {
    for query in queries {
        for &stop in stops {
            for code in ENGINES {
                for threads in [1, 2] {
                    let options = Options {
                        limits: limits_of(stop),
                        code,
                        threads,
                        priorities: Priorities::Kept,
                        ..Options::default()
                    };
                    let answer = check(text, query, &options);
                    let case = format!("{query}, {code:?}, {threads} threads");
                    assert_eq!(answer.verdict, Verdict::Unknown(stop), "{case}");
                    assert!(answer.evidence.witnesses.is_empty(), "{case}");
                    assert!(answer.evidence.strategy.is_none(), "{case}");
                    assert_eq!(answer.value, None, "{case}");
                }
            }
        }
    }
}

const SYMBOLIC: [&str; 8] = [
    "E<> P.T",
    "A[] !P.T",
    "E<> deadlock",
    "E[] P.S",
    "A<> P.T",
    "P.S --> P.T",
    "sup: n",
    "inf{P.T}: n",
];

const GAMES: [&str; 4] = [
    "control: A<> P.T",
    "control: A[] P.S",
    "E<> control: A<> P.T",
    "control_t*(10, 0): A<> P.T",
];

#[test]
fn one_call_ends_in_every_kind_of_query() {
    let both = [StopReason::Time, StopReason::Interrupted];
    check_stops(BUSY, &SYMBOLIC, &both);
    check_stops(BUSY, &GAMES, &both);
}

#[test]
fn one_guard_ends_with_members_exchanged_too() {
    let queries = [
        "A[] forall (i : id) !P(i).T",
        "E<> deadlock",
        "sup{exists (i : id) P(i).T}: 1",
    ];
    check_stops(
        SLOW_GUARD,
        &queries,
        &[StopReason::Time, StopReason::Interrupted],
    );
}

#[test]
fn one_enumeration_of_moves_ends() {
    check_stops(
        CROWD,
        &["E<> n == 5", "sup: n", "control: A<> n == 2"],
        &[StopReason::Time],
    );
}

/// Processes so many that the moves of all successors of one state take long.
const MANY: &str = "
    process P(const int[1,1500] me) { clock x; int[0,3] n; state S, T; init S;
      trans S -> T { guard x >= me % 7; assign n = me % 4; }, T -> S { guard x <= 90; assign x = 0; }; }
    system P;";

#[test]
fn one_state_with_many_moves_ends_before_it_is_explored() {
    let options = Options {
        limits: limits_of(StopReason::Time),
        ..Options::default()
    };
    for query in ["A[] not deadlock", "E<> deadlock"] {
        let answer = check(MANY, query, &options);
        assert_eq!(
            answer.verdict,
            Verdict::Unknown(StopReason::Time),
            "{query}"
        );
        assert!(
            answer.counters.stored < 1500,
            "{query}: {:?}",
            answer.counters
        );
    }
}

#[test]
fn one_operation_on_zones_ends() {
    let all = [
        StopReason::Time,
        StopReason::Memory,
        StopReason::Interrupted,
    ];
    check_stops(CUTTING, &["E<> P(1).T", "A[] n != 3", "sup: n"], &all);
}

#[test]
fn counters_go_on_being_shown_during_a_call() {
    let shown = Arc::new(std::sync::atomic::AtomicU32::new(0));
    let seen = Arc::clone(&shown);
    let options = Options {
        limits: Limits {
            observer: Some(Arc::new(move |_| {
                let is_third = seen.fetch_add(1, std::sync::atomic::Ordering::Relaxed) == 2;
                is_third.then_some(StopReason::Interrupted)
            })),
            ..Limits::default()
        },
        ..interpreted()
    };
    let interrupted = Verdict::Unknown(StopReason::Interrupted);
    expect(BUSY, "E<> P.T", &options, interrupted);
    assert_eq!(shown.load(std::sync::atomic::Ordering::Relaxed), 3);
}

#[test]
fn an_alarm_of_one_query_is_none_of_the_next() {
    let text =
        "bool slow(int[0,200000000] n) { int[0,200000000] i = 0; while (i < n) i++; return true; }
        process P() { state S; init S; } system P;";
    let mut model = load(text);
    let interrupted = Verdict::Unknown(StopReason::Interrupted);
    for (query, limits, verdict) in [
        (
            "E<> slow(200000000)",
            limits_of(StopReason::Interrupted),
            interrupted,
        ),
        ("E<> slow(200000)", Limits::default(), Verdict::Satisfied),
    ] {
        let options = Options {
            limits,
            ..interpreted()
        };
        assert_eq!(ask(&mut model, query, &options).verdict, verdict);
    }
}

#[test]
fn who_watches_says_which_limit_it_was() {
    for reason in [StopReason::Memory, StopReason::Time] {
        let options = Options {
            limits: Limits {
                observer: Some(Arc::new(move |_| Some(reason))),
                ..Limits::default()
            },
            ..interpreted()
        };
        expect(BUSY, "E<> P.T", &options, Verdict::Unknown(reason));
    }
}
