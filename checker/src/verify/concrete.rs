//! States with exact clock values, and their moves, from the definitions.
//!
//! Clock values are integers: numbers of *ticks*, of which [`Semantics::ticks_per_unit`] make one unit of the model's time.
//! Every rational valuation can be had by choosing it large enough.
//!
//! The definitions (the documentation's pages on semantics, edges and locations):
//! * a move is possible if the guards of all participants hold in the source state; one of them leaves a committed location
//!   if some process is in one; the invariants hold after all updates;
//! * a binary synchronisation takes two processes, sender and receiver; a broadcast takes the sender and, of every other process
//!   with an enabled receiving edge, exactly one such edge;
//! * updates run sender first, then receivers in the order of the processes;
//! * time passes neither in urgent and committed locations nor while a synchronisation on an urgent channel is enabled.
//!
//! Priorities are not looked at: games ignore them, and the engine refuses other queries on models that have them.
//!
//! Cost: written to be read; every state allocates.

use std::cell::RefCell;

use crate::exec::{
    Context, EmittedAssignment, EmittedConstraint, Executor, Interpreter, RunTimeError,
};
use crate::ir::{
    ClockChoice, ClockId, Edge, FunctionId, Guard, Network, Predicate, Update, Urgency,
};

/// Why a state could not be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The model's code failed.
    RunTime(RunTimeError),
    /// The initial state breaks an invariant.
    InitialInvariant,
    /// What is to be checked needs something that is not checked here; the text names it.
    Unsupported(&'static str),
}

impl From<RunTimeError> for Error {
    fn from(error: RunTimeError) -> Error {
        Error::RunTime(error)
    }
}

/// A state: words and clock values in ticks, the reference clock first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct State {
    /// The words.
    pub words: Vec<i32>,
    /// The clock values in ticks.
    pub clocks: Vec<i64>,
}

/// One process's share in a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Part {
    /// Index of the process.
    pub process: u32,
    /// Index of the edge in its process.
    pub edge: u32,
    /// Index of the branch of the edge.
    pub branch: u32,
    /// Which combination of `select` values, the last binding fastest.
    pub select: u32,
}

/// A move: the parts of its participants, the sender (or the only process) first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Move {
    /// The participants.
    pub parts: Vec<Part>,
    /// Whether the controller owns it: all participating edges are controllable.
    pub controllable: bool,
    /// Whether it synchronises on an urgent channel.
    pub is_urgent: bool,
}

/// The semantics of a network.
pub struct Semantics<'a> {
    network: &'a Network,
    interpreter: Interpreter,
    ticks_per_unit: i64,
    /// What the running call emits; kept to save allocations.
    emitted: RefCell<(Vec<EmittedConstraint>, Vec<EmittedAssignment>)>,
}

/// An edge of a process whose guard holds, with its channel.
#[derive(Clone, Copy)]
struct Enabled {
    part: Part,
    /// The channel, and whether the edge sends.
    sync: Option<(u32, bool)>,
}

impl<'a> Semantics<'a> {
    /// The semantics of a network at this resolution of time. The code must be that of the network.
    pub fn new(network: &'a Network, ticks_per_unit: i64) -> Semantics<'a> {
        Semantics {
            network,
            interpreter: Interpreter::new(&network.functions, &network.constants),
            ticks_per_unit,
            emitted: RefCell::default(),
        }
    }

    /// The network.
    pub fn network(&self) -> &'a Network {
        self.network
    }

    /// How many ticks make one unit of time.
    pub fn ticks_per_unit(&self) -> i64 {
        self.ticks_per_unit
    }

    /// The initial state.
    pub fn initial(&self) -> Result<State, Error> {
        let values = self.network.initial_clocks.iter();
        let state = State {
            words: self.network.initial.clone(),
            clocks: values
                .map(|&value| i64::from(value) * self.ticks_per_unit)
                .collect(),
        };
        if self.invariants_hold(&state)? {
            Ok(state)
        } else {
            Err(Error::InitialInvariant)
        }
    }

    /// Whether all invariants hold.
    pub fn invariants_hold(&self, state: &State) -> Result<bool, Error> {
        for process in 0..self.network.processes.len() {
            if !self.invariant_holds(process, state)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether the invariant of one process holds.
    pub fn invariant_holds(&self, process: usize, state: &State) -> Result<bool, Error> {
        let location = state.words[process] as usize;
        let invariant = &self.network.processes[process].locations[location].invariant;
        self.guard_holds(invariant, &[], state)
    }

    /// Whether the process is in an urgent or committed location.
    pub fn is_urgent(&self, process: usize, state: &State) -> bool {
        self.urgency(process, state) != Urgency::Normal
    }

    fn urgency(&self, process: usize, state: &State) -> Urgency {
        self.network.processes[process].locations[state.words[process] as usize].urgency
    }

    /// Whether locations and urgent channels stop time. `moves` are the moves of the state.
    pub fn is_time_stopped(&self, state: &State, moves: &[Move]) -> bool {
        (0..self.network.processes.len()).any(|process| self.is_urgent(process, state))
            || moves.iter().any(|one| one.is_urgent)
    }

    /// The clocks whose rate is 0.
    pub fn stopped_clocks(&self, state: &State) -> Result<Vec<ClockId>, Error> {
        let mut stopped = Vec::new();
        for (process, &location) in self.network.processes.iter().zip(&state.words) {
            for &(clock, function) in &process.locations[location as usize].rates {
                match self.value(function, state)? {
                    0 => stopped.push(clock),
                    1 => {}
                    _ => return Err(Error::Unsupported("a rate other than 0 and 1")),
                }
            }
        }
        Ok(stopped)
    }

    /// All moves whose guards hold; whether the invariants of their targets do is not looked at.
    pub fn moves(&self, state: &State) -> Result<Vec<Move>, Error> {
        let mut enabled = Vec::new();
        for process in 0..self.network.processes.len() {
            enabled.push(self.enabled_edges(process, state)?);
        }
        let mut moves = Vec::new();
        for (process, edges) in enabled.iter().enumerate() {
            for one in edges {
                match one.sync {
                    None => self.push(&[*one], &mut moves),
                    Some((channel, true)) => {
                        self.synchronise(process, *one, channel, &enabled, &mut moves);
                    }
                    Some((_, false)) => {}
                }
            }
        }
        let is_committed = |process: usize| self.urgency(process, state) == Urgency::Committed;
        if (0..enabled.len()).any(is_committed) {
            moves.retain(|one| {
                let mut parts = one.parts.iter();
                parts.any(|part| is_committed(part.process as usize))
            });
        }
        Ok(moves)
    }

    fn synchronise(
        &self,
        sender: usize,
        send: Enabled,
        channel: u32,
        enabled: &[Vec<Enabled>],
        moves: &mut Vec<Move>,
    ) {
        let receiving = |process: usize| -> Vec<Enabled> {
            let edges = enabled[process].iter();
            edges
                .filter(|one| one.sync == Some((channel, false)))
                .copied()
                .collect()
        };
        let others = (0..enabled.len()).filter(|&process| process != sender);
        if !self.network.channels[channel as usize].broadcast {
            for receive in others.flat_map(receiving) {
                self.push(&[send, receive], moves);
            }
            return;
        }
        let mut combinations = vec![vec![send]];
        for choices in others.map(receiving).filter(|choices| !choices.is_empty()) {
            combinations = combinations
                .iter()
                .flat_map(|taken| {
                    choices.iter().map(|choice| {
                        let mut taken = taken.clone();
                        taken.push(*choice);
                        taken
                    })
                })
                .collect();
        }
        for combination in combinations {
            self.push(&combination, moves);
        }
    }

    /// Adds a move for each combination of branches, the last participant's fastest.
    fn push(&self, participants: &[Enabled], moves: &mut Vec<Move>) {
        let channel = participants[0].sync.map(|(channel, _)| channel as usize);
        let mut combinations: Vec<Vec<Part>> = vec![Vec::new()];
        for one in participants {
            let branches = 0..self.edge(one.part).branches.len() as u32;
            combinations = combinations
                .iter()
                .flat_map(|parts| {
                    branches.clone().map(|branch| {
                        let mut parts = parts.clone();
                        parts.push(Part { branch, ..one.part });
                        parts
                    })
                })
                .collect();
        }
        moves.extend(combinations.into_iter().map(|parts| Move {
            controllable: parts.iter().all(|&part| self.edge(part).controllable),
            is_urgent: channel.is_some_and(|channel| self.network.channels[channel].urgent),
            parts,
        }));
    }

    /// The edge of a part.
    pub fn edge(&self, part: Part) -> &'a Edge {
        &self.network.processes[part.process as usize].edges[part.edge as usize]
    }

    fn enabled_edges(&self, process: usize, state: &State) -> Result<Vec<Enabled>, Error> {
        let mut enabled = Vec::new();
        let location = &self.network.processes[process].locations[state.words[process] as usize];
        for &edge in &location.edges {
            let definition = &self.network.processes[process].edges[edge.0 as usize];
            for (select, values) in combinations(definition).iter().enumerate() {
                if !self.guard_holds(&definition.guard, values, state)? {
                    continue;
                }
                let sync = match definition.sync {
                    None => None,
                    Some(sync) => {
                        let offset = match sync.index {
                            Some(index) => self.call(index, values, &mut state.words.clone())?,
                            None => 0,
                        };
                        Some((sync.channel.0 + offset as u32, sync.send))
                    }
                };
                let part = Part {
                    process: process as u32,
                    edge: edge.0,
                    branch: 0,
                    select: select as u32,
                };
                enabled.push(Enabled { part, sync });
            }
        }
        Ok(enabled)
    }

    /// The state after a move; `None` if an invariant forbids it.
    pub fn take(&self, state: &State, parts: &[Part]) -> Result<Option<State>, Error> {
        let mut next = state.clone();
        if let Some(update) = &self.network.before_update {
            self.update(update, &[], &mut next)?;
        }
        for &part in parts {
            let edge = self.edge(part);
            let values = &combinations(edge)[part.select as usize];
            self.update(&edge.update, values, &mut next)?;
            self.update(
                &edge.branches[part.branch as usize].update,
                values,
                &mut next,
            )?;
        }
        for &part in parts {
            let target = self.edge(part).branches[part.branch as usize].target;
            next.words[part.process as usize] = target.0 as i32;
        }
        if let Some(update) = &self.network.after_update {
            self.update(update, &[], &mut next)?;
        }
        Ok(self.invariants_hold(&next)?.then_some(next))
    }

    /// Runs an update and assigns clocks one after the other.
    fn update(&self, update: &Update, values: &[i32], state: &mut State) -> Result<(), Error> {
        if let Some(function) = update.function {
            self.call(function, values, &mut state.words)?;
            for one in &self.emitted.borrow().1 {
                let value = i64::from(one.value) * self.ticks_per_unit;
                state.clocks[one.target.0 as usize] = state.clocks[one.source.0 as usize] + value;
            }
        }
        for &(clock, value) in &update.fixed {
            state.clocks[clock.0 as usize] = i64::from(value) * self.ticks_per_unit;
        }
        Ok(())
    }

    fn guard_holds(&self, guard: &Guard, values: &[i32], state: &State) -> Result<bool, Error> {
        let fixed = guard.fixed.iter();
        let mut fixed = fixed
            .map(|one| self.constraint_holds(one.left, one.right, one.bound, one.strict, state));
        if let Some(function) = guard.function {
            let is_true = self.call(function, values, &mut state.words.clone())? != 0;
            let emitted = &self.emitted.borrow().0;
            let mut emitted = emitted.iter().map(|one| {
                self.constraint_holds(one.left, one.right, one.bound, one.strict, state)
            });
            return Ok(is_true && emitted.all(|holds| holds) && fixed.all(|holds| holds));
        }
        Ok(fixed.all(|holds| holds))
    }

    fn constraint_holds(
        &self,
        left: ClockId,
        right: ClockId,
        bound: i32,
        strict: bool,
        state: &State,
    ) -> bool {
        let difference = state.clocks[left.0 as usize] - state.clocks[right.0 as usize];
        let bound = i64::from(bound) * self.ticks_per_unit;
        difference < bound || (!strict && difference == bound)
    }

    /// Whether a predicate of a query holds. `deadlock` is not supported.
    pub fn holds(&self, predicate: &Predicate, state: &State) -> Result<bool, Error> {
        match predicate {
            Predicate::Data(function) => Ok(self.value(*function, state)? != 0),
            Predicate::Constant(value) => Ok(*value),
            Predicate::Location(process, location) => {
                Ok(state.words[process.0 as usize] == location.0 as i32)
            }
            Predicate::Clock(clock) => {
                let left = self.chosen_clock(clock.left, state)?;
                let right = self.chosen_clock(clock.right, state)?;
                let bound = self.value(clock.bound, state)?;
                Ok(self.constraint_holds(left, right, bound, clock.strict, state))
            }
            Predicate::Deadlock => Err(Error::Unsupported("the predicate deadlock")),
            Predicate::Not(inner) => Ok(!self.holds(inner, state)?),
            Predicate::And(parts) => {
                for part in parts {
                    if !self.holds(part, state)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
            Predicate::Or(parts) => {
                for part in parts {
                    if self.holds(part, state)? {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
        }
    }

    fn chosen_clock(&self, choice: ClockChoice, state: &State) -> Result<ClockId, Error> {
        match choice {
            ClockChoice::Fixed(clock) => Ok(clock),
            ClockChoice::Indexed(range, offset) => {
                Ok(ClockId(range.first.0 + self.value(offset, state)? as u32))
            }
        }
    }

    fn value(&self, function: FunctionId, state: &State) -> Result<i32, Error> {
        self.call(function, &[], &mut state.words.clone())
    }

    /// Runs a function; what it emits is left in the buffers.
    fn call(&self, function: FunctionId, values: &[i32], words: &mut [i32]) -> Result<i32, Error> {
        let (constraints, assignments) = &mut *self.emitted.borrow_mut();
        constraints.clear();
        assignments.clear();
        let mut context = Context {
            state: words,
            constraints,
            assignments,
        };
        Ok(self.interpreter.call(function, values, &mut context)?)
    }
}

/// All combinations of the select values of an edge, the last binding fastest.
fn combinations(edge: &Edge) -> Vec<Vec<i32>> {
    let mut combinations = vec![Vec::new()];
    for select in &edge.select {
        combinations = combinations
            .iter()
            .flat_map(|values: &Vec<i32>| {
                (select.low..=select.high).map(|value| {
                    let mut values = values.clone();
                    values.push(value);
                    values
                })
            })
            .collect();
    }
    combinations
}
