//! Zones as difference bound matrices on slices.
//!
//! A zone of dimension n is a slice of n * n bounds, row by row. Entry (i, j) at `i * n + j` bounds
//! `x_i - x_j`, so row 0 holds the negated lower bounds and column 0 holds the upper bounds. All
//! contracts use these terms:
//!
//! * *consistent*: no cycle of bounds sums to less than `<= 0`, so the zone contains a valuation;
//! * *closed*: no entry is greater than the sum along a path, so every entry is the least upper
//!   bound of its difference; the diagonal is `<= 0`. A closed matrix is unique for its set;
//! * *positive*: row 0 is at most `<= 0`, so no clock is negative;
//! * *empty*: entry (0, 0) is below `<= 0`, and no other entry means anything.
//!
//! Every public function takes zones that are closed, consistent and positive, and leaves them so,
//! unless it says otherwise. A function that may empty a zone returns whether the zone still
//! contains a valuation. Nothing but [`is_empty`] may use an empty zone. Indices must be below the
//! dimension, and slices must have the right length: only the bounds checks of the slices test
//! these two contracts.
//!
//! Source: J. Bengtsson, W. Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, section 4.
//!
//! Cost: closing takes n^3 / 4 vector steps, one constraint n^2 / 4, and every other operation at
//! most that.

#![expect(
    clippy::inline_always,
    reason = "the dimension is a constant at some calls"
)]

use std::cmp::Ordering;

use crate::cancellation;

use super::rows::{for_small_dimension, relax_row, rows_mut, with_row};
use super::{Bound, ClockSet, wide};

/// One bound on one difference: `x_left - x_right` is bounded by `bound`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Constraint {
    /// The clock with the positive sign.
    pub left: usize,
    /// The clock with the negative sign.
    pub right: usize,
    /// The bound on the difference.
    pub bound: Bound,
}

impl Constraint {
    /// The constraint that holds exactly where this one fails; the bound must be finite.
    #[must_use]
    pub fn negated(self) -> Constraint {
        Constraint {
            left: self.right,
            right: self.left,
            bound: self.bound.negated(),
        }
    }
}

/// Makes the zone of all valuations without negative clocks.
pub fn set_universe(zone: &mut [Bound], dimension: usize) {
    zone.fill(Bound::INFINITY);
    zone[..dimension].fill(Bound::LE_ZERO);
    set_diagonal(zone, dimension);
}

/// Marks the zone as empty.
pub fn set_empty(zone: &mut [Bound]) {
    zone[0] = Bound::LT_ZERO;
}

/// Whether the zone is marked as empty; the only function that takes empty zones.
#[inline]
pub fn is_empty(zone: &[Bound]) -> bool {
    zone[0] < Bound::LE_ZERO
}

/// Whether sums can be formed: either they have 64 bits, or the constants of all bounds have an
/// absolute value of at most `most`, see [`Bound::most_in_zone`].
///
/// Bounds exceed the constants of a model only if they grow over many steps without extrapolation.
pub fn is_in_range(zone: &[Bound], most: i32) -> bool {
    let range = Bound::lt(-most)..=Bound::le(most);
    let mut bounds = zone.iter();
    bounds.all(|bound| bound.is_infinite() || range.contains(bound)) || wide::is_on()
}

/// Closes any matrix with a diagonal of `<= 0` (Floyd–Warshall); returns whether it is consistent,
/// and marks it as empty otherwise.
///
/// The matrix need not be closed or consistent before. The result is positive if row 0 was at most
/// `<= 0`.
pub fn close(zone: &mut [Bound], dimension: usize) -> bool {
    for_small_dimension!(dimension, close_all(zone))
}

#[inline(always)]
fn close_all(zone: &mut [Bound], dimension: usize) -> bool {
    (0..dimension).all(|via| close_through(zone, dimension, via))
}

/// Closes a matrix that was closed until bounds between the clocks of `touched` were tightened.
///
/// Both clocks of every tightened entry must be in the set. Returns whether the zone is consistent.
///
/// This is sound: in a closed matrix two successive old entries are never better than one, so a
/// path needs to visit only the ends of new entries.
pub fn close_touched(zone: &mut [Bound], dimension: usize, touched: &ClockSet) -> bool {
    touched
        .iter()
        .all(|via| close_through(zone, dimension, via))
}

/// From this dimension on, one pass over a matrix counts as work: it takes long enough.
const LONG_PASS: usize = 64;

/// Counts the work of one pass over a matrix, a vector of bounds at a time.
#[inline(always)]
fn count_if_long(dimension: usize) {
    if dimension >= LONG_PASS {
        cancellation::work(dimension * dimension / 4);
    }
}

/// One step of Floyd–Warshall: adds paths through the clock `via`.
#[inline(always)]
fn close_through(zone: &mut [Bound], dimension: usize, via: usize) -> bool {
    count_if_long(dimension);
    let (before, rest) = zone.split_at_mut(via * dimension);
    let (source, after) = rest.split_at_mut(dimension);
    let mut is_consistent = true;
    // The diagonal shows whether a negative cycle exists now; the row of `via` itself has not
    // changed.
    for (clock, target) in rows_mut(before, dimension).enumerate() {
        relax_row(target, target[via], source);
        is_consistent &= target[clock] >= Bound::LE_ZERO;
    }
    for (clock, target) in (via + 1..).zip(rows_mut(after, dimension)) {
        relax_row(target, target[via], source);
        is_consistent &= target[clock] >= Bound::LE_ZERO;
    }
    if !is_consistent {
        set_empty(zone);
    }
    is_consistent
}

/// Intersects the zone with `x_left - x_right` bounded by `bound`; returns whether something is
/// left.
///
/// Every tightened path uses the new bound once, so one pass over the rows closes the zone again.
/// The pass skips a row whose bound against `x_right` does not improve.
pub fn constrain(
    zone: &mut [Bound],
    dimension: usize,
    left: usize,
    right: usize,
    bound: Bound,
) -> bool {
    if bound >= zone[left * dimension + right] {
        return true;
    }
    if zone[right * dimension + left] + bound < Bound::LE_ZERO {
        set_empty(zone);
        return false;
    }
    count_if_long(dimension);
    for_small_dimension!(dimension, tighten(zone, left, right, bound));
    true
}

#[inline(always)]
fn tighten(zone: &mut [Bound], left: usize, right: usize, bound: Bound, dimension: usize) {
    let (before, rest) = zone.split_at_mut(right * dimension);
    let (source, after) = rest.split_at_mut(dimension);
    let relax = |target: &mut [Bound]| {
        let via = target[left] + bound;
        let is_lost = via.is_infinite() && target[left].is_finite() && target[right].is_infinite();
        if is_lost || via == Bound::TIGHTEST {
            wide::note();
        }
        if via < target[right] {
            relax_row(target, via, source);
        }
    };
    rows_mut(before, dimension).for_each(relax);
    rows_mut(after, dimension).for_each(relax);
}

/// Intersects the zone with all constraints; returns whether something is left.
pub fn constrain_all(zone: &mut [Bound], dimension: usize, constraints: &[Constraint]) -> bool {
    let tightens =
        |zone: &[Bound], one: &Constraint| one.bound < zone[one.left * dimension + one.right];
    let mut upper_bounds = 0;
    for constraint in constraints {
        if constraint.right == 0 && constraint.left != 0 {
            upper_bounds += usize::from(tightens(zone, constraint));
        } else if !constrain_by(zone, dimension, constraint) {
            return false;
        }
    }
    let mut upper = constraints
        .iter()
        .filter(|constraint| constraint.right == 0 && constraint.left != 0);
    match upper_bounds {
        0 => true,
        1 => upper.all(|constraint| constrain_by(zone, dimension, constraint)),
        _ => constrain_above(zone, dimension, constraints),
    }
}

/// The same for one constraint.
pub(super) fn constrain_by(zone: &mut [Bound], dimension: usize, constraint: &Constraint) -> bool {
    let Constraint { left, right, bound } = *constraint;
    constrain(zone, dimension, left, right, bound)
}

/// Intersects the zone with all upper bounds among the constraints at once; returns whether
/// something is left.
///
/// All the new bounds lead to the reference clock. A path that uses two of them visits this clock
/// twice, so it is no shorter than the path without the part between. The new upper bound of each
/// row and the lower bounds therefore close that row again.
fn constrain_above(zone: &mut [Bound], dimension: usize, constraints: &[Constraint]) -> bool {
    with_row(dimension, |row| {
        let upper_bounds = upper_bounds(constraints, row);
        for_small_dimension!(dimension, tighten_above(zone, upper_bounds))
    })
}

#[inline(always)]
fn tighten_above(zone: &mut [Bound], upper_bounds: &[Bound], dimension: usize) -> bool {
    let upper_bounds = &upper_bounds[..dimension];
    let (lower_bounds, others) = zone.split_at_mut(dimension);
    if least_sum(lower_bounds, upper_bounds) < Bound::LE_ZERO {
        set_empty(zone);
        return false;
    }
    for row in rows_mut(others, dimension) {
        let bound = least_sum(row, upper_bounds);
        if bound < row[0] {
            relax_row(row, bound, lower_bounds);
        }
    }
    true
}

/// Lowers the entries of `bounds`, by clock, to the upper bounds among the constraints. The entry
/// of the reference clock stays.
pub(super) fn upper_bounds<'b>(constraints: &[Constraint], bounds: &'b mut [Bound]) -> &'b [Bound] {
    for constraint in constraints {
        if constraint.right == 0 && constraint.left != 0 {
            let bound = &mut bounds[constraint.left];
            *bound = (*bound).min(constraint.bound);
        }
    }
    bounds
}

/// The least upper bound on the clock of this row: the least sum of a difference in the row and the
/// upper bound of the other clock. Its own upper bound is among them, since its bound against
/// itself is `<= 0`.
#[inline(always)]
pub(super) fn least_sum(row: &[Bound], upper_bounds: &[Bound]) -> Bound {
    if wide::is_on() {
        return least_sum_in_64_bits(row, upper_bounds);
    }
    let length = row.len().min(upper_bounds.len());
    let (row, upper_bounds) = (&row[..length], &upper_bounds[..length]);
    let (Some(last), Some(last_bounds)) = (row.last_chunk::<4>(), upper_bounds.last_chunk::<4>())
    else {
        let sums = row.iter().zip(upper_bounds);
        let sums = sums.map(|(difference, bound)| difference.plus(*bound));
        return sums.fold(Bound::INFINITY, Bound::lesser);
    };
    // Some of the last four may count twice.
    let mut least = four_sums(last, last_bounds);
    let (rows, _) = row.as_chunks::<4>();
    let (bounds, _) = upper_bounds.as_chunks::<4>();
    for (differences, bounds) in rows.iter().zip(bounds) {
        let sums = four_sums(differences, bounds);
        least = std::array::from_fn(|lane| least[lane].lesser(sums[lane]));
    }
    least.into_iter().fold(Bound::INFINITY, Bound::lesser)
}

#[cold]
#[inline(never)]
fn least_sum_in_64_bits(row: &[Bound], upper_bounds: &[Bound]) -> Bound {
    let pairs = row.iter().zip(upper_bounds);
    let finite = pairs.filter(|(difference, bound)| difference.is_finite() && bound.is_finite());
    let least = finite
        .map(|(difference, bound)| difference.wide_sum(*bound))
        .min();
    least.map_or(Bound::INFINITY, Bound::fitted)
}

#[inline(always)]
fn four_sums(differences: &[Bound; 4], bounds: &[Bound; 4]) -> [Bound; 4] {
    std::array::from_fn(|lane| differences[lane].plus(bounds[lane]))
}

/// Whether some valuation of the zone satisfies the constraint.
#[inline]
pub fn satisfies(zone: &[Bound], dimension: usize, constraint: &Constraint) -> bool {
    zone[constraint.right * dimension + constraint.left] + constraint.bound >= Bound::LE_ZERO
}

/// Intersects the zone with another; returns whether something is left.
pub fn intersect(zone: &mut [Bound], other: &[Bound], dimension: usize) -> bool {
    if are_apart(zone, other, dimension) {
        set_empty(zone);
        return false;
    }
    let mut touched = ClockSet::EMPTY;
    let rows = rows_mut(zone, dimension).zip(other.chunks_exact(dimension));
    for (left, (row, other_row)) in rows.enumerate() {
        for (right, (bound, other_bound)) in row.iter_mut().zip(other_row).enumerate() {
            if other_bound < bound {
                *bound = *other_bound;
                touched.insert(left);
                touched.insert(right);
            }
        }
    }
    close_touched(zone, dimension, &touched)
}

/// Whether two zones certainly have no valuation in common, because their bounds on some difference
/// exclude each other.
///
/// This test is cheap and one-sided: it may return false for disjoint zones.
#[inline]
pub fn are_apart(zone: &[Bound], other: &[Bound], dimension: usize) -> bool {
    (0..dimension).any(|left| {
        let row = &zone[left * dimension..(left + 1) * dimension];
        row.iter()
            .enumerate()
            .any(|(right, bound)| *bound + other[right * dimension + left] < Bound::LE_ZERO)
    })
}

/// Replaces the zone by the least zone that contains both.
pub fn hull(zone: &mut [Bound], other: &[Bound]) {
    for (bound, other) in zone.iter_mut().zip(other) {
        *bound = (*bound).max(*other);
    }
}

/// Whether every valuation of `zone` is in `other`.
#[inline]
pub fn is_subset(zone: &[Bound], other: &[Bound]) -> bool {
    // Blocks of sixteen are compared without a branch; most comparisons end in the first one.
    let (blocks, rest) = zone.as_chunks::<16>();
    let (other_blocks, other_rest) = other.as_chunks::<16>();
    blocks
        .iter()
        .zip(other_blocks)
        .all(|(block, other)| !exceeds(block, other))
        && !exceeds(rest, other_rest)
}

/// Whether an entry of `zone` is greater than its counterpart.
#[inline]
#[expect(
    clippy::needless_bitwise_bool,
    reason = "a branch would keep the loop from becoming vectors"
)]
fn exceeds(zone: &[Bound], other: &[Bound]) -> bool {
    zone.iter()
        .zip(other)
        .fold(false, |found, (bound, other)| found | (bound > other))
}

/// Whether two zones are the same set.
#[inline]
pub fn is_equal(zone: &[Bound], other: &[Bound]) -> bool {
    // Blocks of sixteen are compared without a branch, as vectors.
    let differ = |zone: &[Bound], other: &[Bound]| {
        let pairs = zone.iter().zip(other);
        pairs.fold(0, |found, (bound, other)| found | (bound.0 ^ other.0)) != 0
    };
    let (blocks, rest) = zone.as_chunks::<16>();
    let (other_blocks, other_rest) = other.as_chunks::<16>();
    blocks
        .iter()
        .zip(other_blocks)
        .all(|(block, other)| !differ(block, other))
        && !differ(rest, other_rest)
}

/// Whether the zone contains the valuation in which clock i has the value `numerators[i] /
/// denominator`.
///
/// `numerators[0]` must be 0 and the denominator positive.
pub fn contains(zone: &[Bound], numerators: &[i64], denominator: i64) -> bool {
    zone.chunks_exact(numerators.len())
        .zip(numerators)
        .all(|(row, left)| {
            row.iter().zip(numerators).all(|(bound, right)| {
                let limit = i64::from(bound.value()) * denominator;
                bound.is_infinite()
                    || match (left - right).cmp(&limit) {
                        Ordering::Less => true,
                        Ordering::Equal => !bound.is_strict(),
                        Ordering::Greater => false,
                    }
            })
        })
}

/// The bounds of a clock in the zone: its negated lower bound (on `0 - x`) and its upper bound (on
/// `x - 0`).
pub fn clock_bounds(zone: &[Bound], dimension: usize, clock: usize) -> (Bound, Bound) {
    (zone[clock], zone[clock * dimension])
}

/// Whether the delay from each valuation of the zone is limited: some running clock has an upper
/// bound.
pub fn is_delay_bounded(zone: &[Bound], dimension: usize, stopped: &ClockSet) -> bool {
    let upper_bounds = zone
        .chunks_exact(dimension)
        .map(|row| row[0])
        .enumerate()
        .skip(1);
    upper_bounds
        .into_iter()
        .any(|(clock, bound)| bound.is_finite() && !stopped.contains(clock))
}

/// A hash that depends only on the bounds of the zone, so it is the same in every run.
///
/// Each of two lanes multiplies two bounds with two others, and folds both halves of the product
/// into one word.
pub fn hash(zone: &[Bound]) -> u64 {
    const MULTIPLIERS: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0xd1b5_4a32_d192_ed03]; // Odd, bits evenly mixed.
    let word = |low: Bound, high: Bound| {
        u64::from(low.0.cast_unsigned()) | u64::from(high.0.cast_unsigned()) << 32
    };
    let mut lanes = [zone.len() as u64, 1];
    let mut absorb = |block: &[Bound; 8]| {
        for (lane, ([a, b, c, d], multiplier)) in lanes
            .iter_mut()
            .zip(block.as_chunks::<4>().0.iter().zip(MULTIPLIERS))
        {
            *lane = folded_product(*lane ^ word(*a, *b), multiplier ^ word(*c, *d));
        }
    };
    let (blocks, rest) = zone.as_chunks::<8>();
    blocks.iter().for_each(&mut absorb);
    let mut last = [Bound::LE_ZERO; 8];
    last[..rest.len()].copy_from_slice(rest);
    absorb(&last);
    folded_product(lanes[0] ^ MULTIPLIERS[1], lanes[1] ^ MULTIPLIERS[0])
}

/// The exclusive or of the two halves of a product.
fn folded_product(left: u64, right: u64) -> u64 {
    let (low, high) = left.carrying_mul(right, 0);
    low ^ high
}

/// Sets the diagonal to `<= 0`.
pub(super) fn set_diagonal(zone: &mut [Bound], dimension: usize) {
    zone.iter_mut()
        .step_by(dimension + 1)
        .for_each(|bound| *bound = Bound::LE_ZERO);
}
