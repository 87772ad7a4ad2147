//! Statistical model checking: random runs of a network in the stochastic reading.
//!
//! Every run draws from a generator of its own, numbered by the run: run k of a seed is the same
//! whatever the number of threads, and results count in the order of run numbers.

mod advice;
mod behaviour;
mod blocks;
mod collector;
mod comparison;
mod condition;
mod constants;
mod control;
mod correspondence;
mod cubic;
mod entry;
mod estimate;
mod extreme;
mod failure;
mod in_order;
mod integrator;
mod joint;
mod machine;
mod mitl;
mod motion;
mod observer;
mod precision;
mod program;
mod race;
mod race_code;
mod rare;
mod readers;
mod repeatable;
mod restriction;
mod rules;
mod run;
mod run_id;
mod run_watch;
mod samples;
mod splitting;
pub mod statistics;
mod unfolder;
mod values_of_runs;

pub use behaviour::Behaviour;
pub use blocks::{RunSource, Runs, block};
pub use collector::estimate;
pub use comparison::compare;
pub use constants::{MOVES_WITHOUT_RISE, ZENO_MOVES, ZENO_TIME};
pub use control::{Chooser, Chosen, ControllerMove, Guidance, Moment, StateView};
pub use correspondence::Correspondence;
pub use estimate::{Simulated, simulate};
pub use failure::{Failure, Stand};
pub use in_order::runs_by;
pub use joint::estimate_jointly;
pub use observer::Outcome;
pub use precision::{Estimate, MeanMethod, Precision};
pub use race::NotFinite;
pub use rare::{Rare, Splitting, estimate_rare};
pub use repeatable::is_repeatable;
pub use restriction::{Restriction, UnderChoice, Unfit};
pub use run::{Ended, Runner, Trajectory};
pub use run_id::RunId;
pub use run_watch::{RunWatch, Shown};
pub use samples::{Distribution, Histogram, MOST_BINS, MOST_VALUES, Samples};
pub use splitting::MOST_EFFORT;
pub use unfolder::{PossibleMove, Stage, Unfolder};
pub use values_of_runs::{Measured, ValuesOfRuns};
