//! Conditions: whether they hold now, and when they will, if nothing happens until then: in one
//! interval, since clocks are linear in time.
//!
//! Numbers that differ by less than [`TOLERANCE`], measured by the greater of the two and 1, are
//! equal, as in the masks that compiled code returns.

use std::cell::Cell;

use super::{Backend, Flow};
use crate::ir::Relation;
use crate::stochastic::condition::{Condition, Number};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::program::Program;

/// A closed interval of delays; without a low end it begins now, without a high one it never ends.
#[derive(Clone, Copy)]
pub(in crate::stochastic) struct Span<R> {
    pub(in crate::stochastic) low: Option<R>,
    pub(in crate::stochastic) high: Option<R>,
}

impl<R> Span<R> {
    /// All delays.
    pub(super) const ALL: Span<R> = Span {
        low: None,
        high: None,
    };
}

impl<R: Copy> Span<R> {
    /// A variable that begins with its low end.
    pub(super) fn begin<B: Backend<Real = R>>(self, b: &mut B) -> Cell<R> {
        match self.low {
            None => b.real_variable(0.0),
            Some(low) => b.copy_of(low),
        }
    }

    /// The moment so long after its low end.
    pub(super) fn after<B: Backend<Real = R>>(self, b: &mut B, passed: R) -> R {
        self.low.map_or(passed, |low| b.add(low, passed))
    }
}

/// Goes on if a condition holds now, else leaves.
pub(in crate::stochastic) fn require<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    condition: Condition,
    values: &[i32],
    otherwise: B::Exit,
) -> Flow<B> {
    match condition {
        Condition::Always => Ok(()),
        Condition::Never => b.leave(otherwise),
        Condition::Words(function) => {
            let holds = b.call(function, values)?;
            b.unless(holds, otherwise)
        }
        Condition::Compared(place) => {
            let comparisons = program.comparisons(place);
            require(b, program, comparisons.on_words, values, otherwise)?;
            for &(clock, relation, bound) in &comparisons.bounds {
                let unclear = |b: &mut B| {
                    let gap = gap(b, clock, bound, values)?;
                    let holds = b.compare_real_to(gap, relation, 0.0);
                    b.unless(holds, otherwise)
                };
                if matches!(relation, Relation::LessEqual | Relation::GreaterEqual) {
                    // What holds without the tolerance holds with it.
                    let value = b.load_real(clock);
                    let bound = number(b, bound, values)?;
                    let holds = b.compare_reals(value, relation, bound);
                    b.choose(holds, |_| Ok(()), unclear)?;
                } else {
                    unclear(b)?;
                }
            }
            Ok(())
        }
        Condition::Timed(_) | Condition::Curved(_) => {
            let holds = b.holds(condition, values)?;
            b.unless(holds, otherwise)
        }
    }
}

/// When a condition holds; leaves if never.
pub(in crate::stochastic) fn span<B: Backend>(
    b: &mut B,
    program: &Program<'_>,
    condition: Condition,
    values: &[i32],
    otherwise: B::Exit,
) -> Flow<B, Span<B::Real>> {
    let Condition::Compared(place) = condition else {
        require(b, program, condition, values, otherwise)?;
        return Ok(Span::ALL);
    };
    let comparisons = program.comparisons(place);
    require(b, program, comparisons.on_words, values, otherwise)?;
    let mut span = Span::ALL;
    for &(clock, relation, bound) in &comparisons.bounds {
        let gap = gap(b, clock, bound, values)?;
        if !matches!(bound, Number::Known(bound) if !bound.is_nan()) {
            let is_number = b.compare_reals(gap, Relation::Equal, gap);
            b.unless(is_number, otherwise)?;
        }
        let one = if b.is_rated(clock) {
            let slope = b.load_real(clock + 2);
            rated(b, relation, gap, slope, otherwise)?
        } else {
            compared(b, relation, gap, otherwise)?
        };
        span = both(b, span, one, otherwise)?;
    }
    Ok(span)
}

/// The difference of a clock and a number; 0 if they count as equal.
fn gap<B: Backend>(b: &mut B, clock: u32, bound: Number, values: &[i32]) -> Flow<B, B::Real> {
    let bound = number(b, bound, values)?;
    let value = b.load_real(clock);
    let gap = b.subtract(value, bound);
    let [value, bound, distance] = [value, bound, gap].map(|one| size(b, one));
    let one = b.real(1.0);
    let largest = b.greatest(value, bound);
    let largest = b.greatest(largest, one);
    let tolerance = b.real(TOLERANCE);
    let tolerance = b.multiply(tolerance, largest);
    let is_equal = b.compare_reals(distance, Relation::LessEqual, tolerance);
    let gap = Cell::new(gap);
    b.when(is_equal, |b| {
        let zero = b.real(0.0);
        b.set_real(&gap, zero);
        Ok(())
    })?;
    Ok(gap.get())
}

/// How far a number is from 0.
pub(in crate::stochastic) fn size<B: Backend>(b: &mut B, value: B::Real) -> B::Real {
    let negative = b.negate(value);
    b.greatest(value, negative)
}

/// A number that does not change as time passes.
pub(in crate::stochastic) fn number<B: Backend>(
    b: &mut B,
    number: Number,
    values: &[i32],
) -> Flow<B, B::Real> {
    match number {
        Number::Known(value) => Ok(b.real(value)),
        Number::Computed(function) => b.call_for_real(function, values),
    }
}

/// When a clock with this rate that is this far above a number stands in a relation to it.
fn rated<B: Backend>(
    b: &mut B,
    relation: Relation,
    gap: B::Real,
    slope: B::Real,
    otherwise: B::Exit,
) -> Flow<B, Span<B::Real>> {
    match relation {
        Relation::LessEqual | Relation::Less => at_most(b, relation, gap, slope, otherwise),
        Relation::GreaterEqual | Relation::Greater => {
            let (gap, slope) = (b.negate(gap), b.negate(slope));
            at_most(b, relation.swapped(), gap, slope, otherwise)
        }
        Relation::Equal => {
            let (low, high) = (b.real_variable(0.0), b.real_variable(0.0));
            let is_equal = b.compare_real_to(gap, Relation::Equal, 0.0);
            b.choose(
                is_equal,
                |b| {
                    let stands_still = b.compare_real_to(slope, Relation::Equal, 0.0);
                    b.when(stands_still, |b| {
                        let infinity = b.real(f64::INFINITY);
                        b.set_real(&high, infinity);
                        Ok(())
                    })
                },
                |b| {
                    let rest = b.negate(gap);
                    let moment = b.divide(rest, slope);
                    let is_ahead = b.compare_real_to(moment, Relation::Greater, 0.0);
                    b.unless(is_ahead, otherwise)?;
                    let is_finite = b.compare_real_to(moment, Relation::Less, f64::INFINITY);
                    b.unless(is_finite, otherwise)?;
                    b.set_real(&low, moment);
                    b.set_real(&high, moment);
                    Ok(())
                },
            )?;
            Ok(Span {
                low: Some(low.get()),
                high: Some(high.get()),
            })
        }
        Relation::NotEqual => unreachable!("only conjunctions of intervals are taken apart"),
    }
}

/// When `gap + slope * t` is at most 0, or below it.
fn at_most<B: Backend>(
    b: &mut B,
    relation: Relation,
    gap: B::Real,
    slope: B::Real,
    otherwise: B::Exit,
) -> Flow<B, Span<B::Real>> {
    let (low, high) = (b.real_variable(0.0), b.real_variable(f64::INFINITY));
    let holds = b.compare_real_to(gap, relation, 0.0);
    let rises = b.compare_real_to(slope, Relation::Greater, 0.0);
    b.choose(
        rises,
        |b| {
            b.unless(holds, otherwise)?;
            let rest = b.negate(gap);
            let end = b.divide(rest, slope);
            b.set_real(&high, end);
            Ok(())
        },
        |b| {
            b.choose(
                holds,
                |_| Ok(()),
                |b| {
                    // A NaN never holds.
                    let falls = b.compare_real_to(slope, Relation::Less, 0.0);
                    b.unless(falls, otherwise)?;
                    let is_above = b.compare_real_to(gap, Relation::GreaterEqual, 0.0);
                    b.unless(is_above, otherwise)?;
                    let fall = b.negate(slope);
                    let begin = b.divide(gap, fall);
                    b.set_real(&low, begin);
                    Ok(())
                },
            )
        },
    )?;
    Ok(Span {
        low: Some(low.get()),
        high: Some(high.get()),
    })
}

/// When a clock that is this far above a number stands in a relation to it.
fn compared<B: Backend>(
    b: &mut B,
    relation: Relation,
    gap: B::Real,
    otherwise: B::Exit,
) -> Flow<B, Span<B::Real>> {
    let rest = b.negate(gap);
    match relation {
        Relation::LessEqual | Relation::Less => {
            let holds = b.compare_real_to(gap, relation, 0.0);
            b.unless(holds, otherwise)?;
            Ok(Span {
                low: None,
                high: Some(rest),
            })
        }
        Relation::GreaterEqual | Relation::Greater => {
            let zero = b.real(0.0);
            Ok(Span {
                low: Some(b.greatest(rest, zero)),
                high: None,
            })
        }
        Relation::Equal => {
            let is_ahead = b.compare_real_to(rest, Relation::GreaterEqual, 0.0);
            b.unless(is_ahead, otherwise)?;
            let is_finite = b.compare_real_to(rest, Relation::Less, f64::INFINITY);
            b.unless(is_finite, otherwise)?;
            Ok(Span {
                low: Some(rest),
                high: Some(rest),
            })
        }
        Relation::NotEqual => unreachable!("only conjunctions of intervals are taken apart"),
    }
}

/// The delays that are in both intervals; leaves if there are none.
fn both<B: Backend>(
    b: &mut B,
    first: Span<B::Real>,
    second: Span<B::Real>,
    otherwise: B::Exit,
) -> Flow<B, Span<B::Real>> {
    let low = match (first.low, second.low) {
        (Some(one), Some(other)) => Some(b.greatest(one, other)),
        (one, other) => one.or(other),
    };
    let high = match (first.high, second.high) {
        (Some(one), Some(other)) => Some(b.least(one, other)),
        (one, other) => one.or(other),
    };
    let (Some(low), Some(high)) = (low, high) else {
        return Ok(Span { low, high });
    };
    let is_beyond = b.compare_reals(low, Relation::Greater, high);
    let end = b.copy_of(high);
    b.when(is_beyond, |b| {
        // Two moments that are the same but for rounding.
        let past = b.subtract(low, high);
        let one = b.real(1.0);
        let size = b.add(one, low);
        let tolerance = b.real(TOLERANCE);
        let tolerance = b.multiply(tolerance, size);
        let is_near = b.compare_reals(past, Relation::LessEqual, tolerance);
        b.unless(is_near, otherwise)?;
        b.set_real(&end, low);
        Ok(())
    })?;
    Ok(Span {
        low: Some(low),
        high: Some(end.get()),
    })
}
