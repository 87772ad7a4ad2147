//! Discrete states, each stored once.
//!
//! Invariants:
//! * Two states get the same [`DiscreteId`] exactly if their identity words are equal; no hash stands in for a state.
//! * Words that no update ever writes are not stored: they have their initial value in every state. `meta` words are stored
//!   with the first state of an identity, and not compared.
//! * Ids count from 0 in the order of first insertion.
//!
//! Cost: a state takes its written words; records lie in blocks that are never moved. A look-up hashes the words once and
//! compares them once, on a match of 32 bits of the hash.

use hashbrown::HashTable;

use crate::ir::Network;

/// The index of a stored discrete state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DiscreteId(pub u32);

/// An entry of the table: the state and a part of its hash, from which the table is rebuilt when it grows.
#[derive(Clone, Copy, Debug)]
struct Entry {
    id: u32,
    hash: u32,
}

/// Words of records in one block, at least; a block holds a power of two of records.
const BLOCK_WORDS: usize = 1 << 18;

/// Stored discrete states.
#[derive(Debug)]
pub struct StateStore {
    /// The words that are stored, as ranges (first, count); those of the identity first.
    ranges: Vec<(usize, usize)>,
    /// The words of a record that decide identity.
    identity: usize,
    /// The words of a record.
    stride: usize,
    /// Records in a block, as a power of two.
    block_bits: u32,
    blocks: Vec<Vec<i32>>,
    table: HashTable<Entry>,
    scratch: Vec<i32>,
    count: u32,
}

impl StateStore {
    /// An empty store for the states of a network.
    pub fn new(network: &Network) -> StateStore {
        let written = written_words(network);
        let identity_words = network.layout.identity_words as usize;
        let mut ranges = ranges_of(&written, 0, identity_words);
        let identity = ranges.iter().map(|range| range.1).sum();
        ranges.extend(ranges_of(&written, identity_words, written.len()));
        let stride = ranges.iter().map(|range| range.1).sum::<usize>().max(1);
        let block_bits = (BLOCK_WORDS / stride).max(1).ilog2();
        StateStore {
            ranges,
            identity,
            stride,
            block_bits,
            blocks: Vec::new(),
            table: HashTable::new(),
            scratch: vec![0; stride],
            count: 0,
        }
    }

    /// How many states are stored.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether no state is stored.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The bytes that the store takes.
    pub fn bytes(&self) -> usize {
        let block = (self.stride << self.block_bits) * size_of::<i32>();
        self.blocks.len() * block + self.table.capacity() * (size_of::<Entry>() + 1) * 8 / 7
    }

    /// The id of a state, and whether it is new.
    pub fn intern(&mut self, words: &[i32]) -> (DiscreteId, bool) {
        let mut at = 0;
        for &(first, count) in &self.ranges {
            self.scratch[at..at + count].copy_from_slice(&words[first..first + count]);
            at += count;
        }
        let hash = hash_words(&self.scratch[..self.identity]);
        let (blocks, stride, bits, identity) =
            (&self.blocks, self.stride, self.block_bits, self.identity);
        let key = &self.scratch[..identity];
        let is_same = |entry: &Entry| {
            entry.hash == hash && &record(blocks, stride, bits, entry.id)[..identity] == key
        };
        if let Some(entry) = self.table.find(spread(hash), is_same) {
            return (DiscreteId(entry.id), false);
        }
        let id = self.count;
        self.count += 1;
        if id as usize >> self.block_bits == self.blocks.len() {
            self.blocks
                .push(Vec::with_capacity(self.stride << self.block_bits));
        }
        let block = self
            .blocks
            .last_mut()
            .expect("a block was just made if there was none");
        block.extend_from_slice(&self.scratch);
        self.table
            .insert_unique(spread(hash), Entry { id, hash }, |entry| spread(entry.hash));
        (DiscreteId(id), true)
    }

    /// The id of a stored state.
    pub fn find(&self, words: &[i32]) -> Option<DiscreteId> {
        let ranges = self.ranges.iter();
        let stored = ranges.flat_map(|&(first, count)| &words[first..first + count]);
        let key: Vec<i32> = stored.take(self.identity).copied().collect();
        let hash = hash_words(&key);
        let is_same = |entry: &Entry| {
            entry.hash == hash
                && record(&self.blocks, self.stride, self.block_bits, entry.id)[..self.identity]
                    == key
        };
        let entry = self.table.find(spread(hash), is_same);
        entry.map(|entry| DiscreteId(entry.id))
    }

    /// Writes the stored words of a state over those of another state of the same network.
    pub fn load(&self, id: DiscreteId, words: &mut [i32]) {
        let record = record(&self.blocks, self.stride, self.block_bits, id.0);
        let mut at = 0;
        for &(first, count) in &self.ranges {
            words[first..first + count].copy_from_slice(&record[at..at + count]);
            at += count;
        }
    }
}

fn record(blocks: &[Vec<i32>], stride: usize, bits: u32, id: u32) -> &[i32] {
    let within = (id as usize & ((1 << bits) - 1)) * stride;
    &blocks[id as usize >> bits][within..within + stride]
}

/// By word: whether some update may write it. Locations always count as written.
fn written_words(network: &Network) -> Vec<bool> {
    let mut written = vec![false; network.layout.words as usize];
    written[..network.processes.len()].fill(true);
    let edges = network.processes.iter().flat_map(|process| &process.edges);
    let updates = edges
        .flat_map(|edge| {
            std::iter::once(&edge.update).chain(edge.branches.iter().map(|branch| &branch.update))
        })
        .chain(&network.before_update)
        .chain(&network.after_update);
    for &(first, count) in updates.flat_map(|update| &update.writes) {
        written[first as usize..(first + count) as usize].fill(true);
    }
    written
}

/// The maximal runs of written words from `first` up to `last`.
fn ranges_of(written: &[bool], first: usize, last: usize) -> Vec<(usize, usize)> {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for word in (first..last).filter(|&word| written[word]) {
        match ranges.last_mut() {
            Some((start, count)) if *start + *count == word => *count += 1,
            _ => ranges.push((word, 1)),
        }
    }
    ranges
}

/// A hash of words: four lanes of multiply and fold, so that the multiplications overlap.
pub fn hash_words(words: &[i32]) -> u32 {
    const FACTORS: [u64; 4] = [
        0x9e37_79b9_7f4a_7c15,
        0xc2b2_ae3d_27d4_eb4f,
        0x1656_67b1_9e37_79f9,
        0xd6e8_feb8_6659_fd93,
    ];
    let mut lanes = FACTORS;
    let mut chunks = words.chunks_exact(8);
    for chunk in &mut chunks {
        for lane in 0..4 {
            lanes[lane] = mix(
                lanes[lane],
                chunk[2 * lane],
                chunk[2 * lane + 1],
                FACTORS[lane],
            );
        }
    }
    let rest = chunks.remainder();
    for (lane, pair) in rest.chunks(2).enumerate() {
        lanes[lane] = mix(
            lanes[lane],
            pair[0],
            pair.get(1).copied().unwrap_or(0),
            FACTORS[lane],
        );
    }
    let all = lanes.iter().fold(words.len() as u64, |hash, lane| {
        fold(hash ^ lane, FACTORS[0])
    });
    (all ^ (all >> 32)) as u32
}

fn mix(lane: u64, first: i32, second: i32, factor: u64) -> u64 {
    let word = u64::from(first as u32) | u64::from(second as u32) << 32;
    fold(lane ^ word, factor)
}

fn fold(value: u64, factor: u64) -> u64 {
    let product = value.wrapping_mul(factor);
    product ^ (product >> 29)
}

/// The 64 bits that the table wants, from the 32 bits that are kept.
fn spread(hash: u32) -> u64 {
    u64::from(hash).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}
