//! From the expressions of the syntax tree to typed ones: names, parts, assignments, quantifiers.

use super::checker::Checker;
use super::codes;
use super::externals::unescaped;
use super::offsets::{known_offset, possible_offsets};
use super::operators::{is_clock_term, to_double};
use super::scope::Entity;
use super::typed::{Element, Expr, Kind, Place, Root};
use super::types::{Class, Index, Memory, Size, Type};
use crate::cancellation;
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::syntax::ast::{self, BinaryOp, ExprKind, Name, UnaryOp};

/// What it takes to check a node of an expression: see [`cancellation::work`].
const UNITS_FOR_EXPRESSION: usize = 256;

impl Checker<'_> {
    /// Checks an expression that stands for a value.
    pub(super) fn expression(&mut self, expr: &ast::Expr) -> Expr {
        read(self.place(expr))
    }

    /// Checks an expression that may stand for a place: a real clock is not read.
    pub(super) fn place(&mut self, expr: &ast::Expr) -> Expr {
        cancellation::work(UNITS_FOR_EXPRESSION);
        let span = expr.span;
        match &expr.kind {
            ExprKind::Int(value) => self.integer_literal(*value, span),
            ExprKind::Double(value) => Expr::new(Kind::Double(*value), Type::Double, span),
            ExprKind::Bool(value) => Expr::bool(*value, span),
            ExprKind::String(text) => Expr::new(Kind::Text(unescaped(text)), Type::String, span),
            ExprKind::Name(name) => self.name(name, span),
            ExprKind::Field(record, name) => self.field(record, name, span),
            ExprKind::Index(array, index) => self.index(array, index, span),
            ExprKind::Call(callee, arguments) => self.call(callee, arguments, span),
            ExprKind::Unary(operator, inner) => self.unary(*operator, inner, span),
            ExprKind::Binary(operator, left, right) => {
                self.binary_expression(*operator, left, right, span)
            }
            ExprKind::Ternary(condition, then, otherwise) => {
                let condition = self.expression(condition);
                let then = self.expression(then);
                let otherwise = self.expression(otherwise);
                self.ternary(condition, then, otherwise, span)
            }
            ExprKind::Assign(operator, target, value) => {
                let before = self.unknowns.len();
                let target = self.place(target);
                let behind = self.unknowns.len();
                let value = self.expression(value);
                match operator {
                    None => self.assignment(target, value, before..behind, span),
                    Some(operator) => self.compound(*operator, target, value, span),
                }
            }
            ExprKind::Step {
                target,
                delta,
                postfix,
            } => {
                let target = self.place(target);
                self.step(target, *delta, *postfix, span)
            }
            ExprKind::Rate(inner) => {
                self.expression(inner);
                self.error(
                    codes::RATE_MISPLACED,
                    span,
                    "the rate of a clock can only be set by == in an invariant",
                    "write x' == 0 as a conjunct of an invariant",
                )
            }
            ExprKind::Quantifier {
                quantifier,
                name,
                ty,
                body,
            } => self.quantifier(*quantifier, name, ty, body, span),
            ExprKind::Spawn(template, arguments) => self.spawn(template, arguments, span),
            ExprKind::Exit => self.misplaced_exit(span),
            ExprKind::NumberOf(template) => self.number_of(template, span),
            ExprKind::Deadlock => self.deadlock(span),
            ExprKind::Error => self.reported_by_parser(span),
            ExprKind::Unsupported => self.unsupported(span),
        }
    }

    /// A literal; the parser has reported those beyond 32 bits.
    fn integer_literal(&mut self, value: i64, span: Span) -> Expr {
        match i32::try_from(value) {
            Ok(value) => Expr::int(value, Type::ANY_INT, span),
            Err(_) => self.reported_by_parser(span),
        }
    }

    fn deadlock(&mut self, span: Span) -> Expr {
        if self.is_query {
            return Expr::new(Kind::Deadlock, Type::Constraint(Class::Query), span);
        }
        self.name("deadlock", span)
    }

    fn name(&mut self, name: &str, span: Span) -> Expr {
        match self.lookup(name) {
            Some(Entity::Constant { value, .. }) => Expr { span, ..value },
            Some(Entity::Variable { place, ty }) => self.variable(place, ty, span),
            Some(Entity::Broken) => Expr::error(span),
            Some(entity) => {
                let help = self.instead_of_value(name, &entity);
                self.error(
                    codes::NAME_WITHOUT_VALUE,
                    span,
                    format!("'{name}' is {}, not a value", entity.kind()),
                    &help,
                )
            }
            None => {
                self.unknown_name(name, span);
                Expr::error(span)
            }
        }
    }

    /// A variable, or its value if it is a constant.
    pub(super) fn variable(&mut self, place: Place, ty: Type, span: Span) -> Expr {
        if ty.is_error() {
            return Expr::error(span);
        }
        let expr = self.folded(Expr::new(Kind::Variable(place), ty, span));
        self.unless_left_out(expr)
    }

    fn field(&mut self, record: &ast::Expr, name: &Name, span: Span) -> Expr {
        if let Some(member) = self.process_member(record, name, span) {
            return member;
        }
        let record = self.expression(record);
        let record = self.place_left_out(record);
        if record.is_error() {
            return Expr::error(span);
        }
        let Type::Struct(fields) = record.ty.clone() else {
            self.error(
                codes::FIELD_OF_NO_STRUCT,
                name.span,
                format!("{} has no field '{}'", record.ty.described(), name.text),
                "only structs have fields, and only processes in queries have members",
            );
            return Expr::error(span);
        };
        let mut offset = Size::default();
        for (field, ty) in &fields.fields {
            if *field == name.text {
                let record = Box::new(record);
                let kind = Kind::Field { record, offset };
                let part = self.folded(Expr::new(kind, ty.clone(), span));
                return self.unless_left_out(part);
            }
            offset = offset.plus(ty.size());
        }
        let known: Vec<&str> = fields
            .fields
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        self.error(
            codes::FIELD_UNKNOWN,
            name.span,
            format!("the struct has no field '{}'", name.text),
            &format!("its fields are {}", known.join(", ")),
        );
        Expr::error(span)
    }

    fn index(&mut self, array: &ast::Expr, index: &ast::Expr, span: Span) -> Expr {
        let array = self.expression(array);
        let array = self.place_left_out(array);
        let index = self.expression(index);
        if array.is_error() || index.is_error() {
            return Expr::error(span);
        }
        let Type::Array(ty) = array.ty.clone() else {
            self.error(
                codes::INDEX_OF_NO_ARRAY,
                array.span,
                format!("{} cannot be indexed", array.ty.described()),
                "only arrays have an index",
            );
            return Expr::error(span);
        };
        self.check_index_type(ty.index, &index);
        let kind = Kind::Index(Element {
            array: Box::new(array),
            index: Box::new(index),
            first: ty.index.first,
            length: ty.index.length,
            stride: ty.part.size(),
        });
        let part = self.folded(Expr::new(kind, ty.part.clone(), span));
        self.unless_left_out(part)
    }

    /// Checks that an index is an integer or a member of the scalar set.
    pub(super) fn check_index_type(&mut self, wanted: Index, index: &Expr) {
        let Some(wanted_set) = wanted.set else {
            self.expect_integer(index, "an index");
            return;
        };
        let fits = matches!(index.ty, Type::Scalar { set, .. } if set == wanted_set);
        if !fits && !index.is_error() {
            self.error(
                codes::SCALAR_SET_EXPECTED,
                index.span,
                format!(
                    "the index must be of the array's scalar set, but this is {}",
                    index.ty.described()
                ),
                "share the set by a typedef",
            );
        }
    }

    /// The value of a scalar in the constant memory at a known place; at one of several places, the
    /// interval of their values; anything else as it is.
    fn folded(&self, expr: Expr) -> Expr {
        let Some(place) = expr.variable() else {
            return expr;
        };
        if place.root != Root::Constants || !expr.ty.is_register() {
            return expr;
        }
        let constants = &self.world.network.constants;
        let Some(offset) = known_offset(&expr, Memory::Words) else {
            let Some(offsets) = possible_offsets(&expr).filter(|_| expr.ty.is_integral()) else {
                return expr;
            };
            let values = || offsets.iter().map(|&offset| constants[offset as usize]);
            let interval = values().min().zip(values().max());
            return match interval {
                Some(interval) => expr.within(interval),
                None => expr,
            };
        };
        let constants = &constants[offset as usize..];
        match expr.ty {
            Type::Double => {
                let value = arithmetic::double_of_words(constants[0], constants[1]);
                Expr::new(Kind::Double(value), Type::Double, expr.span)
            }
            ty => Expr::int(constants[0], ty, expr.span),
        }
    }

    fn unary(&mut self, operator: UnaryOp, inner: &ast::Expr, span: Span) -> Expr {
        // The least integer can only be written as the negation of a literal that is too large by
        // one.
        if operator == UnaryOp::Minus
            && matches!(inner.kind, ExprKind::Int(value) if value == -i64::from(i32::MIN))
        {
            return Expr::int(i32::MIN, Type::ANY_INT, span);
        }
        let inner = self.expression(inner);
        match operator {
            UnaryOp::Not => self.negation(inner, span),
            UnaryOp::Minus => self.minus(inner, span),
            UnaryOp::Plus if inner.is_error() || inner.ty.is_number() => Expr { span, ..inner },
            UnaryOp::Plus => {
                let zero = Expr::int(0, Type::ANY_INT, span);
                self.operands_refused(&zero, &inner, span)
            }
        }
    }

    fn binary_expression(
        &mut self,
        operator: BinaryOp,
        left: &ast::Expr,
        right: &ast::Expr,
        span: Span,
    ) -> Expr {
        if operator == BinaryOp::Equal {
            for (rate, value) in [(left, right), (right, left)] {
                if let ExprKind::Rate(clock) = &rate.kind {
                    let before = self.unknowns.len();
                    let clock = self.place(clock);
                    let value = self.expression(value);
                    return self.rate(clock, value, before, span);
                }
            }
        }
        let is_chain = is_chain(operator, left, span);
        let left = self.expression(left);
        let right = self.expression(right);
        if is_chain && !left.is_error() && !right.is_error() && right.ty != Type::Bool {
            let is_timed = matches!(left.ty, Type::Constraint(_)) || is_clock_term(&right);
            if is_timed {
                return self.error(
                    codes::OPERANDS_MISMATCHED,
                    span,
                    "a comparison is no number that can be compared again",
                    CHAIN_HINT,
                );
            }
            let message = "the result of a comparison, 0 or 1, is compared with a number";
            self.report(Diagnostic::new(codes::COMPARISON_CHAINED, span, message).help(CHAIN_HINT));
        }
        self.binary(operator, left, right, span)
    }

    fn ternary(&mut self, condition: Expr, then: Expr, otherwise: Expr, span: Span) -> Expr {
        if condition.is_error() || then.is_error() || otherwise.is_error() {
            return Expr::error(span);
        }
        if !condition.ty.is_integral() {
            self.error(
                codes::CONDITION_EXPECTED,
                condition.span,
                format!(
                    "the condition of ?: must be an integer or a truth value, but this is {}",
                    condition.ty.described()
                ),
                "clock conditions cannot choose a value",
            );
            return Expr::error(span);
        }
        let is_value = |one: &Expr, other: &Expr| is_clock_term(one) && other.ty.is_number();
        let is_mixed = is_value(&then, &otherwise) || is_value(&otherwise, &then);
        let (then, otherwise) = if is_mixed && !self.is_query {
            (self.clock_value(then), self.clock_value(otherwise))
        } else {
            (then, otherwise)
        };
        let (ty, then, otherwise) = if then.ty == otherwise.ty {
            (then.ty.clone(), then, otherwise)
        } else if then.ty.is_integral() && otherwise.ty.is_integral() {
            (joined(&then.ty, &otherwise.ty), then, otherwise)
        } else if then.ty.is_number() && otherwise.ty.is_number() {
            (Type::Double, to_double(then), to_double(otherwise))
        } else if then.ty.is_equivalent(&otherwise.ty) && !matches!(then.ty, Type::Constraint(_)) {
            (then.ty.clone(), then, otherwise)
        } else {
            return self.operands_refused(&then, &otherwise, span);
        };
        if matches!(ty, Type::Constraint(_) | Type::ClockTerm) {
            return self.operands_refused(&then, &otherwise, span);
        }
        match condition.constant() {
            Some(0) => return Expr { span, ..otherwise },
            Some(_) => return Expr { span, ..then },
            None => {}
        }
        let interval = (
            then.interval.0.min(otherwise.interval.0),
            then.interval.1.max(otherwise.interval.1),
        );
        let kind = Kind::Ternary(Box::new(condition), Box::new(then), Box::new(otherwise));
        Expr::new(kind, ty, span).within(interval)
    }

    /// Checks that an expression changes nothing.
    pub(super) fn expect_pure(&mut self, expr: &Expr, what: &str) -> bool {
        let is_pure = !expr.has_effect();
        if !is_pure {
            // What a user means by `x = 1` where a condition is wanted.
            let assigns =
                expr.any(&|e| matches!(e.kind, Kind::Assign(..) | Kind::AssignClock { .. }));
            let help = if assigns {
                "to compare, write `==`; to change it, do so in the update of an edge"
            } else {
                "move the change into the update of an edge; pass arrays by const reference"
            };
            let message = format!("{what} must not change anything");
            self.report(Diagnostic::new(codes::SIDE_EFFECT, expr.span, message).help(help));
        }
        is_pure
    }
}

/// What a user means by a chain of comparisons.
const CHAIN_HINT: &str = "write `a <= b && b <= c` for a <= b <= c";

/// Whether an operator of comparison follows another one without parentheses, as in `a <= b <= c`
/// or `a == b == c`. An operand in parentheses begins behind them.
fn is_chain(operator: BinaryOp, left: &ast::Expr, span: Span) -> bool {
    let is_order = |operator: BinaryOp| {
        matches!(
            operator,
            BinaryOp::Less | BinaryOp::LessEqual | BinaryOp::Greater | BinaryOp::GreaterEqual
        )
    };
    let ExprKind::Binary(inner, ..) = left.kind else {
        return false;
    };
    let is_same_kind = is_order(operator) && is_order(inner)
        || operator == BinaryOp::Equal && inner == BinaryOp::Equal;
    is_same_kind && left.span.start == span.start
}

/// The value of a real clock where one is given; anything else as it is.
pub(super) fn read(expr: Expr) -> Expr {
    if expr.ty != Type::RealClock || expr.is_error() {
        return expr;
    }
    let span = expr.span;
    Expr::new(Kind::ClockReading(Box::new(expr)), Type::Double, span)
}

/// The integer type of a choice between two.
fn joined(left: &Type, right: &Type) -> Type {
    let ((a, b), (c, d)) = (left.bounds(), right.bounds());
    Type::Int {
        low: a.min(c),
        high: b.max(d),
    }
}
