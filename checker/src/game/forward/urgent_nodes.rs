//! Nodes in which something stops time at some clock values only.
//!
//! A synchronisation on an urgent channel with clock guards stops time where it is enabled: see
//! `network/symbolic/delay.rs`; and a strategy under which the game is played where it lets the
//! controller not wait: there the controller is *obliged* to move. The zone of such a node contains
//! its future as if nothing stopped time, so that it is one zone; which part of it is *reached* is
//! kept beside it, and nothing outside of that part counts. Invariants:
//! * The reached part contains its own future up to where time stops.
//! * An edge leads from the reached part of its source, and whatever it leads to is in the reached
//!   part of a target.
//!
//! There are no chains then, and no clocks that stand still.
//!
//! Where an urgent synchronisation has no first moment, time stops before it. Where an obligation
//! has none, the controller moves soon after: time gets to moments as soon as one likes.
//!
//! Zones are extrapolated on entry, before time passes: valuations that differ only above all
//! constants are bisimilar, so each valuation that is added does, also while time passes, what one
//! does that was there before.

use crate::zones::future::{self, Barriers};
use crate::zones::{ClockSet, Federation, Zone, instants, past};

/// How time is stopped in a node.
#[derive(Clone, Debug)]
pub struct Urgent {
    /// Where an urgent synchronisation is enabled.
    pub channel: Federation,
    /// Where the controller is obliged to move.
    pub obliged: Federation,
    /// What time leads to.
    pub reached: Federation,
}

impl Urgent {
    /// The bytes that it takes beside the value itself.
    pub(super) fn heap_bytes(&self) -> usize {
        let parts = [&self.channel, &self.obliged, &self.reached];
        parts.iter().map(|part| part.heap_bytes()).sum()
    }

    /// All valuations that stop time.
    pub(in crate::game) fn stops(&self) -> Federation {
        let mut stops = self.channel.clone();
        stops.unite(&self.obliged);
        stops
    }

    /// All valuations at which time cannot pass for an urgent channel: where it stops time, and
    /// what is followed by that at once.
    pub(in crate::game) fn standstill(&self) -> Federation {
        let mut all = instants::before(&self.channel, &ClockSet::EMPTY);
        all.unite(&self.channel);
        all.intersection(&self.reached)
    }

    /// The zones with what time leads to from them.
    pub(in crate::game) fn later(&self, zones: &[Zone]) -> Vec<Zone> {
        let dimension = self.reached.dimension();
        let mut from = Federation::empty(dimension);
        for zone in zones {
            from.add(zone.bounds());
        }
        let nothing = Federation::empty(dimension);
        let barriers = Barriers {
            stops: self.stops(),
            ..Barriers::none(dimension)
        };
        let reached = future::successors(&from, &nothing, &barriers).intersection(&self.reached);
        let zones = reached.zones();
        zones
            .map(|zone| Zone::from_bounds(dimension, zone))
            .collect()
    }

    /// The safe timed predecessors of `good` with respect to `bad` where time is stopped on the
    /// way: a valuation that stops time can be the last one of a delay, and no other. So of those
    /// in `good` only the first moments are led to, and where an obligation has none, those as soon
    /// as one likes.
    pub(in crate::game) fn predecessors(&self, good: &Federation, bad: &Federation) -> Federation {
        let stops = self.stops();
        let mut now = good.clone();
        now.subtract(bad);
        let mut running = self.reached.clone();
        running.subtract(&stops);
        let first = instants::after(&running, &ClockSet::EMPTY);
        let entered = now.intersection(&stops);
        let entered = entered.intersection(&first);
        let mut soon = now.intersection(&self.obliged);
        soon.subtract(&self.channel);
        let mut sooner = instants::before(&soon, &ClockSet::EMPTY);
        sooner = sooner.intersection(&running);
        sooner.subtract(bad);
        let mut ends = now.clone();
        ends.subtract(&stops);
        ends.unite(&entered);
        ends.unite(&sooner);
        let mut barred = stops;
        barred.subtract(&entered);
        barred.unite(bad);
        let mut all = past::predecessors(&ends, &barred, &ClockSet::EMPTY);
        all.unite(&now);
        all
    }
}
