//! Whether the receivers of a broadcast run updates whose order matters.
//!
//! They run in the order of processes, and an exchange of members of a scalar set would change this
//! order.

use std::collections::HashMap;
use std::ops::Range;

use crate::analysis::function_reads::read_words;
use crate::ir::{AssignedValue, ClockRange, Edge, Network, Process, Sync, Update};

/// Receivers whose updates read more words count as reading all.
const MOST_READ_WORDS: usize = 1 << 16;

/// Whether two processes may receive the same broadcast, run updates whose order matters, and
/// change their order when members of a set are exchanged.
pub(super) fn has_ordered_receivers(network: &Network, set: u32) -> bool {
    let mut groups: HashMap<u32, Vec<&Process>> = HashMap::new();
    for process in &network.processes {
        if process.coordinates.iter().any(|one| one.set == set) {
            groups.entry(process.group.0).or_default().push(process);
        }
    }
    let mut groups: Vec<_> = groups.into_iter().collect();
    groups.sort_unstable_by_key(|(first, _)| *first);
    groups.iter().any(|(_, processes)| {
        let received: Vec<Vec<Touched>> = processes
            .iter()
            .map(|process| {
                let edges = process.edges.iter();
                let edges = edges.filter(|edge| receives_broadcast(network, edge));
                edges.map(|edge| Touched::new(network, edge)).collect()
            })
            .collect();
        received.iter().enumerate().any(|(index, own)| {
            let others = received[index + 1..].iter().flatten();
            others
                .into_iter()
                .any(|other| own.iter().any(|one| !one.commutes_with(other)))
        })
    })
}

fn receives_broadcast(network: &Network, edge: &Edge) -> bool {
    edge.sync.is_some_and(|sync| {
        let mut channels = sync.channels();
        !sync.send && channels.any(|channel| network.channels[channel as usize].broadcast)
    })
}

/// What the updates of an edge touch.
struct Touched {
    channels: Range<u32>,
    /// The words that are read, if they are known.
    reads: Option<Vec<u32>>,
    writes: Vec<Range<u32>>,
    /// The clocks that are set, and to which constant, if it is always the same.
    sets: Vec<(ClockRange, Option<i32>)>,
    /// The clocks that are copied.
    copies: Vec<ClockRange>,
}

impl Touched {
    fn new(network: &Network, edge: &Edge) -> Touched {
        let branches = edge.branches.iter().map(|branch| &branch.update);
        let updates: Vec<&Update> = std::iter::once(&edge.update).chain(branches).collect();
        let functions = updates.iter().filter_map(|update| update.function);
        let assignments = || updates.iter().flat_map(|update| &update.assignments);
        Touched {
            channels: edge.sync.map_or(0..0, Sync::channels),
            reads: read_words(network, functions, MOST_READ_WORDS),
            writes: updates
                .iter()
                .flat_map(|one| &one.writes)
                .map(|&(first, count)| first..first + count)
                .collect(),
            sets: assignments()
                .map(|one| match one.value {
                    AssignedValue::Integer(low, high) => (one.target, (low == high).then_some(low)),
                    AssignedValue::Clock(..) => (one.target, None),
                })
                .collect(),
            copies: assignments()
                .filter_map(|one| match one.value {
                    AssignedValue::Clock(source, ..) => Some(source),
                    AssignedValue::Integer(..) => None,
                })
                .collect(),
        }
    }

    fn reads_any(&self, written: &[Range<u32>]) -> bool {
        let Some(reads) = &self.reads else {
            return !written.is_empty();
        };
        written.iter().any(|words| {
            let next = reads.partition_point(|&word| word < words.start);
            reads.get(next).is_some_and(|&word| word < words.end)
        })
    }

    /// Whether the order of the two does not matter, or they never run together.
    fn commutes_with(&self, other: &Touched) -> bool {
        if !meet(&self.channels, &other.channels) {
            return true;
        }
        let words_are_apart = !meet_any(&self.writes, &other.writes)
            && !self.reads_any(&other.writes)
            && !other.reads_any(&self.writes);
        let range = |clocks: &ClockRange| clocks.first.0..clocks.first.0 + clocks.count;
        let are_set_alike = self.sets.iter().all(|(clocks, value)| {
            other.sets.iter().all(|(others, other)| {
                !meet(&range(clocks), &range(others)) || (value.is_some() && value == other)
            })
        });
        let is_copied = |one: &Touched, two: &Touched| {
            let mut copies = one.copies.iter();
            copies.any(|copied| {
                two.sets
                    .iter()
                    .any(|(set, _)| meet(&range(copied), &range(set)))
            })
        };
        words_are_apart && are_set_alike && !is_copied(self, other) && !is_copied(other, self)
    }
}

fn meet(one: &Range<u32>, other: &Range<u32>) -> bool {
    one.start < other.end && other.start < one.end
}

fn meet_any(ranges: &[Range<u32>], others: &[Range<u32>]) -> bool {
    ranges
        .iter()
        .any(|one| others.iter().any(|other| meet(one, other)))
}
