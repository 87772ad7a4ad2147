//! The effects of moves on clocks, packed into words; each is stored once.

use hashbrown::HashTable;

use crate::exec::EmittedAssignment;
use crate::ir::{ClockId, FixedConstraint};

/// Effects; each is stored once, as words that determine the result. The first words say how many
/// words there are up to the end of the guard, of the assignments and of the invariant. Then come
/// these parts, whether time may pass, and the constants with which clocks are compared afterwards.
#[derive(Debug, Default)]
pub(super) struct PackedEffects {
    /// The words of all effects, one after the other.
    pub(super) words: Vec<u32>,
    /// Where the words of each effect end.
    pub(super) ends: Vec<u32>,
    pub(super) table: HashTable<u32>,
    /// The words of the current effect.
    pub(super) key: Vec<u32>,
}

/// The indices of the first words of an effect, which say where its parts end.
pub(super) const GUARD: usize = 0;
pub(super) const ASSIGNMENTS: usize = 1;
pub(super) const INVARIANT: usize = 2;
pub(super) const FRONT: usize = 3;

impl PackedEffects {
    pub(super) fn bytes(&self) -> usize {
        (self.words.capacity() + self.ends.capacity()) * size_of::<u32>()
            + self.table.capacity() * (size_of::<u32>() + 1) * 8 / 7
    }

    pub(super) fn clear(&mut self) {
        self.words.clear();
        self.ends.clear();
        self.table.clear();
    }

    /// Begins an effect.
    pub(super) fn begin(&mut self) {
        self.key.clear();
        self.key.resize(FRONT, 0);
    }

    pub(super) fn end(&mut self, part: usize) {
        self.key[part] = self.key.len() as u32;
    }

    pub(super) fn add_constraints(&mut self, emitted: &[FixedConstraint]) {
        for one in emitted {
            let clocks = packed(one.left, one.right) | u32::from(one.strict) << 31;
            self.key.extend([clocks, one.bound.cast_unsigned()]);
        }
    }

    pub(super) fn add_assignment(&mut self, one: EmittedAssignment) {
        let clocks = packed(one.target, one.source);
        self.key.extend([clocks, one.value.cast_unsigned()]);
    }

    /// The pairs of words between the ends of two parts.
    pub(super) fn pairs(&self, first: usize, end: usize) -> &[[u32; 2]] {
        self.key[first..self.key[end] as usize].as_chunks().0
    }

    pub(super) fn guard(&self) -> Vec<FixedConstraint> {
        constraints(self.pairs(FRONT, GUARD))
    }

    pub(super) fn assignments(&self) -> Vec<EmittedAssignment> {
        let pairs = self.pairs(self.key[GUARD] as usize, ASSIGNMENTS);
        pairs
            .iter()
            .map(|&[clocks, value]| EmittedAssignment {
                target: ClockId(clocks & MOST_CLOCKS),
                source: ClockId(clocks >> CLOCK_BITS),
                value: value.cast_signed(),
            })
            .collect()
    }

    pub(super) fn invariant(&self) -> Vec<FixedConstraint> {
        constraints(self.pairs(self.key[ASSIGNMENTS] as usize, INVARIANT))
    }

    /// The number of the current effect.
    pub(super) fn intern(&mut self) -> u32 {
        let PackedEffects {
            words,
            ends,
            table,
            key,
        } = self;
        let hash_of_key = hash_words(key);
        let is_key = |&index: &u32| entry(words, ends, index) == key.as_slice();
        if let Some(&index) = table.find(hash_of_key, is_key) {
            return index;
        }
        let index = ends.len() as u32;
        words.extend_from_slice(key);
        ends.push(words.len() as u32);
        let hash_of = |&index: &u32| hash_words(entry(words, ends, index));
        table.insert_unique(hash_of_key, index, hash_of);
        index
    }
}

/// The bits of a clock in a word of an effect; the greatest number of clocks is far below.
const CLOCK_BITS: u32 = 15;
/// The greatest clock that fits.
pub(super) const MOST_CLOCKS: u32 = (1 << CLOCK_BITS) - 1;

/// The words of an effect.
fn entry<'w>(words: &'w [u32], ends: &[u32], index: u32) -> &'w [u32] {
    let index = index as usize;
    let first = index.checked_sub(1).map_or(0, |before| ends[before]);
    &words[first as usize..ends[index] as usize]
}

/// Two clocks in the lower 30 bits of a word.
fn packed(first: ClockId, second: ClockId) -> u32 {
    debug_assert!(first.0.max(second.0) <= MOST_CLOCKS);
    first.0 | second.0 << CLOCK_BITS
}

/// The constraints in pairs of words.
fn constraints(pairs: &[[u32; 2]]) -> Vec<FixedConstraint> {
    let constraint = |&[clocks, bound]: &[u32; 2]| FixedConstraint {
        left: ClockId(clocks & MOST_CLOCKS),
        right: ClockId(clocks >> CLOCK_BITS & MOST_CLOCKS),
        bound: bound.cast_signed(),
        strict: clocks >> 31 != 0,
    };
    pairs.iter().map(constraint).collect()
}

/// A hash of words: two lanes of multiply and fold.
fn hash_words(words: &[u32]) -> u64 {
    const FACTORS: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f];
    let mut lanes = FACTORS;
    let mut absorb = |[a, b, c, d]: [u32; 4]| {
        let words = [[a, b], [c, d]].map(|[low, high]| u64::from(low) | u64::from(high) << 32);
        for ((lane, word), factor) in lanes.iter_mut().zip(words).zip(FACTORS) {
            *lane = fold(*lane ^ word, factor);
        }
    };
    let (blocks, rest) = words.as_chunks::<4>();
    blocks.iter().copied().for_each(&mut absorb);
    let mut last = [0; 4];
    last[..rest.len()].copy_from_slice(rest);
    absorb(last);
    fold(lanes[0] ^ lanes[1].rotate_left(32), FACTORS[0])
}

pub(super) fn fold(value: u64, factor: u64) -> u64 {
    let product = value.wrapping_mul(factor);
    product ^ product >> 32
}
