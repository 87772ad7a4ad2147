//! One file for each kind of query.

pub mod answer;
pub(super) mod budgets;
pub(super) mod cooperative;
pub(super) mod extremum;
pub(super) mod game;
pub(super) mod liveness;
pub(super) mod optimal_trace;
pub mod partial_observation;
pub(super) mod reachable;
pub mod time_clock;
pub(super) mod time_optimal;
