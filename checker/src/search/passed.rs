//! The passed list: stored symbolic states, none of which contains another.
//!
//! Invariants:
//! * Of two stored states with the same words neither zone contains the other, as a set or, where zones are stored reduced, by
//!   what simulates what (see [`crate::zones::simulation`]). A state that a new one contains is forgotten, and its node is
//!   covered from then on.
//! * Nodes are numbered in the order in which they were stored; a number is never used again.
//!
//! Source: G. Behrmann, J. Bengtsson, A. David, K. G. Larsen, P. Pettersson, W. Yi, "UPPAAL Implementation Secrets", 2002
//! (one list for passed and waiting states, by discrete state).
//!
//! Cost: one look-up of the words, one or two comparisons of zones for each zone stored with the same words, and a look-up
//! of the zone if it is to be stored.

use crate::ir::Network;
use crate::zones::Bound;
use crate::zones::zone_table::ZoneId;

use super::packed_zones::{Kept, PackedZones, Signature};
use super::store::{DiscreteId, StateStore};

/// A stored state with its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    /// The number of the state among all that were ever stored.
    pub(super) node: u32,
    discrete: DiscreteId,
    zone: ZoneId,
}

/// A zone in the list of a discrete state.
#[derive(Clone, Copy, Debug)]
struct Entry {
    signature: Signature,
    zone: ZoneId,
    node: u32,
}

/// The zones of a discrete state: so many entries from `first` on. They lie side by side, since long lists are read again and again,
/// in a place for as many as the next power of two.
#[derive(Clone, Copy, Debug)]
struct List {
    first: u32,
    len: u32,
}

/// Lists of entries.
#[derive(Debug, Default)]
struct Lists {
    entries: Vec<Entry>,
    /// By discrete state: its entries.
    by_discrete: Vec<List>,
    /// By exponent of their size: the places that are not in use.
    free: Vec<Vec<u32>>,
}

impl Lists {
    fn bytes(&self) -> usize {
        let free = self.free.iter().map(|places| size_of_val(&**places));
        size_of_val(&*self.entries) + size_of_val(&*self.by_discrete) + free.sum::<usize>()
    }

    fn get(&self, discrete: DiscreteId) -> &[Entry] {
        let List { first, len } = self.by_discrete[discrete.0 as usize];
        &self.entries[first as usize..][..len as usize]
    }

    fn get_mut(&mut self, discrete: DiscreteId) -> &mut [Entry] {
        let List { first, len } = self.by_discrete[discrete.0 as usize];
        &mut self.entries[first as usize..][..len as usize]
    }

    /// Adds a discrete state without entries.
    fn open(&mut self) {
        self.by_discrete.push(List { first: 0, len: 0 });
    }

    fn push(&mut self, discrete: DiscreteId, entry: Entry) {
        let List { first, len } = self.by_discrete[discrete.0 as usize];
        let place = if len == 0 {
            self.place(0, entry)
        } else if len.is_power_of_two() {
            let exponent = len.ilog2() as usize;
            let place = self.place(exponent + 1, entry);
            let old = first as usize..(first + len) as usize;
            self.entries.copy_within(old, place as usize);
            self.release(exponent, first);
            place
        } else {
            first
        };
        self.entries[(place + len) as usize] = entry;
        self.by_discrete[discrete.0 as usize] = List {
            first: place,
            len: len + 1,
        };
    }

    /// Takes an entry out; the last one takes its place.
    fn remove(&mut self, discrete: DiscreteId, index: usize) {
        let List { first, len } = self.by_discrete[discrete.0 as usize];
        let last = len - 1;
        self.entries[first as usize + index] = self.entries[(first + last) as usize];
        let mut place = first;
        if last == 0 {
            self.release(0, first);
        } else if last.is_power_of_two() {
            let exponent = last.ilog2() as usize;
            place = self.place(exponent, self.entries[first as usize]);
            let old = first as usize..(first + last) as usize;
            self.entries.copy_within(old, place as usize);
            self.release(exponent + 1, first);
        }
        self.by_discrete[discrete.0 as usize] = List {
            first: place,
            len: last,
        };
    }

    /// A place for 2^exponent entries, which mean nothing if it is new.
    fn place(&mut self, exponent: usize, filler: Entry) -> u32 {
        let free = self.free.get_mut(exponent).and_then(Vec::pop);
        free.unwrap_or_else(|| {
            let first = self.entries.len();
            self.entries.resize(first + (1 << exponent), filler);
            first as u32
        })
    }

    fn release(&mut self, exponent: usize, first: u32) {
        if self.free.len() <= exponent {
            self.free.resize_with(exponent + 1, Vec::new);
        }
        self.free[exponent].push(first);
    }
}

/// Stored symbolic states.
#[derive(Debug)]
pub(super) struct PassedList {
    store: StateStore,
    zones: PackedZones,
    lists: Lists,
    /// By node: whether it is covered.
    covered: Vec<u64>,
    nodes: u32,
    covered_count: u32,
    /// Without clocks the words are the whole state.
    has_clocks: bool,
}

impl PassedList {
    /// An empty list for the states of a network, with zones of this dimension, most of whose constants are at most `greatest`.
    pub(super) fn new(network: &Network, dimension: usize, greatest: i32) -> PassedList {
        PassedList {
            store: StateStore::new(network),
            zones: PackedZones::new(dimension, greatest),
            lists: Lists::default(),
            covered: Vec::new(),
            nodes: 0,
            covered_count: 0,
            has_clocks: dimension > 1,
        }
    }

    /// How many states are stored now.
    pub(super) fn len(&self) -> usize {
        (self.nodes - self.covered_count) as usize
    }

    /// The bytes that the list takes.
    pub(super) fn bytes(&self) -> usize {
        let covered = self.covered.len() * size_of::<u64>();
        self.store.bytes() + self.zones.bytes() + self.lists.bytes() + covered
    }

    /// Whether a state was contained by one that was stored later.
    pub(super) fn is_covered(&self, stored: Stored) -> bool {
        let node = stored.node as usize;
        self.covered
            .get(node / 64)
            .is_some_and(|bits| bits >> (node % 64) & 1 == 1)
    }

    /// Writes a stored state that is not covered, its zone as it is stored, over another state of the same network.
    pub(super) fn load(&self, stored: Stored, words: &mut [i32], zone: &mut [Bound]) {
        self.store.load(stored.discrete, words);
        if self.has_clocks {
            self.zones.load(stored.zone, zone);
        }
    }

    /// The bytes of a state's words that decide identity; see [`StateStore::pack`].
    pub(super) fn pack(&mut self, words: &[i32]) -> &[u8] {
        self.store.pack(words)
    }

    /// Stores a state, unless a stored one contains it.
    pub(super) fn add(&mut self, words: &[i32], zone: Kept<'_>) -> Option<Stored> {
        let hash = self.store.propose(words);
        self.add_proposed(hash, zone)
    }

    /// Packs the words of a state, to be stored by [`PassedList::add_proposed`] or sent to another list; returns their hash.
    pub(super) fn propose(&mut self, words: &[i32]) -> u32 {
        self.store.propose(words)
    }

    /// The packed words of the state that was proposed last.
    pub(super) fn proposed(&self) -> &[u8] {
        self.store.proposed()
    }

    /// Takes over words that another list for the same network has packed.
    pub(super) fn propose_record(&mut self, record: &[u8]) {
        self.store.propose_record(record);
    }

    /// As [`PassedList::add`], for the words that were proposed last, which have this hash.
    pub(super) fn add_proposed(&mut self, hash: u32, zone: Kept<'_>) -> Option<Stored> {
        let (discrete, is_new) = self.store.intern_proposed(hash);
        if !self.has_clocks {
            return is_new.then(|| self.stored(discrete, ZoneId(0)));
        }
        if is_new {
            self.lists.open();
        }
        let signature = self.zones.propose(zone);
        if !is_new {
            // None of the stored ones lies within another, so that what one contains contains none of them.
            if self.is_contained(discrete, signature, zone.limits) {
                return None;
            }
            self.forget_within(discrete, signature, zone.limits);
        }
        let zone = self.zones.keep();
        let stored = self.stored(discrete, zone);
        let entry = Entry {
            signature,
            zone,
            node: stored.node,
        };
        self.lists.push(discrete, entry);
        Some(stored)
    }

    fn stored(&mut self, discrete: DiscreteId, zone: ZoneId) -> Stored {
        let node = self.nodes;
        self.nodes += 1;
        Stored {
            node,
            discrete,
            zone,
        }
    }

    /// Whether a stored zone of a discrete state contains the proposed one.
    fn is_contained(
        &mut self,
        discrete: DiscreteId,
        proposed: Signature,
        limits: &[Bound],
    ) -> bool {
        let entries = self.lists.get_mut(discrete);
        // The last ones come first.
        let container = entries.iter().rposition(|entry| {
            proposed.may_be_within(entry.signature)
                && self.zones.contains_candidate(entry.zone, limits)
        });
        // What contains one zone often contains the next one.
        let last = entries.len().saturating_sub(1);
        container
            .inspect(|&place| entries.swap(place, last))
            .is_some()
    }

    /// Forgets the zones of a discrete state that the proposed one contains.
    fn forget_within(&mut self, discrete: DiscreteId, proposed: Signature, limits: &[Bound]) {
        // Where one is taken out, one that was looked at takes its place.
        for index in (0..self.lists.get(discrete).len()).rev() {
            let Entry {
                signature,
                zone,
                node,
            } = self.lists.get(discrete)[index];
            if signature.may_be_within(proposed) && self.zones.is_in_candidate(zone, limits) {
                self.cover(node);
                self.zones.release(zone);
                self.lists.remove(discrete, index);
            }
        }
    }

    fn cover(&mut self, node: u32) {
        let word = node as usize / 64;
        if self.covered.len() <= word {
            self.covered.resize(word + 1, 0);
        }
        self.covered[word] |= 1 << (node % 64);
        self.covered_count += 1;
    }
}
