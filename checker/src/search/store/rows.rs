//! Rows of numbers, all of one length, each stored once as a tree of groups.
//!
//! The numbers of a row are the lowest level of its tree. A level has one number for each few of
//! the level below: that of the group which they make. The uppermost level is the root, whose
//! number is that of the row. So equal parts of rows are stored once.
//!
//! Rows that follow each other differ in few places. So a row is compared with the one at hand, the
//! *basis*, and only what differs is looked up, with the groups above it.
//!
//! Invariants:
//! * Two rows get the same number exactly if they are equal.
//! * All levels of the basis are right, and the groups below its root are stored.
//!
//! Source: A. Laarman, J. van de Pol, M. Weber, "Parallel Recursive State Compression for Free",
//! SPIN 2011, also for the changes along a transition. They pair numbers; wider groups make fewer
//! levels, and less time is spent in looking up.
//!
//! Rows that have little in common are kept as they are: each is a root, and there is no level
//! below. The first few thousand rows decide.
//!
//! Cost: a row takes a root, and the groups that no other row has: at most as many as the depth of
//! the tree for each place where it differs.

use super::disk::Cold;
use super::groups::{Batch, Groups};

/// The most numbers in a group.
const WIDEST: usize = 8;

/// Numbers that are compared at once.
const BLOCK: usize = 16;

/// When there are so many rows, it is seen whether they have enough in common.
const TRIAL: usize = 4096;

/// Trees that take more than this part of the rows themselves are not worth the time.
const WORTH: f64 = 0.3;

/// Where a level stands, and how many groups it has.
#[derive(Clone, Copy, Debug)]
struct Level {
    first: usize,
    groups: usize,
}

/// Stored rows.
#[derive(Debug)]
pub(super) struct Rows {
    length: usize,
    /// The numbers in a group.
    width: usize,
    /// From the lowest one to that below the root.
    levels: Vec<Level>,
    /// The groups of all levels.
    groups: Groups,
    roots: Groups,
    /// The numbers of all levels of the basis, then those of its root.
    basis: Vec<u32>,
    /// Where the root begins there.
    root: usize,
    /// Whether the basis is a row that was visited; else it is that which was stored last.
    is_visited: bool,
    /// The roots of rows that wait to be stored.
    waiting: Batch,
    /// The numbers of the row that is given.
    given: Vec<u32>,
    /// What the basis had before a row was stored: places and numbers.
    before: Vec<(u32, u32)>,
    /// The groups that have changed in the level at hand, and in that above it.
    changed: Vec<usize>,
    changed_above: Vec<usize>,
}

impl Rows {
    /// No rows. They will have so many numbers, at least one.
    pub(super) fn new(length: usize) -> Rows {
        Rows::of_width(length, width(length))
    }

    /// No rows, in groups of this width.
    fn of_width(length: usize, width: usize) -> Rows {
        let (mut levels, mut first, mut below) = (Vec::new(), 0, length);
        while below > width {
            let groups = below.div_ceil(width);
            levels.push(Level { first, groups });
            first += groups * width;
            below = groups;
        }
        let mut rows = Rows {
            length,
            width,
            changed: (0..levels.first().map_or(0, |level| level.groups)).collect(),
            levels,
            groups: Groups::new(width),
            roots: Groups::new(below),
            basis: vec![0; first + below],
            is_visited: false,
            before: Vec::new(),
            given: Vec::new(),
            waiting: Batch::default(),
            root: first,
            changed_above: Vec::new(),
        };
        rows.change_upper();
        rows.changed.clear();
        rows.before.clear();
        rows
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.groups.bytes() + self.roots.bytes()
    }

    /// The most bytes that the next row may take; its groups are not all new.
    pub(super) fn growth(&self) -> usize {
        self.groups.growth() + self.roots.growth()
    }

    /// What may be put on disk.
    pub(super) fn cold(&mut self) -> [&mut dyn Cold; 2] {
        [self.groups.cold(), self.roots.cold()]
    }

    /// Whether rows are compared with one that was visited.
    pub(super) fn is_visited(&self) -> bool {
        self.is_visited
    }

    /// Lets rows be compared with that which was stored last; the first one with that which was
    /// visited.
    pub(super) fn leave(&mut self) {
        self.is_visited = false;
    }

    /// Whether rows are kept as they are.
    pub(super) fn is_flat(&self) -> bool {
        self.levels.is_empty()
    }

    /// The number of a row, and whether it is new. It becomes the basis, unless that was visited.
    pub(super) fn intern(&mut self, row: impl Iterator<Item = u32>) -> (u32, bool) {
        if self.is_flat() {
            for (known, number) in self.basis.iter_mut().zip(row) {
                *known = number;
            }
            return self.roots.intern(&self.basis);
        }
        self.set_all(row);
        self.intern_set()
    }

    /// Changes all numbers of the basis, until [`Rows::intern_set`].
    fn set_all(&mut self, row: impl Iterator<Item = u32>) {
        let mut given = std::mem::take(&mut self.given);
        given.clear();
        given.extend(row);
        for (block, first) in given.chunks(BLOCK).zip((0..).step_by(BLOCK)) {
            if *block == self.basis[first..first + block.len()] {
                continue;
            }
            for (place, number) in (first..).zip(block) {
                self.set(place, *number);
            }
        }
        self.given = given;
    }

    /// Changes a number of the basis, until [`Rows::intern_set`]. Places must ascend.
    #[inline]
    pub(super) fn set(&mut self, place: usize, number: u32) {
        let known = self.basis[place];
        if known != number {
            self.before.push((place as u32, known));
            self.basis[place] = number;
            let group = place / self.width;
            if self.changed.last() != Some(&group) {
                self.changed.push(group);
            }
        }
    }

    /// A number of the basis, as it was set.
    #[inline]
    pub(super) fn number(&self, place: usize) -> u32 {
        self.basis[place]
    }

    /// Like [`Rows::intern`], for the basis as it was set. No row may wait.
    pub(super) fn intern_set(&mut self) -> (u32, bool) {
        self.change_upper();
        let found = self.roots.intern(&self.basis[self.root..]);
        self.restore();
        if found == (TRIAL as u32 - 1, true) && self.shares_little() {
            *self = self.flat();
        }
        found
    }

    /// Makes the basis that which was visited again.
    fn restore(&mut self) {
        if self.is_visited {
            // A place that was set twice has what it was at first.
            for &(place, number) in self.before.iter().rev() {
                self.basis[place as usize] = number;
            }
        }
        self.changed.clear();
        self.before.clear();
    }

    /// Whether rows may wait to be stored: how they are kept was decided.
    pub(super) fn may_wait(&self) -> bool {
        self.roots.len() >= TRIAL
    }

    /// Lets a row wait until [`Rows::intern_waiting`].
    pub(super) fn wait(&mut self, row: impl Iterator<Item = u32>) {
        if self.is_flat() {
            self.waiting.groups.extend(row);
            return;
        }
        self.set_all(row);
        self.wait_set();
    }

    /// Like [`Rows::wait`], for the basis as it was set.
    pub(super) fn wait_set(&mut self) {
        self.change_upper();
        self.waiting
            .groups
            .extend_from_slice(&self.basis[self.root..]);
        self.restore();
    }

    /// Stores the rows that wait, in their order, with what [`Rows::intern`] returns of each.
    pub(super) fn intern_waiting(&mut self, each: impl FnMut(u32, bool)) {
        self.roots.intern_all(&mut self.waiting, each);
    }

    /// Whether rows have so little in common that trees are not worth the time.
    fn shares_little(&self) -> bool {
        let groups = self.groups.len() * self.width;
        groups as f64 > WORTH * (self.roots.len() * self.length) as f64
    }

    /// The same rows with the same numbers, as they are.
    fn flat(&self) -> Rows {
        let mut flat = Rows::of_width(self.length, self.length);
        for row in 0..self.roots.len() as u32 {
            flat.intern(self.get(row).into_iter());
        }
        flat
    }

    /// Computes what stands above the changed groups of the lowest level.
    fn change_upper(&mut self) {
        for (number, level) in self.levels.iter().enumerate() {
            let above = self
                .levels
                .get(number + 1)
                .map_or(self.root, |above| above.first);
            self.changed_above.clear();
            for &place in &self.changed {
                let group = &self.basis[level.first + place * self.width..][..self.width];
                let number = self.groups.intern_recent(group);
                let known = self.basis[above + place];
                if known != number {
                    self.before.push(((above + place) as u32, known));
                    self.basis[above + place] = number;
                    let group = place / self.width;
                    if self.changed_above.last() != Some(&group) {
                        self.changed_above.push(group);
                    }
                }
            }
            std::mem::swap(&mut self.changed, &mut self.changed_above);
        }
    }

    /// The number of a row, if it is stored.
    pub(super) fn find(&self, row: impl Iterator<Item = u32>) -> Option<u32> {
        let mut numbers: Vec<u32> = row.collect();
        for level in &self.levels {
            numbers.resize(level.groups * self.width, 0);
            let groups = numbers.chunks_exact(self.width);
            let above: Option<Vec<u32>> = groups.map(|group| self.groups.find(group)).collect();
            numbers = above?;
        }
        self.roots.find(&numbers)
    }

    /// Makes a stored row the basis, and returns it.
    pub(super) fn visit(&mut self, row: u32) -> &[u32] {
        if self.is_flat() {
            return self.roots.get(row);
        }
        self.is_visited = true;
        self.changed.clear();
        let root = self.basis[self.root..].iter_mut();
        for (place, (known, &number)) in root.zip(self.roots.get(row)).enumerate() {
            if *known != number {
                *known = number;
                self.changed.push(place);
            }
        }
        let mut own = self.root;
        for (number, level) in self.levels.iter().enumerate().rev() {
            self.changed_above.clear();
            for &place in &self.changed {
                let group = self.groups.get(self.basis[own + place]);
                let first = place * self.width;
                let below = &mut self.basis[level.first + first..][..self.width];
                if number == 0 {
                    below.copy_from_slice(group);
                    continue;
                }
                for (place, (known, &number)) in (first..).zip(below.iter_mut().zip(group)) {
                    if *known != number {
                        *known = number;
                        self.changed_above.push(place);
                    }
                }
            }
            std::mem::swap(&mut self.changed, &mut self.changed_above);
            own = level.first;
        }
        &self.basis[..self.length]
    }

    /// A stored row.
    pub(super) fn get(&self, row: u32) -> Vec<u32> {
        let mut numbers = self.roots.get(row).to_vec();
        for level in self.levels.iter().rev() {
            let mut below = Vec::with_capacity(level.groups * self.width);
            for &number in &numbers[..level.groups] {
                below.extend_from_slice(self.groups.get(number));
            }
            numbers = below;
        }
        numbers.truncate(self.length);
        numbers
    }
}

/// The least width of groups with which rows have the fewest levels, but one below the root.
fn width(length: usize) -> usize {
    if (3..=WIDEST).contains(&length) {
        return length.div_ceil(2);
    }
    let levels = |width: usize| {
        let mut levels = 0;
        let mut below = length;
        while below > width {
            below = below.div_ceil(width);
            levels += 1;
        }
        levels
    };
    let fewest = levels(WIDEST);
    (2..=WIDEST)
        .find(|&width| levels(width) == fewest)
        .unwrap_or(WIDEST)
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

    /// Rows that wait get the numbers that they would have got at once.
    #[test]
    fn rows_may_wait_whatever_their_length() {
        for length in [5, 40, 100] {
            for factor in [1, 3] {
                let (mut rows, mut waiting) = (Rows::new(length), Rows::new(length));
                // With the factor 1 only two places differ, and rows become trees.
                let row = |number: u32| {
                    let places = 0..length as u32;
                    places.map(move |place| match (place, factor) {
                        (0, _) => number % 97,
                        (1, _) => number / 7,
                        (_, 1) => place,
                        _ => number.wrapping_mul(2 * place + factor),
                    })
                };
                for number in 0..5000 {
                    assert_eq!(rows.intern(row(number)), waiting.intern(row(number)));
                }
                assert!(waiting.may_wait());
                for first in (4000..9000).step_by(50) {
                    waiting.visit(first / 2);
                    let all = (first..first + 40).map(|number| number / 2 * 2);
                    all.clone().for_each(|number| waiting.wait(row(number)));
                    let mut found = Vec::new();
                    waiting.intern_waiting(|number, is_new| found.push((number, is_new)));
                    let expected = all.map(|number| rows.intern(row(number)));
                    assert_eq!(found, expected.collect::<Vec<_>>());
                }
            }
        }
    }

    #[test]
    fn rows_that_share_little_are_kept_as_they_are() {
        let mut rows = Rows::new(40);
        let row = |number: u32| (0..40).map(move |place| number.wrapping_mul(2 * place + 3));
        for number in 0..5000 {
            assert_eq!(rows.intern(row(number)), (number, true));
            assert_eq!(rows.levels.is_empty(), number + 1 >= super::TRIAL as u32);
            assert!(rows.visit(number / 2).iter().copied().eq(row(number / 2)));
        }
        for number in 0..5000 {
            assert_eq!(rows.find(row(number)), Some(number));
            assert!(rows.get(number).into_iter().eq(row(number)));
        }
    }

    #[test]
    fn rows_come_back_whatever_their_length() {
        for length in [1, 2, 3, 7, 8, 9, 31, 64, 65, 100, 600] {
            check(length, false);
            check(length, true);
        }
    }
}
