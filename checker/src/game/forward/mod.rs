//! The game graph and how it is made forwards.

pub(super) mod branch_points;
pub(super) mod chain_cache;
pub(super) mod chain_following;
pub mod clock_programs;
pub(super) mod dead_end_node;
pub(super) mod dead_ends;
pub(super) mod expansion;
pub mod graph;
pub mod node;
pub mod objective;
pub(super) mod standing;
pub(super) mod urgent_expansion;
pub(super) mod urgent_nodes;
