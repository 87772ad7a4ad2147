//! What a node gains when more of it is won, and the consequences for its predecessors.

use crate::zones::Federation;

use super::winning_sets::{Gained, Win};
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
    /// What a node gains if these valuations are won.
    pub(super) fn gained(&self, node: u32, mut won: Federation) -> Gained {
        let (mut rest, is_first) = match &self.won.win[node as usize] {
            Win::Everything => return Gained::Nothing,
            Win::Part(_) => (self.won.rest[&node].clone(), false),
            Win::Nothing => (self.whole(node), true),
        };
        if !rest.intersects(&won) {
            return Gained::Nothing;
        }
        won.reduce();
        let part = if is_first {
            won.clone()
        } else {
            rest.intersection(&won)
        };
        rest.subtract(&won);
        let mut gained = if rest.is_empty() {
            Gained::Everything((!is_first).then_some(part))
        } else {
            rest.merge();
            Gained::Part { won, part, rest }
        };
        gained.shrink();
        gained
    }

    /// Records what a node gains; its predecessors must then be updated.
    pub(super) fn gain(&mut self, node: u32, gained: Gained) {
        match gained {
            Gained::Nothing => {}
            Gained::Everything(part) => {
                self.won.replace_rest(node, None);
                self.record(node, Win::Everything, part);
            }
            Gained::Part { won, part, rest } => {
                self.won.replace_rest(node, Some(rest));
                self.record(node, Win::Part(won), Some(part));
            }
        }
    }

    /// Records that all of a node is won.
    pub(super) fn gain_everything(&mut self, node: u32) {
        let rest = self.won.replace_rest(node, None);
        self.record(node, Win::Everything, rest);
    }

    /// Records what a node gains.
    fn record(&mut self, node: u32, win: Win, part: Option<Federation>) {
        if !self.exploration.schedule.is_running {
            self.won.note_gain(node, part);
        }
        self.on_gain(node);
        self.won.replace_win(node as usize, win);
        for edge in self.graph.edges_into(node) {
            self.agenda.mark(edge.source);
        }
    }
}
