//! The mean of costs, and how sure it is.

/// The number, the sum and the sum of squares of costs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    pub(super) count: f64,
    pub(super) sum: f64,
    pub(super) squares: f64,
}

impl Sums {
    pub(super) fn add(&mut self, cost: f64) {
        self.count += 1.0;
        self.sum += cost;
        self.squares += cost * cost;
    }

    /// Those of the costs of both.
    pub(super) fn with(self, other: Sums) -> Sums {
        Sums {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            squares: self.squares + other.squares,
        }
    }

    /// Those of the costs, if each of them is so much greater.
    pub(super) fn raised(self, by: f64) -> Sums {
        Sums {
            sum: self.sum + self.count * by,
            squares: self.squares + by * (2.0 * self.sum + self.count * by),
            ..self
        }
    }

    /// Those of the costs that the others do not have.
    pub(super) fn without(self, other: Sums) -> Sums {
        Sums {
            count: self.count - other.count,
            sum: self.sum - other.sum,
            squares: self.squares - other.squares,
        }
    }

    pub(super) fn mean(self) -> f64 {
        self.sum / self.count
    }

    /// The sum of the squares of what the costs differ by from their mean.
    pub(super) fn deviation(self) -> f64 {
        (self.squares - self.sum * self.mean()).max(0.0)
    }
}
