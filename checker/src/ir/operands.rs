//! The operands of instructions: which registers, words and clocks they read and write.
//!
//! One walk over all kinds of instructions serves every caller, both for reading and for changing.
//! A new kind of instruction has one row here.

use super::code::{
    Address, Base, BlockId, ClockOperand, ExternalArgument, Function, Instruction, Register,
    STREAM_WORDS, Terminator,
};
use super::ids::{FunctionId, SiteId};

/// What an instruction does at an address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Access {
    /// It reads this number of words.
    Read(u32),
    /// It writes this number of words.
    Write(u32),
    /// It reads this number of words and then writes them.
    Update(u32),
    /// It takes the address.
    Take,
}

/// An operand, by reference: of registers, addresses and clocks.
pub(crate) enum Operand<R, A, C> {
    /// The register that the instruction writes.
    Target(R),
    /// A register that it reads.
    Source(R),
    /// An address, which may have registers.
    Memory(A, Access),
    /// A clock, which may have a register.
    Clock(C),
}

macro_rules! operand_walk {
    ($(#[$doc:meta])* $name:ident, $($mutable:tt)?) => {
        $(#[$doc])*
        pub(crate) fn $name<'a>(
            &'a $($mutable)? self,
            visit: &mut dyn FnMut(
                Operand<
                    &'a $($mutable)? Register,
                    &'a $($mutable)? Address,
                    &'a $($mutable)? ClockOperand,
                >,
            ),
        ) {
            use Access::{Read, Take, Update, Write};
            use Operand::{Clock, Memory, Source, Target};
            match self {
                Instruction::CountRound { .. } => {}
                Instruction::Integer { target, .. } | Instruction::Double { target, .. } => {
                    visit(Target(target));
                }
                Instruction::Copy { target, source }
                | Instruction::Not { target, source }
                | Instruction::IntegerToDouble { target, source }
                | Instruction::DoubleToInteger { target, source, .. }
                | Instruction::ScaleIndex { target, index: source, .. } => {
                    visit(Source(source));
                    visit(Target(target));
                }
                Instruction::Arithmetic { target, left, right, .. }
                | Instruction::CompareIntegers { target, left, right, .. }
                | Instruction::CompareDoubles { target, left, right, .. }
                | Instruction::DoubleArithmetic { target, left, right, .. }
                | Instruction::AddIndices { target, left, right } => {
                    visit(Source(left));
                    visit(Source(right));
                    visit(Target(target));
                }
                Instruction::Select { target, condition, then, otherwise } => {
                    visit(Source(condition));
                    visit(Source(then));
                    visit(Source(otherwise));
                    visit(Target(target));
                }
                Instruction::Math { target, arguments, .. } => {
                    for argument in arguments {
                        visit(Source(argument));
                    }
                    visit(Target(target));
                }
                Instruction::Random { target, arguments, stream, .. } => {
                    for argument in arguments {
                        visit(Source(argument));
                    }
                    visit(Memory(stream, Update(STREAM_WORDS as u32)));
                    visit(Target(target));
                }
                Instruction::Call { target, arguments, .. } => {
                    for argument in arguments {
                        visit(Source(argument));
                    }
                    if let Some(target) = target {
                        visit(Target(target));
                    }
                }
                Instruction::External { target, arguments, .. } => {
                    for argument in arguments {
                        match argument {
                            ExternalArgument::Value(register) => visit(Source(register)),
                            ExternalArgument::Memory { address, words, is_written } => {
                                let access = if *is_written { Update(*words) } else { Read(*words) };
                                visit(Memory(address, access));
                            }
                        }
                    }
                    if let Some(target) = target {
                        visit(Target(target));
                    }
                }
                Instruction::LoadInteger { target, address } => {
                    visit(Memory(address, Read(1)));
                    visit(Target(target));
                }
                Instruction::LoadDouble { target, address } => {
                    visit(Memory(address, Read(2)));
                    visit(Target(target));
                }
                Instruction::StoreInteger { address, source } => {
                    visit(Source(source));
                    visit(Memory(address, Write(1)));
                }
                Instruction::StoreDouble { address, source, .. } => {
                    visit(Source(source));
                    visit(Memory(address, Write(2)));
                }
                Instruction::CopyWords { target, source, words } => {
                    visit(Memory(source, Read(*words)));
                    visit(Memory(target, Write(*words)));
                }
                Instruction::EqualWords { target, left, right, words } => {
                    visit(Memory(left, Read(*words)));
                    visit(Memory(right, Read(*words)));
                    visit(Target(target));
                }
                Instruction::AddressOf { target, address } => {
                    visit(Memory(address, Take));
                    visit(Target(target));
                }
                Instruction::CheckRange { value: source, .. }
                | Instruction::Require { condition: source, .. } => visit(Source(source)),
                Instruction::Constrain { left, right, bound, .. } => {
                    visit(Clock(left));
                    visit(Clock(right));
                    visit(Source(bound));
                }
                Instruction::SetClock { clock, value, .. } => {
                    visit(Clock(clock));
                    visit(Source(value));
                }
                Instruction::CopyClock { clock, source, increment, .. } => {
                    visit(Clock(clock));
                    visit(Clock(source));
                    if let Some(increment) = increment {
                        visit(Source(increment));
                    }
                }
            }
        }
    };
}

impl Instruction {
    operand_walk! {
        /// Visits the operands.
        each_operand,
    }

    operand_walk! {
        /// Visits the operands, to change them.
        each_operand_mut, mut
    }

    /// The register that it writes.
    pub(crate) fn target(&self) -> Option<Register> {
        let mut found = None;
        self.each_operand(&mut |operand| {
            if let Operand::Target(target) = operand {
                found = Some(*target);
            }
        });
        found
    }

    /// The register that it writes, to change it.
    pub(crate) fn target_mut(&mut self) -> Option<&mut Register> {
        let mut found = None;
        self.each_operand_mut(&mut |operand| {
            if let Operand::Target(target) = operand {
                found = Some(target);
            }
        });
        found
    }

    /// Visits the registers that it reads, those of its addresses and clocks included.
    pub(crate) fn each_use(&self, visit: &mut dyn FnMut(Register)) {
        self.each_operand(&mut |operand| match operand {
            Operand::Target(_) => {}
            Operand::Source(&register) => visit(register),
            Operand::Memory(&address, _) => {
                if let Base::Register(register) = address.base {
                    visit(register);
                }
                address.index.into_iter().for_each(&mut *visit);
            }
            Operand::Clock(clock) => clock.index.into_iter().for_each(&mut *visit),
        });
    }

    /// Visits the registers that it reads, those of its addresses and clocks included, to change
    /// them.
    pub(crate) fn each_use_mut(&mut self, visit: &mut dyn FnMut(&mut Register)) {
        self.each_operand_mut(&mut |operand| match operand {
            Operand::Target(_) => {}
            Operand::Source(register) => visit(register),
            Operand::Memory(address, _) => {
                if let Base::Register(register) = &mut address.base {
                    visit(register);
                }
                address.index.iter_mut().for_each(&mut *visit);
            }
            Operand::Clock(clock) => clock.index.iter_mut().for_each(&mut *visit),
        });
    }

    /// Where it reports its errors, if it can have any.
    pub(crate) fn site(&self) -> Option<SiteId> {
        match *self {
            Instruction::Arithmetic { site, .. }
            | Instruction::DoubleToInteger { site, .. }
            | Instruction::Math { site, .. }
            | Instruction::Random { site, .. }
            | Instruction::External { site, .. }
            | Instruction::CheckRange { site, .. }
            | Instruction::ScaleIndex { site, .. }
            | Instruction::CountRound { site }
            | Instruction::Constrain { site, .. }
            | Instruction::SetClock { site, .. }
            | Instruction::CopyClock { site, .. }
            | Instruction::Require { site, .. } => Some(site),
            _ => None,
        }
    }
}

impl Terminator {
    /// The register that it reads.
    pub(crate) fn used(&self) -> Option<Register> {
        match *self {
            Terminator::Branch(condition, ..) | Terminator::Switch(condition, ..) => {
                Some(condition)
            }
            Terminator::Return(result) => result,
            Terminator::Jump(_) | Terminator::Fail(..) => None,
        }
    }

    /// The register that it reads, to change it.
    pub(crate) fn used_mut(&mut self) -> Option<&mut Register> {
        match self {
            Terminator::Branch(condition, ..) | Terminator::Switch(condition, ..) => {
                Some(condition)
            }
            Terminator::Return(result) => result.as_mut(),
            Terminator::Jump(_) | Terminator::Fail(..) => None,
        }
    }

    /// The blocks that it leads to.
    pub(crate) fn successors(&self) -> impl Iterator<Item = BlockId> {
        let (list, first, second) = match self {
            Terminator::Jump(target) => (&[][..], Some(target), None),
            Terminator::Branch(_, then, otherwise) => (&[][..], Some(then), Some(otherwise)),
            Terminator::Switch(_, list, otherwise) => (&list[..], Some(otherwise), None),
            Terminator::Return(_) | Terminator::Fail(..) => (&[][..], None, None),
        };
        list.iter().chain(first).chain(second).copied()
    }

    /// The blocks that it leads to, to redirect it.
    pub(crate) fn successors_mut(&mut self) -> impl Iterator<Item = &mut BlockId> {
        let (list, first, second) = match self {
            Terminator::Jump(target) => (&mut [][..], Some(target), None),
            Terminator::Branch(_, then, otherwise) => (&mut [][..], Some(then), Some(otherwise)),
            Terminator::Switch(_, list, otherwise) => (&mut list[..], Some(otherwise), None),
            Terminator::Return(_) | Terminator::Fail(..) => (&mut [][..], None, None),
        };
        list.iter_mut().chain(first).chain(second)
    }
}

impl Function {
    /// Its instructions, block by block.
    pub(crate) fn instructions(&self) -> impl Iterator<Item = &Instruction> {
        self.blocks.iter().flat_map(|block| &block.instructions)
    }

    /// The functions that it calls, once forevery call.
    pub(crate) fn callees(&self) -> impl Iterator<Item = FunctionId> {
        self.instructions()
            .filter_map(|instruction| match instruction {
                Instruction::Call { function, .. } => Some(*function),
                _ => None,
            })
    }
}
