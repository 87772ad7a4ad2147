//! When comparisons of clocks with numbers hold, if nothing happens until then: in one interval,
//! since clocks are linear in time.
//!
//! Numbers that differ by less than [`TOLERANCE`], measured by the greater of the two and 1, are
//! equal, as in the masks that compiled code returns.

use super::condition::{Comparisons, Number};
use super::constants::TOLERANCE;
use super::failure::Failure;
use super::machine::Machine;
use crate::ir::Relation;

/// A closed interval of delays, not empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Span {
    /// All delays.
    pub(super) const ALL: Span = Span {
        low: 0.0,
        high: f64::INFINITY,
    };

    fn and(self, other: Option<Span>) -> Option<Span> {
        let other = other?;
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        if low <= high {
            return Some(Span { low, high });
        }
        // Two moments that are the same but for rounding.
        (low - high <= TOLERANCE * (1.0 + low)).then_some(Span { low, high: low })
    }
}

impl Machine<'_> {
    /// When comparisons hold, the condition on words left aside.
    #[inline]
    pub(super) fn span(
        &mut self,
        comparisons: &Comparisons,
        values: &[i32],
    ) -> Result<Option<Span>, Failure> {
        let mut span = Span::ALL;
        for &(clock, relation, bound) in &comparisons.bounds {
            let bound = self.number(bound, values)?;
            let (value, rate) = self.clock(clock);
            match span.and(compared(relation, value, bound, rate)) {
                Some(both) => span = both,
                None => return Ok(None),
            }
        }
        Ok(Some(span))
    }

    /// Whether comparisons hold now, the condition on words left aside.
    #[inline]
    pub(super) fn compare(
        &mut self,
        comparisons: &Comparisons,
        values: &[i32],
    ) -> Result<bool, Failure> {
        for &(clock, relation, bound) in &comparisons.bounds {
            let bound = self.number(bound, values)?;
            if !related(relation, self.clock(clock).0, bound) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn number(&mut self, number: Number, values: &[i32]) -> Result<f64, Failure> {
        match number {
            Number::Known(value) => Ok(value),
            Number::Computed(function) => self.real(function, values),
        }
    }
}

/// Whether a number stands in a relation to a bound.
#[inline]
fn related(relation: Relation, value: f64, bound: f64) -> bool {
    let gap = gap(value, bound);
    match relation {
        Relation::LessEqual => gap <= 0.0,
        Relation::Less => gap < 0.0,
        Relation::GreaterEqual => gap >= 0.0,
        Relation::Greater => gap > 0.0,
        Relation::Equal => gap == 0.0,
        Relation::NotEqual => gap != 0.0,
    }
}

/// The difference of two numbers; 0 if they count as equal.
#[inline]
fn gap(value: f64, bound: f64) -> f64 {
    let gap = value - bound;
    if gap.abs() <= TOLERANCE * value.abs().max(bound.abs()).max(1.0) {
        return 0.0;
    }
    gap
}

/// When a number with this slope stands in a relation to a bound.
#[inline]
fn compared(relation: Relation, value: f64, bound: f64, slope: f64) -> Option<Span> {
    let gap = gap(value, bound);
    match relation {
        Relation::LessEqual => at_most(gap, slope, false),
        Relation::Less => at_most(gap, slope, true),
        Relation::GreaterEqual => at_most(-gap, -slope, false),
        Relation::Greater => at_most(-gap, -slope, true),
        Relation::Equal => {
            if gap == 0.0 {
                let high = if slope == 0.0 { f64::INFINITY } else { 0.0 };
                return Some(Span { low: 0.0, high });
            }
            let moment = -gap / slope;
            (moment > 0.0 && moment.is_finite()).then_some(Span {
                low: moment,
                high: moment,
            })
        }
        Relation::NotEqual => unreachable!("only conjunctions of intervals are taken apart"),
    }
}

/// When `gap + slope * t` is at most 0, or below it if `is_strict`.
#[inline]
fn at_most(gap: f64, slope: f64, is_strict: bool) -> Option<Span> {
    let holds = if is_strict { gap < 0.0 } else { gap <= 0.0 };
    if slope > 0.0 {
        return holds.then(|| Span {
            low: 0.0,
            high: -gap / slope,
        });
    }
    if holds {
        return Some(Span::ALL);
    }
    // A NaN never holds.
    (slope < 0.0 && gap >= 0.0).then(|| Span {
        low: gap / -slope,
        high: f64::INFINITY,
    })
}

#[cfg(test)]
mod tests {
    #![expect(
        clippy::unnecessary_wraps,
        reason = "it is compared with what may be none"
    )]

    use super::{Span, compared};
    use crate::ir::Relation;

    fn span(low: f64, high: f64) -> Option<Span> {
        Some(Span { low, high })
    }

    #[test]
    fn a_clock_is_below_a_bound_until_it_reaches_it() {
        assert_eq!(compared(Relation::LessEqual, 1.0, 5.0, 2.0), span(0.0, 2.0));
        assert_eq!(compared(Relation::LessEqual, 5.0, 5.0, 1.0), span(0.0, 0.0));
        assert_eq!(compared(Relation::Less, 5.0, 5.0, 1.0), None);
        assert_eq!(compared(Relation::LessEqual, 6.0, 5.0, 1.0), None);
        assert_eq!(
            compared(Relation::LessEqual, 6.0, 5.0, -1.0),
            span(1.0, f64::INFINITY)
        );
        assert_eq!(compared(Relation::Less, 5.0, 5.0, 0.0), None);
        assert_eq!(
            compared(Relation::LessEqual, 5.0, 5.0, 0.0),
            Some(Span::ALL)
        );
        assert_eq!(compared(Relation::LessEqual, 0.0, f64::NAN, 1.0), None);
    }

    #[test]
    fn a_clock_is_above_a_bound_from_when_it_reaches_it() {
        assert_eq!(
            compared(Relation::GreaterEqual, 1.0, 5.0, 2.0),
            span(2.0, f64::INFINITY)
        );
        assert_eq!(compared(Relation::GreaterEqual, 1.0, 5.0, 0.0), None);
        assert_eq!(compared(Relation::Greater, 6.0, 5.0, -1.0), span(0.0, 1.0));
    }

    #[test]
    fn an_equality_is_a_moment() {
        assert_eq!(compared(Relation::Equal, 1.0, 5.0, 2.0), span(2.0, 2.0));
        assert_eq!(compared(Relation::Equal, 6.0, 5.0, 2.0), None);
        assert_eq!(
            compared(Relation::Equal, 5.0 + 1e-14, 5.0, 2.0),
            span(0.0, 0.0)
        );
        assert_eq!(compared(Relation::Equal, 1.0, 5.0, 0.0), None);
    }
}
