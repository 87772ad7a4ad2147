//! The best strategy: learned from random runs.
//!
//! What the controller sees of a state is an *observation*: exact values, and values in intervals.
//! A learned strategy says what each action costs from there on, cell by cell of a partition.

mod episode;
mod exact;
mod experience;
mod explorer;
mod in_zones;
mod judging;
mod learner;
mod observation;
mod options;
mod partition;
mod policy;
mod process;
mod refinement;
mod sample;
mod slopes;
mod strategy;
mod sums;
mod tree;
mod whole_state;

pub use exact::{Exact, ExactAnswer, Inexact, solve_exactly};
pub use in_zones::{Broken, InZones, NotInZones, StochasticReading};
pub use judging::{Comparison, compared, judge};
pub use learner::{Iteration, Learned, Mean, Progress, learn};
pub use options::{Learning, Method};
pub use partition::Partition;
pub use policy::{Asking, Policy, SeeingPolicy, Situation, seen_values};
pub use strategy::{Appraisal, Followed, LearnedStrategy, Regressor, order, values, words};
pub use tree::Node;
pub use whole_state::whole_state;
