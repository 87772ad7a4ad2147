//! Ways to play a game that may turn out to take too much: they are tried, and given up.

use crate::game::backward::budget::Budget;

/// States that a game is explored for without abstraction where two clocks are compared. Many such
/// games are finite so, and then far smaller than with zones that are cut along the comparisons.
const MOST_EXACT_STATES: u64 = 4096;

/// States that a game is explored for before it is looked whether there are many zones for each
/// discrete state.
pub(super) const STATES_BEFORE_CROWD: u64 = 2048;

/// So many zones for each discrete state are many.
pub(super) const CROWD: usize = 4;

/// The same in time-optimal games: with more of them, there will be more still.
pub(super) const CROWD_IN_RACES: usize = 2;

/// The greatest number of discrete states that are explored instead. If there are more, runs reach
/// few of them.
const MOST_DISCRETE_STATES: u64 = 64 * STATES_BEFORE_CROWD;

/// The average number of bytes that a discrete state may take before reached zones are tried again:
/// winning sets of everything that invariants allow can have many more pieces than those of what is
/// reached.
const MOST_BYTES_OF_DISCRETE_STATE: u64 = 64 << 10;

/// Units of work ([`crate::cancellation::work`]) that computing what a discrete state wins may
/// take, on average, for the same reason. Where the pieces stay few it takes far fewer, and where
/// they do not, many more soon.
const MOST_WORK_ON_DISCRETE_STATE: u64 = 1 << 20;

/// This many states are added to the stored ones, for the bytes and the work that an average state
/// may take.
const STATES_OF_GRACE: u64 = 256;

/// To play a game without abstraction.
pub(super) const WITHOUT_ABSTRACTION: Budget = Budget {
    explored: MOST_EXACT_STATES,
    bytes_each: u64::MAX,
    work_each: u64::MAX,
    states_of_grace: STATES_OF_GRACE,
};

/// To play a game in discrete states.
pub(super) const IN_DISCRETE_STATES: Budget = Budget {
    explored: MOST_DISCRETE_STATES,
    bytes_each: MOST_BYTES_OF_DISCRETE_STATE,
    work_each: MOST_WORK_ON_DISCRETE_STATE,
    states_of_grace: STATES_OF_GRACE,
};

/// To play a time-optimal game in discrete states. Beside the clock, zones that are reached are
/// rarely few enough to be worth more.
pub(super) const RACE_IN_DISCRETE_STATES: Budget = Budget {
    explored: 1 << 20,
    ..IN_DISCRETE_STATES
};

/// To play a game with a goal that is to recur in discrete states. All nodes are computed in each
/// round, in symbolic states too.
pub(super) const IN_DISCRETE_STATES_BY_ROUNDS: Budget = Budget {
    work_each: 16 * MOST_WORK_ON_DISCRETE_STATE,
    ..IN_DISCRETE_STATES
};
