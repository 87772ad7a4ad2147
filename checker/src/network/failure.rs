//! The reasons why exploring a model ended without an answer.

use crate::exec::RunTimeError;
use crate::ir::RunTimeErrorKind;

/// The model did something that has no meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// A run-time error in the model's code.
    RunTime(RunTimeError),
    /// A clock bound or value is beyond what zones can hold; the number is the value.
    ClockLimit(i32),
    /// Bounds of clocks grew beyond what zones can hold, and no abstraction keeps them small.
    ClockRange,
    /// A rate other than 0 and 1 on a clock of the process with this index.
    Rate {
        /// The process.
        process: u32,
        /// The rate.
        rate: i32,
    },
    /// A state has more than this number of moves.
    Moves(usize),
    /// The initial state breaks an invariant.
    InitialInvariant,
    /// The model did not fail: a call of its code, or the enumeration of moves, was cancelled
    /// ([`crate::cancellation`]).
    Interrupted,
}

impl From<RunTimeError> for Failure {
    fn from(error: RunTimeError) -> Failure {
        match error.kind {
            RunTimeErrorKind::Interrupted => Failure::Interrupted,
            _ => Failure::RunTime(error),
        }
    }
}
