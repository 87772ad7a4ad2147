//! Which moves of the evader are explored: as many as it needs, if it is known.
//!
//! When only a verdict is wanted, a single way to evade is enough. So where time does not pass, and
//! the evader has moves that lead on from everywhere, one of these after the other is explored, in
//! the order of moves: the next one when the seeker has won something of all before. The others are
//! in *reserve*. Where time passes, moves are held back instead: see [`super::lazy_safety`].
//!
//! The nodes *in play* are those that play gets to by moves of the seeker, and by those of the
//! evader that are neither in reserve nor held back; it does not go on where the seeker has won
//! everything, or cannot win any more ([`crate::game::backward::losing_untimed`]). Only they need
//! to be explored. If all of them are, and no wins are to be computed any more, but the initial
//! valuation is not won, then the evader wins. For in the game in which it never moves to what is
//! in reserve, what the seeker wins of the nodes in play follows from what it wins of each other,
//! and it wins nothing that is not known; and more moves do the evader no harm.

use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// At most this many nodes are looked at for each explored state to find those in play; if that is
/// not enough, reserves do not pay.
const MOST_LOOKS: u64 = 32;

/// States that are counted beside those that are explored, for that.
const STATES_OF_GRACE: u64 = 1 << 10;

impl Solver<'_, '_, '_> {
    /// Whether moves of the evader from a node that was just expanded are kept in reserve.
    pub(super) fn begin_reserve(&mut self, node: u32) -> bool {
        let is_kept = self.graph.symbolic.tuning().lazy_zero_time
            && self.exploration.reserve.is_kept
            && self.graph.branch_points.of(node).is_empty()
            && !self.graph.nodes[node as usize].delays
            && self.chosen(node).is_some();
        if is_kept {
            self.exploration.reserve.sources[node as usize] = true;
            self.exploration.reserve.is_used = true;
        }
        is_kept
    }

    /// Lets the node be explored that the evader is to move to from a node with a reserve; all, if
    /// it wins nowhere for sure.
    pub(in crate::game) fn choose(&mut self, node: u32) {
        if !self.exploration.reserve.sources[node as usize] {
            return;
        }
        match self.chosen(node) {
            Some(target) if self.is_unexplored(target) => {
                self.wait_for(target);
                self.exploration.waiting.add_spoiler(target);
            }
            Some(_) => {}
            None => self.use_reserve(node),
        }
    }

    /// The node that the evader is to move to from a node in which time does not pass: the first
    /// one of which nothing is won.
    fn chosen(&self, node: u32) -> Option<u32> {
        let mut edges = self.graph.edges[self.graph.edges_of(node)].iter();
        let open = edges.find(|edge| {
            self.is_evasion(edge)
                && edge.is_total
                && matches!(self.won.win[edge.target as usize], Win::Nothing)
        });
        open.map(|edge| edge.target)
    }

    fn use_reserve(&mut self, node: u32) {
        self.exploration.reserve.sources[node as usize] = false;
        for index in self.graph.edges_of(node) {
            let edge = self.graph.edges[index];
            if self.is_evasion(&edge) {
                self.wait_for(edge.target);
            }
        }
    }

    /// Lets the unexplored nodes wait that are in play, and no others; returns by node whether it
    /// is in play.
    pub(in crate::game) fn wait_for_nodes_in_play(&mut self) -> Vec<bool> {
        let reserve = &mut self.exploration.reserve;
        if reserve.looks > MOST_LOOKS * (self.graph.explored + STATES_OF_GRACE) {
            reserve.is_kept = false;
            reserve.sources.fill(false);
            self.exploration.held.release();
        }
        let mut is_in_play = vec![false; self.graph.nodes.len()];
        is_in_play[0] = true;
        let mut stack = vec![0];
        let mut unexplored = Vec::new();
        while let Some(node) = stack.pop() {
            self.exploration.reserve.looks += 1;
            if self.is_unexplored(node) {
                unexplored.push(node);
            }
            if !self.may_win(node) || matches!(self.won.win[node as usize], Win::Everything) {
                continue;
            }
            let has_reserve = self.exploration.reserve.sources[node as usize];
            let chosen = has_reserve.then(|| self.chosen(node)).flatten();
            for index in self.graph.edges_of(node) {
                let edge = &self.graph.edges[index];
                let is_left = has_reserve && self.is_evasion(edge) && chosen != Some(edge.target)
                    || self.exploration.held.holds(index);
                if !is_left && !std::mem::replace(&mut is_in_play[edge.target as usize], true) {
                    stack.push(edge.target);
                }
            }
        }
        self.exploration.waiting.clear();
        for node in unexplored.into_iter().rev() {
            self.wait_for(node);
        }
        is_in_play
    }

    /// Counts the nodes out of play as won, once the evader has won: nobody knows who wins there,
    /// and it has no need of them.
    pub(in crate::game) fn keep_in_play(&mut self, is_in_play: &[bool]) {
        for (node, is_in_play) in is_in_play.iter().enumerate() {
            if !is_in_play && self.may_win(node as u32) && !self.is_decided(node as u32) {
                self.won.replace_win(node, Win::Everything);
            }
        }
    }

    pub(in crate::game) fn is_unexplored(&self, node: u32) -> bool {
        !self.graph.nodes[node as usize].is_expanded && !self.is_decided(node)
    }

    pub(super) fn is_evasion(&self, edge: &Edge) -> bool {
        !self.seeker.owns(edge.controllable)
    }
}
