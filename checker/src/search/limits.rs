//! Limits: a search reports its counters from time to time, and is told whether to continue.
//!
//! The search itself reads no clock and knows no limit; its caller does.

use super::store::disk::{Cold, Disk};

/// What a search has done until now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// States whose successors were computed.
    pub explored: u64,
    /// States that are stored. States that were replaced by one with a larger zone do not count.
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
    /// The state limit.
    States,
    /// The memory limit.
    Memory,
    /// States that have no room in memory cannot be written to disk.
    Disk,
    /// The time limit.
    Time,
    /// The user interrupted.
    Interrupted,
    /// Bounds of clocks that no abstraction keeps small grew beyond what zones can hold.
    Clocks,
}

/// Watches a search.
pub trait Watch {
    /// Looks at the counters; a reason ends the search. Called every few hundred states.
    fn look(&mut self, counters: &Counters) -> Option<StopReason>;

    /// Where states go that have no room in memory.
    fn disk(&self) -> Option<&Disk> {
        None
    }
}

impl dyn Watch + '_ {
    /// Puts what is cold on disk, if there is one and memory has no room for `bytes`, and for
    /// `growth` more before the next look.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn make_room(
        &self,
        bytes: u64,
        growth: usize,
        cold: &mut [&mut dyn Cold],
    ) -> Result<(), StopReason> {
        let Some(disk) = self.disk() else {
            return Ok(());
        };
        let made = disk.make_room(bytes, growth, cold);
        made.map_err(|_| StopReason::Disk)
    }
}

/// The states that a search may explore between two checks of the limits, at most `most`, for zones
/// of this dimension. The cost of a state grows with the third power of the dimension; so does the
/// cost of its successors where clocks have a process each.
pub(crate) fn states_between_checks(most: u64, dimension: usize) -> u64 {
    (UNITS_BETWEEN_LOOKS / (dimension as u64).pow(3)).clamp(1, most)
}

/// The moves that a search may take between two checks of the limits.
pub(crate) fn moves_between_checks(most: u64, dimension: usize) -> u64 {
    (UNITS_BETWEEN_LOOKS / (dimension as u64).pow(2)).clamp(1, most)
}

/// The approximate number of bounds in the zones of states and moves between two checks of the
/// limits.
const UNITS_BETWEEN_LOOKS: u64 = 1 << 19;

/// Never stops a search.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unlimited;

impl Watch for Unlimited {
    fn look(&mut self, _: &Counters) -> Option<StopReason> {
        None
    }
}
