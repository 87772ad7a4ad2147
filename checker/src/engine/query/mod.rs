//! One file for each kind of query.

pub(super) mod attempts;
pub(super) mod budgets;
pub(super) mod cooperative;
pub(super) mod dispatch;
pub(super) mod extremum;
pub(super) mod game;
pub(super) mod game_zones;
mod joint;
pub(super) mod liveness;
pub(super) mod optimal_trace;
pub mod partial_observation;
pub(super) mod plans;
mod prepared;
pub(super) mod reachable;
mod restriction;
mod splitting;
mod statistical;
pub(crate) mod subject;
pub mod time_clock;
pub(super) mod time_optimal;
mod watched_runs;
pub(super) mod witnesses;
