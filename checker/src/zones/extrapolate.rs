//! Abstractions that make the zone graph finite by forgetting what no guard can tell apart.
//!
//! For each clock let L be the greatest constant in comparisons from below (`x > c`, `x >= c`) in
//! its guards and invariants, U the greatest one in comparisons from above, and M the greater of
//! both. Each is minus infinity where there is none. Let a closed zone have the entries (i, j) and
//! the lower bounds `low(i)` (the negated entry (0, i)). An extrapolation replaces it by the
//! closure of the following matrix, whose other entries stay as they are:
//!
//! * `Extra_M`: infinite if `(i, j) > M(i)`; `< -M(j)` if `-(i, j) > M(j)`;
//! * `Extra_LU`: infinite if `(i, j) > L(i)`; `< -U(j)` if `-(i, j) > U(j)`;
//! * `Extra_M+`: infinite if `(i, j) > M(i)`, or `low(i) > M(i)`, or `low(j) > M(j)` and i is not
//!   0; `< -M(j)` in row 0 if `low(j) > M(j)`;
//! * `Extra_LU+`: infinite if `(i, j) > L(i)`, or `low(i) > L(i)`, or `low(j) > U(j)` and i is not
//!   0; `< -U(j)` in row 0 if `low(j) > U(j)`.
//!
//! Zones stay positive: row 0 never exceeds `<= 0`. The diagonal stays. All four are sound and
//! complete for reachability in automata that compare single clocks with constants; `Extra_M` is
//! the finest and `Extra_LU+` the coarsest. None is sound where guards compare two clocks;
//! [`split_by_differences`] is the variant for those.
//!
//! [`lu_plus`] is coarser still. For i other than 0, an entry (i, j) is infinite already if
//! `low(j) + (i, j) > L(i)`, that is, if clock i is above L where j is least. A clock j is above U
//! already if `low(j)` is the strict bound `> U(j)`. So it forgets all entries on which the
//! abstraction `aLU` does not depend (see [`super::simulation`]), and stays within `aLU`.
//!
//! Source: G. Behrmann, P. Bouyer, K. G. Larsen, R. Pelánek, "Lower and Upper Bounds in Zone Based
//! Abstractions of Timed Automata", TACAS 2004, definitions in section 4, closing after `Extra_LU+`
//! (LU-Canonize) in section 5.
//!
//! Where we differ: closing skips all rows in which nothing was forgotten. The new matrix lies
//! above the old one, which was closed, so an entry that was kept cannot become tighter. This holds
//! for all four.
//!
//! Cost: O(n^2) to forget, then n^2 / 4 vector steps for each row that lost something.

#![expect(
    clippy::inline_always,
    reason = "the dimension is a constant at some calls"
)]

use std::cmp::Ordering;

use super::dbm::{self, Constraint};
use super::federation::Federation;
use super::rows::{for_small_dimension, relax_row, rows_mut};
use super::{Bound, ClockSet};

/// The greatest constants that each clock is compared with, prepared for extrapolation.
#[derive(Debug, PartialEq, Eq)]
pub struct Ceilings {
    /// `<= L` of each clock: greater entries of its row are forgotten. It is below every bound if
    /// there is no L.
    rows: Box<[Bound]>,
    /// `< -U` of each clock: lesser entries of its column are forgotten. It is above every bound if
    /// there is no U.
    columns: Box<[Bound]>,
}

impl Clone for Ceilings {
    fn clone(&self) -> Ceilings {
        Ceilings {
            rows: self.rows.clone(),
            columns: self.columns.clone(),
        }
    }

    /// Allocates nothing if both have the same dimension: this runs for every zone.
    fn clone_from(&mut self, other: &Ceilings) {
        self.rows.clone_from(&other.rows);
        self.columns.clone_from(&other.columns);
    }
}

/// The constants that one clock is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Ceiling {
    clock: usize,
    row: Bound,
    column: Bound,
}

impl Ceilings {
    /// The ceilings of clocks that nothing is compared with.
    pub fn none(dimension: usize) -> Ceilings {
        let mut ceilings = Ceilings {
            rows: vec![Bound(i32::MIN); dimension].into(),
            columns: vec![Bound::INFINITY; dimension].into(),
        };
        ceilings.clear();
        ceilings
    }

    /// The ceilings of the clocks 0..n, given the greatest constants of comparisons from below and
    /// from above.
    ///
    /// `None` stands for a clock without such comparisons. The entries of the reference clock are
    /// ignored.
    pub fn lower_upper(lower: &[Option<i32>], upper: &[Option<i32>]) -> Ceilings {
        let mut ceilings = Ceilings::none(lower.len());
        for (clock, (lower, upper)) in lower.iter().zip(upper).enumerate().skip(1) {
            if let Some(constant) = *lower {
                ceilings.admit_lower(clock, constant);
            }
            if let Some(constant) = *upper {
                ceilings.admit_upper(clock, constant);
            }
        }
        ceilings
    }

    /// Forgets all comparisons.
    pub fn clear(&mut self) {
        self.rows.fill(Bound(i32::MIN));
        self.columns.fill(Bound::INFINITY);
        self.rows[0] = Bound::LE_ZERO;
        self.columns[0] = Bound::LT_ZERO;
    }

    /// Adds a comparison of the clock from below, `x > constant` or `x >= constant`.
    ///
    /// A negative constant changes nothing, since clocks are not negative. A constant above
    /// [`Bound::MAX_VALUE`] counts as that value.
    pub fn admit_lower(&mut self, clock: usize, constant: i32) {
        if constant >= 0 {
            let row = Bound::le(constant.min(Bound::MAX_VALUE));
            self.rows[clock] = self.rows[clock].max(row);
        }
    }

    /// Adds a comparison of the clock from above, `x < constant` or `x <= constant`, like
    /// [`Ceilings::admit_lower`].
    pub fn admit_upper(&mut self, clock: usize, constant: i32) {
        if constant >= 0 {
            let column = Bound::lt(-constant.min(Bound::MAX_VALUE));
            self.columns[clock] = self.columns[clock].min(column);
        }
    }

    /// Raises each ceiling to the greater of both: the result is sound wherever one of the two was.
    pub fn raise(&mut self, other: &Ceilings) {
        for (row, other) in self.rows.iter_mut().zip(&other.rows) {
            *row = (*row).max(*other);
        }
        for (column, other) in self.columns.iter_mut().zip(&other.columns) {
            *column = (*column).min(*other);
        }
    }

    /// Raises the ceilings of one clock, like [`Ceilings::raise`].
    #[inline]
    pub fn raise_one(&mut self, ceiling: &Ceiling) {
        let (row, column) = (
            &mut self.rows[ceiling.clock],
            &mut self.columns[ceiling.clock],
        );
        *row = (*row).max(ceiling.row);
        *column = (*column).min(ceiling.column);
    }

    /// The ceilings of the clocks that are compared with anything.
    pub fn each(&self) -> Vec<Ceiling> {
        let ceiling = |clock: usize| Ceiling {
            clock,
            row: self.rows[clock],
            column: self.columns[clock],
        };
        self.compared().iter().map(ceiling).collect()
    }

    /// The same with M, the greater of L and U, for both.
    #[must_use]
    pub fn to_maximal(&self) -> Ceilings {
        let mut maximal = self.clone();
        maximal.raise(&Ceilings {
            rows: self
                .columns
                .iter()
                .map(|column| {
                    if column.is_infinite() {
                        Bound(i32::MIN)
                    } else {
                        column.negated()
                    }
                })
                .collect(),
            columns: self
                .rows
                .iter()
                .map(|row| {
                    if row.0 == i32::MIN {
                        Bound::INFINITY
                    } else {
                        row.negated()
                    }
                })
                .collect(),
        });
        maximal
    }

    /// The clocks that are compared with anything; the others are not active.
    pub fn compared(&self) -> ClockSet {
        let is_compared =
            |clock: &usize| self.rows[*clock].0 != i32::MIN || self.columns[*clock].is_finite();
        (1..self.rows.len()).filter(is_compared).collect()
    }

    /// Whether the clock is certainly above L, given its entry in row 0.
    #[inline]
    fn is_above_lower(&self, clock: usize, entry: Bound) -> bool {
        entry < self.rows[clock].negated()
    }

    /// `<= L` of each clock; below every bound if there is no L.
    #[inline]
    pub fn limits(&self) -> &[Bound] {
        &self.rows
    }

    /// `< -U` of each clock; above every bound if there is no U.
    #[inline]
    pub(super) fn columns(&self) -> &[Bound] {
        &self.columns
    }
}

/// The least even bound on `y - x` with which y is above L where x is least, given `<= L(y)` and
/// the entry (0, x).
#[inline]
pub(super) fn forgotten_from(limit: Bound, lower: Bound) -> Bound {
    Bound((limit.0 + 2 + lower.0) & !1)
}

/// Extrapolates further than `Extra_LU+`, but stays within `aLU`. With the ceilings of
/// [`Ceilings::to_maximal`] it extrapolates further than `Extra_M+`.
///
/// After forgetting, a path from one clock to another can only visit two kinds of clocks. The first
/// kind is neither certainly above L (its row would be infinite) nor certainly above U (only the
/// reference clock would still bound it). The second is the reference clock. Row 0 is final after
/// forgetting: a path through a clock above U was not better before the bound of that clock became
/// weaker. So it is enough to add paths through the clocks of the first kind, and last those
/// through the reference clock.
pub fn lu_plus(zone: &mut [Bound], dimension: usize, ceilings: &Ceilings) {
    for_small_dimension!(dimension, forget_and_close(zone, ceilings));
}

#[inline(always)]
fn forget_and_close(zone: &mut [Bound], ceilings: &Ceilings, dimension: usize) {
    let (weakened, between) = forget_plus(zone, ceilings, dimension);
    close_again(zone, dimension, &weakened, &between);
}

/// Closes a matrix from which [`lu_plus`] has forgotten all that it can. The rows of `weakened`
/// lost a bound; the clocks of `between` are neither certainly above L nor certainly above U.
#[inline(always)]
pub(super) fn close_again(
    zone: &mut [Bound],
    dimension: usize,
    weakened: &ClockSet,
    between: &ClockSet,
) {
    if weakened.is_empty() {
        return;
    }
    for via in between {
        relax_rows(zone, dimension, weakened, via);
    }
    relax_rows(zone, dimension, weakened, 0);
}

/// Writes the matrix of `Extra_LU+`, not closed. Returns two sets: the clocks whose rows lost a
/// bound that closing may restore, and the clocks that are neither certainly above L nor certainly
/// above U.
#[inline(always)]
fn forget_plus(zone: &mut [Bound], ceilings: &Ceilings, dimension: usize) -> (ClockSet, ClockSet) {
    let (lower_bounds, rows) = zone.split_at_mut(dimension);
    let columns = &ceilings.columns[..dimension];
    let mut weakened = ClockSet::EMPTY;
    let mut between = ClockSet::EMPTY;
    for (clock, row) in (1..dimension).zip(rows_mut(rows, dimension)) {
        if ceilings.is_above_lower(clock, lower_bounds[clock]) {
            row.fill(Bound::INFINITY);
        } else {
            // The diagonal must not count as a lost bound.
            row[clock] = Bound::INFINITY;
            if forget_in_row(row, ceilings.rows[clock], lower_bounds, columns) {
                weakened.insert(clock);
            }
            if lower_bounds[clock] > columns[clock] {
                between.insert(clock);
            }
        }
        row[clock] = Bound::LE_ZERO;
    }
    for (lower, column) in lower_bounds.iter_mut().zip(columns).skip(1) {
        if *lower < *column {
            // Without U only `x >= 0` remains of a lower bound.
            *lower = (*column).min(Bound::LE_ZERO);
        }
    }
    (weakened, between)
}

/// Makes those entries of a row infinite that exceed `limit` or whose clock is certainly above its
/// U; returns whether an entry became weaker.
#[inline(always)]
fn forget_in_row(
    row: &mut [Bound],
    limit: Bound,
    lower_bounds: &[Bound],
    columns: &[Bound],
) -> bool {
    let mut changes = 0;
    for ((bound, lower), column) in row.iter_mut().zip(lower_bounds).zip(columns) {
        let is_above = -i32::from(*bound >= forgotten_from(limit, *lower));
        let is_cut = -i32::from(*lower <= *column);
        let is_forgotten = is_above | is_cut;
        let new = Bound(bound.0 & !is_forgotten | Bound::INFINITY.0 & is_forgotten);
        changes |= new.0 ^ bound.0;
        *bound = new;
    }
    changes != 0
}

/// Adds paths through `via` to the given rows.
#[inline(always)]
fn relax_rows(zone: &mut [Bound], dimension: usize, targets: &ClockSet, via: usize) {
    let (before, rest) = zone.split_at_mut(via * dimension);
    let (source, after) = rest.split_at_mut(dimension);
    for clock in targets {
        let row = match clock.cmp(&via) {
            Ordering::Less => &mut before[clock * dimension..][..dimension],
            Ordering::Equal => continue,
            Ordering::Greater => &mut after[(clock - via - 1) * dimension..][..dimension],
        };
        relax_row(row, row[via], source);
    }
}

/// Extrapolates by `Extra_LU`, or by `Extra_M` with the ceilings of [`Ceilings::to_maximal`].
pub fn lu(zone: &mut [Bound], dimension: usize, ceilings: &Ceilings) {
    let columns = &ceilings.columns[..dimension];
    let mut weakened = ClockSet::EMPTY;
    for (clock, row) in rows_mut(zone, dimension).enumerate() {
        let limit = ceilings.rows[clock];
        // Without U only `x >= 0` remains of a lower bound.
        let greatest = if clock == 0 {
            Bound::LE_ZERO
        } else {
            Bound::INFINITY
        };
        // The diagonal must not count as a lost bound.
        row[clock] = Bound::INFINITY;
        let mut is_weakened = false;
        for (bound, column) in row.iter_mut().zip(columns) {
            let new = match *bound {
                above if above > limit => Bound::INFINITY,
                below if below < *column => (*column).min(greatest),
                kept => kept,
            };
            is_weakened |= new > *bound;
            *bound = new;
        }
        row[clock] = Bound::LE_ZERO;
        if is_weakened {
            weakened.insert(clock);
        }
    }
    if !weakened.is_empty() {
        (0..dimension).for_each(|via| relax_rows(zone, dimension, &weakened, via));
    }
}

/// Cuts the zone along the given differences, extrapolates each part by `Extra_M` on its side of
/// every cut, and adds the parts to `target`.
///
/// This is for automata whose guards or invariants compare two clocks: `differences` are these
/// comparisons. Every part lies wholly inside or outside each of them and stays there, so the parts
/// can distinguish whatever the guards can.
///
/// Source: J. Bengtsson, W. Yi, "On Clock Difference Constraints and Termination in Reachability
/// Analysis of Timed Automata", ICFEM 2003, section 4. Cost: up to 2^m parts for m differences.
pub fn split_by_differences(
    zone: &[Bound],
    dimension: usize,
    ceilings: &Ceilings,
    differences: &[Constraint],
    target: &mut Federation,
) {
    let maximal = ceilings.to_maximal();
    let mut parts = vec![(zone.to_vec(), Vec::new())];
    for difference in differences {
        let sides = [*difference, difference.negated()];
        let cut = |(part, kept): &(Vec<Bound>, Vec<Constraint>)| {
            sides.map(|side| {
                let (mut part, mut kept) = (part.clone(), kept.clone());
                kept.push(side);
                let is_left = dbm::constrain_all(&mut part, dimension, &[side]);
                is_left.then_some((part, kept))
            })
        };
        parts = parts.iter().flat_map(cut).flatten().collect();
    }
    for (mut part, kept) in parts {
        lu(&mut part, dimension, &maximal);
        if dbm::constrain_all(&mut part, dimension, &kept) {
            target.add(&part);
        }
    }
}
