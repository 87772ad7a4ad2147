//! Where discrete states with all that invariants allow take more work than those that are reached,
//! games are played in the latter.

use std::time::Duration;

use checker::engine::{Answer, Limits, Options, Verdict};
use checker::game::Nodes;

use crate::checks::{check, interpreted};
use crate::plates::{NONE_FALLEN, plates};

fn played(nodes: Nodes) -> Answer {
    let options = Options {
        nodes,
        // So all that the controller may do is explored; for a verdict few states are.
        strategy: true,
        limits: Limits {
            timeout: Some(Duration::from_mins(10)),
            ..Limits::default()
        },
        ..interpreted()
    };
    check(&plates(4, [8, 10, 9]), NONE_FALLEN, &options)
}

#[test]
fn discrete_states_that_take_too_much_work_are_given_up() {
    let automatic = played(Nodes::Automatic);
    let symbolic = played(Nodes::Symbolic);
    assert_eq!(automatic.verdict, Verdict::Satisfied);
    assert_eq!(symbolic.verdict, Verdict::Satisfied);
    assert_eq!(automatic.counters.stored, symbolic.counters.stored);
    assert!(automatic.counters.explored > symbolic.counters.explored);
}
