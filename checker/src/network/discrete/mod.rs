//! Enabled edges, synchronisations and broadcasts of a discrete state, and the effect of moves on
//! its words.

pub(super) mod broadcast;
pub(super) mod broadcast_filter;
pub(super) mod broadcast_receivers;
pub(super) mod candidate;
pub(super) mod edge_tables;
pub(super) mod enabled_edges;
pub(super) mod entry;
pub(super) mod pairing;
pub(super) mod partners;
pub mod receivers;
pub(super) mod select_cache;
pub mod selects;
pub mod stepper;
pub mod transition;
pub(super) mod transition_cache;
