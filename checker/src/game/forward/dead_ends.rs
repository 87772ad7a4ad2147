//! Dead ends: states from which what is sought cannot come any more, as locations show.
//!
//! For each process it is known from which of its locations some edges, whatever their guards, lead
//! to one in which what is sought may be. In a state in which one process is in none of these the
//! seeker has lost, whoever moves. Nothing of the words but locations is looked at, nor clocks.

use crate::analysis::may_hold::Possibility;
use crate::ir::{LocationId, Network, Process, ProcessId};

use super::objective::Objective;

/// The locations from which nothing sought can come.
#[derive(Debug, Default)]
pub(super) struct DeadEnds {
    /// The processes that have such locations, and by location whether it is one.
    processes: Vec<(usize, Box<[bool]>)>,
    /// The node that stands for all of them, once there is one.
    pub(super) node: Option<u32>,
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
