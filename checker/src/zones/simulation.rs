//! Inclusion up to what comparisons can distinguish: the abstraction `aLU`.
//!
//! A valuation w *simulates* v if each clock has the same value in w, or is less but above L, or is
//! greater while v is above U. Then w satisfies every comparison that v satisfies. `aLU(Z)` is the
//! set of the valuations that some valuation of Z simulates. It is the coarsest abstraction that L
//! and U allow. It is not a zone, but the *demands* of Z determine it:
//!
//! The zone Z lies within `aLU(Z')` exactly if no entry of Z' is less than the demand of Z for the
//! same entry. The demand for entry (y, x) is the lesser of two bounds: the entry of Z itself, and
//! the least even bound that is at least `2 L(y) + (0, x)`, both encoded. There is no demand if y
//! has no L, or if x is certainly above U. This is the theorem of the source on inclusion, read for
//! all entries at once: an entry of Z' refutes the inclusion exactly if x may be at most U in Z,
//! the entry is less than that of Z, and its sum with `< -L(y)` is less than (0, x).
//!
//! It follows that:
//!
//! * Z lies within `aLU(Z')` exactly if no demand of Z exceeds that of Z'. Proof: if Z lies within
//!   it, the entries (0, x) of Z are at most those of Z' where x may be at most U, and so are the
//!   bounds that are made of them. Conversely, demands are at most entries. So zones have the same
//!   `aLU` exactly if they have the same demands.
//! * The *reduced* zone keeps the entries that are demands. All others are infinite, and there is
//!   no demand for (0, x) if x is certainly above U. The reduced zone has the demands of Z, and
//!   they determine it. Demands show L, the reduced zone does not, so reduced zones are equal more
//!   often.
//! * The result of [`super::extrapolate::lu_plus`] on Z has the demands of Z. It is the closure of
//!   the reduced zone, with `< -U(x)` for the entries (0, x) without a demand.
//!
//! Source: F. Herbreteau, B. Srivathsan, I. Walukiewicz, "Better abstractions for timed automata",
//! Information and Computation 251, 2016 (LICS 2012). The consequences are derived here.
//!
//! Cost: n^2 / 4 vector steps; restoring takes as many as [`super::extrapolate::lu_plus`].

#![expect(
    clippy::inline_always,
    reason = "the dimension is a constant at some calls"
)]

use super::extrapolate::{Ceilings, close_again, forgotten_from};
use super::rows::{for_small_dimension, rows, rows_mut};
use super::{Bound, ClockSet};

/// No demand: every bound meets it. Everything below counts as no demand too.
pub const NO_DEMAND: Bound = Bound(i32::MIN / 2);

/// Replaces a zone by its reduced form.
pub fn reduce(zone: &mut [Bound], dimension: usize, ceilings: &Ceilings) {
    for_small_dimension!(dimension, leave_demands(zone, ceilings));
}

#[inline(always)]
fn leave_demands(zone: &mut [Bound], ceilings: &Ceilings, dimension: usize) {
    let (lower_bounds, others) = zone.split_at_mut(dimension);
    for (lower, column) in lower_bounds.iter_mut().zip(ceilings.columns()) {
        let is_above = -i32::from(*lower <= *column);
        *lower = Bound(lower.0 & !is_above | NO_DEMAND.0 & is_above);
    }
    let limits = ceilings.limits()[1..].iter();
    for (clock, (row, limit)) in (1..dimension).zip(rows_mut(others, dimension).zip(limits)) {
        let limit = (*limit).max(NO_DEMAND);
        for (entry, lower) in row.iter_mut().zip(&*lower_bounds) {
            let is_forgotten = -i32::from(*entry >= forgotten_from(limit, *lower));
            *entry = Bound(entry.0 & !is_forgotten | Bound::INFINITY.0 & is_forgotten);
        }
        row[clock] = Bound::LE_ZERO;
    }
}

/// Writes the demands of a reduced zone; `limits` are those of its ceilings. A zone lies within
/// `aLU` of another exactly if [`super::dbm::is_subset`] holds for its demands and the other zone.
/// The other zone may be given as it is, reduced, or as its demands.
pub fn demands(reduced: &[Bound], dimension: usize, limits: &[Bound], target: &mut [Bound]) {
    for_small_dimension!(dimension, write_demands(reduced, limits, target));
}

#[inline(always)]
fn write_demands(reduced: &[Bound], limits: &[Bound], target: &mut [Bound], dimension: usize) {
    let lower_bounds = &reduced[..dimension];
    let sources = rows(reduced, dimension).zip(limits);
    for (target, (source, limit)) in rows_mut(target, dimension).zip(sources) {
        let limit = (*limit).max(NO_DEMAND);
        for ((demand, entry), lower) in target.iter_mut().zip(source).zip(lower_bounds) {
            *demand = (*entry).min(forgotten_from(limit, *lower));
        }
    }
}

/// Replaces a reduced zone by the result of [`super::extrapolate::lu_plus`] on the zone.
pub fn restore(reduced: &mut [Bound], dimension: usize, ceilings: &Ceilings) {
    for_small_dimension!(dimension, restore_and_close(reduced, ceilings));
}

#[inline(always)]
fn restore_and_close(reduced: &mut [Bound], ceilings: &Ceilings, dimension: usize) {
    let (lower_bounds, others) = reduced.split_at_mut(dimension);
    let mut weakened = ClockSet::EMPTY;
    let mut between = ClockSet::EMPTY;
    let bounds = lower_bounds.iter_mut().zip(ceilings.columns()).skip(1);
    let bounds = bounds.zip(rows(others, dimension));
    for (clock, ((lower, column), row)) in (1..dimension).zip(bounds) {
        let finite: usize = row.iter().map(|entry| usize::from(entry.is_finite())).sum();
        // The diagonal is always there.
        if finite > 1 {
            if finite < dimension {
                weakened.insert(clock);
            }
            if *lower != NO_DEMAND {
                between.insert(clock);
            }
        }
        if *lower == NO_DEMAND {
            *lower = (*column).min(Bound::LE_ZERO);
        }
    }
    close_again(reduced, dimension, &weakened, &between);
}
