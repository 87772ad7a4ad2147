//! Safe timed predecessors: from where can time pass into a good set without meeting a bad one?
//!
//! `Pred_t(G, B)` holds the valuations that reach G by some delay d >= 0 such that no valuation on
//! the way is in B. The way includes both ends: where a good and a bad move are possible at the
//! same instant, the opponent may move first.
//!
//! For zones G and B, with `Z↓` for the past of Z, `Pred_t(G, B) = (G↓ \ B↓) ∪ ((G ∩ B↓) \ B)↓`:
//! either B never comes, or G comes before it. For unions it is the union over the zones of G of
//! the intersection over the zones of B. The reason: from one valuation, the delays that reach a
//! zone of G form an interval, and each zone of B cuts off a final part of it. Of finitely many
//! initial parts, the shortest is contained in all.
//!
//! Where we differ: intersecting unions would multiply overlapping zones. Instead we collect what
//! each zone of B takes away, `(G↓ ∩ B↓) \ ((G ∩ B↓) \ B)↓`, and subtract that from `G↓` once.
//!
//! With stopped clocks the past of a zone is over-approximated (see [`super::clocks`]). The result
//! is then neither an over- nor an under-approximation, and a verdict that depends on it is
//! "maybe".
//!
//! Source: F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient On-the-Fly Algorithms
//! for the Analysis of Timed Games", CONCUR 2005, section 4.

use super::federation::Federation;
use super::{Bound, ClockSet, clocks, dbm};

/// From about this number of zones on, it is worth reducing the federation first. Subtracting a
/// zone can multiply the zones of the rest, but reducing costs the square of their number. On
/// random federations, reducing first was faster from this number on.
const WORTH_REDUCING: usize = 16;

/// The safe timed predecessors of `good` with respect to `bad`, where the clocks of `stopped` do
/// not move.
#[must_use]
pub fn predecessors(good: &Federation, bad: &Federation, stopped: &ClockSet) -> Federation {
    let dimension = good.dimension();
    let with_past = |zone| WithPast::new(zone, dimension, stopped);
    let bad: Vec<WithPast> = bad.zones().map(with_past).collect();
    let mut result = Federation::empty(dimension);
    for good in good.zones().map(with_past) {
        let mut lost = Federation::empty(dimension);
        for bad in &bad {
            // If the pasts do not meet, this bad zone forbids nothing.
            if !dbm::are_apart(&good.past, &bad.past, dimension) {
                let lost_to_it = lost_to(&good, bad, dimension, stopped);
                lost.unite(&lost_to_it);
            }
        }
        if lost.zone_count() > WORTH_REDUCING {
            lost.reduce();
        }
        let safe = Federation::of_zone(dimension, &good.past).minus(&lost);
        result.unite(&safe);
    }
    result
}

/// A zone and its past.
struct WithPast<'a> {
    zone: &'a [Bound],
    past: Box<[Bound]>,
}

impl<'a> WithPast<'a> {
    fn new(zone: &'a [Bound], dimension: usize, stopped: &ClockSet) -> WithPast<'a> {
        let mut past: Box<[Bound]> = zone.into();
        clocks::down_stopped(&mut past, dimension, stopped);
        WithPast { zone, past }
    }
}

/// The part of the past of `good` that can reach it only by meeting `bad` first.
fn lost_to(good: &WithPast, bad: &WithPast, dimension: usize, stopped: &ClockSet) -> Federation {
    let mut before_bad = Federation::of_zone(dimension, good.zone);
    before_bad.intersect_zone(&bad.past);
    before_bad.subtract_zone(bad.zone);
    before_bad.down(stopped);
    let mut lost = Federation::of_zone(dimension, &good.past);
    lost.intersect_zone(&bad.past);
    lost.subtract(&before_bad);
    lost
}
