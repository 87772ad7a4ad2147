//! Writes functions: registers and blocks, in the order in which they run.

use std::collections::BTreeSet;

use super::layout::Layout;
use crate::ir::{
    Address, Base, Block, BlockId, Distribution, Function, FunctionId, Instruction,
    IntegerOperator, Register, RegisterType, Relation, RunTimeErrorKind, SiteId, Terminator,
};
use crate::stochastic::rules::Backend;

/// Code that is written here fails nowhere but where it gives up, which needs no place.
const NOWHERE: SiteId = SiteId(0);

/// From so many different places on, a table leads to them faster than comparisons.
const WORTH_A_TABLE: usize = 4;

/// A function that is being written. What is written goes to the end of the current block; behind
/// its terminator nothing is reached, and nothing is kept.
pub(super) struct Writer<'l> {
    pub(super) layout: &'l Layout,
    function: Function,
    current: usize,
    /// Whether the current block has its terminator.
    is_ended: bool,
    /// By block: whether something leads to it.
    is_reached: Vec<bool>,
}

impl<'l> Writer<'l> {
    /// A function of integers; its parameters are the first registers.
    pub(super) fn new(
        name: &str,
        parameters: u32,
        result: Option<RegisterType>,
        layout: &'l Layout,
    ) -> Writer<'l> {
        Writer {
            layout,
            function: Function {
                name: name.into(),
                registers: vec![RegisterType::Integer; parameters as usize],
                parameters,
                frame_words: 0,
                result,
                blocks: vec![empty_block()],
            },
            current: 0,
            is_ended: false,
            is_reached: vec![true],
        }
    }

    pub(super) fn finish(self) -> Function {
        self.function
    }

    fn register(&mut self, kind: RegisterType) -> Register {
        self.function.registers.push(kind);
        Register(self.function.registers.len() as u32 - 1)
    }

    fn push(&mut self, instruction: Instruction) {
        if !self.is_ended {
            let block = &mut self.function.blocks[self.current];
            block.instructions.push(instruction);
        }
    }

    /// Writes an instruction that has a result.
    pub(super) fn result(
        &mut self,
        kind: RegisterType,
        instruction: impl FnOnce(Register) -> Instruction,
    ) -> Register {
        let target = self.register(kind);
        self.push(instruction(target));
        target
    }

    /// A block that nothing leads to yet.
    pub(super) fn block(&mut self) -> BlockId {
        self.function.blocks.push(empty_block());
        self.is_reached.push(false);
        BlockId(self.function.blocks.len() as u32 - 1)
    }

    /// What is written from here on goes into this block.
    pub(super) fn at(&mut self, BlockId(block): BlockId) {
        self.current = block as usize;
        self.is_ended = false;
    }

    /// Whether something leads to a block so far.
    pub(super) fn is_reached(&self, BlockId(block): BlockId) -> bool {
        self.is_reached[block as usize]
    }

    /// Whether the current block is this one, and nothing is written there.
    pub(super) fn is_empty(&self, BlockId(block): BlockId) -> bool {
        let block = block as usize;
        let is_current = self.current == block && !self.is_ended;
        is_current && self.function.blocks[block].instructions.is_empty()
    }

    fn end(&mut self, terminator: Terminator) {
        if !self.is_ended {
            for block in terminator.successors() {
                self.is_reached[block.0 as usize] = true;
            }
            self.function.blocks[self.current].terminator = terminator;
            self.is_ended = true;
        }
    }

    pub(super) fn jump(&mut self, block: BlockId) {
        self.end(Terminator::Jump(block));
    }

    pub(super) fn branch(&mut self, condition: Register, then: BlockId, otherwise: BlockId) {
        self.end(Terminator::Branch(condition, then, otherwise));
    }

    /// Goes to the block with this place in the list, or elsewhere if there is none.
    pub(super) fn switch(&mut self, place: Register, list: Vec<BlockId>, otherwise: BlockId) {
        self.end(Terminator::Switch(place, list.into(), otherwise));
    }

    /// Goes on if the condition holds, else elsewhere.
    pub(super) fn unless(&mut self, condition: Register, otherwise: BlockId) {
        let next = self.block();
        self.branch(condition, next, otherwise);
        self.at(next);
    }

    /// Writes what is done only if a condition holds.
    pub(super) fn when(&mut self, condition: Register, write: impl FnOnce(&mut Self)) {
        let (then, next) = (self.block(), self.block());
        self.branch(condition, then, next);
        self.at(then);
        write(self);
        self.jump(next);
        self.at(next);
    }

    /// Goes on if the condition holds, else gives the run up.
    pub(super) fn insist(&mut self, condition: Register) {
        let (wrong, next) = (self.block(), self.block());
        self.branch(condition, next, wrong);
        self.at(wrong);
        self.give_up();
        self.at(next);
    }

    pub(super) fn return_value(&mut self, value: Option<Register>) {
        self.end(Terminator::Return(value));
    }

    /// Counts a round of a loop.
    pub(super) fn count_round(&mut self) {
        self.push(Instruction::CountRound { site: NOWHERE });
    }

    /// Gives the run up: it is made in another way.
    pub(super) fn give_up(&mut self) {
        self.end(Terminator::Fail(RunTimeErrorKind::Interrupted, NOWHERE));
    }

    pub(super) fn copy(&mut self, target: Register, source: Register) {
        self.push(Instruction::Copy { target, source });
    }

    pub(super) fn load(&mut self, word: u32) -> Register {
        let address = word_of_state(word, None);
        self.result(RegisterType::Integer, |target| Instruction::LoadInteger {
            target,
            address,
        })
    }

    pub(super) fn store(&mut self, word: u32, source: Register) {
        let address = word_of_state(word, None);
        self.push(Instruction::StoreInteger { address, source });
    }

    pub(super) fn store_integer(&mut self, word: u32, value: i32) {
        let value = self.integer(value);
        self.store(word, value);
    }

    /// Writes into an array of so many words at a place.
    pub(super) fn store_at(&mut self, word: u32, place: Register, length: u32, source: Register) {
        let index = self.result(RegisterType::Integer, |target| Instruction::ScaleIndex {
            target,
            index: place,
            first: 0,
            length,
            stride: 1,
            site: NOWHERE,
        });
        let address = word_of_state(word, Some(index));
        self.push(Instruction::StoreInteger { address, source });
    }

    pub(super) fn load_double(&mut self, word: u32) -> Register {
        self.load_double_at(word, None)
    }

    /// Reads the double so many words behind a place, if that is given.
    pub(super) fn load_double_at(&mut self, word: u32, index: Option<Register>) -> Register {
        let address = word_of_state(word, index);
        self.result(RegisterType::Double, |target| Instruction::LoadDouble {
            target,
            address,
        })
    }

    /// Writes a double that is never a NaN.
    pub(super) fn store_double(&mut self, word: u32, source: Register) {
        self.store_double_at(word, None, source);
    }

    pub(super) fn store_double_at(&mut self, word: u32, index: Option<Register>, source: Register) {
        let address = word_of_state(word, index);
        self.push(Instruction::StoreDouble {
            address,
            source,
            is_number: true,
        });
    }

    pub(super) fn arithmetic(
        &mut self,
        operator: IntegerOperator,
        left: Register,
        right: Register,
    ) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::Arithmetic {
            operator,
            target,
            left,
            right,
            site: NOWHERE,
        })
    }

    /// The sum of small integers: nobody looks whether it fits.
    pub(super) fn add_integers(&mut self, left: Register, right: Register) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::AddIndices {
            target,
            left,
            right,
        })
    }

    pub(super) fn double_of(&mut self, source: Register) -> Register {
        self.result(RegisterType::Double, |target| {
            Instruction::IntegerToDouble { target, source }
        })
    }

    /// A double that is an integer.
    pub(super) fn integer_of(&mut self, source: Register) -> Register {
        self.result(RegisterType::Integer, |target| {
            Instruction::DoubleToInteger {
                target,
                source,
                site: NOWHERE,
            }
        })
    }

    /// Calls a function of integers; returns its result, if it has one.
    pub(super) fn call(&mut self, function: FunctionId, values: &[i32]) {
        let arguments = values.iter().map(|&value| self.integer(value)).collect();
        self.push(Instruction::Call {
            target: None,
            function,
            arguments,
        });
    }

    /// Calls a function of integers that returns one.
    pub(super) fn call_for(&mut self, function: FunctionId, arguments: Vec<Register>) -> Register {
        self.call_typed(function, arguments, RegisterType::Integer)
    }

    /// Calls a function that returns a double.
    pub(super) fn call_for_double(
        &mut self,
        function: FunctionId,
        arguments: Vec<Register>,
    ) -> Register {
        self.call_typed(function, arguments, RegisterType::Double)
    }

    fn call_typed(
        &mut self,
        function: FunctionId,
        arguments: Vec<Register>,
        kind: RegisterType,
    ) -> Register {
        self.result(kind, |target| Instruction::Call {
            target: Some(target),
            function,
            arguments,
        })
    }

    pub(super) fn draw(&mut self, distribution: Distribution, argument: Register) -> Register {
        let stream = word_of_state(self.layout.stream, None);
        self.result(RegisterType::Double, |target| Instruction::Random {
            distribution,
            target,
            arguments: vec![argument],
            stream,
            site: NOWHERE,
        })
    }

    /// One of two integers, the first one if the condition holds.
    pub(super) fn either(
        &mut self,
        condition: Register,
        then: Register,
        otherwise: Register,
    ) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::Select {
            target,
            condition,
            then,
            otherwise,
        })
    }

    /// Whether so many words at two places are the same: 0 or 1.
    pub(super) fn same_words(&mut self, left: u32, right: u32, words: u32) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::EqualWords {
            target,
            left: word_of_state(left, None),
            right: word_of_state(right, None),
            words,
        })
    }

    /// The place of the double with this number in an array of so many.
    pub(super) fn place_of_double(&mut self, number: Register, length: u32) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::ScaleIndex {
            target,
            index: number,
            first: 0,
            length,
            stride: 2,
            site: NOWHERE,
        })
    }

    /// Goes to one of several places by a number that is one of theirs; they are in ascending
    /// order of their numbers.
    pub(super) fn select(&mut self, number: Register, places: &[(i32, BlockId)]) {
        let different: BTreeSet<BlockId> = places.iter().map(|&(_, block)| block).collect();
        let has_gaps = places.windows(2).any(|two| two[1].0 != two[0].0 + 1);
        if different.len() >= WORTH_A_TABLE && !has_gaps {
            let first = self.integer(-places[0].0);
            let place = self.add_integers(number, first);
            let list = places.iter().map(|&(_, block)| block).collect();
            let wrong = self.block();
            self.switch(place, list, wrong);
            self.at(wrong);
            self.give_up();
            return;
        }
        let mut open = vec![(None, places)];
        while let Some((block, places)) = open.pop() {
            if let Some(block) = block {
                self.at(block);
            }
            match places {
                [] => self.give_up(),
                [(_, only)] => self.jump(*only),
                _ if places.iter().all(|(_, block)| *block == places[0].1) => {
                    self.jump(places[0].1);
                }
                _ => {
                    let (left, right) = places.split_at(places.len() / 2);
                    let is_left = self.compare_to(number, Relation::Less, right[0].0);
                    let (then, otherwise) = (self.block(), self.block());
                    self.branch(is_left, then, otherwise);
                    open.push((Some(then), left));
                    open.push((Some(otherwise), right));
                }
            }
        }
    }
}

fn empty_block() -> Block {
    Block {
        instructions: Vec::new(),
        terminator: Terminator::Fail(RunTimeErrorKind::Interrupted, NOWHERE),
    }
}

fn word_of_state(offset: u32, index: Option<Register>) -> Address {
    Address {
        base: Base::State,
        offset,
        index,
    }
}
