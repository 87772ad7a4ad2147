//! Compiled queries for the best strategy.

use super::ids::{FunctionId, ProcessId};
use super::runs::{Path, RunBound};

/// `minE`, `maxE`, `minPr` or `maxPr`.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// Whether the greatest value is the best.
    pub is_greatest: bool,
    /// What has a value.
    pub aim: Aim,
    /// How long a run is.
    pub bound: RunBound,
    /// What ends a run before its bound, as `<> p`.
    pub goal: Option<Path>,
    /// What the strategy sees; `None` is the whole state.
    pub features: Option<Observation>,
}

/// What a best strategy is best for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aim {
    /// The mean, over runs, of the number that this function leaves at the end of a run.
    Expected(FunctionId),
    /// The mean time until the end of a run.
    Time,
    /// The probability that the goal is reached.
    Probability,
}

/// What a strategy sees of a state.
#[derive(Clone, Debug, Default)]
pub struct Observation {
    /// Of these the exact values.
    pub discrete: Vec<Feature>,
    /// Of these in which intervals they lie.
    pub continuous: Vec<Feature>,
}

impl Aim {
    /// The function that leaves the number whose mean is asked for, if it is one.
    pub fn number(self) -> Option<FunctionId> {
        match self {
            Aim::Expected(number) => Some(number),
            Aim::Time | Aim::Probability => None,
        }
    }
}

impl Observation {
    /// How many words the exact values take: doubles take two.
    pub fn words(&self) -> usize {
        let words = self.discrete.iter().map(|feature| match feature.seen {
            Seen::Location(_) | Seen::Integer(_) => 1,
            Seen::Double(_) | Seen::Clock(_) | Seen::Computed(_) => 2,
        });
        words.sum()
    }

    /// Whether a clock is seen in intervals.
    pub fn has_clocks(&self) -> bool {
        let mut features = self.continuous.iter();
        features.any(|one| matches!(one.seen, Seen::Clock(_)))
    }
}

/// A number that a strategy sees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Feature {
    /// The expression, blanks collapsed.
    pub text: String,
    /// Where it comes from.
    pub seen: Seen,
}

/// Where a feature comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seen {
    /// The location that a process is in.
    Location(ProcessId),
    /// An integer at this word.
    Integer(u32),
    /// A double at these words.
    Double(u32),
    /// The clock at these words.
    Clock(u32),
    /// The number that a function leaves as a double.
    Computed(FunctionId),
}
