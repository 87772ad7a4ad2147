//! Blocks of runs, whose results are made at one place and consumed at another.
//!
//! Run k of a seed is the same wherever it is made, so an answer does not depend on who has made
//! its runs. The results of a block are bytes: each is written once, with how often it follows
//! itself. A failure is only marked, and ends the block: whoever consumes it makes this run, and so
//! finds the failure with its place. So is done with whatever cannot be read.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::in_order::in_order;
use super::run::Runner;
use super::run_id::RunId;
use super::run_watch::{RunWatch, Shown, Shows};
use crate::cancellation;
use crate::ir::{Asked, Path, RunBound, Statistical};

/// Gives blocks of results: of runs from a number on, as [`block`] writes them. It is told how many
/// runs are needed at most, if that is known. An empty block says that none is there yet.
#[derive(Clone)]
pub struct RunSource(pub Arc<dyn Fn(u64, Option<u64>) -> Vec<u8> + Send + Sync>);

impl fmt::Debug for RunSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("RunSource")
    }
}

/// Runs of a network, and who makes them.
#[derive(Clone, Copy)]
pub struct Runs<'a> {
    /// What they are runs of.
    pub behaviour: Behaviour<'a>,
    /// Where their results come from, if not from threads of this process.
    pub source: Option<&'a RunSource>,
}

/// The result of a run that can be written as bytes.
pub(super) trait Transferred: Copy {
    fn write(self, to: &mut Vec<u8>);

    /// Takes a result from the front; `None` if there is none.
    fn read(from: &mut &[u8]) -> Option<Self>;
}

const NOT_SATISFIED: u8 = 0;
const SATISFIED: u8 = 1;
const VALUE: u8 = 2;

impl Transferred for Shown {
    fn write(self, to: &mut Vec<u8>) {
        let (kind, number) = match self {
            Shown::Decided { satisfied, at } => (u8::from(satisfied), at),
            Shown::Value(value) => (VALUE, value),
        };
        to.push(kind);
        to.extend(number.to_le_bytes());
    }

    fn read(from: &mut &[u8]) -> Option<Shown> {
        let kind = read_byte(from)?;
        let (number, rest) = from.split_first_chunk()?;
        *from = rest;
        let number = f64::from_le_bytes(*number);
        match kind {
            NOT_SATISFIED | SATISFIED => Some(Shown::Decided {
                satisfied: kind == SATISFIED,
                at: number,
            }),
            VALUE => Some(Shown::Value(number)),
            _ => None,
        }
    }
}

/// Whether the two runs of a pair have what was asked.
impl Transferred for (bool, bool) {
    fn write(self, to: &mut Vec<u8>) {
        to.push(u8::from(self.0) | u8::from(self.1) << 1);
    }

    fn read(from: &mut &[u8]) -> Option<(bool, bool)> {
        let both = read_byte(from)?;
        (both < 4).then_some((both & 1 != 0, both & 2 != 0))
    }
}

fn read_byte(from: &mut &[u8]) -> Option<u8> {
    let (byte, rest) = from.split_first()?;
    *from = rest;
    Some(*byte)
}

/// A number in bytes of 7 bits, the lowest first (LEB128).
fn write_number(mut number: u64, to: &mut Vec<u8>) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

fn read_number(from: &mut &[u8]) -> Option<u64> {
    let mut number = 0_u64;
    for shift in (0..u64::BITS).step_by(7) {
        let byte = read_byte(from)?;
        number |= u64::from(byte & 0x7f).checked_shl(shift)?;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

/// Writes results, each with how often it comes.
#[derive(Default)]
struct Writer {
    bytes: Vec<u8>,
    /// The bytes of the last result, and how often it has come so far.
    last: Vec<u8>,
    count: u64,
    /// Those of the next one, in memory that is used again.
    next: Vec<u8>,
}

impl Writer {
    fn push(&mut self, result: impl Transferred) {
        self.next.clear();
        result.write(&mut self.next);
        if self.next != self.last {
            self.finish_last();
            std::mem::swap(&mut self.last, &mut self.next);
        }
        self.count += 1;
    }

    fn finish_last(&mut self) {
        if self.count > 0 {
            write_number(self.count, &mut self.bytes);
            self.bytes.extend(&self.last);
            self.count = 0;
        }
    }

    /// Marks that the next run failed.
    fn fail(&mut self) {
        self.finish_last();
        write_number(0, &mut self.bytes);
    }
}

/// Makes runs with these numbers (for a comparison, pairs of runs). Returns their results, and the
/// failure that ended them, if one did.
///
/// # Panics
/// The query shows runs: these are no results to count.
pub fn block(
    behaviour: Behaviour<'_>,
    query: &Statistical,
    seed: u64,
    numbers: Range<u64>,
) -> (Vec<u8>, Option<Failure>) {
    let mut runner = Runner::of(behaviour);
    match query {
        Statistical::Comparison { left, right, .. } => written(numbers, |pair| {
            pair_of_runs(
                &mut runner,
                left,
                right,
                RunId {
                    seed,
                    run: 2 * pair,
                },
            )
        }),
        query => written(numbers, |run| {
            shown(&mut runner, query, RunId { seed, run })
        }),
    }
}

fn written<T: Transferred>(
    numbers: Range<u64>,
    mut run: impl FnMut(u64) -> Result<T, Failure>,
) -> (Vec<u8>, Option<Failure>) {
    let mut writer = Writer::default();
    for number in numbers {
        match run(number) {
            Ok(result) => writer.push(result),
            Err(failure) => {
                writer.fail();
                return (writer.bytes, Some(failure));
            }
        }
    }
    writer.finish_last();
    (writer.bytes, None)
}

/// What a run shows for a query about single runs.
pub(super) fn shown(
    runner: &mut Runner<'_>,
    query: &Statistical,
    run: RunId,
) -> Result<Shown, Failure> {
    let asked = query.asked().expect("the query is about single runs");
    let outcome = runner.observe(run, query.bound(), asked)?;
    Ok(match asked {
        Asked::Path(_) => Shown::Decided {
            satisfied: outcome.value != 0.0,
            at: outcome.at,
        },
        Asked::Extreme(..) | Asked::End(_) => Shown::Value(outcome.value),
    })
}

/// Whether a run and the next one have what is asked of the two runs of a pair.
pub(super) fn pair_of_runs(
    runner: &mut Runner<'_>,
    left: &(RunBound, Path),
    right: &(RunBound, Path),
    first: RunId,
) -> Result<(bool, bool), Failure> {
    let next = RunId {
        run: first.run + 1,
        ..first
    };
    let first = runner.observe(first, &left.0, Asked::Path(&left.1))?;
    let second = runner.observe(next, &right.0, Asked::Path(&right.1))?;
    Ok((first.value != 0.0, second.value != 0.0))
}

/// Consumes the results of runs 0, 1, … as [`in_order`] does; they are made by threads, or come
/// from a source, which is told how many are needed at most.
pub(super) fn from_anywhere<T: Transferred + Shows + Send>(
    runs: Runs<'_>,
    threads: usize,
    most: Option<u64>,
    run: impl Fn(&mut Runner<'_>, u64) -> Result<T, Failure> + Sync,
    mut consume: impl FnMut(T) -> bool,
    watch: &mut dyn RunWatch,
) -> Result<bool, Failure> {
    let behaviour = runs.behaviour;
    let Some(source) = runs.source else {
        return in_order(behaviour, threads, run, consume, watch);
    };
    let mut runner = Runner::of(behaviour);
    let mut consumed = 0;
    loop {
        let bytes = (source.0)(consumed, most);
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let (result, count) = match read::<T>(&mut rest) {
                Some(read) => read,
                None => (run(&mut runner, consumed)?, 1),
            };
            for _ in 0..count {
                consumed += 1;
                if let Some(shown) = result.shows() {
                    watch.see(shown);
                }
                if consume(result) {
                    return Ok(true);
                }
            }
        }
        if watch.ends(consumed) {
            if consumed == 0 {
                cancellation::cut();
            }
            return Ok(false);
        }
    }
}

/// Takes a result from the front, and how often it comes. If there is none, nothing is left.
fn read<T: Transferred>(from: &mut &[u8]) -> Option<(T, u64)> {
    let count = read_number(from).filter(|count| *count > 0);
    let result = count.and_then(|count| Some((T::read(from)?, count)));
    if result.is_none() {
        *from = &[];
    }
    result
}

#[cfg(test)]
mod tests {
    use super::{Shown, Transferred, Writer, read, read_number, write_number};

    fn written<T: Transferred>(results: &[T]) -> Vec<u8> {
        let mut writer = Writer::default();
        for result in results {
            writer.push(*result);
        }
        writer.finish_last();
        writer.bytes
    }

    fn all<T: Transferred>(mut bytes: &[u8]) -> Vec<T> {
        let mut results = Vec::new();
        while let Some((result, count)) = read::<T>(&mut bytes) {
            results.extend((0..count).map(|_| result));
        }
        results
    }

    #[test]
    fn results_come_back_to_the_last_bit() {
        let at = |satisfied, at| Shown::Decided { satisfied, at };
        let mut shown = vec![
            at(true, 0.1),
            at(false, 0.1),
            at(false, 0.1),
            at(true, 1e300),
        ];
        shown.extend([0.0, -0.0, 5e-324, 0.1 + 0.2].map(Shown::Value));
        shown.extend([Shown::Value(7.0); 1000]);
        let found = all::<Shown>(&written(&shown));
        assert_eq!(found.len(), shown.len());
        let bits = |one: &Shown| match *one {
            Shown::Decided { satisfied, at } => (Some(satisfied), at.to_bits()),
            Shown::Value(value) => (None, value.to_bits()),
        };
        assert!(found.iter().map(bits).eq(shown.iter().map(bits)));
        let pairs: Vec<(bool, bool)> = (0..64).map(|i| (i % 3 == 0, i % 16 < 8)).collect();
        assert_eq!(all::<(bool, bool)>(&written(&pairs)), pairs);
    }

    #[test]
    fn numbers_of_any_size_come_back_and_others_are_refused() {
        for number in [0, 1, 127, 128, 300, u64::from(u32::MAX), u64::MAX] {
            let mut bytes = Vec::new();
            write_number(number, &mut bytes);
            assert_eq!(read_number(&mut &bytes[..]), Some(number));
            bytes.pop();
            assert_eq!(read_number(&mut &bytes[..]), None, "{number} is cut");
        }
        assert_eq!(read_number(&mut &[0xff_u8; 11][..]), None);
    }
}
