//! What a way to play a game may take before it is given up for another one.
//!
//! What is looked at does not depend on the number of threads: work is counted by task, and what
//! threads have at hand does not count.

use crate::search::limits::{StopReason, Watch};

use super::solver::Solver;

/// What a way to play may take.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// States that are explored.
    pub explored: u64,
    /// Bytes of a stored state, on average.
    pub bytes_each: u64,
    /// Units of work for a stored state, on average.
    pub work_each: u64,
    /// States that are counted beside those that are stored.
    pub states_of_grace: u64,
}

impl Solver<'_, '_, '_> {
    /// Lets the solver give up when it has taken more than this: it stops then for the number of
    /// states, and [`Solver::has_given_up`] is set.
    pub fn give_up_beyond(&mut self, allowance: Option<Allowance>) {
        self.allowance = allowance;
    }

    /// Tells the watch what was done so far; it may give a reason to stop.
    pub(in crate::game) fn tell(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        self.graph.counted_zones = self.graph.zones.len();
        watch.look(&self.counters())
    }

    /// Looks whether to go on, between operations.
    pub(in crate::game) fn look(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let reason = self.tell(watch);
        if reason.is_some() {
            return reason;
        }
        let counters = self.counters();
        let allowance = self.allowance?;
        let states = counters.stored + allowance.states_of_grace;
        let is_beyond = counters.explored > allowance.explored
            || counters.bytes > states.saturating_mul(allowance.bytes_each)
            || self.work > self.most_work();
        self.has_given_up |= is_beyond;
        is_beyond.then_some(StopReason::States)
    }

    /// So many units of work may be done with the states that are stored now.
    pub(super) fn most_work(&self) -> u64 {
        self.allowance.map_or(u64::MAX, |allowance| {
            let states = self.graph.nodes.len() as u64 + allowance.states_of_grace;
            states.saturating_mul(allowance.work_each)
        })
    }
}
