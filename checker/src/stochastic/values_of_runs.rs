//! What the values of the runs of a query are, and how they are distributed.

use super::samples::{Distribution, Samples};
use crate::ir::{Path, RunLimit, Statistical};

/// What the values of runs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// The time at which a run was decided.
    Time,
    /// The value of the clock that bounds runs, at that time.
    Clock,
    /// The number of moves until then.
    Moves,
    /// The value that is asked for.
    Value,
}

/// How the values of the runs of a query are distributed.
#[derive(Clone, Debug, PartialEq)]
pub struct ValuesOfRuns {
    /// What the values are.
    pub measured: Measured,
    /// Whether they are those of runs that break what is asked: so for `[] p`, whose satisfied runs
    /// are all decided at their end.
    pub of_broken: bool,
    /// How many runs there were; some of them may have no value.
    pub runs: u64,
    /// The risk that the true cumulative distribution leaves the band, wherever that be.
    pub alpha: f64,
    /// The values.
    pub distribution: Distribution,
}

impl ValuesOfRuns {
    /// What was seen of the runs of a query; `None` if runs of such a query have no values.
    pub fn new(
        query: &Statistical,
        runs: u64,
        alpha: f64,
        samples: Samples,
    ) -> Option<ValuesOfRuns> {
        let (measured, of_broken) = measured(query)?;
        Some(ValuesOfRuns {
            measured,
            of_broken,
            runs,
            alpha,
            distribution: samples.distribution(),
        })
    }

    /// Whether the values are those of runs that break what is asked.
    pub fn are_of_broken(query: &Statistical) -> bool {
        measured(query).is_some_and(|(_, of_broken)| of_broken)
    }

    /// How far the true cumulative distribution is from that of the runs, everywhere at once.
    ///
    /// Runs without a value count as if it were infinite. The number of runs must not be chosen by
    /// their results.
    ///
    /// Source: P. Massart, "The tight constant in the Dvoretzky-Kiefer-Wolfowitz inequality",
    /// Annals of Probability 18 (1990).
    pub fn band(&self) -> f64 {
        ((2.0 / self.alpha).ln() / (2.0 * self.runs as f64)).sqrt()
    }
}

/// What the values of the runs of a query are, and whether they are of those that break what is
/// asked.
fn measured(query: &Statistical) -> Option<(Measured, bool)> {
    match query {
        Statistical::Probability(bound, path) | Statistical::Hypothesis { bound, path, .. } => {
            let measured = match bound.limit {
                RunLimit::Time => Measured::Time,
                RunLimit::Clock(_) => Measured::Clock,
                RunLimit::Moves => Measured::Moves,
            };
            Some((measured, matches!(path, Path::Always(_))))
        }
        Statistical::Expectation { .. } => Some((Measured::Value, false)),
        Statistical::Comparison { .. } | Statistical::Simulation(_) => None,
    }
}
