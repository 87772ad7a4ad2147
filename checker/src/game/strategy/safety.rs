//! How to stay where the other player, the seeker, does not win.
//!
//! Outside of what the seeker wins, the evader always has a way to stay outside: a move, or a wait.
//! The environment moves where it can, since the controller might escape later. The controller
//! allows everything that stays outside.

use crate::network::Failure;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, ClockSet, Federation, instants, past};

use super::chains::Inner;
use super::extraction::{Choices, Chooser, moves_of, named};
use super::{Decision, decide};
use crate::game::Player;
use crate::game::forward::node::{Edge, Standing};
use crate::game::solver::Solver;

/// How the evader chooses.
pub(super) struct Evading;

impl Chooser for Evading {
    fn choices(&self, solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
        let mut chosen = Choices::default();
        let mut free = solver
            .federation_of(node, &solver.won.lost(node))
            .minus(&ended(solver, node));
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
                    chosen.taken.push(index as u32);
                }
                continue;
            }
            let zones = solver.spoiling(&edge).intersection(&free);
            if !zones.is_empty() {
                acting.unite(&zones);
                let action = Some(named(solver, &moves, &edge));
                decide(&mut chosen.decisions, zones, action, 0);
                chosen.taken.push(index as u32);
            }
        }
        if solver.seeker == Player::Environment {
            for entry in solver.graph.branch_points.of(node) {
                let zones = solver.spoiling_all(entry).intersection(&free);
                if !zones.is_empty() {
                    acting.unite(&zones);
                    let first = &solver.graph.edges[entry[0] as usize];
                    let action = Some(named(solver, &moves, first));
                    decide(&mut chosen.decisions, zones, action, 0);
                    chosen.taken.extend(entry);
                }
            }
        } else {
            let mut picked = |solver: &Solver<'_, '_, '_>, leg: u32| {
                solver.spoiling(&solver.graph.edges[leg as usize])
            };
            chosen.pick(0, solver.picks(node, &free, &mut picked)?);
        }
        let mut waiting = match solver.seeker {
            Player::Controller => {
                free.subtract(&acting);
                free
            }
            Player::Environment => {
                let safe = solver.federation_of(node, &solver.won.lost(node));
                allowed_waiting(solver, node, &safe, &free, &acting)?
            }
        };
        waiting.reduce();
        decide(&mut chosen.decisions, waiting, None, 0);
        Ok(chosen)
    }

    /// What the evader does in those states inside a chain in which the seeker does not win.
    fn inside(
        &self,
        solver: &Solver<'_, '_, '_>,
        edge: &Edge,
        inside: &[Inner],
    ) -> Vec<Vec<Decision>> {
        let mut won = solver.federation_of(edge.target, &solver.won.win[edge.target as usize]);
        let mut all: Vec<Vec<Decision>> = vec![Vec::new(); inside.len()];
        for (inner, decisions) in inside.iter().zip(&mut all).rev() {
            let (acting, mut waiting) =
                inner.evaded(&mut won, !solver.seeker.owns(inner.controllable));
            waiting.subtract(&acting);
            decide(decisions, acting, Some(inner.parts.clone()), 0);
            decide(decisions, waiting, None, 0);
        }
        all
    }
}

/// The valuations of a node in which play has ended and the seeker has not won.
fn ended(solver: &Solver<'_, '_, '_>, node: u32) -> Federation {
    match (solver.graph.nodes[node as usize].standing, solver.seeker) {
        (Standing::Goal, Player::Environment) | (Standing::Broken, Player::Controller) => {
            solver.whole(node)
        }
        (Standing::Mixed, Player::Environment) => solver.goal(node),
        (Standing::Mixed, Player::Controller) => solver.broken(node),
        _ => Federation::empty(solver.graph.dimension()),
    }
}

/// Where the controller may wait and stay safe. `free` is where it is safe and play continues,
/// `acting` where it has a safe move.
pub(super) fn allowed_waiting(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
    safe: &Federation,
    free: &Federation,
    acting: &Federation,
) -> Result<Federation, Failure> {
    let situation = solver.situation(node)?;
    let standstill = solver.standstill(&situation);
    let mut at_rest = standstill.intersection(free);
    let forced = solver.forced_controller(node, &situation);
    at_rest.subtract(&forced);
    if !solver.graph.nodes[node as usize].delays {
        return Ok(at_rest);
    }
    let stopped = situation.stopped;
    let before = instants::before(safe, &stopped);
    let mut waiting = before.intersection(free);
    // Where time can pass at all, and where it must stop.
    let mut passing = safe.clone();
    let mut impassable = Federation::empty(safe.dimension());
    if let Some(urgent) = solver.graph.urgent(node) {
        let mut standstill = urgent.standstill();
        standstill.unite(&urgent.obliged);
        waiting.subtract(&standstill);
        passing.subtract(&standstill);
        impassable.unite(&urgent.stops());
    }
    // The safe valuations may end in a limit that is not itself safe. Before such an end, the last
    // valuations with a move must use it.
    let unsafe_ones = solver.whole(node).minus(safe);
    let after = instants::after(&passing, &stopped);
    let ends = unsafe_ones.intersection(&after);
    if !ends.is_empty() {
        let mut others = unsafe_ones.clone();
        others.unite(&impassable);
        others.subtract(&ends);
        let ending = shortly_before(&ends, &others, &stopped).intersection(safe);
        let mut last = ending.intersection(acting);
        let later = ending.minus(acting);
        let earlier = past::predecessors(&later, &unsafe_ones, &stopped);
        last.subtract(&earlier);
        // It may wait at the first moment of the stretch: there is time left.
        let last = last.intersection(&instants::after(&last, &stopped));
        waiting.subtract(&last);
    }
    waiting.unite(&at_rest);
    Ok(waiting)
}

/// The valuations from which time leads to one of these `ends` without meeting `others`, and in
/// less than a unit. Each end is where some running clock shows a certain value.
fn shortly_before(ends: &Federation, others: &Federation, stopped: &ClockSet) -> Federation {
    let dimension = ends.dimension();
    let mut before = Federation::empty(dimension);
    for zone in ends.zones() {
        let end = Federation::of_zone(dimension, zone);
        let mut leading = past::predecessors(&end, others, stopped);
        let mut running = (1..dimension).filter(|&clock| !stopped.contains(clock));
        let at_value = running.find_map(|clock| {
            let (upper, lower) = (zone[clock * dimension], zone[clock]);
            let is_one = upper.is_finite() && upper.value() == -lower.value();
            is_one.then_some((clock, upper.value()))
        });
        if let Some((clock, value)) = at_value
            && let Some(bound) = Bound::strict(1 - value)
        {
            leading.constrain_all(&[Constraint {
                left: 0,
                right: clock,
                bound,
            }]);
        }
        before.unite(&leading);
    }
    before
}
