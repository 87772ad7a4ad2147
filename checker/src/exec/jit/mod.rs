//! Native code by Cranelift: the fast engine.
//!
//! Functions that loop much are compiled before their first call ([`Jit::prepare`]). Any other
//! function is interpreted until it has run for a while, and then compiled with all
//! that it calls; or once only, if another engine has compiled an equal one. A model with thousands
//! of small guards pays for the few that matter, and a model that is solved at once for none. As
//! interpreted and compiled code agree in everything, it makes no difference to results when this
//! happens.
//!
//! Invariants
//! * Compiled code is never moved or freed before the engine is dropped; queries that come later
//!   only add to it. Engines share the code of equal functions (`pool`).
//! * `unsafe` is confined to this module: calling compiled code, what compiled code calls back, and
//!   freeing it.
//! * The code that is compiled is trusted as the interpreter trusts it not, and so it is validated
//!   before: registers have the types that instructions say, indices were checked
//!   ([`crate::ir::Instruction::ScaleIndex`]), accesses stay inside their memory, and functions do
//!   not call themselves.

mod compiler;
mod error;
pub(super) mod external;
mod needs;
mod pool;
mod runtime;
mod translate;

use std::cell::RefCell;
use std::fmt;
use std::ptr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicPtr, AtomicU64, AtomicUsize, Ordering};

use crate::ir::{Constants, Function, FunctionId, Overflow, SiteId};

use crate::tuning::Tuning;

use super::{Context, Executor, Interpreter, ROUND_LIMIT, RunTimeError, Wraps, validate};

pub use error::JitError;

use compiler::{Compiler, NativeEntry};
use pool::locked;
use runtime::{NativeContext, result_of_status};

/// A function is compiled after this number of interpreted instructions. They take about as long as
/// compiling a small one.
const HOT_INSTRUCTIONS: u64 = 20_000;
/// Preparing stops after this number of instructions, which take some milliseconds to compile.
const MOST_PREPARED: usize = 6_000;
/// The heat of a function that is not to be compiled.
const NEVER: u64 = u64::MAX;

/// Runs functions natively once they are worth compiling.
pub struct Jit {
    interpreter: Interpreter,
    entries: Vec<Entry>,
    constants: Constants,
    /// How many words of state the code reaches.
    state_words: usize,
    hot_instructions: u64,
    compiler: Mutex<Compiler>,
}

/// What is known of a function.
#[derive(Debug, Default)]
struct Entry {
    /// Its native code; null as long as there is none.
    code: AtomicPtr<u8>,
    /// How many words of frame the native code needs. Written before `code`.
    frame_words: AtomicUsize,
    /// How many instructions its calls have taken in the interpreter, or [`NEVER`].
    heat: AtomicU64,
}

impl Entry {
    fn set(&self, native: NativeEntry) {
        self.frame_words
            .store(native.frame_words, Ordering::Relaxed);
        self.code.store(native.code.cast_mut(), Ordering::Release);
    }
}

impl Jit {
    /// An engine that compiles a function once it has run for a while.
    pub fn new(functions: &[Function], constants: impl Into<Constants>) -> Result<Jit, JitError> {
        Jit::tuned(functions, constants, Overflow::default(), Tuning::default())
    }

    /// The same, with these heuristics only; `overflow` is what happens where results of integer
    /// arithmetic do not fit.
    pub fn tuned(
        functions: &[Function],
        constants: impl Into<Constants>,
        overflow: Overflow,
        tuning: Tuning,
    ) -> Result<Jit, JitError> {
        let mut jit = Jit {
            interpreter: Interpreter::default().with_overflow(overflow),
            entries: Vec::new(),
            constants: Constants::default(),
            state_words: 0,
            hot_instructions: if tuning.interpret_first {
                HOT_INSTRUCTIONS
            } else {
                0
            },
            compiler: Mutex::new(Compiler::new(overflow, tuning)?),
        };
        jit.extend(functions, constants)?;
        Ok(jit)
    }

    /// An engine that has compiled everything that can be called from outside.
    pub fn compile(
        functions: &[Function],
        constants: impl Into<Constants>,
        overflow: Overflow,
    ) -> Result<Jit, JitError> {
        let jit = Jit::tuned(functions, constants, overflow, Tuning::default())?;
        for index in 0..functions.len() as u32 {
            jit.compile_function(FunctionId(index))?;
        }
        Ok(jit)
    }

    /// Takes over what was appended since: both arguments are the whole of it, and begin with what
    /// was given before. What is compiled stays so. An error for code that is not a valid program
    /// ([`validate`]), and then nothing is taken over.
    pub fn extend(
        &mut self,
        functions: &[Function],
        constants: impl Into<Constants>,
    ) -> Result<(), JitError> {
        let constants = constants.into();
        let words =
            validate(functions, self.entries.len(), constants.len()).map_err(JitError::new)?;
        self.state_words = self.state_words.max(words);
        self.entries.resize_with(functions.len(), Entry::default);
        self.compiler
            .get_mut()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .extend(functions);
        self.interpreter.extend(functions, &constants);
        self.constants = constants;
        Ok(())
    }

    /// Compiles a function now, whether it is worth it or not.
    pub fn compile_function(&self, function: FunctionId) -> Result<(), JitError> {
        let entry = &self.entries[function.0 as usize];
        let mut compiler = locked(&self.compiler);
        if !entry.code.load(Ordering::Acquire).is_null() {
            return Ok(());
        }
        let compiled = compiler.compile(function);
        if let Ok(Some(native)) = compiled {
            entry.set(native);
        } else {
            entry.heat.store(NEVER, Ordering::Relaxed);
        }
        compiled.map(|_| ())
    }

    /// Takes over the native code of a function, if another engine compiled an equal one.
    fn take_over(&self, function: FunctionId) {
        let entry = &self.entries[function.0 as usize];
        let mut compiler = locked(&self.compiler);
        if entry.code.load(Ordering::Acquire).is_null()
            && let Ok(Some(native)) = compiler.known(function)
        {
            entry.set(native);
        }
    }

    /// Compiles a function if interpreting a single call of it would cost more, as long as this
    /// takes no more than some milliseconds in all.
    pub fn prepare(&self, functions: impl IntoIterator<Item = FunctionId>) {
        for function in functions {
            let mut compiler = locked(&self.compiler);
            if compiler.compiled() > MOST_PREPARED {
                return;
            }
            let is_heavy = compiler.is_heavy(function);
            drop(compiler);
            if is_heavy {
                // A function that cannot be compiled is interpreted.
                let _ = self.compile_function(function);
            }
        }
    }

    /// Interprets a call, and compiles the function if it has become hot.
    fn call_cold(
        &self,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError> {
        let entry = &self.entries[function.0 as usize];
        let (result, effort) = self
            .interpreter
            .measure(ROUND_LIMIT, function, arguments, context);
        let heat = entry.heat.load(Ordering::Relaxed);
        if heat == NEVER {
            return result;
        }
        let is_first = heat == 0;
        let heat = heat + effort.instructions;
        entry.heat.store(heat, Ordering::Relaxed);
        if heat > self.hot_instructions {
            // A function that cannot be compiled stays interpreted, which gives the same results.
            let _ = self.compile_function(function);
        } else if is_first {
            self.take_over(function);
        }
        result
    }
}

impl fmt::Debug for Jit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Jit")
            .field("entries", &self.entries)
            .finish_non_exhaustive()
    }
}

impl Executor for Jit {
    fn call(
        &self,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError> {
        let entry = &self.entries[function.0 as usize];
        let code = entry.code.load(Ordering::Acquire);
        if code.is_null() {
            return self.call_cold(function, arguments, context);
        }
        assert!(
            context.state.len() >= self.state_words,
            "the state has the words of the layout"
        );
        let frame_words = entry.frame_words.load(Ordering::Relaxed);
        if frame_words == 0 {
            let frame = ptr::dangling_mut();
            return self.call_native(code, frame, arguments, context);
        }
        FRAMES.with_borrow_mut(|frames| {
            if frames.len() < frame_words {
                frames.resize(frame_words, 0);
            }
            self.call_native(code, frames.as_mut_ptr(), arguments, context)
        })
    }

    fn with_code(
        &self,
        functions: &[Function],
        constants: &Constants,
        entry: FunctionId,
    ) -> Option<Box<dyn Executor>> {
        let (overflow, tuning) = locked(&self.compiler).rules();
        let jit = Jit::tuned(functions, constants.clone(), overflow, tuning).ok()?;
        jit.compile_function(entry).ok()?;
        let code = jit.entries[entry.0 as usize].code.load(Ordering::Acquire);
        (!code.is_null()).then(|| Box::new(jit) as Box<dyn Executor>)
    }

    fn compiles_runs(&self) -> bool {
        locked(&self.compiler).rules().1.compiled_runs
    }

    fn wraps(&self) -> &Wraps {
        self.interpreter.wraps()
    }
}

thread_local! {
    /// The frames of the functions that this thread runs; kept between calls.
    static FRAMES: RefCell<Vec<i32>> = RefCell::default();
}

/// Code of a function without parameters.
type Plain = unsafe extern "C" fn(*mut NativeContext<'_>, *mut i32, *mut i32) -> i64;
/// The entry of a function with parameters.
type WithArguments =
    unsafe extern "C" fn(*mut NativeContext<'_>, *mut i32, *mut i32, *const i32) -> i64;

impl Jit {
    #[expect(unsafe_code, reason = "compiled code is called by its address")]
    fn call_native(
        &self,
        code: *mut u8,
        frame: *mut i32,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError> {
        let (mut native, state) = NativeContext::new(&self.constants, context);
        let state = state.as_mut_ptr();
        // SAFETY: `code` was made by the compiler of the engine that is borrowed for this call, for
        // a function with as many parameters as there are arguments (a precondition of
        // `Executor::call`), with the signature of an entry if there are any and its own if not.
        // The context lives on this stack, the frame is as long as the compiler said that the
        // function and all that it calls need, and the state has the words of the layout that the
        // code was made for.
        let status = unsafe {
            if arguments.is_empty() {
                let code = std::mem::transmute::<*mut u8, Plain>(code);
                code(&raw mut native, state, frame)
            } else {
                let code = std::mem::transmute::<*mut u8, WithArguments>(code);
                code(&raw mut native, state, frame, arguments.as_ptr())
            }
        };
        if native.wrapped != Wraps::NOWHERE {
            self.wraps().note(SiteId(native.wrapped));
        }
        result_of_status(status)
    }
}
