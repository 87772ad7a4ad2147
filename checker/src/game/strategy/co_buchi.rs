//! How the environment prevents a goal from recurring.
//!
//! Each round of [`crate::game::objectives::buchi`] takes away valuations: from these the
//! controller cannot get to the goal within p and continue inside what was kept before. Let X be
//! what was kept before a round and Y what is kept after it. The valuations of *rank* k are those
//! that round k took away. The environment plays by the rank:
//! * If it can make play leave X, it does: it waits until it has a move that leaves X, and takes
//!   it. Valuations outside X have a smaller rank, or p does not hold there.
//! * Elsewhere in X \ Y it evades: it takes moves that stay outside Y where there are any, and
//!   otherwise waits. So play never gets to a goal from which the controller could continue inside
//!   X.
//!
//! Where the controller moves to a branch point, it picks a leg that leaves X, or stays outside Y.
//!
//! During a play the rank never grows. From every goal that is met, play leaves X, so that the rank
//! falls. So there are at most as many goals as ranks, and after the last one the goal does not
//! recur.

use crate::network::{Failure, Part};
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;

use super::chains::Inner;
use super::extraction::{self, Choices, Chooser, moves_of};
use super::{Decision, Selection, Strategy, decide};
use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::{Edge, Standing};
use crate::game::objectives::buchi::leave;
use crate::game::solver::Solver;

/// Reads the strategy of the environment, which wins from these nodes, from the rounds of the
/// solution.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub fn extract(
    solver: &mut Solver<'_, '_, '_>,
    rounds: &[Vec<Win>],
    waiting: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    let strategy = Strategy::empty(Player::Environment, Selection::First);
    let result = extraction::extract(solver, &Denying { rounds }, strategy, waiting, watch)?;
    Ok(result.map(|all| all.strategy))
}

/// How the environment chooses.
struct Denying<'r> {
    rounds: &'r [Vec<Win>],
}

impl Chooser for Denying<'_> {
    fn choices(&self, solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
        let mut chosen = Choices::default();
        let moves = moves_of(solver, node)?;
        for (after, before) in (1..self.rounds.len()).zip(self.rounds) {
            let mut lost = solver.federation_of(node, &before[node as usize]);
            let left = solver.federation_of(node, &self.rounds[after][node as usize]);
            lost.subtract(&left);
            if lost.is_empty() {
                continue;
            }
            let leaving = leave(solver, node, before)?;
            let leaving = leaving.intersection(&lost);
            let evading = lost.clone().minus(&leaving);
            for (part, kept) in [(leaving, before), (evading, &self.rounds[after])] {
                let mut waiting = part.clone();
                for index in solver.graph.edges_of(node) {
                    let edge = solver.graph.edges[index];
                    if edge.controllable {
                        continue;
                    }
                    let kept = &kept[edge.target as usize];
                    let acting = solver.missing(&edge, kept, None);
                    let acting = acting.intersection(&part);
                    if !acting.is_empty() {
                        waiting.subtract(&acting);
                        let action = Some(moves.get(edge.ordinal as usize).parts.to_vec());
                        push(&mut chosen.decisions, after, acting, action);
                        chosen.taken.push(index as u32);
                    }
                }
                push(&mut chosen.decisions, after, waiting, None);
                let mut picked = |solver: &Solver<'_, '_, '_>, leg| {
                    let edge = &solver.graph.edges[leg as usize];
                    solver.missing(edge, &kept[edge.target as usize], None)
                };
                chosen.pick(after as u32, solver.picks(node, &part, &mut picked)?);
            }
            for index in solver.graph.edges_of(node) {
                let edge = solver.graph.edges[index];
                if edge.controllable && !edge.is_leg && solver.enabled(&edge).intersects(&lost) {
                    chosen.taken.push(index as u32);
                }
            }
        }
        chosen.taken.sort_unstable();
        chosen.taken.dedup();
        Ok(chosen)
    }

    /// What the environment does in the states inside a chain, where the goal holds nowhere. Each
    /// state has one move. If the environment owns it, it takes the move where the rest of the
    /// chain does not lead into what is kept.
    fn inside(
        &self,
        solver: &Solver<'_, '_, '_>,
        edge: &Edge,
        inside: &[Inner],
    ) -> Vec<Vec<Decision>> {
        let dimension = solver.graph.dimension();
        let mut decisions: Vec<Vec<Decision>> = vec![Vec::new(); inside.len()];
        // The parts that the rounds have taken away until now.
        let mut taken: Vec<Federation> = vec![Federation::empty(dimension); inside.len()];
        for (rank, kept) in self.rounds.iter().enumerate().skip(1) {
            let mut kept = solver.federation_of(edge.target, &kept[edge.target as usize]);
            for (index, inner) in inside.iter().enumerate().rev() {
                let (acting, mut lost) = inner.evaded(&mut kept, !inner.controllable);
                lost.subtract(&taken[index]);
                taken[index].unite(&lost);
                let acting = acting.intersection(&lost);
                lost.subtract(&acting);
                let action = Some(inner.parts.clone());
                push(&mut decisions[index], rank, acting, action);
                push(&mut decisions[index], rank, lost, None);
            }
        }
        decisions
    }

    fn is_over(&self, solver: &Solver<'_, '_, '_>, _: Player, node: u32) -> bool {
        solver.graph.nodes[node as usize].standing == Standing::Broken
    }
}

fn push(
    decisions: &mut Vec<Decision>,
    rank: usize,
    mut zones: Federation,
    action: Option<Vec<Part>>,
) {
    zones.reduce();
    decide(decisions, zones, action, rank as u32);
}
