//! Reachability: is there a state that a [`Goal`] finds, for example one in which a predicate holds?
//!
//! A search over the zone graph with inclusion: a symbolic state is not explored if a stored one with the same words contains
//! its zone, and stored ones that a new one contains are dropped from the waiting list. States with a committed location
//! are explored where they arise and not stored: no time passes in them, and chains of them are short. A chain that is not
//! short ([`LONGEST_CHAIN`]) or fans out ([`MOST_UNSTORED`]) is stored after all, so that loops of committed locations end.
//!
//! Each stored state remembers its parent and the moves from it, so that a trace is found by taking the moves again.
//!
//! Source: Bengtsson and Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, section 3; G. Behrmann, J. Bengtsson, A. David,
//! K. G. Larsen, P. Pettersson, W. Yi, "UPPAAL Implementation Secrets", 2002 (one list for passed and waiting states).

use std::collections::VecDeque;

use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::dbm::Constraint;
use crate::zones::{Zone, dbm};

use super::goal::{Goal, Look, Visited};
use super::limits::{Counters, StopReason, Watch};
use super::retrace::{self, Step};
use super::store::{DiscreteId, StateStore};
use super::zone_table::{ZoneId, ZoneTable};

/// Committed states that are explored one below the other without being stored.
const LONGEST_CHAIN: usize = 64;

/// Committed states that are explored below one stored state without being stored; those that follow are stored, so that
/// choices in loops of committed locations do not multiply.
const MOST_UNSTORED: u64 = 256;

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

#[derive(Clone, Copy, Debug)]
struct Node {
    discrete: DiscreteId,
    zone: ZoneId,
    /// The next node with the same words.
    next: u32,
    parent: u32,
    path: (u32, u32),
    is_covered: bool,
}

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
    store: StateStore,
    zones: ZoneTable,
    nodes: Vec<Node>,
    /// By discrete state: its first node.
    heads: Vec<u32>,
    paths: Vec<Step>,
    waiting: VecDeque<u32>,
    frames: Vec<Frame>,
    /// The moves from the node that is being explored to the state at hand.
    path: Vec<Step>,
    current: u32,
    entries: Vec<Zone>,
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
            store: StateStore::new(network),
            zones: ZoneTable::new(symbolic.dimension()),
            nodes: Vec::new(),
            heads: Vec::new(),
            paths: Vec::new(),
            waiting: VecDeque::new(),
            frames: Vec::new(),
            path: Vec::new(),
            current: NONE,
            entries: Vec::new(),
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
        let nodes = self.nodes.capacity() * size_of::<Node>() + self.heads.capacity() * 4;
        let paths = self.paths.capacity() * size_of::<Step>() + self.waiting.capacity() * 4;
        Counters {
            explored: self.explored,
            stored: self.nodes.len() as u64,
            waiting: self.waiting.len() as u64,
            bytes: (self.store.bytes() + self.zones.bytes() + nodes + paths) as u64,
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
            self.add(&words, zone);
        }
        let mut next_look = LOOK_EVERY;
        while let Some(node) = self.next_node() {
            if self.nodes[node as usize].is_covered {
                continue;
            }
            self.current = node;
            let first = self.waiting.len();
            match self.visit(node)? {
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

    fn next_node(&mut self) -> Option<u32> {
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
        let counters = self.own_counters();
        self.goal.look(Visited {
            symbolic: self.symbolic,
            words,
            zone,
            counters,
            watch: self.watch,
        })
    }

    /// Explores a stored state and, below it, all committed states.
    fn visit(&mut self, node: u32) -> Result<Visit, Failure> {
        self.path.clear();
        self.explored_before = self.explored;
        let Node { discrete, zone, .. } = self.nodes[node as usize];
        let mut frames = std::mem::take(&mut self.frames);
        if frames.is_empty() {
            frames.push(self.new_frame());
        }
        self.store.load(discrete, &mut frames[0].words);
        frames[0]
            .zone
            .bounds_mut()
            .copy_from_slice(self.zones.get(zone));
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
                    depth += 1;
                    self.open(&mut frames[depth])?;
                }
            }
        }
    }

    fn open(&mut self, frame: &mut Frame) -> Result<(), Failure> {
        self.explored += 1;
        frame.next = 0;
        self.symbolic.moves(&mut frame.words, &mut frame.moves)
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
        target.words.copy_from_slice(&source.words);
        let one = source.moves.get(ordinal as usize);
        if !self.symbolic.is_enabled(one, source.zone.bounds())? {
            return Ok(Taken::Nothing);
        }
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
        if let Ok(Taken::Nothing) = taken {
            self.path.pop();
        }
        taken
    }

    /// Looks at the target of a move, whose words are in `target`, and stores it or leaves it there with its zone.
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
        let descends = depth < LONGEST_CHAIN
            && self.explored - self.explored_before < MOST_UNSTORED
            && self.symbolic.stepper.is_committed(&target.words);
        if let [entry] = entries.as_slice()
            && descends
        {
            target.zone.bounds_mut().copy_from_slice(entry.bounds());
            return Ok(Taken::Down);
        }
        for entry in &*entries {
            self.add(&target.words, entry);
        }
        Ok(Taken::Nothing)
    }

    /// Stores a state and lets it wait, unless a stored one contains it.
    fn add(&mut self, words: &[i32], zone: &Zone) {
        let (discrete, is_new) = self.store.intern(words);
        if is_new {
            self.heads.push(NONE);
        }
        let id = self.zones.intern(zone.bounds());
        if self.is_covered(discrete, id, zone) {
            return;
        }
        let first = self.paths.len() as u32;
        self.paths.extend_from_slice(&self.path);
        let node = Node {
            discrete,
            zone: id,
            next: self.heads[discrete.0 as usize],
            parent: self.current,
            path: (first, self.paths.len() as u32),
            is_covered: false,
        };
        self.heads[discrete.0 as usize] = self.nodes.len() as u32;
        self.waiting.push_back(self.nodes.len() as u32);
        self.nodes.push(node);
    }

    /// Whether a stored state contains the new one; unlinks those that the new one contains.
    fn is_covered(&mut self, discrete: DiscreteId, id: ZoneId, zone: &Zone) -> bool {
        let mut previous = NONE;
        let mut node = self.heads[discrete.0 as usize];
        while node != NONE {
            let Node {
                zone: other, next, ..
            } = self.nodes[node as usize];
            if other == id || dbm::is_subset(zone.bounds(), self.zones.get(other)) {
                return true;
            }
            if dbm::is_subset(self.zones.get(other), zone.bounds()) {
                self.nodes[node as usize].is_covered = true;
                if previous == NONE {
                    self.heads[discrete.0 as usize] = next;
                } else {
                    self.nodes[previous as usize].next = next;
                }
            } else {
                previous = node;
            }
            node = next;
        }
        false
    }

    /// The way to the state at hand: the parents of the current node, then the moves below it. The states are computed anew;
    /// what fails on the way is left out.
    fn trace(&mut self, is_found: bool) -> Trace {
        let mut steps: Vec<Step> = self.path.iter().rev().copied().collect();
        let mut node = self.current;
        while node != NONE {
            let Node { parent, path, .. } = self.nodes[node as usize];
            steps.extend(self.paths[path.0 as usize..path.1 as usize].iter().rev());
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
