//! Expressions on clocks: sums, comparisons, rates, assignments; and which class a condition on
//! clocks is of.
//!
//! `x < c`, `x <= c`, `x > c`, `x >= c` and the same for differences can stand anywhere; equalities
//! in guards and queries; inequalities, negations and disjunctions of such conditions in queries
//! only. That keeps guards and invariants convex.
//!
//! Source: the classification of UPPAAL's type checker.

use super::checker::Checker;
use super::codes;
use super::offsets::state_offset;
use super::operators::{integer_operation, is_clock_term, to_double};
use super::typed::{ClockRelation, ClockSum, Expr, Kind};
use super::types::{Class, Memory, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{CLOCK_LIMIT, ClockId, IntegerOperator, Relation};
use crate::syntax::ast::BinaryOp;

impl Checker<'_> {
    /// `left + right` or `left - right` where one is a clock or a sum with one.
    pub(super) fn add_clocks(&mut self, is_sum: bool, left: Expr, right: Expr, span: Span) -> Expr {
        let (left, right) = (integral_double(left), integral_double(right));
        if left.ty == Type::Double || right.ty == Type::Double {
            return self.add_clock_values(is_sum, left, right, span);
        }
        let is_term = |e: &Expr| is_clock_term(e) || e.ty.is_integral();
        if !is_term(&left) || !is_term(&right) {
            return self.operands_refused(&left, &right, span);
        }
        let (left_sum, right_sum) = (into_sum(left.clone()), into_sum(right.clone()));
        let right_sum = if is_sum {
            right_sum
        } else {
            negated(right_sum, span)
        };
        match added(left_sum, right_sum, span) {
            Some(sum) => Expr::new(Kind::ClockSum(sum), Type::ClockTerm, span),
            None => self.add_clock_values(is_sum, left, right, span),
        }
    }

    fn add_clock_values(&mut self, is_sum: bool, left: Expr, right: Expr, span: Span) -> Expr {
        // A sum of clocks is one mistake, if it is one.
        let (left, right) = (Expr { span, ..left }, Expr { span, ..right });
        let (left, right) = (self.clock_value(left), self.clock_value(right));
        let operator = if is_sum {
            BinaryOp::Add
        } else {
            BinaryOp::Subtract
        };
        self.binary(operator, left, right, span)
    }

    /// A clock as a number; anything else as it is. Whether that can be is decided where it is
    /// used.
    pub(super) fn clock_value(&mut self, expr: Expr) -> Expr {
        if !is_clock_term(&expr) {
            return expr;
        }
        let diagnostic = Diagnostic::new(
            codes::CLOCK_AS_NUMBER,
            expr.span,
            "the value of a clock is not a number here: it is known only symbolically",
        );
        let diagnostic = diagnostic.help("compare the clock in a guard instead");
        self.unknown(diagnostic, expr, Type::Double)
    }

    /// Reports a comparison of what clocks are not compared as.
    pub(super) fn too_many_clocks(&mut self, span: Span) {
        self.error(
            codes::CLOCKS_BEYOND_DIFFERENCE,
            span,
            "only single clocks and differences of two clocks can be compared",
            "write x - y < c, x < y + c or x < c",
        );
    }

    fn clock_as_number(&mut self, left: &Expr, right: &Expr, span: Span) -> Expr {
        if left.is_error() || right.is_error() {
            return Expr::error(span);
        }
        if !(left.ty == Type::Double || right.ty == Type::Double) {
            return self.operands_refused(left, right, span);
        }
        self.clock_with_double(span);
        Expr::error(span)
    }

    /// Reports that a clock meets a double.
    pub(super) fn clock_with_double(&mut self, span: Span) {
        self.report(clock_with_double(span));
    }

    /// A comparison in which at least one side is a clock or a sum with one.
    pub(super) fn compare_clocks(
        &mut self,
        relation: Relation,
        left: Expr,
        right: Expr,
        span: Span,
    ) -> Expr {
        let (left, right) = (integral_double(left), integral_double(right));
        let is_term = |e: &Expr| is_clock_term(e) || e.ty.is_integral();
        if !is_term(&left) || !is_term(&right) {
            let is_number = |e: &Expr| is_clock_term(e) || e.ty.is_number();
            if self.is_query || !is_number(&left) || !is_number(&right) {
                return self.clock_as_number(&left, &right, span);
            }
            let kind = Kind::CompareReal(relation, Box::new(left), Box::new(right));
            let compared = Expr::new(kind, Type::Bool, span);
            return self.unknown(clock_with_double(span), compared, Type::Bool);
        }
        let (left, right, relation) = match relation {
            Relation::Greater => (right, left, ClockRelation::Less),
            Relation::GreaterEqual => (right, left, ClockRelation::LessEqual),
            Relation::Less => (left, right, ClockRelation::Less),
            Relation::LessEqual => (left, right, ClockRelation::LessEqual),
            Relation::Equal => (left, right, ClockRelation::Equal),
            Relation::NotEqual => (left, right, ClockRelation::NotEqual),
        };
        let (mut left, mut right) = (into_sum(left), into_sum(right));
        let offsets = (left.offset.take(), right.offset.take());
        let Some(sum) = added(left, negated(right, span), span) else {
            self.too_many_clocks(span);
            return Expr::error(span);
        };
        let (bound, is_negated) = match offsets {
            (None, None) => (Expr::int(0, Type::ANY_INT, span), false),
            (None, Some(bound)) => (*bound, false),
            (Some(bound), None) => (*bound, true),
            (Some(minus), Some(plus)) => (
                integer_operation(IntegerOperator::Subtract, *plus, *minus, span),
                false,
            ),
        };
        self.check_bound(&bound);
        let class = match relation {
            ClockRelation::Less | ClockRelation::LessEqual => Class::Invariant,
            ClockRelation::Equal => Class::Guard,
            ClockRelation::NotEqual => Class::Query,
        };
        let kind = Kind::ClockCompare {
            relation,
            left: sum.plus,
            right: sum.minus,
            bound: Box::new(bound),
            negated: is_negated,
        };
        let compared = Expr::new(kind, Type::Constraint(class), span);
        match self.hybrid_comparison(&compared) {
            Some(diagnostic) if self.is_query => {
                self.report(diagnostic);
                compared
            }
            Some(diagnostic) => self.unknown(diagnostic, compared, Type::Bool),
            None => compared,
        }
    }

    fn check_bound(&mut self, bound: &Expr) {
        if let Some(value) = bound.constant()
            && value.unsigned_abs() > CLOCK_LIMIT.unsigned_abs()
        {
            self.error(
                codes::CLOCK_BOUND_TOO_LARGE,
                bound.span,
                format!("a clock is compared with {value}; the limit is {CLOCK_LIMIT}"),
                "measure time in a larger unit",
            );
        }
    }

    /// `clock' == rate`; `before` is how many values of clocks were used before the two were
    /// checked.
    pub(super) fn rate(&mut self, clock: Expr, rate: Expr, before: usize, span: Span) -> Expr {
        if clock.is_error() || rate.is_error() {
            return Expr::error(span);
        }
        if clock.ty == Type::RealClock && rate.ty.is_number() {
            let kind = Kind::Rate {
                clock: Box::new(clock),
                rate: Box::new(to_double(rate)),
            };
            return Expr::new(kind, Type::Constraint(Class::InvariantWithRate), span);
        }
        let Type::Clock { hybrid } = clock.ty else {
            self.error(
                codes::RATE_OF_NO_CLOCK,
                clock.span,
                format!(
                    "only clocks have a rate, but this is {}",
                    clock.ty.described()
                ),
                "write x' for a clock x",
            );
            return Expr::error(span);
        };
        let nothing = Expr::new(
            Kind::Int(1),
            Type::Constraint(Class::InvariantWithRate),
            span,
        );
        if hybrid && !self.is_query {
            // Nothing depends on a hybrid clock, so its rate may depend on anything.
            self.unknowns.truncate(before);
            return nothing;
        }
        let rate = integral_double(rate);
        if rate.constant() == Some(1) && !self.is_query {
            // That is the rate of any clock.
            return nothing;
        }
        let outside = rate.interval.1 < 0 || rate.interval.0 > 1;
        if !rate.ty.is_integral() || outside {
            let diagnostic = Diagnostic::new(
                codes::RATE_NOT_ZERO_OR_ONE,
                rate.span,
                "only the rates 0 and 1 are supported on clocks that conditions depend on",
            )
            .help("keep the clock out of guards, invariants and functions, or let it run at the rates 0 and 1");
            self.candidate(clock.variable(), &diagnostic);
            self.report(diagnostic);
            return Expr::error(span);
        }
        let kind = Kind::Rate {
            clock: Box::new(clock),
            rate: Box::new(rate),
        };
        Expr::new(kind, Type::Constraint(Class::InvariantWithRate), span)
    }

    /// `clock := value`; `before` is how many values of clocks were used before the two were
    /// checked.
    pub(super) fn assign_clock(
        &mut self,
        target: Expr,
        value: Expr,
        before: usize,
        span: Span,
    ) -> Expr {
        let ty = target.ty.clone();
        if ty == (Type::Clock { hybrid: true }) {
            // Nothing depends on a hybrid clock; only the side effects of the value remain.
            if value.has_effect() {
                return value;
            }
            self.unknowns.truncate(before);
            return Expr::new(Kind::Int(0), Type::Void, span);
        }
        let value = integral_double(value);
        let sum = if is_clock_term(&value) || value.ty.is_integral() {
            into_sum(value)
        } else {
            if value.ty == Type::Double {
                self.candidate(target.variable(), &clock_with_double(span));
            }
            return self.clock_as_number(&target, &value, span);
        };
        if sum.minus.is_some() {
            let diagnostic = Diagnostic::new(
                codes::CLOCK_SET_TO_DIFFERENCE,
                span,
                "a clock cannot be set to a difference of clocks",
            )
            .help("set it to an integer, or to a clock plus an integer");
            self.candidate(target.variable(), &diagnostic);
            self.report(diagnostic);
            return Expr::error(span);
        }
        let mut sum = sum;
        if let Some(source) = sum
            .plus
            .take_if(|source| source.ty == (Type::Clock { hybrid: true }))
        {
            let diagnostic = Diagnostic::new(
                codes::HYBRID_CLOCK_COMPARED,
                span,
                "the values of hybrid clocks are not known in symbolic and game queries, so no ordinary clock can take one",
            )
            .help("use an ordinary clock, or make both hybrid");
            self.candidate(target.variable(), &diagnostic);
            let ty = source.ty.clone();
            sum.plus = Some(Box::new(self.unknown(diagnostic, *source, ty)));
        }
        if let Some(value) = &sum.offset {
            self.check_bound(value);
        }
        let kind = Kind::AssignClock {
            target: Box::new(target),
            source: sum.plus,
            value: sum.offset,
        };
        Expr::new(kind, ty, span)
    }

    /// The report about a comparison that depends on hybrid clocks, which are ignored.
    fn hybrid_comparison(&self, compared: &Expr) -> Option<Diagnostic> {
        let Kind::ClockCompare { left, right, .. } = &compared.kind else {
            return None;
        };
        let hybrid = Type::Clock { hybrid: true };
        let mut clocks = left.iter().chain(right);
        let clock = clocks.find(|clock| clock.ty == hybrid)?;
        let cause = clock
            .variable()
            .and_then(|place| self.cause_of(place.declared));
        let Some(cause) = cause else {
            let message =
                "symbolic and game queries ignore hybrid clocks, so they cannot be compared";
            return Some(
                Diagnostic::new(codes::HYBRID_CLOCK_COMPARED, compared.span, message)
                    .help("use an ordinary clock, or keep the hybrid one out of conditions"),
            );
        };
        let line = self.sources.position(cause.span).line;
        Some(
            Diagnostic::new(
                codes::HYBRID_CLOCK_COMPARED,
                compared.span,
                "symbolic and game queries ignore this clock, so it cannot be compared",
            )
            .note(format!("line {line}: {}", cause.message))
            .help("fix that, or keep the clock out of conditions"),
        )
    }

    /// Whether the place is one known clock, and which.
    pub(super) fn known_clock(expr: &Expr) -> Option<ClockId> {
        state_offset(expr, Memory::Clocks).map(ClockId)
    }
}

fn clock_with_double(span: Span) -> Diagnostic {
    Diagnostic::new(
        codes::CLOCK_WITH_DOUBLE,
        span,
        "a clock and a double cannot be combined: clocks have exact, symbolic values",
    )
    .help("use integers for clocks; fint(…) truncates a double")
}

/// A double constant without fraction as the integer that it is.
pub(super) fn integral_double(expr: Expr) -> Expr {
    match expr.kind {
        Kind::Double(value) if value.fract() == 0.0 && value.abs() <= f64::from(CLOCK_LIMIT) => {
            Expr::int(value as i32, Type::ANY_INT, expr.span)
        }
        _ => expr,
    }
}

fn into_sum(expr: Expr) -> ClockSum {
    match expr.kind {
        Kind::ClockSum(sum) => sum,
        _ if expr.ty.is_clock() => ClockSum {
            plus: Some(Box::new(expr)),
            ..ClockSum::default()
        },
        _ => ClockSum {
            offset: Some(Box::new(expr)),
            ..ClockSum::default()
        },
    }
}

fn negated(sum: ClockSum, span: Span) -> ClockSum {
    let zero = Expr::int(0, Type::ANY_INT, span);
    ClockSum {
        plus: sum.minus,
        minus: sum.plus,
        offset: sum
            .offset
            .map(|offset| integer_operation(IntegerOperator::Subtract, zero, *offset, span))
            .map(Box::new),
    }
}

/// The sum of two, if it has at most one clock of each sign.
fn added(left: ClockSum, right: ClockSum, span: Span) -> Option<ClockSum> {
    let one = |a: Option<Box<Expr>>, b: Option<Box<Expr>>| match (a, b) {
        (Some(_), Some(_)) => None,
        (a, b) => Some(a.or(b)),
    };
    let offset = match (left.offset, right.offset) {
        (Some(a), Some(b)) => Some(Box::new(integer_operation(
            IntegerOperator::Add,
            *a,
            *b,
            span,
        ))),
        (a, b) => a.or(b),
    };
    Some(ClockSum {
        plus: one(left.plus, right.plus)?,
        minus: one(left.minus, right.minus)?,
        offset,
    })
}
