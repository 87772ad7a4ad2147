//! Games under partial observation: the controller sees only the values of some predicates, and
//! sees them only when they change.
//!
//! An *observation* is the values of all predicates of the query in a state. As long as it stays
//! the same, the controller proposes one [`Action`]: a channel, an edge without a channel, or
//! nothing. The proposed action is taken as soon as it is possible, again and again. The
//! environment moves when it likes; where both can move, the environment may move first. It also
//! chooses among the moves that the action allows. When the observation changes, the controller
//! sees the new one and proposes an action again. So the controller knows only the sequence of
//! observations without repetitions, and a strategy is a Moore machine over observations.
//!
//! The position of the controller is a *knowledge set*: the states in which play may be when the
//! observation has just changed. For each action, the play inside one observation ([`class`]) leads
//! to one knowledge set for each next observation, or is lost:
//! * if play may break what must be kept;
//! * if the goal must be reached, and play may stay in the observation for ever without reaching
//!   it: by waiting, where time stops and nobody has to move, or by infinitely many moves, however
//!   little time they take;
//! * if time may stop where the controller has moves but does not propose one of them, and the
//!   environment need not move.
//!
//! Runs that reach the goal are won there and leave the set, whether the controller sees it or not.
//! So a goal need not be an observation. The result is a finite game of two players: one chooses
//! the action, the other the next observation ([`solver`]).
//!
//! There must be a first moment at which an observation changes and at which an action becomes
//! possible. The rules on observations and models ensure this: clocks are observed by `x >= c` and
//! `x < c`, and controllable guards have no strict lower bounds.
//!
//! Knowledge sets are extrapolated like the zones of games, with the constants of observations. No
//! move, observation or goal can distinguish the added states from the old ones, now or later, so
//! the same machines win.
//!
//! Source: F. Cassez, A. David, K. G. Larsen, D. Lime, J.-F. Raskin, "Timed Control with
//! Observation Based and Stuttering Invariant Strategies", ATVA 2007. Where we differ: goals need
//! not be observable. Where time stops, the rules for forced moves of full observation apply, so
//! that a controller who wins under partial observation also wins under full observation.

mod class;
mod knowledge;
mod machine;
mod place;
mod solver;

pub use knowledge::{Knowledge, Observation};
pub use machine::{Action, Machine, MachineState, Question};
pub use solver::{Outcome, Solver};
