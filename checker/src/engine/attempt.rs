//! Ways to play a game that may turn out to take too much: they are tried, and given up.

use crate::search::limits::{Counters, StopReason, Watch};

/// States that a game is explored for without abstraction where two clocks are compared. Many such games are finite so, and then far
/// smaller than with zones that are cut along the comparisons.
const MOST_EXACT_STATES: u64 = 4096;

/// States that a game is explored for before it is looked whether there are many zones for each discrete state.
pub(super) const STATES_BEFORE_CROWD: u64 = 2048;

/// So many zones for each discrete state are many.
pub(super) const CROWD: usize = 4;

/// Discrete states that are explored instead, at most. More of them are rather such that no run reaches.
const MOST_DISCRETE_STATES: u64 = 64 * STATES_BEFORE_CROWD;

/// Bytes that a discrete state may take, on average, before zones that are reached are looked at again: winning sets of all that
/// invariants allow can fall into many more pieces than those of what is reached.
const MOST_BYTES_OF_DISCRETE_STATE: u64 = 64 << 10;

/// Looks at the limits that a discrete state may take, on average, for the same reason: they come with every operation on many zones.
/// Where the pieces stay few there are some dozens, and where they do not, thousands soon.
const MOST_LOOKS_AT_DISCRETE_STATE: u64 = 256;

/// States that are counted beside those that are stored, for the bytes and the looks that an average one may take.
const STATES_OF_GRACE: u64 = 256;

/// Stops a search after a number of states, or when the average one takes too much memory or work, if nothing else does before.
pub(super) struct Attempt<'w> {
    watch: &'w mut dyn Watch,
    most: u64,
    most_bytes_each: u64,
    most_looks_each: u64,
    looks: u64,
    pub(super) is_given_up: bool,
}

impl<'w> Attempt<'w> {
    /// To play a game without abstraction.
    pub(super) fn without_abstraction(watch: &'w mut dyn Watch) -> Attempt<'w> {
        Attempt {
            watch,
            most: MOST_EXACT_STATES,
            most_bytes_each: u64::MAX,
            most_looks_each: u64::MAX,
            looks: 0,
            is_given_up: false,
        }
    }

    /// To play a game in discrete states.
    pub(super) fn in_discrete_states(watch: &'w mut dyn Watch) -> Attempt<'w> {
        Attempt {
            most: MOST_DISCRETE_STATES,
            most_bytes_each: MOST_BYTES_OF_DISCRETE_STATE,
            most_looks_each: MOST_LOOKS_AT_DISCRETE_STATE,
            ..Attempt::without_abstraction(watch)
        }
    }

    /// After so many states it is given up.
    pub(super) fn with_most(self, most: u64) -> Attempt<'w> {
        Attempt { most, ..self }
    }
}

impl Watch for Attempt<'_> {
    fn look(&mut self, counters: &Counters) -> Option<StopReason> {
        let reason = self.watch.look(counters);
        self.looks += 1;
        let states = counters.stored + STATES_OF_GRACE;
        let takes_too_much = counters.bytes > states.saturating_mul(self.most_bytes_each)
            || self.looks > states.saturating_mul(self.most_looks_each);
        if reason.is_none() && (counters.explored > self.most || takes_too_much) {
            self.is_given_up = true;
            return Some(StopReason::States);
        }
        reason
    }
}
