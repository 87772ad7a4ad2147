//! One file for each kind of query.

pub(super) mod attempts;
pub(super) mod budgets;
pub(super) mod cooperative;
pub(super) mod dispatch;
pub(super) mod extremum;
pub(super) mod game;
pub(super) mod game_zones;
pub mod joint;
mod learned_zones;
pub(super) mod libraries;
pub(super) mod liveness;
pub(super) mod optimal_trace;
mod optimum;
pub mod partial_observation;
pub(super) mod plans;
pub(crate) mod problem;
pub(super) mod reachable;
mod restriction;
mod run_failure;
mod shield;
mod splitting;
pub(super) mod statistical;
pub mod time_clock;
pub(super) mod time_optimal;
mod watched_runs;
pub(super) mod witnesses;
