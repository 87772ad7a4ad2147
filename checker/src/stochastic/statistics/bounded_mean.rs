//! The mean of values between two known bounds: empirical Bernstein intervals, which are narrow
//! where the values vary little.
//!
//! For values X in \[0, 1\], numbers w (the *weights*) in \[0, 1) that are chosen before each
//! value, and the mean m of the values before it (at first 1/2),
//!
//! ```text
//! sum(w X) / sum(w)  ±  (ln(2 / alpha) + sum(4 (X - m)² psi(w))) / sum(w)
//! psi(w) = (-ln(1 - w) - w) / 4
//! ```
//!
//! holds the mean after all numbers of values together, but for a risk of alpha. So each of these
//! intervals is right at any moment of stopping. The weights say where they are narrow: they are
//! chosen either for a number of runs that is planned, or for all numbers.
//!
//! Here an interval also holds the mean of the values, which may lie beside the weighted one; that
//! only makes it wider.
//!
//! Source: I. Waudby-Smith and A. Ramdas, "Estimating means of bounded random variables by
//! betting", JRSS B 86 (2024), section 3: theorem 2, with its weights for one number of values and
//! for all.

use super::binomial::Interval;

/// No weight is greater: where values have not varied yet, they may still do.
const MOST_WEIGHT: f64 = 0.5;

/// What values say of their mean.
#[derive(Clone, Debug)]
pub struct BoundedMean {
    bounds: (f64, f64),
    /// ln(2 / alpha)
    log_risk: f64,
    /// For how many values the weights are chosen; `None` for all numbers.
    planned: Option<u64>,
    count: u64,
    /// Of the scaled values.
    sum: f64,
    /// Of the squares of their distances to the mean until then.
    squares: f64,
    weights: f64,
    weighted: f64,
    deviation: f64,
}

impl BoundedMean {
    /// One without values, whose intervals miss with a risk of `alpha`.
    pub fn new(bounds: (f64, f64), alpha: f64, planned: Option<u64>) -> BoundedMean {
        BoundedMean {
            bounds,
            log_risk: (2.0 / alpha).ln(),
            planned,
            count: 0,
            sum: 0.0,
            squares: 0.0,
            weights: 0.0,
            weighted: 0.0,
            deviation: 0.0,
        }
    }

    /// Adds a value, which lies between the bounds.
    pub fn push(&mut self, value: f64) {
        let (low, high) = self.bounds;
        let value = if high > low {
            (value - low) / (high - low)
        } else {
            0.0
        };
        // Both as if there were one value more, in the middle, with a variance of 1/4.
        let known = self.count as f64 + 1.0;
        let variance = (0.25 + self.squares) / known;
        let before = value - (0.5 + self.sum) / known;
        let lasting = match self.planned {
            Some(planned) => planned as f64,
            None => known * known.ln_1p(),
        };
        let weight = (2.0 * self.log_risk / (variance * lasting))
            .sqrt()
            .min(MOST_WEIGHT);
        self.weights += weight;
        self.weighted += weight * value;
        self.deviation += before * before * (-(-weight).ln_1p() - weight);
        self.count += 1;
        self.sum += value;
        let after = value - (0.5 + self.sum) / (known + 1.0);
        self.squares += after * after;
    }

    /// Their mean; the lower bound without values.
    pub fn mean(&self) -> f64 {
        self.unscaled(self.sum / self.count.max(1) as f64)
    }

    /// The interval after these values.
    pub fn interval(&self) -> Interval {
        if self.count == 0 {
            let (lower, upper) = self.bounds;
            return Interval { lower, upper };
        }
        let mean = self.sum / self.count as f64;
        let center = self.weighted / self.weights;
        let half = (self.log_risk + self.deviation) / self.weights;
        Interval {
            lower: self.unscaled((center - half).clamp(0.0, mean)),
            upper: self.unscaled((center + half).clamp(mean, 1.0)),
        }
    }

    fn unscaled(&self, value: f64) -> f64 {
        let (low, high) = self.bounds;
        low + value * (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::super::draws::{Draws, KINDS};
    use super::super::expectation::Expectation;
    use super::BoundedMean;

    const REPETITIONS: u64 = 2000;

    /// How many repetitions of so many values have an interval that misses: at the end, and ever.
    fn misses(kind: usize, planned: Option<u64>, values: u64, alpha: f64) -> (u64, u64) {
        let (mean, draw) = KINDS[kind];
        let mut missed = (0, 0);
        for repetition in 0..REPETITIONS {
            let mut draws = Draws::new(repetition + 1000 * kind as u64);
            let mut found = BoundedMean::new((0.0, 10.0), alpha, planned);
            let (mut now, mut ever) = (false, false);
            for _ in 0..values {
                found.push(10.0 * draw(&mut draws));
                let interval = found.interval();
                now = !(interval.lower <= 10.0 * mean && 10.0 * mean <= interval.upper);
                ever |= now;
            }
            missed.0 += u64::from(now);
            missed.1 += u64::from(ever);
        }
        missed
    }

    #[test]
    fn intervals_miss_less_often_than_alpha() {
        for kind in 0..KINDS.len() {
            for planned in [None, Some(300)] {
                let (end, ever) = misses(kind, planned, 300, 0.1);
                assert!(end <= ever, "{kind}");
                assert!(ever <= REPETITIONS / 10, "{kind}: {ever} of {REPETITIONS}");
            }
        }
    }

    #[test]
    fn student_misses_more_often_than_it_says_where_values_are_rarely_great() {
        let (mean, draw) = KINDS[1];
        let mut missed = 0;
        for repetition in 0..REPETITIONS {
            let mut draws = Draws::new(repetition);
            let mut found = Expectation::default();
            for _ in 0..100 {
                found.push(draw(&mut draws));
            }
            let interval = found.student(0.05).expect("there are many values");
            missed += u64::from(!(interval.lower <= mean && mean <= interval.upper));
        }
        assert!(missed > REPETITIONS / 8, "{missed} of {REPETITIONS}");
    }

    #[test]
    fn values_that_vary_little_have_narrow_intervals() {
        let mut steady = BoundedMean::new((0.0, 1.0), 0.05, Some(1000));
        for i in 0..1000 {
            steady.push(if i % 2 == 0 { 0.49 } else { 0.51 });
        }
        let interval = steady.interval();
        // Hoeffding's half width would be sqrt(ln(40) / 2000), about 0.043.
        assert!(interval.upper - interval.lower < 0.03, "{interval:?}");
        assert!((steady.mean() - 0.5).abs() < 1e-9);
        let mut free = BoundedMean::new((0.0, 1.0), 0.05, Some(100_000));
        let mut draws = Draws::new(7);
        for _ in 0..100_000 {
            free.push(KINDS[2].1(&mut draws));
        }
        let interval = free.interval();
        let normal = 1.96 * (1.0 / 12.0 / 1e5_f64).sqrt();
        assert!(
            interval.upper - interval.lower < 2.0 * 1.5 * normal,
            "{interval:?}"
        );
    }
}
