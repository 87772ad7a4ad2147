//! Computing what several nodes win, by several threads.
//!
//! All tasks start from the same winning valuations, and what comes out is recorded in the order of
//! the tasks when all are done. So the result does not depend on how many threads there are, nor on
//! how fast they are.

use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::cancellation::{self, Cut, Look};
use crate::search::limits::{StopReason, Watch};
use crate::zones::federation::block_bytes;

use super::predecessors::Situation;
use super::winning_sets::Gained;
use crate::game::backward::winning_sets::Win;
use crate::game::exploration::held_moves::Defence;
use crate::game::solver::Solver;

/// How often the limits are looked at while others work.
const PULSE: Duration = Duration::from_millis(20);

/// Bounds of all the zones that tasks start from, at least, for threads to be worth starting.
const WORTH_STARTING: usize = 1 << 15;

/// Bytes of what was computed between two questions whether there may be so many.
const BETWEEN_QUESTIONS: u64 = 1 << 20;

/// The stack of a thread: as much as that of the first thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// A node whose winning valuations are to be computed.
#[derive(Debug)]
pub(super) struct Task {
    pub(super) node: u32,
    pub(super) situation: Situation,
}

impl Task {
    /// The bytes that it takes beside the value itself.
    fn heap_bytes(&self) -> u64 {
        let Situation { stops, movers, .. } = &self.situation;
        let zones = stops.iter().map(|(_, stop)| stop.heap_bytes());
        let parts = movers
            .iter()
            .map(|(parts, _)| block_bytes(size_of_val(&**parts)));
        (zones.sum::<usize>() + parts.sum::<usize>()) as u64
    }
}

/// What comes of a task.
struct Done {
    /// Which task it is.
    index: usize,
    gained: Gained,
    defence: Defence,
}

/// What threads tell each other while they work.
struct Progress {
    /// The next task that nobody has begun.
    next: AtomicUsize,
    threads: Vec<ThreadProgress>,
    /// The bytes of the tasks, and of what is computed and not recorded yet.
    done_bytes: AtomicU64,
    /// The units of work that were done: see [`cancellation::work`].
    work: AtomicU64,
    /// After this many units the game is given up: see [`super::budget`].
    most_work: u64,
    /// What is looked at beside.
    beside: Option<Look>,
}

/// What one thread tells the others.
#[derive(Default)]
struct ThreadProgress {
    /// The bytes that it asked for last in its task.
    asked_bytes: AtomicU64,
    /// How much work it had done when it told of it last.
    work_told: AtomicU64,
}

impl Progress {
    /// What a thread looks at during its tasks.
    fn look_of(self: &Arc<Self>, thread: usize) -> Look {
        let progress = Arc::clone(self);
        Arc::new(move |bytes| {
            progress.tell_work(thread);
            let all = if bytes > 0 {
                let asked = &progress.threads[thread].asked_bytes;
                asked.store(bytes, Ordering::Relaxed);
                progress.bytes()
            } else {
                0
            };
            let is_due = |look: &Look| look(all);
            progress.is_beyond() || progress.beside.as_ref().is_some_and(is_due)
        })
    }

    /// Whether more work was done than the budget allows.
    fn is_beyond(&self) -> bool {
        self.work.load(Ordering::Relaxed) > self.most_work
    }

    /// The bytes that no account knows yet.
    fn bytes(&self) -> u64 {
        let asked = self.threads.iter().map(|one| &one.asked_bytes);
        let asked = asked
            .map(|bytes| bytes.load(Ordering::Relaxed))
            .sum::<u64>();
        self.done_bytes.load(Ordering::Relaxed) + asked
    }

    /// Begins a task: what was done and asked for before is none of it.
    fn begin(&self, thread: usize) {
        let ThreadProgress {
            asked_bytes,
            work_told,
        } = &self.threads[thread];
        asked_bytes.store(0, Ordering::Relaxed);
        work_told.store(cancellation::done(), Ordering::Relaxed);
    }

    /// Counts bytes that are kept until all tasks are done; asks where they have become many more.
    fn keep(&self, bytes: u64) {
        let before = self.done_bytes.load(Ordering::Relaxed);
        if (before + bytes) / BETWEEN_QUESTIONS > before / BETWEEN_QUESTIONS {
            cancellation::ask_for(bytes as usize);
        }
        self.done_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds what a thread has done since it told last.
    fn tell_work(&self, thread: usize) {
        let done = cancellation::done();
        let told = self.threads[thread].work_told.swap(done, Ordering::Relaxed);
        self.work
            .fetch_add(done.wrapping_sub(told), Ordering::Relaxed);
    }
}

impl Solver<'_, '_, '_> {
    /// Computes what the nodes of some tasks win, and records it, unless there is a reason to stop
    /// before.
    pub(super) fn compute(
        &mut self,
        tasks: Vec<Task>,
        watch: &mut dyn Watch,
    ) -> Option<StopReason> {
        // Whatever is seen before or afterwards, however many threads there are, no thread sees by
        // chance.
        let reason = self.look(watch);
        if reason.is_some() || tasks.is_empty() {
            return reason;
        }
        let threads = if self.is_worth_sharing(&tasks) {
            self.threads.min(tasks.len())
        } else {
            1
        };
        let progress = Arc::new(Progress {
            next: AtomicUsize::new(0),
            threads: (0..threads).map(|_| ThreadProgress::default()).collect(),
            done_bytes: AtomicU64::new(tasks.iter().map(Task::heap_bytes).sum()),
            work: AtomicU64::new(self.stops.work),
            most_work: self.most_work(),
            beside: cancellation::current(),
        });
        let done = cancellation::unless_cut(|| self.share(&tasks, &progress));
        self.stops.work = progress.work.load(Ordering::Relaxed);
        if progress.is_beyond() {
            self.stops.has_given_up = true;
            return Some(StopReason::States);
        }
        let mut done = done.unwrap_or_else(|Cut| cancellation::cut());
        done.sort_unstable_by_key(|one| one.index);
        for (task, one) in tasks.into_iter().zip(done) {
            self.defend(task.node, &one.defence);
            self.gain_computed(task.node, one.gained);
        }
        None
    }

    /// Whether the tasks are so large that starting threads does not matter.
    fn is_worth_sharing(&self, tasks: &[Task]) -> bool {
        if self.threads == 1 || tasks.len() < 2 {
            return false;
        }
        let edges = tasks.iter().flat_map(|task| self.graph.edges_of(task.node));
        let zones = edges.map(|edge| {
            let target = self.graph.edges[edge].target;
            match &self.won.win[target as usize] {
                Win::Part(part) => part.zone_count() + self.won.rest[&target].zone_count(),
                Win::Nothing | Win::Everything => 1,
            }
        });
        zones.sum::<usize>() * self.graph.dimension().pow(2) >= WORTH_STARTING
    }

    /// Does the tasks with as many threads as tell of their progress; the caller's is the first.
    fn share(&self, tasks: &[Task], progress: &Arc<Progress>) -> Vec<Done> {
        thread::scope(|scope| {
            let (over, is_over) = mpsc::channel::<()>();
            let helpers: Vec<_> = (1..progress.threads.len())
                .filter_map(|index| {
                    let over = over.clone();
                    let work = move || {
                        // It is told also when the work is cut off.
                        let _over = over;
                        self.work(tasks, progress, index)
                    };
                    // Who cannot be started is not missed: the others do its tasks.
                    let thread = thread::Builder::new().stack_size(STACK_BYTES);
                    thread.spawn_scoped(scope, work).ok()
                })
                .collect();
            drop(over);
            let mut done = self.work(tasks, progress, 0);
            // The user is asked by this thread only, so that it looks while it waits.
            while is_over.recv_timeout(PULSE) == Err(RecvTimeoutError::Timeout) {
                cancellation::is_due();
            }
            for helper in helpers {
                match helper.join() {
                    Ok(more) => done.extend(more),
                    Err(panic) => panic::resume_unwind(panic),
                }
            }
            done
        })
    }

    /// Does tasks that nobody has begun, as one of the threads.
    fn work(&self, tasks: &[Task], progress: &Arc<Progress>, thread: usize) -> Vec<Done> {
        let mut done = Vec::new();
        let look = progress.look_of(thread);
        cancellation::looking_at(Some(look), || {
            loop {
                let index = progress.next.fetch_add(1, Ordering::Relaxed);
                let Some(task) = tasks.get(index) else {
                    break;
                };
                progress.begin(thread);
                let (won, defence) = self.winnable_against_defence(task.node, &task.situation);
                let gained = self.gained(task.node, won);
                progress.tell_work(thread);
                progress.keep(gained.heap_bytes());
                done.push(Done {
                    index,
                    gained,
                    defence,
                });
            }
        });
        done
    }
}
