//! Searches that forget variables where nothing reads them any more, against searches that keep all
//! values.
//!
//! Models in which a value is passed on and not needed again show what is gained; models in which
//! it is needed on a hidden way show what must be kept; random networks that pass values in all
//! ways show that verdicts and values stay what they are. Every run that is found must pass its
//! replay, which knows nothing of the reduction.
//!
//! `NETWORKS=50000 cargo test --release --test models live_variables::` runs more of them than the
//! usual number.

use std::fmt::Write as _;

use checker::engine::{Answer, Options, Verdict};
use checker::search::reachability::report::Manner;

use crate::random::{Random, networks};
use crate::searches::{self, BREADTH_FIRST, Total, is_replayed_or_cut};

/// Networks without the environment variable `NETWORKS`.
const NETWORKS: u64 = 200;

/// Larger networks are left out.
const MOST_STATES: u64 = 4000;

fn answer(text: &str, query: &str, manner: Manner, live_variables: bool) -> Answer {
    let adjust = |options: &mut Options| {
        options.reductions.live_variables = live_variables;
        options.limits.states = Some(MOST_STATES);
    };
    searches::answer_in(manner, (text, query), adjust, is_replayed_or_cut)
}

/// How many states are stored without and with the reduction, which must agree in any manner of
/// search.
fn stored(text: &str, query: &str) -> (u64, u64) {
    let compare = |manner: Manner, full: &Answer, reduced: &Answer| {
        let is_cut = |answer: &Answer| matches!(answer.verdict, Verdict::Unknown(_));
        // Where a failure can be met and what is looked for can be found, either may come first in
        // another manner.
        let is_end = |answer: &Answer| !answer.evidence.witnesses.is_empty();
        let agree = full.verdict == reduced.verdict
            && format!("{:?}", full.value) == format!("{:?}", reduced.value);
        assert!(
            agree
                || is_cut(full)
                || is_cut(reduced)
                || manner != BREADTH_FIRST && is_end(full) && is_end(reduced),
            "{:?} {:?} with all values, {:?} {:?} without, {manner:?}: {query}\n{text}",
            full.verdict,
            full.value,
            reduced.verdict,
            reduced.value,
        );
    };
    let answer = |manner, live_variables| answer(text, query, manner, live_variables);
    let (full, reduced) = searches::answers(answer, compare);
    (full.counters.stored, reduced.counters.stored)
}

/// A sender passes one of sixteen values by a variable in common; the receiver takes it over, looks
/// at it once, and waits again.
const PASSING: &str = "
    chan pass; int[0,15] message; int[0,15] rounds;
    process Sender() { state Idle, Busy; init Idle; trans
        Idle -> Busy { select k : int[0,15]; sync pass!; assign message = k; }, Busy -> Idle { }; }
    process Receiver() { int[0,15] value; int[0,15] copy[2];
        void take() { int i; value = message; for (i = 0; i < 2; i++) copy[i] = value; }
        state Waiting, Reading, Odd; init Waiting; trans
        Waiting -> Reading { sync pass?; assign take(); },
        Reading -> Odd { guard value % 2 == 1; }, Reading -> Waiting { guard value % 2 == 0; },
        Odd -> Waiting { }; }
    system Sender, Receiver;";

#[test]
fn a_value_that_was_passed_on_is_forgotten() {
    // The value counts only where it is read: sixteen states there, one in each of the two other
    // places, each with the sender in two.
    assert_eq!(stored(PASSING, "E<> false"), (80, 36));
    assert_eq!(
        stored(PASSING, "sup: Receiver.value"),
        (80, 80),
        "the query reads the value"
    );
}

/// In each of these a value is read on a way on which a careless analysis does not see it: edges of
/// a process, those of another one, and what can be reached only with the value.
#[test]
fn values_that_are_read_are_kept() {
    let cases = [
        // After a loop through places that do not read it,
        (
            "a -> b { assign v = 2; }, b -> c { }, c -> a { guard v == 2; assign w = 1; };",
            "",
            "w == 1",
        ),
        // where it is written on one way only,
        (
            "a -> b { assign v = 2; }, b -> c { assign w > 0 ? v = 1 : 0; }, c -> a { guard v == 2; assign w = 1; };",
            "",
            "w == 1",
        ),
        // where it is written after it is read,
        (
            "a -> b { assign v = 2; }, b -> c { assign w = v, v = 0; };",
            "",
            "w == 2",
        ),
        (
            "a -> b { assign v = 2; }, b -> c { assign w = v--; };",
            "",
            "w == 2",
        ),
        // where code reads it that is called,
        (
            "a -> b { assign v = 2; }, b -> c { assign w = value(); };",
            "",
            "w == 2",
        ),
        (
            "a -> b { assign v = 2; }, b -> c { assign take(v); };",
            "",
            "w == 2",
        ),
        // or that returns before it writes,
        (
            "a -> b { assign v = 2; }, b -> c { assign early(); }, c -> a { guard v == 2; assign w = 1; };",
            "",
            "w == 1",
        ),
        // or writes in one branch only,
        (
            "a -> b { assign v = 2; }, b -> c { assign unless_two(2); }, c -> a { guard v == 2; assign w = 1; };",
            "",
            "w == 1",
        ),
        // where another part of an array is written,
        (
            "a -> b { assign f[1] = 2; }, b -> c { assign f[0] = 0; }, c -> a { assign w = f[1]; };",
            "",
            "w == 2",
        ),
        (
            "a -> b { select k : int[0,1]; assign f[k] = 2; }, b -> c { select k : int[0,1]; assign f[k] = 0; }, c -> a { assign w = f[0]; };",
            "",
            "w == 2",
        ),
        // where an invariant or the index of a channel reads it,
        (
            "a -> b { assign v = 1; }, b -> i { }, b -> c { };",
            "",
            "P.c && !P.i",
        ),
        (
            "a -> b { assign v = 1; }, b -> c { sync d[v]!; };",
            "x -> y { sync d[1]?; };",
            "Q.y",
        ),
        // where another process reads it, then or later,
        (
            "a -> b { assign v = 2; }, b -> c { sync d[0]!; };",
            "x -> y { sync d[0]?; }, y -> z { guard v == 2; };",
            "Q.z",
        ),
        (
            "a -> b { assign v = 2; }, b -> c { sync e!; };",
            "x -> y { sync e?; assign w = v; };",
            "w == 2",
        ),
        (
            "a -> b { assign v = 2; }, b -> c { sync e!; assign v = 1; };",
            "x -> y { guard v == 2; sync e?; };",
            "Q.y",
        ),
        // where it is written only by one of two senders,
        (
            "a -> b { assign v = 2; }, b -> c { sync e!; }, b -> a { sync e!; assign v = 0; };",
            "x -> y { sync e?; assign w = v; };",
            "w == 2",
        ),
        // by a sender on only one of two channels,
        (
            "a -> b { assign v = 2; }, b -> c { sync d[0]!; }, b -> a { sync d[1]!; assign v = 0; };",
            "x -> y { select k : int[0,1]; sync d[k]?; assign w = v; };",
            "w == 2",
        ),
        // by only one of those that may send on a channel,
        (
            "a -> b { assign v = 2; }, b -> c { select k : int[0,1]; sync d[k]!; }, b -> a { sync d[1]!; assign v = 0; };",
            "x -> y { sync d[1]?; assign w = v; };",
            "w == 2",
        ),
        // in one of two branches,
        (
            "a -> b { assign v = 2; }, b -> h { sync e!; }, h -> c { probability 1; }, h -> a { assign v = 0; probability 1; };",
            "x -> y { sync e?; assign w = v; };",
            "w == 2",
        ),
        // by one who need not be there,
        (
            "a -> b { assign v = 2; }, b -> c { sync n!; }, c -> a { guard v == 2; assign w = 1; };",
            "x -> y { }, y -> x { sync n?; assign v = 0; };",
            "w == 1",
        ),
        // or by one of two receivers.
        (
            "a -> b { assign v = 2; }, b -> c { sync e!; }, c -> a { guard v == 2; assign w = 1; };",
            "x -> y { sync e?; }, x -> z { sync e?; assign v = 0; };",
            "w == 1",
        ),
    ];
    for (edges, others, goal) in cases {
        let points = if edges.contains(" h ") {
            "branchpoint h;"
        } else {
            ""
        };
        let others = if others.is_empty() {
            String::new()
        } else {
            format!("trans {others}")
        };
        let text = format!(
            "int[0,2] v; int[0,2] w; int[0,2] f[2]; chan d[3]; chan e; broadcast chan n;
             int[0,2] value() {{ return v; }}
             void take(int[0,2] &from) {{ w = from; }}
             void early() {{ if (w == 0) return; v = 0; }}
             void unless_two(int n) {{ if (n == 2) w = 0; else v = 0; }}
             process P() {{ state a, b, c, i {{ v == 0 }}; {points} init a; trans {edges} }}
             process Q() {{ state x, y, z; init x; {others} }}
             system P, Q;"
        );
        let query = format!("E<> {goal}");
        for live_variables in [false, true] {
            let found = answer(&text, &query, BREADTH_FIRST, live_variables);
            assert_eq!(found.verdict, Verdict::Satisfied, "{goal}\n{text}");
        }
        stored(&text, "A[] !P.i");
        stored(&text, &query);
    }
}

const GUARDS: [&str; 9] = [
    "own == 1",
    "own == 2",
    "v == 1",
    "v == w",
    "f[1] == 2",
    "f[v] == 1",
    "is(w)",
    "x >= 1",
    "own != v",
];

const UPDATES: [&str; 22] = [
    "own = v",
    "own = 0",
    "own = k",
    "own = k + 1",
    "v = k",
    "v = k + 1",
    "v = own",
    "v = 0",
    "w = v",
    "w = (w + 1) % 3",
    "f[0] = v",
    "f[k] = own",
    "f[1] = k + 1",
    "own = f[v]",
    "swap(own)",
    "set(k)",
    "clear()",
    "v > 0 ? w = 0 : 0",
    "take(v)",
    "pair = other",
    "other.s = k, other.t = v",
    "w = pair.t",
];

const SYNCS: [&str; 10] = [
    "c!", "c?", "c!", "c?", "d[k]!", "d[v]?", "d[own]!", "b!", "b?", "d[1]?",
];

const INVARIANTS: [&str; 4] = ["x <= 3", "own < 2", "v != 1", "w != 2"];

const PLACES: [&str; 5] = ["p", "q", "r", "s", "t"];

fn process(random: &mut Random, index: usize) -> String {
    let mut text = format!("process P{index}() {{ clock x; int[0,2] own; state ");
    let states = PLACES.map(|place| {
        let invariant = random.chance(8).then(|| random.one_of(&INVARIANTS));
        invariant.map_or(place.to_owned(), |invariant| {
            format!("{place} {{ {invariant} }}")
        })
    });
    let _ = write!(text, "{};", states.join(", "));
    let committed: Vec<&str> = PLACES.into_iter().filter(|_| random.chance(15)).collect();
    if !committed.is_empty() {
        let _ = write!(text, " commit {};", committed.join(", "));
    }
    let edges: Vec<String> = (0..5 + random.below(3))
        .map(|edge| {
            let source = if edge < 5 { edge } else { random.below(5) };
            let target = if random.chance(75) {
                (source + 1) % 5
            } else {
                random.below(5)
            };
            let sync = random.chance(40).then(|| random.one_of(&SYNCS));
            let guard = random.chance(25).then(|| random.one_of(&GUARDS));
            // Whether a broadcast is heard must not hang on clocks, or deadlocks could not be asked
            // for.
            let is_timed = |guard: &&str| sync == Some("b?") && guard.starts_with('x');
            let guard = guard.filter(|guard| !is_timed(guard));
            let mut updates: Vec<&str> = (0..random.below(3))
                .map(|_| random.one_of(&UPDATES))
                .collect();
            if random.chance(30) {
                updates.push("x = 0");
            }
            let part = |keyword: &str, text: Option<String>| {
                text.map_or(String::new(), |text| format!("{keyword} {text}; "))
            };
            let updates = (!updates.is_empty()).then(|| updates.join(", "));
            format!(
                "{} {} {} {{ select k : int[0,1]; {}{}{}}}",
                PLACES[source],
                if random.chance(35) { "-u->" } else { "->" },
                PLACES[target],
                part("guard", guard.map(str::to_owned)),
                part("sync", sync.map(str::to_owned)),
                part("assign", updates),
            )
        })
        .collect();
    let _ = writeln!(text, " init p; trans {}; }}", edges.join(",\n  "));
    text
}

const GAMES: [&str; 6] = [
    "control: A<> P0.s",
    "control: A<> P1.t && v == 1",
    "control: A[] !(P0.r && P1.r)",
    "control: A[ w < 2 U P1.t ]",
    "control: A[ P0.own < 2 W P1.s ]",
    "control: A[] (!P0.t && A<> P0.q)",
];

const QUERIES: [&str; 12] = [
    "E<> P0.q && P1.r",
    "E<> P0.s && P1.t",
    "E<> P0.t",
    "E<> P1.t",
    "E<> P1.s",
    "A[] !(P0.r && P1.r)",
    "E<> deadlock",
    "E<> P0.r && v == 2",
    "A[] P1.own < 2",
    "E<> P0.x - P1.x > 2 && P1.q",
    "sup: v + P0.own, P1.x",
    "bounds{P0.q}: f[1], w",
];

#[test]
fn answers_are_those_with_all_values() {
    let networks = networks(NETWORKS);
    let mut total = Total::default();
    for seed in 1..=networks {
        let mut random = Random::of_network(seed);
        let count = 2 + random.below(2);
        let mut text = String::from(
            "int[0,2] v; int[0,2] w; int[0,2] f[3]; struct { int[0,2] s; int[0,2] t; } pair, other;
             chan c; chan d[3]; broadcast chan b;
             bool is(int n) { return n == v; }
             void swap(int[0,2] &one) { int[0,2] old = one; one = w; w = old; }
             void set(int[0,2] n) { if (n == 0) { v = 1; w = 0; } else { w = 2; v = 0; } }
             void clear() { int i; for (i = 0; i < 3; i++) f[i] = 0; }
             void take(int[0,2] n) { if (n == 2) return; w = n; f[2] = 1; }\n",
        );
        for index in 0..count {
            text += &process(&mut random, index);
        }
        let names: Vec<String> = (0..count).map(|index| format!("P{index}")).collect();
        let mut variables = String::new();
        if random.chance(10) {
            variables = String::from("before_update { w = (w + 1) % 3 }\n");
        }
        let _ = writeln!(text, "{variables}system {};", names.join(", "));
        for query in QUERIES {
            let (full, reduced) = stored(&text, query);
            total.add(full, reduced);
        }
        for query in GAMES {
            stored(&text, query);
        }
    }
    assert!(
        total.reduced < total.full && total.fewer > networks,
        "without and with dead values forgotten: {total:?}"
    );
}
