//! Finite unions of zones.
//!
//! A federation keeps closed, consistent, positive zones of one dimension one after the other in a
//! flat buffer. It may describe the same set in many ways; [`Federation::add`] and
//! [`Federation::reduce`] keep the description short, and every answer about the set is exact.
//!
//! Subtraction is what all exactness rests on: `Z \ B` is cut out along the minimal constraints of
//! `B`. For each of them, the part of the rest that violates it is a zone of the result, and the
//! rest is intersected with it. The results are disjoint. Constraints that the rest satisfies
//! anyway cut nothing and are passed over; among the others the one that the rest exceeds most goes
//! first, so the first parts are large and the later cuts have little left to split.
//!
//! Source: A. David, J. Håkansson, K. G. Larsen, P. Pettersson, "Model Checking Timed Automata with
//! Priorities Using DBM Subtraction", FORMATS 2006, sections 3 and 4.
//!
//! Cost: one zone minus another makes at most as many zones as the other has minimal constraints;
//! the difference of federations is exponential in the worst case, and reduced after each step.

use crate::cancellation;

use super::clocks::{self, Assignment};
use super::dbm::{self, Constraint};
use super::rows::rows;
use super::{Bound, ClockSet, Zone, minimal};

/// What it takes to find out that a zone is not in another, as a rule: see [`cancellation::work`].
const UNITS_FOR_COMPARISON: usize = 16;

/// So much work on zones of a federation is counted at once.
const UNITS_AT_ONCE: usize = 1 << 16;

/// Before a federation takes this many bytes, it is asked whether it may.
const LARGE_BYTES: usize = 1 << 20;

/// A finite union of zones of the same dimension.
#[derive(Clone, Debug)]
pub struct Federation {
    dimension: usize,
    bounds: Vec<Bound>,
}

impl Federation {
    /// The federation without valuations.
    pub fn empty(dimension: usize) -> Federation {
        Federation {
            dimension,
            bounds: Vec::new(),
        }
    }

    /// The federation of one zone, which may be empty.
    pub fn of_zone(dimension: usize, zone: &[Bound]) -> Federation {
        let mut federation = Federation::empty(dimension);
        federation.push(zone);
        federation
    }

    /// All valuations.
    pub fn universe(dimension: usize) -> Federation {
        Federation::of_zone(dimension, Zone::universe(dimension).bounds())
    }

    /// The number of clocks, the reference clock included.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The zones, none of them empty.
    pub fn zones(&self) -> std::slice::ChunksExact<'_, Bound> {
        self.bounds.chunks_exact(self.size())
    }

    /// Copies of the zones.
    pub fn to_zones(&self) -> impl Iterator<Item = Zone> {
        let zones = self.zones();
        zones.map(|zone| Zone::from_bounds(self.dimension, zone))
    }

    /// The number of zones in this description of the set.
    pub fn zone_count(&self) -> usize {
        self.bounds.len() / self.size()
    }

    /// The bytes that its zones take, beside the value itself.
    pub fn heap_bytes(&self) -> usize {
        block_bytes(self.bounds.capacity() * size_of::<Bound>())
    }

    /// Gives up the room for zones that are not there.
    pub fn shrink(&mut self) {
        self.bounds.shrink_to_fit();
    }

    /// Whether there is no valuation in it.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Removes everything.
    pub fn clear(&mut self) {
        self.bounds.clear();
    }

    /// Adds a zone, which may be empty, without looking whether it was there.
    pub fn push(&mut self, zone: &[Bound]) {
        if !dbm::is_empty(zone) {
            self.append(zone);
        }
    }

    fn append(&mut self, zone: &[Bound]) {
        make_room(&mut self.bounds, zone.len());
        self.bounds.extend_from_slice(zone);
    }

    /// Adds a zone, which may be empty, unless one zone contains it; removes the zones that it
    /// contains.
    ///
    /// Returns whether the zone was not contained in a single zone.
    pub fn add(&mut self, zone: &[Bound]) -> bool {
        cancellation::work(self.zone_count() * UNITS_FOR_COMPARISON);
        if dbm::is_empty(zone) || self.zones().any(|other| dbm::is_subset(zone, other)) {
            return false;
        }
        self.retain(|other| !dbm::is_subset(other, zone));
        self.append(zone);
        true
    }

    /// Adds all zones of another federation as [`Federation::add`] does; returns whether one was
    /// new.
    pub fn unite(&mut self, other: &Federation) -> bool {
        other
            .zones()
            .fold(false, |is_new, zone| self.add(zone) | is_new)
    }

    /// Whether the valuation is in the federation; see [`dbm::contains`].
    pub fn contains(&self, numerators: &[i64], denominator: i64) -> bool {
        self.zones()
            .any(|zone| dbm::contains(zone, numerators, denominator))
    }

    /// Intersects with one zone.
    pub fn intersect_zone(&mut self, zone: &[Bound]) {
        let dimension = self.dimension;
        if dbm::is_empty(zone) {
            self.clear();
        }
        self.update(|other| {
            !dbm::are_apart(other, zone, dimension) && dbm::intersect(other, zone, dimension)
        });
    }

    /// The valuations in both.
    #[must_use]
    pub fn intersection(&self, other: &Federation) -> Federation {
        let _held = cancellation::hold(self.heap_bytes() + other.heap_bytes());
        let mut result = Federation::empty(self.dimension);
        let mut both = vec![Bound::LE_ZERO; self.size()];
        for zone in other.zones() {
            cancellation::work(self.bounds.len());
            let mut part = Federation::empty(self.dimension);
            for own in self.zones() {
                both.copy_from_slice(own);
                if !dbm::are_apart(own, zone, self.dimension)
                    && dbm::intersect(&mut both, zone, self.dimension)
                {
                    part.append(&both);
                }
            }
            result.unite(&part);
        }
        result
    }

    /// Keeps the valuations that satisfy all constraints.
    pub fn constrain_all(&mut self, constraints: &[Constraint]) {
        let dimension = self.dimension;
        self.update(|zone| dbm::constrain_all(zone, dimension, constraints));
    }

    /// Removes the valuations of a zone.
    ///
    /// A zone that is cut had no other one within it, so only its parts are looked for in the
    /// others.
    pub fn subtract_zone(&mut self, zone: &[Bound]) {
        let dimension = self.dimension;
        let is_apart = |minuend: &[Bound]| dbm::are_apart(minuend, zone, dimension);
        if dbm::is_empty(zone) || self.zones().all(is_apart) {
            return;
        }
        let mut cut = Vec::new();
        self.retain(|minuend| {
            let is_kept = is_apart(minuend);
            if !is_kept {
                make_room(&mut cut, minuend.len());
                cut.extend_from_slice(minuend);
            }
            is_kept
        });
        let _held = cancellation::hold(cut.capacity() * size_of::<Bound>());
        let subtrahend = Subtrahend::new(zone, dimension);
        let size = self.size();
        for minuend in cut.chunks_exact(size) {
            // The parts of one zone are disjoint.
            let others = self.bounds.len();
            let comparisons = subtrahend.constraints.len() * self.zone_count();
            cancellation::work(comparisons * UNITS_FOR_COMPARISON);
            subtrahend.subtract_from(minuend, &mut |part| {
                let mut others = self.bounds[..others].chunks_exact(size);
                if !others.any(|other| dbm::is_subset(part, other)) {
                    self.push(part);
                }
                true
            });
        }
    }

    /// Removes the valuations that satisfy all constraints: [`Federation::subtract_zone`] of their
    /// zone, without making it where each constraint bounds one clock.
    pub fn subtract_conjunction(&mut self, constraints: &[Constraint]) {
        if constraints
            .iter()
            .any(|one| one.left != 0 && one.right != 0)
        {
            let zone = Zone::of_constraints(self.dimension, constraints);
            self.subtract_zone(zone.bounds());
            return;
        }
        if is_contradiction(constraints) {
            return;
        }
        let (dimension, size) = (self.dimension, self.size());
        let meets = |zone: &[Bound]| {
            let mut constraints = constraints.iter();
            constraints.all(|one| dbm::satisfies(zone, dimension, one))
        };
        if !self.zones().any(meets) {
            return;
        }
        let end = self.bounds.len();
        for start in (0..end).step_by(size) {
            let minuend = &self.bounds[start..start + size];
            if !meets(minuend) {
                make_room(&mut self.bounds, size);
                self.bounds.extend_from_within(start..start + size);
                continue;
            }
            cancellation::work(size * (constraints.len() + 1));
            loop {
                let rest = &self.bounds[start..start + size];
                let Some(cut) = deepest_cut(rest, dimension, constraints) else {
                    break;
                };
                make_room(&mut self.bounds, size);
                let part = self.bounds.len();
                self.bounds.extend_from_within(start..start + size);
                let outside = cut.negated();
                if !dbm::constrain_by(&mut self.bounds[part..], dimension, &outside) {
                    self.bounds.truncate(part);
                }
                let rest = &mut self.bounds[start..start + size];
                if !dbm::constrain_by(rest, dimension, &cut) {
                    break;
                }
            }
        }
        self.bounds.drain(..end);
    }

    /// Removes the valuations of another federation.
    pub fn subtract(&mut self, other: &Federation) {
        for zone in other.zones() {
            self.subtract_zone(zone);
        }
    }

    /// What is left of it outside of another one.
    #[must_use]
    pub fn minus(mut self, other: &Federation) -> Federation {
        self.subtract(other);
        self
    }

    /// All valuations that are not in it.
    #[must_use]
    pub fn complement(&self) -> Federation {
        Federation::universe(self.dimension).minus(self)
    }

    /// Whether every valuation of the zone is in the federation; exact.
    pub fn includes_zone(&self, zone: &[Bound]) -> bool {
        dbm::is_empty(zone)
            || self.zones().any(|other| dbm::is_subset(zone, other))
            || is_covered(zone, &self.bounds, self.dimension)
    }

    /// Whether every valuation of this federation is in the other; exact.
    pub fn is_subset(&self, other: &Federation) -> bool {
        self.zones().all(|zone| other.includes_zone(zone))
    }

    /// Whether the two are the same set; exact.
    pub fn is_same_set(&self, other: &Federation) -> bool {
        self.is_subset(other) && other.is_subset(self)
    }

    /// Whether some valuation is in both.
    pub fn intersects(&self, other: &Federation) -> bool {
        let mut scratch = vec![Bound::LE_ZERO; self.size()];
        let mut meets = |zone: &[Bound], other: &[Bound]| {
            scratch.copy_from_slice(zone);
            !dbm::are_apart(zone, other, self.dimension)
                && dbm::intersect(&mut scratch, other, self.dimension)
        };
        self.zones().any(|zone| {
            cancellation::work(other.bounds.len());
            other.zones().any(|other| meets(zone, other))
        })
    }

    /// Lets any time pass while the clocks of `stopped` keep their values; see
    /// [`clocks::up_stopped`].
    pub fn up(&mut self, stopped: &ClockSet) {
        let dimension = self.dimension;
        self.update(|zone| {
            clocks::up_stopped(zone, dimension, stopped);
            true
        });
    }

    /// Lets time run backwards while the clocks of `stopped` keep their values; see
    /// [`clocks::down_stopped`].
    pub fn down(&mut self, stopped: &ClockSet) {
        let dimension = self.dimension;
        self.update(|zone| {
            clocks::down_stopped(zone, dimension, stopped);
            true
        });
    }

    /// Replaces the federation by its preimage under a guard and assignments; see
    /// [`clocks::preimage`].
    pub fn preimage(&mut self, guard: &[Constraint], assignments: &[Assignment]) {
        let dimension = self.dimension;
        self.update(|zone| clocks::preimage(zone, dimension, guard, assignments));
    }

    /// Removes every zone that a single other one contains. Quadratic in the number of zones.
    fn remove_included(&mut self) {
        let zones = std::mem::take(&mut self.bounds);
        let _held = cancellation::hold(zones.capacity() * size_of::<Bound>());
        for zone in zones.chunks_exact(self.size()) {
            self.add(zone);
        }
    }

    /// Makes the description shorter: joins pairs of zones whose union is a zone, and removes zones
    /// that the rest covers. The set stays the same.
    pub fn reduce(&mut self) {
        self.merge();
        self.remove_covered();
    }

    /// Makes the description shorter as [`Federation::reduce`] does, but leaves zones that only
    /// several others cover. Cheaper.
    pub fn merge(&mut self) {
        self.remove_included();
        self.join_pairs();
    }

    /// Replaces pairs of zones by their hull where that adds no valuation, until there is no such
    /// pair.
    ///
    /// Zones enter one by one; one that joins with another enters again as their hull.
    fn join_pairs(&mut self) {
        let size = self.size();
        let zones = std::mem::take(&mut self.bounds);
        let _held = cancellation::hold(zones.capacity() * size_of::<Bound>());
        let mut entering = vec![Bound::LE_ZERO; size];
        let mut hull = entering.clone();
        for zone in zones.chunks_exact(size) {
            cancellation::work(self.zone_count() * self.dimension);
            entering.copy_from_slice(zone);
            while let Some(index) = self
                .zones()
                .position(|other| join(&mut hull, &entering, other, self.dimension))
            {
                self.bounds.drain(index * size..(index + 1) * size);
                entering.copy_from_slice(&hull);
            }
            self.add(&entering);
        }
    }

    /// Removes the zones that all others together cover.
    fn remove_covered(&mut self) {
        let size = self.size();
        let mut index = 0;
        while index < self.zone_count() && self.zone_count() > 1 {
            let zone: Vec<Bound> = self
                .bounds
                .drain(index * size..(index + 1) * size)
                .collect();
            if !self.includes_zone(&zone) {
                self.bounds.splice(index * size..index * size, zone);
                index += 1;
            }
        }
    }

    /// The least zone that contains the federation, which must not be empty.
    pub fn convex_hull(&self) -> Vec<Bound> {
        let mut hull = self.zone(0).to_vec();
        self.zones()
            .skip(1)
            .for_each(|zone| dbm::hull(&mut hull, zone));
        hull
    }

    /// Adds the faces of `zone` in which an upper bound of an invariant is reached, so that time
    /// cannot pass.
    ///
    /// A strict bound is never reached and has no face; neither has the bound of a clock in
    /// `stopped`. Constraints other than upper bounds of a clock do not stop time and are passed
    /// over.
    pub fn add_upper_faces(
        &mut self,
        zone: &[Bound],
        invariant: &[Constraint],
        stopped: &ClockSet,
    ) {
        let dimension = self.dimension;
        for &Constraint { left, right, bound } in invariant {
            let is_upper = left != 0 && right == 0 && bound.is_finite();
            if !is_upper || bound.is_strict() || stopped.contains(left) {
                continue;
            }
            let mut face = zone.to_vec();
            let lower = Constraint {
                left: 0,
                right: left,
                bound: Bound::le(-bound.value()),
            };
            let upper = Constraint { left, right, bound };
            if dbm::constrain_all(&mut face, dimension, &[upper, lower]) {
                self.add(&face);
            }
        }
    }

    /// The zone with this index.
    pub fn zone(&self, index: usize) -> &[Bound] {
        &self.bounds[index * self.size()..(index + 1) * self.size()]
    }

    /// The number of bounds of a zone.
    fn size(&self) -> usize {
        self.dimension * self.dimension
    }

    /// Keeps the zones for which the predicate holds, in their order.
    fn retain(&mut self, mut is_kept: impl FnMut(&[Bound]) -> bool) {
        self.update(|zone| is_kept(zone));
    }

    /// Changes every zone in place and drops those for which the change returns false.
    fn update(&mut self, mut change: impl FnMut(&mut [Bound]) -> bool) {
        let size = self.size();
        let (mut kept, mut units) = (0, 0);
        for start in (0..self.bounds.len()).step_by(size) {
            units += size;
            if units >= UNITS_AT_ONCE {
                cancellation::work(std::mem::take(&mut units));
            }
            if change(&mut self.bounds[start..start + size]) {
                self.bounds.copy_within(start..start + size, kept);
                kept += size;
            }
        }
        self.bounds.truncate(kept);
        cancellation::work(units);
    }
}

/// Makes room for so many more bounds; asks before, where that takes much memory. Long lists grow
/// by a quarter, so that they do not come to a limit of memory with half of it free.
#[inline]
fn make_room(bounds: &mut Vec<Bound>, more: usize) {
    if bounds.capacity() - bounds.len() < more {
        let least = bounds.len() + more;
        let bytes = least * size_of::<Bound>();
        if bytes >= LARGE_BYTES {
            cancellation::ask_for(bytes + bytes / 4);
            bounds.reserve_exact(more.max(least / 4));
        } else {
            bounds.reserve(more);
        }
    }
}

/// What a block of so many bytes takes of the heap: allocators keep its size in front of it, and
/// common ones give multiples of 16.
pub fn block_bytes(bytes: usize) -> usize {
    if bytes == 0 {
        return 0;
    }
    (bytes + size_of::<usize>()).next_multiple_of(16).max(32)
}

/// The bytes of a hash table with room for so many entries: it has a power of two of places, with a
/// byte for each, and an eighth of them stays free.
pub fn table_bytes<T>(capacity: usize) -> usize {
    if capacity == 0 {
        return 0;
    }
    let places = (capacity * 8).div_ceil(7).next_power_of_two();
    places * (size_of::<T>() + 1)
}

/// A zone that is taken away from others: its minimal constraints are found once.
struct Subtrahend<'a> {
    zone: &'a [Bound],
    dimension: usize,
    constraints: Vec<Constraint>,
}

impl<'a> Subtrahend<'a> {
    fn new(zone: &'a [Bound], dimension: usize) -> Subtrahend<'a> {
        let mut constraints = Vec::new();
        minimal::for_each_minimal(zone, dimension, |constraint| constraints.push(constraint));
        Subtrahend {
            zone,
            dimension,
            constraints,
        }
    }

    /// Gives the parts of `minuend` outside the zone to `visit` until that returns false; returns
    /// whether it never did.
    fn subtract_from(&self, minuend: &[Bound], visit: &mut impl FnMut(&[Bound]) -> bool) -> bool {
        let dimension = self.dimension;
        if dbm::are_apart(minuend, self.zone, dimension) {
            return visit(minuend);
        }
        cancellation::work(minuend.len() * (self.constraints.len() + 1));
        let mut rest = minuend.to_vec();
        let mut part = minuend.to_vec();
        while let Some(cut) = deepest_cut(&rest, dimension, &self.constraints) {
            let outside = cut.negated();
            part.copy_from_slice(&rest);
            if dbm::constrain_by(&mut part, dimension, &outside) && !visit(&part) {
                return false;
            }
            if !dbm::constrain_by(&mut rest, dimension, &cut) {
                break;
            }
        }
        true
    }
}

/// The constraint that the zone exceeds most; none if it satisfies all.
fn deepest_cut(zone: &[Bound], dimension: usize, constraints: &[Constraint]) -> Option<Constraint> {
    let excess = |constraint: &Constraint| {
        let entry = zone[constraint.left * dimension + constraint.right];
        i64::from(entry.raw()) - i64::from(constraint.bound.raw())
    };
    let cutting = constraints
        .iter()
        .filter(|constraint| excess(constraint) > 0);
    // Of equally deep cuts the first one, so that results do not depend on how a maximum is found.
    cutting
        .rev()
        .max_by_key(|constraint| excess(constraint))
        .copied()
}

/// Whether constraints that bound one clock each have no solution.
fn is_contradiction(constraints: &[Constraint]) -> bool {
    constraints.iter().any(|upper| {
        let opposite = |lower: &&Constraint| lower.left == upper.right && lower.right == upper.left;
        let mut lowers = constraints.iter().filter(opposite);
        lowers.any(|lower| upper.bound + lower.bound < Bound::LE_ZERO)
    })
}

/// Whether the zones, one after the other in `cover`, contain the whole zone.
fn is_covered(zone: &[Bound], cover: &[Bound], dimension: usize) -> bool {
    cancellation::work(cover.len() / (dimension * dimension) * UNITS_FOR_COMPARISON);
    let mut cover = cover;
    while let Some((first, others)) = cover.split_at_checked(dimension * dimension) {
        if dbm::is_subset(zone, first) {
            return true;
        }
        if !dbm::are_apart(zone, first, dimension) {
            let mut is_part_covered = |part: &[Bound]| is_covered(part, others, dimension);
            return Subtrahend::new(first, dimension).subtract_from(zone, &mut is_part_covered);
        }
        cover = others;
    }
    false
}

/// Writes the hull of two zones; returns whether it contains nothing but them.
///
/// A valuation of the hull outside of both exceeds some bound of each. Such a pair of bounds leaves
/// valuations of the hull, which is closed as a hull of closed zones, unless the cycle through both
/// negated bounds is negative.
fn join(hull: &mut [Bound], zone: &[Bound], other: &[Bound], dimension: usize) -> bool {
    if has_gap(zone, other, dimension) {
        return false;
    }
    hull.copy_from_slice(zone);
    dbm::hull(hull, other);
    let hull = &*hull;
    let is_covered_beyond = |left: usize, right: usize| {
        let beyond = zone[left * dimension + right].negated();
        let row = &hull[left * dimension..(left + 1) * dimension];
        exceeded(hull, other, dimension).all(|(other_left, other_right)| {
            let other_beyond = other[other_left * dimension + other_right].negated();
            let there = row[other_right] + other_beyond;
            let back = hull[other_left * dimension + right] + beyond;
            there + back < Bound::LE_ZERO
        })
    };
    exceeded(hull, zone, dimension).all(|(left, right)| is_covered_beyond(left, right))
}

/// The entries of a zone that those of a larger one exceed.
fn exceeded(
    larger: &[Bound],
    zone: &[Bound],
    dimension: usize,
) -> impl Iterator<Item = (usize, usize)> {
    let entries = larger.iter().zip(zone).enumerate();
    entries
        .filter(|(_, (larger, bound))| larger > bound)
        .map(move |(index, _)| (index / dimension, index % dimension))
}

/// Whether there is room between two zones: some difference has values that lie beyond the one and
/// before the other.
fn has_gap(zone: &[Bound], other: &[Bound], dimension: usize) -> bool {
    let lies_apart =
        |bound: &Bound, opposite: Bound| bound.is_finite() && opposite < bound.negated();
    rows(zone, dimension).enumerate().any(|(left, row)| {
        row.iter()
            .enumerate()
            .any(|(right, bound)| lies_apart(bound, other[right * dimension + left]))
    })
}
