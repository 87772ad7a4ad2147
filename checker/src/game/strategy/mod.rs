//! Strategies: how they are extracted, their closed loop, and plans.

pub mod attractor;
pub mod closed_loop;
pub mod co_buchi;
pub mod plans;
pub(super) mod safety;
