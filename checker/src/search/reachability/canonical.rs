//! One state for all that differ only in which member of a scalar set is which, and the way back
//! from it.
//!
//! A search that stores representatives takes moves of them, which are not those of the state that
//! was reached. So the exchanges that led to a representative stand in the way to it, after the
//! moves; with them a trace is led back, from the initial state on, to the moves of the states that
//! it is about.
//!
//! Cost: eight bytes for some ten exchanges on the way to a stored state, and what
//! [`Symmetry::normalise`] costs.

use crate::network::{Permutation, Symmetry};
use crate::zones::Bound;

use crate::search::outcome::Step;

/// Marks a step that stands for exchanges; the bits below hold their numbers, each one more than it
/// is.
const EXCHANGES: Step = 1 << 62;

/// Buffers for a representative.
#[derive(Debug, Default)]
pub(super) struct Representative {
    words: Vec<i32>,
    zone: Vec<Bound>,
    way: Vec<Step>,
    exchanges: Vec<u32>,
}

impl Representative {
    /// The representative of a state, and the way to it, given that to the state.
    pub(super) fn of(
        &mut self,
        symmetry: &Symmetry,
        words: &[i32],
        zone: &[Bound],
        way: &[Step],
    ) -> (&[i32], &mut [Bound], &[Step]) {
        self.words.clear();
        self.words.extend_from_slice(words);
        self.zone.clear();
        self.zone.extend_from_slice(zone);
        self.exchanges.clear();
        symmetry.normalise(&mut self.words, &mut self.zone, &mut self.exchanges);
        self.way.clear();
        self.way.extend_from_slice(way);
        let bits = bits_of_exchange(symmetry);
        for some in self.exchanges.chunks(62 / bits as usize) {
            let numbers = some.iter().rev().fold(0, |numbers, &number| {
                numbers << bits | Step::from(number + 1)
            });
            self.way.push(EXCHANGES | numbers);
        }
        (&self.words, &mut self.zone, &self.way)
    }
}

/// How many bits hold one more than the number of an exchange.
fn bits_of_exchange(symmetry: &Symmetry) -> u32 {
    (symmetry.exchanges() as Step + 1).ilog2() + 1
}

/// The moves of a way, each with what the members of the state that it is taken in were exchanged
/// by before.
pub(super) fn unfold(symmetry: &Symmetry, way: &[Step]) -> Vec<(Step, Permutation)> {
    let bits = bits_of_exchange(symmetry);
    let mut permutation = symmetry.identity();
    let mut steps = Vec::new();
    for &step in way {
        if step < EXCHANGES {
            steps.push((step, permutation.clone()));
            continue;
        }
        let mut numbers = step - EXCHANGES;
        while numbers != 0 {
            let number = numbers & ((1 << bits) - 1);
            symmetry.exchange(number as usize - 1, &mut permutation);
            numbers >>= bits;
        }
    }
    steps
}
