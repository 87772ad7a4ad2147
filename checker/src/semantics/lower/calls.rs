//! Calls and their arguments.

use super::super::typed::{ClockEffect, ClockSet, Expr, Kind, LocalId, Parameter, Root, Signature};
use super::super::types::{Memory, Type};
use super::{Builder, register_type};
use crate::ir::{Address, ClockAtom, FunctionId, Instruction, IntegerOperator, Register};

impl Builder<'_> {
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
            registers.push(self.address_of(address));
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
        if parameter.ty == Type::String {
            let text = self.text(argument);
            registers.push(text);
            return None;
        }
        if parameter.passes_channel {
            let (first, _, index) = self.offset(argument, Memory::Channels);
            let mut number = self.integer(first as i32);
            if let Some(index) = index {
                number = self.arithmetic(IntegerOperator::Add, number, index, argument.span);
            }
            registers.push(number);
            return None;
        }
        if parameter.reference {
            return self.reference(argument, parameter, registers);
        }
        if parameter.ty.is_aggregate() {
            let source = self.checked_address(argument, &parameter.ty);
            let address = if changes_follow {
                self.copied(source, parameter.ty.size().words)
            } else {
                source
            };
            registers.push(self.address_of(address));
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
            registers.push(self.address_of(address));
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
            self.effects.emits = true;
            self.effects.assignments.push(ClockEffect {
                target: substitute(effect.target),
                source: effect.source.map(substitute),
                range: effect.range,
            });
        }
    }
}

/// The words of the state that a place may be, without emitting code.
fn extent(expr: &Expr) -> (u32, u32) {
    let (mut offset, mut reach) = (0, 0);
    let mut place = expr;
    loop {
        match &place.kind {
            Kind::Index(element) => {
                if element.length == 0 {
                    // The index is an error, and nothing is touched.
                    return (0, 0);
                }
                match element.position() {
                    Some(position) => offset += position * element.stride.words,
                    None => reach += (element.length - 1) * element.stride.words,
                }
                place = &element.array;
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
