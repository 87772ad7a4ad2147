//! The typed program and the flat network: what the engine runs.
//!
//! This is the hand-over point between the front end and everything below it. After it nobody looks
//! at source text: names and spans are kept only to name things to the user.
//!
//! Memory
//! * The discrete state is one array of 32-bit *words*: first the location index of each process,
//!   then the variables in order of declaration, then the `meta` variables. Two states are equal if
//!   their first [`Layout::identity_words`] words are; `meta` words are carried along and not
//!   compared.
//! * Integers, truth values and scalars take one word; a `double` takes two (its bits, low word
//!   first); arrays and structs are the concatenation of their parts in declaration order.
//! * Constants that must be addressed (constant arrays and structs) lie in [`Network::constants`];
//!   scalar constants are folded into the code. Local arrays and structs of functions lie in a
//!   frame of [`Function::frame_words`] words, zeroed on entry.
//!
//! Clocks are not part of the words. Clock 0 is the reference clock (always 0); the model's clocks
//! count from 1, arrays of clocks flattened. Channels are flattened likewise and count from 0.

mod ids;

mod chances;
mod code;
mod constants;
mod external;
mod formulas;
mod labels;
mod learning;
mod moves;
mod network;
mod operands;
mod queries;
mod runs;
mod shields;
mod statistical;

mod accesses;

pub use chances::*;
pub use code::*;
pub use constants::Constants;
pub use external::*;
pub use formulas::{Formula, Temporal};
pub use ids::*;
pub use labels::*;
pub use learning::*;
pub use moves::*;
pub use network::*;
pub(crate) use operands::{Access, Operand};
pub use queries::*;
pub use runs::*;
pub use shields::{Axis, Shield};
pub use statistical::*;
