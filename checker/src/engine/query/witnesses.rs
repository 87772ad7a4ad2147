//! Collects what backs an answer: traces, with their runs in exact times.

use crate::cancellation;
use crate::network::symbolic::predicate;
use crate::network::{Failure, Symbolic};
use crate::search::limits::Counters;
use crate::search::liveness::ending::RunEnding;
use crate::search::{Outcome, Trace};

use crate::engine::answer::{Answer, Evidence, Verdict};
use crate::engine::evidence::timed_run::{self, Shows, Takes, ToProve};
use crate::engine::evidence::witness::{Missing, Proof, Witness, WitnessKind};
use crate::engine::options::Options;

/// The verdict on something that was found, in zones that may be too large.
pub(super) fn found(is_approximate: bool) -> Verdict {
    if is_approximate {
        Verdict::Maybe
    } else {
        Verdict::Satisfied
    }
}

/// Collects what backs an answer.
pub(super) struct Witnesses<'w, 'a> {
    pub(super) symbolic: &'w mut Symbolic<'a>,
    has_runs: bool,
    /// Whether what was found is sure only if a run is replayed.
    is_doubtful: bool,
    /// Whether the runs follow a strategy.
    is_restricted: bool,
    found: Vec<Witness>,
    /// A remark for the user.
    pub(super) message: Option<String>,
}

impl<'w, 'a> Witnesses<'w, 'a> {
    pub(super) fn new(symbolic: &'w mut Symbolic<'a>, options: &Options) -> Witnesses<'w, 'a> {
        Witnesses {
            has_runs: options.runs,
            is_doubtful: symbolic.is_approximate(),
            is_restricted: symbolic.is_restricted(),
            symbolic,
            found: Vec::new(),
            message: None,
        }
    }

    /// The same for a result that is certain only if a run is replayed: there is another doubt, in
    /// addition to zones that are too large.
    pub(super) fn doubting(self, is_doubtful: bool) -> Witnesses<'w, 'a> {
        Witnesses {
            is_doubtful: self.is_doubtful || is_doubtful,
            ..self
        }
    }

    /// Whether what was found is sure only if a run is replayed.
    pub(super) fn is_doubtful(&self) -> bool {
        self.is_doubtful
    }

    /// Adds a trace, with its run if runs are wanted; returns the verdict that it shows. If there
    /// is a doubt, the run is computed too, since then only the run gives certainty.
    pub(super) fn add(
        &mut self,
        trace: Trace,
        ending: Option<RunEnding>,
        shows: Shows<'_>,
    ) -> Verdict {
        let kind = match shows {
            Shows::Possible => WitnessKind::Failure,
            Shows::Reaches(..) | Shows::Stays(_) => WitnessKind::Predicate,
            Shows::Takes(takes) => WitnessKind::Value(takes.item, takes.shown),
        };
        let mut witness = Witness::new(trace, ending, kind);
        // An initial state that cannot be entered is no run. What is stuck under a strategy may go
        // on in the model, which is what the replay knows, and priorities count in the model.
        let is_dead = match shows {
            Shows::Reaches(predicate, _) | Shows::Takes(Takes { predicate, .. }) => {
                predicate::has_deadlock(predicate)
            }
            Shows::Stays(_) => ending == Some(RunEnding::Stuck),
            Shows::Possible => false,
        };
        let is_comparable = !(self.is_restricted && is_dead || self.symbolic.ignores_priorities());
        let mut is_replayed = false;
        let is_wanted = self.has_runs || self.is_doubtful;
        if is_wanted && is_comparable && !witness.trace.states.is_empty() {
            let what = ToProve {
                trace: &witness.trace,
                ending,
                shows,
                is_doubtful: self.is_doubtful || self.symbolic.is_approximate(),
            };
            let prove = || timed_run::prove(self.symbolic, what);
            let proof = cancellation::unless_cut(prove);
            let proof = proof.unwrap_or(Proof::Missing(Missing::Stopped));
            is_replayed = matches!(proof, Proof::Replayed(..));
            witness.run = self.has_runs.then_some(proof);
        }
        self.found.push(witness);
        found(self.is_doubtful && !is_replayed)
    }

    /// What a search has found, or the verdict without it; with the way to a failure.
    pub(super) fn found_by<T>(
        &mut self,
        outcome: Result<Outcome<T>, (Failure, Trace)>,
    ) -> Result<T, Verdict> {
        match outcome {
            Ok(Outcome::Found(found)) => Ok(found),
            Ok(Outcome::Exhausted) => Err(Verdict::NotSatisfied),
            Ok(Outcome::Stopped(reason)) => Err(Verdict::Unknown(reason)),
            Err((failure, trace)) => {
                self.add(trace, None, Shows::Possible);
                Err(Verdict::Error(failure))
            }
        }
    }

    pub(super) fn into_witnesses(self) -> Vec<Witness> {
        self.found
    }

    pub(super) fn into_answer(self, verdict: Verdict, counters: Counters) -> Answer {
        let evidence = Evidence {
            witnesses: self.found,
            ..Evidence::default()
        };
        Answer {
            message: self.message,
            evidence,
            ..Answer::new(verdict, counters)
        }
    }
}
