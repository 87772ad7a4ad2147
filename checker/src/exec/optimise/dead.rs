//! Removes instructions whose results nobody reads, and registers that nobody uses.

use crate::ir::{Function, Register};

use super::operands::{each_use_mut, is_pure, target, target_mut, terminator_use_mut};

/// Removes dead instructions, and numbers the remaining registers afresh.
pub(super) fn remove_dead_code(function: &mut Function) {
    let needed = needed_registers(function);
    for block in &mut function.blocks {
        block.instructions.retain(|instruction| {
            !is_pure(instruction)
                || target(instruction).is_none_or(|target| needed[target.0 as usize])
        });
    }
    compact_registers(function);
}

/// The registers that something with an effect reads, directly or through others.
fn needed_registers(function: &mut Function) -> Vec<bool> {
    let mut writers = vec![Vec::new(); function.registers.len()];
    let mut needed = vec![false; function.registers.len()];
    let mut pending = Vec::new();
    for (index, block) in function.blocks.iter_mut().enumerate() {
        for (position, instruction) in block.instructions.iter_mut().enumerate() {
            if is_pure(instruction) {
                if let Some(target) = target(instruction) {
                    writers[target.0 as usize].push((index, position));
                }
            } else {
                each_use_mut(instruction, &mut |register| pending.push(*register));
            }
        }
        pending.extend(terminator_use_mut(&mut block.terminator).copied());
    }
    while let Some(Register(register)) = pending.pop() {
        if std::mem::replace(&mut needed[register as usize], true) {
            continue;
        }
        for &(block, position) in &writers[register as usize] {
            let instruction = &mut function.blocks[block].instructions[position];
            each_use_mut(instruction, &mut |register| pending.push(*register));
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
            each_use_mut(instruction, visit);
            if let Some(target) = target_mut(instruction) {
                visit(target);
            }
        }
        if let Some(register) = terminator_use_mut(&mut block.terminator) {
            visit(register);
        }
    }
}
