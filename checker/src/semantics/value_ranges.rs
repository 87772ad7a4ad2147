//! Between which numbers a value always lies, where that is easy to see: integers of declared
//! ranges, conditions, and doubles that are computed from them.
//!
//! The operations are monotone in each argument also when they round, so the ends of ranges are
//! those of the results.

use super::typed::{Expr, Kind};
use crate::ir::DoubleOperator;

/// How much the greatest value of an `int` without a declared range is above the least.
const WIDTH_OF_INT: i64 = 65_535;

/// The range of an expression; `None` if it is not known. The range of `int` says nothing of a
/// value: it is there because no other one was declared.
pub(super) fn range(expr: &Expr) -> Option<(f64, f64)> {
    if expr.ty.is_integral() {
        let (low, high) = expr.interval;
        let is_known = low <= high && i64::from(high) - i64::from(low) < WIDTH_OF_INT;
        return is_known.then_some((f64::from(low), f64::from(high)));
    }
    match &expr.kind {
        Kind::Double(value) => value.is_finite().then_some((*value, *value)),
        Kind::ToDouble(integer) => range(integer),
        Kind::Ternary(_, then, otherwise) => {
            let (one, other) = (range(then)?, range(otherwise)?);
            Some((one.0.min(other.0), one.1.max(other.1)))
        }
        Kind::Real(operator, left, right) => {
            let ((a, b), (c, d)) = (range(left)?, range(right)?);
            let (low, high) = match operator {
                DoubleOperator::Add => (a + c, b + d),
                DoubleOperator::Subtract => (a - d, b - c),
                DoubleOperator::Multiply => {
                    let ends = [a * c, a * d, b * c, b * d];
                    let least = ends.iter().copied().fold(f64::INFINITY, f64::min);
                    let greatest = ends.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                    (least, greatest)
                }
                DoubleOperator::Minimum => (a.min(c), b.min(d)),
                DoubleOperator::Maximum => (a.max(c), b.max(d)),
                DoubleOperator::Divide => return None,
            };
            (low.is_finite() && high.is_finite()).then_some((low, high))
        }
        _ => None,
    }
}
