//! Plans: all sequences of moves that win, for games in which only the controller has a choice.
//!
//! A plan is a path of the game graph from the initial node to a goal on which every move is
//! winning. Zones are computed exactly, so a plan can be carried out, and no state occurs twice on
//! it. Plans come in the order of the moves of each state, which does not depend on the search.
//!
//! Cost: proportional to the nodes on winning paths. Plans are found one after the other, and are
//! never all in memory here.

use crate::cancellation;
use crate::network::{Failure, Moves, Part};
use crate::zones::Zone;
use crate::zones::federation::block_bytes;

use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Standing;
use crate::game::solver::Solver;

/// One transition of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlanStep {
    /// The edges that are taken.
    pub parts: Vec<Part>,
    /// Whether some process was in a committed location before it: such a step follows from the one
    /// before it.
    pub was_committed: bool,
}

/// A plan with the words that it ends in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The transitions, in order.
    pub steps: Vec<PlanStep>,
    /// The words at its end.
    pub end: Vec<i32>,
}

impl Plan {
    /// The bytes that it takes, including the value itself.
    pub fn heap_bytes(&self) -> usize {
        let parts = self.steps.iter().map(|step| size_of_val(&*step.parts));
        size_of::<Plan>()
            + block_bytes(size_of_val(&*self.steps))
            + block_bytes(size_of_val(&*self.end))
            + parts.map(block_bytes).sum::<usize>()
    }
}

/// Why there is no list of plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlans {
    /// The environment has a choice, so a strategy is no list of plans.
    EnvironmentChooses,
}

/// The work of following an edge, without its zones: see [`cancellation::work`].
const UNITS_FOR_STEP: usize = 256;

/// A node on the path that is being followed.
struct Level {
    node: u32,
    next: usize,
    zones: Vec<Zone>,
}

/// Enumerates the plans of a solved game.
pub struct Plans<'r, 'g, 's, 'a> {
    solver: &'r mut Solver<'g, 's, 'a>,
    path: Vec<Level>,
    edges: Vec<u32>,
    on_path: Vec<bool>,
}

impl<'r, 'g, 's, 'a> Plans<'r, 'g, 's, 'a> {
    /// The plans of a solved game.
    pub fn new(solver: &'r mut Solver<'g, 's, 'a>) -> Result<Plans<'r, 'g, 's, 'a>, NoPlans> {
        if (0..solver.graph.nodes.len() as u32).any(|node| has_opponent_choice(solver, node)) {
            return Err(NoPlans::EnvironmentChooses);
        }
        let dimension = solver.graph.dimension();
        let mut plans = Plans {
            on_path: vec![false; solver.graph.nodes.len()],
            path: Vec::new(),
            edges: Vec::new(),
            solver,
        };
        if !matches!(plans.solver.won.win[0], Win::Nothing) {
            let zones = plans.solver.graph.whole(0);
            let zones = zones.zones().map(|zone| Zone::from_bounds(dimension, zone));
            plans.enter(0, zones.collect());
        }
        Ok(plans)
    }

    fn enter(&mut self, node: u32, zones: Vec<Zone>) {
        self.on_path[node as usize] = true;
        self.path.push(Level {
            node,
            next: 0,
            zones,
        });
    }

    /// The next plan as edges of the graph; `None` after the last.
    pub fn next_path(&mut self) -> Option<&[u32]> {
        loop {
            let level = self.path.last_mut()?;
            let node = level.node;
            if level.next == 0 && self.solver.graph.nodes[node as usize].standing == Standing::Goal
            {
                level.next = usize::MAX;
                return Some(&self.edges);
            }
            let range = self.solver.graph.edges_of(node);
            if level.next == usize::MAX || range.start + level.next >= range.end {
                self.on_path[node as usize] = false;
                self.path.pop();
                self.edges.pop();
                continue;
            }
            let edge = range.start + level.next;
            level.next += 1;
            if let Some(zones) = self.follow(edge) {
                self.edges.push(edge as u32);
                let target = self.solver.graph.edges[edge].target;
                self.enter(target, zones);
            }
        }
    }

    /// The zones that an edge reaches from the last node of the path; `None` if a plan does not
    /// take it.
    fn follow(&mut self, edge: usize) -> Option<Vec<Zone>> {
        let graph = &*self.solver.graph;
        let edge = graph.edges[edge];
        if self.on_path[edge.target as usize]
            || matches!(self.solver.won.win[edge.target as usize], Win::Nothing)
        {
            return None;
        }
        let urgent = graph.urgent(edge.target);
        let delays = graph.nodes[edge.target as usize].delays && urgent.is_none();
        let level = self.path.last()?;
        let bounds = level.zones.len() * graph.dimension().pow(2);
        cancellation::work(UNITS_FOR_STEP + bounds);
        let images = level
            .zones
            .iter()
            .flat_map(|zone| graph.programs.image(edge.program, zone, delays));
        let mut zones: Vec<Zone> = images.collect();
        if let Some(urgent) = urgent {
            zones = urgent.later(&zones);
        }
        if zones
            .iter()
            .any(|zone| graph.symbolic.has_grown(zone.bounds()))
        {
            let graph = &mut *self.solver.graph;
            let mut words = graph.symbolic.stepper.network().initial.clone();
            graph.load(edge.target, &mut words);
            graph.symbolic.extrapolate_all(&words, &mut zones);
        }
        (!zones.is_empty()).then_some(zones)
    }

    /// The transitions of a path, and the words at its end.
    pub fn plan_of_path(&mut self, path: &[u32]) -> Result<Plan, Failure> {
        let graph = &mut *self.solver.graph;
        let symbolic = &mut *graph.symbolic;
        let mut words = symbolic.stepper.network().initial.clone();
        let mut moves = Moves::default();
        let mut steps = Vec::new();
        for &index in path {
            let edge = graph.edges[index as usize];
            for position in 0..edge.length {
                symbolic.remembered_moves(&mut words, &mut moves)?;
                let chosen = if position == 0 { edge.ordinal } else { 0 };
                let parts = moves.get(chosen as usize).parts.to_vec();
                let was_committed = symbolic.stepper.is_committed(&words);
                symbolic.stepper.fire(&parts, &mut words)?;
                steps.push(PlanStep {
                    parts,
                    was_committed,
                });
            }
        }
        Ok(Plan { steps, end: words })
    }
}

/// Whether the environment has another move besides this one, or may choose when to move.
fn has_opponent_choice(solver: &Solver<'_, '_, '_>, node: u32) -> bool {
    let range = solver.graph.edges_of(node);
    let count = range.len();
    let has_opponent = range
        .into_iter()
        .any(|edge| !solver.graph.edges[edge].controllable || solver.graph.edges[edge].is_leg);
    has_opponent && (count > 1 || solver.graph.nodes[node as usize].delays)
}
