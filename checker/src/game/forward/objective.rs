//! What must be reached and kept, and until when.
//!
//! If the goal must be reached in time, a clock that nothing sets measures the time. A state after
//! the deadline is lost for good, so zones end at the deadline.

use crate::ir::{FunctionId, Predicate};
use crate::network::Failure;
use crate::zones::Bound;
use crate::zones::dbm::Constraint;

/// What must be reached and kept.
#[derive(Clone, Copy, Debug)]
pub struct Objective<'q> {
    /// The goal; play ends where it holds. With `None` there is none (safety).
    pub goal: Option<&'q Predicate>,
    /// What must hold until then; with `None` nothing.
    pub keep: Option<&'q Predicate>,
    /// Whether waiting for ever never helps the controller.
    pub must_progress: bool,
    /// The deadline of the goal.
    pub deadline: Option<Deadline>,
    /// Whether the states after dead ends are left out.
    pub leaves_dead_ends: bool,
}

/// A limit on the time that play takes.
#[derive(Clone, Copy, Debug)]
pub struct Deadline {
    /// The clock that measures the time; nothing sets it.
    pub clock: usize,
    /// The limit.
    pub limit: i32,
    /// Whether the clock may start at any value up to the limit. Then the valuations of the initial
    /// node show how much time is needed. Otherwise it starts at 0.
    pub starts_anywhere: bool,
    /// The least time that must still remain in a state before the goal; a negative value counts as
    /// 0.
    pub rest: Option<FunctionId>,
}

impl Deadline {
    /// The constraint that the clock shows at most this.
    pub(super) fn until(&self, limit: i32) -> Result<Constraint, Failure> {
        Ok(Constraint {
            left: self.clock,
            right: 0,
            bound: Bound::weak(limit).ok_or(Failure::ClockLimit(limit))?,
        })
    }
}
