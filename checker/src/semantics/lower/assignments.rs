//! Expressions with an effect, and the checks of what is assigned.

use super::super::operators::integer_interval;
use super::super::typed::{Expr, Kind};
use super::super::types::{Index, Interval, Type};
use super::places::Destination;
use super::{Builder, at};
use crate::diagnostics::Span;
use crate::ir::{Address, Base, Instruction, IntegerOperator, Register, RegisterType};

impl Builder<'_> {
    /// Evaluates an expression and drops its value.
    pub(super) fn effect(&mut self, expr: &Expr) {
        match &expr.kind {
            Kind::AssignClock {
                target,
                source,
                value,
            } => {
                self.assign_clock(expr, target, source.as_deref(), value.as_deref());
            }
            Kind::Call { .. } if !expr.ty.is_register() => {
                let is_aggregate = expr.ty.is_aggregate();
                let result = is_aggregate.then(|| self.frame(expr.ty.size().words));
                self.call(expr, result);
            }
            Kind::Ternary(condition, then, otherwise) => {
                self.either_side(condition, [then, otherwise], |builder, side| {
                    builder.effect(side);
                });
            }
            Kind::Assign(target, value) => {
                self.assign(target, value);
            }
            Kind::Compound(operator, target, value) => {
                self.compound(*operator, target, value, expr.span);
            }
            Kind::Step { target, delta, .. } => {
                self.step(target, *delta, expr.span);
            }
            _ if expr.ty.is_register() => {
                self.value(expr);
            }
            _ if expr.ty.size().words > 0 => {
                self.address(expr);
            }
            _ => {}
        }
    }

    /// Assigns a value and returns where it went.
    pub(super) fn assign(&mut self, target: &Expr, value: &Expr) -> Destination {
        let place = self.target(target, true);
        if target.ty.is_aggregate() {
            let source = self.checked_address(value, &target.ty);
            if let Destination::Memory(address) = place
                && address != source
            {
                self.copy_words(address, source, target.ty.size().words);
            }
            return place;
        }
        let source = self.checked_value(value, &target.ty);
        self.store(place, source, &target.ty);
        place
    }

    /// The value of an expression, checked against the range of the type that it is given to.
    pub(super) fn checked_value(&mut self, expr: &Expr, ty: &Type) -> Register {
        let value = self.value(expr);
        self.check_range(value, expr.interval, ty, expr.span);
        value
    }

    /// The address of an array, struct or scalar whose parts are checked against the ranges of the
    /// type that it is given to.
    pub(super) fn checked_address(&mut self, expr: &Expr, ty: &Type) -> Address {
        let address = self.address(expr);
        self.check_parts(address, ty, &expr.ty, expr.span);
        address
    }

    fn check_parts(&mut self, address: Address, ty: &Type, given: &Type, span: Span) {
        if ty.holds(given) {
            return;
        }
        match (ty, given) {
            (Type::Array(array), Type::Array(given)) => {
                let Index { length, .. } = array.index;
                let stride = array.part.size().words;
                self.counted((0, length as i32 - 1), span, &mut |builder, counter| {
                    let scaled = builder.scaled_index(counter, 0, length, stride, span);
                    let index = Some(builder.add_indices(address.index, scaled));
                    let part = Address { index, ..address };
                    builder.check_parts(part, &array.part, &given.part, span);
                });
            }
            (Type::Struct(record), Type::Struct(given)) => {
                let mut part = address;
                for ((_, ty), (_, given)) in record.fields.iter().zip(&given.fields) {
                    self.check_parts(part, ty, given, span);
                    part.offset += ty.size().words;
                }
            }
            _ => {
                let value = self.load(Destination::Memory(address), ty);
                self.check_range(value, given.bounds(), ty, span);
            }
        }
    }

    pub(super) fn check_range(
        &mut self,
        value: Register,
        interval: Interval,
        ty: &Type,
        span: Span,
    ) {
        let (low, high) = ty.bounds();
        if ty.is_integral() && (interval.0 < low || high < interval.1) {
            let site = self.site(span);
            self.emit(Instruction::CheckRange {
                value,
                low,
                high,
                site,
            });
        }
    }

    /// `target op= value`: where the result went, and the old value.
    pub(super) fn compound(
        &mut self,
        operator: IntegerOperator,
        target: &Expr,
        value: &Expr,
        span: Span,
    ) -> (Destination, Register) {
        let place = self.target(target, true);
        let right = self.value(value);
        let old = self.load(place, &target.ty);
        let result = self.arithmetic(operator, old, right, span);
        let interval = integer_interval(operator, target.ty.bounds(), value.interval);
        self.check_range(result, interval, &target.ty, span);
        self.store(place, result, &target.ty);
        (place, old)
    }

    /// `++` or `--`: where the result went, and the old value in a register of its own.
    pub(super) fn step(
        &mut self,
        target: &Expr,
        delta: i32,
        span: Span,
    ) -> (Destination, Register) {
        let place = self.target(target, true);
        let loaded = self.load(place, &target.ty);
        let old = self.register(RegisterType::Integer);
        self.copy(old, loaded);
        let delta_register = self.integer(delta);
        let result = self.arithmetic(IntegerOperator::Add, old, delta_register, span);
        let interval = integer_interval(IntegerOperator::Add, target.ty.bounds(), (delta, delta));
        self.check_range(result, interval, &target.ty, span);
        self.store(place, result, &target.ty);
        (place, old)
    }

    /// Copies the words of a value into fresh memory of the frame.
    pub(super) fn default_words(&mut self, address: Address, image: Vec<i32>) {
        let words = image.len() as u32;
        let offset = super::store_constant(self.network, self.images, image);
        self.copy_words(address, at(Base::Constants, offset), words);
    }
}
