//! From typed trees to code: one [`Builder`] makes one function.
//!
//! Invariants:
//! * Nothing here fails: every tree that reaches it was checked and holds no error.
//! * Operands are evaluated from left to right; a local's register that a later operand may change
//!   is copied first.
//! * A check is emitted only where the interval of the value does not prove it away.
//! * Local scalars live in registers unless something refers to them; arrays and structs live in
//!   the frame.
//! * Parameters of a function in order: a scalar by value is a register of its type; an array or
//!   struct by value and words by reference are an address; clocks by reference are the index of
//!   the first clock. A returned array or struct is written to an address that comes as last
//!   parameter.

mod assignments;
mod calls;
pub(super) mod clocks;
mod expressions;
mod externals;
pub(super) mod horizons;
mod places;
mod quantifiers;
mod spawn;
mod statements;

use std::hash::BuildHasher;

use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::cancellation;

use super::typed::{Effects, Expr, Local, LocalId, Statement};
use super::types::{Memory, Type};
use crate::diagnostics::Span;
use crate::ir::{
    Address, Base, Block, BlockId, DoubleOperator, Function, FunctionId, Instruction,
    IntegerOperator, Network, Register, RegisterType, Relation, Site, SiteId, Terminator,
};

/// Images of values in the constant memory that were stored before: by a hash of the words, where
/// they begin. The words themselves decide.
pub(super) type Images = FxHashMap<u64, Vec<u32>>;

/// Puts words into the constant memory once, and returns where they lie.
pub(super) fn store_constant(network: &mut Network, images: &mut Images, words: Vec<i32>) -> u32 {
    let same = images.entry(FxBuildHasher.hash_one(&words)).or_default();
    let known = &network.constants;
    let is_same = |&&offset: &&u32| known[offset as usize..].starts_with(&words);
    if let Some(&offset) = same.iter().find(is_same) {
        return offset;
    }
    let offset = known.len() as u32;
    network.constants.append(words);
    same.push(offset);
    offset
}

/// Where a local lives.
#[derive(Clone, Copy, Debug)]
enum Home {
    Register(Register),
    Frame(u32),
    Reference {
        address: Option<Register>,
        clock: Option<Register>,
    },
}

/// A function in the making.
pub(super) struct Builder<'n> {
    network: &'n mut Network,
    images: &'n mut Images,
    locals: Vec<Local>,
    homes: Vec<Option<Home>>,
    registers: Vec<RegisterType>,
    parameters: u32,
    frame_words: u32,
    blocks: Vec<Block>,
    current: usize,
    loops: u32,
    result: Type,
    result_address: Option<Register>,
    /// What the code does to the state.
    pub(super) effects: Effects,
}

impl<'n> Builder<'n> {
    /// A function without parameters; `locals` are those of the trees that it will be given.
    pub(super) fn new(
        network: &'n mut Network,
        images: &'n mut Images,
        locals: Vec<Local>,
    ) -> Builder<'n> {
        Builder {
            network,
            images,
            homes: vec![None; locals.len()],
            locals,
            registers: Vec::new(),
            parameters: 0,
            frame_words: 0,
            blocks: vec![open_block()],
            current: 0,
            loops: 0,
            result: Type::Void,
            result_address: None,
            effects: Effects::default(),
        }
    }

    /// Adds an integer parameter for each of the locals (the `select` bindings of an edge).
    pub(super) fn select_parameters(&mut self, locals: &[LocalId]) {
        for &local in locals {
            let register = self.register(RegisterType::Integer);
            self.parameters += 1;
            self.homes[local.0 as usize] = Some(Home::Register(register));
        }
    }

    /// Adds the parameters of a function of the model, whose first locals they are, and what it
    /// returns.
    pub(super) fn signature(&mut self, parameters: &[super::typed::Parameter], result: &Type) {
        let mut copies = Vec::new();
        for (i, parameter) in parameters.iter().enumerate() {
            let local = LocalId(i as u32);
            let home = if parameter.ty == Type::String {
                let address = Some(self.register(RegisterType::Address));
                Home::Reference {
                    address,
                    clock: None,
                }
            } else if parameter.passes_channel {
                Home::Register(self.register(RegisterType::Integer))
            } else if parameter.reference {
                let size = parameter.ty.size();
                let has_words = parameter.ty.has_words();
                let address = has_words.then(|| self.register(RegisterType::Address));
                let clock = (size.clocks > 0).then(|| self.register(RegisterType::Integer));
                Home::Reference { address, clock }
            } else if parameter.ty.is_aggregate() {
                let source = self.register(RegisterType::Address);
                copies.push((local, source));
                Home::Reference {
                    address: Some(source),
                    clock: None,
                }
            } else {
                let register = self.register(register_type(&parameter.ty));
                if self.locals[i].addressed {
                    copies.push((local, register));
                }
                Home::Register(register)
            };
            self.homes[i] = Some(home);
        }
        if result.is_aggregate() {
            self.result_address = Some(self.register(RegisterType::Address));
        }
        self.result = result.clone();
        self.parameters = self.registers.len() as u32;
        for (local, register) in copies {
            self.copy_parameter(local, register);
        }
    }

    /// Moves a parameter that was passed by value into the frame, so that it can be changed and
    /// referred to.
    fn copy_parameter(&mut self, local: LocalId, register: Register) {
        let ty = self.locals[local.0 as usize].ty.clone();
        let target = self.frame(ty.size().words);
        let offset = target.offset;
        if ty.is_aggregate() {
            self.copy_words(target, at(Base::Register(register), 0), ty.size().words);
        } else {
            self.store(places::Destination::Memory(target), register, &ty);
        }
        self.homes[local.0 as usize] = Some(Home::Frame(offset));
    }

    /// Lowers the body of a function of the model and adds the function.
    pub(super) fn function(mut self, name: String, body: &Statement) -> (FunctionId, Effects) {
        self.statement(body);
        let result = self
            .result
            .is_register()
            .then(|| register_type(&self.result));
        // Checking has shown that the end of the body is not reached where a value is to be
        // returned.
        let end = result.map(|ty| self.zero(ty));
        self.terminate(Terminator::Return(end));
        self.finish(name, result)
    }

    /// A function that returns the value of an expression.
    pub(super) fn expression(mut self, name: String, expr: &Expr) -> (FunctionId, Effects) {
        let value = self.value(expr);
        let result = self.registers[value.0 as usize];
        self.terminate(Terminator::Return(Some(value)));
        self.finish(name, Some(result))
    }

    /// A function that writes the words of an expression to the start of the state, which it does
    /// not read.
    pub(super) fn words(mut self, name: String, expr: &Expr) -> FunctionId {
        let target = at(Base::State, 0);
        if expr.ty.is_aggregate() {
            let source = self.address(expr);
            self.copy_words(target, source, expr.ty.size().words);
        } else {
            let value = self.value(expr);
            self.store(places::Destination::Memory(target), value, &expr.ty);
        }
        self.terminate(Terminator::Return(None));
        self.finish(name, None).0
    }

    /// A function that evaluates expressions for their effects.
    pub(super) fn update(mut self, name: String, exprs: &[Expr]) -> (FunctionId, Effects) {
        for expr in exprs {
            self.effect(expr);
        }
        self.terminate(Terminator::Return(None));
        self.finish(name, None)
    }

    /// A function that returns whether all conditions may hold and emits their clock constraints.
    pub(super) fn guard(mut self, name: String, conditions: &[&Expr]) -> (FunctionId, Effects) {
        let fail = self.new_block();
        for condition in conditions {
            self.constrain(condition, fail);
        }
        let one = self.integer(1);
        self.terminate(Terminator::Return(Some(one)));
        self.switch(fail);
        let zero = self.integer(0);
        self.terminate(Terminator::Return(Some(zero)));
        self.finish(name, Some(RegisterType::Integer))
    }

    /// A function that returns the value of an expression, checked against the range of a type.
    pub(super) fn ranged(mut self, name: String, expr: &Expr, ty: &Type) -> (FunctionId, Effects) {
        let value = self.checked_value(expr, ty);
        self.terminate(Terminator::Return(Some(value)));
        self.finish(name, Some(RegisterType::Integer))
    }

    /// The first clock or channel that a place may be, how many it may be, and the computed offset
    /// from the first.
    pub(super) fn offset(&mut self, expr: &Expr, memory: Memory) -> (u32, u32, Option<Register>) {
        let path = self.path(expr, memory);
        debug_assert!(path.start == places::AddressStart::Fixed, "it is no local");
        (path.offset, path.reach + 1, path.index)
    }

    /// A function that returns the computed offset.
    pub(super) fn offset_function(mut self, name: String, index: Register) -> FunctionId {
        self.terminate(Terminator::Return(Some(index)));
        self.finish(name, Some(RegisterType::Integer)).0
    }

    fn finish(self, name: String, result: Option<RegisterType>) -> (FunctionId, Effects) {
        cancellation::work(UNITS_FOR_FUNCTION);
        let id = FunctionId(self.network.functions.len() as u32);
        self.network.functions.push(Function {
            name,
            registers: self.registers,
            parameters: self.parameters,
            frame_words: self.frame_words,
            result,
            blocks: reachable_blocks(self.blocks),
        });
        (id, self.effects)
    }

    fn register(&mut self, ty: RegisterType) -> Register {
        self.registers.push(ty);
        Register(self.registers.len() as u32 - 1)
    }

    fn frame(&mut self, words: u32) -> Address {
        let offset = self.frame_words;
        self.frame_words += words;
        at(Base::Frame, offset)
    }

    fn site(&mut self, span: Span) -> SiteId {
        self.network.sites.push(Site { span });
        SiteId(self.network.sites.len() as u32 - 1)
    }

    fn emit(&mut self, instruction: Instruction) {
        self.blocks[self.current].instructions.push(instruction);
    }

    /// Emits an instruction with a new register of this type as its target.
    fn compute(&mut self, ty: RegisterType, of: impl FnOnce(Register) -> Instruction) -> Register {
        let target = self.register(ty);
        self.emit(of(target));
        target
    }

    fn new_block(&mut self) -> BlockId {
        self.blocks.push(open_block());
        BlockId(self.blocks.len() as u32 - 1)
    }

    fn switch(&mut self, block: BlockId) {
        self.current = block.0 as usize;
    }

    /// Ends the current block; what is emitted next, before a switch, is not reached.
    fn terminate(&mut self, terminator: Terminator) {
        self.blocks[self.current].terminator = terminator;
        let unreachable = self.new_block();
        self.switch(unreachable);
    }

    fn jump(&mut self, block: BlockId) {
        self.terminate(Terminator::Jump(block));
    }

    /// Goes on with one of two sides as a condition says; both end behind them.
    fn either_side<T>(
        &mut self,
        condition: &Expr,
        sides: [T; 2],
        mut lower: impl FnMut(&mut Self, T),
    ) {
        let (yes, no, end) = (self.new_block(), self.new_block(), self.new_block());
        self.condition(condition, yes, no);
        for (block, side) in [yes, no].into_iter().zip(sides) {
            self.switch(block);
            lower(self, side);
            self.jump(end);
        }
        self.switch(end);
    }

    fn integer(&mut self, value: i32) -> Register {
        let target = self.register(RegisterType::Integer);
        self.set_integer(target, value);
        target
    }

    fn set_integer(&mut self, target: Register, value: i32) {
        self.emit(Instruction::Integer { target, value });
    }

    fn double(&mut self, value: f64) -> Register {
        let value = value.into();
        self.compute(RegisterType::Double, |target| Instruction::Double {
            target,
            value,
        })
    }

    fn zero(&mut self, ty: RegisterType) -> Register {
        match ty {
            RegisterType::Double => self.double(0.0),
            _ => self.integer(0),
        }
    }

    fn as_double(&mut self, source: Register) -> Register {
        let convert = |target| Instruction::IntegerToDouble { target, source };
        self.compute(RegisterType::Double, convert)
    }

    fn not(&mut self, source: Register) -> Register {
        self.compute(RegisterType::Integer, |target| Instruction::Not {
            target,
            source,
        })
    }

    fn copy(&mut self, target: Register, source: Register) {
        if target != source {
            self.emit(Instruction::Copy { target, source });
        }
    }

    fn copy_words(&mut self, target: Address, source: Address, words: u32) {
        self.emit(Instruction::CopyWords {
            target,
            source,
            words,
        });
    }

    fn address_of(&mut self, address: Address) -> Register {
        let take = |target| Instruction::AddressOf { target, address };
        self.compute(RegisterType::Address, take)
    }

    /// The offset of a part of an array, checked against its length.
    fn scaled_index(
        &mut self,
        index: Register,
        first: i32,
        length: u32,
        stride: u32,
        span: Span,
    ) -> Register {
        let site = self.site(span);
        self.compute(RegisterType::Integer, |target| Instruction::ScaleIndex {
            target,
            index,
            first,
            length,
            stride,
            site,
        })
    }

    fn compare(&mut self, relation: Relation, left: Register, right: Register) -> Register {
        self.compute(RegisterType::Integer, |target| {
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            }
        })
    }

    fn compare_doubles(&mut self, relation: Relation, left: Register, right: Register) -> Register {
        self.compute(RegisterType::Integer, |target| {
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            }
        })
    }

    fn real(&mut self, operator: DoubleOperator, left: Register, right: Register) -> Register {
        self.compute(RegisterType::Double, |target| {
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            }
        })
    }

    fn arithmetic(
        &mut self,
        operator: IntegerOperator,
        left: Register,
        right: Register,
        span: Span,
    ) -> Register {
        let site = self.site(span);
        self.compute(RegisterType::Integer, |target| Instruction::Arithmetic {
            operator,
            target,
            left,
            right,
            site,
        })
    }
}

/// What it takes to lower a function, as a rule: see [`cancellation::work`].
const UNITS_FOR_FUNCTION: usize = 1 << 13;

/// The kind of register that holds values of a type.
fn register_type(ty: &Type) -> RegisterType {
    if ty.is_real() {
        RegisterType::Double
    } else {
        RegisterType::Integer
    }
}

fn at(base: Base, offset: u32) -> Address {
    Address {
        base,
        offset,
        index: None,
    }
}

fn open_block() -> Block {
    Block {
        instructions: Vec::new(),
        terminator: Terminator::Return(None),
    }
}

/// Leaves out the blocks that are never reached and renumbers the others.
fn reachable_blocks(blocks: Vec<Block>) -> Vec<Block> {
    let mut reached = vec![false; blocks.len()];
    let mut open = vec![0];
    while let Some(block) = open.pop() {
        if !std::mem::replace(&mut reached[block], true) {
            let next = blocks[block].terminator.successors();
            open.extend(next.map(|BlockId(next)| next as usize));
        }
    }
    let mut numbers = Vec::with_capacity(blocks.len());
    let mut count = 0;
    for &is_reached in &reached {
        numbers.push(BlockId(count));
        count += u32::from(is_reached);
    }
    let renumber = |block: BlockId| numbers[block.0 as usize];
    let kept = blocks
        .into_iter()
        .zip(reached)
        .filter(|&(_, reached)| reached);
    kept.map(|(mut block, _)| {
        for target in block.terminator.successors_mut() {
            *target = renumber(*target);
        }
        block
    })
    .collect()
}
