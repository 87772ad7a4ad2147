//! Where time can lead from a set without meeting a bad one, and without passing through one that stops it.
//!
//! A *barrier* is a set in which time cannot pass: it can be entered by waiting, and not be left by it. For zones G (from
//! where), B (bad, both ends of a delay included) and U (a barrier), with `Z↑` for the future of Z and `Z⇑` for the
//! valuations that lie a positive delay after one of Z, the valuations that G reaches are
//!
//! * without meeting B: `(G↑ \ B↑) ∪ ((G ∩ B↑) \ B)↑`: either B was never, or it was before G;
//! * without passing U: `G ∪ (G↑ \ U⇑) ∪ ((G ∩ U↑) \ U)↑`.
//!
//! Read backwards in time, each set cuts off a final part of the interval of delays that lead back to G, and of finitely many
//! initial parts the shortest is contained in all. So for unions the result is the union over the zones of G of the
//! intersection over all B and U, as for the safe predecessors in [`super::past`], whose mirror image this is.
//!
//! Invariant: no clock is stopped. Cost: as [`super::past`].

use super::federation::Federation;
use super::{Bound, ClockSet, clocks, dbm};

/// The valuations that `from` reaches by some delay, where no valuation on the way, both ends included, is in `bad`, and none
/// but the last is in a barrier.
#[must_use]
pub fn successors(from: &Federation, bad: &Federation, barriers: &Federation) -> Federation {
    let dimension = from.dimension();
    let mut result = Federation::empty(dimension);
    for zone in from.zones() {
        let future = future_of(zone, dimension);
        let mut lost = Federation::empty(dimension);
        for bad in bad.zones() {
            lost.unite(&lost_to_bad(zone, &future, bad, dimension));
        }
        for barrier in barriers.zones() {
            lost.unite(&lost_to_barrier(zone, &future, barrier, dimension));
        }
        let mut reached = Federation::of_zone(dimension, &future);
        reached.subtract(&lost);
        result.unite(&reached);
    }
    result
}

/// The valuations that reach `to` by some delay, where none on the way but the last is in a barrier.
#[must_use]
pub fn predecessors_within(to: &Federation, barriers: &Federation) -> Federation {
    let dimension = to.dimension();
    let mut result = Federation::empty(dimension);
    for zone in to.zones() {
        let mut past: Box<[Bound]> = zone.into();
        clocks::down(&mut past, dimension);
        let mut lost = Federation::empty(dimension);
        for barrier in barriers.zones() {
            lost.unite(&stopped_before(zone, &past, barrier, dimension));
        }
        let mut reaching = Federation::of_zone(dimension, &past);
        reaching.subtract(&lost);
        result.unite(&reaching);
    }
    result
}

/// `(G↑ ∩ B↑) \ ((G ∩ B↑) \ B)↑`
fn lost_to_bad(from: &[Bound], future: &[Bound], bad: &[Bound], dimension: usize) -> Federation {
    let after_bad = future_of(bad, dimension);
    let mut lost = Federation::of_zone(dimension, future);
    lost.intersect_zone(&after_bad);
    lost.subtract(&beyond(from, &after_bad, bad, dimension));
    lost
}

/// `(G↑ ∩ U⇑) \ (G ∪ ((G ∩ U↑) \ U)↑)`
fn lost_to_barrier(
    from: &[Bound],
    future: &[Bound],
    barrier: &[Bound],
    dimension: usize,
) -> Federation {
    let mut lost = Federation::of_zone(dimension, future);
    lost.intersect_zone(&strictly_after(barrier, dimension));
    lost.subtract_zone(from);
    let after_barrier = future_of(barrier, dimension);
    lost.subtract(&beyond(from, &after_barrier, barrier, dimension));
    lost
}

/// `((G ∩ Z↑) \ Z)↑`: the future of the part of G that lies after Z.
fn beyond(from: &[Bound], after: &[Bound], zone: &[Bound], dimension: usize) -> Federation {
    let mut part = Federation::of_zone(dimension, from);
    part.intersect_zone(after);
    part.subtract_zone(zone);
    part.up(&ClockSet::EMPTY);
    part
}

/// `(G↓ ∩ U↓) \ (G ∪ ((G ∩ U↓) \ U⇑)↓)`
fn stopped_before(to: &[Bound], past: &[Bound], barrier: &[Bound], dimension: usize) -> Federation {
    let mut before_barrier: Box<[Bound]> = barrier.into();
    clocks::down(&mut before_barrier, dimension);
    let mut in_time = Federation::of_zone(dimension, to);
    in_time.intersect_zone(&before_barrier);
    in_time.subtract_zone(&strictly_after(barrier, dimension));
    in_time.down(&ClockSet::EMPTY);
    let mut lost = Federation::of_zone(dimension, past);
    lost.intersect_zone(&before_barrier);
    lost.subtract_zone(to);
    lost.subtract(&in_time);
    lost
}

fn future_of(zone: &[Bound], dimension: usize) -> Box<[Bound]> {
    let mut future: Box<[Bound]> = zone.into();
    clocks::up(&mut future, dimension);
    future
}

/// The valuations that lie a positive delay after one of the zone: its future with all lower bounds strict.
///
/// Closed, since the sum of a strict bound and another is strict.
fn strictly_after(zone: &[Bound], dimension: usize) -> Box<[Bound]> {
    let mut after = future_of(zone, dimension);
    for bound in &mut after[1..dimension] {
        *bound = Bound(bound.0 & !1);
    }
    debug_assert!(!dbm::is_empty(&after));
    after
}
