//! Certificates: those of the engine pass, and those that were made wrong on purpose are caught.

use checker::engine::answer::Certificate;
use checker::engine::evidence::certificate::verify;
use checker::engine::{Answer, LoadedModel, Options, Rules, Verdict};
use checker::ir::{ClockId, FixedConstraint};
use checker::verify::certificate::States;

use crate::checks::{ask, goal_of, interpreted, load};

/// Two trains share a crossing; the second one must wait outside for the first.
const CROSSING: &str = "
clock x[2];
int[0,1] holder;
bool taken;
process Train(const int[0,1] id) {
  state Away, Near { x[id] <= 5 }, On { x[id] <= 3 };
  init Away;
  trans Away -> Near { guard x[id] >= 2; assign x[id] = 0; },
        Near -> On { guard !taken && x[id] > 1; assign x[id] = 0, taken = true, holder = id; },
        Near -> Away { guard taken; assign x[id] = 0; },
        On -> Away { guard x[id] >= 1; assign x[id] = 0, taken = false; };
}
system Train;
";

const QUERY: &str = "A[] not (Train(0).On and Train(1).On)";

fn certified(text: &str, query: &str) -> (LoadedModel, Answer) {
    let mut model = load(text);
    let options = Options {
        certificate: true,
        ..interpreted()
    };
    let answer = ask(&mut model, query, &options);
    (model, answer)
}

/// That the certificate of an answer holds.
fn check_certificate(text: &str, query: &str) {
    let (mut model, answer) = certified(text, query);
    let Some(certificate) = answer.evidence.certificate else {
        panic!("{query}: {:?}, {:?}", answer.verdict, answer.message);
    };
    let avoided = goal_of(&mut model, query);
    let checked = verify(model.network(), &certificate.states, &avoided);
    assert_eq!(checked.holds, Some(true), "{query}: {:?}", checked.lines);
}

/// What the check says of the certificate for the crossing after `mutate`; `None` if it holds.
fn violation(mutate: impl Fn(&mut Vec<States>)) -> Option<String> {
    let (mut model, answer) = certified(CROSSING, QUERY);
    let Certificate { mut states } = answer.evidence.certificate.expect("the query is satisfied");
    mutate(&mut states);
    let avoided = goal_of(&mut model, QUERY);
    let checked = verify(model.network(), &states, &avoided);
    let holds = checked.holds.expect("the check covers the model");
    checked.lines.into_iter().next().filter(|_| !holds)
}

fn check_violation(mutate: impl Fn(&mut Vec<States>), expected: &str) {
    let found = violation(mutate).expect("the certificate does not hold");
    assert!(found.contains(expected), "{found}");
}

#[test]
fn certificate_as_it_is_holds() {
    assert_eq!(violation(|_| {}), None);
}

#[test]
fn every_zone_is_needed() {
    let (_, answer) = certified(CROSSING, QUERY);
    let states = answer.evidence.certificate.expect("it is satisfied").states;
    for (index, state) in states.iter().enumerate() {
        for zone in 0..state.zones.len() {
            let found = violation(|states| drop(states[index].zones.remove(zone)));
            assert!(
                found.is_some(),
                "zone {zone} of state {index} can be left out"
            );
        }
    }
}

#[test]
fn shrunk_zones_are_caught() {
    let (_, answer) = certified(CROSSING, QUERY);
    let states = answer.evidence.certificate.expect("it is satisfied").states;
    let mut caught = 0;
    for (index, state) in states.iter().enumerate() {
        for (zone, constraints) in state.zones.iter().enumerate() {
            for one in 0..constraints.len() {
                let shrink = |states: &mut Vec<States>| {
                    let constraint = &mut states[index].zones[zone][one];
                    constraint.bound -= 1;
                };
                assert!(violation(shrink).is_some(), "{index} {zone} {one}");
                caught += 1;
            }
        }
    }
    assert!(caught > 5, "{caught}");
}

#[test]
fn missing_state_is_caught() {
    check_violation(|states| drop(states.remove(0)), "the initial state");
    check_violation(|states| drop(states.pop()), "leads out of it");
}

#[test]
fn time_that_leads_out_is_caught() {
    check_violation(
        |states| {
            // Both trains away: all times from 0 on; no longer beyond 7.
            for constraints in &mut states[0].zones {
                constraints.push(FixedConstraint {
                    left: ClockId(1),
                    right: ClockId(0),
                    bound: 7,
                    strict: false,
                });
            }
        },
        "time leads out of it",
    );
}

#[test]
fn goal_inside_is_caught() {
    check_violation(
        |states| {
            let mut both = states[0].clone();
            (both.words[0], both.words[1]) = (2, 2);
            both.zones = vec![Vec::new()];
            states.push(both);
        },
        "what it should avoid holds in it",
    );
}

#[test]
fn other_words_and_clocks_are_refused() {
    check_violation(|states| states[0].words.truncate(2), "does not fit");
    check_violation(|states| states[0].words[0] = 9, "does not fit");
    let other_clock = |states: &mut Vec<States>| {
        let mut constraints = states
            .iter_mut()
            .flat_map(|state| &mut state.zones)
            .flatten();
        constraints.next().expect("some zone has a constraint").left = ClockId(9);
    };
    check_violation(other_clock, "does not fit");
    check_violation(|states| states.push(states[0].clone()), "the same words");
}

/// A file is read back as it was written.
#[test]
fn file_is_checked() {
    let (mut model, answer) = certified(CROSSING, QUERY);
    let certificate = answer.evidence.certificate.expect("it is satisfied");
    let text =
        certificate.head(model.network(), QUERY) + &certificate.lines(0..certificate.state_count());
    let checked = model
        .verify_evidence("safe.jsonl", &text, Rules::default())
        .expect("it is one");
    assert_eq!(checked.holds, Some(true), "{:?}", checked.lines);
    let shorter: Vec<&str> = text.lines().take(3).collect();
    assert!(
        model
            .verify_evidence("safe.jsonl", &shorter.join("\n"), Rules::default())
            .is_err()
    );
    assert!(
        model
            .verify_evidence("safe.jsonl", "{}", Rules::default())
            .is_err()
    );
    assert!(
        model
            .verify_evidence("safe.jsonl", "no json", Rules::default())
            .is_err()
    );
}

/// Deadlocks, urgent channels with clock guards, priorities and receivers that abstain have rules
/// of their own in the check.
#[test]
fn certificates_of_all_constructs_hold() {
    let models = [
        (
            "clock x, y; urgent chan c;
             process P() { state A, B { x <= 4 }; init A;
               trans A -> B { guard x >= 3; sync c!; assign x = 0; }, B -> A { guard y > 5; assign y = 0, x = 1; }; }
             process Q() { state S; init S; trans S -> S { guard y < 9; sync c?; }; }
             system P, Q;",
            "E<> P.A and x > 3 and y < 9",
        ),
        (
            "clock x; broadcast chan c; chan priority default < c;
             process P() { state A { x <= 3 }, B, C; init A; trans A -> B { guard x >= 2; sync c!; }, A -> C { guard x >= 2; }; }
             process Q() { state S, T; init S; trans S -> T { guard x < 3; sync c?; }; }
             system P, Q;",
            "E<> P.C or (P.B and Q.S and x < 3)",
        ),
        (
            "clock x, y;
             process P() { state A { x <= 3 }, B { x - y <= 2 }; init A;
               trans A -> B { guard x - y < 1 && x >= 1; assign x = 0; }, B -> A { assign y = 2, x = 2; }; }
             system P;",
            "A[] not deadlock",
        ),
        (
            "clock x, y; int[0,2] n;
             process P() { state A { x <= 2 }, C; commit C; init A;
               trans A -> C { guard x >= 1; assign y = x, n = (n + 1) % 3; }, C -> A { assign x = 0; }; }
             system P;",
            "A[] y <= 4",
        ),
        (
            "clock work, pause, t; int[0,1] n; meta int[0,5] last;
             process P() { state Working { work <= 3 }, Paused { work' == 0 && pause <= 2 }, Done; init Working;
               trans Working -> Paused { guard work > 0 && n == 0; assign pause = 0, n = 1, last = 5; },
                     Paused -> Working { guard pause >= 1; }, Working -> Done { guard work >= 3; assign last = n; }; }
             system P;",
            "A[] P.Done imply t >= 3 && last < 5",
        ),
    ];
    for (text, query) in models {
        check_certificate(text, query);
    }
}

/// Which of two states that differ in a `meta` variable is kept decides what is found; a
/// certificate cannot take sides.
#[test]
fn certificate_that_hangs_on_meta_variables_is_refused() {
    let text = "meta int[0,1] m;
         process P() { state A, B, C; init A;
           trans A -> B { }, A -> B { assign m = 1; }, B -> C { guard m == 1; }; }
         system P;";
    let (_, answer) = certified(text, "E<> P.C");
    assert_eq!(answer.verdict, Verdict::NotSatisfied);
    assert!(answer.evidence.certificate.is_none());
    let message = answer.message.unwrap_or_default();
    assert!(
        message.contains("differ in meta variables alone"),
        "{message}"
    );
}

/// Whoever listens for long enough hears the call: each listener has a clock of its own, so that
/// without zones any set of them might hear it.
fn listeners(count: usize) -> String {
    format!(
        "broadcast chan call; process Caller() {{ clock t; state S {{ t <= 40 }}, Done; init S; trans S -> Done {{ sync call!; }}; }}
process Listener(const int[0,{last}] id) {{ clock x; state Deaf, Heard; init Deaf;
  trans Deaf -> Heard {{ guard x >= id; sync call?; }}; }}
system Caller, Listener;",
        last = count - 1
    )
}

#[test]
fn receivers_of_a_broadcast_are_put_together_within_zones() {
    let query = "E<> Listener(20).Heard and Listener(3).Deaf";
    check_certificate(&listeners(30), query);
}

#[test]
fn many_clocks_are_checked() {
    let text = "clock x[200]; process P() { state A { x[199] <= 5 }, B { x[199] <= 5 }; init A;
        trans A -> B { guard x[199] >= 3; }; } system P;";
    check_certificate(text, "A[] x[199] <= 5");
}
