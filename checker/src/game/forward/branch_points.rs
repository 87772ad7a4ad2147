//! Branch points after edges of the controller: it chooses the edge, and the environment picks the
//! leg.
//!
//! By an *entry* ([`entry_of`]), the controller gets into given valuations where at least one leg
//! is possible and all possible legs lead into them. A strategy of the controller names entries; a
//! strategy of the environment says which leg it picks.
//!
//! Moves with the same entry are successive in the order of moves, unless legs are edges of the
//! network.

use rustc_hash::FxHashMap;

use crate::ir::Network;
use crate::network::{Moves, entry_of, is_same_entry};
use crate::zones::federation::{block_bytes, table_bytes};

use super::node::Edge;

/// The entries with several legs that the controller owns.
#[derive(Debug, Default)]
pub(in crate::game) struct BranchPoints {
    /// Whether the network has any.
    is_possible: bool,
    /// Whether legs are edges of the network.
    are_edges: bool,
    /// For each node: its entries with several legs, and the edges of each.
    entries: FxHashMap<u32, Vec<Vec<u32>>>,
    bytes: usize,
}

impl BranchPoints {
    /// None yet.
    pub(super) fn new(network: &Network) -> BranchPoints {
        let mut edges = network.processes.iter().flat_map(|process| &process.edges);
        BranchPoints {
            is_possible: edges
                .any(|edge| edge.controllable && (edge.branches.len() > 1 || edge.leg.is_some())),
            are_edges: network.features.legs,
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
    pub(super) fn find(
        &mut self,
        network: &Network,
        node: u32,
        edges: &mut [Edge],
        first: usize,
        moves: &Moves,
    ) {
        if !self.is_possible {
            return;
        }
        let mut entries = if self.are_edges {
            apart(network, edges, first, moves)
        } else {
            successive(network, edges, first, moves)
        };
        // Several edges of the same move are pieces of it.
        entries.retain(|legs| {
            let ordinal = |leg: &u32| edges[*leg as usize].ordinal;
            legs.iter().any(|leg| ordinal(leg) != ordinal(&legs[0]))
        });
        for &leg in entries.iter().flatten() {
            edges[leg as usize].is_leg = true;
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

/// The controllable edges of a node by their entries, where those of an entry are successive.
fn successive(network: &Network, edges: &[Edge], first: usize, moves: &Moves) -> Vec<Vec<u32>> {
    let parts = |edge: &Edge| moves.get(edge.ordinal as usize).parts;
    let is_same = |one: &Edge, other: &Edge| {
        other.controllable && is_same_entry(network, parts(one), parts(other))
    };
    let mut start = first as u32;
    let entries = edges[first..].chunk_by(is_same).map(|legs| {
        let end = start + legs.len() as u32;
        (std::mem::replace(&mut start, end)..end).collect()
    });
    entries.collect()
}

/// The controllable edges of a node by their entries.
fn apart(network: &Network, edges: &[Edge], first: usize, moves: &Moves) -> Vec<Vec<u32>> {
    let mut places = FxHashMap::default();
    let mut entries: Vec<Vec<u32>> = Vec::new();
    for (number, edge) in edges.iter().enumerate().skip(first) {
        if !edge.controllable {
            continue;
        }
        let entry = entry_of(network, moves.get(edge.ordinal as usize).parts);
        let place = *places.entry(entry).or_insert(entries.len());
        if place == entries.len() {
            entries.push(Vec::new());
        }
        entries[place].push(number as u32);
    }
    entries
}
