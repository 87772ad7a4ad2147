//! Which edges may be taken again and again while time stands still.
//!
//! In a run without end in which no time passes, consider the edges that are taken infinitely
//! often. Those of each process lie on cycles of such edges; a synchronisation among them has a
//! partner among them; and an edge that sleeps where a clock is low ([`super::dependence`]) is not
//! among them if each of its cycles sets that clock, for nothing could raise it again. What breaks
//! one of these rules does not recur, and then neither does what relied on it.

use crate::ir::{Edge, LocationId, Network, Process};

use super::dependence::sleeper;

/// The edges of a process with more count as recurrent.
const MOST_EDGES: usize = 512;

/// Which processes take part in something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Who {
    Nobody,
    Only(usize),
    Several,
}

impl Who {
    fn add(&mut self, process: usize) {
        *self = match *self {
            Who::Nobody => Who::Only(process),
            Who::Only(other) if other == process => *self,
            _ => Who::Several,
        };
    }

    fn is_other_than(self, process: usize) -> bool {
        self == Who::Several || matches!(self, Who::Only(other) if other != process)
    }
}

/// By process and edge: whether it may be taken infinitely often while time stands still.
/// `greatest`: the values that clocks are set to, at most.
pub(crate) fn recurrent_edges(network: &Network, greatest: &[i32]) -> Vec<Vec<bool>> {
    let processes = network.processes.iter();
    let mut recurrent: Vec<Vec<bool>> = processes
        .map(|process| vec![true; process.edges.len()])
        .collect();
    loop {
        let (senders, receivers) = partners(network, &recurrent);
        let has_partner = |process: usize, edge: &Edge| {
            edge.sync.is_none_or(|sync| {
                let is_broadcast = network.channels[sync.channel.0 as usize].broadcast;
                let partners = if sync.send { &receivers } else { &senders };
                let is_other = |channel: u32| partners[channel as usize].is_other_than(process);
                sync.send && is_broadcast || sync.channels().any(is_other)
            })
        };
        let mut changed = false;
        for (index, process) in network.processes.iter().enumerate() {
            for edge in 0..process.edges.len() {
                let stays = recurrent[index][edge]
                    && has_partner(index, &process.edges[edge])
                    && (process.edges.len() > MOST_EDGES
                        || is_on_cycle(process, edge, &recurrent[index], greatest));
                changed |= recurrent[index][edge] && !stays;
                recurrent[index][edge] = stays;
            }
        }
        if !changed {
            return recurrent;
        }
    }
}

/// For each channel: the processes that send and receive on it with edges that may recur.
fn partners(network: &Network, recurrent: &[Vec<bool>]) -> (Vec<Who>, Vec<Who>) {
    let mut senders = vec![Who::Nobody; network.channels.len()];
    let mut receivers = senders.clone();
    for (index, process) in network.processes.iter().enumerate() {
        for (edge, &recurs) in process.edges.iter().zip(&recurrent[index]) {
            if let Some(sync) = edge.sync.filter(|_| recurs) {
                let side = if sync.send {
                    &mut senders
                } else {
                    &mut receivers
                };
                for channel in sync.channels() {
                    side[channel as usize].add(index);
                }
            }
        }
    }
    (senders, receivers)
}

/// Whether the edge lies on a cycle of recurrent edges, none of which sets a clock that lets it
/// sleep.
fn is_on_cycle(process: &Process, edge: usize, recurrent: &[bool], greatest: &[i32]) -> bool {
    let own = &process.edges[edge];
    let clock = sleeper(own, greatest).map(|one| one.right);
    let is_usable = |edge: &Edge| clock.is_none_or(|clock| !sets(edge, clock));
    if !is_usable(own) {
        return false;
    }
    let targets = |edge: &Edge| -> Vec<LocationId> {
        edge.branches.iter().map(|branch| branch.target).collect()
    };
    let mut is_met = vec![false; process.locations.len()];
    let mut open = targets(own);
    while let Some(location) = open.pop() {
        if location == own.source {
            return true;
        }
        if std::mem::replace(&mut is_met[location.0 as usize], true) {
            continue;
        }
        for edge in &process.locations[location.0 as usize].edges {
            let index = edge.0 as usize;
            if recurrent[index] && is_usable(&process.edges[index]) {
                open.extend(targets(&process.edges[index]));
            }
        }
    }
    false
}

/// Whether taking the edge always sets the clock to a constant.
fn sets(edge: &Edge, clock: usize) -> bool {
    let is_it = |&(one, _): &(crate::ir::ClockId, i32)| one.0 as usize == clock;
    edge.update.fixed.iter().any(is_it)
        || edge
            .branches
            .iter()
            .all(|branch| branch.update.fixed.iter().any(is_it))
}
