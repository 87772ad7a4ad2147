//! The moves of a state that priorities and a restriction ([`super::restriction`]) leave, and
//! whether a zone allows them.

use super::clock_effect::{conjunctions, to_constraints};
use super::restriction;
use crate::network::discrete::broadcast_filter::Scope;
use crate::network::{Failure, MoveRef, Moves, Part, Symbolic};
use crate::zones::dbm;
use crate::zones::{Bound, Federation, Zone};

impl Symbolic<'_> {
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

    /// The part of a zone in which the guards of a move hold.
    pub fn guarded_part(&self, one: MoveRef<'_>, zone: &[Bound]) -> Result<Federation, Failure> {
        guarded_part(one, zone, self.dimension())
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
pub(super) fn guarded_part(
    one: MoveRef<'_>,
    zone: &[Bound],
    dimension: usize,
) -> Result<Federation, Failure> {
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
