//! A confidence sequence of a probability: intervals, one after each run, that all hold the
//! probability together, but for a risk of alpha. So one may look after every run, and stop by
//! what one sees.
//!
//! Whoever bets against a probability p wins money only if p is wrong. The capital after n runs of
//! which k are satisfied is that of a gambler who believes in a mixture of all probabilities q, by
//! the density of Beta(1/2, 1/2):
//!
//! ```text
//! B(k + 1/2, n - k + 1/2) / B(1/2, 1/2) / (p^k (1 - p)^(n - k))
//! ```
//!
//! It is a martingale that begins with 1 if p is the probability, so it ever reaches 1 / alpha with
//! a risk of at most alpha (Ville's inequality). The interval is all p at which it has not.
//! The share k/n always lies within: there the capital is at most 1.
//!
//! Sources: H. Robbins, "Statistical methods related to the law of the iterated logarithm", Annals
//! of Mathematical Statistics 41 (1970), on mixtures; I. Waudby-Smith and A. Ramdas,
//! "Estimating means of bounded random variables by betting", JRSS B 86 (2024), section 4, on
//! capital; R. Krichevsky and V. Trofimov, "The performance of universal encoding", IEEE
//! Transactions on Information Theory 27 (1981), on the density: the capital is within a factor of
//! sqrt(n) of what the best probability in hindsight wins.

use statrs::function::gamma::ln_gamma;

use super::binomial::{Interval, halved};

/// What runs say of a probability, at any moment.
#[derive(Clone, Debug, Default)]
pub struct ProbabilitySequence {
    runs: u64,
    satisfied: u64,
}

impl ProbabilitySequence {
    /// The state after so many runs, of which so many are satisfied.
    pub fn after(runs: u64, satisfied: u64) -> ProbabilitySequence {
        ProbabilitySequence { runs, satisfied }
    }

    /// The logarithm of the mixture's capital, without the part of the probability that is bet
    /// against.
    fn mixture(&self) -> f64 {
        let (satisfied, failed) = (self.satisfied as f64, (self.runs - self.satisfied) as f64);
        // B(1/2, 1/2) is pi.
        ln_gamma(satisfied + 0.5) + ln_gamma(failed + 0.5)
            - ln_gamma(self.runs as f64 + 1.0)
            - std::f64::consts::PI.ln()
    }

    /// The logarithm of the capital won against `p`.
    fn won(&self, mixture: f64, p: f64) -> f64 {
        let (satisfied, failed) = (self.satisfied, self.runs - self.satisfied);
        let part = |count: u64, log: f64| if count == 0 { 0.0 } else { count as f64 * log };
        mixture - part(satisfied, p.ln()) - part(failed, (-p).ln_1p())
    }

    /// The interval after these runs.
    pub fn interval(&self, alpha: f64) -> Interval {
        let share = self.satisfied as f64 / self.runs as f64;
        let mixture = self.mixture();
        let is_lost = |p: f64| self.won(mixture, p) >= -alpha.ln();
        Interval {
            lower: if self.satisfied == 0 {
                0.0
            } else {
                halved(0.0, share, &is_lost)
            },
            upper: if self.satisfied == self.runs {
                1.0
            } else {
                halved(share, 1.0, &|p| !is_lost(p))
            },
        }
    }

    /// Whether both ends of the interval are within `half` of the share.
    pub fn is_within(&self, half: f64, alpha: f64) -> bool {
        let share = self.satisfied as f64 / self.runs as f64;
        let mixture = self.mixture();
        let is_lost = |p: f64| self.won(mixture, p) >= -alpha.ln();
        let (low, high) = (share - half, share + half);
        (low <= 0.0 || is_lost(low)) && (high >= 1.0 || is_lost(high))
    }
}

#[cfg(test)]
mod tests {
    use super::ProbabilitySequence;

    /// The probability that one of the intervals of the first `most` runs misses `p`, by dynamic
    /// programming over all results.
    fn ever_misses(p: f64, most: u64, alpha: f64) -> f64 {
        let mut open = vec![1.0];
        let mut missed = 0.0;
        for runs in 1..=most {
            let mut next = vec![0.0; open.len() + 1];
            for (satisfied, weight) in open.iter().enumerate() {
                next[satisfied] += weight * (1.0 - p);
                next[satisfied + 1] += weight * p;
            }
            for (satisfied, weight) in next.iter_mut().enumerate() {
                let now = ProbabilitySequence::after(runs, satisfied as u64);
                if *weight > 0.0 && now.won(now.mixture(), p) >= -f64::ln(alpha) {
                    missed += *weight;
                    *weight = 0.0;
                }
            }
            open = next;
        }
        missed
    }

    #[test]
    fn all_intervals_together_miss_less_often_than_alpha() {
        for alpha in [0.05, 0.01] {
            for p in [0.001, 0.01, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5] {
                let risk = ever_misses(p, 800, alpha);
                assert!(risk <= alpha, "{p}: {risk}");
                // It is not far too careful either.
                assert!(risk >= alpha / 100.0 || p < 0.01, "{p}: {risk}");
            }
        }
    }

    #[test]
    fn stopping_by_eye_breaks_intervals_of_fixed_numbers_only() {
        // Whoever stops as soon as an interval of Clopper and Pearson excludes 1/2 is wrong often.
        let mut open = vec![1.0];
        let mut wrong = 0.0;
        for runs in 1..=400_u64 {
            let mut next = vec![0.0; open.len() + 1];
            for (satisfied, weight) in open.iter().enumerate() {
                next[satisfied] += weight / 2.0;
                next[satisfied + 1] += weight / 2.0;
            }
            for (satisfied, weight) in next.iter_mut().enumerate() {
                let least = (satisfied as u64).min(runs - satisfied as u64);
                if super::super::binomial::at_most(least, runs, 0.5) < 0.025 {
                    wrong += *weight;
                    *weight = 0.0;
                }
            }
            open = next;
        }
        assert!(wrong > 0.15, "{wrong}");
        assert!(ever_misses(0.5, 400, 0.05) < 0.05);
    }

    #[test]
    fn intervals_end_where_the_capital_is_enough() {
        for (runs, satisfied) in [(1, 0), (1, 1), (10, 3), (1000, 999), (100_000, 50_000)] {
            let now = ProbabilitySequence::after(runs, satisfied);
            let interval = now.interval(0.05);
            let share = satisfied as f64 / runs as f64;
            assert!(
                interval.lower <= share && share <= interval.upper,
                "{interval:?}"
            );
            let half = (share - interval.lower).max(interval.upper - share);
            assert!(now.is_within(half + 1e-9, 0.05), "{interval:?}");
            assert!(!now.is_within(half - 1e-6, 0.05), "{interval:?}");
            for end in [interval.lower, interval.upper] {
                let won = now.won(now.mixture(), end);
                assert!(
                    [0.0, 1.0].contains(&end) || (won - 20_f64.ln()).abs() < 1e-6,
                    "{won}"
                );
            }
        }
    }
}
