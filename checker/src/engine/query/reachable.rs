//! Is there a state? `E<>`, and what `A[]` asks for; with the trace that is wanted or a
//! certificate.

use std::sync::Arc;

use crate::analysis::Abstraction;
use crate::ir::Predicate;
use crate::network::symbolic::predicate;
use crate::network::{PartialOrder, Symbolic, Symmetry};
use crate::search::reachability::report::Report;
use crate::search::reachability::search;
use crate::search::{Outcome, Trace};

use super::optimal_trace::{Sought, best, not_the_best};
use super::subject::{Subject, coarser, live_variables, symbolic};
use super::witnesses::Witnesses;
use crate::engine::answer::{Answer, Evidence, Verdict};
use crate::engine::evidence::certificate;
use crate::engine::evidence::timed_run::Shows;
use crate::engine::limits::LimitWatch;
use crate::engine::{Options, TraceWanted};

/// Is there a state in which the goal holds?
pub(super) fn reachable<'a>(
    subject: Subject<'a>,
    goal: &Predicate,
    options: &Options,
    symmetry: Option<&Arc<Symmetry>>,
    watch: &mut LimitWatch,
) -> Answer {
    // A strategy may forbid moves in one order and allow them in another.
    let is_ordered = options.reductions.partial_order && subject.under.is_none();
    let order = is_ordered
        .then(|| PartialOrder::new(subject.network, goal, options.tuning))
        .flatten();
    let live = live_variables(subject, predicate::functions(goal), options, symmetry);
    let reduced = |symbolic: Symbolic<'a>| {
        let symbolic = symbolic.reduced_by(symmetry.cloned());
        symbolic.ordered_by(order.clone()).forgetting(live.clone())
    };
    if let Some((mut symbolic, report)) = reach_coarsely(subject, goal, options, reduced, watch) {
        return conclude(subject, &mut symbolic, goal, report, options, watch);
    }
    let mut symbolic = reduced(symbolic(subject, &[goal], &[], Abstraction::LowerUpper));
    let mut look = goal;
    let report = search::search_shared(&mut symbolic, &mut look, options.manner(), watch);
    conclude(subject, &mut symbolic, goal, report, options, watch)
}

/// Looks for a deadlock in zones that are too large for it. One that is found counts if it remains
/// in the exact zones of its trace. `None` if this settles nothing, or does not apply.
fn reach_coarsely<'a>(
    subject: Subject<'a>,
    goal: &Predicate,
    options: &Options,
    reduced: impl FnOnce(Symbolic<'a>) -> Symbolic<'a>,
    watch: &mut LimitWatch,
) -> Option<(Symbolic<'a>, Report)> {
    // The zones of a certificate must be free of deadlocks themselves, and the best trace is found
    // in them.
    let is_exact = options.certificate || options.trace != TraceWanted::Any;
    if is_exact || !predicate::has_deadlock(goal) {
        return None;
    }
    let mut coarse = reduced(coarser(subject, &[goal])?);
    let mut look = goal;
    let report = search::search_shared(&mut coarse, &mut look, options.manner(), watch);
    let is_settled = match &report.outcome {
        Ok(Outcome::Found(trace)) => ends_in(&mut coarse, goal, trace),
        _ => true,
    };
    is_settled.then_some((coarse, report))
}

/// Whether the last state of a trace, whose zones are exact, satisfies the predicate somewhere.
fn ends_in(symbolic: &mut Symbolic<'_>, goal: &Predicate, trace: &Trace) -> bool {
    let Some((words, zone)) = trace.states.last() else {
        return false;
    };
    let is_whole = trace.states.len() == trace.moves.len() + 1;
    is_whole
        && symbolic
            .holds_somewhere(goal, &mut words.clone(), zone.bounds())
            .is_ok_and(|holds| holds)
}

/// The answer that the report of a search for the goal amounts to.
fn conclude(
    subject: Subject<'_>,
    symbolic: &mut Symbolic<'_>,
    goal: &Predicate,
    report: Report,
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let counters = report.counters;
    let mut witnesses = Witnesses::new(symbolic, options);
    let mut certificate = None;
    let mut message = None;
    let verdict = match report.outcome {
        Ok(Outcome::Found(trace)) => {
            let symbolic = &mut *witnesses.symbolic;
            let sought = Sought {
                target: &mut &*goal,
                predicate: goal,
                atoms: Vec::new(),
            };
            let (trace, deadline) = match best(subject, symbolic, sought, options, watch) {
                Ok(None) => (trace, None),
                Ok(Some((best, deadline))) => (best, deadline),
                Err(reason) => {
                    message = Some(not_the_best(&reason));
                    (trace, None)
                }
            };
            witnesses.add(trace, None, Shows::Reaches(goal, deadline))
        }
        Ok(Outcome::Exhausted) => {
            if options.certificate && subject.under.is_some() {
                message = Some("no certificate: it would be about the model alone".to_owned());
            } else if options.certificate {
                let whole = certificate::with_all_words(subject.network);
                let subject = Subject {
                    network: &whole,
                    ..subject
                };
                let mut zones = self::symbolic(subject, &[goal], &[], Abstraction::LowerUpper);
                match certificate::reached(&mut zones, goal, counters, watch) {
                    Ok(reached) => certificate = Some(reached),
                    Err(reason) => message = Some(format!("no certificate: {reason}")),
                }
            }
            Verdict::NotSatisfied
        }
        Ok(Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, trace)) => {
            witnesses.add(trace, None, Shows::Possible);
            Verdict::Error(failure)
        }
    };
    let evidence = Evidence {
        certificate,
        ..witnesses.into_evidence()
    };
    Answer {
        message,
        evidence,
        ..Answer::new(verdict, counters)
    }
}
