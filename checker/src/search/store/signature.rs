//! Signatures of zones: digests that grow with a zone, so that most zones can be distinguished
//! without comparing them.

use crate::zones::Bound;

/// Sums of bytes with at most such a sum of weights are below 2^15.
const NARROW: i32 = 255;

/// If zones have fewer clocks than this, with the reference clock, hardly more than one bound
/// counts for each number of a signature, however they are divided.
const FEW_CLOCKS: usize = 6;

/// The number of successive bounds after which the numbers of a signature start again with the
/// first one, and whether bounds have weights.
///
/// If a clock was reset a little later, the bounds of its column are greater and those of its row
/// smaller, or the other way round. So a number is the sum of columns: the columns of one clock
/// show the change in one direction, all others in the opposite direction. In sums that mix rows
/// and columns it would cancel out.
fn period(dimension: usize) -> Period {
    if dimension < FEW_CLOCKS {
        Period {
            length: dimension * dimension,
            is_weighted: true,
        }
    } else {
        Period {
            length: dimension,
            is_weighted: false,
        }
    }
}

/// How bounds are shared out among the numbers of a signature.
#[derive(Clone, Copy, Debug)]
struct Period {
    /// The number of successive bounds after which the numbers start again with the first one.
    length: usize,
    /// Whether bounds have weights.
    is_weighted: bool,
}

/// The factor of the bounds of a block of eight in the sums of a signature.
///
/// Bounds on a difference and on its negative often lie in the same lane, and would cancel out
/// where a difference is exact.
fn weight(block: usize, is_weighted: bool) -> i32 {
    if is_weighted {
        1 + (block & 3) as i32
    } else {
        1
    }
}

/// The weighted sums of every eighth bound of a period. A bound counts from the negated greatest
/// one on less one, and up to the greatest.
fn sums(matrix: &[Bound], greatest: i32, period: Period) -> [i32; 8] {
    let mut sums = [0; 8];
    let mut add = |bounds: &[Bound], index| {
        for (sum, bound) in sums.iter_mut().zip(bounds) {
            *sum += weight(index, period.is_weighted) * bound.raw().clamp(-greatest - 1, greatest);
        }
    };
    for row in matrix.chunks_exact(period.length) {
        let (blocks, rest) = row.as_chunks::<8>();
        for (index, block) in blocks.iter().enumerate() {
            add(block, index);
        }
        add(rest, blocks.len());
    }
    sums
}

/// As [`sums`] for entries whose greatest sum is below 2^15, in as narrow lanes.
fn narrow_sums(matrix: &[i16], greatest: i16, period: Period) -> [i32; 8] {
    let mut sums = [0_i16; 8];
    let mut add = |entries: &[i16], index| {
        let weight = weight(index, period.is_weighted) as i16;
        for (sum, entry) in sums.iter_mut().zip(entries) {
            *sum += weight * (*entry).clamp(-greatest - 1, greatest);
        }
    };
    for row in matrix.chunks_exact(period.length) {
        let (blocks, rest) = row.as_chunks::<8>();
        for (index, block) in blocks.iter().enumerate() {
            add(block, index);
        }
        add(rest, blocks.len());
    }
    sums.map(i32::from)
}

/// The entries of a matrix packed into bytes, or its demands if there are limits; only as exact as
/// [`narrow_sums`] needs.
pub(super) fn widen_narrow(matrix: &[u8], limits: &[Bound], dimension: usize, target: &mut [i16]) {
    const NONE: i16 = -1 << 14;
    for (entry, byte) in target.iter_mut().zip(matrix) {
        let byte = *byte as i8;
        let is_infinite = -i16::from(byte == i8::MAX);
        let is_no_demand = -i16::from(byte == i8::MIN);
        let wide = i16::from(byte) & !is_infinite | i16::MAX & is_infinite;
        *entry = wide & !is_no_demand | NONE & is_no_demand;
    }
    let (lower_bounds, others) = target.split_at_mut(dimension);
    // Without limits there is nothing to do.
    for (row, limit) in others
        .chunks_exact_mut(dimension)
        .zip(limits.iter().skip(1))
    {
        let limit = limit.raw().clamp(NONE.into(), -i32::from(NONE) - 1) as i16;
        for (entry, lower) in row.iter_mut().zip(&*lower_bounds) {
            *entry = (*entry).min((limit + 2 + lower) & !1);
        }
    }
}

/// How the signatures of zones of one dimension are made.
#[derive(Debug)]
pub(super) struct Signatures {
    /// The number of successive bounds after which the numbers start again with the first one, and
    /// whether bounds have weights.
    period: Period,
    /// Encoded bounds from here on look alike.
    greatest: i32,
    /// By number: the sum of the weights of its bounds.
    weights: [i32; 8],
    /// The factor from sums of bounds to numbers, over 2^32.
    scale: u64,
}

impl Signatures {
    /// Those of zones of this dimension, most of whose constants are at most `greatest`.
    pub(super) fn new(dimension: usize, greatest: i32) -> Signatures {
        let mut weights = [0; 8];
        let period = period(dimension);
        for entry in 0..dimension * dimension {
            let place = entry % period.length;
            weights[place % 8] += weight(place / 8, period.is_weighted);
        }
        // Sums of this many bounds must fit into a word.
        let greatest = (2 * greatest.clamp(0, Bound::MAX_VALUE) + 1).min((1 << 29) / weights[0]);
        let most = i64::from(weights[0]) * i64::from(2 * greatest + 1);
        Signatures {
            period,
            greatest,
            weights,
            scale: ((0x7fff << 32) / most as u64).min(1 << 32),
        }
    }

    /// Whether [`Signatures::of_narrow`] is possible for bounds of one byte.
    pub(super) fn are_narrow(&self) -> bool {
        self.greatest < i8::MAX.into() && self.weights[0] <= NARROW
    }

    /// The signature of a matrix, or of the demands of a zone.
    pub(super) fn of(&self, matrix: &[Bound]) -> Signature {
        self.scaled(sums(matrix, self.greatest, self.period))
    }

    /// The same of what [`widen_narrow`] makes of them.
    pub(super) fn of_narrow(&self, matrix: &[i16]) -> Signature {
        self.scaled(narrow_sums(matrix, self.greatest as i16, self.period))
    }

    fn scaled(&self, sums: [i32; 8]) -> Signature {
        let number = |lane: usize| {
            let above_least = sums[lane] + (self.greatest + 1) * self.weights[lane];
            ((above_least as u64 * self.scale) >> 32) as u32
        };
        Signature::of(std::array::from_fn(number))
    }
}

/// A digest of a zone, or of its demands if it is reduced, that grows with it: eight numbers of
/// fifteen bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Signature([u32; 4]);

impl Signature {
    /// Whether a zone with this signature may be a subset of one with the other; false is certain.
    #[inline]
    pub(super) fn may_be_within(self, other: Signature) -> bool {
        // No number borrows from its neighbour, and the sixteenth bit is left where it is not
        // greater.
        const SIXTEENTH_BITS: u64 = 0x8000_8000_8000_8000;
        let left = |half: usize| (other.half(half) | SIXTEENTH_BITS) - self.half(half);
        left(0) & left(1) & SIXTEENTH_BITS == SIXTEENTH_BITS
    }

    /// By number, the first lowest: whether it is at least that of the other.
    #[inline]
    pub(super) fn reaches(self, other: Signature) -> u8 {
        const SIXTEENTH_BITS: u64 = 0x8000_8000_8000_8000;
        // Brings the bits 0, 16, 32 and 48 to 48 to 51.
        const GATHER: u64 = 1 << 48 | 1 << 33 | 1 << 18 | 1 << 3;
        let bits = |half: usize| {
            let left = (self.half(half) | SIXTEENTH_BITS) - other.half(half);
            ((left & SIXTEENTH_BITS) >> 15).wrapping_mul(GATHER) >> 48 & 15
        };
        (bits(0) | bits(1) << 4) as u8
    }

    /// The numbers in the middle of those of others, rounded up; `None` if these are all the same.
    pub(super) fn mean(
        signatures: &(impl Iterator<Item = Signature> + Clone),
    ) -> Option<Signature> {
        let first = signatures.clone().next()?;
        if signatures.clone().all(|one| one == first) {
            return None;
        }
        let count = signatures.clone().count() as u64;
        let sum = |lane| {
            signatures
                .clone()
                .map(|one| u64::from(one.number(lane)))
                .sum()
        };
        let mean = |lane: usize| u64::div_ceil(sum(lane), count) as u32;
        Some(Signature::of(std::array::from_fn(mean)))
    }

    /// One with these numbers, which have fifteen bits.
    pub(super) fn of(numbers: [u32; 8]) -> Signature {
        Signature(std::array::from_fn(|pair| {
            numbers[2 * pair] | numbers[2 * pair + 1] << 16
        }))
    }

    fn number(self, lane: usize) -> u32 {
        self.0[lane / 2] >> (16 * (lane % 2)) & 0xffff
    }

    #[inline]
    fn half(self, half: usize) -> u64 {
        u64::from(self.0[2 * half]) | u64::from(self.0[2 * half + 1]) << 32
    }
}
