//! Zones; each is stored once, with as few bytes for a bound as the widest one needs. They are
//! reduced (see [`simulation`]) if zones are compared by what comparisons can distinguish.
//!
//! Invariants:
//! * Two zones get the same [`ZoneId`] exactly if their matrices are equal.
//! * All matrices have entries of the same width: one byte until a bound does not fit, then two,
//!   then four. The order of bounds is that of the entries, so inclusion is decided on the packed
//!   form.
//! * A zone counts its uses; after the last use its place is used again.
//!
//! Cost: packing and comparing touch each bound once, a vector of them at a time.

use crate::network::KeptZone;
use crate::tuning::Tuning;
use crate::zones::simulation::{self, NO_DEMAND};
use crate::zones::zone_table::ZoneId;
use crate::zones::{Bound, dbm};

use super::disk::Cold;
use super::hashing::{hash_bytes, spread};
use super::records::Records;
use super::segmented_table::PiecedTable;
use super::signature::{Signature, Signatures, widen_narrow};

/// How many bytes a bound takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Width {
    One,
    Two,
    Four,
}

/// A zone as it is stored.
#[derive(Clone, Copy, Debug)]
pub(in crate::search) struct Kept<'r> {
    /// Its closed matrix, or its reduced form if there are limits.
    pub(in crate::search) matrix: &'r [Bound],
    /// The limits of its ceilings, if zones count as contained in what simulates them. Either all
    /// zones have limits or none has, and zones that are compared have the same limits.
    pub(in crate::search) limits: &'r [Bound],
    /// By what it is known, if it is.
    pub(in crate::search) known: Option<KeptZone>,
}

/// How the packed matrices of two zones relate to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    /// No entry of the first exceeds its counterpart.
    Within,
    /// Only infinite entries do.
    InfinitelyAbove,
    /// Others do.
    Above,
}

/// A bound packed into `N` bytes; the greatest value stands for infinity.
trait Entry<const N: usize>: Copy + Ord {
    const INFINITY: Self;

    /// The least bound that fits.
    const LEAST: Self;

    /// Stands for no demand.
    const NO_DEMAND: Self;

    /// The lower bits of an encoded bound.
    fn truncated(raw: i32) -> Self;

    /// The encoded bound; meaningless for infinity.
    fn raw(self) -> i32;

    fn to_bytes(self) -> [u8; N];

    fn of_bytes(bytes: [u8; N]) -> Self;
}

macro_rules! entry {
    ($type:ty, $bytes:literal, $least:expr, $no_demand:expr) => {
        impl Entry<$bytes> for $type {
            const INFINITY: $type = <$type>::MAX;
            const LEAST: $type = $least;
            const NO_DEMAND: $type = $no_demand;

            #[inline]
            fn truncated(raw: i32) -> $type {
                raw as $type
            }

            #[inline]
            fn raw(self) -> i32 {
                self.into()
            }

            #[inline]
            fn to_bytes(self) -> [u8; $bytes] {
                self.to_le_bytes()
            }

            #[inline]
            fn of_bytes(bytes: [u8; $bytes]) -> $type {
                <$type>::from_le_bytes(bytes)
            }
        }
    };
}
entry!(i8, 1, i8::MIN + 1, i8::MIN);
entry!(i16, 2, i16::MIN + 1, i16::MIN);
entry!(i32, 4, i32::MIN, NO_DEMAND.raw());

/// Packs a zone; returns whether all bounds fit.
fn pack<T: Entry<N>, const N: usize>(zone: &[Bound], target: &mut [u8]) -> bool {
    let (least, infinity) = (T::LEAST.raw(), T::INFINITY.raw());
    let no_demand = T::NO_DEMAND.raw();
    let mut lost = 0;
    for (bytes, bound) in target.as_chunks_mut::<N>().0.iter_mut().zip(zone) {
        let raw = bound.raw();
        let is_no_demand = -i32::from(raw == NO_DEMAND.raw());
        let is_lost = raw < least || raw >= infinity && raw != i32::MAX;
        lost |= i32::from(is_lost) & !is_no_demand;
        let fitting = raw.clamp(least, infinity);
        *bytes = T::truncated(fitting & !is_no_demand | no_demand & is_no_demand).to_bytes();
    }
    lost == 0
}

fn unpack<T: Entry<N>, const N: usize>(bytes: &[u8], zone: &mut [Bound]) {
    for (bound, bytes) in zone.iter_mut().zip(bytes.as_chunks::<N>().0) {
        let entry = T::of_bytes(*bytes);
        *bound = if entry == T::INFINITY {
            Bound::INFINITY
        } else if entry == T::NO_DEMAND {
            NO_DEMAND
        } else {
            Bound::from_raw(entry.raw())
        };
    }
}

fn compare<T: Entry<N>, const N: usize>(zone: &[u8], other: &[u8]) -> Comparison {
    // Blocks are compared without a branch; most comparisons end in the first one.
    const BLOCK_BYTES: usize = 32;
    let mut is_above = 0;
    let mut exceeds = |block: &[u8], other: &[u8]| {
        let entries = block.as_chunks::<N>().0.iter();
        let mut exceeds = 0;
        for (entry, other) in entries.zip(other.as_chunks::<N>().0) {
            let (entry, other) = (T::of_bytes(*entry), T::of_bytes(*other));
            is_above |= u8::from(entry > other);
            exceeds |= u8::from(entry > other) & u8::from(entry != T::INFINITY);
        }
        exceeds != 0
    };
    let (blocks, rest) = zone.as_chunks::<BLOCK_BYTES>();
    let (other_blocks, other_rest) = other.as_chunks::<BLOCK_BYTES>();
    let mut pairs = blocks.iter().zip(other_blocks);
    if pairs.any(|(block, other)| exceeds(block, other)) || exceeds(rest, other_rest) {
        Comparison::Above
    } else if is_above == 0 {
        Comparison::Within
    } else {
        Comparison::InfinitelyAbove
    }
}

/// The packed matrices and signatures of zones by what they are known by.
#[derive(Debug, Default)]
struct Known {
    age: u32,
    matrices: Vec<u8>,
    signatures: Vec<Option<Signature>>,
}

impl Known {
    fn bytes(&self) -> usize {
        self.matrices.len() + size_of_val(&*self.signatures)
    }

    /// Writes the matrix of a zone and gives its signature, if it was added.
    fn copy_into(&self, known: KeptZone, candidate: &mut [u8]) -> Option<Signature> {
        let index = known.zone.0 as usize;
        let signature = *self.signatures.get(index)?;
        let size = candidate.len();
        if known.age == self.age && signature.is_some() {
            candidate.copy_from_slice(&self.matrices[index * size..][..size]);
            return signature;
        }
        None
    }

    fn add(&mut self, known: KeptZone, matrix: &[u8], signature: Signature) {
        if known.age != self.age {
            *self = Known {
                age: known.age,
                ..Known::default()
            };
        }
        let (index, size) = (known.zone.0 as usize, matrix.len());
        if self.signatures.len() <= index {
            self.signatures.resize(index + 1, None);
            self.matrices.resize((index + 1) * size, 0);
        }
        self.signatures[index] = Some(signature);
        self.matrices[index * size..][..size].copy_from_slice(matrix);
    }
}

/// Stored zones of one dimension.
#[derive(Debug)]
pub(in crate::search) struct PackedZones {
    dimension: usize,
    tuning: Tuning,
    signatures: Signatures,
    width: Width,
    matrices: Records<u8>,
    /// The matrix that was proposed last.
    candidate: Vec<u8>,
    known: Known,
    /// The demands of a zone; empty until zones have limits.
    demands: Vec<Bound>,
    /// What [`widen_narrow`] makes of the candidate; empty until it is asked for.
    narrow: Vec<i16>,
    /// What demands are to be met by; empty until zones have limits.
    other: Vec<Bound>,
    /// By zone: how often it is in use.
    uses: Vec<u32>,
    free: Vec<u32>,
    table: PiecedTable<u32>,
}

impl PackedZones {
    /// An empty table of zones of this dimension, most of whose constants are at most `greatest`;
    /// signatures are best then.
    pub(in crate::search) fn new(dimension: usize, greatest: i32) -> PackedZones {
        PackedZones {
            dimension,
            tuning: Tuning::default(),
            signatures: Signatures::new(dimension, greatest),
            width: Width::One,
            matrices: Records::new(dimension * dimension),
            candidate: vec![0; dimension * dimension],
            known: Known::default(),
            demands: Vec::new(),
            narrow: Vec::new(),
            other: Vec::new(),
            uses: Vec::new(),
            free: Vec::new(),
            table: PiecedTable::new(),
        }
    }

    /// The same, with these heuristics only; before the first zone.
    pub(in crate::search) fn tuned(mut self, tuning: Tuning) -> PackedZones {
        self.tuning = tuning;
        if !tuning.narrow_zones {
            self.widen();
            self.widen();
        }
        self
    }

    /// What may be put on disk.
    pub(in crate::search) fn cold(&mut self) -> &mut dyn Cold {
        &mut self.matrices
    }

    fn get(&self, id: u32) -> &[u8] {
        self.matrices.get(id)
    }

    /// Makes a zone the candidate, which the following questions are about; returns its signature.
    pub(super) fn propose(&mut self, zone: Kept<'_>) -> Signature {
        if self.tuning.kept_signatures
            && let Some(known) = zone.known
            && let Some(signature) = self.known.copy_into(known, &mut self.candidate)
        {
            return signature;
        }
        self.propose_alone(zone.matrix);
        let candidate = std::mem::take(&mut self.candidate);
        let signature = self.signature_of(&candidate, zone.matrix, zone.limits);
        self.candidate = candidate;
        if self.tuning.kept_signatures
            && let Some(known) = zone.known
        {
            self.known.add(known, &self.candidate, signature);
        }
        signature
    }

    /// The same, without the signature.
    pub(in crate::search) fn propose_alone(&mut self, matrix: &[Bound]) {
        while !self.pack(matrix) {
            self.widen();
        }
    }

    /// The signature of a stored zone that has these limits.
    pub(super) fn signature(&mut self, id: ZoneId, limits: &[Bound]) -> Signature {
        let mut matrix = vec![Bound::INFINITY; self.dimension * self.dimension];
        self.load(id, &mut matrix);
        let packed = self.get(id.0).to_vec();
        self.signature_of(&packed, &matrix, limits)
    }

    /// The signature of a zone, from its packed matrix or its bounds.
    fn signature_of(&mut self, packed: &[u8], matrix: &[Bound], limits: &[Bound]) -> Signature {
        let dimension = self.dimension;
        let size = dimension * dimension;
        if !self.tuning.signatures {
            Signature::of([0; 8])
        } else if self.width == Width::One && self.signatures.are_narrow() {
            self.narrow.resize(size, 0);
            widen_narrow(packed, limits, dimension, &mut self.narrow);
            self.signatures.of_narrow(&self.narrow)
        } else if limits.is_empty() {
            self.signatures.of(matrix)
        } else {
            self.demands.resize(size, Bound::INFINITY);
            simulation::demands(matrix, dimension, limits, &mut self.demands);
            self.signatures.of(&self.demands)
        }
    }

    fn pack(&mut self, zone: &[Bound]) -> bool {
        match self.width {
            Width::One => pack::<i8, 1>(zone, &mut self.candidate),
            Width::Two => pack::<i16, 2>(zone, &mut self.candidate),
            Width::Four => pack::<i32, 4>(zone, &mut self.candidate),
        }
    }

    /// Whether a stored zone contains the candidate, which has these limits.
    pub(in crate::search) fn contains_candidate(&mut self, id: ZoneId, limits: &[Bound]) -> bool {
        match self.compare(&self.candidate, self.get(id.0)) {
            Comparison::Within => true,
            Comparison::Above => false,
            Comparison::InfinitelyAbove => {
                self.is_within(|zones| [&zones.candidate, zones.get(id.0)], limits)
            }
        }
    }

    /// Whether the candidate, which has these limits, contains a stored zone.
    pub(in crate::search) fn is_in_candidate(&mut self, id: ZoneId, limits: &[Bound]) -> bool {
        match self.compare(self.get(id.0), &self.candidate) {
            Comparison::Within => true,
            Comparison::Above => false,
            Comparison::InfinitelyAbove => {
                self.is_within(|zones| [zones.get(id.0), &zones.candidate], limits)
            }
        }
    }

    /// Whether a stored zone contains another, if zones have no limits.
    pub(in crate::search) fn is_subset(&self, inner: ZoneId, outer: ZoneId) -> bool {
        self.compare(self.get(inner.0), self.get(outer.0)) == Comparison::Within
    }

    fn compare(&self, zone: &[u8], other: &[u8]) -> Comparison {
        match self.width {
            Width::One => compare::<i8, 1>(zone, other),
            Width::Two => compare::<i16, 2>(zone, other),
            Width::Four => compare::<i32, 4>(zone, other),
        }
    }

    /// Whether the second of two packed zones contains the first. Only infinite entries of the
    /// first exceed their counterparts.
    fn is_within(&mut self, of: impl Fn(&PackedZones) -> [&[u8]; 2], limits: &[Bound]) -> bool {
        if limits.is_empty() {
            return false;
        }
        let mut other = std::mem::take(&mut self.other);
        let mut demands = std::mem::take(&mut self.demands);
        other.resize(self.dimension * self.dimension, Bound::INFINITY);
        demands.resize(other.len(), Bound::INFINITY);
        let [first, second] = of(self);
        unpack_as(self.width, first, &mut other);
        simulation::demands(&other, self.dimension, limits, &mut demands);
        unpack_as(self.width, second, &mut other);
        let is_within = dbm::is_subset(&demands, &other);
        (self.other, self.demands) = (other, demands);
        is_within
    }

    /// Keeps the candidate, or counts one more use of it if it is stored.
    pub(in crate::search) fn keep(&mut self) -> ZoneId {
        let new_hash = hash(&self.candidate);
        let is_candidate = |&id: &u32| self.get(id) == self.candidate;
        if let Some(&id) = self.table.find(new_hash, is_candidate) {
            self.uses[id as usize] += 1;
            return ZoneId(id);
        }
        let id = if let Some(id) = self.free.pop() {
            self.matrices.get_mut(id).copy_from_slice(&self.candidate);
            self.uses[id as usize] = 1;
            id
        } else {
            self.uses.push(1);
            self.matrices.push(&self.candidate)
        };
        let matrices = &self.matrices;
        self.table
            .insert_unique(new_hash, id, |&id| hash(matrices.get(id)));
        ZoneId(id)
    }

    /// Gives up one use of a zone; without any it is forgotten. The candidate stays.
    pub(in crate::search) fn release(&mut self, id: ZoneId) {
        let uses = &mut self.uses[id.0 as usize];
        *uses -= 1;
        if *uses > 0 {
            return;
        }
        let hash = hash(self.get(id.0));
        let entry = self.table.find_entry(hash, |&other| other == id.0);
        entry.expect("a zone in use is in the table").remove();
        self.free.push(id.0);
    }

    /// Writes a stored zone.
    pub(in crate::search) fn load(&self, id: ZoneId, zone: &mut [Bound]) {
        unpack_as(self.width, self.get(id.0), zone);
    }

    /// The bytes that the zones and their table take.
    pub(in crate::search) fn bytes(&self) -> usize {
        let ids = (self.uses.len() + self.free.capacity()) * size_of::<u32>();
        let buffers = self.candidate.len()
            + size_of_val(&*self.narrow)
            + size_of_val(&*self.demands)
            + size_of_val(&*self.other);
        self.matrices.bytes() + ids + self.table.bytes() + self.known.bytes() + buffers
    }

    /// Gives all matrices entries of twice as many bytes.
    fn widen(&mut self) {
        self.width = match self.width {
            Width::One => {
                self.matrices.widen(widened::<i8, i16, 1, 2>);
                Width::Two
            }
            Width::Two => {
                self.matrices.widen(widened::<i16, i32, 2, 4>);
                Width::Four
            }
            Width::Four => unreachable!("every bound fits into four bytes"),
        };
        self.candidate.resize(2 * self.candidate.len(), 0);
        self.known = Known::default();
        let ids: Vec<u32> = self.table.drain().collect();
        let hash_of = |&id: &u32| hash(self.matrices.get(id));
        for id in ids {
            self.table.insert_unique(hash_of(&id), id, hash_of);
        }
    }
}

fn unpack_as(width: Width, bytes: &[u8], zone: &mut [Bound]) {
    match width {
        Width::One => unpack::<i8, 1>(bytes, zone),
        Width::Two => unpack::<i16, 2>(bytes, zone),
        Width::Four => unpack::<i32, 4>(bytes, zone),
    }
}

fn hash(matrix: &[u8]) -> u64 {
    spread(hash_bytes(matrix))
}

fn widened<T: Entry<N>, W: Entry<M>, const N: usize, const M: usize>(
    bytes: &[u8],
    wide: &mut Vec<u8>,
) {
    let entries = bytes.as_chunks::<N>().0.iter();
    let widen = |bytes: &[u8; N]| {
        let entry = T::of_bytes(*bytes);
        if entry == T::INFINITY {
            W::INFINITY.to_bytes()
        } else if entry == T::NO_DEMAND {
            W::NO_DEMAND.to_bytes()
        } else {
            W::truncated(entry.raw()).to_bytes()
        }
    };
    entries.for_each(|entry| wide.extend_from_slice(&widen(entry)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zones::Zone;
    use crate::zones::extrapolate::Ceilings;

    /// Zones of three clocks with constants up to about `scale`, in a fixed order.
    fn zones(scale: i32) -> Vec<Zone> {
        let mut zones = Vec::new();
        for index in 0..60_i32 {
            let mut zone = Zone::universe(4);
            let bound = |seed: i32| Bound::weak((index * seed) % 7 * scale / 7);
            for clock in 1..4 {
                let upper = bound(clock as i32 + 2).expect("a constant within the range");
                zone.constrain(clock, index as usize % clock, upper);
            }
            zones.push(zone);
        }
        zones
    }

    fn whole(matrix: &[Bound]) -> Kept<'_> {
        Kept {
            matrix,
            limits: &[],
            known: None,
        }
    }

    #[test]
    fn reduced_zones_are_compared_by_their_demands_in_every_width() {
        let ceilings = Ceilings::lower_upper(
            &[None, Some(40), None, Some(90)],
            &[None, Some(9), Some(30), None],
        );
        let limits = ceilings.limits();
        let mut packed = PackedZones::new(4, 9);
        let mut kept: Vec<(ZoneId, Vec<Bound>, Vec<Bound>, Signature)> = Vec::new();
        let mut beyond_entries = 0;
        for scale in [9, 40, 62 * 7 / 6, 64 * 7 / 6, 400, 100_000] {
            for (index, mut zone) in (0..).zip(zones(scale)) {
                let least = Bound::weak(-(index % 5) * scale.min(60) / 10);
                let least = least.expect("a constant within the range");
                if !zone.constrain(0, index as usize % 3 + 1, least) {
                    continue;
                }
                let mut matrix = zone.bounds().to_vec();
                simulation::reduce(&mut matrix, 4, &ceilings);
                let mut demands = matrix.clone();
                simulation::demands(&matrix, 4, limits, &mut demands);
                let own = packed.propose(Kept {
                    matrix: &matrix,
                    limits,
                    known: None,
                });
                for (id, other, others, signature) in &kept {
                    let is_within = dbm::is_subset(&demands, other);
                    assert_eq!(packed.contains_candidate(*id, limits), is_within);
                    let contains = dbm::is_subset(others, &matrix);
                    assert_eq!(packed.is_in_candidate(*id, limits), contains);
                    assert!(!is_within || own.may_be_within(*signature));
                    assert!(!contains || signature.may_be_within(own));
                    beyond_entries += i32::from(is_within && !dbm::is_subset(&matrix, other));
                }
                let id = packed.keep();
                for (other_id, other, ..) in &kept {
                    assert_eq!(*other_id == id, *other == matrix);
                }
                kept.push((id, matrix, demands, own));
            }
        }
        assert!(
            beyond_entries > 0,
            "some inclusions show only in the demands"
        );
        for (id, matrix, ..) in &kept {
            let mut loaded = vec![Bound::LE_ZERO; 16];
            packed.load(*id, &mut loaded);
            assert_eq!(&loaded, matrix);
        }
    }

    type Known = (ZoneId, Zone, Signature);

    fn check_zones(packed: &mut PackedZones, zones: &[Zone], kept: &mut Vec<Known>) {
        for zone in zones {
            let own = packed.propose(whole(zone.bounds()));
            for (id, other, signature) in &*kept {
                let is_within = dbm::is_subset(zone.bounds(), other.bounds());
                assert_eq!(packed.contains_candidate(*id, &[]), is_within);
                let contains = dbm::is_subset(other.bounds(), zone.bounds());
                assert_eq!(packed.is_in_candidate(*id, &[]), contains);
                assert!(!is_within || own.may_be_within(*signature));
                assert!(!contains || signature.may_be_within(own));
            }
            let id = packed.keep();
            for (other_id, other, _) in &*kept {
                assert_eq!(*other_id == id, other == zone);
            }
            kept.push((id, zone.clone(), own));
        }
        for (id, zone, _) in kept {
            let mut loaded = Zone::zero(4);
            packed.load(*id, loaded.bounds_mut());
            assert_eq!(&loaded, zone);
        }
    }

    #[test]
    fn zones_stay_the_same_when_bounds_outgrow_their_width() {
        let mut packed = PackedZones::new(4, 9);
        let mut kept = Vec::new();
        // Encoded, 63 is the greatest constant for one byte, 64 the first for two; 16383 and 16384
        // likewise.
        for scale in [
            9,
            62 * 7 / 6,
            64 * 7 / 6,
            16_383 * 7 / 6,
            16_384 * 7 / 6,
            1_000_000,
        ] {
            check_zones(&mut packed, &zones(scale), &mut kept);
        }
        assert_eq!(packed.width, Width::Four);
        // Nothing beyond the account was made room for.
        assert_eq!(packed.matrices.room(), packed.matrices.bytes());
    }

    #[test]
    fn released_zones_are_forgotten_and_their_places_used_again() {
        let mut packed = PackedZones::new(4, 9);
        let mut kept = Vec::new();
        check_zones(&mut packed, &zones(9), &mut kept);
        let places = packed.uses.len();
        for (id, ..) in kept.drain(..) {
            packed.release(id);
        }
        assert!(packed.table.len() == 0);
        check_zones(&mut packed, &zones(10), &mut kept);
        assert!(packed.uses.len() <= places.max(packed.table.len()));
    }

    #[test]
    fn signatures_tell_zones_apart_without_comparing_them() {
        let mut packed = PackedZones::new(4, 9);
        let mut signature = |upper: i32| {
            let mut zone = Zone::universe(4);
            zone.constrain(
                1,
                0,
                Bound::weak(upper).expect("a constant within the range"),
            );
            packed.propose(whole(zone.bounds()))
        };
        assert!(signature(3).may_be_within(signature(9)));
        assert!(!signature(9).may_be_within(signature(3)));
    }

    #[test]
    fn signatures_tell_apart_what_clock_was_reset_later() {
        for (dimension, greatest) in [(8, 60), (21, 60), (40, 60), (40, 1000)] {
            let mut packed = PackedZones::new(dimension, greatest);
            let mut signature = |later: usize| {
                let value = |clock: usize| match clock {
                    0 => 0,
                    _ => (clock as i32 * 7 % 23) + 9 * i32::from(clock == later),
                };
                let bounds = (0..dimension * dimension).map(|entry| {
                    let difference = value(entry / dimension) - value(entry % dimension);
                    Bound::weak(difference).expect("a constant within the range")
                });
                packed.propose(whole(&bounds.collect::<Vec<_>>()))
            };
            let signatures: Vec<_> = (0..dimension).map(&mut signature).collect();
            for (index, one) in signatures.iter().enumerate() {
                for other in &signatures[..index] {
                    // The numbers count clocks modulo eight.
                    let is_told = !one.may_be_within(*other) && !other.may_be_within(*one);
                    assert!(is_told || one == other, "{dimension} {greatest} {index}");
                }
            }
            assert!(signatures[1..].iter().all(|one| *one != signatures[0]));
        }
    }

    #[test]
    fn every_bound_near_the_end_of_a_width_is_told_from_infinity() {
        for raw in [
            i32::MIN,
            i32::MIN + 1,
            NO_DEMAND.raw(),
            -32_769,
            -32_768,
            -129,
            -128,
            126,
            127,
            128,
            32_766,
            32_767,
            32_768,
        ] {
            let mut packed = PackedZones::new(1, 9);
            let zone = [Bound::from_raw(raw)];
            packed.propose(whole(&zone));
            let id = packed.keep();
            let mut loaded = [Bound::LE_ZERO];
            packed.load(id, &mut loaded);
            assert_eq!(loaded, zone);
            packed.propose(whole(&[Bound::INFINITY]));
            assert!(!packed.contains_candidate(id, &[]) && packed.is_in_candidate(id, &[]));
        }
    }
}
