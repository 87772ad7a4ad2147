//! Runs of thousands of states on the stack of a depth-first search, of which only the top is held.

use checker::engine::evidence::witness::Proof;
use checker::engine::{Options, Verdict};

use crate::checks::{ask, interpreted, load};

/// Counts to 3,000 in steps of one or two. `others` are more edges.
fn counter(others: &str) -> String {
    format!(
        "int[0, 3000] n;
process P() {{
  state Counts, Done;
  urgent Counts;
  init Counts;
  trans Counts -> Counts {{ guard n < 3000; assign n++; }},
        Counts -> Counts {{ guard n < 2999; assign n += 2; }},
        {others}
        Counts -> Done {{ guard n == 3000; }};
}}
system P;"
    )
}

#[test]
fn every_state_of_a_long_run_is_left() {
    let answer = ask(&mut load(&counter("")), "A<> P.Done", &interpreted());
    assert_eq!(answer.verdict, Verdict::Satisfied);
    assert_eq!(answer.counters.explored, 3001);
}

#[test]
fn a_loop_to_a_state_far_below_is_a_run() {
    let mut model = load(&counter(
        "Counts -> Counts { guard n == 3000; assign n = 7; },",
    ));
    let options = Options {
        runs: true,
        ..interpreted()
    };
    let answer = ask(&mut model, "A<> P.Done", &options);
    assert_eq!(answer.verdict, Verdict::NotSatisfied);
    let [witness] = answer.evidence.witnesses.as_slice() else {
        panic!("{} witnesses", answer.evidence.witnesses.len());
    };
    match &witness.run {
        Some(Proof::Replayed(run, _, _)) => assert!(run.steps.len() > 2_000),
        other => panic!("{other:?}"),
    }
}
