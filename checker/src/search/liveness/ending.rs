//! How a run that never leaves a predicate ends.

/// Why a run inside a predicate never leaves it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnding {
    /// The last move leads from its last state back to the state with this index.
    Loop(usize),
    /// Time passes for ever in its last state.
    Waits,
    /// No move is possible any more, and time cannot take it out of the predicate.
    Stuck,
}

impl RunEnding {
    /// The same for a trace with this many more states before it.
    #[must_use]
    pub fn moved(self, before: usize) -> RunEnding {
        match self {
            RunEnding::Loop(start) => RunEnding::Loop(start + before),
            other => other,
        }
    }
}
