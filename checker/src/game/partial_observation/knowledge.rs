//! Knowledge sets: states that have the same observation.
//!
//! Invariant: the discrete states are in ascending order, and no federation is empty.

use std::collections::BTreeMap;
use std::hash::{BuildHasher, Hash, Hasher};
use std::sync::Arc;

use crate::zones::{Bound, Federation, dbm};

/// The values of the observed predicates, in the order of the query.
pub type Observation = Arc<[bool]>;

/// The states in which play may be when an observation has just begun.
#[derive(Clone, Debug)]
pub struct Knowledge {
    /// What is observed in all of them.
    pub observation: Observation,
    /// Clock values by words.
    pub states: BTreeMap<Box<[i32]>, Federation>,
}

impl Knowledge {
    /// The empty set.
    pub(super) fn empty(observation: Observation) -> Knowledge {
        Knowledge {
            observation,
            states: BTreeMap::new(),
        }
    }

    /// Adds a zone.
    pub(super) fn add(&mut self, words: &[i32], zone: &[Bound], dimension: usize) {
        if let Some(federation) = self.states.get_mut(words) {
            federation.add(zone);
        } else {
            let federation = Federation::of_zone(dimension, zone);
            self.states.insert(words.into(), federation);
        }
    }

    /// Makes the representation of each federation short.
    pub(super) fn reduce(&mut self) {
        self.states.values_mut().for_each(Federation::reduce);
    }

    /// A hash that does not depend on how federations are represented. It uses the least zone that
    /// contains each federation.
    pub(super) fn hash(&self) -> u64 {
        let mut hasher = rustc_hash::FxHasher::default();
        self.observation.hash(&mut hasher);
        for (words, zones) in &self.states {
            words.hash(&mut hasher);
            dbm::hash(&zones.convex_hull()).hash(&mut hasher);
        }
        hasher.finish()
    }

    /// Whether both are the same set.
    pub(super) fn is_same(&self, other: &Knowledge) -> bool {
        self.observation == other.observation
            && self.states.len() == other.states.len()
            && self
                .states
                .iter()
                .zip(&other.states)
                .all(|((words, zones), (others, more))| words == others && zones.is_same_set(more))
    }

    /// Whether another set with the same observation contains all states of this set.
    pub(super) fn is_subset(&self, other: &Knowledge) -> bool {
        self.states.len() <= other.states.len()
            && self.states.iter().all(|(words, zones)| {
                let others = other.states.get(words);
                others.is_some_and(|others| zones.is_subset(others))
            })
    }

    /// A set of bits: each stands for a class of discrete states. A set has all bits of its
    /// subsets.
    pub(super) fn signature(&self) -> u64 {
        self.states.keys().fold(0, |bits, words| {
            bits | 1 << (rustc_hash::FxBuildHasher.hash_one(words) >> 58)
        })
    }

    /// The number of zones.
    pub fn zone_count(&self) -> usize {
        self.states.values().map(Federation::zone_count).sum()
    }

    /// The approximate number of bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        let mut bytes = self.observation.len();
        for (words, zones) in &self.states {
            let zone = 4 * zones.dimension() * zones.dimension();
            bytes += 96 + 4 * words.len() + zone * zones.zone_count();
        }
        bytes
    }
}
