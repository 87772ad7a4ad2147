//! One state that stands for all states that differ only by exchanges of members of a scalar set,
//! and the way back from it.
//!
//! A search that stores representatives takes moves of them, which are not those of the state that
//! was reached. So the path to a representative also contains, after the moves, the exchanges that
//! led to it. With them a trace is translated back, from the initial state on, into the moves of
//! the real states.
//!
//! Cost: eight bytes for about ten exchanges on the path to a stored state, and the cost of
//! [`Symmetry::normalise`].

use crate::network::{Permutation, Symmetry};
use crate::zones::Bound;

use crate::search::outcome::Step;

/// Marks a step that stands for exchanges. The bits below hold their numbers, each plus one.
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
    /// The representative of a state and the path to it, given the path to the state.
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

/// The moves of a path, each with the exchanges of members that were applied to its state before.
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
