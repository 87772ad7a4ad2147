//! The code of a model on words: conditions, updates and the composition of edges into moves, from
//! the definitions.
//!
//! What code says about clocks is handed on as constraints and assignments. [`super::concrete`]
//! evaluates them on clock values, [`super::certificate`] on sets of values.
//!
//! The definitions (the documentation's pages on semantics, edges and locations):
//! * one of the participants of a move leaves a committed location if some process is in one;
//! * a binary synchronisation takes two processes, sender and receiver; a broadcast takes the
//!   sender and, of every other process with an enabled receiving edge, exactly one such edge;
//! * updates run sender first, then receivers in the order of the processes.
//!
//! Cost: written to be read; every call allocates.

use std::cell::RefCell;

use crate::cancellation;
use crate::exec::{Context, EmittedAssignment, Executor, Interpreter, RunTimeError};
use crate::ir::{
    ClockChoice, ClockId, ClockPredicate, Edge, FixedConstraint, FunctionId, Guard, Network,
    Update, Urgency,
};

use super::moves::{Error, Part};
use super::zone::Comparison;

/// The work of looking at the edges of a process: see [`cancellation::work`].
const UNITS_FOR_PROCESS: usize = 1 << 10;

/// Runs the code of a network on the interpreter.
pub(super) struct Code<'a> {
    network: &'a Network,
    interpreter: Interpreter,
    /// What the running call emits; kept to save allocations.
    emitted: RefCell<(Vec<FixedConstraint>, Vec<EmittedAssignment>)>,
}

/// An edge whose guard holds, by the words alone.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub(super) part: Part,
    /// The channel, and whether the edge sends.
    pub(super) sync: Option<(u32, bool)>,
    /// What the guard asks of the clocks.
    pub(super) guard: Vec<FixedConstraint>,
}

/// A combination of edges that are taken together.
#[derive(Clone, Debug)]
pub(super) struct Combination {
    /// The participants, the sender (or the only process) first.
    pub(super) parts: Vec<Part>,
    /// What the guards of the participants ask of the clocks.
    pub(super) guard: Vec<FixedConstraint>,
    /// The guards of receivers that do not take part: none of these conjunctions may hold.
    pub(super) excluded: Vec<Vec<FixedConstraint>>,
    /// The channel.
    pub(super) channel: Option<u32>,
}

/// Whether clocks may satisfy what participants ask while none of the conjunctions holds.
pub(super) type IsPossible<'p> = dyn Fn(&[FixedConstraint], &[Vec<FixedConstraint>]) -> bool + 'p;

/// A state with more moves is not checked: the search for it ends in an error too.
const MOST_MOVES: usize = 1 << 20;

fn few_enough(moves: usize) -> Result<(), Error> {
    if moves > MOST_MOVES {
        return Err(Error::Unsupported("states with more than 1048576 moves"));
    }
    Ok(())
}

/// What the guards of participants ask of the clocks.
fn guards(participants: &[&Candidate]) -> Vec<FixedConstraint> {
    let guards = participants.iter().flat_map(|one| &one.guard);
    guards.copied().collect()
}

impl<'a> Code<'a> {
    pub(super) fn new(network: &'a Network) -> Code<'a> {
        Code {
            network,
            interpreter: Interpreter::new(&network.functions, &network.constants)
                .with_overflow(network.overflow),
            emitted: RefCell::default(),
        }
    }

    pub(super) fn network(&self) -> &'a Network {
        self.network
    }

    /// The edge of a part.
    pub(super) fn edge(&self, part: Part) -> &'a Edge {
        self.network.edge(part)
    }

    /// Whether time may pass in the location of a process.
    pub(super) fn urgency(&self, process: usize, words: &[i32]) -> Urgency {
        self.network.processes[process].locations[words[process] as usize].urgency
    }

    /// For each clock, including the reference: whether its rate is 0.
    pub(super) fn stopped(&self, words: &[i32]) -> Result<Vec<bool>, Error> {
        let mut is_stopped = vec![false; self.network.clocks.len().max(1)];
        for (process, &location) in self.network.processes.iter().zip(words) {
            for &(clock, function) in &process.locations[location as usize].rates {
                match self.value(function, words)? {
                    0 => is_stopped[clock.0 as usize] = true,
                    1 => {}
                    _ => return Err(Error::Unsupported("a rate other than 0 and 1")),
                }
            }
        }
        Ok(is_stopped)
    }

    /// What the invariant of one process asks of the clocks; `None` if the words break it.
    pub(super) fn invariant(
        &self,
        process: usize,
        words: &[i32],
    ) -> Result<Option<Vec<FixedConstraint>>, Error> {
        let location = words[process] as usize;
        let invariant = &self.network.processes[process].locations[location].invariant;
        self.condition(invariant, &[], words)
    }

    /// What all invariants ask of the clocks; `None` if the words break one.
    pub(super) fn invariants(&self, words: &[i32]) -> Result<Option<Vec<FixedConstraint>>, Error> {
        let mut all = Vec::new();
        for process in 0..self.network.processes.len() {
            match self.invariant(process, words)? {
                None => return Ok(None),
                Some(constraints) => all.extend(constraints),
            }
        }
        Ok(Some(all))
    }

    /// What a guard asks of the clocks; `None` if the words break it.
    fn condition(
        &self,
        guard: &Guard,
        values: &[i32],
        words: &[i32],
    ) -> Result<Option<Vec<FixedConstraint>>, Error> {
        let mut constraints = guard.fixed.clone();
        if let Some(function) = guard.function {
            if self.call(function, values, &mut words.to_vec())? == 0 {
                return Ok(None);
            }
            constraints.extend_from_slice(&self.emitted.borrow().0);
        }
        Ok(Some(constraints))
    }

    /// The edges of a process whose guards hold by the words alone, and whose clock constraints are
    /// accepted.
    pub(super) fn candidates(
        &self,
        process: usize,
        words: &[i32],
        accepts: &dyn Fn(&[FixedConstraint]) -> bool,
    ) -> Result<Vec<Candidate>, Error> {
        cancellation::work(UNITS_FOR_PROCESS);
        let mut found = Vec::new();
        let definition = &self.network.processes[process];
        for &edge in &definition.locations[words[process] as usize].edges {
            let definition = &definition.edges[edge.0 as usize];
            for select in 0..select_count(definition) {
                let values = &select_values(definition, select);
                let Some(guard) = self.condition(&definition.guard, values, words)? else {
                    continue;
                };
                if !accepts(&guard) {
                    continue;
                }
                let sync = match definition.sync {
                    None => None,
                    Some(sync) => {
                        let offset = match sync.index {
                            Some(index) => self.call(index, values, &mut words.to_vec())?,
                            None => 0,
                        };
                        Some((sync.channel.0 + offset as u32, sync.send))
                    }
                };
                let part = Part {
                    process: process as u32,
                    edge: edge.0,
                    branch: 0,
                    select,
                };
                found.push(Candidate { part, sync, guard });
            }
        }
        Ok(found)
    }

    /// All combinations of candidates, given by process, that make a move. Those of a broadcast are
    /// put together receiver by receiver, and given up where `is_possible` says no.
    pub(super) fn combinations(
        &self,
        candidates: &[Vec<Candidate>],
        words: &[i32],
        is_possible: &IsPossible<'_>,
    ) -> Result<Vec<Combination>, Error> {
        let mut found = Vec::new();
        for one in candidates.iter().flatten() {
            match one.sync {
                None => self.push(&[one], &[], &mut found)?,
                Some((channel, true)) => {
                    self.synchronise(one, channel, candidates, is_possible, &mut found)?;
                }
                Some((_, false)) => {}
            }
        }
        let is_committed = |process: usize| self.urgency(process, words) == Urgency::Committed;
        if (0..candidates.len()).any(is_committed) {
            found.retain(|one| {
                let mut parts = one.parts.iter();
                parts.any(|part| is_committed(part.process as usize))
            });
        }
        Ok(found)
    }

    fn synchronise(
        &self,
        sender: &Candidate,
        channel: u32,
        candidates: &[Vec<Candidate>],
        is_possible: &IsPossible<'_>,
        found: &mut Vec<Combination>,
    ) -> Result<(), Error> {
        let receiving = |process: usize| -> Vec<&Candidate> {
            let edges = candidates[process].iter();
            edges
                .filter(|one| one.sync == Some((channel, false)))
                .collect()
        };
        let own = sender.part.process as usize;
        let others = (0..candidates.len()).filter(|&process| process != own);
        if !self.network.channels[channel as usize].broadcast {
            for receive in others.flat_map(receiving) {
                self.push(&[sender, receive], &[], found)?;
            }
            return Ok(());
        }
        let mut open = vec![(vec![sender], Vec::new())];
        for choices in others.map(receiving).filter(|choices| !choices.is_empty()) {
            let may_abstain = choices.iter().all(|choice| !choice.guard.is_empty());
            let mut next = Vec::new();
            for (taken, excluded) in open {
                for choice in &choices {
                    let mut taken = taken.clone();
                    taken.push(*choice);
                    next.push((taken, excluded.clone()));
                }
                if may_abstain {
                    let mut excluded = excluded;
                    excluded.extend(choices.iter().map(|choice| choice.guard.clone()));
                    next.push((taken, excluded));
                }
            }
            next.retain(|(taken, excluded)| is_possible(&guards(taken), excluded));
            few_enough(next.len())?;
            open = next;
        }
        for (taken, excluded) in open {
            self.push(&taken, &excluded, found)?;
        }
        Ok(())
    }

    /// Adds a combination for each choice of branches, the last participant's fastest.
    fn push(
        &self,
        participants: &[&Candidate],
        excluded: &[Vec<FixedConstraint>],
        found: &mut Vec<Combination>,
    ) -> Result<(), Error> {
        let mut choices: Vec<Vec<Part>> = vec![Vec::new()];
        for one in participants {
            let branches = 0..self.edge(one.part).branches.len() as u32;
            choices = choices
                .iter()
                .flat_map(|parts| {
                    branches.clone().map(|branch| {
                        let mut parts = parts.clone();
                        parts.push(Part { branch, ..one.part });
                        parts
                    })
                })
                .collect();
            few_enough(found.len() + choices.len())?;
        }
        let guard = guards(participants);
        found.extend(choices.into_iter().map(|parts| Combination {
            parts,
            guard: guard.clone(),
            excluded: excluded.to_vec(),
            channel: participants[0].sync.map(|(channel, _)| channel),
        }));
        Ok(())
    }

    /// Takes a move on words; what it assigns to clocks, in order.
    pub(super) fn take(
        &self,
        parts: &[Part],
        words: &mut [i32],
    ) -> Result<Vec<EmittedAssignment>, Error> {
        let mut assignments = Vec::new();
        if let Some(update) = &self.network.before_update {
            self.update(update, &[], words, &mut assignments)?;
        }
        for &part in parts {
            let edge = self.edge(part);
            let values = &select_values(edge, part.select);
            self.update(&edge.update, values, words, &mut assignments)?;
            let branch = &edge.branches[part.branch as usize];
            self.update(&branch.update, values, words, &mut assignments)?;
        }
        for &part in parts {
            let target = self.edge(part).branches[part.branch as usize].target;
            words[part.process as usize] = target.0 as i32;
        }
        if let Some(update) = &self.network.after_update {
            self.update(update, &[], words, &mut assignments)?;
        }
        Ok(assignments)
    }

    fn update(
        &self,
        update: &Update,
        values: &[i32],
        words: &mut [i32],
        assignments: &mut Vec<EmittedAssignment>,
    ) -> Result<(), Error> {
        if let Some(function) = update.function {
            self.call(function, values, words)?;
            assignments.extend_from_slice(&self.emitted.borrow().1);
        }
        for &(target, value) in &update.fixed {
            assignments.push(EmittedAssignment {
                target,
                source: ClockId(0),
                value,
            });
        }
        Ok(())
    }

    /// The level of a combination: the priority of its channel, then the greatest of its processes.
    pub(super) fn level(&self, parts: &[Part], channel: Option<u32>) -> (u32, u32) {
        let network = self.network;
        let of_channel = match channel {
            Some(channel) => network.channels[channel as usize].priority,
            None => network.features.default_priority,
        };
        let processes = parts.iter();
        let processes = processes.map(|part| network.processes[part.process as usize].priority);
        (of_channel, processes.max().unwrap_or(0))
    }

    /// Whether a move is one of the controller.
    pub(super) fn is_controllable(&self, parts: &[Part]) -> bool {
        parts.iter().all(|&part| self.edge(part).controllable)
    }

    /// The clock that the words choose.
    pub(super) fn chosen_clock(
        &self,
        choice: ClockChoice,
        words: &[i32],
    ) -> Result<ClockId, Error> {
        Ok(match choice {
            ClockChoice::Fixed(clock) => clock,
            ClockChoice::Indexed(range, offset) => {
                ClockId(range.first.0 + self.value(offset, words)? as u32)
            }
        })
    }

    /// The comparison that a predicate makes where these are the words.
    pub(super) fn comparison(
        &self,
        predicate: &ClockPredicate,
        words: &[i32],
    ) -> Result<Comparison, Error> {
        Ok(Comparison::new(
            self.chosen_clock(predicate.left, words)?.0 as usize,
            self.chosen_clock(predicate.right, words)?.0 as usize,
            self.value(predicate.bound, words)?.into(),
            predicate.strict,
        ))
    }

    /// The value of a function without parameters.
    pub(super) fn value(&self, function: FunctionId, words: &[i32]) -> Result<i32, Error> {
        self.call(function, &[], &mut words.to_vec())
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
        let result: Result<i32, RunTimeError> =
            self.interpreter.call(function, values, &mut context);
        Ok(result?)
    }
}

/// How many combinations of select values an edge has.
fn select_count(edge: &Edge) -> u32 {
    let counts = edge.select.iter();
    let counts = counts.map(|select| i64::from(select.high) - i64::from(select.low) + 1);
    counts.product::<i64>() as u32
}

/// The combination of the select values of an edge with this number.
fn select_values(edge: &Edge, number: u32) -> Vec<i32> {
    let mut rest = i64::from(number);
    let mut values: Vec<i32> = Vec::with_capacity(edge.select.len());
    for select in edge.select.iter().rev() {
        let count = i64::from(select.high) - i64::from(select.low) + 1;
        values.push((i64::from(select.low) + rest % count) as i32);
        rest /= count;
    }
    values.reverse();
    values
}
