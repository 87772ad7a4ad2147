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

use crate::zones::dbm::{self, Constraint};
use crate::zones::future::{self, Barriers};
use crate::zones::{Bound, Federation, Zone};

use super::clock_effect::{conjunctions, to_constraints};
use super::restriction;
use crate::network::discrete::broadcast_filter::Scope;
use crate::network::{Failure, MoveRef, Moves, Part, Symbolic};

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

    /// All moves that the words of a state allow. A move that priorities or a restriction forbid in
    /// part is cut down to the rest.
    ///
    /// A move is forbidden where one of a higher level is possible, its target's invariants
    /// included. Levels are those of channels first, then the greatest of the participating
    /// processes.
    pub fn moves(&mut self, words: &mut [i32], out: &mut Moves) -> Result<(), Failure> {
        self.moves_in(words, Scope::Everything, out)
    }

    /// Like [`Symbolic::moves`]; it may leave out moves that no valuation of the zone allows.
    pub fn moves_within(
        &mut self,
        words: &mut [i32],
        zone: &[Bound],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        self.moves_in(words, Scope::Within(zone), out)
    }

    /// Like [`Symbolic::moves`]; it may leave out moves that have other parts.
    pub fn moves_of(
        &mut self,
        words: &mut [i32],
        parts: &[Part],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        // What priorities forbid depends on all moves.
        let scope = if self.has_priorities {
            Scope::Everything
        } else {
            Scope::Of(parts)
        };
        self.moves_in(words, scope, out)
    }

    fn moves_in(
        &mut self,
        words: &mut [i32],
        scope: Scope<'_>,
        out: &mut Moves,
    ) -> Result<(), Failure> {
        match scope {
            Scope::Of(_) => self.stepper.compute_moves(words, scope, out)?,
            _ => self.stepper.moves_in(words, scope, out)?,
        }
        self.forbid(words, out)
    }

    /// Like [`Symbolic::moves`], for a caller that asks for the moves of the same state again.
    pub fn remembered_moves(&mut self, words: &mut [i32], out: &mut Moves) -> Result<(), Failure> {
        self.stepper.moves(words, out)?;
        self.forbid(words, out)
    }

    /// Applies priorities and the restriction to the moves of a state.
    fn forbid(&mut self, words: &[i32], out: &mut Moves) -> Result<(), Failure> {
        self.apply_priorities(words, out)?;
        if let Some(restriction) = self.restriction {
            restriction::apply(self.stepper.network(), restriction, words, out);
        }
        Ok(())
    }

    fn apply_priorities(&mut self, words: &[i32], moves: &mut Moves) -> Result<(), Failure> {
        if !self.has_priorities || moves.len() < 2 {
            return Ok(());
        }
        let levels: Vec<(u32, u32)> = moves.iter().map(|one| self.stepper.level(one)).collect();
        let lowest = levels.iter().min().copied();
        let mut possible = Vec::with_capacity(levels.len());
        let mut target = words.to_vec();
        for (one, level) in moves.iter().zip(&levels) {
            // Nothing is below the lowest level, so it forbids nothing.
            if Some(*level) == lowest {
                possible.push(Vec::new());
                continue;
            }
            target.copy_from_slice(words);
            let effect = self.fire(one, &mut target)?;
            possible.push(effect.map_or_else(Vec::new, |effect| {
                let universe = Zone::universe(self.dimension());
                conjunctions(&effect.enabled_part(universe.bounds(), self.dimension()))
            }));
        }
        let mut allowed = Moves::default();
        for (one, level) in moves.iter().zip(&levels) {
            let above = levels
                .iter()
                .zip(&possible)
                .filter(|(other, _)| *other > level);
            let forbidden =
                above.flat_map(|(_, conjunctions)| conjunctions.iter().map(Vec::as_slice));
            allowed.push_without(one, forbidden);
        }
        *moves = allowed;
        Ok(())
    }

    /// Whether the guards of a move leave anything of the zone for which the moves were computed.
    /// This is checked before a move is taken, so that no update runs that cannot happen.
    pub fn is_enabled(&self, one: MoveRef<'_>, zone: &[Bound]) -> Result<bool, Failure> {
        if one.is_unconditional() || one.label.is_possible {
            return Ok(true);
        }
        let Some(guard) = to_constraints(one.constraints)? else {
            return Ok(false);
        };
        let is_near = |constraint| dbm::satisfies(zone, self.dimension(), constraint);
        if !guard.iter().all(is_near) {
            return Ok(false);
        }
        if guard.len() <= 1 && one.excluded().next().is_none() {
            return Ok(true);
        }
        Ok(!guarded_part(one, zone, self.dimension())?.is_empty())
    }
}

/// The part of a zone in which the guards of a move hold.
fn guarded_part(one: MoveRef<'_>, zone: &[Bound], dimension: usize) -> Result<Federation, Failure> {
    let mut part = Federation::of_zone(dimension, zone);
    match to_constraints(one.constraints)? {
        Some(guard) => part.constrain_all(&guard),
        None => part.clear(),
    }
    for conjunction in one.excluded() {
        if let Some(excluded) = to_constraints(conjunction)? {
            part.subtract_conjunction(&excluded);
        }
    }
    Ok(part)
}
