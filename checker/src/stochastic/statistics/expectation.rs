//! Means of values that may be any number.
//!
//! The interval is Student's: it is right in the limit of many runs, and can be far too narrow for
//! few runs of values that are rarely great.
//!
//! Of values that cannot be negative, the logarithm of the mean may have the interval instead: with
//! the relative error r of the mean, it is the mean times exp(-r) and exp(r). In the limit that is
//! the same; for values with a long tail it misses less often.
//!
//! Source: B. P. Welford, "Note on a method for calculating corrected sums of squares and
//! products", Technometrics 4 (1962).

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::binomial::Interval;

/// A mean in the making.
#[derive(Clone, Debug, Default)]
pub struct Expectation {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Expectation {
    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    /// How many values there are.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; 0 without values.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The standard error of their mean; 0 for fewer than two values.
    pub fn error(&self) -> f64 {
        let freedom = self.count.saturating_sub(1).max(1) as f64;
        (self.squares / freedom / self.count.max(1) as f64).sqrt()
    }

    /// Student's interval of the logarithm of the mean of values that are not negative; `None` for
    /// fewer than two values, and if all are 0.
    pub fn student_of_logarithm(&self, alpha: f64) -> Option<Interval> {
        let interval = self.student(alpha)?;
        let relative = (interval.upper - self.mean) / self.mean;
        (self.mean > 0.0).then(|| Interval {
            lower: self.mean * (-relative).exp(),
            upper: self.mean * relative.exp(),
        })
    }

    /// Student's interval, at a risk of `alpha` in the limit; `None` for fewer than two values.
    pub fn student(&self, alpha: f64) -> Option<Interval> {
        if self.count < 2 {
            return None;
        }
        let freedom = (self.count - 1) as f64;
        let quantile = StudentsT::new(0.0, 1.0, freedom)
            .ok()?
            .inverse_cdf(1.0 - alpha / 2.0);
        let half = quantile * self.error();
        Some(Interval {
            lower: self.mean - half,
            upper: self.mean + half,
        })
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "these are exact")]

    use super::Expectation;

    #[test]
    fn the_interval_is_that_of_tables() {
        let mut mean = Expectation::default();
        for value in [1.0, 2.0, 3.0, 4.0, 5.0] {
            mean.push(value);
        }
        assert_eq!(mean.mean(), 3.0);
        // t(4; 0.975) = 2.776445, deviation sqrt(2.5), five values.
        let half = 2.776_445 * (2.5_f64 / 5.0).sqrt();
        let interval = mean.student(0.05).expect("there are two values");
        assert!((interval.upper - 3.0 - half).abs() < 1e-6, "{interval:?}");
        assert!((3.0 - interval.lower - half).abs() < 1e-6, "{interval:?}");
    }
}
