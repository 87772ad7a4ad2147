//! Is there a run that never ends? `E[]`, `A<>` and `-->`, with the shortest trace if that is
//! wanted.
//!
//! A run is first searched in zones that may be too large, if the answer that there is none is
//! sound in them. A run that is found there is searched again in exact zones.

use crate::analysis::Abstraction;
use crate::ir::Predicate;
use crate::network::Symbolic;
use crate::search::liveness::emptiness::Liveness;
use crate::search::liveness::ending::RunEnding;
use crate::search::liveness::leads_to::{self, Unanswered};
use crate::search::liveness::shortest_lasso::{self, Wanted};
use crate::search::reachability::{report, search};
use crate::search::timed_trace::schedule::Stays;
use crate::search::{Outcome, Trace};

use super::attempts::{Accuracy, first_of_use};
use super::optimal_trace::{found_best, not_the_best};
use super::problem::{Problem, can_be_coarse, coarse, symbolic};
use super::witnesses::Witnesses;
use crate::engine::answer::Answer;
use crate::engine::evidence::timed_run::Shows;
use crate::engine::limits::LimitWatch;
use crate::engine::options::TraceWanted;

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
    let verdict = match witnesses.found_by(outcome) {
        Ok(run) => {
            let wanted = Wanted { open: None, keep };
            let any = (run.trace, run.ending, 0);
            let (trace, ending, _) = best_instead(any, &mut witnesses, wanted, problem, watch);
            let shows = Shows::Stays(Stays { from: None, keep });
            witnesses.add(trace, Some(ending), shows)
        }
        Err(verdict) => verdict,
    };
    witnesses.into_answer(verdict, search.counters())
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
    let outcome = report.outcome.map_err(|(failure, way)| {
        let way = match goal.failed.take() {
            None => way,
            Some(run) => leads_to::joined(way, run).0,
        };
        (failure, way)
    });
    let verdict = match witnesses.found_by(outcome) {
        Ok(way) => {
            let run = goal.run.take().expect("the search ended at a run");
            let (trace, start) = leads_to::joined(way, run.trace);
            let any = (trace, run.ending.moved(start), start);
            let wanted = Wanted {
                open: Some(open),
                keep,
            };
            let (trace, ending, start) = best_instead(any, &mut witnesses, wanted, problem, watch);
            let stays = Stays {
                from: Some((start, open)),
                keep,
            };
            witnesses.add(trace, Some(ending), Shows::Stays(stays))
        }
        Err(verdict) => verdict,
    };
    let answer = witnesses.into_answer(verdict, report.counters);
    answer.negated()
}

/// A trace, how it ends, and the state in which it begins to stay.
type Endless = (Trace, RunEnding, usize);

/// This trace, or the one with the fewest moves in its place if that is wanted and found.
fn best_instead(
    any: Endless,
    witnesses: &mut Witnesses<'_, '_>,
    wanted: Wanted<'_>,
    problem: Problem<'_>,
    watch: &mut LimitWatch,
) -> Endless {
    let best = match problem.options.trace {
        TraceWanted::Any => return any,
        TraceWanted::Fastest => Err("a run that never ends takes no least time".to_owned()),
        TraceWanted::Shortest if witnesses.is_doubtful() => {
            Err("where clocks stand still, what has the fewest moves may be no run".to_owned())
        }
        TraceWanted::Shortest => {
            let search = shortest_lasso::LassoSearch::new(witnesses.symbolic, wanted);
            found_best(watch, |watch| search.run(watch))
        }
    };
    match best {
        Ok((run, start)) => (run.trace, run.ending, start),
        Err(reason) => {
            witnesses.message = Some(not_the_best(&reason));
            any
        }
    }
}
