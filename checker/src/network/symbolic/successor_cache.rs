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
//! pairs are found it does not pay, and is given up for a while.

use hashbrown::HashTable;
use rustc_hash::FxHashMap;

use crate::cancellation;
use crate::exec::{EmittedAssignment, EmittedConstraint};
use crate::ir::{ClockId, Network};
use crate::zones::clocks;
use crate::zones::zone_table::{ZoneId, ZoneTable};
use crate::zones::{Bound, dbm, simulation};

use super::clock_effect::{add_constraints, check_limit, to_assignment};
use crate::network::{Failure, FixedMove, MoveRef, OfferId, Symbolic};

/// How much is remembered, and for how long though it does not pay.
#[derive(Clone, Copy, Debug)]
pub struct MemoLimits {
    /// When so many bytes are taken, about, everything is forgotten.
    pub bytes: usize,
    /// So many more pairs may be missed than found before it is given up.
    pub misses: u32,
    /// When it was given up so many states do not ask, and four times as many each further time.
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
/// At most so many states do not ask.
const LONGEST_PAUSE: u32 = 1 << 22;
/// After so many pairs what was found and missed before counts half.
const LONG_AGO: u32 = 1 << 17;
/// What a move of an offer takes, about.
const FIXED_BYTES: usize = 256;

/// A zone that moves from it may be looked up by.
#[derive(Clone, Copy, Debug)]
pub struct KnownZone {
    zone: ZoneId,
    /// How often everything had been forgotten when it was known.
    age: u32,
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
struct FixedEffect {
    one: FixedMove,
    effect: u32,
}

/// No zone.
const NOTHING: ZoneId = ZoneId(u32::MAX);

/// What an effect makes of a zone.
#[derive(Clone, Copy, Debug)]
struct Outcome {
    zone: ZoneId,
    effect: u32,
    /// The zone on entry with time passed; [`NOTHING`] if nothing is left.
    entered: ZoneId,
    /// What is kept of it.
    kept: ZoneId,
}

/// All that is remembered.
#[derive(Debug)]
pub(super) struct ZoneMemo {
    dimension: usize,
    /// Whether all that moves do to zones can be said by effects.
    is_possible: bool,
    /// Whether zones are asked for as they are entered; else what is kept of them may stand in
    /// their place.
    needs_entered: bool,
    pub(super) limits: MemoLimits,
    zones: ZoneTable,
    /// Reduced forms, each with the limits of its ceilings behind it, where these are kept.
    reduced: ZoneTable,
    effects: Effects,
    outcomes: HashTable<Outcome>,
    /// Moves of offers that were taken; `None` where the effect may depend on variables.
    fixed: FxHashMap<(OfferId, u32), Option<FixedEffect>>,
    balance: Balance,
    age: u32,
    /// A reduced form with its limits.
    scratch: Vec<Bound>,
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
            effects: Effects::default(),
            outcomes: HashTable::new(),
            fixed: FxHashMap::default(),
            balance: Balance::default(),
            age: 0,
            scratch: Vec::new(),
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.zones.bytes()
            + self.reduced.bytes()
            + self.effects.bytes()
            + self.outcomes.capacity() * (size_of::<Outcome>() + 1) * 8 / 7
            + self.fixed.capacity() * FIXED_BYTES
    }

    /// The bytes that are in use, about.
    fn used_bytes(&self) -> usize {
        let zones = self.zones.len() * self.dimension;
        let reduced = self.reduced.len() * (self.dimension + 1);
        (zones + reduced) * self.dimension * size_of::<Bound>()
            + self.effects.words.len() * size_of::<u32>()
            + self.outcomes.len() * (size_of::<Outcome>() + 1)
            + self.fixed.len() * FIXED_BYTES
    }

    /// Forgets everything and keeps the memory.
    fn forget(&mut self) {
        self.zones.clear();
        self.reduced.clear();
        self.effects.clear();
        self.outcomes.clear();
        self.fixed.clear();
        self.age += 1;
    }

    /// The number of a zone, unless asking for moves from it does not pay.
    fn know(&mut self, zone: &[Bound]) -> Option<KnownZone> {
        if self.balance.pause > 0 {
            self.balance.pause -= 1;
            return None;
        }
        let pays = self.balance.pays(self.limits.misses);
        if !pays || self.used_bytes() > self.limits.bytes {
            self.forget();
        }
        if !pays {
            self.balance.give_up(self.limits.pause);
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

    fn find(&self, zone: ZoneId, effect: u32) -> Option<Outcome> {
        let is_pair = |one: &Outcome| one.zone == zone && one.effect == effect;
        self.outcomes
            .find(hash_pair(zone, effect), is_pair)
            .copied()
    }

    /// Writes the zone that was entered, and gives what is kept of it.
    fn result(&self, outcome: Outcome, zone: &mut [Bound]) -> Option<KeptZone> {
        if outcome.entered == NOTHING {
            return None;
        }
        zone.copy_from_slice(self.zones.get(outcome.entered));
        Some(KeptZone {
            zone: outcome.kept,
            age: self.age,
        })
    }

    fn insert(&mut self, outcome: Outcome) {
        let hash = |one: &Outcome| hash_pair(one.zone, one.effect);
        self.outcomes.insert_unique(hash(&outcome), outcome, hash);
    }
}

/// Whether it pays.
#[derive(Debug, Default)]
struct Balance {
    found: u32,
    missed: u32,
    /// How many states will not ask, and how many did not the last time.
    pause: u32,
    last_pause: u32,
}

impl Balance {
    fn note(&mut self, is_found: bool) {
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

    fn give_up(&mut self, first_pause: u32) {
        let pause = self.last_pause.saturating_mul(4).min(LONGEST_PAUSE);
        let pause = pause.max(first_pause);
        *self = Balance {
            pause,
            last_pause: pause,
            ..Balance::default()
        };
    }
}

impl<'a> Symbolic<'a> {
    /// The same, with other limits to what is remembered of zones.
    #[must_use]
    pub fn remembering(mut self, limits: MemoLimits) -> Symbolic<'a> {
        self.memo.limits = limits;
        self
    }

    /// Says whether zones are needed as they are entered, before extrapolation. They are unless
    /// this was said.
    pub fn need_entered(&mut self, needs: bool) {
        if self.memo.needs_entered != needs {
            self.memo.forget();
            self.memo.needs_entered = needs;
        }
    }

    /// The number of the zone of a state that is explored; `None` where looking up moves by it is
    /// impossible or does not pay.
    pub fn know(&mut self, zone: &[Bound]) -> Option<KnownZone> {
        let is_used = self.tuning().successor_cache && self.memo.is_possible;
        if !is_used || self.has_barriers() || self.splits() {
            return None;
        }
        self.memo.know(zone)
    }

    /// Whether moves from the zone can still be looked up.
    pub fn is_known(&self, known: KnownZone) -> bool {
        known.age == self.memo.age
    }

    /// As [`Symbolic::take`], [`Symbolic::forget`] and [`Symbolic::pass_time`], for a move from a
    /// zone that is known and that each of its guards leaves something of; `zone`, of the same
    /// dimension, is overwritten. `None` if the move is not possible.
    pub fn enter_known(
        &mut self,
        one: MoveRef<'_>,
        words: &mut [i32],
        (known, source): (KnownZone, &[Bound]),
        zone: &mut [Bound],
    ) -> Result<Option<KeptZone>, Failure> {
        cancellation::work(words.len() + zone.len());
        if let Some(offered) = one.offered
            && let Some(Some(fixed)) = self.memo.fixed.get(&offered)
            && let Some(outcome) = self.memo.find(known.zone, fixed.effect)
        {
            self.stepper.take(&fixed.one, words)?;
            self.forget(words);
            self.memo.balance.note(true);
            return Ok(self.memo.result(outcome, zone));
        }
        let dimension = self.dimension;
        if one.constraints.len() > 1 {
            zone.copy_from_slice(source);
            if !add_constraints(one.constraints, &mut self.invariant)?
                || !dbm::constrain_all(zone, dimension, &self.invariant)
            {
                return Ok(None);
            }
        }
        let effects = &mut self.memo.effects;
        effects.begin();
        effects.add_constraints(one.constraints);
        effects.end(GUARD);
        for assignment in self.stepper.fire(one.parts, words)? {
            check_limit(assignment.value)?;
            effects.add_assignment(*assignment);
        }
        effects.end(ASSIGNMENTS);
        match self.stepper.invariants(words)? {
            Some(emitted) => effects.add_constraints(emitted),
            None => return Ok(None),
        }
        effects.end(INVARIANT);
        self.forget(words);
        let may_delay = match self.may_delay(words) {
            Ok(may_delay) => may_delay,
            // Where nothing of the zone is left nobody asks whether time may pass.
            Err(failure) => {
                let is_left = self.apply_effect(source, zone)?;
                return if is_left { Err(failure) } else { Ok(None) };
            }
        };
        self.memo.effects.key.push(may_delay.into());
        self.bounds.classes_into(words, &mut self.memo.effects.key);
        let effect = self.memo.effects.intern();
        self.fix_effect(one, words, effect);
        let found = self.memo.find(known.zone, effect);
        self.memo.balance.note(found.is_some());
        if let Some(outcome) = found {
            return Ok(self.memo.result(outcome, zone));
        }
        let (entered, kept) = if self.compute(words, source, may_delay, zone)? {
            // A single state may have successors without end.
            if self.memo.used_bytes() > self.memo.limits.bytes {
                self.memo.forget();
            }
            self.intern(words, zone)
        } else {
            (NOTHING, NOTHING)
        };
        let outcome = Outcome {
            zone: known.zone,
            effect,
            entered,
            kept,
        };
        if self.is_known(known) {
            self.memo.insert(outcome);
        }
        Ok(self.memo.result(outcome, zone))
    }

    /// Remembers the effect of a move of an offer, which led to these words, unless it may depend
    /// on variables.
    fn fix_effect(&mut self, one: MoveRef<'_>, words: &[i32], effect: u32) {
        let Some(offered) = one.offered else { return };
        if self.memo.fixed.contains_key(&offered) {
            return;
        }
        let is_fixed =
            self.tuning().constant_effect && self.is_fixed() && self.bounds.follow_locations();
        let fixed = self.fix(one, words).filter(|_| is_fixed);
        let fixed = fixed.map(|one| FixedEffect { one, effect });
        self.memo.fixed.insert(offered, fixed);
    }

    /// Applies the effect at hand to a zone.
    fn apply_effect(&mut self, source: &[Bound], zone: &mut [Bound]) -> Result<bool, Failure> {
        let dimension = self.dimension;
        let effects = &self.memo.effects;
        zone.copy_from_slice(source);
        if !add_constraints(&effects.guard(), &mut self.invariant)?
            || !dbm::constrain_all(zone, dimension, &self.invariant)
        {
            return Ok(false);
        }
        for assignment in effects.assignments() {
            if !clocks::assign(zone, dimension, &[to_assignment(&assignment)?]) {
                return Ok(false);
            }
        }
        Ok(add_constraints(&effects.invariant(), &mut self.invariant)?
            && dbm::constrain_all(zone, dimension, &self.invariant))
    }

    /// Applies the effect at hand to a zone and lets time pass if it may.
    fn compute(
        &mut self,
        words: &[i32],
        source: &[Bound],
        may_delay: bool,
        zone: &mut [Bound],
    ) -> Result<bool, Failure> {
        if !self.apply_effect(source, zone)? {
            return Ok(false);
        }
        let invariant = std::mem::take(&mut self.invariant);
        let result = self.delay(words, may_delay, &invariant, zone);
        self.invariant = invariant;
        result.map(|()| true)
    }

    /// The numbers of a zone that was entered and of what is kept of it.
    fn intern(&mut self, words: &[i32], zone: &[Bound]) -> (ZoneId, ZoneId) {
        let mut kept = std::mem::take(&mut self.memo.scratch);
        kept.clear();
        kept.extend_from_slice(zone);
        let kept_zone = if self.keeps_reduced() {
            self.bounds.ceilings_into(words, &mut self.ceilings);
            simulation::reduce(&mut kept, self.dimension, &self.ceilings);
            kept.extend_from_slice(self.ceilings.limits());
            self.memo.reduced.intern(&kept)
        } else {
            self.extrapolate(words, &mut kept);
            self.memo.zones.intern(&kept)
        };
        self.memo.scratch = kept;
        if self.memo.needs_entered || self.keeps_reduced() {
            (self.memo.zones.intern(zone), kept_zone)
        } else {
            (kept_zone, kept_zone)
        }
    }

    /// Whether the reduced forms of zones are kept (see [`Symbolic::to_stored`]): not where states
    /// are exchanged before.
    pub fn keeps_reduced(&self) -> bool {
        self.stores_reduced() && self.symmetry().is_none()
    }

    /// What is kept of a zone that the last move entered: the reduced form and the limits of its
    /// ceilings, or the extrapolated zone and no limits.
    pub fn kept(&self, kept: KeptZone) -> (&[Bound], &[Bound]) {
        if self.keeps_reduced() {
            self.memo
                .reduced
                .get(kept.zone)
                .split_at(self.dimension * self.dimension)
        } else {
            (self.memo.zones.get(kept.zone), &[])
        }
    }

    /// The number of the extrapolated zone that is kept; `None` if it is a reduced form.
    pub fn known_kept(&self, KeptZone { zone, age }: KeptZone) -> Option<KnownZone> {
        (!self.keeps_reduced()).then_some(KnownZone { zone, age })
    }
}

/// Effects, each once, as the words that say all that the result hangs on: how many there are up to
/// the end of the guard, of the assignments and of the invariant; these; whether time may pass; and
/// what clocks are compared with from there on.
#[derive(Debug, Default)]
struct Effects {
    /// The words of all effects, one after the other.
    words: Vec<u32>,
    /// Where the words of each effect end.
    ends: Vec<u32>,
    table: HashTable<u32>,
    /// The words of the effect at hand.
    key: Vec<u32>,
}

/// The words at the front of an effect, which say where its parts end.
const GUARD: usize = 0;
const ASSIGNMENTS: usize = 1;
const INVARIANT: usize = 2;
const FRONT: usize = 3;

impl Effects {
    fn bytes(&self) -> usize {
        (self.words.capacity() + self.ends.capacity()) * size_of::<u32>()
            + self.table.capacity() * (size_of::<u32>() + 1) * 8 / 7
    }

    fn clear(&mut self) {
        self.words.clear();
        self.ends.clear();
        self.table.clear();
    }

    /// Begins an effect.
    fn begin(&mut self) {
        self.key.clear();
        self.key.resize(FRONT, 0);
    }

    fn end(&mut self, part: usize) {
        self.key[part] = self.key.len() as u32;
    }

    fn add_constraints(&mut self, emitted: &[EmittedConstraint]) {
        for one in emitted {
            let clocks = packed(one.left, one.right) | u32::from(one.strict) << 31;
            self.key.extend([clocks, one.bound.cast_unsigned()]);
        }
    }

    fn add_assignment(&mut self, one: EmittedAssignment) {
        let clocks = packed(one.target, one.source);
        self.key.extend([clocks, one.value.cast_unsigned()]);
    }

    /// The pairs of words between the ends of two parts.
    fn pairs(&self, first: usize, end: usize) -> &[[u32; 2]] {
        self.key[first..self.key[end] as usize].as_chunks().0
    }

    fn guard(&self) -> Vec<EmittedConstraint> {
        self.pairs(FRONT, GUARD)
            .iter()
            .copied()
            .map(to_constraint)
            .collect()
    }

    fn assignments(&self) -> Vec<EmittedAssignment> {
        let pairs = self.pairs(self.key[GUARD] as usize, ASSIGNMENTS);
        pairs
            .iter()
            .map(|&[clocks, value]| EmittedAssignment {
                target: ClockId(clocks & MOST_CLOCKS),
                source: ClockId(clocks >> CLOCK_BITS),
                value: value.cast_signed(),
            })
            .collect()
    }

    fn invariant(&self) -> Vec<EmittedConstraint> {
        let pairs = self.pairs(self.key[ASSIGNMENTS] as usize, INVARIANT);
        pairs.iter().copied().map(to_constraint).collect()
    }

    /// The number of the effect at hand.
    fn intern(&mut self) -> u32 {
        let Effects {
            words,
            ends,
            table,
            key,
        } = self;
        let of = |index: u32| {
            let index = index as usize;
            let first = index.checked_sub(1).map_or(0, |before| ends[before]);
            &words[first as usize..ends[index] as usize]
        };
        let hash_of_key = hash_words(key);
        if let Some(&index) = table.find(hash_of_key, |&index| of(index) == key.as_slice()) {
            return index;
        }
        let index = ends.len() as u32;
        words.extend_from_slice(key);
        ends.push(words.len() as u32);
        let of = |index: u32| {
            let index = index as usize;
            let first = index.checked_sub(1).map_or(0, |before| ends[before]);
            &words[first as usize..ends[index] as usize]
        };
        table.insert_unique(hash_of_key, index, |&index| hash_words(of(index)));
        index
    }
}

/// The bits that a clock takes in a word of an effect: the limit of clocks is far below.
const CLOCK_BITS: u32 = 15;
/// The greatest clock that fits.
const MOST_CLOCKS: u32 = (1 << CLOCK_BITS) - 1;

/// Two clocks in the lower 30 bits of a word.
fn packed(first: ClockId, second: ClockId) -> u32 {
    debug_assert!(first.0.max(second.0) <= MOST_CLOCKS);
    first.0 | second.0 << CLOCK_BITS
}

fn to_constraint([clocks, bound]: [u32; 2]) -> EmittedConstraint {
    EmittedConstraint {
        left: ClockId(clocks & MOST_CLOCKS),
        right: ClockId(clocks >> CLOCK_BITS & MOST_CLOCKS),
        bound: bound.cast_signed(),
        strict: clocks >> 31 != 0,
    }
}

/// A hash of words: two lanes of multiply and fold.
fn hash_words(words: &[u32]) -> u64 {
    const FACTORS: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f];
    let mut lanes = FACTORS;
    let mut absorb = |[a, b, c, d]: [u32; 4]| {
        let words = [[a, b], [c, d]].map(|[low, high]| u64::from(low) | u64::from(high) << 32);
        for ((lane, word), factor) in lanes.iter_mut().zip(words).zip(FACTORS) {
            *lane = fold(*lane ^ word, factor);
        }
    };
    let (blocks, rest) = words.as_chunks::<4>();
    blocks.iter().copied().for_each(&mut absorb);
    let mut last = [0; 4];
    last[..rest.len()].copy_from_slice(rest);
    absorb(last);
    fold(lanes[0] ^ lanes[1].rotate_left(32), FACTORS[0])
}

fn hash_pair(zone: ZoneId, effect: u32) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    fold(
        fold(u64::from(zone.0) << 32 | u64::from(effect), FACTOR),
        FACTOR,
    )
}

fn fold(value: u64, factor: u64) -> u64 {
    let product = value.wrapping_mul(factor);
    product ^ product >> 32
}
