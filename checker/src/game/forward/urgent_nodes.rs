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

use crate::network::{Failure, Moves};
use crate::zones::dbm::Constraint;
use crate::zones::future::{self, Barriers};
use crate::zones::{ClockSet, Federation, Patience, Zone, instants, past};

use super::graph::{Graph, Origin, push_step};

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
    pub(in crate::game) fn predecessors(
        &self,
        good: &Federation,
        bad: &Federation,
        patience: &mut Patience<'_>,
    ) -> Federation {
        let stops = self.stops();
        let mut now = good.clone();
        now.subtract_within(bad, patience);
        let mut running = self.reached.clone();
        running.subtract_within(&stops, patience);
        let first = instants::after(&running, &ClockSet::EMPTY);
        let entered = now.intersection_within(&stops, patience);
        let entered = entered.intersection_within(&first, patience);
        let mut soon = now.intersection_within(&self.obliged, patience);
        soon.subtract_within(&self.channel, patience);
        let mut sooner = instants::before(&soon, &ClockSet::EMPTY);
        sooner = sooner.intersection_within(&running, patience);
        sooner.subtract_within(bad, patience);
        let mut ends = now.clone();
        ends.subtract_within(&stops, patience);
        ends.unite_within(&entered, patience);
        ends.unite_within(&sooner, patience);
        let mut barred = stops;
        barred.subtract_within(&entered, patience);
        barred.unite_within(bad, patience);
        let mut all = past::predecessors_within(&ends, &barred, &ClockSet::EMPTY, patience);
        all.unite_within(&now, patience);
        all
    }
}

impl Graph<'_, '_> {
    /// How time is stopped in a node; `None` if nothing does it at some clock values only.
    pub fn urgent(&self, node: u32) -> Option<&Urgent> {
        if self.urgent.is_empty() {
            return None;
        }
        self.urgent.get(&node)
    }

    /// All valuations of a node that count.
    pub fn whole(&self, node: u32) -> Federation {
        match self.urgent(node) {
            Some(urgent) => urgent.reached.clone(),
            None => Federation::of_zone(self.dimension(), self.zone(node)),
        }
    }

    /// Whether a node whose zone contains that of a state also reaches whatever the state does.
    pub(super) fn covers(&self, node: u32, zone: &Zone, urgent: Option<&Urgent>) -> bool {
        match (self.urgent(node), urgent) {
            (None, _) => true,
            (Some(known), None) => known.reached.includes_zone(zone.bounds()),
            (Some(known), Some(new)) => new.reached.is_subset(&known.reached),
        }
    }

    /// Makes the initial node.
    pub(super) fn start_urgently(&mut self) -> Result<(), Failure> {
        let (mut words, zone, invariant) = self.start()?;
        for (zone, urgent) in self.futures(&mut words, &invariant, vec![zone])? {
            let id = self.zones.intern(zone.bounds());
            self.node_of(&mut words, &zone, id, urgent)?;
        }
        Ok(())
    }

    /// Takes a move of a node; adds its edges.
    pub(super) fn follow_urgently(
        &mut self,
        origin: Origin,
        moves: &Moves,
        target: &mut [i32],
    ) -> Result<(), Failure> {
        let dimension = self.dimension();
        let one = moves.get(origin.ordinal as usize);
        let pieces = self.whole(origin.node);
        let mut is_enabled = false;
        for piece in pieces.zones() {
            is_enabled |= self.symbolic.is_enabled(one, piece)?;
        }
        if !is_enabled || !self.symbolic.fire_into(one, target, &mut self.effect)? {
            return Ok(());
        }
        let mut entries = Vec::new();
        for piece in pieces.zones() {
            self.effect.entry_zones(piece, dimension, &mut self.entries);
            entries.append(&mut self.entries);
        }
        self.steps.clear();
        push_step(&mut self.steps, false, &self.effect);
        let program = self.programs.intern(&self.steps);
        if self.dead_ends.contain(target) {
            if !entries.is_empty() {
                self.end_dead(target, program, origin, 1);
            }
            return Ok(());
        }
        self.symbolic.extrapolate_all(target, &mut entries);
        let invariant = self.effect.invariant.clone();
        let first = self.edges.len();
        for (zone, urgent) in self.futures(target, &invariant, entries)? {
            let id = self.zones.intern(zone.bounds());
            let node = self.node_of(target, &zone, id, urgent)?;
            if self.edges[first..].iter().any(|edge| edge.target == node) {
                continue;
            }
            let is_cut = self.urgent(origin.node).is_some() || self.urgent(node).is_some();
            let (from, to) = (
                self.nodes[origin.node as usize].zone,
                self.nodes[node as usize].zone,
            );
            let ends = ((from, self.zones.get(from)), (to, self.zones.get(to)));
            let is_total = !is_cut && self.programs.is_total(program, ends.0, ends.1, dimension);
            self.link(origin, node, program, (1, is_total));
        }
        Ok(())
    }

    /// What the zones on entry of a state become when time passes.
    fn futures(
        &mut self,
        words: &mut [i32],
        invariant: &[Constraint],
        entries: Vec<Zone>,
    ) -> Result<Vec<(Zone, Option<Urgent>)>, Failure> {
        let may_delay = self.symbolic.may_delay(words)?;
        let mut futures = Vec::new();
        for entry in entries {
            let mut whole = entry.clone();
            self.symbolic
                .delay(words, may_delay, invariant, whole.bounds_mut())?;
            let mut urgent = None;
            let obliged = self.symbolic.obliged_part(words, whole.bounds());
            if may_delay {
                let barriers = self.symbolic.barriers(words, whole.bounds())?;
                if !barriers.is_empty() {
                    let channel = if self.symbolic.has_guarded_urgency() {
                        self.symbolic.urgent_part(words, whole.bounds())?
                    } else {
                        Federation::empty(self.dimension())
                    };
                    let mut reached = self.symbolic.within(&entry, &whole, &barriers);
                    reached.reduce();
                    urgent = Some(Urgent {
                        channel,
                        obliged,
                        reached,
                    });
                }
            } else if !obliged.is_empty() {
                urgent = Some(Urgent {
                    channel: Federation::empty(self.dimension()),
                    obliged,
                    reached: Federation::of_zone(self.dimension(), whole.bounds()),
                });
            }
            futures.push((whole, urgent));
        }
        Ok(futures)
    }
}
