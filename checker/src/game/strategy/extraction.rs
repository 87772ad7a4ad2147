//! How a strategy is read from a solved game: node by node, wherever play under it leads.

use crate::cancellation;
use crate::network::{Failure, Moves, Part, entry_of};
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;

use super::chains::{Inner, walk};
use super::{Decision, Strategy, StrategyState};
use crate::game::Player;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// The choices of the player whose strategy is read.
pub(super) trait Chooser {
    /// What is chosen in a node.
    fn choices(&self, solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure>;

    /// What is done in the states inside the chain of an edge.
    fn inside(
        &self,
        solver: &Solver<'_, '_, '_>,
        edge: &Edge,
        inside: &[Inner],
    ) -> Vec<Vec<Decision>>;

    /// Whether play has ended in a node and the owner has won, for all clock values.
    fn is_over(&self, solver: &Solver<'_, '_, '_>, owner: Player, node: u32) -> bool {
        solver.is_over(owner, node)
    }
}

/// What is chosen in a node.
#[derive(Default)]
pub(super) struct Choices {
    pub(super) decisions: Vec<Decision>,
    /// See [`StrategyState::legs`].
    pub(super) legs: Vec<Decision>,
    /// The edges that play may take from it.
    pub(super) taken: Vec<u32>,
}

impl Choices {
    /// Adds legs that are picked, all of one rank.
    pub(super) fn pick(&mut self, rank: u32, picks: Vec<Pick>) {
        for Pick { leg, zones, parts } in picks {
            self.legs.push(Decision {
                zones,
                action: Some(parts),
                rank,
            });
            self.taken.push(leg);
        }
    }
}

/// A leg that the environment picks.
pub(super) struct Pick {
    /// Its edge.
    leg: u32,
    zones: Federation,
    parts: Vec<Part>,
}

/// A strategy, and for each state inside a chain the number of moves to its end.
pub(super) struct Extracted {
    pub(super) strategy: Strategy,
    pub(super) steps_to_end: Vec<u32>,
}

/// Reads the strategy of a player who wins from these nodes into one that is empty.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub(super) fn extract(
    solver: &mut Solver<'_, '_, '_>,
    chooser: &dyn Chooser,
    mut strategy: Strategy,
    mut waiting: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Result<Extracted, StopReason>, Failure> {
    if let Some(reason) = solver.tell(watch) {
        return Ok(Err(reason));
    }
    let mut steps_to_end = Vec::new();
    let mut bytes = 0;
    let mut seen = vec![false; solver.graph.nodes.len()];
    for &node in &waiting {
        seen[node as usize] = true;
    }
    while let Some(node) = waiting.pop() {
        let known = strategy.states.len();
        let words = solver.graph.words_of(node);
        let Choices {
            decisions,
            legs,
            taken,
        } = chooser.choices(solver, node)?;
        strategy.states.push(StrategyState {
            words: words.clone(),
            decisions,
            legs,
            is_goal: chooser.is_over(solver, strategy.owner, node),
        });
        steps_to_end.push(0);
        for edge in taken {
            let edge = solver.graph.edges[edge as usize];
            let inside = walk(solver, &edge, &words)?;
            let decisions = chooser.inside(solver, &edge, &inside);
            let inside = inside.into_iter().zip(decisions);
            let inside = inside.map(|(inner, decisions)| inner.with(decisions));
            let mut inside: Vec<StrategyState> = inside.collect();
            if strategy.owner == Player::Controller {
                name_entries(solver, &mut inside);
            }
            steps_to_end.extend((1..=inside.len() as u32).rev());
            strategy.states.extend(inside);
            if !std::mem::replace(&mut seen[edge.target as usize], true) {
                waiting.push(edge.target);
            }
        }
        let new = strategy.states[known..].iter();
        bytes += new.map(StrategyState::bytes).sum::<usize>();
        cancellation::ask_for(bytes);
    }
    Ok(Ok(Extracted {
        strategy,
        steps_to_end,
    }))
}

/// How a strategy names the first move of an edge, for a node with these moves, if the owner of the
/// move takes it.
pub(super) fn named(solver: &Solver<'_, '_, '_>, moves: &Moves, edge: &Edge) -> Vec<Part> {
    let parts = moves.get(edge.ordinal as usize).parts;
    if solver.graph.branch_points.is_possible() && edge.controllable {
        entry_of(solver.graph.symbolic.stepper.network(), parts)
    } else {
        parts.to_vec()
    }
}

/// Names the moves of the controller in states inside chains by their entries.
fn name_entries(solver: &Solver<'_, '_, '_>, inside: &mut [StrategyState]) {
    if !solver.graph.branch_points.is_possible() {
        return;
    }
    let network = solver.graph.symbolic.stepper.network();
    let decisions = inside.iter_mut().flat_map(|state| &mut state.decisions);
    for action in decisions.filter_map(|one| one.action.as_mut()) {
        *action = entry_of(network, action);
    }
}

/// The moves of a node.
pub(super) fn moves_of(solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Moves, Failure> {
    let mut words = solver.graph.words_of(node);
    let mut moves = Moves::default();
    solver
        .graph
        .symbolic
        .remembered_moves(&mut words, &mut moves)?;
    Ok(moves)
}

impl Solver<'_, '_, '_> {
    /// The legs that the environment picks in some valuations of a node, each where the ones before
    /// it are not picked; `good` says where a leg is good for it.
    pub(super) fn picks(
        &mut self,
        node: u32,
        part: &Federation,
        good: &mut dyn FnMut(&Self, u32) -> Federation,
    ) -> Result<Vec<Pick>, Failure> {
        let mut picks = Vec::new();
        if self.graph.branch_points.of(node).is_empty() {
            return Ok(picks);
        }
        let moves = moves_of(self, node)?;
        for entry in self.graph.branch_points.of(node).to_vec() {
            let mut left = part.clone();
            for leg in entry {
                let zones = good(self, leg).intersection(&left);
                if zones.is_empty() {
                    continue;
                }
                left.subtract(&zones);
                let ordinal = self.graph.edges[leg as usize].ordinal;
                let parts = moves.get(ordinal as usize).parts.to_vec();
                picks.push(Pick { leg, zones, parts });
            }
        }
        Ok(picks)
    }
}
