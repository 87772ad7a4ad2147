//! The zone graph: delay, successors, predicates and deadlocks of symbolic states.

pub(super) mod allowed_moves;
pub(super) mod clock_effect;
pub(super) mod constant_effect;
pub(super) mod deadlock;
pub(super) mod delay;
pub(super) mod known_successors;
pub(super) mod packed_effects;
pub mod predicate;
pub mod restriction;
pub(super) mod successor_cache;
pub mod zone_graph;
