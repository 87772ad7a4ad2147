//! Machines of a controller who goes by observations.
//!
//! A machine that has come to one of its states stays there as long as what it sees stays the same.
//! This is a *stage*: a state of the machine and what is seen in it.

use std::collections::HashMap;

pub use crate::ir::Action;
use crate::ir::{Network, Predicate};

use super::moves::{Part, entry};

/// A state of the machine; the first one is the initial one.
#[derive(Clone, Debug)]
pub struct MachineState {
    /// What is proposed.
    pub action: Action,
    /// By next observation: the index of the next state.
    pub next: Vec<(Vec<bool>, usize)>,
}

/// A state of the machine, with what is seen in it.
struct Stage {
    state: usize,
    seen: Vec<bool>,
    /// The stages that others are left for, by what is seen then.
    next: Vec<(Vec<bool>, u32)>,
}

/// A machine, and what it observes.
pub(super) struct Machine<'a> {
    states: &'a [MachineState],
    observations: &'a [Predicate],
    stages: Vec<Stage>,
}

impl<'a> Machine<'a> {
    /// The machine, at its first stage in a state of the model in which this is seen. It must have
    /// a state.
    pub(super) fn new(
        states: &'a [MachineState],
        observations: &'a [Predicate],
        seen: Vec<bool>,
    ) -> Machine<'a> {
        let mut machine = Machine {
            states,
            observations,
            stages: Vec::new(),
        };
        let mut index = HashMap::from([((0, seen.clone()), 0)]);
        let mut found = vec![(0, seen)];
        while let Some((state, seen)) = found.get(machine.stages.len()).cloned() {
            let next = states[state].next.iter();
            let next = next
                .filter(|(other, _)| *other != seen)
                .map(|(other, next)| {
                    let stage = (*next, other.clone());
                    let number = index.len() as u32;
                    let number = *index.entry(stage.clone()).or_insert_with(|| {
                        found.push(stage);
                        number
                    });
                    (other.clone(), number)
                });
            let next = next.collect();
            machine.stages.push(Stage { state, seen, next });
        }
        machine
    }

    /// How many stages there are; the first has the number 0.
    pub(super) fn stages(&self) -> usize {
        self.stages.len()
    }

    /// What it proposes at a stage.
    pub(super) fn action(&self, stage: u32) -> Action {
        self.states[self.stages[stage as usize].state].action
    }

    /// What the controller sees.
    pub(super) fn observations(&self) -> &'a [Predicate] {
        self.observations
    }

    /// The stage after this is seen at a stage; `None` if the machine has none.
    pub(super) fn after(&self, stage: u32, seen: &[bool]) -> Option<u32> {
        let here = &self.stages[stage as usize];
        if here.seen == seen {
            return Some(stage);
        }
        let mut next = here.next.iter();
        next.find(|(one, _)| one == seen).map(|&(_, next)| next)
    }
}

/// Whether an action proposes a move of the controller, with this channel.
pub(super) fn proposes(
    network: &Network,
    action: Action,
    parts: &[Part],
    channel: Option<u32>,
) -> bool {
    let part = parts[0];
    // Legs with channels are proposed by their entry.
    let is_edge = match &network.edge(part).leg {
        Some(leg) if !leg.follows_sync => true,
        _ => channel.is_none(),
    };
    match action {
        Action::Wait => false,
        Action::Channel(meant) => !is_edge && channel == Some(meant.0),
        Action::Edge(proposed) => is_edge && entry(network, &[part]) == entry(network, &[proposed]),
    }
}
