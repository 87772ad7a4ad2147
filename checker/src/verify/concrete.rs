//! States with exact clock values, and their moves, from the definitions.
//!
//! Clock values are integers: numbers of *ticks*. [`Semantics::ticks_per_unit`] of them make one
//! unit of the model's time. Every rational valuation can be had by choosing it large enough.
//!
//! The definitions (the documentation's page on semantics; [`super::code`] has those about which
//! edges go together):
//! * a move is possible if the guards of all participants hold in the source state, the invariants
//!   hold after all updates, and no move of a higher priority is possible;
//! * time passes neither in urgent and committed locations nor while a synchronisation on an urgent
//!   channel is enabled.
//!
//! [`Semantics::moves`] and [`Semantics::take`] ignore priorities, [`Semantics::successors`] does
//! not.
//!
//! Cost: written to be read; every state allocates.

use crate::ir::{Edge, FixedConstraint, FunctionId, Network, Predicate, Urgency};

use super::code::{Code, Combination};
use super::moves::{Error, Move, Part, State};
use super::zone::Comparison;

/// The semantics of a network.
pub struct Semantics<'a> {
    pub(super) code: Code<'a>,
    ticks_per_unit: i64,
}

impl<'a> Semantics<'a> {
    /// The semantics of a network at this resolution of time. The code must be that of the network.
    pub fn new(network: &'a Network, ticks_per_unit: i64) -> Semantics<'a> {
        Semantics {
            code: Code::new(network),
            ticks_per_unit,
        }
    }

    /// The network.
    pub fn network(&self) -> &'a Network {
        self.code.network()
    }

    /// How many ticks make one unit of time.
    pub fn ticks_per_unit(&self) -> i64 {
        self.ticks_per_unit
    }

    /// The initial state.
    pub fn initial(&self) -> Result<State, Error> {
        let network = self.network();
        let values = network.initial_clocks.iter();
        let mut clocks: Vec<i64> = values
            .map(|&value| i64::from(value) * self.ticks_per_unit)
            .collect();
        if clocks.is_empty() {
            clocks.push(0);
        }
        let state = State {
            words: network.initial.clone(),
            clocks,
        };
        if self.invariants_hold(&state)? {
            Ok(state)
        } else {
            Err(Error::InitialInvariant)
        }
    }

    /// Whether all invariants hold.
    pub fn invariants_hold(&self, state: &State) -> Result<bool, Error> {
        for process in 0..self.network().processes.len() {
            if !self.invariant_holds(process, state)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether the invariant of one process holds.
    pub fn invariant_holds(&self, process: usize, state: &State) -> Result<bool, Error> {
        let constraints = self.code.invariant(process, &state.words)?;
        Ok(constraints.is_some_and(|constraints| self.all_hold(&constraints, &state.clocks)))
    }

    /// Whether the process is in an urgent or committed location.
    pub fn is_urgent(&self, process: usize, state: &State) -> bool {
        self.code.urgency(process, &state.words) != Urgency::Normal
    }

    /// Whether locations and urgent channels stop time. `moves` are the moves of the state.
    pub fn is_time_stopped(&self, state: &State, moves: &[Move]) -> bool {
        (0..self.network().processes.len()).any(|process| self.is_urgent(process, state))
            || moves.iter().any(|one| one.is_urgent)
    }

    /// For each clock: whether its rate is 0.
    pub fn stopped(&self, state: &State) -> Result<Vec<bool>, Error> {
        self.code.stopped(&state.words)
    }

    /// The state after this number of ticks, whether or not this time can pass.
    pub fn after(&self, state: &State, wait: i64) -> Result<State, Error> {
        let is_stopped = self.stopped(state)?;
        let mut later = state.clone();
        for (clock, is_stopped) in later.clocks.iter_mut().zip(is_stopped).skip(1) {
            if !is_stopped {
                *clock += wait;
            }
        }
        Ok(later)
    }

    /// All moves whose guards hold. It checks neither the invariants of their targets nor
    /// priorities.
    pub fn moves(&self, state: &State) -> Result<Vec<Move>, Error> {
        let found = self.combinations(state)?;
        Ok(found.into_iter().map(|one| self.to_move(one)).collect())
    }

    fn combinations(&self, state: &State) -> Result<Vec<Combination>, Error> {
        let holds = |guard: &[FixedConstraint]| self.all_hold(guard, &state.clocks);
        let mut enabled = Vec::new();
        for process in 0..self.network().processes.len() {
            let mut edges = self.code.candidates(process, &state.words, &holds)?;
            for edge in &mut edges {
                // It holds here, so nobody abstains because of it.
                edge.guard.clear();
            }
            enabled.push(edges);
        }
        // What is enabled has no guards left that could exclude each other.
        self.code.combinations(&enabled, &state.words, &|_, _| true)
    }

    fn to_move(&self, one: Combination) -> Move {
        let channels = &self.network().channels;
        let is_urgent = |channel: u32| channels[channel as usize].urgent;
        Move {
            controllable: self.code.is_controllable(&one.parts),
            channel: one.channel,
            is_urgent: one.channel.is_some_and(is_urgent),
            level: self.code.level(&one.parts, one.channel),
            parts: one.parts,
        }
    }

    /// The possible moves with the states that they lead to: those whose targets satisfy the
    /// invariants, of the highest priority among these.
    pub fn successors(&self, state: &State) -> Result<Vec<(Move, State)>, Error> {
        let mut found = Vec::new();
        for one in self.moves(state)? {
            if let Some(target) = self.take(state, &one.parts)? {
                found.push((one, target));
            }
        }
        let highest = found.iter().map(|(one, _)| one.level).max();
        found.retain(|(one, _)| Some(one.level) == highest);
        Ok(found)
    }

    /// The edge of a part.
    pub fn edge(&self, part: Part) -> &'a Edge {
        self.code.edge(part)
    }

    /// The state after a move; `None` if an invariant forbids it.
    pub fn take(&self, state: &State, parts: &[Part]) -> Result<Option<State>, Error> {
        let mut next = state.clone();
        for one in self.code.take(parts, &mut next.words)? {
            let value = i64::from(one.value) * self.ticks_per_unit;
            let value = next.clocks[one.source.0 as usize] + value;
            if value < 0 {
                return Ok(None);
            }
            next.clocks[one.target.0 as usize] = value;
        }
        Ok(self.invariants_hold(&next)?.then_some(next))
    }

    fn all_hold(&self, constraints: &[FixedConstraint], clocks: &[i64]) -> bool {
        let mut comparisons = constraints.iter().map(Comparison::from);
        comparisons.all(|one| one.holds(clocks, self.ticks_per_unit))
    }

    /// Whether a predicate of a query holds. `deadlock` is not supported.
    pub fn holds(&self, predicate: &Predicate, state: &State) -> Result<bool, Error> {
        let deadlock = || Err(Error::Unsupported("the predicate deadlock"));
        self.holds_where(predicate, state, &deadlock)
    }

    /// Whether a predicate of a query holds; `deadlock` says whether the predicate of this name
    /// does.
    pub(super) fn holds_where(
        &self,
        predicate: &Predicate,
        state: &State,
        deadlock: &dyn Fn() -> Result<bool, Error>,
    ) -> Result<bool, Error> {
        let holds = |part: &Predicate| self.holds_where(part, state, deadlock);
        match predicate {
            Predicate::Data(function) => Ok(self.value(*function, state)? != 0),
            Predicate::Constant(value) => Ok(*value),
            Predicate::Location(process, location) => {
                Ok(state.words[process.0 as usize] == location.0 as i32)
            }
            Predicate::Clock(clock) => {
                let one = self.code.comparison(clock, &state.words)?;
                Ok(one.holds(&state.clocks, self.ticks_per_unit))
            }
            Predicate::Deadlock => deadlock(),
            Predicate::Not(inner) => Ok(!holds(inner)?),
            Predicate::And(parts) => {
                for part in parts {
                    if !holds(part)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
            Predicate::Or(parts) => {
                for part in parts {
                    if holds(part)? {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
        }
    }

    /// The value of a function without parameters.
    pub fn value(&self, function: FunctionId, state: &State) -> Result<i32, Error> {
        self.code.value(function, &state.words)
    }
}
