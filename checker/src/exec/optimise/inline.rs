//! Puts the code of called functions in the place of calls.

use crate::ir::{
    Address, Base, Block, BlockId, Function, FunctionId, Instruction, Operand, Register, Terminator,
};

use super::graph::targets_mut;
use super::size_of;

/// Larger frames are not taken over: every call would zero them word by word.
const MAX_FRAME_WORDS: u32 = 16;

/// Inlines the calls for which `inlined` gives code, as long as the function does not grow beyond
/// `max_size`.
pub(super) fn inline_calls<'a>(
    function: &mut Function,
    inlined: &dyn Fn(FunctionId) -> Option<&'a Function>,
    max_size: usize,
) {
    let mut size = size_of(function);
    let mut block = 0;
    while block < function.blocks.len() {
        let found = function.blocks[block]
            .instructions
            .iter()
            .enumerate()
            .find_map(|(position, instruction)| match instruction {
                Instruction::Call { function, .. } => {
                    let callee = inlined(*function)?;
                    let fits =
                        callee.frame_words <= MAX_FRAME_WORDS && size + size_of(callee) <= max_size;
                    fits.then_some((position, callee))
                }
                _ => None,
            });
        match found {
            Some((position, callee)) => {
                size += size_of(callee);
                inline_call(function, block, position, callee);
            }
            None => block += 1,
        }
    }
}

/// Replaces a call by the code of the callee. The block ends before it; what followed moves to a
/// new block.
fn inline_call(function: &mut Function, block: usize, position: usize, callee: &Function) {
    let rest = function.blocks[block].instructions.split_off(position + 1);
    let call = function.blocks[block].instructions.pop();
    let Some(Instruction::Call {
        target, arguments, ..
    }) = call
    else {
        unreachable!("the position is that of a call");
    };
    let first_register = function.registers.len() as u32;
    function.registers.extend(&callee.registers);
    let first_block = function.blocks.len() as u32;
    let after = first_block + callee.blocks.len() as u32;
    let frame = function.frame_words;
    function.frame_words += callee.frame_words;
    let head = &mut function.blocks[block];
    for (index, source) in arguments.into_iter().enumerate() {
        head.instructions.push(Instruction::Copy {
            target: Register(first_register + index as u32),
            source,
        });
    }
    let terminator =
        std::mem::replace(&mut head.terminator, Terminator::Jump(BlockId(first_block)));
    zero_frame(function, block, frame, callee.frame_words);
    for block in &callee.blocks {
        let mut block = block.clone();
        shift(&mut block, first_register, first_block, frame);
        if let Terminator::Return(result) = block.terminator {
            if let (Some(target), Some(source)) = (target, result) {
                block
                    .instructions
                    .push(Instruction::Copy { target, source });
            }
            block.terminator = Terminator::Jump(BlockId(after));
        }
        function.blocks.push(block);
    }
    function.blocks.push(Block {
        instructions: rest,
        terminator,
    });
}

fn zero_frame(function: &mut Function, block: usize, first: u32, words: u32) {
    if words == 0 {
        return;
    }
    function.registers.push(crate::ir::RegisterType::Integer);
    let zero = Register(function.registers.len() as u32 - 1);
    let instructions = &mut function.blocks[block].instructions;
    instructions.push(Instruction::Integer {
        target: zero,
        value: 0,
    });
    for offset in first..first + words {
        let address = Address {
            base: Base::Frame,
            offset,
            index: None,
        };
        instructions.push(Instruction::StoreInteger {
            address,
            source: zero,
        });
    }
}

/// Renumbers what a block refers to.
fn shift(block: &mut Block, registers: u32, blocks: u32, frame: u32) {
    for instruction in &mut block.instructions {
        instruction.each_use_mut(&mut |register| register.0 += registers);
        instruction.each_operand_mut(&mut |operand| match operand {
            Operand::Target(target) => target.0 += registers,
            Operand::Memory(address, _) if address.base == Base::Frame => address.offset += frame,
            _ => {}
        });
    }
    if let Some(register) = block.terminator.used_mut() {
        register.0 += registers;
    }
    for target in targets_mut(&mut block.terminator) {
        target.0 += blocks;
    }
}
