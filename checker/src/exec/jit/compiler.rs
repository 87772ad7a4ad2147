//! Makes native code of the functions of one engine on demand.
//!
//! Functions are compiled together with everything they call that is not compiled yet, unless
//! another engine has compiled an equal one ([`Pool`]). Calls go to absolute addresses, since code
//! that is compiled late may lie anywhere.
//!
//! Cost: some 10 to 50 µs, and then about 1 µs an instruction.

use std::sync::{Arc, Mutex};

use cranelift_module::FuncId;

use crate::ir::{Function, FunctionId, Overflow, RegisterType};
use crate::tuning::Tuning;

use super::error::JitError;
use super::needs::AllNeeds;
use super::pool::{Key, Pool, locked};

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
    tuning: Tuning,
    functions: Vec<Function>,
    /// What the functions need.
    needs: AllNeeds,
    /// The numbers in the pool of the functions that are compiled.
    numbers: Vec<Option<FuncId>>,
    /// How many instructions were compiled so far.
    compiled: usize,
}

impl Compiler {
    pub(super) fn new(overflow: Overflow, tuning: Tuning) -> Result<Compiler, JitError> {
        Ok(Compiler {
            pool: Pool::shared()?,
            overflow,
            tuning,
            functions: Vec::new(),
            needs: AllNeeds::default(),
            numbers: Vec::new(),
            compiled: 0,
        })
    }

    /// Takes over the functions that were appended since, of all functions.
    pub(super) fn extend(&mut self, functions: &[Function]) {
        let known = self.functions.len();
        self.functions.extend_from_slice(&functions[known..]);
        self.numbers.resize(functions.len(), None);
    }

    /// What it does where results do not fit, and which heuristics it uses.
    pub(super) fn rules(&self) -> (Overflow, Tuning) {
        (self.overflow, self.tuning)
    }

    /// How many instructions were compiled so far; those that another engine had compiled do not
    /// count.
    pub(super) fn compiled(&self) -> usize {
        self.compiled
    }

    /// Whether a call of the function is likely to run so much that it should be compiled before
    /// the first one.
    pub(super) fn is_heavy(&mut self, function: FunctionId) -> bool {
        let needs = self.needs.of(&self.functions, function.0 as usize);
        needs.are_heavy()
    }

    /// The entry of a function if it has native code, since another engine compiled an equal one.
    pub(super) fn known(&mut self, function: FunctionId) -> Result<Option<NativeEntry>, JitError> {
        self.entry(function, false)
    }

    /// Compiles a function that can be called from outside and all that it calls; `None` if it is
    /// none or too large.
    pub(super) fn compile(
        &mut self,
        function: FunctionId,
    ) -> Result<Option<NativeEntry>, JitError> {
        self.entry(function, true)
    }

    /// The entry of a function. One that nobody compiled is compiled now or has none.
    fn entry(
        &mut self,
        function: FunctionId,
        compiles: bool,
    ) -> Result<Option<NativeEntry>, JitError> {
        let root = function.0 as usize;
        let code = &self.functions[root];
        let needs = self.needs.of(&self.functions, root);
        if !is_callable(code) || !needs.are_modest() {
            return Ok(None);
        }
        let parameters = code.parameters;
        let mut pool = locked(&self.pool);
        let before = pool.instructions();
        for index in self.uncompiled_below(root) {
            let key = Key::new(&self.functions[index], &self.numbers, self.overflow);
            let number = match pool.known(&key) {
                None if compiles => pool.compiled(key)?,
                known => known,
            };
            if number.is_none() {
                return Ok(None);
            }
            self.numbers[index] = number;
        }
        self.compiled += pool.instructions() - before;
        let number = self.numbers[root].expect("the function was compiled now or before");
        Ok(Some(NativeEntry {
            code: pool.address_of(number, parameters)?,
            frame_words: pool.needs_of(number).frame_words,
        }))
    }

    /// The function and all that it calls, without those that are compiled; what is called comes
    /// before its callers.
    fn uncompiled_below(&self, root: usize) -> Vec<usize> {
        let mut found = vec![false; self.functions.len()];
        let mut pending = vec![(root, false)];
        let mut order = Vec::new();
        while let Some((index, is_left)) = pending.pop() {
            if is_left {
                order.push(index);
            } else if self.numbers[index].is_none() && !std::mem::replace(&mut found[index], true) {
                pending.push((index, true));
                let callees = self.functions[index].callees();
                pending.extend(callees.map(|callee| (callee.0 as usize, false)));
            }
        }
        order
    }
}

/// Whether a function takes only integers and returns an integer or nothing.
fn is_callable(function: &Function) -> bool {
    let parameters = &function.registers[..function.parameters as usize];
    let is_integer = |&kind: &RegisterType| kind == RegisterType::Integer;
    parameters.iter().all(is_integer) && function.result.iter().all(is_integer)
}
