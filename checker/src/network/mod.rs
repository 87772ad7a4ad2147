//! The semantics of networks: which moves a state has, what they do, and whether time may pass.
//!
//! [`Stepper`] works on the words of a state and collects clock constraints and assignments; it
//! knows no zones. [`Symbolic`] adds zones. Neither knows how states are stored or why they are
//! wanted.
//!
//! The semantics is UPPAAL's, as the documentation's pages on edges, synchronisation and semantics
//! give it. In short: guards of all participants hold in the source state; updates run sender
//! first, then receivers in process order; invariants of the target hold after all updates; if a
//! location is committed, a committed location must take part; every process with an enabled
//! receiving edge takes part in a broadcast.

pub mod discrete;
pub mod failure;

pub mod reduction;
pub mod symbolic;
mod trial;

pub use failure::Failure;
pub use symbolic::constant_effect::FixedMove;

pub use discrete::entry::{entry_of, is_same_entry};
pub use discrete::stepper::Stepper;
pub use discrete::transition::{MoveListId, MoveRef, Moves, Part};
pub use discrete::transition_cache::VectorId;
pub use reduction::partial_order::PartialOrder;
pub use reduction::scalar_swaps::Obstacle;
pub(crate) use reduction::stubborn_sets::{Agenda, StubbornSets};
pub use reduction::symmetry::{Permutation, Symmetry};
pub use symbolic::clock_effect::{ClockEffect, conjunction, conjunctions};
pub use symbolic::predicate::Extent;
pub use symbolic::restriction::{Allowed, Restriction};
pub use symbolic::successor_cache::{KeptZone, KnownZone, MemoLimits};
pub use symbolic::zone_graph::Symbolic;
