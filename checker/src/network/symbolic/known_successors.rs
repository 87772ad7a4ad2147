//! Successors from the cache of zones: see [`super::successor_cache`].

use crate::cancellation;
use crate::network::{Failure, MoveRef, Symbolic};
use crate::zones::clocks;
use crate::zones::zone_table::ZoneId;
use crate::zones::{Bound, dbm, simulation};

use super::clock_effect::{add_constraints, check_limit, to_assignment};
use super::packed_effects::{ASSIGNMENTS, GUARD, INVARIANT};
use super::successor_cache::{FixedEffect, KeptZone, KnownZone, MemoLimits, NOTHING, ZoneOutcome};

impl<'a> Symbolic<'a> {
    /// The same, with other limits of the cache.
    #[must_use]
    pub fn remembering(mut self, limits: MemoLimits) -> Symbolic<'a> {
        self.memo.limits = limits;
        self
    }

    /// Says whether zones on entry, before extrapolation, are needed. By default they are.
    pub fn need_entered(&mut self, needs: bool) {
        if self.memo.needs_entered != needs {
            self.memo.forget();
            self.memo.needs_entered = needs;
        }
    }

    /// The number of the zone of a state that is explored; `None` if its moves cannot be looked up,
    /// or if that does not pay.
    pub fn know(&mut self, zone: &[Bound]) -> Option<KnownZone> {
        let is_used = self.tuning().successor_cache && self.memo.is_possible;
        if !is_used || self.has_barriers() || self.splits() {
            return None;
        }
        self.memo.know(zone)
    }

    /// Whether moves from the zone can still be looked up.
    pub fn is_known(&self, known: KnownZone) -> bool {
        known.age == self.memo.age
    }

    /// Does the work of [`Symbolic::take`], [`Symbolic::forget`] and [`Symbolic::pass_time`], for a
    /// move from a known zone. Each guard of the move leaves something of the zone. It overwrites
    /// `zone`, which has the same dimension. `None` if the move is not possible.
    pub fn enter_known(
        &mut self,
        one: MoveRef<'_>,
        words: &mut [i32],
        known: KnownZone,
        source: &[Bound],
        zone: &mut [Bound],
    ) -> Result<Option<KeptZone>, Failure> {
        cancellation::work(words.len() + zone.len());
        if let Some(listed) = one.listed
            && let Some(Some(fixed)) = self.memo.fixed.get(&listed)
            && let Some(outcome) = self.memo.find(known.zone, fixed.effect)
        {
            self.stepper.take(&fixed.one, words)?;
            self.forget(words);
            self.memo.balance.note(true);
            return Ok(self.memo.result(outcome, zone));
        }
        let dimension = self.dimension;
        if one.constraints.len() > 1 {
            zone.copy_from_slice(source);
            if !add_constraints(one.constraints, &mut self.invariant)?
                || !dbm::constrain_all(zone, dimension, &self.invariant)
            {
                return Ok(None);
            }
        }
        if !self.pack_effect(one, words)? {
            return Ok(None);
        }
        self.forget(words);
        let may_delay = match self.may_delay(words) {
            Ok(may_delay) => may_delay,
            // If nothing of the zone is left, it does not matter whether time may pass.
            Err(failure) => {
                let is_left = self.apply_effect(source, zone)?;
                return if is_left { Err(failure) } else { Ok(None) };
            }
        };
        self.memo.effects.key.push(may_delay.into());
        self.bounds.classes_into(words, &mut self.memo.effects.key);
        let effect = self.memo.effects.intern();
        self.fix_effect(one, words, effect);
        let found = self.memo.find(known.zone, effect);
        self.memo.balance.note(found.is_some());
        if let Some(outcome) = found {
            return Ok(self.memo.result(outcome, zone));
        }
        let empty = ZoneOutcome {
            zone: known.zone,
            effect,
            entered: NOTHING,
            kept: NOTHING,
        };
        let outcome = self.completed(empty, words, source, may_delay, zone)?;
        if self.is_known(known) {
            self.memo.insert(outcome);
        }
        Ok(self.memo.result(outcome, zone))
    }

    /// Takes a move and packs its effect on clocks; false if the invariants of its target do not
    /// hold.
    fn pack_effect(&mut self, one: MoveRef<'_>, words: &mut [i32]) -> Result<bool, Failure> {
        let effects = &mut self.memo.effects;
        effects.begin();
        effects.add_constraints(one.constraints);
        effects.end(GUARD);
        for assignment in self.stepper.fire(one.parts, words)? {
            check_limit(assignment.value)?;
            effects.add_assignment(*assignment);
        }
        effects.end(ASSIGNMENTS);
        match self.stepper.invariants(words)? {
            Some(emitted) => effects.add_constraints(emitted),
            None => return Ok(false),
        }
        effects.end(INVARIANT);
        Ok(true)
    }

    /// Caches the effect of a listed move, which led to these words, unless it may depend on
    /// variables.
    fn fix_effect(&mut self, one: MoveRef<'_>, words: &[i32], effect: u32) {
        let Some(listed) = one.listed else { return };
        if self.memo.fixed.contains_key(&listed) {
            return;
        }
        let is_fixed =
            self.tuning().constant_effect && self.is_fixed() && self.bounds.follow_locations();
        let fixed = self.stepper.fix(one, words).filter(|_| is_fixed);
        let fixed = fixed.map(|one| FixedEffect { one, effect });
        self.memo.fixed.insert(listed, fixed);
    }

    /// Applies the current effect to a zone.
    fn apply_effect(&mut self, source: &[Bound], zone: &mut [Bound]) -> Result<bool, Failure> {
        let dimension = self.dimension;
        let effects = &self.memo.effects;
        zone.copy_from_slice(source);
        if !add_constraints(&effects.guard(), &mut self.invariant)?
            || !dbm::constrain_all(zone, dimension, &self.invariant)
        {
            return Ok(false);
        }
        for assignment in effects.assignments() {
            if !clocks::assign(zone, dimension, &[to_assignment(&assignment)?]) {
                return Ok(false);
            }
        }
        Ok(add_constraints(&effects.invariant(), &mut self.invariant)?
            && dbm::constrain_all(zone, dimension, &self.invariant))
    }

    /// The outcome of the current effect on a zone, with the wait after it.
    fn completed(
        &mut self,
        mut outcome: ZoneOutcome,
        words: &[i32],
        source: &[Bound],
        may_delay: bool,
        zone: &mut [Bound],
    ) -> Result<ZoneOutcome, Failure> {
        if self.apply_effect(source, zone)? {
            self.delay_by_invariant(words, may_delay, zone)?;
            // A single state may have any number of successors.
            if self.memo.used_bytes() > self.memo.limits.bytes {
                self.memo.forget();
            }
            (outcome.entered, outcome.kept) = self.intern(words, zone);
        }
        Ok(outcome)
    }

    /// The numbers of a zone that was entered and of its stored form.
    fn intern(&mut self, words: &[i32], zone: &[Bound]) -> (ZoneId, ZoneId) {
        let mut kept = std::mem::take(&mut self.memo.scratch);
        kept.clear();
        kept.extend_from_slice(zone);
        let kept_zone = if self.keeps_reduced() {
            self.bounds.ceilings_into(words, &mut self.ceilings);
            simulation::reduce(&mut kept, self.dimension, &self.ceilings);
            kept.extend_from_slice(self.ceilings.limits());
            self.memo.reduced.intern(&kept)
        } else {
            self.extrapolate(words, &mut kept);
            self.memo.zones.intern(&kept)
        };
        self.memo.scratch = kept;
        if self.memo.needs_entered || self.keeps_reduced() {
            (self.memo.zones.intern(zone), kept_zone)
        } else {
            (kept_zone, kept_zone)
        }
    }

    /// Whether the reduced forms of zones are stored (see [`Symbolic::to_stored`]). They are not if
    /// states are exchanged before.
    pub fn keeps_reduced(&self) -> bool {
        self.stores_reduced() && self.symmetry().is_none()
    }

    /// Whether the stored form can still be looked up.
    pub fn is_kept(&self, kept: KeptZone) -> bool {
        kept.age == self.memo.age
    }

    /// The stored form of a zone that the last move entered: the reduced form and the limits of its
    /// ceilings, or the extrapolated zone without limits.
    pub fn kept(&self, kept: KeptZone) -> (&[Bound], &[Bound]) {
        if self.keeps_reduced() {
            self.memo
                .reduced
                .get(kept.zone)
                .split_at(self.dimension * self.dimension)
        } else {
            (self.memo.zones.get(kept.zone), &[])
        }
    }

    /// The number of the extrapolated zone that is stored; `None` if the stored form is reduced.
    pub fn known_kept(&self, KeptZone { zone, age }: KeptZone) -> Option<KnownZone> {
        (!self.keeps_reduced()).then_some(KnownZone { zone, age })
    }

    /// Whether locations and the answers of guards decide the moves, and locations alone decide how
    /// time passes.
    pub fn is_fixed(&self) -> bool {
        if self.has_priorities || self.restriction.is_some() {
            return false;
        }
        let network = self.stepper.network();
        !network.features.stopwatches && !network.channels.iter().any(|channel| channel.urgent)
    }
}
