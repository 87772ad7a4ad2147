//! What a strategy lets one process do: a part of it that is small where the whole is large.

use std::collections::HashMap;

use crate::game::strategy::{Decision, Strategy};
use crate::ir::Network;
use crate::network::Part;

use super::text::{self, ValuePlace};

/// A decision for a move in which the process takes part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProcessDecision {
    /// For each variable that was asked for, the first words of its scalar parts.
    pub values: Vec<Vec<i32>>,
    /// The edges of the move.
    pub parts: Vec<Part>,
}

/// What a process does where a strategy lets it move: of each discrete state the first such move,
/// with the values of variables by name; `None` if a name is unknown. Of an array there are all
/// elements. Which clock values a decision applies to is left out.
pub fn of_process(
    network: &Network,
    strategy: &Strategy,
    process: &str,
    variables: &[String],
) -> Option<Vec<ProcessDecision>> {
    let process = network
        .processes
        .iter()
        .position(|one| one.name == process)? as u32;
    let places = places(network, variables)?;
    // Few of the states are such, so only these are joined by their words.
    let mut first: HashMap<&[i32], &Decision> = HashMap::new();
    let mut order: Vec<&[i32]> = Vec::new();
    for state in &strategy.states {
        let moves = state.decisions.iter().filter(|one| {
            let parts = one.action.as_deref().unwrap_or_default();
            parts.iter().any(|part| part.process == process)
        });
        let Some(decision) = moves.min_by_key(|one| one.rank) else {
            continue;
        };
        let known = first.entry(&state.words).or_insert_with(|| {
            order.push(&state.words);
            decision
        });
        if decision.rank < known.rank {
            *known = decision;
        }
    }
    let found = order.into_iter().map(|words| {
        let values = places
            .iter()
            .map(|offsets| offsets.iter().map(|&offset| words[offset]).collect());
        ProcessDecision {
            values: values.collect(),
            parts: first[words].action.clone().unwrap_or_default(),
        }
    });
    Some(found.collect())
}

/// Where the scalar parts of variables begin; `None` if a name is unknown.
fn places(network: &Network, variables: &[String]) -> Option<Vec<Vec<usize>>> {
    let mut known: HashMap<String, Vec<usize>> = HashMap::new();
    text::for_each_place(network, |name, ValuePlace { offset, .. }| {
        let whole = name.split('[').next().unwrap_or(name);
        known.entry(whole.to_owned()).or_default().push(offset);
    });
    let places = variables.iter().map(|name| known.get(name).cloned());
    places.collect()
}
