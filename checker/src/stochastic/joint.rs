//! Several queries that are answered from the same runs: each run is made once, and watched for
//! all of them.
//!
//! Watching changes nothing, so each query sees the results that it would see alone. A query that
//! has seen enough is not watched for any more. When that is found depends on the threads, so a run
//! may be longer than it must: a failure counts only for queries that were not decided before.
//!
//! With a risk of alpha / k for each of k queries, all intervals hold together but for a risk of
//! alpha, whatever the queries have to do with each other (C. E. Bonferroni, "Teoria statistica
//! delle classi e calcolo delle probabilità", 1936).

use std::sync::atomic::{AtomicBool, Ordering};

use super::behaviour::Behaviour;
use super::collector::Collector;
use super::extreme::Extreme;
use super::failure::Failure;
use super::in_order::in_order;
use super::mitl::Watch;
use super::precision::{Estimate, Precision};
use super::run::{Runner, watched};
use super::run_id::RunId;
use super::run_watch::{Ends, Shows};
use crate::ir::{Path, RunBound, Statistical};

/// Answers queries for estimates or tests from the same runs, each with what is asked of it alone;
/// all have the same bound and the same seed. `ends` is asked now and then, with the number of runs
/// so far.
///
/// # Errors
/// A run failed: the one with the least number.
pub fn estimate_jointly(
    behaviour: Behaviour<'_>,
    asked: &[(&Statistical, Precision)],
    ends: impl FnMut(u64) -> bool,
) -> Result<Vec<Estimate>, Failure> {
    let Some((first, Precision { seed, threads, .. })) = asked.first() else {
        return Ok(Vec::new());
    };
    let bound = bound_of(first);
    let queries: Vec<&Statistical> = asked.iter().map(|(query, _)| *query).collect();
    let mut collectors: Vec<Collector> = asked
        .iter()
        .map(|(query, precision)| Collector::new(query, precision))
        .collect();
    let open: Vec<AtomicBool> = queries.iter().map(|_| AtomicBool::new(true)).collect();
    let mut failure = None;
    in_order(
        behaviour,
        *threads,
        |runner, run| Ok(runner.all(RunId { seed: *seed, run }, bound, &queries, &open)),
        |run| {
            let mut is_over = true;
            let results = collectors.iter_mut().zip(run.results);
            for ((collector, result), open) in results.zip(&open) {
                // A run that began before the query was closed has a result that does not count.
                if !open.load(Ordering::Relaxed) {
                    continue;
                }
                let Some(result) = result else {
                    failure = run.failure;
                    return true;
                };
                match collector.push(result) {
                    Ok(is_last) => open.store(!is_last, Ordering::Relaxed),
                    Err(found) => {
                        failure = Some(found);
                        return true;
                    }
                }
                is_over &= !open.load(Ordering::Relaxed);
            }
            is_over
        },
        &mut Ends(ends),
    )?;
    if let Some(failure) = failure {
        return Err(failure);
    }
    let estimates = collectors.iter().zip(&open).map(|(collector, open)| {
        let is_complete = !open.load(Ordering::Relaxed);
        collector.estimate(is_complete)
    });
    Ok(estimates.collect())
}

/// How long the runs of a query are.
pub fn bound_of(query: &Statistical) -> &RunBound {
    match query {
        Statistical::Probability(bound, _)
        | Statistical::Hypothesis { bound, .. }
        | Statistical::Expectation { bound, .. } => bound,
        // The runs of the second probability have a bound of their own.
        Statistical::Comparison { left, .. } => &left.0,
        Statistical::Simulation(asked) => &asked.bound,
    }
}

/// What is known of a run for one query.
enum Seen<'q> {
    /// Nothing is looked for.
    Closed,
    /// Not decided yet.
    Open,
    /// A formula that is not decided yet.
    Formula(Watch<'q>),
    /// Whether it is satisfied.
    Decided(bool),
    /// The least or greatest value so far, and whether it may change as time passes.
    Extreme(Extreme, bool),
}

/// What a run says of several queries.
struct JointRun {
    /// By query: the result; none if it is closed, or was not decided before the run failed.
    results: Vec<Option<f64>>,
    failure: Option<Failure>,
}

impl Shows for JointRun {}

impl Runner<'_> {
    /// What a run says of each query that is open when it begins.
    fn all(
        &mut self,
        id: RunId,
        bound: &RunBound,
        queries: &[&Statistical],
        open: &[AtomicBool],
    ) -> JointRun {
        let mut seen: Vec<Seen<'_>> = queries
            .iter()
            .zip(open)
            .map(|(query, open)| match query {
                _ if !open.load(Ordering::Relaxed) => Seen::Closed,
                &&Statistical::Expectation { value, maximum, .. } => {
                    Seen::Extreme(Extreme::new(value, maximum), self.program.is_timed(value))
                }
                Statistical::Probability(_, Path::Formula(formula))
                | Statistical::Hypothesis {
                    path: Path::Formula(formula),
                    ..
                } => Seen::Formula(Watch::new(formula)),
                _ => Seen::Open,
            })
            .collect();
        let ended = self.until_bound(id, bound, &mut |race, delay| {
            let mut is_over = true;
            for (query, seen) in queries.iter().zip(&mut seen) {
                match (&mut *seen, query) {
                    (
                        Seen::Open,
                        Statistical::Probability(_, path) | Statistical::Hypothesis { path, .. },
                    ) => {
                        if let Some((satisfied, _)) = watched(race, path, delay)? {
                            *seen = Seen::Decided(satisfied);
                        } else {
                            is_over = false;
                        }
                    }
                    (Seen::Formula(watch), _) => {
                        if let Some((satisfied, _)) = watch.state(race, delay)? {
                            *seen = Seen::Decided(satisfied);
                        } else {
                            is_over = false;
                        }
                    }
                    (Seen::Extreme(extreme, is_timed), _) => {
                        extreme.look(&mut race.machine)?;
                        if *is_timed && delay > 0.0 && delay.is_finite() {
                            extreme.look_through(race, delay)?;
                        }
                        is_over = false;
                    }
                    _ => {}
                }
            }
            Ok(is_over)
        });
        let mut failure = ended.err();
        let mut results = Vec::with_capacity(seen.len());
        for (query, seen) in queries.iter().zip(&mut seen) {
            if let (Seen::Extreme(extreme, _), None) = (&mut *seen, &failure) {
                failure = extreme.look(&mut self.race.machine).err();
            }
            results.push(match seen {
                Seen::Decided(satisfied) => Some(f64::from(*satisfied)),
                Seen::Closed => None,
                _ if failure.is_some() => None,
                Seen::Open => Some(f64::from(holds_at_the_end(query))),
                Seen::Formula(watch) => Some(f64::from(watch.finish())),
                Seen::Extreme(extreme, _) => Some(extreme.value()),
            });
        }
        JointRun { results, failure }
    }
}

/// Whether a run that was not decided until its bound satisfies a query.
fn holds_at_the_end(query: &Statistical) -> bool {
    matches!(
        query,
        Statistical::Probability(_, Path::Always(_))
            | Statistical::Hypothesis {
                path: Path::Always(_),
                ..
            }
    )
}
