//! Takes the code of small functions into those that call them.
//!
//! In a race a guard or an update is often cheaper than its call; symbolic queries gain nothing by
//! it.

use rustc_hash::FxHashMap;

use crate::ir::{Block, BlockId, Function, FunctionId, Instruction, Register, Terminator};

/// How large a function is: its instructions, ends of blocks included.
pub(super) fn size_of(function: &Function) -> usize {
    function.instructions().count() + function.blocks.len()
}

/// A function with the code of those that it calls which are at most so large, as long as it does
/// not grow beyond `most`.
pub(super) fn inlined(
    mut function: Function,
    functions: &[Function],
    largest: usize,
    most: usize,
) -> Function {
    let mut size = size_of(&function);
    let mut block = 0;
    while block < function.blocks.len() {
        let instructions = &function.blocks[block].instructions;
        let call = instructions.iter().position(|instruction| {
            let Instruction::Call { function, .. } = instruction else {
                return false;
            };
            let callee = &functions[function.0 as usize];
            let more = size_of(callee);
            callee.frame_words == 0 && more <= largest && size + more <= most
        });
        let Some(place) = call else {
            block += 1;
            continue;
        };
        let Instruction::Call {
            target,
            function: FunctionId(callee),
            arguments,
        } = function.blocks[block].instructions[place].clone()
        else {
            unreachable!("it is a call")
        };
        let callee = &functions[callee as usize];
        size += size_of(callee);
        take_in(&mut function, block, place, callee, target, &arguments);
    }
    function
}

/// Replaces a call by the code that it calls.
fn take_in(
    function: &mut Function,
    block: usize,
    place: usize,
    callee: &Function,
    target: Option<Register>,
    arguments: &[Register],
) {
    let first_register = function.registers.len() as u32;
    function.registers.extend(&callee.registers);
    let next = BlockId(function.blocks.len() as u32);
    let first_block = next.0 + 1;
    let before = &mut function.blocks[block];
    let mut after = before.instructions.split_off(place);
    after.remove(0);
    for (number, &source) in (first_register..).zip(arguments) {
        let target = Register(number);
        before
            .instructions
            .push(Instruction::Copy { target, source });
    }
    let end = std::mem::replace(
        &mut before.terminator,
        Terminator::Jump(BlockId(first_block)),
    );
    // Where a call decides how its caller goes on, a constant result leads there directly.
    let decides = after.is_empty().then(|| end.clone());
    let constants = constants_of(callee);
    function.blocks.push(Block {
        instructions: after,
        terminator: end,
    });
    for block in &callee.blocks {
        let mut block = block.clone();
        let returned = match block.terminator {
            Terminator::Return(result) => result,
            _ => None,
        };
        for instruction in &mut block.instructions {
            instruction.each_use_mut(&mut |register| register.0 += first_register);
            if let Some(register) = instruction.target_mut() {
                register.0 += first_register;
            }
        }
        if let Some(register) = block.terminator.used_mut() {
            register.0 += first_register;
        }
        for target in block.terminator.successors_mut() {
            target.0 += first_block;
        }
        if let Terminator::Return(result) = block.terminator {
            let value = returned.and_then(|result| *constants.get(&result)?);
            if let (Some(target), Some(source)) = (target, result) {
                block
                    .instructions
                    .push(Instruction::Copy { target, source });
            }
            block.terminator = Terminator::Jump(match (&decides, value) {
                (Some(Terminator::Branch(condition, then, otherwise)), Some(value))
                    if Some(*condition) == target =>
                {
                    if value == 0 {
                        *otherwise
                    } else {
                        *then
                    }
                }
                (Some(Terminator::Switch(number, list, otherwise)), Some(value))
                    if Some(*number) == target =>
                {
                    *list.get(value as usize).unwrap_or(otherwise)
                }
                _ => next,
            });
        }
        function.blocks.push(block);
    }
}

/// The registers of a function that are written once, with an integer that is known; `None` for
/// those that are written in another way.
fn constants_of(function: &Function) -> FxHashMap<Register, Option<i32>> {
    let mut constants = FxHashMap::default();
    for instruction in function.instructions() {
        if let Some(target) = instruction.target() {
            let value = match *instruction {
                Instruction::Integer { value, .. } if target.0 >= function.parameters => {
                    Some(value)
                }
                _ => None,
            };
            let known = constants.entry(target).or_insert(value);
            if *known != value {
                *known = None;
            }
        }
    }
    constants
}
