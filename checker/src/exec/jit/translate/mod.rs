//! From code to Cranelift's intermediate representation, one function at a time.
//!
//! Invariants
//! * A compiled function takes the [`runtime::NativeContext`], the state's words, its frame, and
//!   its own arguments in native types; it returns the status (see [`super::runtime`]) and, for a
//!   double or an address, also the value.
//! * A check that fails jumps to a cold block that returns the status of its kind and site; nothing
//!   is trapped by signals.
//! * An address is a pointer. The frame of a callee begins where the frame of its caller ends.
//!
//! Memory is accessed without checks of bounds: the code was produced with every index checked by a
//! [`Instruction::ScaleIndex`], and the caller hands over as many words of state and frame as the
//! functions need.

mod arithmetic;
mod external;
mod failures;
mod memory;
mod random;

use cranelift_codegen::ir::types::{F64, I32, I64};
use cranelift_codegen::ir::{
    AbiParam, Block as NativeBlock, BlockCall, FuncRef, InstBuilder, JumpTableData, MemFlagsData,
    SigRef, Signature, Type, Value,
};
use cranelift_codegen::isa::{CallConv, TargetFrontendConfig};
use cranelift_frontend::{FuncInstBuilder, FunctionBuilder, Variable};

use crate::ir::{
    CLOCK_LIMIT, ClockOperand, Function, FunctionId, Instruction, Overflow, Register, RegisterType,
    RunTimeErrorKind, SiteId, Terminator,
};

use super::runtime;

/// At most this number of words is copied, compared or zeroed in line.
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

/// The signature of an entry: as of a function without parameters, with the address of the
/// arguments at the end.
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

/// Writes a function. `import` gives the reference by which the function under construction calls
/// another.
pub(super) fn translate(
    mut builder: FunctionBuilder<'_>,
    function: &Function,
    import: &mut dyn FnMut(FunctionId, &mut cranelift_codegen::ir::Function) -> FuncRef,
    config: TargetFrontendConfig,
    overflow: Overflow,
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
        overflow,
        import,
        variables,
        blocks,
        context: parameters[0],
        state: parameters[1],
        frame: parameters[2],
        failures: Vec::new(),
        wraps: Vec::new(),
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
        translator.terminator(&block.terminator);
    }
    translator.write_failures();
    translator.builder.seal_all_blocks();
    translator.builder.finalize(config);
}

/// A function under construction.
struct Translator<'a> {
    builder: FunctionBuilder<'a>,
    function: &'a Function,
    overflow: Overflow,
    import: &'a mut dyn FnMut(FunctionId, &mut cranelift_codegen::ir::Function) -> FuncRef,
    variables: Vec<Variable>,
    blocks: Vec<NativeBlock>,
    context: Value,
    state: Value,
    frame: Value,
    /// The cold blocks that return an error, by status.
    failures: Vec<(i64, NativeBlock)>,
    /// The cold blocks that note that a result wrapped round: the site, the block, and the block
    /// that follows.
    wraps: Vec<(SiteId, NativeBlock, NativeBlock)>,
    /// The cold block that passes on the error of a callee.
    failed_call: Option<NativeBlock>,
    /// The signatures of called-back functions, by types.
    signatures: Vec<(Vec<Type>, Option<Type>, SigRef)>,
}

impl<'a> Translator<'a> {
    /// What inserts an instruction at the end of the current block.
    fn ins(&mut self) -> FuncInstBuilder<'_, 'a> {
        self.builder.ins()
    }

    /// Takes over the arguments and zeroes the frame.
    fn write_entry(&mut self, arguments: &[Value]) {
        for (&variable, &argument) in self.variables.iter().zip(arguments) {
            self.builder.def_var(variable, argument);
        }
        let words = self.function.frame_words;
        if words > INLINE_WORDS {
            let count = self.ins().iconst(I64, i64::from(words));
            let code = runtime::zero_words as *const () as usize;
            self.call_back(code, None, &[self.frame, count]);
        } else if words > 0 {
            let zero = self.ins().iconst(I32, 0);
            for word in 0..words as i32 {
                let (frame, offset) = (self.frame, 4 * word);
                self.ins().store(MODEL_MEMORY, zero, frame, offset);
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
            | Instruction::Select { .. }
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
            | Instruction::Random { .. }
            | Instruction::ScaleIndex { .. } => self.compute_checked(instruction),
            Instruction::CheckRange { .. }
            | Instruction::CountRound { .. }
            | Instruction::Require { .. } => self.check(instruction),
            Instruction::External {
                target,
                function,
                arguments,
                site,
            } => self.call_external(*target, *function, arguments, *site),
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
                    bound = self.ins().ineg(bound);
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
                self.ins().iadd_imm_s(index, i64::from(first))
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
        let call = self.ins().call(callee, &values);
        let results = self.builder.inst_results(call).to_vec();
        self.propagate_failure(results[0]);
        if let Some(target) = target {
            let value = match results.get(1) {
                Some(&value) => value,
                None => self.ins().ireduce(I32, results[0]),
            };
            self.set(target, value);
        }
    }

    fn terminator(&mut self, terminator: &Terminator) {
        match *terminator {
            Terminator::Jump(target) => {
                self.builder.ins().jump(self.blocks[target.0 as usize], &[]);
            }
            Terminator::Branch(condition, then, otherwise) => {
                let condition = self.get(condition);
                let then = self.blocks[then.0 as usize];
                let otherwise = self.blocks[otherwise.0 as usize];
                self.ins().brif(condition, then, &[], otherwise, &[]);
            }
            Terminator::Switch(number, ref list, otherwise) => {
                let number = self.get(number);
                let blocks = list.iter().map(|target| self.blocks[target.0 as usize]);
                let pool = &mut self.builder.func.dfg.value_lists;
                let calls = blocks.map(|block| BlockCall::new(block, [], pool));
                let calls: Vec<BlockCall> = calls.collect();
                let otherwise = self.blocks[otherwise.0 as usize];
                let otherwise = BlockCall::new(otherwise, [], pool);
                let table = JumpTableData::new(otherwise, &calls);
                let table = self.builder.create_jump_table(table);
                self.ins().br_table(number, table);
            }
            Terminator::Fail(kind, site) => {
                let block = self.failure(kind, site);
                self.ins().jump(block, &[]);
            }
            Terminator::Return(result) => {
                let result = result.map(|register| self.get(register));
                match (self.function.result, result) {
                    (Some(RegisterType::Integer), Some(value)) => {
                        let status = self.ins().uextend(I64, value);
                        self.ins().return_(&[status]);
                    }
                    (Some(_), Some(value)) => {
                        let status = self.ins().iconst(I64, 0);
                        self.ins().return_(&[status, value]);
                    }
                    _ => {
                        let status = self.ins().iconst(I64, 0);
                        self.return_status(status);
                    }
                }
            }
        }
    }

    /// Returns a status, and the value if there is one.
    fn return_status(&mut self, status: Value) {
        let value = match self.function.result {
            None | Some(RegisterType::Integer) => None,
            Some(RegisterType::Double) => Some(self.ins().f64const(0.0)),
            Some(RegisterType::Address) => Some(self.ins().iconst(I64, 0)),
        };
        let mut values = vec![status];
        values.extend(value);
        self.ins().return_(&values);
    }

    /// Calls a function of this program at its address.
    fn call_back(&mut self, code: usize, result: Option<Type>, arguments: &[Value]) -> Value {
        let types: Vec<Type> = arguments
            .iter()
            .map(|&value| self.builder.func.dfg.value_type(value))
            .collect();
        let signature = self.call_back_signature(types, result);
        let callee = self.ins().iconst(I64, code as i64);
        let call = self.ins().call_indirect(signature, callee, arguments);
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
        self.ins().iconst(I32, i64::from(value as u32))
    }
}
