//! Objectives beyond reachability and safety.

pub mod buchi;
pub mod cooperative;
