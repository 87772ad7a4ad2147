//! Reachability by several threads.
//!
//! Stored states are divided into *shards*, one for each thread ([`super::shard`]). Each shard has
//! a *worker*, which explores its states level by level, breadth first. The search proceeds in
//! rounds: in a round every worker takes in the states that the others have sent, explores some of
//! its own states, and collects the states that it sends. Workers share nothing, and a round
//! depends only on the one before it.
//!
//! Invariants:
//! * With the same number of threads, a query always has the same verdict, counters and trace. Only
//!   a stop by time or by the user may come at any point.
//! * A level begins when all states of the level before are explored, so traces are shortest in
//!   stored states, as with one thread.
//! * A search ends after the first round in which something was found. A failure in this round has
//!   priority over a state that was found; among two of a kind, that of the first shard counts.
//! * The result does not depend on whether the workers of a round run at the same time. While few
//!   states wait, one thread runs all workers.
//! * A worker that panics ends the search with its panic.
//!
//! Cost: between rounds threads wait for the slowest one. Rounds are long enough that this costs
//! little, and short enough that mail takes little memory.

use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::Duration;

use crate::cancellation;
use crate::network::{Failure, Symbolic};
use crate::zones::Bound;

use super::expand::{self, Explorer, Scene, Visit};
use super::goal::{Goal, Look, SharedGoal};
use super::report::Report;
use super::retrace;
use super::shard::{Mail, Shard};
use super::tree::{self, Origin, Tree};
use crate::search::limits::{Counters, StopReason, Unlimited, Watch, moves_between_checks};
use crate::search::outcome::{Outcome, Trace};

/// Moves of a worker between two checks of the time.
const PULSE_MOVES: u64 = 1 << 10;
/// The time between two checks of the limits while others work.
const PULSE: Duration = Duration::from_millis(20);

/// The moves of a worker in a round: at first this many, and
const FEWEST_MOVES: u64 = 1 << 10;
/// at most this many.
const MOST_MOVES: u64 = 1 << 15;
/// The greatest number of bounds in the zones of the states that a worker reaches in a round.
const MOST_BOUNDS: u64 = 1 << 22;
/// A worker that has collected this many bytes for others ends its round, so that these bytes are
/// still in a cache when the others read them.
const MOST_MAIL_BYTES: usize = 1 << 18;

/// From this number of states in a round for each worker, threads are worth waking.
const WORTH_WAKING: usize = 48;

/// The stack of a thread: as much as that of the first thread of a program.
const STACK_BYTES: usize = 8 << 20;

/// Searches for a state that `goal` finds, breadth first, with this many threads; the caller's
/// thread is one of them.
///
/// # Panics
/// If there are no threads or more than [`tree::MOST_SHARDS`], or if a worker panics.
pub(super) fn search<G: SharedGoal>(
    symbolic: &mut Symbolic<'_>,
    goal: &mut G,
    threads: usize,
    watch: &mut dyn Watch,
) -> Report {
    assert!(
        (1..=tree::MOST_SHARDS).contains(&threads),
        "the number of threads lies in the range"
    );
    let dimension = symbolic.dimension();
    let mut others: Vec<_> = (1..threads)
        .map(|_| (symbolic.another(), goal.fork()))
        .collect();
    let own = std::iter::once((&mut *symbolic, &mut *goal));
    let pairs = own.chain(others.iter_mut().map(|(symbolic, goal)| (symbolic, goal)));
    let workers = pairs.enumerate().map(|(index, (symbolic, goal))| {
        let worker = Worker::new(symbolic, goal, index, threads);
        Some(Box::new(worker))
    });
    let mut search = ParallelSearch {
        workers: workers.collect(),
        dimension,
        watch,
    };
    let report = search.run();
    drop(search);
    for (other, seen) in others {
        symbolic.join(&other);
        goal.join(seen);
    }
    report
}

/// Why a worker's round ended early.
#[derive(Clone, Copy, Debug)]
enum Ending {
    Failed(Failure),
    Found,
    /// It was told to.
    Cut,
}

/// The work of a worker in a round.
#[derive(Clone, Copy, Debug)]
struct Task {
    /// Whether a level begins.
    advances: bool,
    most_moves: u64,
}

/// Explores the states of one shard.
struct Worker<'s, 'a, G> {
    symbolic: &'s mut Symbolic<'a>,
    goal: &'s mut G,
    explorer: Explorer,
    shard: Shard,
    /// For each shard: the states that came from it.
    incoming: Vec<Mail>,
    /// Whether a state is begun and not ended.
    is_busy: bool,
    ending: Option<Ending>,
}

impl<'s, 'a, G: Goal> Worker<'s, 'a, G> {
    fn new(
        symbolic: &'s mut Symbolic<'a>,
        goal: &'s mut G,
        index: usize,
        count: usize,
    ) -> Worker<'s, 'a, G> {
        let tree = Tree::new(symbolic);
        let may_wait = symbolic.order().is_none();
        Worker {
            explorer: Explorer::new(symbolic, goal),
            shard: Shard::new(tree, may_wait, index, count),
            incoming: (0..count).map(|_| Mail::default()).collect(),
            symbolic,
            goal,
            is_busy: false,
            ending: None,
        }
    }

    /// Enters the initial state.
    fn start(&mut self) {
        let mut scene = Scene {
            symbolic: self.symbolic,
            goal: self.goal,
            watch: &mut Unlimited,
            counters: Counters::default(),
            sink: &mut self.shard,
        };
        self.ending = match expand::start(&mut scene) {
            Ok(Look::Continue) => None,
            Ok(Look::Found) => Some(Ending::Found),
            Ok(Look::Stopped(_)) => Some(Ending::Cut),
            Err(failure) => Some(Ending::Failed(failure)),
        };
    }

    /// Works for one round. `is_cut` is asked from time to time whether to end it.
    fn work(&mut self, task: Task, is_cut: &mut dyn FnMut() -> bool) {
        self.shard.begin_round();
        for (sender, mail) in self.incoming.iter_mut().enumerate() {
            self.shard.deliver(mail, sender);
        }
        if task.advances {
            self.shard.advance();
        }
        self.ending = self
            .explore(task.most_moves, is_cut)
            .unwrap_or_else(|failure| Some(Ending::Failed(failure)));
        self.shard.end_round();
    }

    fn explore(
        &mut self,
        mut moves: u64,
        is_cut: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Ending>, Failure> {
        let pulse_moves = moves_between_checks(PULSE_MOVES, self.symbolic.dimension());
        let mut until_pulse = pulse_moves;
        while moves > 0 && self.shard.sent_bytes < MOST_MAIL_BYTES {
            if until_pulse == 0 {
                if is_cut() {
                    return Ok(Some(Ending::Cut));
                }
                until_pulse = pulse_moves;
            }
            if !self.is_busy && !self.begin()? {
                break;
            }
            let mut left = until_pulse.min(moves);
            let before = left;
            let mut scene = Scene {
                symbolic: self.symbolic,
                goal: self.goal,
                watch: &mut Unlimited,
                counters: Counters::default(),
                sink: &mut self.shard,
            };
            match self.explorer.explore(&mut scene, &mut left)? {
                Visit::Done => self.is_busy = false,
                Visit::Paused => {}
                Visit::Found => return Ok(Some(Ending::Found)),
                Visit::Stopped(_) => return Ok(Some(Ending::Cut)),
            }
            moves -= before - left;
            until_pulse -= before - left;
        }
        Ok(None)
    }

    /// Begins with the next state, if there is one.
    fn begin(&mut self) -> Result<bool, Failure> {
        let Some(stored) = self.shard.take() else {
            return Ok(false);
        };
        self.is_busy = true;
        let passed = &mut self.shard.tree.passed;
        let load = |words: &mut [i32], zone: &mut [Bound]| passed.visit(stored, words, zone);
        self.explorer.begin(self.symbolic, load)?;
        Ok(true)
    }

    fn counters(&self) -> Counters {
        let mail = self.incoming.iter();
        let bytes = self.shard.bytes()
            + self.explorer.bytes()
            + self.symbolic.bytes()
            + mail.map(Mail::bytes).sum::<usize>();
        let (now, next) = self.shard.waiting();
        let own = Counters {
            explored: self.explorer.explored(),
            stored: self.shard.tree.passed.len() as u64,
            waiting: (now + next) as u64,
            bytes: bytes as u64,
        };
        own + self.goal.counters()
    }
}

type Place<'s, 'a, G> = Option<Box<Worker<'s, 'a, G>>>;

struct ParallelSearch<'s, 'a, 'w, G> {
    /// Each worker is in its place except while a thread has it.
    workers: Vec<Place<'s, 'a, G>>,
    dimension: usize,
    watch: &'w mut dyn Watch,
}

impl<'s, 'a, G: SharedGoal> ParallelSearch<'s, 'a, '_, G> {
    fn run(&mut self) -> Report {
        self.worker(0).start();
        let is_cut = AtomicBool::new(false);
        let outcome = thread::scope(|scope| {
            let mut crew = Crew {
                scope,
                is_cut: &is_cut,
                threads: Vec::new(),
            };
            self.rounds(&mut crew)
        });
        Report {
            outcome,
            counters: self.counters(),
        }
    }

    fn rounds<'t, 'e>(
        &mut self,
        crew: &mut Crew<'t, 'e, 's, 'a, G>,
    ) -> Result<Outcome<Trace>, (Failure, Trace)>
    where
        's: 'e,
        'a: 'e,
        G: 'e,
    {
        loop {
            if let Some(outcome) = self.outcome() {
                return outcome;
            }
            self.exchange();
            if let Err(reason) = self.make_room() {
                return Ok(Outcome::Stopped(reason));
            }
            let counters = self.counters();
            if let Some(reason) = self.watch.look(&counters) {
                return Ok(Outcome::Stopped(reason));
            }
            let Some((task, waiting)) = self.task(counters.explored) else {
                return Ok(Outcome::Exhausted);
            };
            let mut reason = None;
            let watch = &mut *self.watch;
            let mut pulse = || {
                reason = reason.or_else(|| watch.look(&counters));
                reason.is_some()
            };
            if waiting < WORTH_WAKING * self.workers.len() {
                for worker in self.workers.iter_mut().flatten() {
                    worker.work(task, &mut pulse);
                }
            } else {
                crew.work(&mut self.workers, task, &mut pulse);
            }
            if let Some(reason) = reason {
                return Ok(Outcome::Stopped(reason));
            }
        }
    }

    fn worker(&mut self, index: usize) -> &mut Worker<'s, 'a, G> {
        self.workers[index]
            .as_mut()
            .expect("between rounds all workers are in their places")
    }

    fn counters(&self) -> Counters {
        let workers = self.workers.iter().flatten();
        workers.fold(Counters::default(), |sum, one| sum + one.counters())
    }

    /// Puts on disk what is cold if there is no room for it.
    fn make_room(&mut self) -> Result<(), StopReason> {
        let bytes = self.counters().bytes;
        let workers = self.workers.iter_mut().flatten();
        let shards: Vec<_> = workers.map(|worker| &mut worker.shard).collect();
        let growth = shards.iter().map(|shard| shard.tree.growth()).sum();
        let mut cold: Vec<_> = shards.into_iter().flat_map(Shard::cold).collect();
        self.watch.make_room(bytes, growth, &mut cold)
    }

    /// Delivers all mail.
    fn exchange(&mut self) {
        for sender in 0..self.workers.len() {
            for receiver in 0..self.workers.len() {
                let mail = std::mem::take(&mut self.worker(sender).shard.outgoing[receiver]);
                let place = &mut self.worker(receiver).incoming[sender];
                let empty = std::mem::replace(place, mail);
                self.worker(sender).shard.outgoing[receiver] = empty;
            }
        }
    }

    /// The work of the next round, and the approximate number of states that wait for it; `None` if
    /// there is nothing to do.
    fn task(&self, explored: u64) -> Option<(Task, usize)> {
        let (mut now, mut next, mut sent, mut is_level_over) = (0, 0, 0, true);
        for worker in self.workers.iter().flatten() {
            let waiting = worker.shard.waiting();
            now += waiting.0 + usize::from(worker.is_busy);
            next += waiting.1;
            sent += worker.incoming.iter().map(Mail::len).sum::<usize>();
            is_level_over &= !worker.incoming.iter().any(Mail::has_choices);
        }
        if now + next + sent == 0 {
            return None;
        }
        let advances = is_level_over && now == 0;
        // The memory is checked between rounds.
        let zone = self.dimension.pow(2) as u64;
        let most_moves = (MOST_BOUNDS / zone).clamp(1, MOST_MOVES);
        let task = Task {
            advances,
            most_moves: explored.clamp(FEWEST_MOVES.min(most_moves), most_moves),
        };
        Some((task, sent + if advances { next } else { now }))
    }

    /// The result of the search, if it ends with this round.
    fn outcome(&mut self) -> Option<Result<Outcome<Trace>, (Failure, Trace)>> {
        let endings = self.workers.iter().flatten().map(|worker| worker.ending);
        let endings: Vec<Option<Ending>> = endings.collect();
        for (index, ending) in endings.iter().enumerate() {
            if let Some(Ending::Failed(failure)) = *ending {
                return Some(Err((failure, self.trace(index, false))));
            }
        }
        let is_found = |ending: &Option<Ending>| matches!(ending, Some(Ending::Found));
        let index = endings.iter().position(is_found)?;
        Some(Ok(Outcome::Found(self.trace(index, true))))
    }

    /// The path to the current state of a worker.
    fn trace(&mut self, index: usize, is_found: bool) -> Trace {
        let workers = self.workers.iter().flatten();
        let trees: Vec<_> = workers.map(|worker| &worker.shard.tree).collect();
        let (current, last) = match &self.workers[index] {
            Some(worker) => (worker.shard.current, worker.explorer.way()),
            None => (Origin::NOWHERE, &[][..]),
        };
        let steps = tree::way(&trees, current, last);
        let worker = self.worker(index);
        let goal = is_found.then_some(&mut *worker.goal as &mut dyn Goal);
        retrace::retrace(worker.symbolic, &steps, goal)
    }
}

/// The threads other than the caller's. Each is started when it is first needed, and ends with this
/// value.
struct Crew<'t, 'e, 's, 'a, G> {
    scope: &'t Scope<'t, 'e>,
    /// Tells all threads to end their rounds.
    is_cut: &'e AtomicBool,
    /// `None` for a thread that the system does not give.
    threads: Vec<Option<Thread<'t, 's, 'a, G>>>,
}

struct Thread<'t, 's, 'a, G> {
    jobs: Sender<(Box<Worker<'s, 'a, G>>, Task)>,
    done: Receiver<Box<Worker<'s, 'a, G>>>,
    handle: ScopedJoinHandle<'t, ()>,
}

impl<'t, 'e, 's: 'e, 'a: 'e, G: SharedGoal + 'e> Crew<'t, 'e, 's, 'a, G> {
    /// Lets all workers work for a round, each in its thread; the first works in the caller's.
    fn work(
        &mut self,
        workers: &mut [Place<'s, 'a, G>],
        task: Task,
        pulse: &mut dyn FnMut() -> bool,
    ) {
        let is_cut = self.is_cut;
        let mut cut = || {
            let cuts = pulse();
            is_cut.fetch_or(cuts, Ordering::Relaxed);
            cuts
        };
        if self.threads.is_empty() {
            self.threads = (1..workers.len()).map(|index| self.spawn(index)).collect();
        }
        let (first, others) = workers.split_at_mut(1);
        for (thread, place) in self.threads.iter().zip(&mut *others) {
            if let Some(thread) = thread
                && let Some(worker) = place.take()
                && let Err(refused) = thread.jobs.send((worker, task))
            {
                // The thread has ended by a panic. The panic is passed on when its work is
                // collected.
                *place = Some(refused.0.0);
            }
        }
        for worker in first.iter_mut().flatten() {
            worker.work(task, &mut cut);
        }
        for (thread, place) in self.threads.iter_mut().zip(others) {
            match thread {
                None => {
                    if let Some(worker) = place {
                        worker.work(task, &mut cut);
                    }
                }
                Some(one) => match one.collect(&mut cut) {
                    Some(worker) => *place = Some(worker),
                    None => {
                        if let Some(Err(cause)) = thread.take().map(|one| one.handle.join()) {
                            panic::resume_unwind(cause);
                        }
                    }
                },
            }
        }
    }

    fn spawn(&self, index: usize) -> Option<Thread<'t, 's, 'a, G>> {
        let (jobs, tasks) = mpsc::channel::<(Box<Worker<'s, 'a, G>>, Task)>();
        let (results, done) = mpsc::channel();
        let is_cut = self.is_cut;
        let look = cancellation::current();
        let serve = move || {
            while let Ok((mut worker, task)) = tasks.recv() {
                worker.work(task, &mut || is_cut.load(Ordering::Relaxed));
                if results.send(worker).is_err() {
                    return;
                }
            }
        };
        let run = move || cancellation::looking_at(look, serve);
        let builder = thread::Builder::new()
            .name(format!("search-{index}"))
            .stack_size(STACK_BYTES);
        let handle = builder.spawn_scoped(self.scope, run).ok()?;
        Some(Thread { jobs, done, handle })
    }
}

impl<'s, 'a, G> Thread<'_, 's, 'a, G> {
    /// Waits for the worker; `None` if the thread has ended by a panic.
    fn collect(&self, pulse: &mut dyn FnMut() -> bool) -> Option<Box<Worker<'s, 'a, G>>> {
        loop {
            match self.done.recv_timeout(PULSE) {
                Ok(worker) => return Some(worker),
                Err(RecvTimeoutError::Disconnected) => return None,
                Err(RecvTimeoutError::Timeout) => {
                    pulse();
                }
            }
        }
    }
}
