//! Traces to a state that are the best: with the fewest moves, or in the least time.

use crate::analysis::Abstraction;
use crate::analysis::clock_differences::greatest_constant;
use crate::ir::{ClockAtom, ClockId, ClockRange, Network, Predicate};
use crate::network::{Failure, Symbolic};
use crate::search::limits::Counters;
use crate::search::optimum::best_first;
use crate::search::reachability::goal::Target;
use crate::search::{Outcome, Trace};
use crate::zones::Bound;

use super::problem::{Problem, symbolic};
use super::time_clock::with_time;
use super::witnesses::Witnesses;
use crate::engine::limits::{LimitWatch, cut_as_interrupted, stop_text};
use crate::engine::options::TraceWanted;

/// The states that a trace is to lead to.
pub(super) struct Sought<'q> {
    pub(super) target: &'q mut dyn Target,
    /// What holds in them.
    pub(super) predicate: &'q Predicate,
    /// Additional comparisons that distinguish them from others; those of the predicate count too.
    pub(super) atoms: Vec<ClockAtom>,
}

/// The remark on a trace that is any one, for this reason.
pub(super) fn not_the_best(reason: &str) -> String {
    format!("the trace is not the one wanted: {reason}")
}

/// What a search for the best finds, or why there is nothing better than what was found before.
pub(super) fn found_best<T>(
    watch: &mut LimitWatch,
    search: impl FnOnce(&mut LimitWatch) -> Result<Outcome<T>, Failure>,
) -> Result<T, String> {
    match cut_as_interrupted(|| search(watch)) {
        Ok(Outcome::Found(best)) => Ok(best),
        Ok(Outcome::Exhausted) => Err("a search for it finds none".to_owned()),
        Ok(Outcome::Stopped(reason)) => Err(stop_text(reason).to_owned()),
        Err(Failure::Interrupted) => Err(stop_text(watch.stop()).to_owned()),
        // The search for any trace did not reach the state that fails.
        Err(_) => Err("the model fails in a state beside it".to_owned()),
    }
}

/// This trace, or in its place the best one with its time, if that is wanted and found. The zones
/// of the witnesses keep the comparisons of what is sought.
pub(super) fn best_instead(
    any: Trace,
    witnesses: &mut Witnesses<'_, '_>,
    problem: Problem<'_>,
    sought: Sought<'_>,
    watch: &mut LimitWatch,
) -> (Trace, Option<best_first::Cost>) {
    match best(problem, witnesses.symbolic, sought, watch) {
        Ok(best) => best.unwrap_or((any, None)),
        Err(reason) => {
            witnesses.message = Some(not_the_best(&reason));
            (any, None)
        }
    }
}

/// The trace with the fewest moves or the least time, and its time; `None` if any trace will do.
fn best(
    problem: Problem<'_>,
    zones: &mut Symbolic<'_>,
    sought: Sought<'_>,
    watch: &mut LimitWatch,
) -> Result<Option<(Trace, Option<best_first::Cost>)>, String> {
    let Sought {
        target,
        predicate,
        mut atoms,
    } = sought;
    let none = Counters::default();
    let way = match problem.options.trace {
        TraceWanted::Any => return Ok(None),
        TraceWanted::Shortest => {
            let mut search =
                best_first::BestFirst::new(zones, &*target, best_first::Measure::Moves, none);
            found_best(watch, |watch| search.run(watch))?
        }
        TraceWanted::Fastest if problem.under.is_some() => {
            return Err("there is none for fastest traces under a strategy".to_owned());
        }
        TraceWanted::Fastest => {
            let (timed, clock) = with_time(problem.network);
            let problem = Problem {
                network: &timed,
                ..problem
            };
            atoms.push(time_atom(problem.network, clock));
            let mut zones = symbolic(problem, &[predicate], &atoms, Abstraction::LowerUpper);
            let measure = best_first::Measure::Time(clock);
            let mut search = best_first::BestFirst::new(&mut zones, &*target, measure, none);
            found_best(watch, |watch| search.run(watch))?
        }
    };
    let deadline = (problem.options.trace == TraceWanted::Fastest).then_some(way.cost);
    Ok(Some((way.trace(zones, target), deadline)))
}

/// A comparison that keeps the lower bounds of the clock apart, up to the longest time for which
/// there are bounds.
fn time_atom(network: &Network, clock: usize) -> ClockAtom {
    let longest = Bound::reach(greatest_constant(network));
    let clock = ClockRange::one(ClockId(clock as u32));
    ClockAtom::weak(clock, ClockRange::REFERENCE, longest, longest)
}
