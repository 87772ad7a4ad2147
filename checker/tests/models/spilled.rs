//! States on disk: answers, counts and traces are those of a search in memory.

use std::path::PathBuf;
use std::sync::Arc;
use std::{env, fs, process};

use checker::engine::{Answer, Options, Verdict};
use checker::search::reachability::report::Order;
use checker::search::store::disk::Disk;

use crate::checks::{ask, interpreted, load};

/// Counters that walk up and down; one has a clock.
const COUNTERS: &str = "
int[0,31] a, b, c; meta int seen; clock x;
void step(int[-1,1] da, int[-1,1] db, int[-1,1] dc) { a += da; b += db; c += dc; seen = a; }
process P() {
  state S; init S;
  trans S -> S { guard a < 31; assign step(1, 0, 0); },
        S -> S { guard a > 0; assign step(-1, 0, 0); },
        S -> S { guard b < 31; assign step(0, 1, 0); },
        S -> S { guard c < 31; assign step(0, 0, 1); };
}
process Q() {
  state Off { x <= 3 }, On; init Off;
  trans Off -> On { guard x >= 2; }, On -> Off { guard a > 29; assign x = 0; };
}
";

/// A long way from number to number.
const WAY: &str = "
int[0,80000] n; clock x;
process P() {
  state S { x <= 2 }, T { x <= 2 }, Done; init S;
  trans S -> T { guard n < 80000; assign n = n + 1, x = 0; },
        T -> S { guard x >= 1; assign x = 0; },
        S -> Done { guard n >= 80000; };
}
system P;
";

/// An answer with everything on disk that may be there, after the same in memory, if the options
/// leave one order of states.
fn both(text: &str, query: &str, adjust: impl Fn(&mut Options)) -> (Answer, Answer) {
    let mut options = interpreted();
    adjust(&mut options);
    let in_memory = ask(&mut load(text), query, &options);
    let place = place(query);
    let disk = Disk::new(&place, Some(0)).expect("there is room");
    options.limits.disk = Some(Arc::new(disk));
    let on_disk = ask(&mut load(text), query, &options);
    drop(options);
    assert_eq!(fs::read_dir(&place).expect("it was made").count(), 0);
    fs::remove_dir(place).expect("it is empty");
    (in_memory, on_disk)
}

/// A folder for a query.
fn place(query: &str) -> PathBuf {
    let name: String = query.chars().filter(char::is_ascii_alphanumeric).collect();
    env::temp_dir().join(format!("ntagen-test-spilled-{name}-{}", process::id()))
}

#[test]
fn answers_and_counts_are_those_in_memory() {
    let untimed = format!("{COUNTERS} system P;");
    let timed = format!("{COUNTERS} system P, Q;");
    for (text, query) in [
        (untimed.as_str(), "E<> a == 31 && b == 31 && c == 31"),
        (&untimed, "A[] a + b + c < 94 || seen >= 0"),
        (&untimed, "A[] not deadlock"),
        (&untimed, "sup: a + b"),
        (&timed, "E<> a == 31 && b == 30 && c == 31 && Q.On"),
        (&timed, "E<> deadlock"),
        (WAY, "E<> n == 79000"),
        (WAY, "A<> P.Done"),
        (WAY, "n == 70 --> n == 75000"),
    ] {
        let (in_memory, on_disk) = both(text, query, |options| options.runs = true);
        assert_eq!(on_disk.verdict, in_memory.verdict, "{query}");
        assert_eq!(on_disk.value, in_memory.value, "{query}");
        let counts = |answer: &Answer| (answer.counters.explored, answer.counters.stored);
        assert_eq!(counts(&on_disk), counts(&in_memory), "{query}");
        let lengths = |answer: &Answer| -> Vec<usize> {
            let witnesses = answer.evidence.witnesses.iter();
            witnesses.map(|one| one.trace.moves.len()).collect()
        };
        assert_eq!(lengths(&on_disk), lengths(&in_memory), "{query}");
        assert!(on_disk.peak_bytes < in_memory.peak_bytes, "{query}");
    }
}

#[test]
fn answers_are_those_in_memory_whatever_the_order_and_the_threads() {
    let timed = format!("{COUNTERS} system P, Q;");
    for (order, threads) in [
        (Order::BreadthFirst, 3),
        (Order::DepthFirst, 1),
        (Order::Random(3), 1),
    ] {
        for query in ["E<> a + b + c == 93 && Q.On && x > 1", "A[] a != b + 32"] {
            let (in_memory, on_disk) = both(&timed, query, |options| {
                options.order = order;
                options.threads = threads;
            });
            assert_eq!(on_disk.verdict, in_memory.verdict, "{query}");
            if in_memory.verdict == Verdict::Satisfied && query.starts_with("A[]") {
                assert_eq!(on_disk.counters.stored, in_memory.counters.stored);
            }
        }
    }
}
