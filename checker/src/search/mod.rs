//! Search over symbolic states: stores, orders, limits, reachability, liveness, extrema and traces.

pub mod limits;

pub mod liveness;
pub mod optimum;
pub mod reachability;
pub mod store;
pub mod timed_trace;

pub use limits::{Counters, StopReason, Watch};
pub use store::discrete_states::{DiscreteId, StateStore};
