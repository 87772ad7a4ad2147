//! How nodes are made where something stops time for only some clock values
//! ([`super::urgent_nodes`]).

use crate::network::{Failure, Moves};
use crate::zones::dbm::Constraint;
use crate::zones::{Federation, Zone};

use super::expansion::push_step;
use super::graph::Graph;
use super::node::Origin;
use super::urgent_nodes::Urgent;

impl Graph<'_, '_> {
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
            let from = self.nodes[origin.node as usize].zone;
            let to = self.nodes[node as usize].zone;
            let is_total = !is_cut
                && self
                    .programs
                    .is_total(program, from, to, &self.zones, dimension);
            self.link(origin, node, program, 1, is_total);
        }
        Ok(())
    }

    /// The zones on entry of a state after time has passed.
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
