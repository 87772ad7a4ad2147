//! From code to Cranelift's intermediate representation, one function at a time.
//!
//! Invariants
//! * A compiled function takes the [`NativeContext`], the state's words, its frame, and its own arguments in native types;
//!   it returns the status (see [`super::runtime`]) and, for a double or an address, the value beside it.
//! * A check that fails jumps to a cold block that returns the status of its kind and site; nothing is trapped by signals.
//! * An address is a pointer. The frame of a callee begins where the frame of its caller ends.
//!
//! Memory is accessed without checks of bounds: the code was produced with every index checked by a
//! [`Instruction::ScaleIndex`], and the caller hands over as many words of state and frame as the functions need.

use std::mem::offset_of;

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{
    AbiParam, Block as NativeBlock, FuncRef, InstBuilder, MemFlagsData, SigRef, Signature, Type,
    Value,
};
use cranelift_codegen::isa::{CallConv, TargetFrontendConfig};
use cranelift_frontend::{FunctionBuilder, Variable};

use crate::exec::math::{self, MathCode};
use crate::ir::{
    Address, Base, CLOCK_LIMIT, ClockOperand, DoubleOperator, Function, FunctionId, Instruction,
    IntegerOperator, MathFunction, Register, RegisterType, Relation, RunTimeErrorKind, SiteId,
    Terminator,
};

use super::runtime::{self, NativeContext, failure_status};

/// Up to so many words are copied, compared or zeroed in line.
const INLINE_WORDS: u32 = 16;

/// Memory of the model: always there, but a double may lie at an odd word.
const MODEL_MEMORY: MemFlagsData = MemFlagsData::new().with_notrap();

/// The type of a register in native code.
pub(super) fn native_type(register: RegisterType) -> Type {
    match register {
        RegisterType::Integer => I32,
        RegisterType::Double => F64,
        RegisterType::Address => I64,
    }
}

/// The native signature of a function.
pub(super) fn native_signature(function: &Function, convention: CallConv) -> Signature {
    let mut signature = Signature::new(convention);
    signature.params = vec![AbiParam::new(I64); 3];
    let parameters = &function.registers[..function.parameters as usize];
    signature.params.extend(
        parameters
            .iter()
            .map(|&kind| AbiParam::new(native_type(kind))),
    );
    signature.returns.push(AbiParam::new(I64));
    match function.result {
        None | Some(RegisterType::Integer) => {}
        Some(result) => signature.returns.push(AbiParam::new(native_type(result))),
    }
    signature
}

/// The signature of an entry: as of a function without parameters, with the address of the arguments at the end.
pub(super) fn entry_signature(convention: CallConv) -> Signature {
    let mut signature = Signature::new(convention);
    signature.params = vec![AbiParam::new(I64); 4];
    signature.returns.push(AbiParam::new(I64));
    signature
}

/// Writes an entry: it reads the arguments from memory and calls the function.
pub(super) fn translate_entry(
    mut builder: FunctionBuilder<'_>,
    function: FuncRef,
    parameters: u32,
    config: TargetFrontendConfig,
) {
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    let mut arguments = builder.block_params(block).to_vec();
    let source = arguments.pop().expect("an entry has four parameters");
    for index in 0..parameters {
        let offset = 4 * index as i32;
        arguments.push(builder.ins().load(I32, MODEL_MEMORY, source, offset));
    }
    let call = builder.ins().call(function, &arguments);
    let status = builder.inst_results(call)[0];
    builder.ins().return_(&[status]);
    builder.seal_all_blocks();
    builder.finalize(config);
}

/// Writes a function. `import` gives the reference by which the function under construction calls another.
pub(super) fn translate(
    mut builder: FunctionBuilder<'_>,
    function: &Function,
    import: &mut dyn FnMut(FunctionId, &mut cranelift_codegen::ir::Function) -> FuncRef,
    config: TargetFrontendConfig,
) {
    let variables = function
        .registers
        .iter()
        .map(|&kind| builder.declare_var(native_type(kind)))
        .collect();
    let blocks = function
        .blocks
        .iter()
        .map(|_| builder.create_block())
        .collect();
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let parameters = builder.block_params(entry).to_vec();
    let mut translator = Translator {
        builder,
        function,
        import,
        variables,
        blocks,
        context: parameters[0],
        state: parameters[1],
        frame: parameters[2],
        failures: Vec::new(),
        failed_call: None,
        signatures: Vec::new(),
    };
    translator.write_entry(&parameters[3..]);
    for (index, block) in function.blocks.iter().enumerate() {
        let native = translator.blocks[index];
        translator.builder.switch_to_block(native);
        for instruction in &block.instructions {
            translator.instruction(instruction);
        }
        translator.terminator(block.terminator);
    }
    translator.write_failures();
    translator.builder.seal_all_blocks();
    translator.builder.finalize(config);
}

/// A function under construction.
struct Translator<'a> {
    builder: FunctionBuilder<'a>,
    function: &'a Function,
    import: &'a mut dyn FnMut(FunctionId, &mut cranelift_codegen::ir::Function) -> FuncRef,
    variables: Vec<Variable>,
    blocks: Vec<NativeBlock>,
    context: Value,
    state: Value,
    frame: Value,
    /// The cold blocks that return an error, by status.
    failures: Vec<(i64, NativeBlock)>,
    /// The cold block that hands on the error of a callee.
    failed_call: Option<NativeBlock>,
    /// The signatures of called-back functions, by types.
    signatures: Vec<(Vec<Type>, Option<Type>, SigRef)>,
}

impl Translator<'_> {
    /// Takes over the arguments and zeroes the frame.
    fn write_entry(&mut self, arguments: &[Value]) {
        for (&variable, &argument) in self.variables.iter().zip(arguments) {
            self.builder.def_var(variable, argument);
        }
        let words = self.function.frame_words;
        if words > INLINE_WORDS {
            let count = self.builder.ins().iconst(I64, i64::from(words));
            let code = runtime::zero_words as *const () as usize;
            self.call_back(code, None, &[self.frame, count]);
        } else if words > 0 {
            let zero = self.builder.ins().iconst(I32, 0);
            for word in 0..words as i32 {
                let (frame, offset) = (self.frame, 4 * word);
                self.builder.ins().store(MODEL_MEMORY, zero, frame, offset);
            }
        }
        self.builder.ins().jump(self.blocks[0], &[]);
    }

    fn instruction(&mut self, instruction: &Instruction) {
        match instruction {
            Instruction::Integer { .. }
            | Instruction::Double { .. }
            | Instruction::Copy { .. }
            | Instruction::CompareIntegers { .. }
            | Instruction::CompareDoubles { .. }
            | Instruction::Not { .. }
            | Instruction::DoubleArithmetic { .. }
            | Instruction::IntegerToDouble { .. }
            | Instruction::AddIndices { .. } => self.compute(instruction),
            Instruction::LoadInteger { .. }
            | Instruction::LoadDouble { .. }
            | Instruction::StoreInteger { .. }
            | Instruction::StoreDouble { .. }
            | Instruction::CopyWords { .. }
            | Instruction::EqualWords { .. }
            | Instruction::AddressOf { .. } => self.access(instruction),
            Instruction::Arithmetic { .. }
            | Instruction::DoubleToInteger { .. }
            | Instruction::Math { .. }
            | Instruction::ScaleIndex { .. } => self.compute_checked(instruction),
            Instruction::CheckRange { .. }
            | Instruction::CountRound { .. }
            | Instruction::Require { .. } => self.check(instruction),
            Instruction::Constrain { .. }
            | Instruction::SetClock { .. }
            | Instruction::CopyClock { .. } => self.emit(instruction),
            Instruction::Call {
                target,
                function,
                arguments,
            } => self.call(*target, *function, arguments),
        }
    }

    /// The instructions that compute a register from others and cannot fail.
    fn compute(&mut self, instruction: &Instruction) {
        let (target, value) = match *instruction {
            Instruction::Integer { target, value } => (target, self.integer(value)),
            Instruction::Double { target, value } => (target, self.builder.ins().f64const(value)),
            Instruction::Copy { target, source } => (target, self.get(source)),
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                let holds = self
                    .builder
                    .ins()
                    .icmp(integer_condition(relation), left, right);
                (target, self.truth(holds))
            }
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                let holds = self
                    .builder
                    .ins()
                    .fcmp(double_condition(relation), left, right);
                (target, self.truth(holds))
            }
            Instruction::Not { target, source } => {
                let source = self.get(source);
                let is_zero = self.builder.ins().icmp_imm_s(IntCC::Equal, source, 0);
                (target, self.truth(is_zero))
            }
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.double_arithmetic(operator, left, right))
            }
            Instruction::IntegerToDouble { target, source } => {
                let source = self.get(source);
                (target, self.builder.ins().fcvt_from_sint(F64, source))
            }
            Instruction::AddIndices {
                target,
                left,
                right,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.builder.ins().iadd(left, right))
            }
            _ => unreachable!("sorted out by instruction"),
        };
        self.set(target, value);
    }

    fn double_arithmetic(&mut self, operator: DoubleOperator, left: Value, right: Value) -> Value {
        let ins = self.builder.ins();
        match operator {
            DoubleOperator::Add => ins.fadd(left, right),
            DoubleOperator::Subtract => ins.fsub(left, right),
            DoubleOperator::Multiply => ins.fmul(left, right),
            DoubleOperator::Divide => ins.fdiv(left, right),
            DoubleOperator::Minimum => {
                let less = ins.fcmp(FloatCC::LessThan, left, right);
                self.builder.ins().select(less, left, right)
            }
            DoubleOperator::Maximum => {
                let greater = ins.fcmp(FloatCC::GreaterThan, left, right);
                self.builder.ins().select(greater, left, right)
            }
        }
    }

    /// The instructions that compute a register from others and can fail.
    fn compute_checked(&mut self, instruction: &Instruction) {
        let (target, value) = match instruction {
            &Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                site,
            } => {
                let (left, right) = (self.get(left), self.get(right));
                (target, self.arithmetic(operator, left, right, site))
            }
            &Instruction::DoubleToInteger {
                target,
                source,
                site,
            } => {
                let source = self.get(source);
                (target, self.truncate(source, site))
            }
            Instruction::Math {
                function,
                target,
                arguments,
                site,
            } => (*target, self.math(*function, arguments, *site)),
            &Instruction::ScaleIndex {
                target,
                index,
                first,
                length,
                stride,
                site,
            } => {
                let index = self.get(index);
                let position = self.builder.ins().iadd_imm_s(index, -i64::from(first));
                let outside = self.builder.ins().icmp_imm_u(
                    IntCC::UnsignedGreaterThanOrEqual,
                    position,
                    i64::from(length),
                );
                self.fail_if(outside, RunTimeErrorKind::IndexOutOfBounds, site);
                let scaled = self.builder.ins().imul_imm_u(position, i64::from(stride));
                (target, scaled)
            }
            _ => unreachable!("sorted out by instruction"),
        };
        self.set(target, value);
    }

    fn arithmetic(
        &mut self,
        operator: IntegerOperator,
        left: Value,
        right: Value,
        site: SiteId,
    ) -> Value {
        let ins = self.builder.ins();
        match operator {
            IntegerOperator::Add => {
                let (sum, overflow) = ins.sadd_overflow(left, right);
                self.without_overflow(sum, overflow, site)
            }
            IntegerOperator::Subtract => {
                let (difference, overflow) = ins.ssub_overflow(left, right);
                self.without_overflow(difference, overflow, site)
            }
            IntegerOperator::Multiply => {
                let (product, overflow) = ins.smul_overflow(left, right);
                self.without_overflow(product, overflow, site)
            }
            IntegerOperator::Divide => {
                self.check_divisor(right, site);
                self.check_quotient(left, right, site);
                self.builder.ins().sdiv(left, right)
            }
            IntegerOperator::Remainder => {
                self.check_divisor(right, site);
                self.builder.ins().srem(left, right)
            }
            IntegerOperator::Power => self.power(left, right, site),
            IntegerOperator::ShiftLeft => {
                self.check_distance(right, site);
                self.builder.ins().ishl(left, right)
            }
            IntegerOperator::ShiftRight => {
                self.check_distance(right, site);
                self.builder.ins().sshr(left, right)
            }
            IntegerOperator::And => ins.band(left, right),
            IntegerOperator::Or => ins.bor(left, right),
            IntegerOperator::Xor => ins.bxor(left, right),
            IntegerOperator::Minimum => ins.smin(left, right),
            IntegerOperator::Maximum => ins.smax(left, right),
        }
    }

    fn without_overflow(&mut self, value: Value, overflow: Value, site: SiteId) -> Value {
        self.fail_if(overflow, RunTimeErrorKind::Overflow, site);
        value
    }

    fn check_divisor(&mut self, divisor: Value, site: SiteId) {
        let is_zero = self.builder.ins().icmp_imm_s(IntCC::Equal, divisor, 0);
        self.fail_if(is_zero, RunTimeErrorKind::DivisionByZero, site);
    }

    /// Fails for `-2^31 / -1`.
    fn check_quotient(&mut self, dividend: Value, divisor: Value, site: SiteId) {
        let is_least = self
            .builder
            .ins()
            .icmp_imm_s(IntCC::Equal, dividend, i64::from(i32::MIN));
        let is_minus_one = self.builder.ins().icmp_imm_s(IntCC::Equal, divisor, -1);
        let both = self.builder.ins().band(is_least, is_minus_one);
        self.fail_if(both, RunTimeErrorKind::Overflow, site);
    }

    fn check_distance(&mut self, distance: Value, site: SiteId) {
        let outside = self
            .builder
            .ins()
            .icmp_imm_u(IntCC::UnsignedGreaterThan, distance, 31);
        self.fail_if(outside, RunTimeErrorKind::ShiftDistance, site);
    }

    fn power(&mut self, base: Value, exponent: Value, site: SiteId) -> Value {
        let negative = self
            .builder
            .ins()
            .icmp_imm_s(IntCC::SignedLessThan, exponent, 0);
        self.fail_if(negative, RunTimeErrorKind::NegativeExponent, site);
        let code = runtime::power as *const () as usize;
        let power = self.call_back(code, Some(I64), &[base, exponent]);
        self.word_of(power, RunTimeErrorKind::Overflow, site)
    }

    /// The integer that a called-back function gave; fails if it gave none.
    fn word_of(&mut self, result: Value, kind: RunTimeErrorKind, site: SiteId) -> Value {
        let none = self
            .builder
            .ins()
            .icmp_imm_s(IntCC::SignedLessThan, result, 0);
        self.fail_if(none, kind, site);
        self.builder.ins().ireduce(I32, result)
    }

    fn truncate(&mut self, source: Value, site: SiteId) -> Value {
        // Both comparisons are false for a NaN, and the conversion is exact between the two.
        let high = self.builder.ins().f64const(2_147_483_648.0);
        let below = self.builder.ins().fcmp(FloatCC::LessThan, source, high);
        self.fail_unless(below, RunTimeErrorKind::NotAnInteger, site);
        let low = self.builder.ins().f64const(-2_147_483_649.0);
        let above = self.builder.ins().fcmp(FloatCC::GreaterThan, source, low);
        self.fail_unless(above, RunTimeErrorKind::NotAnInteger, site);
        self.builder.ins().fcvt_to_sint_sat(I32, source)
    }

    fn math(&mut self, function: MathFunction, arguments: &[Register], site: SiteId) -> Value {
        let arguments: Vec<Value> = arguments
            .iter()
            .map(|&register| self.get(register))
            .collect();
        let ins = self.builder.ins();
        // These are exact in IEEE arithmetic, so that the processor's instruction gives what the library gives.
        match function {
            MathFunction::Fabs => return ins.fabs(arguments[0]),
            MathFunction::Sqrt => return ins.sqrt(arguments[0]),
            _ => {}
        }
        let (code, result) = match math::code_of(function) {
            MathCode::Abs => {
                let least = i64::from(i32::MIN);
                let is_least = ins.icmp_imm_s(IntCC::Equal, arguments[0], least);
                self.fail_if(is_least, RunTimeErrorKind::Overflow, site);
                return self.builder.ins().iabs(arguments[0]);
            }
            MathCode::Ilogb => {
                let code = runtime::ilogb as *const () as usize;
                let exponent = self.call_back(code, Some(I64), &arguments);
                return self.word_of(exponent, RunTimeErrorKind::NotAnInteger, site);
            }
            MathCode::Unary(code) => (code as usize, F64),
            MathCode::Binary(code) => (code as usize, F64),
            MathCode::Scale(code) => (code as usize, F64),
            MathCode::Ternary(code) => (code as usize, F64),
            MathCode::Classify(code) => (code as usize, I32),
        };
        self.call_back(code, Some(result), &arguments)
    }

    /// The instructions that read and write memory.
    fn access(&mut self, instruction: &Instruction) {
        match *instruction {
            Instruction::LoadInteger { target, address } => {
                let (base, offset) = self.place(address);
                let value = self.builder.ins().load(I32, MODEL_MEMORY, base, offset);
                self.set(target, value);
            }
            Instruction::LoadDouble { target, address } => {
                let (base, offset) = self.place(address);
                let value = self.builder.ins().load(F64, MODEL_MEMORY, base, offset);
                self.set(target, value);
            }
            Instruction::StoreInteger { address, source } => {
                let source = self.get(source);
                let (base, offset) = self.place(address);
                self.builder.ins().store(MODEL_MEMORY, source, base, offset);
            }
            Instruction::StoreDouble { address, source } => {
                let source = self.get(source);
                let source = self.canonical(source);
                let (base, offset) = self.place(address);
                self.builder.ins().store(MODEL_MEMORY, source, base, offset);
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
    fn canonical(&mut self, value: Value) -> Value {
        let is_nan = self.builder.ins().fcmp(FloatCC::Unordered, value, value);
        let nan = self.builder.ins().f64const(f64::NAN);
        self.builder.ins().select(is_nan, nan, value)
    }

    fn copy_words(&mut self, target: Address, source: Address, words: u32) {
        if words > INLINE_WORDS {
            let (target, source) = (self.pointer(target), self.pointer(source));
            let count = self.builder.ins().iconst(I64, i64::from(words));
            let code = runtime::copy_words as *const () as usize;
            self.call_back(code, None, &[target, source, count]);
            return;
        }
        let (source, source_offset) = self.place(source);
        let (target, target_offset) = self.place(target);
        for word in 0..words as i32 {
            let value =
                self.builder
                    .ins()
                    .load(I32, MODEL_MEMORY, source, source_offset + 4 * word);
            self.builder
                .ins()
                .store(MODEL_MEMORY, value, target, target_offset + 4 * word);
        }
    }

    fn equal_words(&mut self, left: Address, right: Address, words: u32) -> Value {
        if words > INLINE_WORDS {
            let (left, right) = (self.pointer(left), self.pointer(right));
            let count = self.builder.ins().iconst(I64, i64::from(words));
            let code = runtime::equal_words as *const () as usize;
            return self.call_back(code, Some(I32), &[left, right, count]);
        }
        let (left, left_offset) = self.place(left);
        let (right, right_offset) = self.place(right);
        let mut difference = self.integer(0);
        for word in 0..words as i32 {
            let ins = self.builder.ins();
            let left = ins.load(I32, MODEL_MEMORY, left, left_offset + 4 * word);
            let ins = self.builder.ins();
            let right = ins.load(I32, MODEL_MEMORY, right, right_offset + 4 * word);
            let bits = self.builder.ins().bxor(left, right);
            difference = self.builder.ins().bor(difference, bits);
        }
        let equal = self.builder.ins().icmp_imm_s(IntCC::Equal, difference, 0);
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
            let index = self.builder.ins().uextend(I64, index);
            let bytes = self.builder.ins().ishl_imm_u(index, 2);
            base = self.builder.ins().iadd(base, bytes);
        }
        let bytes = 4 * i64::from(address.offset);
        // The bytes of a range must be countable behind it too.
        if bytes < 1 << 30 {
            (base, bytes as i32)
        } else {
            (self.builder.ins().iadd_imm_s(base, bytes), 0)
        }
    }

    fn pointer(&mut self, address: Address) -> Value {
        let (base, offset) = self.place(address);
        self.builder.ins().iadd_imm_s(base, i64::from(offset))
    }

    /// The instructions that can fail and do nothing else.
    fn check(&mut self, instruction: &Instruction) {
        match *instruction {
            Instruction::CheckRange {
                value,
                low,
                high,
                site,
            } => self.check_range(value, low, high, RunTimeErrorKind::OutOfRange, site),
            Instruction::CountRound { site } => {
                let offset = offset_of!(NativeContext<'static>, rounds_left) as i32;
                let flags = MemFlagsData::trusted();
                let left = self.builder.ins().load(I64, flags, self.context, offset);
                let none = self.builder.ins().icmp_imm_s(IntCC::Equal, left, 0);
                self.fail_if(none, RunTimeErrorKind::StepLimit, site);
                let left = self.builder.ins().iadd_imm_s(left, -1);
                self.builder.ins().store(flags, left, self.context, offset);
            }
            Instruction::Require {
                condition,
                kind,
                site,
            } => {
                let condition = self.get(condition);
                self.fail_unless(condition, kind, site);
            }
            _ => unreachable!("sorted out by instruction"),
        }
    }

    /// Fails unless `low <= value <= high`.
    fn check_range(
        &mut self,
        value: Register,
        low: i32,
        high: i32,
        kind: RunTimeErrorKind,
        site: SiteId,
    ) {
        let value = self.get(value);
        if low > high {
            let always = self.integer(1);
            self.fail_if(always, kind, site);
            return;
        }
        let ins = self.builder.ins();
        let outside = if low == i32::MIN {
            ins.icmp_imm_s(IntCC::SignedGreaterThan, value, i64::from(high))
        } else if high == i32::MAX {
            ins.icmp_imm_s(IntCC::SignedLessThan, value, i64::from(low))
        } else {
            // Counted from the least value without a sign, too small values are too large as well.
            let position = ins.iadd_imm_s(value, -i64::from(low));
            let width = i64::from(high.wrapping_sub(low) as u32);
            self.builder
                .ins()
                .icmp_imm_u(IntCC::UnsignedGreaterThan, position, width)
        };
        self.fail_if(outside, kind, site);
    }

    /// The instructions that emit clock constraints and assignments.
    fn emit(&mut self, instruction: &Instruction) {
        let limit = CLOCK_LIMIT;
        match *instruction {
            Instruction::Constrain {
                left,
                right,
                strict,
                bound,
                negate_bound,
                site,
            } => {
                self.check_range(bound, -limit, limit, RunTimeErrorKind::ClockValue, site);
                let mut bound = self.get(bound);
                if negate_bound {
                    bound = self.builder.ins().ineg(bound);
                }
                let (left, right) = (self.clock(left), self.clock(right));
                let strict = self.integer(strict.into());
                let code = runtime::emit_constraint as *const () as usize;
                self.call_back(code, None, &[self.context, left, right, bound, strict]);
            }
            Instruction::SetClock { clock, value, site } => {
                self.check_range(value, 0, limit, RunTimeErrorKind::ClockValue, site);
                let (clock, reference) = (self.clock(clock), self.integer(0));
                let value = self.get(value);
                let code = runtime::emit_assignment as *const () as usize;
                self.call_back(code, None, &[self.context, clock, reference, value]);
            }
            Instruction::CopyClock {
                clock,
                source,
                increment,
                site,
            } => {
                let value = match increment {
                    None => self.integer(0),
                    Some(value) => {
                        self.check_range(value, -limit, limit, RunTimeErrorKind::ClockValue, site);
                        self.get(value)
                    }
                };
                let (clock, source) = (self.clock(clock), self.clock(source));
                let code = runtime::emit_assignment as *const () as usize;
                self.call_back(code, None, &[self.context, clock, source, value]);
            }
            _ => unreachable!("sorted out by instruction"),
        }
    }

    fn clock(&mut self, operand: ClockOperand) -> Value {
        let first = operand.first.0 as i32;
        match operand.index {
            None => self.integer(first),
            Some(index) => {
                let index = self.get(index);
                self.builder.ins().iadd_imm_s(index, i64::from(first))
            }
        }
    }

    /// Calls a function of the model.
    fn call(&mut self, target: Option<Register>, function: FunctionId, arguments: &[Register]) {
        let callee = (self.import)(function, self.builder.func);
        let bytes = 4 * i64::from(self.function.frame_words);
        let frame = self.builder.ins().iadd_imm_s(self.frame, bytes);
        let mut values = vec![self.context, self.state, frame];
        for &argument in arguments {
            values.push(self.get(argument));
        }
        let call = self.builder.ins().call(callee, &values);
        let results = self.builder.inst_results(call).to_vec();
        self.hand_on_failure(results[0]);
        if let Some(target) = target {
            let value = match results.get(1) {
                Some(&value) => value,
                None => self.builder.ins().ireduce(I32, results[0]),
            };
            self.set(target, value);
        }
    }

    /// Returns the status if it is an error.
    fn hand_on_failure(&mut self, status: Value) {
        let cold = *self.failed_call.get_or_insert_with(|| {
            let block = self.builder.create_block();
            self.builder.append_block_param(block, I64);
            self.builder.set_cold_block(block);
            block
        });
        let failed = self
            .builder
            .ins()
            .icmp_imm_s(IntCC::SignedLessThan, status, 0);
        let next = self.builder.create_block();
        self.builder
            .ins()
            .brif(failed, cold, &[status.into()], next, &[]);
        self.builder.switch_to_block(next);
    }

    fn terminator(&mut self, terminator: Terminator) {
        match terminator {
            Terminator::Jump(target) => {
                self.builder.ins().jump(self.blocks[target.0 as usize], &[]);
            }
            Terminator::Branch(condition, then, otherwise) => {
                let condition = self.get(condition);
                let then = self.blocks[then.0 as usize];
                let otherwise = self.blocks[otherwise.0 as usize];
                self.builder
                    .ins()
                    .brif(condition, then, &[], otherwise, &[]);
            }
            Terminator::Fail(kind, site) => {
                let block = self.failure(kind, site);
                self.builder.ins().jump(block, &[]);
            }
            Terminator::Return(result) => {
                let result = result.map(|register| self.get(register));
                match (self.function.result, result) {
                    (Some(RegisterType::Integer), Some(value)) => {
                        let status = self.builder.ins().uextend(I64, value);
                        self.builder.ins().return_(&[status]);
                    }
                    (Some(_), Some(value)) => {
                        let status = self.builder.ins().iconst(I64, 0);
                        self.builder.ins().return_(&[status, value]);
                    }
                    _ => {
                        let status = self.builder.ins().iconst(I64, 0);
                        self.return_status(status);
                    }
                }
            }
        }
    }

    /// Returns a status, with any value beside it.
    fn return_status(&mut self, status: Value) {
        let value = match self.function.result {
            None | Some(RegisterType::Integer) => None,
            Some(RegisterType::Double) => Some(self.builder.ins().f64const(0.0)),
            Some(RegisterType::Address) => Some(self.builder.ins().iconst(I64, 0)),
        };
        let mut values = vec![status];
        values.extend(value);
        self.builder.ins().return_(&values);
    }

    fn write_failures(&mut self) {
        for (status, block) in std::mem::take(&mut self.failures) {
            self.builder.switch_to_block(block);
            let status = self.builder.ins().iconst(I64, status);
            self.return_status(status);
        }
        if let Some(block) = self.failed_call {
            self.builder.switch_to_block(block);
            let status = self.builder.block_params(block)[0];
            self.return_status(status);
        }
    }

    /// The cold block that returns this error.
    fn failure(&mut self, kind: RunTimeErrorKind, site: SiteId) -> NativeBlock {
        let status = failure_status(kind, site);
        // The checks of one instruction follow each other, so that the block is mostly among the last.
        let known = self
            .failures
            .iter()
            .rev()
            .find(|(known, _)| *known == status);
        if let Some(&(_, block)) = known {
            return block;
        }
        let block = self.builder.create_block();
        self.builder.set_cold_block(block);
        self.failures.push((status, block));
        block
    }

    fn fail_if(&mut self, condition: Value, kind: RunTimeErrorKind, site: SiteId) {
        let (cold, next) = (self.failure(kind, site), self.builder.create_block());
        self.builder.ins().brif(condition, cold, &[], next, &[]);
        self.builder.switch_to_block(next);
    }

    fn fail_unless(&mut self, condition: Value, kind: RunTimeErrorKind, site: SiteId) {
        let (cold, next) = (self.failure(kind, site), self.builder.create_block());
        self.builder.ins().brif(condition, next, &[], cold, &[]);
        self.builder.switch_to_block(next);
    }

    /// Calls a function of this program at its address.
    fn call_back(&mut self, code: usize, result: Option<Type>, arguments: &[Value]) -> Value {
        let types: Vec<Type> = arguments
            .iter()
            .map(|&value| self.builder.func.dfg.value_type(value))
            .collect();
        let signature = self.call_back_signature(types, result);
        let callee = self.builder.ins().iconst(I64, code as i64);
        let call = self
            .builder
            .ins()
            .call_indirect(signature, callee, arguments);
        match result {
            Some(_) => self.builder.inst_results(call)[0],
            None => callee,
        }
    }

    fn call_back_signature(&mut self, types: Vec<Type>, result: Option<Type>) -> SigRef {
        let known = self
            .signatures
            .iter()
            .find(|(known, known_result, _)| *known == types && *known_result == result);
        if let Some(&(_, _, signature)) = known {
            return signature;
        }
        let mut signature = Signature::new(self.builder.func.signature.call_conv);
        signature.params = types.iter().copied().map(AbiParam::new).collect();
        signature.returns = result.into_iter().map(AbiParam::new).collect();
        let reference = self.builder.import_signature(signature);
        self.signatures.push((types, result, reference));
        reference
    }

    fn get(&mut self, Register(register): Register) -> Value {
        self.builder.use_var(self.variables[register as usize])
    }

    fn set(&mut self, Register(register): Register, value: Value) {
        self.builder
            .def_var(self.variables[register as usize], value);
    }

    fn integer(&mut self, value: i32) -> Value {
        self.builder.ins().iconst(I32, i64::from(value as u32))
    }

    /// A condition as 0 or 1.
    fn truth(&mut self, condition: Value) -> Value {
        self.builder.ins().uextend(I32, condition)
    }
}

fn integer_condition(relation: Relation) -> IntCC {
    match relation {
        Relation::Less => IntCC::SignedLessThan,
        Relation::LessEqual => IntCC::SignedLessThanOrEqual,
        Relation::Greater => IntCC::SignedGreaterThan,
        Relation::GreaterEqual => IntCC::SignedGreaterThanOrEqual,
        Relation::Equal => IntCC::Equal,
        Relation::NotEqual => IntCC::NotEqual,
    }
}

/// Cranelift's conditions are ordered but for `NotEqual`, as ours are.
fn double_condition(relation: Relation) -> FloatCC {
    match relation {
        Relation::Less => FloatCC::LessThan,
        Relation::LessEqual => FloatCC::LessThanOrEqual,
        Relation::Greater => FloatCC::GreaterThan,
        Relation::GreaterEqual => FloatCC::GreaterThanOrEqual,
        Relation::Equal => FloatCC::Equal,
        Relation::NotEqual => FloatCC::NotEqual,
    }
}
