//! Dead ends: states from which what is sought cannot come any more, as locations show.
//!
//! For each process it is known from which of its locations some edges, whatever their guards, lead
//! to one in which what is sought may be. In a state in which one process is in none of these the
//! seeker has lost, whoever moves. Nothing of the words but locations is looked at, nor clocks.

use crate::analysis::may_hold::Possibility;
use crate::ir::{LocationId, Network, Process, ProcessId};
use crate::network::Failure;
use crate::search::limits::{StopReason, Watch, states_between_looks};
use crate::zones::Zone;

use super::clock_programs::ProgramId;
use super::graph::{Edge, Graph, NONE, Objective, Origin, Standing};
use crate::game::backward::solver::Solver;

/// Expanded nodes between two looks at the limits, at most.
const BETWEEN_LOOKS: u64 = 64;

/// The locations from which nothing sought can come.
#[derive(Debug, Default)]
pub(super) struct DeadEnds {
    /// The processes that have such locations, and by location whether it is one.
    processes: Vec<(usize, Box<[bool]>)>,
    /// The node that stands for all of them, once there is one.
    node: Option<u32>,
}

impl DeadEnds {
    /// The dead ends of an objective: of the goal if the controller seeks it, else of breaking what
    /// must be kept.
    pub(super) fn new(network: &Network, objective: &Objective<'_>) -> DeadEnds {
        let (sought, truth) = match (objective.goal, objective.keep) {
            (Some(goal), _) if objective.must_progress => (goal, true),
            (_, Some(keep)) if !objective.must_progress => (keep, false),
            _ => return DeadEnds::default(),
        };
        let mut possibility = Possibility::new(network);
        let mut processes = Vec::new();
        for (index, process) in network.processes.iter().enumerate() {
            let locations = 0..process.locations.len() as u32;
            let has_it = locations.map(|location| {
                let at = (ProcessId(index as u32), LocationId(location));
                possibility.can_be(truth, sought, at)
            });
            let is_dead = cannot_reach(process, has_it.collect());
            if is_dead.contains(&true) {
                processes.push((index, is_dead));
            }
        }
        DeadEnds {
            processes,
            node: None,
        }
    }

    /// Whether a state is one.
    pub(super) fn contain(&self, words: &[i32]) -> bool {
        self.processes
            .iter()
            .any(|(process, is_dead)| is_dead[words[*process] as usize])
    }
}

/// The locations of a process from which no edges lead to one of these.
fn cannot_reach(process: &Process, mut reaches: Box<[bool]>) -> Box<[bool]> {
    let mut has_grown = reaches.contains(&true);
    while std::mem::take(&mut has_grown) {
        for edge in &process.edges {
            let mut targets = edge.branches.iter().map(|branch| branch.target.0 as usize);
            let source = edge.source.0 as usize;
            if !reaches[source] && targets.any(|target| reaches[target]) {
                reaches[source] = true;
                has_grown = true;
            }
        }
    }
    for location in &mut reaches {
        *location = !*location;
    }
    reaches
}

impl Graph<'_, '_> {
    /// Adds an edge of `length` moves to the node of all dead ends.
    pub(super) fn end_dead(
        &mut self,
        words: &[i32],
        program: ProgramId,
        origin: Origin,
        length: u32,
    ) {
        let node = self.dead_ends.node.unwrap_or_else(|| {
            let zone = Zone::universe(self.dimension());
            let id = self.zones.intern(zone.bounds());
            let discrete = self.discrete_of(words);
            self.push_node(discrete, id, Standing::Dead)
        });
        self.dead_ends.node = Some(node);
        self.link(origin, node, program, (length, false));
    }

    /// Takes back that dead ends are left out: expands the nodes anew that lead to one.
    fn go_on_in_dead_ends(&mut self) -> Result<(), Failure> {
        let DeadEnds { node, .. } = std::mem::take(&mut self.dead_ends);
        let mut edge = node.map_or(NONE, |node| self.nodes[node as usize].first_in);
        let mut last = NONE;
        while edge != NONE {
            let Edge {
                source, next_in, ..
            } = self.edges[edge as usize];
            // The edges of a node into the same target stand together.
            if source != last {
                self.expand(source)?;
            }
            last = source;
            edge = next_in;
        }
        if self.nodes[0].standing == Standing::Dead {
            self.judge_anew(0)?;
            self.expand(0)?;
        }
        Ok(())
    }
}

impl Solver<'_, '_, '_> {
    /// Explores what follows after dead ends if the evader has won: its strategy says what to do
    /// there too.
    ///
    /// # Errors
    /// The model fails in a state that follows.
    pub fn explore_dead_ends(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        if self.is_won() {
            return Ok(None);
        }
        // What follows after a dead end is a dead end, so all of it is made now.
        let mut next = self.graph.nodes.len();
        let look_every = states_between_looks(BETWEEN_LOOKS, self.graph.dimension()) as usize;
        self.graph.go_on_in_dead_ends()?;
        self.adopt_new_nodes();
        while let Some(node) = self.graph.nodes.get(next) {
            if !node.is_expanded && !self.is_decided(next as u32) {
                self.graph.expand(next as u32)?;
                self.adopt_new_nodes();
            }
            next += 1;
            if next.is_multiple_of(look_every)
                && let Some(reason) = self.look(watch)
            {
                return Ok(Some(reason));
            }
        }
        Ok(None)
    }
}
