//! Whether a probability is at least a threshold: Wald's sequential probability ratio test.
//!
//! Within the deltas of the threshold nothing is promised. Outside, the probability of a wrong
//! answer is alpha (for "below") or beta (for "at least") up to the overshoot, which Wald neglects.
//!
//! Source: A. Wald, "Sequential tests of statistical hypotheses", Annals of Mathematical Statistics
//! 16 (1945).

/// What a test says of a probability.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// It is at least the threshold.
    AtLeast,
    /// It is less.
    Below,
}

/// A test in the making.
#[derive(Clone, Debug)]
pub struct SequentialTest {
    /// What a run that is satisfied, and one that is not, adds to the logarithm of the ratio of the
    /// likelihoods of "below" and "at least".
    steps: (f64, f64),
    limits: (f64, f64),
    ratio: f64,
}

/// How near to 0 and 1 probabilities are taken.
const LEAST: f64 = 1e-12;

impl SequentialTest {
    /// A test at these risks, with an indifference region that begins the first of `deltas` below
    /// the threshold and ends the second above.
    pub fn new(threshold: f64, deltas: (f64, f64), alpha: f64, beta: f64) -> SequentialTest {
        let high = (threshold + deltas.1).clamp(LEAST, 1.0 - LEAST);
        let low = (threshold - deltas.0).clamp(LEAST, 1.0 - LEAST);
        SequentialTest::between(low, high, alpha, beta)
    }

    /// A test at these risks that promises nothing between two probabilities.
    pub(super) fn between(low: f64, high: f64, alpha: f64, beta: f64) -> SequentialTest {
        SequentialTest {
            steps: ((low / high).ln(), ((1.0 - low) / (1.0 - high)).ln()),
            limits: ((beta / (1.0 - alpha)).ln(), ((1.0 - beta) / alpha).ln()),
            ratio: 0.0,
        }
    }

    /// Adds a run; returns the decision if it is the last one.
    pub fn push(&mut self, satisfied: bool) -> Option<Decision> {
        self.ratio += if satisfied {
            self.steps.0
        } else {
            self.steps.1
        };
        if self.ratio <= self.limits.0 {
            Some(Decision::AtLeast)
        } else if self.ratio >= self.limits.1 {
            Some(Decision::Below)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Decision, SequentialTest};

    /// The probability that a test says this at a probability of `p`, by dynamic programming.
    fn says(decision: Decision, threshold: f64, p: f64) -> f64 {
        let mut open = vec![(
            1.0,
            SequentialTest::new(threshold, (0.05, 0.05), 0.05, 0.05),
        )];
        let mut said = 0.0;
        for _ in 0..3000 {
            let mut next: Vec<(f64, SequentialTest)> = Vec::new();
            for (weight, test) in open {
                for (satisfied, chance) in [(true, p), (false, 1.0 - p)] {
                    let mut test = test.clone();
                    match test.push(satisfied) {
                        Some(found) if found == decision => said += weight * chance,
                        Some(_) => {}
                        None => match next.last_mut() {
                            // Results in another order come to the same ratio.
                            Some(last) if (last.1.ratio - test.ratio).abs() < 1e-9 => {
                                last.0 += weight * chance;
                            }
                            _ => next.push((weight * chance, test)),
                        },
                    }
                }
            }
            next.retain(|one| one.0 > 1e-15);
            open = next;
        }
        said
    }

    #[test]
    fn errors_are_as_rare_as_promised() {
        for threshold in [0.2, 0.5, 0.9] {
            let wrong = says(Decision::Below, threshold, threshold + 0.05);
            assert!(wrong <= 0.05, "{threshold}: {wrong}");
            let wrong = says(Decision::AtLeast, threshold, threshold - 0.05);
            assert!(wrong <= 0.05, "{threshold}: {wrong}");
        }
    }
}
