//! The network's semantics: which moves a state has, what they do, and whether time may pass.
//!
//! [`Stepper`] works on the words of a state and collects clock constraints and assignments; it knows no zones.
//! [`Symbolic`] puts zones on top. Neither knows how states are stored or why they are wanted.
//!
//! Semantics: UPPAAL's, as the documentation's pages on edges, synchronisation and semantics give it. In short: guards of all
//! participants hold in the source state; updates run sender first, then receivers in process order; invariants of the target
//! hold after all updates; a committed location must take part if there is one; a broadcast takes along every process with an
//! enabled receiving edge.

mod audience;
pub mod bounds;
mod combinations;
mod deadlocks;
pub mod differences;
mod enumeration;
mod exposure;
pub mod failure;
mod fixed;
mod footprints;
mod holders;
mod instances;
mod interference;
mod listening;
pub mod live;
pub mod moves;
mod offers;
mod orbits;
mod pairing;
mod partners;
mod passage;
pub mod possibility;
pub mod predicate;
mod reads;
mod recurrence;
pub mod restriction;
mod scope;
pub mod selects;
pub mod stepper;
pub mod stubborn;
pub mod symbolic;
pub mod symmetry;
mod tables;
mod valuations;
mod watched;
mod zone_memo;

pub use bounds::{Abstraction, ClockBounds};
pub use failure::Failure;
pub use fixed::FixedMove;
pub use live::LiveVariables;
pub use moves::{MoveRef, Moves, Part, is_same_entry};
pub use offers::{OfferId, VectorId};
pub use orbits::Obstacle;
pub use predicate::Extent;
pub use restriction::{Allowed, Restriction};
pub use stepper::Stepper;
pub use stubborn::PartialOrder;
pub(crate) use stubborn::{Agenda, StubbornSets};
pub use symbolic::{ClockEffect, Symbolic};
pub use symmetry::{Permutation, Symmetry};
pub use zone_memo::{KeptZone, KnownZone, MemoLimits};
