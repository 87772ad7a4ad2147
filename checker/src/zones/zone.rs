//! One zone that owns its matrix. It is a convenient form of [`super::dbm`] and [`super::clocks`]
//! for code outside the innermost loops.

use super::clocks::{self, Assignment};
use super::dbm::{self, Constraint};
use super::{Bound, ClockSet};

/// A zone with its own storage; may be empty.
///
/// Operations on an empty zone leave it empty. Two zones are equal if they are the same set.
#[derive(Clone, Debug)]
pub struct Zone {
    dimension: usize,
    bounds: Box<[Bound]>,
}

impl Zone {
    /// The zone that contains only the valuation in which every clock is 0.
    pub fn zero(dimension: usize) -> Zone {
        Zone {
            dimension,
            bounds: vec![Bound::LE_ZERO; dimension * dimension].into(),
        }
    }

    /// The zone of all valuations without negative clocks.
    pub fn universe(dimension: usize) -> Zone {
        let mut zone = Zone::zero(dimension);
        dbm::set_universe(&mut zone.bounds, dimension);
        zone
    }

    /// A zone from a closed, consistent and positive matrix, or an empty one.
    pub fn from_bounds(dimension: usize, bounds: &[Bound]) -> Zone {
        Zone {
            dimension,
            bounds: bounds.into(),
        }
    }

    /// The valuations without negative clocks that satisfy all constraints.
    pub fn of_constraints(dimension: usize, constraints: &[Constraint]) -> Zone {
        let mut zone = Zone::universe(dimension);
        zone.constrain_all(constraints);
        zone
    }

    /// The number of clocks, the reference clock included.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The matrix, row by row.
    pub fn bounds(&self) -> &[Bound] {
        &self.bounds
    }

    /// The matrix, for the functions on slices; they must leave it closed or empty.
    pub fn bounds_mut(&mut self) -> &mut [Bound] {
        &mut self.bounds
    }

    /// The bound on `x_left - x_right`.
    pub fn bound(&self, left: usize, right: usize) -> Bound {
        self.bounds[left * self.dimension + right]
    }

    /// The projection to all clocks but the last.
    #[must_use]
    pub fn without_last_clock(&self) -> Zone {
        let dimension = self.dimension - 1;
        let rows = self.bounds.chunks(self.dimension).take(dimension);
        Zone {
            dimension,
            bounds: rows.flat_map(|row| &row[..dimension]).copied().collect(),
        }
    }

    /// Whether the zone contains no valuation.
    pub fn is_empty(&self) -> bool {
        dbm::is_empty(&self.bounds)
    }

    /// Intersects with one constraint; returns whether something is left.
    pub fn constrain(&mut self, left: usize, right: usize, bound: Bound) -> bool {
        self.constrain_all(&[Constraint { left, right, bound }])
    }

    /// Intersects with all constraints; returns whether something is left.
    pub fn constrain_all(&mut self, constraints: &[Constraint]) -> bool {
        !self.is_empty() && dbm::constrain_all(&mut self.bounds, self.dimension, constraints)
    }

    /// Intersects with another zone; returns whether something is left.
    pub fn intersect(&mut self, other: &Zone) -> bool {
        if other.is_empty() {
            dbm::set_empty(&mut self.bounds);
        }
        !self.is_empty() && dbm::intersect(&mut self.bounds, &other.bounds, self.dimension)
    }

    /// Lets any time pass while the clocks of `stopped` keep their values; see
    /// [`clocks::up_stopped`].
    pub fn up(&mut self, stopped: &ClockSet) {
        if !self.is_empty() {
            clocks::up_stopped(&mut self.bounds, self.dimension, stopped);
        }
    }

    /// Lets time run backwards while the clocks of `stopped` keep their values; see
    /// [`clocks::down_stopped`].
    pub fn down(&mut self, stopped: &ClockSet) {
        if !self.is_empty() {
            clocks::down_stopped(&mut self.bounds, self.dimension, stopped);
        }
    }

    /// Carries out the assignments in order; returns whether something is left.
    pub fn assign(&mut self, assignments: &[Assignment]) -> bool {
        !self.is_empty() && clocks::assign(&mut self.bounds, self.dimension, assignments)
    }

    /// Replaces the zone by its preimage under a guard and assignments; returns whether something
    /// is left.
    pub fn preimage(&mut self, guard: &[Constraint], assignments: &[Assignment]) -> bool {
        !self.is_empty() && clocks::preimage(&mut self.bounds, self.dimension, guard, assignments)
    }

    /// Whether every valuation of this zone is in the other.
    pub fn is_subset(&self, other: &Zone) -> bool {
        self.is_empty() || !other.is_empty() && dbm::is_subset(&self.bounds, &other.bounds)
    }

    /// Whether the zone contains the valuation of the clocks; see [`dbm::contains`].
    pub fn contains(&self, numerators: &[i64], denominator: i64) -> bool {
        !self.is_empty() && dbm::contains(&self.bounds, numerators, denominator)
    }
}

impl PartialEq for Zone {
    fn eq(&self, other: &Zone) -> bool {
        self.is_subset(other) && other.is_subset(self)
    }
}

impl Eq for Zone {}
