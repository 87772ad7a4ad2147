//! Where a polynomial of degree 3 changes its sign between 0 and 1.

/// The coefficients by powers of the variable, the constant first.
pub(super) type Cubic = [f64; 4];

/// Places nearer to each other are the same.
pub(super) const LEAST_PART: f64 = 1e-9;

/// The value at a place.
pub(super) fn value_of(&[a, b, c, d]: &Cubic, part: f64) -> f64 {
    a + part * (b + part * (c + part * d))
}

/// The first place between two places in \[0, 1\] where a cubic changes its sign, if there is one.
pub(super) fn first_root(cubic: &Cubic, low: f64, high: f64) -> Option<f64> {
    let &[a, b, c, d] = cubic;
    // By the coefficients of Bernstein, between the least and the greatest of which a polynomial
    // lies.
    let corners = [a, a + b / 3.0, a + (2.0 * b + c) / 3.0, a + b + c + d];
    if corners.iter().all(|&one| one >= 0.0) || corners.iter().all(|&one| one <= 0.0) {
        return None;
    }
    // Between its extremes a cubic changes its sign once at most.
    let root = (c * c - 3.0 * b * d).max(0.0).sqrt();
    let sum = -(c + c.signum() * root);
    let mut turns = [sum / (3.0 * d), b / sum];
    if turns[1] < turns[0] {
        turns.swap(0, 1);
    }
    let mut left = low;
    for right in [turns[0], turns[1], high] {
        if right > left && right <= high {
            if let Some(found) = root_between(cubic, left, right) {
                return Some(found);
            }
            left = right;
        }
    }
    None
}

/// Where a cubic changes its sign, if it does so between two places where it is monotonic: by false
/// position, with halving where that does not get on.
fn root_between(cubic: &Cubic, mut low: f64, mut high: f64) -> Option<f64> {
    let (mut below, mut above) = (value_of(cubic, low), value_of(cubic, high));
    if above == 0.0 && below != 0.0 {
        return Some(high);
    }
    if below * above >= 0.0 {
        return None;
    }
    let enough = 1e-12 * below.abs().max(above.abs());
    let mut place = high;
    for halves in (0..60).map(|round| round % 2 == 1) {
        place = if halves {
            f64::midpoint(low, high)
        } else {
            low - below * (high - low) / (above - below)
        };
        let value = value_of(cubic, place);
        if value.abs() <= enough || high - low < LEAST_PART {
            break;
        }
        if value * below > 0.0 {
            (low, below) = (place, value);
        } else {
            (high, above) = (place, value);
        }
    }
    Some(place)
}

#[cfg(test)]
mod tests {
    use super::first_root;

    #[test]
    fn signs_change_where_the_roots_are() {
        // (x - 0.2) (x - 0.5) (x - 0.9)
        let cubic = [-0.09, 0.73, -1.6, 1.0];
        for (low, root) in [(0.0, 0.2), (0.3, 0.5), (0.6, 0.9)] {
            let found = first_root(&cubic, low, 1.0).expect("there is one");
            assert!((found - root).abs() < 1e-8, "{found} instead of {root}");
        }
        assert_eq!(first_root(&cubic, 0.95, 1.0), None);
        assert_eq!(first_root(&cubic, 0.3, 0.4), None);
        // x - 0.25, and x^2 - 0.25
        let found = first_root(&[-0.25, 1.0, 0.0, 0.0], 0.0, 1.0);
        assert_eq!(found, Some(0.25));
        let found = first_root(&[-0.25, 0.0, 1.0, 0.0], 0.0, 1.0).expect("there is one");
        assert!((found - 0.5).abs() < 1e-8, "{found}");
        assert_eq!(first_root(&[1.0, -0.5, 0.0, 0.0], 0.0, 1.0), None);
        // (x - 0.5)^3, whose extremes and root are one
        let found = first_root(&[-0.125, 0.75, -1.5, 1.0], 0.0, 1.0);
        assert_eq!(found, Some(0.5));
    }
}
