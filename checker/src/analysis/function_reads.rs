//! Which words of a state a function may read, and which of its parameters, if its code shows it
//! without being run.

use std::ops::Range;

use crate::ir::{
    Access, Address, Base, Function, FunctionId, Instruction, Network, Operand, Register,
};

/// The words that functions may read, calls included, ascending; `None` if that is not known, or
/// they are more than `most`.
pub(crate) fn read_words(
    network: &Network,
    functions: impl IntoIterator<Item = FunctionId>,
    most: usize,
) -> Option<Vec<u32>> {
    let mut words = Vec::new();
    let mut open: Vec<FunctionId> = functions.into_iter().collect();
    let mut seen = 0;
    while let Some(&function) = open.get(seen) {
        seen += 1;
        let code = &network.functions[function.0 as usize];
        for instruction in code.instructions() {
            let mut is_known = true;
            instruction.each_operand(&mut |operand| {
                is_known &= match operand {
                    Operand::Memory(&address, Access::Read(count) | Access::Update(count)) => {
                        let touched = state_words(code, address, count, most);
                        let is_known = touched.is_some();
                        words.extend(touched.into_iter().flatten());
                        is_known
                    }
                    // The analysis does not follow where the address is used.
                    Operand::Memory(address, Access::Take) => address.base != Base::State,
                    _ => true,
                };
            });
            if let Instruction::Call { function, .. } = *instruction
                && !open.contains(&function)
            {
                open.push(function);
            }
            if !is_known {
                return None;
            }
        }
        words.sort_unstable();
        words.dedup();
    }
    (words.len() <= most).then_some(words)
}

/// Whether a function reads its parameters, for each of them.
pub(crate) fn read_parameters(function: &Function) -> Vec<bool> {
    let mut is_read = vec![false; function.parameters as usize];
    let mut read = |register: Register| {
        if let Some(is_read) = is_read.get_mut(register.0 as usize) {
            *is_read = true;
        }
    };
    for block in &function.blocks {
        for instruction in &block.instructions {
            instruction.each_use(&mut read);
        }
        block.terminator.used().into_iter().for_each(&mut read);
    }
    is_read
}

/// The words of the state that an access to `count` words may touch; `None` if that is not known,
/// or its place is one of more than `most`.
pub(super) fn state_words(
    code: &Function,
    address: Address,
    count: u32,
    most: usize,
) -> Option<Range<u32>> {
    match address.base {
        Base::Constants | Base::Frame => return Some(0..0),
        // What the register holds the address of is not followed.
        Base::Register(_) => return None,
        Base::State => {}
    }
    let greatest = match address.index {
        None => 0,
        Some(index) => greatest_index(code, index, MOST_STEPS)?,
    };
    let is_small = (greatest as usize) < most;
    is_small.then(|| address.offset..address.offset + greatest + count)
}

/// How many instructions back the value of an index is followed.
const MOST_STEPS: u32 = 8;

/// The greatest value that a checked index can have; `None` if it is not known.
fn greatest_index(code: &Function, index: Register, steps: u32) -> Option<u32> {
    let steps = steps.checked_sub(1)?;
    let mut greatest = None;
    for instruction in code.instructions() {
        let value = match *instruction {
            Instruction::ScaleIndex {
                target,
                length,
                stride,
                ..
            } if target == index => length.saturating_sub(1).checked_mul(stride)?,
            Instruction::AddIndices {
                target,
                left,
                right,
            } if target == index => {
                let (left, right) = (
                    greatest_index(code, left, steps)?,
                    greatest_index(code, right, steps)?,
                );
                left.checked_add(right)?
            }
            Instruction::Copy { target, source } if target == index => {
                greatest_index(code, source, steps)?
            }
            Instruction::Integer { target, value } if target == index => {
                u32::try_from(value).ok()?
            }
            ref other if other.target() == Some(index) => return None,
            _ => continue,
        };
        greatest = greatest.max(Some(value));
    }
    greatest
}
