//! From code to faster code that does the same: for compiled code, and testable with the
//! interpreter.
//!
//! Invariant: results, states, emitted constraints and assignments, the sites where results wrap
//! round, and the kind and site of a run-time error stay what they were. Only rounds of loops that
//! are written out are no longer counted.
//!
//! A function is optimised after the functions that it calls. Values are numbered, and loops of few
//! rounds written out, innermost first. Calls stay calls: taking in the code of small functions
//! gained 8 % on one member of the benchmarks, and nothing on others.
//!
//! Cost: about a microsecond an instruction of the result.

mod graph;
mod numbering;
mod unroll;

use std::collections::BTreeMap;

use crate::ir::{Block, Constants, Function, FunctionId, Instruction};

use super::rounds::count_rounds;
use crate::tuning::Tuning;

/// Writing out of loops stops at functions of this size.
const MAX_SIZE: usize = 1500;
/// Larger functions are left as they are.
const MAX_SIZE_TO_OPTIMISE: usize = 20_000;

/// Optimises all functions of a program, which must not call each other thousands deep.
pub fn optimise(functions: &[Function], constants: impl Into<Constants>) -> Vec<Function> {
    let mut optimiser = Optimiser::default();
    optimiser.extend(functions, constants);
    let numbers: Vec<u32> = (0..functions.len() as u32)
        .map(|index| optimiser.optimised(FunctionId(index)))
        .collect();
    // Functions keep their numbers.
    let mut position = vec![0; functions.len()];
    for (index, &number) in numbers.iter().enumerate() {
        position[number as usize] = index as u32;
    }
    let mut ordered: Vec<(u32, Function)> = position.iter().copied().zip(optimiser.made).collect();
    ordered.sort_by_key(|(position, _)| *position);
    let mut functions: Vec<Function> = ordered.into_iter().map(|(_, function)| function).collect();
    for block in functions
        .iter_mut()
        .flat_map(|function| &mut function.blocks)
    {
        for instruction in &mut block.instructions {
            if let Instruction::Call { function, .. } = instruction {
                function.0 = position[function.0 as usize];
            }
        }
    }
    functions
}

/// Optimises functions on demand.
#[derive(Debug, Default)]
pub(super) struct Optimiser {
    functions: Vec<Function>,
    constants: Constants,
    tuning: Tuning,
    /// The optimised functions; calls in them refer to each other.
    made: Vec<Function>,
    /// By function: the number of the optimised one.
    numbers: BTreeMap<FunctionId, u32>,
}

impl Optimiser {
    /// One that knows no functions, with these heuristics only.
    #[cfg(feature = "jit")]
    pub(super) fn tuned(tuning: Tuning) -> Optimiser {
        Optimiser {
            tuning,
            ..Optimiser::default()
        }
    }

    /// Takes over what was appended since: both arguments are the whole of it, and begin with what
    /// was given before.
    pub(super) fn extend(&mut self, functions: &[Function], constants: impl Into<Constants>) {
        let known = self.functions.len();
        self.functions.extend_from_slice(&functions[known..]);
        self.constants = constants.into();
    }

    /// The functions as they were given.
    #[cfg(feature = "jit")]
    pub(super) fn given(&self) -> &[Function] {
        &self.functions
    }

    /// The functions that were made so far.
    #[cfg(feature = "jit")]
    pub(super) fn made(&self) -> &[Function] {
        &self.made
    }

    /// The number of a function among those [made](Optimiser::made).
    pub(super) fn optimised(&mut self, function: FunctionId) -> u32 {
        if let Some(&number) = self.numbers.get(&function) {
            return number;
        }
        let mut made = self.functions[function.0 as usize].clone();
        self.improve(&mut made);
        count_rounds(&mut made);
        self.made.push(made);
        let number = self.made.len() as u32 - 1;
        self.numbers.insert(function, number);
        number
    }

    fn improve(&mut self, function: &mut Function) {
        self.optimise_calls(function);
        if size_of(function) > MAX_SIZE_TO_OPTIMISE {
            return;
        }
        self.tidy(function);
        while self.tuning.unrolling && unroll::unroll_one(function, MAX_SIZE) {
            self.tidy(function);
        }
    }

    /// Numbers the values; once more if branches fell away, for then blocks can be joined.
    fn tidy(&self, function: &mut Function) {
        graph::clean(function);
        if self.tuning.value_numbering && numbering::number_values(function, &self.constants) {
            graph::clean(function);
            numbering::number_values(function, &self.constants);
        }
        graph::clean(function);
    }

    /// Lets calls refer to optimised functions.
    fn optimise_calls(&mut self, function: &mut Function) {
        for block in &mut function.blocks {
            for instruction in &mut block.instructions {
                if let Instruction::Call { function, .. } = instruction {
                    function.0 = self.optimised(*function);
                }
            }
        }
    }
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
