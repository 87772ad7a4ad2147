//! What an attempt at a game may take before another one replaces it.
//!
//! Nothing here depends on the number of threads: work is counted by task, and the zones that
//! threads hold meanwhile do not count.

/// What an attempt may take.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// States that are explored.
    pub explored: u64,
    /// Bytes of a stored state, on average.
    pub bytes_each: u64,
    /// Units of work for a stored state, on average.
    pub work_each: u64,
    /// The states that are added to the stored ones.
    pub states_of_grace: u64,
}

/// What can stop a solver before it has an answer, in addition to the watch.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) struct Stops {
    pub(super) budget: Option<Budget>,
    /// From this number of explored states on, the solver checks whether there are many nodes for
    /// each discrete state.
    pub(super) crowded_from: u64,
    /// The number of nodes for each discrete state that counts as many.
    pub(super) crowd: usize,
    /// The number of explored states at the next such check.
    pub(in crate::game) next_crowd: u64,
    /// Whether the solver has given up: it had many nodes for each discrete state, or took too
    /// much.
    pub(in crate::game) has_given_up: bool,
    /// The units of work that computing what nodes win has taken.
    pub(super) work: u64,
    /// The watch is asked again when this many states are explored,
    pub(in crate::game) next_look: u64,
    /// or this many zones are stored.
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
