//! The state space as a graph: its states contain all successors of each of them, and each move
//! stands in it once for each state that it leads to.

use checker::engine::{CodeEngine, Limits, LoadedModel};
use checker::zones::dbm;

use crate::checks::load;

/// Two processes whose edges have equal ends, a committed location, and a clock without a bound.
/// No difference of clocks is compared: zones would be split before they are extrapolated, and a
/// move would lead into several of them together.
const TWINS: &str = "
clock x, y;
int[0, 2] n;
broadcast chan go;
process P(const int[0, 1] id) {
    clock z;
    state A { z <= 5 }, B, C;
    commit C;
    init A;
    trans
        A -> B { guard z >= 2 && n < 2; assign n = n + 1; },
        A -> B { guard z >= 4; sync go!; assign z = 0; },
        A -> C { guard x > 1; sync go?; assign x = 0; },
        B -> A { guard y >= 1; assign y = 0, z = 0, n = 0; },
        C -> A { assign z = 0; },
        C -> B { };
}
system P;
";

fn prepared() -> LoadedModel {
    let mut model = load(TWINS);
    model
        .prepare_simulation(CodeEngine::Interpreter)
        .expect("the model runs");
    model
}

#[test]
fn all_moves_of_all_states_are_in_the_graph() {
    let model = prepared();
    let space = model.reached(Limits::default(), true).expect("no failure");
    assert_eq!(space.stop, None);
    assert!(space.states.len() > 20 && space.links.len() > space.states.len());
    let mut expected = 0;
    for (source, state) in space.states.iter().enumerate() {
        let point = checker::engine::session::walk::Point {
            words: state.words.clone(),
            zone: state.zone.clone(),
        };
        for (parts, target) in model.successors(&point).expect("no failure") {
            expected += 1;
            let is_there = space.links.iter().any(|link| {
                let end = &space.states[link.target];
                link.source == source
                    && link.parts == parts
                    && end.words == target.words
                    && dbm::is_subset(target.zone.bounds(), end.zone.bounds())
            });
            assert!(is_there, "{source} {parts:?}");
        }
    }
    assert_eq!(space.links.len(), expected);
}

#[test]
fn states_and_ways_are_the_same_without_moves() {
    let model = prepared();
    let space = model.reached(Limits::default(), true).expect("no failure");
    let plain = model.reached(Limits::default(), false).expect("no failure");
    assert!(plain.links.is_empty());
    assert_eq!(plain.states.len(), space.states.len());
    for (index, state) in space.states.iter().enumerate() {
        assert_eq!(plain.states[index].words, state.words);
        let Some((parent, parts)) = &state.from else {
            continue;
        };
        let mut links = space.links.iter();
        assert!(links.any(|one| (one.source, &one.parts, one.target) == (*parent, parts, index)));
    }
}

#[test]
fn a_limit_leaves_out_moves_to_states_that_are_left_out() {
    let model = prepared();
    let limits = Limits {
        states: Some(5),
        ..Limits::default()
    };
    let space = model.reached(limits, true).expect("no failure");
    assert_eq!(space.states.len(), 5);
    assert!(!space.links.is_empty());
    assert!(space.links.iter().all(|one| one.source.max(one.target) < 5));
}
