//! States and moves as values, and why there may be none.

use crate::exec::RunTimeError;
use crate::ir::Network;

pub use crate::ir::Part;

/// Why a state could not be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The model's code failed.
    RunTime(RunTimeError),
    /// The initial state breaks an invariant.
    InitialInvariant,
    /// The check needs something that is not supported here; the text names it.
    Unsupported(&'static str),
}

impl From<RunTimeError> for Error {
    fn from(error: RunTimeError) -> Error {
        Error::RunTime(error)
    }
}

/// A state: words and clock values in ticks, the reference clock first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct State {
    /// The words.
    pub words: Vec<i32>,
    /// The clock values in ticks.
    pub clocks: Vec<i64>,
}

/// A move: the parts of its participants, the sender (or the only process) first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Move {
    /// The participants.
    pub parts: Vec<Part>,
    /// Whether the controller owns it: all participating edges are controllable.
    pub controllable: bool,
    /// The index of the channel of the synchronisation; `None` for an internal edge.
    pub channel: Option<u32>,
    /// Whether it synchronises on an urgent channel.
    pub is_urgent: bool,
    /// The priority of its channel, then the greatest of its participants.
    pub level: (u32, u32),
}

/// What is chosen of a move, where the rest is chance: its edges with their `select` values,
/// without the branches; of legs that are edges the entry. If the sender's leg has the
/// synchronisation, it says who takes part.
pub(super) fn entry(network: &Network, parts: &[Part]) -> Vec<(u32, u32, u32)> {
    let mut entry = Vec::with_capacity(parts.len());
    for part in parts {
        let Some(leg) = &network.edge(*part).leg else {
            entry.push((part.process, part.edge, part.select));
            continue;
        };
        let is_first = entry.is_empty();
        entry.push((part.process, leg.first.0, part.select / leg.combinations));
        if is_first && !leg.follows_sync {
            break;
        }
    }
    entry
}

/// Whether the same is chosen of two moves.
pub(super) fn is_same_entry(network: &Network, one: &[Part], other: &[Part]) -> bool {
    entry(network, one) == entry(network, other)
}
