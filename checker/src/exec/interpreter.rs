//! The interpreter: what code means, written to be read. Compiled code is compared with it.
//!
//! Every thread has one [`Machine`] whose stacks are kept between calls, so that a call allocates
//! nothing once they have grown. A register is 64 bits wide and holds an integer (its low half),
//! the bits of a double, or the address of a word as space and offset. Calls within the model push
//! an [`Activation`] and do not recurse in Rust, so that long chains of functions need no native
//! stack.
//!
//! Cost: some nanoseconds an instruction.

use std::cell::RefCell;
use std::sync::Arc;

use crate::builtins::Number;
use crate::cancellation;
use crate::ir::{
    Address, Base, Block, CLOCK_LIMIT, ClockId, ClockOperand, Function, FunctionId, Instruction,
    MathFunction, Overflow, Register, RegisterType, RunTimeErrorKind, SiteId, Terminator,
};

use super::arithmetic::Wrapping;
use super::executor::ROUNDS_BETWEEN_LOOKS;
use super::rounds::{ROUND_LIMIT, count_rounds};
use super::{
    Context, EmittedAssignment, EmittedConstraint, Executor, RunTimeError, Wraps, arithmetic,
};

/// Runs functions by walking over their instructions.
#[derive(Clone, Debug, Default)]
pub struct Interpreter {
    functions: Vec<Function>,
    constants: Vec<i32>,
    overflow: Overflow,
    wraps: Arc<Wraps>,
}

impl Interpreter {
    /// An interpreter of the given functions over the given constant memory.
    pub fn new(functions: &[Function], constants: &[i32]) -> Interpreter {
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
    pub fn extend(&mut self, functions: &[Function], constants: &[i32]) {
        let known = self.functions.len();
        self.functions.extend_from_slice(&functions[known..]);
        self.functions[known..].iter_mut().for_each(count_rounds);
        self.constants.clear();
        self.constants.extend_from_slice(constants);
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
        MACHINE.with_borrow_mut(|machine| {
            machine.reset();
            let mut run = Run {
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
    static MACHINE: RefCell<Machine> = RefCell::default();
}

/// The stacks of a thread.
#[derive(Debug, Default)]
struct Machine {
    /// The registers of all active functions.
    registers: Vec<u64>,
    /// The frames of all active functions.
    frames: Vec<i32>,
    /// The callers of the running function, outermost first.
    callers: Vec<Activation>,
}

impl Machine {
    fn reset(&mut self) {
        self.registers.clear();
        self.frames.clear();
        self.callers.clear();
    }
}

/// A function on its way.
#[derive(Clone, Copy, Debug)]
struct Activation {
    function: usize,
    block: usize,
    /// The instruction of the block that runs next.
    next: usize,
    /// The first of its registers.
    registers: usize,
    /// The first word of its frame.
    frame: usize,
}

/// The memories that an address can lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Space {
    State,
    Constants,
    Frames,
}

/// A word.
#[derive(Clone, Copy, Debug)]
struct Place {
    space: Space,
    offset: usize,
}

impl Place {
    fn to_bits(self) -> u64 {
        (self.space as u64) << 62 | self.offset as u64
    }

    fn from_bits(bits: u64) -> Place {
        let space = match bits >> 62 {
            0 => Space::State,
            1 => Space::Constants,
            _ => Space::Frames,
        };
        Place {
            space,
            offset: (bits & (u64::MAX >> 2)) as usize,
        }
    }

    fn new(space: Space, offset: usize) -> Place {
        Place { space, offset }
    }

    fn plus(self, words: usize) -> Place {
        Place {
            offset: self.offset + words,
            ..self
        }
    }
}

/// A call from outside.
struct Run<'run, 'context> {
    program: &'run Interpreter,
    machine: &'run mut Machine,
    context: &'run mut Context<'context>,
    /// How many rounds it may take.
    round_limit: u64,
    effort: Effort,
}

impl<'run> Run<'run, '_> {
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
            match block.terminator {
                Terminator::Jump(target) => go_to(&mut active, target.0),
                Terminator::Branch(condition, then, otherwise) => {
                    let holds = self.integer(active, condition) != 0;
                    go_to(&mut active, if holds { then.0 } else { otherwise.0 });
                }
                Terminator::Fail(kind, site) => return Err(RunTimeError { kind, site }),
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

    fn execute(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeError> {
        match instruction {
            Instruction::Integer { .. }
            | Instruction::Double { .. }
            | Instruction::Copy { .. }
            | Instruction::CompareIntegers { .. }
            | Instruction::CompareDoubles { .. }
            | Instruction::Not { .. }
            | Instruction::DoubleArithmetic { .. }
            | Instruction::IntegerToDouble { .. }
            | Instruction::AddIndices { .. } => self.compute(active, instruction),
            Instruction::LoadInteger { .. }
            | Instruction::LoadDouble { .. }
            | Instruction::StoreInteger { .. }
            | Instruction::StoreDouble { .. }
            | Instruction::CopyWords { .. }
            | Instruction::EqualWords { .. }
            | Instruction::AddressOf { .. } => self.access(active, instruction),
            Instruction::Arithmetic { site, .. }
            | Instruction::DoubleToInteger { site, .. }
            | Instruction::Math { site, .. }
            | Instruction::CheckRange { site, .. }
            | Instruction::ScaleIndex { site, .. }
            | Instruction::CountRound { site }
            | Instruction::Require { site, .. } => {
                let site = *site;
                return self
                    .compute_checked(active, instruction)
                    .map_err(|kind| RunTimeError { kind, site });
            }
            Instruction::Constrain { site, .. }
            | Instruction::SetClock { site, .. }
            | Instruction::CopyClock { site, .. } => {
                let site = *site;
                return self
                    .emit(active, instruction)
                    .map_err(|kind| RunTimeError { kind, site });
            }
            Instruction::Call { .. } => unreachable!("calls are taken by the loop"),
        }
        Ok(())
    }

    /// The instructions that compute a register from others and cannot fail.
    fn compute(&mut self, active: Activation, instruction: &Instruction) {
        match *instruction {
            Instruction::Integer { target, value } => self.set_integer(active, target, value),
            Instruction::Double { target, value } => self.set_double(active, target, value),
            Instruction::Copy { target, source } => {
                let value = self.register(active, source);
                self.set_register(active, target, value);
            }
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.integer(active, left), self.integer(active, right));
                let holds = arithmetic::integers_relate(relation, left, right);
                self.set_integer(active, target, holds.into());
            }
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.double(active, left), self.double(active, right));
                let holds = arithmetic::doubles_relate(relation, left, right);
                self.set_integer(active, target, holds.into());
            }
            Instruction::Not { target, source } => {
                let is_zero = self.integer(active, source) == 0;
                self.set_integer(active, target, is_zero.into());
            }
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            } => {
                let (left, right) = (self.double(active, left), self.double(active, right));
                self.set_double(active, target, arithmetic::double(operator, left, right));
            }
            Instruction::IntegerToDouble { target, source } => {
                let value = self.integer(active, source);
                self.set_double(active, target, value.into());
            }
            Instruction::AddIndices {
                target,
                left,
                right,
            } => {
                let (left, right) = (self.integer(active, left), self.integer(active, right));
                self.set_integer(active, target, left.wrapping_add(right));
            }
            _ => unreachable!("sorted out by execute"),
        }
    }

    /// The instructions that compute a register from others, or nothing, and can fail.
    fn compute_checked(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeErrorKind> {
        match instruction {
            Instruction::Arithmetic {
                operator,
                target,
                left,
                right,
                site,
            } => {
                let (left, right) = (self.integer(active, *left), self.integer(active, *right));
                let result = arithmetic::integer(*operator, left, right)?;
                let value = self.wrapped(result, *site)?;
                self.set_integer(active, *target, value);
            }
            Instruction::DoubleToInteger { target, source, .. } => {
                let value = arithmetic::truncate(self.double(active, *source))?;
                self.set_integer(active, *target, value);
            }
            Instruction::Math {
                function,
                target,
                arguments,
                site,
            } => self.apply(active, *function, *target, arguments, *site)?,
            &Instruction::CheckRange {
                value, low, high, ..
            } => {
                if !(low..=high).contains(&self.integer(active, value)) {
                    return Err(RunTimeErrorKind::OutOfRange);
                }
            }
            &Instruction::ScaleIndex {
                target,
                index,
                first,
                length,
                stride,
                ..
            } => {
                let index = self.integer(active, index);
                let value = arithmetic::scale_index(index, first, length, stride)?;
                self.set_integer(active, target, value);
            }
            Instruction::CountRound { .. } => {
                self.effort.rounds += 1;
                if self.effort.rounds > self.round_limit {
                    return Err(RunTimeErrorKind::StepLimit);
                }
                if self.effort.rounds.is_multiple_of(ROUNDS_BETWEEN_LOOKS) && cancellation::is_due()
                {
                    return Err(RunTimeErrorKind::Interrupted);
                }
            }
            Instruction::Require {
                condition, kind, ..
            } => {
                if self.integer(active, *condition) == 0 {
                    return Err(*kind);
                }
            }
            _ => unreachable!("sorted out by execute"),
        }
        Ok(())
    }

    /// The result of integer arithmetic at a site.
    fn wrapped(
        &self,
        (value, has_wrapped): Wrapping,
        site: SiteId,
    ) -> Result<i32, RunTimeErrorKind> {
        if has_wrapped {
            match self.program.overflow {
                Overflow::Error => return Err(RunTimeErrorKind::Overflow),
                Overflow::Wrap => self.program.wraps.note(site),
            }
        }
        Ok(value)
    }

    /// A function of the mathematical library.
    fn apply(
        &mut self,
        active: Activation,
        function: MathFunction,
        target: Register,
        arguments: &[Register],
        site: SiteId,
    ) -> Result<(), RunTimeErrorKind> {
        // No function has more than three parameters.
        let mut numbers = [Number::Integer(0); 3];
        for (number, &argument) in numbers.iter_mut().zip(arguments) {
            *number = match self.type_of(active, argument) {
                RegisterType::Double => Number::Double(self.double(active, argument)),
                _ => Number::Integer(self.integer(active, argument)),
            };
        }
        match function.evaluate(&numbers[..arguments.len()]) {
            None => return Err(RunTimeErrorKind::NotAnInteger),
            Some((Number::Integer(value), has_wrapped)) => {
                let value = self.wrapped((value, has_wrapped), site)?;
                self.set_integer(active, target, value);
            }
            Some((Number::Double(value), _)) => self.set_double(active, target, value),
        }
        Ok(())
    }

    /// The instructions that read and write memory.
    fn access(&mut self, active: Activation, instruction: &Instruction) {
        match *instruction {
            Instruction::LoadInteger { target, address } => {
                let value = self.word(self.place(active, address));
                self.set_integer(active, target, value);
            }
            Instruction::LoadDouble { target, address } => {
                let place = self.place(active, address);
                let (low, high) = (self.word(place), self.word(place.plus(1)));
                self.set_double(active, target, arithmetic::double_of_words(low, high));
            }
            Instruction::StoreInteger { address, source } => {
                let place = self.place(active, address);
                self.set_word(place, self.integer(active, source));
            }
            Instruction::StoreDouble { address, source } => {
                let place = self.place(active, address);
                let [low, high] = arithmetic::double_words(self.double(active, source));
                self.set_word(place, low);
                self.set_word(place.plus(1), high);
            }
            Instruction::CopyWords {
                target,
                source,
                words,
            } => {
                let (target, source) = (self.place(active, target), self.place(active, source));
                for word in 0..words as usize {
                    self.set_word(target.plus(word), self.word(source.plus(word)));
                }
            }
            Instruction::EqualWords {
                target,
                left,
                right,
                words,
            } => {
                let (left, right) = (self.place(active, left), self.place(active, right));
                let equal = (0..words as usize)
                    .all(|word| self.word(left.plus(word)) == self.word(right.plus(word)));
                self.set_integer(active, target, equal.into());
            }
            Instruction::AddressOf { target, address } => {
                let place = self.place(active, address);
                self.set_register(active, target, place.to_bits());
            }
            _ => unreachable!("sorted out by execute"),
        }
    }

    /// The instructions that emit clock constraints and assignments.
    fn emit(
        &mut self,
        active: Activation,
        instruction: &Instruction,
    ) -> Result<(), RunTimeErrorKind> {
        match *instruction {
            Instruction::Constrain {
                left,
                right,
                strict,
                bound,
                negate_bound,
                ..
            } => {
                let bound = within_clock_limit(self.integer(active, bound))?;
                self.context.constraints.push(EmittedConstraint {
                    left: self.clock(active, left),
                    right: self.clock(active, right),
                    bound: if negate_bound { -bound } else { bound },
                    strict,
                });
            }
            Instruction::SetClock { clock, value, .. } => {
                let value = within_clock_limit(self.integer(active, value))?;
                if value < 0 {
                    return Err(RunTimeErrorKind::ClockValue);
                }
                self.context.assignments.push(EmittedAssignment {
                    target: self.clock(active, clock),
                    source: ClockId(0),
                    value,
                });
            }
            Instruction::CopyClock {
                clock,
                source,
                increment,
                ..
            } => {
                let increment = increment.map_or(0, |register| self.integer(active, register));
                let value = within_clock_limit(increment)?;
                self.context.assignments.push(EmittedAssignment {
                    target: self.clock(active, clock),
                    source: self.clock(active, source),
                    value,
                });
            }
            _ => unreachable!("sorted out by execute"),
        }
        Ok(())
    }

    fn clock(&self, active: Activation, operand: ClockOperand) -> ClockId {
        let offset = operand
            .index
            .map_or(0, |index| self.integer(active, index) as u32);
        ClockId(operand.first.0.wrapping_add(offset))
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

    fn place(&self, active: Activation, address: Address) -> Place {
        let base = match address.base {
            Base::State => Place::new(Space::State, 0),
            Base::Constants => Place::new(Space::Constants, 0),
            Base::Frame => Place::new(Space::Frames, active.frame),
            Base::Register(register) => Place::from_bits(self.register(active, register)),
        };
        let index = address
            .index
            .map_or(0, |index| self.integer(active, index) as usize);
        base.plus(address.offset as usize + index)
    }

    fn word(&self, place: Place) -> i32 {
        match place.space {
            Space::State => self.context.state[place.offset],
            Space::Constants => self.program.constants[place.offset],
            Space::Frames => self.machine.frames[place.offset],
        }
    }

    fn set_word(&mut self, place: Place, value: i32) {
        match place.space {
            Space::State => self.context.state[place.offset] = value,
            Space::Frames => self.machine.frames[place.offset] = value,
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
