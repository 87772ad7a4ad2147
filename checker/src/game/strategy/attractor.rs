//! The strategy of the seeker if it wins: from valuations of stamp k it moves into valuations of
//! smaller stamps, or waits for them.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};
use crate::zones::{ClockSet, Federation};

use super::chains::Inner;
use super::extraction::{Choices, Chooser, Extracted, extract as extracted, moves_of, named};
use super::safety::Evading;
use super::{Decision, Selection, Strategy, decide};
use crate::game::Player;
use crate::game::backward::winning_sets::{Gain, Win};
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// Reads the strategy of the player who wins a solved game.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub fn extract(
    solver: &mut Solver<'_, '_, '_>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    extract_from(solver, solver.winner(), vec![0], watch)
}

/// Reads the strategy of a player who wins from these nodes of a solved game.
///
/// # Errors
/// Works like [`extract`].
pub fn extract_from(
    solver: &mut Solver<'_, '_, '_>,
    owner: Player,
    waiting: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    if owner != solver.seeker {
        let selection = match owner {
            Player::Controller => Selection::Any,
            Player::Environment => Selection::First,
        };
        let strategy = Strategy::empty(owner, selection);
        let result = extracted(solver, &Evading, strategy, waiting, watch)?;
        return Ok(result.map(|all| all.strategy));
    }
    let strategy = Strategy::empty(owner, Selection::First);
    let result = extracted(solver, &Seeking, strategy, waiting, watch)?;
    Ok(result.map(|mut all| {
        rank_chains(&mut all);
        all.strategy
    }))
}

/// How the seeker chooses.
struct Seeking;

impl Chooser for Seeking {
    fn choices(&self, solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
        let mut chosen = Choices::default();
        if solver.is_over(solver.seeker, node) {
            return Ok(chosen);
        }
        for gain in &solver.won.gains[node as usize].clone() {
            let mut rest = solver.gained_part(node, gain);
            // Where the target must recur, play continues from there into anything that is won.
            let goes_on = solver.sought.targets.is_some();
            let earlier = |solver: &Solver<'_, '_, '_>, edge: u32| {
                let target = solver.graph.edges[edge as usize].target;
                if gain.stamp > 0 {
                    won_before(solver, target, gain.stamp)
                } else {
                    solver.won.win[target as usize].clone()
                }
            };
            if gain.stamp > 0 || goes_on {
                let selection = Selection::First;
                let rank = gain.stamp;
                choose_moves(
                    solver,
                    node,
                    &mut rest,
                    rank,
                    selection,
                    &earlier,
                    &mut chosen,
                )?;
                if solver.seeker == Player::Environment {
                    let whole = solver.gained_part(node, gain);
                    let mut picked = |solver: &Solver<'_, '_, '_>, leg: u32| {
                        solver.won_by_leg(leg, &earlier(solver, leg))
                    };
                    chosen.pick(gain.stamp, solver.picks(node, &whole, &mut picked)?);
                }
            }
            decide(&mut chosen.decisions, rest, None, gain.stamp);
        }
        let opponent = solver.graph.edges_of(node).filter(|&edge| {
            let edge = &solver.graph.edges[edge];
            !edge.is_leg && !solver.seeker.owns(edge.controllable)
        });
        chosen.taken.extend(opponent.map(|edge| edge as u32));
        Ok(chosen)
    }

    /// What the seeker does in the states inside a chain. Each state has one move, which is taken
    /// where the rest of the chain leads into won valuations of the end; smaller stamps come first.
    /// Elsewhere the strategy waits.
    fn inside(
        &self,
        solver: &Solver<'_, '_, '_>,
        edge: &Edge,
        inside: &[Inner],
    ) -> Vec<Vec<Decision>> {
        let is_own = |inner: &Inner| solver.seeker.owns(inner.controllable);
        let mut decisions: Vec<Vec<Decision>> = vec![Vec::new(); inside.len()];
        for gain in &solver.won.gains[edge.target as usize] {
            let mut won = solver.gained_part(edge.target, gain);
            for (inner, decisions) in inside.iter().zip(&mut decisions).rev() {
                inner.effect.preimage(&mut won);
                won.constrain_all(&inner.invariant);
                let action = is_own(inner).then(|| inner.parts.clone());
                decide(decisions, won.clone(), action, gain.stamp);
                if inner.delays {
                    won.down(&ClockSet::default());
                    won.constrain_all(&inner.invariant);
                    decide(decisions, won.clone(), None, gain.stamp);
                }
            }
        }
        decisions
    }
}

/// Gives states inside chains ranks above the end of their chain, by their distance from it. A
/// state inside a chain may have the same words as a node; with equal ranks, play could enter the
/// chain again from its end.
fn rank_chains(all: &mut Extracted) {
    let Extracted {
        strategy,
        steps_to_end,
    } = all;
    let states = strategy.states.iter().zip(steps_to_end.iter());
    let mut ranks: Vec<(u32, u32)> = states
        .flat_map(|(state, &steps)| {
            let decisions = state.decisions.iter().chain(&state.legs);
            decisions.map(move |one| (one.rank, steps))
        })
        .chain([(0, 0)])
        .collect();
    ranks.sort_unstable();
    ranks.dedup();
    for (state, &steps) in strategy.states.iter_mut().zip(steps_to_end.iter()) {
        for decision in state.decisions.iter_mut().chain(&mut state.legs) {
            let rank = ranks.partition_point(|&rank| rank < (decision.rank, steps));
            decision.rank = rank as u32;
        }
    }
}

/// Which valuations of the target of an edge are good.
pub(super) type Good<'g> = dyn Fn(&Solver<'_, '_, '_>, u32) -> Win + 'g;

/// Chooses moves of the seeker from a part of a node, all of this rank, that lead into `good`
/// valuations of their targets: the first in each valuation, or any. Leaves of the part where there
/// is none.
pub(super) fn choose_moves(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    part: &mut Federation,
    rank: u32,
    selection: Selection,
    good: &Good<'_>,
    chosen: &mut Choices,
) -> Result<(), Failure> {
    let moves = moves_of(solver, node)?;
    let whole = part.clone();
    for edges in own_choices(solver, node) {
        let first = solver.graph.edges[edges[0] as usize];
        let wins: Vec<Win> = edges.iter().map(|&edge| good(solver, edge)).collect();
        let zones = match &wins[..] {
            [win] => solver.before(&first, win),
            wins => solver.before_all(edges.iter().copied().zip(wins)),
        };
        let zones = match selection {
            Selection::First => zones.intersection(part),
            Selection::Any => zones.intersection(&whole),
        };
        if !zones.is_empty() {
            part.subtract(&zones);
            let action = Some(named(solver, &moves, &first));
            decide(&mut chosen.decisions, zones, action, rank);
            chosen.taken.extend(edges);
        }
    }
    Ok(())
}

/// The choices of the seeker in a node: edges, or all legs of an entry.
fn own_choices(solver: &Solver<'_, '_, '_>, node: u32) -> Vec<Vec<u32>> {
    let edges = solver.graph.edges_of(node).filter(|&edge| {
        let edge = &solver.graph.edges[edge];
        !edge.is_leg && solver.seeker.owns(edge.controllable)
    });
    let mut choices: Vec<Vec<u32>> = edges.map(|edge| vec![edge as u32]).collect();
    if solver.seeker == Player::Controller {
        choices.extend_from_slice(solver.graph.branch_points.of(node));
        choices.sort_unstable();
    }
    choices
}

/// The valuations of a node that were won before a stamp.
pub(super) fn won_before(solver: &Solver<'_, '_, '_>, node: u32, stamp: u32) -> Win {
    let mut won: Option<Federation> = None;
    for Gain { stamp: _, part } in solver.won.gains[node as usize]
        .iter()
        .filter(|gain| gain.stamp < stamp)
    {
        let Some(part) = part else {
            return Win::Everything;
        };
        match &mut won {
            None => won = Some(part.clone()),
            Some(won) => {
                won.unite(part);
            }
        }
    }
    won.map_or(Win::Nothing, Win::Part)
}
