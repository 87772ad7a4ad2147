//! Winning sets, computed backwards.

pub(super) mod account;
pub(super) mod agenda;
pub(super) mod branch_points;
pub mod budget;
pub(super) mod edge_predecessors;
pub(super) mod forced_moves;
pub(super) mod full_backward;
pub(super) mod gains;
pub(super) mod losing_timed;
pub(super) mod losing_untimed;
pub(super) mod parallel;
pub(super) mod predecessors;
pub(super) mod propagation;
pub(super) mod ranks;
pub(super) mod restart;
pub(super) mod targets;
pub mod winning_sets;
