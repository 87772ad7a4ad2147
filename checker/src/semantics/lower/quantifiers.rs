//! Loops over the values of a type: quantifiers and sums.

use super::super::typed::{Expr, Kind, LocalId};
use super::super::types::{Interval, Type};
use super::places::Destination;
use super::{Builder, Home, register_type};
use crate::diagnostics::Span;
use crate::ir::{DoubleOperator, IntegerOperator, Register, Relation, Terminator};
use crate::syntax::ast::Quantifier;

impl Builder<'_> {
    pub(super) fn quantifier(&mut self, expr: &Expr) -> Register {
        let Kind::Quantifier {
            quantifier,
            local,
            range,
            body,
        } = &expr.kind
        else {
            unreachable!("called for quantifiers only");
        };
        let result = self.register(register_type(&expr.ty));
        let end = self.new_block();
        if *quantifier == Quantifier::Sum {
            let zero = self.zero(register_type(&expr.ty));
            self.copy(result, zero);
            self.count(*local, *range, expr, &mut |builder| {
                let value = builder.value(body);
                let sum = builder.sum(result, value, expr);
                builder.copy(result, sum);
            });
        } else {
            let decided = i32::from(*quantifier == Quantifier::Exists);
            self.set_integer(result, decided);
            self.count(*local, *range, expr, &mut |builder| {
                let next = builder.new_block();
                let (yes, no) = if decided == 1 {
                    (end, next)
                } else {
                    (next, end)
                };
                builder.condition(body, yes, no);
                builder.switch(next);
            });
            self.set_integer(result, 1 - decided);
        }
        self.jump(end);
        self.switch(end);
        result
    }

    fn sum(&mut self, left: Register, right: Register, expr: &Expr) -> Register {
        if expr.ty != Type::Double {
            return self.arithmetic(IntegerOperator::Add, left, right, expr.span);
        }
        self.real(DoubleOperator::Add, left, right)
    }

    /// Runs `body` for each value of a local from `low` to `high`.
    pub(super) fn count(
        &mut self,
        local: LocalId,
        values: Interval,
        expr: &Expr,
        body: &mut dyn FnMut(&mut Self),
    ) {
        self.counted(values, expr.span, &mut |builder, counter| {
            builder.bind_counter(local, counter);
            body(builder);
        });
    }

    /// Runs `body` for each value of a counter.
    pub(super) fn counted(
        &mut self,
        values: Interval,
        span: Span,
        body: &mut dyn FnMut(&mut Self, Register),
    ) {
        let (low, high) = values;
        if low > high {
            return;
        }
        let counter = self.integer(low);
        let (head, next, end) = (self.new_block(), self.new_block(), self.new_block());
        self.jump(head);
        self.switch(head);
        self.loops += 1;
        body(self, counter);
        self.loops -= 1;
        let last = self.integer(high);
        let is_last = self.compare(Relation::Equal, counter, last);
        self.terminate(Terminator::Branch(is_last, end, next));
        self.switch(next);
        let one = self.integer(1);
        let increased = self.arithmetic(IntegerOperator::Add, counter, one, span);
        self.copy(counter, increased);
        self.jump(head);
        self.switch(end);
    }

    fn bind_counter(&mut self, local: LocalId, counter: Register) {
        let home = if self.locals[local.0 as usize].addressed {
            let address = self.frame(1);
            self.store(Destination::Memory(address), counter, &Type::ANY_INT);
            Home::Frame(address.offset)
        } else {
            Home::Register(counter)
        };
        self.homes[local.0 as usize] = Some(home);
    }
}
