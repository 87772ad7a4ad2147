//! The states inside chains of moves without a choice, which the graph does not store.

use crate::network::{ClockEffect, Failure, Moves, Part};
use crate::zones::dbm::Constraint;
use crate::zones::{ClockSet, Federation, Zone};

use super::{Decision, StrategyState};
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// A state inside a chain, with its only move.
pub(super) struct Inner {
    pub(super) words: Vec<i32>,
    pub(super) parts: Vec<Part>,
    pub(super) controllable: bool,
    /// Whether time may pass before the move.
    pub(super) delays: bool,
    /// The invariant of the state.
    pub(super) invariant: Vec<Constraint>,
    pub(super) effect: ClockEffect,
}

impl Inner {
    /// The state of a strategy for it, with these decisions.
    pub(super) fn with(self, decisions: Vec<Decision>) -> StrategyState {
        StrategyState {
            words: self.words,
            decisions,
            legs: Vec::new(),
            is_goal: false,
        }
    }

    /// Steps back through the state: what the seeker wins after it becomes what it wins in it. If
    /// the opponent owns the move, returns where it can take it and escape, and where the seeker
    /// does not win.
    pub(super) fn evaded(&self, won: &mut Federation, is_own: bool) -> (Federation, Federation) {
        self.effect.preimage(won);
        won.constrain_all(&self.invariant);
        let zone = Zone::of_constraints(won.dimension(), &self.invariant);
        let mut acting = Federation::empty(won.dimension());
        if is_own {
            acting = self.effect.enabled_part(zone.bounds(), won.dimension());
            acting.subtract(won);
        }
        if self.delays {
            won.down(&ClockSet::EMPTY);
            won.constrain_all(&self.invariant);
        }
        let lost = Federation::of_zone(won.dimension(), zone.bounds()).minus(won);
        (acting, lost)
    }
}

/// The states inside the chain of an edge, in order.
pub(super) fn walk(
    solver: &mut Solver<'_, '_, '_>,
    edge: &Edge,
    source: &[i32],
) -> Result<Vec<Inner>, Failure> {
    let mut inside = Vec::new();
    if edge.length == 1 {
        return Ok(inside);
    }
    let symbolic = &mut *solver.graph.symbolic;
    let mut words = source.to_vec();
    let mut moves = Moves::default();
    symbolic.remembered_moves(&mut words, &mut moves)?;
    let Some(first) = symbolic.fire(moves.get(edge.ordinal as usize), &mut words)? else {
        return Ok(inside);
    };
    let mut invariant = first.invariant;
    for _ in 1..edge.length {
        let delays = symbolic.may_delay(&mut words)?;
        symbolic.remembered_moves(&mut words, &mut moves)?;
        let before = words.clone();
        let one = moves.get(0);
        let Some(effect) = symbolic.fire(one, &mut words)? else {
            break;
        };
        inside.push(Inner {
            words: before,
            parts: one.parts.to_vec(),
            controllable: one.controllable,
            delays,
            invariant: std::mem::replace(&mut invariant, effect.invariant.clone()),
            effect,
        });
    }
    Ok(inside)
}
