//! A state of a network whose clocks are words, and calls of the code that reads and changes it.
//!
//! Invariant: the words `ahead` say how far ahead of the state the last mask was asked; nothing
//! else reads them.

use super::condition::Condition;
use super::control::StateView;
use super::failure::Failure;
use crate::exec::arithmetic::{double_of_words, double_words};
use crate::exec::{Context, Executor};
use crate::ir::{FunctionId, LocationId, Network, ProcessId, STREAM_WORDS, Stream, Update};

/// Whether a condition holds at a moment and in the interval behind it, and how long that interval
/// is at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mask {
    pub(super) now: bool,
    pub(super) behind: bool,
    pub(super) horizon: f64,
}

impl Mask {
    /// What always holds, or never.
    pub(super) fn constant(holds: bool) -> Mask {
        Mask {
            now: holds,
            behind: holds,
            horizon: f64::INFINITY,
        }
    }

    pub(super) fn and(self, other: Mask) -> Mask {
        Mask {
            now: self.now && other.now,
            behind: self.behind && other.behind,
            horizon: self.horizon.min(other.horizon),
        }
    }

    pub(super) fn or(self, other: Mask) -> Mask {
        Mask {
            now: self.now || other.now,
            behind: self.behind || other.behind,
            horizon: self.horizon.min(other.horizon),
        }
    }
}

/// What is seen of a timed condition at a moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Whether it holds.
    pub(super) now: bool,
    /// On which sides its comparisons are.
    pub(super) signature: f64,
    /// In how long the next of its linear comparisons would change its side, if the rates of clocks
    /// stayed as they are.
    pub(super) gap_closes_in: f64,
}

/// A state, and what runs code on it.
pub(super) struct Machine<'a> {
    pub(super) network: &'a Network,
    executor: &'a dyn Executor,
    words: Vec<i32>,
    /// Values of clocks, for [`Machine::look_ahead`].
    values: Vec<f64>,
}

impl<'a> Machine<'a> {
    pub(super) fn new(network: &'a Network, executor: &'a dyn Executor) -> Machine<'a> {
        Machine {
            network,
            executor,
            words: network.initial.clone(),
            values: Vec::new(),
        }
    }

    /// The initial state, with the random numbers of a run.
    pub(super) fn start(&mut self, seed: u64, run: u64) {
        self.words.copy_from_slice(&self.network.initial);
        self.start_stream(seed, run);
    }

    /// Begins with the random numbers of a run.
    pub(super) fn start_stream(&mut self, seed: u64, run: u64) {
        let start = self.network.chances.stream as usize;
        Stream::start(&mut self.words[start..start + STREAM_WORDS], seed, run);
    }

    /// The words of the random numbers of the run.
    pub(super) fn stream_words(&self) -> [i32; STREAM_WORDS] {
        let start = self.network.chances.stream as usize;
        let words = &self.words[start..start + STREAM_WORDS];
        words.try_into().expect("there are as many")
    }

    /// Goes on with random numbers of a run.
    pub(super) fn set_stream(&mut self, stream: [i32; STREAM_WORDS]) {
        let start = self.network.chances.stream as usize;
        self.words[start..start + STREAM_WORDS].copy_from_slice(&stream);
    }

    /// The words of the state.
    pub(super) fn words(&self) -> &[i32] {
        &self.words
    }

    /// The state as whoever decides sees it.
    pub(super) fn view_of_state(&mut self) -> StateView<'_> {
        StateView {
            words: &mut self.words,
            executor: self.executor,
            network: self.network,
        }
    }

    /// Goes back to a state.
    pub(super) fn restore(&mut self, words: &[i32]) {
        self.words.copy_from_slice(words);
    }

    /// The random numbers of the run.
    pub(super) fn stream(&mut self) -> Stream<'_> {
        let start = self.network.chances.stream as usize;
        Stream::of(&mut self.words[start..start + STREAM_WORDS])
    }

    /// Looks at the state as it is after this time, if nothing happens until then.
    pub(super) fn look_ahead<R>(&mut self, time: f64, look: impl FnOnce(&mut Self) -> R) -> R {
        let network = self.network;
        let mut values = std::mem::take(&mut self.values);
        values.clear();
        values.extend(
            network
                .chances
                .clocks
                .iter()
                .map(|&clock| self.clock(clock).0),
        );
        self.advance(time);
        let found = look(self);
        for (&clock, &value) in network.chances.clocks.iter().zip(&values) {
            self.set_double(clock, value);
        }
        self.values = values;
        found
    }

    pub(super) fn location(&self, process: usize) -> LocationId {
        LocationId(self.words[process] as u32)
    }

    pub(super) fn enter(&mut self, ProcessId(process): ProcessId, location: LocationId) {
        self.words[process as usize] = location.0 as i32;
    }

    pub(super) fn double(&self, offset: u32) -> f64 {
        let offset = offset as usize;
        double_of_words(self.words[offset], self.words[offset + 1])
    }

    pub(super) fn set_double(&mut self, offset: u32, value: f64) {
        let offset = offset as usize;
        self.words[offset..offset + 2].copy_from_slice(&double_words(value));
    }

    /// The value of the clock at these words, and its rate.
    pub(super) fn clock(&self, offset: u32) -> (f64, f64) {
        (self.double(offset), self.double(offset + 2))
    }

    pub(super) fn set_rate(&mut self, clock: u32, rate: f64) {
        self.set_double(clock + 2, rate);
    }

    /// Lets time pass.
    pub(super) fn advance(&mut self, time: f64) {
        let network = self.network;
        for &offset in &network.chances.clocks {
            let words = &mut self.words[offset as usize..offset as usize + 4];
            let rate = double_of_words(words[2], words[3]);
            let value = double_of_words(words[0], words[1]) + rate * time;
            words[..2].copy_from_slice(&double_words(value));
        }
    }

    /// Calls a function of the model.
    pub(super) fn call(&mut self, function: FunctionId, arguments: &[i32]) -> Result<i32, Failure> {
        let mut context = Context {
            state: &mut self.words,
            constraints: &mut Vec::new(),
            assignments: &mut Vec::new(),
        };
        Ok(self.executor.call(function, arguments, &mut context)?)
    }

    /// A condition after this time, if nothing happens until then.
    pub(super) fn mask(
        &mut self,
        condition: Condition,
        arguments: &[i32],
        ahead: f64,
    ) -> Result<Mask, Failure> {
        match condition {
            Condition::Always => Ok(Mask::constant(true)),
            Condition::Never => Ok(Mask::constant(false)),
            Condition::Words(function) => {
                let bits = self.call(function, arguments)?;
                Ok(Mask::constant(bits != 0))
            }
            Condition::Compared(_) => unreachable!("it is asked as a whole"),
            Condition::Curved(function) => {
                let view = self.view(function, arguments)?;
                Ok(Mask::constant(view.now))
            }
            Condition::Timed(function) => {
                self.set_double(self.network.chances.ahead, ahead);
                let bits = self.call(function, arguments)?;
                Ok(Mask {
                    now: bits & 1 != 0,
                    behind: bits & 2 != 0,
                    horizon: self.double(self.network.chances.result),
                })
            }
        }
    }

    /// A timed condition, now.
    pub(super) fn view(
        &mut self,
        function: FunctionId,
        arguments: &[i32],
    ) -> Result<View, Failure> {
        self.set_double(self.network.chances.ahead, 0.0);
        let bits = self.call(function, arguments)?;
        Ok(View {
            now: bits & 1 != 0,
            signature: self.double(self.network.chances.signature),
            gap_closes_in: self.double(self.network.chances.result),
        })
    }

    /// Whether a condition holds now.
    pub(super) fn holds(
        &mut self,
        condition: Condition,
        arguments: &[i32],
    ) -> Result<bool, Failure> {
        Ok(self.mask(condition, arguments, 0.0)?.now)
    }

    /// The double that a function leaves.
    pub(super) fn real(&mut self, function: FunctionId, arguments: &[i32]) -> Result<f64, Failure> {
        self.call(function, arguments)?;
        Ok(self.double(self.network.chances.result))
    }

    pub(super) fn update(&mut self, update: &Update, arguments: &[i32]) -> Result<(), Failure> {
        if let Some(function) = update.function {
            self.call(function, arguments)?;
        }
        Ok(())
    }
}
