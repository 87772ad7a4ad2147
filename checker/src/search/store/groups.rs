//! Groups of numbers, all of one width, each stored once.
//!
//! Invariants:
//! * Two groups get the same number exactly if they are equal.
//! * Numbers count from 0 in the order of first insertion.
//!
//! Cost: a group takes four bytes for each of its numbers, and six to eleven in the table.

use crate::cancellation;

use super::segmented_table::PiecedTable;

/// Numbers in a block, about.
const BLOCK_NUMBERS: usize = 1 << 14;

/// Stored groups.
#[derive(Debug)]
pub(super) struct Groups {
    width: usize,
    /// The groups by their numbers, in blocks that are never moved.
    blocks: Vec<Vec<u32>>,
    /// Groups in a block, as a power of two.
    block_bits: u32,
    count: u32,
    /// The numbers by the hashes of their groups.
    table: PiecedTable<u32>,
}

impl Groups {
    /// No groups of this width.
    pub(super) fn new(width: usize) -> Groups {
        Groups {
            width,
            blocks: Vec::new(),
            block_bits: (BLOCK_NUMBERS / width).max(1).ilog2(),
            count: 0,
            table: PiecedTable::new(),
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count as usize
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        let block = (self.width << self.block_bits) * size_of::<u32>();
        self.blocks.len() * block + self.table.bytes()
    }

    /// The group with a number.
    #[inline]
    pub(super) fn get(&self, number: u32) -> &[u32] {
        at(&self.blocks, self.block_bits, self.width, number)
    }

    /// The number of a group, if it is stored.
    #[inline]
    pub(super) fn find(&self, group: &[u32]) -> Option<u32> {
        self.find_hashed(hash(group), group)
    }

    #[inline]
    fn find_hashed(&self, hash: u64, group: &[u32]) -> Option<u32> {
        let is_it = |&one: &u32| is_same(self.get(one), group);
        self.table.find(hash, is_it).copied()
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
        let number = cancellation::number(self.count as usize);
        self.count += 1;
        if number as usize >> self.block_bits == self.blocks.len() {
            let block = Vec::with_capacity(self.width << self.block_bits);
            self.blocks.push(block);
        }
        let block = self.blocks.last_mut();
        block
            .expect("a block was just made if there was none")
            .extend_from_slice(group);
        let (blocks, bits, width) = (&self.blocks, self.block_bits, self.width);
        let hash_of = |&one: &u32| hash(at(blocks, bits, width, one));
        self.table.insert_unique(of_group, number, hash_of);
        number
    }
}

#[inline]
fn at(blocks: &[Vec<u32>], bits: u32, width: usize, number: u32) -> &[u32] {
    let within = number as usize & ((1 << bits) - 1);
    &blocks[number as usize >> bits][within * width..][..width]
}

/// Whether two groups are the same. They are short, so that a call would take longer.
fn is_same(one: &[u32], other: &[u32]) -> bool {
    one.iter().zip(other).all(|(one, other)| one == other)
}

/// Numbers that follow each other must differ in all bits: the table uses the upper and the lower
/// ones.
fn hash(group: &[u32]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    // Of a long group four lanes are mixed apart, so that the multiplications overlap.
    let (blocks, rest) = group.as_chunks::<8>();
    let mut lanes = [0x1656_67b1_9e37_79f9_u64, 1, 2, 3];
    for block in blocks {
        for (lane, &[first, second]) in lanes.iter_mut().zip(block.as_chunks::<2>().0) {
            let pair = u64::from(first) | u64::from(second) << 32;
            *lane = (*lane ^ pair).wrapping_mul(FACTOR);
            *lane ^= *lane >> 32;
        }
    }
    let mut mixed = lanes[0];
    if !blocks.is_empty() {
        for lane in &lanes[1..] {
            mixed = (mixed ^ lane).wrapping_mul(FACTOR);
            mixed ^= mixed >> 32;
        }
    }
    let (pairs, rest) = rest.as_chunks::<2>();
    for &[first, second] in pairs {
        let pair = u64::from(first) | u64::from(second) << 32;
        mixed = (mixed ^ pair).wrapping_mul(FACTOR);
        mixed ^= mixed >> 32;
    }
    for &last in rest {
        mixed = (mixed ^ u64::from(last)).wrapping_mul(FACTOR);
        mixed ^= mixed >> 32;
    }
    let mixed = mixed.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    mixed ^ mixed >> 32
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
