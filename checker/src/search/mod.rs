//! Search over symbolic states: stores, orders, limits, reachability, liveness, extrema and traces.

mod durations;
pub mod endless;
mod explore;
pub mod extremum;
pub mod goal;
pub mod leads_to;
pub mod limits;
pub mod liveness;
mod packed_zones;
mod parallel;
mod passed;
mod paths;
mod pieced_table;
pub mod plain;
pub mod reach;
mod recent;
mod representatives;
mod retrace;
pub mod schedule;
mod shard;
mod staying;
pub mod store;
pub mod taking;
mod times;
mod tree;
mod zone_lists;

pub use limits::{Counters, StopReason, Watch};
pub use store::{DiscreteId, StateStore};
