//! What the results of runs say of probabilities and means. Nothing here knows networks.
//!
//! Parameters are checked by whoever takes them from a user: risks lie between 0 and 1, numbers of
//! runs are at least 1.

mod binomial;
mod bounded_mean;
mod distribution;
mod double_sampling;
#[cfg(test)]
pub(super) mod draws;
mod expectation;
mod fixed_width;
mod method;
mod probability_sequence;
mod sequential_test;

pub use binomial::{Interval, clopper_pearson};
pub use bounded_mean::BoundedMean;
pub use distribution::Distribution;
pub use double_sampling::DoubleSampling;
pub use expectation::Expectation;
pub use fixed_width::FixedWidth;
pub use method::Method;
pub use probability_sequence::ProbabilitySequence;
pub use sequential_test::{Decision, SequentialTest};
