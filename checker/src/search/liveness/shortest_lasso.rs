//! The run with the fewest moves that stays inside a predicate for ever.
//!
//! The nodes of the search are words with an extrapolated zone. If there is a condition on the
//! state in which the run opens, some nodes are on the path to such a state; the others are nodes
//! of the run itself, as in [`super::emptiness`]. A run can end in a node in which it can stay
//! without a move. Or it can close: a path leads from a node to one with the same words, and can be
//! repeated for ever, because after some rounds the zone contains that of an earlier round. The
//! search counts the moves up to there, and those of the loop once.
//!
//! Nodes are made in the order of their distance from the start, so the first end is the nearest.
//! Where a path returns to the words of one of its nodes, it gives a first loop. Then the search
//! looks for the nearest loop from each node in turn, as long as it may be better than what was
//! found. Among several paths of the same length from one node to another, the first one stands for
//! all.
//!
//! Cost: that of breadth-first search with equal zones as one state; for loops its square in the
//! worst case.

use std::collections::HashMap;

use crate::ir::Predicate;
use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::dbm::{self, Constraint};
use crate::zones::zone_table::{ZoneId, ZoneTable};
use crate::zones::{Bound, Zone};

use super::delay_inside::{Delays, Entry};
use super::emptiness::{EndlessRun, push_state};
use super::ending::RunEnding;
use crate::search::limits::{Counters, StopReason, Watch, states_between_checks};
use crate::search::outcome::{Outcome, Trace};
use crate::search::store::discrete_states::{DiscreteId, StateStore};

/// The greatest number of steps between two checks of the limits.
const LOOK_EVERY: u64 = 256;

/// The number of rounds after which the zones of a loop no longer change, or the loop is given up.
const MOST_ROUNDS: usize = 16;

/// The search looks for a run that stays in `keep` for ever.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'p> {
    /// The run begins in a reachable state that satisfies this; without it, in the initial state.
    pub open: Option<&'p Predicate>,
    /// What must stay true.
    pub keep: &'p Predicate,
}

/// Where a node or an end comes from.
#[derive(Clone, Debug)]
enum Origin {
    /// The run begins here.
    Start,
    /// The run opens in a state of the path.
    Opening(usize),
    /// By a move.
    Move(usize, Vec<Part>),
}

struct Node {
    discrete: DiscreteId,
    zone: ZoneId,
    /// Whether it is a node of the run, and not of the path to it.
    is_open: bool,
    from: Origin,
    /// The number of moves to it.
    distance: u32,
    /// The nodes of the run to which its moves lead.
    next: Vec<(usize, Vec<Part>)>,
    is_explored: bool,
}

/// A way to stay.
enum Stay {
    /// Without a move, in these zones of a state.
    Ends(RunEnding, Origin, Vec<i32>, Vec<Zone>),
    /// In a loop from a node: its moves with the nodes that they lead to.
    Loops(usize, Vec<(usize, Vec<Part>)>),
}

/// A search for a run with the fewest moves.
pub struct LassoSearch<'s, 'a> {
    symbolic: &'s mut Symbolic<'a>,
    wanted: Wanted<'s>,
    delays: Delays<'s>,
    store: StateStore,
    zones: ZoneTable,
    nodes: Vec<Node>,
    /// For words and zone: the node of the run.
    open_nodes: HashMap<(DiscreteId, ZoneId), usize>,
    /// For words: the nodes of the path.
    ways: HashMap<DiscreteId, Vec<usize>>,
    found: Option<(u32, Stay)>,
    steps: u64,
}

impl<'s, 'a> LassoSearch<'s, 'a> {
    /// A search in zones that extrapolation leaves exact for what must stay true.
    pub fn new(symbolic: &'s mut Symbolic<'a>, wanted: Wanted<'s>) -> LassoSearch<'s, 'a> {
        LassoSearch {
            store: StateStore::new(symbolic.stepper.network()),
            zones: ZoneTable::new(symbolic.dimension()),
            symbolic,
            delays: Delays::inside(wanted.keep),
            wanted,
            nodes: Vec::new(),
            open_nodes: HashMap::new(),
            ways: HashMap::new(),
            found: None,
            steps: 0,
        }
    }

    /// Searches for a run with the fewest moves; returns it with the way to it, and the index of
    /// the state in which it opens.
    pub fn run(mut self, watch: &mut dyn Watch) -> Result<Outcome<(EndlessRun, usize)>, Failure> {
        let (mut words, zone, invariant) = self.symbolic.start()?;
        self.enter(None, &mut words, vec![zone], &invariant)?;
        let mut index = 0;
        while index < self.nodes.len() && self.may_beat(self.nodes[index].distance + 1) {
            self.explore(index)?;
            for arc in 0..self.nodes[index].next.len() {
                self.close_back(index, arc)?;
            }
            index += 1;
            if let Some(reason) = self.look(watch) {
                return Ok(Outcome::Stopped(reason));
            }
        }
        for head in 0..index {
            if self.nodes[head].is_open
                && let Some(reason) = self.close(head, watch)?
            {
                return Ok(Outcome::Stopped(reason));
            }
        }
        Ok(match self.found.take() {
            None => Outcome::Exhausted,
            Some((_, stay)) => Outcome::Found(self.traced(stay)),
        })
    }

    fn counters(&self) -> Counters {
        let node = size_of::<Node>() + 2 * size_of::<(usize, Vec<Part>)>() + 4 * size_of::<Part>();
        Counters {
            explored: self.steps,
            stored: self.nodes.len() as u64,
            waiting: 0,
            bytes: (self.store.bytes() + self.zones.bytes() + self.nodes.len() * node) as u64,
        }
    }

    fn look(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        self.steps += 1;
        let look_every = states_between_checks(LOOK_EVERY, self.symbolic.dimension());
        if self.steps.is_multiple_of(look_every) {
            watch.look(&self.counters())
        } else {
            None
        }
    }

    /// Whether a run with this many moves would be the best until now.
    fn may_beat(&self, moves: u32) -> bool {
        self.found
            .as_ref()
            .is_none_or(|(fewest, _)| moves < *fewest)
    }

    fn zone_of(&self, node: usize) -> &[Bound] {
        self.zones.get(self.nodes[node].zone)
    }

    /// The words and the zone of a node.
    fn state_of(&self, node: usize) -> (Vec<i32>, Zone) {
        let words = self.store.words(self.nodes[node].discrete);
        let zone = Zone::from_bounds(self.symbolic.dimension(), self.zone_of(node));
        (words, zone)
    }

    fn explore(&mut self, index: usize) -> Result<(), Failure> {
        if std::mem::replace(&mut self.nodes[index].is_explored, true) {
            return Ok(());
        }
        let dimension = self.symbolic.dimension();
        let (mut words, zone) = self.state_of(index);
        let mut moves = Moves::default();
        self.symbolic
            .moves_within(&mut words, zone.bounds(), &mut moves)?;
        let mut target = words.clone();
        for one in moves.iter() {
            let symbolic = &mut *self.symbolic;
            let Some(effect) = symbolic.fire_within(one, &words, zone.bounds(), &mut target)?
            else {
                continue;
            };
            let mut entries = Vec::new();
            effect.entry_zones(zone.bounds(), dimension, &mut entries);
            let source = Some((index, one.parts));
            self.enter(source, &mut target, entries, &effect.invariant)?;
        }
        Ok(())
    }

    /// Enters a state, from a node by a move or at the start.
    fn enter(
        &mut self,
        source: Option<(usize, &[Part])>,
        words: &mut [i32],
        mut entries: Vec<Zone>,
        invariant: &[Constraint],
    ) -> Result<(), Failure> {
        let from = source.map_or(Origin::Start, |(node, parts)| {
            Origin::Move(node, parts.to_vec())
        });
        let is_open = source.map_or(self.wanted.open.is_none(), |(node, _)| {
            self.nodes[node].is_open
        });
        if is_open {
            for entry in &entries {
                self.stay(&from, words, entry, invariant)?;
            }
            return Ok(());
        }
        self.symbolic
            .let_time_pass(words, invariant, &mut entries)?;
        for entry in entries {
            self.extend_run(&from, words, &entry, invariant)?;
        }
        Ok(())
    }

    /// Adds the nodes of the path to the run for a zone, and those of the runs that open in it.
    fn extend_run(
        &mut self,
        from: &Origin,
        words: &mut [i32],
        zone: &Zone,
        invariant: &[Constraint],
    ) -> Result<(), Failure> {
        let Some(open) = self.wanted.open else {
            return Ok(());
        };
        let (discrete, _) = self.store.intern(words);
        let mut extrapolated = vec![zone.clone()];
        self.symbolic.extrapolate_all(words, &mut extrapolated);
        let known = self.ways.get(&discrete).map_or(&[][..], Vec::as_slice);
        extrapolated.retain(|one| {
            let is_inside = |&node: &usize| dbm::is_subset(one.bounds(), self.zone_of(node));
            !known.iter().any(is_inside)
        });
        if extrapolated.is_empty() {
            return Ok(());
        }
        for one in &extrapolated {
            let node = self.add(discrete, one, false, from);
            self.ways.entry(discrete).or_default().push(node);
        }
        let opening = Origin::Opening(self.nodes.len() - 1);
        for entry in self.symbolic.part(open, words, zone)?.to_zones() {
            self.stay(&opening, words, &entry, invariant)?;
        }
        Ok(())
    }

    /// Adds the nodes of the run for a zone on entry, or finds that the run can end there.
    fn stay(
        &mut self,
        from: &Origin,
        words: &mut [i32],
        entry: &Zone,
        invariant: &[Constraint],
    ) -> Result<(), Failure> {
        let inside = self
            .delays
            .from(self.symbolic, words, Entry::at(entry), invariant)?;
        let mut zones = inside.zones;
        if let Some(ending) = inside.ending {
            let moves = self.distance_after(from);
            if self.may_beat(moves) {
                let stay = Stay::Ends(ending, from.clone(), words.to_vec(), zones);
                self.found = Some((moves, stay));
            }
            return Ok(());
        }
        self.symbolic.extrapolate_all(words, &mut zones);
        let (discrete, _) = self.store.intern(words);
        for zone in zones {
            let key = (discrete, self.zones.intern(zone.bounds()));
            let known = self.open_nodes.get(&key).copied();
            let node = known.unwrap_or_else(|| self.add(discrete, &zone, true, from));
            self.open_nodes.insert(key, node);
            if let Origin::Move(source, parts) = from {
                self.nodes[*source].next.push((node, parts.clone()));
            }
        }
        Ok(())
    }

    fn add(&mut self, discrete: DiscreteId, zone: &Zone, is_open: bool, from: &Origin) -> usize {
        self.nodes.push(Node {
            discrete,
            zone: self.zones.intern(zone.bounds()),
            is_open,
            distance: self.distance_after(from),
            from: from.clone(),
            next: Vec::new(),
            is_explored: false,
        });
        self.nodes.len() - 1
    }

    fn distance_after(&self, from: &Origin) -> u32 {
        match from {
            Origin::Start => 0,
            Origin::Opening(node) => self.nodes[*node].distance,
            Origin::Move(node, _) => self.nodes[*node].distance + 1,
        }
    }

    /// Whether a run that comes from the head along this path can repeat it for ever.
    fn closes(&mut self, head: usize, way: &[(usize, Vec<Part>)]) -> Result<bool, Failure> {
        let Some((last, _)) = way.last() else {
            return Ok(false);
        };
        let discrete = self.nodes[head].discrete;
        let mut rounds = vec![head];
        let mut node = *last;
        while self.nodes[node].discrete == discrete && rounds.len() <= MOST_ROUNDS {
            let zone = self.zone_of(node);
            let is_inside = |&before: &usize| dbm::is_subset(self.zone_of(before), zone);
            if rounds.iter().any(is_inside) {
                return Ok(true);
            }
            rounds.push(node);
            for (_, parts) in way {
                self.explore(node)?;
                let mut next = self.nodes[node].next.iter();
                let Some((target, _)) = next.find(|(_, other)| other == parts) else {
                    return Ok(false);
                };
                node = *target;
            }
        }
        Ok(false)
    }

    /// Looks for a loop that a move from `source` closes with the way to `source`.
    fn close_back(&mut self, source: usize, arc: usize) -> Result<(), Failure> {
        let moves = self.nodes[source].distance + 1;
        let last = self.nodes[source].next[arc].0;
        let mut way = vec![self.nodes[source].next[arc].clone()];
        let mut head = source;
        while self.may_beat(moves) {
            if self.nodes[head].discrete == self.nodes[last].discrete {
                let forwards: Vec<_> = way.iter().rev().cloned().collect();
                if self.closes(head, &forwards)? {
                    self.found = Some((moves, Stay::Loops(head, forwards)));
                }
            }
            match &self.nodes[head].from {
                Origin::Move(before, parts) => {
                    way.push((head, parts.clone()));
                    head = *before;
                }
                Origin::Start | Origin::Opening(_) => break,
            }
        }
        Ok(())
    }

    /// Looks for the shortest loop from a node, as long as it may be better than what was found.
    fn close(&mut self, head: usize, watch: &mut dyn Watch) -> Result<Option<StopReason>, Failure> {
        // For each node: the node from which it was reached first, and by which of its moves.
        let mut came: HashMap<usize, (usize, usize)> = HashMap::new();
        let mut layer = vec![head];
        let mut moves = self.nodes[head].distance;
        while !layer.is_empty() {
            moves += 1;
            let mut next_layer = Vec::new();
            for node in layer {
                if let Some(reason) = self.look(watch) {
                    return Ok(Some(reason));
                }
                for arc in 0..self.nodes[node].next.len() {
                    if !self.may_beat(moves) {
                        return Ok(None);
                    }
                    let target = self.nodes[node].next[arc].0;
                    if came.contains_key(&target) {
                        continue;
                    }
                    came.insert(target, (node, arc));
                    next_layer.push(target);
                    if self.nodes[head].discrete == self.nodes[target].discrete {
                        let way = self.way_back(head, target, &came);
                        if self.closes(head, &way)? {
                            self.found = Some((moves, Stay::Loops(head, way)));
                        }
                    }
                }
            }
            layer = next_layer;
        }
        Ok(None)
    }

    fn way_back(
        &self,
        head: usize,
        last: usize,
        came: &HashMap<usize, (usize, usize)>,
    ) -> Vec<(usize, Vec<Part>)> {
        let mut way = Vec::new();
        let mut target = last;
        loop {
            let (node, arc) = came[&target];
            way.push((target, self.nodes[node].next[arc].1.clone()));
            if node == head {
                way.reverse();
                return way;
            }
            target = node;
        }
    }

    /// The run with the way to it, and the index of the state in which it opens.
    fn traced(&self, stay: Stay) -> (EndlessRun, usize) {
        let mut trace = Trace::default();
        match stay {
            Stay::Ends(ending, from, words, zones) => {
                let mut opening = 0;
                self.follow(&from, &mut trace, &mut opening);
                push_state(&mut trace, &words, &zones);
                (EndlessRun { trace, ending }, opening)
            }
            Stay::Loops(head, way) => {
                let mut opening = 0;
                self.follow(&self.nodes[head].from, &mut trace, &mut opening);
                trace.states.push(self.state_of(head));
                let start = trace.states.len() - 1;
                for (node, parts) in way {
                    trace.moves.push(parts);
                    trace.states.push(self.state_of(node));
                }
                let ending = RunEnding::Loop(start);
                (EndlessRun { trace, ending }, opening)
            }
        }
    }

    /// Adds the states and moves that lead to this origin.
    fn follow(&self, from: &Origin, trace: &mut Trace, opening: &mut usize) {
        let mut chain = Vec::new();
        let mut last = from;
        loop {
            chain.push(last);
            match last {
                Origin::Start => break,
                Origin::Opening(node) | Origin::Move(node, _) => last = &self.nodes[*node].from,
            }
        }
        for from in chain.into_iter().rev() {
            match from {
                Origin::Start => {}
                // The rest is the same state, if the run begins in it.
                Origin::Opening(_) => *opening = trace.states.len(),
                Origin::Move(node, parts) => {
                    trace.states.push(self.state_of(*node));
                    trace.moves.push(parts.clone());
                }
            }
        }
    }
}
