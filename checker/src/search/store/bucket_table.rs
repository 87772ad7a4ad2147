//! A hash table of numbers, in buckets of one cache line each.
//!
//! A bucket has, for each of its numbers, a byte of the hash, so that a look-up touches one line of
//! the table, and nearly always no other thing than the one that is looked for. A number whose
//! bucket is full stands in the next one that is not.
//!
//! When the table grows, the old buckets are given back before there are new ones, and the numbers
//! are entered again in their order. So it never takes twice the memory, and what the numbers stand
//! for is read as it lies in memory.
//!
//! Invariants:
//! * The numbers are all from 0 to the greatest one.
//! * A bucket before which others are searched has [`Bucket::is_passed`].
//!
//! Cost: six to nine bytes a number.

use crate::cancellation;

/// Numbers in a bucket.
const SLOTS: usize = 12;

/// A table with more numbers than this part of its slots grows,
const FULL: f64 = 0.85;

/// by this factor.
const GROWTH: f64 = 1.5;

/// Numbers that share a line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Bucket {
    numbers: [u32; SLOTS],
    /// Of each number: a byte of its hash that is not 0; where there is no number, 0.
    tags: [u8; SLOTS],
    /// Whether numbers were put into the next bucket because this one was full.
    is_passed: bool,
}

impl Bucket {
    const EMPTY: Bucket = Bucket {
        numbers: [0; SLOTS],
        tags: [0; SLOTS],
        is_passed: false,
    };

    /// The slots with this tag, and perhaps slots after them: the upper bit of a byte for each.
    #[inline]
    fn with_tag(&self, tag: u8) -> u128 {
        const LOW: u128 = u128::from_le_bytes([1; 16]);
        const HIGH: u128 = LOW << 7;
        let mut tags = [!tag; 16];
        tags[..SLOTS].copy_from_slice(&self.tags);
        // A byte is 0 where the tag is this one. Subtracting 1 from all bytes borrows from there on
        // only.
        let other = u128::from_le_bytes(tags) ^ (LOW * u128::from(tag));
        other.wrapping_sub(LOW) & !other & HIGH
    }
}

/// The first of the marked slots.
#[inline]
fn slot(marks: u128) -> usize {
    (marks.trailing_zeros() / 8) as usize
}

/// Numbers by the hashes of what they stand for.
#[derive(Debug)]
pub(super) struct BucketTable {
    buckets: Vec<Bucket>,
    count: u32,
}

impl BucketTable {
    /// An empty table.
    pub(super) fn new() -> BucketTable {
        BucketTable {
            buckets: vec![Bucket::EMPTY],
            count: 0,
        }
    }

    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.buckets)
    }

    /// The number with this hash that is the one looked for.
    #[inline]
    pub(super) fn find(&self, hash: u64, mut is_it: impl FnMut(u32) -> bool) -> Option<u32> {
        let tag = tag(hash);
        let mut place = self.place(hash);
        loop {
            let bucket = &self.buckets[place];
            let mut equal = bucket.with_tag(tag);
            while equal != 0 {
                let number = bucket.numbers[slot(equal)];
                if is_it(number) {
                    return Some(number);
                }
                equal &= equal - 1;
            }
            if !bucket.is_passed {
                return None;
            }
            place = self.next(place);
        }
    }

    /// The first number whose hash has the bits of this one that its bucket shows, if there is one:
    /// probably the one that [`BucketTable::find`] finds.
    #[inline]
    pub(super) fn guess(&self, hash: u64) -> Option<u32> {
        let bucket = &self.buckets[self.place(hash)];
        let equal = bucket.with_tag(tag(hash));
        (equal != 0).then(|| bucket.numbers[slot(equal)])
    }

    /// Reads the bucket of a hash, so that it is in the cache; the result says nothing.
    #[inline]
    pub(super) fn touch(&self, hash: u64) -> u8 {
        self.buckets[self.place(hash)].tags[0]
    }

    /// Enters the next number; `hash_of` says the hash of every number before it.
    #[inline]
    pub(super) fn push(&mut self, hash: u64, hash_of: impl Fn(u32) -> u64) {
        if f64::from(self.count) >= FULL * (self.buckets.len() * SLOTS) as f64 {
            self.grow(hash_of);
        }
        self.enter(hash, self.count);
        self.count += 1;
    }

    /// The buckets by which it grows.
    fn more(&self) -> usize {
        (self.buckets.len() as f64 * (GROWTH - 1.0)) as usize + 1
    }

    /// The bytes by which it grows.
    pub(super) fn growth(&self) -> usize {
        self.more() * size_of::<Bucket>()
    }

    #[inline(never)]
    fn grow(&mut self, hash_of: impl Fn(u32) -> u64) {
        cancellation::ask_for(self.growth());
        let buckets = self.buckets.len() + self.more();
        self.buckets = Vec::new();
        self.buckets = vec![Bucket::EMPTY; buckets];
        for number in 0..self.count {
            self.enter(hash_of(number), number);
        }
    }

    #[inline]
    fn enter(&mut self, hash: u64, number: u32) {
        let mut place = self.place(hash);
        loop {
            let bucket = &mut self.buckets[place];
            let free = bucket.with_tag(0);
            if free != 0 {
                bucket.tags[slot(free)] = tag(hash);
                bucket.numbers[slot(free)] = number;
                return;
            }
            bucket.is_passed = true;
            place = self.next(place);
        }
    }

    /// The bucket in which a number belongs.
    #[inline]
    fn place(&self, hash: u64) -> usize {
        (((hash >> 32) * self.buckets.len() as u64) >> 32) as usize
    }

    #[inline]
    fn next(&self, place: usize) -> usize {
        if place + 1 == self.buckets.len() {
            0
        } else {
            place + 1
        }
    }
}

#[inline]
fn tag(hash: u64) -> u8 {
    (hash as u8).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every number is found by its hash, and none by another.
    fn check(count: u32, hash_of: impl Fn(u32) -> u64) {
        let mut table = BucketTable::new();
        for number in 0..count {
            assert_eq!(table.find(hash_of(number), |one| one == number), None);
            table.push(hash_of(number), &hash_of);
        }
        for number in 0..count {
            let found = table.find(hash_of(number), |one| one == number);
            assert_eq!(found, Some(number));
        }
        assert!(table.bytes() <= 10 * count as usize + size_of::<Bucket>());
    }

    #[test]
    fn numbers_are_found_however_their_hashes_lie() {
        let spread = |number: u32| u64::from(number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        check(10_000, spread);
        check(500, |_| 0);
        check(500, |_| u64::MAX);
        check(2_000, |number| spread(number % 40));
        check(2_000, |number| {
            u64::from(number % 3) << 32 | u64::from(number % 5)
        });
    }
}
