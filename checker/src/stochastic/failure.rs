//! What ends a run without a result.

use crate::exec::RunTimeError;
use crate::ir::{EdgeId, LocationId, ProcessId};

/// A place in a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stand {
    /// The process.
    pub process: ProcessId,
    /// Where it is.
    pub location: LocationId,
}

/// Why a run has no result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Failure {
    /// The model's code failed.
    RunTime(RunTimeError),
    /// An output can be enabled, no invariant bounds the delay, and the location has no rate.
    NoRate(Stand),
    /// The rate of an exponential delay is negative or no finite number.
    Rate(Stand, f64),
    /// The rate of a clock is not a finite number.
    ClockRate(Stand),
    /// Two locations set the rate of one clock.
    RatesConflict(Stand, Stand),
    /// A weight is negative or no number.
    Weight(Stand, EdgeId),
    /// All weights of a branch point are 0.
    NoWeight(Stand, EdgeId),
    /// Time cannot pass, and nothing can happen.
    TimeLock(Stand),
    /// The invariant does not hold.
    InvariantBroken(Stand),
    /// More moves than [`super::race::ZENO_MOVES`] in no time.
    Zeno(Stand),
    /// The clock that bounds the run stands still or runs backwards, and nothing can happen.
    BoundNeverReached,
    /// In more than [`super::MOVES_WITHOUT_RISE`] moves the clock that bounds the run has not risen
    /// above this value.
    BoundNotApproached(f64),
    /// Runs can cycle in no time and get better by it each time: there is no best strategy.
    NoBest,
    /// Under every strategy some runs cycle in no time for ever.
    NeverEnds,
    /// The value of an expression is no finite number.
    NoNumber,
    /// A value whose mean is asked for lies outside the bounds that the user gave.
    ValueOutOfBounds(f64),
    /// The strategy demands a move that is not possible.
    ImpossibleDemand,
    /// Who decides for the controller has not decided.
    NoDecision,
    /// The same run went another way when it was made again.
    NotRepeatable,
    /// A comparison changes more often than numbers can tell apart.
    NoProgress(Stand),
}

impl From<RunTimeError> for Failure {
    fn from(error: RunTimeError) -> Failure {
        Failure::RunTime(error)
    }
}
