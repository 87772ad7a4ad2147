//! Which registers instructions and terminators read and write.

use crate::ir::{Address, Base, ClockOperand, Instruction, Register, Terminator};

/// The register that an instruction writes.
pub(super) fn target_mut(instruction: &mut Instruction) -> Option<&mut Register> {
    match instruction {
        Instruction::Integer { target, .. }
        | Instruction::Double { target, .. }
        | Instruction::Copy { target, .. }
        | Instruction::Arithmetic { target, .. }
        | Instruction::CompareIntegers { target, .. }
        | Instruction::CompareDoubles { target, .. }
        | Instruction::Not { target, .. }
        | Instruction::DoubleArithmetic { target, .. }
        | Instruction::IntegerToDouble { target, .. }
        | Instruction::DoubleToInteger { target, .. }
        | Instruction::Math { target, .. }
        | Instruction::LoadInteger { target, .. }
        | Instruction::LoadDouble { target, .. }
        | Instruction::EqualWords { target, .. }
        | Instruction::AddressOf { target, .. }
        | Instruction::ScaleIndex { target, .. }
        | Instruction::AddIndices { target, .. } => Some(target),
        Instruction::Call { target, .. } => target.as_mut(),
        _ => None,
    }
}

/// The register that an instruction writes.
pub(crate) fn target(instruction: &Instruction) -> Option<Register> {
    match instruction {
        Instruction::Integer { target, .. }
        | Instruction::Double { target, .. }
        | Instruction::Copy { target, .. }
        | Instruction::Arithmetic { target, .. }
        | Instruction::CompareIntegers { target, .. }
        | Instruction::CompareDoubles { target, .. }
        | Instruction::Not { target, .. }
        | Instruction::DoubleArithmetic { target, .. }
        | Instruction::IntegerToDouble { target, .. }
        | Instruction::DoubleToInteger { target, .. }
        | Instruction::Math { target, .. }
        | Instruction::LoadInteger { target, .. }
        | Instruction::LoadDouble { target, .. }
        | Instruction::EqualWords { target, .. }
        | Instruction::AddressOf { target, .. }
        | Instruction::ScaleIndex { target, .. }
        | Instruction::AddIndices { target, .. } => Some(*target),
        Instruction::Call { target, .. } => *target,
        _ => None,
    }
}

/// Visits the registers that an instruction reads.
pub(super) fn each_use_mut(instruction: &mut Instruction, visit: &mut dyn FnMut(&mut Register)) {
    match instruction {
        Instruction::Integer { .. }
        | Instruction::Double { .. }
        | Instruction::CountRound { .. } => {}
        Instruction::Copy { source, .. }
        | Instruction::Not { source, .. }
        | Instruction::IntegerToDouble { source, .. }
        | Instruction::DoubleToInteger { source, .. } => visit(source),
        Instruction::Arithmetic { left, right, .. }
        | Instruction::CompareIntegers { left, right, .. }
        | Instruction::CompareDoubles { left, right, .. }
        | Instruction::DoubleArithmetic { left, right, .. }
        | Instruction::AddIndices { left, right, .. } => {
            visit(left);
            visit(right);
        }
        Instruction::Math { arguments, .. } | Instruction::Call { arguments, .. } => {
            arguments.iter_mut().for_each(visit);
        }
        Instruction::LoadInteger { address, .. }
        | Instruction::LoadDouble { address, .. }
        | Instruction::AddressOf { address, .. } => each_address_use(address, visit),
        Instruction::StoreInteger { address, source }
        | Instruction::StoreDouble { address, source } => {
            each_address_use(address, visit);
            visit(source);
        }
        Instruction::CopyWords { target, source, .. } => {
            each_address_use(target, visit);
            each_address_use(source, visit);
        }
        Instruction::EqualWords { left, right, .. } => {
            each_address_use(left, visit);
            each_address_use(right, visit);
        }
        Instruction::CheckRange { value, .. } => visit(value),
        Instruction::ScaleIndex { index, .. } => visit(index),
        Instruction::Require { condition, .. } => visit(condition),
        Instruction::Constrain {
            left, right, bound, ..
        } => {
            each_clock_use(left, visit);
            each_clock_use(right, visit);
            visit(bound);
        }
        Instruction::SetClock { clock, value, .. } => {
            each_clock_use(clock, visit);
            visit(value);
        }
        Instruction::CopyClock {
            clock,
            source,
            increment,
            ..
        } => {
            each_clock_use(clock, visit);
            each_clock_use(source, visit);
            increment.iter_mut().for_each(visit);
        }
    }
}

fn each_address_use(address: &mut Address, visit: &mut dyn FnMut(&mut Register)) {
    if let Base::Register(register) = &mut address.base {
        visit(register);
    }
    address.index.iter_mut().for_each(visit);
}

fn each_clock_use(clock: &mut ClockOperand, visit: &mut dyn FnMut(&mut Register)) {
    clock.index.iter_mut().for_each(visit);
}

/// Visits the addresses of an instruction.
pub(super) fn each_address_mut(instruction: &mut Instruction, visit: &mut dyn FnMut(&mut Address)) {
    match instruction {
        Instruction::LoadInteger { address, .. }
        | Instruction::LoadDouble { address, .. }
        | Instruction::AddressOf { address, .. }
        | Instruction::StoreInteger { address, .. }
        | Instruction::StoreDouble { address, .. } => visit(address),
        Instruction::CopyWords { target, source, .. } => {
            visit(target);
            visit(source);
        }
        Instruction::EqualWords { left, right, .. } => {
            visit(left);
            visit(right);
        }
        _ => {}
    }
}

/// Visits the clocks of an instruction.
pub(super) fn each_clock_mut(
    instruction: &mut Instruction,
    visit: &mut dyn FnMut(&mut ClockOperand),
) {
    match instruction {
        Instruction::Constrain { left, right, .. } => {
            visit(left);
            visit(right);
        }
        Instruction::SetClock { clock, .. } => visit(clock),
        Instruction::CopyClock { clock, source, .. } => {
            visit(clock);
            visit(source);
        }
        _ => {}
    }
}

/// The register that a terminator reads.
pub(super) fn terminator_use_mut(terminator: &mut Terminator) -> Option<&mut Register> {
    match terminator {
        Terminator::Branch(condition, ..) => Some(condition),
        Terminator::Return(result) => result.as_mut(),
        Terminator::Jump(_) | Terminator::Fail(..) => None,
    }
}

/// Whether an instruction does nothing but write its target, and cannot fail.
pub(super) fn is_pure(instruction: &Instruction) -> bool {
    match instruction {
        Instruction::Math { function, .. } => !function.may_fail_or_wrap(),
        Instruction::Integer { .. }
        | Instruction::Double { .. }
        | Instruction::Copy { .. }
        | Instruction::CompareIntegers { .. }
        | Instruction::CompareDoubles { .. }
        | Instruction::Not { .. }
        | Instruction::DoubleArithmetic { .. }
        | Instruction::IntegerToDouble { .. }
        | Instruction::LoadInteger { .. }
        | Instruction::LoadDouble { .. }
        | Instruction::EqualWords { .. }
        | Instruction::AddressOf { .. }
        | Instruction::AddIndices { .. } => true,
        _ => false,
    }
}
