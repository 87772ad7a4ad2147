//! The interpreter: what code means, written to be read. Compiled code is compared with it.
//!
//! Every thread has one [`Stacks`] whose stacks are kept between calls, so that a call allocates
//! nothing once they have grown. A register is 64 bits wide and holds an integer (its low half),
//! the bits of a double, or the address of a word as space and offset. Calls within the model push
//! an [`Activation`] and do not recurse in Rust, so that long chains of functions need no native
//! stack.
//!
//! Cost: some nanoseconds an instruction.

mod instructions;
mod machine;

use std::cell::RefCell;
use std::sync::Arc;

use crate::ir::{
    Address, Base, Block, CLOCK_LIMIT, Constants, Function, FunctionId, Instruction, Overflow,
    Register, RegisterType, RunTimeErrorKind, Terminator,
};

use crate::exec::rounds::{ROUND_LIMIT, count_rounds};
use crate::exec::{Context, Executor, RunTimeError, Wraps};

use machine::{Activation, Space, Stacks, WordPlace};

/// Runs functions by walking over their instructions.
#[derive(Clone, Debug, Default)]
pub struct Interpreter {
    functions: Vec<Function>,
    constants: Constants,
    overflow: Overflow,
    wraps: Arc<Wraps>,
}

impl Interpreter {
    /// An interpreter of the given functions over the given constant memory.
    pub fn new(functions: &[Function], constants: impl Into<Constants>) -> Interpreter {
        let mut interpreter = Interpreter::default();
        interpreter.extend(functions, constants);
        interpreter
    }

    /// The same, with what happens where results of integer arithmetic do not fit.
    #[must_use]
    pub fn with_overflow(mut self, overflow: Overflow) -> Interpreter {
        self.overflow = overflow;
        self
    }

    /// Takes over what was appended since: both arguments are the whole of it, and begin with what
    /// was given before.
    pub fn extend(&mut self, functions: &[Function], constants: impl Into<Constants>) {
        let known = self.functions.len();
        self.functions.extend_from_slice(&functions[known..]);
        self.functions[known..].iter_mut().for_each(count_rounds);
        self.constants = constants.into();
    }

    /// Calls a function that may take this number of rounds instead of [`ROUND_LIMIT`]; returns
    /// also how many it took.
    pub fn call_within(
        &self,
        round_limit: u64,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> (Result<i32, RunTimeError>, u64) {
        let (result, effort) = self.measure(round_limit, function, arguments, context);
        (result, effort.rounds)
    }

    /// Calls a function and measures its effort.
    pub(super) fn measure(
        &self,
        round_limit: u64,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> (Result<i32, RunTimeError>, Effort) {
        STACKS.with_borrow_mut(|machine| {
            machine.reset();
            let mut run = Execution {
                program: self,
                machine,
                context,
                round_limit,
                effort: Effort::default(),
            };
            let result = run.call(function, arguments);
            (result, run.effort)
        })
    }
}

impl Executor for Interpreter {
    fn call(
        &self,
        function: FunctionId,
        arguments: &[i32],
        context: &mut Context<'_>,
    ) -> Result<i32, RunTimeError> {
        self.measure(ROUND_LIMIT, function, arguments, context).0
    }

    fn with_code(
        &self,
        functions: &[Function],
        constants: &Constants,
        _: FunctionId,
    ) -> Option<Box<dyn Executor>> {
        let mut interpreter = Interpreter::default().with_overflow(self.overflow);
        interpreter.extend(functions, constants.clone());
        Some(Box::new(interpreter))
    }

    fn wraps(&self) -> &Wraps {
        &self.wraps
    }
}

/// What a call took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Effort {
    /// Rounds of loops, and calls of functions that call others.
    pub(super) rounds: u64,
    pub(super) instructions: u64,
}

thread_local! {
    static STACKS: RefCell<Stacks> = RefCell::default();
}

/// A call from outside.
struct Execution<'run, 'context> {
    program: &'run Interpreter,
    machine: &'run mut Stacks,
    context: &'run mut Context<'context>,
    /// How many rounds it may take.
    round_limit: u64,
    effort: Effort,
}

impl<'run> Execution<'run, '_> {
    fn call(
        &mut self,
        FunctionId(function): FunctionId,
        arguments: &[i32],
    ) -> Result<i32, RunTimeError> {
        let mut active = self.enter(function as usize);
        for (index, &argument) in arguments.iter().enumerate() {
            self.machine.registers[index] = u64::from(argument as u32);
        }
        loop {
            let block = self.block(active);
            if let Some(instruction) = block.instructions.get(active.next) {
                active.next += 1;
                self.effort.instructions += 1;
                if let Instruction::Call {
                    function,
                    arguments,
                    ..
                } = instruction
                {
                    active = self.enter_call(active, *function, arguments);
                } else {
                    self.execute(active, instruction)?;
                }
                continue;
            }
            match &block.terminator {
                Terminator::Jump(target) => go_to(&mut active, target.0),
                Terminator::Branch(condition, then, otherwise) => {
                    let holds = self.integer(active, *condition) != 0;
                    go_to(&mut active, if holds { then.0 } else { otherwise.0 });
                }
                Terminator::Switch(number, list, otherwise) => {
                    let number = self.integer(active, *number) as usize;
                    go_to(&mut active, list.get(number).unwrap_or(otherwise).0);
                }
                &Terminator::Fail(kind, site) => return Err(RunTimeError { kind, site }),
                Terminator::Return(result) => {
                    let result = result.map_or(0, |register| self.register(active, register));
                    let Some(caller) = self.leave(active, result) else {
                        return Ok(result as u32 as i32);
                    };
                    active = caller;
                }
            }
        }
    }

    /// Makes room for a function, with its frame zeroed.
    fn enter(&mut self, function: usize) -> Activation {
        let code = &self.program.functions[function];
        let active = Activation {
            function,
            block: 0,
            next: 0,
            registers: self.machine.registers.len(),
            frame: self.machine.frames.len(),
        };
        self.machine
            .registers
            .resize(active.registers + code.registers.len(), 0);
        self.machine
            .frames
            .resize(active.frame + code.frame_words as usize, 0);
        active
    }

    fn enter_call(
        &mut self,
        caller: Activation,
        FunctionId(function): FunctionId,
        arguments: &[Register],
    ) -> Activation {
        let callee = self.enter(function as usize);
        for (index, &argument) in arguments.iter().enumerate() {
            self.machine.registers[callee.registers + index] = self.register(caller, argument);
        }
        self.machine.callers.push(caller);
        callee
    }

    /// Gives up the room of a function and hands its result to the caller, which is returned if
    /// there is one.
    fn leave(&mut self, active: Activation, result: u64) -> Option<Activation> {
        self.machine.registers.truncate(active.registers);
        self.machine.frames.truncate(active.frame);
        let caller = self.machine.callers.pop()?;
        if let Instruction::Call {
            target: Some(target),
            ..
        } = self.block(caller).instructions[caller.next - 1]
        {
            self.set_register(caller, target, result);
        }
        Some(caller)
    }

    fn block(&self, active: Activation) -> &'run Block {
        &self.program.functions[active.function].blocks[active.block]
    }

    fn register(&self, active: Activation, Register(register): Register) -> u64 {
        self.machine.registers[active.registers + register as usize]
    }

    fn set_register(&mut self, active: Activation, Register(register): Register, value: u64) {
        self.machine.registers[active.registers + register as usize] = value;
    }

    fn integer(&self, active: Activation, register: Register) -> i32 {
        debug_assert_eq!(
            self.type_of(active, register),
            RegisterType::Integer,
            "an integer is read from a register of integers"
        );
        self.register(active, register) as u32 as i32
    }

    fn set_integer(&mut self, active: Activation, register: Register, value: i32) {
        debug_assert_eq!(
            self.type_of(active, register),
            RegisterType::Integer,
            "an integer is written into a register of integers"
        );
        self.set_register(active, register, u64::from(value as u32));
    }

    fn double(&self, active: Activation, register: Register) -> f64 {
        debug_assert_eq!(
            self.type_of(active, register),
            RegisterType::Double,
            "a double is read from a register of doubles"
        );
        f64::from_bits(self.register(active, register))
    }

    fn set_double(&mut self, active: Activation, register: Register, value: f64) {
        debug_assert_eq!(
            self.type_of(active, register),
            RegisterType::Double,
            "a double is written into a register of doubles"
        );
        self.set_register(active, register, value.to_bits());
    }

    fn type_of(&self, active: Activation, Register(register): Register) -> RegisterType {
        self.program.functions[active.function].registers[register as usize]
    }

    fn place(&self, active: Activation, address: Address) -> WordPlace {
        let base = match address.base {
            Base::State => WordPlace::new(Space::State, 0),
            Base::Constants => WordPlace::new(Space::Constants, 0),
            Base::Frame => WordPlace::new(Space::Frames, active.frame),
            Base::Register(register) => WordPlace::from_bits(self.register(active, register)),
        };
        let index = address
            .index
            .map_or(0, |index| self.integer(active, index) as usize);
        base.plus(address.offset as usize + index)
    }

    fn word(&self, place: WordPlace) -> i32 {
        match place.space {
            Space::State => self.context.state[place.offset],
            Space::Constants => self.program.constants[place.offset],
            Space::Frames => self.machine.frames[place.offset],
        }
    }

    fn set_word(&mut self, place: WordPlace, value: i32) {
        self.words_mut(place, 1)[0] = value;
    }

    /// The words from a place on, to change them.
    fn words_mut(&mut self, place: WordPlace, count: usize) -> &mut [i32] {
        let words = place.offset..place.offset + count;
        match place.space {
            Space::State => &mut self.context.state[words],
            Space::Frames => &mut self.machine.frames[words],
            Space::Constants => unreachable!("constants are never written"),
        }
    }
}

fn go_to(active: &mut Activation, block: u32) {
    active.block = block as usize;
    active.next = 0;
}

/// The value, if clocks may be compared with it or set to it.
pub(super) fn within_clock_limit(value: i32) -> Result<i32, RunTimeErrorKind> {
    if (-CLOCK_LIMIT..=CLOCK_LIMIT).contains(&value) {
        Ok(value)
    } else {
        Err(RunTimeErrorKind::ClockValue)
    }
}
