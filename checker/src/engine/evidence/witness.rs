//! What backs a verdict or a value: a symbolic run, and the run with exact times that proves it.

use crate::ir::Network;
use crate::network::{Failure, Part};
use crate::search::Trace;
use crate::search::liveness::ending::RunEnding;
use crate::verify::replay::{self, Claim, Coverage, Outcome, Run, Shown};
use crate::verify::{self, State, Violation};

/// What backs a verdict or a value: a witness, a counterexample, or the way to a failure.
#[derive(Clone, Debug)]
pub struct Witness {
    /// What it shows, if the answer has several.
    pub title: Option<String>,
    /// The symbolic run.
    pub trace: Trace,
    /// Why it never ends, if it does not.
    pub ending: Option<RunEnding>,
    /// The move that fails in the last state, if it leads to a failure that is in one.
    pub failing: Option<Vec<Part>>,
    /// Whether it shows what the query asks about, a value, or only the way to a failure.
    pub kind: WitnessKind,
    /// The run with exact times, if it was wanted.
    pub run: Option<Proof>,
}

/// What a witness is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WitnessKind {
    /// The way to a failure of the model.
    Failure,
    /// What the query asks about.
    Predicate,
    /// A value of the item with this index.
    Value(usize, Shown),
}

impl Witness {
    /// A symbolic run without anything.
    pub fn new(trace: Trace, ending: Option<RunEnding>, kind: WitnessKind) -> Witness {
        Witness {
            title: None,
            trace,
            ending,
            failing: None,
            kind,
            run: None,
        }
    }
}

/// What became of the run with exact times.
#[derive(Clone, Debug)]
pub enum Proof {
    /// It was replayed: the states on entry, in ticks, and what was checked.
    Replayed(Run, Vec<State>, Coverage),
    /// The replay shows a mistake in it.
    Violated(Run, Violation),
    /// The moves of the trace have no times although its zones are exact.
    Impossible,
    /// There is none.
    Missing(Missing),
}

impl Proof {
    /// What the replay of a run says of a claim.
    pub(crate) fn of(network: &Network, run: Run, claim: &Claim<'_>) -> Proof {
        match replay::replay(network, &run, claim) {
            Ok(Outcome::Replayed(states, coverage)) => Proof::Replayed(run, states, coverage),
            Ok(Outcome::Violated(violation)) => Proof::Violated(run, violation),
            Err(error) => Proof::Missing(Missing::NotCovered(error)),
        }
    }
    /// Whether the run shows what it should; `None` if there is none.
    pub(crate) fn holds(&self) -> Option<bool> {
        match self {
            Proof::Replayed(..) => Some(true),
            Proof::Violated(..) | Proof::Impossible => Some(false),
            Proof::Missing(_) => None,
        }
    }
}

/// Why there is no run with exact times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The zones of the trace are too large, and its moves are not possible in this order.
    Approximate,
    /// The moves are not possible with the values that `meta` variables have on this way.
    Meta,
    /// Too many alternatives.
    TooHard,
    /// No two states on the loop were found that lie in the same region.
    OpenLoop,
    /// A limit came first, or the user interrupted.
    Stopped,
    /// The model failed.
    Failed(Failure),
    /// The replay does not cover the model or query.
    NotCovered(verify::Error),
}
