//! Fewer states: symmetry of scalar sets, and stubborn sets of processes.

pub(super) mod independence;
pub(super) mod ordered_receivers;
pub mod partial_order;
pub(super) mod scalar_swaps;
pub mod stubborn_sets;
pub mod symmetry;
pub(super) mod time_stoppers;
