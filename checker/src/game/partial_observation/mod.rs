//! Games under partial observation: the controller sees the values of some predicates, and these
//! only where they change.
//!
//! An *observation* is the values of all predicates of the query in a state. As long as it stays
//! the same, the controller proposes one [`Action`]: a channel, an edge without a channel, or
//! nothing. What it proposes is taken as soon as it is possible, again and again; the environment
//! moves when it likes, first where both can, and chooses among the moves that the action allows.
//! When the observation changes, the controller sees the new one and proposes anew. So all that it
//! knows of the state is the sequence of observations without repetitions, and a strategy is a
//! Moore machine over observations.
//!
//! Where the controller stands is a *knowledge set*: the states in which it may be when the
//! observation has just changed. For each action, the play inside one observation ([`class`]) leads
//! to one knowledge set for each next observation, or is lost:
//! * if what must be kept may be broken on the way;
//! * if the goal must be reached, and play may stay in the observation for ever without: by
//!   waiting, where time stops and nobody has to move, or by moves without end, however little time
//!   they take;
//! * if time may stop where the controller has moves, does not propose one of them, and the
//!   environment need not move.
//!
//! Runs that meet the goal are won there and leave the set, whether the controller sees it or not,
//! so a goal need not be an observation. What is left is a finite game of two players, who choose
//! the action and the next observation ([`solver`]).
//!
//! That there is a first moment at which an observation changes and at which an action becomes
//! possible is what the rules on observations and models are for: clocks are observed by `x >= c`
//! and `x < c`, and controllable guards have no strict lower bounds.
//!
//! Knowledge sets are extrapolated as the zones of games are, with the constants of observations:
//! what is added cannot be told apart from what was there by any move, observation or goal, now or
//! later, so the same machines win from it.
//!
//! Source: F. Cassez, A. David, K. G. Larsen, D. Lime, J.-F. Raskin, "Timed Control with
//! Observation Based and Stuttering Invariant Strategies", ATVA 2007. Where we differ: goals need
//! not be observable, and where time stops, the rules for forced moves of full observation decide,
//! so that who wins under partial observation wins under full observation too.

mod class;
mod knowledge;
mod machine;
mod place;
mod solver;

pub use knowledge::{Knowledge, Observation};
pub use machine::{Action, Machine, MachineState, Question};
pub use solver::{Outcome, Solver};
