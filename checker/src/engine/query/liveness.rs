//! Is there a run that never ends? `E[]`, `A<>` and `-->`, with the shortest trace if that is
//! wanted.
//!
//! A run is first searched in zones that may be too large, if the answer that there is none is
//! sound in them. A run that is found there is searched again in exact zones.

use crate::analysis::Abstraction;
use crate::ir::Predicate;
use crate::network::{Failure, Symbolic};
use crate::search::liveness::emptiness::Liveness;
use crate::search::liveness::ending::RunEnding;
use crate::search::liveness::leads_to::{self, Unanswered};
use crate::search::liveness::shortest_lasso::{self, Wanted};
use crate::search::reachability::{report, search};
use crate::search::timed_trace::schedule::Stays;
use crate::search::{Outcome, Trace};

use super::attempts::{Accuracy, first_of_use};
use super::optimal_trace::not_the_best;
use super::problem::{Problem, can_be_coarse, coarse, symbolic};
use super::witnesses::Witnesses;
use crate::engine::answer::{Answer, Verdict};
use crate::engine::evidence::timed_run::Shows;
use crate::engine::limits::{LimitWatch, cut_as_interrupted, stop_text};
use crate::engine::{Options, TraceWanted};

/// The result of a search in coarser zones, unless it found something that may not exist; otherwise
/// the result of the same search in exact zones.
fn settle<'a, T>(
    problem: Problem<'a>,
    predicates: &[&Predicate],
    mut search: impl FnMut(Symbolic<'a>) -> T,
    is_found: impl Fn(&T) -> bool,
) -> T {
    let attempts: &[Accuracy] = if can_be_coarse(problem, predicates) {
        &[Accuracy::Coarse, Accuracy::Exact]
    } else {
        &[Accuracy::Exact]
    };
    let make = |accuracy| {
        search(match accuracy {
            Accuracy::Coarse => coarse(problem, predicates),
            Accuracy::Exact => symbolic(problem, predicates, &[], Abstraction::Maximum),
        })
    };
    first_of_use(attempts, make, |_, result| !is_found(result))
}

/// Is there a run inside the predicate that never leaves it?
pub(super) fn always<'a>(problem: Problem<'a>, keep: &Predicate, watch: &mut LimitWatch) -> Answer {
    let search = |mut symbolic: Symbolic<'a>| {
        let mut search = Liveness::new(&symbolic, keep);
        let outcome = search.from_start(&mut symbolic, watch);
        (symbolic, search, outcome)
    };
    let is_found = |(.., outcome): &(_, _, Result<_, _>)| matches!(outcome, Ok(Outcome::Found(_)));
    let (mut symbolic, search, outcome) = settle(problem, &[keep], search, is_found);
    let mut witnesses = Witnesses::new(&mut symbolic, problem.options).doubting(search.is_coarse());
    let mut message = None;
    let verdict = match outcome {
        Ok(Outcome::Found(run)) => {
            let wanted = Wanted { open: None, keep };
            let any = (run.trace, run.ending, 0);
            let best = best(&mut witnesses, wanted, problem.options, watch);
            let (trace, ending, _) = chosen(any, best, &mut message);
            let shows = Shows::Stays(Stays { from: None, keep });
            witnesses.add(trace, Some(ending), shows)
        }
        Ok(Outcome::Exhausted) => Verdict::NotSatisfied,
        Ok(Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, trace)) => {
            witnesses.add(trace, None, Shows::Possible);
            Verdict::Error(failure)
        }
    };
    Answer {
        message,
        evidence: witnesses.into_evidence(),
        ..Answer::new(verdict, search.counters())
    }
}

/// Does every state of `open` lead out of `keep`?
pub(super) fn leads_to<'a>(
    problem: Problem<'a>,
    open: &Predicate,
    keep: &Predicate,
    watch: &mut LimitWatch,
) -> Answer {
    let search = |mut symbolic: Symbolic<'a>| {
        let mut goal = Unanswered::new(&symbolic, open, keep);
        let report = search::search(&mut symbolic, &mut goal, problem.options.order, watch);
        (symbolic, goal, report)
    };
    let is_found =
        |(.., report): &(_, _, report::Report)| matches!(report.outcome, Ok(Outcome::Found(_)));
    let (mut symbolic, mut goal, report) = settle(problem, &[open, keep], search, is_found);
    let mut witnesses = Witnesses::new(&mut symbolic, problem.options).doubting(goal.is_coarse());
    let mut message = None;
    let verdict = match report.outcome {
        Ok(Outcome::Found(way)) => {
            let run = goal.run.take().expect("the search ended at a run");
            let (trace, start) = leads_to::joined(way, run.trace);
            let any = (trace, run.ending.moved(start), start);
            let wanted = Wanted {
                open: Some(open),
                keep,
            };
            let best = best(&mut witnesses, wanted, problem.options, watch);
            let (trace, ending, start) = chosen(any, best, &mut message);
            let stays = Stays {
                from: Some((start, open)),
                keep,
            };
            witnesses.add(trace, Some(ending), Shows::Stays(stays))
        }
        Ok(Outcome::Exhausted) => Verdict::NotSatisfied,
        Ok(Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, way)) => {
            let below = goal.failed.take();
            let way = match below {
                None => way,
                Some(run) => leads_to::joined(way, run).0,
            };
            witnesses.add(way, None, Shows::Possible);
            Verdict::Error(failure)
        }
    };
    let answer = Answer {
        message,
        evidence: witnesses.into_evidence(),
        ..Answer::new(verdict, report.counters)
    };
    answer.negated()
}

/// A trace, how it ends, and the state in which it begins to stay.
type Endless = (Trace, RunEnding, usize);

/// The best trace, or any one with a message that says why.
fn chosen(
    any: Endless,
    best: Result<Option<Endless>, String>,
    message: &mut Option<String>,
) -> Endless {
    match best {
        Ok(best) => best.unwrap_or(any),
        Err(reason) => {
            *message = Some(not_the_best(&reason));
            any
        }
    }
}

/// The trace with the fewest moves; `None` if any trace will do.
fn best(
    witnesses: &mut Witnesses<'_, '_>,
    wanted: Wanted<'_>,
    options: &Options,
    watch: &mut LimitWatch,
) -> Result<Option<Endless>, String> {
    match options.trace {
        TraceWanted::Any => return Ok(None),
        TraceWanted::Shortest => {}
        TraceWanted::Fastest => {
            return Err("a run that never ends takes no least time".to_owned());
        }
    }
    if witnesses.is_doubtful() {
        return Err("where clocks stand still, what has the fewest moves may be no run".to_owned());
    }
    let search = shortest_lasso::LassoSearch::new(witnesses.symbolic, wanted);
    match cut_as_interrupted(|| search.run(watch)) {
        Ok(Outcome::Found((run, start))) => Ok(Some((run.trace, run.ending, start))),
        Ok(Outcome::Exhausted) => Err("a search for it finds none".to_owned()),
        Ok(Outcome::Stopped(reason)) => Err(stop_text(reason).to_owned()),
        Err(Failure::Interrupted) => Err(stop_text(watch.stop()).to_owned()),
        // The search for any run did not reach the state that fails.
        Err(_) => Err("the model fails in a state beside it".to_owned()),
    }
}
