//! Is there a run that stays inside a predicate for ever?
//!
//! A run counts if the predicate holds at all its moments and the run cannot leave it. There are
//! three cases: it has infinitely many moves (in however little time); from some moment on time can
//! pass without limit inside predicate and invariants; or at some moment no move, and no wait that
//! the invariants allow, leads to a move or out of the predicate.
//!
//! The nodes of the search are words with a zone of valuations inside the predicate that some delay
//! inside it reaches from the entry of the state ([`super::delay_inside`]). Every node is
//! accepting, so one depth-first search is enough: there is a run with infinitely many moves
//! exactly if the search returns to a node on its stack, or to one that contains the zone of such a
//! node. (Each valuation of that zone then has a predecessor in the zone again, without end, and
//! there are finitely many regions.) A node that was left without success starts no such run, and
//! neither does any node that it contains.
//!
//! For a run that is found, extrapolation must have kept everything that comparisons can
//! distinguish (Extra-M+), including those of the predicate. The answer that there is none also
//! holds with larger zones.
//!
//! Source: S. Tripakis, "Checking Timed Büchi Automata Emptiness on Simulation Graphs", ACM TOCL
//! 10, 2009 (cycles of zones are cycles of runs); A. Laarman, M. C. Olesen, A. E. Dalsgaard, K. G.
//! Larsen, J. van de Pol, "Multi-Core Emptiness Checking of Timed Büchi Automata using Inclusion
//! Abstraction", CAV 2013 (which inclusions are sound). Where we differ: with stopped clocks the
//! cut is left out and every doubt counts as a run, so that only the absence of one is certain.

use crate::cancellation;
use crate::ir::Predicate;
use crate::network::{Failure, Moves, Symbolic};
use crate::zones::Zone;
use crate::zones::dbm;
use crate::zones::zone_table::{ZoneId, ZoneTable};

use super::delay_inside::{Delays, Entry};
use super::ending::RunEnding;
use super::stack::{Frame, Stack};
use crate::search::limits::{Counters, StopReason, Watch, states_between_checks};
use crate::search::outcome::{Outcome, Trace};
use crate::search::store::discrete_states::{DiscreteId, StateStore};

/// The greatest number of states between two checks of the limits.
const LOOK_EVERY: u64 = 256;

/// No node.
const NONE: u32 = u32::MAX;

/// A run inside a predicate that never leaves it.
#[derive(Clone, Debug)]
pub struct EndlessRun {
    /// Its states and moves; the zones are those of the search.
    pub trace: Trace,
    /// Why it never leaves.
    pub ending: RunEnding,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    discrete: DiscreteId,
    zone: ZoneId,
    /// The next node with the same words.
    next: u32,
    /// Its place on the stack; [`NONE`] after it was left.
    depth: u32,
}

/// Searches for runs inside `keep`. Several searches share what is known about nodes that start no
/// run.
pub struct Liveness<'p> {
    delays: Delays<'p>,
    store: StateStore,
    zones: ZoneTable,
    nodes: Vec<Node>,
    /// For each discrete state: its first node.
    heads: Vec<u32>,
    stack: Stack,
    /// The words of the state that is entered.
    words: Vec<i32>,
    explored: u64,
    next_look: u64,
    is_coarse: bool,
}

impl<'p> Liveness<'p> {
    /// Searches in the network of `symbolic` for runs inside `keep`.
    pub fn new(symbolic: &Symbolic<'_>, keep: &'p Predicate) -> Liveness<'p> {
        Liveness {
            delays: Delays::inside(keep),
            store: StateStore::new(symbolic.stepper.network()),
            zones: ZoneTable::new(symbolic.dimension()),
            nodes: Vec::new(),
            heads: Vec::new(),
            stack: Stack::default(),
            words: Vec::new(),
            explored: 0,
            next_look: states_between_checks(LOOK_EVERY, symbolic.dimension()),
            is_coarse: false,
        }
    }

    /// Whether a doubt was counted as a run: only if not, what was found is certain.
    pub fn is_coarse(&self) -> bool {
        self.is_coarse
    }

    /// What was done until now.
    pub fn counters(&self) -> Counters {
        let nodes = self.nodes.capacity() * size_of::<Node>() + self.heads.capacity() * 4;
        Counters {
            explored: self.explored,
            stored: self.nodes.len() as u64,
            waiting: self.stack.len() as u64,
            bytes: (self.store.bytes() + self.zones.bytes() + nodes + self.stack.bytes()) as u64,
        }
    }

    /// Searches for a run from the initial state.
    pub fn from_start(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        watch: &mut dyn Watch,
    ) -> Result<Outcome<EndlessRun>, (Failure, Trace)> {
        let start = symbolic.start();
        let (words, zone, _) = start.map_err(|failure| (failure, Trace::default()))?;
        let entry = Entry::at(&zone);
        self.from_entry(symbolic, &words, entry, Counters::default(), watch)
    }

    /// Searches for a run that begins with some valuation of a zone. `before` is what was done
    /// outside this search, for the limits.
    pub fn from_entry(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &[i32],
        entry: Entry<'_>,
        before: Counters,
        watch: &mut dyn Watch,
    ) -> Result<Outcome<EndlessRun>, (Failure, Trace)> {
        let mut words = words.to_vec();
        let outcome = self.run(symbolic, &mut words, entry, before, watch);
        let outcome = outcome.map_err(|failure| (failure, self.stack_trace(symbolic)));
        self.stack.clear();
        outcome
    }

    fn run(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        entry: Entry<'_>,
        before: Counters,
        watch: &mut dyn Watch,
    ) -> Result<Outcome<EndlessRun>, Failure> {
        let Some(invariant) = symbolic.invariant(words)? else {
            return Ok(Outcome::Exhausted);
        };
        let mut inside = self.delays.from(symbolic, words, entry, &invariant)?;
        self.is_coarse |= inside.is_coarse;
        if let Some(ending) = inside.ending {
            let mut trace = Trace::default();
            push_state(&mut trace, words, &inside.zones);
            return Ok(Outcome::Found(EndlessRun { trace, ending }));
        }
        symbolic.extrapolate_all(words, &mut inside.zones);
        for zone in inside.zones {
            let discrete = self.discrete(words);
            if self.is_left(discrete, &zone) {
                continue;
            }
            self.push(symbolic, discrete, words, zone)?;
            while self.stack.len() > 0 {
                if let Some(ending) = self.step(symbolic)? {
                    return Ok(Outcome::Found(self.found(symbolic, ending)));
                }
                if self.explored >= self.next_look {
                    let dimension = symbolic.dimension();
                    self.next_look = self.explored + states_between_checks(LOOK_EVERY, dimension);
                    let stopped = self.make_room(before, watch).err();
                    let counters = self.counters() + before;
                    if let Some(reason) = stopped.or_else(|| watch.look(&counters)) {
                        return Ok(Outcome::Stopped(reason));
                    }
                }
            }
        }
        Ok(Outcome::Exhausted)
    }

    /// Puts on disk what is cold if there is no room for it.
    fn make_room(&mut self, before: Counters, watch: &mut dyn Watch) -> Result<(), StopReason> {
        let Some(disk) = watch.disk() else {
            return Ok(());
        };
        let (bytes, growth) = ((self.counters() + before).bytes, self.store.growth());
        let mut cold: Vec<_> = self.store.cold().collect();
        disk.make_room(bytes, growth, &mut cold)
            .map_err(|_| StopReason::Disk)
    }

    /// Moves one node down, to the next move, or one node up.
    fn step(&mut self, symbolic: &mut Symbolic<'_>) -> Result<Option<RunEnding>, Failure> {
        let Some(frame) = self.stack.top() else {
            return self.come_back(symbolic);
        };
        if let Some(zone) = frame.pending.pop() {
            return self.visit(symbolic, zone);
        }
        if frame.next_move < frame.moves.len() {
            return take_next(symbolic, &mut self.delays, frame, &mut self.is_coarse);
        }
        let node = frame.node;
        self.stack.pop();
        self.leave(node);
        Ok(None)
    }

    /// Holds the top of the stack again.
    fn come_back(&mut self, symbolic: &mut Symbolic<'_>) -> Result<Option<RunEnding>, Failure> {
        let Some(below) = self.stack.pop_below() else {
            return Ok(None);
        };
        let (words, zone) = self.state(symbolic, below.node);
        self.stack.push(symbolic, below.node, &words, zone)?;
        let frame = self.stack.top().expect("a state was pushed");
        frame.next_move = below.next_move as usize;
        if below.pending > 0 {
            frame.next_move -= 1;
            take_next(symbolic, &mut self.delays, frame, &mut self.is_coarse)?;
            frame.pending.truncate(below.pending as usize);
        }
        Ok(None)
    }

    /// The state of a node.
    fn state(&self, symbolic: &Symbolic<'_>, node: u32) -> (Vec<i32>, Zone) {
        let Node { discrete, zone, .. } = self.nodes[node as usize];
        let zone = Zone::from_bounds(symbolic.dimension(), self.zones.get(zone));
        (self.store.words(discrete), zone)
    }

    /// The number of words; those that are new begin an empty list.
    fn discrete(&mut self, words: &[i32]) -> DiscreteId {
        let (discrete, is_new) = self.store.intern(words);
        if is_new {
            self.heads.push(NONE);
        }
        discrete
    }

    /// Moves to the target of the current move with this zone, unless it is known to start no run;
    /// checks whether it closes a loop.
    fn visit(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        zone: Zone,
    ) -> Result<Option<RunEnding>, Failure> {
        let top = self.stack.top().expect("the move was taken from a node");
        let mut words = std::mem::take(&mut self.words);
        words.clone_from(&top.target);
        let ending = self.enter(symbolic, &words, zone);
        self.words = words;
        ending
    }

    fn enter(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &[i32],
        zone: Zone,
    ) -> Result<Option<RunEnding>, Failure> {
        let discrete = self.discrete(words);
        let closes = |one: &&Node| {
            one.depth != NONE && dbm::is_subset(self.zones.get(one.zone), zone.bounds())
        };
        let closing = self.list(discrete).find(closes).map(|one| one.depth);
        if let Some(depth) = closing {
            let top = self.stack.top();
            top.expect("the move was taken from a node").pending = vec![zone];
            return Ok(Some(RunEnding::Loop(depth as usize)));
        }
        if !self.is_left(discrete, &zone) {
            self.push(symbolic, discrete, words, zone)?;
        }
        Ok(None)
    }

    /// The nodes with these words.
    fn list(&self, discrete: DiscreteId) -> impl Iterator<Item = &Node> {
        // There is none beyond the end.
        let node = |index: u32| self.nodes.get(index as usize);
        let first = node(self.heads[discrete.0 as usize]);
        std::iter::successors(first, move |one| node(one.next))
    }

    /// Whether it is known that no run starts in the zone.
    fn is_left(&self, discrete: DiscreteId, zone: &Zone) -> bool {
        self.list(discrete)
            .any(|one| one.depth == NONE && dbm::is_subset(zone.bounds(), self.zones.get(one.zone)))
    }

    fn push(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        discrete: DiscreteId,
        words: &[i32],
        zone: Zone,
    ) -> Result<(), Failure> {
        self.explored += 1;
        let node = cancellation::number(self.nodes.len());
        self.nodes.push(Node {
            discrete,
            zone: self.zones.intern(zone.bounds()),
            next: std::mem::replace(&mut self.heads[discrete.0 as usize], node),
            depth: self.stack.len() as u32,
        });
        self.stack.push(symbolic, node, words, zone)
    }

    /// Notes that no run starts in a node, and drops the nodes whose zones it contains from the
    /// list of its words.
    fn leave(&mut self, node: u32) {
        self.nodes[node as usize].depth = NONE;
        let Node { discrete, zone, .. } = self.nodes[node as usize];
        let mut previous = NONE;
        let mut other = self.heads[discrete.0 as usize];
        while other != NONE {
            let Node {
                zone: inner,
                next,
                depth,
                ..
            } = self.nodes[other as usize];
            let is_covered = other != node
                && depth == NONE
                && dbm::is_subset(self.zones.get(inner), self.zones.get(zone));
            if !is_covered {
                previous = other;
            } else if previous == NONE {
                self.heads[discrete.0 as usize] = next;
            } else {
                self.nodes[previous as usize].next = next;
            }
            other = next;
        }
    }

    /// The run on the stack, with the state in which it ends.
    fn found(&self, symbolic: &mut Symbolic<'_>, ending: RunEnding) -> EndlessRun {
        let mut trace = self.stack_trace(symbolic);
        if let (_, [.., top]) = self.stack.all() {
            trace.moves.push(top.parts().to_vec());
            push_state(&mut trace, &top.target, &top.pending);
        }
        EndlessRun { trace, ending }
    }

    fn stack_trace(&self, symbolic: &mut Symbolic<'_>) -> Trace {
        let (below, frames) = self.stack.all();
        let mut trace = Trace::default();
        let mut moves = Moves::default();
        for one in below {
            let (mut words, zone) = self.state(symbolic, one.node);
            let found = symbolic.moves_within(&mut words, zone.bounds(), &mut moves);
            found.expect("the moves were found before");
            let current = moves.get(one.next_move as usize - 1);
            trace.moves.push(current.parts.to_vec());
            trace.states.push((words, zone));
        }
        for (number, frame) in frames.iter().enumerate() {
            trace.states.push((frame.words.clone(), frame.zone.clone()));
            if number + 1 < frames.len() {
                trace.moves.push(frame.parts().to_vec());
            }
        }
        trace
    }
}

/// Takes the next move of a state: fills its pending zones.
fn take_next(
    symbolic: &mut Symbolic<'_>,
    delays: &mut Delays<'_>,
    frame: &mut Frame,
    is_coarse: &mut bool,
) -> Result<Option<RunEnding>, Failure> {
    let one = frame.moves.get(frame.next_move);
    frame.next_move += 1;
    let (words, zone) = (&frame.words, frame.zone.bounds());
    let Some(effect) = symbolic.fire_within(one, words, zone, &mut frame.target)? else {
        return Ok(None);
    };
    let mut entries = Vec::new();
    effect.entry_zones(frame.zone.bounds(), symbolic.dimension(), &mut entries);
    for entry in &entries {
        let entry = Entry::at(entry);
        let target = &mut frame.target;
        let inside = delays.from(symbolic, target, entry, &effect.invariant)?;
        *is_coarse |= inside.is_coarse;
        frame.pending.extend(inside.zones);
        if inside.ending.is_some() {
            return Ok(inside.ending);
        }
    }
    symbolic.extrapolate_all(&frame.target, &mut frame.pending);
    Ok(None)
}

/// Adds a state of a trace: the words with the last of their zones.
pub(super) fn push_state(trace: &mut Trace, words: &[i32], zones: &[Zone]) {
    if let Some(zone) = zones.last() {
        trace.states.push((words.to_vec(), zone.clone()));
    }
}
