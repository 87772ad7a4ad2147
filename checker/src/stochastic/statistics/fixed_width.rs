//! The rule by which UPPAAL 5 estimates a probability: runs are made until both bounds of the
//! Clopper-Pearson interval are within epsilon of the estimate.
//!
//! The interval is that of a fixed number of runs, and stopping by what was seen is not corrected.
//! The tests compute exactly how often it misses the probability nevertheless: for alpha = 0.05 and
//! 0.01 and epsilon = 0.05 less often than alpha, for every probability of a fine grid.

use statrs::distribution::{ContinuousCDF, Normal};

use super::binomial::{at_least, at_most};

/// An estimate in the making.
#[derive(Clone, Debug)]
pub struct FixedWidth {
    alpha: f64,
    epsilon: f64,
    /// How many standard deviations the normal distribution takes for half an interval.
    quantile: f64,
    runs: u64,
    satisfied: u64,
}

/// From so many results of each kind on, the interval is at least as wide as the normal
/// distribution says, but for [`SAFETY`].
const MANY: u64 = 1000;

/// So much narrower than its normal approximation an interval with [`MANY`] results of each kind
/// never is.
const SAFETY: f64 = 0.99;

impl FixedWidth {
    /// One without runs.
    pub fn new(alpha: f64, epsilon: f64) -> FixedWidth {
        FixedWidth {
            alpha,
            epsilon,
            quantile: Normal::standard().inverse_cdf(1.0 - alpha / 2.0),
            runs: 0,
            satisfied: 0,
        }
    }

    /// After how many runs the rule stops if half of them are satisfied, at most so many.
    pub fn runs_for_one_half(alpha: f64, epsilon: f64, most: u64) -> u64 {
        let is_narrow = |pairs: u64| {
            let state = FixedWidth {
                runs: 2 * pairs,
                satisfied: pairs,
                ..FixedWidth::new(alpha, epsilon)
            };
            state.is_narrow()
        };
        let (mut low, mut high) = (0, 1);
        while 2 * high < most && !is_narrow(high) {
            (low, high) = (high, 2 * high);
        }
        while high - low > 1 {
            let middle = low.midpoint(high);
            if is_narrow(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        most.min(2 * high)
    }

    /// Adds a run; returns whether it is the last one.
    pub fn push(&mut self, satisfied: bool) -> bool {
        self.runs += 1;
        self.satisfied += u64::from(satisfied);
        self.is_narrow()
    }

    fn is_narrow(&self) -> bool {
        !self.is_far_too_wide() && self.is_exactly_narrow()
    }

    /// Whether the normal distribution is enough to say that the interval is too wide.
    fn is_far_too_wide(&self) -> bool {
        let (runs, successes) = (self.runs, self.satisfied);
        if successes < MANY || runs - successes < MANY {
            return false;
        }
        let estimate = successes as f64 / runs as f64;
        let deviation = (estimate * (1.0 - estimate) / runs as f64).sqrt();
        SAFETY * self.quantile * deviation > self.epsilon
    }

    fn is_exactly_narrow(&self) -> bool {
        let (runs, successes) = (self.runs, self.satisfied);
        let estimate = successes as f64 / runs as f64;
        let (low, high) = (estimate - self.epsilon, estimate + self.epsilon);
        let risk = self.alpha / 2.0;
        (low <= 0.0 || at_least(successes, runs, low) <= risk)
            && (high >= 1.0 || at_most(successes, runs, high) <= risk)
    }
}

#[cfg(test)]
mod tests {
    use super::super::binomial::{Interval, clopper_pearson};
    use super::FixedWidth;

    fn state(alpha: f64, epsilon: f64, runs: u64, satisfied: u64) -> FixedWidth {
        FixedWidth {
            runs,
            satisfied,
            ..FixedWidth::new(alpha, epsilon)
        }
    }

    /// Whether the rule stops after this many runs, and what it has counted.
    fn stops(successes: u64, runs: u64, epsilon: f64) -> bool {
        state(0.05, epsilon, runs, successes).is_narrow()
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

    #[test]
    fn one_half_takes_as_many_runs_as_results_that_alternate() {
        for (alpha, epsilon) in [(0.05, 0.05), (0.01, 0.05), (0.05, 0.01), (0.3, 0.2)] {
            let mut rule = FixedWidth::new(alpha, epsilon);
            let mut runs = 0;
            loop {
                runs += 2;
                // Between the two there is one satisfied run more than others.
                rule.push(true);
                if rule.push(false) {
                    break;
                }
            }
            assert_eq!(
                FixedWidth::runs_for_one_half(alpha, epsilon, 1 << 40),
                runs,
                "{alpha} {epsilon}"
            );
        }
        assert_eq!(FixedWidth::runs_for_one_half(0.05, 0.05, 1 << 40), 402);
        assert_eq!(FixedWidth::runs_for_one_half(0.05, 0.05, 100), 100);
        // The normal distribution says 0.96 / epsilon^2.
        let many = FixedWidth::runs_for_one_half(0.05, 1e-5, 1 << 40) as f64;
        assert!((many / 0.960_365e10 - 1.0).abs() < 1e-4, "{many}");
        assert_eq!(FixedWidth::runs_for_one_half(0.05, 1e-9, 1 << 40), 1 << 40);
    }

    /// At which numbers of runs and of satisfied ones the rule stops, up to the number at which it
    /// always does: of each the interval, or `None` where it goes on.
    fn ends(alpha: f64, epsilon: f64) -> Vec<Vec<Option<Interval>>> {
        const UNREACHED: Option<Interval> = Some(Interval {
            lower: 0.0,
            upper: 1.0,
        });
        let mut ends: Vec<Vec<Option<Interval>>> = Vec::new();
        for runs in 1.. {
            let before = ends.last();
            let goes_on = |satisfied: usize| {
                before.is_none_or(|row| matches!(row.get(satisfied), Some(None)))
            };
            let row: Vec<Option<Interval>> = (0..=runs)
                .map(|satisfied| {
                    let index = satisfied as usize;
                    if !(goes_on(index) || index.checked_sub(1).is_some_and(goes_on)) {
                        return UNREACHED;
                    }
                    let state = state(alpha, epsilon, runs, satisfied);
                    state
                        .is_narrow()
                        .then(|| clopper_pearson(state.satisfied, state.runs, alpha))
                })
                .collect();
            let is_last = row.iter().all(Option::is_some);
            ends.push(row);
            if is_last {
                break;
            }
        }
        ends
    }

    /// The probability that the interval misses `p`, by dynamic programming over all results, and
    /// the mean number of runs.
    fn risk(ends: &[Vec<Option<Interval>>], p: f64) -> (f64, f64) {
        let mut open = vec![1.0];
        let (mut missed, mut runs) = (0.0, 0.0);
        for row in ends {
            let mut next = vec![0.0; row.len()];
            for (satisfied, weight) in open.iter().enumerate() {
                runs += weight;
                next[satisfied] += weight * (1.0 - p);
                next[satisfied + 1] += weight * p;
            }
            for (weight, end) in next.iter_mut().zip(row) {
                if let Some(interval) = end {
                    if !(interval.lower <= p && p <= interval.upper) {
                        missed += *weight;
                    }
                    *weight = 0.0;
                }
            }
            open = next;
        }
        (missed, runs)
    }

    /// Checks that the interval misses less often than `alpha`, for 499 probabilities; beyond 1/2
    /// everything is the same the other way round.
    #[track_caller]
    fn check_risk(alpha: f64, epsilon: f64, most_runs: usize) {
        let ends = ends(alpha, epsilon);
        assert_eq!(ends.len(), most_runs, "the longest estimate");
        let mut worst: f64 = 0.0;
        for i in 1..500 {
            let p = f64::from(i) / 1000.0;
            let (risk, _) = risk(&ends, p);
            assert!(risk <= alpha, "{p}: {risk}");
            worst = worst.max(risk);
        }
        // It is not far too careful either.
        assert!(worst > 0.9 * alpha, "{worst}");
    }

    #[test]
    fn the_interval_misses_less_often_than_alpha() {
        check_risk(0.05, 0.05, 404);
    }

    #[test]
    fn the_interval_misses_less_often_than_a_smaller_alpha() {
        check_risk(0.01, 0.05, 683);
    }

    #[test]
    fn the_normal_distribution_never_says_too_wide_where_it_is_not() {
        for alpha in [0.2, 0.05, 0.001] {
            for runs in [2_000, 2_500, 10_000, 100_000, 3_000_000] {
                for satisfied in [1_000, 1_001, runs / 4, runs / 2, runs - 1_000] {
                    let interval = clopper_pearson(satisfied, runs, alpha);
                    let share = satisfied as f64 / runs as f64;
                    let half = (share - interval.lower).max(interval.upper - share);
                    let narrow = state(alpha, half * (1.0 + 1e-9), runs, satisfied);
                    assert!(narrow.is_exactly_narrow(), "{alpha} {satisfied}/{runs}");
                    assert!(!narrow.is_far_too_wide(), "{alpha} {satisfied}/{runs}");
                    let wide = state(alpha, half * 0.9, runs, satisfied);
                    assert!(
                        wide.is_far_too_wide() || satisfied < 1_000 || runs - satisfied < 1_000
                    );
                }
            }
        }
    }

    #[test]
    fn the_mean_number_of_runs_is_that_of_an_independent_computation() {
        let ends = ends(0.05, 0.05);
        for (p, expected) in [(0.001, 74.0), (0.1, 199.0), (0.4, 397.0)] {
            let (_, runs) = risk(&ends, p);
            assert!((runs - expected).abs() < 1.0, "{p}: {runs}");
        }
    }
}
