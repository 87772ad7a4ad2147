//! Nodes in which something stops time for only some clock values.
//!
//! A synchronisation on an urgent channel with clock guards stops time where it is enabled: see
//! `network/symbolic/delay.rs`. So does a strategy under which the game is played, where it does
//! not let the controller wait: there the controller is *obliged* to move. The zone of such a node
//! contains its future as if nothing stopped time, so it is one zone. The part of it that is
//! *reached* is stored separately, and nothing outside of that part counts. Invariants:
//! * The reached part contains its own future up to where time stops.
//! * An edge starts in the reached part of its source, and everything that it leads to is in the
//!   reached part of a target.
//!
//! There are no chains then, and no clocks that stand still.
//!
//! If an urgent synchronisation has no first moment, time stops before it. If an obligation has
//! none, the controller moves soon after it begins: time gets to moments as close to the beginning
//! as one likes.
//!
//! Zones are extrapolated on entry, before time passes. Valuations that differ only above all
//! constants are bisimilar. So each added valuation behaves like one that was there before, also
//! while time passes.

use crate::zones::future::{self, Barriers};
use crate::zones::{ClockSet, Federation, Zone, instants, past};

/// How time is stopped in a node.
#[derive(Clone, Debug)]
pub struct Urgent {
    /// Where an urgent synchronisation is enabled.
    pub channel: Federation,
    /// Where the controller is obliged to move.
    pub obliged: Federation,
    /// What time reaches.
    pub reached: Federation,
}

impl Urgent {
    /// The bytes that it takes, without the value itself.
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

    /// All valuations in which time cannot pass because of an urgent channel: where it stops time,
    /// and where such a valuation follows at once.
    pub(in crate::game) fn standstill(&self) -> Federation {
        let mut all = instants::before(&self.channel, &ClockSet::EMPTY);
        all.unite(&self.channel);
        all.intersection(&self.reached)
    }

    /// The zones, and what time reaches from them.
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
        reached.to_zones().collect()
    }

    /// The safe timed predecessors of `good` with respect to `bad`, where something stops time in
    /// between. A valuation that stops time can be the last one of a delay, but no earlier one. So
    /// only the first moments of those in `good` are reached; where an obligation has no first
    /// moment, moments as early as one likes are.
    pub(in crate::game) fn predecessors(&self, good: &Federation, bad: &Federation) -> Federation {
        let stops = self.stops();
        let now = good.clone().minus(bad);
        let running = self.reached.clone().minus(&stops);
        let first = instants::after(&running, &ClockSet::EMPTY);
        let entered = now.intersection(&stops);
        let entered = entered.intersection(&first);
        let soon = now.intersection(&self.obliged).minus(&self.channel);
        let mut sooner = instants::before(&soon, &ClockSet::EMPTY);
        sooner = sooner.intersection(&running);
        sooner.subtract(bad);
        let mut ends = now.clone().minus(&stops);
        ends.unite(&entered);
        ends.unite(&sooner);
        let mut barred = stops.minus(&entered);
        barred.unite(bad);
        let mut all = past::predecessors(&ends, &barred, &ClockSet::EMPTY);
        all.unite(&now);
        all
    }
}
