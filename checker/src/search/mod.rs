//! Search over symbolic states: stores, orders, limits, reachability and traces.

pub mod limits;
pub mod reach;
pub mod store;
pub mod zone_table;

pub use limits::{Counters, StopReason, Watch};
pub use store::{DiscreteId, StateStore};
