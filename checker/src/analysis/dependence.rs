//! What the edges of a network read and write, whom they may synchronise with, and so which
//! processes may get in each other's way.
//!
//! The footprint of an edge has the cells ([`super::cells`]) that decide whether its moves are
//! possible and what they do (those that its guard, channel and updates read, and the invariants of
//! the locations that it leaves and enters), and the cells that they change. Footprints are never
//! too small, and may be too large.
//!
//! Two footprints of each location count: *now*, of the edges that leave it, and *future*, of all
//! edges that the process may take from there on while time stands still. While a process stays in
//! a committed location, a move needs another committed process, so that processes elsewhere take
//! no internal edges; this makes two of each ([`Still`]).
//!
//! An edge that needs more of a clock than any assignment gives it *sleeps* where the clock is
//! lower: only time could wake it.

use std::ops::Range;

use crate::ir::{AssignedValue, ClockRange, Edge, LocationId, Network, ProcessId, Urgency};
use crate::zones::Bound;
use crate::zones::dbm::Constraint;

use super::cells::{CellNumbers, Cells};
use super::visibility::Watched;

/// Why time stands still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Still {
    /// A process stays in an urgent location, and no location is committed.
    Urgent,
    /// A process stays in a committed location.
    Committed,
}

/// An edge's part in synchronisations.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Synchronisation {
    channels: Range<u32>,
    sends: bool,
    is_broadcast: bool,
    /// Whether it leaves a committed location.
    is_committed: bool,
}

impl Synchronisation {
    /// Whether one may synchronise with the other, where a move must leave a committed location if
    /// `still` says so.
    fn fits(&self, other: &Synchronisation, still: Still) -> bool {
        self.sends != other.sends
            && self.channels.start < other.channels.end
            && other.channels.start < self.channels.end
            && (still == Still::Urgent
                || self.is_broadcast
                || self.is_committed
                || other.is_committed)
    }
}

/// A constraint that an assignment never makes true: the edge that needs it sleeps while it does
/// not hold.
pub(crate) type Sleeper = Constraint;

/// What some edges of one process do.
#[derive(Clone, Debug, Default)]
pub(crate) struct Footprint {
    reads: Cells,
    writes: Cells,
    synchronisations: Vec<Synchronisation>,
    /// Constraints that keep edges asleep as long as they do not hold: one for each edge that may
    /// sleep.
    pub(crate) sleepers: Vec<Sleeper>,
    /// Whether one of them may make what is watched come true,
    pub(crate) may_fulfil: bool,
    /// and whether one may make it false again.
    pub(crate) may_spoil: bool,
}

impl Footprint {
    fn add(&mut self, other: &Footprint) {
        self.reads.extend(&other.reads);
        self.writes.extend(&other.writes);
        for one in &other.synchronisations {
            if !self.synchronisations.contains(one) {
                self.synchronisations.push(one.clone());
            }
        }
        self.sleepers.extend_from_slice(&other.sleepers);
        self.may_fulfil |= other.may_fulfil;
        self.may_spoil |= other.may_spoil;
    }

    fn settle(&mut self) {
        self.reads.settle();
        self.writes.settle();
    }

    /// Whether edges of two processes may depend on each other, or take part in the same move.
    pub(crate) fn meets(&self, other: &Footprint, still: Still) -> bool {
        self.writes.meet(&other.reads)
            || self.reads.meet(&other.writes)
            || self.writes.meet(&other.writes)
            || self.synchronisations.iter().any(|one| {
                let others = &mut other.synchronisations.iter();
                others.any(|other| one.fits(other, still))
            })
    }
}

/// What footprints are taken of, what is watched, and the greatest values that clocks are set to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ground<'n> {
    pub(crate) network: &'n Network,
    pub(crate) watched: &'n Watched,
    pub(crate) greatest: &'n [i32],
    /// Why time stands still.
    pub(crate) still: Still,
}

/// Where a process begins when a footprint is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Start {
    pub(crate) process: usize,
    pub(crate) location: LocationId,
    /// Whether all edges that may sleep do.
    pub(crate) is_asleep: bool,
}

/// By clock: the greatest value that an assignment gives it, or that it could get from another one.
pub(crate) fn greatest_values(network: &Network) -> Vec<i32> {
    let mut greatest = vec![0; network.clocks.len()];
    for assignment in network.updates().flat_map(|update| &update.assignments) {
        let value = match assignment.value {
            AssignedValue::Integer(_, high) => high,
            AssignedValue::Clock(..) => i32::MAX,
        };
        let ClockRange { first, count } = assignment.target;
        for clock in &mut greatest[first.0 as usize..(first.0 + count) as usize] {
            *clock = value.max(*clock);
        }
    }
    greatest
}

/// The footprints of single edges, taken when they are asked for.
#[derive(Debug, Default)]
pub(crate) struct Footprints {
    /// By process and edge.
    edges: Vec<Vec<Option<Box<Footprint>>>>,
}

impl Footprints {
    /// That of the edges that leave a location, and of what the process hears once it has taken
    /// one: a broadcast that left it behind would take it along then.
    pub(crate) fn now(&mut self, ground: Ground<'_>, start: Start) -> Footprint {
        let mut all = Footprint::default();
        let leaving = self.add_leaving(ground, start, &mut all);
        for branch in leaving.iter().flat_map(|edge| &edge.branches) {
            let definition = &ground.network.processes[start.process];
            for &index in &definition.locations[branch.target.0 as usize].edges {
                let there = self.edge(ground, start.process, index.0 as usize);
                let there = there.synchronisations.iter();
                let heard = there.filter(|one| one.is_broadcast && !one.sends);
                all.synchronisations.extend(heard.cloned());
            }
        }
        all.settle();
        all
    }

    /// That of all edges that the process may take from a location on while time stands still.
    pub(crate) fn future(&mut self, ground: Ground<'_>, start: Start) -> Footprint {
        let definition = &ground.network.processes[start.process];
        let mut all = Footprint::default();
        let mut is_met = vec![false; definition.locations.len()];
        is_met[start.location.0 as usize] = true;
        let mut open = vec![start.location];
        while let Some(location) = open.pop() {
            let from = Start { location, ..start };
            for edge in self.add_leaving(ground, from, &mut all) {
                for branch in &edge.branches {
                    if !std::mem::replace(&mut is_met[branch.target.0 as usize], true) {
                        open.push(branch.target);
                    }
                }
            }
            // Cells that come again and again are kept once.
            all.settle();
        }
        all
    }

    /// Adds the invariant of a location and the edges that leave it, which are returned.
    fn add_leaving<'n>(
        &mut self,
        ground: Ground<'n>,
        Start {
            process,
            location,
            is_asleep,
        }: Start,
        all: &mut Footprint,
    ) -> Vec<&'n Edge> {
        let still = ground.still;
        let definition = &ground.network.processes[process];
        let numbers = CellNumbers::new(ground.network);
        numbers.add_invariant(process, location, &mut all.reads);
        let location = &definition.locations[location.0 as usize];
        let stays_put = still == Still::Committed && location.urgency != Urgency::Committed;
        let mut leaving = Vec::new();
        for &index in &location.edges {
            let edge = &definition.edges[index.0 as usize];
            let footprint = self.edge(ground, process, index.0 as usize);
            let sleeps = is_asleep && !footprint.sleepers.is_empty();
            if sleeps || stays_put && edge.sync.is_none() {
                continue;
            }
            leaving.push(edge);
            all.add(footprint);
            if still == Still::Urgent {
                numbers.add_commitment(&mut all.reads);
                let enters_committed = edge.branches.iter().any(|branch| {
                    let target = &definition.locations[branch.target.0 as usize];
                    target.urgency == Urgency::Committed
                });
                if enters_committed {
                    numbers.add_commitment(&mut all.writes);
                }
            }
        }
        leaving
    }

    fn edge(&mut self, ground: Ground<'_>, process: usize, index: usize) -> &Footprint {
        if self.edges.is_empty() {
            let processes = ground.network.processes.iter();
            self.edges = processes
                .map(|process| vec![None; process.edges.len()])
                .collect();
        }
        self.edges[process][index].get_or_insert_with(|| Box::new(of_edge(ground, process, index)))
    }
}

fn of_edge(
    Ground {
        network,
        watched,
        greatest,
        ..
    }: Ground<'_>,
    process: usize,
    index: usize,
) -> Footprint {
    let definition = &network.processes[process];
    let edge = &definition.edges[index];
    let numbers = CellNumbers::new(network);
    let mut footprint = Footprint::default();
    let Footprint { reads, writes, .. } = &mut footprint;
    let functions = [edge.guard.function, edge.sync.and_then(|sync| sync.index)];
    numbers.add_reads(functions.into_iter().flatten(), reads);
    for atom in &edge.guard.atoms {
        numbers.add_clocks(atom.left, reads);
        numbers.add_clocks(atom.right, reads);
    }
    let branches = edge.branches.iter().map(|branch| &branch.update);
    for update in std::iter::once(&edge.update).chain(branches) {
        numbers.add_reads(update.function, reads);
        for &(first, count) in &update.writes {
            writes.add(first, count);
        }
        for assignment in &update.assignments {
            numbers.add_clocks(assignment.target, writes);
            if let AssignedValue::Clock(source, ..) = assignment.value {
                numbers.add_clocks(source, reads);
            }
        }
    }
    for branch in &edge.branches {
        numbers.add_invariant(process, branch.target, reads);
        if branch.target != edge.source {
            // Only what is watched reads the location of another process.
            writes.add(process as u32, 1);
        }
    }
    footprint.settle();
    let owner = ProcessId(process as u32);
    let targets = || edge.branches.iter().map(|branch| branch.target);
    let touches = watched.reads(&footprint.writes);
    footprint.may_fulfil =
        touches || targets().any(|target| watched.may_be_fulfilled(owner, edge.source, target));
    footprint.may_spoil =
        touches || targets().any(|target| watched.may_be_fulfilled(owner, target, edge.source));
    footprint.sleepers.extend(sleeper(edge, greatest));
    let location = &definition.locations[edge.source.0 as usize];
    let synchronisation = edge.sync.map(|sync| Synchronisation {
        channels: sync.channels(),
        sends: sync.send,
        is_broadcast: network.channels[sync.channel.0 as usize].broadcast,
        is_committed: location.urgency == Urgency::Committed,
    });
    footprint.synchronisations.extend(synchronisation);
    footprint
}

/// What keeps an edge asleep, if anything does.
pub(super) fn sleeper(edge: &Edge, greatest: &[i32]) -> Option<Sleeper> {
    edge.guard.fixed.iter().find_map(|one| {
        let (left, right) = (one.left.0 as usize, one.right.0 as usize);
        let bound = if one.strict {
            Bound::strict(one.bound)
        } else {
            Bound::weak(one.bound)
        };
        let constraint = Constraint {
            left,
            right,
            bound: bound?,
        };
        let highest = i64::from(*greatest.get(right)?);
        let holds_then =
            -highest < i64::from(one.bound) || !one.strict && -highest == i64::from(one.bound);
        (left == 0 && right != 0 && !holds_then).then_some(constraint)
    })
}
