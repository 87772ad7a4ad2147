//! Results of runs in the order of their numbers, made by one thread or several.
//!
//! Which results are consumed does not depend on the number of threads: run k is the same wherever
//! it is made, and a failure counts only if its run is reached.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::run::Runner;
use super::run_watch::{RunWatch, Shows};
use crate::cancellation::{self, Cut};

/// How long a block of runs should take.
const BLOCK_TIME: Duration = Duration::from_millis(10);

/// The most runs of one thread in a block, whose results are kept.
const MOST_RUNS: u64 = 4096;

/// How often limits and signals are looked at while other threads make runs that take long.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Makes runs 0, 1, … and consumes their results in this order until `consume` returns true or
/// `watch`, asked now and then, ends them. Returns whether `consume` ended it.
pub(super) fn in_order<T: Send + Shows>(
    behaviour: Behaviour<'_>,
    threads: usize,
    run: impl Fn(&mut Runner<'_>, u64) -> Result<T, Failure> + Sync,
    mut consume: impl FnMut(T) -> bool,
    watch: &mut dyn RunWatch,
) -> Result<bool, Failure> {
    let mut runners = Runner::several(behaviour, threads);
    let (mut first, mut share, mut consumed) = (0_u64, 1_u64, 0_u64);
    loop {
        let start = Instant::now();
        let block = |runner: &mut Runner<'_>, number: usize| -> Vec<Result<T, Failure>> {
            let from = first + number as u64 * share;
            let mut results = Vec::with_capacity(share as usize);
            for one in from..from + share {
                let result = run(runner, one);
                let failed = result.is_err();
                results.push(result);
                if failed {
                    break;
                }
            }
            results
        };
        let results: Vec<Result<Vec<Result<T, Failure>>, Cut>> = if let [runner] = &mut runners[..]
        {
            vec![cancellation::unless_cut(|| block(runner, 0))]
        } else {
            blocks_of_all(&mut runners, &block)
        };
        for results in results {
            let Ok(results) = results else {
                // What was consumed before stands; without it there is no result.
                if consumed == 0 {
                    cancellation::cut();
                }
                return Ok(false);
            };
            for result in results {
                consumed += 1;
                let result = result?;
                if let Some(shown) = result.shows() {
                    watch.see(shown);
                }
                if consume(result) {
                    return Ok(true);
                }
            }
        }
        first += share * runners.len() as u64;
        if watch.ends(first) {
            return Ok(false);
        }
        if start.elapsed() < BLOCK_TIME {
            share = (share * 2).min(MOST_RUNS);
        }
    }
}

/// The block of each runner: the first one's is made by this thread, the others' by a thread each.
///
/// Only this thread sees signals, so it looks for them while it waits for the others.
fn blocks_of_all<T: Send>(
    runners: &mut [Runner<'_>],
    block: &(impl Fn(&mut Runner<'_>, usize) -> T + Sync),
) -> Vec<Result<T, Cut>> {
    let Some((own, others)) = runners.split_first_mut() else {
        return Vec::new();
    };
    let look = cancellation::current();
    let (running, all_have_ended) = mpsc::channel::<()>();
    thread::scope(|scope| {
        let started: Vec<_> = (1..)
            .zip(others)
            .map(|(number, runner)| {
                let (look, running) = (look.clone(), running.clone());
                scope.spawn(move || {
                    // The other end waits until this is dropped.
                    let _running = running;
                    cancellation::looking_at(look, || {
                        cancellation::unless_cut(|| block(runner, number))
                    })
                })
            })
            .collect();
        drop(running);
        let mut results = vec![cancellation::unless_cut(|| block(own, 0))];
        while all_have_ended.recv_timeout(LOOK_EVERY) == Err(RecvTimeoutError::Timeout) {
            // When it is time to end, the other threads see it too.
            cancellation::is_due();
        }
        results.extend(started.into_iter().map(|one| match one.join() {
            Ok(results) => results,
            Err(panic) => std::panic::resume_unwind(panic),
        }));
        results
    })
}
