//! Where time can lead from a set without meeting a bad set, and without passing a set that stops
//! it.
//!
//! A *barrier* is a set in which time cannot pass: waiting can enter it, but cannot leave it. Let G
//! be the zone of the start, B a bad zone (a delay must avoid it at both ends too) and U a barrier.
//! Let `Z↑` be the future of Z, and `Z⇑` the valuations that lie a positive delay after a valuation
//! of Z. Then G reaches
//!
//! * without meeting B: `(G↑ \ B↑) ∪ ((G ∩ B↑) \ B)↑`: either B never came, or it came before G;
//! * without passing U: `G ∪ (G↑ \ U⇑) ∪ ((G ∩ U↑) \ U)↑`.
//!
//! Read backwards in time, each set cuts off a final part of the interval of delays that lead back
//! to G. Of finitely many initial parts, the shortest is contained in all. So for unions the result
//! is the union over the zones of G of the intersection over all B and U. The safe predecessors in
//! [`super::past`] have the same form; this is their mirror image.
//!
//! A part of a barrier may be *open*. If the part has no first moment (`x > 1` after `x <= 1`),
//! there is no valuation at which time must stop. So time that comes from outside the barrier runs
//! on inside the part. If the part has a first moment, or time did not lead to a valuation in it,
//! no time passes there. Let P be a zone of the part and P' its lower edge (the valuations from
//! which every short enough delay leads into P). Time runs from `F ∩ P'` to the valuations of P
//! strictly after it, and goes on as long as it stays in the part.
//!
//! Invariant: no clock is stopped. The cost is that of [`super::past`].

use super::federation::Federation;
use super::{Bound, ClockSet, Zone, clocks, dbm, instants, past};

/// Where time does not pass.
#[derive(Clone, Debug)]
pub struct Barriers {
    /// All valuations at which time cannot pass.
    pub stops: Federation,
    /// Parts of `stops` that are open.
    pub open: Vec<Federation>,
}

impl Barriers {
    /// No barrier.
    pub fn none(dimension: usize) -> Barriers {
        Barriers {
            stops: Federation::empty(dimension),
            open: Vec::new(),
        }
    }

    /// Whether there is no barrier.
    pub fn is_empty(&self) -> bool {
        self.stops.is_empty()
    }
}

/// The valuations that `from` reaches by some delay. No valuation on the way, both ends included,
/// may be in `bad`. Only the last may be in a barrier, unless those in a barrier form an open part
/// without a first moment.
#[must_use]
pub fn successors(from: &Federation, bad: &Federation, barriers: &Barriers) -> Federation {
    let mut reached = up_to(from, bad, &barriers.stops);
    if barriers.open.is_empty() {
        return reached;
    }
    let waiting = reached.clone().minus(&barriers.stops);
    for part in &barriers.open {
        reached.unite(&running_on(&waiting, bad, part));
    }
    reached
}

/// Like [`successors`], for barriers without open parts.
fn up_to(from: &Federation, bad: &Federation, stops: &Federation) -> Federation {
    let dimension = from.dimension();
    let mut result = Federation::empty(dimension);
    for zone in from.zones() {
        let future = future_of(zone, dimension);
        let mut lost = Federation::empty(dimension);
        for bad in bad.zones() {
            lost.unite(&lost_to_bad(zone, &future, bad, dimension));
        }
        for barrier in stops.zones() {
            lost.unite(&lost_to_barrier(zone, &future, barrier, dimension));
        }
        let reached = Federation::of_zone(dimension, &future).minus(&lost);
        result.unite(&reached);
    }
    result
}

/// The valuations that time reaches from `from` in the open parts of a barrier, if time is running
/// there already.
#[must_use]
pub fn successors_inside(from: &Federation, bad: &Federation, barriers: &Barriers) -> Federation {
    let mut reached = Federation::empty(from.dimension());
    for part in &barriers.open {
        reached.unite(&staying_in(&from.intersection(part), bad, part));
    }
    reached
}

/// The valuations in an open part of a barrier that time reaches from `waiting`. The set `waiting`
/// lies outside the barrier.
fn running_on(waiting: &Federation, bad: &Federation, part: &Federation) -> Federation {
    let dimension = part.dimension();
    let mut reached = Federation::empty(dimension);
    for piece in part.zones() {
        let starts = waiting.intersection(&lower_edge(piece, dimension));
        for start in starts.zones() {
            let mut first = up_to(
                &Federation::of_zone(dimension, start),
                bad,
                &Federation::empty(dimension),
            );
            first.intersect_zone(&strictly_after(start, dimension));
            first.intersect_zone(piece);
            reached.unite(&first);
        }
    }
    staying_in(&reached, bad, part)
}

/// What time reaches from a subset of a part without leaving the part.
fn staying_in(from: &Federation, bad: &Federation, part: &Federation) -> Federation {
    if from.is_empty() {
        return from.clone();
    }
    let mut left = part.complement();
    left.unite(bad);
    up_to(from, &left, &Federation::empty(part.dimension()))
}

/// The valuations that reach `to` by some delay. Only the last valuation on the way may be in a
/// barrier, unless those in a barrier form an open part without a first moment.
#[must_use]
pub fn predecessors_within(to: &Federation, barriers: &Barriers) -> Federation {
    let mut to = to.clone();
    for part in &barriers.open {
        to.unite(&running_into(&to, part, &barriers.stops));
    }
    back_to(&to, &barriers.stops)
}

/// The valuations outside the barrier from which time runs at once into its open part, and inside
/// it to a valuation of `to`.
fn running_into(to: &Federation, part: &Federation, stops: &Federation) -> Federation {
    let dimension = part.dimension();
    let mut entries = Federation::empty(dimension);
    let ends = to.intersection(part);
    if ends.is_empty() {
        return entries;
    }
    let inside = past::predecessors(&ends, &part.complement(), &ClockSet::EMPTY);
    for piece in part.zones() {
        let edge = lower_edge(piece, dimension);
        let mut within = inside.clone();
        within.intersect_zone(piece);
        for zone in within.zones() {
            let mut entry = edge.clone();
            entry.intersect_zone(strictly_before(zone, dimension).bounds());
            entries.unite(&entry);
        }
    }
    entries.subtract(stops);
    entries
}

/// Like [`predecessors_within`], for barriers without open parts.
fn back_to(to: &Federation, stops: &Federation) -> Federation {
    let dimension = to.dimension();
    let mut result = Federation::empty(dimension);
    for zone in to.zones() {
        let mut past: Box<[Bound]> = zone.into();
        clocks::down(&mut past, dimension);
        let mut lost = Federation::empty(dimension);
        for barrier in stops.zones() {
            lost.unite(&stopped_before(zone, &past, barrier, dimension));
        }
        let reaching = Federation::of_zone(dimension, &past).minus(&lost);
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

/// The valuations that lie a positive delay after one of the zone: its future with all lower bounds
/// strict.
///
/// The result is closed, since the sum of a strict bound and another is strict.
fn strictly_after(zone: &[Bound], dimension: usize) -> Box<[Bound]> {
    let mut after = future_of(zone, dimension);
    for bound in &mut after[1..dimension] {
        *bound = bound.made_strict();
    }
    debug_assert!(!dbm::is_empty(&after));
    after
}

/// The valuations from which every short enough delay leads into the zone.
fn lower_edge(zone: &[Bound], dimension: usize) -> Federation {
    instants::before(&Federation::of_zone(dimension, zone), &ClockSet::EMPTY)
}

/// The valuations that lie a positive delay before one of the zone.
fn strictly_before(zone: &[Bound], dimension: usize) -> Zone {
    let mut before = Zone::from_bounds(dimension, zone);
    before.down(&ClockSet::EMPTY);
    let uppers = (1..dimension).map(|left| (left, zone[left * dimension].made_strict()));
    let uppers: Vec<(usize, Bound)> = uppers.filter(|one| one.1.is_finite()).collect();
    for (left, bound) in uppers {
        if !before.constrain(left, 0, bound) {
            break;
        }
    }
    before
}
