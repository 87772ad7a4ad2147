//! What a way to play a game may take before it is given up for another one.
//!
//! What is looked at does not depend on the number of threads: work is counted by task, and what
//! threads have at hand does not count.

/// What a way to play may take.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// States that are explored.
    pub explored: u64,
    /// Bytes of a stored state, on average.
    pub bytes_each: u64,
    /// Units of work for a stored state, on average.
    pub work_each: u64,
    /// States that are counted beside those that are stored.
    pub states_of_grace: u64,
}

/// What can stop a solver before it has an answer, beside what the watch says.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) struct Stops {
    pub(super) budget: Option<Budget>,
    /// After how many explored states it is looked whether there are many nodes for each discrete
    /// state.
    pub(super) crowded_from: u64,
    /// How many nodes for each discrete state are many.
    pub(super) crowd: usize,
    /// When that is looked at next.
    pub(in crate::game) next_crowd: u64,
    /// Whether the solver has given up: for having many nodes for each discrete state, or for what
    /// it has taken.
    pub(in crate::game) has_given_up: bool,
    /// The units of work that computing what nodes win has taken.
    pub(super) work: u64,
    /// How many states may be explored,
    pub(in crate::game) next_look: u64,
    /// and how many zones stored, before the watch is asked again.
    pub(in crate::game) zones_at_look: usize,
}

impl Default for Stops {
    fn default() -> Stops {
        Stops {
            budget: None,
            crowded_from: u64::MAX,
            crowd: usize::MAX,
            next_crowd: 1,
            has_given_up: false,
            work: 0,
            next_look: 0,
            zones_at_look: 0,
        }
    }
}
