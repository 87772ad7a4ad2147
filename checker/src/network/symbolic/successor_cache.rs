//! What moves make of zones, remembered.
//!
//! The zone that a move leads to is a function of the zone that it starts from and of the move's
//! *effect*: guard, assignments, the invariants behind it, whether time may pass there, and what
//! clocks are compared with from there on. Models whose states have few zones meet the same pair of
//! them again and again. So zones and effects get numbers, and for each pair that was met stands
//! the zone on entry with time passed, and what is kept of it in a store.
//!
//! Invariants:
//! * Zones are compared bound by bound and effects word by word, so that what is found is what
//!   would be computed.
//! * Guards, updates and invariants are evaluated as without it, in the same order; only operations
//!   on zones are spared.
//! * Memory is bounded by [`MemoLimits`]: beyond it everything is forgotten. What was handed out
//!   before has another age then, and is not looked up any more.
//!
//! Cost: a look-up takes two hashes, of the effect and of the pair. Where fewer than half of the
//! pairs are found it does not pay, and is given up for a while. Pairs are weighed, and
//! all the time: there are no trials of states, because one state may have many pairs.

use hashbrown::HashTable;
use rustc_hash::FxHashMap;

use crate::ir::Network;
use crate::zones::Bound;
use crate::zones::zone_table::{ZoneId, ZoneTable};

use super::packed_effects::{PackedEffects, fold};
use crate::network::trial::Pause;
use crate::network::{FixedMove, MoveListId};

/// How much is remembered, and for how long though it does not pay.
#[derive(Clone, Copy, Debug)]
pub struct MemoLimits {
    /// When the cache takes about this many bytes, everything is forgotten.
    pub bytes: usize,
    /// So many more pairs may be missed than found before it is given up.
    pub misses: u32,
    /// When the cache was given up, this many states do not use it; each further time four times as
    /// many.
    pub pause: u32,
}

impl Default for MemoLimits {
    /// Those that are fast.
    fn default() -> MemoLimits {
        MemoLimits {
            bytes: 4 << 20,
            misses: 1 << 12,
            pause: 1 << 16,
        }
    }
}

/// Where not as many zones fit nothing is remembered: a state and its successors would not be there
/// together.
const FEWEST_ZONES: usize = 16;
/// The greatest number of states that do not use the cache.
const LONGEST_PAUSE: u32 = 1 << 22;
/// After this many pairs, earlier hits and misses count half.
const LONG_AGO: u32 = 1 << 17;
/// What a listed move takes, about.
const FIXED_BYTES: usize = 256;

/// A zone that moves from it may be looked up by.
#[derive(Clone, Copy, Debug)]
pub struct KnownZone {
    pub(super) zone: ZoneId,
    /// How often everything had been forgotten when it was known.
    pub(super) age: u32,
}

/// What is kept of a zone in a store: see [`Symbolic::kept`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptZone {
    /// Its number among all that are kept at this age.
    pub zone: ZoneId,
    /// How often everything had been forgotten before.
    pub age: u32,
}

/// A move whose effect does not depend on variables.
#[derive(Debug)]
pub(super) struct FixedEffect {
    pub(super) one: FixedMove,
    pub(super) effect: u32,
}

/// No zone.
pub(super) const NOTHING: ZoneId = ZoneId(u32::MAX);

/// What an effect makes of a zone.
#[derive(Clone, Copy, Debug)]
pub(super) struct ZoneOutcome {
    pub(super) zone: ZoneId,
    pub(super) effect: u32,
    /// The zone on entry with time passed; [`NOTHING`] if nothing is left.
    pub(super) entered: ZoneId,
    /// What is kept of it.
    pub(super) kept: ZoneId,
}

/// All that is remembered.
#[derive(Debug)]
pub(super) struct ZoneMemo {
    pub(super) dimension: usize,
    /// Whether all that moves do to zones can be said by effects.
    pub(super) is_possible: bool,
    /// Whether zones are asked for as they are entered; else what is kept of them may stand in
    /// their place.
    pub(super) needs_entered: bool,
    pub(super) limits: MemoLimits,
    pub(super) zones: ZoneTable,
    /// Reduced forms, each with the limits of its ceilings behind it, where these are kept.
    pub(super) reduced: ZoneTable,
    pub(super) effects: PackedEffects,
    pub(super) outcomes: HashTable<ZoneOutcome>,
    /// Listed moves that were taken; `None` where the effect may depend on variables.
    pub(super) fixed: FxHashMap<(MoveListId, u32), Option<FixedEffect>>,
    pub(super) balance: Balance,
    pause: Pause,
    pub(super) age: u32,
    /// A reduced form with its limits.
    pub(super) scratch: Vec<Bound>,
}

impl ZoneMemo {
    /// Nothing, about the zones of a network.
    pub(super) fn new(network: &Network) -> ZoneMemo {
        let features = &network.features;
        let dimension = network.clocks.len().max(1);
        let is_possible = dimension > 1 && !features.stopwatches && !features.clock_copies;
        let limits = MemoLimits::default();
        ZoneMemo {
            dimension,
            is_possible: is_possible
                && FEWEST_ZONES * dimension * dimension * size_of::<Bound>() <= limits.bytes,
            needs_entered: true,
            limits,
            zones: ZoneTable::new(dimension),
            reduced: ZoneTable::of_size(dimension * dimension + dimension),
            effects: PackedEffects::default(),
            outcomes: HashTable::new(),
            fixed: FxHashMap::default(),
            balance: Balance::default(),
            pause: Pause::default(),
            age: 0,
            scratch: Vec::new(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.zones.bytes()
            + self.reduced.bytes()
            + self.effects.bytes()
            + self.outcomes.capacity() * (size_of::<ZoneOutcome>() + 1) * 8 / 7
            + self.fixed.capacity() * FIXED_BYTES
    }

    /// The bytes that are in use, about.
    pub(super) fn used_bytes(&self) -> usize {
        let zones = self.zones.len() * self.dimension;
        let reduced = self.reduced.len() * (self.dimension + 1);
        (zones + reduced) * self.dimension * size_of::<Bound>()
            + self.effects.words.len() * size_of::<u32>()
            + self.outcomes.len() * (size_of::<ZoneOutcome>() + 1)
            + self.fixed.len() * FIXED_BYTES
    }

    /// Forgets everything and keeps the memory.
    pub(super) fn forget(&mut self) {
        self.zones.clear();
        self.reduced.clear();
        self.effects.clear();
        self.outcomes.clear();
        self.fixed.clear();
        self.age += 1;
    }

    /// The number of a zone, unless asking for moves from it does not pay.
    pub(super) fn know(&mut self, zone: &[Bound]) -> Option<KnownZone> {
        if self.pause.lasts() {
            return None;
        }
        let pays = self.balance.pays(self.limits.misses);
        if !pays || self.used_bytes() > self.limits.bytes {
            self.forget();
        }
        if !pays {
            self.balance = Balance::default();
            self.pause.begin(self.limits.pause, LONGEST_PAUSE);
            return None;
        }
        let before = self.zones.len();
        let zone = self.zones.intern(zone);
        self.balance.note(self.zones.len() == before);
        Some(KnownZone {
            zone,
            age: self.age,
        })
    }

    pub(super) fn find(&self, zone: ZoneId, effect: u32) -> Option<ZoneOutcome> {
        let is_pair = |one: &ZoneOutcome| one.zone == zone && one.effect == effect;
        self.outcomes
            .find(hash_pair(zone, effect), is_pair)
            .copied()
    }

    /// Writes the zone that was entered, and gives what is kept of it.
    pub(super) fn result(&self, outcome: ZoneOutcome, zone: &mut [Bound]) -> Option<KeptZone> {
        if outcome.entered == NOTHING {
            return None;
        }
        zone.copy_from_slice(self.zones.get(outcome.entered));
        Some(KeptZone {
            zone: outcome.kept,
            age: self.age,
        })
    }

    pub(super) fn insert(&mut self, outcome: ZoneOutcome) {
        let hash = |one: &ZoneOutcome| hash_pair(one.zone, one.effect);
        self.outcomes.insert_unique(hash(&outcome), outcome, hash);
    }
}

/// Whether it pays: what was found, against what was missed.
#[derive(Debug, Default)]
pub(super) struct Balance {
    found: u32,
    missed: u32,
}

impl Balance {
    pub(super) fn note(&mut self, is_found: bool) {
        self.found += u32::from(is_found);
        self.missed += u32::from(!is_found);
    }

    /// Whether it has paid so far, or may still begin to.
    fn pays(&mut self, free_misses: u32) -> bool {
        if self.found + self.missed > LONG_AGO {
            (self.found, self.missed) = (self.found / 2, self.missed / 2);
        }
        self.missed <= self.found.saturating_add(free_misses)
    }
}

fn hash_pair(zone: ZoneId, effect: u32) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    fold(
        fold(u64::from(zone.0) << 32 | u64::from(effect), FACTOR),
        FACTOR,
    )
}
