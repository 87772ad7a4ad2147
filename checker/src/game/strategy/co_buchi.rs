//! How the environment keeps a goal from coming again and again.
//!
//! Each round of [`crate::game::objectives::buchi`] takes away valuations from which the controller
//! cannot get to the goal within p and go on from there inside what was kept before. Let X be what
//! was kept before a round and Y what is kept after it. The valuations of *rank* k are those that
//! round k took away. The environment plays by the rank:
//! * Where it can make play leave X, it does: it waits until it has a move that leaves X, and takes
//!   it. What is outside X has a smaller rank, or p does not hold there.
//! * Elsewhere in X without Y it evades: it takes moves that stay outside Y wherever there are any,
//!   and else waits. So play never gets to a goal from which the controller could go on inside X.
//!
//! Where the controller moves to a branch point, it picks a leg that leaves X, or stays outside Y.
//!
//! Along a play the rank never grows. A goal that is met is one from which play leaves X, so that
//! the rank falls: there are no more goals than ranks, and after the last one the goal does not
//! come again.

use crate::network::{Failure, Part};
use crate::search::limits::{StopReason, Watch};
use crate::zones::{ClockSet, Federation};

use super::attractor::{
    Choices, Decision, Selection, Start, Strategy, StrategyState, keep, moves_of, walk,
    whole_or_part,
};
use super::safety::{new_decision, spoiling, within_invariant};
use crate::game::Player;
use crate::game::backward::solver::{Solver, Win};
use crate::game::forward::node::{Edge, Standing};
use crate::game::objectives::buchi::{leave, to_federation};

/// Reads the strategy of the environment, which wins from these nodes, from the rounds of the
/// solution.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub fn extract(
    solver: &mut Solver<'_, '_, '_>,
    rounds: &[Vec<Win>],
    mut waiting: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    if let Some(reason) = solver.tell(watch) {
        return Ok(Err(reason));
    }
    let mut bytes = 0;
    let mut strategy = Strategy {
        owner: Player::Environment,
        selection: Selection::First,
        time_limit: None,
        under: None,
        start: Start::default(),
        states: Vec::new(),
    };
    let mut seen = vec![false; solver.graph.nodes.len()];
    for &node in &waiting {
        seen[node as usize] = true;
    }
    while let Some(node) = waiting.pop() {
        let known = strategy.states.len();
        let mut words = solver.graph.symbolic.stepper.network().initial.clone();
        solver.graph.load(node, &mut words);
        let Choices {
            decisions,
            legs,
            taken,
        } = choices(solver, node, rounds)?;
        strategy.states.push(StrategyState {
            words: words.clone(),
            decisions,
            legs,
            is_goal: solver.graph.nodes[node as usize].standing == Standing::Broken,
        });
        for edge in taken {
            let edge = solver.graph.edges[edge as usize];
            let inner = inner_states(solver, &edge, &words, rounds)?;
            strategy.states.extend(inner);
            if !std::mem::replace(&mut seen[edge.target as usize], true) {
                waiting.push(edge.target);
            }
        }
        keep(&strategy.states[known..], &mut bytes);
    }
    Ok(Ok(strategy))
}

/// What the environment chooses in a node.
fn choices(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    rounds: &[Vec<Win>],
) -> Result<Choices, Failure> {
    let mut chosen = Choices::default();
    let Choices {
        decisions,
        legs,
        taken,
    } = &mut chosen;
    let moves = moves_of(solver, node)?;
    for (after, before) in (1..rounds.len()).zip(rounds) {
        let mut lost = to_federation(solver, node, &before[node as usize]);
        let left = to_federation(solver, node, &rounds[after][node as usize]);
        lost.subtract(&left);
        if lost.is_empty() {
            continue;
        }
        let leaving = leave(solver, node, before)?;
        let leaving = leaving.intersection(&lost);
        let mut evading = lost.clone();
        evading.subtract(&leaving);
        for (part, kept) in [(leaving, before), (evading, &rounds[after])] {
            let mut waiting = part.clone();
            for index in solver.graph.edges_of(node) {
                let edge = solver.graph.edges[index];
                if edge.controllable {
                    continue;
                }
                let kept = &kept[edge.target as usize];
                let acting = solver.missing(&edge, (kept, None));
                let acting = acting.intersection(&part);
                if !acting.is_empty() {
                    waiting.subtract(&acting);
                    let action = Some(moves.get(edge.ordinal as usize).parts.to_vec());
                    push(decisions, (acting, action, after));
                    taken.push(index as u32);
                }
            }
            push(decisions, (waiting, None, after));
            let mut picked = |solver: &Solver<'_, '_, '_>, leg| {
                let edge = &solver.graph.edges[leg as usize];
                solver.missing(edge, (&kept[edge.target as usize], None))
            };
            let chosen = (&mut *legs, &mut *taken);
            solver.pick_legs(node, (&part, after as u32), &mut picked, chosen)?;
        }
        for index in solver.graph.edges_of(node) {
            let edge = solver.graph.edges[index];
            if edge.controllable && !edge.is_leg && solver.enabled(&edge).intersects(&lost) {
                taken.push(index as u32);
            }
        }
    }
    taken.sort_unstable();
    taken.dedup();
    Ok(chosen)
}

fn push(
    decisions: &mut Vec<Decision>,
    (mut zones, action, rank): (Federation, Option<Vec<Part>>, usize),
) {
    if !zones.is_empty() {
        zones.reduce();
        decisions.push(Decision {
            rank: rank as u32,
            ..new_decision(zones, action)
        });
    }
}

/// The states inside a chain, where the goal holds nowhere. Each has one move, which the
/// environment takes, if it owns it, where the rest of the chain does not lead into what is kept.
fn inner_states(
    solver: &mut Solver<'_, '_, '_>,
    edge: &Edge,
    source: &[i32],
    rounds: &[Vec<Win>],
) -> Result<Vec<StrategyState>, Failure> {
    let inside = walk(solver, edge, source)?;
    let dimension = solver.graph.dimension();
    let mut decisions: Vec<Vec<Decision>> = vec![Vec::new(); inside.len()];
    // What the rounds so far have taken away.
    let mut taken: Vec<Federation> = vec![Federation::empty(dimension); inside.len()];
    for (rank, kept) in rounds.iter().enumerate().skip(1) {
        let mut kept = match &kept[edge.target as usize] {
            Win::Nothing => Federation::empty(dimension),
            Win::Everything => whole_or_part(solver, edge.target, None),
            Win::Part(part) => part.clone(),
        };
        for (index, inner) in inside.iter().enumerate().rev() {
            inner.effect.preimage(&mut kept);
            kept.constrain_all(&inner.invariant);
            let acting = if inner.controllable {
                Federation::empty(dimension)
            } else {
                spoiling(inner, &kept)
            };
            if inner.delays {
                kept.down(&ClockSet::EMPTY);
                kept.constrain_all(&inner.invariant);
            }
            let mut lost = within_invariant(inner, dimension);
            lost.subtract(&kept);
            lost.subtract(&taken[index]);
            taken[index].unite(&lost);
            let acting = acting.intersection(&lost);
            lost.subtract(&acting);
            let action = Some(inner.parts.clone());
            push(&mut decisions[index], (acting, action, rank));
            push(&mut decisions[index], (lost, None, rank));
        }
    }
    let states = inside.into_iter().zip(decisions);
    Ok(states
        .map(|(inner, decisions)| StrategyState {
            words: inner.words,
            decisions,
            legs: Vec::new(),
            is_goal: false,
        })
        .collect())
}
