//! Machines of games under partial observation as controllers: a file in C99 that depends on
//! nothing, with two functions and tables.
//!
//! A state has one observation, so the table of what is observed next is that of the states which
//! may come next.

use std::fmt::Write as _;

use crate::game::partial_observation::{Action, Machine};
use crate::ir::Network;

use super::machine_json::action_text;
use super::strategy_c::{array, comment, starts, texts};
use crate::engine::query_form::observations;

/// What does not depend on the machine.
const RUNTIME: &str = include_str!("machine_runtime.c");

/// A machine for a query as the text of a C file.
pub fn write(network: &Network, machine: &Machine, query: &str) -> String {
    let mut actions: Vec<Action> = machine.states.iter().map(|state| state.action).collect();
    actions.sort_unstable();
    actions.dedup();
    actions.retain(|&action| action != Action::Wait);
    let number = |action: Action| {
        let found = actions.iter().position(|&one| one == action);
        found.map_or(-1, |number| number as i64)
    };
    let names = observations(query);
    let mut text = opening(query, &names);
    let _ = write!(
        text,
        "#define CONTROLLER_STATES {}\n#define CONTROLLER_OBSERVATIONS {}\n#define CONTROLLER_ACTIONS {}\n\n",
        machine.states.len(),
        names.len(),
        actions.len()
    );
    texts(
        &mut text,
        actions.iter().map(|&one| action_text(network, one)),
    );
    let states = || machine.states.iter();
    let text = &mut text;
    array(text, "actions", states().map(|state| number(state.action)));
    let seen = states().flat_map(|state| &state.knowledge.observation[..]);
    array(text, "seen", seen.map(|&value| value.into()));
    array(
        text,
        "starts",
        starts(states().map(|state| state.next.len())),
    );
    let targets = states().flat_map(|state| &state.next);
    array(text, "targets", targets.map(|&(_, next)| next as i64));
    text.push_str(RUNTIME);
    std::mem::take(text)
}

/// The comment that the file begins with, and its interface.
fn opening(query: &str, names: &[String]) -> String {
    let mut text = format!(
        "/* A machine of the controller for\n *     {}\n * written by ntagen.\n *\n",
        comment(query)
    );
    text.push_str(
        " * It begins in state 0.\n\
         \x20* controller_propose(state) is what it proposes: an action, by its number (controller_texts says which), or CONTROLLER_WAIT.\n\
         \x20*   The action is to be taken as soon as it is possible, again and again, until the observation changes.\n\
         \x20* controller_next(state, seen) is the state in which it is when it observes this.\n\
         \x20* Both are CONTROLLER_NONE where the machine says nothing: play does not come here before it is won.\n *\n\
         \x20* seen, each 0 or 1:\n",
    );
    for (index, name) in names.iter().enumerate() {
        let _ = writeln!(text, " *   [{index}] {}", comment(name));
    }
    text.push_str(
        " */\n\
         #include <stddef.h>\n\
         #include <stdint.h>\n\n\
         #define CONTROLLER_WAIT (-1)\n\
         #define CONTROLLER_NONE (-3)\n\n\
         int controller_propose(int state);\n\
         int controller_next(int state, const unsigned char *seen);\n\n",
    );
    text
}
