//! Reachability: is there a state that a [`Goal`] finds, for example one in which a predicate
//! holds?
//!
//! A search of the zone graph with inclusion: a symbolic state is not explored if a stored one with
//! the same words contains its zone, and the passed list forgets stored states that a new one
//! contains. [`super::expand`] says which committed states are stored.
//!
//! Each stored state remembers its parent and the moves from it, so that a trace can be found by
//! taking the moves again.
//!
//! Source: Bengtsson and Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, section 3.

use crate::network::{Failure, Symbolic};
use crate::zones::Bound;

use super::expand::{self, Explorer, Scene, Sink, Visit};
use super::goal::{Goal, Look, SharedGoal};
use super::parallel;
use super::report::{Manner, Order, Report};
use super::retrace;
use super::tree::{self, Origin, Tree};
use crate::search::limits::{
    Counters, StopReason, Watch, moves_between_checks, states_between_checks,
};
use crate::search::outcome::{Outcome, Step, Trace};
use crate::search::store::packed_zones::Kept;
use crate::search::store::passed_list::{PassedList, Stored};
use crate::search::store::queue::Queue;

/// The greatest number of states between two checks of the limits.
const LOOK_EVERY: u64 = 256;
/// The greatest number of moves between two checks of the limits.
const LOOK_EVERY_MOVES: u64 = 1 << 12;

/// Searches for a state that `goal` finds.
pub fn search(
    symbolic: &mut Symbolic<'_>,
    goal: &mut dyn Goal,
    order: Order,
    watch: &mut dyn Watch,
) -> Report {
    let mut search = Search::new(symbolic, goal, order, watch);
    let outcome = match search.run() {
        Ok(outcome) => Ok(outcome),
        Err(failure) => Err((failure, search.trace(false))),
    };
    Report {
        outcome,
        counters: search.counters(),
    }
}

/// Like [`search`], with several threads if they are wanted and the order is breadth first: see
/// [`super::parallel`].
pub fn search_shared<G: SharedGoal>(
    symbolic: &mut Symbolic<'_>,
    goal: &mut G,
    manner: Manner,
    watch: &mut dyn Watch,
) -> Report {
    if manner.threads > 1 && manner.order == Order::BreadthFirst {
        return parallel::search(symbolic, goal, manner.threads, watch);
    }
    search(symbolic, goal, manner.order, watch)
}

struct Search<'s, 'a> {
    symbolic: &'s mut Symbolic<'a>,
    goal: &'s mut dyn Goal,
    watch: &'s mut dyn Watch,
    order: Order,
    explorer: Explorer,
    store: Store,
    random: u64,
}

/// All stored states, and those of them that wait.
struct Store {
    tree: Tree,
    waiting: Queue,
    /// The state that is being explored.
    current: Origin,
    /// Whether states may wait to be stored: nobody must know at once whether they are new.
    may_wait: bool,
}

impl Sink for Store {
    fn add_waiting(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool {
        if self.may_wait && self.tree.wait(words, self.current, way, &mut self.waiting) {
            return false;
        }
        let stored = self.tree.add(words, zone, self.current, way);
        self.waiting.extend(stored);
        stored.is_some()
    }

    fn add_choice(&mut self, words: &[i32], zone: Kept<'_>, way: &[Step]) -> bool {
        self.tree.add_waiting(&mut self.waiting);
        self.tree.add(words, zone, self.current, way).is_some()
    }

    fn passed(&mut self) -> &mut PassedList {
        &mut self.tree.passed
    }
}

impl<'s, 'a> Search<'s, 'a> {
    fn new(
        symbolic: &'s mut Symbolic<'a>,
        goal: &'s mut dyn Goal,
        order: Order,
        watch: &'s mut dyn Watch,
    ) -> Search<'s, 'a> {
        let may_wait = order == Order::BreadthFirst && symbolic.order().is_none();
        let tree = Tree::new(symbolic);
        Search {
            explorer: Explorer::new(symbolic, goal),
            store: Store {
                waiting: Queue::new(tree.passed.has_zones()),
                tree,
                current: Origin::NOWHERE,
                may_wait,
            },
            random: if let Order::Random(seed) = order {
                seed | 1
            } else {
                1
            },
            symbolic,
            goal,
            watch,
            order,
        }
    }

    fn counters(&self) -> Counters {
        self.own_counters() + self.goal.counters()
    }

    fn own_counters(&self) -> Counters {
        let Store { tree, waiting, .. } = &self.store;
        let bytes = tree.bytes() + self.explorer.bytes() + self.symbolic.bytes() + waiting.bytes();
        Counters {
            explored: self.explorer.explored(),
            stored: tree.passed.len() as u64,
            waiting: waiting.len() as u64,
            bytes: bytes as u64,
        }
    }

    fn run(&mut self) -> Result<Outcome<Trace>, Failure> {
        let counters = self.own_counters();
        match expand::start(&mut self.scene(counters))? {
            Look::Continue => {}
            Look::Found => return Ok(Outcome::Found(self.trace(true))),
            Look::Stopped(reason) => return Ok(Outcome::Stopped(reason)),
        }
        let dimension = self.symbolic.dimension();
        let look_every = states_between_checks(LOOK_EVERY, dimension);
        let mut next_look = look_every;
        let mut moves = moves_between_checks(LOOK_EVERY_MOVES, dimension);
        while let Some(stored) = self.next_waiting() {
            if self.store.tree.passed.is_covered(stored) {
                continue;
            }
            self.store.current = Origin {
                shard: 0,
                node: stored.node,
            };
            let first = self.store.waiting.len();
            match self.visit(stored, &mut moves)? {
                Visit::Found => return Ok(Outcome::Found(self.trace(true))),
                Visit::Stopped(reason) => return Ok(Outcome::Stopped(reason)),
                Visit::Done | Visit::Paused => {}
            }
            self.shuffle_from(first);
            if self.explorer.explored() >= next_look {
                next_look = self.explorer.explored() + look_every;
                if let Some(reason) = self.look() {
                    return Ok(Outcome::Stopped(reason));
                }
            }
        }
        Ok(Outcome::Exhausted)
    }

    /// Looks at the limits, and makes room in memory.
    fn look(&mut self) -> Option<StopReason> {
        let bytes = self.counters().bytes;
        let Store { tree, waiting, .. } = &mut self.store;
        let growth = tree.growth();
        let mut cold: Vec<_> = tree.cold().chain([waiting.cold()]).collect();
        let stopped = self.watch.make_room(bytes, growth, &mut cold).err();
        let counters = self.counters();
        stopped.or_else(|| self.watch.look(&counters))
    }

    fn next_waiting(&mut self) -> Option<Stored> {
        let Store { tree, waiting, .. } = &mut self.store;
        match self.order {
            Order::BreadthFirst => waiting.pop_front().or_else(|| {
                tree.add_waiting(waiting);
                waiting.pop_front()
            }),
            Order::DepthFirst | Order::Random(_) => self.store.waiting.pop_back(),
        }
    }

    /// Puts the newest waiting nodes into the search order.
    fn shuffle_from(&mut self, first: usize) {
        let Order::Random(_) = self.order else { return };
        let first = first.saturating_sub(1).min(self.store.waiting.len());
        for index in (first + 1..self.store.waiting.len()).rev() {
            let other = first + (self.next_random() % (index - first + 1) as u64) as usize;
            self.store.waiting.swap(index, other);
        }
    }

    /// Xorshift; only the order of the search depends on it.
    fn next_random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random >> 16
    }

    fn scene(&mut self, counters: Counters) -> Scene<'_, 'a, Store> {
        Scene {
            counters,
            symbolic: self.symbolic,
            goal: self.goal,
            watch: self.watch,
            sink: &mut self.store,
        }
    }

    /// Explores a stored state to the end. `moves` is the number of moves until the next check of
    /// the limits.
    fn visit(&mut self, stored: Stored, moves: &mut u64) -> Result<Visit, Failure> {
        let counters = self.own_counters();
        let passed = &mut self.store.tree.passed;
        let load = |words: &mut [i32], zone: &mut [Bound]| passed.visit(stored, words, zone);
        self.explorer.begin(self.symbolic, load)?;
        loop {
            let mut scene = Scene {
                counters,
                symbolic: self.symbolic,
                goal: self.goal,
                watch: self.watch,
                sink: &mut self.store,
            };
            match self.explorer.explore(&mut scene, moves)? {
                Visit::Paused => {
                    *moves = moves_between_checks(LOOK_EVERY_MOVES, self.symbolic.dimension());
                    if let Some(reason) = self.look() {
                        return Ok(Visit::Stopped(reason));
                    }
                }
                end => return Ok(end),
            }
        }
    }

    /// The path to the current state: the parents of the current node, then the moves below it. The
    /// states are computed again; those that fail are left out.
    fn trace(&mut self, is_found: bool) -> Trace {
        let Store { tree, current, .. } = &self.store;
        let steps = tree::way(&[tree], *current, self.explorer.way());
        let goal = is_found.then_some(&mut *self.goal as &mut dyn Goal);
        retrace::retrace(self.symbolic, &steps, goal)
    }
}
