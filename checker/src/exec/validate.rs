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

use super::cycles::cycle_heads;
use super::libraries;
use crate::builtins::MOST_PARAMETERS;
use crate::cancellation;
use crate::ir::{
    Access, Address, Base, Block, BlockId, ClockOperand, ExternalArgument, ExternalId,
    ExternalParameter, ExternalType, Function, FunctionId, Instruction, Operand, Register,
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

/// What it takes to check a function, as a rule, and to make it ready to run: see
/// [`cancellation::work`].
const UNITS_FOR_FUNCTION: usize = 1 << 12;

/// Checks the functions from `first` on, which may call earlier ones; returns how many words of
/// state they reach.
pub fn validate(functions: &[Function], first: usize, constants: usize) -> Result<usize, Flaw> {
    let mut state_words = 0;
    for (index, function) in functions.iter().enumerate().skip(first) {
        cancellation::work(UNITS_FOR_FUNCTION);
        let mut check = FunctionCheck {
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
struct FunctionCheck<'a> {
    functions: &'a [Function],
    function: &'a Function,
    constants: usize,
    /// By register: the greatest value, if it holds nothing but checked indices.
    limits: Vec<Option<u64>>,
    state_words: usize,
}

impl FunctionCheck<'_> {
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
        self.terminator(&block.terminator)
            .map_err(|what| (block.instructions.len(), what))
    }

    fn terminator(&self, terminator: &Terminator) -> Verdict {
        match *terminator {
            Terminator::Branch(number, ..) | Terminator::Switch(number, ..) => {
                self.wants(number, Integer)?;
            }
            Terminator::Return(value) => {
                let types = value.map(|register| self.kind(register)).transpose()?;
                if types != self.function.result {
                    return Err("it returns something else than it says");
                }
            }
            Terminator::Jump(_) | Terminator::Fail(..) => {}
        }
        let mut targets = terminator.successors();
        targets.try_for_each(|target| self.target(target))
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
        self.registers(instruction)?;
        let mut verdict = Ok(());
        instruction.each_operand(&mut |operand| {
            if verdict.is_ok() {
                verdict = match operand {
                    Operand::Memory(&address, access) => self.access(address, access),
                    Operand::Clock(ClockOperand {
                        index: Some(index), ..
                    }) => self.wants(*index, Integer),
                    Operand::Target(_) | Operand::Source(_) | Operand::Clock(_) => Ok(()),
                };
            }
        });
        verdict
    }

    /// The types of the registers that are operands themselves.
    fn registers(&self, instruction: &Instruction) -> Verdict {
        use Instruction as I;
        match *instruction {
            I::Copy { target, source } => self.wants(target, self.kind(source)?),
            I::CompareDoubles {
                target,
                left,
                right,
                ..
            } => {
                self.wants(target, Integer)?;
                self.all(&[left, right], Double)
            }
            I::IntegerToDouble { target, source } => {
                self.wants(target, Double)?;
                self.wants(source, Integer)
            }
            I::DoubleToInteger { target, source, .. } => {
                self.wants(target, Integer)?;
                self.wants(source, Double)
            }
            I::Math {
                function,
                target,
                ref arguments,
                ..
            } => {
                self.wants(target, function.result())?;
                self.arguments(arguments, function.parameters())
            }
            I::Random {
                distribution,
                target,
                ref arguments,
                ..
            } => {
                self.wants(target, Double)?;
                self.arguments(
                    arguments,
                    &[Double; MOST_PARAMETERS][..distribution.arity()],
                )
            }
            I::External {
                target,
                function,
                ref arguments,
                ..
            } => self.external(target, function, arguments),
            I::Call {
                target,
                function,
                ref arguments,
            } => self.call(target, function, arguments),
            I::AddressOf { target, .. } => self.wants(target, RegisterType::Address),
            I::Double { .. }
            | I::DoubleArithmetic { .. }
            | I::LoadDouble { .. }
            | I::StoreDouble { .. } => self.all_operands(instruction, Double),
            I::Integer { .. }
            | I::Arithmetic { .. }
            | I::CompareIntegers { .. }
            | I::Select { .. }
            | I::AddIndices { .. }
            | I::Not { .. }
            | I::CheckRange { .. }
            | I::ScaleIndex { .. }
            | I::Require { .. }
            | I::CountRound { .. }
            | I::LoadInteger { .. }
            | I::StoreInteger { .. }
            | I::CopyWords { .. }
            | I::EqualWords { .. }
            | I::Constrain { .. }
            | I::SetClock { .. }
            | I::CopyClock { .. } => self.all_operands(instruction, Integer),
        }
    }

    /// All registers that are operands themselves are of one type.
    fn all_operands(&self, instruction: &Instruction, wanted: RegisterType) -> Verdict {
        let mut verdict = Ok(());
        instruction.each_operand(&mut |operand| {
            if let (true, Operand::Target(&register) | Operand::Source(&register)) =
                (verdict.is_ok(), operand)
            {
                verdict = self.wants(register, wanted);
            }
        });
        verdict
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

    fn external(
        &self,
        target: Option<Register>,
        function: ExternalId,
        arguments: &[ExternalArgument],
    ) -> Verdict {
        let register_type = |kind| match kind {
            ExternalType::Integer | ExternalType::Bool => Integer,
            ExternalType::Double => Double,
        };
        let signature = libraries::signature_of(function).ok_or("a function of no library")?;
        if arguments.len() != signature.parameters.len() {
            return Err("a call with another number of arguments");
        }
        for (argument, parameter) in arguments.iter().zip(&signature.parameters) {
            match (argument, parameter) {
                (ExternalArgument::Value(register), ExternalParameter::Value(kind)) => {
                    self.wants(*register, register_type(*kind))?;
                }
                (
                    ExternalArgument::Memory {
                        words, is_written, ..
                    },
                    parameter,
                ) if parameter.memory() == Some((*words, *is_written)) => {}
                _ => return Err("an argument of another kind than the library wants"),
            }
        }
        match (target, signature.result) {
            (Some(target), Some(result)) => self.wants(target, register_type(result)),
            (Some(_), None) => Err("the result of a function that returns nothing"),
            (None, _) => Ok(()),
        }
    }

    /// An access to the words from an address on.
    fn access(&mut self, address: Address, access: Access) -> Verdict {
        let (words, writes) = match access {
            Access::Read(words) => (words, false),
            Access::Write(words) | Access::Update(words) => (words, true),
            Access::Take => (0, false),
        };
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
    for instruction in function.instructions() {
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
            _ => match instruction.target() {
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
    let callees = |index: usize| {
        let callees = functions[index].callees();
        callees.map(|FunctionId(callee)| callee as usize).collect()
    };
    let heads = cycle_heads(functions.len(), callees);
    heads.first().map(|&head| FunctionId(head as u32))
}
