//! Conditions in code: whether they hold now, and when they will; the same arithmetic as in
//! `stochastic/span.rs`.

use super::layout::Layout;
use super::writer::Writer;
use crate::ir::{BlockId, FunctionId, Register, Relation};
use crate::stochastic::condition::{Condition, Number};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::program::{Program, Spot};

/// Writes conditions of a program.
pub(super) struct Conditions<'p, 'a> {
    pub(super) program: &'p Program<'a>,
    pub(super) layout: &'p Layout,
    /// Where functions leave doubles.
    pub(super) result: u32,
}

/// A closed interval of delays; without a low end it begins now, without a high one it never ends.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub(super) low: Option<Register>,
    pub(super) high: Option<Register>,
}

const ALL: Span = Span {
    low: None,
    high: None,
};

impl Conditions<'_, '_> {
    /// Whether all conditions of a spot can be written.
    pub(super) fn can_write(&self, spot: &Spot) -> bool {
        let is_known = |condition| !matches!(condition, Condition::Timed(_) | Condition::Curved(_));
        let mut instances = [spot.outputs, spot.inputs]
            .into_iter()
            .flat_map(|range| self.program.range(range));
        is_known(spot.invariant) && instances.all(|one| is_known(one.guard) && !one.is_binary)
    }

    /// Goes on if a condition holds now, else elsewhere.
    pub(super) fn require(
        &self,
        w: &mut Writer,
        condition: Condition,
        values: &[i32],
        otherwise: BlockId,
    ) {
        match condition {
            Condition::Always => {}
            Condition::Words(function) => require_words(w, function, values, otherwise),
            Condition::Compared(place) => {
                let comparisons = self.program.comparisons(place);
                self.require(w, comparisons.on_words, values, otherwise);
                for &(clock, relation, bound) in &comparisons.bounds {
                    let next = w.block();
                    if matches!(relation, Relation::LessEqual | Relation::GreaterEqual) {
                        // What holds without the tolerance holds with it.
                        let (value, bound) = (w.load_double(clock), self.number(w, bound, values));
                        let holds = w.compare_doubles(value, relation, bound);
                        let unclear = w.block();
                        w.branch(holds, next, unclear);
                        w.at(unclear);
                    }
                    let gap = self.gap(w, (clock, bound), values);
                    let zero = w.double(0.0);
                    let holds = w.compare_doubles(gap, relation, zero);
                    w.branch(holds, next, otherwise);
                    w.at(next);
                }
            }
            Condition::Never | Condition::Timed(_) | Condition::Curved(_) => w.jump(otherwise),
        }
    }

    /// When a condition holds; goes elsewhere if never.
    pub(super) fn span(
        &self,
        w: &mut Writer,
        condition: Condition,
        values: &[i32],
        otherwise: BlockId,
    ) -> Span {
        let Condition::Compared(place) = condition else {
            self.require(w, condition, values, otherwise);
            return ALL;
        };
        let comparisons = self.program.comparisons(place);
        self.require(w, comparisons.on_words, values, otherwise);
        let mut span = ALL;
        for &(clock, relation, bound) in &comparisons.bounds {
            let gap = self.gap(w, (clock, bound), values);
            if !matches!(bound, Number::Known(bound) if !bound.is_nan()) {
                let is_number = w.compare_doubles(gap, Relation::Equal, gap);
                w.unless(is_number, otherwise);
            }
            let one = if self.layout.is_rated(clock) {
                let slope = w.load_double(clock + 2);
                rated(w, relation, (gap, slope), otherwise)
            } else {
                compared(w, relation, gap, otherwise)
            };
            span = both(w, span, one, otherwise);
        }
        span
    }

    /// The difference of a clock and a number; 0 if they count as equal.
    fn gap(&self, w: &mut Writer, (clock, bound): (u32, Number), values: &[i32]) -> Register {
        let bound = self.number(w, bound, values);
        let value = w.load_double(clock);
        let gap = w.subtract(value, bound);
        let sizes = [value, bound, gap].map(|one| {
            let negative = w.negate(one);
            w.greatest(one, negative)
        });
        let one = w.double(1.0);
        let size = w.greatest(sizes[0], sizes[1]);
        let size = w.greatest(size, one);
        let tolerance = w.double(TOLERANCE);
        let tolerance = w.multiply(tolerance, size);
        let is_equal = w.compare_doubles(sizes[2], Relation::LessEqual, tolerance);
        w.when(is_equal, |w| {
            let zero = w.double(0.0);
            w.copy(gap, zero);
        });
        gap
    }

    /// A number that does not change as time passes.
    pub(super) fn number(&self, w: &mut Writer, number: Number, values: &[i32]) -> Register {
        match number {
            Number::Known(value) => w.double(value),
            Number::Computed(function) => {
                w.call(function, values);
                w.load_double(self.result)
            }
        }
    }
}

/// Goes on if the mask of a condition on words is not 0, else elsewhere.
fn require_words(w: &mut Writer, function: FunctionId, values: &[i32], otherwise: BlockId) {
    let arguments = values.iter().map(|&value| w.integer(value)).collect();
    let mask = w.call_for(function, arguments);
    w.unless(mask, otherwise);
}

/// When a clock with this rate that is this far above a number stands in a relation to it.
fn rated(
    w: &mut Writer,
    relation: Relation,
    (gap, slope): (Register, Register),
    otherwise: BlockId,
) -> Span {
    match relation {
        Relation::LessEqual => at_most(w, (gap, slope), false, otherwise),
        Relation::Less => at_most(w, (gap, slope), true, otherwise),
        Relation::GreaterEqual | Relation::Greater => {
            let (gap, slope) = (w.negate(gap), w.negate(slope));
            let is_strict = relation == Relation::Greater;
            at_most(w, (gap, slope), is_strict, otherwise)
        }
        Relation::Equal => {
            let (low, high, zero) = (w.double(0.0), w.double(0.0), w.double(0.0));
            let (now, ahead, done) = (w.block(), w.block(), w.block());
            let is_equal = w.compare_doubles(gap, Relation::Equal, zero);
            w.branch(is_equal, now, ahead);
            w.at(now);
            let stands_still = w.compare_doubles(slope, Relation::Equal, zero);
            let infinity = w.double(f64::INFINITY);
            w.when(stands_still, |w| w.copy(high, infinity));
            w.jump(done);
            w.at(ahead);
            let rest = w.negate(gap);
            let moment = w.divide(rest, slope);
            let is_ahead = w.compare_doubles(moment, Relation::Greater, zero);
            w.unless(is_ahead, otherwise);
            let is_finite = w.compare_doubles(moment, Relation::Less, infinity);
            w.unless(is_finite, otherwise);
            w.copy(low, moment);
            w.copy(high, moment);
            w.jump(done);
            w.at(done);
            Span {
                low: Some(low),
                high: Some(high),
            }
        }
        Relation::NotEqual => unreachable!("only conjunctions of intervals are taken apart"),
    }
}

/// When `gap + slope * t` is at most 0, or below it if `is_strict`.
fn at_most(
    w: &mut Writer,
    (gap, slope): (Register, Register),
    is_strict: bool,
    otherwise: BlockId,
) -> Span {
    let (low, high, zero) = (w.double(0.0), w.double(f64::INFINITY), w.double(0.0));
    let relation = if is_strict {
        Relation::Less
    } else {
        Relation::LessEqual
    };
    let holds = w.compare_doubles(gap, relation, zero);
    let (rising, other, done) = (w.block(), w.block(), w.block());
    let rises = w.compare_doubles(slope, Relation::Greater, zero);
    w.branch(rises, rising, other);
    w.at(rising);
    w.unless(holds, otherwise);
    let rest = w.negate(gap);
    let end = w.divide(rest, slope);
    w.copy(high, end);
    w.jump(done);
    w.at(other);
    let later = w.block();
    w.branch(holds, done, later);
    w.at(later);
    let falls = w.compare_doubles(slope, Relation::Less, zero);
    w.unless(falls, otherwise);
    let is_number = w.compare_doubles(gap, Relation::GreaterEqual, zero);
    w.unless(is_number, otherwise);
    let fall = w.negate(slope);
    let begin = w.divide(gap, fall);
    w.copy(low, begin);
    w.jump(done);
    w.at(done);
    Span {
        low: Some(low),
        high: Some(high),
    }
}

/// When a clock that is this far above a number stands in a relation to it.
fn compared(w: &mut Writer, relation: Relation, gap: Register, otherwise: BlockId) -> Span {
    let zero = w.double(0.0);
    let rest = w.negate(gap);
    match relation {
        Relation::LessEqual | Relation::Less => {
            let holds = w.compare_doubles(gap, relation, zero);
            w.unless(holds, otherwise);
            Span {
                low: None,
                high: Some(rest),
            }
        }
        Relation::GreaterEqual | Relation::Greater => Span {
            low: Some(w.greatest(rest, zero)),
            high: None,
        },
        Relation::Equal => {
            let (is_ahead, infinity) = (
                w.compare_doubles(rest, Relation::GreaterEqual, zero),
                w.double(f64::INFINITY),
            );
            w.unless(is_ahead, otherwise);
            let is_finite = w.compare_doubles(rest, Relation::Less, infinity);
            w.unless(is_finite, otherwise);
            Span {
                low: Some(rest),
                high: Some(rest),
            }
        }
        Relation::NotEqual => unreachable!("only conjunctions of intervals are taken apart"),
    }
}

/// The delays that are in both intervals; goes elsewhere if there are none.
fn both(w: &mut Writer, first: Span, second: Span, otherwise: BlockId) -> Span {
    let join = |one: Option<Register>, other: Option<Register>| one.xor(other);
    let low = match (first.low, second.low) {
        (Some(one), Some(other)) => Some(w.greatest(one, other)),
        (one, other) => join(one, other),
    };
    let high = match (first.high, second.high) {
        (Some(one), Some(other)) => Some(w.least(one, other)),
        (one, other) => join(one, other),
    };
    if let (Some(low), Some(high)) = (low, high) {
        let is_beyond = w.compare_doubles(low, Relation::Greater, high);
        let end = w.double(0.0);
        w.copy(end, high);
        w.when(is_beyond, |w| {
            // Two moments that are the same but for rounding.
            let past = w.subtract(low, high);
            let one = w.double(1.0);
            let size = w.add(one, low);
            let tolerance = w.double(TOLERANCE);
            let tolerance = w.multiply(tolerance, size);
            let is_near = w.compare_doubles(past, Relation::LessEqual, tolerance);
            w.unless(is_near, otherwise);
            w.copy(end, low);
        });
        return Span {
            low: Some(low),
            high: Some(end),
        };
    }
    Span { low, high }
}
