//! From code to faster code that does the same: for compiled code, and testable with the
//! interpreter.
//!
//! Invariant: results, states, emitted constraints and assignments, the sites where results wrap
//! round, and the kind and site of a run-time error stay what they were. Only rounds of loops that
//! are written out are no longer counted.
//!
//! A function is optimised by itself. Values are numbered, and loops of few rounds written out,
//! innermost first. Calls stay calls: taking in the code of small functions gained 8 % on one
//! member of the benchmarks, and nothing on others.
//!
//! Cost: about a microsecond an instruction of the result.

mod graph;
mod numbering;
mod unroll;

use rustc_hash::FxHashMap;

use crate::ir::{Block, Constants, Function};

use super::rounds::count_rounds;
use crate::tuning::Tuning;

/// Writing out of loops stops at functions of this size.
const MAX_SIZE: usize = 1500;
/// Larger functions are left as they are.
const MAX_SIZE_TO_OPTIMISE: usize = 20_000;

/// Optimises all functions of a program.
pub fn optimise(functions: &[Function], constants: impl Into<Constants>) -> Vec<Function> {
    let constants = constants.into();
    let functions = functions.iter().cloned();
    let optimised = functions.map(|one| optimised(one, &constants, Tuning::default()).0);
    optimised.collect()
}

/// A function in a faster form, and the words of constant memory that it depends on, in order.
///
/// It depends on nothing else: where a program has the same function and these words, the result is
/// the same.
pub(super) fn optimised(
    mut function: Function,
    constants: &[i32],
    tuning: Tuning,
) -> (Function, Vec<(u32, i32)>) {
    let mut memory = ConstantMemory {
        words: constants,
        read: FxHashMap::default(),
    };
    improve(&mut function, &mut memory, tuning);
    count_rounds(&mut function);
    let mut read: Vec<(u32, i32)> = memory.read.into_iter().collect();
    read.sort_unstable();
    (function, read)
}

/// A function in a faster form that goes into others, so that its rounds are not counted yet.
pub(crate) fn simplified(mut function: Function, constants: &Constants) -> Function {
    let mut memory = ConstantMemory {
        words: constants,
        read: FxHashMap::default(),
    };
    improve(&mut function, &mut memory, Tuning::default());
    function
}

/// The constant memory, and what was read of it.
struct ConstantMemory<'a> {
    words: &'a [i32],
    read: FxHashMap<u32, i32>,
}

impl ConstantMemory<'_> {
    fn word(&mut self, offset: u32) -> i32 {
        let word = self.words[offset as usize];
        self.read.insert(offset, word);
        word
    }
}

fn improve(function: &mut Function, constants: &mut ConstantMemory, tuning: Tuning) {
    if size_of(function) > MAX_SIZE_TO_OPTIMISE {
        return;
    }
    tidy(function, constants, tuning);
    while tuning.unrolling && unroll::unroll_one(function, MAX_SIZE) {
        tidy(function, constants, tuning);
    }
}

/// Numbers the values; once more if branches fell away, for then blocks can be joined.
fn tidy(function: &mut Function, constants: &mut ConstantMemory, tuning: Tuning) {
    graph::clean(function);
    if tuning.value_numbering && numbering::number_values(function, constants) {
        graph::clean(function);
        numbering::number_values(function, constants);
    }
    graph::clean(function);
}

/// How large a function is: its instructions, terminators included.
fn size_of(function: &Function) -> usize {
    size_of_blocks(&function.blocks)
}

fn size_of_blocks(blocks: &[Block]) -> usize {
    blocks
        .iter()
        .map(|block| block.instructions.len() + 1)
        .sum()
}
