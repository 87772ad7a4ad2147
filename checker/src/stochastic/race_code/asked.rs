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
    /// What is asked, if the code can watch for it.
    pub(in crate::stochastic) fn of(asked: Asked<'_>, program: &Program<'_>) -> Option<Watched> {
        let path = match asked {
            Asked::Path(path) => path,
            Asked::Extreme(value, maximum) => {
                let sign = if maximum { 1.0 } else { -1.0 };
                let watched = Watched::Extreme(value, sign);
                return (!program.is_timed(value)).then_some(watched);
            }
        };
        let watched = match path {
            Path::Eventually(goal) => Watched::Eventually(Condition::of(goal)),
            Path::Always(keep) => Watched::Always(Condition::of(keep)),
            Path::Until(keep, goal) => Watched::Until(Condition::of(keep), Condition::of(goal)),
            Path::Formula(_) => return None,
        };
        let conditions = match watched {
            Watched::Eventually(one) | Watched::Always(one) => [one, Condition::Always],
            Watched::Until(keep, goal) => [keep, goal],
            Watched::Extreme(..) => return None,
        };
        let is_curved = |one: &Condition| matches!(one, Condition::Curved(_));
        (!conditions.iter().any(is_curved)).then_some(watched)
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
