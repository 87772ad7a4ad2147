//! The zones of each discrete state, with their signatures.
//!
//! Short lists are searched as a whole. A long one is split by its mean signature: if a zone lies
//! in another one, no number of its signature is greater. So the numbers that are at least the
//! mean's show in which parts a larger or smaller zone may lie. Parts that grow long are split
//! again.
//!
//! Nothing that a caller sees depends on the order in a list.
//!
//! Cost: a search in a list that is not split takes less than a nanosecond for each entry. In a
//! list that is split, it visits about (3/4)^8 of the parts, if the eight numbers are independent.

use crate::cancellation;
use crate::zones::zone_table::ZoneId;

use super::discrete_states::DiscreteId;
use super::signature::Signature;

/// A zone in the list of a discrete state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) signature: Signature,
    pub(super) zone: ZoneId,
    pub(super) node: u32,
}

/// A list: this many entries from `first` on, in a place whose length is the next power of two; or
/// [`SPLIT`], and the number of the split; or the only zone, and its node with [`ALONE`].
#[derive(Clone, Copy, Debug)]
struct List {
    first: u32,
    len: u32,
}

/// The length of a list that is split.
const SPLIT: u32 = u32::MAX;

/// Marks the node of the only zone of a discrete state, which needs no signature. Most discrete
/// states of many models have one zone.
const ALONE: u32 = 1 << 31;

/// A list is split when it has this many entries, or twice as many after a split in vain.
const LONG: u32 = 128;

const EMPTY: List = List { first: 0, len: 0 };

impl List {
    /// The list of this zone alone, if its node is small enough.
    fn alone(entry: Entry) -> Option<List> {
        (entry.node < SPLIT & !ALONE).then_some(List {
            first: entry.zone.0,
            len: entry.node | ALONE,
        })
    }

    /// The only zone, and its node.
    fn only(self) -> Option<(ZoneId, u32)> {
        let is_alone = self.len & ALONE != 0 && self.len != SPLIT;
        is_alone.then_some((ZoneId(self.first), self.len & !ALONE))
    }
}

/// A long list in parts.
#[derive(Debug)]
struct Split {
    mean: Signature,
    /// By which numbers of the signatures are at least the mean's.
    parts: Vec<(u8, List)>,
}

/// Where a list stands.
#[derive(Clone, Copy, Debug)]
enum At {
    Discrete(DiscreteId),
    /// A part of a split.
    Part(u32, u32),
}

/// Lists of entries.
#[derive(Debug, Default)]
pub(super) struct Lists {
    entries: Vec<Entry>,
    /// By discrete state: its entries.
    by_discrete: Vec<List>,
    splits: Vec<Split>,
    may_split: bool,
    /// The parts of all splits.
    parts: usize,
    /// By exponent of their size: the places that are not in use.
    free: Vec<Vec<u32>>,
}

impl Lists {
    /// No lists. `may_split`: whether long ones are to be taken apart.
    pub(super) fn new(may_split: bool) -> Lists {
        Lists {
            may_split,
            ..Lists::default()
        }
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        let free = self.free.iter().map(|places| size_of_val(&**places));
        size_of_val(&*self.entries)
            + size_of_val(&*self.by_discrete)
            + size_of_val(&*self.splits)
            + self.parts * size_of::<(u8, List)>()
            + free.sum::<usize>()
    }

    /// Adds a discrete state without entries.
    pub(super) fn open(&mut self) {
        self.by_discrete.push(EMPTY);
    }

    /// Whether a zone of a discrete state that may contain one with this signature does.
    pub(super) fn any_above(
        &mut self,
        discrete: DiscreteId,
        proposed: Signature,
        mut contains: impl FnMut(ZoneId) -> bool,
    ) -> bool {
        self.any_above_in(At::Discrete(discrete), proposed, &mut contains)
    }

    fn any_above_in(
        &mut self,
        at: At,
        proposed: Signature,
        contains: &mut dyn FnMut(ZoneId) -> bool,
    ) -> bool {
        let list = self.list(at);
        if let Some((zone, _)) = list.only() {
            return contains(zone);
        }
        let List { first, len } = list;
        if len == SPLIT {
            let split = &self.splits[first as usize];
            let reached = proposed.reaches(split.mean);
            // The last parts are those that came last.
            return (0..split.parts.len()).rev().any(|part| {
                let (other, _) = self.splits[first as usize].parts[part];
                reached & !other == 0
                    && self.any_above_in(At::Part(first, part as u32), proposed, contains)
            });
        }
        let entries = &mut self.entries[first as usize..][..len as usize];
        // The last ones come first.
        let container = entries
            .iter()
            .rposition(|entry| proposed.may_be_within(entry.signature) && contains(entry.zone));
        // What contains one zone often contains the next one.
        let last = entries.len().saturating_sub(1);
        container
            .inspect(|&place| entries.swap(place, last))
            .is_some()
    }

    /// Takes out the zones of a discrete state that may lie in one with this signature and do.
    pub(super) fn remove_below(
        &mut self,
        discrete: DiscreteId,
        proposed: Signature,
        mut is_within: impl FnMut(ZoneId, u32) -> bool,
    ) {
        self.remove_below_in(At::Discrete(discrete), proposed, &mut is_within);
    }

    fn remove_below_in(
        &mut self,
        at: At,
        proposed: Signature,
        is_within: &mut dyn FnMut(ZoneId, u32) -> bool,
    ) {
        let list = self.list(at);
        if let Some((zone, node)) = list.only() {
            if is_within(zone, node) {
                self.set(at, EMPTY);
            }
            return;
        }
        let List { first, len } = list;
        if len == SPLIT {
            let split = &self.splits[first as usize];
            let reached = proposed.reaches(split.mean);
            for part in 0..split.parts.len() {
                let (other, _) = self.splits[first as usize].parts[part];
                if other & !reached == 0 {
                    self.remove_below_in(At::Part(first, part as u32), proposed, is_within);
                }
            }
            return;
        }
        // Where one is taken out, one that was looked at takes its place.
        for index in (0..len as usize).rev() {
            let entry = self.entries[self.list(at).first as usize + index];
            if entry.signature.may_be_within(proposed) && is_within(entry.zone, entry.node) {
                self.remove(at, index);
            }
        }
    }

    /// Adds an entry. `signature_of` is asked for the signature of a zone that was alone.
    pub(super) fn push(
        &mut self,
        discrete: DiscreteId,
        entry: Entry,
        signature_of: impl FnOnce(ZoneId) -> Signature,
    ) {
        let mut at = At::Discrete(discrete);
        let list = self.list(at);
        if let Some((zone, node)) = list.only() {
            let signature = signature_of(zone);
            self.set(at, EMPTY);
            self.push_at(
                at,
                Entry {
                    signature,
                    zone,
                    node,
                },
            );
        } else if list.len == 0
            && let Some(alone) = List::alone(entry)
        {
            return self.set(at, alone);
        }
        loop {
            let list = self.list(at);
            if list.len == SPLIT {
                at = self.part_for(list.first, entry.signature);
            } else if self.may_split
                && list.len >= LONG
                && list.len.is_power_of_two()
                && self.split(at)
            {
                // Now it has parts.
            } else {
                return self.push_at(at, entry);
            }
        }
    }

    fn list(&self, at: At) -> List {
        match at {
            At::Discrete(discrete) => self.by_discrete[discrete.0 as usize],
            At::Part(split, part) => self.splits[split as usize].parts[part as usize].1,
        }
    }

    fn set(&mut self, at: At, list: List) {
        match at {
            At::Discrete(discrete) => self.by_discrete[discrete.0 as usize] = list,
            At::Part(split, part) => self.splits[split as usize].parts[part as usize].1 = list,
        }
    }

    /// The part of a split in which a signature belongs, which may be new.
    fn part_for(&mut self, split: u32, signature: Signature) -> At {
        let Split { mean, parts } = &mut self.splits[split as usize];
        let reached = signature.reaches(*mean);
        let known = parts.iter().position(|(other, _)| *other == reached);
        let part = known.unwrap_or_else(|| {
            parts.push((reached, EMPTY));
            self.parts += 1;
            parts.len() - 1
        });
        At::Part(split, part as u32)
    }

    /// Splits a list, unless all its signatures are the same.
    fn split(&mut self, at: At) -> bool {
        let List { first, len } = self.list(at);
        let range = first as usize..(first + len) as usize;
        let signatures = self.entries[range.clone()].iter();
        let Some(mean) = Signature::mean(&signatures.map(|entry| entry.signature)) else {
            return false;
        };
        let number = cancellation::number(self.splits.len());
        self.splits.push(Split {
            mean,
            parts: Vec::new(),
        });
        self.set(
            at,
            List {
                first: number,
                len: SPLIT,
            },
        );
        for index in range {
            let entry = self.entries[index];
            let part = self.part_for(number, entry.signature);
            self.push_at(part, entry);
        }
        self.release(len.ilog2() as usize, first);
        true
    }

    fn push_at(&mut self, at: At, entry: Entry) {
        let List { first, len } = self.list(at);
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
        self.set(
            at,
            List {
                first: place,
                len: len + 1,
            },
        );
    }

    /// Takes an entry out; the last one takes its place.
    fn remove(&mut self, at: At, index: usize) {
        let List { first, len } = self.list(at);
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
        self.set(
            at,
            List {
                first: place,
                len: last,
            },
        );
    }

    /// A place for 2^exponent entries, which mean nothing if it is new.
    fn place(&mut self, exponent: usize, filler: Entry) -> u32 {
        let free = self.free.get_mut(exponent).and_then(Vec::pop);
        free.unwrap_or_else(|| {
            let first = self.entries.len();
            let end = cancellation::number(first + (1 << exponent));
            self.entries.resize(end as usize, filler);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self, below: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005) + 1;
            (self.0 >> 33) % below
        }

        fn signature(&mut self, spread: u64) -> Signature {
            Signature::of(std::array::from_fn(|_| self.next(spread) as u32))
        }
    }

    /// Lists and vectors of the same entries are asked and changed in the same ways.
    fn check(spread: u64, count: u32) {
        let mut numbers = Numbers(u64::from(count) + spread);
        let mut lists = Lists::new(true);
        let mut vectors: [Vec<Entry>; 2] = Default::default();
        let mut signatures: Vec<Signature> = Vec::new();
        lists.open();
        lists.open();
        for node in 0..count {
            let which = numbers.next(2) as usize;
            let discrete = DiscreteId(which as u32);
            let (own, bit) = (numbers.signature(spread), numbers.next(3) as u32);
            // As if a third of what may be contained were.
            let is_related = |zone: ZoneId| zone.0 % 3 == bit;
            let all = vectors[which].iter();
            let mut above = all.filter(|one| own.may_be_within(one.signature));
            let expected = above.any(|one| is_related(one.zone));
            let contains =
                |zone: ZoneId| own.may_be_within(signatures[zone.0 as usize]) && is_related(zone);
            assert_eq!(lists.any_above(discrete, own, contains), expected);
            let is_below = |one: &Entry| one.signature.may_be_within(own) && is_related(one.zone);
            let mut gone: Vec<u32> = Vec::new();
            lists.remove_below(discrete, own, |zone, node| {
                let signature = signatures[zone.0 as usize];
                let is_within = signature.may_be_within(own) && is_related(zone);
                gone.extend(is_within.then_some(node));
                is_within
            });
            gone.sort_unstable();
            let below = vectors[which].iter().filter(|one| is_below(one));
            assert_eq!(gone, below.map(|one| one.node).collect::<Vec<u32>>());
            vectors[which].retain(|one| !is_below(one));
            let entry = Entry {
                signature: own,
                zone: ZoneId(node),
                node,
            };
            lists.push(discrete, entry, |zone| signatures[zone.0 as usize]);
            signatures.push(own);
            vectors[which].push(entry);
        }
        assert!(spread < 9 || !lists.splits.is_empty());
    }

    #[test]
    fn lists_that_are_split_answer_as_those_that_are_not() {
        for spread in [1, 9, 0x7fff] {
            for count in [3, 300, 3000] {
                if count == 3000 || spread < 9 {
                    check(spread, count);
                }
            }
        }
    }
}
