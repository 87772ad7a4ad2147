//! Zones described by their fewest constraints.
//!
//! A closed matrix is redundant. The minimal constraints are those that cannot be left out; closing
//! them gives the matrix back. There are two kinds of redundancy, which must be removed in this
//! order:
//!
//! * clocks at a fixed distance from each other (a cycle of bounds that sums to `<= 0`) form
//!   classes. One cycle through the clocks of a class, in ascending order, describes the class. Its
//!   least clock represents it in all other constraints;
//! * between these representatives there is no such cycle. So all constraints that are the sum of
//!   two others can be left out at once, and the result does not depend on the order.
//!
//! `x >= 0` holds in every zone. Neither this nor what follows from it is a constraint, so the
//! universe has none.
//!
//! Source: K. G. Larsen, F. Larsson, P. Pettersson, W. Yi, "Efficient Verification of Real-Time
//! Systems: Compact Data Structure and State-Space Reduction", RTSS 1997, section 3.
//!
//! Cost: O(n^3).

use crate::cancellation;

use super::dbm::Constraint;
use super::rows::{relax_row, rows, with_row};
use super::{Bound, ClockSet, wide};

/// Calls `visit` with the minimal constraints of a zone that is not empty, row by row.
pub fn for_each_minimal(zone: &[Bound], dimension: usize, visit: impl FnMut(Constraint)) {
    with_row(dimension, |detours| {
        // Detours that are too long are none.
        wide::unnoticed(|| visit_minimal(zone, dimension, detours, visit));
    });
}

/// Does the work of [`for_each_minimal`]; `detours` has room for a row.
fn visit_minimal(
    zone: &[Bound],
    dimension: usize,
    detours: &mut [Bound],
    mut visit: impl FnMut(Constraint),
) {
    let representatives = representatives(zone, dimension);
    let has_ties = representatives.len() < dimension;
    if has_ties && wide::is_on() && !follow_from(zone, dimension, &representatives) {
        return visit_all(zone, dimension, visit);
    }
    for (left, row) in rows(zone, dimension).enumerate() {
        let is_representative = representatives.contains(left);
        let successor = if has_ties {
            cycle_successor(zone, dimension, left)
        } else {
            None
        };
        if is_representative {
            cancellation::work(dimension * dimension / 4);
            find_detours(zone, dimension, &representatives, left, detours);
        }
        for (right, (&bound, &detour)) in row.iter().zip(&*detours).enumerate() {
            // An infinite bound is never below its detour.
            let is_needed = is_representative
                && bound < detour
                && left != right
                && representatives.contains(right);
            if (is_needed || successor == Some(right))
                && (left != 0 || !is_implied_by_sign(zone, dimension, right))
            {
                visit(Constraint { left, right, bound });
            }
        }
    }
}

/// Whether the bounds of all clocks follow from those of the representatives. They do in a closed
/// matrix, but bounds beyond what can be held may be missing (see [`wide`]).
fn follow_from(zone: &[Bound], dimension: usize, representatives: &ClockSet) -> bool {
    let bound = |left: usize, right: usize| zone[left * dimension + right];
    let tied = |clock: usize| {
        let mut others = representatives.iter();
        let own = others.find(|&other| other == clock || are_tied(zone, dimension, other, clock));
        own.unwrap_or(clock)
    };
    (0..dimension).all(|clock| {
        let own = tied(clock);
        own == clock
            || (0..dimension).filter(|&other| other != clock).all(|other| {
                let beyond = bound(clock, own) + bound(own, other);
                let before = bound(other, own) + bound(own, clock);
                bound(clock, other) == beyond && bound(other, clock) == before
            })
    })
}

/// Calls `visit` with all constraints of a zone.
fn visit_all(zone: &[Bound], dimension: usize, mut visit: impl FnMut(Constraint)) {
    for (left, row) in rows(zone, dimension).enumerate() {
        for (right, &bound) in row.iter().enumerate() {
            let is_sign = left == 0 && bound == Bound::LE_ZERO;
            if left != right && bound.is_finite() && !is_sign {
                visit(Constraint { left, right, bound });
            }
        }
    }
}

/// Writes for every clock the least sum of two bounds from `left` to it through a third
/// representative.
fn find_detours(
    zone: &[Bound],
    dimension: usize,
    representatives: &ClockSet,
    left: usize,
    detours: &mut [Bound],
) {
    detours.fill(Bound::INFINITY);
    let row = &zone[left * dimension..(left + 1) * dimension];
    for via in representatives.iter().filter(|via| *via != left) {
        // The path to `via` itself would be no detour.
        let kept = detours[via];
        relax_row(
            detours,
            row[via],
            &zone[via * dimension..(via + 1) * dimension],
        );
        detours[via] = kept;
    }
}

/// Whether two different clocks have a fixed distance in the zone.
#[inline]
fn are_tied(zone: &[Bound], dimension: usize, left: usize, right: usize) -> bool {
    let (forth, back) = (
        zone[left * dimension + right],
        zone[right * dimension + left],
    );
    forth.is_finite() && !forth.is_strict() && back == Bound::le(-forth.value())
}

/// The least clock of each class of tied clocks.
fn representatives(zone: &[Bound], dimension: usize) -> ClockSet {
    let is_least =
        |clock: &usize| (0..*clock).all(|other| !are_tied(zone, dimension, other, *clock));
    (0..dimension).filter(is_least).collect()
}

/// The next clock in the cycle through the class of `clock`; none if the class has no other clock.
fn cycle_successor(zone: &[Bound], dimension: usize, clock: usize) -> Option<usize> {
    let is_tied = |other: &usize| are_tied(zone, dimension, *other, clock);
    (clock + 1..dimension)
        .find(is_tied)
        .or_else(|| (0..clock).find(is_tied))
}

/// Whether the lower bound of a clock follows from `x >= 0`, for itself or for a clock that is tied
/// to it.
///
/// The cycle of the clocks that are tied to the reference clock must stay whole, so they do not
/// count.
fn is_implied_by_sign(zone: &[Bound], dimension: usize, clock: usize) -> bool {
    let follows =
        |tied: usize| zone[tied] == Bound::LE_ZERO && zone[tied * dimension + clock] <= zone[clock];
    let is_free = !are_tied(zone, dimension, 0, clock);
    zone[clock] == Bound::LE_ZERO
        || is_free
            && (1..dimension).any(|tied| are_tied(zone, dimension, tied, clock) && follows(tied))
}
