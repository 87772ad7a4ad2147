//! The bytes that a game takes, by which the limit of memory goes.
//!
//! Everything that grows with the game counts: the graph, what nodes win with what is left of them
//! and what was gained when, the lists of nodes, what was computed before, and what is set aside
//! meanwhile. Zones at hand in an operation are asked for where they are many
//! ([`crate::cancellation::ask_for`]).
//!
//! Invariants:
//! * Vectors that only grow count by what is in them: room at their end takes no memory before it
//!   is written to. Hash tables count whole.
//! * The valuations that are kept have no room to spare.

use crate::search::limits::Counters;
use crate::zones::federation::{block_bytes, table_bytes};
use crate::zones::{Bound, Federation};

use super::solver::{Gain, Pending, Solver, Win};
use super::winning_sets::Gained;

impl Win {
    /// The bytes that it takes beside the value itself.
    pub(super) fn heap_bytes(&self) -> u64 {
        match self {
            Win::Nothing | Win::Everything => 0,
            Win::Part(part) => part.heap_bytes() as u64,
        }
    }
}

impl Gained {
    /// The bytes that it takes beside the value itself.
    pub(super) fn heap_bytes(&self) -> u64 {
        let bytes = match self {
            Gained::Nothing | Gained::Everything(None) => 0,
            Gained::Everything(Some(part)) => part.heap_bytes(),
            Gained::Part { won, part, rest } => {
                won.heap_bytes() + part.heap_bytes() + rest.heap_bytes()
            }
        };
        bytes as u64
    }

    /// Gives up room to spare.
    pub(super) fn shrink(&mut self) {
        match self {
            Gained::Nothing | Gained::Everything(None) => {}
            Gained::Everything(Some(part)) => part.shrink(),
            Gained::Part { won, part, rest } => {
                won.shrink();
                part.shrink();
                rest.shrink();
            }
        }
    }
}

/// The bytes that the gains of a node take beside the value itself.
pub(super) fn gains_bytes(gains: &Vec<Gain>) -> u64 {
    let parts = gains.iter().filter_map(|gain| gain.part.as_ref());
    let zones: usize = parts.map(Federation::heap_bytes).sum();
    (block_bytes(gains.capacity() * size_of::<Gain>()) + zones) as u64
}

/// The bytes that winning valuations by node take.
pub(in crate::game) fn wins_bytes(wins: &[Win]) -> u64 {
    size_of_val(wins) as u64 + wins.iter().map(Win::heap_bytes).sum::<u64>()
}

impl Solver<'_, '_, '_> {
    /// What was done so far.
    pub fn counters(&self) -> Counters {
        Counters {
            explored: self.graph.explored,
            stored: self.graph.nodes.len() as u64,
            waiting: self.frontier.len() as u64,
            bytes: self.bytes(),
        }
    }

    fn bytes(&self) -> u64 {
        let by_node = size_of::<Win>() + size_of::<Vec<Gain>>() + size_of::<Pending>();
        let lists = self.win.len() * by_node
            + self.has_hope.len()
            + (self.updates.capacity() + self.deferred.capacity()) * size_of::<u32>()
            + self.frontier.bytes()
            + self.defences.bytes()
            + table_bytes::<(u32, Federation)>(self.rest.capacity());
        self.graph.bytes()
            + self.repeats.bytes()
            + lists as u64
            + self.gained_bytes
            + self.aside_bytes
    }

    /// The bytes of a zone.
    pub(in crate::game) fn zone_bytes(&self) -> u64 {
        (self.graph.dimension().pow(2) * size_of::<Bound>()) as u64
    }
}
