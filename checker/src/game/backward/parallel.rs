//! Several threads compute what several nodes win.
//!
//! All tasks start from the same winning valuations, and the results are recorded in the order of
//! the tasks when all are done. So the result depends neither on the number of threads nor on their
//! speed.

use std::panic;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::cancellation::{self, Cut, Look};
use crate::search::limits::{StopReason, Watch};
use crate::zones::federation::block_bytes;
use crate::zones::wide;

use super::predecessors::Situation;
use super::winning_sets::Gained;
use crate::game::backward::winning_sets::Win;
use crate::game::exploration::held_moves::Defence;
use crate::game::solver::Solver;

/// The time between two checks of the limits while others work.
const PULSE: Duration = Duration::from_millis(20);

/// The least number of bounds in all zones from which tasks start, for threads to be worth
/// starting.
const WORTH_STARTING: usize = 1 << 15;

/// The computed bytes between two questions whether this much memory is allowed.
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
    /// The bytes that it takes, without the value itself.
    fn heap_bytes(&self) -> u64 {
        let Situation { stops, movers, .. } = &self.situation;
        let zones = stops.iter().map(|(_, stop)| stop.heap_bytes());
        let parts = movers
            .iter()
            .map(|(parts, _)| block_bytes(size_of_val(&**parts)));
        (zones.sum::<usize>() + parts.sum::<usize>()) as u64
    }
}

/// The result of a task.
struct Done {
    /// Which task it is.
    index: usize,
    gained: Gained,
    defence: Defence,
}

/// What threads tell each other while they work.
struct Progress {
    /// The next task that no thread has begun.
    next: AtomicUsize,
    threads: Vec<ThreadProgress>,
    /// The bytes of the tasks, and of the results that are not recorded yet.
    done_bytes: AtomicU64,
    /// The units of work that were done: see [`cancellation::work`].
    work: AtomicU64,
    /// After this many units the game is given up: see [`super::budget`].
    most_work: u64,
    /// The cancellation that the threads check too.
    beside: Option<Look>,
}

/// What one thread tells the others.
#[derive(Default)]
struct ThreadProgress {
    /// The bytes for which it asked last in its task.
    asked_bytes: AtomicU64,
    /// Its work at its last report.
    work_told: AtomicU64,
}

impl Progress {
    /// What a thread checks during its tasks.
    fn look_of(self: &Arc<Self>, thread: usize) -> Look {
        let progress = Arc::clone(self);
        Arc::new(move |bytes| {
            progress.report_work(thread);
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

    /// The bytes that are not in any account yet.
    fn bytes(&self) -> u64 {
        let asked = self.threads.iter().map(|one| &one.asked_bytes);
        let asked = asked
            .map(|bytes| bytes.load(Ordering::Relaxed))
            .sum::<u64>();
        self.done_bytes.load(Ordering::Relaxed) + asked
    }

    /// Begins a task: earlier work and earlier requests for memory do not count for it.
    fn begin(&self, thread: usize) {
        let ThreadProgress {
            asked_bytes,
            work_told,
        } = &self.threads[thread];
        asked_bytes.store(0, Ordering::Relaxed);
        work_told.store(cancellation::done(), Ordering::Relaxed);
    }

    /// Counts bytes that are kept until all tasks are done; asks for memory when they have become
    /// many more.
    fn keep(&self, bytes: u64) {
        let before = self.done_bytes.load(Ordering::Relaxed);
        if (before + bytes) / BETWEEN_QUESTIONS > before / BETWEEN_QUESTIONS {
            cancellation::ask_for(bytes as usize);
        }
        self.done_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Adds the work of a thread since its last report.
    fn report_work(&self, thread: usize) {
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
        // The limits are checked here and afterwards for any number of threads, so that no thread
        // stops by chance.
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

    /// Whether the tasks are so large that the time to start threads does not matter.
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

    /// Does the tasks with one thread for each entry of `progress`; the caller's is the first.
    fn share(&self, tasks: &[Task], progress: &Arc<Progress>) -> Vec<Done> {
        thread::scope(|scope| {
            let (over, is_over) = mpsc::channel::<()>();
            let helpers: Vec<_> = (1..progress.threads.len())
                .filter_map(|index| {
                    let over = over.clone();
                    let work = move || {
                        // The thread reports its end also when its work is cut off.
                        let _over = over;
                        (self.work(tasks, progress, index), wide::has_forgotten())
                    };
                    // A thread that cannot be started is not needed: the others do its tasks.
                    let thread = thread::Builder::new().stack_size(STACK_BYTES);
                    thread.spawn_scoped(scope, work).ok()
                })
                .collect();
            drop(over);
            let mut done = self.work(tasks, progress, 0);
            // Only this thread can ask the user, so it checks the limits while it waits.
            while is_over.recv_timeout(PULSE) == Err(RecvTimeoutError::Timeout) {
                cancellation::is_due();
            }
            for helper in helpers {
                match helper.join() {
                    Ok((more, has_forgotten)) => {
                        done.extend(more);
                        if has_forgotten {
                            wide::note();
                        }
                    }
                    Err(panic) => panic::resume_unwind(panic),
                }
            }
            done
        })
    }

    /// Does tasks that no thread has begun, as one of the threads.
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
                progress.report_work(thread);
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
