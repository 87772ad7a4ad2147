//! Numbers that runs share, however they are made.

/// So many moves in less than [`ZENO_TIME`] are taken for a run that never gets on.
pub const ZENO_MOVES: u64 = 100_000;
/// The time that so many moves must take, in units of the model.
pub const ZENO_TIME: f64 = 1e-6;

/// So many moves in which the clock that bounds a run rises to no new height are taken for a run
/// that never ends.
pub const MOVES_WITHOUT_RISE: u64 = 10_000_000;

/// Times and values of clocks that differ by less than this part, and less than this, are the same.
pub(super) const TOLERANCE: f64 = 1e-12;

/// After this number of moves plans that wait for a clock are drawn anew, so that the rounding of
/// the delays in between does not add up.
pub(super) const MOVES_OF_A_PLAN: u32 = 4096;

/// What a move takes: see [`crate::cancellation::work`].
pub(super) const UNITS_FOR_MOVE: usize = 256;

/// The changes of what is asked of a run that are followed within one delay.
pub(super) const MOST_CHANGES: usize = 1_000_000;
