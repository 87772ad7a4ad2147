//! Results of runs in the order of their numbers, made by one thread or several.
//!
//! The runs are handed out in chunks to whoever has nothing to do; the calling thread makes runs
//! like the others, and consumes results between its chunks. Which results are consumed does not
//! depend on the number of threads: run k is the same wherever it is made, and a failure counts
//! only if its run is reached.
//!
//! Invariants:
//! * `open` holds the chunks that were handed out and are not consumed, in the order of their runs.
//!   They are at most [`AHEAD`] a thread, so what is kept does not grow with the number of runs.
//! * When the calling thread leaves, by whatever way, the others are told, and end behind the run
//!   that they are making.

use std::any::Any;
use std::collections::VecDeque;
use std::ops::Range;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::run::Runner;
use super::run_watch::{RunWatch, Shows};
use crate::cancellation::{self, Cut};

/// How long a chunk of runs should take.
const CHUNK_TIME: Duration = Duration::from_millis(2);

/// The most runs of a chunk, whose results are kept.
const MOST_RUNS: u64 = 1024;

/// How many chunks a thread may be ahead of what is consumed.
const AHEAD: usize = 4;

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
    let chunks = Chunks::new(runners.len());
    let (own, others) = runners.split_first_mut().expect("there is a thread");
    let look = cancellation::current();
    thread::scope(|scope| {
        let chunks = &chunks;
        let _over = Over(chunks);
        for runner in others {
            let (look, run) = (look.clone(), &run);
            scope.spawn(move || {
                cancellation::looking_at(look, || {
                    while let Some(chunk) = chunks.take_or_wait() {
                        chunks.make(chunk, |one| run(runner, one));
                    }
                });
            });
        }
        let mut consumed = 0;
        loop {
            while let Some(made) = chunks.next_made() {
                let results = match made {
                    Ok(results) => results,
                    // What was consumed before stands; without it there is no result.
                    Err(cause) if cause.is::<Cut>() && consumed > 0 => return Ok(false),
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
            match chunks.take() {
                Some(chunk) => chunks.make(chunk, |one| run(own, one)),
                None => {
                    // Only this thread sees signals. When it is time to end, the others see it too.
                    if !chunks.wait_for_next() {
                        cancellation::is_due();
                    }
                }
            }
        }
    })
}

/// The results of a chunk, up to the first failure; or what its thread unwound with.
type Made<T> = Result<Vec<Result<T, Failure>>, Box<dyn Any + Send>>;

/// Runs that one thread makes: the number of the chunk, and those of its runs.
type Chunk = (u64, Range<u64>);

/// The runs of all threads.
struct Chunks<T> {
    shares: Mutex<Shares<T>>,
    /// A chunk was made or consumed, or all is over.
    has_changed: Condvar,
    most_open: usize,
    is_over: AtomicBool,
}

struct Shares<T> {
    next_run: u64,
    /// How many runs the next chunk has.
    share: u64,
    /// The number of the first open chunk.
    first_open: u64,
    /// What was made of the open chunks so far.
    open: VecDeque<Option<Made<T>>>,
}

impl<T> Chunks<T> {
    fn new(threads: usize) -> Chunks<T> {
        Chunks {
            shares: Mutex::new(Shares {
                next_run: 0,
                share: 1,
                first_open: 0,
                open: VecDeque::new(),
            }),
            has_changed: Condvar::new(),
            most_open: AHEAD * threads,
            is_over: AtomicBool::new(false),
        }
    }

    /// The shares are whole between any two statements, so a thread that unwound does no harm.
    fn shares(&self) -> MutexGuard<'_, Shares<T>> {
        self.shares.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_over(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }

    /// Hands out a chunk, if not too many are open.
    fn take(&self) -> Option<Chunk> {
        self.hand_out(&mut self.shares())
    }

    fn hand_out(&self, shares: &mut Shares<T>) -> Option<Chunk> {
        if shares.open.len() >= self.most_open {
            return None;
        }
        let number = shares.first_open + shares.open.len() as u64;
        shares.open.push_back(None);
        let first = shares.next_run;
        shares.next_run += shares.share;
        Some((number, first..shares.next_run))
    }

    /// Hands out a chunk as soon as there is one; none when all is over.
    fn take_or_wait(&self) -> Option<Chunk> {
        let mut shares = self.shares();
        loop {
            if self.is_over() {
                return None;
            }
            let chunk = self.hand_out(&mut shares);
            if chunk.is_some() {
                return chunk;
            }
            let waited = self.has_changed.wait(shares);
            shares = waited.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Makes the runs of a chunk, as long as they are wanted.
    fn make(&self, (number, runs): Chunk, mut run: impl FnMut(u64) -> Result<T, Failure>) {
        let start = Instant::now();
        let share = runs.end - runs.start;
        let made = panic::catch_unwind(AssertUnwindSafe(|| {
            let mut results = Vec::with_capacity(share as usize);
            for one in runs {
                let result = run(one);
                let failed = result.is_err();
                results.push(result);
                if failed || self.is_over() {
                    break;
                }
            }
            results
        }));
        let is_short = start.elapsed() < CHUNK_TIME;
        let mut shares = self.shares();
        if is_short && share == shares.share {
            shares.share = (share * 2).min(MOST_RUNS);
        }
        let place = (number - shares.first_open) as usize;
        shares.open[place] = Some(made);
        drop(shares);
        self.has_changed.notify_all();
    }

    /// What was made of the first open chunk, if it is ready.
    fn next_made(&self) -> Option<Made<T>> {
        let mut shares = self.shares();
        let made = shares.open.front_mut()?.take()?;
        shares.open.pop_front();
        shares.first_open += 1;
        drop(shares);
        self.has_changed.notify_all();
        Some(made)
    }

    /// Waits until the first open chunk is ready, but not long; returns whether it is.
    fn wait_for_next(&self) -> bool {
        let is_made = |shares: &Shares<T>| matches!(shares.open.front(), Some(Some(_)));
        let shares = self.shares();
        let waited = self
            .has_changed
            .wait_timeout_while(shares, LOOK_EVERY, |shares| !is_made(shares));
        let (shares, _) = waited.unwrap_or_else(PoisonError::into_inner);
        is_made(&shares)
    }
}

/// Tells the other threads that all is over, when it is dropped.
struct Over<'c, T>(&'c Chunks<T>);

impl<T> Drop for Over<'_, T> {
    fn drop(&mut self) {
        // Under the lock, so that nobody begins to wait meanwhile.
        let shares = self.0.shares();
        self.0.is_over.store(true, Ordering::Relaxed);
        drop(shares);
        self.0.has_changed.notify_all();
    }
}
