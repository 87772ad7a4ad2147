//! Where the seeker may still win, as far as the graph is explored.
//!
//! A node has *hope* if the seeker has won some of it, or if it is not expanded, or if a move of
//! the seeker leads to a node with hope. A move of the evader gives hope only if it may have to be
//! made:
//! * if time may stop in the node, since it need not move before,
//! * if no other move leads the evader from everywhere in the node to one without hope, and
//! * if the evader is the controller and the environment has to move wherever it can
//!   ([`Forced::Neutral`]), unless it can everywhere in the node: then the controller may leave it
//!   to that.
//!
//! Nodes without hope are lost: the evader stays among them whatever the seeker does. So if the
//! initial node has none, the game is over, however much of the graph waits; and what only nodes
//! without hope lead to need not be explored. Clocks are not looked at, so a node with hope may be
//! lost.
//!
//! Nodes lose hope as the graph grows and never gain it again.

use super::solver::{Solver, Win};
use crate::game::forward::node::{Edge, NONE};
use crate::game::{Forced, Player};

impl Solver<'_, '_, '_> {
    /// Finds the nodes with hope anew, and returns whether the initial one is among them. If it is
    /// not, all nodes with hope count as won afterwards, so that the strategy of the evader keeps
    /// out of them.
    pub(super) fn has_hope(&mut self) -> bool {
        let count = self.graph.nodes.len() as u32;
        let mut has_hope = vec![false; count as usize];
        let mut waiting: Vec<u32> = (0..count)
            .filter(|&node| self.is_source_of_hope(node))
            .collect();
        for &node in &waiting {
            has_hope[node as usize] = true;
        }
        while let Some(node) = waiting.pop() {
            let mut edge = self.graph.nodes[node as usize].first_in;
            while edge != NONE {
                let Edge {
                    source,
                    next_in,
                    controllable,
                    ..
                } = self.graph.edges[edge as usize];
                edge = next_in;
                let is_useful = self.seeker.owns(controllable)
                    || self.may_stop(source) && !self.gets_away(source, &has_hope);
                if is_useful
                    && !self.is_decided(source)
                    && !std::mem::replace(&mut has_hope[source as usize], true)
                {
                    waiting.push(source);
                }
            }
        }
        let is_open = has_hope[0];
        if !is_open {
            for (node, has_hope) in has_hope.iter().enumerate() {
                let win = if *has_hope {
                    Win::Everything
                } else {
                    Win::Nothing
                };
                self.replace_win(node, win);
            }
        }
        self.has_hope = has_hope;
        is_open
    }

    /// Whether a node had hope when it was last looked at, or was not there yet.
    pub(in crate::game) fn may_have_hope(&self, node: u32) -> bool {
        self.has_hope.get(node as usize).is_none_or(|&it| it)
    }

    /// Counts the nodes that were left unexpanded as won, once the evader has won: it has no need
    /// of them, and nobody knows more.
    pub(super) fn keep_out_of_unexpanded(&mut self) {
        for node in 0..self.win.len() {
            if !self.graph.nodes[node].is_expanded && !self.is_decided(node as u32) {
                self.replace_win(node, Win::Everything);
            }
        }
    }

    /// Whether the evader has a move from everywhere in a node to one without hope, or may leave it
    /// to the environment to move.
    fn gets_away(&self, node: u32, has_hope: &[bool]) -> bool {
        let mut edges = self.graph.edges[self.graph.edges_of(node)].iter();
        edges.any(|edge| {
            let is_own = self.seeker.owns(edge.controllable);
            edge.is_total
                && !edge.is_leg
                && (is_own && self.seeker == Player::Environment && self.forced == Forced::Neutral
                    || !is_own && !has_hope[edge.target as usize])
        })
    }

    fn is_source_of_hope(&self, node: u32) -> bool {
        !matches!(self.win[node as usize], Win::Nothing)
            || !self.graph.nodes[node as usize].is_expanded && !self.is_decided(node)
            || self.seeker == Player::Environment && self.is_obliged(node)
    }

    /// Whether time may come to a stop in an expanded node.
    pub(in crate::game) fn may_stop(&self, node: u32) -> bool {
        !self.graph.nodes[node as usize].delays
            || self.graph.urgent(node).is_some()
            || self.graph.is_delay_bounded(node)
    }
}
