//! Where discrete states with all that invariants allow take more work than those that are reached,
//! games are played in the latter.

use std::time::Duration;

use checker::engine::{Answer, CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::game::Nodes;

use crate::plates::{NONE_FALLEN, plates};

fn played(nodes: Nodes) -> Answer {
    let mut model =
        LoadedModel::load("plates.xta", plates(4, [8, 10, 9]).as_bytes()).expect("it is accepted");
    let options = Options {
        nodes,
        // So all that the controller may do is explored; for a verdict few states are.
        strategy: true,
        code: CodeEngine::Interpreter,
        limits: Limits {
            timeout: Some(Duration::from_mins(10)),
            ..Limits::default()
        },
        ..Options::default()
    };
    let query = model.add_query(NONE_FALLEN);
    model.check(&query, &options).expect("it is answered")
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
