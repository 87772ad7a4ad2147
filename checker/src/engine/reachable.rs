//! Is there a state? `E<>`, and what `A[]` asks for; with the trace that is wanted or a certificate.

use std::sync::Arc;

use crate::ir::{ClockAtom, ClockId, ClockRange, Predicate};
use crate::network::{Abstraction, Failure, PartialOrder, Symbolic, Symmetry, predicate};
use crate::search::limits::Counters;
use crate::search::plain;
use crate::search::reach::{self, Outcome, Report, Trace};
use crate::zones::Bound;

use super::answer::Evidence;
use super::answer::{Answer, Subject, Verdict, Witnesses, coarser, found, new_answer, symbolic};
use super::certificate;
use super::evidence::Shows;
use super::limits::LimitWatch;
use super::timing::with_time;
use super::{Options, TraceWanted};

/// Is there a state in which the goal holds?
pub(super) fn reachable<'a>(
    subject: Subject<'a>,
    goal: &Predicate,
    options: &Options,
    symmetry: Option<&Arc<Symmetry>>,
    watch: &mut LimitWatch,
) -> Answer {
    // A strategy may forbid moves in one order and allow them in another.
    let is_ordered = options.partial_order && subject.under.is_none();
    let order = is_ordered
        .then(|| PartialOrder::new(subject.network, goal))
        .flatten();
    let reduced = |symbolic: Symbolic<'a>| {
        let symbolic = symbolic.reduced_by(symmetry.cloned());
        symbolic.ordered_by(order.clone())
    };
    if let Some((mut symbolic, report)) = reach_coarsely(subject, goal, options, reduced, watch) {
        return conclude(subject, &mut symbolic, goal, report, options, watch);
    }
    let mut symbolic = reduced(symbolic(subject, &[goal], &[], Abstraction::LowerUpper));
    let mut look = goal;
    let report = reach::search_shared(&mut symbolic, &mut look, options.manner(), watch);
    conclude(subject, &mut symbolic, goal, report, options, watch)
}

/// Looks for a deadlock in zones that are too large for it. One that is found counts if it remains in the exact zones of its trace.
/// `None` if this settles nothing, or does not apply.
fn reach_coarsely<'a>(
    subject: Subject<'a>,
    goal: &Predicate,
    options: &Options,
    reduced: impl FnOnce(Symbolic<'a>) -> Symbolic<'a>,
    watch: &mut LimitWatch,
) -> Option<(Symbolic<'a>, Report)> {
    // The zones of a certificate must be free of deadlocks themselves, and the best trace is found in them.
    let is_exact = options.certificate || options.trace != TraceWanted::Any;
    if is_exact || !predicate::has_deadlock(goal) {
        return None;
    }
    let mut coarse = reduced(coarser(subject, &[goal])?);
    let mut look = goal;
    let report = reach::search_shared(&mut coarse, &mut look, options.manner(), watch);
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
            .extent(goal, &mut words.clone(), zone.bounds())
            .is_ok_and(|extent| extent.is_somewhere())
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
            let (trace, deadline) = match best(subject, symbolic, goal, options, watch) {
                Ok(None) => (trace, None),
                Ok(Some((best, deadline))) => (best, deadline),
                Err(reason) => {
                    message = Some(format!("the trace is not the one wanted: {reason}"));
                    (trace, None)
                }
            };
            let is_sure = witnesses.add(trace, None, Shows::Reaches(goal, deadline));
            found(witnesses.symbolic.is_approximate() && !is_sure)
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
    let mut answer = new_answer(verdict, evidence, counters);
    answer.message = message;
    answer
}

/// The trace with the fewest moves or the least time, and its time; `None` if any trace will do.
fn best(
    subject: Subject<'_>,
    symbolic: &mut Symbolic<'_>,
    goal: &Predicate,
    options: &Options,
    watch: &mut LimitWatch,
) -> Result<Option<(Trace, Option<plain::Cost>)>, String> {
    let none = Counters::default();
    let way = match options.trace {
        TraceWanted::Any => return Ok(None),
        TraceWanted::Shortest => {
            plain::Search::new(symbolic, goal, plain::Measure::Moves, none).run(watch)
        }
        TraceWanted::Fastest if subject.under.is_some() => {
            return Err("there is none for fastest traces under a strategy".to_owned());
        }
        TraceWanted::Fastest => {
            let (timed, clock) = with_time(subject.network);
            let subject = Subject {
                network: &timed,
                ..subject
            };
            let mut zones = self::symbolic(
                subject,
                &[goal],
                &[time_atom(clock)],
                Abstraction::LowerUpper,
            );
            plain::Search::new(&mut zones, goal, plain::Measure::Time(clock), none).run(watch)
        }
    };
    match way {
        Ok(plain::Outcome::Found(way)) => {
            let deadline = (options.trace == TraceWanted::Fastest).then_some(way.cost);
            Ok(Some((way.trace(symbolic, goal), deadline)))
        }
        Ok(plain::Outcome::Exhausted) => Err("a search for it finds none".to_owned()),
        Ok(plain::Outcome::Stopped(reason)) => Err(certificate::stop_text(reason).to_owned()),
        Err(Failure::Interrupted) => Err(certificate::stop_text(watch.stop()).to_owned()),
        // The search for any trace did not come to the state that fails.
        Err(_) => Err("the model fails in a state beside it".to_owned()),
    }
}

/// A comparison that keeps the lower bounds of the clock apart.
fn time_atom(clock: usize) -> ClockAtom {
    let range = |clock: usize| ClockRange {
        first: ClockId(clock as u32),
        count: 1,
    };
    ClockAtom {
        left: range(clock),
        right: range(0),
        low: LONGEST_TIME,
        high: LONGEST_TIME,
        strict: false,
    }
}

/// Up to here times of traces are compared.
const LONGEST_TIME: i32 = Bound::MAX_VALUE / 4;
