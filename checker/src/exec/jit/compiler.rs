//! Owns the compiled code and makes more of it on demand.
//!
//! Functions are optimised, and compiled together with everything they call that is not compiled
//! yet. Calls go to absolute addresses, since code that is compiled late may lie anywhere. The
//! memory of the code is freed with the compiler.
//!
//! Cost: some 10 to 50 µs, and then about 1 µs an instruction.

use std::fmt;
use std::mem::ManuallyDrop;

use cranelift_codegen::isa::CallConv;
use cranelift_codegen::settings::{self, Configurable};
use cranelift_codegen::{Context, ir};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Module, default_libcall_names};

use crate::exec::optimise::Optimiser;
use crate::ir::{Constants, Function, FunctionId, Overflow, RegisterType};
use crate::tuning::Tuning;

use super::needs::AllNeeds;
use super::translate::{entry_signature, native_signature, translate, translate_entry};

/// Why there is no native code.
#[derive(Clone, Debug)]
pub struct JitError(String);

impl JitError {
    pub(super) fn new(cause: impl fmt::Display) -> JitError {
        JitError(cause.to_string())
    }
}

impl fmt::Display for JitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "cannot generate native code: {}", self.0)
    }
}

impl std::error::Error for JitError {}

/// A compiled function as it is called from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct NativeEntry {
    /// Its address; the signature is that of an entry if the function has parameters, else its own.
    pub(super) code: *const u8,
    /// How many words of frame it needs, with those of all that it calls.
    pub(super) frame_words: usize,
}

/// The compiler.
pub(super) struct Compiler {
    /// Taken out only to free its memory.
    module: ManuallyDrop<JITModule>,
    convention: CallConv,
    overflow: Overflow,
    context: Context,
    builder_context: FunctionBuilderContext,
    optimiser: Optimiser,
    /// What the functions need as they were given.
    needs: AllNeeds,
    /// What the optimised functions need.
    optimised_needs: AllNeeds,
    /// The declarations of the optimised functions; whatever is declared is compiled.
    declared: Vec<Option<FuncId>>,
    /// How many instructions were compiled so far.
    compiled: usize,
}

impl Compiler {
    pub(super) fn new(overflow: Overflow, tuning: Tuning) -> Result<Compiler, JitError> {
        if cfg!(target_endian = "big") {
            // Doubles lie in memory with the low word first.
            return Err(JitError("the processor stores the high word first".into()));
        }
        let mut flags = settings::builder();
        let verify = if cfg!(debug_assertions) {
            "true"
        } else {
            "false"
        };
        for (name, value) in [
            // The code is optimised already: doing it again takes as long as all the rest and gains
            // nothing.
            ("opt_level", "none"),
            ("enable_verifier", verify),
            ("is_pic", "false"),
            ("use_colocated_libcalls", "false"),
        ] {
            flags.set(name, value).map_err(JitError::new)?;
        }
        let isa = cranelift_native::builder()
            .map_err(JitError::new)?
            .finish(settings::Flags::new(flags))
            .map_err(JitError::new)?;
        let convention = isa.default_call_conv();
        let module = JITModule::new(JITBuilder::with_isa(isa, default_libcall_names()));
        Ok(Compiler {
            context: module.make_context(),
            module: ManuallyDrop::new(module),
            convention,
            overflow,
            builder_context: FunctionBuilderContext::new(),
            optimiser: Optimiser::tuned(tuning),
            needs: AllNeeds::default(),
            optimised_needs: AllNeeds::default(),
            declared: Vec::new(),
            compiled: 0,
        })
    }

    /// Takes over what was appended since: both arguments are the whole of it, and begin with what
    /// was given before.
    pub(super) fn extend(&mut self, functions: &[Function], constants: &Constants) {
        self.optimiser.extend(functions, constants);
    }

    /// How many instructions were compiled so far, counted after optimisation.
    pub(super) fn compiled(&self) -> usize {
        self.compiled
    }

    /// Whether a call of the function is likely to run so much that it should be compiled before
    /// the first one.
    pub(super) fn is_heavy(&mut self, function: FunctionId) -> bool {
        let given = self.optimiser.given();
        self.needs.of(given, function.0 as usize).are_heavy()
    }

    /// Compiles a function that can be called from outside and all that it calls; `None` if it is
    /// none or too large.
    pub(super) fn compile(
        &mut self,
        function: FunctionId,
    ) -> Result<Option<NativeEntry>, JitError> {
        let given = self.optimiser.given();
        let code = &given[function.0 as usize];
        let needs = self.needs.of(given, function.0 as usize);
        if !is_callable(code) || !needs.are_modest() {
            return Ok(None);
        }
        let parameters = code.parameters;
        let index = self.optimiser.optimised(function) as usize;
        let needs = self.optimised_needs.of(self.optimiser.made(), index);
        if !needs.are_modest() {
            return Ok(None);
        }
        self.declared.resize(self.optimiser.made().len(), None);
        for index in self.uncompiled_below(index) {
            self.define(index)?;
        }
        let mut entry = self.declare(index)?;
        if parameters > 0 {
            entry = self.define_entry(entry, parameters)?;
        }
        self.module.finalize_definitions().map_err(JitError::new)?;
        Ok(Some(NativeEntry {
            code: self.module.get_finalized_function(entry),
            frame_words: needs.frame_words,
        }))
    }

    /// The function and all that it calls, without those that are compiled.
    fn uncompiled_below(&self, root: usize) -> Vec<usize> {
        let functions = self.optimiser.made();
        let mut found = vec![false; functions.len()];
        let mut pending = vec![root];
        let mut order = Vec::new();
        while let Some(index) = pending.pop() {
            if self.declared[index].is_none() && !std::mem::replace(&mut found[index], true) {
                order.push(index);
                pending.extend(functions[index].callees().map(|callee| callee.0 as usize));
            }
        }
        order
    }

    fn declare(&mut self, index: usize) -> Result<FuncId, JitError> {
        declare(
            &mut self.module,
            &mut self.declared,
            self.optimiser.made(),
            self.convention,
            index,
        )
    }

    fn define(&mut self, index: usize) -> Result<(), JitError> {
        let id = self.declare(index)?;
        let function = &self.optimiser.made()[index];
        let blocks = function.blocks.iter();
        self.compiled += blocks
            .map(|block| block.instructions.len() + 1)
            .sum::<usize>();
        self.context.func.signature = native_signature(function, self.convention);
        self.context.func.name = ir::UserFuncName::user(0, id.as_u32());
        let builder = FunctionBuilder::new(&mut self.context.func, &mut self.builder_context);
        let config = self.module.target_config();
        let mut failure = None;
        let mut import = |FunctionId(callee): FunctionId, native: &mut ir::Function| {
            let declared = declare(
                &mut self.module,
                &mut self.declared,
                self.optimiser.made(),
                self.convention,
                callee as usize,
            );
            let callee = declared.unwrap_or_else(|error| {
                failure = Some(error);
                id
            });
            import_function(&mut self.module, callee, native)
        };
        translate(builder, function, &mut import, config, self.overflow);
        if let Some(error) = failure {
            return Err(error);
        }
        self.finish(id)
    }

    fn define_entry(&mut self, function: FuncId, parameters: u32) -> Result<FuncId, JitError> {
        let signature = entry_signature(self.convention);
        let id = self
            .module
            .declare_anonymous_function(&signature)
            .map_err(JitError::new)?;
        self.context.func.signature = signature;
        self.context.func.name = ir::UserFuncName::user(0, id.as_u32());
        let callee = import_function(&mut self.module, function, &mut self.context.func);
        let builder = FunctionBuilder::new(&mut self.context.func, &mut self.builder_context);
        translate_entry(builder, callee, parameters, self.module.target_config());
        self.finish(id)?;
        Ok(id)
    }

    fn finish(&mut self, id: FuncId) -> Result<(), JitError> {
        let defined = self.module.define_function(id, &mut self.context);
        self.module.clear_context(&mut self.context);
        defined.map_err(JitError::new)
    }
}

impl Drop for Compiler {
    #[expect(
        unsafe_code,
        reason = "the module leaves freeing its memory to its owner"
    )]
    fn drop(&mut self) {
        // SAFETY: the module is taken out only here. Its code runs only in calls that borrow the
        // owner of this compiler, and none can be left when that is dropped.
        unsafe { ManuallyDrop::take(&mut self.module).free_memory() }
    }
}

/// Whether a function takes only integers and returns an integer or nothing.
fn is_callable(function: &Function) -> bool {
    let parameters = &function.registers[..function.parameters as usize];
    let is_integer = |&kind: &RegisterType| kind == RegisterType::Integer;
    parameters.iter().all(is_integer) && function.result.iter().all(is_integer)
}

fn declare(
    module: &mut JITModule,
    declared: &mut [Option<FuncId>],
    functions: &[Function],
    convention: CallConv,
    index: usize,
) -> Result<FuncId, JitError> {
    if let Some(id) = declared[index] {
        return Ok(id);
    }
    let signature = native_signature(&functions[index], convention);
    let id = module
        .declare_anonymous_function(&signature)
        .map_err(JitError::new)?;
    declared[index] = Some(id);
    Ok(id)
}

/// Refers to a function that may lie anywhere.
fn import_function(module: &mut JITModule, id: FuncId, native: &mut ir::Function) -> ir::FuncRef {
    let reference = module.declare_func_in_func(id, native);
    native.dfg.ext_funcs[reference].colocated = false;
    reference
}
