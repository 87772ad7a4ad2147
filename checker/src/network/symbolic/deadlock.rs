//! Deadlocks: the valuations of a state from which no move is possible, now or after any delay.
//!
//! Most states have a move for which every valuation of the zone can wait. The guard of a move
//! shows this without an operation on zones ([`hold_sometime`]). A valuation v can wait until lower
//! bounds `x >= l` and upper bounds `y <= u` hold (including those of the invariant) exactly on two
//! conditions: `y - x <= u - l` holds for v and all pairs of them, and `y <= u` holds for the upper
//! bounds of the guard. This is Fourier and Motzkin's elimination of the delay. The bound of a
//! closed zone on `y - x` decides it for all its valuations.
//!
//! Only if no move can be reached from the whole zone, the valuations before each move are
//! computed. Whether they cover the zone is decided part by part ([`Federation::includes_zone`]),
//! so that no list of remaining zones grows. The rest is computed only if it is wanted.

use crate::zones::clocks::Assignment;
use crate::zones::dbm::Constraint;
use crate::zones::future::{self, Barriers};
use crate::zones::{Bound, Federation, Zone};

use super::clock_effect::add_constraints;
use super::predicate::Extent;
use super::zone_graph::DeadlockBuffers;
use crate::network::{ClockEffect, Failure, Symbolic};

/// The valuations of a zone from which a move is possible.
enum Alive {
    /// All.
    Everywhere,
    /// Those that are in the zone and in this federation.
    Within(Federation),
}

impl Symbolic<'_> {
    /// The valuations of the zone from which no move is possible, now or after any delay.
    pub(super) fn deadlock_extent(
        &mut self,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        Ok(match self.alive(words, zone)? {
            Alive::Everywhere => Extent::Nowhere,
            Alive::Within(alive) => self.rest_of(zone, &alive),
        })
    }

    /// Whether the zone has a valuation from which no move is possible, now or after any delay.
    pub(super) fn has_deadlock(
        &mut self,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<bool, Failure> {
        Ok(match self.alive(words, zone)? {
            Alive::Everywhere => false,
            Alive::Within(alive) => !alive.includes_zone(zone),
        })
    }

    fn alive(&mut self, words: &mut [i32], zone: &[Bound]) -> Result<Alive, Failure> {
        let mut buffers = std::mem::take(&mut self.deadlock_buffers);
        let alive = self.alive_by(words, zone, &mut buffers);
        self.deadlock_buffers = buffers;
        alive
    }

    fn alive_by(
        &mut self,
        words: &mut [i32],
        own: &[Bound],
        buffers: &mut DeadlockBuffers,
    ) -> Result<Alive, Failure> {
        let may_delay = self.may_delay(words)?;
        let stopped = self.stopped(words)?;
        // If there are barriers, the zone may be one of several pieces of what time reaches.
        let future = self.future_beside_barriers(may_delay, words, own)?;
        let zone = future.as_ref().map_or(own, Zone::bounds);
        let barriers = if may_delay {
            self.barriers(words, zone)?
        } else {
            Barriers::none(self.dimension())
        };
        self.moves_within(words, zone, &mut buffers.moves)?;
        let is_witness_of_use = self.tuning().deadlock_witness;
        if is_witness_of_use && barriers.is_empty() && stopped.is_empty() {
            // Moves without guards can be reached most often.
            for is_first in [true, false] {
                if self.is_one_within_reach(words, zone, may_delay, is_first, buffers)? {
                    return Ok(Alive::Everywhere);
                }
            }
        }
        let DeadlockBuffers {
            moves,
            target,
            effect,
            needs,
            ..
        } = buffers;
        let mut alive = Federation::empty(self.dimension());
        for one in moves.iter() {
            if !self.is_enabled(one, zone)? {
                continue;
            }
            target.clear();
            target.extend_from_slice(words);
            if self.fire_into(one, target, effect)? {
                let mut before = if add_needs(effect, needs) {
                    let mut part = Federation::of_zone(self.dimension(), zone);
                    part.constrain_all(needs);
                    part
                } else {
                    effect.enabled_part(zone, self.dimension())
                };
                if !barriers.is_empty() {
                    before = future::predecessors_within(&before, &barriers);
                } else if may_delay {
                    before.down(&stopped);
                }
                alive.unite(&before);
            }
        }
        Ok(Alive::Within(alive))
    }

    /// Whether one of the moves without guards, or of the others, is certainly possible, now or
    /// later, from all of the zone.
    fn is_one_within_reach(
        &mut self,
        words: &mut [i32],
        zone: &[Bound],
        may_delay: bool,
        is_unconditional: bool,
        buffers: &mut DeadlockBuffers,
    ) -> Result<bool, Failure> {
        let DeadlockBuffers {
            moves,
            target,
            effect,
            needs,
            invariant,
        } = buffers;
        let mut has_invariant = false;
        for one in moves.iter() {
            if one.is_unconditional() != is_unconditional || !self.is_enabled(one, zone)? {
                continue;
            }
            target.clear();
            target.extend_from_slice(words);
            if !self.fire_into(one, target, effect)? || !add_needs(effect, needs) {
                continue;
            }
            let dimension = self.dimension();
            if !may_delay {
                if hold_now(needs, zone, dimension) {
                    return Ok(true);
                }
                continue;
            }
            if !has_invariant && needs.iter().any(is_lower) {
                has_invariant = true;
                invariant.clear();
                if let Some(emitted) = self.stepper.invariants(words)? {
                    add_constraints(emitted, invariant)?;
                }
            }
            if hold_sometime(needs, zone, dimension, invariant) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Everything that time reaches from the zone within the invariants, if barriers may have cut
    /// it; `None` if this is the zone.
    fn future_beside_barriers(
        &mut self,
        may_delay: bool,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Option<Zone>, Failure> {
        if !may_delay || !self.has_barriers() {
            return Ok(None);
        }
        let Some(invariant) = self.invariant(words)? else {
            return Ok(None);
        };
        let mut future = Zone::from_bounds(self.dimension(), zone);
        self.delay(words, may_delay, &invariant, future.bounds_mut())?;
        Ok(Some(future))
    }
}

/// Whether all valuations of a closed zone meet the needs.
fn hold_now(needs: &[Constraint], zone: &[Bound], dimension: usize) -> bool {
    let holds = |one: &Constraint| zone[one.left * dimension + one.right] <= one.bound;
    needs.iter().all(holds)
}

/// Whether every valuation of a closed zone can wait, within the invariant, until it meets the
/// needs. The invariant only counts if the needs have lower bounds.
fn hold_sometime(
    needs: &[Constraint],
    zone: &[Bound],
    dimension: usize,
    invariant: &[Constraint],
) -> bool {
    let bound = |left: usize, right: usize| zone[left * dimension + right];
    // Upper bounds must not have passed yet, and time does not change differences.
    let holds_still = |one: &Constraint| is_lower(one) || bound(one.left, one.right) <= one.bound;
    let comes_in_time = |low: &Constraint| {
        let mut uppers = needs.iter().chain(invariant).filter(|one| one.right == 0);
        uppers.all(|high| bound(high.left, low.right) <= high.bound + low.bound)
    };
    needs.iter().all(holds_still) && needs.iter().filter(|one| is_lower(one)).all(comes_in_time)
}

fn is_lower(constraint: &Constraint) -> bool {
    constraint.left == 0
}

/// Replaces `needs` by the condition on a valuation for the move to be possible. Returns false if
/// it is not known or never holds.
fn add_needs(effect: &ClockEffect, needs: &mut Vec<Constraint>) -> bool {
    if !effect.excluded.is_empty() {
        return false;
    }
    needs.clear();
    needs.extend_from_slice(&effect.guard);
    let is_value = |one: &Assignment| matches!(one, Assignment::Value { value, .. } if *value >= 0);
    if !effect.assignments.iter().all(is_value) {
        return false;
    }
    // The value of a clock after the assignments; the last assignment counts.
    let after = |clock: usize| {
        let mut last_first = effect.assignments.iter().rev();
        last_first.find_map(|one| match *one {
            Assignment::Value { clock: set, value } if set == clock => Some(value),
            _ => None,
        })
    };
    for one in &effect.invariant {
        let (left, right) = (after(one.left), after(one.right));
        let shifted = Constraint {
            left: left.map_or(one.left, |_| 0),
            right: right.map_or(one.right, |_| 0),
            bound: one.bound.shifted(right.unwrap_or(0) - left.unwrap_or(0)),
        };
        if shifted.left != shifted.right {
            needs.push(shifted);
        } else if shifted.bound < Bound::LE_ZERO {
            return false;
        }
    }
    true
}
