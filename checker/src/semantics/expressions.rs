//! From the expressions of the syntax tree to typed ones: names, parts, assignments, quantifiers.

use super::checker::Checker;
use super::codes;
use super::offsets::{known_offset, possible_offsets};
use super::operators::{as_truth, integer_operator, is_clock_term, to_double, truth_interval};
use super::scope::Entity;
use super::typed::{Expr, Kind, Place, Root};
use super::types::{Class, Index, Memory, Size, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::syntax::ast::{self, BinaryOp, ExprKind, Name, Quantifier, TypeExpr, UnaryOp};
use std::ops::Range;

impl Checker<'_> {
    /// Checks an expression.
    pub(super) fn expression(&mut self, expr: &ast::Expr) -> Expr {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Int(value) => self.integer_literal(*value, span),
            ExprKind::Double(value) => Expr::new(Kind::Double(*value), Type::Double, span),
            ExprKind::Bool(value) => Expr::bool(*value, span),
            ExprKind::String(_) => Expr::new(Kind::Text, Type::String, span),
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
                let target = self.expression(target);
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
                let target = self.expression(target);
                self.step(target, *delta, *postfix, span)
            }
            ExprKind::Rate(inner) => {
                self.expression(inner);
                self.error(
                    codes::RATE_MISPLACED,
                    span,
                    "the rate of a clock can only be set by == in an invariant",
                    "write x' == 0 as a conjunct of an invariant",
                );
                Expr::error(span)
            }
            ExprKind::Quantifier {
                quantifier,
                name,
                ty,
                body,
            } => self.quantifier(*quantifier, name, ty, body, span),
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
                self.error(
                    codes::NAME_WITHOUT_VALUE,
                    span,
                    format!("'{name}' is {}, not a value", entity.kind()),
                    "use a variable, a constant or a call",
                );
                Expr::error(span)
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

    /// Reports an unknown name, with the nearest known one.
    pub(super) fn unknown_name(&mut self, name: &str, span: Span) {
        if name == "cost" {
            // Priced models use the name without a declaration.
            self.error(
                codes::CONSTRUCT_UNSUPPORTED,
                span,
                "not supported: the variable `cost` of priced models (CORA)",
                "declare an integer or a clock of this name, or remove what uses it",
            );
            return;
        }
        let help = match self.similar_name(name) {
            Some(similar) => format!("did you mean '{similar}'?"),
            None => String::from("declare it first"),
        };
        self.error(
            codes::NAME_UNKNOWN,
            span,
            format!("'{name}' is not declared"),
            &help,
        );
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
                "only structs, and processes in queries, have parts with names",
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
                "only arrays have parts with numbers",
            );
            return Expr::error(span);
        };
        self.check_index_type(ty.index, &index);
        let kind = Kind::Index {
            array: Box::new(array),
            index: Box::new(index),
            first: ty.index.first,
            length: ty.index.length,
            stride: ty.part.size(),
        };
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
                    let clock = self.expression(clock);
                    let value = self.expression(value);
                    return self.rate(clock, value, before, span);
                }
            }
        }
        let left = self.expression(left);
        let right = self.expression(right);
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

    /// Checks that an expression may be assigned to.
    pub(super) fn expect_mutable(&mut self, target: &Expr) -> bool {
        if target.is_error() {
            return false;
        }
        let is_constant =
            target.is_place() || matches!(target.kind, Kind::Int(_) | Kind::Double(_));
        if !target.is_mutable_place() {
            let message = if is_constant {
                "a constant cannot be changed"
            } else {
                "only variables can be changed"
            };
            self.error(
                codes::TARGET_NOT_ASSIGNABLE,
                target.span,
                message,
                "assign to a variable that is not const",
            );
            return false;
        }
        true
    }

    /// `target = value`; `of_target` is where among the unknown values those stand that the target
    /// hangs on.
    fn assignment(
        &mut self,
        target: Expr,
        value: Expr,
        of_target: Range<usize>,
        span: Span,
    ) -> Expr {
        if let Some(place) = self.target_left_out(&target) {
            let place = place.clone();
            return self.assignment_left_out((target, &place), value, of_target, span);
        }
        if !self.expect_mutable(&target) || value.is_error() {
            return Expr::error(span);
        }
        if target.ty.is_clock() && (target.ty.accepts(&value.ty)) {
            return self.assign_clock(target, value, of_target.start, span);
        }
        let size = target.ty.size();
        if size.clocks + size.channels > 0 {
            self.error(
                codes::TARGET_NOT_ASSIGNABLE,
                target.span,
                format!("{} cannot be assigned as a whole", target.ty.described()),
                "set each clock on its own",
            );
            return Expr::error(span);
        }
        let Some(value) = self.converted(value, &target.ty) else {
            return Expr::error(span);
        };
        if let Some(place) = target.variable() {
            self.takes_unknown(place.declared, &value, of_target.end);
        }
        if !matches!(target.kind, Kind::Variable(_)) {
            self.mark_chosen(&target);
        }
        let ty = target.ty.clone();
        Expr::new(Kind::Assign(Box::new(target), Box::new(value)), ty, span)
    }

    /// An assignment to a variable that is left out: it remains where its own value is used, which
    /// is unknown, and what the value does beside it.
    fn assignment_left_out(
        &mut self,
        (target, place): (Expr, &Expr),
        value: Expr,
        of_target: Range<usize>,
        span: Span,
    ) -> Expr {
        if !self.expect_mutable(place) || value.is_error() {
            return Expr::error(span);
        }
        let ty = target.ty.clone();
        let Some(value) = self.converted(value, &ty) else {
            return Expr::error(span);
        };
        if value.has_effect() && !place.has_effect() {
            self.unknowns.drain(of_target);
            return value;
        }
        Expr::new(Kind::Assign(Box::new(target), Box::new(value)), ty, span)
    }

    /// A place that is chosen when the code runs must lie in memory.
    fn mark_chosen(&mut self, target: &Expr) {
        if target.any(&|e| matches!(e.kind, Kind::Ternary(..))) {
            self.mark_addressed(target);
        }
    }

    /// A value as one of the type that it is given to; reports a mismatch.
    pub(super) fn converted(&mut self, value: Expr, ty: &Type) -> Option<Expr> {
        if value.is_error() || ty.is_error() {
            return None;
        }
        let value = if *ty == Type::Double {
            self.clock_value(value)
        } else {
            value
        };
        if !ty.accepts(&value.ty) {
            let help = if ty.is_integral() && value.ty == Type::Double {
                "convert with fint(…), which truncates"
            } else {
                "use a value of that type"
            };
            self.error(
                codes::TYPE_MISMATCHED,
                value.span,
                format!(
                    "{} is needed here, but this is {}",
                    ty.described(),
                    value.ty.described()
                ),
                help,
            );
            return None;
        }
        let span = value.span;
        Some(match ty {
            Type::Double => to_double(value),
            Type::Bool => as_truth(value, span),
            _ => value,
        })
    }

    fn compound(&mut self, operator: BinaryOp, target: Expr, value: Expr, span: Span) -> Expr {
        if !self.expect_mutable(&target) || value.is_error() {
            return Expr::error(span);
        }
        if !(target.ty.is_integral() && value.ty.is_integral()) {
            return self.operands_refused(&target, &value, span);
        }
        self.mark_chosen(&target);
        let ty = target.ty.clone();
        let operator = integer_operator(operator);
        Expr::new(
            Kind::Compound(operator, Box::new(target), Box::new(value)),
            ty,
            span,
        )
    }

    fn step(&mut self, target: Expr, delta: i32, postfix: bool, span: Span) -> Expr {
        if !self.expect_mutable(&target) {
            return Expr::error(span);
        }
        if !target.ty.is_integral() {
            let one = Expr::int(1, Type::ANY_INT, span);
            return self.operands_refused(&target, &one, span);
        }
        self.mark_chosen(&target);
        let ty = target.ty.clone();
        let target = Box::new(target);
        Expr::new(
            Kind::Step {
                target,
                delta,
                postfix,
            },
            ty,
            span,
        )
    }

    fn quantifier(
        &mut self,
        quantifier: Quantifier,
        name: &Name,
        ty: &TypeExpr,
        body: &ast::Expr,
        span: Span,
    ) -> Expr {
        let Some((range_type, range)) = self.iterated(ty) else {
            self.scopes.push(super::scope::Scope::default());
            self.declare(name, Entity::Broken);
            self.expression(body);
            self.scopes.pop();
            return Expr::error(span);
        };
        if range.0 > range.1 {
            // The body may speak of the members of a set of processes that has none.
            let value = i32::from(quantifier == Quantifier::ForAll);
            let ty = match quantifier {
                Quantifier::Sum => Type::ANY_INT,
                Quantifier::ForAll | Quantifier::Exists => Type::Bool,
            };
            return Expr::int(value, ty, span);
        }
        let local = self.new_local(range_type.clone());
        let place = Place {
            root: Root::Local(local),
            base: Size::default(),
            mutable: false,
            declared: Span::default(),
        };
        self.scopes.push(super::scope::Scope::default());
        self.declare(
            name,
            Entity::Variable {
                place,
                ty: range_type.clone(),
            },
        );
        let outer = std::mem::take(&mut self.needs_unrolling);
        let mut checked = self.expression(body);
        if quantifier == Quantifier::Sum && !self.is_query {
            checked = self.clock_value(checked);
        }
        let members_differ = std::mem::replace(&mut self.needs_unrolling, outer);
        self.scopes.pop();
        if quantifier == Quantifier::Sum && checked.ty == Type::Double {
            // The order of additions decides how they are rounded.
            self.tell_members_apart(&range_type, span);
        }
        if members_differ || self.must_unroll(&checked) {
            return self.unrolled(quantifier, (name, &range_type, range), body, span);
        }
        self.expect_pure(&checked, "the body of a quantifier");
        let Some(ty) = self.quantified_type(quantifier, &checked) else {
            return Expr::error(span);
        };
        // The range may be empty.
        let interval = match (quantifier, truth_interval(&checked)) {
            (Quantifier::ForAll, (low, _)) => (low, 1),
            (Quantifier::Exists, (_, high)) => (0, high),
            (Quantifier::Sum, _) => ty.bounds(),
        };
        let kind = Kind::Quantifier {
            quantifier,
            local,
            range,
            body: Box::new(checked),
        };
        Expr::new(kind, ty, span).within(interval)
    }

    /// The type of a quantified expression with this body; reports a body that does not fit.
    fn quantified_type(&mut self, quantifier: Quantifier, body: &Expr) -> Option<Type> {
        if quantifier == Quantifier::Sum {
            if body.ty == Type::Double {
                return Some(Type::Double);
            }
            let is_integer = self.expect_integer(body, "the body of a sum");
            return is_integer.then_some(Type::ANY_INT);
        }
        if !self.expect_condition(body) {
            return None;
        }
        Some(match &body.ty {
            Type::Constraint(class) if quantifier == Quantifier::ForAll => Type::Constraint(*class),
            Type::Constraint(_) => Type::Constraint(Class::Query),
            _ => Type::Bool,
        })
    }

    /// Whether a quantifier cannot be a loop: its body sets rates, or holds clock conditions of a
    /// query.
    fn must_unroll(&self, body: &Expr) -> bool {
        let mentions_rate = |e: &Expr| matches!(e.kind, Kind::Rate { .. });
        (self.is_query && body.mentions_clocks()) || body.any(&mentions_rate)
    }

    /// A quantifier as a conjunction or disjunction over all values, and a sum as a sum.
    pub(super) fn unrolled(
        &mut self,
        quantifier: Quantifier,
        (name, ty, (low, high)): (&Name, &Type, (i32, i32)),
        body: &ast::Expr,
        span: Span,
    ) -> Expr {
        /// The most instances that a quantifier over clocks is unrolled into.
        const UNROLLING_LIMIT: i64 = 100_000;
        if i64::from(high) - i64::from(low) >= UNROLLING_LIMIT {
            self.error(
                codes::RANGE_TOO_LARGE,
                span,
                "a quantifier over clocks ranges over too many values",
                "use a smaller range",
            );
            return Expr::error(span);
        }
        let mut parts = Vec::new();
        for value in low..=high {
            self.scopes.push(super::scope::Scope::default());
            let value = Expr::int(value, ty.clone(), name.span);
            self.declare(name, Entity::Constant { value, free: false });
            parts.push(self.expression(body));
            self.scopes.pop();
        }
        self.balanced(quantifier, parts, span)
    }

    /// Joins the instances of a quantifier into a tree of small height.
    fn balanced(&mut self, quantifier: Quantifier, mut parts: Vec<Expr>, span: Span) -> Expr {
        if parts.len() > 1 {
            let rest = parts.split_off(parts.len() / 2);
            let left = self.balanced(quantifier, parts, span);
            let right = self.balanced(quantifier, rest, span);
            return match quantifier {
                Quantifier::ForAll => self.conjunction(left, right, span),
                Quantifier::Exists => self.disjunction(left, right, span),
                Quantifier::Sum => self.binary(BinaryOp::Add, left, right, span),
            };
        }
        parts.pop().unwrap_or_else(|| Expr::error(span))
    }

    /// Checks that an expression changes nothing.
    pub(super) fn expect_pure(&mut self, expr: &Expr, what: &str) {
        if expr.has_effect() {
            // What someone meant who writes `x = 1` where a condition is wanted.
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
    }
}

/// The integer type of a choice between two.
fn joined(left: &Type, right: &Type) -> Type {
    let ((a, b), (c, d)) = (left.bounds(), right.bounds());
    Type::Int {
        low: a.min(c),
        high: b.max(d),
    }
}
