//! What is found of all that may come next from a state: see `unfolding.rs`.

use crate::stochastic::failure::{Failure, Stand};

/// Why a state has no finite number of outcomes with known chances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotFinite {
    /// The delay is drawn of a process that may move next.
    Drawn(Stand),
    /// The controller chooses how long it waits.
    Wait(Stand),
    /// The rates of clocks change as time passes.
    Flow,
    /// An update draws a random number.
    Random(Stand),
    /// Rounding has put the delay of a process beside the times at which it can move.
    Rounded(Stand),
    /// The strategy that is refined demands moves at certain times.
    Demand,
}

/// Which delays would be drawn.
#[derive(Clone, Debug)]
pub(in crate::stochastic) struct Drawn {
    /// Of the plan that is being made.
    is_drawn: bool,
    pub(super) of_process: Vec<bool>,
}

impl Drawn {
    pub(in crate::stochastic) fn new(processes: usize) -> Drawn {
        Drawn {
            is_drawn: false,
            of_process: vec![false; processes],
        }
    }

    pub(super) fn note(&mut self, is_drawn: bool) {
        self.is_drawn |= is_drawn;
    }

    /// The plan is that of this process.
    pub(super) fn keep(&mut self, process: usize) {
        self.of_process[process] = std::mem::take(&mut self.is_drawn);
    }
}

/// What may come next.
#[derive(Clone, Debug, Default)]
pub(in crate::stochastic) struct Unfolded {
    /// What the run is worth beyond what its state says, if it ends here.
    pub(in crate::stochastic) end: Option<f64>,
    /// How long time passes before.
    pub(in crate::stochastic) delay: f64,
    /// The chance that the controller is asked.
    pub(in crate::stochastic) asked: f64,
    /// What it can do, each with the end of its outcomes; the first outcomes are those of nobody's
    /// choice.
    pub(in crate::stochastic) choices: Vec<(Option<u32>, usize)>,
    /// The end of the outcomes of nobody's choice.
    pub(in crate::stochastic) chance_end: usize,
    pub(in crate::stochastic) outcomes: Vec<Outcome>,
    /// The words of the states after the outcomes, one after the other.
    pub(in crate::stochastic) words: Vec<i32>,
}

/// A move that may be made.
#[derive(Clone, Copy, Debug)]
pub(in crate::stochastic) struct Outcome {
    pub(in crate::stochastic) chance: f64,
    /// By how much the value grows.
    pub(in crate::stochastic) gain: f64,
}

impl Unfolded {
    pub(in crate::stochastic) fn clear(&mut self) {
        self.end = None;
        self.delay = 0.0;
        self.asked = 0.0;
        self.choices.clear();
        self.chance_end = 0;
        self.outcomes.clear();
        self.words.clear();
    }
}

/// Who may move next, and when.
pub(in crate::stochastic) struct Rivals {
    pub(in crate::stochastic) delay: f64,
    pub(in crate::stochastic) winners: Vec<usize>,
    pub(in crate::stochastic) stopped_by: Option<usize>,
}

/// Some instances, one of which is taken, with their chances.
pub(super) type Lottery = Vec<(u32, f64)>;

/// What was found, or why it is not finite.
pub(in crate::stochastic) type Found<T> = Result<Result<T, NotFinite>, Failure>;

/// Goes on with what was found, or returns why nothing can be.
macro_rules! known {
    ($found:expr) => {
        match $found? {
            Ok(known) => known,
            Err(reason) => return Ok(Err(reason)),
        }
    };
}

pub(in crate::stochastic) use known;
