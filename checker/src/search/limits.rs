//! Limits: a search reports its counters now and then, and is told whether to go on.
//!
//! The search itself reads no clock and knows no limit; whoever calls it does.

/// What a search has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// States whose successors were computed.
    pub explored: u64,
    /// States that are stored: those that one with a larger zone took the place of do not count.
    pub stored: u64,
    /// Stored states that wait for their successors to be computed.
    pub waiting: u64,
    /// Bytes of the stored states, with their tables.
    pub bytes: u64,
}

impl std::ops::Add for Counters {
    type Output = Counters;

    fn add(self, other: Counters) -> Counters {
        Counters {
            explored: self.explored + other.explored,
            stored: self.stored + other.stored,
            waiting: self.waiting + other.waiting,
            bytes: self.bytes + other.bytes,
        }
    }
}

/// Why a search stopped before it had an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The limit of states.
    States,
    /// The limit of memory.
    Memory,
    /// The limit of time.
    Time,
    /// The user interrupted.
    Interrupted,
}

/// Watches a search.
pub trait Watch {
    /// Looks at the counters; a reason ends the search. Called every few hundred states.
    fn look(&mut self, counters: &Counters) -> Option<StopReason>;
}

/// Never stops a search.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unlimited;

impl Watch for Unlimited {
    fn look(&mut self, _: &Counters) -> Option<StopReason> {
        None
    }
}
