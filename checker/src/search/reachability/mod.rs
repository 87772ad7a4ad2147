//! The search for a reachable state, by one thread or several.

pub(super) mod canonical;
pub(super) mod expand;
pub mod goal;
pub(super) mod parallel;
pub(super) mod recent;
pub mod report;
pub(super) mod retrace;
pub mod search;
pub(super) mod shard;
pub(super) mod tree;
