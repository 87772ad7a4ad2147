//! Which edge instances are enabled, and which of them synchronise with each other.
//!
//! Invariants:
//! * Moves are ordered by process, then edge, select values, partners, branches.
//! * If the guard of an edge does not hold, its channel is not evaluated: it may have none.

use crate::cancellation;
use crate::exec::{Context, Executor, RunTimeError};
use crate::ir::{ChannelId, FunctionId, Guard, RunTimeErrorKind};

use super::broadcast_filter::{Scope, Sending};
use super::candidate::{Candidate, Choice};
use super::edge_tables::EdgeEntry;
use super::selects::select_values;
use super::stepper::Stepper;
use super::transition::Moves;
use super::transition_cache::Record;
use crate::analysis::function_reads::read_parameters;
use crate::network::failure::Failure;

/// The number that stands for no channel.
const NO_CHANNEL: u32 = u32::MAX;

/// The work of looking at the location of a process, of asking whether a process receives, and of
/// making a move: see [`cancellation::work`].
const UNITS_FOR_PROCESS: usize = 8;
const UNITS_FOR_RECEIVER: usize = 16;
const UNITS_FOR_MOVE: usize = 256;

impl<'a> Stepper<'a> {
    /// Like [`Stepper::moves`], without a cache, and without combinations that the scope leaves
    /// out.
    pub(in crate::network) fn compute_moves(
        &mut self,
        words: &mut [i32],
        scope: Scope<'_>,
        out: &mut Moves,
    ) -> Result<(), Failure> {
        out.clear();
        self.round += 1;
        self.rank = 0;
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
            let sender = Sending {
                process: process as u32,
                needs_committed: committed && !own,
                scope,
            };
            for index in 0..sends {
                let entry = self.tables[process][location].sends[index];
                self.synchronisations(sender, entry, words, out)?;
            }
            out.check_count()?;
        }
        cancellation::work(UNITS_FOR_PROCESS * self.tables.len() + UNITS_FOR_MOVE * out.len());
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
        match self.set_of(process, entry, words) {
            Some(set) => self.add_candidates(process, entry, set, None),
            None => self.enabled_instances(process, entry, words)?,
        }
        for index in 0..self.candidates.len() {
            self.chosen.clear();
            self.chosen.push(Choice::Takes(index as u32));
            self.emit(false, out);
        }
        Ok(())
    }

    /// The moves in which a process sends by an edge.
    fn synchronisations(
        &mut self,
        sender: Sending<'_>,
        entry: EdgeEntry<'a>,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        let (executor, definition) = (self.executor, entry.edge);
        let process = sender.process;
        let Some(sync) = definition.sync else {
            return Ok(());
        };
        if let Some(set) = self.set_of(process, entry, words) {
            return self.remembered_synchronisations(sender, entry, set, words, out);
        }
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
            self.synchronisations_on(sender, channel, words, out)?;
        }
        Ok(())
    }

    /// The moves in which the candidate 0 sends on a channel.
    pub(super) fn synchronisations_on(
        &mut self,
        sender: Sending<'_>,
        channel: u32,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), Failure> {
        self.channel = Some(ChannelId(channel));
        if self.network.channels[channel as usize].broadcast {
            self.broadcast(sender, channel, words, out)
        } else {
            Ok(self.handshakes(sender, channel, words, out)?)
        }
    }

    /// Pairs the candidate 0 with every enabled receiver on a binary channel.
    fn handshakes(
        &mut self,
        sender: Sending<'_>,
        channel: u32,
        words: &mut [i32],
        out: &mut Moves,
    ) -> Result<(), RunTimeError> {
        let receivers = self.receivers.on(channel).len();
        cancellation::work(UNITS_FOR_RECEIVER * receivers);
        for index in 0..receivers {
            let receiver = self.receivers.on(channel)[index];
            if receiver == sender.process
                || (sender.needs_committed && !self.is_process_committed(receiver, words))
            {
                continue;
            }
            let first = self.candidates.len();
            self.enabled_receives(receiver, channel, words)?;
            for candidate in first..self.candidates.len() {
                self.chosen.clear();
                self.chosen
                    .extend([Choice::Takes(0), Choice::Takes(candidate as u32)]);
                self.emit(false, out);
            }
        }
        Ok(())
    }

    pub(super) fn is_process_committed(&self, process: u32, words: &[i32]) -> bool {
        self.tables[process as usize][words[process as usize] as usize].is_committed()
    }

    /// Adds every enabled receiving instance of a process on a channel to the candidates.
    pub(super) fn enabled_receives(
        &mut self,
        process: u32,
        channel: u32,
        words: &mut [i32],
    ) -> Result<(), RunTimeError> {
        let location = words[process as usize] as usize;
        for index in 0..self.tables[process as usize][location].receives.len() {
            let entry = self.tables[process as usize][location].receives[index];
            let listens = entry
                .edge
                .sync
                .is_some_and(|sync| sync.channels().contains(&channel));
            if !listens {
                continue;
            }
            if let Some(set) = self.set_of(process, entry, words) {
                self.add_candidates(process, entry, set, Some(channel));
                continue;
            }
            self.enabled_listeners(process, entry, channel, words)?;
        }
        Ok(())
    }

    /// Adds every enabled instance of a receiving edge that listens to a channel to the candidates.
    fn enabled_listeners(
        &mut self,
        process: u32,
        entry: EdgeEntry<'a>,
        channel: u32,
        words: &mut [i32],
    ) -> Result<(), RunTimeError> {
        let Some((sync, function)) = entry.edge.sync.and_then(|sync| Some((sync, sync.index?)))
        else {
            return self.enabled_instances(process, entry, words);
        };
        for select in 0..entry.instances {
            select_values(entry.edge, select, &mut self.arguments);
            let heard = match self.call(self.executor, function, words) {
                Ok(offset) => sync.channel.0 + offset as u32,
                Err(error) => self.unheard(entry, error, words)?,
            };
            if heard == channel {
                self.enabled_instance(process, entry, select, words)?;
            }
        }
        Ok(())
    }

    /// The channel of a receiving instance cannot be computed. If its guard does not hold, it
    /// receives nothing, since then the channel does not count; otherwise this is an error. The
    /// select values are in the buffer.
    fn unheard(
        &mut self,
        entry: EdgeEntry<'a>,
        error: RunTimeError,
        words: &mut [i32],
    ) -> Result<u32, RunTimeError> {
        if let Some(record) = &mut self.record {
            record.spoil();
        }
        let first = self.constraints.len();
        let is_enabled =
            error.kind == RunTimeErrorKind::Interrupted || self.guard(&entry.edge.guard, words)?;
        self.constraints.truncate(first);
        if is_enabled {
            return Err(error);
        }
        Ok(NO_CHANNEL)
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

    /// Evaluates a guard with the arguments in the buffer; its clock constraints are appended to
    /// the buffer.
    pub(super) fn guard(&mut self, guard: &Guard, words: &mut [i32]) -> Result<bool, RunTimeError> {
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
        self.constraints.extend_from_slice(&guard.fixed);
        Ok(true)
    }

    pub(super) fn call(
        &mut self,
        executor: &dyn Executor,
        function: FunctionId,
        words: &mut [i32],
    ) -> Result<i32, RunTimeError> {
        if let Some(mut record) = self.record.take() {
            let answer = self.recorded_call(function, words, &mut record);
            self.record = Some(record);
            return answer;
        }
        let mut context = Context {
            state: words,
            constraints: &mut self.constraints,
            assignments: &mut self.assignments,
        };
        executor.call(function, &self.arguments, &mut context)
    }

    /// The same while a record is made: what was asked before is not asked again. That instances of
    /// an edge differ in values that its function does not read is no reason to ask.
    fn recorded_call(
        &mut self,
        function: FunctionId,
        words: &mut [i32],
        record: &mut Record,
    ) -> Result<i32, RunTimeError> {
        let code = &self.network.functions[function.0 as usize];
        let is_read = self.read_parameters.entry(function);
        let is_read = is_read.or_insert_with(|| read_parameters(code));
        let read = self.arguments.iter().zip(is_read);
        let arguments: Vec<i32> = read
            .map(|(&value, &mut is_read)| if is_read { value } else { 0 })
            .collect();
        if let Some(answer) = record.answer(function, &arguments) {
            return Ok(answer);
        }
        let answer = self.run(function, &arguments, words)?;
        record.note(function, arguments.into(), answer);
        Ok(answer)
    }
}
