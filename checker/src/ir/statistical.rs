//! Compiled statistical queries.

use super::ids::FunctionId;
use super::labels::Guard;
use super::learning::Optimum;
use super::runs::{Path, RunBound};

/// The kinds of statistical queries.
#[derive(Clone, Debug)]
pub enum Statistical {
    /// `Pr[bound](path)`
    Probability(RunBound, Path),
    /// `Pr[bound](path) >= threshold`, or `<=`.
    Hypothesis {
        /// How long a run is.
        bound: RunBound,
        /// What is asked of a run.
        path: Path,
        /// Whether it is `>=`.
        at_least: bool,
        /// The probability that is compared.
        threshold: f64,
    },
    /// `Pr[bound](path) >= Pr[bound](path)`, or `<=`.
    Comparison {
        /// How long a run for the first probability is, and what is asked of it.
        left: (RunBound, Path),
        /// The same for the second one.
        right: (RunBound, Path),
        /// Whether it is `>=`.
        at_least: bool,
    },
    /// `E[bound; runs](max: value)`
    Expectation {
        /// How long a run is.
        bound: RunBound,
        /// Whether the greatest value of a run counts, or the least.
        maximum: bool,
        /// Leaves the value as a double.
        value: FunctionId,
        /// Between which numbers the value always lies, if that is known.
        range: Option<(f64, f64)>,
    },
    /// `simulate [bound; runs] {a, b} : k : p`
    Simulation(Simulation),
}

/// What a run shows.
#[derive(Clone, Debug)]
pub struct ShownItem {
    /// Leaves the value as a double.
    pub value: FunctionId,
    /// The text of the expression.
    pub text: String,
    /// Whether the value may change otherwise than linearly while time passes.
    pub is_curved: bool,
}

/// A query for runs themselves.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// How long a run is, and how many there are.
    pub bound: RunBound,
    /// What is shown.
    pub items: Vec<ShownItem>,
    /// What a run must reach to be shown, and how many such runs there are at most.
    pub filter: Option<(Guard, u64)>,
}

/// What is asked of one run.
#[derive(Clone, Copy, Debug)]
pub enum Asked<'q> {
    /// Whether it has what a path says.
    Path(&'q Path),
    /// The least value that a function leaves, or the greatest if this is true.
    Extreme(FunctionId, bool),
    /// What a best strategy is best for, at the end of the run.
    End(&'q Optimum),
}

impl Statistical {
    /// How long the runs of a query are; the runs of the second probability of a comparison have a
    /// bound of their own.
    pub fn bound(&self) -> &RunBound {
        match self {
            Statistical::Probability(bound, _)
            | Statistical::Hypothesis { bound, .. }
            | Statistical::Expectation { bound, .. } => bound,
            Statistical::Comparison { left, .. } => &left.0,
            Statistical::Simulation(asked) => &asked.bound,
        }
    }

    /// What is asked of each run; `None` where runs are compared or shown.
    pub fn asked(&self) -> Option<Asked<'_>> {
        match self {
            Statistical::Probability(_, path) | Statistical::Hypothesis { path, .. } => {
                Some(Asked::Path(path))
            }
            Statistical::Expectation { value, maximum, .. } => {
                Some(Asked::Extreme(*value, *maximum))
            }
            Statistical::Comparison { .. } | Statistical::Simulation(_) => None,
        }
    }
}
