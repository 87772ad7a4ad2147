//! The choices of one player: moves are left out and delays cut short before any search sees them.
//!
//! Under a restriction the moves of its owner are possible only where it allows them, and time
//! passes only where it allows waiting. All other moves stay the same. If waiting ends without a
//! first moment (wait while `x <= 1`, act when `x > 1`), time continues inside the valuations of
//! one decision to act: the restriction does not say at which of its moments the player acts.
//!
//! The controller chooses edges, and the environment picks the legs of branch points. So a rule for
//! a move of the controller counts for all legs of its edges, and a restriction of the environment
//! may say which leg of a move of the controller is picked.
//!
//! The restriction applies to the moves that priorities leave: a move that it forbids still has
//! priority over moves of lower levels. [`crate::network::Symbolic::without_priorities`] says
//! whether priorities count.

use std::sync::Arc;

use crate::ir::{ClockAtom, FixedConstraint, Network};
use crate::zones::Federation;
use crate::zones::future::Barriers;

use super::clock_effect::conjunctions;
use crate::network::{MoveRef, Moves, Part, is_same_entry};

/// What is allowed in the states with the same words.
#[derive(Clone, Debug)]
pub struct Allowed {
    /// Where time must not pass.
    pub barriers: Barriers,
    /// For each move: where it is forbidden.
    pub forbidden: Vec<(Vec<Part>, Federation)>,
    /// Where every move that is not listed is forbidden.
    pub others: Federation,
    /// For each move of the other player: where it is picked among those with the same edges.
    pub legs: Vec<(Vec<Part>, Federation)>,
}

/// Restricts one player. Threads share it.
pub trait Restriction: Sync {
    /// What is allowed in a state with these words; `None` means everything.
    fn allowed(&self, words: &[i32]) -> Option<Arc<Allowed>>;

    /// Whether the player owns a move that is, or is not, controllable.
    fn owns(&self, controllable: bool) -> bool;

    /// The comparisons by which the restriction distinguishes clock values.
    fn atoms(&self) -> &[ClockAtom];
}

impl Allowed {
    /// Where a move of the player is forbidden; a move of the controller is known by its entry.
    pub fn forbidden(&self, network: &Network, one: &MoveRef<'_>) -> &Federation {
        let is_it = |parts: &[Part]| {
            parts == one.parts || one.controllable && is_same_entry(network, parts, one.parts)
        };
        let listed = self.forbidden.iter().find(|listed| is_it(&listed.0));
        listed.map_or(&self.others, |listed| &listed.1)
    }

    /// Where another leg is picked, and not the leg of this move of the other player.
    fn picked_otherwise(
        &self,
        network: &Network,
        one: &MoveRef<'_>,
    ) -> impl Iterator<Item = &Federation> {
        let others = self
            .legs
            .iter()
            .filter(|leg| leg.0 != one.parts && is_same_entry(network, &leg.0, one.parts));
        others.map(|leg| &leg.1)
    }
}

/// Restricts the moves of a state to what is allowed.
pub(super) fn apply(
    network: &Network,
    restriction: &dyn Restriction,
    words: &[i32],
    moves: &mut Moves,
) {
    let Some(allowed) = restriction.allowed(words) else {
        return;
    };
    let is_own = |one: &MoveRef<'_>| restriction.owns(one.controllable);
    if allowed.legs.is_empty() && !moves.iter().any(|one| is_own(&one)) {
        return;
    }
    let mut rest = Moves::default();
    for one in moves.iter() {
        let forbidden: Vec<Vec<FixedConstraint>> = if is_own(&one) {
            conjunctions(allowed.forbidden(network, &one))
        } else {
            let others = allowed.picked_otherwise(network, &one);
            others.flat_map(conjunctions).collect()
        };
        // An empty conjunction always holds.
        if !forbidden.iter().any(Vec::is_empty) {
            rest.push_without(one, forbidden.iter().map(Vec::as_slice));
        }
    }
    *moves = rest;
}
