//! Plans: all sequences of moves that win, for games in which only the controller has a choice.
//!
//! A plan is a path of the game graph from the initial node to a goal on which every move is
//! winning. Zones are computed exactly, so a plan can be carried out, and no state occurs twice on
//! it. Plans come in the order of the moves of each state, which does not depend on the search.
//!
//! Cost: proportional to the nodes on winning paths. Plans are found one after the other, and are
//! never all in memory here. [`super::plan_list`] makes a list of them.

use crate::cancellation;
use crate::zones::Zone;

use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Standing;
use crate::game::solver::Solver;

/// Why there is no list of plans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoPlans {
    /// The environment has a choice, so a strategy is no list of plans.
    EnvironmentChooses,
}

/// The work of following an edge, without its zones: see [`cancellation::work`].
pub(super) const UNITS_FOR_STEP: usize = 256;

/// A node on the path that is being followed.
struct Level {
    node: u32,
    next: usize,
    zones: Vec<Zone>,
}

/// Enumerates the plans of a solved game.
pub struct Plans<'r, 'g, 's, 'a> {
    pub(super) solver: &'r mut Solver<'g, 's, 'a>,
    path: Vec<Level>,
    edges: Vec<u32>,
    on_path: Vec<bool>,
}

impl<'r, 'g, 's, 'a> Plans<'r, 'g, 's, 'a> {
    /// The plans of a solved game in which the environment has no choice.
    pub fn new(solver: &'r mut Solver<'g, 's, 'a>) -> Plans<'r, 'g, 's, 'a> {
        let mut plans = Plans {
            on_path: vec![false; solver.graph.nodes.len()],
            path: Vec::new(),
            edges: Vec::new(),
            solver,
        };
        if !matches!(plans.solver.won.win[0], Win::Nothing) {
            let zones = plans.solver.graph.whole(0).to_zones().collect();
            plans.enter(0, zones);
        }
        plans
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
            let words = graph.words_of(edge.target);
            graph.symbolic.extrapolate_all(&words, &mut zones);
        }
        (!zones.is_empty()).then_some(zones)
    }
}
