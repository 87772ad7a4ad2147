//! Nodes and edges of the game graph, and what the words and zone of a node say about it.

use crate::search::store::discrete_states::DiscreteId;
use crate::zones::Federation;
use crate::zones::zone_table::ZoneId;

use super::clock_programs::ProgramId;

/// The greatest number of moves in one chain; longer chains are cut by a node, so that loops end.
pub(super) const LONGEST_CHAIN: usize = 64;

/// No node or edge.
pub const NONE: u32 = u32::MAX;

/// A symbolic state.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Its words.
    pub discrete: DiscreteId,
    /// Its zone.
    pub zone: ZoneId,
    /// The next node with the same words.
    pub(super) next: u32,
    /// Its edges, once it is expanded.
    pub edges: (u32, u32),
    /// The first edge into it, [`NONE`] without one.
    pub first_in: u32,
    /// Whether its edges are known.
    pub is_expanded: bool,
    /// Whether time may pass in it; known once it is expanded.
    pub delays: bool,
    /// Where the goal holds, and where what must be kept does not.
    pub standing: Standing,
}

/// Whether the words decide the objective in a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// The goal holds nowhere, and nothing is broken.
    Open,
    /// The goal holds in the whole node.
    Goal,
    /// What must be kept is broken in the whole node, and the goal holds nowhere.
    Broken,
    /// Both depend on the clocks: see [`Parts`].
    Mixed,
    /// The target cannot be reached any more: see [`super::dead_ends`].
    Dead,
}

/// The parts of a mixed node.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Where the goal holds.
    pub goal: Federation,
    /// Where neither the goal holds nor what must be kept.
    pub broken: Federation,
}

/// A move, with the moves that follow without a choice.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Where it starts.
    pub source: u32,
    /// Where it ends.
    pub target: u32,
    /// The next edge into the same target.
    pub next_in: u32,
    /// Its effect on clocks.
    pub program: ProgramId,
    /// The index of the first move among the moves of the source.
    pub ordinal: u32,
    /// The processes that take part in the first move, one bit for each; processes with the same
    /// index modulo 32 share one.
    pub movers: u32,
    /// How many moves it stands for.
    pub length: u8,
    /// Whether the controller owns the first move.
    pub controllable: bool,
    /// Whether it leads from every valuation of the source into the target.
    pub is_total: bool,
    /// Whether it is one of several legs of an entry that the controller owns.
    pub is_leg: bool,
}

/// Where an edge starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    pub(super) node: u32,
    /// The index of the first move.
    pub(super) ordinal: u32,
    pub(super) controllable: bool,
    pub(super) movers: u32,
}
