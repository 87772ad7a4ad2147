//! Exact times for the moves of a symbolic run.

pub(super) mod difference_constraints;
pub mod schedule;
pub(super) mod simplex;
