//! The mean of values between two known bounds, by a band around their distribution.
//!
//! With a risk of alpha at most, the share of values below any number is nowhere farther from the
//! probability than sqrt(ln(2 / alpha) / 2n). The least mean of a distribution in this band moves
//! so much of the greatest values to the lower bound, the greatest mean moves the least values to
//! the upper one. The number of values is chosen before.
//!
//! Values are kept by cells of equal width, so memory does not grow with their number; where a
//! value lies in its cell counts for neither end, which makes the interval wider by the part
//! 1 / [`CELLS`] of the bounds at most.
//!
//! Sources: P. Massart, "The tight constant in the Dvoretzky-Kiefer-Wolfowitz inequality", Annals
//! of Probability 18 (1990), for both sides at once; T. W. Anderson (1969), for the mean, as told
//! by M. Phan, P. Thomas and E. Learned-Miller, "Towards practical mean bounds for small samples",
//! ICML 2021; C. E. Budde et al., "Sound statistical model checking for probabilities and expected
//! rewards", TACAS 2025, who recommend it.

use super::binomial::Interval;

/// The number of cells between the bounds.
const CELLS: usize = 1 << 14;

/// What values say of their distribution.
#[derive(Clone, Debug)]
pub struct Distribution {
    bounds: (f64, f64),
    cells: Vec<u64>,
    count: u64,
    sum: f64,
}

impl Distribution {
    /// One without values.
    pub fn new(bounds: (f64, f64)) -> Distribution {
        Distribution {
            bounds,
            cells: vec![0; CELLS],
            count: 0,
            sum: 0.0,
        }
    }

    /// Adds a value, which lies between the bounds.
    pub fn push(&mut self, value: f64) {
        let (low, high) = self.bounds;
        let part = if high > low {
            (value - low) / (high - low)
        } else {
            0.0
        };
        self.cells[((part * CELLS as f64) as usize).min(CELLS - 1)] += 1;
        self.count += 1;
        self.sum += value;
    }

    /// Their mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }

    /// The interval of the mean, at a risk of `alpha`.
    pub fn interval(&self, alpha: f64) -> Interval {
        let (low, high) = self.bounds;
        if self.count == 0 || high <= low {
            return Interval {
                lower: low,
                upper: high,
            };
        }
        let count = self.count as f64;
        let band = ((2.0 / alpha).ln() / (2.0 * count)).sqrt().min(1.0);
        let cell = |index: usize| low + (high - low) * index as f64 / CELLS as f64;
        // The share 1 - band of the values that stays, from the least and from the greatest on.
        let kept = |cells: &mut dyn Iterator<Item = (usize, u64)>, value: &dyn Fn(usize) -> f64| {
            let mut rest = 1.0 - band;
            let mut sum = 0.0;
            for (index, number) in cells {
                let share = (number as f64 / count).min(rest);
                sum += share * value(index);
                rest -= share;
            }
            sum
        };
        let indexed = || self.cells.iter().copied().enumerate();
        let mean = self.mean();
        let least = kept(&mut indexed(), &cell) + band * low;
        let greatest = kept(&mut indexed().rev(), &|index| cell(index + 1)) + band * high;
        Interval {
            lower: least.clamp(low, mean),
            upper: greatest.clamp(mean, high),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::draws::{Draws, KINDS};
    use super::{CELLS, Distribution};

    #[test]
    fn the_interval_misses_less_often_than_alpha() {
        const REPETITIONS: u64 = 2000;
        for (number, (mean, draw)) in KINDS.iter().enumerate() {
            let mut missed = 0;
            for repetition in 0..REPETITIONS {
                let mut draws = Draws::new(repetition + 1000 * number as u64);
                let mut found = Distribution::new((-1.0, 3.0));
                for _ in 0..50 {
                    found.push(4.0 * draw(&mut draws) - 1.0);
                }
                let interval = found.interval(0.1);
                let mean = 4.0 * mean - 1.0;
                missed += u64::from(!(interval.lower <= mean && mean <= interval.upper));
            }
            assert!(
                missed <= REPETITIONS / 10,
                "{number}: {missed} of {REPETITIONS}"
            );
        }
    }

    #[test]
    fn the_interval_is_that_of_the_extreme_distributions() {
        // 0 and 1 half each, of 8 values; a band of 1/4 moves a quarter to an end.
        let mut found = Distribution::new((0.0, 1.0));
        for value in [0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0] {
            found.push(value);
        }
        let alpha = 2.0 * (-2.0 * 8.0 / 16.0_f64).exp();
        let interval = found.interval(alpha);
        let cell = 1.0 / CELLS as f64;
        assert!((interval.lower - 0.25).abs() <= cell, "{interval:?}");
        assert!((interval.upper - 0.75).abs() <= cell, "{interval:?}");
    }
}
