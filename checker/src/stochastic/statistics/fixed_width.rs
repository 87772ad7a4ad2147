//! The rule by which UPPAAL 5 estimates a probability: runs are made until both bounds of the
//! Clopper-Pearson interval are within epsilon of the estimate.
//!
//! The interval is that of a fixed number of runs, and stopping by what was seen is not corrected.
//! The tests compute exactly how often it misses the probability nevertheless: at alpha = 0.05 and
//! epsilon = 0.05 less often than alpha, for every probability of a fine grid.

use super::binomial::{Interval, at_least, at_most, clopper_pearson};

/// An estimate in the making.
#[derive(Clone, Debug)]
pub struct FixedWidth {
    alpha: f64,
    epsilon: f64,
    runs: u64,
    satisfied: u64,
}

/// From so many results of each kind on, the normal distribution says well enough when the interval
/// is still far too wide.
const MANY: u64 = 1000;

/// So much narrower than its normal approximation an interval with [`MANY`] results of each kind
/// never is.
const SAFETY: f64 = 0.9;

/// A bound from below of how many standard deviations wide half an interval is: that at a risk of
/// 0.3; no one takes a greater risk and many runs.
const LEAST_QUANTILE: f64 = 1.0;

impl FixedWidth {
    /// One without runs.
    pub fn new(alpha: f64, epsilon: f64) -> FixedWidth {
        FixedWidth {
            alpha,
            epsilon,
            runs: 0,
            satisfied: 0,
        }
    }

    /// Adds a run; returns whether it is the last one.
    pub fn push(&mut self, satisfied: bool) -> bool {
        self.runs += 1;
        self.satisfied += u64::from(satisfied);
        self.is_narrow()
    }

    fn is_narrow(&self) -> bool {
        let (runs, successes) = (self.runs, self.satisfied);
        let estimate = successes as f64 / runs as f64;
        if successes >= MANY && runs - successes >= MANY {
            let deviation = (estimate * (1.0 - estimate) / runs as f64).sqrt();
            if SAFETY * LEAST_QUANTILE * deviation > self.epsilon {
                return false;
            }
        }
        let (low, high) = (estimate - self.epsilon, estimate + self.epsilon);
        let risk = self.alpha / 2.0;
        (low <= 0.0 || at_least(successes, runs, low) <= risk)
            && (high >= 1.0 || at_most(successes, runs, high) <= risk)
    }

    /// How many runs there were.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// How many of them are satisfied.
    pub fn satisfied(&self) -> u64 {
        self.satisfied
    }

    /// The Clopper-Pearson interval.
    pub fn interval(&self) -> Interval {
        clopper_pearson(self.satisfied, self.runs, self.alpha)
    }
}

#[cfg(test)]
mod tests {
    use super::FixedWidth;

    /// Whether the rule stops after this many runs, and what it has counted.
    fn stops(successes: u64, runs: u64, epsilon: f64) -> bool {
        FixedWidth {
            alpha: 0.05,
            epsilon,
            runs,
            satisfied: successes,
        }
        .is_narrow()
    }

    #[test]
    fn runs_end_where_published_ones_did() {
        for (successes, runs) in [(0, 72), (6, 135), (9, 153), (246, 316)] {
            assert!(stops(successes, runs, 0.05), "{successes}/{runs}");
        }
        for (successes, runs) in [(0, 71), (6, 134), (9, 152)] {
            assert!(!stops(successes, runs, 0.05), "{successes}/{runs}");
        }
        assert!(stops(0, 36_887, 1e-4) && !stops(0, 36_886, 1e-4));
    }

    /// The probability that the interval misses p, by dynamic programming over all results.
    fn risk(p: f64) -> f64 {
        let mut open = vec![1.0];
        let mut missed = 0.0;
        for runs in 1..=404_u64 {
            let mut next = vec![0.0; open.len() + 1];
            for (successes, weight) in open.iter().enumerate() {
                next[successes] += weight * (1.0 - p);
                next[successes + 1] += weight * p;
            }
            for (successes, weight) in next.iter_mut().enumerate() {
                let state = FixedWidth {
                    alpha: 0.05,
                    epsilon: 0.05,
                    runs,
                    satisfied: successes as u64,
                };
                if *weight > 0.0 && state.is_narrow() {
                    let interval = state.interval();
                    if !(interval.lower <= p && p <= interval.upper) {
                        missed += *weight;
                    }
                    *weight = 0.0;
                }
            }
            open = next;
        }
        assert!(open.iter().all(|&weight| weight == 0.0), "no run is longer");
        missed
    }

    #[test]
    fn the_interval_misses_less_often_than_alpha() {
        for i in 1..25 {
            let p = f64::from(i) / 50.0;
            let risk = risk(p);
            assert!(risk <= 0.05, "{p}: {risk}");
        }
    }
}
