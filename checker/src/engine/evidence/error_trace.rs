//! The way to a run-time error: the states to the one in which it happens, and the move that it
//! happens in.
//!
//! Searches give a trace to the state that they were at when the model failed. Some look one move
//! ahead, so that the last state can be missing; here it is added, and the failing move is found by
//! trying all moves of the last state. A game has no trace of its own: the shortest way to an error
//! is searched for, among the states that come before the end of play.

use crate::analysis::Abstraction;
use crate::ir::{Control, Objective, Predicate, Query, QueryKind};
use crate::network::{Extent, Failure, Part, Symbolic};
use crate::search::Trace;
use crate::search::reachability::goal::Goal;
use crate::search::reachability::report::Order;
use crate::search::reachability::search;
use crate::zones::Zone;

use super::timed_run::{self, Shows, ToProve};
use super::witness::{Witness, WitnessKind};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::limits::{LimitWatch, Limits};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;
use crate::engine::query::problem::{self, Problem};
use crate::engine::session::walk::{Point, successors_or_failure};

/// The way to the error in a game is searched for among this many times the states that the game
/// explored,
const EFFORT: u64 = 10;

/// and at least if there are this many.
const LEAST_EFFORT: u64 = 10_000;

impl LoadedModel {
    /// Completes the trace of an answer that is an error, and finds the move that fails.
    pub(crate) fn complete_failure(&self, query: &Query, options: &Options, answer: &mut Answer) {
        let Verdict::Error(failure) = answer.verdict else {
            return;
        };
        let predicates = predicates(&query.kind);
        let (failure, witness) = match answer.evidence.witnesses.pop() {
            Some(witness) => (failure, witness),
            None => match self.shortest_error_trace(&predicates, &query.kind, options, answer) {
                Some((found, trace)) => (found, Witness::new(trace, None, WitnessKind::Failure)),
                None => return,
            },
        };
        let (failure, witness) = self.completed(witness, &predicates, failure, options.runs);
        answer.verdict = Verdict::Error(failure);
        answer.evidence.witnesses.push(witness);
    }

    /// A way to a failure with its last state, the move that fails, and a run that goes so far; and
    /// the failure to which it leads.
    fn completed(
        &self,
        mut witness: Witness,
        predicates: &[&Predicate],
        failure: Failure,
        has_run: bool,
    ) -> (Failure, Witness) {
        let before = witness.trace.states.len();
        let (failure, failing) = self.failing_move(predicates, &mut witness.trace, failure);
        witness.failing = failing;
        let is_timed = witness.run.is_some() && witness.trace.states.len() == before;
        if has_run && !is_timed && !witness.trace.states.is_empty() {
            let mut symbolic = self.symbolic();
            let network = self.network();
            let is_doubtful = network.features.stopwatches;
            let what = ToProve {
                trace: &witness.trace,
                ending: None,
                shows: Shows::Possible,
                is_doubtful,
            };
            let run = timed_run::prove(&mut symbolic, what);
            witness.run = Some(run);
        }
        if witness.trace.states.is_empty() {
            // The initial state is where it happens, although nobody can be in it.
            witness.trace.states.extend(self.symbolic().origin());
        }
        (failure, witness)
    }

    /// The move at the end of a trace that fails, if it is one that does; a state is added if the
    /// failure is one move further on. If both it and that of a move before are run-time errors,
    /// the latter is returned instead: the way to it is shorter. All else that fails here may fail
    /// only because zones are not extrapolated.
    fn failing_move(
        &self,
        predicates: &[&Predicate],
        trace: &mut Trace,
        failure: Failure,
    ) -> (Failure, Option<Vec<Part>>) {
        let Some((words, zone)) = trace.states.last().cloned() else {
            return (failure, None);
        };
        let last = Point { words, zone };
        if self.breaks(predicates, &last, failure) {
            return (failure, None);
        }
        let mut symbolic = self.symbolic();
        let successors = match successors_or_failure(&mut symbolic, &last) {
            Ok(successors) => successors,
            Err((found, Some(parts))) if found == failure || both_run_time(found, failure) => {
                return (found, Some(parts));
            }
            Err(_) => return (failure, None),
        };
        for (parts, point) in successors {
            let next = match successors_or_failure(&mut symbolic, &point) {
                Err((found, next)) if found == failure => next,
                _ if self.breaks(predicates, &point, failure) => None,
                _ => continue,
            };
            trace.moves.push(parts);
            trace.states.push((point.words, point.zone));
            return (failure, next);
        }
        (failure, None)
    }

    /// Whether looking at the state for the query is what fails.
    fn breaks(&self, predicates: &[&Predicate], point: &Point, failure: Failure) -> bool {
        let mut symbolic = self.symbolic();
        let mut words = point.words.clone();
        predicates.iter().any(|predicate| {
            let found = symbolic.extent(predicate, &mut words, point.zone.bounds());
            found.is_err_and(|found| found == failure)
        })
    }

    /// The shortest way to an error that a game can run into, if it is found with a reasonable
    /// effort.
    fn shortest_error_trace(
        &self,
        predicates: &[&Predicate],
        kind: &QueryKind,
        options: &Options,
        answer: &Answer,
    ) -> Option<(Failure, Trace)> {
        let QueryKind::Control(Control { objective, .. }) = kind else {
            return None;
        };
        let effort = (EFFORT * answer.counters.explored).max(LEAST_EFFORT);
        let limits = Limits {
            states: Some(
                options
                    .limits
                    .states
                    .map_or(effort, |most| most.min(effort)),
            ),
            ..options.limits.clone()
        };
        let problem = Problem {
            network: self.network(),
            executor: self.executor(),
            under: None,
            options,
            guide: None,
            freedom: None,
        };
        let wanted = Abstraction::LowerUpper;
        let mut symbolic = problem::symbolic(problem, predicates, &[], wanted);
        let mut probe = Probe { predicates };
        let order = Order::BreadthFirst;
        let watch = &mut LimitWatch::new(limits);
        let looked_for = watch.bound(|watch| {
            let report = search::search(&mut symbolic, &mut probe, order, watch);
            let (failure, trace) = report.outcome.err()?;
            let is_one = failure != Failure::Interrupted;
            (is_one && !is_over_before_the_end(&mut symbolic, objective, &trace))
                .then_some((failure, trace))
        });
        looked_for.ok().flatten()
    }
}

/// Whether both are run-time errors of the model.
fn both_run_time(one: Failure, other: Failure) -> bool {
    matches!((one, other), (Failure::RunTime(_), Failure::RunTime(_)))
}

/// Whether play ends in a state of the trace before its last one.
fn is_over_before_the_end(
    symbolic: &mut Symbolic<'_>,
    objective: &Objective,
    trace: &Trace,
) -> bool {
    let before = trace
        .states
        .split_last()
        .map_or(&[][..], |(_, before)| before);
    if let Objective::Buchi(..) = objective {
        return true;
    }
    before.iter().any(|(words, zone)| {
        let mut words = words.clone();
        let won = objective.goal();
        let won = won.map(|goal| symbolic.extent(goal, &mut words, zone.bounds()));
        let kept = objective.keep();
        let kept = kept.map(|keep| symbolic.extent(keep, &mut words, zone.bounds()));
        matches!(won, Some(Ok(Extent::Everywhere))) || matches!(kept, Some(Ok(Extent::Nowhere)))
    })
}

/// What a query asks of states.
fn predicates(kind: &QueryKind) -> Vec<&Predicate> {
    match kind {
        QueryKind::Reachable(one)
        | QueryKind::Invariantly(one)
        | QueryKind::PotentiallyAlways(one)
        | QueryKind::Eventually(one) => vec![one],
        QueryKind::LeadsTo(cause, effect) => vec![cause, effect],
        QueryKind::Extremum { predicate, .. } => vec![predicate],
        QueryKind::Control(control) => control.objective.predicates().collect(),
        QueryKind::SaveStrategy { .. }
        | QueryKind::LoadStrategy { .. }
        | QueryKind::Optimum(_)
        | QueryKind::Shield(_)
        | QueryKind::Statistical(_) => Vec::new(),
    }
}

/// Looks at states as a query does, and finds nothing: only failures end its search.
struct Probe<'q> {
    predicates: &'q [&'q Predicate],
}

impl Goal for Probe<'_> {
    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        for predicate in self.predicates {
            symbolic.extent(predicate, words, zone.bounds())?;
        }
        Ok(false)
    }
}
