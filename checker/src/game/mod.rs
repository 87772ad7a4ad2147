//! Timed games: on-the-fly solving, strategies and plans.
//!
//! The controller owns a move if all participating edges are controllable; all other moves are the
//! environment's. The environment is faster: where both can move at the same instant, it may. It
//! also picks the leg behind a branch point, whoever owns the edge that leads there.

pub mod backward;
pub mod exploration;
pub mod forward;
pub mod objectives;
pub mod partial_observation;
pub mod solver;
pub mod strategy;

use crate::search::limits::StopReason;

/// The players.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Player {
    /// The player for whom a control query asks.
    Controller,
    /// Its opponent.
    Environment,
}

impl Player {
    /// The other one.
    #[must_use]
    pub fn opponent(self) -> Player {
        match self {
            Player::Controller => Player::Environment,
            Player::Environment => Player::Controller,
        }
    }

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Player::Controller => "controller",
            Player::Environment => "environment",
        }
    }

    /// Whether the player owns a move that is, or is not, controllable.
    pub fn owns(self, controllable: bool) -> bool {
        controllable == (self == Player::Controller)
    }
}

/// Whether the priorities of channels and processes count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Priorities {
    /// TIGA's rule: they do not count, neither in games nor under the strategies that come from
    /// them.
    #[default]
    Ignored,
    /// A move is possible only where no move of a higher level is, whoever owns the two moves, as
    /// in all other queries.
    Kept,
}

/// What happens at a point where time cannot pass and the environment has a move. If it need not
/// move, it may decline, and then play stops unless the controller moves. A goal that must be
/// reached is then lost. If something has only to be kept, the controller must take a move if it
/// has one, and has lost if each of them loses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Forced {
    /// TIGA's rule: the environment must move if the component whose invariant (or urgent location)
    /// stops time has no controllable move there.
    #[default]
    Tiga,
    /// The environment must move if no controllable move of the whole network is possible there.
    Product,
    /// The environment must move; the controller may always decline.
    Neutral,
}

/// The kind of nodes in a game graph. The answer is the same for all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Nodes {
    /// Symbolic states first; then discrete states, if that is possible and there are many symbolic
    /// states for each discrete one.
    #[default]
    Automatic,
    /// Symbolic states: only what is reached.
    Symbolic,
    /// Discrete states with all that their invariants allow, where that is possible.
    Discrete,
}

/// How much must be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Until the verdict is known.
    Verdict,
    /// Until the verdict is known; if the seeker loses, until everything that the evader may do is
    /// there.
    Permissive,
    /// The winning valuations of all nodes that can be reached.
    Everything,
}

/// The winner of a game.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solution {
    /// This player wins from the initial valuation.
    Won(Player),
    /// A limit was reached first.
    Stopped(StopReason),
}

/// Whether play continues in the goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AfterGoal {
    /// It ends.
    Ends,
    /// Play continues, and the graph must show what follows.
    GoesOn,
    /// Play continues, and the goal makes no difference to it.
    IsLikeBefore,
}
