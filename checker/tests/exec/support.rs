//! Engines side by side, and a short way to write code.

use checker::exec::{Context, EmittedAssignment, Executor, Interpreter, RunTimeError};
use checker::ir::{
    Address, Base, Block, FixedConstraint, Function, FunctionId, Instruction, Overflow, Register,
    RegisterType, SiteId, Terminator,
};

/// Everything that a call leaves behind.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outcome {
    /// What the call returned.
    pub result: Result<i32, RunTimeError>,
    /// The words of the state; empty after an error, when they are of no use.
    pub state: Vec<i32>,
    /// The emitted constraints; empty after an error.
    pub constraints: Vec<FixedConstraint>,
    /// The emitted assignments; empty after an error.
    pub assignments: Vec<EmittedAssignment>,
    /// The first place where a result wrapped round.
    pub wrapped: Option<SiteId>,
}

/// Both ways to take results that do not fit.
pub(crate) const OVERFLOWS: [Overflow; 2] = [Overflow::Wrap, Overflow::Error];

/// All engines on the same code, the reference first.
pub(crate) fn engines(
    functions: &[Function],
    constants: &[i32],
    overflow: Overflow,
) -> Vec<(&'static str, Box<dyn Executor>)> {
    let interpreter = Interpreter::new(functions, constants).with_overflow(overflow);
    vec![
        ("interpreter", Box::new(interpreter)),
        #[cfg(feature = "jit")]
        (
            "compiled code",
            Box::new(compiled(functions, constants, overflow)),
        ),
        // The engine before has compiled it, and this one has not.
        #[cfg(feature = "jit")]
        (
            "shared code",
            Box::new(sharing(functions, constants, overflow)),
        ),
    ]
}

#[cfg(feature = "jit")]
fn compiled(functions: &[Function], constants: &[i32], overflow: Overflow) -> checker::exec::Jit {
    checker::exec::Jit::compile(functions, constants, overflow).expect("the host is supported")
}

#[cfg(feature = "jit")]
fn sharing(functions: &[Function], constants: &[i32], overflow: Overflow) -> checker::exec::Jit {
    let tuning = checker::tuning::Tuning::default();
    let jit = checker::exec::Jit::tuned(functions, constants, overflow, tuning);
    jit.expect("the host is supported")
}

/// Calls a function on one engine.
pub(crate) fn run(
    engine: &dyn Executor,
    function: FunctionId,
    arguments: &[i32],
    state: &[i32],
) -> Outcome {
    let mut outcome = Outcome {
        result: Ok(0),
        state: state.to_vec(),
        constraints: Vec::new(),
        assignments: Vec::new(),
        wrapped: None,
    };
    engine.wraps().clear();
    outcome.result = engine.call(
        function,
        arguments,
        &mut Context {
            state: &mut outcome.state,
            constraints: &mut outcome.constraints,
            assignments: &mut outcome.assignments,
        },
    );
    outcome.wrapped = engine.wraps().first();
    if outcome.result.is_err() {
        outcome.state.clear();
        outcome.constraints.clear();
        outcome.assignments.clear();
    }
    outcome
}

/// A function of one block.
pub(crate) fn straight_line(
    parameters: u32,
    registers: &[RegisterType],
    instructions: Vec<Instruction>,
    result: Option<u32>,
) -> Function {
    Function {
        name: "test".into(),
        registers: registers.to_vec(),
        parameters,
        frame_words: 0,
        result: result.map(|register| registers[register as usize]),
        blocks: vec![Block {
            instructions,
            terminator: Terminator::Return(result.map(Register)),
        }],
    }
}

/// A word of the state.
pub(crate) fn state_word(offset: u32) -> Address {
    Address {
        base: Base::State,
        offset,
        index: None,
    }
}
