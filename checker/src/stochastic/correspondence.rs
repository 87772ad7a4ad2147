//! Where the words and clocks of the symbolic reading lie in a state of the stochastic one.
//!
//! Both readings come from the same text, so processes, locations, edges and the values of `select`
//! have the same numbers. Variables have the same names; but clocks are words in one reading only,
//! also inside of records and arrays, and what the symbolic reading leaves out has no name there.

use rustc_hash::FxHashMap;

use crate::ir::{ClockId, Network, ProcessId, Shape};

/// From states of the symbolic reading to those of the stochastic one.
#[derive(Clone, Debug)]
pub struct Correspondence {
    /// Words that lie one behind the other in both: the first of each, and how many.
    runs: Vec<(u32, u32, u32)>,
    /// The first word of each clock, without the reference clock.
    pub(super) clocks: Vec<u32>,
}

impl Correspondence {
    /// That of two readings of one model; `None` if they are not of one model.
    pub fn new(symbolic: &Network, stochastic: &Network) -> Option<Correspondence> {
        let sizes = |network: &Network| -> Vec<(usize, usize)> {
            let processes = network.processes.iter();
            processes
                .map(|one| (one.locations.len(), one.edges.len()))
                .collect()
        };
        if sizes(symbolic) != sizes(stochastic) {
            return None;
        }
        let twins: FxHashMap<(&str, Option<ProcessId>), _> = stochastic
            .layout
            .variables
            .iter()
            .map(|variable| ((&*variable.name, variable.owner), variable))
            .collect();
        let mut all = Correspondence {
            runs: vec![(0, 0, symbolic.processes.len() as u32)],
            clocks: Vec::new(),
        };
        for variable in symbolic.layout.variables.iter().filter(|one| !one.meta) {
            let twin = twins.get(&(&*variable.name, variable.owner))?;
            all.pair(
                (&variable.shape, variable.offset),
                (&twin.shape, twin.offset),
            )?;
        }
        for (number, clock) in symbolic.clocks.iter().enumerate().skip(1) {
            let twin = stochastic.clocks.get(number)?;
            if twin.name != clock.name {
                return None;
            }
            all.clocks.push(*stochastic.chances.clocks.get(number - 1)?);
        }
        Some(all)
    }

    /// Adds the words of a value.
    fn pair(&mut self, from: (&Shape, u32), to: (&Shape, u32)) -> Option<()> {
        if from.0 == to.0 {
            let count = from.0.words();
            match self.runs.last_mut() {
                Some(last) if (last.0 + last.2, last.1 + last.2) == (from.1, to.1) => {
                    last.2 += count;
                }
                _ => self.runs.push((from.1, to.1, count)),
            }
            return Some(());
        }
        match (from.0, to.0) {
            (
                Shape::Array { part, length, .. },
                Shape::Array {
                    part: other,
                    length: same,
                    ..
                },
            ) if length == same => {
                for index in 0..*length {
                    let from = (&**part, from.1 + index * part.words());
                    self.pair(from, (&**other, to.1 + index * other.words()))?;
                }
                Some(())
            }
            (Shape::Struct(fields), Shape::Struct(others)) => {
                let mut offset = from.1;
                for (name, shape) in fields {
                    let mut place = to.1;
                    let twin = others.iter().find_map(|(other, shape)| {
                        let found = (other == name).then_some((shape, place));
                        place += shape.words();
                        found
                    });
                    self.pair((shape, offset), twin?)?;
                    offset += shape.words();
                }
                Some(())
            }
            _ => None,
        }
    }

    /// The words of a state of the symbolic reading that both have.
    pub(super) fn of_symbolic<'w>(&'w self, words: &'w [i32]) -> impl Iterator<Item = &'w [i32]> {
        let runs = self.runs.iter();
        runs.map(|&(first, _, count)| &words[first as usize..(first + count) as usize])
    }

    /// The same words of a state of the stochastic reading.
    pub(super) fn of_stochastic<'w>(&'w self, words: &'w [i32]) -> impl Iterator<Item = &'w [i32]> {
        let runs = self.runs.iter();
        runs.map(|&(_, first, count)| &words[first as usize..(first + count) as usize])
    }

    /// The same words of a key, which has nothing but them.
    pub(super) fn of_key<'w>(&'w self, key: &'w [i32]) -> impl Iterator<Item = &'w [i32]> {
        let mut rest = key;
        self.runs.iter().map(move |&(_, _, count)| {
            let (run, others) = rest.split_at(count as usize);
            rest = others;
            run
        })
    }

    /// Copies the words that both have from a state of the symbolic reading to one of the other.
    pub fn copy(&self, symbolic: &[i32], stochastic: &mut [i32]) {
        for &(from, to, count) in &self.runs {
            let run = &symbolic[from as usize..(from + count) as usize];
            stochastic[to as usize..(to + count) as usize].copy_from_slice(run);
        }
    }

    /// Whether both have this word of the stochastic reading.
    pub fn has(&self, word: u32) -> bool {
        let mut runs = self.runs.iter();
        runs.any(|&(_, first, count)| (first..first + count).contains(&word))
    }

    /// The clock of the symbolic reading that begins at this word of the stochastic one.
    pub fn clock(&self, word: u32) -> Option<ClockId> {
        let found = self.clocks.iter().position(|&clock| clock == word)?;
        Some(ClockId(found as u32 + 1))
    }

    /// How many words both have.
    pub(super) fn count(&self) -> usize {
        self.runs.iter().map(|&(_, _, count)| count as usize).sum()
    }
}
