//! Loads, stores, copies and comparisons of words.

use std::mem::offset_of;

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{InstBuilder, InstructionData, MemFlagsData, Opcode, Value};

use crate::exec::jit::runtime::{self, NativeContext};
use crate::ir::{Address, Base, Instruction};

use super::{INLINE_WORDS, MODEL_MEMORY, Translator};

impl Translator<'_> {
    /// The instructions that read and write memory.
    pub(super) fn access(&mut self, instruction: &Instruction) {
        match *instruction {
            Instruction::LoadInteger { target, address } => {
                let (base, offset) = self.place(address);
                let value = self.ins().load(I32, MODEL_MEMORY, base, offset);
                self.set(target, value);
            }
            Instruction::LoadDouble { target, address } => {
                let (base, offset) = self.place(address);
                let value = self.ins().load(F64, MODEL_MEMORY, base, offset);
                self.set(target, value);
            }
            Instruction::StoreInteger { address, source } => {
                let source = self.get(source);
                let (base, offset) = self.place(address);
                self.ins().store(MODEL_MEMORY, source, base, offset);
            }
            Instruction::StoreDouble {
                address,
                source,
                is_number,
            } => {
                let mut source = self.get(source);
                if !is_number {
                    source = self.canonical(source);
                }
                if let Some(double) = self.double(source) {
                    // The bits of a constant need no register of doubles.
                    source = self.ins().iconst(I64, double.to_bits() as i64);
                }
                let (base, offset) = self.place(address);
                self.ins().store(MODEL_MEMORY, source, base, offset);
            }
            Instruction::CopyWords {
                target,
                source,
                words,
            } => self.copy_words(target, source, words),
            Instruction::EqualWords {
                target,
                left,
                right,
                words,
            } => {
                let equal = self.equal_words(left, right, words);
                self.set(target, equal);
            }
            Instruction::AddressOf { target, address } => {
                let pointer = self.pointer(address);
                self.set(target, pointer);
            }
            _ => unreachable!("sorted out by instruction"),
        }
    }

    /// The value, with one NaN for all.
    pub(super) fn canonical(&mut self, value: Value) -> Value {
        if self.is_number(value) {
            return value;
        }
        let is_nan = self.ins().fcmp(FloatCC::Unordered, value, value);
        let nan = self.ins().f64const(f64::NAN);
        self.ins().select(is_nan, nan, value)
    }

    /// The double that a value always is, if it is a constant.
    pub(super) fn double(&self, value: Value) -> Option<f64> {
        let graph = &self.builder.func.dfg;
        match graph.insts[graph.value_def(value).inst()?] {
            InstructionData::UnaryIeee64 { imm, .. } => Some(f64::from_bits(imm.bits())),
            _ => None,
        }
    }

    /// Whether a value is known not to be a NaN.
    fn is_number(&self, value: Value) -> bool {
        let graph = &self.builder.func.dfg;
        let definition = graph.value_def(value).inst();
        let is_integer = definition
            .is_some_and(|instruction| graph.insts[instruction].opcode() == Opcode::FcvtFromSint);
        is_integer || self.double(value).is_some_and(|double| !double.is_nan())
    }

    fn copy_words(&mut self, target: Address, source: Address, words: u32) {
        if words > INLINE_WORDS {
            let (target, source) = (self.pointer(target), self.pointer(source));
            let count = self.ins().iconst(I64, i64::from(words));
            let code = runtime::copy_words as *const () as usize;
            self.call_back(code, None, &[target, source, count]);
            return;
        }
        let (source, source_offset) = self.place(source);
        let (target, target_offset) = self.place(target);
        for word in 0..words as i32 {
            let value = self
                .ins()
                .load(I32, MODEL_MEMORY, source, source_offset + 4 * word);
            self.ins()
                .store(MODEL_MEMORY, value, target, target_offset + 4 * word);
        }
    }

    fn equal_words(&mut self, left: Address, right: Address, words: u32) -> Value {
        if words > INLINE_WORDS {
            let (left, right) = (self.pointer(left), self.pointer(right));
            let count = self.ins().iconst(I64, i64::from(words));
            let code = runtime::equal_words as *const () as usize;
            return self.call_back(code, Some(I32), &[left, right, count]);
        }
        let (left, left_offset) = self.place(left);
        let (right, right_offset) = self.place(right);
        let mut difference = self.integer(0);
        for word in 0..words as i32 {
            let ins = self.ins();
            let left = ins.load(I32, MODEL_MEMORY, left, left_offset + 4 * word);
            let ins = self.ins();
            let right = ins.load(I32, MODEL_MEMORY, right, right_offset + 4 * word);
            let bits = self.ins().bxor(left, right);
            difference = self.ins().bor(difference, bits);
        }
        let equal = self.ins().icmp_imm_s(IntCC::Equal, difference, 0);
        self.truth(equal)
    }

    /// Where a word lies: a pointer and a number of bytes behind it.
    fn place(&mut self, address: Address) -> (Value, i32) {
        let mut base = match address.base {
            Base::State => self.state,
            Base::Frame => self.frame,
            Base::Constants => {
                let offset = offset_of!(NativeContext<'static>, constants) as i32;
                let flags = MemFlagsData::trusted().with_readonly().with_can_move();
                self.builder.ins().load(I64, flags, self.context, offset)
            }
            Base::Register(register) => self.get(register),
        };
        if let Some(index) = address.index {
            let index = self.get(index);
            let index = self.ins().uextend(I64, index);
            let bytes = self.ins().ishl_imm_u(index, 2);
            base = self.ins().iadd(base, bytes);
        }
        let bytes = 4 * i64::from(address.offset);
        // The bytes of a range must be countable behind it too.
        if bytes < 1 << 30 {
            (base, bytes as i32)
        } else {
            (self.ins().iadd_imm_s(base, bytes), 0)
        }
    }

    pub(super) fn pointer(&mut self, address: Address) -> Value {
        let (base, offset) = self.place(address);
        self.ins().iadd_imm_s(base, i64::from(offset))
    }
}
