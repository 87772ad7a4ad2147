//! The effect of moves on clocks: how the constraints and assignments that code emits become those
//! of zones.

use crate::exec::EmittedAssignment;
use crate::ir::{ClockId, FixedConstraint};
use crate::network::Failure;
use crate::zones::clocks::Assignment;
use crate::zones::dbm::Constraint;
use crate::zones::federation::block_bytes;
use crate::zones::{Bound, Federation, Zone, minimal};

/// The effect of a move on clocks, from the source's zone to the zone on entry.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct ClockEffect {
    /// The guard.
    pub guard: Vec<Constraint>,
    /// Conjunctions that must not hold.
    pub excluded: Vec<Vec<Constraint>>,
    /// The assignments.
    pub assignments: Vec<Assignment>,
    /// The invariants of the target.
    pub invariant: Vec<Constraint>,
}

impl ClockEffect {
    /// The bytes that it takes, without the value itself.
    pub fn heap_bytes(&self) -> usize {
        let excluded = self.excluded.iter();
        block_bytes(size_of_val(&*self.guard))
            + block_bytes(size_of_val(&*self.assignments))
            + block_bytes(size_of_val(&*self.invariant))
            + block_bytes(size_of_val(&*self.excluded))
            + excluded
                .map(|one| block_bytes(size_of_val(&**one)))
                .sum::<usize>()
    }

    /// Whether the move is possible everywhere and leaves every zone as it is.
    pub fn is_trivial(&self) -> bool {
        self.guard.is_empty()
            && self.excluded.is_empty()
            && self.assignments.is_empty()
            && self.invariant.is_empty()
    }

    /// Whether the move is possible at all valuations of a zone; false if it copies clocks, since
    /// then this is not known.
    pub fn keeps_all_of(&self, zone: &Zone) -> bool {
        self.guard.iter().all(|one| holds(zone, one)) && self.enters_from_all_of(zone)
    }

    /// The part of a zone in which the guard holds, if the move is known to be possible in all of
    /// it.
    pub fn guarded_part(&self, zone: &Zone) -> Option<Zone> {
        let mut part = zone.clone();
        let is_known = part.constrain_all(&self.guard) && self.enters_from_all_of(&part);
        is_known.then_some(part)
    }

    /// Whether nothing but the guard can forbid the move in a zone; false if that is not known.
    fn enters_from_all_of(&self, zone: &Zone) -> bool {
        let only_sets = |one: &Assignment| matches!(one, Assignment::Value { .. });
        if !self.excluded.is_empty() || !self.assignments.iter().all(only_sets) {
            return false;
        }
        if self.assignments.is_empty() && self.invariant.is_empty() {
            return true;
        }
        let mut after = zone.clone();
        after.assign(&self.assignments) && self.invariant.iter().all(|one| holds(&after, one))
    }

    /// The zones on entry of the target: those valuations of the source's zone that satisfy the
    /// guard, after the assignments, within the invariant. There is more than one zone only if some
    /// clock-guarded receiver abstains.
    pub fn entry_zones(&self, zone: &[Bound], dimension: usize, out: &mut Vec<Zone>) {
        out.clear();
        let mut within = Zone::from_bounds(dimension, zone);
        if self.excluded.is_empty() {
            if self.enter(&mut within) {
                out.push(within);
            }
            return;
        }
        if within.constrain_all(&self.guard) {
            let mut rest = Federation::of_zone(dimension, within.bounds());
            self.subtract_excluded(&mut rest);
            out.extend(rest.to_zones());
            out.retain_mut(|piece| self.enter(piece));
        }
    }

    /// Replaces a zone of the source by the zone of the target, if no receiver abstains; returns
    /// whether something is left.
    pub fn enter(&self, zone: &mut Zone) -> bool {
        zone.constrain_all(&self.guard)
            && zone.assign(&self.assignments)
            && zone.constrain_all(&self.invariant)
    }

    /// The valuations from which the guard and the assignments of the move lead into the
    /// federation.
    pub fn preimage(&self, federation: &mut Federation) {
        if self.is_trivial() {
            return;
        }
        federation.constrain_all(&self.invariant);
        federation.preimage(&self.guard, &self.assignments);
        self.subtract_excluded(federation);
    }

    /// The part of a zone in which the move is possible.
    pub fn enabled_part(&self, zone: &[Bound], dimension: usize) -> Federation {
        let mut enabled = Federation::universe(dimension);
        enabled.constrain_all(&self.invariant);
        enabled.preimage(&self.guard, &self.assignments);
        enabled.intersect_zone(zone);
        // What must not hold is cut out last: outside of the zone it would make a great number of
        // zones.
        self.subtract_excluded(&mut enabled);
        enabled
    }

    fn subtract_excluded(&self, federation: &mut Federation) {
        for conjunction in &self.excluded {
            federation.subtract_conjunction(conjunction);
        }
    }
}

/// Whether a constraint holds in all of a zone.
fn holds(zone: &Zone, one: &Constraint) -> bool {
    zone.bounds()[one.left * zone.dimension() + one.right] <= one.bound
}

pub(super) fn check_limit(value: i32) -> Result<(), Failure> {
    if Bound::is_allowed(value) {
        Ok(())
    } else {
        Err(Failure::ClockLimit(value))
    }
}

/// Emitted constraints as constraints on zones; `None` if one of them never holds (a clock compared
/// with itself).
pub(super) fn to_constraints(
    emitted: &[FixedConstraint],
) -> Result<Option<Vec<Constraint>>, Failure> {
    let mut constraints = Vec::new();
    Ok(add_constraints(emitted, &mut constraints)?.then_some(constraints))
}

/// An emitted constraint as one on zones, which may compare a clock with itself.
pub(in crate::network) fn to_constraint(emitted: &FixedConstraint) -> Result<Constraint, Failure> {
    let bound = if emitted.strict {
        Bound::strict(emitted.bound)
    } else {
        Bound::weak(emitted.bound)
    };
    Ok(Constraint {
        left: emitted.left.0 as usize,
        right: emitted.right.0 as usize,
        bound: bound.ok_or(Failure::ClockLimit(emitted.bound))?,
    })
}

/// Replaces `constraints` by the emitted ones; returns false if one of them never holds.
pub(in crate::network) fn add_constraints(
    emitted: &[FixedConstraint],
    constraints: &mut Vec<Constraint>,
) -> Result<bool, Failure> {
    constraints.clear();
    for one in emitted {
        let constraint = to_constraint(one)?;
        if constraint.left != constraint.right {
            constraints.push(constraint);
        } else if constraint.bound < Bound::LE_ZERO {
            return Ok(false);
        }
    }
    Ok(true)
}

pub(super) fn to_assignment(one: &EmittedAssignment) -> Result<Assignment, Failure> {
    check_limit(one.value)?;
    let clock = one.target.0 as usize;
    if one.source == ClockId(0) {
        return Ok(Assignment::Value {
            clock,
            value: one.value,
        });
    }
    Ok(Assignment::Copy {
        clock,
        source: one.source.0 as usize,
        increment: one.value,
    })
}

/// The fewest constraints that make a zone.
pub fn conjunction(zone: &[Bound], dimension: usize) -> Vec<FixedConstraint> {
    let mut constraints = Vec::new();
    minimal::for_each_minimal(zone, dimension, |one| {
        constraints.push(FixedConstraint {
            left: ClockId(one.left as u32),
            right: ClockId(one.right as u32),
            bound: one.bound.value(),
            strict: one.bound.is_strict(),
        });
    });
    constraints
}

/// The zones of a federation as conjunctions.
pub fn conjunctions(federation: &Federation) -> Vec<Vec<FixedConstraint>> {
    let zones = federation.zones();
    zones
        .map(|zone| conjunction(zone, federation.dimension()))
        .collect()
}
