//! A learned strategy in zones: what symbolic queries follow.
//!
//! The decisions of a discrete state are found when a search first comes there, and kept. So they
//! are a restriction of the network from the beginning of a search; at its end they are a strategy
//! in zones, which is followed, shown and checked like those that games make.
//!
//! Invariant: what random runs under the learned strategy can reach is reached under the one in
//! zones. The converse fails in three ways, all on the safe side: at a cut the actions of both
//! sides are allowed, of several best actions all are, and a move in which somebody takes part
//! whose edge is not controllable is the environment's, as in games.

mod cells;
mod deciding;
mod scene;
mod sight;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

pub use deciding::Broken;
use deciding::Deciding;
use sight::SymbolicSight;
pub use sight::{NotInZones, StochasticReading};

use super::strategy::LearnedStrategy;
use crate::game::Player;
use crate::game::strategy::closed_loop::{self, ClosedLoop, Joined};
use crate::game::strategy::{Selection, Start, Strategy, StrategyState};
use crate::ir::{ClockAtom, ClockId, FixedConstraint};
use crate::network::{Allowed, Restriction, Symbolic};
use crate::search::StateStore;

/// A learned strategy as a restriction, which grows as it is asked. Threads share it.
pub struct InZones<'a> {
    known: Mutex<Known<'a>>,
    atoms: Vec<ClockAtom>,
}

struct Known<'a> {
    deciding: Deciding<'a>,
    store: StateStore,
    /// For each state of the store.
    states: Vec<Found>,
    failure: Option<Broken>,
    /// The bytes of the decisions.
    bytes: usize,
}

/// What is known of a discrete state.
struct Found {
    state: StrategyState,
    /// `None` is everything.
    allowed: Option<Arc<Allowed>>,
}

impl<'a> InZones<'a> {
    /// A learned strategy for a network without any strategy, whose extrapolation keeps both sides
    /// of all comparisons; it stays within another strategy.
    ///
    /// # Errors
    /// Zones cannot tell what the strategy sees.
    pub fn new(
        strategy: &'a LearnedStrategy,
        reading: StochasticReading<'a>,
        symbolic: Symbolic<'a>,
        under: Option<&'a ClosedLoop>,
    ) -> Result<InZones<'a>, NotInZones> {
        let network = symbolic.stepper.network();
        let sight = SymbolicSight::new(strategy, network, reading)?;
        let mut atoms: Vec<ClockAtom> = sight.clock_cuts().flat_map(both_sides).collect();
        atoms.extend(under.into_iter().flat_map(ClosedLoop::atoms).cloned());
        atoms.sort_by_key(|one| (one.left.first, one.right.first, one.low, one.strict));
        atoms.dedup();
        Ok(InZones {
            known: Mutex::new(Known {
                deciding: Deciding::new(strategy, symbolic, sight, under),
                store: StateStore::new(network),
                states: Vec::new(),
                failure: None,
                bytes: 0,
            }),
            atoms,
        })
    }

    /// What failed when decisions were to be found.
    pub fn failure(&self) -> Option<Broken> {
        self.known().failure
    }

    /// The approximate number of bytes of what was found.
    pub fn bytes(&self) -> usize {
        let known = self.known();
        known.store.bytes() + known.bytes
    }

    /// The decisions that were found, those of the state that was asked for first at the beginning.
    pub fn into_strategy(self) -> Strategy {
        let known = self.known.into_inner();
        let known = known.unwrap_or_else(PoisonError::into_inner);
        let mut is_first = true;
        let is_listed = |one: &Found| std::mem::take(&mut is_first) || one.allowed.is_some();
        let decided = known.states.into_iter().filter(is_listed);
        Strategy {
            owner: Player::Controller,
            selection: Selection::Any,
            time_limit: None,
            under: None,
            start: Start::Initial,
            states: decided.map(|one| one.state).collect(),
        }
    }

    fn known(&self) -> MutexGuard<'_, Known<'a>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Known<'_> {
    /// What is allowed in the state with these words.
    fn allowed(&mut self, words: &[i32]) -> Result<Option<Arc<Allowed>>, Broken> {
        if let Some(id) = self.store.find(words) {
            return Ok(self.states[id.0 as usize].allowed.clone());
        }
        let state = StrategyState {
            words: words.to_vec(),
            decisions: self.deciding.decisions(words)?,
            legs: Vec::new(),
            is_goal: false,
        };
        let joined = Joined {
            words,
            is_goal: false,
            decisions: state.decisions.iter().collect(),
            legs: Vec::new(),
        };
        let allowed = (!state.decisions.is_empty()).then(|| {
            let network = self.deciding.network();
            let (owner, selection) = (Player::Controller, Selection::Any);
            Arc::new(closed_loop::allowed(network, &joined, owner, selection))
        });
        // What is allowed takes as much room as the decisions that it comes from.
        self.bytes += 2 * state.bytes();
        self.store.intern(words);
        self.states.push(Found {
            state,
            allowed: allowed.clone(),
        });
        Ok(allowed)
    }
}

impl Restriction for InZones<'_> {
    fn allowed(&self, words: &[i32]) -> Option<Arc<Allowed>> {
        let mut known = self.known();
        known.allowed(words).unwrap_or_else(|failure| {
            known.failure.get_or_insert(failure);
            None
        })
    }

    fn owns(&self, controllable: bool) -> bool {
        Player::Controller.owns(controllable)
    }

    fn atoms(&self) -> &[ClockAtom] {
        &self.atoms
    }
}

/// The comparisons of a clock with a number, in both directions.
fn both_sides((clock, bound): (usize, f64)) -> [ClockAtom; 2] {
    let (clock, zero, bound) = (ClockId(clock as u32), ClockId(0), bound as i32);
    let atom = |left, right, bound| {
        ClockAtom::from(FixedConstraint {
            left,
            right,
            bound,
            strict: false,
        })
    };
    [atom(clock, zero, bound), atom(zero, clock, -bound)]
}
