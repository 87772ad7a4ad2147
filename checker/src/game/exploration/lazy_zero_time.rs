//! Which moves of the evader are explored where time does not pass: only as many as it is known to
//! need.
//!
//! For a verdict, one way to evade is enough. So where time does not pass, and moves of the evader
//! are possible everywhere, these moves are explored one after the other, in the order of moves:
//! the next one when the seeker has won a part of all before. The others are in *reserve*. Where
//! time passes, moves are held back instead: see [`super::lazy_safety`].
//!
//! The nodes *in play* are those that play reaches by moves of the seeker, and by those moves of
//! the evader that are neither in reserve nor held back. Play does not continue where the seeker
//! has won everything, or cannot win any more ([`crate::game::backward::losing_untimed`]). Only
//! nodes in play need to be explored. Suppose that all of them are explored, no more wins must be
//! computed, and the initial valuation is not won. Then the evader wins. Proof: consider the game
//! in which it never uses a move in reserve. There, what the seeker wins of the nodes in play
//! follows from what it wins of each other, and all of that is known. More moves do not harm the
//! evader.

use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// To find the nodes in play, at most this many nodes are visited for each explored state. If that
/// is not enough, reserves do not pay.
const MOST_LOOKS: u64 = 32;

/// The states that are added to the explored ones for that.
const STATES_OF_GRACE: u64 = 1 << 10;

impl Solver<'_, '_, '_> {
    /// Decides whether moves of the evader from a node that was just expanded are kept in reserve.
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

    /// Lets that node be explored to which the evader must move from a node with a reserve. If no
    /// target is certain to help, all are explored.
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

    /// Where the evader must move from a node in which time does not pass: to the first node that
    /// is not won anywhere.
    fn chosen(&self, node: u32) -> Option<u32> {
        let mut edges = self.graph.edges_from(node).iter();
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

    /// Puts the unexplored nodes in play on the waiting list, and no others; returns for each node
    /// whether it is in play.
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

    /// Counts the nodes out of play as won, once the evader has won. Their winner is unknown, and
    /// the evader does not need them.
    pub(in crate::game) fn avoid_out_of_play(&mut self, is_in_play: &[bool]) {
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
