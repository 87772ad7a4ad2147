//! Operations that move clocks: delay and its past, reset, assignment, freeing, and the preimage of
//! an update.
//!
//! The contract is that of [`super::dbm`]: zones are closed, consistent and positive before and
//! after. Each function writes the closed result directly, so no result needs closing.
//!
//! *Stopped* clocks (stopwatches at rate 0) keep their value while the others run. The exact set
//! after such a delay is in general not a zone. The functions with stopped clocks return the least
//! zone that contains it. UPPAAL does the same (its answers become "maybe"). Without stopped clocks
//! these functions are exact.
//!
//! Source: Bengtsson and Yi 2004, section 4.2, algorithms `up`, `down`, `free`, `reset`, `copy`,
//! `shift`; the stopped variants are derived here.
//!
//! Cost: O(n) for delay, freeing and resetting; O(n^2) for the past and for assignments that drop
//! valuations.

#![expect(
    clippy::inline_always,
    reason = "the dimension is a constant at some calls"
)]

use super::dbm::{Constraint, constrain, least_sum, upper_bounds};
use super::rows::{for_small_dimension, rows, rows_mut, with_row};
use super::{Bound, ClockSet, wide};

/// Up to this number of upper bounds, each clock looks at them one by one. If there are more, they
/// are written into a row with one bound for each clock.
const FEW_BOUNDS: usize = 4;

/// One step of an update of clocks. The steps of a list are carried out in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Assignment {
    /// `x_clock := value`; the value must be from 0 to [`Bound::MAX_VALUE`].
    Value {
        /// The clock that is set.
        clock: usize,
        /// Its new value.
        value: i32,
    },
    /// `x_clock := x_source + increment`; the magnitude of the increment must be at most
    /// [`Bound::MAX_VALUE`].
    Copy {
        /// The clock that is set.
        clock: usize,
        /// The clock whose value is taken; may be the same.
        source: usize,
        /// What is added.
        increment: i32,
    },
}

/// Lets any time pass: the zone becomes its future.
pub fn up(zone: &mut [Bound], dimension: usize) {
    zone.iter_mut()
        .step_by(dimension)
        .skip(1)
        .for_each(|bound| *bound = Bound::INFINITY);
}

/// Lets time pass as long as the constraints hold. The zone must satisfy all of them.
///
/// Only upper bounds end a delay, and the closed result differs from the future only in upper
/// bounds. Each is the least sum of a difference to some clock and the bound of that clock. All
/// other differences stay as they were. Cost: O(n) for each upper bound.
pub fn up_within(zone: &mut [Bound], dimension: usize, constraints: &[Constraint]) {
    let is_upper = |one: &&Constraint| one.right == 0 && one.left != 0;
    let count = constraints.iter().filter(is_upper).count();
    if count <= FEW_BOUNDS {
        for row in rows_mut(zone, dimension).skip(1) {
            let upper = constraints.iter().filter(is_upper);
            let sums = upper.map(|one| row[one.left].noted_sum(one.bound));
            row[0] = sums.fold(Bound::INFINITY, Bound::min);
        }
        return;
    }
    with_row(dimension, |row| {
        let upper_bounds = upper_bounds(constraints, row);
        for_small_dimension!(dimension, delay_below(zone, upper_bounds));
    });
}

#[inline(always)]
fn delay_below(zone: &mut [Bound], upper_bounds: &[Bound], dimension: usize) {
    let upper_bounds = &upper_bounds[..dimension];
    for row in rows_mut(zone, dimension).skip(1) {
        row[0] = least_sum(row, upper_bounds);
    }
}

/// Replaces the zone by the least zone that contains its future, while the clocks of `stopped` do
/// not move.
///
/// Differences between two running clocks, or two stopped ones, stay. A running clock loses its
/// upper bound against the reference clock and every stopped clock. The opposite bounds stay, since
/// a delay of 0 reaches them. If all clocks are stopped, nothing changes.
pub fn up_stopped(zone: &mut [Bound], dimension: usize, stopped: &ClockSet) {
    let running = |clock: &usize| !stopped.contains(*clock);
    for left in (1..dimension).filter(running) {
        let row = &mut zone[left * dimension..(left + 1) * dimension];
        row[0] = Bound::INFINITY;
        stopped
            .iter()
            .take_while(|right| *right < dimension)
            .for_each(|right| row[right] = Bound::INFINITY);
    }
}

/// Lets time run backwards: the zone becomes its past, the valuations that reach it by some delay.
///
/// A clock loses its lower bound, except for the part that keeps other clocks from becoming
/// negative.
pub fn down(zone: &mut [Bound], dimension: usize) {
    for_small_dimension!(dimension, lower_to_columns(zone));
}

/// Sets row 0 to the least entry of each column, not above `<= 0`.
#[inline(always)]
fn lower_to_columns(zone: &mut [Bound], dimension: usize) {
    let (lower_bounds, others) = zone.split_at_mut(dimension);
    lower_bounds.fill(Bound::LE_ZERO);
    for row in rows(others, dimension) {
        for (lower, bound) in lower_bounds.iter_mut().zip(row) {
            *lower = (*lower).min(*bound);
        }
    }
    lower_bounds[0] = Bound::LE_ZERO;
}

/// Replaces the zone by the least zone that contains its past, while the clocks of `stopped` do not
/// move.
///
/// Only bounds `x_s - x_r` between a stopped clock or the reference `s` and a running clock `r`
/// change. Every running clock limits a delay `d`, so `d` behaves like a clock with `d - x_q <= 0`
/// for all running `q`. Let `delay(y) = min over q of (q, y)` be the closed bounds of `d`. The
/// greatest `x_s - x_r + d` over the zone is a flow from `{s, d}` to `{r, 0}` along closed entries.
/// So it is the lesser of the two pairings `(s, r) + delay(0)` and `(s, 0) + delay(r)`.
pub fn down_stopped(zone: &mut [Bound], dimension: usize, stopped: &ClockSet) {
    if stopped.is_empty() {
        return down(zone, dimension);
    }
    let is_running = |clock: usize| clock != 0 && !stopped.contains(clock);
    let column_least = |zone: &[Bound], column: usize| {
        let running = (1..dimension).filter(|clock| is_running(*clock));
        running
            .map(|clock| zone[clock * dimension + column])
            .min()
            .unwrap_or(Bound::INFINITY)
    };
    let longest_delay = column_least(zone, 0);
    for right in (1..dimension).filter(|clock| is_running(*clock)) {
        let delay = column_least(zone, right);
        for left in (0..dimension).filter(|clock| !is_running(*clock)) {
            let crossed = zone[left * dimension].noted_sum(delay);
            let bound = &mut zone[left * dimension + right];
            *bound = bound.noted_sum(longest_delay).min(crossed);
        }
    }
}

/// Frees a clock: it may have any value from 0.
pub fn free_clock(zone: &mut [Bound], dimension: usize, clock: usize) {
    for row in rows_mut(zone, dimension) {
        row[clock] = row[0];
    }
    let row = &mut zone[clock * dimension..(clock + 1) * dimension];
    row.fill(Bound::INFINITY);
    row[clock] = Bound::LE_ZERO;
}

/// Sets a clock to a value from 0 to [`Bound::MAX_VALUE`].
pub fn reset(zone: &mut [Bound], dimension: usize, clock: usize, value: i32) {
    let start = clock * dimension;
    zone.copy_within(0..dimension, start);
    if value == 0 {
        for row in rows_mut(zone, dimension) {
            row[clock] = row[0];
        }
        zone[start + clock] = Bound::LE_ZERO;
        return;
    }
    wide::admit(value);
    zone[start..start + dimension]
        .iter_mut()
        .for_each(|bound| *bound = bound.shifted(value));
    for row in rows_mut(zone, dimension) {
        row[clock] = row[0].shifted(-value);
    }
    zone[start + clock] = Bound::LE_ZERO;
}

/// Sets a clock to the value of another (or its own) plus an increment; returns whether something
/// is left.
///
/// Drops the valuations that would make the clock negative. A caller that treats this as a mistake
/// must check the lower bound of `source` before.
pub fn assign_clock(
    zone: &mut [Bound],
    dimension: usize,
    clock: usize,
    source: usize,
    increment: i32,
) -> bool {
    if clock == source {
        return shift(zone, dimension, clock, increment);
    }
    if !keep_from(zone, dimension, source, increment) {
        return false;
    }
    zone.copy_within(
        source * dimension..(source + 1) * dimension,
        clock * dimension,
    );
    for bound in &mut zone[clock * dimension..(clock + 1) * dimension] {
        *bound = bound.shifted(increment);
    }
    for row in rows_mut(zone, dimension) {
        row[clock] = row[source].shifted(-increment);
    }
    zone[clock * dimension + clock] = Bound::LE_ZERO;
    true
}

/// Adds an increment to a clock; returns whether something is left. Drops the same valuations as
/// [`assign_clock`].
pub fn shift(zone: &mut [Bound], dimension: usize, clock: usize, increment: i32) -> bool {
    if !keep_from(zone, dimension, clock, increment) {
        return false;
    }
    for bound in &mut zone[clock * dimension..(clock + 1) * dimension] {
        *bound = bound.shifted(increment);
    }
    for row in rows_mut(zone, dimension) {
        row[clock] = row[clock].shifted(-increment);
    }
    zone[clock * dimension + clock] = Bound::LE_ZERO;
    true
}

/// Drops the valuations in which `clock + increment` is negative; returns whether something is
/// left.
fn keep_from(zone: &mut [Bound], dimension: usize, clock: usize, increment: i32) -> bool {
    wide::admit(increment);
    increment >= 0 || constrain(zone, dimension, 0, clock, Bound::le(increment))
}

/// Carries out the assignments in order; returns whether something is left.
pub fn assign(zone: &mut [Bound], dimension: usize, assignments: &[Assignment]) -> bool {
    assignments.iter().all(|assignment| {
        match *assignment {
            Assignment::Value { clock, value } => reset(zone, dimension, clock, value),
            Assignment::Copy {
                clock,
                source,
                increment,
            } => {
                return assign_clock(zone, dimension, clock, source, increment);
            }
        }
        true
    })
}

/// Replaces the zone by its preimage: the valuations that satisfy the guard and that the
/// assignments map into the zone. Returns whether there are any.
pub fn preimage(
    zone: &mut [Bound],
    dimension: usize,
    guard: &[Constraint],
    assignments: &[Assignment],
) -> bool {
    assignments
        .iter()
        .rev()
        .all(|assignment| unassign(zone, dimension, assignment))
        && super::dbm::constrain_all(zone, dimension, guard)
}

/// The preimage of one assignment: restricts the clock to the values that it may have got, then
/// frees it.
fn unassign(zone: &mut [Bound], dimension: usize, assignment: &Assignment) -> bool {
    let (clock, source, increment) = match *assignment {
        Assignment::Copy {
            clock,
            source,
            increment,
        } if clock == source => {
            return shift(zone, dimension, clock, -increment);
        }
        Assignment::Copy {
            clock,
            source,
            increment,
        } => (clock, source, increment),
        Assignment::Value { clock, value } => (clock, 0, value),
    };
    wide::admit(increment);
    let is_reachable = constrain(zone, dimension, clock, source, Bound::le(increment))
        && constrain(zone, dimension, source, clock, Bound::le(-increment));
    if is_reachable {
        free_clock(zone, dimension, clock);
    }
    is_reachable
}
