//! What a way to play a game may take before it is given up for another one.
//!
//! What is looked at does not hang on the number of threads: operations are counted by task, and
//! what threads have at hand does not count.

use crate::search::limits::{StopReason, Watch};

use super::solver::Solver;

/// What a way to play may take.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    /// States that are explored.
    pub explored: u64,
    /// Bytes of a stored state, on average.
    pub bytes_each: u64,
    /// Operations on many zones for a stored state, on average.
    pub operations_each: u64,
    /// States that are counted beside those that are stored.
    pub states_of_grace: u64,
}

impl Solver<'_, '_, '_> {
    /// Lets the solver give up when it has taken more than this: it stops then for the number of
    /// states, and [`Solver::has_given_up`] is set.
    pub fn give_up_beyond(&mut self, allowance: Option<Allowance>) {
        self.allowance = allowance;
    }

    /// Looks whether to go on, between operations.
    pub(in crate::game) fn look(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let counters = self.counters();
        self.graph.counted_zones = self.graph.zones.len();
        let reason = watch.look(&counters);
        if reason.is_some() {
            return reason;
        }
        let allowance = self.allowance?;
        let states = counters.stored + allowance.states_of_grace;
        let is_beyond = counters.explored > allowance.explored
            || counters.bytes > states.saturating_mul(allowance.bytes_each)
            || self.operations > self.most_operations();
        self.has_given_up |= is_beyond;
        is_beyond.then_some(StopReason::States)
    }

    /// So many operations may be done with the states that are stored now.
    pub(super) fn most_operations(&self) -> u64 {
        self.allowance.map_or(u64::MAX, |allowance| {
            let states = self.graph.nodes.len() as u64 + allowance.states_of_grace;
            states.saturating_mul(allowance.operations_each)
        })
    }
}
