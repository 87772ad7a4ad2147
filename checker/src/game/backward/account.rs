//! The account of what a game has taken. The memory limit uses it, and it says when a solver stops.
//!
//! Everything that grows with the game counts: the graph, what nodes win, what remains of it, what
//! was gained when, the lists of nodes, what was computed before, and what is set aside meanwhile.
//! An operation that holds many zones asks for them ([`crate::cancellation::ask_for`]). Vectors
//! that only grow count by their length: reserved room takes no memory until it is written to. Hash
//! tables count with all their room.

use crate::search::limits::{Counters, StopReason, Watch, states_between_checks};
use crate::zones::Bound;

use super::budget::Budget;
use crate::game::solver::Solver;

/// Expanded nodes between two checks of the limits.
pub(super) const LOOK_EVERY: u64 = 64;

/// The greatest number of bytes of zones that are made between two checks of the limits. One
/// expansion may exceed it.
const ZONE_BYTES_BETWEEN_LOOKS: u64 = 4 << 20;

impl Solver<'_, '_, '_> {
    /// What was done until now.
    pub fn counters(&self) -> Counters {
        Counters {
            explored: self.graph.explored,
            stored: self.graph.nodes.len() as u64,
            waiting: self.exploration.waiting.len() as u64,
            bytes: self.bytes(),
        }
    }

    fn bytes(&self) -> u64 {
        let lists = self.agenda.bytes() + self.exploration.bytes();
        self.graph.bytes() + self.won.all_bytes() + lists as u64 + self.aside_bytes
    }

    /// The bytes of a zone.
    pub(in crate::game) fn zone_bytes(&self) -> u64 {
        (self.graph.dimension().pow(2) * size_of::<Bound>()) as u64
    }

    /// Lets the solver give up when it has taken more than this. It stops then as at the state
    /// limit, and [`Solver::has_given_up`] says so.
    pub fn give_up_beyond(&mut self, budget: Option<Budget>) {
        self.stops.budget = budget;
    }

    /// Tells the watch what was done until now; it may give a reason to stop.
    pub(in crate::game) fn tell(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        self.graph.counted_zones = self.graph.zones.len();
        watch.look(&self.counters())
    }

    /// Checks between operations whether to continue.
    pub(in crate::game) fn look(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let reason = self.tell(watch);
        if reason.is_some() {
            return reason;
        }
        let counters = self.counters();
        let budget = self.stops.budget?;
        let states = counters.stored + budget.states_of_grace;
        let is_beyond = counters.explored > budget.explored
            || counters.bytes > states.saturating_mul(budget.bytes_each)
            || self.stops.work > self.most_work();
        self.stops.has_given_up |= is_beyond;
        is_beyond.then_some(StopReason::States)
    }

    /// The units of work that are allowed for the states that are stored now.
    pub(super) fn most_work(&self) -> u64 {
        self.stops.budget.map_or(u64::MAX, |budget| {
            let states = self.graph.nodes.len() as u64 + budget.states_of_grace;
            states.saturating_mul(budget.work_each)
        })
    }

    /// Whether the solver has given up: it had many nodes for each discrete state, or took too
    /// much.
    pub fn has_given_up(&self) -> bool {
        self.stops.has_given_up
    }

    /// Lets the solver give up after this many explored states, if it has at least `crowd` nodes
    /// for each discrete state. It stops then as at the state limit, and [`Solver::has_given_up`]
    /// says so.
    pub fn set_crowd_limit(&mut self, explored: u64, crowd: usize) {
        self.stops.crowded_from = explored;
        self.stops.crowd = crowd;
    }

    pub(super) fn is_crowded(&self) -> bool {
        self.graph.explored >= self.stops.crowded_from
            && self.graph.nodes.len() >= self.stops.crowd * self.graph.discrete_count()
    }

    /// Gives up if there are many nodes for each discrete state. It checks this each time that the
    /// number of explored states has doubled.
    pub(in crate::game) fn check_crowd(&mut self) -> bool {
        let explored = self.graph.explored;
        if explored < self.stops.next_crowd {
            return false;
        }
        self.stops.next_crowd = 2 * explored;
        let is_crowded = self.is_crowded();
        self.stops.has_given_up |= is_crowded;
        is_crowded
    }

    /// Starts to count what is explored until the watch is asked again.
    pub(in crate::game) fn schedule_limit_check(&mut self) {
        let look_every = states_between_checks(LOOK_EVERY, self.graph.dimension());
        let most_zones = (ZONE_BYTES_BETWEEN_LOOKS / self.zone_bytes()) as usize;
        self.stops.next_look = self.graph.explored + look_every;
        self.stops.zones_at_look = self.graph.zones.len() + most_zones;
    }

    /// Asks the watch if many states were explored, or many zones made, since the last time.
    pub(in crate::game) fn check_limits(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let is_due = self.graph.explored >= self.stops.next_look
            || self.graph.zones.len() >= self.stops.zones_at_look;
        if !is_due {
            return None;
        }
        self.schedule_limit_check();
        self.look(watch)
    }
}
