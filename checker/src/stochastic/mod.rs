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
mod precision;
mod program;
mod race;
mod run;
mod run_watch;
mod samples;
mod span;
pub mod statistics;
mod values_of_runs;
mod windows;

pub use estimate::{Simulated, estimate, estimate_watched, simulate};
pub use failure::{Failure, Stand};
pub use precision::{Estimate, MeanMethod, Precision};
pub use race::{ZENO_MOVES, ZENO_TIME};
pub use run::{Outcome, Runner, Trajectory};
pub use run_watch::{RunWatch, Shown};
pub use samples::{Distribution, Histogram, MOST_BINS, MOST_VALUES, Samples};
pub use values_of_runs::{Measured, ValuesOfRuns};
