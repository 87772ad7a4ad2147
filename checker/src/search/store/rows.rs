//! Rows of numbers, all of one length, each stored once as a tree of pairs.
//!
//! The numbers of a row are the lowest level of its tree. A level has one number for each two of
//! the level below: that of the pair. The last one of a level of odd length stands above it as it
//! is. The two numbers of the uppermost level are the root, whose number is that of the row. So
//! equal parts of rows are stored once.
//!
//! Rows that follow each other differ in few places. So a row is compared with the one at hand, the
//! *basis*, and only what differs is looked up, with the pairs above it.
//!
//! Invariants:
//! * Two rows get the same number exactly if they are equal.
//! * All levels of the basis are right, and the pairs below its root are stored.
//!
//! Source: A. Laarman, J. van de Pol, M. Weber, "Parallel Recursive State Compression for Free",
//! SPIN 2011, also for the changes along a transition.
//!
//! Cost: a row takes a root, and the pairs that no other row has: at most as many as the depth of
//! the tree for each place where it differs.

use super::pairs::Pairs;

/// Where a level stands.
#[derive(Clone, Copy, Debug)]
struct Level {
    first: usize,
    length: usize,
}

/// Stored rows.
#[derive(Debug)]
pub(super) struct Rows {
    /// From the lowest one to that with two numbers.
    levels: Vec<Level>,
    /// The pairs of all levels but the uppermost.
    pairs: Pairs,
    roots: Pairs,
    /// The numbers of all levels of the basis.
    basis: Vec<u32>,
    /// Whether the basis was visited; else it is the row that was stored last.
    is_visited: bool,
    /// What the basis had before it was changed: places and numbers.
    before: Vec<(usize, u32)>,
    /// Where the level at hand has changed, and that above it.
    changed: Vec<usize>,
    changed_above: Vec<usize>,
}

impl Rows {
    /// No rows. They will have so many numbers, at least two.
    pub(super) fn new(length: usize) -> Rows {
        let mut levels = vec![Level { first: 0, length }];
        let mut last = levels[0];
        while last.length > 2 {
            last = Level {
                first: last.first + last.length,
                length: last.length.div_ceil(2),
            };
            levels.push(last);
        }
        let mut rows = Rows {
            basis: vec![0; last.first + last.length],
            levels,
            pairs: Pairs::new(),
            roots: Pairs::new(),
            is_visited: false,
            before: Vec::new(),
            changed: (0..length.div_ceil(2)).collect(),
            changed_above: Vec::new(),
        };
        rows.change_upper();
        rows
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.pairs.bytes() + self.roots.bytes()
    }

    /// The number of a row, and whether it is new.
    pub(super) fn intern(&mut self, row: impl Iterator<Item = u32>) -> (u32, bool) {
        self.before.clear();
        self.changed.clear();
        for (place, number) in row.enumerate() {
            let known = self.basis[place];
            if number != known {
                self.before.push((place, known));
                self.basis[place] = number;
                note(&mut self.changed, place / 2);
            }
        }
        self.change_upper();
        let found = self.roots.intern(self.root());
        if self.is_visited {
            for &(place, number) in self.before.iter().rev() {
                self.basis[place] = number;
            }
        }
        found
    }

    /// Computes what stands above the changed pairs of the lowest level.
    fn change_upper(&mut self) {
        for level in 1..self.levels.len() {
            self.changed_above.clear();
            for &place in &self.changed {
                let below = below(&self.basis, self.levels[level - 1], place);
                let number = match *below {
                    [one] => one,
                    [one, other] => self.pairs.intern([one, other]).0,
                    _ => unreachable!("a number stands above one or two"),
                };
                let own = self.levels[level].first + place;
                if self.basis[own] != number {
                    self.before.push((own, self.basis[own]));
                    self.basis[own] = number;
                    note(&mut self.changed_above, place / 2);
                }
            }
            std::mem::swap(&mut self.changed, &mut self.changed_above);
        }
    }

    fn root(&self) -> [u32; 2] {
        let last = self.levels[self.levels.len() - 1].first;
        [self.basis[last], self.basis[last + 1]]
    }

    /// The number of a row, if it is stored.
    pub(super) fn find(&self, row: impl Iterator<Item = u32>) -> Option<u32> {
        let mut numbers: Vec<u32> = row.collect();
        while numbers.len() > 2 {
            let mut length = 0;
            for place in 0..numbers.len().div_ceil(2) {
                let number = numbers[2 * place];
                let next = numbers.get(2 * place + 1);
                numbers[place] = match next {
                    None => number,
                    Some(&other) => self.pairs.find([number, other])?,
                };
                length = place + 1;
            }
            numbers.truncate(length);
        }
        self.roots.find([numbers[0], numbers[1]])
    }

    /// Makes a stored row the basis, and returns it. Rows to be stored will be compared with it.
    pub(super) fn visit(&mut self, row: u32) -> &[u32] {
        self.is_visited = true;
        self.changed.clear();
        let upper = self.levels[self.levels.len() - 1];
        for (place, number) in self.roots.get(row).into_iter().enumerate() {
            if self.basis[upper.first + place] != number {
                self.basis[upper.first + place] = number;
                self.changed.push(place);
            }
        }
        for level in (1..self.levels.len()).rev() {
            self.changed_above.clear();
            let (own, below) = (self.levels[level], self.levels[level - 1]);
            for &place in &self.changed {
                let number = self.basis[own.first + place];
                let first = 2 * place;
                let (pair, count) = if first + 1 < below.length {
                    (self.pairs.get(number), 2)
                } else {
                    ([number, 0], 1)
                };
                for (place, &number) in (first..).zip(&pair[..count]) {
                    if self.basis[below.first + place] != number {
                        self.basis[below.first + place] = number;
                        self.changed_above.push(place);
                    }
                }
            }
            std::mem::swap(&mut self.changed, &mut self.changed_above);
        }
        &self.basis[..self.levels[0].length]
    }

    /// A stored row.
    pub(super) fn get(&self, row: u32) -> Vec<u32> {
        let mut numbers = self.roots.get(row).to_vec();
        for level in self.levels.iter().rev().skip(1) {
            let mut below = Vec::with_capacity(level.length);
            for number in numbers {
                if below.len() + 1 < level.length {
                    below.extend(self.pairs.get(number));
                } else {
                    below.push(number);
                }
            }
            numbers = below;
        }
        numbers
    }
}

/// The one or two numbers of a level that stand below a place.
fn below(numbers: &[u32], level: Level, place: usize) -> &[u32] {
    let first = 2 * place;
    let end = level.length.min(first + 2);
    &numbers[level.first + first..level.first + end]
}

/// Adds a place, unless it is the last one already.
fn note(places: &mut Vec<usize>, place: usize) {
    if places.last() != Some(&place) {
        places.push(place);
    }
}

#[cfg(test)]
mod tests {
    use rustc_hash::FxHashMap;

    use super::Rows;

    /// Rows that differ from the one before in few places come back, whether rows are visited or
    /// not.
    fn check(length: usize, visits: bool) {
        let mut state = length as u64;
        let mut next = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005) + 1;
            (state >> 33) as usize % below
        };
        let mut rows = Rows::new(length);
        let mut known: FxHashMap<Vec<u32>, u32> = FxHashMap::default();
        let mut all: Vec<Vec<u32>> = Vec::new();
        let mut row = vec![0; length];
        for _ in 0..3000 {
            for _ in 0..next(4) {
                row[next(length)] = next(3) as u32;
            }
            let found = rows.intern(row.iter().copied());
            let expected = known.get(&row).copied();
            assert_eq!(found.1, expected.is_none());
            assert_eq!(found.0, expected.unwrap_or(all.len() as u32));
            if found.1 {
                known.insert(row.clone(), found.0);
                all.push(row.clone());
            }
            assert_eq!(rows.find(row.iter().copied()), Some(found.0));
            if visits {
                let other = next(all.len());
                row.clone_from(&all[other]);
                assert_eq!(rows.visit(other as u32), row);
            }
        }
        for (number, row) in (0..).zip(&all) {
            assert_eq!(rows.get(number), *row);
        }
        row.fill(7);
        assert_eq!(rows.find(row.iter().copied()), None);
    }

    #[test]
    fn rows_come_back_whatever_their_length() {
        for length in [2, 3, 4, 5, 7, 8, 9, 31, 100] {
            check(length, false);
            check(length, true);
        }
    }
}
