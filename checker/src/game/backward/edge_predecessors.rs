//! Where edges lead into what is won, and where they do not.

use crate::zones::Federation;

use super::winning_sets::{Gain, Win};
use crate::game::Player;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
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
        let is_missed = (edge.length == 1).then(|| self.won.lost(edge.target));
        self.missing(edge, &self.won.win[edge.target as usize], is_missed)
    }

    /// The valuations from which an edge is possible and does not lead into the given valuations of
    /// its target. The other valuations of the target are computed if `missed` does not give them.
    /// In a chain a player may still wait or get stuck, so there the result is all that is not led
    /// into the given valuations. Other edges may be pieces of a move, and lead into the rest of
    /// their own target.
    pub(in crate::game) fn missing(
        &self,
        edge: &Edge,
        hit: &Win,
        missed: Option<Win>,
    ) -> Federation {
        if edge.length == 1 {
            let missed = missed.unwrap_or_else(|| self.complement(edge.target, hit));
            return self.before(edge, &missed);
        }
        self.enabled(edge).minus(&self.before(edge, hit))
    }

    /// The other valuations of a node.
    fn complement(&self, node: u32, part: &Win) -> Win {
        match part {
            Win::Nothing => Win::Everything,
            Win::Everything => Win::Nothing,
            Win::Part(part) => Win::Part(self.whole(node).minus(part)),
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

    /// What a gain added to the won part of a node.
    pub(in crate::game) fn gained_part(&self, node: u32, gain: &Gain) -> Federation {
        match &gain.part {
            Some(part) => part.clone(),
            None => self.whole(node),
        }
    }
}
