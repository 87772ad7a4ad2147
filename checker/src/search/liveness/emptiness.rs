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
//! Most moves lead to states that are known. So it is first seen whether a node contains the state;
//! whether a run ends there need not be asked where that node is sure ([`super::nodes`]). A new
//! state is asked for the whole zone that is stored, so that its node is sure wherever it can be.
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

use crate::ir::Predicate;
use crate::network::{Extent, Failure, KeptZone, KnownZone, Moves, Symbolic};
use crate::zones::Zone;

use super::delay_inside::{Delays, Entry};
use super::ending::RunEnding;
use super::nodes::{Known, Nodes};
use super::stack::{Frame, Stack};
use crate::search::limits::{Counters, StopReason, Watch, states_between_checks};
use crate::search::outcome::{Outcome, Trace};
use crate::search::store::discrete_states::{DiscreteId, StateStore};

/// The greatest number of states between two checks of the limits.
const LOOK_EVERY: u64 = 256;

/// A run inside a predicate that never leaves it.
#[derive(Clone, Debug)]
pub struct EndlessRun {
    /// Its states and moves; the zones are those of the search.
    pub trace: Trace,
    /// Why it never leaves.
    pub ending: RunEnding,
}

/// Searches for runs inside `keep`. Several searches share what is known about nodes that start no
/// run.
pub struct Liveness<'p> {
    delays: Delays<'p>,
    store: StateStore,
    nodes: Nodes,
    stack: Stack,
    /// The state that is entered: its words, its zone, and the zone as it is stored.
    words: Vec<i32>,
    zone: Zone,
    stored: Zone,
    /// If a run ends in that state: the zones in which it does.
    ends: Vec<Zone>,
    /// Whether no clock is ever stopped.
    has_exact_delays: bool,
    explored: u64,
    next_look: u64,
    is_coarse: bool,
}

impl<'p> Liveness<'p> {
    /// Searches in the network of `symbolic` for runs inside `keep`.
    pub fn new(symbolic: &Symbolic<'_>, keep: &'p Predicate) -> Liveness<'p> {
        let network = symbolic.stepper.network();
        Liveness {
            delays: Delays::inside(keep),
            store: StateStore::new(network),
            nodes: Nodes::new(symbolic),
            stack: Stack::default(),
            words: network.initial.clone(),
            zone: Zone::zero(symbolic.dimension()),
            stored: Zone::zero(symbolic.dimension()),
            ends: Vec::new(),
            has_exact_delays: !network.features.stopwatches,
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
        Counters {
            explored: self.explored,
            stored: self.nodes.len() as u64,
            waiting: self.stack.len() as u64,
            bytes: (self.store.bytes() + self.nodes.bytes() + self.stack.bytes()) as u64,
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
        let outcome = self.run(symbolic, words, entry, before, watch);
        let outcome = outcome.map_err(|failure| (failure, self.stack_trace(symbolic)));
        self.stack.clear();
        outcome
    }

    fn run(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &[i32],
        entry: Entry<'_>,
        before: Counters,
        watch: &mut dyn Watch,
    ) -> Result<Outcome<EndlessRun>, Failure> {
        self.words.copy_from_slice(words);
        let (ending, zones) = self.begin(symbolic, entry)?;
        if let Some(ending) = ending {
            return Ok(Outcome::Found(self.found(symbolic, ending)));
        }
        let mut zones = zones.into_iter();
        loop {
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
            let Some(zone) = zones.next() else {
                return Ok(Outcome::Exhausted);
            };
            self.words.copy_from_slice(words);
            self.enter_part(symbolic, zone)?;
        }
    }

    /// Enters the words at hand by a zone; returns the zones that are still to be entered.
    fn begin(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        entry: Entry<'_>,
    ) -> Result<(Option<RunEnding>, Vec<Zone>), Failure> {
        let Some(invariant) = symbolic.invariant(&mut self.words)? else {
            return Ok((None, Vec::new()));
        };
        if self.has_exact_delays && !symbolic.has_barriers() && !symbolic.splits() {
            let may_delay = symbolic.may_delay(&mut self.words)?;
            let zone = self.zone.bounds_mut();
            zone.copy_from_slice(entry.zone.bounds());
            symbolic.delay(&self.words, may_delay, &invariant, zone)?;
            match self.delays.extent(symbolic, &mut self.words, zone)? {
                Extent::Nowhere => return Ok((None, Vec::new())),
                Extent::Everywhere => {
                    let ending = self.enter_whole(symbolic, None)?;
                    return Ok((ending, Vec::new()));
                }
                Extent::Part(_) => {}
            }
        }
        let delays = &mut self.delays;
        let mut inside = delays.from(symbolic, &mut self.words, entry, &invariant)?;
        self.is_coarse |= inside.is_coarse;
        if inside.ending.is_some() {
            self.ends = inside.zones;
            return Ok((inside.ending, Vec::new()));
        }
        symbolic.extrapolate_all(&self.words, &mut inside.zones);
        Ok((None, inside.zones))
    }

    /// Puts on disk what is cold if there is no room for it.
    fn make_room(&mut self, before: Counters, watch: &dyn Watch) -> Result<(), StopReason> {
        let (bytes, growth) = ((self.counters() + before).bytes, self.store.growth());
        let mut cold: Vec<_> = self.store.cold().chain(self.nodes.cold()).collect();
        watch.make_room(bytes, growth, &mut cold)
    }

    /// Moves one node down, to the next move, or one node up.
    fn step(&mut self, symbolic: &mut Symbolic<'_>) -> Result<Option<RunEnding>, Failure> {
        let Some(frame) = self.stack.top() else {
            return self.come_back(symbolic);
        };
        if let Some(zone) = frame.pending.pop() {
            self.words.copy_from_slice(&frame.target);
            return self.enter_part(symbolic, zone);
        }
        if frame.next_move < frame.moves.len() {
            return self.take_next(symbolic);
        }
        let node = frame.node;
        self.stack.pop();
        self.nodes.leave(node);
        Ok(None)
    }

    /// Holds the top of the stack again.
    fn come_back(&mut self, symbolic: &mut Symbolic<'_>) -> Result<Option<RunEnding>, Failure> {
        let Some((below, pending)) = self.stack.pop_below() else {
            return Ok(None);
        };
        let discrete = self.nodes.discrete(below.node);
        self.store.load(discrete, &mut self.words);
        self.nodes.load(below.node, self.stored.bounds_mut());
        let zone = self.stored.bounds();
        self.stack
            .push(symbolic, below.node, &self.words, zone, None)?;
        let frame = self.stack.top().expect("a state was pushed");
        frame.next_move = below.next_move as usize;
        if pending > 0 {
            take_parts(symbolic, &mut self.delays, frame, &mut self.is_coarse)?;
            frame.pending.truncate(pending);
        }
        Ok(None)
    }

    /// Takes the next move of the top. If it leads to one zone, in all of which the predicate
    /// holds, that is entered; else the parts of it wait.
    fn take_next(&mut self, symbolic: &mut Symbolic<'_>) -> Result<Option<RunEnding>, Failure> {
        let top = self.stack.top();
        let frame = top.expect("the move is taken from a node");
        let one = frame.moves.get(frame.next_move);
        frame.next_move += 1;
        let from = frame.zone.bounds();
        if self.has_exact_delays && symbolic.stays_whole(one, from) {
            if !symbolic.may_satisfy(one, from)? {
                return Ok(None);
            }
            let (words, zone) = (&mut self.words, self.zone.bounds_mut());
            words.copy_from_slice(&frame.words);
            let kept = if let Some(known) = frame.known.filter(|&known| symbolic.is_known(known)) {
                let kept = symbolic.enter_known(one, words, known, from, zone)?;
                if kept.is_none() {
                    return Ok(None);
                }
                kept
            } else {
                zone.copy_from_slice(from);
                if !symbolic.take(one, words, zone)? {
                    return Ok(None);
                }
                symbolic.pass_time(words, zone)?;
                None
            };
            match self.delays.extent(symbolic, words, zone)? {
                Extent::Nowhere => return Ok(None),
                Extent::Everywhere => return self.enter_whole(symbolic, kept),
                Extent::Part(_) => {}
            }
        }
        let ending = take_parts(symbolic, &mut self.delays, frame, &mut self.is_coarse)?;
        if ending.is_some() {
            self.words.copy_from_slice(&frame.target);
            self.ends = std::mem::take(&mut frame.pending);
        }
        Ok(ending)
    }

    /// Enters the state at hand, in all of whose zone the predicate holds: unless it is known that
    /// no run ends or starts there, or one is found.
    fn enter_whole(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        kept: Option<KeptZone>,
    ) -> Result<Option<RunEnding>, Failure> {
        let (discrete, is_new) = self.store.intern(&self.words);
        let mut number = None;
        let stored = self.stored.bounds_mut();
        if let Some(kept) = kept.filter(|_| !symbolic.keeps_reduced()) {
            stored.copy_from_slice(symbolic.kept(kept).0);
            number = symbolic.known_kept(kept);
        } else {
            stored.copy_from_slice(self.zone.bounds());
            // Mostly the state is known, and this tells.
            let known = self.nodes.propose(discrete, is_new, stored);
            if known.is_left && known.is_sure {
                return Ok(None);
            }
            symbolic.extrapolate(&self.words, stored);
        }
        let mut known = self.nodes.propose(discrete, is_new, stored);
        if !known.is_sure {
            let may_delay = symbolic.may_delay(&mut self.words)?;
            known.is_sure = !known.is_left && self.is_sure(symbolic, may_delay);
            if !known.is_sure {
                let (words, zone) = (&mut self.words, &self.zone);
                let end = self.delays.end_in(symbolic, words, zone, may_delay)?;
                if let Some((ending, part)) = end {
                    self.ends = part.to_zones().collect();
                    return Ok(Some(ending));
                }
            }
        }
        self.enter(symbolic, discrete, known, number)
    }

    /// Whether it is certain that no run ends in any valuation of the stored zone at hand that the
    /// invariants allow.
    fn is_sure(&mut self, symbolic: &mut Symbolic<'_>, may_delay: bool) -> bool {
        let words = &mut self.words;
        let mut all = self.zone.clone();
        if self.zone != self.stored {
            // What fails only here does not concern the state.
            let Ok(Some(invariant)) = symbolic.invariant(words) else {
                return false;
            };
            all.bounds_mut().copy_from_slice(self.stored.bounds());
            all.constrain_all(&invariant);
            let delayed = symbolic.delay(words, may_delay, &invariant, all.bounds_mut());
            if delayed.is_err() {
                return false;
            }
        }
        if all != self.zone {
            let extent = self.delays.extent(symbolic, words, all.bounds());
            if !matches!(extent, Ok(Extent::Everywhere)) {
                return false;
            }
        }
        let end = self.delays.end_in(symbolic, words, &all, may_delay);
        matches!(end, Ok(None))
    }

    /// Enters the words at hand with a stored zone, from which no run ends.
    fn enter_part(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        zone: Zone,
    ) -> Result<Option<RunEnding>, Failure> {
        self.stored = zone;
        let (discrete, is_new) = self.store.intern(&self.words);
        let known = self.nodes.propose(discrete, is_new, self.stored.bounds());
        self.enter(symbolic, discrete, known, None)
    }

    /// Enters the stored state at hand, from which no run ends, unless it is known to start none;
    /// checks whether it closes a loop.
    fn enter(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        discrete: DiscreteId,
        known: Known,
        number: Option<KnownZone>,
    ) -> Result<Option<RunEnding>, Failure> {
        if let Some(node) = known.closes {
            self.ends = vec![self.stored.clone()];
            return Ok(Some(RunEnding::Loop(self.stack.depth(node))));
        }
        if !known.is_left {
            self.explored += 1;
            let node = self.nodes.add(discrete, known.is_sure);
            let zone = self.stored.bounds();
            self.stack.push(symbolic, node, &self.words, zone, number)?;
        }
        Ok(None)
    }

    /// The run on the stack, with the state at hand, in which it ends.
    fn found(&self, symbolic: &mut Symbolic<'_>, ending: RunEnding) -> EndlessRun {
        let mut trace = self.stack_trace(symbolic);
        if let (_, [.., top]) = self.stack.all() {
            trace.moves.push(top.parts().to_vec());
        }
        push_state(&mut trace, &self.words, &self.ends);
        EndlessRun { trace, ending }
    }

    fn stack_trace(&self, symbolic: &mut Symbolic<'_>) -> Trace {
        let (below, frames) = self.stack.all();
        let mut trace = Trace::default();
        let mut moves = Moves::default();
        for one in below {
            let mut words = self.store.words(self.nodes.discrete(one.node));
            let mut zone = Zone::zero(symbolic.dimension());
            self.nodes.load(one.node, zone.bounds_mut());
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

/// Takes the current move of a state once more: fills its pending zones.
fn take_parts(
    symbolic: &mut Symbolic<'_>,
    delays: &mut Delays<'_>,
    frame: &mut Frame,
    is_coarse: &mut bool,
) -> Result<Option<RunEnding>, Failure> {
    let one = frame.moves.get(frame.next_move - 1);
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
