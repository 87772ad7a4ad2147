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
use super::failure::Failure;
use super::in_order::in_order;
use super::observer::Observer;
use super::precision::{Estimate, Precision};
use super::run::Runner;
use super::run_id::RunId;
use super::run_watch::{Ends, Shows};
use crate::ir::{RunBound, Statistical};

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
    let bound = first.bound();
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

/// What is known of a run for one query.
enum Seen<'q> {
    /// Nothing is looked for.
    Closed,
    Open(Observer<'q>),
    /// Whether it is satisfied.
    Decided(bool),
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
            .map(|(query, open)| {
                if !open.load(Ordering::Relaxed) {
                    return Seen::Closed;
                }
                let asked = query.asked().expect("the query is about single runs");
                Seen::Open(Observer::new(&self.program, asked))
            })
            .collect();
        let ended = self.until_bound(id, bound, &mut |race, delay| {
            let mut is_over = true;
            for one in &mut seen {
                let Seen::Open(observer) = one else { continue };
                match observer.look(race, delay)? {
                    Some((satisfied, _)) => *one = Seen::Decided(satisfied),
                    None => is_over = false,
                }
            }
            Ok(is_over)
        });
        let mut failure = ended.err();
        let results = seen.into_iter().map(|one| match one {
            Seen::Closed => None,
            Seen::Decided(satisfied) => Some(f64::from(satisfied)),
            Seen::Open(_) if failure.is_some() => None,
            Seen::Open(mut observer) => {
                let result = observer.finish(&mut self.race);
                result.map_err(|found| failure = Some(found)).ok()
            }
        });
        let results = results.collect();
        JointRun { results, failure }
    }
}
