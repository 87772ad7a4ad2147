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

use super::attempts::{Accuracy, first_of_use};
use super::optimal_trace::{Sought, best_instead};
use super::problem::{Problem, can_be_coarse, coarse, live_variables, symbolic};
use super::witnesses::Witnesses;
use crate::engine::answer::{Answer, Verdict, Wanted};
use crate::engine::evidence::certificate;
use crate::engine::evidence::timed_run::Shows;
use crate::engine::limits::LimitWatch;
use crate::engine::options::TraceWanted;

/// A search for the goal that has ended, with its zones.
struct Searched<'a> {
    symbolic: Symbolic<'a>,
    report: Report,
}

/// Is there a state in which the goal holds?
pub(super) fn reachable<'a>(
    problem: Problem<'a>,
    goal: &Predicate,
    symmetry: Option<&Arc<Symmetry>>,
    watch: &mut LimitWatch,
) -> Answer {
    let options = problem.options;
    // A strategy may forbid moves in one order and allow them in another.
    let is_ordered = options.reductions.partial_order && problem.under.is_none();
    let order = is_ordered
        .then(|| PartialOrder::new(problem.network, goal, options.tuning))
        .flatten();
    let live = live_variables(problem, predicate::functions(goal), symmetry);
    let search = |accuracy| {
        let symbolic = match accuracy {
            Accuracy::Coarse => coarse(problem, &[goal]),
            Accuracy::Exact => symbolic(problem, &[goal], &[], Abstraction::LowerUpper),
        };
        let symbolic = symbolic.reduced_by(symmetry.cloned());
        let mut symbolic = symbolic.ordered_by(order.clone()).forgetting(live.clone());
        let mut look = goal;
        let report = search::search_shared(&mut symbolic, &mut look, options.manner(), watch);
        Searched { symbolic, report }
    };
    let is_settled = |searched: &mut Searched<'a>| match &searched.report.outcome {
        Ok(Outcome::Found(trace)) => ends_in(&mut searched.symbolic, goal, trace),
        _ => true,
    };
    let attempts = attempts(problem, goal);
    let searched = first_of_use(attempts, search, |_, searched| is_settled(searched));
    conclude(problem, goal, searched, watch)
}

/// A deadlock is first searched in zones that are too large for it. One that is found counts if it
/// remains in the exact zones of its trace.
fn attempts(problem: Problem<'_>, goal: &Predicate) -> &'static [Accuracy] {
    // The zones of a certificate must be free of deadlocks themselves, and the best trace is found
    // in them.
    let is_exact = problem.options.certificate || problem.options.trace != TraceWanted::Any;
    if is_exact || !predicate::has_deadlock(goal) || !can_be_coarse(problem, &[goal]) {
        return &[Accuracy::Exact];
    }
    &[Accuracy::Coarse, Accuracy::Exact]
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
    problem: Problem<'_>,
    goal: &Predicate,
    searched: Searched<'_>,
    watch: &mut LimitWatch,
) -> Answer {
    let Searched {
        mut symbolic,
        report,
    } = searched;
    let counters = report.counters;
    let mut witnesses = Witnesses::new(&mut symbolic, problem.options);
    let verdict = match witnesses.found_by(report.outcome) {
        Ok(trace) => {
            let sought = Sought {
                target: &mut &*goal,
                predicate: goal,
                atoms: Vec::new(),
            };
            let (trace, deadline) = best_instead(trace, &mut witnesses, problem, sought, watch);
            witnesses.add(trace, None, Shows::Reaches(goal, deadline))
        }
        Err(verdict) => verdict,
    };
    let mut answer = witnesses.into_answer(verdict, counters);
    if verdict == Verdict::NotSatisfied && problem.options.certificate {
        add_certificate(&mut answer, problem, goal, watch);
    }
    answer
}

/// Adds the states that are reached, none of which satisfies the goal, or why there are none.
fn add_certificate(
    answer: &mut Answer,
    problem: Problem<'_>,
    goal: &Predicate,
    watch: &mut LimitWatch,
) {
    if problem.under.is_some() {
        answer.remark("no certificate: it would be about the model alone");
        return;
    }
    let whole = certificate::with_all_words(problem.network);
    let problem = Problem {
        network: &whole,
        ..problem
    };
    let mut zones = symbolic(problem, &[goal], &[], Abstraction::LowerUpper);
    match certificate::reached(&mut zones, goal, answer.counters, watch) {
        Ok(reached) => answer.evidence.certificate = Some(reached),
        Err((why, reason)) => {
            answer.remark(format!("no certificate: {why}"));
            if let Some(reason) = reason {
                answer.lacks(Wanted::Certificate, reason);
            }
        }
    }
}
