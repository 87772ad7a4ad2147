//! Values and conditions.

use super::super::operators::integer_interval;
use super::super::typed::{ClockEffect, ClockSet, Expr, Kind, LocalId, Parameter, Root, Signature};
use super::super::types::{Index, Type};
use super::places::Target;
use super::{Builder, Home, at, register_type};
use crate::diagnostics::Span;
use crate::ir::{
    Address, Base, BlockId, ClockAtom, FunctionId, Instruction, IntegerOperator, Register,
    RegisterType, Relation, Terminator,
};
use crate::syntax::ast::Quantifier;

impl Builder<'_> {
    /// The value of a scalar expression.
    pub(super) fn value(&mut self, expr: &Expr) -> Register {
        match &expr.kind {
            Kind::Int(value) => self.integer(*value),
            Kind::Double(value) => {
                let target = self.register(RegisterType::Double);
                let value = *value;
                self.emit(Instruction::Double { target, value });
                target
            }
            Kind::Variable(_) | Kind::Index { .. } | Kind::Field { .. } => {
                let target = self.target(expr, false);
                self.load(target, &expr.ty)
            }
            Kind::Assign(..) | Kind::Compound(..) => {
                let target = self.target(expr, true);
                self.load(target, &expr.ty)
            }
            Kind::Step {
                target,
                delta,
                postfix,
            } => {
                let (place, old) = self.step(target, *delta, expr.span);
                if *postfix {
                    old
                } else {
                    self.load(place, &expr.ty)
                }
            }
            Kind::Call { .. } => self.call(expr, None).expect("the function returns a value"),
            Kind::Quantifier { .. } => self.quantifier(expr),
            Kind::Ternary(condition, then, otherwise) => {
                self.choose_value(condition, then, otherwise, &expr.ty)
            }
            Kind::Not(inner) => {
                let source = self.value(inner);
                let target = self.register(RegisterType::Integer);
                self.emit(Instruction::Not { target, source });
                target
            }
            Kind::And(..) | Kind::Or(..) => self.truth(expr),
            _ => self.operation(expr),
        }
    }

    fn operation(&mut self, expr: &Expr) -> Register {
        match &expr.kind {
            Kind::ToDouble(inner) => {
                let source = self.value(inner);
                let target = self.register(RegisterType::Double);
                self.emit(Instruction::IntegerToDouble { target, source });
                target
            }
            Kind::ToInteger(inner) => {
                let source = self.value(inner);
                let site = self.site(expr.span);
                let target = self.register(RegisterType::Integer);
                self.emit(Instruction::DoubleToInteger {
                    target,
                    source,
                    site,
                });
                target
            }
            Kind::Integer(operator, left, right) => {
                let (left, right) = self.operands(left, right);
                self.arithmetic(*operator, left, right, expr.span)
            }
            Kind::Real(operator, left, right) => {
                let (left, right) = self.operands(left, right);
                let target = self.register(RegisterType::Double);
                let operator = *operator;
                self.emit(Instruction::DoubleArithmetic {
                    operator,
                    target,
                    left,
                    right,
                });
                target
            }
            Kind::Math(function, arguments) => {
                let arguments = self.stable_values(arguments);
                let site = self.site(expr.span);
                let target = self.register(register_type(&expr.ty));
                self.emit(Instruction::Math {
                    function: *function,
                    target,
                    arguments,
                    site,
                });
                target
            }
            _ => self.comparison(expr),
        }
    }

    fn comparison(&mut self, expr: &Expr) -> Register {
        let target = self.register(RegisterType::Integer);
        match &expr.kind {
            Kind::Compare(relation, left, right) => {
                let (left, right) = self.operands(left, right);
                let relation = *relation;
                self.emit(Instruction::CompareIntegers {
                    relation,
                    target,
                    left,
                    right,
                });
            }
            Kind::CompareReal(relation, left, right) => {
                let (left, right) = self.operands(left, right);
                let relation = *relation;
                self.emit(Instruction::CompareDoubles {
                    relation,
                    target,
                    left,
                    right,
                });
            }
            Kind::CompareWords(equal, left, right) => {
                let words = left.ty.size().words;
                let left = self.stable_address(left, right);
                let right = self.address(right);
                self.emit(Instruction::EqualWords {
                    target,
                    left,
                    right,
                    words,
                });
                if !equal {
                    let source = target;
                    let target = self.register(RegisterType::Integer);
                    self.emit(Instruction::Not { target, source });
                    return target;
                }
            }
            other => unreachable!("checking leaves no such value: {other:?}"),
        }
        target
    }

    /// The address of an array or struct that the evaluation of `later` does not change.
    fn stable_address(&mut self, expr: &Expr, later: &Expr) -> Address {
        let source = self.address(expr);
        if !later.has_effect() {
            return source;
        }
        let words = expr.ty.size().words;
        let target = self.frame(words);
        self.emit(Instruction::CopyWords {
            target,
            source,
            words,
        });
        target
    }

    fn operands(&mut self, left: &Expr, right: &Expr) -> (Register, Register) {
        let first = self.stable_value(left, right.has_effect());
        (first, self.value(right))
    }

    fn stable_values(&mut self, exprs: &[Expr]) -> Vec<Register> {
        (0..exprs.len())
            .map(|i| {
                let changes = exprs[i + 1..].iter().any(Expr::has_effect);
                self.stable_value(&exprs[i], changes)
            })
            .collect()
    }

    /// The value of an expression, in a register of its own if a later operand changes variables.
    fn stable_value(&mut self, expr: &Expr, changes_follow: bool) -> Register {
        let source = self.value(expr);
        if !changes_follow {
            return source;
        }
        let target = self.register(self.registers[source.0 as usize]);
        self.copy(target, source);
        target
    }

    fn truth(&mut self, expr: &Expr) -> Register {
        let target = self.register(RegisterType::Integer);
        let (yes, no, end) = (self.new_block(), self.new_block(), self.new_block());
        self.condition(expr, yes, no);
        for (block, value) in [(yes, 1), (no, 0)] {
            self.switch(block);
            self.emit(Instruction::Integer { target, value });
            self.jump(end);
        }
        self.switch(end);
        target
    }

    fn choose_value(
        &mut self,
        condition: &Expr,
        then: &Expr,
        otherwise: &Expr,
        ty: &Type,
    ) -> Register {
        let target = self.register(register_type(ty));
        let (yes, no, end) = (self.new_block(), self.new_block(), self.new_block());
        self.condition(condition, yes, no);
        for (block, side) in [(yes, then), (no, otherwise)] {
            self.switch(block);
            let source = self.value(side);
            self.copy(target, source);
            self.jump(end);
        }
        self.switch(end);
        target
    }

    /// Goes to `yes` if the expression is true, to `no` otherwise.
    pub(super) fn condition(&mut self, expr: &Expr, yes: BlockId, no: BlockId) {
        match &expr.kind {
            Kind::Int(value) => self.jump(if *value == 0 { no } else { yes }),
            Kind::Not(inner) => self.condition(inner, no, yes),
            Kind::And(left, right) => {
                let next = self.new_block();
                self.condition(left, next, no);
                self.switch(next);
                self.condition(right, yes, no);
            }
            Kind::Or(left, right) => {
                let next = self.new_block();
                self.condition(left, yes, next);
                self.switch(next);
                self.condition(right, yes, no);
            }
            _ => {
                let value = self.value(expr);
                self.terminate(Terminator::Branch(value, yes, no));
            }
        }
    }

    fn quantifier(&mut self, expr: &Expr) -> Register {
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
            self.emit(Instruction::Integer {
                target: result,
                value: decided,
            });
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
            self.emit(Instruction::Integer {
                target: result,
                value: 1 - decided,
            });
        }
        self.jump(end);
        self.switch(end);
        result
    }

    fn sum(&mut self, left: Register, right: Register, expr: &Expr) -> Register {
        if expr.ty != Type::Double {
            return self.arithmetic(IntegerOperator::Add, left, right, expr.span);
        }
        let target = self.register(RegisterType::Double);
        self.emit(Instruction::DoubleArithmetic {
            operator: crate::ir::DoubleOperator::Add,
            target,
            left,
            right,
        });
        target
    }

    /// Runs `body` for each value of a local from `low` to `high`.
    pub(super) fn count(
        &mut self,
        local: LocalId,
        (low, high): (i32, i32),
        expr: &Expr,
        body: &mut dyn FnMut(&mut Self),
    ) {
        self.counted((low, high), expr.span, &mut |builder, counter| {
            builder.bind_counter(local, counter);
            body(builder);
        });
    }

    /// Runs `body` for each value of a counter from `low` to `high`.
    fn counted(
        &mut self,
        (low, high): (i32, i32),
        span: Span,
        body: &mut dyn FnMut(&mut Self, Register),
    ) {
        if low > high {
            return;
        }
        let counter = self.register(RegisterType::Integer);
        self.emit(Instruction::Integer {
            target: counter,
            value: low,
        });
        let (head, next, end) = (self.new_block(), self.new_block(), self.new_block());
        self.jump(head);
        self.switch(head);
        self.loops += 1;
        body(self, counter);
        self.loops -= 1;
        let last = self.integer(high);
        let is_last = self.register(RegisterType::Integer);
        self.emit(Instruction::CompareIntegers {
            relation: Relation::Equal,
            target: is_last,
            left: counter,
            right: last,
        });
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
            self.store(Target::Memory(address), counter, &Type::ANY_INT);
            Home::Frame(address.offset)
        } else {
            Home::Register(counter)
        };
        self.homes[local.0 as usize] = Some(home);
    }

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
                let (yes, no, end) = (self.new_block(), self.new_block(), self.new_block());
                self.condition(condition, yes, no);
                for (block, side) in [(yes, then), (no, otherwise)] {
                    self.switch(block);
                    self.effect(side);
                    self.jump(end);
                }
                self.switch(end);
            }
            Kind::Assign(..) | Kind::Compound(..) | Kind::Step { .. } => {
                self.target_of_effect(expr);
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

    fn target_of_effect(&mut self, expr: &Expr) {
        match &expr.kind {
            Kind::Assign(target, value) => {
                self.assign(target, value);
            }
            Kind::Compound(operator, target, value) => {
                self.compound(*operator, target, value, expr.span);
            }
            Kind::Step { target, delta, .. } => {
                self.step(target, *delta, expr.span);
            }
            _ => unreachable!("called for assignments only"),
        }
    }

    /// Assigns a value and returns where it went.
    pub(super) fn assign(&mut self, target: &Expr, value: &Expr) -> Target {
        let place = self.target(target, true);
        if target.ty.is_aggregate() {
            let source = self.checked_address(value, &target.ty);
            if let Target::Memory(address) = place
                && address != source
            {
                let words = target.ty.size().words;
                self.emit(Instruction::CopyWords {
                    target: address,
                    source,
                    words,
                });
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
                    let site = builder.site(span);
                    let scaled = builder.register(RegisterType::Integer);
                    builder.emit(Instruction::ScaleIndex {
                        target: scaled,
                        index: counter,
                        first: 0,
                        length,
                        stride,
                        site,
                    });
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
                let value = self.load(Target::Memory(address), ty);
                self.check_range(value, given.bounds(), ty, span);
            }
        }
    }

    fn check_range(&mut self, value: Register, interval: (i32, i32), ty: &Type, span: Span) {
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
    ) -> (Target, Register) {
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
    pub(super) fn step(&mut self, target: &Expr, delta: i32, span: Span) -> (Target, Register) {
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

    /// Calls a function. An array or struct that it returns goes to `result`.
    pub(super) fn call(&mut self, expr: &Expr, result: Option<Address>) -> Option<Register> {
        let Kind::Call {
            function,
            signature,
            arguments,
        } = &expr.kind
        else {
            unreachable!("called for calls only");
        };
        let mut registers = Vec::new();
        let mut clock_sets = Vec::new();
        for (i, argument) in arguments.iter().enumerate() {
            let changes = arguments[i + 1..].iter().any(Expr::has_effect);
            let set = self.argument(argument, &signature.parameters[i], changes, &mut registers);
            clock_sets.push(set);
        }
        if let Some(address) = result {
            let target = self.register(RegisterType::Address);
            self.emit(Instruction::AddressOf { target, address });
            registers.push(target);
        }
        self.record_effects(signature, &clock_sets);
        self.emit_call(*function, registers, &expr.ty)
    }

    fn emit_call(
        &mut self,
        function: FunctionId,
        arguments: Vec<Register>,
        ty: &Type,
    ) -> Option<Register> {
        let target = ty.is_register().then(|| self.register(register_type(ty)));
        self.emit(Instruction::Call {
            target,
            function,
            arguments,
        });
        target
    }

    /// Adds the registers of one argument; returns the clocks that it refers to.
    fn argument(
        &mut self,
        argument: &Expr,
        parameter: &Parameter,
        changes_follow: bool,
        registers: &mut Vec<Register>,
    ) -> Option<ClockSet> {
        if parameter.reference {
            return self.reference(argument, parameter, registers);
        }
        if parameter.ty.is_aggregate() {
            let source = self.checked_address(argument, &parameter.ty);
            let address = if changes_follow {
                let words = parameter.ty.size().words;
                let target = self.frame(words);
                self.emit(Instruction::CopyWords {
                    target,
                    source,
                    words,
                });
                target
            } else {
                source
            };
            let target = self.register(RegisterType::Address);
            self.emit(Instruction::AddressOf { target, address });
            registers.push(target);
            return None;
        }
        let value = self.stable_value(argument, changes_follow);
        self.check_range(value, argument.interval, &parameter.ty, argument.span);
        registers.push(value);
        None
    }

    fn reference(
        &mut self,
        argument: &Expr,
        parameter: &Parameter,
        registers: &mut Vec<Register>,
    ) -> Option<ClockSet> {
        let size = parameter.ty.size();
        if parameter.ty.has_words() {
            let address = if parameter.constant {
                self.checked_address(argument, &parameter.ty)
            } else {
                self.address(argument)
            };
            if !parameter.constant
                && argument
                    .variable()
                    .is_some_and(|place| place.root == Root::State)
            {
                let extent = extent(argument);
                self.effects.writes.push(extent);
            }
            let target = self.register(RegisterType::Address);
            self.emit(Instruction::AddressOf { target, address });
            registers.push(target);
        }
        (size.clocks > 0).then(|| {
            let (operand, set) = self.clock(argument);
            let number = self.clock_number(operand);
            registers.push(number);
            match set {
                ClockSet::Range(mut range) => {
                    range.count += size.clocks - 1;
                    ClockSet::Range(range)
                }
                parameter @ ClockSet::Parameter(_) => parameter,
            }
        })
    }

    fn record_effects(&mut self, signature: &Signature, arguments: &[Option<ClockSet>]) {
        let effects = &signature.effects;
        self.effects.writes.extend_from_slice(&effects.writes);
        self.effects.reads_state |= effects.reads_state;
        self.effects.mentions_clocks |= effects.mentions_clocks;
        let atoms: &[ClockAtom] = &effects.atoms;
        self.effects.atoms.extend_from_slice(atoms);
        let substitute = |set: ClockSet| match set {
            ClockSet::Parameter(LocalId(i)) => {
                arguments[i as usize].expect("the parameter refers to clocks")
            }
            range @ ClockSet::Range(_) => range,
        };
        for effect in &effects.assignments {
            self.emits = true;
            self.effects.assignments.push(ClockEffect {
                target: substitute(effect.target),
                source: effect.source.map(substitute),
                range: effect.range,
            });
        }
    }

    /// Copies the words of a value into fresh memory of the frame.
    pub(super) fn default_words(&mut self, address: Address, words: &[i32]) {
        let offset = super::store_constant(self.network, self.images, words);
        self.emit(Instruction::CopyWords {
            target: address,
            source: at(Base::Constants, offset),
            words: words.len() as u32,
        });
    }
}

/// The words of the state that a place may be, without emitting code.
fn extent(expr: &Expr) -> (u32, u32) {
    let (mut offset, mut reach) = (0, 0);
    let mut place = expr;
    loop {
        match &place.kind {
            Kind::Index {
                array,
                index,
                first,
                length,
                stride,
            } => {
                if *length == 0 {
                    // The index is an error, and nothing is touched.
                    return (0, 0);
                }
                match index.constant() {
                    Some(i) if i >= *first && i.abs_diff(*first) < *length => {
                        offset += i.abs_diff(*first) * stride.words;
                    }
                    _ => reach += (length - 1) * stride.words,
                }
                place = array;
            }
            Kind::Field { record, offset: by } => {
                offset += by.words;
                place = record;
            }
            Kind::Variable(root) => {
                return (root.base.words + offset, reach + expr.ty.size().words);
            }
            _ => unreachable!("called for parts of variables only"),
        }
    }
}
