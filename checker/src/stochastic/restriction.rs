//! A strategy of the controller, prepared for random runs: its decisions by discrete state.
//!
//! Random runs under a strategy are those of the network of which only what the strategy allows is
//! left. Where it has no decision, everything is allowed. [`super::advice`] says what that means in
//! a state with exact clock values; this file finds the decisions.
//!
//! Cost: a look-up hashes the words that both readings share, and compares them once.

use std::hash::{BuildHasher as _, Hash as _, Hasher as _};
use std::ops::Range;

use hashbrown::HashTable;
use rustc_hash::{FxBuildHasher, FxHashMap};

use super::correspondence::Correspondence;
use crate::game::Player;
use crate::game::strategy::closed_loop::{self, Joined};
use crate::game::strategy::{Decision, Selection, Strategy};
use crate::ir::Network;
use crate::network::{Part, entry_of};
use crate::zones::Bound;

/// When the controller moves where a strategy lets it choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum UnderChoice {
    /// Its processes race as without the strategy, with the moves that it allows, until it demands
    /// a move.
    #[default]
    Race,
    /// At the first moment at which the strategy allows a move.
    Eager,
    /// Only when the strategy demands a move.
    Lazy,
}

/// Why a strategy does not restrict runs of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It is one of the environment.
    Environment,
    /// The two readings of the model do not correspond.
    Readings,
}

/// An edge of a process with the values of its `select` bindings, as their number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Entry {
    pub(super) process: u32,
    pub(super) edge: u32,
    pub(super) select: u32,
}

/// `left - right < bound`, or `<=` if not strict. Clocks count from 1, 0 is the constant 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limit {
    pub(super) left: u32,
    pub(super) right: u32,
    pub(super) bound: f64,
    pub(super) strict: bool,
}

/// A decision in one of its zones.
#[derive(Clone, Debug)]
pub(super) struct Case {
    /// The index of the move; `None` to wait.
    pub(super) action: Option<u32>,
    limits: Range<u32>,
}

/// A strategy by discrete states.
#[derive(Debug)]
pub struct Restriction {
    pub(super) correspondence: Correspondence,
    /// Whether the first decision that applies counts, or each.
    pub(super) selection: Selection,
    pub(super) choice: UnderChoice,
    /// Whether the last clock of the strategy is the time of the run.
    pub(super) has_time: bool,
    table: HashTable<u32>,
    /// The words of the states, one after the other.
    keys: Vec<i32>,
    /// For each state, its cases in the order in which they apply; none where play has ended.
    states: Vec<Range<u32>>,
    cases: Vec<Case>,
    limits: Vec<Limit>,
    actions: Vec<Vec<Entry>>,
}

impl Restriction {
    /// What a strategy for a model in the symbolic reading allows in runs of the stochastic one.
    pub fn new(
        symbolic: &Network,
        stochastic: &Network,
        strategy: &Strategy,
        choice: UnderChoice,
    ) -> Result<Restriction, Unfit> {
        if strategy.owner == Player::Environment {
            return Err(Unfit::Environment);
        }
        let correspondence = Correspondence::new(symbolic, stochastic).ok_or(Unfit::Readings)?;
        let mut restriction = Restriction {
            correspondence,
            selection: strategy.selection,
            choice,
            has_time: strategy.time_limit.is_some(),
            table: HashTable::new(),
            keys: Vec::new(),
            states: Vec::new(),
            cases: Vec::new(),
            limits: Vec::new(),
            actions: Vec::new(),
        };
        let mut known = FxHashMap::default();
        for one in closed_loop::joined(symbolic, strategy) {
            restriction.add(symbolic, &one, &mut known);
        }
        Ok(restriction)
    }

    fn add(
        &mut self,
        symbolic: &Network,
        joined: &Joined<'_>,
        known: &mut FxHashMap<Vec<Entry>, u32>,
    ) {
        let first = self.cases.len() as u32;
        let decisions = joined.decisions.iter().filter(|_| !joined.is_goal);
        for decision in decisions {
            self.add_decision(symbolic, decision, known);
        }
        let state = self.states.len() as u32;
        self.states.push(first..self.cases.len() as u32);
        let words = self.correspondence.of_symbolic(joined.words);
        self.keys.extend(words.flatten());
        let (keys, count) = (&self.keys, self.correspondence.count());
        let hash_of = |state: u32| hash(self.correspondence.of_key(key(keys, count, state)));
        let add = |&other: &u32| hash_of(other);
        self.table.insert_unique(hash_of(state), state, add);
    }

    fn add_decision(
        &mut self,
        symbolic: &Network,
        decision: &Decision,
        known: &mut FxHashMap<Vec<Entry>, u32>,
    ) {
        let action = decision.action.as_ref().map(|parts| {
            let entries = entries(&entry_of(symbolic, parts));
            *known.entry(entries).or_insert_with_key(|entries| {
                self.actions.push(entries.clone());
                self.actions.len() as u32 - 1
            })
        });
        let dimension = decision.zones.dimension();
        for zone in decision.zones.zones() {
            let first = self.limits.len() as u32;
            add_limits(zone, dimension, &mut self.limits);
            let limits = first..self.limits.len() as u32;
            self.cases.push(Case { action, limits });
        }
    }

    /// The cases of the state with these words in the stochastic reading; none if the strategy
    /// decides nothing there.
    pub(super) fn cases(&self, words: &[i32]) -> &[Case] {
        let count = self.correspondence.count();
        let is_it = |&state: &u32| {
            let key = self.correspondence.of_key(key(&self.keys, count, state));
            key.eq(self.correspondence.of_stochastic(words))
        };
        let hash = hash(self.correspondence.of_stochastic(words));
        match self.table.find(hash, is_it) {
            None => &[],
            Some(&state) => {
                let Range { start, end } = self.states[state as usize];
                &self.cases[start as usize..end as usize]
            }
        }
    }

    /// The comparisons of a case.
    pub(super) fn limits(&self, case: &Case) -> &[Limit] {
        &self.limits[case.limits.start as usize..case.limits.end as usize]
    }

    /// The edges of a move.
    pub(super) fn action(&self, action: u32) -> &[Entry] {
        &self.actions[action as usize]
    }
}

/// The participants of a move, the sender first and the others by their processes.
fn entries(parts: &[Part]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = parts
        .iter()
        .map(|part| Entry {
            process: part.process,
            edge: part.edge,
            select: part.select,
        })
        .collect();
    if let [_, receivers @ ..] = &mut entries[..] {
        receivers.sort_by_key(|one| one.process);
    }
    entries
}

/// Adds the comparisons that tell the zone from the rest.
fn add_limits(zone: &[Bound], dimension: usize, limits: &mut Vec<Limit>) {
    for left in 0..dimension {
        for right in 0..dimension {
            let bound = zone[left * dimension + right];
            let is_trivial = left == 0 && bound == Bound::LE_ZERO;
            if left == right || bound.is_infinite() || is_trivial {
                continue;
            }
            // What follows from the comparisons of each with a constant is left out.
            let [first, second] = [zone[left * dimension], zone[right]];
            let is_known = first.is_finite() && second.is_finite();
            if left != 0 && right != 0 && is_known && first + second <= bound {
                continue;
            }
            limits.push(Limit {
                left: left as u32,
                right: right as u32,
                bound: f64::from(bound.value()),
                strict: bound.is_strict(),
            });
        }
    }
}

fn key(keys: &[i32], count: usize, state: u32) -> &[i32] {
    &keys[state as usize * count..][..count]
}

fn hash<'w>(runs: impl Iterator<Item = &'w [i32]>) -> u64 {
    let mut hasher = FxBuildHasher.build_hasher();
    for run in runs {
        // All words of a run at once, which is several times faster than one after the other.
        i32::hash_slice(run, &mut hasher);
    }
    hasher.finish()
}
