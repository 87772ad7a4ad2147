//! The game graph and how it is made forwards.

pub(super) mod chain_cache;
pub(super) mod chance;
pub mod clock_programs;
pub(super) mod dead_ends;
pub(super) mod deadline;
pub mod graph;
pub(super) mod urgent_nodes;
