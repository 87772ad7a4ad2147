//! The regions of a network and the moves between them, computed from the tree of the network by
//! the definitions of the language. Nothing here knows the engine, or what it makes of the text.
//!
//! A region is a state whose clock values have all integer parts and the order of all fractions in
//! common. Its representative has the fractions 0, 2, 4, … of as many ticks as leave room between
//! them; a clock beyond all constants has one value. Clocks are not compared with each other.

use std::collections::HashMap;

use checker::ir;
use checker::verify::{Part, State};

use super::{Atom, Invariant};
use super::{CHANNELS, Edge, Labels, Leg, Network, PRIORITIES, Sync, Update, Urgency, VALUES};
use crate::explicit::{Entry, Graph, Label, Node, Step, Stopper};

/// An edge, with a leg if it has any, whose guards hold, and the values of its selects.
#[derive(Clone)]
struct Way<'n> {
    process: usize,
    edge: usize,
    edges: &'n Edge,
    leg: Option<&'n Leg>,
    values: [i32; 2],
    /// The channel, and whether it sends.
    sync: Option<(String, bool)>,
}

/// A transition: the sender, or the only process, first.
struct Move<'n> {
    ways: Vec<Way<'n>>,
    channel: Option<String>,
}

struct Explorer<'n> {
    network: &'n Network,
    constant: i64,
    ticks: i64,
    known: HashMap<State, usize>,
    states: Vec<State>,
}

/// All regions that can be reached, with the moves that priorities leave; nothing if there are more
/// than `most`, or if the initial state breaks an invariant.
pub(crate) fn explore(network: &Network, constant: i32, most: usize) -> Option<Graph> {
    let mut explorer = Explorer {
        network,
        constant: i64::from(constant),
        ticks: 2 * (network.clocks as i64 + 1),
        known: HashMap::new(),
        states: Vec::new(),
    };
    let initial = State {
        words: vec![0; network.processes.len() + network.variables],
        clocks: vec![0; network.clocks + 1],
    };
    if !explorer.invariants_hold(&initial) {
        return None;
    }
    explorer.id(initial);
    let mut nodes = Vec::new();
    while nodes.len() < explorer.states.len() {
        if explorer.states.len() > most {
            return None;
        }
        let state = explorer.states[nodes.len()].clone();
        nodes.push(explorer.node(state));
    }
    Some(Graph {
        nodes,
        ticks: explorer.ticks,
        network: ir::Network::default(),
    })
}

impl<'n> Explorer<'n> {
    fn id(&mut self, state: State) -> usize {
        let next = self.states.len();
        let states = &mut self.states;
        *self.known.entry(state).or_insert_with_key(|state| {
            states.push(state.clone());
            next
        })
    }

    fn node(&mut self, state: State) -> Node {
        let moves = self.moves(&state);
        let is_urgent = |one: &Move<'_>| one.channel.as_deref().is_some_and(is_urgent);
        let mut possible: Vec<(&Move<'_>, State)> = Vec::new();
        for one in &moves {
            let target = self.take(&state, one);
            if self.invariants_hold(&target) {
                possible.push((one, target));
            }
        }
        let highest = possible.iter().map(|(one, _)| self.level(one)).max();
        possible.retain(|(one, _)| Some(self.level(one)) == highest);
        let mut steps = Vec::new();
        for (one, target) in possible {
            steps.push(Step {
                target: self.id(target),
                controllable: one.ways.iter().all(|way| way.edges.controllable),
                parts: one.ways.iter().map(part).collect(),
                entry: entry(one),
                label: Label::Edge(0, 0, 0),
            });
        }
        let mut next = state.clone();
        self.pass(&mut next.clocks);
        let mut stoppers = Vec::new();
        for process in 0..self.network.processes.len() {
            let stops = self.urgency(process, &state) != Urgency::Normal;
            if stops || !self.invariant_holds(process, &next) {
                stoppers.push(Stopper::Process(process as u32));
            }
        }
        // Of a synchronisation that is possible at all moments after the region there is no first.
        let is_stopped_at_once =
            self.is_moment(&state.clocks) && self.moves(&next).iter().any(is_urgent);
        if is_stopped_at_once || moves.iter().any(is_urgent) {
            stoppers.push(Stopper::Channel);
        }
        Node {
            later: stoppers.is_empty().then(|| self.id(next)),
            state,
            steps,
            stoppers,
            is_obliged: false,
        }
    }

    fn urgency(&self, process: usize, state: &State) -> Urgency {
        self.network.processes[process].locations[state.words[process] as usize].urgency
    }

    fn invariants_hold(&self, state: &State) -> bool {
        (0..self.network.processes.len()).all(|process| self.invariant_holds(process, state))
    }

    fn invariant_holds(&self, process: usize, state: &State) -> bool {
        let location = state.words[process] as usize;
        let location = &self.network.processes[process].locations[location];
        let value = |variable: usize| self.value(state, variable);
        let clock = |clock: usize| state.clocks[1 + clock % self.network.clocks];
        location
            .invariants
            .iter()
            .all(|invariant| match *invariant {
                Invariant::Upper {
                    clock: index,
                    bound,
                    strict,
                } => {
                    let bound = i64::from(bound) * self.ticks;
                    clock(index) < bound || !strict && clock(index) == bound
                }
                Invariant::UpperByVariable {
                    clock: index,
                    variable,
                    bound,
                } => clock(index) <= i64::from(value(variable) + bound) * self.ticks,
                Invariant::Conditional {
                    variable,
                    value: wanted,
                    clock: index,
                    bound,
                } => value(variable) != wanted || clock(index) <= i64::from(bound) * self.ticks,
                Invariant::Variable { variable, bound } => value(variable) <= bound,
            })
    }

    fn value(&self, state: &State, variable: usize) -> i32 {
        state.words[self.network.processes.len() + variable % self.network.variables]
    }

    /// What a process can take part in.
    fn ways(&self, process: usize, state: &State) -> Vec<Way<'n>> {
        let known = &self.network.processes[process];
        let mut ways = Vec::new();
        for (index, edge) in known.edges.iter().enumerate() {
            if edge.source % known.locations.len() != state.words[process] as usize {
                continue;
            }
            let legs: Vec<Option<&Leg>> = if edge.legs.is_empty() {
                vec![None]
            } else {
                edge.legs.iter().map(Some).collect()
            };
            for leg in legs {
                let mut guards = self.network.guards(edge, None);
                if leg.is_some() {
                    guards.extend(self.network.guards(edge, leg));
                }
                let holds = |atom: &Atom| {
                    let State { words, clocks } = state;
                    self.network.atom_holds(atom, words, clocks, self.ticks)
                };
                if !guards.iter().all(holds) {
                    continue;
                }
                for first in selected(&edge.labels) {
                    for second in leg.map_or(0..1, |leg| selected(&leg.labels)) {
                        let sync = match leg {
                            Some(leg) if leg.labels.sync != Sync::None => {
                                self.channel(&leg.labels, leg.labels.sync, second, state)
                            }
                            _ => self.channel(&edge.labels, edge.own_sync(), first, state),
                        };
                        ways.push(Way {
                            process,
                            edge: index,
                            edges: edge,
                            leg,
                            values: [first, second],
                            sync,
                        });
                    }
                }
            }
        }
        ways
    }

    fn channel(
        &self,
        labels: &Labels,
        sync: Sync,
        selected: i32,
        state: &State,
    ) -> Option<(String, bool)> {
        match sync {
            Sync::None => None,
            Sync::Channel { channel, send } => Some((CHANNELS[channel].0.to_owned(), send)),
            Sync::Indexed { variable, send } => {
                let index = if labels.select {
                    selected
                } else {
                    self.value(state, variable)
                };
                Some((format!("d[{index}]"), send))
            }
        }
    }

    /// The transitions whose guards hold, of which some leave a committed location if there is any.
    fn moves(&self, state: &State) -> Vec<Move<'n>> {
        let processes = 0..self.network.processes.len();
        let ways: Vec<Vec<Way<'_>>> = processes.clone().map(|one| self.ways(one, state)).collect();
        let mut moves = Vec::new();
        for way in ways.iter().flatten() {
            let Some((channel, send)) = &way.sync else {
                moves.push(Move {
                    ways: vec![way.clone()],
                    channel: None,
                });
                continue;
            };
            if !send {
                continue;
            }
            let receivers = |process: usize| -> Vec<&Way<'n>> {
                let ready = ways[process].iter();
                ready
                    .filter(|one| one.sync == Some((channel.clone(), false)))
                    .collect()
            };
            let others = processes.clone().filter(|&one| one != way.process);
            let mut choices = Vec::new();
            if is_broadcast(channel) {
                choices.push(vec![way.clone()]);
                for process in others {
                    let ready = receivers(process);
                    if ready.is_empty() {
                        continue;
                    }
                    choices = choices
                        .iter()
                        .flat_map(|before| ready.iter().map(move |&one| (before, one)))
                        .map(|(before, one)| {
                            let mut ways = before.clone();
                            ways.push(one.clone());
                            ways
                        })
                        .collect();
                }
            } else {
                let ready = others.flat_map(receivers);
                choices.extend(ready.map(|one| vec![way.clone(), one.clone()]));
            }
            moves.extend(choices.into_iter().map(|ways| Move {
                ways,
                channel: Some(channel.clone()),
            }));
        }
        let is_committed = |process| self.urgency(process, state) == Urgency::Committed;
        if processes.clone().any(is_committed) {
            moves.retain(|one| one.ways.iter().any(|way| is_committed(way.process)));
        }
        moves
    }

    fn take(&self, state: &State, one: &Move<'_>) -> State {
        let mut target = state.clone();
        for way in &one.ways {
            let of_edge = (&way.edges.labels, way.values[0]);
            let of_leg = way.leg.map(|leg| (&leg.labels, way.values[1]));
            for (labels, selected) in [of_edge].into_iter().chain(of_leg) {
                for update in &labels.updates {
                    let value = if labels.select { selected } else { 0 };
                    self.update(update, value, &mut target);
                }
            }
            let end = way.leg.map_or(way.edges.target, |leg| leg.target);
            let count = self.network.processes[way.process].locations.len();
            target.words[way.process] = (end % count) as i32;
        }
        self.represent(&mut target.clocks);
        target
    }

    fn update(&self, update: &Update, selected: i32, state: &mut State) {
        let clock = |clock: usize| 1 + clock % self.network.clocks;
        let word =
            |variable: usize| self.network.processes.len() + variable % self.network.variables;
        match *update {
            Update::Reset { clock: one, value } => {
                state.clocks[clock(one)] = i64::from(value) * self.ticks;
            }
            Update::ResetToVariable {
                clock: one,
                variable,
            } => {
                state.clocks[clock(one)] = i64::from(state.words[word(variable)]) * self.ticks;
            }
            Update::Copy { target, source } => {
                state.clocks[clock(target)] = state.clocks[clock(source)];
            }
            Update::Set { variable, value } => state.words[word(variable)] = value,
            Update::Increment { variable } => {
                let value = &mut state.words[word(variable)];
                *value = (*value + 1) % VALUES;
            }
            Update::Select { variable } => state.words[word(variable)] = selected,
        }
    }

    /// The level of a transition: that of its channel, then the highest of its processes.
    fn level(&self, one: &Move<'_>) -> (usize, usize) {
        let (channels, has_levels) = PRIORITIES[self.network.priority];
        let levels = channels
            .trim_start_matches("chan priority")
            .trim_end_matches(';');
        let level_of = |name: &str| {
            let mut levels = levels.split('<');
            levels.position(|level| level.split(',').any(|listed| listed.trim() == name))
        };
        let listed = one.channel.as_deref().and_then(level_of);
        let channel = listed.or(level_of("default")).unwrap_or(0);
        let processes = one.ways.iter().map(|way| way.process);
        let process = processes.max().filter(|_| has_levels);
        (channel, process.unwrap_or(0))
    }

    fn is_beyond(&self, clock: i64) -> bool {
        clock > self.constant * self.ticks
    }

    /// Whether the region is left as soon as time passes.
    fn is_moment(&self, clocks: &[i64]) -> bool {
        let mut within = clocks[1..].iter().filter(|&&clock| !self.is_beyond(clock));
        within.any(|clock| clock % self.ticks == 0)
    }

    /// Lets time pass into the next region, if there is any.
    fn pass(&self, clocks: &mut [i64]) {
        let within = clocks[1..].iter().filter(|&&clock| !self.is_beyond(clock));
        let greatest = within.map(|clock| clock % self.ticks).max();
        let Some(greatest) = greatest else {
            return;
        };
        let step = if self.is_moment(clocks) {
            1
        } else {
            self.ticks - greatest
        };
        for clock in &mut clocks[1..] {
            *clock += step;
        }
        self.represent(clocks);
    }

    /// The representative of the region of clock values.
    fn represent(&self, clocks: &mut [i64]) {
        let within = clocks[1..].iter().filter(|&&clock| !self.is_beyond(clock));
        let fractions = within.map(|clock| clock % self.ticks);
        let mut fractions: Vec<i64> = fractions.filter(|&one| one > 0).collect();
        fractions.sort_unstable();
        fractions.dedup();
        for clock in &mut clocks[1..] {
            let fraction = *clock % self.ticks;
            *clock = if self.is_beyond(*clock) {
                (self.constant + 1) * self.ticks
            } else {
                let rank = fractions.iter().position(|&one| one == fraction);
                *clock - fraction + rank.map_or(0, |rank| 2 * (rank as i64 + 1))
            };
        }
    }
}

fn selected(labels: &Labels) -> std::ops::Range<i32> {
    0..if labels.select { VALUES } else { 1 }
}

fn declaration(channel: &str) -> &'static str {
    let found = CHANNELS.iter().find(|(name, _)| *name == channel);
    found.map_or("chan", |(_, declaration)| declaration)
}

fn is_broadcast(channel: &str) -> bool {
    declaration(channel).contains("broadcast")
}

fn is_urgent(channel: &str) -> bool {
    declaration(channel).starts_with("urgent")
}

fn part(way: &Way<'_>) -> Part {
    Part {
        process: way.process as u32,
        edge: way.edge as u32,
        branch: 0,
        select: 0,
    }
}

/// What the owner of a transition chooses: the edges with their select values. Where the leg of the
/// first is chance, and the edge does not say who takes part, the leg does.
fn entry(one: &Move<'_>) -> Entry {
    let first = &one.ways[0];
    let is_chance = first.edges.legs.len() > 1 || first.leg.is_some_and(|leg| leg.labels.select);
    let is_alone = is_chance && first.edges.own_sync() == Sync::None;
    let chosen = one.ways.iter().take(if is_alone { 1 } else { usize::MAX });
    chosen
        .map(|way| (way.process as u32, way.edge as u32, way.values[0] as u32))
        .collect()
}
