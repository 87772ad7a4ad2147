//! Dead ends: states from which the target cannot be reached any more, as locations show.
//!
//! For each process, this finds the locations from which some edges, whatever their guards, lead to
//! a location that may satisfy the target of the seeker. If one process of a state is in no such
//! location, the seeker has lost, whoever moves. This uses only locations, neither other words nor
//! clocks.

use crate::analysis::may_hold::Possibility;
use crate::ir::{LocationId, Network, Process, ProcessId};

use super::objective::Objective;

/// The locations from which the target cannot be reached.
#[derive(Debug, Default)]
pub(super) struct DeadEnds {
    /// The processes that have such locations; for each location, whether it is one.
    processes: Vec<(usize, Box<[bool]>)>,
    /// The node that stands for all of them, once it exists.
    pub(super) node: Option<u32>,
}

impl DeadEnds {
    /// The dead ends of an objective. Its target is the goal if the controller seeks it; otherwise
    /// it is a state in which what must be kept is broken.
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
                let process = ProcessId(index as u32);
                possibility.can_be(truth, sought, process, LocationId(location))
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
