//! Whether a predicate can hold where nothing is known of a state but the location of one process.
//!
//! Code is run with unknown values. Where an unknown value decides how the code continues, both
//! branches are tried. The contents of frames and references count as unknown. The answer errs
//! towards "it can": a branch that ends in a run-time error counts as holding, and so does one that
//! takes too many steps.

use crate::exec::arithmetic;
use crate::ir::{
    Address, Base, FunctionId, Instruction, LocationId, Network, Predicate, ProcessId, Register,
    Terminator,
};

/// The greatest number of instructions for all questions together: a few milliseconds.
const MOST_STEPS: u32 = 1 << 20;

/// The greatest number of instructions for one truth value of one function.
const MOST_STEPS_OF_A_QUESTION: u32 = 1 << 14;

/// Answers whether predicates can hold.
pub struct Possibility<'a> {
    network: &'a Network,
    /// For each word: its value, if it is always the same.
    words: Vec<Option<i32>>,
    steps: u32,
}

/// One way through a function.
#[derive(Clone)]
struct Path {
    /// The running function and its callers, outermost first.
    calls: Vec<Call>,
}

#[derive(Clone)]
struct Call {
    function: FunctionId,
    block: usize,
    /// The instruction of the block that comes next.
    next: usize,
    registers: Vec<Option<i32>>,
}

/// How a branch continues.
enum NextStep {
    /// Here.
    Here,
    /// In two blocks, since the value that decides is not known.
    Fork(usize, usize),
    /// Nowhere, with this result.
    Returned(Option<i32>),
    /// Nowhere that is known: a run-time error, or one of many blocks.
    Failed,
}

impl<'a> Possibility<'a> {
    /// Knows of words only those that nothing ever writes.
    pub fn new(network: &'a Network) -> Possibility<'a> {
        let written = network.written_words();
        let words = network.initial.iter().zip(written);
        Possibility {
            network,
            words: words
                .map(|(&value, is_written)| (!is_written).then_some(value))
                .collect(),
            steps: 0,
        }
    }

    /// Whether the predicate can have the truth value in a state in which the process is in the
    /// location.
    pub fn can_be(
        &mut self,
        truth: bool,
        predicate: &Predicate,
        process: ProcessId,
        location: LocationId,
    ) -> bool {
        self.words[process.0 as usize] = Some(location.0 as i32);
        let can_be = self.may_be(truth, predicate);
        self.words[process.0 as usize] = None;
        can_be
    }

    fn may_be(&mut self, truth: bool, predicate: &Predicate) -> bool {
        match predicate {
            Predicate::Constant(value) => *value == truth,
            Predicate::Location(process, location) => self.words[process.0 as usize]
                .is_none_or(|known| (known == location.0 as i32) == truth),
            Predicate::Data(function) => self.can_return(*function, truth),
            Predicate::Clock(_) | Predicate::Deadlock => true,
            Predicate::Not(inner) => self.may_be(!truth, inner),
            Predicate::And(parts) if truth => parts.iter().all(|part| self.may_be(truth, part)),
            Predicate::Or(parts) if !truth => parts.iter().all(|part| self.may_be(truth, part)),
            Predicate::And(parts) | Predicate::Or(parts) => {
                parts.iter().any(|part| self.may_be(truth, part))
            }
        }
    }

    /// Whether a function without parameters can return a truth value.
    fn can_return(&mut self, function: FunctionId, truth: bool) -> bool {
        let most = MOST_STEPS.min(self.steps + MOST_STEPS_OF_A_QUESTION);
        let mut ways = vec![Path {
            calls: vec![self.call(function, &[])],
        }];
        while let Some(mut way) = ways.pop() {
            loop {
                self.steps += 1;
                if self.steps >= most {
                    return true;
                }
                match self.step(&mut way) {
                    NextStep::Here => {}
                    NextStep::Fork(one, other) => {
                        let mut second = way.clone();
                        second.enter(other);
                        ways.push(second);
                        way.enter(one);
                    }
                    NextStep::Failed => return true,
                    NextStep::Returned(value) => {
                        if value.is_none_or(|value| (value != 0) == truth) {
                            return true;
                        }
                        break;
                    }
                }
            }
        }
        false
    }

    fn call(&self, function: FunctionId, arguments: &[Option<i32>]) -> Call {
        let mut registers = vec![None; self.network.functions[function.0 as usize].registers.len()];
        registers[..arguments.len()].copy_from_slice(arguments);
        Call {
            function,
            block: 0,
            next: 0,
            registers,
        }
    }

    /// Does the next instruction of a way, or goes to the next block.
    fn step(&self, way: &mut Path) -> NextStep {
        let Some(active) = way.calls.last_mut() else {
            return NextStep::Failed;
        };
        let code = &self.network.functions[active.function.0 as usize].blocks[active.block];
        let Some(instruction) = code.instructions.get(active.next) else {
            return self.leave(way, &code.terminator);
        };
        active.next += 1;
        if let Instruction::Call {
            function,
            arguments,
            ..
        } = instruction
        {
            let arguments: Vec<_> = arguments.iter().map(|&one| active.value(one)).collect();
            let callee = self.call(*function, &arguments);
            way.calls.push(callee);
            return NextStep::Here;
        }
        let value = self.value_of(active, instruction);
        if let Some(target) = instruction.target() {
            active.registers[target.0 as usize] = value;
        }
        NextStep::Here
    }

    /// Takes the end of a block.
    fn leave(&self, way: &mut Path, terminator: &Terminator) -> NextStep {
        let Some(active) = way.calls.last_mut() else {
            return NextStep::Failed;
        };
        match *terminator {
            Terminator::Jump(block) => way.enter(block.0 as usize),
            Terminator::Branch(condition, yes, no) => match active.value(condition) {
                None => return NextStep::Fork(yes.0 as usize, no.0 as usize),
                Some(0) => way.enter(no.0 as usize),
                Some(_) => way.enter(yes.0 as usize),
            },
            Terminator::Switch(number, ref list, otherwise) => match active.value(number) {
                None => return NextStep::Failed,
                Some(number) => {
                    let block = list.get(number as usize).unwrap_or(&otherwise);
                    way.enter(block.0 as usize);
                }
            },
            Terminator::Fail(..) => return NextStep::Failed,
            Terminator::Return(register) => {
                let value = register.and_then(|register| active.value(register));
                way.calls.pop();
                let Some(caller) = way.calls.last_mut() else {
                    return NextStep::Returned(value);
                };
                let code = &self.network.functions[caller.function.0 as usize].blocks[caller.block];
                if let Some(target) = code.instructions[caller.next - 1].target() {
                    caller.registers[target.0 as usize] = value;
                }
            }
        }
        NextStep::Here
    }

    /// What an instruction computes, if that is known.
    fn value_of(&self, active: &Call, instruction: &Instruction) -> Option<i32> {
        let value = |register| active.value(register);
        match *instruction {
            Instruction::LoadInteger { address, .. } => self.loaded(active, address),
            _ => arithmetic::value_of(instruction, value),
        }
    }

    fn loaded(&self, active: &Call, address: Address) -> Option<i32> {
        let index = match address.index {
            None => 0,
            Some(index) => usize::try_from(active.value(index)?).ok()?,
        };
        let place = address.offset as usize + index;
        match address.base {
            Base::State => self.words.get(place).copied().flatten(),
            Base::Constants => self.network.constants.get(place).copied(),
            Base::Frame | Base::Register(_) => None,
        }
    }
}

impl Path {
    fn enter(&mut self, block: usize) {
        if let Some(active) = self.calls.last_mut() {
            active.block = block;
            active.next = 0;
        }
    }
}

impl Call {
    fn value(&self, register: Register) -> Option<i32> {
        self.registers[register.0 as usize]
    }
}
