//! Whether one probability is at least another: Wald's test of pairs.
//!
//! Runs for the two come in pairs. Only pairs whose runs differ count: given that they do, the
//! first run is the satisfied one with probability u / (1 + u), where u = p (1 - q) / (q (1 - p))
//! is the ratio of the odds. So a sequential test of this probability, between u0 and u1, tests
//! whether p is less than q or not. Between u0 and u1 nothing is promised.
//!
//! Source: A. Wald, "Sequential Analysis" (1947), chapter 6.

use super::sequential_test::{Decision, SequentialTest};

/// A test in the making.
#[derive(Clone, Debug)]
pub struct DoubleSampling {
    test: SequentialTest,
    differing: u64,
}

impl DoubleSampling {
    /// A test at these risks: that p is less than q is said wrongly at a ratio of the odds of `u1`
    /// or more with a risk of `alpha`, and the opposite at `u0` or less with a risk of `beta`.
    pub fn new(u0: f64, u1: f64, alpha: f64, beta: f64) -> DoubleSampling {
        let share = |odds: f64| odds / (1.0 + odds);
        DoubleSampling {
            test: SequentialTest::between(share(u0), share(u1), alpha, beta),
            differing: 0,
        }
    }

    /// Adds a pair; returns the decision on the first probability if it is the last pair.
    pub fn push(&mut self, first: bool, second: bool) -> Option<Decision> {
        if first == second {
            return None;
        }
        self.differing += 1;
        self.test.push(first)
    }

    /// How many pairs differ.
    pub fn differing(&self) -> u64 {
        self.differing
    }
}

#[cfg(test)]
mod tests {
    use super::{Decision, DoubleSampling};

    /// The risks that the test says "less" and "at least" for two probabilities.
    ///
    /// Only differing pairs count, so the test is a walk that steps up with probability
    /// u / (1 + u). Its risks come from the distribution after each step, until next to nothing is
    /// left undecided; steps in another order come to the same place.
    fn says(p: f64, q: f64, bounds: (f64, f64)) -> (f64, f64) {
        let odds = p * (1.0 - q) / (q * (1.0 - p));
        let up = odds / (1.0 + odds);
        let new = || DoubleSampling::new(bounds.0, bounds.1, 0.05, 0.05);
        // Of each number of steps up more than down, the probability and a test that is there.
        let mut open = vec![(0_i64, 1.0, new())];
        let (mut below, mut at_least) = (0.0, 0.0);
        for _ in 0..200_000 {
            let mut next: Vec<(i64, f64, DoubleSampling)> = Vec::with_capacity(open.len() + 2);
            for (place, weight, test) in open {
                for (step, first, chance) in [(-1, false, 1.0 - up), (1, true, up)] {
                    let mut test = test.clone();
                    match test.push(first, !first) {
                        Some(Decision::Below) => below += weight * chance,
                        Some(Decision::AtLeast) => at_least += weight * chance,
                        None => match next
                            .iter_mut()
                            .rev()
                            .take(2)
                            .find(|one| one.0 == place + step)
                        {
                            Some(same) => same.1 += weight * chance,
                            None => next.push((place + step, weight * chance, test)),
                        },
                    }
                }
            }
            open = next;
            if open.iter().map(|one| one.1).sum::<f64>() < 1e-9 {
                break;
            }
        }
        (below, at_least)
    }

    #[test]
    fn errors_are_as_rare_as_promised() {
        let bounds = (0.9, 1.1);
        // Ratios of the odds of u1 and u0 exactly, for likely and unlikely events.
        for q in [0.5_f64, 0.01] {
            let of_odds = |odds: f64| odds * q / (1.0 - q + odds * q);
            let (below, at_least) = says(of_odds(1.1), q, bounds);
            assert!(below <= 0.05 && at_least > 0.94, "{q}: {below}, {at_least}");
            let (below, at_least) = says(of_odds(0.9), q, bounds);
            assert!(at_least <= 0.05 && below > 0.94, "{q}: {below}, {at_least}");
        }
        let (below, at_least) = says(0.6, 0.5, bounds);
        assert!(below < 1e-4 && at_least > 0.999, "{below}, {at_least}");
    }

    #[test]
    fn pairs_that_agree_do_not_count() {
        let mut test = DoubleSampling::new(0.9, 1.1, 0.05, 0.05);
        for _ in 0..10_000 {
            assert_eq!(test.push(true, true), None);
            assert_eq!(test.push(false, false), None);
        }
        assert_eq!(test.differing(), 0);
    }
}
