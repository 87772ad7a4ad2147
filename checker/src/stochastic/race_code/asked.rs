//! What is asked of a run, and how it ended.

use crate::ir::{FunctionId, Path};
use crate::stochastic::condition::Condition;
use crate::stochastic::program::Program;

/// What is asked of the states of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::stochastic) enum Watched {
    Eventually(Condition),
    Always(Condition),
    /// The first condition, until the second holds.
    Until(Condition, Condition),
    /// The greatest value of a function, times this sign.
    Extreme(FunctionId, f64),
}

/// What is asked of a run.
#[derive(Clone, Copy, Debug)]
pub enum Asked<'q> {
    /// Whether it has what a path says.
    Path(&'q Path),
    /// The least value that a function leaves, or the greatest if this is true.
    Extreme(FunctionId, bool),
}

impl Watched {
    /// What is asked, unless it is a formula with operators over time.
    pub(in crate::stochastic) fn of(asked: Asked<'_>) -> Option<Watched> {
        Some(match asked {
            Asked::Extreme(value, true) => Watched::Extreme(value, 1.0),
            Asked::Extreme(value, false) => Watched::Extreme(value, -1.0),
            Asked::Path(Path::Eventually(goal)) => Watched::Eventually(Condition::of(goal)),
            Asked::Path(Path::Always(keep)) => Watched::Always(Condition::of(keep)),
            Asked::Path(Path::Until(keep, goal)) => {
                Watched::Until(Condition::of(keep), Condition::of(goal))
            }
            Asked::Path(Path::Formula(_)) => return None,
        })
    }

    /// Whether the code can watch for it.
    pub(super) fn is_known(&self, program: &Program<'_>) -> bool {
        let is_curved = |one: Condition| matches!(one, Condition::Curved(_));
        match *self {
            Watched::Eventually(one) | Watched::Always(one) => !is_curved(one),
            Watched::Until(keep, goal) => !is_curved(keep) && !is_curved(goal),
            Watched::Extreme(value, _) => !program.is_timed(value),
        }
    }
}

/// How a run ended that the code has made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::stochastic) struct End {
    /// Whether it has what was asked, if that was decided before its bound.
    pub(in crate::stochastic) decided: Option<bool>,
    /// How long it lasted.
    pub(in crate::stochastic) time: f64,
    pub(in crate::stochastic) moves: u64,
    /// The greatest value, times the sign.
    pub(in crate::stochastic) best: f64,
}
