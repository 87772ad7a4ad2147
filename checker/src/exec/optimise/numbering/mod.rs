//! Value numbering along the dominator tree: constants are folded, copies followed, and what was
//! computed, read or checked before is not computed, read or checked again.
//!
//! Conventions
//! * A register that the function writes once is its own value. Every write of another register
//!   goes to a new register instead; the old one is only kept as the place that carries the value
//!   over edges to blocks with several predecessors: it is written at the end of such an edge and
//!   copied to a new register where it is read behind it. So all values are immutable, and what is
//!   known of them holds wherever their definition dominates.
//! * What is known of memory is forgotten in blocks with several predecessors, at calls, and at
//!   writes that may concern it.
//! * No instruction moves in front of another one, and an instruction that can fail is removed only
//!   if it cannot fail here: the first error of a run stays the first. A second check of the same
//!   values cannot fail, since the first would have ended the call. An operation that may wrap
//!   round is computed at each of its places, since each is noted.
//!
//! Method: dominator-based value numbering after Briggs, Cooper and Simpson, "Value Numbering"
//! (1997). Cost: linear in the code but for copying what is known at branches, which is given up in
//! very large functions.

mod expressions;
mod memory;
mod simplify;

use rustc_hash::FxHashMap;

use crate::builtins::Number;
use crate::ir::{
    Address, Base, Block, BlockId, Function, Instruction, IntegerOperator, Operand, Register,
    RegisterType, Terminator,
};

use super::ConstantMemory;
use super::graph::{dominators, predecessors};

use expressions::{Expression, expression_of};
use memory::MAX_WORDS_TO_EXPAND;

/// In larger functions nothing is handed on to blocks with several predecessors.
const MAX_BLOCKS_TO_HAND_ON: usize = 500;
/// Numbers the values of a [`super::graph::clean`] function over the given constant memory. Says
/// whether branches fell away, so that cleaning up and numbering once more may find more.
pub(super) fn number_values(function: &mut Function, constants: &mut ConstantMemory) -> bool {
    let predecessors = predecessors(function);
    let dominators = dominators(function, &predecessors);
    let writes = count_writes(function);
    let mut numbering = Numbering {
        constants,
        replacements: (0..function.registers.len() as u32).map(Register).collect(),
        is_rewritten: writes.iter().map(|&writes| writes > 1).collect(),
        registers: std::mem::take(&mut function.registers),
        literals: FxHashMap::default(),
        addresses: FxHashMap::default(),
        sums: FxHashMap::default(),
        known: KnownFacts::default(),
        output: Vec::new(),
        has_decided: false,
    };
    numbering.walk(function, &predecessors, &dominators);
    function.registers = numbering.registers;
    numbering.has_decided
}

fn count_writes(function: &Function) -> Vec<u32> {
    let mut writes = vec![0; function.registers.len()];
    writes[..function.parameters as usize].fill(1);
    for instruction in function.instructions() {
        if let Some(Register(target)) = instruction.target() {
            writes[target as usize] += 1;
        }
    }
    writes
}

/// What is known at a place of the function.
#[derive(Clone, Debug, Default)]
struct KnownFacts {
    /// The value that a register which is written several times holds, and whether that is not yet
    /// in the register itself.
    current: FxHashMap<Register, (Register, bool)>,
    expressions: FxHashMap<Expression, Register>,
    /// The range of an integer value.
    ranges: FxHashMap<Register, (i32, i32)>,
    /// The value of a word of memory, or of a double.
    memory: FxHashMap<Address, Register>,
}

impl KnownFacts {
    /// What remains behind a join of several ways.
    fn after_join(mut self) -> KnownFacts {
        self.current.clear();
        self.memory
            .retain(|address, _| address.base == Base::Constants);
        self
    }
}

/// What an instruction comes down to.
enum Simplified {
    Nothing,
    Value(Register),
    Literal(Number),
    Instruction(Instruction),
}

struct Numbering<'a, 'c> {
    constants: &'a mut ConstantMemory<'c>,
    registers: Vec<RegisterType>,
    /// The value of a register that is written once.
    replacements: Vec<Register>,
    /// The registers that are written several times.
    is_rewritten: Vec<bool>,
    /// The values that are constants.
    literals: FxHashMap<Register, Number>,
    /// The values that are known addresses.
    addresses: FxHashMap<Register, Address>,
    /// The values that are an index and a constant.
    sums: FxHashMap<Register, (Register, i32)>,
    known: KnownFacts,
    /// The block under construction.
    output: Vec<Instruction>,
    /// Whether a branch was found to go only one way.
    has_decided: bool,
}

impl Numbering<'_, '_> {
    fn walk(&mut self, function: &mut Function, predecessors: &[Vec<usize>], dominators: &[usize]) {
        let count = function.blocks.len();
        let is_join: Vec<bool> = (0..count)
            .map(|block| predecessors[block].len() > 1 || block == 0)
            .collect();
        let hands_on = count <= MAX_BLOCKS_TO_HAND_ON;
        let mut heirs = vec![0; count];
        for block in 1..count {
            heirs[dominators[block]] += usize::from(hands_on || !is_join[block]);
        }
        let mut ends: Vec<Option<KnownFacts>> = vec![None; count];
        let mut reached = vec![false; count];
        reached[0] = true;
        for block in 0..count {
            let mut known = KnownFacts::default();
            if block > 0 && (hands_on || !is_join[block]) {
                let from = dominators[block];
                heirs[from] -= 1;
                if heirs[from] == 0 {
                    known = ends[from].take().unwrap_or_default();
                } else if reached[block] {
                    known = ends[from].clone().unwrap_or_default();
                }
            }
            if !reached[block] {
                continue;
            }
            self.known = if is_join[block] {
                known.after_join()
            } else {
                known
            };
            self.block(function, block, &is_join);
            for BlockId(target) in function.blocks[block].terminator.successors() {
                // Blocks beyond the old ones are edges that were split for their copies.
                match function.blocks.get(target as usize) {
                    Some(_) if (target as usize) < count => reached[target as usize] = true,
                    Some(split) => {
                        for BlockId(target) in split.terminator.successors() {
                            reached[target as usize] = true;
                        }
                    }
                    None => {}
                }
            }
            if heirs[block] > 0 {
                ends[block] = Some(std::mem::take(&mut self.known));
            }
        }
    }

    fn block(&mut self, function: &mut Function, index: usize, is_join: &[bool]) {
        let instructions = std::mem::take(&mut function.blocks[index].instructions);
        for instruction in instructions {
            self.instruction(instruction);
        }
        let mut terminator = function.blocks[index].terminator.clone();
        if let Some(register) = terminator.used_mut() {
            *register = self.value(*register);
        }
        let decided = match &terminator {
            Terminator::Branch(condition, then, otherwise) => self
                .integer(*condition)
                .map(|condition| if condition != 0 { *then } else { *otherwise }),
            Terminator::Switch(number, list, otherwise) => self
                .integer(*number)
                .map(|number| *list.get(number as usize).unwrap_or(otherwise)),
            _ => None,
        };
        if let Some(next) = decided {
            terminator = Terminator::Jump(next);
            self.has_decided = true;
        }
        let carried = self.carried();
        if let Terminator::Jump(target) = terminator {
            if is_join[target.0 as usize] {
                self.output.extend(carried);
            }
        } else if !carried.is_empty() {
            for target in terminator.successors_mut() {
                if is_join[target.0 as usize] {
                    function.blocks.push(Block {
                        instructions: carried.clone(),
                        terminator: Terminator::Jump(*target),
                    });
                    target.0 = function.blocks.len() as u32 - 1;
                }
            }
        }
        let block = &mut function.blocks[index];
        block.instructions = std::mem::take(&mut self.output);
        block.terminator = terminator;
    }

    /// The copies that bring registers up to date before a block with several predecessors.
    fn carried(&self) -> Vec<Instruction> {
        let mut carried: Vec<(Register, Register)> = self
            .known
            .current
            .iter()
            .filter(|(_, (_, is_pending))| *is_pending)
            .map(|(&target, &(source, _))| (target, source))
            .collect();
        carried.sort_unstable();
        carried
            .into_iter()
            .map(|(target, source)| Instruction::Copy { target, source })
            .collect()
    }

    /// The value that a register holds.
    fn value(&mut self, register: Register) -> Register {
        let index = register.0 as usize;
        if index >= self.is_rewritten.len() {
            return register;
        }
        if !self.is_rewritten[index] {
            return self.replacements[index];
        }
        if let Some(&(value, _)) = self.known.current.get(&register) {
            return value;
        }
        let value = self.new_register(self.registers[index]);
        self.output.push(Instruction::Copy {
            target: value,
            source: register,
        });
        self.known.current.insert(register, (value, false));
        value
    }

    fn new_register(&mut self, kind: RegisterType) -> Register {
        self.registers.push(kind);
        Register(self.registers.len() as u32 - 1)
    }

    /// Says what a register holds from here on.
    fn define(&mut self, target: Register, value: Register) {
        let index = target.0 as usize;
        if index >= self.is_rewritten.len() {
            return;
        }
        if self.is_rewritten[index] {
            self.known.current.insert(target, (value, true));
        } else {
            self.replacements[index] = value;
        }
    }

    fn literal(&self, value: Register) -> Option<Number> {
        self.literals.get(&value).copied()
    }

    fn integer(&self, value: Register) -> Option<i32> {
        match self.literal(value) {
            Some(Number::Integer(value)) => Some(value),
            _ => None,
        }
    }

    fn double(&self, value: Register) -> Option<f64> {
        match self.literal(value) {
            Some(Number::Double(value)) => Some(value),
            _ => None,
        }
    }

    fn range(&self, value: Register) -> (i32, i32) {
        let known = self.known.ranges.get(&value).copied();
        match self.integer(value) {
            Some(value) => (value, value),
            None => known.unwrap_or((i32::MIN, i32::MAX)),
        }
    }

    fn instruction(&mut self, mut instruction: Instruction) {
        instruction.each_use_mut(&mut |register| *register = self.value(*register));
        instruction.each_operand_mut(&mut |operand| match operand {
            Operand::Memory(address, _) => self.resolve(address),
            Operand::Clock(clock) => {
                if let Some(index) = clock.index.and_then(|index| self.integer(index)) {
                    clock.first.0 = clock.first.0.wrapping_add(index as u32);
                    clock.index = None;
                }
            }
            Operand::Target(_) | Operand::Source(_) => {}
        });
        if let Instruction::CopyWords {
            target,
            source,
            words,
        } = instruction
            && words <= MAX_WORDS_TO_EXPAND
        {
            self.expand_copy(target, source, words);
            return;
        }
        let target = instruction.target();
        let simplified = self.simplify(instruction);
        let value = match simplified {
            Simplified::Nothing => return,
            Simplified::Value(value) => value,
            Simplified::Literal(literal) => self.literal_value(literal),
            Simplified::Instruction(instruction) => {
                let Some(value) = self.emit(instruction) else {
                    return;
                };
                value
            }
        };
        self.define(target.expect("what has a value has a target"), value);
    }

    /// The value of a constant.
    fn literal_value(&mut self, literal: Number) -> Register {
        let (kind, expression) = match literal {
            Number::Integer(value) => (RegisterType::Integer, Expression::Integer(value)),
            Number::Double(value) => (RegisterType::Double, Expression::Double(value.to_bits())),
        };
        if let Some(&value) = self.known.expressions.get(&expression) {
            return value;
        }
        let target = self.new_register(kind);
        self.output.push(match literal {
            Number::Integer(value) => Instruction::Integer { target, value },
            Number::Double(value) => Instruction::Double {
                target,
                value: value.into(),
            },
        });
        self.literals.insert(target, literal);
        self.known.expressions.insert(expression, target);
        target
    }

    /// Puts an instruction out, unless its value is known, and returns the value that it gives.
    fn emit(&mut self, mut instruction: Instruction) -> Option<Register> {
        let expression = expression_of(&instruction);
        if let Some(expression) = &expression
            && let Some(&value) = self.known.expressions.get(expression)
        {
            return Some(value);
        }
        let value = instruction.target_mut().map(|target| {
            let index = target.0 as usize;
            if self.is_rewritten.get(index) == Some(&true) {
                *target = Register(self.registers.len() as u32);
                self.registers.push(self.registers[index]);
            }
            *target
        });
        if let Some(value) = value {
            self.learn(&instruction, value);
            if let Some(expression) = expression {
                self.known.expressions.insert(expression, value);
            }
        }
        self.output.push(instruction);
        value
    }

    /// Notes what is known of the value of an instruction.
    fn learn(&mut self, instruction: &Instruction, value: Register) {
        match *instruction {
            Instruction::LoadInteger { address, .. } | Instruction::LoadDouble { address, .. } => {
                self.remember(address, value);
            }
            Instruction::AddressOf { address, .. } => {
                self.addresses.insert(value, address);
            }
            Instruction::CompareIntegers { .. }
            | Instruction::CompareDoubles { .. }
            | Instruction::Not { .. }
            | Instruction::EqualWords { .. } => {
                self.known.ranges.insert(value, (0, 1));
            }
            Instruction::ScaleIndex { length, stride, .. } => {
                let last = u64::from(length.saturating_sub(1)) * u64::from(stride);
                let last = i32::try_from(last).unwrap_or(i32::MAX);
                self.known.ranges.insert(value, (0, last));
            }
            Instruction::AddIndices { left, right, .. } => {
                if let Some(increment) = self.integer(right) {
                    self.sums.insert(value, (left, increment));
                }
                self.learn_sum(value, left, right);
            }
            Instruction::Arithmetic {
                operator,
                left,
                right,
                ..
            } => match operator {
                IntegerOperator::Add => self.learn_sum(value, left, right),
                IntegerOperator::And => {
                    let mask = self.integer(left).or(self.integer(right));
                    if let Some(mask) = mask.filter(|&mask| mask >= 0) {
                        self.known.ranges.insert(value, (0, mask));
                    }
                }
                _ => {}
            },
            _ => {}
        }
    }

    fn learn_sum(&mut self, value: Register, left: Register, right: Register) {
        let (left, right) = (self.range(left), self.range(right));
        if let (Some(low), Some(high)) = (left.0.checked_add(right.0), left.1.checked_add(right.1))
        {
            self.known.ranges.insert(value, (low, high));
        }
    }
}
