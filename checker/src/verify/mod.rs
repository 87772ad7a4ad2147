//! The independent check: what the engine claims, done again on concrete states.
//!
//! Nothing here uses the moves, zones, search or games of the engine. [`concrete`] computes the
//! moves of a state with exact clock values straight from the definitions, running code on the
//! interpreter, `symbolic` those of sets of values; [`regions`] makes the set of valuations finite;
//! [`strategy`] closes the loop between a strategy and every move of the environment, [`observed`]
//! that of one that goes by observations, both on sets of values and by the rules of `rules`, with
//! an [`Effort`]; [`replay`] follows a single run;
//! [`certificate`] checks that a set of states is closed and avoids a predicate; [`choices`] says
//! what can happen next in a state, for simulating runs; [`play`] the same for playing against a
//! strategy.
//!
//! A mistake in the front end or in the interpreter is shared with the engine and not found here;
//! one in moves, zones, extrapolation, compiled code or the solver is.

pub mod certificate;
pub mod choices;
mod code;
pub mod concrete;
mod defects;
mod effort;
mod expected_moves;
mod machine;
mod moments;
mod moves;
pub mod observed;
mod outcome;
mod place;
pub mod play;
pub mod regions;
pub mod replay;
mod rules;
mod stages;
pub mod strategy;
mod symbolic;
pub mod timed;
mod view;
mod waits;
mod winning;
mod zone;

pub use concrete::Semantics;
pub use effort::{Effort, GivenUp};
pub use moves::{Error, Move, Part, State};
pub use regions::Regions;
pub use replay::Violation;
