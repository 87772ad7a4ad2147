//! What all engines that run code have in common: one trait, and what a call reads and writes.

use super::Wraps;
use crate::ir::{
    ClockId, Constants, FixedConstraint, Function, FunctionId, RunTimeErrorKind, SiteId,
};

/// What a call reads and writes in addition to its arguments.
#[derive(Debug)]
pub struct Context<'a> {
    /// The words of the state; updates change them in place.
    pub state: &'a mut [i32],
    /// The clock constraints that the call emitted, appended in order.
    pub constraints: &'a mut Vec<EmittedConstraint>,
    /// The clock assignments that the call emitted, appended in order.
    pub assignments: &'a mut Vec<EmittedAssignment>,
}

/// A constraint that a call emitted.
pub type EmittedConstraint = FixedConstraint;

/// `target := value`, or `target := source + value` if the source is not the reference clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
#[expect(missing_docs, reason = "the formula says it")]
pub struct EmittedAssignment {
    pub target: ClockId,
    pub source: ClockId,
    pub value: i32,
}

/// A run-time error of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RunTimeError {
    /// What went wrong.
    pub kind: RunTimeErrorKind,
    /// Where.
    pub site: SiteId,
}

/// Something that runs functions.
///
/// `function` must be one of the functions that the executor was made from; its parameters must all
/// be integers, as many as `arguments`, and its result an integer or nothing. Every other use of
/// functions is between functions.
pub trait Executor: Send + Sync {
    /// Runs a function and returns its result; 0 for a function that returns nothing.
    fn call(
        &self,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError>;

    /// An executor of the same kind for further functions, where `entry` is called often; both
    /// arguments are the whole of it, and begin with what this one has. `None` if it cannot run
    /// them.
    fn with_code(
        &self,
        functions: &[Function],
        constants: &Constants,
        entry: FunctionId,
    ) -> Option<Box<dyn Executor>>;

    /// Whether whole random runs, as code, are made faster by it than move by move.
    fn compiles_runs(&self) -> bool {
        false
    }

    /// Where results wrapped round since this was cleared.
    fn wraps(&self) -> &Wraps;
}

/// Rounds of loops between two looks whether to end ([`crate::cancellation::is_due`]); a call that
/// is ended so fails with [`crate::ir::RunTimeErrorKind::Interrupted`].
pub(super) const ROUNDS_BETWEEN_LOOKS: u64 = 1 << 16;
