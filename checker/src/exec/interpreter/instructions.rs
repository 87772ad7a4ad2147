//! What each instruction does.

use crate::builtins::{MOST_PARAMETERS, Number};
use crate::cancellation;
use crate::exec::executor::ROUNDS_BETWEEN_LOOKS;
use crate::exec::external_words::{ExternalWords, ends_text};
use crate::exec::libraries;
use crate::exec::{EmittedAssignment, RunTimeError, arithmetic};
use crate::ir::{
    Address, ClockId, ClockOperand, Distribution, ExternalArgument, ExternalId, ExternalParameter,
    FixedConstraint, Instruction, MathFunction, Overflow, Register, RegisterType, RunTimeErrorKind,
    STREAM_WORDS, SiteId, Stream,
};

use super::machine::Activation;
use super::{Execution, within_clock_limit};

impl Execution<'_, '_> {
    pub(super) fn execute(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeError> {
        match instruction {
            Instruction::Integer { .. }
            | Instruction::Double { .. }
            | Instruction::Copy { .. }
            | Instruction::CompareIntegers { .. }
            | Instruction::CompareDoubles { .. }
            | Instruction::Not { .. }
            | Instruction::Select { .. }
            | Instruction::DoubleArithmetic { .. }
            | Instruction::IntegerToDouble { .. }
            | Instruction::AddIndices { .. } => self.compute(active, instruction),
            Instruction::LoadInteger { .. }
            | Instruction::LoadDouble { .. }
            | Instruction::StoreInteger { .. }
            | Instruction::StoreDouble { .. }
            | Instruction::CopyWords { .. }
            | Instruction::EqualWords { .. }
            | Instruction::AddressOf { .. } => self.access(active, instruction),
            Instruction::Arithmetic { site, .. }
            | Instruction::DoubleToInteger { site, .. }
            | Instruction::Math { site, .. }
            | Instruction::Random { site, .. }
            | Instruction::External { site, .. }
            | Instruction::CheckRange { site, .. }
            | Instruction::ScaleIndex { site, .. }
            | Instruction::CountRound { site }
            | Instruction::Require { site, .. } => {
                let site = *site;
                return self
                    .compute_checked(active, instruction)
                    .map_err(|kind| RunTimeError { kind, site });
            }
            Instruction::Constrain { site, .. }
            | Instruction::SetClock { site, .. }
            | Instruction::CopyClock { site, .. } => {
                let site = *site;
                return self
                    .emit(active, instruction)
                    .map_err(|kind| RunTimeError { kind, site });
            }
            Instruction::Call { .. } => unreachable!("calls are taken by the loop"),
        }
        Ok(())
    }

    /// The instructions that compute a register from others and cannot fail.
    fn compute(&mut self, active: Activation, instruction: &Instruction) {
        match *instruction {
            Instruction::Integer { target, value } => self.set_integer(active, target, value),
            Instruction::Double { target, value } => self.set_double(active, target, value.value()),
            Instruction::Copy { target, source } => {
                let value = self.register(active, source);
                self.set_register(active, target, value);
            }
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.integer(active, left), self.integer(active, right));
                let holds = arithmetic::relate(relation, left, right);
                self.set_integer(active, target, holds.into());
            }
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.double(active, left), self.double(active, right));
                let holds = arithmetic::relate(relation, left, right);
                self.set_integer(active, target, holds.into());
            }
            Instruction::Not { target, source } => {
                let is_zero = self.integer(active, source) == 0;
                self.set_integer(active, target, is_zero.into());
            }
            Instruction::Select {
                target,
                condition,
                then,
                otherwise,
            } => {
                let holds = self.integer(active, condition) != 0;
                let value = self.integer(active, if holds { then } else { otherwise });
                self.set_integer(active, target, value);
            }
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.double(active, left), self.double(active, right));
                self.set_double(active, target, arithmetic::double(operator, left, right));
            }
            Instruction::IntegerToDouble { target, source } => {
                let value = self.integer(active, source);
                self.set_double(active, target, value.into());
            }
            Instruction::AddIndices {
                target,
                left,
                right,
            } => {
                let (left, right) = (self.integer(active, left), self.integer(active, right));
                self.set_integer(active, target, left.wrapping_add(right));
            }
            _ => unreachable!("sorted out by execute"),
        }
    }

    /// The instructions that compute a register from others, or nothing, and can fail.
    fn compute_checked(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeErrorKind> {
        match instruction {
            Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                site,
            } => {
                let (left, right) = (self.integer(active, *left), self.integer(active, *right));
                let (value, has_wrapped) = arithmetic::integer(*operator, left, right)?;
                let value = self.wrapped(value, has_wrapped, *site)?;
                self.set_integer(active, *target, value);
            }
            Instruction::DoubleToInteger { target, source, .. } => {
                let value = arithmetic::truncate(self.double(active, *source))?;
                self.set_integer(active, *target, value);
            }
            Instruction::Math {
                function,
                target,
                arguments,
                site,
            } => self.apply(active, *function, *target, arguments, *site)?,
            Instruction::Random {
                distribution,
                target,
                arguments,
                stream,
                ..
            } => self.draw(active, *distribution, *target, arguments, *stream)?,
            Instruction::External {
                target,
                function,
                arguments,
                ..
            } => self.call_external(active, *function, arguments, *target)?,
            &Instruction::CheckRange {
                value, low, high, ..
            } => {
                if !(low..=high).contains(&self.integer(active, value)) {
                    return Err(RunTimeErrorKind::OutOfRange);
                }
            }
            &Instruction::ScaleIndex {
                target,
                index,
                first,
                length,
                stride,
                ..
            } => {
                let index = self.integer(active, index);
                let value = arithmetic::scale_index(index, first, length, stride)?;
                self.set_integer(active, target, value);
            }
            Instruction::CountRound { .. } => self.count_round()?,
            Instruction::Require {
                condition, kind, ..
            } => {
                if self.integer(active, *condition) == 0 {
                    return Err(*kind);
                }
            }
            _ => unreachable!("sorted out by execute"),
        }
        Ok(())
    }

    fn count_round(&mut self) -> Result<(), RunTimeErrorKind> {
        self.effort.rounds += 1;
        if self.effort.rounds > self.round_limit {
            return Err(RunTimeErrorKind::StepLimit);
        }
        if self.effort.rounds.is_multiple_of(ROUNDS_BETWEEN_LOOKS) && cancellation::is_due() {
            return Err(RunTimeErrorKind::Interrupted);
        }
        Ok(())
    }

    /// The result of integer arithmetic at a site.
    fn wrapped(
        &self,
        value: i32,
        has_wrapped: bool,
        site: SiteId,
    ) -> Result<i32, RunTimeErrorKind> {
        if has_wrapped {
            match self.program.overflow {
                Overflow::Error => return Err(RunTimeErrorKind::Overflow),
                Overflow::Wrap => self.program.wraps.note(site),
            }
        }
        Ok(value)
    }

    /// A function of the mathematical library.
    fn apply(
        &mut self,
        active: Activation,
        function: MathFunction,
        target: Register,
        arguments: &[Register],
        site: SiteId,
    ) -> Result<(), RunTimeErrorKind> {
        // No function has more than three parameters.
        let mut numbers = [Number::Integer(0); 3];
        for (number, &argument) in numbers.iter_mut().zip(arguments) {
            *number = match self.type_of(active, argument) {
                RegisterType::Double => Number::Double(self.double(active, argument)),
                _ => Number::Integer(self.integer(active, argument)),
            };
        }
        match function.evaluate(&numbers[..arguments.len()]) {
            None => return Err(RunTimeErrorKind::NotAnInteger),
            Some((Number::Integer(value), has_wrapped)) => {
                let value = self.wrapped(value, has_wrapped, site)?;
                self.set_integer(active, target, value);
            }
            Some((Number::Double(value), _)) => self.set_double(active, target, value),
        }
        Ok(())
    }

    /// A random number.
    fn draw(
        &mut self,
        active: Activation,
        distribution: Distribution,
        target: Register,
        arguments: &[Register],
        stream: Address,
    ) -> Result<(), RunTimeErrorKind> {
        let mut doubles = [0.0; MOST_PARAMETERS];
        for (double, &argument) in doubles.iter_mut().zip(arguments) {
            *double = self.double(active, argument);
        }
        let place = self.place(active, stream);
        let mut stream = Stream::of(self.words_mut(place, STREAM_WORDS));
        let value = distribution
            .sample(&mut stream, &doubles[..arguments.len()])
            .ok_or(RunTimeErrorKind::Parameter(distribution))?;
        self.set_double(active, target, value);
        Ok(())
    }

    /// A call of a function of a library.
    fn call_external(
        &mut self,
        active: Activation,
        function: ExternalId,
        arguments: &[ExternalArgument],
        target: Option<Register>,
    ) -> Result<(), RunTimeErrorKind> {
        let signature = libraries::signature_of(function).ok_or(RunTimeErrorKind::NotLoaded)?;
        let mut places = Vec::with_capacity(arguments.len());
        let mut given = Vec::with_capacity(arguments.len());
        for (argument, parameter) in arguments.iter().zip(&signature.parameters) {
            match *argument {
                ExternalArgument::Value(register) => {
                    given.push(ExternalWords::Value(self.register(active, register)));
                    places.push(None);
                }
                ExternalArgument::Memory {
                    address,
                    words,
                    is_written,
                } => {
                    let place = self.place(active, address);
                    let mut read: Vec<i32> = Vec::new();
                    if *parameter == ExternalParameter::Text {
                        while read.last().is_none_or(|word| !ends_text(*word)) {
                            read.push(self.word(place.plus(read.len())));
                        }
                    } else {
                        read.extend((0..words as usize).map(|word| self.word(place.plus(word))));
                    }
                    given.push(ExternalWords::Memory(read));
                    places.push(is_written.then_some(place));
                }
            }
        }
        let result = libraries::call(function, &mut given)?;
        for (words, place) in given.iter().zip(places) {
            if let (ExternalWords::Memory(words), Some(place)) = (words, place) {
                self.words_mut(place, words.len()).copy_from_slice(words);
            }
        }
        if let Some(target) = target {
            self.set_register(active, target, result);
        }
        Ok(())
    }

    /// The instructions that read and write memory.
    fn access(&mut self, active: Activation, instruction: &Instruction) {
        match *instruction {
            Instruction::LoadInteger { target, address } => {
                let value = self.word(self.place(active, address));
                self.set_integer(active, target, value);
            }
            Instruction::LoadDouble { target, address } => {
                let place = self.place(active, address);
                let (low, high) = (self.word(place), self.word(place.plus(1)));
                self.set_double(active, target, arithmetic::double_of_words(low, high));
            }
            Instruction::StoreInteger { address, source } => {
                let place = self.place(active, address);
                self.set_word(place, self.integer(active, source));
            }
            Instruction::StoreDouble {
                address, source, ..
            } => {
                let place = self.place(active, address);
                let [low, high] = arithmetic::double_words(self.double(active, source));
                self.set_word(place, low);
                self.set_word(place.plus(1), high);
            }
            Instruction::CopyWords {
                target,
                source,
                words,
            } => {
                let (target, source) = (self.place(active, target), self.place(active, source));
                for word in 0..words as usize {
                    self.set_word(target.plus(word), self.word(source.plus(word)));
                }
            }
            Instruction::EqualWords {
                target,
                left,
                right,
                words,
            } => {
                let (left, right) = (self.place(active, left), self.place(active, right));
                let equal = (0..words as usize)
                    .all(|word| self.word(left.plus(word)) == self.word(right.plus(word)));
                self.set_integer(active, target, equal.into());
            }
            Instruction::AddressOf { target, address } => {
                let place = self.place(active, address);
                self.set_register(active, target, place.to_bits());
            }
            _ => unreachable!("sorted out by execute"),
        }
    }

    /// The instructions that emit clock constraints and assignments.
    fn emit(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeErrorKind> {
        match *instruction {
            Instruction::Constrain {
                left,
                right,
                strict,
                bound,
                negate_bound,
                ..
            } => {
                let bound = within_clock_limit(self.integer(active, bound))?;
                self.context.constraints.push(FixedConstraint {
                    left: self.clock(active, left),
                    right: self.clock(active, right),
                    bound: if negate_bound { -bound } else { bound },
                    strict,
                });
            }
            Instruction::SetClock { clock, value, .. } => {
                let value = within_clock_limit(self.integer(active, value))?;
                if value < 0 {
                    return Err(RunTimeErrorKind::ClockValue);
                }
                self.context.assignments.push(EmittedAssignment {
                    target: self.clock(active, clock),
                    source: ClockId(0),
                    value,
                });
            }
            Instruction::CopyClock {
                clock,
                source,
                increment,
                ..
            } => {
                let increment = increment.map_or(0, |register| self.integer(active, register));
                let value = within_clock_limit(increment)?;
                self.context.assignments.push(EmittedAssignment {
                    target: self.clock(active, clock),
                    source: self.clock(active, source),
                    value,
                });
            }
            _ => unreachable!("sorted out by execute"),
        }
        Ok(())
    }

    fn clock(&self, active: Activation, operand: ClockOperand) -> ClockId {
        let offset = operand
            .index
            .map_or(0, |index| self.integer(active, index) as u32);
        ClockId(operand.first.0.wrapping_add(offset))
    }
}
