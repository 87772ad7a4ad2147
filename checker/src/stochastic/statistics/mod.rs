//! What the results of runs say of probabilities and means. Nothing here knows networks.
//!
//! Parameters are checked by whoever takes them from a user: risks lie between 0 and 1, numbers of
//! runs are at least 1.

mod binomial;
mod expectation;
mod fixed_width;
mod sequential_test;

pub use binomial::{Interval, clopper_pearson};
pub use expectation::Expectation;
pub use fixed_width::FixedWidth;
pub use sequential_test::{Decision, SequentialTest};
