//! `forall`, `exists` and `sum`.

use super::checker::Checker;
use super::codes;
use super::operators::truth_interval;
use super::scope::Entity;
use super::typed::{Expr, Kind, Place};
use super::types::{Class, Interval, Type};
use crate::diagnostics::Span;
use crate::syntax::ast::{self, BinaryOp, Name, Quantifier, TypeExpr};

impl Checker<'_> {
    pub(super) fn quantifier(
        &mut self,
        quantifier: Quantifier,
        name: &Name,
        ty: &TypeExpr,
        body: &ast::Expr,
        span: Span,
    ) -> Expr {
        if let Some(checked) = self.over_instances(quantifier, name, ty, body, span) {
            return checked;
        }
        let Some((range_type, range)) = self.iterated(ty) else {
            self.scoped(name, Entity::Broken, |checker| checker.expression(body));
            return Expr::error(span);
        };
        if range.0 > range.1 {
            return over_nothing(quantifier, span);
        }
        let local = self.new_local(range_type.clone());
        let (place, ty) = (Place::bound(local), range_type.clone());
        let outer = std::mem::take(&mut self.needs_unrolling);
        let checked = self.scoped(name, Entity::Variable { place, ty }, |checker| {
            let checked = checker.expression(body);
            if quantifier == Quantifier::Sum && !checker.is_query {
                checker.clock_value(checked)
            } else {
                checked
            }
        });
        let members_differ = std::mem::replace(&mut self.needs_unrolling, outer);
        if quantifier == Quantifier::Sum && checked.ty == Type::Double {
            // The order of additions decides how they are rounded.
            self.distinguish_members(&range_type, span);
        }
        if members_differ || self.must_unroll(&checked) {
            return self.unrolled(quantifier, name, &range_type, range, body, span);
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
    pub(super) fn quantified_type(&mut self, quantifier: Quantifier, body: &Expr) -> Option<Type> {
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
    fn unrolled(
        &mut self,
        quantifier: Quantifier,
        name: &Name,
        ty: &Type,
        values: Interval,
        body: &ast::Expr,
        span: Span,
    ) -> Expr {
        /// The most instances that a quantifier over clocks is unrolled into.
        const UNROLLING_LIMIT: i64 = 100_000;
        let (low, high) = values;
        if i64::from(high) - i64::from(low) >= UNROLLING_LIMIT {
            return self.error(
                codes::RANGE_TOO_LARGE,
                span,
                "a quantifier over clocks ranges over too many values",
                "use a smaller range",
            );
        }
        let mut parts = Vec::new();
        for value in low..=high {
            let value = Expr::int(value, ty.clone(), name.span);
            let entity = Entity::Constant { value, free: false };
            parts.push(self.scoped(name, entity, |checker| checker.expression(body)));
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
}

/// The value of a quantifier over an empty range. Its body is not looked at, since it may speak of
/// the members of a set of processes that has none.
fn over_nothing(quantifier: Quantifier, span: Span) -> Expr {
    let value = i32::from(quantifier == Quantifier::ForAll);
    let ty = match quantifier {
        Quantifier::Sum => Type::ANY_INT,
        Quantifier::ForAll | Quantifier::Exists => Type::Bool,
    };
    Expr::int(value, ty, span)
}
