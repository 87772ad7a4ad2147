//! Where discrete states with all that invariants allow take more work than those that are reached, games are played in the latter.

use std::time::Duration;

use checker::engine::{Answer, CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::game::Nodes;

/// Four plates on poles, one pair of hands: each is to be spun again within ten units, which takes one. Two thousand states have many
/// zones for each discrete state, of which there are few. With all that invariants allow, the plates may have been left alone for any
/// time, and where they are lost falls into ever more pieces.
const TEXT: &str = "
const int N = 4;
typedef int[0, N - 1] id_t;
bool hands;
process Plate(const id_t id) {
  clock x;
  state Steady, Shaking { x <= 10 }, Spun { x <= 1 }, Fallen;
  init Steady;
  trans Steady -u-> Shaking { guard x >= 8; },
        Steady -> Spun { guard !hands; assign hands = true, x = 0; },
        Shaking -> Spun { guard !hands; assign hands = true, x = 0; },
        Spun -> Steady { guard x >= 1; assign hands = false, x = 0; },
        Shaking -u-> Fallen { guard x >= 9; };
}
system Plate;
";

fn played(nodes: Nodes) -> Answer {
    let mut model = LoadedModel::load("plates.xta", TEXT.as_bytes()).expect("it is accepted");
    let options = Options {
        nodes,
        code: CodeEngine::Interpreter,
        limits: Limits {
            timeout: Some(Duration::from_mins(10)),
            ..Limits::default()
        },
        ..Options::default()
    };
    let query = model.add_query("control: A[] forall (i : id_t) not Plate(i).Fallen");
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
