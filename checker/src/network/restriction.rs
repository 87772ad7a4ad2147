//! What one player allows itself: moves are left out and delays cut short before any search sees them.
//!
//! Under a restriction the moves of its owner are possible only where it allows them, and time passes only where it allows
//! waiting. All other moves stay as they are. Where waiting ends without a first moment (wait while `x <= 1`, act when `x > 1`),
//! time runs on inside the valuations of one decision to act: the restriction leaves open which of its moments is taken.
//!
//! What priorities leave of the moves is restricted further: a move that the restriction forbids still goes before those of lower
//! levels. Whether priorities count is said elsewhere ([`super::Symbolic::without_priorities`]).

use crate::exec::EmittedConstraint;
use crate::ir::ClockAtom;
use crate::zones::Federation;
use crate::zones::future::Barriers;

use super::{MoveRef, Moves, Part};

/// What is allowed in the states with the same words.
#[derive(Clone, Debug)]
pub struct Allowed {
    /// Where time must not pass.
    pub barriers: Barriers,
    /// By move: where it is forbidden.
    pub forbidden: Vec<(Vec<Part>, Federation)>,
    /// Where every move that is not listed is forbidden.
    pub others: Federation,
}

/// Restricts one player. Threads share it.
pub trait Restriction: Sync {
    /// What is allowed in a state with these words; `None` is everything.
    fn allowed(&self, words: &[i32]) -> Option<&Allowed>;

    /// Whether the player owns a move that is, or is not, controllable.
    fn owns(&self, controllable: bool) -> bool;

    /// The comparisons with which the restriction tells clock values apart.
    fn atoms(&self) -> &[ClockAtom];
}

impl Allowed {
    /// Where a move of the player is forbidden.
    fn forbidden(&self, parts: &[Part]) -> &Federation {
        let listed = self.forbidden.iter().find(|one| one.0 == parts);
        listed.map_or(&self.others, |one| &one.1)
    }
}

/// Cuts the moves of a state down to what is allowed.
pub(super) fn apply(restriction: &dyn Restriction, words: &[i32], moves: &mut Moves) {
    let Some(allowed) = restriction.allowed(words) else {
        return;
    };
    let is_own = |one: &MoveRef<'_>| restriction.owns(one.controllable);
    if !moves.iter().any(|one| is_own(&one)) {
        return;
    }
    let mut rest = Moves::default();
    for one in moves.iter() {
        let forbidden: Vec<Vec<EmittedConstraint>> = if is_own(&one) {
            super::passage::conjunctions(allowed.forbidden(one.parts))
        } else {
            Vec::new()
        };
        // A conjunction of nothing holds always.
        if !forbidden.iter().any(Vec::is_empty) {
            let excluded = one.excluded().chain(forbidden.iter().map(Vec::as_slice));
            rest.push(
                one.parts,
                [one.constraints],
                excluded,
                one.label.unsettled(),
            );
        }
    }
    *moves = rest;
}
