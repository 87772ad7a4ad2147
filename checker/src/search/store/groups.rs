//! Groups of numbers, all of one width, each stored once.
//!
//! Invariants:
//! * Two groups get the same number exactly if they are equal.
//! * Numbers count from 0 in the order of first insertion.
//!
//! Cost: a group takes four bytes for each of its numbers, and six to nine in the table.

use super::bucket_table::BucketTable;
use super::disk::Cold;
use super::hashing::fold;
use super::records::Records;

/// Groups that wait to be stored.
#[derive(Debug, Default)]
pub(super) struct Batch {
    /// One after the other.
    pub(super) groups: Vec<u32>,
    hashes: Vec<u64>,
}

/// Stored groups.
#[derive(Debug)]
pub(super) struct Groups {
    records: Records<u32>,
    /// The numbers by the hashes of their groups.
    table: BucketTable,
    /// Some groups that were asked for lately, by their hashes; none while there are few.
    recent: Vec<u32>,
}

/// How many groups are known as recent.
const RECENT: usize = 1 << 14;

impl Groups {
    /// No groups of this width.
    pub(super) fn new(width: usize) -> Groups {
        Groups {
            records: Records::new(width),
            table: BucketTable::new(),
            recent: Vec::new(),
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.records.len()
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.records.bytes() + self.table.bytes() + size_of_val(&*self.recent)
    }

    /// The most bytes that the next group may take.
    pub(super) fn growth(&self) -> usize {
        self.table.growth()
    }

    /// What may be put on disk.
    pub(super) fn cold(&mut self) -> &mut dyn Cold {
        &mut self.records
    }

    /// The group with a number.
    #[inline]
    pub(super) fn get(&self, number: u32) -> &[u32] {
        self.records.get(number)
    }

    /// The number of a group, if it is stored.
    #[inline]
    pub(super) fn find(&self, group: &[u32]) -> Option<u32> {
        self.find_hashed(hash(group), group)
    }

    #[inline]
    fn find_hashed(&self, hash: u64, group: &[u32]) -> Option<u32> {
        let is_it = |one| is_same(self.get(one), group);
        self.table.find(hash, is_it)
    }

    /// The number of a group, which is stored if it is new; quick for those that come again soon.
    #[inline]
    pub(super) fn intern_recent(&mut self, group: &[u32]) -> u32 {
        let hash = hash(group);
        // So few groups lie in a cache in any case.
        if self.records.len() < RECENT {
            return self.intern_hashed(hash, group).0;
        }
        let place = (hash >> 16) as usize % RECENT;
        if let Some(&guess) = self.recent.get(place)
            && is_same(self.get(guess), group)
        {
            return guess;
        }
        let number = self.intern_hashed(hash, group).0;
        self.recent.resize(RECENT, 0);
        self.recent[place] = number;
        number
    }

    /// The number of a group, and whether it is new.
    #[inline]
    pub(super) fn intern(&mut self, group: &[u32]) -> (u32, bool) {
        self.intern_hashed(hash(group), group)
    }

    #[inline]
    fn intern_hashed(&mut self, hash: u64, group: &[u32]) -> (u32, bool) {
        match self.find_hashed(hash, group) {
            Some(known) => (known, false),
            None => (self.push(hash, group), true),
        }
    }

    /// Like [`Groups::intern`], for several groups in their order.
    ///
    /// What they are compared with lies where no cache has it. So first it is read for all of them,
    /// without a decision, so that the reads overlap.
    pub(super) fn intern_all(&mut self, batch: &mut Batch, mut each: impl FnMut(u32, bool)) {
        let width = self.records.size();
        let Batch { groups, hashes } = batch;
        hashes.clear();
        let mut touched = 0;
        for group in groups.chunks_exact(width) {
            let hash = hash(group);
            touched ^= u32::from(self.table.touch(hash));
            hashes.push(hash);
        }
        for &hash in &*hashes {
            let guess = self.table.guess(hash).unwrap_or(0);
            touched ^= self.records.first(guess);
        }
        std::hint::black_box(touched);
        for (&hash, group) in hashes.iter().zip(groups.chunks_exact(width)) {
            let (number, is_new) = self.intern_hashed(hash, group);
            each(number, is_new);
        }
        groups.clear();
    }

    #[inline(never)]
    fn push(&mut self, of_group: u64, group: &[u32]) -> u32 {
        let number = self.records.push(group);
        let records = &self.records;
        self.table
            .push(of_group, |one| hash(records.get_in_order(one)));
        number
    }
}

/// Whether two groups are the same. They are short, so that a call would take longer.
fn is_same(one: &[u32], other: &[u32]) -> bool {
    one.iter().zip(other).all(|(one, other)| one == other)
}

/// Numbers that follow each other must differ in all bits: the table uses the upper and the lower
/// ones. Four lanes are mixed apart, so that the multiplications overlap.
fn hash(group: &[u32]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut lanes = [0x1656_67b1_9e37_79f9_u64, 1, 2, 3];
    let mut absorb = |block: &[u32; 8]| {
        for (lane, &[first, second]) in lanes.iter_mut().zip(block.as_chunks::<2>().0) {
            let pair = u64::from(first) | u64::from(second) << 32;
            *lane = fold(*lane ^ pair, FACTOR);
        }
    };
    let (blocks, rest) = group.as_chunks::<8>();
    blocks.iter().for_each(&mut absorb);
    if !rest.is_empty() {
        // A copy of so few numbers is not worth a call.
        absorb(&std::array::from_fn(|place| {
            rest.get(place).copied().unwrap_or(0)
        }));
    }
    let all = lanes
        .iter()
        .fold(0, |mixed, lane| fold(mixed ^ lane, FACTOR));
    all ^ (all >> 32)
}

#[cfg(test)]
mod tests {
    use super::Groups;

    #[test]
    fn groups_keep_their_numbers() {
        for width in [1, 2, 3, 8] {
            let mut groups = Groups::new(width);
            let group = |number: u32| {
                let mut group = vec![7; width];
                group[width - 1] = (number % 100) << 20;
                group[0] += number / 100;
                group
            };
            for number in 0..20_000 {
                assert_eq!(groups.find(&group(number)), None);
                assert_eq!(groups.intern(&group(number)), (number, true));
            }
            for number in 0..20_000 {
                assert_eq!(groups.intern(&group(number)), (number, false));
                assert_eq!(groups.get(number), group(number));
            }
            assert_eq!(groups.find(&vec![u32::MAX; width]), None);
            assert!(groups.bytes() >= 20_000 * 4 * (width + 1));
        }
    }
}
