//! What all nodes of a graph win, computed in sweeps: the graph is explored first, and then the
//! nodes are computed from the target back to the start.
//!
//! A node is on a higher *level* than those of its successors that do not lead back to it. The
//! waiting nodes on the lowest level are computed first, so that each sees at once everything that
//! its successors win. If no play comes to a node twice, each node is computed once. A solver that
//! alternates between forward and backward steps may end before it has seen everything; if
//! everything is wanted anyway, it computes most nodes several times.
//!
//! Source of the levels: R. Tarjan, "Depth-First Search and Linear Graph Algorithms", SIAM Journal
//! on Computing, 1972.

use std::collections::VecDeque;

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch, states_between_checks};

use crate::game::backward::account::LOOK_EVERY;
use crate::game::backward::propagation::MOST_TASKS;
use crate::game::forward::graph::Graph;
use crate::game::forward::node::NONE;
use crate::game::solver::Solver;
use crate::game::{Extent, Solution};

/// Batches of nodes between two checks of the limits.
const BATCHES_BETWEEN_LOOKS: u32 = 16;

/// The nodes that must be computed, by level.
struct Sweep {
    levels: Vec<u32>,
    waiting: Vec<VecDeque<u32>>,
    is_waiting: Vec<bool>,
    /// No node waits below this level.
    lowest: usize,
}

impl Sweep {
    fn new(graph: &Graph<'_, '_>) -> Sweep {
        let levels = levels(graph);
        let count = levels.iter().max().map_or(0, |&level| level as usize + 1);
        Sweep {
            waiting: vec![VecDeque::new(); count],
            is_waiting: vec![false; levels.len()],
            lowest: count,
            levels,
        }
    }

    fn add(&mut self, node: u32) {
        if !std::mem::replace(&mut self.is_waiting[node as usize], true) {
            let level = self.levels[node as usize] as usize;
            self.waiting[level].push_back(node);
            self.lowest = self.lowest.min(level);
        }
    }

    /// Some nodes of the lowest level on which a node waits; none if no node waits.
    fn next_batch(&mut self) -> Vec<u32> {
        while let Some(waiting) = self.waiting.get_mut(self.lowest) {
            if !waiting.is_empty() {
                let count = waiting.len().min(MOST_TASKS);
                let batch: Vec<u32> = waiting.drain(..count).collect();
                for &node in &batch {
                    self.is_waiting[node as usize] = false;
                }
                return batch;
            }
            self.lowest += 1;
        }
        Vec::new()
    }
}

impl Solver<'_, '_, '_> {
    /// Solves the game for all nodes that can be reached.
    ///
    /// # Errors
    /// The model fails in one of their states.
    pub fn solve_backward(&mut self, watch: &mut dyn Watch) -> Result<Solution, Failure> {
        if !self.graph.symbolic.tuning().full_backward {
            return self.solve(Extent::Everything, watch);
        }
        if let Some(reason) = self.explore(watch)? {
            return Ok(Solution::Stopped(reason));
        }
        if let Some(reason) = self.sweep(watch)? {
            return Ok(Solution::Stopped(reason));
        }
        Ok(Solution::Won(self.winner()))
    }

    /// Expands all nodes that can be reached, without computing what they win.
    pub(in crate::game) fn explore(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        let look_every = states_between_checks(LOOK_EVERY, self.graph.dimension());
        let mut next_look = look_every;
        let tuning = self.graph.symbolic.tuning();
        while let Some(node) = self.exploration.waiting.next(&self.graph.nodes, tuning) {
            if self.graph.nodes[node as usize].is_expanded {
                continue;
            }
            self.expand(node)?;
            if self.is_crowded() {
                self.stops.has_given_up = true;
                return Ok(Some(StopReason::States));
            }
            if self.graph.explored >= next_look {
                next_look = self.graph.explored + look_every;
                if let Some(reason) = self.look(watch) {
                    return Ok(Some(reason));
                }
            }
        }
        Ok(None)
    }

    /// Computes what explored nodes win until nothing grows.
    pub(in crate::game) fn sweep(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        let mut sweep = Sweep::new(self.graph);
        let mut until_look = BATCHES_BETWEEN_LOOKS;
        loop {
            for node in self.agenda.take_updates() {
                sweep.add(node);
            }
            let batch = sweep.next_batch();
            if batch.is_empty() {
                self.graph.symbolic.check_differences()?;
                return Ok(None);
            }
            let mut tasks = Vec::new();
            for node in batch {
                if !self.may_gain(node) {
                    continue;
                }
                match self.quick(node) {
                    Some(true) => self.gain_everything(node),
                    Some(false) => {}
                    None => tasks.push(self.task_of(node)?),
                }
            }
            if let Some(reason) = self.compute(tasks, watch) {
                return Ok(Some(reason));
            }
            until_look -= 1;
            if until_look == 0 {
                until_look = BATCHES_BETWEEN_LOOKS;
                let reason = self.look(watch);
                if reason.is_some() {
                    return Ok(reason);
                }
            }
        }
    }
}

/// The level of each node: 0 if its edges lead only to itself.
fn levels(graph: &Graph<'_, '_>) -> Vec<u32> {
    let count = graph.nodes.len();
    let mut levels = vec![NONE; count];
    // The order in which nodes are found, and for each node the first one in this order to which it
    // is known to lead back.
    let mut order = vec![NONE; count];
    let mut first = vec![NONE; count];
    let mut met = 0;
    let mut open = Vec::new();
    let mut path: Vec<(u32, usize)> = Vec::new();
    for root in 0..count as u32 {
        if order[root as usize] != NONE {
            continue;
        }
        path.push((root, graph.edges_of(root).start));
        while let Some((node, next)) = path.last_mut() {
            let index = *node as usize;
            if order[index] == NONE {
                order[index] = met;
                first[index] = met;
                met += 1;
                open.push(*node);
            }
            if *next < graph.edges_of(*node).end {
                let target = graph.edges[*next].target;
                *next += 1;
                if order[target as usize] == NONE {
                    path.push((target, graph.edges_of(target).start));
                } else if levels[target as usize] == NONE {
                    first[index] = first[index].min(order[target as usize]);
                }
                continue;
            }
            path.pop();
            if first[index] == order[index] {
                let start = open.iter().rposition(|&one| one as usize == index);
                let members = open.split_off(start.unwrap_or(0));
                let edges = members.iter().flat_map(|&one| graph.edges_of(one));
                let below = edges.map(|edge| levels[graph.edges[edge].target as usize]);
                let level = below.filter(|&level| level != NONE).max();
                for &one in &members {
                    levels[one as usize] = level.map_or(0, |level| level + 1);
                }
            }
            if let Some((before, _)) = path.last() {
                let before = *before as usize;
                first[before] = first[before].min(first[index]);
            }
        }
    }
    levels
}
