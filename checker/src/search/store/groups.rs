//! Groups of numbers, all of one width, each stored once.
//!
//! Invariants:
//! * Two groups get the same number exactly if they are equal.
//! * Numbers count from 0 in the order of first insertion.
//!
//! Cost: a group takes four bytes for each of its numbers, and six to nine in the table.

use super::bucket_table::BucketTable;
use super::hashing::fold;
use super::records::Records;

/// Stored groups.
#[derive(Debug)]
pub(super) struct Groups {
    groups: Records<u32>,
    /// The numbers by the hashes of their groups.
    table: BucketTable,
}

impl Groups {
    /// No groups of this width.
    pub(super) fn new(width: usize) -> Groups {
        Groups {
            groups: Records::new(width),
            table: BucketTable::new(),
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.groups.bytes() + self.table.bytes()
    }

    /// The group with a number.
    #[inline]
    pub(super) fn get(&self, number: u32) -> &[u32] {
        self.groups.get(number)
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

    /// The number of a group, and whether it is new.
    #[inline]
    pub(super) fn intern(&mut self, group: &[u32]) -> (u32, bool) {
        let hash = hash(group);
        match self.find_hashed(hash, group) {
            Some(known) => (known, false),
            None => (self.push(hash, group), true),
        }
    }

    #[inline(never)]
    fn push(&mut self, of_group: u64, group: &[u32]) -> u32 {
        let number = self.groups.push(group);
        let groups = &self.groups;
        self.table.push(of_group, |one| hash(groups.get(one)));
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
