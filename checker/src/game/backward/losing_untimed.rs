//! Where the seeker may still win, as the explored part of the graph shows.
//!
//! A node *may be won* if the seeker has won a part of it, if it is not expanded, or if a move of
//! the seeker leads to a node that may be won. A move of the evader to such a node counts only if
//! the evader may have to make it:
//! * if time may stop in the node, since before that the evader need not move,
//! * if no other move of the evader is possible everywhere in the node and leads to a node that
//!   cannot be won, and
//! * if the evader is the controller and the environment has to move wherever it can
//!   ([`Forced::Neutral`]). If the environment can move everywhere in the node, the controller may
//!   leave the move to it.
//!
//! The other nodes are lost: the evader stays among them whatever the seeker does. So if the
//! initial node is one of them, the game is over, however much of the graph is unexplored. Nodes to
//! which only lost nodes lead need not be explored. Clocks are ignored, so a node that may be won
//! may be lost.
//!
//! As the graph grows, more nodes are lost, and each lost node stays lost.
//!
//! All of this is computed again when the graph has doubled. With a guide, that is too late: it
//! leads on into a part of the game that one answer of the evader has just decided. So after each
//! expansion, the new node and its predecessors are asked, as long as they turn out to be lost.
//! This finds the same nodes but for those that lead to each other on cycles.

use crate::game::backward::winning_sets::Win;
use crate::game::solver::Solver;
use crate::game::{Forced, Player};

impl Solver<'_, '_, '_> {
    /// Finds again the nodes that may be won, and returns whether the initial one is among them. If
    /// it is not, all of them count as won afterwards, so that the strategy of the evader avoids
    /// them.
    pub(in crate::game) fn may_seeker_win(&mut self) -> bool {
        let count = self.graph.nodes.len() as u32;
        let mut may_be_won = vec![false; count as usize];
        let mut waiting: Vec<u32> = (0..count).filter(|&node| self.may_win_here(node)).collect();
        for &node in &waiting {
            may_be_won[node as usize] = true;
        }
        while let Some(node) = waiting.pop() {
            for edge in self.graph.edges_into(node) {
                let source = edge.source;
                let is_useful = self.seeker.owns(edge.controllable)
                    || self.may_stop(source)
                        && !self.may_escape(source, |node| !may_be_won[node as usize]);
                if is_useful
                    && !self.is_decided(source)
                    && !std::mem::replace(&mut may_be_won[source as usize], true)
                {
                    waiting.push(source);
                }
            }
        }
        let is_open = may_be_won[0];
        if !is_open {
            for (node, may_be_won) in may_be_won.iter().enumerate() {
                let win = if *may_be_won {
                    Win::Everything
                } else {
                    Win::Nothing
                };
                self.won.replace_win(node, win);
            }
        }
        self.exploration.may_win = may_be_won;
        is_open
    }

    /// Notes that an expanded node is lost, if it is, and which of those before it are lost then.
    pub(in crate::game) fn note_if_lost(&mut self, node: u32) {
        let mut asked = vec![node];
        while let Some(node) = asked.pop() {
            if self.is_lost(node) || self.leads_to_a_win(node) {
                continue;
            }
            let may_win = &mut self.exploration.may_win;
            may_win.resize(self.graph.nodes.len().max(may_win.len()), true);
            may_win[node as usize] = false;
            asked.extend(self.graph.edges_into(node).map(|edge| edge.source));
        }
    }

    /// Whether a node is known to be lost.
    fn is_lost(&self, node: u32) -> bool {
        !self.may_win(node)
            || self.is_decided(node) && matches!(self.won.win[node as usize], Win::Nothing)
    }

    /// Whether a node may be won, as far as it and its successors tell.
    fn leads_to_a_win(&self, node: u32) -> bool {
        let is_lost = |node| self.is_lost(node);
        let is_forced = || self.may_stop(node) && !self.may_escape(node, is_lost);
        let mut edges = self.graph.edges_from(node).iter();
        self.may_win_here(node)
            || edges.any(|edge| {
                !is_lost(edge.target) && (self.seeker.owns(edge.controllable) || is_forced())
            })
    }

    /// Whether a node might be won at the last computation, or is newer than it.
    pub(in crate::game) fn may_win(&self, node: u32) -> bool {
        self.exploration
            .may_win
            .get(node as usize)
            .is_none_or(|&it| it)
    }

    /// Counts the nodes that were left unexpanded as won, once the evader has won. The evader does
    /// not need them, and their winner is unknown.
    pub(in crate::game) fn avoid_unexpanded(&mut self) {
        for node in 0..self.won.win.len() {
            if !self.graph.nodes[node].is_expanded && !self.is_decided(node as u32) {
                self.won.replace_win(node, Win::Everything);
            }
        }
    }

    /// Whether the evader has a move that is possible everywhere in a node and leads to one that
    /// cannot be won, or may leave the move to the environment.
    fn may_escape(&self, node: u32, is_lost: impl Fn(u32) -> bool) -> bool {
        let mut edges = self.graph.edges_from(node).iter();
        edges.any(|edge| {
            let is_own = self.seeker.owns(edge.controllable);
            edge.is_total
                && !edge.is_leg
                && (is_own && self.seeker == Player::Environment && self.forced == Forced::Neutral
                    || !is_own && is_lost(edge.target))
        })
    }

    fn may_win_here(&self, node: u32) -> bool {
        !matches!(self.won.win[node as usize], Win::Nothing)
            || !self.graph.nodes[node as usize].is_expanded && !self.is_decided(node)
            || self.seeker == Player::Environment && self.is_obliged(node)
    }

    /// Whether time may stop in an expanded node.
    pub(in crate::game) fn may_stop(&self, node: u32) -> bool {
        !self.graph.nodes[node as usize].delays
            || self.graph.urgent(node).is_some()
            || self.graph.is_delay_bounded(node)
    }
}
