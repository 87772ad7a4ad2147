//! Computing what several nodes win, by several threads.
//!
//! All tasks start from the same winning valuations, and what comes out is recorded in the order of
//! the tasks when all are done. So the result does not hang on how many threads there are, nor on
//! how fast they are.

use std::panic;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::cancellation;
use crate::search::limits::{Counters, StopReason, Watch};
use crate::zones::Patience;
use crate::zones::federation::block_bytes;

use super::predecessors::Situation;
use super::solver::{Solver, Win};
use super::winning_sets::Gained;
use crate::game::exploration::lazy_safety::Defence;

/// How often the limits are looked at while others work.
const PULSE: Duration = Duration::from_millis(20);

/// Bounds of all the zones that tasks start from, at least, for threads to be worth starting.
const WORTH_STARTING: usize = 1 << 15;

/// The stack of a thread: as much as that of the first thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// A node whose winning valuations are to be computed.
#[derive(Debug)]
pub(super) struct Task {
    pub(super) node: u32,
    pub(super) situation: Situation,
    /// The key of the case that it is, if it is one: see [`super::result_cache`].
    pub(super) key: Option<Box<[u32]>>,
}

impl Task {
    /// The bytes that it takes beside the value itself, keys excepted.
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
    is_cut: AtomicBool,
    /// By thread: the zones at hand.
    zones: Vec<AtomicUsize>,
    /// The bytes of the tasks, and of what is computed and not recorded yet.
    done_bytes: AtomicU64,
    /// How many operations on many zones were done.
    operations: AtomicU64,
    /// After so many operations the game is given up: see [`super::budget`].
    most_operations: u64,
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
        let progress = Progress {
            next: AtomicUsize::new(0),
            is_cut: AtomicBool::new(false),
            zones: (0..threads).map(|_| AtomicUsize::new(0)).collect(),
            done_bytes: AtomicU64::new(tasks.iter().map(Task::heap_bytes).sum()),
            operations: AtomicU64::new(self.operations),
            most_operations: self.most_operations(),
        };
        let (mut done, reason) = if threads == 1 {
            self.work_and_look(&tasks, &progress, watch)
        } else {
            self.share(&tasks, &progress, watch)
        };
        if reason.is_some() {
            return reason;
        }
        self.operations = progress.operations.load(Ordering::Relaxed);
        if self.operations > progress.most_operations {
            self.has_given_up = true;
            return Some(StopReason::States);
        }
        done.sort_unstable_by_key(|one| one.index);
        for (task, one) in tasks.into_iter().zip(done) {
            if let Some(key) = task.key {
                self.remember_case(key, &one.gained, &one.defence);
            }
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
            match &self.win[target as usize] {
                Win::Part(part) => part.zone_count() + self.rest[&target].zone_count(),
                Win::Nothing | Win::Everything => 1,
            }
        });
        zones.sum::<usize>() * self.graph.dimension().pow(2) >= WORTH_STARTING
    }

    /// Does the tasks with several threads, of which the caller's is one.
    fn share(
        &self,
        tasks: &[Task],
        progress: &Progress,
        watch: &mut dyn Watch,
    ) -> (Vec<Done>, Option<StopReason>) {
        thread::scope(|scope| {
            let (over, is_over) = mpsc::channel();
            let helpers: Vec<_> = (1..progress.zones.len())
                .filter_map(|index| {
                    let over = over.clone();
                    let look = cancellation::current();
                    let work = move || {
                        let zones = &progress.zones[index];
                        let mut goes_on = |count: usize| {
                            zones.store(count, Ordering::Relaxed);
                            !progress.is_cut.load(Ordering::Relaxed)
                        };
                        let done = self.work(tasks, progress, &mut goes_on);
                        // Nobody listens any more once there is a reason to stop.
                        let _ = over.send(());
                        done
                    };
                    // Who cannot be started is not missed: the others do its tasks.
                    let thread = thread::Builder::new().stack_size(STACK_BYTES);
                    let run = move || cancellation::looking_at(look, work);
                    thread.spawn_scoped(scope, run).ok()
                })
                .collect();
            drop(over);
            let (mut done, mut reason) = self.work_and_look(tasks, progress, watch);
            let mut working = helpers.len();
            while working > 0 {
                match is_over.recv_timeout(PULSE) {
                    Ok(()) => working -= 1,
                    Err(RecvTimeoutError::Disconnected) => break,
                    Err(RecvTimeoutError::Timeout) if reason.is_none() => {
                        reason = watch.look(&self.counters_with(progress, 0));
                        progress.is_cut.store(reason.is_some(), Ordering::Relaxed);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
            }
            for helper in helpers {
                match helper.join() {
                    Ok(more) => done.extend(more),
                    Err(panic) => panic::resume_unwind(panic),
                }
            }
            (done, reason)
        })
    }

    /// Does tasks that nobody has begun, as long as the watch gives no reason to stop.
    fn work_and_look(
        &self,
        tasks: &[Task],
        progress: &Progress,
        watch: &mut dyn Watch,
    ) -> (Vec<Done>, Option<StopReason>) {
        let mut reason = None;
        let mut goes_on = |zones: usize| {
            reason = watch.look(&self.counters_with(progress, zones));
            reason.is_none()
        };
        let done = self.work(tasks, progress, &mut goes_on);
        if reason.is_some() {
            progress.is_cut.store(true, Ordering::Relaxed);
        }
        (done, reason)
    }

    /// Does tasks that nobody has begun, as long as it may go on.
    fn work(
        &self,
        tasks: &[Task],
        progress: &Progress,
        goes_on: &mut dyn FnMut(usize) -> bool,
    ) -> Vec<Done> {
        let mut ask = |zones: usize| {
            let operations = progress.operations.fetch_add(1, Ordering::Relaxed);
            operations < progress.most_operations && goes_on(zones)
        };
        let mut done = Vec::new();
        loop {
            let index = progress.next.fetch_add(1, Ordering::Relaxed);
            let Some(Task {
                node, situation, ..
            }) = tasks.get(index)
            else {
                return done;
            };
            // Each task has a patience of its own, so that what it asks does not hang on who does
            // it.
            let mut patience = Patience::as_long_as(&mut ask);
            let (won, defence) = self.winnable_against_defence(*node, situation, &mut patience);
            let gained = self.gained(*node, won, &mut patience);
            if patience.is_over() || progress.is_cut.load(Ordering::Relaxed) {
                return done;
            }
            let bytes = gained.heap_bytes();
            progress.done_bytes.fetch_add(bytes, Ordering::Relaxed);
            done.push(Done {
                index,
                gained,
                defence,
            });
        }
    }

    /// The counters, with the zones that threads have at hand beside what is stored.
    fn counters_with(&self, progress: &Progress, own_zones: usize) -> Counters {
        let counters = self.counters();
        let others = progress.zones.iter();
        let zones: usize = others.map(|zones| zones.load(Ordering::Relaxed)).sum();
        let bytes = counters.bytes
            + progress.done_bytes.load(Ordering::Relaxed)
            + (own_zones + zones) as u64 * self.zone_bytes();
        Counters { bytes, ..counters }
    }
}
