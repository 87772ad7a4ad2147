//! Enabled moves of a state and their effect on its words.
//!
//! Invariants:
//! * The words handed in are those of a whole state; queries for moves do not change them.
//! * Moves come in a fixed order: by sending process, then edge, select values, partners, branches. Nothing depends on hashes.
//! * Clock guards are not decided here: each move carries the constraints under which it is possible.
//!
//! Cost: proportional to the edges that leave the current locations; no allocation once the buffers have grown.

use std::ops::Range;

use crate::exec::{Context, EmittedAssignment, EmittedConstraint, Executor, RunTimeError};
use crate::ir::{ChannelId, Edge, FunctionId, Guard, Location, Network, Process, Update, Urgency};

use super::failure::Failure;
use super::listening::Listening;
use super::moves::{MoveRef, Moves, Part};
use super::offers::{Next, OfferId, Offers, Record, VectorId};
use super::selects::{select_count, select_values};

/// An edge with what is asked of it most.
#[derive(Clone, Copy, Debug)]
struct EdgeEntry<'a> {
    index: u32,
    /// How many combinations of select values it has.
    instances: u32,
    edge: &'a Edge,
}

/// The edges that leave a location, sorted by what they wait for.
#[derive(Debug)]
struct LocationTable<'a> {
    internal: Vec<EdgeEntry<'a>>,
    sends: Vec<EdgeEntry<'a>>,
    receives: Vec<EdgeEntry<'a>>,
    urgency: Urgency,
}

impl<'a> LocationTable<'a> {
    fn new(process: &'a Process, location: &Location) -> LocationTable<'a> {
        let urgency = location.urgency;
        let (internal, sends, receives) = (Vec::new(), Vec::new(), Vec::new());
        let mut table = LocationTable {
            internal,
            sends,
            receives,
            urgency,
        };
        for index in &location.edges {
            let edge = &process.edges[index.0 as usize];
            let entry = EdgeEntry {
                index: index.0,
                instances: select_count(edge),
                edge,
            };
            match edge.sync {
                None => table.internal.push(entry),
                Some(sync) if sync.send => table.sends.push(entry),
                Some(_) => table.receives.push(entry),
            }
        }
        table
    }

    fn is_committed(&self) -> bool {
        self.urgency == Urgency::Committed
    }
}

/// One enabled edge instance: a process, an edge, its select values and its clock constraints.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    process: u32,
    edge: u32,
    select: u32,
    is_controllable: bool,
    constraints: (u32, u32),
}

/// Computes moves and their effects. Holds the buffers, so one per thread.
pub struct Stepper<'a> {
    network: &'a Network,
    executor: &'a dyn Executor,
    tables: Vec<Vec<LocationTable<'a>>>,
    /// By channel: the processes that may receive on it.
    receivers: Vec<Vec<u32>>,
    /// Whether any channel is urgent.
    has_urgent_channels: bool,
    constraints: Vec<EmittedConstraint>,
    assignments: Vec<EmittedAssignment>,
    arguments: Vec<i32>,
    candidates: Vec<Candidate>,
    /// The channel of the moves that are being put together.
    channel: Option<ChannelId>,
    chosen: Vec<Choice>,
    /// The receiving processes of the broadcast that is being put together.
    groups: Vec<Group>,
    parts: Vec<Part>,
    /// By process: the channels of its receiving instances in the state at hand, whose number is `round`.
    listening: Vec<Listening>,
    round: u64,
    /// The channels of the instances of one edge.
    channels: Vec<u32>,
    /// Moves that were put together before.
    offers: Offers,
    /// What is evaluated while moves are put together to be remembered.
    record: Option<Record>,
}

/// A receiving process of a broadcast: its candidates, and what it does in the combination at hand.
#[derive(Clone, Copy, Debug)]
struct Group {
    first: usize,
    last: usize,
    /// One past the last pick.
    end: usize,
    /// A candidate, or `last` for abstaining.
    pick: usize,
}

/// What a process does in a broadcast that is being put together.
#[derive(Clone, Copy, Debug)]
enum Choice {
    /// It takes part by this candidate.
    Takes(u32),
    /// It abstains: none of these clock-guarded candidates holds.
    Abstains(u32, u32),
}

impl<'a> Stepper<'a> {
    /// A stepper for a network, running its code by `executor`.
    pub fn new(network: &'a Network, executor: &'a dyn Executor) -> Stepper<'a> {
        let tables = network.processes.iter().map(|process| {
            let locations = process.locations.iter();
            locations
                .map(|location| LocationTable::new(process, location))
                .collect()
        });
        Stepper {
            network,
            executor,
            tables: tables.collect(),
            receivers: receivers(network),
            has_urgent_channels: network.channels.iter().any(|channel| channel.urgent),
            constraints: Vec::new(),
            assignments: Vec::new(),
            arguments: Vec::new(),
            candidates: Vec::new(),
            channel: None,
            chosen: Vec::new(),
            groups: Vec::new(),
            parts: Vec::new(),
            listening: network
                .processes
                .iter()
                .map(|_| Listening::default())
                .collect(),
            round: 0,
            channels: Vec::new(),
            offers: Offers::new(network.processes.len()),
            record: None,
        }
    }

    /// The network.
    pub fn network(&self) -> &'a Network {
        self.network
    }

    /// Whether some process is in a committed location.
    pub fn is_committed(&self, words: &[i32]) -> bool {
        self.tables
            .iter()
            .zip(words)
            .any(|(tables, &location)| tables[location as usize].is_committed())
    }

    /// Whether some process is in an urgent or committed location.
    pub fn is_urgent(&self, words: &[i32]) -> bool {
        self.tables
            .iter()
            .zip(words)
            .any(|(tables, &location)| tables[location as usize].urgency != Urgency::Normal)
    }

    /// Whether time may pass as far as locations and urgent channels say. `moves` are the moves of the state.
    ///
    /// Synchronisations on urgent channels whose guards have clocks do not count here: see [`super::Symbolic::barriers`].
    pub fn may_delay(&self, words: &[i32], moves: &Moves) -> bool {
        if self.is_urgent(words) {
            return false;
        }
        !self.has_urgent_channels
            || !moves
                .iter()
                .any(|one| one.is_unconditional() && self.is_urgent_move(one))
    }

    /// Whether the move synchronises on an urgent channel.
    pub fn is_urgent_move(&self, one: MoveRef<'_>) -> bool {
        one.channel
            .is_some_and(|channel| self.network.channels[channel.0 as usize].urgent)
    }

    /// The level of a move: that of its channel, then the greatest of its processes; greater is more urgent.
    pub fn level(&self, one: MoveRef<'_>) -> (u32, u32) {
        let default = self.network.features.default_priority;
        let priority = |channel: ChannelId| self.network.channels[channel.0 as usize].priority;
        let channel = one.channel.map_or(default, priority);
        let processes = one.parts.iter();
        let levels = processes.map(|part| self.network.processes[part.process as usize].priority);
        (channel, levels.max().unwrap_or(0))
    }

    /// The edge of a part.
    pub fn edge(&self, part: Part) -> &'a Edge {
        &self.network.processes[part.process as usize].edges[part.edge as usize]
    }

    /// All moves of the state, as far as the words decide, into `out`.
    pub fn moves(&mut self, words: &mut [i32], out: &mut Moves) -> Result<(), Failure> {
        if let Some(vector) = self.offers.vector(words)
            && let Some(offer) = self.offer(vector, words)?
        {
            out.copy_from(self.offers.moves(offer));
            return Ok(());
        }
        self.put_together(words, out)
    }

    /// The location vector of the state, if it is known; it is after the first time that it was asked for.
    pub fn vector(&mut self, words: &[i32]) -> Option<VectorId> {
        self.offers.vector(words)
    }

    /// The moves of a state with this location vector, if they depend on locations and answers of guards alone and there is place
    /// to remember them.
    pub fn offer(
        &mut self,
        vector: VectorId,
        words: &mut [i32],
    ) -> Result<Option<OfferId>, Failure> {
        let Some(mut way) = self.offers.start(vector) else {
            return Ok(None);
        };
        loop {
            match self.offers.next(way) {
                Next::Offer(offer) => return Ok(Some(offer)),
                Next::Ask(function, arguments) => {
                    let mut context = Context {
                        state: words,
                        constraints: &mut self.constraints,
                        assignments: &mut self.assignments,
                    };
                    let answer = self.executor.call(function, arguments, &mut context)?;
                    self.offers.answer(&mut way, answer);
                }
                Next::Unknown => break,
            }
        }
        let mut moves = Moves::default();
        self.record = Some(Record::default());
        let result = self.put_together(words, &mut moves);
        let record = self.record.take().unwrap_or_default();
        result?;
        Ok(self.offers.remember(vector, record, &moves))
    }

    /// The moves of an offer.
    pub fn offered(&self, offer: OfferId) -> &Moves {
        self.offers.moves(offer)
    }

    /// The bytes that remembered moves take, about.
    pub fn bytes(&self) -> usize {
        self.offers.bytes()
    }

    /// As [`Stepper::moves`], without remembering.
    pub(super) fn put_together(
        &mut self,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        out.clear();
        self.round += 1;
        let committed = self.is_committed(words);
        for process in 0..self.tables.len() {
            let location = words[process] as usize;
            let table = &self.tables[process][location];
            let own = table.is_committed();
            let (internal, sends) = (table.internal.len(), table.sends.len());
            if own || !committed {
                for index in 0..internal {
                    let entry = self.tables[process][location].internal[index];
                    self.internal_moves(process as u32, entry, words, out)?;
                }
            }
            for index in 0..sends {
                let entry = self.tables[process][location].sends[index];
                self.synchronisations(process as u32, entry, committed && !own, words, out)?;
            }
            check_count(out)?;
        }
        Ok(())
    }

    fn internal_moves(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        self.candidates.clear();
        self.constraints.clear();
        self.channel = None;
        self.enabled_instances(process, entry, words)?;
        for index in 0..self.candidates.len() {
            self.chosen.clear();
            self.chosen.push(Choice::Takes(index as u32));
            self.emit(out);
        }
        Ok(())
    }

    /// The moves in which `edge` of `process` sends. `needs_committed`: another process must leave a committed location.
    fn synchronisations(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        needs_committed: bool,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let (network, executor, definition) = (self.network, self.executor, entry.edge);
        let Some(sync) = definition.sync else {
            return Ok(());
        };
        for select in 0..entry.instances {
            self.candidates.clear();
            self.constraints.clear();
            if !self.enabled_instance(process, entry, select, words)? {
                continue;
            }
            let offset = match sync.index {
                Some(function) => {
                    select_values(definition, select, &mut self.arguments);
                    self.call(executor, function, words)? as u32
                }
                None => 0,
            };
            let channel = sync.channel.0 + offset;
            self.channel = Some(ChannelId(channel));
            if network.channels[channel as usize].broadcast {
                self.broadcast(process, channel, needs_committed, words, out)?;
            } else {
                self.handshakes(process, channel, needs_committed, words, out)?;
            }
        }
        Ok(())
    }

    /// Pairs the candidate 0 with every enabled receiver on a binary channel.
    fn handshakes(
        &mut self,
        sender: u32,
        channel: u32,
        needs_committed: bool,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), RunTimeError> {
        for index in 0..self.receivers[channel as usize].len() {
            let receiver = self.receivers[channel as usize][index];
            if receiver == sender
                || (needs_committed && !self.is_process_committed(receiver, words))
            {
                continue;
            }
            let first = self.candidates.len();
            self.enabled_receives(receiver, channel, words)?;
            for candidate in first..self.candidates.len() {
                self.chosen.clear();
                self.chosen
                    .extend([Choice::Takes(0), Choice::Takes(candidate as u32)]);
                self.emit(out);
            }
        }
        Ok(())
    }

    /// Joins the candidate 0 with one enabled receiving edge of every process that has one.
    fn broadcast(
        &mut self,
        sender: u32,
        channel: u32,
        needs_committed: bool,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let mut groups = std::mem::take(&mut self.groups);
        groups.clear();
        let mut has_committed = !needs_committed;
        for index in 0..self.receivers[channel as usize].len() {
            let receiver = self.receivers[channel as usize][index];
            if receiver == sender {
                continue;
            }
            let first = self.candidates.len();
            self.enabled_receives(receiver, channel, words)?;
            if self.candidates.len() > first {
                has_committed |= self.is_process_committed(receiver, words);
                groups.push(self.group(first));
            }
        }
        if has_committed {
            self.chosen.clear();
            self.chosen.push(Choice::Takes(0));
            self.combine(&mut groups, needs_committed, words, out)?;
        }
        self.groups = groups;
        Ok(())
    }

    /// Emits every combination of the receivers' alternatives with the sender, which was chosen; the last receiver's change
    /// fastest.
    fn combine(
        &mut self,
        groups: &mut [Group],
        needs_committed: bool,
        words: &[i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        loop {
            self.chosen.truncate(1);
            self.chosen.extend(groups.iter().map(|group| {
                if group.pick < group.last {
                    Choice::Takes(group.pick as u32)
                } else {
                    Choice::Abstains(group.first as u32, group.last as u32)
                }
            }));
            if !needs_committed || self.has_committed_choice(words) {
                self.emit(out);
                check_count(out)?;
            }
            let next = groups.iter().rposition(|group| group.pick + 1 < group.end);
            let Some(next) = next else {
                return Ok(());
            };
            groups[next].pick += 1;
            for group in &mut groups[next + 1..] {
                group.pick = group.first;
            }
        }
    }

    /// The candidates from `first` on, all of one receiving process.
    fn group(&self, first: usize) -> Group {
        let last = self.candidates.len();
        // A receiver whose edges all have clock guards may have none that is open: abstaining comes after its candidates.
        let guarded = |candidate: &Candidate| candidate.constraints.0 < candidate.constraints.1;
        let may_abstain = self.candidates[first..last].iter().all(guarded);
        Group {
            first,
            last,
            end: last + usize::from(may_abstain),
            pick: first,
        }
    }

    fn has_committed_choice(&self, words: &[i32]) -> bool {
        self.chosen.iter().any(|choice| match *choice {
            Choice::Takes(index) => {
                self.is_process_committed(self.candidates[index as usize].process, words)
            }
            Choice::Abstains(..) => false,
        })
    }

    fn is_process_committed(&self, process: u32, words: &[i32]) -> bool {
        self.tables[process as usize][words[process as usize] as usize].is_committed()
    }

    /// Adds every enabled receiving instance of a process on a channel to the candidates.
    fn enabled_receives(
        &mut self,
        process: u32,
        channel: u32,
        words: &mut [i32],
    ) -> Result<(), RunTimeError> {
        let location = words[process as usize] as usize;
        for index in 0..self.tables[process as usize][location].receives.len() {
            let entry = self.tables[process as usize][location].receives[index];
            let listens = entry.edge.sync.is_some_and(|sync| {
                (sync.channel.0..sync.channel.0 + sync.count).contains(&channel)
            });
            if !listens {
                continue;
            }
            if !self.hears(process, index, words)? {
                self.enabled_instances(process, entry, words)?;
                continue;
            }
            for place in self.listening[process as usize].listeners(index, channel) {
                let select = self.listening[process as usize].instance(place);
                self.enabled_instance(process, entry, select, words)?;
            }
        }
        Ok(())
    }

    /// Makes sure that the channels of the instances of a receiving edge, the one with this index in its location, are known;
    /// returns false if all have the same channel.
    fn hears(
        &mut self,
        process: u32,
        index: usize,
        words: &mut [i32],
    ) -> Result<bool, RunTimeError> {
        let receives = &self.tables[process as usize][words[process as usize] as usize].receives;
        let entry = receives[index];
        let Some((sync, function)) = entry.edge.sync.and_then(|sync| Some((sync, sync.index?)))
        else {
            return Ok(false);
        };
        let listening = &mut self.listening[process as usize];
        listening.turn_to(self.round, receives.len());
        if listening.knows(index) {
            return Ok(true);
        }
        let mut channels = std::mem::take(&mut self.channels);
        channels.clear();
        for select in 0..entry.instances {
            select_values(entry.edge, select, &mut self.arguments);
            let offset = self.call(self.executor, function, words)?;
            channels.push(sync.channel.0 + offset as u32);
        }
        self.listening[process as usize].learn(index, &channels);
        self.channels = channels;
        Ok(true)
    }

    /// Adds every enabled instance of an edge to the candidates.
    fn enabled_instances(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        words: &mut [i32],
    ) -> Result<(), RunTimeError> {
        for select in 0..entry.instances {
            self.enabled_instance(process, entry, select, words)?;
        }
        Ok(())
    }

    /// Adds one instance to the candidates if the words allow it.
    fn enabled_instance(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        select: u32,
        words: &mut [i32],
    ) -> Result<bool, RunTimeError> {
        let guard = &entry.edge.guard;
        let first = self.constraints.len() as u32;
        if guard.function.is_some() {
            select_values(entry.edge, select, &mut self.arguments);
        }
        if !guard.is_trivial() && !self.guard(guard, words)? {
            return Ok(false);
        }
        let constraints = (first, self.constraints.len() as u32);
        self.candidates.push(Candidate {
            process,
            edge: entry.index,
            select,
            is_controllable: entry.edge.controllable,
            constraints,
        });
        Ok(true)
    }

    /// Evaluates a guard with the arguments in the buffer; its clock constraints are appended to the buffer.
    fn guard(&mut self, guard: &Guard, words: &mut [i32]) -> Result<bool, RunTimeError> {
        let first = self.constraints.len();
        if guard.emits
            && let Some(record) = &mut self.record
        {
            record.spoil();
        }
        if let Some(function) = guard.function
            && self.call(self.executor, function, words)? == 0
        {
            self.constraints.truncate(first);
            return Ok(false);
        }
        self.constraints.extend(
            guard
                .fixed
                .iter()
                .map(|&fixed| EmittedConstraint::from(fixed)),
        );
        Ok(true)
    }

    fn call(
        &mut self,
        executor: &dyn Executor,
        function: FunctionId,
        words: &mut [i32],
    ) -> Result<i32, RunTimeError> {
        if let Some(record) = &self.record
            && let Some(answer) = record.answer(function, &self.arguments)
        {
            return Ok(answer);
        }
        let mut context = Context {
            state: words,
            constraints: &mut self.constraints,
            assignments: &mut self.assignments,
        };
        let answer = executor.call(function, &self.arguments, &mut context)?;
        if let Some(record) = &mut self.record {
            record.note(function, &self.arguments, answer);
        }
        Ok(answer)
    }

    /// Emits the chosen combination, once for each combination of branches.
    fn emit(&mut self, out: &mut Moves) {
        let network = self.network;
        self.parts.clear();
        let mut controllable = true;
        for choice in &self.chosen {
            if let Choice::Takes(index) = *choice {
                let Candidate {
                    process,
                    edge,
                    select,
                    is_controllable,
                    ..
                } = self.candidates[index as usize];
                controllable &= is_controllable;
                self.parts.push(Part {
                    process,
                    edge,
                    branch: 0,
                    select,
                });
            }
        }
        loop {
            let taken = self.chosen.iter().filter_map(|choice| match *choice {
                Choice::Takes(index) => Some(self.constraints_of(index)),
                Choice::Abstains(..) => None,
            });
            let excluded = self.chosen.iter().flat_map(|choice| match *choice {
                Choice::Takes(_) => 0..0,
                Choice::Abstains(first, last) => first..last,
            });
            out.push(
                &self.parts,
                taken,
                excluded.map(|index| self.constraints_of(index)),
                self.channel,
                controllable,
            );
            if !next_branches(network, &mut self.parts) {
                return;
            }
        }
    }

    fn constraints_of(&self, candidate: u32) -> &[EmittedConstraint] {
        let (first, last) = self.candidates[candidate as usize].constraints;
        &self.constraints[first as usize..last as usize]
    }

    /// Takes the move: changes locations and variables. The clock assignments, in order, are in the result.
    pub fn fire(
        &mut self,
        parts: &[Part],
        words: &mut [i32],
    ) -> Result<&[EmittedAssignment], RunTimeError> {
        let network = self.network;
        self.assignments.clear();
        self.arguments.clear();
        if let Some(update) = &network.before_update {
            self.update(update, words)?;
        }
        for &part in parts {
            let edge = self.edge(part);
            let branch = &edge.branches[part.branch as usize];
            if edge.update.function.is_some() || branch.update.function.is_some() {
                select_values(edge, part.select, &mut self.arguments);
            }
            self.update(&edge.update, words)?;
            self.update(&branch.update, words)?;
        }
        for &part in parts {
            let branch = &self.edge(part).branches[part.branch as usize];
            words[part.process as usize] = branch.target.0 as i32;
        }
        if let Some(update) = &network.after_update {
            self.arguments.clear();
            self.update(update, words)?;
        }
        Ok(&self.assignments)
    }

    fn update(&mut self, update: &Update, words: &mut [i32]) -> Result<(), RunTimeError> {
        if let Some(function) = update.function {
            self.call(self.executor, function, words)?;
        }
        let fixed = update.fixed.iter();
        self.assignments
            .extend(fixed.map(|&(target, value)| EmittedAssignment {
                target,
                source: crate::ir::ClockId(0),
                value,
            }));
        Ok(())
    }

    /// Runs a function on the state.
    pub(super) fn run(
        &mut self,
        function: FunctionId,
        arguments: &[i32],
        words: &mut [i32],
    ) -> Result<i32, RunTimeError> {
        let mut context = Context {
            state: words,
            constraints: &mut self.constraints,
            assignments: &mut self.assignments,
        };
        self.executor.call(function, arguments, &mut context)
    }

    /// Evaluates all invariants: `None` if the words break one, else the clock constraints that must hold.
    pub fn invariants(
        &mut self,
        words: &mut [i32],
    ) -> Result<Option<&[EmittedConstraint]>, RunTimeError> {
        self.invariants_of(0..self.network.processes.len(), words)
    }

    /// Evaluates the invariant of one process: `None` if the words break it.
    pub fn invariant_of(
        &mut self,
        process: usize,
        words: &mut [i32],
    ) -> Result<Option<&[EmittedConstraint]>, RunTimeError> {
        self.invariants_of(process..process + 1, words)
    }

    fn invariants_of(
        &mut self,
        processes: Range<usize>,
        words: &mut [i32],
    ) -> Result<Option<&[EmittedConstraint]>, RunTimeError> {
        let network = self.network;
        self.constraints.clear();
        self.arguments.clear();
        for index in processes {
            let location = words[index] as usize;
            let invariant = &network.processes[index].locations[location].invariant;
            if !invariant.is_trivial() && !self.guard(invariant, words)? {
                return Ok(None);
            }
        }
        Ok(Some(&self.constraints))
    }

    /// Runs a function of a query on the state.
    pub fn evaluate(
        &mut self,
        function: FunctionId,
        words: &mut [i32],
    ) -> Result<i32, RunTimeError> {
        self.arguments.clear();
        self.call(self.executor, function, words)
    }
}

/// By channel: the processes with an edge that may receive on it, ascending.
fn receivers(network: &Network) -> Vec<Vec<u32>> {
    let mut receivers = vec![Vec::new(); network.channels.len()];
    for (index, process) in network.processes.iter().enumerate() {
        for sync in process
            .edges
            .iter()
            .filter_map(|edge| edge.sync)
            .filter(|sync| !sync.send)
        {
            for channel in sync.channel.0..sync.channel.0 + sync.count {
                let list: &mut Vec<u32> = &mut receivers[channel as usize];
                if list.last() != Some(&(index as u32)) {
                    list.push(index as u32);
                }
            }
        }
    }
    receivers
}

/// The most moves of a state: receivers of a broadcast that have a choice each multiply.
const MOST_MOVES: usize = 1 << 20;

fn check_count(moves: &Moves) -> Result<(), Failure> {
    if moves.len() > MOST_MOVES {
        return Err(Failure::Moves(MOST_MOVES));
    }
    Ok(())
}

/// Goes to the next combination of branches, the last part fastest; false after the last one.
fn next_branches(network: &Network, parts: &mut [Part]) -> bool {
    for part in parts.iter_mut().rev() {
        let edge = &network.processes[part.process as usize].edges[part.edge as usize];
        if part.branch as usize + 1 < edge.branches.len() {
            part.branch += 1;
            return true;
        }
        part.branch = 0;
    }
    false
}
