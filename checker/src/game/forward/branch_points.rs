//! Branch points after edges of the controller: it chooses the edge, and the environment picks the
//! leg.
//!
//! The *entry* of a move is its edges with their `select` values, without the legs. By an entry,
//! the controller gets into given valuations where at least one leg is possible and all possible
//! legs lead into them. A strategy of the controller names entries; a strategy of the environment
//! says which leg it picks.
//!
//! Moves with the same entry are successive in the order of moves.

use rustc_hash::FxHashMap;

use crate::ir::Network;
use crate::network::{Moves, Part, is_same_entry};
use crate::zones::federation::{block_bytes, table_bytes};

use super::node::Edge;

/// The entries with several legs that the controller owns.
#[derive(Debug, Default)]
pub(in crate::game) struct BranchPoints {
    /// Whether the network has any.
    is_possible: bool,
    /// For each node: its entries with several legs, and the edges of each.
    entries: FxHashMap<u32, Vec<Vec<u32>>>,
    bytes: usize,
}

impl BranchPoints {
    /// None yet.
    pub(super) fn new(network: &Network) -> BranchPoints {
        let mut edges = network.processes.iter().flat_map(|process| &process.edges);
        BranchPoints {
            is_possible: edges.any(|edge| edge.controllable && edge.branches.len() > 1),
            ..BranchPoints::default()
        }
    }

    /// Whether there may be any.
    pub(in crate::game) fn is_possible(&self) -> bool {
        self.is_possible
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.bytes + table_bytes::<(u32, Vec<Vec<u32>>)>(self.entries.capacity())
    }

    /// Marks the legs among the edges of a node that was just expanded. Its edges start at `first`.
    pub(super) fn find(&mut self, node: u32, (edges, first): (&mut [Edge], usize), moves: &Moves) {
        if !self.is_possible {
            return;
        }
        let parts = |edge: &Edge| moves.get(edge.ordinal as usize).parts;
        let mut entries = Vec::new();
        let mut start = first;
        for end in first + 1..=edges.len() {
            let goes_on = edges.get(end).is_some_and(|edge| {
                edge.controllable && is_same_entry(parts(edge), parts(&edges[start]))
            });
            if goes_on {
                continue;
            }
            let ordinals = [&edges[start], &edges[end - 1]].map(|edge| edge.ordinal);
            // Several edges of the same move are pieces of it.
            if ordinals[0] != ordinals[1] {
                for edge in &mut edges[start..end] {
                    edge.is_leg = true;
                }
                entries.push((start as u32..end as u32).collect::<Vec<_>>());
            }
            start = end;
        }
        if entries.is_empty() {
            self.entries.remove(&node);
        } else {
            let legs = entries.iter().map(|legs| block_bytes(size_of_val(&**legs)));
            self.bytes += legs.sum::<usize>() + block_bytes(size_of_val(&*entries));
            self.entries.insert(node, entries);
        }
    }

    /// The entries of a node, each with its edges.
    pub(in crate::game) fn of(&self, node: u32) -> &[Vec<u32>] {
        if self.entries.is_empty() {
            return &[];
        }
        self.entries.get(&node).map_or(&[], |entries| entries)
    }
}

/// The edges of a move with their first legs: this is the name of the move in a strategy of the
/// controller.
pub(in crate::game) fn entry_of(parts: &[Part]) -> Vec<Part> {
    let parts = parts.iter().map(|&part| Part { branch: 0, ..part });
    parts.collect()
}
