//! Results of runs in the order of their numbers, made by one thread or several.
//!
//! The runs are handed out in chunks to whoever has nothing to do; the calling thread makes runs
//! like the others, and consumes results between its chunks. Which results are consumed does not
//! depend on the number of threads: run k is the same wherever it is made, and a failure counts
//! only if its run is reached.
//!
//! Chunks that were handed out and are not consumed are at most [`AHEAD`] a thread, so what is kept
//! does not grow with the number of runs. When the calling thread leaves, by whatever way, nothing
//! is handed out any more, and the others end behind the run that they are making.

use std::any::Any;
use std::collections::VecDeque;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::run::Runner;
use super::run_watch::{Ends, RunWatch, Shows};
use crate::cancellation::{self, Cut};

/// How long a chunk of runs should take.
const CHUNK_TIME: Duration = Duration::from_millis(2);

/// The most runs of a chunk, whose results are kept.
const MOST_RUNS: u64 = 1024;

/// How many chunks a thread may be ahead of what is consumed.
const AHEAD: usize = 4;

/// How often limits and signals are looked at while other threads make runs that take long.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// The results of a chunk, up to the first failure; or what its thread unwound with.
type Made<T> = Result<Vec<Result<T, Failure>>, Box<dyn Any + Send>>;

/// Runs to be made, and who waits for their results.
struct Chunk<T> {
    runs: Range<u64>,
    made: Sender<(Made<T>, Duration)>,
}

impl<T> Chunk<T> {
    /// Makes the runs, as long as they are wanted.
    fn make(self, is_over: &AtomicBool, mut run: impl FnMut(u64) -> Result<T, Failure>) {
        let start = Instant::now();
        let made = panic::catch_unwind(AssertUnwindSafe(|| {
            let mut results = Vec::with_capacity((self.runs.end - self.runs.start) as usize);
            for one in self.runs {
                let result = run(one);
                let failed = result.is_err();
                results.push(result);
                if failed || is_over.load(Ordering::Relaxed) {
                    break;
                }
            }
            results
        }));
        // Nobody waits any more when all is over.
        let _ = self.made.send((made, start.elapsed()));
    }
}

/// Tells the other threads that all is over, when it is dropped.
struct Over<'o>(&'o AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Makes runs 0, 1, … and consumes their results in this order until `consume` returns true or
/// `watch`, asked now and then, ends them. Returns whether `consume` ended it.
pub(super) fn in_order<T: Send + Shows>(
    behaviour: Behaviour<'_>,
    threads: usize,
    run: impl Fn(&mut Runner<'_>, u64) -> Result<T, Failure> + Sync,
    consume: impl FnMut(T) -> bool,
    watch: &mut dyn RunWatch,
) -> Result<bool, Failure> {
    let mut runners = Runner::several(behaviour, threads);
    in_order_by(&mut runners, 0, false, run, consume, watch)
}

/// A result that nobody watches.
struct Kept<T>(T);

impl<T> Shows for Kept<T> {}

/// Makes the runs with these numbers, by these runners, one thread each, and consumes their results
/// in this order. `ends`, asked now and then with the number of results so far, may end them.
/// Returns whether all runs were made. What ends work from inside ends them, too, and goes no
/// further.
pub fn runs_by<T: Send>(
    runners: &mut [Runner<'_>],
    runs: Range<u64>,
    run: impl Fn(&mut Runner<'_>, u64) -> Result<T, Failure> + Sync,
    mut consume: impl FnMut(T),
    ends: impl FnMut(u64) -> bool,
) -> Result<bool, Failure> {
    let mut left = runs.end.saturating_sub(runs.start);
    if left == 0 {
        return Ok(true);
    }
    let take = |Kept(result)| {
        consume(result);
        left -= 1;
        left == 0
    };
    let kept = |runner: &mut Runner<'_>, number| Ok(Kept(run(runner, number)?));
    in_order_by(runners, runs.start, true, kept, take, &mut Ends(ends))
}

fn in_order_by<T: Send + Shows>(
    runners: &mut [Runner<'_>],
    first: u64,
    stands_alone: bool,
    run: impl Fn(&mut Runner<'_>, u64) -> Result<T, Failure> + Sync,
    mut consume: impl FnMut(T) -> bool,
    watch: &mut dyn RunWatch,
) -> Result<bool, Failure> {
    let most_open = AHEAD * runners.len();
    let (own, others) = runners.split_first_mut().expect("there is a thread");
    let look = cancellation::current();
    let (chunks, queue) = mpsc::channel::<Chunk<T>>();
    let (queue, is_over) = (Mutex::new(queue), AtomicBool::new(false));
    thread::scope(|scope| {
        let (chunks, queue, is_over) = (chunks, &queue, &is_over);
        let _over = Over(is_over);
        for runner in others {
            let (look, run) = (look.clone(), &run);
            scope.spawn(move || {
                let make = |chunk: Chunk<T>| chunk.make(is_over, |one| run(runner, one));
                cancellation::looking_at(look, || make_all(queue, make));
            });
        }
        let mut open = VecDeque::new();
        let (mut next, mut share, mut consumed) = (first, 1, 0);
        loop {
            while open.len() < most_open {
                let (made, results) = mpsc::channel();
                let runs = next..next + share;
                next = runs.end;
                open.push_back((share, results));
                let _ = chunks.send(Chunk { runs, made });
            }
            let (size, results) = &open[0];
            let made = received(results, queue, |chunk| {
                chunk.make(is_over, |one| run(own, one));
            });
            let Some((made, time)) = made else { continue };
            if time < CHUNK_TIME && *size == share {
                share = (share * 2).min(MOST_RUNS);
            }
            open.pop_front();
            let results = match made {
                Ok(results) => results,
                // What was consumed before stands; without it there is no result.
                Err(cause) if cause.is::<Cut>() && (consumed > 0 || stands_alone) => {
                    return Ok(false);
                }
                Err(cause) => panic::resume_unwind(cause),
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
            if watch.ends(consumed) {
                return Ok(false);
            }
        }
    })
}

/// Makes all chunks that are handed out, with other threads.
fn make_all<T>(queue: &Mutex<Receiver<Chunk<T>>>, mut make: impl FnMut(Chunk<T>)) {
    let take = || queue.lock().unwrap_or_else(PoisonError::into_inner).recv();
    while let Ok(chunk) = take() {
        make(chunk);
    }
}

/// What was made of the first open chunk, if it is ready; else makes another one, or waits a while.
fn received<T>(
    results: &Receiver<(Made<T>, Duration)>,
    queue: &Mutex<Receiver<Chunk<T>>>,
    make: impl FnOnce(Chunk<T>),
) -> Option<(Made<T>, Duration)> {
    if let Ok(made) = results.try_recv() {
        return Some(made);
    }
    let waiting = queue.try_lock().ok();
    if let Some(chunk) = waiting.and_then(|queue| queue.try_recv().ok()) {
        make(chunk);
        return None;
    }
    let made = results.recv_timeout(LOOK_EVERY).ok();
    if made.is_none() {
        // Only this thread sees signals. When it is time to end, the others see it too.
        cancellation::is_due();
    }
    made
}
