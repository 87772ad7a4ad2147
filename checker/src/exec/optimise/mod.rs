//! From code to faster code that does the same: for compiled code, and testable with the
//! interpreter.
//!
//! Invariant: results, states, emitted constraints and assignments, the sites where results wrap
//! round, and the kind and site of a run-time error stay what they were. Only rounds of loops that
//! are written out are no longer counted.
//!
//! A function is optimised after the functions that it calls: their code is taken in where they are
//! small, or made to measure where they are called with constants ([`Optimiser::specialise`]); then
//! values are numbered and loops of few rounds written out, innermost first.
//!
//! Cost: about a microsecond an instruction of the result.

mod dead;
mod graph;
mod inline;
mod numbering;
mod unroll;

use std::collections::BTreeMap;

use crate::ir::{Block, Function, FunctionId, Instruction, Register};

use super::rounds::count_rounds;
use crate::tuning::Tuning;

/// Callees of at most this size are inlined.
const MAX_SIZE_TO_INLINE: usize = 60;
/// Inlining and writing out of loops stop at functions of this size.
const MAX_SIZE: usize = 1500;
/// Callees of at most this size are not made to measure, for they will be inlined.
const MAX_SIZE_TO_LEAVE_GENERAL: usize = 12;
/// A function is specialised for at most this number of different arguments.
const MAX_VARIANTS: usize = 16;
/// Larger functions are left as they are.
const MAX_SIZE_TO_OPTIMISE: usize = 20_000;

/// Optimises all functions of a program, which must not call each other thousands deep. Copies that
/// were made to measure stand behind the functions that were given.
pub fn optimise(functions: &[Function], constants: &[i32]) -> Vec<Function> {
    let mut optimiser = Optimiser::default();
    optimiser.extend(functions, constants);
    let known = functions.len() as u32;
    let numbers: Vec<u32> = (0..known)
        .map(|index| optimiser.optimised(FunctionId(index)))
        .collect();
    // Functions keep their numbers, and what else was made follows.
    let mut position = vec![None; optimiser.made.len()];
    for (index, &number) in numbers.iter().enumerate() {
        position[number as usize] = Some(index as u32);
    }
    let mut next = known;
    for position in &mut position {
        position.get_or_insert_with(|| {
            next += 1;
            next - 1
        });
    }
    let mut ordered: Vec<(u32, Function)> = position
        .iter()
        .map(|position| position.expect("every function has a position"))
        .zip(optimiser.made)
        .collect();
    ordered.sort_by_key(|(position, _)| *position);
    let mut functions: Vec<Function> = ordered.into_iter().map(|(_, function)| function).collect();
    for block in functions
        .iter_mut()
        .flat_map(|function| &mut function.blocks)
    {
        for instruction in &mut block.instructions {
            if let Instruction::Call { function, .. } = instruction {
                function.0 = position[function.0 as usize].expect("every function has a position");
            }
        }
    }
    functions
}

/// The constant arguments of a call, in order; `None` is not constant.
type Constants = Vec<Option<i32>>;

/// Optimises functions on demand.
#[derive(Debug, Default)]
pub(super) struct Optimiser {
    functions: Vec<Function>,
    constants: Vec<i32>,
    tuning: Tuning,
    /// The optimised functions; calls in them refer to each other.
    made: Vec<Function>,
    /// The number of the optimised function, by function and constant arguments.
    numbers: BTreeMap<(FunctionId, Constants), u32>,
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
    pub(super) fn extend(&mut self, functions: &[Function], constants: &[i32]) {
        let known = self.functions.len();
        self.functions.extend_from_slice(&functions[known..]);
        self.constants.clear();
        self.constants.extend_from_slice(constants);
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
        self.specialise(function, Vec::new())
    }

    /// Whether a function should be specialised. Without a limit, functions that hand on their
    /// arguments to each other in several ways would multiply.
    fn may_specialise(&self, function: FunctionId, arguments: &Constants) -> bool {
        let general = (function, Constants::new());
        let variants = self.numbers.range(general..).take(MAX_VARIANTS);
        let variants = variants.take_while(|((other, _), _)| *other == function);
        self.tuning.specialising
            && arguments.iter().any(Option::is_some)
            && size_of(&self.functions[function.0 as usize]) > MAX_SIZE_TO_LEAVE_GENERAL
            && (self.numbers.contains_key(&(function, arguments.clone()))
                || variants.count() < MAX_VARIANTS)
    }

    /// The number of a function made for constant arguments. It takes all arguments nevertheless.
    fn specialise(&mut self, function: FunctionId, arguments: Constants) -> u32 {
        let key = (function, arguments);
        if let Some(&number) = self.numbers.get(&key) {
            return number;
        }
        let mut made = self.functions[function.0 as usize].clone();
        for (index, value) in key.1.iter().enumerate() {
            if let Some(value) = *value {
                let target = Register(index as u32);
                made.blocks[0]
                    .instructions
                    .insert(0, Instruction::Integer { target, value });
            }
        }
        self.improve(&mut made);
        count_rounds(&mut made);
        self.made.push(made);
        let number = self.made.len() as u32 - 1;
        self.numbers.insert(key, number);
        number
    }

    fn improve(&mut self, function: &mut Function) {
        if size_of(function) > MAX_SIZE_TO_OPTIMISE {
            self.specialise_calls(function);
            return;
        }
        self.tidy(function);
        self.specialise_calls(function);
        let made = &self.made;
        let small = |FunctionId(number): FunctionId| {
            let callee = &made[number as usize];
            (size_of(callee) <= MAX_SIZE_TO_INLINE).then_some(callee)
        };
        if self.tuning.inlining {
            inline::inline_calls(function, &small, MAX_SIZE);
        }
        self.tidy(function);
        while self.tuning.unrolling && unroll::unroll_one(function, MAX_SIZE) {
            self.tidy(function);
        }
    }

    /// Numbers the values and removes what is dead; once more if branches fell away, for then
    /// blocks can be joined.
    fn tidy(&self, function: &mut Function) {
        graph::clean(function);
        if self.tuning.value_numbering && numbering::number_values(function, &self.constants) {
            graph::clean(function);
            numbering::number_values(function, &self.constants);
        }
        graph::clean(function);
        if self.tuning.dead_code {
            dead::remove_dead_code(function);
        }
    }

    /// Lets calls refer to optimised functions, made for the arguments that are constants.
    fn specialise_calls(&mut self, function: &mut Function) {
        let integers = known_integers(function);
        for block in &mut function.blocks {
            for instruction in &mut block.instructions {
                if let Instruction::Call {
                    function,
                    arguments,
                    ..
                } = instruction
                {
                    let mut constants: Constants = arguments
                        .iter()
                        .map(|register| integers[register.0 as usize])
                        .collect();
                    if !self.may_specialise(*function, &constants) {
                        constants.clear();
                    }
                    function.0 = self.specialise(*function, constants);
                }
            }
        }
    }
}

/// The registers that always hold the same integer.
fn known_integers(function: &Function) -> Vec<Option<i32>> {
    let mut writes = vec![0; function.registers.len()];
    writes[..function.parameters as usize].fill(1);
    let mut integers = vec![None; function.registers.len()];
    for instruction in function.instructions() {
        if let Some(Register(target)) = instruction.target() {
            writes[target as usize] += 1;
            if let Instruction::Integer { value, .. } = instruction {
                integers[target as usize] = Some(*value);
            }
        }
    }
    for (integer, &writes) in integers.iter_mut().zip(&writes) {
        if writes != 1 {
            *integer = None;
        }
    }
    integers
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
