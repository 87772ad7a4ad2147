//! Search over symbolic states: stores, orders, limits, reachability, liveness, extrema and traces.

pub mod limits;

pub mod liveness;
pub mod optimum;
pub mod outcome;
pub mod reachability;
pub mod store;
pub mod timed_trace;

pub use limits::{Counters, StopReason, Watch};
pub use outcome::{Outcome, Trace};
pub use store::discrete_states::{DiscreteId, RecordSize, StateStore};
