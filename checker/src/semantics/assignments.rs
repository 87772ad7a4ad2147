//! Assignments, and the conversion of values to the type of what takes them.

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::expressions::read;
use super::operators::{as_truth, integer_operator, to_double};
use super::typed::{Expr, Kind};
use super::types::Type;
use crate::diagnostics::Span;
use crate::syntax::ast::BinaryOp;
use std::ops::Range;

impl Checker<'_> {
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
    /// depends on.
    pub(super) fn assignment(
        &mut self,
        target: Expr,
        value: Expr,
        of_target: Range<usize>,
        span: Span,
    ) -> Expr {
        if let Some(place) = self.target_left_out(&target) {
            let place = place.clone();
            return self.assignment_left_out(target, &place, value, of_target, span);
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

    /// An assignment to a variable that is left out. It stays where its own value, which is
    /// unknown, is used, and where the right side has other effects.
    fn assignment_left_out(
        &mut self,
        target: Expr,
        place: &Expr,
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
        let value = match ty {
            Type::Double => read(self.clock_value(value)),
            Type::RealClock => read(value),
            _ => value,
        };
        if !ty.accepts(&value.ty) {
            let help = if ty.is_integral() && value.ty == Type::Double {
                "convert with fint(…), which truncates"
            } else {
                "use a value of that type"
            };
            return self.refused(
                codes::TYPE_MISMATCHED,
                value.span,
                format!(
                    "{} is needed here, but this is {}",
                    ty.described(),
                    value.ty.described()
                ),
                help,
            );
        }
        let span = value.span;
        Some(match ty {
            Type::Double | Type::RealClock => to_double(value),
            Type::Bool => as_truth(value, span),
            _ => value,
        })
    }

    pub(super) fn compound(
        &mut self,
        operator: BinaryOp,
        target: Expr,
        value: Expr,
        span: Span,
    ) -> Expr {
        if !self.expect_mutable(&target) || value.is_error() {
            return Expr::error(span);
        }
        if target.ty.is_real()
            && self.reading == Reading::Stochastic
            && value.ty.is_number()
            && !target.has_effect()
        {
            let old = read(target.clone());
            let new = self.binary(operator, old, value, span);
            return self.assignment(target, new, 0..0, span);
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

    pub(super) fn step(&mut self, target: Expr, delta: i32, postfix: bool, span: Span) -> Expr {
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
}
