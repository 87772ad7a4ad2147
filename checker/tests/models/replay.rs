//! Runs with exact times: what they look like, and that runs that were made wrong on purpose are
//! caught.

#![expect(
    clippy::needless_raw_string_hashes,
    reason = "UPDATE_EXPECT=1 writes them"
)]

use checker::engine::evidence::witness::Proof;
use checker::engine::format::text;
use checker::engine::{Answer, LoadedModel, Options, Verdict};
use checker::ir::{Predicate, QueryKind};
use checker::verify::replay::{self, Claim, Coverage, Defect, End, Moment, Outcome, Run};
use expect_test::{Expect, expect};

use crate::checks::{ask, interpreted, load};

/// A lamp that must burn for more than one and less than two units, and warms up before it can be
/// dimmed.
const LAMP: &str = "
clock x, y;
urgent chan press;
process Lamp() {
  state Off, On { x < 2 }, Dim, Broken;
  urgent Broken;
  init Off;
  trans Off -> On { guard y >= 3; assign x = 0; },
        On -> Off { guard x > 1; assign y = 0; },
        On -> Dim { guard y >= 5; sync press!; },
        Dim -> Broken { };
}
process Hand() { state Idle; init Idle; trans Idle -> Idle { sync press?; }; }
system Lamp, Hand;
";

fn answer(model: &mut LoadedModel, query: &str) -> Answer {
    let options = Options {
        runs: true,
        ..interpreted()
    };
    ask(model, query, &options)
}

/// The run of the only witness of an answer.
fn run_of(answer: &Answer) -> (Run, Coverage) {
    match answer.evidence.witnesses.as_slice() {
        [only] => match &only.run {
            Some(Proof::Replayed(run, _, coverage)) => (run.clone(), *coverage),
            other => panic!("{other:?}"),
        },
        other => panic!("{} witnesses", other.len()),
    }
}

fn check_text(query: &str, expected: &Expect) {
    let mut model = load(LAMP);
    let answer = answer(&mut model, query);
    let texts = answer.evidence.witnesses.iter();
    let text: String = texts
        .map(|witness| match &witness.run {
            Some(Proof::Replayed(run, states, _)) => text::run_text(model.network(), run, states),
            other => panic!("{other:?}"),
        })
        .collect();
    expected.assert_eq(&text);
}

/// What the replay says of a run of the lamp after `mutate`; the claim is that of the query.
fn defect(query: &str, mutate: impl Fn(&mut Run)) -> Option<Defect> {
    let mut model = load(LAMP);
    let (mut run, _) = run_of(&answer(&mut model, query));
    mutate(&mut run);
    let text = model.add_query(query);
    let (query, _) = model.compile(text.span).expect("the query is right");
    let (negated, always) = (negation(&query.kind), Predicate::Constant(true));
    let claim = match &query.kind {
        QueryKind::Reachable(goal) => Claim::Reaches(goal),
        QueryKind::PotentiallyAlways(keep) => Claim::Stays(&always, keep),
        QueryKind::Eventually(_) => Claim::Stays(&always, &negated),
        other => panic!("{other:?}"),
    };
    match replay::replay(model.network(), &run, &claim).expect("the model can be replayed") {
        Outcome::Replayed(..) => None,
        Outcome::Violated(violation) => Some(violation.defect),
    }
}

fn negation(kind: &QueryKind) -> Predicate {
    match kind {
        QueryKind::Eventually(goal) => Predicate::Not(Box::new(goal.clone())),
        _ => Predicate::Constant(true),
    }
}

#[test]
fn strict_bounds_become_fractions() {
    check_text(
        "E<> Lamp.Off and y < 1 and x > 1",
        &expect![[r#"

        Run:
        0: ( Lamp.Off Hand.Idle ) x=0 y=0
          wait 3
          Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
        1: ( Lamp.On Hand.Idle ) x=0 y=3
          wait 3/2
          Lamp.On->Lamp.Off { x > 1, tau, y = 0 }
        2: ( Lamp.Off Hand.Idle ) x=3/2 y=0
    "#]],
    );
}

#[test]
fn lasso_says_where_it_goes_round() {
    check_text(
        "E[] not Lamp.Dim",
        &expect![[r#"

        Run:
        0: ( Lamp.Off Hand.Idle ) x=0 y=0
          Time passes for ever.
    "#]],
    );
    check_text(
        "E[] (Lamp.Off and y <= 3) or Lamp.On",
        &expect![[r#"

        Run:
        0: ( Lamp.Off Hand.Idle ) x=0 y=0
          wait 3
          Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
        1: ( Lamp.On Hand.Idle ) x=0 y=3
          wait 4/3
          Lamp.On->Lamp.Off { x > 1, tau, y = 0 }
        2: ( Lamp.Off Hand.Idle ) x=4/3 y=0
          wait 3
          Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
        3: ( Lamp.On Hand.Idle ) x=0 y=3
          wait 4/3
          Lamp.On->Lamp.Off { x > 1, tau, y = 0 }
        4: ( Lamp.Off Hand.Idle ) x=4/3 y=0
          The same as state 2 from here on: the run goes round for ever.
    "#]],
    );
}

#[test]
fn deadlock_ends_where_nothing_is_possible() {
    check_text(
        "E<> deadlock",
        &expect![[r#"

        Run:
        0: ( Lamp.Off Hand.Idle ) x=0 y=0
          wait 7/2
          Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
        1: ( Lamp.On Hand.Idle ) x=0 y=7/2
          wait 3/2
          Lamp.On->Lamp.Dim { y >= 5, press!, 1 }
          Hand.Idle->Hand.Idle { 1, press?, 1 }
        2: ( Lamp.Dim Hand.Idle ) x=3/2 y=5
          Lamp.Dim->Lamp.Broken { 1, tau, 1 }
        3: ( Lamp.Broken Hand.Idle ) x=3/2 y=5
    "#]],
    );
}

#[test]
fn values_come_with_the_state_that_has_them() {
    check_text(
        "bounds{Lamp.On}: x",
        &expect![[r#"

            Run:
            0: ( Lamp.Off Hand.Idle ) x=0 y=0
              wait 3
              Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
            1: ( Lamp.On Hand.Idle ) x=0 y=3

            Run:
            0: ( Lamp.Off Hand.Idle ) x=0 y=0
              wait 3
              Lamp.Off->Lamp.On { y >= 3, tau, x = 0 }
            1: ( Lamp.On Hand.Idle ) x=0 y=3
              wait 3/2
               ( Lamp.On Hand.Idle ) x=3/2 y=9/2
        "#]],
    );
}

#[test]
fn violated_leads_to_shows_the_moment_from_which_on_nothing_follows() {
    let mut model = load(LAMP);
    let answer = answer(&mut model, "y > 5 --> Lamp.Dim");
    let (run, _) = run_of(&answer);
    assert_eq!(run.from.state, 0);
    assert!(run.from.wait > 5 * run.ticks_per_unit);
}

#[test]
fn replay_says_what_it_looked_at() {
    let mut model = load(LAMP);
    let (_, coverage) = run_of(&answer(&mut model, "E<> Lamp.Broken"));
    assert_eq!((coverage.states, coverage.moves), (4, 3));
}

/// Work of three units that is interrupted twice, while two other clocks run.
const WORK: &str = "
clock work, pause, t;
process P() {
  state Working { work <= 3 }, Paused { work' == 0 && pause <= 2 }, Done;
  init Working;
  trans Working -> Paused { guard work > 0; assign pause = 0; },
        Paused -> Working { guard pause >= 1; },
        Working -> Done { guard work >= 3; };
}
system P;
";

#[test]
fn stopped_clocks_have_exact_times() {
    let mut model = load(WORK);
    for (query, verdict) in [
        ("E<> P.Done && t > 7 && t < 8", Verdict::Satisfied),
        ("E<> P.Paused && t == 3 && work == 1", Verdict::Satisfied),
        ("A[] P.Done imply t <= 6", Verdict::NotSatisfied),
        ("A[] P.Done imply t >= 3", Verdict::Satisfied),
    ] {
        let answer = answer(&mut model, query);
        assert_eq!(answer.verdict, verdict, "{query}");
        if !answer.evidence.witnesses.is_empty() {
            run_of(&answer);
        }
    }
}

/// A loop closes where the clocks have the values again that they had; one that is never set, or
/// counts only above a constant, does not keep it open.
#[test]
fn runs_without_end_and_values_are_sure_beside_stopped_clocks() {
    let mut model = load(
        "clock x, y, z, total;
         process P() { state L { x < 3 && z' == 0 }, M { y <= 5 && x' == 0 }; init L;
           trans L -> L { guard x > 1; assign x = 0, y = 1; }, L -> M { guard y > 2 && total > 2; }, M -> L { assign x = 0, y = 0; }; }
         system P;",
    );
    let (yes, no) = (Verdict::Satisfied, Verdict::NotSatisfied);
    for (query, verdict) in [
        ("E[] y < 3", yes),
        ("E[] P.L && y <= 2", no),
        ("A<> P.M", no),
        ("P.L --> P.M", no),
        ("P.M --> P.L || y > 3", yes),
        ("sup: y", yes),
        ("inf{P.M}: total", Verdict::Maybe),
        ("sup{z > 0}: y", yes),
    ] {
        let answer = answer(&mut model, query);
        let (values, message) = (answer.value.as_ref(), &answer.message);
        assert_eq!(answer.verdict, verdict, "{query}: {values:?} {message:?}");
        if verdict != Verdict::Maybe && !answer.evidence.witnesses.is_empty() {
            run_of(&answer);
        }
    }
}

/// The zones contain what no run reaches: that t is as large as the two clocks together, of which
/// one stands still at a time.
#[test]
fn what_only_too_large_zones_have_stays_a_maybe() {
    let mut model = load(
        "clock a, b, t;
         process P() { state A { b' == 0 }, B { a' == 0 }, C; init A; trans A -> B { }, B -> C { }; }
         system P;",
    );
    let possible = answer(&mut model, "E<> P.B && a == 2 && b == 3 && t == 5");
    assert_eq!(possible.verdict, Verdict::Satisfied);
    let impossible = answer(&mut model, "E<> P.B && a == 2 && b == 3 && t == 6");
    assert_eq!(impossible.verdict, Verdict::Maybe);
}

const REACH: &str = "E<> Lamp.Broken";
const LOOP: &str = "E[] (Lamp.Off and y <= 3) or Lamp.On";

#[test]
fn runs_as_they_are_pass() {
    assert_eq!(defect(REACH, |_| {}), None);
    assert_eq!(defect(LOOP, |_| {}), None);
}

#[test]
fn wait_that_is_too_short_is_caught() {
    assert_eq!(
        defect(REACH, |run| run.steps[0].wait -= 1),
        Some(Defect::NoMove)
    );
}

#[test]
fn wait_beyond_an_invariant_is_caught() {
    let wait = |run: &mut Run| run.steps[1].wait = 2 * run.ticks_per_unit;
    assert_eq!(defect(REACH, wait), Some(Defect::NoTime));
}

#[test]
fn wait_beyond_an_urgent_synchronisation_is_caught() {
    let wait = |run: &mut Run| {
        run.steps[0].wait = 4 * run.ticks_per_unit;
        run.steps[1].wait = 3 * run.ticks_per_unit / 2;
    };
    assert_eq!(defect(REACH, wait), Some(Defect::NoTime));
}

#[test]
fn negative_wait_is_caught() {
    assert_eq!(
        defect(REACH, |run| run.steps[0].wait = -1),
        Some(Defect::Malformed)
    );
}

#[test]
fn move_of_another_edge_is_caught() {
    assert_eq!(
        defect(REACH, |run| run.steps[0].parts[0].edge = 1),
        Some(Defect::NoMove)
    );
}

#[test]
fn missing_partner_is_caught() {
    let alone = |run: &mut Run| run.steps[1].parts.truncate(1);
    assert_eq!(defect(REACH, alone), Some(Defect::NoMove));
}

#[test]
fn run_that_stops_short_is_caught() {
    let shorten = |run: &mut Run| drop(run.steps.pop());
    assert_eq!(defect(REACH, shorten), Some(Defect::NotReached));
    let shorten = |run: &mut Run| run.end = End::After(0);
    assert_eq!(defect(LOOP, shorten), Some(Defect::NotEndless));
}

#[test]
fn loop_that_does_not_close_is_caught() {
    let open = |run: &mut Run| {
        run.steps.pop();
        run.end = End::Loop(0);
    };
    assert_eq!(defect(LOOP, open), Some(Defect::NoLoop));
    assert_eq!(
        defect(LOOP, |run| run.end = End::Loop(run.steps.len())),
        Some(Defect::Malformed)
    );
}

#[test]
fn end_that_is_none_is_caught() {
    assert_eq!(
        defect(LOOP, |run| run.end = End::Stuck(0)),
        Some(Defect::NotStuck)
    );
    assert_eq!(
        defect(LOOP, |run| run.end = End::Waits(0)),
        Some(Defect::NotKept)
    );
}

#[test]
fn moment_outside_the_run_is_caught() {
    let late = |run: &mut Run| {
        run.from = Moment {
            state: 100,
            wait: 0,
        }
    };
    assert_eq!(defect(LOOP, late), Some(Defect::Malformed));
}
