//! The passed list: stored symbolic states, none of which contains another.
//!
//! Invariants:
//! * Among two stored states with the same words, neither zone contains the other: as a set or, if
//!   zones are stored reduced, by simulation (see [`crate::zones::simulation`]). A state that a new
//!   one contains is forgotten, and its node is covered from then on.
//! * Nodes are numbered in the order in which they were stored; a number is never used again.
//!
//! Source: G. Behrmann, J. Bengtsson, A. David, K. G. Larsen, P. Pettersson, W. Yi, "UPPAAL
//! Implementation Secrets", 2002 (one list for passed and waiting states, by discrete state).
//!
//! Cost: one look-up of the words, one or two comparisons of zones for each zone stored with the
//! same words, and a look-up of the zone if it is to be stored.

use crate::cancellation;
use crate::network::Symbolic;
use crate::zones::Bound;
use crate::zones::zone_table::ZoneId;

use super::discrete_states::{DiscreteId, StateStore};
use super::disk::Cold;
use super::packed_zones::{Kept, PackedZones};
use super::signature::Signature;
use super::zone_lists::{Entry, Lists};

/// A stored state with its number.
#[derive(Clone, Copy, Debug)]
pub(in crate::search) struct Stored {
    /// The number of the state among all that were ever stored.
    pub(in crate::search) node: u32,
    discrete: DiscreteId,
    zone: ZoneId,
}

impl Stored {
    /// Its numbers: the first is enough if it has no zone.
    pub(super) fn numbers(self) -> [u32; 3] {
        [self.node, self.discrete.0, self.zone.0]
    }

    /// The state with these numbers. Where states have no zones, they are counted as their words
    /// are.
    pub(super) fn of_numbers(numbers: &[u32]) -> Stored {
        let (discrete, zone) = match *numbers {
            [_, discrete, zone] => (discrete, zone),
            _ => (numbers[0], 0),
        };
        Stored {
            node: numbers[0],
            discrete: DiscreteId(discrete),
            zone: ZoneId(zone),
        }
    }
}

/// Stored symbolic states.
#[derive(Debug)]
pub(in crate::search) struct PassedList {
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
    /// An empty list for the states of a network.
    pub(in crate::search) fn new(symbolic: &Symbolic<'_>) -> PassedList {
        let (dimension, tuning) = (symbolic.dimension(), symbolic.tuning());
        let zones = PackedZones::new(dimension, symbolic.greatest_constant());
        PassedList {
            store: StateStore::new(symbolic.stepper.network()),
            zones: zones.tuned(tuning),
            lists: Lists::new(tuning.split_lists),
            covered: Vec::new(),
            nodes: 0,
            covered_count: 0,
            has_clocks: dimension > 1,
        }
    }

    /// How many states are stored now.
    pub(in crate::search) fn len(&self) -> usize {
        (self.nodes - self.covered_count) as usize
    }

    /// The bytes that the list takes.
    pub(in crate::search) fn bytes(&self) -> usize {
        let covered = self.covered.len() * size_of::<u64>();
        self.store.bytes() + self.zones.bytes() + self.lists.bytes() + covered
    }

    /// The most bytes that the next state may take.
    pub(in crate::search) fn growth(&self) -> usize {
        self.store.growth()
    }

    /// What may be put on disk.
    pub(in crate::search) fn cold(&mut self) -> impl Iterator<Item = &mut dyn Cold> {
        self.store.cold().chain([self.zones.cold()])
    }

    /// Whether a state was contained by one that was stored later.
    pub(in crate::search) fn is_covered(&self, stored: Stored) -> bool {
        let node = stored.node as usize;
        self.covered
            .get(node / 64)
            .is_some_and(|bits| bits >> (node % 64) & 1 == 1)
    }

    /// Writes a stored state that is not covered, its zone as it is stored, over another state of
    /// the same network. The next states that are added are likely to be its successors.
    pub(in crate::search) fn visit(
        &mut self,
        stored: Stored,
        words: &mut [i32],
        zone: &mut [Bound],
    ) {
        self.store.visit(stored.discrete, words);
        if self.has_clocks {
            self.zones.load(stored.zone, zone);
        }
    }

    /// Whether states have zones.
    pub(in crate::search) fn has_zones(&self) -> bool {
        self.has_clocks
    }

    /// The bytes of a state's words that decide identity; see [`StateStore::pack`].
    pub(in crate::search) fn pack(&mut self, words: &[i32]) -> &[u8] {
        self.store.pack(words)
    }

    /// Stores a state, unless a stored one contains it.
    pub(in crate::search) fn add(&mut self, words: &[i32], zone: Kept<'_>) -> Option<Stored> {
        let interned = self.store.intern(words);
        self.add_interned(interned, zone)
    }

    /// Whether states may wait to be stored: they are words alone.
    pub(in crate::search) fn may_wait(&self) -> bool {
        !self.has_clocks && self.store.may_wait()
    }

    /// Lets a state wait until [`PassedList::add_waiting`].
    pub(in crate::search) fn wait(&mut self, words: &[i32]) {
        self.store.wait(words);
    }

    /// The same, for words that another list has packed.
    pub(in crate::search) fn wait_record(&mut self, record: &[u8]) {
        self.store.wait_record(record);
    }

    /// Stores the states that wait, in their order, with what [`PassedList::add`] returns of each.
    pub(in crate::search) fn add_waiting(&mut self, mut each: impl FnMut(Option<Stored>)) {
        let PassedList { store, nodes, .. } = self;
        store.intern_waiting(|discrete, is_new| each(is_new.then(|| numbered(nodes, discrete))));
    }

    /// See [`StateStore::identity_hash`].
    pub(in crate::search) fn identity_hash(&self, words: &[i32]) -> u32 {
        self.store.identity_hash(words)
    }

    /// The packed words of a state, for [`PassedList::add_record`] of another list for the same
    /// network.
    pub(in crate::search) fn record(&mut self, words: &[i32]) -> &[u8] {
        self.store.record(words)
    }

    /// Prepares for records of another list; see [`StateStore::leave`].
    pub(in crate::search) fn leave(&mut self) {
        self.store.leave();
    }

    /// As [`PassedList::add`], for words that another list has packed.
    pub(in crate::search) fn add_record(
        &mut self,
        record: &[u8],
        zone: Kept<'_>,
    ) -> Option<Stored> {
        let interned = self.store.intern_record(record);
        self.add_interned(interned, zone)
    }

    /// Adds a zone to a discrete state that is or is not new.
    fn add_interned(
        &mut self,
        (discrete, is_new): (DiscreteId, bool),
        zone: Kept<'_>,
    ) -> Option<Stored> {
        if !self.has_clocks {
            return is_new.then(|| numbered(&mut self.nodes, discrete));
        }
        if is_new {
            self.lists.open();
        }
        let signature = self.zones.propose(zone);
        if !is_new {
            // No stored zone contains another. So if one contains the candidate, the candidate
            // contains none of them.
            let zones = &mut self.zones;
            let contains = |other| zones.contains_candidate(other, zone.limits);
            if self.lists.any_above(discrete, signature, contains) {
                return None;
            }
            self.forget_within(discrete, signature, zone.limits);
        }
        let limits = zone.limits;
        let zone = self.zones.keep();
        let stored = Stored {
            zone,
            ..numbered(&mut self.nodes, discrete)
        };
        let entry = Entry {
            signature,
            zone,
            node: stored.node,
        };
        let zones = &mut self.zones;
        let signature_of = |zone| zones.signature(zone, limits);
        self.lists.push(discrete, entry, signature_of);
        Some(stored)
    }

    /// Forgets the zones of a discrete state that the proposed one contains.
    fn forget_within(&mut self, discrete: DiscreteId, proposed: Signature, limits: &[Bound]) {
        let PassedList {
            zones,
            lists,
            covered,
            covered_count,
            ..
        } = self;
        lists.remove_below(discrete, proposed, |zone, node| {
            let is_within = zones.is_in_candidate(zone, limits);
            if is_within {
                cover(covered, node);
                *covered_count += 1;
                zones.release(zone);
            }
            is_within
        });
    }
}

/// A state without a zone, with the next number.
fn numbered(nodes: &mut u32, discrete: DiscreteId) -> Stored {
    let node = cancellation::number(*nodes as usize);
    *nodes += 1;
    Stored {
        node,
        discrete,
        zone: ZoneId(0),
    }
}

/// Notes that a node is covered.
fn cover(covered: &mut Vec<u64>, node: u32) {
    let word = node as usize / 64;
    if covered.len() <= word {
        covered.resize(word + 1, 0);
    }
    covered[word] |= 1 << (node % 64);
}
