//! Checks code before machine code is made of it: the compiler trusts what the interpreter would
//! stumble over.
//!
//! A program that passes has
//! * registers that exist and are of the types that each instruction wants, parameters first;
//! * jumps to blocks that exist, and calls of functions that exist, with arguments of the right
//!   number and types;
//! * no function that calls itself, directly or indirectly;
//! * accesses to the frame and the constants that stay inside, whatever the indices; and it says
//!   how long the state must be.
//!
//! Indices are bounded by the instructions that make them ([`Instruction::ScaleIndex`] checks them
//! when it runs). Not checked are accesses through addresses that are handed over as arguments: the
//! caller's place is checked, not its length.
//!
//! Cost: linear; a small part of what translating takes.

use std::fmt;

use crate::ir::{
    Address, Base, Block, BlockId, ClockOperand, Function, FunctionId, Instruction, Register,
    RegisterType, Terminator,
};

use RegisterType::{Double, Integer};

/// What is wrong with a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flaw {
    /// The function.
    pub function: FunctionId,
    /// The block, and the instruction in it; its number of instructions stands for the terminator.
    pub place: (usize, usize),
    /// What is wrong.
    pub what: &'static str,
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (block, instruction) = self.place;
        write!(
            f,
            "function {}, block {block}, instruction {instruction}: {}",
            self.function.0, self.what
        )
    }
}

/// Checks the functions from `first` on, which may call earlier ones; returns how many words of
/// state they reach.
pub fn validate(functions: &[Function], first: usize, constants: usize) -> Result<usize, Flaw> {
    let mut state_words = 0;
    for (index, function) in functions.iter().enumerate().skip(first) {
        let mut check = Check {
            functions,
            function,
            constants,
            limits: index_limits(function),
            state_words: 0,
        };
        check.function().map_err(|(place, what)| Flaw {
            function: FunctionId(index as u32),
            place,
            what,
        })?;
        state_words = state_words.max(check.state_words);
    }
    if let Some(function) = recursive(functions) {
        return Err(Flaw {
            function,
            place: (0, 0),
            what: "it calls itself",
        });
    }
    Ok(state_words)
}

type Verdict = Result<(), &'static str>;

/// The check of one function.
struct Check<'a> {
    functions: &'a [Function],
    function: &'a Function,
    constants: usize,
    /// By register: the greatest value, if it holds nothing but checked indices.
    limits: Vec<Option<u64>>,
    state_words: usize,
}

impl Check<'_> {
    fn function(&mut self) -> Result<(), ((usize, usize), &'static str)> {
        let function = self.function;
        if function.parameters as usize > function.registers.len() || function.blocks.is_empty() {
            return Err((
                (0, 0),
                "it has no blocks, or more parameters than registers",
            ));
        }
        for (number, block) in function.blocks.iter().enumerate() {
            self.block(block)
                .map_err(|(instruction, what)| ((number, instruction), what))?;
        }
        Ok(())
    }

    fn block(&mut self, block: &Block) -> Result<(), (usize, &'static str)> {
        for (number, instruction) in block.instructions.iter().enumerate() {
            self.instruction(instruction)
                .map_err(|what| (number, what))?;
        }
        self.terminator(block.terminator)
            .map_err(|what| (block.instructions.len(), what))
    }

    fn terminator(&self, terminator: Terminator) -> Verdict {
        match terminator {
            Terminator::Jump(target) => self.target(target),
            Terminator::Branch(condition, then, otherwise) => {
                self.wants(condition, Integer)?;
                self.target(then)?;
                self.target(otherwise)
            }
            Terminator::Return(value) => {
                let types = value.map(|register| self.kind(register)).transpose()?;
                if types != self.function.result {
                    return Err("it returns something else than it says");
                }
                Ok(())
            }
            Terminator::Fail(..) => Ok(()),
        }
    }

    fn target(&self, BlockId(target): BlockId) -> Verdict {
        if target as usize >= self.function.blocks.len() {
            return Err("a jump to a block that does not exist");
        }
        Ok(())
    }

    fn kind(&self, Register(register): Register) -> Result<RegisterType, &'static str> {
        let kind = self.function.registers.get(register as usize);
        kind.copied().ok_or("a register that does not exist")
    }

    fn wants(&self, register: Register, wanted: RegisterType) -> Verdict {
        if self.kind(register)? != wanted {
            return Err("a register of another type");
        }
        Ok(())
    }

    fn all(&self, registers: &[Register], wanted: RegisterType) -> Verdict {
        registers
            .iter()
            .try_for_each(|&register| self.wants(register, wanted))
    }

    fn instruction(&mut self, instruction: &Instruction) -> Verdict {
        match *instruction {
            Instruction::Integer { target, .. } => self.wants(target, Integer),
            Instruction::Double { target, .. } => self.wants(target, Double),
            Instruction::Copy { target, source } => self.wants(target, self.kind(source)?),
            Instruction::Arithmetic {
                target,
                left,
                right,
                ..
            }
            | Instruction::CompareIntegers {
                target,
                left,
                right,
                ..
            }
            | Instruction::AddIndices {
                target,
                left,
                right,
            } => self.all(&[target, left, right], Integer),
            Instruction::CompareDoubles {
                target,
                left,
                right,
                ..
            } => {
                self.wants(target, Integer)?;
                self.all(&[left, right], Double)
            }
            Instruction::Not { target, source } => self.all(&[target, source], Integer),
            Instruction::DoubleArithmetic {
                target,
                left,
                right,
                ..
            } => self.all(&[target, left, right], Double),
            Instruction::IntegerToDouble { target, source } => {
                self.wants(target, Double)?;
                self.wants(source, Integer)
            }
            Instruction::DoubleToInteger { target, source, .. } => {
                self.wants(target, Integer)?;
                self.wants(source, Double)
            }
            Instruction::Math {
                function,
                target,
                ref arguments,
                ..
            } => {
                self.wants(target, function.result())?;
                self.arguments(arguments, function.parameters())
            }
            Instruction::Call {
                target,
                function,
                ref arguments,
            } => self.call(target, function, arguments),
            Instruction::CheckRange { value, .. } => self.wants(value, Integer),
            Instruction::ScaleIndex { target, index, .. } => self.all(&[target, index], Integer),
            Instruction::Require { condition, .. } => self.wants(condition, Integer),
            Instruction::CountRound { .. } => Ok(()),
            Instruction::Constrain {
                left, right, bound, ..
            } => {
                self.clock(left)?;
                self.clock(right)?;
                self.wants(bound, Integer)
            }
            Instruction::SetClock { clock, value, .. } => {
                self.clock(clock)?;
                self.wants(value, Integer)
            }
            Instruction::CopyClock {
                clock,
                source,
                increment,
                ..
            } => {
                self.clock(clock)?;
                self.clock(source)?;
                increment.map_or(Ok(()), |register| self.wants(register, Integer))
            }
            _ => self.memory(instruction),
        }
    }

    /// The instructions that read and write memory.
    fn memory(&mut self, instruction: &Instruction) -> Verdict {
        match *instruction {
            Instruction::LoadInteger { target, address } => {
                self.wants(target, Integer)?;
                self.access(address, 1, false)
            }
            Instruction::LoadDouble { target, address } => {
                self.wants(target, Double)?;
                self.access(address, 2, false)
            }
            Instruction::StoreInteger { address, source } => {
                self.wants(source, Integer)?;
                self.access(address, 1, true)
            }
            Instruction::StoreDouble { address, source } => {
                self.wants(source, Double)?;
                self.access(address, 2, true)
            }
            Instruction::CopyWords {
                target,
                source,
                words,
            } => {
                self.access(target, words, true)?;
                self.access(source, words, false)
            }
            Instruction::EqualWords {
                target,
                left,
                right,
                words,
            } => {
                self.wants(target, Integer)?;
                self.access(left, words, false)?;
                self.access(right, words, false)
            }
            Instruction::AddressOf { target, address } => {
                self.wants(target, RegisterType::Address)?;
                self.access(address, 0, false)
            }
            _ => Ok(()),
        }
    }

    fn arguments(&self, arguments: &[Register], wanted: &[RegisterType]) -> Verdict {
        if arguments.len() != wanted.len() {
            return Err("a call with another number of arguments");
        }
        let mut pairs = arguments.iter().zip(wanted);
        pairs.try_for_each(|(&register, &wanted)| self.wants(register, wanted))
    }

    fn call(
        &self,
        target: Option<Register>,
        FunctionId(function): FunctionId,
        arguments: &[Register],
    ) -> Verdict {
        let callee = self.functions.get(function as usize);
        let callee = callee.ok_or("a call of a function that does not exist")?;
        self.arguments(arguments, &callee.registers[..callee.parameters as usize])?;
        match (target, callee.result) {
            (Some(target), Some(result)) => self.wants(target, result),
            (Some(_), None) => Err("the result of a function that returns nothing"),
            (None, _) => Ok(()),
        }
    }

    fn clock(&self, clock: ClockOperand) -> Verdict {
        clock
            .index
            .map_or(Ok(()), |register| self.wants(register, Integer))
    }

    /// An access to so many words from an address on.
    fn access(&mut self, address: Address, words: u32, writes: bool) -> Verdict {
        let mut end = u64::from(address.offset) + u64::from(words);
        if let Some(index) = address.index {
            self.wants(index, Integer)?;
            let limit = self.limits[index.0 as usize];
            end = end.saturating_add(limit.ok_or("an index that was not checked")?);
        }
        let (fits, what) = match address.base {
            Base::State => {
                self.state_words = self.state_words.max(end as usize);
                (true, "")
            }
            Base::Constants if writes => (false, "a constant that is written"),
            Base::Constants => (
                end <= self.constants as u64,
                "an access behind the constants",
            ),
            Base::Frame => (
                end <= u64::from(self.function.frame_words),
                "an access behind the frame",
            ),
            Base::Register(register) => {
                self.wants(register, RegisterType::Address)?;
                (true, "")
            }
        };
        if fits { Ok(()) } else { Err(what) }
    }
}

/// By register: the greatest value that it can hold, if it is written as an index only.
fn index_limits(function: &Function) -> Vec<Option<u64>> {
    let mut limits = vec![Some(0_u64); function.registers.len()];
    let parameters = (function.parameters as usize).min(limits.len());
    limits[..parameters].fill(None);
    // Sums are of indices that stand before them, as a rule: two passes suffice. What still grows
    // has no limit.
    let mut passes = 0;
    while raise_limits(function, &mut limits, passes > 2) {
        passes += 1;
    }
    limits
}

/// Raises the limits to what the instructions write; whether any rose. `give_up`: what rises has no
/// limit.
fn raise_limits(function: &Function, limits: &mut [Option<u64>], give_up: bool) -> bool {
    let mut has_risen = false;
    for instruction in function.blocks.iter().flat_map(|block| &block.instructions) {
        let (Register(target), limit) = match *instruction {
            Instruction::ScaleIndex {
                target,
                length,
                stride,
                ..
            } => {
                let last = u64::from(length.saturating_sub(1));
                (target, Some(last * u64::from(stride)))
            }
            Instruction::AddIndices {
                target,
                left,
                right,
            } => {
                let part =
                    |Register(register): Register| limits.get(register as usize).copied().flatten();
                (
                    target,
                    part(left)
                        .zip(part(right))
                        .map(|(a, b)| a.saturating_add(b)),
                )
            }
            _ => match super::optimise::target(instruction) {
                Some(target) => (target, None),
                None => continue,
            },
        };
        if let Some(known) = limits.get_mut(target as usize) {
            let joined = known.zip(limit).map(|(known, limit)| known.max(limit));
            if joined != *known {
                has_risen = true;
                *known = joined.filter(|_| !give_up);
            }
        }
    }
    has_risen
}

/// A function that calls itself, directly or indirectly.
fn recursive(functions: &[Function]) -> Option<FunctionId> {
    #[derive(Clone, Copy, PartialEq)]
    enum Visit {
        New,
        Open,
        Done,
    }
    let callees = |function: &Function| -> Vec<usize> {
        let instructions = function.blocks.iter().flat_map(|block| &block.instructions);
        instructions
            .filter_map(|instruction| match instruction {
                Instruction::Call { function, .. } => Some(function.0 as usize),
                _ => None,
            })
            .collect()
    };
    let mut visits = vec![Visit::New; functions.len()];
    for root in 0..functions.len() {
        if visits[root] != Visit::New {
            continue;
        }
        visits[root] = Visit::Open;
        let mut path = vec![(root, callees(&functions[root]))];
        while let Some((function, pending)) = path.last_mut() {
            let Some(callee) = pending.pop() else {
                visits[*function] = Visit::Done;
                path.pop();
                continue;
            };
            match visits[callee] {
                Visit::Open => return Some(FunctionId(callee as u32)),
                Visit::New => {
                    visits[callee] = Visit::Open;
                    path.push((callee, callees(&functions[callee])));
                }
                Visit::Done => {}
            }
        }
    }
    None
}
