//! All that the controller may do in a game to reach something, where a strategy that is played
//! makes one move a state: what a query `under` it allows.
//!
//! There are two such sets. The most permissive one allows every move and every wait after which
//! the win stays certain. It is that of the safety game of staying where the controller wins; its
//! waits are found as in [`super::safety`]. Under it the goal can be put off for ever, if winning
//! valuations lead to each other, or time may pass in them for ever. The narrower one allows every
//! move that leads to a smaller rank, and to wait only where there is no such move. Ranks are the
//! layers of [`crate::game::backward::ranks`]: each turn leads to a smaller one, so the goal
//! comes.
//!
//! In the goal, and outside of what is won, neither decides anything. Where states with the same
//! words lie in several nodes of the graph, a valuation has the same rank in each of them, since a
//! rank depends on what follows only.
//!
//! Invariant: the graph has no chains, and what all of its nodes win is known.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;

use super::attractor::{choose_moves, won_before};
use super::chains::Inner;
use super::extraction::{Choices, Chooser, extract as extracted};
use super::safety::allowed_waiting;
use super::{Decision, Selection, Strategy, decide};
use crate::game::Player;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// How much the controller is left to choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// Every move and wait after which the win stays certain.
    Winning,
    /// Every move to a smaller rank, and to wait where there is none.
    Nearer,
}

/// All that the controller may do in a game that it wins as the seeker. For [`Freedom::Nearer`] the
/// stamps must be layers.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub fn extract(
    solver: &mut Solver<'_, '_, '_>,
    freedom: Freedom,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    let strategy = Strategy::empty(Player::Controller, Selection::Any);
    let result = extracted(solver, &Free(freedom), strategy, vec![0], watch)?;
    Ok(result.map(|all| all.strategy))
}

/// A controller that is left to choose.
struct Free(Freedom);

impl Chooser for Free {
    fn choices(&self, solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
        let mut chosen = Choices::default();
        let goal = solver.goal(node);
        let free = solver
            .federation_of(node, &solver.won.win[node as usize])
            .minus(&goal);
        if solver.is_over(Player::Controller, node) || free.is_empty() {
            return Ok(chosen);
        }
        match self.0 {
            Freedom::Winning => choose_winning(solver, node, &free, &mut chosen)?,
            Freedom::Nearer => choose_nearer(solver, node, &mut chosen)?,
        }
        let opponent = solver.graph.edges_of(node).filter(|&edge| {
            let edge = &solver.graph.edges[edge];
            !edge.is_leg && !edge.controllable && solver.enabled(edge).intersects(&free)
        });
        chosen.taken.extend(opponent.map(|edge| edge as u32));
        Ok(chosen)
    }

    fn inside(&self, _: &Solver<'_, '_, '_>, _: &Edge, inside: &[Inner]) -> Vec<Vec<Decision>> {
        debug_assert!(inside.is_empty(), "the graph has no chains");
        Vec::new()
    }
}

/// Chooses all that keeps the win, where play continues.
fn choose_winning(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    free: &Federation,
    chosen: &mut Choices,
) -> Result<(), Failure> {
    let won = |solver: &Solver<'_, '_, '_>, edge: u32| {
        let target = solver.graph.edges[edge as usize].target;
        solver.won.win[target as usize].clone()
    };
    let mut rest = free.clone();
    choose_moves(solver, node, &mut rest, 0, Selection::Any, &won, chosen)?;
    let acting = free.clone().minus(&rest);
    let safe = solver.federation_of(node, &solver.won.win[node as usize]);
    let mut waiting = allowed_waiting(solver, node, &safe, free, &acting)?;
    waiting.reduce();
    decide(&mut chosen.decisions, waiting, None, 0);
    Ok(())
}

/// Chooses all moves that lead to smaller ranks, and to wait where there are none.
fn choose_nearer(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    chosen: &mut Choices,
) -> Result<(), Failure> {
    for gain in &solver.won.gains[node as usize].clone() {
        if gain.stamp == 0 {
            continue;
        }
        let mut rest = solver.gained_part(node, gain);
        let earlier = |solver: &Solver<'_, '_, '_>, edge: u32| {
            let target = solver.graph.edges[edge as usize].target;
            won_before(solver, target, gain.stamp)
        };
        let selection = Selection::Any;
        choose_moves(
            solver, node, &mut rest, gain.stamp, selection, &earlier, chosen,
        )?;
        decide(&mut chosen.decisions, rest, None, gain.stamp);
    }
    Ok(())
}
