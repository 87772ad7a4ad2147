//! Winning sets, computed backwards.

pub(super) mod branch_points;
pub mod budget;
pub(super) mod forced_moves;
pub(super) mod full_backward;
pub(super) mod losing_timed;
pub(super) mod losing_untimed;
pub(super) mod memory;
pub(super) mod parallel;
pub(super) mod predecessors;
pub(super) mod ranks;
pub(super) mod result_cache;
pub mod solver;
pub(super) mod targets;
pub(super) mod winning_sets;
