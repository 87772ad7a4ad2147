//! Removes instructions whose results nobody reads, and registers that nobody uses.

use crate::ir::{Function, Instruction, Register};

/// Removes dead instructions, and numbers the remaining registers afresh.
pub(super) fn remove_dead_code(function: &mut Function) {
    let needed = needed_registers(function);
    for block in &mut function.blocks {
        block.instructions.retain(|instruction| {
            !is_pure(instruction)
                || instruction
                    .target()
                    .is_none_or(|target| needed[target.0 as usize])
        });
    }
    compact_registers(function);
}

/// The registers that something with an effect reads, directly or through others.
fn needed_registers(function: &Function) -> Vec<bool> {
    let mut writers = vec![Vec::new(); function.registers.len()];
    let mut needed = vec![false; function.registers.len()];
    let mut pending = Vec::new();
    for (index, block) in function.blocks.iter().enumerate() {
        for (position, instruction) in block.instructions.iter().enumerate() {
            if is_pure(instruction) {
                if let Some(target) = instruction.target() {
                    writers[target.0 as usize].push((index, position));
                }
            } else {
                instruction.each_use(&mut |register| pending.push(register));
            }
        }
        pending.extend(block.terminator.used());
    }
    while let Some(Register(register)) = pending.pop() {
        if std::mem::replace(&mut needed[register as usize], true) {
            continue;
        }
        for &(block, position) in &writers[register as usize] {
            let instruction = &function.blocks[block].instructions[position];
            instruction.each_use(&mut |register| pending.push(register));
        }
    }
    needed
}

fn compact_registers(function: &mut Function) {
    let mut used = vec![false; function.registers.len()];
    used[..function.parameters as usize].fill(true);
    each_register_mut(function, &mut |register| used[register.0 as usize] = true);
    let mut numbers = Vec::with_capacity(used.len());
    let mut count = 0;
    for &used in &used {
        numbers.push(Register(count));
        count += u32::from(used);
    }
    each_register_mut(function, &mut |register| {
        *register = numbers[register.0 as usize];
    });
    let mut kept = used.into_iter();
    function
        .registers
        .retain(|_| kept.next().expect("there is a mark for every register"));
}

fn each_register_mut(function: &mut Function, visit: &mut dyn FnMut(&mut Register)) {
    for block in &mut function.blocks {
        for instruction in &mut block.instructions {
            instruction.each_use_mut(visit);
            if let Some(target) = instruction.target_mut() {
                visit(target);
            }
        }
        if let Some(register) = block.terminator.used_mut() {
            visit(register);
        }
    }
}

/// Whether an instruction does nothing but write its target, and cannot fail.
fn is_pure(instruction: &Instruction) -> bool {
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
