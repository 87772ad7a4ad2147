//! What is asked of an estimate, and what it says.

use super::statistics::{Decision, FixedWidth, Method};
use crate::ir::RunBound;

/// No estimate makes more runs than this.
pub(crate) const MOST_RUNS: u64 = 1_000_000_000_000_000;

/// What an estimate is to promise, and how it is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// The risk that the interval misses, or that a test says "below" wrongly.
    pub alpha: f64,
    /// The risk that a test says "at least" wrongly.
    pub beta: f64,
    /// Half the width of the interval of a probability.
    pub epsilon: f64,
    /// So far below and above its threshold a test promises nothing.
    pub delta: (f64, f64),
    /// A comparison of two probabilities promises nothing if the ratio of their odds lies between
    /// these.
    pub odds_ratios: (f64, f64),
    /// The step with which equations of clocks are solved; `None` leaves it to their errors.
    pub discretisation: Option<f64>,
    /// Whether intervals hold at every moment, so that anyone may look and stop.
    pub anytime: bool,
    /// Runs are made until both ends of the interval are within this part of the estimate.
    pub relative: Option<f64>,
    /// Between which numbers the values lie whose mean is asked for, if the user says so.
    pub value_bounds: Option<(f64, f64)>,
    /// What makes the interval of a mean.
    pub mean_method: MeanMethod,
    /// How many runs are made; `None` leaves it to the query and to the results.
    pub runs: Option<u64>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// How many threads make runs; results do not depend on it.
    pub threads: usize,
}

/// What makes the interval of a mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeanMethod {
    /// Empirical Bernstein intervals if bounds of the values are known, else Student's.
    Auto,
    /// Student's, which is right in the limit of many runs only.
    Student,
    /// Empirical Bernstein intervals; bounds of the values must be known.
    EmpiricalBernstein,
    /// By a band around the distribution; bounds of the values must be known.
    DvoretzkyKieferWolfowitz,
}

impl Precision {
    /// How many runs a mean takes if neither the user nor its query says it, nor how exact the mean
    /// is to be: as many as a probability of one half; `None` if something of this is said.
    pub(crate) fn assumed_runs(&self, bound: &RunBound) -> Option<u64> {
        let is_said = self.runs.or(bound.runs).is_some() || self.relative.is_some();
        let runs = || FixedWidth::runs_for_one_half(self.alpha, self.epsilon, MOST_RUNS);
        (!is_said).then(runs)
    }

    /// Whether the number of runs may depend on the results in any way.
    pub(super) fn is_sequential(&self) -> bool {
        self.anytime || self.relative.is_some()
    }
}

impl Default for Precision {
    fn default() -> Precision {
        Precision {
            alpha: 0.05,
            beta: 0.05,
            epsilon: 0.05,
            delta: (0.01, 0.01),
            odds_ratios: (0.9, 1.1),
            discretisation: None,
            anytime: false,
            relative: None,
            value_bounds: None,
            mean_method: MeanMethod::Auto,
            runs: None,
            seed: 0,
            threads: 1,
        }
    }
}

/// What was found out.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The share of runs that are satisfied, or the mean of their values.
    pub value: f64,
    /// The least value of the interval.
    pub lower: f64,
    /// The greatest value of the interval.
    pub upper: f64,
    /// The confidence of the interval; the method says what it means.
    pub confidence: f64,
    /// What made the interval.
    pub method: Method,
    /// How many runs were made.
    pub runs: u64,
    /// How many of them are satisfied; `None` for expectations.
    pub satisfied_runs: Option<u64>,
    /// What a test decided.
    pub decision: Option<Decision>,
    /// The estimate of the probability that this one was compared with.
    pub compared: Option<Box<Estimate>>,
    /// Whether all runs were made that were wanted.
    pub is_complete: bool,
}
