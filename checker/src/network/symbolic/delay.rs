//! How time passes where invariants alone do not decide it: barriers, and delays of several zones
//! at once.
//!
//! A *barrier* is the set in which a synchronisation on an urgent channel with clock guards is
//! enabled: time runs up to it and stops. If it contains all valuations or none,
//! [`Symbolic::may_delay`] knows it. Otherwise the future of a zone within its barriers is a
//! federation ([`crate::zones::future`]). A guard with a strict lower bound has no first moment:
//! time stops before it, and the synchronisation never happens; this follows from the definition of
//! urgency. A restriction ([`super::restriction`]) has barriers too, where it does not allow
//! waiting.

use crate::zones::dbm::Constraint;
use crate::zones::future::{self, Barriers};
use crate::zones::{Bound, Federation, Zone};

use super::allowed_moves::guarded_part;
use crate::network::discrete::broadcast_filter::Scope;
use crate::network::{Failure, Symbolic};

impl Symbolic<'_> {
    /// The part of the zone in which time cannot pass because of a clock-guarded urgent
    /// synchronisation or a restriction.
    pub fn barriers(&mut self, words: &mut [i32], zone: &[Bound]) -> Result<Barriers, Failure> {
        let mut urgent = Federation::empty(self.dimension());
        if self.has_guarded_urgency {
            urgent = self.urgent_part(words, zone)?;
        }
        let allowed = self.restriction.and_then(|one| one.allowed(words));
        let mut barriers = allowed.map_or_else(
            || Barriers::none(self.dimension()),
            |allowed| allowed.barriers.clone(),
        );
        for part in std::iter::once(&mut barriers.stops).chain(&mut barriers.open) {
            part.intersect_zone(zone);
        }
        if !urgent.is_empty() {
            for part in &mut barriers.open {
                part.subtract(&urgent);
            }
            barriers.stops.unite(&urgent);
        }
        barriers.open.retain(|part| !part.is_empty());
        Ok(barriers)
    }

    /// Whether a synchronisation on an urgent channel may have clock guards.
    pub fn has_guarded_urgency(&self) -> bool {
        self.has_guarded_urgency
    }

    /// Whether there may be barriers.
    pub fn has_barriers(&self) -> bool {
        self.has_guarded_urgency || self.restriction.is_some()
    }

    /// The part of the zone in which the restriction does not let its owner wait.
    pub fn obliged_part(&self, words: &[i32], zone: &[Bound]) -> Federation {
        let allowed = self.restriction.and_then(|one| one.allowed(words));
        let Some(allowed) = allowed else {
            return Federation::empty(self.dimension());
        };
        let mut obliged = allowed.barriers.stops.clone();
        obliged.intersect_zone(zone);
        obliged
    }

    /// The part of the zone in which a clock-guarded urgent synchronisation is enabled.
    pub fn urgent_part(
        &mut self,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Federation, Failure> {
        let mut urgent = Federation::empty(self.dimension());
        let mut moves = std::mem::take(&mut self.inner_moves);
        let result = self
            .stepper
            .compute_moves(words, Scope::Within(zone), &mut moves);
        if result.is_ok() {
            for one in moves.iter().filter(|one| self.stepper.is_urgent_move(*one)) {
                urgent.unite(&guarded_part(one, zone, self.dimension())?);
            }
        }
        self.inner_moves = moves;
        result?;
        Ok(urgent)
    }

    /// Lets time pass in each of the zones on entry of a state; a zone with barriers in its future
    /// may become several.
    pub fn let_time_pass(
        &mut self,
        words: &mut [i32],
        invariant: &[Constraint],
        zones: &mut Vec<Zone>,
    ) -> Result<(), Failure> {
        let may_delay = !zones.is_empty() && self.may_delay(words)?;
        if !may_delay {
            return Ok(());
        }
        let mut entries = Vec::new();
        if self.has_barriers() {
            entries.clone_from(zones);
        }
        for zone in zones.iter_mut() {
            self.delay(words, may_delay, invariant, zone.bounds_mut())?;
        }
        for index in 0..entries.len() {
            let whole = zones[index].clone();
            let barriers = self.barriers(words, whole.bounds())?;
            if barriers.is_empty() {
                continue;
            }
            let mut reached = self.within(&entries[index], &whole, &barriers);
            reached.reduce();
            let mut parts = reached.to_zones();
            zones[index] = parts
                .next()
                .expect("the zone on entry is reached without delay");
            zones.extend(parts);
        }
        Ok(())
    }

    /// What `entry` reaches without passing a barrier, in `whole`, its future within the invariant.
    pub fn within(&self, entry: &Zone, whole: &Zone, barriers: &Barriers) -> Federation {
        let from = Federation::of_zone(self.dimension(), entry.bounds());
        let nothing = Federation::empty(self.dimension());
        let mut reached = future::successors(&from, &nothing, barriers);
        reached.intersect_zone(whole.bounds());
        reached
    }
}
