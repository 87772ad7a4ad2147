//! The valuations that nodes win, the rest of them, and where edges lead into either.

use crate::zones::Federation;
use crate::zones::federation::block_bytes;

use super::solver::{Gain, Solver, Win};
use crate::game::Player;
use crate::game::forward::node::{Edge, NONE};

/// What a node gains.
#[derive(Clone, Debug)]
pub(super) enum Gained {
    /// Nothing.
    Nothing,
    /// All that was not won; this part, unless it is the whole node.
    Everything(Option<Federation>),
    /// A part.
    Part {
        /// What is won now.
        won: Federation,
        /// What of it was not before.
        part: Federation,
        /// What is not won.
        rest: Federation,
    },
}

impl Solver<'_, '_, '_> {
    /// What a node gains if these valuations are won.
    pub(super) fn gained(&self, node: u32, mut won: Federation) -> Gained {
        let (mut rest, is_first) = match &self.win[node as usize] {
            Win::Everything => return Gained::Nothing,
            Win::Part(_) => (self.rest[&node].clone(), false),
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

    /// Records what a node gains, whose predecessors are to be updated then.
    pub(super) fn gain(&mut self, node: u32, gained: Gained) {
        match gained {
            Gained::Nothing => {}
            Gained::Everything(part) => {
                self.replace_rest(node, None);
                self.record(node, Win::Everything, part);
            }
            Gained::Part { won, part, rest } => {
                self.replace_rest(node, Some(rest));
                self.record(node, Win::Part(won), Some(part));
            }
        }
    }

    /// Records that all of a node is won.
    pub(super) fn gain_everything(&mut self, node: u32) {
        let rest = self.replace_rest(node, None);
        self.record(node, Win::Everything, rest);
    }

    /// Replaces what is left of a node, of which a part is won if there is a rest; gives what it
    /// was.
    pub(super) fn replace_rest(
        &mut self,
        node: u32,
        rest: Option<Federation>,
    ) -> Option<Federation> {
        let old = match rest {
            Some(rest) => {
                self.gained_bytes += rest.heap_bytes() as u64;
                self.rest.insert(node, rest)
            }
            None => self.rest.remove(&node),
        };
        let old_bytes = old.as_ref().map_or(0, Federation::heap_bytes);
        self.gained_bytes -= old_bytes as u64;
        old
    }

    /// Replaces what a node wins.
    pub(in crate::game) fn replace_win(&mut self, node: usize, win: Win) {
        self.gained_bytes += win.heap_bytes();
        let old = std::mem::replace(&mut self.win[node], win);
        self.gained_bytes -= old.heap_bytes();
    }

    /// Records what a node gains.
    fn record(&mut self, node: u32, win: Win, part: Option<Federation>) {
        if !self.schedule.is_running {
            self.note_gain(node, part);
        }
        if self.frontier.reserve.is_used || self.schedule.is_running {
            self.note_attackers(node);
        }
        self.replace_win(node as usize, win);
        let mut edge = self.graph.nodes[node as usize].first_in;
        while edge != NONE {
            let Edge {
                source, next_in, ..
            } = self.graph.edges[edge as usize];
            self.mark(source);
            edge = next_in;
        }
    }

    /// Records what a node gains with a new stamp.
    fn note_gain(&mut self, node: u32, part: Option<Federation>) {
        self.stamp += 1;
        let gains = &mut self.gains[node as usize];
        // Most nodes gain once.
        if gains.is_empty() {
            gains.reserve_exact(1);
        }
        let room = gains.capacity();
        let part_bytes = part.as_ref().map_or(0, Federation::heap_bytes);
        gains.push(Gain {
            stamp: self.stamp,
            part,
        });
        let bytes = |room: usize| block_bytes(room * size_of::<Gain>());
        let is_first = gains.len() == 1;
        self.gained_bytes += (bytes(gains.capacity()) + part_bytes) as u64;
        self.gained_bytes -= if is_first { 0 } else { bytes(room) as u64 };
    }

    /// The valuations of an edge's source from which it leads into the given valuations of its
    /// target.
    pub fn before(&self, edge: &Edge, target: &Win) -> Federation {
        let dimension = self.graph.dimension();
        let mut part = match target {
            Win::Nothing => return Federation::empty(dimension),
            Win::Everything if edge.is_total => {
                return self.whole(edge.source);
            }
            Win::Everything => self.whole(edge.target),
            Win::Part(part) => part.clone(),
        };
        self.graph.programs.preimage(edge.program, &mut part);
        match self.graph.urgent(edge.source) {
            None => part.intersect_zone(self.graph.zone(edge.source)),
            Some(urgent) => part = part.intersection(&urgent.reached),
        }
        part
    }

    /// The valuations of an edge's source in which its first move is possible.
    pub(in crate::game) fn enabled(&self, edge: &Edge) -> Federation {
        self.graph.programs.enabled(
            edge.program,
            self.graph.zone(edge.source),
            self.graph.dimension(),
        )
    }

    /// The valuations from which a move of the evader is not known to lead into won ones.
    pub(in crate::game) fn spoiling(&self, edge: &Edge) -> Federation {
        if self.seeker == Player::Environment && self.graph.programs.waits(edge.program) {
            return self.enabled(edge);
        }
        let is_missed = (edge.length == 1).then(|| self.lost(edge.target));
        self.missing(edge, (&self.win[edge.target as usize], is_missed))
    }

    /// The valuations from which an edge is possible and does not lead into the given valuations of
    /// its target, whose others are computed unless they are given too. In a chain somebody may
    /// still wait or get stuck, so there it is what is not led into them; other edges may be pieces
    /// of a move, and lead into the rest of their own target.
    pub(in crate::game) fn missing(
        &self,
        edge: &Edge,
        (hit, missed): (&Win, Option<Win>),
    ) -> Federation {
        if edge.length == 1 {
            let missed = missed.unwrap_or_else(|| self.complement(edge.target, hit));
            return self.before(edge, &missed);
        }
        let mut missing = self.enabled(edge);
        missing.subtract(&self.before(edge, hit));
        missing
    }

    /// The valuations of a node that are not known to be won.
    pub(in crate::game) fn lost(&self, node: u32) -> Win {
        match &self.win[node as usize] {
            Win::Nothing => Win::Everything,
            Win::Everything => Win::Nothing,
            Win::Part(_) => Win::Part(self.rest[&node].clone()),
        }
    }

    /// The other valuations of a node.
    fn complement(&self, node: u32, part: &Win) -> Win {
        match part {
            Win::Nothing => Win::Everything,
            Win::Everything => Win::Nothing,
            Win::Part(part) => {
                let mut rest = self.whole(node);
                rest.subtract(part);
                Win::Part(rest)
            }
        }
    }

    /// All valuations of a node.
    pub(in crate::game) fn whole(&self, node: u32) -> Federation {
        self.graph.whole(node)
    }

    /// What is won of a node, as zones.
    pub(in crate::game) fn federation_of(&self, node: u32, win: &Win) -> Federation {
        match win {
            Win::Nothing => Federation::empty(self.graph.dimension()),
            Win::Everything => self.whole(node),
            Win::Part(part) => part.clone(),
        }
    }

    /// What a gain added to what is won of a node.
    pub(in crate::game) fn gained_part(&self, node: u32, gain: &Gain) -> Federation {
        match &gain.part {
            Some(part) => part.clone(),
            None => self.whole(node),
        }
    }
}
