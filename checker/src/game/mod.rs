//! Timed games: on-the-fly solving, strategies and plans.
//!
//! The controller owns a move if all participating edges are controllable; all other moves are the environment's. The
//! environment is faster: where both can move at the same instant, it may.

pub mod graph;
pub mod plans;
pub mod programs;
pub mod reach;
pub mod strategy;

/// What happens at a point where time cannot pass and the environment has a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Forced {
    /// TIGA's rule: the environment must move if the component whose invariant (or urgent location) stops time has no
    /// controllable move there.
    #[default]
    Tiga,
    /// The environment must move if no controllable move of the whole network is possible there.
    Product,
    /// The environment must move; the controller may always decline.
    Neutral,
}
