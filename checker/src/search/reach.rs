//! Reachability: is there a state that a [`Goal`] finds, for example one in which a predicate holds?
//!
//! A search over the zone graph with inclusion: a symbolic state is not explored if a stored one with the same words contains
//! its zone, and stored ones that a new one contains are dropped from the waiting list. States with a committed location
//! are explored where they arise, and stored only if they have a choice, so that choices one after the other do not multiply.
//! The others are links of a chain; those that were explored last are remembered ([`RecentStates`]) and not explored again.
//! Chains that are not short ([`LONGEST_CHAIN`], [`MOST_AT_ONCE`]) are stored after all, so that loops of them end.
//!
//! Each stored state remembers its parent and the moves from it, so that a trace is found by taking the moves again.
//!
//! Source: Bengtsson and Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, section 3.

use std::collections::VecDeque;

use crate::ir::Urgency;
use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Zone};

use super::goal::{Goal, Look, Visited};
use super::limits::{Counters, StopReason, Watch};
use super::passed::{PassedList, Stored};
use super::recent::RecentStates;
use super::retrace::{self, Step};

/// Committed states that are explored one below the other without waiting.
const LONGEST_CHAIN: usize = 64;

/// Committed states that are explored below one stored state without waiting.
const MOST_AT_ONCE: u64 = 4096;

/// States between two looks at the limits.
const LOOK_EVERY: u64 = 256;
/// Moves between two looks at the limits below one stored state.
const LOOK_EVERY_MOVES: u64 = 1 << 12;

/// No node.
const NONE: u32 = u32::MAX;

/// In which order states are explored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Breadth first: traces are shortest in stored states.
    BreadthFirst,
    /// Depth first.
    DepthFirst,
    /// Depth first among the successors of a state in random order, from this seed.
    Random(u64),
}

/// What a search found.
#[derive(Debug)]
pub enum Outcome {
    /// A state in which the predicate holds; the way to it.
    Found(Trace),
    /// There is none.
    Exhausted,
    /// A limit came first.
    Stopped(StopReason),
}

/// The end of a search.
#[derive(Debug)]
pub struct Report {
    /// What was found, or the failure and the way to the state whose exploration failed.
    pub outcome: Result<Outcome, (Failure, Trace)>,
    /// What was done.
    pub counters: Counters,
}

/// A symbolic run: states, and the moves between them (one less).
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Words and zone of each state.
    pub states: Vec<(Vec<i32>, Zone)>,
    /// The parts of each move.
    pub moves: Vec<Vec<Part>>,
}

/// How a stored state was reached.
#[derive(Clone, Copy, Debug)]
struct Node {
    parent: u32,
    /// The only move from the parent; or, with [`MANY_STEPS`], where the number of moves stands in `paths`, and then they.
    path: u32,
}

/// Marks a node to which several moves lead from its parent.
const MANY_STEPS: u32 = 1 << 31;

/// A state on the stack of unstored ones.
#[derive(Debug)]
struct Frame {
    words: Vec<i32>,
    zone: Zone,
    moves: Moves,
    next: usize,
}

/// How the exploration of one stored state ended.
enum Visit {
    Done,
    Found,
    Stopped(StopReason),
}

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

struct Search<'s, 'a> {
    symbolic: &'s mut Symbolic<'a>,
    goal: &'s mut dyn Goal,
    watch: &'s mut dyn Watch,
    order: Order,
    passed: PassedList,
    /// The committed states that were explored last.
    recent: RecentStates,
    nodes: Vec<Node>,
    paths: Vec<Step>,
    waiting: VecDeque<Stored>,
    frames: Vec<Frame>,
    /// The moves from the node that is being explored to the state at hand.
    path: Vec<Step>,
    current: u32,
    entries: Vec<Zone>,
    /// Whether some location is committed.
    has_committed: bool,
    /// The counters when the exploration of the current node began.
    counters: Counters,
    explored: u64,
    /// The value of `explored` when the exploration of the current node began.
    explored_before: u64,
    random: u64,
}

impl<'s, 'a> Search<'s, 'a> {
    fn new(
        symbolic: &'s mut Symbolic<'a>,
        goal: &'s mut dyn Goal,
        order: Order,
        watch: &'s mut dyn Watch,
    ) -> Search<'s, 'a> {
        let network = symbolic.stepper.network();
        Search {
            passed: PassedList::new(network, symbolic.dimension(), symbolic.greatest_constant()),
            recent: RecentStates::new(),
            nodes: Vec::new(),
            paths: Vec::new(),
            waiting: VecDeque::new(),
            frames: Vec::new(),
            path: Vec::new(),
            current: NONE,
            entries: Vec::new(),
            has_committed: network.processes.iter().any(|process| {
                let mut locations = process.locations.iter();
                locations.any(|location| location.urgency == Urgency::Committed)
            }),
            counters: Counters::default(),
            explored: 0,
            explored_before: 0,
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
        let nodes = self.nodes.len() * size_of::<Node>() + self.paths.len() * size_of::<Step>();
        let waiting = self.waiting.capacity() * size_of::<Stored>();
        Counters {
            explored: self.explored,
            stored: self.passed.len() as u64,
            waiting: self.waiting.len() as u64,
            bytes: (self.passed.bytes()
                + self.recent.bytes()
                + self.symbolic.stepper.bytes()
                + nodes
                + waiting) as u64,
        }
    }

    fn run(&mut self) -> Result<Outcome, Failure> {
        let (mut words, zone, invariant) = self.symbolic.start()?;
        let mut zones = vec![zone];
        self.symbolic
            .let_time_pass(&mut words, &invariant, &mut zones)?;
        for zone in &zones {
            match self.look(&mut words, zone)? {
                Look::Continue => {}
                Look::Found => return Ok(Outcome::Found(self.trace(true))),
                Look::Stopped(reason) => return Ok(Outcome::Stopped(reason)),
            }
        }
        self.symbolic.extrapolate_all(&words, &mut zones);
        for zone in &zones {
            self.add_waiting(&words, zone.bounds());
        }
        let mut next_look = LOOK_EVERY;
        while let Some(stored) = self.next_waiting() {
            if self.passed.is_covered(stored) {
                continue;
            }
            self.current = stored.node;
            let first = self.waiting.len();
            match self.visit(stored)? {
                Visit::Done => {}
                Visit::Found => return Ok(Outcome::Found(self.trace(true))),
                Visit::Stopped(reason) => return Ok(Outcome::Stopped(reason)),
            }
            self.shuffle_from(first);
            if self.explored >= next_look {
                next_look = self.explored + LOOK_EVERY;
                let counters = self.counters();
                if let Some(reason) = self.watch.look(&counters) {
                    return Ok(Outcome::Stopped(reason));
                }
            }
        }
        Ok(Outcome::Exhausted)
    }

    fn next_waiting(&mut self) -> Option<Stored> {
        match self.order {
            Order::BreadthFirst => self.waiting.pop_front(),
            Order::DepthFirst | Order::Random(_) => self.waiting.pop_back(),
        }
    }

    /// Puts the newest waiting nodes into an order that fits the search order.
    fn shuffle_from(&mut self, first: usize) {
        let Order::Random(_) = self.order else { return };
        let first = first.saturating_sub(1).min(self.waiting.len());
        for index in (first + 1..self.waiting.len()).rev() {
            let other = first + (self.next_random() % (index - first + 1) as u64) as usize;
            self.waiting.swap(index, other);
        }
    }

    /// Xorshift; only the order of the search depends on it.
    fn next_random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random >> 16
    }

    fn look(&mut self, words: &mut [i32], zone: &Zone) -> Result<Look, Failure> {
        self.goal.look(Visited {
            symbolic: self.symbolic,
            words,
            zone,
            counters: self.counters,
            watch: self.watch,
        })
    }

    /// Explores a stored state and, below it, all committed states.
    fn visit(&mut self, stored: Stored) -> Result<Visit, Failure> {
        self.path.clear();
        self.explored_before = self.explored;
        self.counters = self.own_counters();
        let mut frames = std::mem::take(&mut self.frames);
        if frames.is_empty() {
            frames.push(self.new_frame());
        }
        let Frame { words, zone, .. } = &mut frames[0];
        self.passed.load(stored, words, zone.bounds_mut());
        let result = self.visit_frames(&mut frames);
        self.frames = frames;
        result
    }

    fn new_frame(&self) -> Frame {
        Frame {
            words: self.symbolic.stepper.network().initial.clone(),
            zone: Zone::zero(self.symbolic.dimension()),
            moves: Moves::default(),
            next: 0,
        }
    }

    fn visit_frames(&mut self, frames: &mut Vec<Frame>) -> Result<Visit, Failure> {
        let mut depth = 0;
        let mut taken: u64 = 0;
        self.open(&mut frames[0])?;
        loop {
            taken += 1;
            if taken.is_multiple_of(LOOK_EVERY_MOVES) {
                let counters = self.counters();
                if let Some(reason) = self.watch.look(&counters) {
                    return Ok(Visit::Stopped(reason));
                }
            }
            if frames[depth].next == frames[depth].moves.len() {
                if depth == 0 {
                    return Ok(Visit::Done);
                }
                depth -= 1;
                self.path.pop();
                continue;
            }
            if frames.len() == depth + 1 {
                frames.push(self.new_frame());
            }
            let (above, below) = frames.split_at_mut(depth + 1);
            match self.take_next(&mut above[depth], &mut below[0], depth)? {
                Taken::Nothing => {}
                Taken::Found => return Ok(Visit::Found),
                Taken::Stopped(reason) => return Ok(Visit::Stopped(reason)),
                Taken::Down => {
                    self.open(&mut frames[depth + 1])?;
                    if self.is_link_or_new(&frames[depth + 1]) {
                        depth += 1;
                    } else {
                        self.path.pop();
                    }
                }
            }
        }
    }

    fn open(&mut self, frame: &mut Frame) -> Result<(), Failure> {
        self.explored += 1;
        frame.next = 0;
        self.symbolic.moves(&mut frame.words, &mut frame.moves)
    }

    /// Stores a committed state that has a choice; returns false if a stored state contains it.
    fn is_link_or_new(&mut self, frame: &Frame) -> bool {
        if frame.moves.len() < 2 {
            return true;
        }
        let added = self.add(&frame.words, frame.zone.bounds());
        self.explored -= u64::from(added.is_none());
        added.is_some()
    }

    /// Takes the next move of `source`; a committed target is left in `target` to be explored at once.
    fn take_next(
        &mut self,
        source: &mut Frame,
        target: &mut Frame,
        depth: usize,
    ) -> Result<Taken, Failure> {
        let ordinal = source.next as u32;
        source.next += 1;
        let one = source.moves.get(ordinal as usize);
        if self.symbolic.stays_whole(one) {
            if !self.symbolic.may_satisfy(one, source.zone.bounds())? {
                return Ok(Taken::Nothing);
            }
            target.words.copy_from_slice(&source.words);
            let zone = target.zone.bounds_mut();
            zone.copy_from_slice(source.zone.bounds());
            if !self.symbolic.take(one, &mut target.words, zone)? {
                return Ok(Taken::Nothing);
            }
            self.path.push(ordinal);
            return self.enter_whole(target, depth);
        }
        if !self.symbolic.is_enabled(one, source.zone.bounds())? {
            return Ok(Taken::Nothing);
        }
        target.words.copy_from_slice(&source.words);
        let Some(effect) = self.symbolic.fire(one, &mut target.words)? else {
            return Ok(Taken::Nothing);
        };
        let mut entries = std::mem::take(&mut self.entries);
        effect.entry_zones(
            source.zone.bounds(),
            self.symbolic.dimension(),
            &mut entries,
        );
        self.path.push(ordinal);
        let taken = self.enter(&effect.invariant, &mut entries, target, depth);
        self.entries = entries;
        taken
    }

    /// Looks at the target of a move, whose words and zone are in `target`, and stores it or leaves it there.
    fn enter_whole(&mut self, target: &mut Frame, depth: usize) -> Result<Taken, Failure> {
        let Frame { words, zone, .. } = target;
        self.symbolic.pass_time(words, zone.bounds_mut())?;
        let taken = match self.look(words, zone)? {
            Look::Found => return Ok(Taken::Found),
            Look::Stopped(reason) => Taken::Stopped(reason),
            Look::Continue => {
                self.symbolic.extrapolate(words, zone.bounds_mut());
                if self.descends(words, depth) {
                    return Ok(self.descend(words, zone.bounds()));
                }
                self.add_waiting(words, zone.bounds());
                Taken::Nothing
            }
        };
        self.path.pop();
        Ok(taken)
    }

    /// As [`Search::enter_whole`], for the zones on entry before time passes, of which there may be several.
    fn enter(
        &mut self,
        invariant: &[Constraint],
        entries: &mut Vec<Zone>,
        target: &mut Frame,
        depth: usize,
    ) -> Result<Taken, Failure> {
        self.symbolic
            .let_time_pass(&mut target.words, invariant, entries)?;
        for entry in &*entries {
            match self.look(&mut target.words, entry)? {
                Look::Continue => {}
                Look::Found => return Ok(Taken::Found),
                Look::Stopped(reason) => return Ok(Taken::Stopped(reason)),
            }
        }
        self.symbolic.extrapolate_all(&target.words, entries);
        if let [entry] = entries.as_slice()
            && self.descends(&target.words, depth)
        {
            target.zone.bounds_mut().copy_from_slice(entry.bounds());
            return Ok(self.descend(&target.words, entry.bounds()));
        }
        for entry in &*entries {
            self.add_waiting(&target.words, entry.bounds());
        }
        self.path.pop();
        Ok(Taken::Nothing)
    }

    /// Whether a state is to be explored at once and not stored.
    fn descends(&self, words: &[i32], depth: usize) -> bool {
        self.has_committed
            && depth < LONGEST_CHAIN
            && self.explored - self.explored_before < MOST_AT_ONCE
            && self.symbolic.stepper.is_committed(words)
    }

    /// Goes down to a committed state, unless it was explored lately.
    fn descend(&mut self, words: &[i32], zone: &[Bound]) -> Taken {
        let stored = self.passed.len();
        if self.recent.enter(self.passed.pack(words), zone, stored) {
            self.path.pop();
            return Taken::Nothing;
        }
        Taken::Down
    }

    /// Stores a state and lets it wait, unless a stored one contains it.
    fn add_waiting(&mut self, words: &[i32], zone: &[Bound]) {
        if let Some(stored) = self.add(words, zone) {
            self.waiting.push_back(stored);
        }
    }

    /// Stores a state with the way to it, unless a stored one contains it.
    fn add(&mut self, words: &[i32], zone: &[Bound]) -> Option<Stored> {
        let stored = self.passed.add(words, zone)?;
        let path = if let [step] = *self.path
            && step < MANY_STEPS
        {
            step
        } else {
            let first = self.paths.len() as u32;
            self.paths.push(self.path.len() as u32);
            self.paths.extend_from_slice(&self.path);
            first | MANY_STEPS
        };
        self.nodes.push(Node {
            parent: self.current,
            path,
        });
        Some(stored)
    }

    /// The way to the state at hand: the parents of the current node, then the moves below it. The states are computed anew;
    /// what fails on the way is left out.
    fn trace(&mut self, is_found: bool) -> Trace {
        let mut steps: Vec<Step> = self.path.iter().rev().copied().collect();
        let mut node = self.current;
        while node != NONE {
            let Node { parent, path } = self.nodes[node as usize];
            if path < MANY_STEPS {
                steps.push(path);
            } else {
                let first = (path - MANY_STEPS) as usize;
                let length = self.paths[first] as usize;
                steps.extend(self.paths[first + 1..=first + length].iter().rev());
            }
            node = parent;
        }
        steps.reverse();
        let goal: Option<&mut dyn Goal> = if is_found {
            Some(&mut *self.goal)
        } else {
            None
        };
        retrace::retrace(self.symbolic, &steps, goal)
    }
}

/// What became of a move.
enum Taken {
    /// Nothing more to do: impossible, stored, or covered.
    Nothing,
    /// The goal was found in the target.
    Found,
    /// A limit came first.
    Stopped(StopReason),
    /// The target is committed and is explored at once.
    Down,
}
