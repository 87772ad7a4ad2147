//! Makes native code of the functions of one engine on demand.
//!
//! Functions are optimised, and compiled together with everything they call that is not compiled
//! yet, unless another engine has compiled an equal one ([`Pool`]). Calls go to absolute addresses,
//! since code that is compiled late may lie anywhere.
//!
//! Cost: some 10 to 50 µs, and then about 1 µs an instruction.

use std::sync::{Arc, Mutex};

use cranelift_module::FuncId;

use crate::exec::optimise::Optimiser;
use crate::ir::{Constants, Function, FunctionId, Overflow, RegisterType};
use crate::tuning::Tuning;

use super::error::JitError;
use super::needs::AllNeeds;
use super::pool::{Pool, locked};

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
    /// Owns the code.
    pool: Arc<Mutex<Pool>>,
    overflow: Overflow,
    optimiser: Optimiser,
    /// What the functions need as they were given.
    needs: AllNeeds,
    /// What the optimised functions need.
    optimised_needs: AllNeeds,
    /// The numbers in the pool of the optimised functions that are compiled.
    numbers: Vec<Option<FuncId>>,
    /// How many instructions were compiled so far.
    compiled: usize,
}

impl Compiler {
    pub(super) fn new(overflow: Overflow, tuning: Tuning) -> Result<Compiler, JitError> {
        Ok(Compiler {
            pool: Pool::shared()?,
            overflow,
            optimiser: Optimiser::tuned(tuning),
            needs: AllNeeds::default(),
            optimised_needs: AllNeeds::default(),
            numbers: Vec::new(),
            compiled: 0,
        })
    }

    /// Takes over what was appended since: both arguments are the whole of it, and begin with what
    /// was given before.
    pub(super) fn extend(&mut self, functions: &[Function], constants: &Constants) {
        self.optimiser.extend(functions, constants);
    }

    /// How many instructions were compiled so far, counted after optimisation; those that another
    /// engine had compiled do not count.
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
        self.numbers.resize(self.optimiser.made().len(), None);
        let mut pool = locked(&self.pool);
        let before = pool.instructions();
        for index in self.uncompiled_below(index) {
            let numbers = &self.numbers;
            let number_of = |callee: FunctionId| {
                numbers[callee.0 as usize].expect("what a function calls is compiled before it")
            };
            let optimised = &self.optimiser.made()[index];
            let number = pool.compiled(optimised, number_of, self.overflow)?;
            self.numbers[index] = Some(number);
        }
        self.compiled += pool.instructions() - before;
        let number = self.numbers[index].expect("the function was compiled now or before");
        Ok(Some(NativeEntry {
            code: pool.address_of(number, parameters)?,
            frame_words: needs.frame_words,
        }))
    }

    /// The function and all that it calls, without those that are compiled; what is called comes
    /// before its callers, as the optimiser numbers them.
    fn uncompiled_below(&self, root: usize) -> Vec<usize> {
        let functions = self.optimiser.made();
        let mut found = vec![false; functions.len()];
        let mut pending = vec![root];
        let mut order = Vec::new();
        while let Some(index) = pending.pop() {
            if self.numbers[index].is_none() && !std::mem::replace(&mut found[index], true) {
                order.push(index);
                pending.extend(functions[index].callees().map(|callee| callee.0 as usize));
            }
        }
        order.sort_unstable();
        order
    }
}

/// Whether a function takes only integers and returns an integer or nothing.
fn is_callable(function: &Function) -> bool {
    let parameters = &function.registers[..function.parameters as usize];
    let is_integer = |&kind: &RegisterType| kind == RegisterType::Integer;
    parameters.iter().all(is_integer) && function.result.iter().all(is_integer)
}
