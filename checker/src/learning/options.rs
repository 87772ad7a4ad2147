//! How a strategy is learned.

use std::ops::Range;

/// How the values of actions are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// Q-learning: each sample moves the value of its action.
    Q,
    /// M-learning: the values are those of the finite process that all samples make.
    #[default]
    M,
}

/// All that determines what is learned.
#[derive(Clone, Debug)]
pub struct Learning {
    /// How values are computed.
    pub method: Method,
    /// The seed of all runs.
    pub seed: u64,
    /// How many threads make runs.
    pub threads: usize,
    /// How many words exact values take.
    pub width: usize,
    /// The most iterations.
    pub iterations: u64,
    /// How many runs an iteration learns from; `None` leaves it to the length of runs.
    pub learning_runs: Option<u64>,
    /// How many runs judge the strategy of an iteration.
    pub judging_runs: Option<u64>,
    /// So many iterations without a better strategy, and learning ends or begins anew. `None` is
    /// [`PATIENCE`], but not while cuts become finer.
    pub patience: Option<u64>,
    /// How often it begins anew.
    pub resets: u64,
    /// What a cost counts a decision earlier, as a part of itself; `None` is 1, but
    /// [`LONG_DISCOUNT`] where runs have more than [`LONG`] decisions.
    pub discount: Option<f64>,
    /// In Q-learning: the n-th sample counts for 1 / min(`alpha`, n + 1).
    pub alpha: f64,
    /// How often decisions are random while learning.
    pub randomness: f64,
    /// When cells are cut: the least sum of squares of t,
    pub score: f64,
    /// the least difference of costs, as a part of the standard deviation of random runs: in the
    /// first iteration, and in the last ones,
    pub difference: Range<f64>,
    /// the least number of samples on each side,
    pub samples: usize,
    /// and the most cells.
    pub cells: usize,
    /// How much of what is behind a decision is what has followed, in long runs; the rest is what
    /// the cells promise, whose errors add up from decision to decision.
    pub trace: f64,
    /// How many decisions are remembered.
    pub memory: usize,
}

/// An iteration has about so many decisions: the first of them this many,
const FIRST_STEPS: f64 = 20_000.0;
/// each further one so many times more,
const GROWTH: f64 = 1.4;
/// up to this many.
const MOST_STEPS: f64 = 400_000.0;
/// About so many decisions judge a strategy.
const JUDGING_STEPS: f64 = 200_000.0;

/// A run of more decisions is long: what is far away then is discounted, or else what a single
/// decision costs is lost in the noise of all that follow.
pub(super) const LONG: f64 = 100.0;
/// The discount of long runs.
pub(super) const LONG_DISCOUNT: f64 = 0.995;
/// After so many iterations without a better strategy there is hardly one.
const PATIENCE: u64 = 5;
/// How much smaller the least difference is in each iteration.
const FINER: f64 = 0.75;

fn is_long(steps_of_run: f64) -> bool {
    steps_of_run > LONG
}

impl Default for Learning {
    fn default() -> Learning {
        Learning {
            method: Method::default(),
            seed: 0,
            threads: 1,
            width: 0,
            iterations: 30,
            learning_runs: None,
            judging_runs: None,
            patience: None,
            resets: 0,
            discount: None,
            alpha: 1000.0,
            randomness: 0.2,
            score: 10.0,
            difference: 0.02..0.002,
            samples: 24,
            cells: 200_000,
            trace: 0.7,
            memory: 3_000_000,
        }
    }
}

impl Learning {
    /// The discount, if a run has so many decisions.
    pub(super) fn discount(&self, steps_of_run: f64) -> f64 {
        let fitting = if is_long(steps_of_run) {
            LONG_DISCOUNT
        } else {
            1.0
        };
        self.discount.unwrap_or(fitting)
    }

    /// How much of what is behind a decision is what has followed, if a run has so many decisions.
    pub(super) fn trace(&self, steps_of_run: f64) -> f64 {
        if is_long(steps_of_run) {
            self.trace
        } else {
            0.0
        }
    }

    /// The least difference of costs in this iteration.
    pub(super) fn difference(&self, iteration: u64) -> f64 {
        let Range { start, end } = self.difference;
        (start * FINER.powi(iteration as i32)).max(end)
    }

    /// Whether it ends or begins anew after this iteration, if the strategies of so many were not
    /// better.
    pub(super) fn has_enough(&self, iteration: u64, worse: u64) -> bool {
        let is_finest = self.difference(iteration) <= self.difference.end;
        match self.patience {
            Some(patience) => worse >= patience,
            None => worse >= PATIENCE && is_finest,
        }
    }

    /// How many runs this iteration learns from, if a run has so many decisions.
    pub(super) fn runs(&self, iteration: u64, steps_of_run: f64) -> u64 {
        let steps = (FIRST_STEPS * GROWTH.powi(iteration as i32)).min(MOST_STEPS);
        let fitting = (steps / steps_of_run).clamp(50.0, 100_000.0) as u64;
        self.learning_runs
            .unwrap_or(if iteration == 0 { 500 } else { fitting })
    }

    /// How many runs judge the strategy of an iteration.
    pub(super) fn judging(&self, steps_of_run: f64) -> u64 {
        let fitting = (JUDGING_STEPS / steps_of_run).clamp(200.0, 100_000.0) as u64;
        self.judging_runs.unwrap_or(fitting)
    }
}
