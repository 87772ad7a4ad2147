//! Safe timed predecessors: from where can time pass into a good set without meeting a bad one?
//!
//! `Pred_t(G, B)` holds the valuations that reach G by some delay d >= 0 such that no valuation on the way is in B, both
//! ends included: where a good and a bad move are possible at the same instant, the opponent may come first.
//!
//! For zones G and B, with `Z↓` for the past of Z,
//! `Pred_t(G, B) = (G↓ \ B↓) ∪ ((G ∩ B↓) \ B)↓`: either B never comes, or G is met before it. For unions it is the union
//! over the zones of G of the intersection over the zones of B: from one valuation the delays that reach a zone of G
//! form an interval, each zone of B cuts off a final part of it, and of finitely many initial parts the shortest is
//! contained in all.
//!
//! With stopped clocks the past of a zone is over-approximated (see [`super::clocks`]), so the result is an
//! approximation in either direction and a verdict that rests on it is "maybe".
//!
//! Source: F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient On-the-Fly Algorithms for the Analysis of
//! Timed Games", CONCUR 2005, section 4.

use super::federation::Federation;
use super::{Bound, ClockSet, clocks, dbm};

/// The safe timed predecessors of `good` with respect to `bad`.
#[must_use]
pub fn predecessors(good: &Federation, bad: &Federation, stopped: &ClockSet) -> Federation {
    let dimension = good.dimension();
    let past_of_bad: Vec<Box<[Bound]>> = bad
        .zones()
        .map(|zone| past(zone, dimension, stopped))
        .collect();
    let mut result = Federation::empty(dimension);
    for zone in good.zones() {
        let past_of_good = past(zone, dimension, stopped);
        let mut safe = Federation::of_zone(dimension, &past_of_good);
        for (bad_zone, bad_past) in bad.zones().zip(&past_of_bad) {
            // Where the pasts do not meet, this bad zone forbids nothing.
            if !dbm::are_apart(&past_of_good, bad_past, dimension) {
                avoid(&mut safe, zone, bad_zone, bad_past, stopped);
            }
        }
        result.unite(&safe);
    }
    result
}

/// The safe predecessors in a state where no time passes: what is good and not bad.
#[must_use]
pub fn predecessors_without_delay(good: &Federation, bad: &Federation) -> Federation {
    let mut result = good.clone();
    result.subtract(bad);
    result
}

/// Keeps in `safe`, a part of the past of the zone `good`, what reaches it without meeting the zone `bad`.
fn avoid(
    safe: &mut Federation,
    good: &[Bound],
    bad: &[Bound],
    past_of_bad: &[Bound],
    stopped: &ClockSet,
) {
    let dimension = safe.dimension();
    let mut before_bad = Federation::of_zone(dimension, good);
    before_bad.intersect_zone(past_of_bad);
    before_bad.subtract_zone(bad);
    before_bad.down(stopped);
    let mut kept = safe.intersection(&before_bad);
    safe.subtract_zone(past_of_bad);
    kept.unite(safe);
    *safe = kept;
}

/// The past of a zone.
fn past(zone: &[Bound], dimension: usize, stopped: &ClockSet) -> Box<[Bound]> {
    let mut past: Box<[Bound]> = zone.into();
    if stopped.is_empty() {
        clocks::down(&mut past, dimension);
    } else {
        clocks::down_stopped(&mut past, dimension, stopped);
    }
    past
}
