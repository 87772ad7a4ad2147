//! Conditions on real clocks: whether they hold at a time and just after it, and when that may
//! change.
//!
//! A function of a timed condition asks about the state as it is after the time that the word AHEAD
//! holds, if nothing happens until then. It returns a *mask*: bit 0 says whether the condition
//! holds at that moment, bit 1 whether it holds in the open interval behind it. It leaves in the
//! words RESULT for how long bit 1 stays as it is, at least; infinity if for ever.
//!
//! Where every clock is linear in time, every term that [`curved_number`] lets pass is linear too,
//! and comes as its value with its slope (forward differentiation). A condition with other terms is
//! *curved*: its mask is only good for the very state that the words hold, with AHEAD at 0, and
//! says nothing of what comes behind. So is any mask if the rate of a clock in it changes as time
//! passes. To find when such conditions change, the function also leaves a *signature*: a number
//! that depends on which side of each comparison is the greater, and stays the same as long as none
//! of these changes.
//!
//! Invariants:
//! * The right side of `&&` is evaluated only if the left side may hold, that of `||` only if it
//!   may fail: indices that the left side checks are safe.
//! * Numbers that differ by less than [`TOLERANCE`], measured by the greater of the two and 1, are
//!   equal: what is reached by adding delays is reached in spite of rounding.

use super::super::layout::chance_words;
use super::super::typed::{Expr, Kind};
use super::super::types::Type;
use super::places::Destination;
use super::{Builder, at};
use crate::diagnostics::Span;
use crate::ir::{
    Address, Base, DoubleOperator, FunctionId, IntegerOperator, Register, RegisterType, Relation,
    Terminator,
};
use crate::syntax::ast::Quantifier;

/// What is counted as rounding when clocks are compared.
const TOLERANCE: f64 = 1e-12;

/// Holds at the moment and behind it.
const ALWAYS: i32 = 3;

/// A signature is a polynomial in this number, so that the order of comparisons counts.
const SIGNATURE_BASE: f64 = 0.97;

/// A number that is linear in time: its value, and its slope unless that is 0.
#[derive(Clone, Copy)]
struct Linear {
    value: Register,
    slope: Option<Register>,
}

/// The registers that all parts of a timed condition share.
#[derive(Clone, Copy)]
struct Horizon {
    ahead: Register,
    least: Register,
    signature: Register,
}

impl Builder<'_> {
    /// A function that returns the mask of a conjunction; whether that can change as time passes.
    pub(in crate::semantics) fn mask(
        mut self,
        name: String,
        conditions: &[&Expr],
    ) -> (FunctionId, bool) {
        let is_timed = conditions.iter().any(|condition| condition.is_timed());
        let fail = self.new_block();
        let mask = self.integer(ALWAYS);
        let shared = is_timed.then(|| Horizon {
            ahead: self.load(word_pair(chance_words::AHEAD), &Type::Double),
            least: self.double(f64::INFINITY),
            signature: self.double(0.0),
        });
        for condition in conditions {
            if let (Some(shared), true) = (shared, condition.is_timed()) {
                let part = self.timed(condition, shared);
                let both = self.arithmetic(IntegerOperator::And, mask, part, condition.span);
                self.copy(mask, both);
                let next = self.new_block();
                self.terminate(Terminator::Branch(mask, next, fail));
                self.switch(next);
            } else {
                let next = self.new_block();
                self.condition(condition, next, fail);
                self.switch(next);
            }
        }
        self.leave_horizon(shared);
        self.terminate(Terminator::Return(Some(mask)));
        self.switch(fail);
        self.leave_horizon(shared);
        let zero = self.integer(0);
        self.terminate(Terminator::Return(Some(zero)));
        let (function, _) = self.finish(name, Some(RegisterType::Integer));
        (function, is_timed)
    }

    fn leave_horizon(&mut self, shared: Option<Horizon>) {
        if let Some(shared) = shared {
            let Horizon {
                least, signature, ..
            } = shared;
            self.store(word_pair(chance_words::RESULT), least, &Type::Double);
            self.store(word_pair(chance_words::SIGNATURE), signature, &Type::Double);
        }
    }

    /// A function that leaves the value of a number in the words RESULT.
    pub(in crate::semantics) fn real_result(mut self, name: String, expr: &Expr) -> FunctionId {
        let value = self.value(expr);
        self.store(word_pair(chance_words::RESULT), value, &Type::Double);
        self.terminate(Terminator::Return(None));
        self.finish(name, None).0
    }

    /// A function that sets the rates of clocks: pairs of a clock and its rate.
    pub(in crate::semantics) fn rates(
        mut self,
        name: String,
        rates: &[(Expr, Expr)],
    ) -> FunctionId {
        for (clock, rate) in rates {
            let value = self.value(rate);
            if let Destination::Memory(address) = self.target(clock, false) {
                let address = rate_of(address);
                self.store(Destination::Memory(address), value, &Type::Double);
            }
        }
        self.terminate(Terminator::Return(None));
        self.finish(name, None).0
    }

    /// The mask of a condition.
    fn timed(&mut self, expr: &Expr, shared: Horizon) -> Register {
        if !expr.is_timed() {
            return self.untimed(expr);
        }
        match &expr.kind {
            Kind::Not(inner) => {
                let inner = self.timed(inner, shared);
                let all = self.integer(ALWAYS);
                self.arithmetic(IntegerOperator::Xor, inner, all, expr.span)
            }
            Kind::And(left, right) => {
                self.joined(IntegerOperator::And, [left, right], shared, expr.span)
            }
            Kind::Or(left, right) => {
                self.joined(IntegerOperator::Or, [left, right], shared, expr.span)
            }
            Kind::Ternary(condition, then, otherwise) => {
                let condition = self.timed(condition, shared);
                let then = self.timed(then, shared);
                let otherwise = self.timed(otherwise, shared);
                let all = self.integer(ALWAYS);
                let not = self.arithmetic(IntegerOperator::Xor, condition, all, expr.span);
                let then = self.arithmetic(IntegerOperator::And, condition, then, expr.span);
                let otherwise = self.arithmetic(IntegerOperator::And, not, otherwise, expr.span);
                self.arithmetic(IntegerOperator::Or, then, otherwise, expr.span)
            }
            Kind::Quantifier { .. } => self.timed_quantifier(expr, shared),
            Kind::CompareReal(relation, left, right) => {
                let [left, right] = [left, right].map(|side| {
                    if curved_number(side).is_some() {
                        let value = self.value(side);
                        Linear { value, slope: None }
                    } else {
                        self.linear(side, shared)
                    }
                });
                self.compared(*relation, left, right, shared, expr.span)
            }
            _ => {
                let mask = self.untimed(expr);
                self.sign(mask, shared);
                mask
            }
        }
    }

    fn timed_quantifier(&mut self, expr: &Expr, shared: Horizon) -> Register {
        let Kind::Quantifier {
            quantifier,
            local,
            range,
            body,
        } = &expr.kind
        else {
            unreachable!("called for quantifiers only");
        };
        let (start, operator) = match quantifier {
            Quantifier::ForAll => (ALWAYS, IntegerOperator::And),
            _ => (0, IntegerOperator::Or),
        };
        let result = self.integer(start);
        let end = self.new_block();
        self.count(*local, *range, expr, &mut |builder| {
            let part = builder.timed(body, shared);
            let joined = builder.arithmetic(operator, result, part, expr.span);
            builder.copy(result, joined);
            let next = builder.new_block();
            let decided = builder.integer(ALWAYS - start);
            let is_decided = builder.compare(Relation::Equal, result, decided);
            builder.terminate(Terminator::Branch(is_decided, end, next));
            builder.switch(next);
        });
        self.jump(end);
        self.switch(end);
        result
    }

    /// Adds what is known of a part to the signature.
    fn sign(&mut self, code: Register, shared: Horizon) {
        let base = self.double(SIGNATURE_BASE);
        let before = self.real(DoubleOperator::Multiply, shared.signature, base);
        let code = self.as_double(code);
        let signature = self.real(DoubleOperator::Add, before, code);
        self.copy(shared.signature, signature);
    }

    /// The mask of what does not change as time passes.
    fn untimed(&mut self, expr: &Expr) -> Register {
        let mask = self.register(RegisterType::Integer);
        self.either_side(expr, [ALWAYS, 0], |builder, value| {
            builder.set_integer(mask, value);
        });
        mask
    }

    /// `and` or `or`: the second side is not looked at where the first one decides.
    fn joined(
        &mut self,
        operator: IntegerOperator,
        [left, right]: [&Expr; 2],
        shared: Horizon,
        span: Span,
    ) -> Register {
        let mask = self.register(RegisterType::Integer);
        let first = self.timed(left, shared);
        self.copy(mask, first);
        let (next, end) = (self.new_block(), self.new_block());
        if operator == IntegerOperator::And {
            self.terminate(Terminator::Branch(mask, next, end));
        } else {
            let all = self.integer(ALWAYS);
            let is_decided = self.compare(Relation::Equal, mask, all);
            self.terminate(Terminator::Branch(is_decided, end, next));
        }
        self.switch(next);
        let second = self.timed(right, shared);
        let joined = self.arithmetic(operator, mask, second, span);
        self.copy(mask, joined);
        self.jump(end);
        self.switch(end);
        mask
    }

    /// A number that [`curved`] let pass.
    fn linear(&mut self, expr: &Expr, shared: Horizon) -> Linear {
        if !expr.is_timed() {
            let value = self.value(expr);
            return Linear { value, slope: None };
        }
        match &expr.kind {
            Kind::ClockReading(clock) => self.clock_ahead(clock, shared),
            Kind::Real(operator, left, right) => {
                let left = self.linear(left, shared);
                let right = self.linear(right, shared);
                self.linear_operation(*operator, left, right)
            }
            Kind::Ternary(condition, then, otherwise) => {
                let value = self.register(RegisterType::Double);
                let slope = self.register(RegisterType::Double);
                self.either_side(condition, [then, otherwise], |builder, side| {
                    let side = builder.linear(side, shared);
                    builder.copy(value, side.value);
                    let side_slope = side.slope.unwrap_or_else(|| builder.double(0.0));
                    builder.copy(slope, side_slope);
                });
                let slope = Some(slope);
                Linear { value, slope }
            }
            Kind::Quantifier {
                local, range, body, ..
            } => {
                let (value, slope) = (self.double(0.0), self.double(0.0));
                self.count(*local, *range, expr, &mut |builder| {
                    let part = builder.linear(body, shared);
                    let sum = builder.real(DoubleOperator::Add, value, part.value);
                    builder.copy(value, sum);
                    if let Some(part) = part.slope {
                        let sum = builder.real(DoubleOperator::Add, slope, part);
                        builder.copy(slope, sum);
                    }
                });
                let slope = Some(slope);
                Linear { value, slope }
            }
            other => unreachable!("checking leaves no such number: {other:?}"),
        }
    }

    fn clock_ahead(&mut self, clock: &Expr, shared: Horizon) -> Linear {
        self.effects.mentions_clocks = true;
        let place = self.target(clock, false);
        let now = self.load(place, &Type::Double);
        let Destination::Memory(address) = place else {
            unreachable!("clocks lie in memory");
        };
        let rate = self.load(Destination::Memory(rate_of(address)), &Type::Double);
        let passed = self.real(DoubleOperator::Multiply, rate, shared.ahead);
        let value = self.real(DoubleOperator::Add, now, passed);
        let slope = Some(rate);
        Linear { value, slope }
    }

    fn linear_operation(
        &mut self,
        operator: DoubleOperator,
        left: Linear,
        right: Linear,
    ) -> Linear {
        let value = self.real(operator, left.value, right.value);
        let slope = match (operator, left.slope, right.slope) {
            (_, None, None) => None,
            (DoubleOperator::Add | DoubleOperator::Subtract, Some(left), Some(right)) => {
                Some(self.real(operator, left, right))
            }
            (DoubleOperator::Subtract, None, Some(right)) => {
                let zero = self.double(0.0);
                Some(self.real(operator, zero, right))
            }
            (DoubleOperator::Add | DoubleOperator::Subtract, left, right) => left.or(right),
            (DoubleOperator::Multiply, Some(slope), _) => {
                Some(self.real(operator, slope, right.value))
            }
            (DoubleOperator::Multiply, None, Some(slope)) => {
                Some(self.real(operator, left.value, slope))
            }
            (_, Some(slope), _) => Some(self.real(operator, slope, right.value)),
            (_, None, Some(_)) => unreachable!("checking leaves no such operation"),
        };
        Linear { value, slope }
    }

    /// The mask of a comparison; the horizon is at most the time when the two are equal.
    fn compared(
        &mut self,
        relation: Relation,
        left: Linear,
        right: Linear,
        shared: Horizon,
        span: Span,
    ) -> Register {
        let difference = self.linear_operation(DoubleOperator::Subtract, left, right);
        let (gap, slope) = (
            difference.value,
            difference.slope.unwrap_or_else(|| self.double(0.0)),
        );
        let zero = self.double(0.0);
        let tolerance = self.tolerance(left.value, right.value);
        let minus = self.real(DoubleOperator::Subtract, zero, tolerance);
        let at_most = self.compare_doubles(Relation::LessEqual, gap, tolerance);
        let at_least = self.compare_doubles(Relation::GreaterEqual, gap, minus);
        let near = self.arithmetic(IntegerOperator::And, at_most, at_least, span);
        self.bound_horizon(gap, slope, near, shared, span);
        let one = self.integer(1);
        let at_least_code = self.arithmetic(IntegerOperator::ShiftLeft, at_least, one, span);
        let code = self.arithmetic(IntegerOperator::Or, at_most, at_least_code, span);
        self.sign(code, shared);
        // What holds behind the moment where the two are equal depends on the slope.
        let (now, turned, keeps) = match relation {
            Relation::LessEqual => (at_most, Relation::Greater, false),
            Relation::GreaterEqual => (at_least, Relation::Less, false),
            Relation::Equal => (near, Relation::NotEqual, false),
            Relation::Less => (self.not(at_least), Relation::Less, true),
            Relation::Greater => (self.not(at_most), Relation::Greater, true),
            Relation::NotEqual => (self.not(near), Relation::NotEqual, true),
        };
        let turns = self.compare_doubles(turned, slope, zero);
        let turns = self.arithmetic(IntegerOperator::And, near, turns, span);
        let behind = if keeps {
            self.arithmetic(IntegerOperator::Or, now, turns, span)
        } else {
            let stays = self.not(turns);
            self.arithmetic(IntegerOperator::And, now, stays, span)
        };
        let one = self.integer(1);
        let shifted = self.arithmetic(IntegerOperator::ShiftLeft, behind, one, span);
        self.arithmetic(IntegerOperator::Or, now, shifted, span)
    }

    /// How far two numbers may be apart and count as equal.
    fn tolerance(&mut self, left: Register, right: Register) -> Register {
        let zero = self.double(0.0);
        let mut scale = self.double(1.0);
        for side in [left, right] {
            let minus = self.real(DoubleOperator::Subtract, zero, side);
            scale = self.real(DoubleOperator::Maximum, scale, side);
            scale = self.real(DoubleOperator::Maximum, scale, minus);
        }
        let part = self.double(TOLERANCE);
        self.real(DoubleOperator::Multiply, scale, part)
    }

    /// The horizon is at most the time until a gap closes.
    fn bound_horizon(
        &mut self,
        gap: Register,
        slope: Register,
        near: Register,
        shared: Horizon,
        span: Span,
    ) {
        let zero = self.double(0.0);
        let product = self.real(DoubleOperator::Multiply, gap, slope);
        let closes = self.compare_doubles(Relation::Less, product, zero);
        let far = self.not(near);
        let closes = self.arithmetic(IntegerOperator::And, closes, far, span);
        let (yes, end) = (self.new_block(), self.new_block());
        self.terminate(Terminator::Branch(closes, yes, end));
        self.switch(yes);
        let minus = self.real(DoubleOperator::Subtract, zero, gap);
        let time = self.real(DoubleOperator::Divide, minus, slope);
        let least = self.real(DoubleOperator::Minimum, shared.least, time);
        self.copy(shared.least, least);
        self.jump(end);
        self.switch(end);
    }
}

/// The first part of a condition that is not linear in time even where clocks are.
pub(in crate::semantics) fn curved(condition: &Expr) -> Option<Span> {
    if !condition.is_timed() {
        return None;
    }
    match &condition.kind {
        Kind::Not(inner) => curved(inner),
        Kind::And(left, right) | Kind::Or(left, right) => curved(left).or_else(|| curved(right)),
        Kind::Ternary(head, then, otherwise) => curved(head)
            .or_else(|| curved(then))
            .or_else(|| curved(otherwise)),
        Kind::Quantifier { body, .. } => curved(body),
        Kind::CompareReal(_, left, right) => curved_number(left).or_else(|| curved_number(right)),
        _ => Some(condition.span),
    }
}

/// The first part of a number that is not linear in time.
pub(in crate::semantics) fn curved_number(expr: &Expr) -> Option<Span> {
    if !expr.is_timed() {
        return None;
    }
    match &expr.kind {
        Kind::ClockReading(_) => None,
        Kind::Real(operator, left, right) => {
            let is_linear = match operator {
                DoubleOperator::Add | DoubleOperator::Subtract => true,
                DoubleOperator::Multiply => !(left.is_timed() && right.is_timed()),
                DoubleOperator::Divide => !right.is_timed(),
                DoubleOperator::Minimum | DoubleOperator::Maximum => false,
            };
            if !is_linear {
                return Some(expr.span);
            }
            curved_number(left).or_else(|| curved_number(right))
        }
        Kind::Ternary(condition, then, otherwise) => {
            if condition.is_timed() {
                return Some(condition.span);
            }
            curved_number(then).or_else(|| curved_number(otherwise))
        }
        Kind::Quantifier { body, .. } => curved_number(body),
        _ => Some(expr.span),
    }
}

/// Where the rate of the clock at an address lies.
fn rate_of(clock: Address) -> Address {
    let offset = clock.offset + 2;
    Address { offset, ..clock }
}

fn word_pair(offset: u32) -> Destination {
    Destination::Memory(at(Base::State, offset))
}
