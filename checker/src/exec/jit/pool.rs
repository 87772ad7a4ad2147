//! Native code that the engines of a process share.
//!
//! Whoever rebuilds a model again and again, with other numbers in it, has mostly equal functions:
//! of 62 models of one run of a needle, 95 % of all instructions. Compiling takes longer than
//! solving such a model, so that each function is compiled once for all engines.
//!
//! Invariants
//! * Functions share native code only if all that it depends on is equal: registers, frame, all
//!   instructions bit by bit, the code of what they call, and the rule for overflows. Constant
//!   memory and states are reached through the context and the arguments of a call.
//! * Code is never moved or freed while an engine holds its pool, which it keeps for life.
//! * What a function calls is compiled before it.
//!
//! Cost: of a function that is known, that of comparing it as it was given.

use std::collections::HashMap;
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cranelift_codegen::isa::CallConv;
use cranelift_codegen::settings::{self, Configurable};
use cranelift_codegen::{Context, ir};
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{FuncId, Module, default_libcall_names};

use crate::exec::rounds::count_rounds;
use crate::ir::{Function, FunctionId, Instruction, Overflow};

use super::error::JitError;
use super::needs::Needs;
use super::translate::{entry_signature, native_signature, translate, translate_entry};

/// New engines begin a new pool after so many instructions, which take some megabytes.
const MOST_INSTRUCTIONS: usize = 200_000;

/// The pool of the engines that are made now.
static CURRENT: Mutex<Option<Arc<Mutex<Pool>>>> = Mutex::new(None);

/// Compiled functions.
pub(super) struct Pool {
    /// Taken out only to free its memory.
    module: ManuallyDrop<JITModule>,
    convention: CallConv,
    context: Context,
    builder_context: FunctionBuilderContext,
    /// By function as it was given: its number.
    known: HashMap<Key, FuncId>,
    /// What the functions need, with all that they call.
    needs: HashMap<FuncId, Needs>,
    /// The entries of functions with parameters.
    entries: HashMap<FuncId, FuncId>,
    /// How many instructions were compiled.
    instructions: usize,
    /// Whether a function could not be compiled, which leaves a gap in the module.
    is_broken: bool,
}

/// What the code of a function depends on, but for constant memory.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct Key {
    overflow: Overflow,
    /// Without its name; it calls functions by their numbers in the pool.
    function: Function,
}

impl Key {
    /// That of a function, given the numbers in the pool of what it calls.
    pub(super) fn new(function: &Function, numbers: &[Option<FuncId>], overflow: Overflow) -> Key {
        let mut function = Function {
            name: String::new(),
            registers: function.registers.clone(),
            blocks: function.blocks.clone(),
            ..*function
        };
        for block in &mut function.blocks {
            for instruction in &mut block.instructions {
                if let Instruction::Call { function, .. } = instruction {
                    let number = numbers[function.0 as usize];
                    let number = number.expect("what a function calls is compiled before it");
                    function.0 = number.as_u32();
                }
            }
        }
        Key { overflow, function }
    }
}

impl Pool {
    /// The pool for a new engine.
    pub(super) fn shared() -> Result<Arc<Mutex<Pool>>, JitError> {
        let mut current = locked(&CURRENT);
        let usable = current.take().filter(|pool| {
            let pool = locked(pool);
            pool.instructions < MOST_INSTRUCTIONS && !pool.is_broken
        });
        let pool = match usable {
            Some(pool) => pool,
            None => Arc::new(Mutex::new(Pool::new()?)),
        };
        *current = Some(Arc::clone(&pool));
        Ok(pool)
    }

    fn new() -> Result<Pool, JitError> {
        if cfg!(target_endian = "big") {
            // Doubles lie in memory with the low word first.
            return Err(JitError::new("the processor stores the high word first"));
        }
        let mut flags = settings::builder();
        let verify = if cfg!(debug_assertions) {
            "true"
        } else {
            "false"
        };
        for (name, value) in [
            // Optimising takes as long as all the rest, and what it gains is less on all members of
            // the benchmarks.
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
        Ok(Pool {
            context: module.make_context(),
            module: ManuallyDrop::new(module),
            convention,
            builder_context: FunctionBuilderContext::new(),
            known: HashMap::new(),
            needs: HashMap::new(),
            entries: HashMap::new(),
            instructions: 0,
            is_broken: false,
        })
    }

    /// How many instructions were compiled so far.
    pub(super) fn instructions(&self) -> usize {
        self.instructions
    }

    /// The number of a function in the pool, if it is known.
    pub(super) fn known(&self, key: &Key) -> Option<FuncId> {
        self.known.get(key).copied()
    }

    /// Compiles a function that is not known; `None` if it is too large.
    ///
    /// Its code has an address only after [`Pool::address_of`].
    pub(super) fn compiled(&mut self, key: Key) -> Result<Option<FuncId>, JitError> {
        let mut function = key.function.clone();
        count_rounds(&mut function);
        let calls = function
            .callees()
            .map(|callee| self.needs_of(FuncId::from_u32(callee.0)));
        let needs = calls.fold(Needs::default(), Needs::then).below(&function);
        if !needs.are_modest() {
            return Ok(None);
        }
        let defined = self.define(&function, key.overflow);
        self.is_broken |= defined.is_err();
        let id = defined?;
        self.needs.insert(id, needs);
        self.known.insert(key, id);
        Ok(Some(id))
    }

    /// What a function of the pool needs, with all that it calls.
    pub(super) fn needs_of(&self, id: FuncId) -> Needs {
        self.needs[&id]
    }

    /// The address of a function in the pool as it is called from outside: with the signature of an
    /// entry if it has parameters, else with its own.
    pub(super) fn address_of(
        &mut self,
        function: FuncId,
        parameters: u32,
    ) -> Result<*const u8, JitError> {
        let id = match self.entries.get(&function) {
            _ if parameters == 0 => function,
            Some(&entry) => entry,
            None => {
                let defined = self.define_entry(function, parameters);
                self.is_broken |= defined.is_err();
                let entry = defined?;
                self.entries.insert(function, entry);
                entry
            }
        };
        self.module.finalize_definitions().map_err(JitError::new)?;
        Ok(self.module.get_finalized_function(id))
    }

    fn define(&mut self, function: &Function, overflow: Overflow) -> Result<FuncId, JitError> {
        let signature = native_signature(function, self.convention);
        let id = self
            .module
            .declare_anonymous_function(&signature)
            .map_err(JitError::new)?;
        let blocks = function.blocks.iter();
        self.instructions += blocks
            .map(|block| block.instructions.len() + 1)
            .sum::<usize>();
        self.context.func.signature = signature;
        self.context.func.name = ir::UserFuncName::user(0, id.as_u32());
        let builder = FunctionBuilder::new(&mut self.context.func, &mut self.builder_context);
        let config = self.module.target_config();
        let mut import = |FunctionId(callee): FunctionId, native: &mut ir::Function| {
            import_function(&mut self.module, FuncId::from_u32(callee), native)
        };
        translate(builder, function, &mut import, config, overflow);
        self.finish(id)?;
        Ok(id)
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

impl Drop for Pool {
    #[expect(
        unsafe_code,
        reason = "the module leaves freeing its memory to its owner"
    )]
    fn drop(&mut self) {
        // SAFETY: the module is taken out only here. Its code runs only in calls that borrow an
        // engine, and all engines that hold this pool are gone when it is dropped.
        unsafe { ManuallyDrop::take(&mut self.module).free_memory() }
    }
}

/// What a lock guards, even if somebody panicked with it: nothing is left half done in between.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Refers to a function that may lie anywhere.
fn import_function(module: &mut JITModule, id: FuncId, native: &mut ir::Function) -> ir::FuncRef {
    let reference = module.declare_func_in_func(id, native);
    native.dfg.ext_funcs[reference].colocated = false;
    reference
}
