//! Searches end where there are more states than numbers for them.

use checker::cancellation::with_numbers;
use checker::engine::{Options, TraceWanted, Verdict};
use checker::search::StopReason;

use crate::checks::{check, expect, interpreted};

/// Ten thousand states, or zones. Whatever is done first, in the end both have counted as far as
/// they can: time stops, and somebody moves as long as anybody can.
const COUNTERS: &str = "clock x; int[0,99] a, b;
    process P() { state S { x <= 2 }; init S;
        trans S -> S { guard a < 99 && x >= 1; assign a++, x = 0; }; }
    process Q() { state S; init S; trans S -> S { guard b < 99; assign b++; }; }
    system P, Q;";

/// The same as a game: the environment counts, and the controller only looks.
const GAME: &str = "clock x; int[0,99] a, b;
    process P() { state S { x <= 2 }, L; init S;
        trans S -u-> S { guard a < 99 && x >= 1; assign a++, x = 0; },
            S -u-> L { guard x > 2; }; }
    process Q() { state S; init S; trans S -u-> S { guard b < 99; assign b++; }; }
    system P, Q;";

/// With so few numbers the search ends and says why; with all of them it does not.
fn check_numbers(text: &str, query: &str, options: &Options, verdict: Verdict) {
    let answer = with_numbers(1000, || check(text, query, options));
    assert_eq!(
        answer.verdict,
        Verdict::Unknown(StopReason::States),
        "{query}"
    );
    let message = answer.message.unwrap_or_default();
    assert!(message.contains("4,294,967,295"), "{query}: {message}");
    expect(text, query, options, verdict);
}

#[test]
fn searches_end_where_numbers_do() {
    let options = interpreted();
    check_numbers(COUNTERS, "E<> a + b > 198", &options, Verdict::NotSatisfied);
    check_numbers(COUNTERS, "A[] a + b < 199", &options, Verdict::Satisfied);
    check_numbers(COUNTERS, "sup: a + b", &options, Verdict::Satisfied);
    check_numbers(COUNTERS, "A<> a + b > 197", &options, Verdict::Satisfied);
    check_numbers(COUNTERS, "a > 0 --> b > 98", &options, Verdict::Satisfied);
}

#[test]
fn games_end_where_numbers_do() {
    let options = interpreted();
    check_numbers(GAME, "control: A[] not P.L", &options, Verdict::Satisfied);
    let strategy = Options {
        strategy: true,
        ..interpreted()
    };
    check_numbers(GAME, "control: A[] not P.L", &strategy, Verdict::Satisfied);
}

#[test]
fn a_trace_that_is_the_shortest_is_left_out_where_numbers_end() {
    let options = Options {
        trace: TraceWanted::Shortest,
        ..interpreted()
    };
    check_numbers(COUNTERS, "E<> a + b > 198", &options, Verdict::NotSatisfied);
}
