//! How to stay where the other player, who seeks something, does not win.
//!
//! Outside of what the seeker wins, the evader always has a way to stay outside: a move, or
//! waiting. The environment moves where it can, since the controller might get away later. The
//! controller allows everything that stays outside.

use crate::network::{Failure, Part};
use crate::zones::{ClockSet, Federation, Zone, instants, past};

use super::attractor::{
    Choices, Decision, Inner, Strategy, StrategyState, moves_of, named, walk, whole_or_part,
};
use crate::game::Player;
use crate::game::backward::solver::{Solver, Win};
use crate::game::forward::node::Standing;

/// What the evader chooses in a node.
pub(super) fn choices(solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
    let mut chosen = Choices::default();
    let Choices {
        decisions,
        legs,
        taken,
    } = &mut chosen;
    let mut free = rest_of(solver, node);
    free.subtract(&ended(solver, node));
    if free.is_empty() {
        return Ok(chosen);
    }
    let moves = moves_of(solver, node)?;
    let mut acting = Federation::empty(solver.graph.dimension());
    for index in solver.graph.edges_of(node) {
        let edge = solver.graph.edges[index];
        if edge.is_leg {
            continue;
        }
        if solver.seeker.owns(edge.controllable) {
            if solver.enabled(&edge).intersects(&free) {
                taken.push(index as u32);
            }
            continue;
        }
        let spoiling = solver.spoiling(&edge);
        let zones = spoiling.intersection(&free);
        if !zones.is_empty() {
            acting.unite(&zones);
            let action = Some(named(solver, &moves, &edge));
            decisions.push(new_decision(zones, action));
            taken.push(index as u32);
        }
    }
    if solver.seeker == Player::Environment {
        for entry in solver.graph.chances.of(node) {
            let spoiling = solver.spoiling_all(entry);
            let zones = spoiling.intersection(&free);
            if !zones.is_empty() {
                acting.unite(&zones);
                let first = &solver.graph.edges[entry[0] as usize];
                decisions.push(new_decision(zones, Some(named(solver, &moves, first))));
                taken.extend(entry);
            }
        }
    } else {
        let mut picked = |solver: &Solver<'_, '_, '_>, leg: u32| {
            solver.spoiling(&solver.graph.edges[leg as usize])
        };
        solver.pick_legs(node, (&free, 0), &mut picked, (legs, taken))?;
    }
    let mut waiting = match solver.seeker {
        Player::Controller => {
            free.subtract(&acting);
            free
        }
        Player::Environment => allowed_waiting(solver, node, (&free, &acting))?,
    };
    if !waiting.is_empty() {
        waiting.reduce();
        decisions.push(new_decision(waiting, None));
    }
    Ok(chosen)
}

pub(super) fn new_decision(zones: Federation, action: Option<Vec<Part>>) -> Decision {
    Decision {
        zones,
        action,
        rank: 0,
    }
}

/// The valuations of a node that the seeker does not win.
fn rest_of(solver: &Solver<'_, '_, '_>, node: u32) -> Federation {
    match solver.lost(node) {
        Win::Nothing => Federation::empty(solver.graph.dimension()),
        Win::Everything => whole_or_part(solver, node, None),
        Win::Part(rest) => rest,
    }
}

/// The valuations of a node in which play has ended without the seeker's having won.
fn ended(solver: &Solver<'_, '_, '_>, node: u32) -> Federation {
    match (solver.graph.nodes[node as usize].standing, solver.seeker) {
        (Standing::Goal, Player::Environment) | (Standing::Broken, Player::Controller) => {
            whole_or_part(solver, node, None)
        }
        (Standing::Mixed, Player::Environment) => solver.goal(node),
        (Standing::Mixed, Player::Controller) => solver.broken(node),
        _ => Federation::empty(solver.graph.dimension()),
    }
}

/// Where the controller may wait and stay safe. `free` is where it is safe and play goes on,
/// `acting` where it has a safe move.
fn allowed_waiting(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    (free, acting): (&Federation, &Federation),
) -> Result<Federation, Failure> {
    let situation = solver.situation(node)?;
    let standstill = solver.standstill(&situation);
    let mut at_rest = standstill.intersection(free);
    let forced = solver.forced_controller(node, &situation);
    at_rest.subtract(&forced);
    if !solver.graph.nodes[node as usize].delays {
        return Ok(at_rest);
    }
    let safe = rest_of(solver, node);
    let stopped = situation.stopped;
    let before = instants::before(&safe, &stopped);
    let mut waiting = before.intersection(free);
    // Where time can pass at all, and what it does not pass.
    let mut passing = safe.clone();
    let mut impassable = Federation::empty(safe.dimension());
    if let Some(urgent) = solver.graph.urgent(node) {
        let mut standstill = urgent.standstill();
        standstill.unite(&urgent.obliged);
        waiting.subtract(&standstill);
        passing.subtract(&standstill);
        impassable.unite(&urgent.stops());
    }
    // What is safe may end in a limit that is not itself safe. Before such an end, the last
    // valuations with a move must use it.
    let mut unsafe_ones = whole_or_part(solver, node, None);
    unsafe_ones.subtract(&safe);
    let after = instants::after(&passing, &stopped);
    let ends = unsafe_ones.intersection(&after);
    if !ends.is_empty() {
        let mut others = unsafe_ones.clone();
        others.unite(&impassable);
        others.subtract(&ends);
        let before = past::predecessors(&ends, &others, &stopped);
        let ending = before.intersection(&safe);
        let mut last = ending.intersection(acting);
        let mut later = ending;
        later.subtract(acting);
        let earlier = past::predecessors(&later, &unsafe_ones, &stopped);
        last.subtract(&earlier);
        waiting.subtract(&last);
    }
    waiting.unite(&at_rest);
    Ok(waiting)
}

/// Adds the states inside a chain, as far as the seeker does not win there.
pub(super) fn inner_states(
    solver: &mut Solver<'_, '_, '_>,
    edge: u32,
    source: &[i32],
    strategy: &mut Strategy,
) -> Result<(), Failure> {
    let edge = solver.graph.edges[edge as usize];
    let inside = walk(solver, &edge, source)?;
    let mut won = match &solver.win[edge.target as usize] {
        Win::Nothing => Federation::empty(solver.graph.dimension()),
        Win::Everything => whole_or_part(solver, edge.target, None),
        Win::Part(part) => part.clone(),
    };
    let mut states = Vec::new();
    for inner in inside.into_iter().rev() {
        inner.effect.preimage(&mut won);
        won.constrain_all(&inner.invariant);
        let is_own = !solver.seeker.owns(inner.controllable);
        let mut decisions = Vec::new();
        let acting = if is_own {
            spoiling(&inner, &won)
        } else {
            Federation::empty(won.dimension())
        };
        if inner.delays {
            won.down(&ClockSet::EMPTY);
            won.constrain_all(&inner.invariant);
        }
        let mut waiting = within_invariant(&inner, won.dimension());
        waiting.subtract(&won);
        waiting.subtract(&acting);
        if !acting.is_empty() {
            decisions.push(new_decision(acting, Some(inner.parts)));
        }
        if !waiting.is_empty() {
            decisions.push(new_decision(waiting, None));
        }
        states.push(StrategyState {
            words: inner.words,
            decisions,
            legs: Vec::new(),
            is_goal: false,
        });
    }
    strategy.states.extend(states.into_iter().rev());
    Ok(())
}

/// Where the move of a state inside a chain is possible, and leads to none of the valuations that
/// are won.
pub(super) fn spoiling(inner: &Inner, won: &Federation) -> Federation {
    let zone = Zone::of_constraints(won.dimension(), &inner.invariant);
    let mut acting = inner.effect.enabled_part(zone.bounds(), won.dimension());
    acting.subtract(won);
    acting
}

pub(super) fn within_invariant(inner: &Inner, dimension: usize) -> Federation {
    let zone = Zone::of_constraints(dimension, &inner.invariant);
    Federation::of_zone(dimension, zone.bounds())
}
