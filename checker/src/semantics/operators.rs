//! Typing of operators on integers, truth values and doubles; folding of constants; intervals of
//! results.

use super::checker::Checker;
use super::codes;
use super::typed::{Expr, Kind};
use super::types::{Class, Interval, Type};
use crate::builtins::{Code, Number};
use crate::diagnostics::Span;
use crate::exec::arithmetic;
use crate::ir::{DoubleOperator, IntegerOperator, MathFunction, Relation};
use crate::syntax::ast::BinaryOp;

impl Checker<'_> {
    /// `left operator right`, forevery binary operator.
    pub(super) fn binary(
        &mut self,
        operator: BinaryOp,
        left: Expr,
        right: Expr,
        span: Span,
    ) -> Expr {
        if left.is_error() || right.is_error() {
            return Expr::error(span);
        }
        if let Some(relation) = relation_of(operator) {
            return self.compare(relation, left, right, span);
        }
        match operator {
            BinaryOp::And => self.conjunction(left, right, span),
            BinaryOp::Or => self.disjunction(left, right, span),
            BinaryOp::Imply => {
                let negated = self.negation(left, span);
                self.disjunction(negated, right, span)
            }
            BinaryOp::Xor => self.exclusive_or(left, right, span),
            _ => self.arithmetic(operator, left, right, span),
        }
    }

    fn arithmetic(&mut self, operator: BinaryOp, left: Expr, right: Expr, span: Span) -> Expr {
        if matches!(operator, BinaryOp::Add | BinaryOp::Subtract)
            && (is_clock_term(&left) || is_clock_term(&right))
        {
            return self.add_clocks(operator == BinaryOp::Add, left, right, span);
        }
        let (left, right) = (self.clock_value(left), self.clock_value(right));
        let integer = integer_operator(operator);
        if left.ty.is_integral() && right.ty.is_integral() {
            return integer_operation(integer, left, right, span);
        }
        if operator == BinaryOp::Power && left.ty.is_number() && right.ty.is_number() {
            let operands = vec![to_double(left), to_double(right)];
            return folded_math(MathFunction::Pow, operands, span);
        }
        if let Some(double) = double_operator(operator)
            && left.ty.is_number()
            && right.ty.is_number()
        {
            return double_operation(double, to_double(left), to_double(right), span);
        }
        self.operands_refused(&left, &right, span)
    }

    /// Reports that an operator does not apply to its operands.
    pub(super) fn operands_refused(&mut self, left: &Expr, right: &Expr, span: Span) -> Expr {
        let operands = [&left.ty, &right.ty];
        let help = if operands.iter().any(|ty| ty.is_clock()) {
            "clocks can only be compared, subtracted from each other, and set"
        } else if operands.iter().any(|ty| matches!(ty, Type::Constraint(_))) {
            "join conditions on clocks by `&&`"
        } else if operands.iter().any(|ty| matches!(ty, Type::Array(_))) {
            "name a part of the array by an index: a[0]"
        } else if operands.contains(&&Type::Double) {
            "convert with fint(…), or use other operands"
        } else {
            "use numbers"
        };
        self.error(
            codes::OPERANDS_MISMATCHED,
            span,
            format!(
                "this operator does not apply to {} and {}",
                left.ty.described(),
                right.ty.described()
            ),
            help,
        )
    }

    fn compare(&mut self, relation: Relation, left: Expr, right: Expr, span: Span) -> Expr {
        if is_clock_term(&left) || is_clock_term(&right) {
            return self.compare_clocks(relation, left, right, span);
        }
        let is_equality = matches!(relation, Relation::Equal | Relation::NotEqual);
        if left.ty.is_integral() && right.ty.is_integral() {
            return compare_integers(relation, left, right, span);
        }
        if left.ty.is_number() && right.ty.is_number() {
            return compare_doubles(relation, to_double(left), to_double(right), span);
        }
        let same = left.ty.is_equivalent(&right.ty);
        if is_equality && same && matches!(left.ty, Type::Scalar { .. }) {
            return compare_integers(relation, left, right, span);
        }
        let is_data = left.ty.size().clocks + left.ty.size().channels == 0;
        let is_comparable = left.ty.has_parts_of(&right.ty);
        if is_equality && is_comparable && is_data && left.ty.is_aggregate() {
            let equal = relation == Relation::Equal;
            let kind = Kind::CompareWords(equal, Box::new(left), Box::new(right));
            return Expr::new(kind, Type::Bool, span);
        }
        self.operands_refused(&left, &right, span)
    }

    /// Checks that an expression can stand as a condition.
    pub(super) fn expect_condition(&mut self, expr: &Expr) -> bool {
        if expr.is_error() {
            return false;
        }
        if !expr.ty.is_condition() {
            self.error(
                codes::CONDITION_EXPECTED,
                expr.span,
                format!("a condition is needed, but this is {}", expr.ty.described()),
                match expr.ty {
                    Type::Channel { .. } => {
                        "a channel has no value: set a variable where it synchronises"
                    }
                    Type::String => {
                        "write names of locations and variables without quotation marks"
                    }
                    _ => "compare it with something",
                },
            );
        }
        expr.ty.is_condition()
    }

    /// Logical negation.
    pub(super) fn negation(&mut self, inner: Expr, span: Span) -> Expr {
        if !self.expect_condition(&inner) {
            return Expr::error(span);
        }
        if let Some(value) = inner.constant() {
            return Expr::bool(value == 0, span);
        }
        let ty = match inner.ty {
            Type::Constraint(_) => Type::Constraint(Class::Query),
            _ => Type::Bool,
        };
        let (low, high) = truth_interval(&inner);
        Expr::new(Kind::Not(Box::new(inner)), ty, span).within((1 - high, 1 - low))
    }

    /// `left && right`
    pub(super) fn conjunction(&mut self, left: Expr, right: Expr, span: Span) -> Expr {
        if !(self.expect_condition(&left) & self.expect_condition(&right)) {
            return Expr::error(span);
        }
        let ty = match (&left.ty, &right.ty) {
            (Type::Constraint(a), Type::Constraint(b)) => Type::Constraint(*a.max(b)),
            (Type::Constraint(class), _) | (_, Type::Constraint(class)) => Type::Constraint(*class),
            _ => Type::Bool,
        };
        match (left.constant(), right.constant()) {
            (Some(0), _) => Expr::bool(false, span),
            (Some(_), _) => as_truth(right, span),
            (_, Some(value)) if value != 0 => as_truth(left, span),
            _ => {
                let ((a, b), (c, d)) = (truth_interval(&left), truth_interval(&right));
                let kind = Kind::And(Box::new(left), Box::new(right));
                Expr::new(kind, ty, span).within((a.min(c), b.min(d)))
            }
        }
    }

    /// `left || right`
    pub(super) fn disjunction(&mut self, left: Expr, right: Expr, span: Span) -> Expr {
        if !(self.expect_condition(&left) & self.expect_condition(&right)) {
            return Expr::error(span);
        }
        let ty = match (&left.ty, &right.ty) {
            (Type::Constraint(_), Type::Constraint(_)) => Type::Constraint(Class::Query),
            (Type::Constraint(class), _) | (_, Type::Constraint(class)) => {
                Type::Constraint(match class {
                    Class::InvariantWithRate => Class::Query,
                    other => *other,
                })
            }
            _ => Type::Bool,
        };
        match (left.constant(), right.constant()) {
            (Some(0), _) => as_truth(right, span),
            (Some(_), _) => Expr::bool(true, span),
            (_, Some(0)) => as_truth(left, span),
            _ => {
                let ((a, b), (c, d)) = (truth_interval(&left), truth_interval(&right));
                let kind = Kind::Or(Box::new(left), Box::new(right));
                Expr::new(kind, ty, span).within((a.max(c), b.max(d)))
            }
        }
    }

    fn exclusive_or(&mut self, left: Expr, right: Expr, span: Span) -> Expr {
        if !(self.expect_condition(&left) & self.expect_condition(&right)) {
            return Expr::error(span);
        }
        if !(left.ty.is_integral() && right.ty.is_integral()) {
            return self.operands_refused(&left, &right, span);
        }
        let (left_span, right_span) = (left.span, right.span);
        let (left, right) = (as_truth(left, left_span), as_truth(right, right_span));
        compare_integers(Relation::NotEqual, left, right, span)
    }

    /// `-inner`
    pub(super) fn minus(&mut self, inner: Expr, span: Span) -> Expr {
        if inner.is_error() {
            return Expr::error(span);
        }
        let zero = Expr::int(0, Type::ANY_INT, span);
        let inner = self.clock_value(inner);
        if inner.ty.is_integral() {
            return integer_operation(IntegerOperator::Subtract, zero, inner, span);
        }
        if let Kind::Double(value) = inner.kind {
            return Expr::new(Kind::Double(-value), Type::Double, span);
        }
        if inner.ty == Type::Double {
            // -x is (-0.0) - x: that also gives the right sign of zero.
            let zero = Expr::new(Kind::Double(-0.0), Type::Double, span);
            return double_operation(DoubleOperator::Subtract, zero, inner, span);
        }
        self.operands_refused(&zero, &inner, span)
    }
}

/// Whether it is a clock, or a sum of clocks and an integer.
pub(super) fn is_clock_term(expr: &Expr) -> bool {
    expr.ty.is_clock() || expr.ty == Type::ClockTerm
}

/// The truth value of a condition: 0 or 1.
pub(super) fn as_truth(expr: Expr, span: Span) -> Expr {
    if !expr.ty.is_integral() || expr.ty == Type::Bool {
        return Expr { span, ..expr };
    }
    if let Some(value) = expr.constant() {
        return Expr::bool(value != 0, span);
    }
    let zero = Expr::int(0, Type::ANY_INT, span);
    compare_integers(Relation::NotEqual, expr, zero, span)
}

/// A number as a double.
pub(super) fn to_double(expr: Expr) -> Expr {
    let span = expr.span;
    if expr.ty == Type::Double {
        return expr;
    }
    match expr.constant() {
        Some(value) => Expr::new(Kind::Double(f64::from(value)), Type::Double, span),
        None => Expr::new(Kind::ToDouble(Box::new(expr)), Type::Double, span),
    }
}

/// Arithmetic on integers.
pub(super) fn integer_operation(
    operator: IntegerOperator,
    left: Expr,
    right: Expr,
    span: Span,
) -> Expr {
    if let (Some(a), Some(b)) = (left.constant(), right.constant())
        && let Some(value) = arithmetic::fitting(operator, a, b)
    {
        return Expr::int(value, Type::ANY_INT, span);
    }
    let interval = integer_interval(operator, left.interval, right.interval);
    let kind = Kind::Integer(operator, Box::new(left), Box::new(right));
    Expr::new(kind, Type::ANY_INT, span).within(interval)
}

fn double_operation(operator: DoubleOperator, left: Expr, right: Expr, span: Span) -> Expr {
    if let (Kind::Double(a), Kind::Double(b)) = (&left.kind, &right.kind) {
        let value = arithmetic::double(operator, *a, *b);
        return Expr::new(Kind::Double(value), Type::Double, span);
    }
    let kind = Kind::Real(operator, Box::new(left), Box::new(right));
    Expr::new(kind, Type::Double, span)
}

/// A comparison of integers, truth values or scalars.
pub(super) fn compare_integers(relation: Relation, left: Expr, right: Expr, span: Span) -> Expr {
    if let (Some(a), Some(b)) = (left.constant(), right.constant()) {
        return Expr::bool(arithmetic::relate(relation, a, b), span);
    }
    let interval = comparison_interval(relation, left.interval, right.interval);
    let kind = Kind::Compare(relation, Box::new(left), Box::new(right));
    Expr::new(kind, Type::Bool, span).within(interval)
}

/// The truth values of a comparison of values in these intervals.
fn comparison_interval(relation: Relation, left: Interval, right: Interval) -> Interval {
    let ((a, b), (c, d)) = (left, right);
    let (always, never) = match relation {
        Relation::Less => (b < c, a >= d),
        Relation::LessEqual => (b <= c, a > d),
        Relation::Greater => (a > d, b <= c),
        Relation::GreaterEqual => (a >= d, b < c),
        Relation::Equal => ((a, b) == (c, c) && c == d, b < c || d < a),
        Relation::NotEqual => (b < c || d < a, (a, b) == (c, c) && c == d),
    };
    (always.into(), (!never).into())
}

/// The truth values of a condition.
pub(super) fn truth_interval(condition: &Expr) -> (i32, i32) {
    match condition.interval {
        (0, 0) => (0, 0),
        (low, high) if low > 0 || high < 0 => (1, 1),
        _ => (0, 1),
    }
}

fn compare_doubles(relation: Relation, left: Expr, right: Expr, span: Span) -> Expr {
    if let (Kind::Double(a), Kind::Double(b)) = (&left.kind, &right.kind) {
        return Expr::bool(arithmetic::relate(relation, *a, *b), span);
    }
    let kind = Kind::CompareReal(relation, Box::new(left), Box::new(right));
    Expr::new(kind, Type::Bool, span)
}

/// The values of an operation whose operands have values in these intervals, where it has one.
/// Results that may not fit into 32 bits may wrap round to any value.
pub(super) fn integer_interval(
    operator: IntegerOperator,
    left: Interval,
    right: Interval,
) -> Interval {
    let ((a, b), (c, d)) = (left, right);
    let (wide_a, wide_b) = (i64::from(a), i64::from(b));
    let (wide_c, wide_d) = (i64::from(c), i64::from(d));
    let clamp = |value: i64| value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
    let fitting = |low: i64, high: i64| match (i32::try_from(low), i32::try_from(high)) {
        (Ok(low), Ok(high)) => (low, high),
        _ => (i32::MIN, i32::MAX),
    };
    let hull = |values: [i64; 4]| {
        let low = values.into_iter().fold(i64::MAX, i64::min);
        let high = values.into_iter().fold(i64::MIN, i64::max);
        fitting(low, high)
    };
    let products = [
        wide_a * wide_c,
        wide_a * wide_d,
        wide_b * wide_c,
        wide_b * wide_d,
    ];
    let magnitude = clamp(wide_a.abs().max(wide_b.abs()));
    match operator {
        IntegerOperator::Add => fitting(wide_a + wide_c, wide_b + wide_d),
        IntegerOperator::Subtract => fitting(wide_a - wide_d, wide_b - wide_c),
        IntegerOperator::Multiply => hull(products),
        IntegerOperator::Divide => divided((a, b), (c, d), magnitude),
        IntegerOperator::Remainder => {
            let most =
                clamp(wide_c.abs().max(wide_d.abs()).saturating_sub(1).max(0)).min(magnitude);
            (if a < 0 { -most } else { 0 }, if b > 0 { most } else { 0 })
        }
        IntegerOperator::Minimum => (a.min(c), b.min(d)),
        IntegerOperator::Maximum => (a.max(c), b.max(d)),
        IntegerOperator::And if a >= 0 && c >= 0 => (0, b.min(d)),
        IntegerOperator::And | IntegerOperator::ShiftRight if a >= 0 => (0, b),
        IntegerOperator::And if c >= 0 => (0, d),
        IntegerOperator::Or | IntegerOperator::Xor if a >= 0 && c >= 0 => {
            // No bit above the highest of either operand can be set.
            (0, (((b | d) as u32 + 1).next_power_of_two() - 1) as i32)
        }
        IntegerOperator::ShiftRight => (a, b.max(0)),
        _ => (i32::MIN, i32::MAX),
    }
}

/// The values of a quotient: a positive constant divisor keeps the order, any other can only change
/// the sign.
fn divided(dividend: Interval, divisor: Interval, magnitude: i32) -> Interval {
    let ((a, b), (c, d)) = (dividend, divisor);
    if c > 0 && c == d {
        return (a / c, b / c);
    }
    if a >= 0 && c >= 0 {
        return (0, b);
    }
    if a == i32::MIN && c <= -1 && -1 <= d {
        return (i32::MIN, i32::MAX);
    }
    (magnitude.saturating_neg(), magnitude)
}

fn relation_of(operator: BinaryOp) -> Option<Relation> {
    Some(match operator {
        BinaryOp::Less => Relation::Less,
        BinaryOp::LessEqual => Relation::LessEqual,
        BinaryOp::Greater => Relation::Greater,
        BinaryOp::GreaterEqual => Relation::GreaterEqual,
        BinaryOp::Equal => Relation::Equal,
        BinaryOp::NotEqual => Relation::NotEqual,
        _ => return None,
    })
}

/// The integer operator of an arithmetic operator.
pub(super) fn integer_operator(operator: BinaryOp) -> IntegerOperator {
    match operator {
        BinaryOp::Add => IntegerOperator::Add,
        BinaryOp::Subtract => IntegerOperator::Subtract,
        BinaryOp::Multiply => IntegerOperator::Multiply,
        BinaryOp::Divide => IntegerOperator::Divide,
        BinaryOp::Remainder => IntegerOperator::Remainder,
        BinaryOp::Power => IntegerOperator::Power,
        BinaryOp::ShiftLeft => IntegerOperator::ShiftLeft,
        BinaryOp::ShiftRight => IntegerOperator::ShiftRight,
        BinaryOp::Minimum => IntegerOperator::Minimum,
        BinaryOp::Maximum => IntegerOperator::Maximum,
        BinaryOp::BitAnd => IntegerOperator::And,
        BinaryOp::BitXor => IntegerOperator::Xor,
        BinaryOp::BitOr => IntegerOperator::Or,
        _ => unreachable!("comparisons and logical operators were told apart before"),
    }
}

fn double_operator(operator: BinaryOp) -> Option<DoubleOperator> {
    Some(match operator {
        BinaryOp::Add => DoubleOperator::Add,
        BinaryOp::Subtract => DoubleOperator::Subtract,
        BinaryOp::Multiply => DoubleOperator::Multiply,
        BinaryOp::Divide => DoubleOperator::Divide,
        BinaryOp::Minimum => DoubleOperator::Minimum,
        BinaryOp::Maximum => DoubleOperator::Maximum,
        _ => return None,
    })
}

/// A function of the mathematical library, evaluated if its arguments are known.
pub(super) fn folded_math(function: MathFunction, arguments: Vec<Expr>, span: Span) -> Expr {
    let ty = match function.code() {
        Code::Integer(_) | Code::ToInteger(_) => Type::ANY_INT,
        Code::Classify(_) => Type::Bool,
        Code::Unary(_) | Code::Binary(_) | Code::Scale(_) | Code::Ternary(_) => Type::Double,
    };
    let known: Option<Vec<Number>> = arguments.iter().map(number).collect();
    match known.and_then(|known| function.evaluate(&known)) {
        Some((Number::Integer(value), false)) => Expr::int(value, ty, span),
        Some((Number::Double(value), false)) => Expr::new(Kind::Double(value), ty, span),
        _ if function == MathFunction::Abs => absolute(arguments, span),
        _ => Expr::new(Kind::Math(function, arguments), ty, span),
    }
}

fn number(argument: &Expr) -> Option<Number> {
    match argument.kind {
        Kind::Double(value) => Some(Number::Double(value)),
        _ => argument.constant().map(Number::Integer),
    }
}

/// The absolute value of what is not known, but for its range.
fn absolute(arguments: Vec<Expr>, span: Span) -> Expr {
    let (low, high) = arguments[0].interval;
    let least = if low <= 0 && 0 <= high {
        0
    } else {
        low.saturating_abs().min(high.saturating_abs())
    };
    let most = low.saturating_abs().max(high.saturating_abs());
    // The least integer wraps round to itself.
    let least = if low == i32::MIN { low } else { least };
    let kind = Kind::Math(MathFunction::Abs, arguments);
    Expr::new(kind, Type::ANY_INT, span).within((least, most))
}
