//! What is known of words of memory.
//!
//! Invariant: a word is forgotten with every write that may concern it, so that what is remembered
//! holds.

use crate::builtins::Number;
use crate::exec::arithmetic;
use crate::ir::{Address, Base, Instruction, Register, RegisterType, STREAM_WORDS};

use super::{Numbering, Simplified};

/// So many words of memory are remembered.
const MAX_KNOWN_WORDS: usize = 1024;

/// Copies of at most this number of words become loads and stores, which can be followed.
pub(super) const MAX_WORDS_TO_EXPAND: u32 = 9;

impl Numbering<'_, '_> {
    pub(super) fn expand_copy(&mut self, target: Address, source: Address, words: u32) {
        for word in 0..words {
            let at = |address: Address| Address {
                offset: address.offset + word,
                ..address
            };
            let value = self.new_register(RegisterType::Integer);
            let load = Instruction::LoadInteger {
                target: value,
                address: at(source),
            };
            let value = match self.simplify(load) {
                Simplified::Value(value) => value,
                Simplified::Literal(literal) => self.literal_value(literal),
                Simplified::Instruction(load) => self.emit(load).expect("a load has a target"),
                Simplified::Nothing => value,
            };
            let store = Instruction::StoreInteger {
                address: at(target),
                source: value,
            };
            if let Simplified::Instruction(store) = self.simplify(store) {
                self.emit(store);
            }
        }
    }

    /// Follows addresses in registers, and takes constants out of the index.
    pub(super) fn resolve(&self, address: &mut Address) {
        if let Base::Register(register) = address.base
            && let Some(known) = self.addresses.get(&register)
            && (known.index.is_none() || address.index.is_none())
        {
            *address = Address {
                base: known.base,
                offset: known.offset + address.offset,
                index: known.index.or(address.index),
            };
        }
        while let Some(index) = address.index {
            if let Some(index) = self.integer(index) {
                address.offset = address.offset.wrapping_add(index as u32);
                address.index = None;
            } else if let Some(&(rest, increment)) = self.sums.get(&index)
                && increment >= 0
                && self.range(rest).0 >= 0
            {
                address.offset += increment as u32;
                address.index = Some(rest);
            } else {
                break;
            }
        }
    }

    pub(super) fn simplify_access(&mut self, instruction: Instruction) -> Simplified {
        match instruction {
            Instruction::LoadInteger { address, .. } => {
                self.simplify_load(address, RegisterType::Integer, instruction)
            }
            Instruction::LoadDouble { address, .. } => {
                self.simplify_load(address, RegisterType::Double, instruction)
            }
            Instruction::StoreInteger { address, source } => {
                if self.remembered(address, RegisterType::Integer) == Some(source) {
                    return Simplified::Nothing;
                }
                self.forget(address, 1);
                self.remember(address, source);
                Simplified::Instruction(instruction)
            }
            Instruction::StoreDouble {
                address, source, ..
            } => {
                self.forget(address, 2);
                self.remember(address, source);
                Simplified::Instruction(instruction)
            }
            Instruction::CopyWords { target, words, .. } => {
                self.forget(target, words);
                Simplified::Instruction(instruction)
            }
            Instruction::Random { stream, .. } => {
                self.forget(stream, STREAM_WORDS as u32);
                Simplified::Instruction(instruction)
            }
            _ => {
                self.known
                    .memory
                    .retain(|address, _| address.base == Base::Constants);
                Simplified::Instruction(instruction)
            }
        }
    }

    fn simplify_load(
        &mut self,
        address: Address,
        kind: RegisterType,
        instruction: Instruction,
    ) -> Simplified {
        if let Some(value) = self.remembered(address, kind) {
            return Simplified::Value(value);
        }
        if address.base == Base::Constants && address.index.is_none() {
            let first = self.constants.word(address.offset);
            return Simplified::Literal(match kind {
                RegisterType::Double => Number::Double(arithmetic::double_of_words(
                    first,
                    self.constants.word(address.offset + 1),
                )),
                _ => Number::Integer(first),
            });
        }
        Simplified::Instruction(instruction)
    }

    /// The value of the word at an address, or of the double.
    fn remembered(&self, address: Address, kind: RegisterType) -> Option<Register> {
        let value = *self.known.memory.get(&address)?;
        (self.registers[value.0 as usize] == kind).then_some(value)
    }

    pub(super) fn remember(&mut self, address: Address, value: Register) {
        if self.known.memory.len() < MAX_KNOWN_WORDS {
            self.known.memory.insert(address, value);
        }
    }

    /// Forgets what a write of this number of words may change.
    fn forget(&mut self, written: Address, words: u32) {
        let mut memory = std::mem::take(&mut self.known.memory);
        memory.retain(|&address, &mut value| {
            let width = match self.registers[value.0 as usize] {
                RegisterType::Double => 2,
                _ => 1,
            };
            self.are_disjoint(written, words, address, width)
        });
        self.known.memory = memory;
    }

    fn are_disjoint(
        &self,
        left: Address,
        left_words: u32,
        right: Address,
        right_words: u32,
    ) -> bool {
        let is_register = |base| matches!(base, Base::Register(_));
        if left.base != right.base {
            // Constants are never written; an address in a register may lie in the state or in any
            // frame.
            return left.base == Base::Constants
                || right.base == Base::Constants
                || !(is_register(left.base) || is_register(right.base));
        }
        let (left_first, left_last) = self.extent(left, left.index != right.index);
        let (right_first, right_last) = self.extent(right, left.index != right.index);
        left_last + u64::from(left_words) <= right_first
            || right_last + u64::from(right_words) <= left_first
    }

    /// The least and the greatest offset that an address may have, leaving out the index if it does
    /// not matter.
    fn extent(&self, address: Address, with_index: bool) -> (u64, u64) {
        let offset = u64::from(address.offset);
        match address.index.filter(|_| with_index) {
            None => (offset, offset),
            Some(index) => {
                let (low, high) = self.range(index);
                (offset + low.max(0) as u64, offset + high.max(0) as u64)
            }
        }
    }
}
