//! Exact confidence intervals of a probability.
//!
//! Source: C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated
//! in the case of the binomial", Biometrika 26 (1934).

use statrs::function::beta::beta_reg;

/// An interval of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Its least number.
    pub lower: f64,
    /// Its greatest number.
    pub upper: f64,
}

/// So often an interval is halved: until doubles cannot be told apart.
const HALVINGS: usize = 60;

/// The probability of at least `least` successes in `runs` runs.
pub(super) fn at_least(least: u64, runs: u64, probability: f64) -> f64 {
    if least == 0 || probability >= 1.0 {
        return 1.0;
    }
    if probability <= 0.0 {
        return 0.0;
    }
    beta_reg(least as f64, (runs - least + 1) as f64, probability)
}

/// The probability of at most `most` successes in `runs` runs.
pub(super) fn at_most(most: u64, runs: u64, probability: f64) -> f64 {
    if most == runs || probability <= 0.0 {
        return 1.0;
    }
    if probability >= 1.0 {
        return 0.0;
    }
    beta_reg((runs - most) as f64, (most + 1) as f64, 1.0 - probability)
}

/// Where between two numbers `is_below` ends to hold.
pub(super) fn halved(mut low: f64, mut high: f64, is_below: &dyn Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if is_below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// The two-sided interval that misses the probability with a risk of at most `alpha`, whatever the
/// probability is, if the number of runs was fixed before.
pub fn clopper_pearson(successes: u64, runs: u64, alpha: f64) -> Interval {
    let estimate = successes as f64 / runs as f64;
    let lower = if successes == 0 {
        0.0
    } else {
        halved(0.0, estimate, &|p| {
            at_least(successes, runs, p) < alpha / 2.0
        })
    };
    let upper = if successes == runs {
        1.0
    } else {
        halved(estimate, 1.0, &|p| {
            at_most(successes, runs, p) > alpha / 2.0
        })
    };
    Interval { lower, upper }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "these are exact")]

    use super::clopper_pearson;

    #[test]
    fn intervals_are_those_of_published_answers() {
        let none = clopper_pearson(0, 72, 0.05);
        assert_eq!(none.lower, 0.0);
        assert!((none.upper - 0.049_944_1).abs() < 1e-7, "{none:?}");
        let rare = clopper_pearson(0, 36_887, 0.05);
        assert!((rare.upper - 9.999_99e-5).abs() < 1e-9, "{rare:?}");
        let all = clopper_pearson(29, 29, 0.05);
        assert_eq!(all.upper, 1.0);
        // The closed form of the case without failures.
        assert!((all.lower - 0.025_f64.powf(1.0 / 29.0)).abs() < 1e-12);
    }
}
