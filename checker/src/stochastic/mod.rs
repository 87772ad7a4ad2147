//! Statistical model checking: random runs of a network in the stochastic reading.
//!
//! Every run draws from a generator of its own, numbered by the run: run k of a seed is the same
//! whatever the number of threads, and results count in the order of run numbers.

mod collector;
mod condition;
mod estimate;
mod extreme;
mod failure;
mod in_order;
mod integrator;
mod machine;
mod motion;
mod program;
mod race;
mod run;
mod span;
pub mod statistics;
mod windows;

pub use estimate::{Estimate, MeanMethod, Precision, Simulated, estimate, simulate};
pub use failure::{Failure, Stand};
pub use race::{ZENO_MOVES, ZENO_TIME};
pub use run::{Outcome, Runner, Trajectory};
