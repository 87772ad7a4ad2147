//! Enabled moves of a state and their effect on its words.
//!
//! Invariants:
//! * The caller passes the words of a whole state; questions about moves do not change them.
//! * Moves come in a fixed order: by sending process, then edge, select values, partners, branches.
//!   Nothing depends on hashes.
//! * Clock guards are not decided here: each move carries the constraints under which it is
//!   possible.
//!
//! Cost: proportional to the edges that leave the current locations; no allocation once the buffers
//! have grown.

use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::cancellation;
use crate::exec::{Context, EmittedAssignment, Executor, RunTimeError};
use crate::ir::{
    ChannelId, Edge, FixedConstraint, FunctionId, Network, RunTimeErrorKind, Update, Urgency,
};

use super::broadcast_filter::{BroadcastFilter, Scope};
use super::candidate::{Audience, Candidate, Choice, Group};
use super::edge_tables::LocationTable;
use super::partners::{Pair, Partners, partners};
use super::receivers::Receivers;
use super::select_cache::Instances;
use super::selects::select_values;
use super::transition::{MoveListId, MoveRef, Moves, Part};
use super::transition_cache::{Point, Record, TransitionCache, VectorId};
use crate::network::failure::Failure;
use crate::tuning::Tuning;

/// Computes moves and their effects. It holds the buffers, so each thread has its own.
pub struct Stepper<'a> {
    pub(super) network: &'a Network,
    /// The heuristics in use, here and in all code that works with these moves.
    pub(crate) tuning: Tuning,
    pub(super) executor: &'a dyn Executor,
    pub(super) tables: Vec<Vec<LocationTable<'a>>>,
    /// For each channel: the processes that may receive on it.
    pub(super) receivers: Receivers,
    /// Whether any channel is urgent.
    pub(super) has_urgent_channels: bool,
    pub(super) constraints: Vec<FixedConstraint>,
    pub(super) assignments: Vec<EmittedAssignment>,
    pub(super) arguments: Vec<i32>,
    pub(super) candidates: Vec<Candidate>,
    /// The channel of the moves that are being made.
    pub(super) channel: Option<ChannelId>,
    pub(super) chosen: Vec<Choice>,
    /// The receiving processes of the broadcast that is being made.
    pub(super) groups: Vec<Group>,
    pub(super) parts: Vec<Part>,
    /// The rank of the next move; see [`super::broadcast`].
    pub(super) rank: u64,
    pub(super) filter: BroadcastFilter,
    /// The receivers of the channel of the last broadcast, and the buffer for their constraints.
    pub(super) audience: Audience,
    pub(super) heard: Vec<FixedConstraint>,
    /// The cached enabled instances of edges.
    pub(super) instances: Instances,
    pub(super) partners: Partners,
    /// The pairs of the current sending edge.
    pub(super) pairs: Vec<Pair<'a>>,
    /// The number of the current state.
    pub(super) round: u64,
    /// The bytes of moves that the caller holds while it asks for more.
    pub(crate) moves_beside: usize,
    /// Moves that were made before.
    pub(super) transitions: TransitionCache,
    /// What is evaluated while moves are made for the cache.
    pub(super) record: Option<Record>,
    /// Which of its arguments a function reads, for those that were recorded.
    pub(super) read_parameters: FxHashMap<FunctionId, Vec<bool>>,
}

/// What the cache knows about the moves of a state.
enum Found {
    Moves(MoveListId),
    Nothing,
    /// A question failed, so the moves cannot be cached with those of the tree.
    Failure,
}

impl<'a> Stepper<'a> {
    /// A stepper for a network, running its code by `executor`.
    pub fn new(network: &'a Network, executor: &'a dyn Executor) -> Stepper<'a> {
        Stepper::tuned(network, executor, Tuning::default())
    }

    /// The same, with these heuristics only.
    pub fn tuned(network: &'a Network, executor: &'a dyn Executor, tuning: Tuning) -> Stepper<'a> {
        let tables = network.processes.iter().map(|process| {
            let locations = process.locations.iter();
            locations
                .map(|location| LocationTable::new(process, location))
                .collect()
        });
        let receivers = Receivers::new(network);
        Stepper {
            tuning,
            instances: Instances::new(network),
            partners: partners(network, &receivers),
            pairs: Vec::new(),
            network,
            executor,
            tables: tables.collect(),
            receivers,
            has_urgent_channels: network.channels.iter().any(|channel| channel.urgent),
            constraints: Vec::new(),
            assignments: Vec::new(),
            arguments: Vec::new(),
            candidates: Vec::new(),
            channel: None,
            chosen: Vec::new(),
            groups: Vec::new(),
            parts: Vec::new(),
            rank: 0,
            filter: BroadcastFilter::new(network.clocks.len().max(1)),
            audience: Audience::default(),
            heard: Vec::new(),
            round: 0,
            moves_beside: 0,
            transitions: TransitionCache::new(network.processes.len()),
            record: None,
            read_parameters: FxHashMap::default(),
        }
    }

    /// A stepper for another thread.
    #[must_use]
    pub fn another(&self) -> Stepper<'a> {
        Stepper::tuned(self.network, self.executor, self.tuning)
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

    /// Whether locations and urgent channels allow time to pass. `moves` are the moves of the
    /// state.
    ///
    /// Synchronisations on urgent channels whose guards have clocks do not count here: see
    /// [`crate::network::Symbolic::barriers`].
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

    /// The level of a move: that of its channel, then the greatest of its processes. A greater
    /// level has priority.
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
        self.network.edge(part)
    }

    /// Writes all moves of the state that the words allow into `out`.
    pub fn moves(&mut self, words: &mut [i32], out: &mut Moves) -> Result<(), Failure> {
        if let Some(vector) = self.vector(words)
            && let Some(list) = self.move_list(vector, words)?
        {
            out.copy_from(self.transitions.moves(list));
            return Ok(());
        }
        self.compute_moves(words, Scope::Everything, out)
    }

    /// The location vector of the state, if it is known; it is known after the first question.
    pub fn vector(&mut self, words: &[i32]) -> Option<VectorId> {
        if !self.tuning.transition_cache {
            return None;
        }
        self.transitions.vector(words)
    }

    /// Like [`Stepper::moves`], without combinations that the scope leaves out. It is for a search,
    /// which cannot know whether the cache pays.
    pub(in crate::network) fn moves_in(
        &mut self,
        words: &mut [i32],
        scope: Scope<'_>,
        out: &mut Moves,
    ) -> Result<(), Failure> {
        if self.tuning.transition_cache
            && self.transitions.is_worth_asking()
            && let Some(vector) = self.transitions.vector(words)
        {
            match self.known_list(vector, words)? {
                Found::Moves(list) => {
                    self.transitions.note_found();
                    out.copy_from(self.transitions.moves(list));
                    return Ok(());
                }
                Found::Nothing if self.transitions.is_suited(vector) => {
                    return self.remember(vector, words, scope, out).map(|_| ());
                }
                Found::Nothing | Found::Failure => {}
            }
        }
        self.compute_moves(words, scope, out)
    }

    /// The moves of a state with this location vector, if they depend only on locations and answers
    /// of guards, and the cache has room for them.
    pub fn move_list(
        &mut self,
        vector: VectorId,
        words: &mut [i32],
    ) -> Result<Option<MoveListId>, Failure> {
        match self.known_list(vector, words)? {
            Found::Moves(list) => Ok(Some(list)),
            Found::Nothing if self.transitions.is_suited(vector) => {
                self.remember(vector, words, Scope::Everything, &mut Moves::default())
            }
            Found::Nothing | Found::Failure => Ok(None),
        }
    }

    /// The moves of a state with this location vector, if they are in the cache.
    fn known_list(&mut self, vector: VectorId, words: &mut [i32]) -> Result<Found, Failure> {
        let mut point = self.transitions.root(vector);
        while let Some(Point::Ask(question)) = point {
            let (function, arguments) = self.transitions.asked(question);
            let mut context = Context {
                state: words,
                constraints: &mut self.constraints,
                assignments: &mut self.assignments,
            };
            match self.executor.call(function, arguments, &mut context) {
                Ok(answer) => point = self.transitions.after(question, answer),
                Err(error) if error.kind == RunTimeErrorKind::Interrupted => {
                    return Err(error.into());
                }
                // The moves are then made without the cache, which shows whether the failure
                // counts.
                Err(_) => return Ok(Found::Failure),
            }
        }
        Ok(match point {
            Some(Point::Moves(list)) => Found::Moves(list),
            _ => Found::Nothing,
        })
    }

    /// Makes the moves of a state with this location vector, and caches them if they do not depend
    /// on the scope.
    fn remember(
        &mut self,
        vector: VectorId,
        words: &mut [i32],
        scope: Scope<'_>,
        out: &mut Moves,
    ) -> Result<Option<MoveListId>, Failure> {
        self.filter.has_narrowed = false;
        self.record = Some(Record::default());
        // If this is cancelled, the record must not be taken for that of another state.
        let compute_moves = || self.compute_moves(words, scope, out);
        let result = cancellation::unless_cut(compute_moves).unwrap_or(Err(Failure::Interrupted));
        let mut record = self.record.take().unwrap_or_default();
        result?;
        if self.filter.has_narrowed {
            record.spoil();
        }
        Ok(self.transitions.remember(vector, record, out))
    }

    /// The moves of a list.
    pub fn listed(&self, list: MoveListId) -> &Moves {
        self.transitions.moves(list)
    }

    /// The approximate number of bytes of the caches.
    pub fn bytes(&self) -> usize {
        self.transitions.bytes() + self.instances.bytes()
    }

    /// Takes the move: changes locations and variables. The result has the clock assignments, in
    /// order.
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
    pub(in crate::network) fn run(
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

    /// Evaluates all invariants: `None` if the words break one, else the clock constraints that
    /// must hold.
    pub fn invariants(
        &mut self,
        words: &mut [i32],
    ) -> Result<Option<&[FixedConstraint]>, RunTimeError> {
        self.invariants_of(0..self.network.processes.len(), words)
    }

    /// Evaluates the invariant of one process: `None` if the words break it.
    pub fn invariant_of(
        &mut self,
        process: usize,
        words: &mut [i32],
    ) -> Result<Option<&[FixedConstraint]>, RunTimeError> {
        self.invariants_of(process..process + 1, words)
    }

    fn invariants_of(
        &mut self,
        processes: Range<usize>,
        words: &mut [i32],
    ) -> Result<Option<&[FixedConstraint]>, RunTimeError> {
        self.constraints.clear();
        self.arguments.clear();
        for index in processes {
            if let Some(invariant) = self.tables[index][words[index] as usize].invariant
                && !self.guard(invariant, words)?
            {
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
