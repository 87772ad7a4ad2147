//! What a node wins by what is known of its successors: the formulas at the head of [`super::reach`].

use crate::network::Failure;
use crate::zones::{ClockSet, Federation, Patience, past};

use super::Player;
use super::reach::{Solver, Win};

impl Solver<'_, '_, '_> {
    /// The valuations of a node that are won by what is known of its successors.
    pub(super) fn winnable(
        &mut self,
        node: u32,
        patience: &mut Patience<'_>,
    ) -> Result<Federation, Failure> {
        let mut won = match self.seeker {
            Player::Controller => self.controllers_gain(node, patience)?,
            Player::Environment => self.environments_gain(node, patience)?,
        };
        match self.graph.urgent(node) {
            None => won.intersect_zone(self.graph.zone(node)),
            Some(urgent) => won = won.intersection(&urgent.reached),
        }
        Ok(won)
    }

    /// What the controller wins as the seeker, as far as known.
    fn controllers_gain(
        &mut self,
        node: u32,
        patience: &mut Patience<'_>,
    ) -> Result<Federation, Failure> {
        let mut good = self.known(node);
        let goal = self.goal(node);
        let mut bad = self.broken(node);
        for index in self.graph.edges_of(node) {
            let edge = self.graph.edges[index];
            if edge.controllable {
                good.unite(&self.before(&edge, &self.win[edge.target as usize]));
            } else {
                bad.unite(&self.spoiling(&edge));
            }
        }
        bad.subtract_within(&goal, patience);
        let forced = self.forced_environment(node, &bad)?;
        good.unite(&forced);
        let mut won = self.safe_past(node, good, &bad, patience)?;
        won.unite(&goal);
        Ok(won)
    }

    /// What the environment wins as the seeker, as far as known.
    fn environments_gain(
        &mut self,
        node: u32,
        patience: &mut Patience<'_>,
    ) -> Result<Federation, Failure> {
        let goal = self.goal(node);
        let mut now = self.broken(node);
        let mut escape = Federation::empty(self.graph.dimension());
        for index in self.graph.edges_of(node) {
            let edge = self.graph.edges[index];
            if edge.controllable {
                escape.unite(&self.spoiling(&edge));
            } else {
                now.unite(&self.before(&edge, &self.win[edge.target as usize]));
            }
        }
        now.subtract_within(&goal, patience);
        let mut good = self.forced_controller(node)?;
        good.subtract_within(&escape, patience);
        good.unite(&now);
        good.unite(&self.known(node));
        escape.subtract_within(&now, patience);
        escape.unite(&goal);
        self.safe_past(node, good, &escape, patience)
    }

    /// What was won in a node so far, as far as it is a part of it.
    fn known(&self, node: u32) -> Federation {
        match &self.win[node as usize] {
            Win::Part(part) => part.clone(),
            _ => Federation::empty(self.graph.dimension()),
        }
    }

    /// The valuations of a node that get into `good` without meeting `bad`, by waiting if time may pass.
    pub(super) fn safe_past(
        &mut self,
        node: u32,
        mut good: Federation,
        bad: &Federation,
        patience: &mut Patience<'_>,
    ) -> Result<Federation, Failure> {
        if self.graph.nodes[node as usize].delays {
            if let Some(urgent) = self.graph.urgent(node) {
                return Ok(urgent.predecessors(&good, bad));
            }
            let stopped = self.stopped(node)?;
            return Ok(past::predecessors_within(&good, bad, &stopped, patience));
        }
        good.subtract_within(bad, patience);
        Ok(good)
    }

    /// The clocks that stand still in a node.
    pub(super) fn stopped(&mut self, node: u32) -> Result<ClockSet, Failure> {
        let mut words = self.graph.symbolic.stepper.network().initial.clone();
        self.graph.load(node, &mut words);
        self.graph.symbolic.stopped(&words)
    }
}
