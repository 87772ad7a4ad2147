//! Branch points behind edges of the controller: it chooses the edge, the environment picks the
//! leg.
//!
//! The *entry* of a move are its edges with their `select` values, without the legs. The controller
//! gets into some valuations by an entry where one of its legs is possible and all that are lead
//! there. A strategy of the controller names entries; one of the environment says which leg it
//! picks.
//!
//! Moves with the same entry follow each other in the order of moves.

use rustc_hash::FxHashMap;

use crate::ir::Network;
use crate::network::{Moves, Part, is_same_entry};
use crate::zones::Federation;
use crate::zones::federation::block_bytes;

use super::node::Edge;
use crate::game::Player;
use crate::game::backward::solver::{Solver, Win};
use crate::game::strategy::attractor::Decision;
use crate::zones::federation::table_bytes;

/// The entries with several legs that the controller owns.
#[derive(Debug, Default)]
pub(in crate::game) struct Chances {
    /// Whether the network has any.
    is_possible: bool,
    /// By node: the edges of each.
    entries: FxHashMap<u32, Vec<Vec<u32>>>,
    bytes: usize,
}

impl Chances {
    /// None yet.
    pub(super) fn new(network: &Network) -> Chances {
        let mut edges = network.processes.iter().flat_map(|process| &process.edges);
        Chances {
            is_possible: edges.any(|edge| edge.controllable && edge.branches.len() > 1),
            ..Chances::default()
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

    /// Marks the legs among the edges of a node that was just expanded, which are those from
    /// `first` on.
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

impl Solver<'_, '_, '_> {
    /// The valuations from which all legs of an entry that are possible lead into the given
    /// valuations of their targets, and some leg is possible.
    pub(in crate::game) fn before_all<'w>(
        &self,
        legs: impl IntoIterator<Item = (u32, &'w Win)>,
    ) -> Federation {
        let mut into = Federation::empty(self.graph.dimension());
        let mut past = Federation::empty(self.graph.dimension());
        for (leg, hit) in legs {
            let edge = &self.graph.edges[leg as usize];
            into.unite(&self.before(edge, hit));
            past.unite(&self.missing(edge, (hit, None)));
        }
        into.subtract(&past);
        into
    }

    /// The valuations from which all legs of an entry that are possible lead into valuations that
    /// the seeker is not known to win, and some leg is possible. The controller is the evader.
    pub(in crate::game) fn spoiling_all(&self, legs: &[u32]) -> Federation {
        let mut away = Federation::empty(self.graph.dimension());
        let mut back = Federation::empty(self.graph.dimension());
        for &leg in legs {
            let edge = &self.graph.edges[leg as usize];
            away.unite(&self.spoiling(edge));
            back.unite(&self.won_by_leg(leg, &self.win[edge.target as usize]));
        }
        away.subtract(&back);
        away
    }

    /// The valuations from which the environment, which seeks something, gets into some of the
    /// target of a leg by picking it: nowhere if the controller may wait on the way.
    pub(in crate::game) fn won_by_leg(&self, leg: u32, hit: &Win) -> Federation {
        let edge = &self.graph.edges[leg as usize];
        if self.graph.programs.waits(edge.program) {
            return Federation::empty(self.graph.dimension());
        }
        self.before(edge, hit)
    }

    /// The legs of an entry, each with what is known of its target.
    pub(in crate::game) fn targets_of<'w>(
        &self,
        legs: &[u32],
        known: &'w [Win],
    ) -> impl Iterator<Item = (u32, &'w Win)> {
        legs.iter().map(|&leg| {
            let target = self.graph.edges[leg as usize].target;
            (leg, &known[target as usize])
        })
    }

    /// Whether the controller, which seeks something, gets into won nodes by an entry from
    /// everywhere in a node, as far as words decide.
    pub(in crate::game) fn wins_by_an_entry(&self, node: u32) -> bool {
        let is_won = |leg: &u32| {
            let edge = &self.graph.edges[*leg as usize];
            let is_whole = edge.is_total || edge.length == 1;
            is_whole && matches!(self.win[edge.target as usize], Win::Everything)
        };
        let is_total = |leg: &u32| self.graph.edges[*leg as usize].is_total;
        let mut entries = self.graph.chances.of(node).iter();
        self.seeker == Player::Controller
            && entries.any(|legs| legs.iter().all(is_won) && legs.iter().any(is_total))
    }

    /// Adds the legs that the environment picks in some valuations of a node, each where the ones
    /// before it are not picked; `picked` says where a leg is good for it. Adds their edges to
    /// those that play may take.
    pub(in crate::game) fn pick_legs(
        &mut self,
        node: u32,
        (part, rank): (&Federation, u32),
        picked: &mut dyn FnMut(&Self, u32) -> Federation,
        (legs, taken): (&mut Vec<Decision>, &mut Vec<u32>),
    ) -> Result<(), crate::network::Failure> {
        if self.graph.chances.of(node).is_empty() {
            return Ok(());
        }
        let moves = crate::game::strategy::attractor::moves_of(self, node)?;
        for entry in self.graph.chances.of(node).to_vec() {
            let mut left = part.clone();
            for leg in entry {
                let zones = picked(self, leg).intersection(&left);
                if zones.is_empty() {
                    continue;
                }
                left.subtract(&zones);
                let ordinal = self.graph.edges[leg as usize].ordinal;
                let action = moves.get(ordinal as usize).parts.to_vec();
                legs.push(Decision {
                    zones,
                    action: Some(action),
                    rank,
                });
                taken.push(leg);
            }
        }
        Ok(())
    }
}

/// The edges of a move by their first legs: how a strategy of the controller names it.
pub(in crate::game) fn entry_of(parts: &[Part]) -> Vec<Part> {
    let parts = parts.iter().map(|&part| Part { branch: 0, ..part });
    parts.collect()
}
