//! The enabled instances of edges with `select`, cached by the words that decide them.
//!
//! Guards and channel expressions of an edge often read few words, whose values occur again and
//! again. For each combination of values there is a *set* of the edge's enabled instances, with
//! their channels and clock constraints. Where two processes synchronise, the matching pairs depend
//! on two sets only, and are cached too.
//!
//! Invariants:
//! * A set is the result of evaluating the edge's functions in the state, since these read no other
//!   words. If the evaluation fails there is no set. Then the caller evaluates one instance after
//!   the other, so that only what is needed can fail.
//! * Sets stay what they are; nothing is forgotten. Memory is bounded by [`MOST_BYTES`]: what comes
//!   later is not remembered, nor are edges whose words seldom come again. That is judged by how
//!   often each set was used and not in trials of states, as an edge has few sets or many.

use std::hash::BuildHasher;
use std::ops::Range;

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

use crate::ir::{Edge, FixedConstraint, Network};

use super::selects::select_count;
use crate::analysis::function_reads::read_words;

/// The approximate number of bytes that the cache may take.
const MOST_BYTES: usize = 16 << 20;
/// Edges whose functions read more words are not cached.
const MOST_WORDS: usize = 16;
/// An edge with this many sets is given up unless on average [`LEAST_USES`] states asked for each.
const SETS_TO_JUDGE: u32 = 256;
const LEAST_USES: u64 = 4;

/// No set; no edge.
const NONE: u32 = u32::MAX;

/// The index of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SetId(u32);

/// An enabled instance of an edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Instance {
    /// The channel; 0 without synchronisation.
    pub(super) channel: u32,
    /// Its combination of select values.
    pub(super) select: u32,
    /// Its constraints among those of the set.
    pub(super) constraints: (u32, u32),
}

/// The enabled instances of an edge in some states.
#[derive(Debug, Default)]
pub(super) struct Set {
    /// The instances of a receiving edge by channel, then by select values; those of another edge
    /// by select values.
    pub(super) instances: Vec<Instance>,
    constraints: Vec<FixedConstraint>,
}

impl Set {
    /// Adds an instance.
    pub(super) fn push(&mut self, channel: u32, select: u32, constraints: &[FixedConstraint]) {
        let first = self.constraints.len() as u32;
        self.constraints.extend_from_slice(constraints);
        self.instances.push(Instance {
            channel,
            select,
            constraints: (first, self.constraints.len() as u32),
        });
    }

    /// The clock constraints of an instance.
    pub(super) fn constraints(&self, instance: Instance) -> &[FixedConstraint] {
        &self.constraints[instance.constraints.0 as usize..instance.constraints.1 as usize]
    }

    /// The instances of a receiving edge that listen to a channel.
    pub(super) fn listeners(&self, channel: u32) -> Range<usize> {
        let first = self.instances.partition_point(|one| one.channel < channel);
        let rest = &self.instances[first..];
        let count = rest.iter().take_while(|one| one.channel == channel).count();
        first..first + count
    }

    fn bytes(&self) -> usize {
        size_of::<Set>() + size_of_val(&*self.instances) + size_of_val(&*self.constraints)
    }
}

/// The cache of an edge.
#[derive(Debug)]
struct Memory {
    /// The words that decide its instances.
    words: Vec<u32>,
    /// The values of these words, for each set of this edge.
    keys: Vec<i32>,
    sets: Vec<SetId>,
    table: HashTable<u32>,
    /// The set of the latest state that asked, and the number of that state.
    latest: (u64, SetId),
    uses: u64,
    is_given_up: bool,
}

/// The answer of the cache.
pub(super) enum Known {
    Set(SetId),
    /// It is not in the cache yet.
    New,
    /// The edge is not cached.
    Never,
}

/// The cache.
#[derive(Debug)]
pub(super) struct Instances {
    /// For each process and edge: its memory.
    places: Vec<Vec<u32>>,
    memories: Vec<Memory>,
    sets: Vec<Set>,
    key: Vec<i32>,
    /// For a set of a sender and one of a receiver: where `matches` has the pairs of their
    /// instances with the same channel.
    pairs: HashTable<(SetId, SetId, u32, u32)>,
    matches: Vec<(u32, u32)>,
    bytes: usize,
}

impl Instances {
    pub(super) fn new(network: &Network) -> Instances {
        let mut memories = Vec::new();
        let places = network.processes.iter().map(|process| {
            let edges = process.edges.iter().map(|edge| {
                let Some(words) = deciding_words(network, edge) else {
                    return NONE;
                };
                memories.push(Memory {
                    words,
                    keys: Vec::new(),
                    sets: Vec::new(),
                    table: HashTable::new(),
                    latest: (0, SetId(NONE)),
                    uses: 0,
                    is_given_up: false,
                });
                memories.len() as u32 - 1
            });
            edges.collect()
        });
        Instances {
            places: places.collect(),
            memories,
            sets: Vec::new(),
            key: Vec::new(),
            pairs: HashTable::new(),
            matches: Vec::new(),
            bytes: 0,
        }
    }

    /// The approximate number of bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The set of an edge in a state with this number.
    #[inline]
    pub(super) fn find(&mut self, process: u32, edge: u32, round: u64, words: &[i32]) -> Known {
        let place = self.places[process as usize][edge as usize];
        if place == NONE {
            return Known::Never;
        }
        let memory = &mut self.memories[place as usize];
        if memory.latest.0 == round || memory.words.is_empty() && memory.latest.1 != SetId(NONE) {
            return Known::Set(memory.latest.1);
        }
        if memory.is_given_up {
            return Known::Never;
        }
        memory.uses += 1;
        self.key.clear();
        let values = memory.words.iter().map(|&word| words[word as usize]);
        self.key.extend(values);
        let (key, keys, size) = (&self.key, &memory.keys, memory.words.len());
        let is_key = |&index: &u32| &keys[index as usize * size..][..size] == key.as_slice();
        let Some(&index) = memory.table.find(hash(key), is_key) else {
            return Known::New;
        };
        memory.latest = (round, memory.sets[index as usize]);
        Known::Set(memory.latest.1)
    }

    /// Caches the set of the edge that was last asked for and was new; `None` if there is no room
    /// for it.
    pub(super) fn remember(
        &mut self,
        process: u32,
        edge: u32,
        round: u64,
        set: Set,
    ) -> Option<SetId> {
        let memory = &mut self.memories[self.places[process as usize][edge as usize] as usize];
        let number = memory.sets.len() as u32;
        if number >= SETS_TO_JUDGE && memory.uses < u64::from(number) * LEAST_USES
            || self.bytes > MOST_BYTES
        {
            memory.is_given_up = true;
            return None;
        }
        let id = SetId(self.sets.len() as u32);
        self.bytes += set.bytes() + size_of_val(&*self.key) + 3 * size_of::<u32>();
        self.sets.push(set);
        memory.sets.push(id);
        memory.keys.extend_from_slice(&self.key);
        let (keys, size) = (&memory.keys, memory.words.len());
        let key_of = |&index: &u32| hash(&keys[index as usize * size..][..size]);
        memory.table.insert_unique(hash(&self.key), number, key_of);
        memory.latest = (round, id);
        Some(id)
    }

    /// A set.
    pub(super) fn set(&self, SetId(id): SetId) -> &Set {
        &self.sets[id as usize]
    }

    /// Adds the pairs of places of a sending and a receiving instance with the same channel, in the
    /// order of the senders, then of the receivers.
    #[inline]
    pub(super) fn add_matches(
        &mut self,
        sender: SetId,
        receiver: SetId,
        out: &mut impl FnMut(u32, u32),
    ) {
        let hash = hash(&[sender.0 as i32, receiver.0 as i32]);
        let is_pair = |one: &(SetId, SetId, u32, u32)| one.0 == sender && one.1 == receiver;
        if let Some(&(_, _, first, last)) = self.pairs.find(hash, is_pair) {
            for &(own, other) in &self.matches[first as usize..last as usize] {
                out(own, other);
            }
            return;
        }
        let (senders, receivers) = (
            &self.sets[sender.0 as usize],
            &self.sets[receiver.0 as usize],
        );
        let first = self.matches.len();
        for (own, instance) in senders.instances.iter().enumerate() {
            for other in receivers.listeners(instance.channel) {
                self.matches.push((own as u32, other as u32));
                out(own as u32, other as u32);
            }
        }
        if self.bytes > MOST_BYTES {
            self.matches.truncate(first);
            return;
        }
        self.bytes += (self.matches.len() - first) * size_of::<(u32, u32)>();
        self.bytes += size_of::<(SetId, SetId, u32, u32)>() * 2;
        let pair = (sender, receiver, first as u32, self.matches.len() as u32);
        self.pairs.insert_unique(hash, pair, |one| {
            self::hash(&[one.0.0 as i32, one.1.0 as i32])
        });
    }
}

/// The words that decide the instances of an edge. `None` if it is not worth caching, or if they
/// are not known.
fn deciding_words(network: &Network, edge: &Edge) -> Option<Vec<u32>> {
    let index = edge.sync.and_then(|sync| sync.index);
    let is_broadcast = |sync: crate::ir::Sync| network.channels[sync.channel.0 as usize].broadcast;
    let is_asked_often = edge
        .sync
        .is_some_and(|sync| !sync.send && is_broadcast(sync));
    let has_code = edge.guard.function.is_some() || index.is_some();
    if !has_code || (select_count(edge) == 1 && index.is_none() && !is_asked_often) {
        return None;
    }
    read_words(
        network,
        edge.guard.function.into_iter().chain(index),
        MOST_WORDS,
    )
}

fn hash(key: &[i32]) -> u64 {
    FxBuildHasher.hash_one(key)
}
