//! The question that a game under partial observation answers, and the form of its strategies.

pub use crate::ir::Action;
use crate::ir::{Network, Predicate};
use crate::network::{MoveRef, entry_of};

use super::knowledge::{Knowledge, Observation};
use crate::game::Forced;

impl Action {
    /// The action that allows a move; `None` if the move is the environment's.
    pub(super) fn of(network: &Network, one: MoveRef<'_>) -> Option<Action> {
        if !one.controllable {
            return None;
        }
        let leg = network.edge(one.parts[0]).leg.as_ref();
        let has_channels = leg.is_some_and(|leg| !leg.follows_sync);
        Some(match one.channel {
            Some(channel) if !has_channels => Action::Channel(channel),
            _ => Action::Edge(entry_of(network, one.parts)[0]),
        })
    }
}

/// A game under partial observation.
#[derive(Clone, Copy, Debug)]
pub struct Question<'q> {
    /// The predicates that the controller sees.
    pub observations: &'q [Predicate],
    /// Where play ends and is won; with `None` nowhere.
    pub goal: Option<&'q Predicate>,
    /// What must hold until then; with `None` nothing.
    pub keep: Option<&'q Predicate>,
    /// Whether the goal must be reached; otherwise keeping is enough.
    pub must_reach: bool,
    /// When the environment must move where time stops.
    pub forced: Forced,
}

/// A strategy of the controller: what to propose in which state of the machine.
#[derive(Clone, Debug)]
pub struct Machine {
    /// The states, the initial one first; none if the game is won before it begins.
    pub states: Vec<MachineState>,
}

/// A state of the machine.
#[derive(Clone, Debug)]
pub struct MachineState {
    /// The states in which this state proposes its action, among them all in which play may be on
    /// entry.
    pub knowledge: Knowledge,
    /// What it proposes.
    pub action: Action,
    /// For each next observation: the state in which play continues.
    pub next: Vec<(Observation, usize)>,
}
