//! The instants just before and just after a set: what a delay of any small length enters, or has
//! left.
//!
//! `before(Z)` holds the valuations v with `v + d` in Z for all small enough delays d > 0;
//! `after(Z)` those with `v - d` in Z. Of finitely many zones each contains either all small enough
//! delays or none, so for a union both are the union of those of its zones. A zone is the
//! conjunction of the bounds of its closed matrix, and for each bound alone the answer is read off:
//! the differences of two clocks stay; just before `x < c` and `x <= c` it is `x < c`, just before
//! `x > c` and `x >= c` it is `x >= c`; just after, the other way round. A stopped clock is as the
//! reference clock: what runs is compared with it.
//!
//! Cost: one closing for each zone.

use crate::cancellation;

use super::federation::Federation;
use super::{Bound, ClockSet, dbm};

/// The valuations from which every small enough delay leads into the federation.
#[must_use]
pub fn before(federation: &Federation, stopped: &ClockSet) -> Federation {
    moved(federation, stopped, (&weak, &strict))
}

/// The valuations that every small enough delay has just led out of the federation, or on within
/// it.
#[must_use]
pub fn after(federation: &Federation, stopped: &ClockSet) -> Federation {
    moved(federation, stopped, (&strict, &weak))
}

fn weak(bound: Bound) -> Bound {
    if bound.is_finite() {
        Bound(bound.0 | 1)
    } else {
        bound
    }
}

fn strict(bound: Bound) -> Bound {
    if bound.is_finite() {
        Bound(bound.0 & !1)
    } else {
        bound
    }
}

/// The zones with other bounds from below and from above, each closed again.
fn moved(
    federation: &Federation,
    stopped: &ClockSet,
    (from_below, from_above): (&dyn Fn(Bound) -> Bound, &dyn Fn(Bound) -> Bound),
) -> Federation {
    let dimension = federation.dimension();
    let mut result = Federation::empty(dimension);
    let mut moved = Vec::new();
    for zone in federation.zones() {
        cancellation::work(dimension * dimension * dimension / 4);
        moved.clear();
        moved.extend_from_slice(zone);
        for running in (1..dimension).filter(|clock| !stopped.contains(*clock)) {
            for fixed in (0..dimension).filter(|&clock| clock == 0 || stopped.contains(clock)) {
                let (lower, upper) = (fixed * dimension + running, running * dimension + fixed);
                moved[lower] = from_below(moved[lower]);
                moved[upper] = from_above(moved[upper]);
            }
        }
        if dbm::close(&mut moved, dimension) {
            result.add(&moved);
        }
    }
    result
}
