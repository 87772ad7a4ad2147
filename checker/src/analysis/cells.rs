//! Sets of cells: what guards, updates and predicates may depend on. A *cell* is a word, a clock,
//! or whether some location is committed.

use crate::ir::{ClockRange, FunctionId, LocationId, Network};

use super::function_reads::read_words;

/// Functions that read more words count as reading all.
const MOST_READ_WORDS: usize = 1 << 16;

/// Cells as ascending disjoint ranges: the first, and the one after the last.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Cells(Vec<(u32, u32)>);

impl Cells {
    pub(super) fn add(&mut self, first: u32, count: u32) {
        if count > 0 {
            self.0.push((first, first + count));
        }
    }

    pub(super) fn extend(&mut self, other: &Cells) {
        self.0.extend_from_slice(&other.0);
    }

    /// Brings the ranges in order; until then they only may be added to.
    pub(super) fn settle(&mut self) {
        self.0.sort_unstable();
        let mut merged: Vec<(u32, u32)> = Vec::with_capacity(self.0.len());
        for &(first, end) in &self.0 {
            match merged.last_mut() {
                Some(last) if first <= last.1 => last.1 = last.1.max(end),
                _ => merged.push((first, end)),
            }
        }
        self.0 = merged;
    }

    /// Whether the two have a cell in common.
    pub(super) fn meet(&self, other: &Cells) -> bool {
        let (mut own, mut others) = (self.0.iter().peekable(), other.0.iter().peekable());
        while let (Some(one), Some(two)) = (own.peek(), others.peek()) {
            if one.1 <= two.0 {
                own.next();
            } else if two.1 <= one.0 {
                others.next();
            } else {
                return true;
            }
        }
        false
    }
}

/// The numbers of cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct CellNumbers<'n> {
    network: &'n Network,
}

impl<'n> CellNumbers<'n> {
    pub(super) fn new(network: &'n Network) -> CellNumbers<'n> {
        CellNumbers { network }
    }

    fn words(self) -> u32 {
        self.network.layout.words
    }

    pub(super) fn add_clocks(self, clocks: ClockRange, cells: &mut Cells) {
        cells.add(self.words() + clocks.first.0, clocks.count);
    }

    /// Whether some location is committed.
    pub(super) fn add_commitment(self, cells: &mut Cells) {
        cells.add(self.words() + self.network.clocks.len().max(1) as u32, 1);
    }

    /// The words that functions read.
    pub(super) fn add_reads(
        self,
        functions: impl IntoIterator<Item = FunctionId>,
        cells: &mut Cells,
    ) {
        match read_words(self.network, functions, MOST_READ_WORDS) {
            Some(words) => words.iter().for_each(|&word| cells.add(word, 1)),
            None => cells.add(0, self.words()),
        }
    }

    /// The cells that decide an invariant.
    pub(super) fn add_invariant(self, process: usize, location: LocationId, cells: &mut Cells) {
        let location = &self.network.processes[process].locations[location.0 as usize];
        let invariant = &location.invariant;
        self.add_reads(invariant.function, cells);
        for atom in &invariant.atoms {
            self.add_clocks(atom.left, cells);
            self.add_clocks(atom.right, cells);
        }
    }
}
