//! The nodes of the search for runs without end: words with a zone. A node is on the stack, or it
//! was left, and then no run starts in it.
//!
//! Invariants:
//! * Without clocks a node has the number of its words, and nothing else is kept of it but whether
//!   it is on the stack. Else the nodes with the same words form a list, at whose end their words
//!   stand.
//! * Among the nodes of a list that were left, none contains another, unless the inner one is sure
//!   and the outer one is not.
//! * A node is *sure* if no run ends in any valuation of its zone that satisfies the invariants.
//!   Of other nodes this is known only before their zones were extrapolated.
//!
//! Cost: one bit for each node without clocks; else eight bytes and three bits, four bytes for
//! words, and the zones, each once.

use crate::network::Symbolic;
use crate::zones::Bound;
use crate::zones::zone_table::ZoneId;

use crate::search::store::discrete_states::DiscreteId;
use crate::search::store::disk::Cold;
use crate::search::store::packed_zones::PackedZones;
use crate::search::store::records::Records;

/// No node.
const NONE: u32 = u32::MAX;

/// What nodes say about a state with the same words.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Known {
    /// Whether a node that was left contains it.
    pub(super) is_left: bool,
    /// Whether a sure node contains it.
    pub(super) is_sure: bool,
    /// A node on the stack that it contains.
    pub(super) closes: Option<u32>,
}

/// All nodes.
#[derive(Debug)]
pub(super) struct Nodes {
    has_clocks: bool,
    count: u32,
    on_stack: Bits,
    zones: PackedZones,
    /// By node: its zone, and the next node with the same words, or these words.
    links: Records<u32>,
    /// Whether a node is the last one of a list.
    is_last: Bits,
    is_sure: Bits,
    /// For each discrete state: its first node.
    heads: Records<u32>,
}

impl Nodes {
    /// No nodes.
    pub(super) fn new(symbolic: &Symbolic<'_>) -> Nodes {
        let dimension = symbolic.dimension();
        let zones = PackedZones::new(dimension, symbolic.greatest_constant());
        Nodes {
            has_clocks: dimension > 1,
            count: 0,
            on_stack: Bits::default(),
            zones: zones.tuned(symbolic.tuning()),
            links: Records::new(2),
            is_last: Bits::default(),
            is_sure: Bits::default(),
            heads: Records::new(1),
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count as usize
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        let bits = self.on_stack.bytes() + self.is_last.bytes() + self.is_sure.bytes();
        bits + self.zones.bytes() + self.links.bytes() + self.heads.bytes()
    }

    /// What may be put on disk.
    pub(super) fn cold(&mut self) -> [&mut dyn Cold; 3] {
        [self.zones.cold(), &mut self.links, &mut self.heads]
    }

    /// What is known of a state with these words, which are new or not; it is the candidate from
    /// now on.
    pub(super) fn propose(&mut self, discrete: DiscreteId, is_new: bool, zone: &[Bound]) -> Known {
        let mut known = Known::default();
        if !self.has_clocks {
            let is_on_stack = !is_new && self.on_stack.get(discrete.0);
            known.closes = is_on_stack.then_some(discrete.0);
            known.is_left = !is_new && !is_on_stack;
            known.is_sure = !is_new;
            return known;
        }
        self.zones.propose_alone(zone);
        if self.heads.len() == discrete.0 as usize {
            self.heads.push(&[NONE]);
        }
        let mut next = self.heads.first(discrete.0);
        while next != NONE && !(known.is_left && known.is_sure) {
            let node = next;
            let zone = self.zone(node);
            next = self.next(node);
            let is_on_stack = self.on_stack.get(node);
            if is_on_stack && known.closes.is_none() && self.zones.is_in_candidate(zone, &[]) {
                known.closes = Some(node);
            }
            let is_sure = self.is_sure.get(node);
            let may_tell = !is_on_stack || is_sure && !known.is_sure;
            if may_tell && self.zones.contains_candidate(zone, &[]) {
                known.is_left |= !is_on_stack;
                known.is_sure |= is_sure;
            }
        }
        known
    }

    /// Adds the candidate, on the stack.
    pub(super) fn add(&mut self, discrete: DiscreteId, is_sure: bool) -> u32 {
        self.count += 1;
        if !self.has_clocks {
            self.on_stack.set(discrete.0, true);
            return discrete.0;
        }
        let head = self.heads.first(discrete.0);
        let next = if head == NONE { discrete.0 } else { head };
        let zone = self.zones.keep();
        let node = self.links.push(&[zone.0, next]);
        self.heads.get_mut(discrete.0)[0] = node;
        self.on_stack.set(node, true);
        self.is_last.set(node, head == NONE);
        self.is_sure.set(node, is_sure);
        node
    }

    /// Notes that no run starts in a node, and drops the nodes whose zones it contains from the
    /// list of its words.
    pub(super) fn leave(&mut self, node: u32) {
        self.on_stack.set(node, false);
        if !self.has_clocks {
            return;
        }
        let discrete = self.discrete(node);
        let outer = self.zone(node);
        let mut previous = NONE;
        let mut other = self.heads.first(discrete.0);
        while other != NONE {
            let next = self.next(other);
            let inner = self.zone(other);
            let is_covered = other != node
                && !self.on_stack.get(other)
                && (self.is_sure.get(node) || !self.is_sure.get(other))
                && self.zones.is_subset(inner, outer);
            if is_covered {
                self.zones.release(inner);
                self.unlink(previous, other, discrete);
            } else {
                previous = other;
            }
            other = next;
        }
    }

    /// Takes a node out of its list.
    fn unlink(&mut self, previous: u32, node: u32, discrete: DiscreteId) {
        let next = self.links.get(node)[1];
        if previous == NONE {
            self.heads.get_mut(discrete.0)[0] = self.next(node);
        } else {
            self.links.get_mut(previous)[1] = next;
            self.is_last.set(previous, self.is_last.get(node));
        }
    }

    /// The words of a node on the stack.
    pub(super) fn discrete(&self, node: u32) -> DiscreteId {
        if !self.has_clocks {
            return DiscreteId(node);
        }
        let mut last = node;
        while !self.is_last.get(last) {
            last = self.links.get(last)[1];
        }
        DiscreteId(self.links.get(last)[1])
    }

    /// Writes the zone of a node on the stack.
    pub(super) fn load(&self, node: u32, zone: &mut [Bound]) {
        if self.has_clocks {
            self.zones.load(self.zone(node), zone);
        }
    }

    fn zone(&self, node: u32) -> ZoneId {
        ZoneId(self.links.first(node))
    }

    /// The next node with the same words.
    fn next(&self, node: u32) -> u32 {
        if self.is_last.get(node) {
            NONE
        } else {
            self.links.get(node)[1]
        }
    }
}

/// A bit for each number, 0 until it is set.
#[derive(Debug, Default)]
struct Bits(Vec<u64>);

impl Bits {
    fn get(&self, number: u32) -> bool {
        let bits = self.0.get(number as usize / 64);
        bits.is_some_and(|bits| bits >> (number % 64) & 1 == 1)
    }

    fn set(&mut self, number: u32, value: bool) {
        let place = number as usize / 64;
        if place >= self.0.len() {
            self.0.resize(place + 1, 0);
        }
        let bits = &mut self.0[place];
        *bits = *bits & !(1 << (number % 64)) | u64::from(value) << (number % 64);
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}
