//! The instants just before and just after a set: what every short enough delay enters, or has just
//! left.
//!
//! `before(Z)` holds the valuations v with `v + d` in Z for all small enough delays d > 0;
//! `after(Z)` holds those with `v - d` in Z. Each zone contains either all small enough delays or
//! none. So for a union of finitely many zones both are the union over these zones. A zone is the
//! conjunction of the bounds of its closed matrix, so each bound is treated alone. The differences
//! of two clocks stay. Just before `x < c` and `x <= c` the bound is `x < c`; just before `x > c`
//! and `x >= c` it is `x >= c`. Just after, it is the other way round. A stopped clock counts as
//! the reference clock: running clocks are compared with it.
//!
//! Cost: one closing for each zone.

use crate::cancellation;

use super::federation::Federation;
use super::{Bound, ClockSet, dbm};

/// The valuations from which every small enough delay leads into the federation.
#[must_use]
pub fn before(federation: &Federation, stopped: &ClockSet) -> Federation {
    moved(federation, stopped, Bound::made_weak, Bound::made_strict)
}

/// The valuations that every small enough delay has just led out of the federation, or further
/// within it.
#[must_use]
pub fn after(federation: &Federation, stopped: &ClockSet) -> Federation {
    moved(federation, stopped, Bound::made_strict, Bound::made_weak)
}

/// Replaces the bounds from below and from above in each zone, and closes it again.
fn moved(
    federation: &Federation,
    stopped: &ClockSet,
    from_below: fn(Bound) -> Bound,
    from_above: fn(Bound) -> Bound,
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
