//! Pairs of numbers, each stored once.
//!
//! Invariants:
//! * Two pairs get the same number exactly if they are equal.
//! * Numbers count from 0 in the order of first insertion.
//!
//! Cost: a pair takes eight bytes, and four to nine in the table.

use crate::cancellation;

use super::segmented_table::PiecedTable;

/// Pairs in a block, as a power of two.
const BLOCK_BITS: u32 = 13;

/// Stored pairs.
#[derive(Debug)]
pub(super) struct Pairs {
    /// The pairs by their numbers, in blocks that are never moved. The first one of a pair is the
    /// lower half.
    blocks: Vec<Vec<u64>>,
    count: u32,
    /// The numbers by the hashes of their pairs.
    table: PiecedTable<u32>,
}

impl Pairs {
    /// No pairs.
    pub(super) fn new() -> Pairs {
        Pairs {
            blocks: Vec::new(),
            count: 0,
            table: PiecedTable::new(),
        }
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.blocks.len() * (size_of::<u64>() << BLOCK_BITS) + self.table.bytes()
    }

    /// The pair with a number.
    #[inline]
    pub(super) fn get(&self, number: u32) -> [u32; 2] {
        let pair = at(&self.blocks, number);
        [pair as u32, (pair >> 32) as u32]
    }

    /// The number of a pair, if it is stored.
    #[inline]
    pub(super) fn find(&self, pair: [u32; 2]) -> Option<u32> {
        let pair = packed(pair);
        let is_it = |&one: &u32| at(&self.blocks, one) == pair;
        self.table.find(hash(pair), is_it).copied()
    }

    /// The number of a pair, and whether it is new.
    #[inline]
    pub(super) fn intern(&mut self, pair: [u32; 2]) -> (u32, bool) {
        match self.find(pair) {
            Some(known) => (known, false),
            None => (self.push(packed(pair)), true),
        }
    }

    fn push(&mut self, pair: u64) -> u32 {
        let number = cancellation::number(self.count as usize);
        self.count += 1;
        if number as usize >> BLOCK_BITS == self.blocks.len() {
            self.blocks.push(Vec::with_capacity(1 << BLOCK_BITS));
        }
        let block = self.blocks.last_mut();
        block
            .expect("a block was just made if there was none")
            .push(pair);
        let blocks = &self.blocks;
        self.table
            .insert_unique(hash(pair), number, |&one| hash(at(blocks, one)));
        number
    }
}

#[inline]
fn at(blocks: &[Vec<u64>], number: u32) -> u64 {
    let within = number as usize & ((1 << BLOCK_BITS) - 1);
    blocks[number as usize >> BLOCK_BITS][within]
}

fn packed([first, second]: [u32; 2]) -> u64 {
    u64::from(first) | u64::from(second) << 32
}

/// Numbers that follow each other must differ in all bits: the table uses the upper and the lower
/// ones.
fn hash(pair: u64) -> u64 {
    let mixed = (pair ^ pair >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    mixed ^ mixed >> 32
}

#[cfg(test)]
mod tests {
    use super::Pairs;

    #[test]
    fn pairs_keep_their_numbers() {
        let mut pairs = Pairs::new();
        let all = (0..200_u32).flat_map(|first| (0..100).map(move |second| [first, second << 20]));
        for (number, pair) in (0..).zip(all.clone()) {
            assert_eq!(pairs.find(pair), None);
            assert_eq!(pairs.intern(pair), (number, true));
        }
        for (number, pair) in (0..).zip(all) {
            assert_eq!(pairs.intern(pair), (number, false));
            assert_eq!(pairs.get(number), pair);
        }
        assert_eq!(pairs.find([0, 1]), None);
        assert!(pairs.bytes() >= 20_000 * 12);
    }
}
