//! What is true of a network before any search: which clock bounds matter where, which variables
//! are live, which processes depend on each other, which comparisons can hold.

mod cells;
pub mod clock_bounds;
pub mod clock_differences;
pub(crate) mod dependence;
pub(crate) mod function_reads;
pub mod influence;
pub(crate) mod joint_resets;
pub mod live_variables;
pub(crate) mod location_splitting;
pub mod may_hold;
pub(crate) mod read_before_write;
pub(crate) mod visibility;
pub(crate) mod zero_time_cycles;

pub use clock_bounds::{Abstraction, ClockBounds};
pub use influence::Influence;
pub use live_variables::LiveVariables;
