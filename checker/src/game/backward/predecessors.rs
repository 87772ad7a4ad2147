//! What a node wins, given what is known about its successors: the formulas at the top of
//! [`crate::game::solver`].

use crate::network::Failure;
use crate::zones::{ClockSet, Federation, past};

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::solver::Solver;

/// The facts about a node's words that the formulas need.
#[derive(Debug)]
pub(in crate::game) struct Situation {
    /// The clocks that stand still.
    pub(in crate::game) stopped: ClockSet,
    /// Where time cannot pass; see [`super::forced_moves::stops`].
    pub(super) stops: Vec<(Option<u32>, Federation)>,
    /// See [`Solver::controllable_movers`].
    pub(super) movers: Vec<(Vec<u32>, usize)>,
}

impl Solver<'_, '_, '_> {
    /// The situation in a node.
    pub(in crate::game) fn situation(&mut self, node: u32) -> Result<Situation, Failure> {
        self.situation_with(node, true)
    }

    /// The situation in a node, reduced to what decides what is won there: stopped time matters
    /// only for a player who may be forced.
    pub(super) fn situation_for_win(&mut self, node: u32) -> Result<Situation, Failure> {
        let mut edges = self.graph.edges_from(node).iter();
        let may_be_forced = edges.any(|edge| !self.seeker.owns(edge.controllable));
        self.situation_with(node, may_be_forced)
    }

    fn situation_with(&mut self, node: u32, stops_matter: bool) -> Result<Situation, Failure> {
        let mut words = std::mem::take(&mut self.words);
        self.graph.load(node, &mut words);
        let mut situation = Situation {
            stopped: self.graph.symbolic.stopped(&words)?,
            stops: Vec::new(),
            movers: Vec::new(),
        };
        if stops_matter {
            situation.stops = self.stops(node, &mut words)?;
            if !situation.stops.is_empty() {
                situation.movers = self.controllable_movers(node, &mut words)?;
            }
        }
        self.words = words;
        Ok(situation)
    }

    /// The valuations of a node in this situation that are won, given what is known about its
    /// successors.
    pub(in crate::game) fn winnable(&self, node: u32, situation: &Situation) -> Federation {
        self.winnable_without(node, situation, &[]).0
    }

    /// The valuations of a node that are won if the evader does not use the held moves, and those
    /// in which its choice does not matter.
    pub(in crate::game) fn winnable_without(
        &self,
        node: u32,
        situation: &Situation,
        held: &[usize],
    ) -> (Federation, Federation) {
        let (mut won, decided) = match self.seeker {
            Player::Controller => {
                let nothing = Federation::empty(self.graph.dimension());
                (self.controllers_gain(node, situation), nothing)
            }
            Player::Environment => self.environments_gain(node, situation, held),
        };
        match self.graph.urgent(node) {
            None => won.intersect_zone(self.graph.zone(node)),
            Some(urgent) => won = won.intersection(&urgent.reached),
        }
        (won, decided)
    }

    /// What the controller wins as the seeker, given what is known.
    fn controllers_gain(&self, node: u32, situation: &Situation) -> Federation {
        let mut good = self.known(node);
        let goal = self.goal(node);
        let mut bad = self.broken(node);
        for edge in self.graph.edges_from(node) {
            if edge.is_leg {
                continue;
            }
            if edge.controllable {
                good.unite(&self.before(edge, &self.won.win[edge.target as usize]));
            } else {
                bad.unite(&self.spoiling(edge));
            }
        }
        for legs in self.graph.branch_points.of(node) {
            let legs = self.targets_of(legs, &self.won.win);
            good.unite(&self.before_all(legs));
        }
        bad.subtract(&goal);
        let forced = self.forced_environment(node, &bad, situation);
        good.unite(&forced);
        let mut won = self.safe_past(node, good, &bad, situation);
        won.unite(&goal);
        won
    }

    /// What the environment wins as the seeker, given what is known, and the part of it that it has
    /// at once.
    fn environments_gain(
        &self,
        node: u32,
        situation: &Situation,
        held: &[usize],
    ) -> (Federation, Federation) {
        let goal = self.goal(node);
        let mut now = self.broken(node);
        let mut escape = Federation::empty(self.graph.dimension());
        for index in self.graph.edges_of(node) {
            let edge = self.graph.edges[index];
            if edge.is_leg || held.contains(&index) {
                continue;
            }
            if edge.controllable {
                escape.unite(&self.spoiling(&edge));
            } else {
                now.unite(&self.before(&edge, &self.won.win[edge.target as usize]));
            }
        }
        for legs in self.graph.branch_points.of(node) {
            escape.unite(&self.spoiling_all(legs));
        }
        now.subtract(&goal);
        let mut good = self.forced_controller(node, situation).minus(&escape);
        good.unite(&now);
        good.unite(&self.known(node));
        escape.subtract(&now);
        escape.unite(&goal);
        let won = self.safe_past(node, good, &escape, situation);
        (won, now)
    }

    /// The part of a node that is won until now.
    fn known(&self, node: u32) -> Federation {
        match &self.won.win[node as usize] {
            Win::Part(part) => part.clone(),
            _ => Federation::empty(self.graph.dimension()),
        }
    }

    /// The valuations of a node that get into `good` without meeting `bad`, by waiting where time
    /// may pass.
    pub(in crate::game) fn safe_past(
        &self,
        node: u32,
        mut good: Federation,
        bad: &Federation,
        situation: &Situation,
    ) -> Federation {
        if self.graph.nodes[node as usize].delays {
            if let Some(urgent) = self.graph.urgent(node) {
                return urgent.predecessors(&good, bad);
            }
            return past::predecessors(&good, bad, &situation.stopped);
        }
        good.subtract(bad);
        good
    }
}
