//! Searches that leave out orders of independent moves where time stands still, against searches of
//! all moves.
//!
//! Random networks have urgent and committed locations, invariants, variables and clocks of their
//! own and in common, and channels of every kind; in some of them mostly urgent locations keep time
//! from passing, in others mostly invariants and urgent channels. Every run that is found must pass
//! its replay, which knows nothing of the reduction.
//!
//! `NETWORKS=50000 cargo test --release --test models partial_order::` runs more of them than the
//! usual number.

use std::fmt::Write as _;

use checker::engine::{Answer, Options, Verdict};
use checker::search::reachability::report::Manner;

use crate::random::{Random, networks};
use crate::searches::{self, Total, is_replayed_or_cut};

/// Networks without the environment variable `NETWORKS`.
const NETWORKS: u64 = 250;

fn answer(text: &str, query: &str, manner: Manner, partial_order: bool) -> Answer {
    let adjust = |options: &mut Options| {
        options.reductions.partial_order = partial_order;
        options.limits.states = Some(MOST_STATES);
    };
    searches::answer_in(manner, (text, query), adjust, is_replayed_or_cut)
}

/// Larger networks are left out.
const MOST_STATES: u64 = 4000;

/// Whether verdicts of two searches agree: where a failure can be met and what is looked for can be
/// found, either may come first.
fn agree(one: Verdict, other: Verdict, found: Verdict) -> bool {
    let is_end = |verdict| verdict == found || matches!(verdict, Verdict::Error(_));
    one == other
        || is_end(one) && is_end(other)
        || [one, other]
            .iter()
            .any(|one| matches!(one, Verdict::Unknown(_)))
}

/// How many states are stored without and with the reduction, which must agree in any manner of
/// search.
fn stored(text: &str, query: &str) -> (u64, u64) {
    let found = if query.starts_with("E<>") {
        Verdict::Satisfied
    } else {
        Verdict::NotSatisfied
    };
    let compare = |manner: Manner, full: &Answer, reduced: &Answer| {
        let is_cut = |verdict| matches!(verdict, Verdict::Error(_) | Verdict::Unknown(_));
        assert!(
            agree(full.verdict, reduced.verdict, found)
                && (is_cut(full.verdict)
                    || is_cut(reduced.verdict)
                    || full.evidence.witnesses.is_empty() == reduced.evidence.witnesses.is_empty()),
            "{:?} in all, {:?} with the reduction, {manner:?}: {query}\n{text}",
            full.verdict,
            reduced.verdict,
        );
    };
    let answer = |manner, partial_order| answer(text, query, manner, partial_order);
    let (full, reduced) = searches::answers(answer, compare);
    (full.counters.stored, reduced.counters.stored)
}

fn sensors(count: usize, urgency: &str) -> String {
    let mut text = String::from("broadcast chan tick;\n");
    let mut names = Vec::new();
    for sensor in 0..count {
        let _ = writeln!(
            text,
            "int[0,3] level{sensor};
             process S{sensor}() {{ state wait, read, judge, tell; {urgency} read, judge, tell; init wait; trans
               wait -> read {{ sync tick?; }}, read -> judge {{ assign level{sensor} = (level{sensor} + 1) % 4; }},
               judge -> tell {{ guard level{sensor} < 3; }}, judge -> wait {{ guard level{sensor} == 3; }},
               tell -> wait {{ }}; }}"
        );
        names.push(format!("S{sensor}"));
    }
    format!(
        "{text} process Bell() {{ clock x; state on {{ x <= 5 }}; init on; trans on -> on {{ guard x == 5; sync tick!; assign x = 0; }}; }}
         system Bell, {};",
        names.join(", ")
    )
}

#[test]
fn independent_processes_are_not_interleaved() {
    for urgency in ["urgent", "commit"] {
        for query in [
            "A[] !(S0.wait && S0.read)",
            "E<> deadlock",
            "A[] level0 <= 3",
            "A[] S0.tell imply level0 < 3",
        ] {
            let (full, reduced) = stored(&sensors(5, urgency), query);
            assert!(
                reduced * 20 < full || reduced < 60,
                "{urgency}, {query}: {full} states, {reduced} with the reduction"
            );
        }
    }
}

/// Sensors of which each waits for a moment of its own, and all begin again at one time.
fn roll_call(count: usize) -> String {
    format!(
        "const int N = {count}; chan alive, ack;
         process Sensor(const int[0, N - 1] id) {{
           clock x;
           state before {{ x <= 10 * id + 1 }}, calling {{ x <= 10 * id + 6 }}, listening {{ x <= 10 * id + 9 }}, resting {{ x <= 1500 }};
           init before;
           trans before -> calling {{ guard x >= 10 * id + 1; }}, calling -> listening {{ sync alive!; }},
                 listening -> resting {{ sync ack?; }}, listening -> resting {{ guard x >= 10 * id + 9; }},
                 resting -> before {{ guard x >= 1500; assign x = 0; }};
         }}
         process Centre() {{ state on; init on; trans on -> on {{ sync alive?; }}, on -> on {{ sync ack!; }}; }}
         system Sensor, Centre;"
    )
}

#[test]
fn who_has_come_to_the_bound_of_an_invariant_is_not_interleaved() {
    // Of each sensor three states between its window and the next one, and of each pair one while
    // they begin again.
    let (full, reduced) = stored(&roll_call(9), "A[] not deadlock");
    assert_eq!((full, reduced), (538, 72));
    let query = "E<> Sensor(3).listening && Sensor(2).before";
    let (full, reduced) = stored(&roll_call(9), query);
    assert!(
        reduced * 4 <= full,
        "{full} states, {reduced} with the reduction"
    );
}

#[test]
fn who_meets_on_an_urgent_channel_is_not_interleaved() {
    let mut text = String::from("urgent chan go[5]; broadcast chan bell;\n");
    for pair in 0..5 {
        let _ = writeln!(
            text,
            "process A{pair}() {{ state idle, ready, done; init idle; trans
               idle -> ready {{ sync bell?; }}, ready -> done {{ sync go[{pair}]!; }}, done -> idle {{ sync bell?; }}; }}
             process B{pair}() {{ state idle, ready; init idle; trans
               idle -> ready {{ sync bell?; }}, ready -> idle {{ sync go[{pair}]?; }}; }}"
        );
    }
    let _ = writeln!(
        text,
        "process Bell() {{ clock x; state on {{ x <= 5 }}; init on; trans on -> on {{ guard x == 5; sync bell!; assign x = 0; }}; }}
         system Bell, A0, A1, A2, A3, A4, B0, B1, B2, B3, B4;"
    );
    for query in ["A[] not deadlock", "A[] !(A0.done && B0.ready)"] {
        let (full, reduced) = stored(&text, query);
        assert!(
            reduced * 3 <= full,
            "{query}: {full} states, {reduced} with the reduction"
        );
    }
}

/// In each of these a run exists only in an order that a careless reduction leaves out.
#[test]
fn orders_that_matter_are_kept() {
    let cases = [
        // One process reads what the other writes.
        (
            "int[0,1] v;",
            "trans a -> b { assign v = 1; };",
            "trans a -> b { guard v == 0; };",
            "E<> P.b && Q.b",
        ),
        // A clock is set between.
        (
            "clock x;",
            "trans a -> b { assign x = 0; };",
            "trans a -> b { guard x >= 1; };",
            "E<> Q.b",
        ),
        // A partner comes only after some moves.
        (
            "chan c;",
            "trans a -> b { sync c!; }, a -> d { };",
            "trans a -> b { }, b -> d { sync c?; };",
            "E<> P.b",
        ),
        // A broadcast takes along whoever is there.
        (
            "broadcast chan c;",
            "trans a -> b { sync c!; };",
            "trans a -> b { }, b -> d { sync c?; };",
            "E<> P.b && Q.b",
        ),
        // A loop would put the other off for ever.
        ("", "trans a -> a { };", "trans a -> b { };", "E<> Q.b"),
        (
            "int[0,2] v;",
            "trans a -> a { assign v = (v + 1) % 3; };",
            "trans a -> b { };",
            "E<> Q.b",
        ),
        // So it would a failure.
        (
            "int[0,1] v;",
            "trans a -> a { };",
            "trans a -> b { assign v = 2; };",
            "E<> Q.d",
        ),
        // Seen only in one order.
        (
            "",
            "trans a -> b { };",
            "trans a -> b { };",
            "E<> P.a && Q.b",
        ),
        (
            "",
            "trans a -> b { };",
            "trans a -> b { };",
            "E<> Q.a && P.b",
        ),
        // An invariant of the other forbids a move.
        (
            "int[0,1] v;",
            "trans a -> b { assign v = 1; };",
            "trans a -> d { };",
            "E<> P.b && Q.d",
        ),
        // A deadlock in the one that the other runs into.
        (
            "int[0,1] v;",
            "trans a -> b { guard v == 0; };",
            "trans a -> b { assign v = 1; };",
            "E<> deadlock && P.a",
        ),
    ];
    for urgency in ["urgent", "commit"] {
        for (declarations, left, right, query) in cases {
            for swapped in [false, true] {
                let order = if swapped { "Q, P" } else { "P, Q" };
                let invariant = if declarations.contains('v') {
                    " { v <= 0 || true }"
                } else {
                    ""
                };
                let text = format!(
                    "{declarations} process P() {{ state a, b, d; {urgency} a, b; init a; {left} }}
                     process Q() {{ state a{invariant}, b, d; {urgency} a, b; init a; {right} }} system {order};"
                );
                stored(&text, query);
            }
        }
    }
}

const GUARDS: [&str; 12] = [
    "own == 0",
    "own < 2",
    "x >= 1",
    "x <= 1",
    "a[ME] == 0",
    "a[OTHER] == 0",
    "v == 0",
    "v < 2",
    "g >= 2",
    "g < 1",
    "a[v] == 1",
    "x - g <= 1",
];

const UPDATES: [&str; 12] = [
    "own = (own + 1) % 3",
    "own = 0",
    "x = 0",
    "a[ME] = 1",
    "a[ME] = 1 - a[ME]",
    "a[OTHER] = 0",
    "v = (v + 1) % 3",
    "v = own",
    "g = 0",
    "swap(own)",
    "v = v + own",
    "x = 1",
];

const OWN: [&str; 4] = ["own == 0", "own < 2", "x >= 1", "x <= 1"];
const OWN_UPDATES: [&str; 4] = ["own = (own + 1) % 3", "own = 0", "x = 0", "x = 1"];

const INVARIANTS: [&str; 5] = ["x <= 2", "x <= 1", "own < 2", "v < 2", "g <= 3"];

/// Bounds that time comes to, first those of a clock that no other process writes.
const LIMITS: [&str; 8] = [
    "x <= 2",
    "x <= 1",
    "x <= own",
    "x < 2",
    "x <= 2 && own < 2",
    "g <= 3",
    "g <= v",
    "x <= v",
];

/// Guards that hold where such a bound is reached.
const REACHED: [&str; 4] = ["x == 2", "x == 1", "x >= 1", "x >= 2"];

const TIMED_SYNCS: [&str; 8] = ["u!", "u?", "u!", "u?", "b!", "b?", "c!", "c?"];

const SYNCS: [&str; 9] = [
    "c!",
    "c?",
    "d[ME]!",
    "d[OTHER]?",
    "b!",
    "b?",
    "u!",
    "u?",
    "d[v]!",
];

/// In `timed` processes few locations are urgent or committed, and time comes to the bounds of
/// invariants.
fn process(random: &mut Random, index: usize, count: usize, is_timed: bool) -> String {
    // Most of what a process does concerns itself, else there is nothing to reduce.
    let is_sociable = random.chance(25);
    let mut text = format!("process P{index}() {{ clock x; int[0,2] own; state ");
    let places = ["p", "q", "r", "s"];
    let states: Vec<String> = places
        .iter()
        .map(|place| {
            let invariant = if random.chance(if is_timed { 50 } else { 6 }) {
                let pool = if is_timed {
                    &LIMITS[..if is_sociable { LIMITS.len() } else { 5 }]
                } else if is_sociable {
                    &INVARIANTS[..]
                } else {
                    &INVARIANTS[..3]
                };
                format!(" {{ {} }}", random.one_of(pool))
            } else {
                String::new()
            };
            format!("{place}{invariant}")
        })
        .collect();
    let _ = write!(text, "{};", states.join(", "));
    let (mut committed, mut urgent) = (Vec::new(), Vec::new());
    for place in places {
        match random.below(if is_timed { 60 } else { 10 }) {
            0..4 => committed.push(place),
            4..7 => urgent.push(place),
            _ => {}
        }
    }
    for (keyword, places) in [("commit", committed), ("urgent", urgent)] {
        if !places.is_empty() {
            let _ = write!(text, " {keyword} {};", places.join(", "));
        }
    }
    let edges: Vec<String> = (0..4 + random.below(3))
        .map(|edge| {
            let source = if edge < 4 { edge } else { random.below(4) };
            let target = if random.chance(60) {
                (source + 1) % 4
            } else {
                random.below(4)
            };
            let is_social = is_sociable || random.chance(7);
            let guards: Vec<&str> = (0..usize::from(random.chance(35)))
                .map(|_| {
                    let pool = match (is_timed && random.chance(60), is_social) {
                        (true, _) => &REACHED[..],
                        (false, true) => &GUARDS[..],
                        (false, false) => &OWN[..],
                    };
                    random.one_of(pool)
                })
                .collect();
            let updates: Vec<&str> = (0..random.below(3))
                .map(|_| {
                    random.one_of(if is_social {
                        &UPDATES[..]
                    } else {
                        &OWN_UPDATES[..]
                    })
                })
                .collect();
            let sync = if is_social && random.chance(50) {
                random.one_of(if is_timed {
                    &TIMED_SYNCS[..]
                } else {
                    &SYNCS[..]
                })
            } else {
                ""
            };
            // Clocks in guards of receivers of broadcasts and on urgent channels are left out as
            // often as not.
            let guards: Vec<&str> = guards
                .into_iter()
                .filter(|guard| {
                    !(sync.starts_with('u') || sync == "b?")
                        || !(guard.starts_with('x') || guard.starts_with('g'))
                })
                .collect();
            let part = |keyword: &str, parts: String| {
                if parts.is_empty() {
                    parts
                } else {
                    format!("{keyword} {parts};")
                }
            };
            format!(
                "{} -> {} {{ {} {} {} }}",
                places[source],
                places[target],
                part("guard", guards.join(" && ")),
                part("sync", sync.to_owned()),
                part("assign", updates.join(", ")),
            )
            .replace("ME", &index.to_string())
            .replace("OTHER", &((index + 1) % count).to_string())
        })
        .collect();
    let _ = writeln!(text, " init p; trans {}; }}", edges.join(",\n  "));
    text
}

const QUERIES: [&str; 14] = [
    "E<> P0.q && P1.r",
    "A[] !(P0.s && P1.s)",
    "A[] P2.r imply P0.own < 2",
    "E<> deadlock",
    "A[] not deadlock",
    "E<> deadlock && P1.q",
    "E<> a[0] == 1 && a[1] == 0 && v == 2",
    "E<> P0.x - P1.x > 2 && P2.q",
    "A[] !P1.s || g < 3",
    "E<> P0.own == 2 && !P1.p",
    "E<> (P0.s || P1.s) && P2.s && v == 1",
    "E<> P0.s && P1.s && P2.s && P3.s && v == 2",
    "A[] P3.own <= 2",
    "A[] v + P0.own < 4",
];

#[test]
fn verdicts_are_those_of_all_orders() {
    let networks = networks(NETWORKS);
    let mut total = Total::default();
    for seed in 1..=networks {
        let mut random = Random::of_network(seed);
        let count = 4 + random.below(2);
        let is_timed = random.chance(50);
        let mut text = String::from(
            "int[0,2] v; int[0,1] a[5]; clock g; chan c; chan d[5]; broadcast chan b; urgent chan u;
             void swap(int[0,2] &w) { int[0,2] old = w; w = v; v = old; }\n",
        );
        for index in 0..count {
            text += &process(&mut random, index, count, is_timed);
        }
        let names: Vec<String> = (0..count).map(|index| format!("P{index}")).collect();
        let _ = writeln!(text, "system {};", names.join(", "));
        for _ in 0..2 {
            let (full, reduced) = stored(&text, random.one_of(&QUERIES));
            total.add(full, reduced);
        }
    }
    assert!(
        total.reduced < total.full && total.fewer * 20 > networks,
        "without and with the reduction: {total:?}"
    );
}
