//! What functions need while they run natively, so that what needs too much is interpreted instead.

use crate::ir::{BlockId, Function, FunctionId};

/// Compiling larger functions would take longer than most runs.
const MAX_INSTRUCTIONS: usize = 20_000;
/// Half of the stack of a small thread.
const MAX_STACK_BYTES: usize = 1 << 20;
/// Functions that call each other deeper are interpreted, which needs no native stack.
const MAX_DEPTH: usize = 100;
/// The number of rounds that a loop is assumed to have.
const ROUNDS: u64 = 4;
/// A call that runs more instructions than this is worth compiling before the first one.
const HEAVY_WORK: u64 = 1000;
/// A quarter of a gigabyte.
const MAX_FRAME_WORDS: usize = 1 << 26;

/// What a function needs with all that it calls.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Needs {
    pub(super) frame_words: usize,
    stack_bytes: usize,
    depth: usize,
    /// The largest number of instructions of one function.
    instructions: usize,
    /// A guess at how many instructions a call runs.
    work: u64,
}

impl Needs {
    /// Whether the function may be compiled.
    pub(super) fn are_modest(self) -> bool {
        self.instructions <= MAX_INSTRUCTIONS
            && self.stack_bytes <= MAX_STACK_BYTES
            && self.depth <= MAX_DEPTH
            && self.frame_words <= MAX_FRAME_WORDS
    }

    /// Whether compiling the function before its first call is likely to pay.
    pub(super) fn are_heavy(self) -> bool {
        self.work > HEAVY_WORK
    }

    /// What one function needs, and then another.
    pub(super) fn then(self, other: Needs) -> Needs {
        Needs {
            frame_words: self.frame_words.max(other.frame_words),
            stack_bytes: self.stack_bytes.max(other.stack_bytes),
            depth: self.depth.max(other.depth),
            instructions: self.instructions.max(other.instructions),
            work: self.work.saturating_add(other.work),
        }
    }

    /// The needs of a function, given those of all its calls together.
    pub(super) fn below(self, function: &Function) -> Needs {
        let instructions = function
            .blocks
            .iter()
            .map(|block| block.instructions.len() + 1)
            .sum::<usize>();
        // Every register and every instruction may need a place of its own on the native stack.
        let stack_bytes = 512 + 16 * (instructions + function.registers.len());
        Needs {
            frame_words: self
                .frame_words
                .saturating_add(function.frame_words as usize),
            stack_bytes: self.stack_bytes.saturating_add(stack_bytes),
            depth: self.depth + 1,
            instructions: self.instructions.max(instructions),
            work: (self.work.saturating_add(instructions as u64))
                .saturating_mul(if has_loop(function) { ROUNDS } else { 1 }),
        }
    }
}

/// The needs of the functions of a program that grows; found on demand.
#[derive(Debug, Default)]
pub(super) struct AllNeeds {
    known: Vec<Option<Needs>>,
}

impl AllNeeds {
    /// The needs of a function, by the needs of what it calls; functions do not call themselves.
    pub(super) fn of(&mut self, functions: &[Function], root: usize) -> Needs {
        self.known.resize(functions.len(), None);
        let mut pending = vec![root];
        while let Some(&index) = pending.last() {
            if self.known[index].is_some() {
                pending.pop();
                continue;
            }
            let before = pending.len();
            let mut calls = Needs::default();
            for FunctionId(callee) in functions[index].callees() {
                let callee = callee as usize;
                match self.known[callee] {
                    None => pending.push(callee),
                    Some(needs) => calls = calls.then(needs),
                }
            }
            if pending.len() == before {
                self.known[index] = Some(calls.below(&functions[index]));
                pending.pop();
            }
        }
        self.known[root].expect("the root was among the pending")
    }
}

/// Whether some block jumps to an earlier one: the front end writes such jumps only for loops.
fn has_loop(function: &Function) -> bool {
    let mut blocks = function.blocks.iter().enumerate();
    blocks.any(|(index, block)| {
        let mut next = block.terminator.successors();
        next.any(|BlockId(target)| target as usize <= index)
    })
}
