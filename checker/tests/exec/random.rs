//! Random programs: whatever they do, all engines must do the same.
//!
//! A program is a few functions, of which each calls only earlier ones and the last is called from
//! outside. Functions work on small pools of registers that are written over and over, on 64 words
//! each of state, constants and frame, cut into blocks of four, and through addresses of blocks.
//! Random numbers come from a stream behind these words of the state. Nothing else writes it: its
//! parts depend on each other. Loops have few rounds. Numbers are mostly small, so that many
//! programs run to their end, and sometimes extreme, so that results wrap round and every error
//! comes up.

use std::fmt::Write;

use checker::exec::{Interpreter, RunTimeError};
use checker::ir::{
    Address, Base, Block, BlockId, ClockId, ClockOperand, Distribution, DoubleOperator, Function,
    FunctionId, Instruction, IntegerOperator, MathFunction, Register, RegisterType, Relation,
    RunTimeErrorKind, STREAM_WORDS, SiteId, Stream, Terminator,
};
use proptest::prelude::*;

use crate::support::{OVERFLOWS, engines, run};

const INTEGERS: u32 = 5;
const DOUBLES: u32 = 4;
/// The last one may hold the address of a constant and is never written through.
const ADDRESSES: u32 = 3;
const WORDS: usize = 64;
const BLOCK_WORDS: u32 = 4;

/// A statement, as far as it is drawn: picks are taken modulo what there is to pick from.
#[derive(Clone, Debug)]
enum Statement {
    Simple {
        code: u8,
        picks: [u8; 6],
        value: i32,
        double: f64,
    },
    If(u8, Vec<Statement>, Vec<Statement>),
    Loop(u8, Vec<Statement>),
}

#[derive(Clone, Debug)]
struct Body {
    parameters: Vec<u8>,
    result: u8,
    has_frame: bool,
    statements: Vec<Statement>,
}

fn integers() -> impl Strategy<Value = i32> {
    prop_oneof![
        8 => -4..10,
        2 => -40_000..40_000,
        1 => any::<i32>(),
        2 => prop::sample::select(LIMITS.to_vec()),
        1 => prop::sample::select(vec![-1, 31, 32]),
    ]
}

/// Numbers that arithmetic soon takes beyond 32 bits.
const LIMITS: [i32; 8] = [
    i32::MIN,
    i32::MIN + 1,
    i32::MIN / 2,
    -65536,
    46341,
    i32::MAX / 2,
    i32::MAX - 1,
    i32::MAX,
];

fn doubles() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => (-400..400).prop_map(|quarters| f64::from(quarters) / 4.0),
        2 => -1e7..1e7,
        1 => any::<f64>(),
        2 => prop::sample::select(vec![
            0.0, -0.0, 1.0, 0.5, 1000.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN,
            5e-324, f64::MAX, 2_147_483_647.5, -2_147_483_648.5,
        ]),
    ]
}

fn statements() -> impl Strategy<Value = Vec<Statement>> {
    let simple = (any::<u8>(), any::<[u8; 6]>(), integers(), doubles()).prop_map(
        |(code, picks, value, double)| Statement::Simple {
            code,
            picks,
            value,
            double,
        },
    );
    let statement = simple.prop_recursive(2, 24, 6, |inner| {
        let inner = prop::collection::vec(inner, 0..6);
        prop_oneof![
            (any::<u8>(), inner.clone(), inner.clone())
                .prop_map(|(condition, then, otherwise)| Statement::If(condition, then, otherwise)),
            (any::<u8>(), inner).prop_map(|(rounds, body)| Statement::Loop(rounds, body)),
        ]
    });
    prop::collection::vec(statement, 1..16)
}

fn programs() -> impl Strategy<Value = Vec<Body>> {
    let body = (
        prop::collection::vec(any::<u8>(), 0..4),
        any::<u8>(),
        any::<bool>(),
        statements(),
    )
        .prop_map(|(parameters, result, has_frame, statements)| Body {
            parameters,
            result,
            has_frame,
            statements,
        });
    prop::collection::vec(body, 1..4)
}

/// Makes functions out of what was drawn.
fn lower(program: &[Body]) -> Vec<Function> {
    let mut functions: Vec<Function> = Vec::new();
    let mut sites = 0;
    for (index, body) in program.iter().enumerate() {
        let is_last = index + 1 == program.len();
        let function = Lowering::new(body, is_last, &functions, &mut sites).lower(body);
        functions.push(function);
    }
    functions
}

struct Lowering<'a> {
    earlier: &'a [Function],
    sites: &'a mut u32,
    function: Function,
    /// The first registers of the pools.
    integers: u32,
    doubles: u32,
    addresses: u32,
}

impl<'a> Lowering<'a> {
    fn new(body: &Body, is_last: bool, earlier: &'a [Function], sites: &'a mut u32) -> Self {
        use RegisterType::{Address, Double, Integer};
        let kinds = [Integer, Double, Address, Integer];
        let mut registers: Vec<RegisterType> = body
            .parameters
            .iter()
            .map(|&pick| {
                if is_last {
                    Integer
                } else {
                    pick_from(&kinds, pick)
                }
            })
            .collect();
        let parameters = registers.len() as u32;
        let integers = parameters;
        let doubles = integers + INTEGERS;
        let addresses = doubles + DOUBLES;
        for (kind, count) in [(Integer, INTEGERS), (Double, DOUBLES), (Address, ADDRESSES)] {
            registers.extend((0..count).map(|_| kind));
        }
        let results = [Some(Integer), None, Some(Double), Some(Address)];
        let result = pick_from(&results[..if is_last { 2 } else { 4 }], body.result);
        Lowering {
            earlier,
            sites,
            function: Function {
                name: "random".into(),
                registers,
                parameters,
                frame_words: if body.has_frame { WORDS as u32 } else { 0 },
                result,
                blocks: vec![empty_block()],
            },
            integers,
            doubles,
            addresses,
        }
    }

    fn lower(mut self, body: &Body) -> Function {
        self.fill_pools();
        self.statements(&body.statements);
        self.finish();
        self.function
    }

    /// Writes every register of the pools, from parameters where there are any.
    fn fill_pools(&mut self) {
        for index in 0..INTEGERS {
            let target = Register(self.integers + index);
            let value = index as i32;
            self.push(Instruction::Integer { target, value });
        }
        for index in 0..DOUBLES {
            let target = Register(self.doubles + index);
            let value = (0.75 * f64::from(index)).into();
            self.push(Instruction::Double { target, value });
        }
        for index in 0..ADDRESSES {
            let target = Register(self.addresses + index);
            let address = word(Base::State, index * 5 * BLOCK_WORDS);
            self.push(Instruction::AddressOf { target, address });
        }
        for parameter in 0..self.function.parameters {
            let pool = match self.function.registers[parameter as usize] {
                RegisterType::Integer => self.integers,
                RegisterType::Double => self.doubles,
                RegisterType::Address => self.addresses + ADDRESSES - 1 - parameter,
            };
            self.push(Instruction::Copy {
                target: Register(pool + parameter),
                source: Register(parameter),
            });
        }
    }

    fn finish(&mut self) {
        let result = self.function.result.map(|kind| match kind {
            RegisterType::Integer => Register(self.integers),
            RegisterType::Double => Register(self.doubles),
            RegisterType::Address => {
                // Not the address of a frame, which ends with its function.
                let target = Register(self.addresses);
                let address = word(Base::State, 2 * BLOCK_WORDS);
                self.push(Instruction::AddressOf { target, address });
                target
            }
        });
        self.end(Terminator::Return(result));
    }

    fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            match statement {
                Statement::Simple {
                    code,
                    picks,
                    value,
                    double,
                } => self.simple(*code, *picks, *value, *double),
                Statement::If(condition, then, otherwise) => {
                    let is_switch = condition % 3 == 0;
                    let condition = self.integer(*condition);
                    self.branch((condition, is_switch), then, otherwise);
                }
                Statement::Loop(rounds, body) => self.repeat(i32::from(rounds % 5), body),
            }
        }
    }

    /// Two ways, decided by a condition or by the place in a list.
    fn branch(
        &mut self,
        (condition, is_switch): (Register, bool),
        then: &[Statement],
        otherwise: &[Statement],
    ) {
        let head = self.current();
        let then_block = self.open();
        self.statements(then);
        let then_end = self.current();
        let otherwise_block = self.open();
        self.statements(otherwise);
        let otherwise_end = self.current();
        let join = self.open();
        let terminator = if is_switch {
            let list = [then_block, otherwise_block, then_block, then_block];
            Terminator::Switch(condition, list.into(), otherwise_block)
        } else {
            Terminator::Branch(condition, then_block, otherwise_block)
        };
        self.end_at(head, terminator);
        self.end_at(then_end, Terminator::Jump(join));
        self.end_at(otherwise_end, Terminator::Jump(join));
    }

    fn repeat(&mut self, rounds: i32, body: &[Statement]) {
        let counter = self.temporary(RegisterType::Integer);
        let limit = self.temporary(RegisterType::Integer);
        let one = self.temporary(RegisterType::Integer);
        let goes_on = self.temporary(RegisterType::Integer);
        self.push(Instruction::Integer {
            target: counter,
            value: 0,
        });
        let before = self.current();
        let head = self.open();
        if rounds % 2 == 0 {
            // The front end counts rounds, the engines count where it does not.
            let site = self.site();
            self.push(Instruction::CountRound { site });
        }
        self.push(Instruction::Integer {
            target: limit,
            value: rounds,
        });
        self.push(Instruction::CompareIntegers {
            relation: Relation::Less,
            target: goes_on,
            left: counter,
            right: limit,
        });
        let body_start = self.open();
        self.statements(body);
        self.push(Instruction::Integer {
            target: one,
            value: 1,
        });
        let site = self.site();
        self.push(Instruction::Arithmetic {
            operator: IntegerOperator::Add,
            target: counter,
            left: counter,
            right: one,
            site,
        });
        let body_end = self.current();
        let after = self.open();
        self.end_at(before, Terminator::Jump(head));
        self.end_at(head, Terminator::Branch(goes_on, body_start, after));
        self.end_at(body_end, Terminator::Jump(head));
    }

    /// One instruction, with what it needs for its operands.
    #[expect(
        clippy::many_single_char_names,
        reason = "picks mean nothing of themselves"
    )]
    fn simple(&mut self, code: u8, picks: [u8; 6], value: i32, double: f64) {
        let [a, b, c, d, e, f] = picks;
        let site = self.site();
        match code % 40 {
            0 | 1 => {
                let target = self.integer(a);
                self.push(Instruction::Integer { target, value });
            }
            2 | 3 => {
                let (target, value) = (self.double(a), double.into());
                self.push(Instruction::Double { target, value });
            }
            4 => self.copy(a, b, c),
            5..10 => {
                let (target, left, right) = (self.integer(b), self.integer(c), self.integer(d));
                if e % 2 == 0 {
                    // Near the limits results wrap round, which registers seldom come to.
                    let target = if f % 2 == 0 { left } else { right };
                    let value = match e % 4 {
                        0 => pick_from(&LIMITS, f / 2),
                        _ => value,
                    };
                    self.push(Instruction::Integer { target, value });
                }
                self.push(Instruction::Arithmetic {
                    operator: pick_from(&INTEGER_OPERATORS, a),
                    target,
                    left,
                    right,
                    site,
                });
            }
            10 | 11 => {
                let (target, left, right) = (self.integer(b), self.integer(c), self.integer(d));
                let relation = pick_from(&RELATIONS, a);
                self.push(Instruction::CompareIntegers {
                    relation,
                    target,
                    left,
                    right,
                });
            }
            12 => {
                let (target, left, right) = (self.integer(b), self.double(c), self.double(d));
                let relation = pick_from(&RELATIONS, a);
                self.push(Instruction::CompareDoubles {
                    relation,
                    target,
                    left,
                    right,
                });
            }
            13 => {
                let (target, source) = (self.integer(a), self.integer(b));
                if c % 2 == 0 {
                    self.push(Instruction::Not { target, source });
                } else {
                    let (then, otherwise) = (self.integer(d), self.integer(e));
                    self.push(Instruction::Select {
                        target,
                        condition: source,
                        then,
                        otherwise,
                    });
                }
            }
            14..17 => {
                let (target, left, right) = (self.double(b), self.double(c), self.double(d));
                let operator = pick_from(&DOUBLE_OPERATORS, a);
                self.push(Instruction::DoubleArithmetic {
                    operator,
                    target,
                    left,
                    right,
                });
            }
            17 => {
                let (target, source) = (self.double(a), self.integer(b));
                self.push(Instruction::IntegerToDouble { target, source });
            }
            18 => {
                let (target, source) = (self.integer(a), self.double(b));
                self.push(Instruction::DoubleToInteger {
                    target,
                    source,
                    site,
                });
            }
            19 | 20 => self.math(pick_from(MathFunction::ALL, a), [b, c, d, e], site),
            21 | 22 => {
                let (target, address) = (self.integer(a), self.place(b, c, d, true));
                self.push(Instruction::LoadInteger { target, address });
            }
            23 => {
                let (target, address) = (self.double(a), self.place(b, c, d, true));
                self.push(Instruction::LoadDouble { target, address });
            }
            24..27 => {
                let (address, source) = (self.place(b, c, d, false), self.integer(a));
                self.push(Instruction::StoreInteger { address, source });
            }
            27 => {
                let (address, source) = (self.place(b, c, d, false), self.double(a));
                self.push(Instruction::StoreDouble {
                    address,
                    source,
                    is_number: false,
                });
            }
            28 => {
                let (target, source, words) = self.ranges([a, b, c, d, e], true);
                self.push(Instruction::CopyWords {
                    target,
                    source,
                    words,
                });
            }
            29 => {
                let target = self.integer(f);
                let (left, right, words) = self.ranges([a, b, c, d, e], false);
                self.push(Instruction::EqualWords {
                    target,
                    left,
                    right,
                    words,
                });
            }
            30 => self.take_address(a, b, c),
            31 => {
                let (low, width) = (value, i32::from(b) * i32::from(c) * i32::from(c) * 64);
                let value = self.integer(a);
                let high = low.saturating_add(width);
                self.push(Instruction::CheckRange {
                    value,
                    low,
                    high,
                    site,
                });
            }
            32 => {
                let (condition, kind) = (self.integer(a), RunTimeErrorKind::AssertionFailed);
                self.push(Instruction::Require {
                    condition,
                    kind,
                    site,
                });
            }
            33 => {
                let (left, right) = (self.clock(b, c), self.clock(d, e));
                let bound = self.integer(a);
                self.push(Instruction::Constrain {
                    left,
                    right,
                    strict: f.is_multiple_of(2),
                    bound,
                    negate_bound: f < 128,
                    site,
                });
            }
            34 => {
                let (clock, value) = (self.clock(b, c), self.integer(a));
                self.push(Instruction::SetClock { clock, value, site });
            }
            35 => {
                let (clock, source) = (self.clock(b, c), self.clock(d, e));
                let increment = f.is_multiple_of(2).then(|| self.integer(a));
                self.push(Instruction::CopyClock {
                    clock,
                    source,
                    increment,
                    site,
                });
            }
            36 | 37 => self.call(picks),
            38 if f < 40 => {
                self.finish();
                self.open();
            }
            38 if f < 100 => {
                // Few programs may end at a parameter that is out of its domain.
                let distribution = match f {
                    ..60 => pick_from(Distribution::ALL, a),
                    _ => Distribution::Uniform,
                };
                let arguments = [b, c, d].map(|pick| self.double(pick));
                let target = self.double(e);
                self.push(Instruction::Random {
                    distribution,
                    target,
                    arguments: arguments[..distribution.arity()].to_vec(),
                    stream: word(Base::State, WORDS as u32),
                    site,
                });
            }
            39 if f < 40 => {
                self.end(Terminator::Fail(RunTimeErrorKind::AssertionFailed, site));
                self.open();
            }
            _ => {
                let (target, source) = (self.integer(a), self.integer(b));
                self.push(Instruction::Copy { target, source });
            }
        }
    }

    fn copy(&mut self, kind: u8, target: u8, source: u8) {
        let (target, source) = match kind % 3 {
            0 => (self.integer(target), self.integer(source)),
            1 => (self.double(target), self.double(source)),
            _ => (self.writable(target), self.writable(source)),
        };
        self.push(Instruction::Copy { target, source });
    }

    fn math(&mut self, function: MathFunction, picks: [u8; 4], site: SiteId) {
        let [target, arguments @ ..] = picks;
        let arguments = arguments
            .iter()
            .zip(function.parameters())
            .map(|(&pick, &kind)| self.of_kind(kind, pick))
            .collect();
        let target = self.of_kind(function.result(), target);
        self.push(Instruction::Math {
            function,
            target,
            arguments,
            site,
        });
    }

    /// Starts of blocks, the same or disjoint; sometimes many.
    #[expect(
        clippy::many_single_char_names,
        reason = "picks mean nothing of themselves"
    )]
    fn ranges(&mut self, picks: [u8; 5], writes: bool) -> (Address, Address, u32) {
        let [a, b, c, d, e] = picks;
        if e < 64 {
            let left = self.base(a, !writes, false);
            let right = self.base(b, true, false);
            let half = |pick: u8| u32::from(pick % 2) * 32;
            return (
                word(left, half(c)),
                word(right, half(d)),
                18 + u32::from(e) % 15,
            );
        }
        let mut left = self.place(a, b, c, !writes);
        let mut right = self.place(c, d, e, true);
        for address in [&mut left, &mut right] {
            address.offset -= address.offset % BLOCK_WORDS;
        }
        (left, right, u32::from(e % 5))
    }

    fn take_address(&mut self, target: u8, base: u8, block: u8) {
        let target = self.addresses + u32::from(target) % ADDRESSES;
        let may_be_constant = target + 1 == self.addresses + ADDRESSES;
        let address = self.place(base, block, 0, may_be_constant);
        self.push(Instruction::AddressOf {
            target: Register(target),
            address,
        });
    }

    fn base(&mut self, pick: u8, may_be_constant: bool, may_be_register: bool) -> Base {
        match pick % 4 {
            1 if may_be_constant => Base::Constants,
            2 if self.function.frame_words > 0 => Base::Frame,
            3 if may_be_register && may_be_constant => {
                Base::Register(Register(self.addresses + u32::from(pick / 4) % ADDRESSES))
            }
            3 if may_be_register => Base::Register(self.writable(pick / 4)),
            _ => Base::State,
        }
    }

    /// A place with room for a double; the third pick says which word of a block, and how it is
    /// indexed.
    fn place(&mut self, base: u8, block: u8, how: u8, may_be_constant: bool) -> Address {
        let base = self.base(base, may_be_constant, true);
        let in_block = u32::from(how) % 3;
        if let Base::Register(_) = base {
            return word(base, in_block);
        }
        let is_indexed = how & 0x80 != 0;
        let blocks = if is_indexed { 12 } else { 16 };
        let mut address = word(base, u32::from(block) % blocks * BLOCK_WORDS + in_block);
        if is_indexed {
            let mut index = self.scaled_index(block / 16, 4, how & 0x10 == 0);
            if how & 0x08 == 0 {
                let other = self.scaled_index(block / 32, 2, true);
                let target = self.temporary(RegisterType::Integer);
                self.push(Instruction::AddIndices {
                    target,
                    left: index,
                    right: other,
                });
                index = target;
            }
            address.index = Some(index);
        }
        address
    }

    /// 0 to `length - 1` blocks; if masked, it is never out of bounds.
    fn scaled_index(&mut self, pick: u8, length: u32, is_masked: bool) -> Register {
        let mut index = self.integer(pick);
        let site = self.site();
        if is_masked {
            let (mask, masked) = (
                self.temporary(RegisterType::Integer),
                self.temporary(RegisterType::Integer),
            );
            self.push(Instruction::Integer {
                target: mask,
                value: length as i32 - 1,
            });
            self.push(Instruction::Arithmetic {
                operator: IntegerOperator::And,
                target: masked,
                left: index,
                right: mask,
                site,
            });
            index = masked;
        }
        let target = self.temporary(RegisterType::Integer);
        self.push(Instruction::ScaleIndex {
            target,
            index,
            first: 0,
            length,
            stride: BLOCK_WORDS,
            site,
        });
        target
    }

    fn clock(&mut self, first: u8, index: u8) -> ClockOperand {
        let index = index
            .is_multiple_of(3)
            .then(|| self.scaled_index(index / 3, 4, true));
        ClockOperand {
            first: ClockId(u32::from(first) % 8),
            index,
        }
    }

    fn call(&mut self, picks: [u8; 6]) {
        let [function, target, arguments @ ..] = picks;
        if self.earlier.is_empty() {
            return;
        }
        let function = usize::from(function) % self.earlier.len();
        let callee = &self.earlier[function];
        let parameters = callee.registers[..callee.parameters as usize].to_vec();
        let result = callee.result;
        let arguments = parameters
            .iter()
            .zip(arguments)
            .map(|(&kind, pick)| self.of_kind(kind, pick))
            .collect();
        self.push(Instruction::Call {
            target: result.map(|kind| self.of_kind(kind, target)),
            function: FunctionId(function as u32),
            arguments,
        });
    }

    fn of_kind(&self, kind: RegisterType, pick: u8) -> Register {
        match kind {
            RegisterType::Integer => self.integer(pick),
            RegisterType::Double => self.double(pick),
            RegisterType::Address => self.writable(pick),
        }
    }

    fn integer(&self, pick: u8) -> Register {
        Register(self.integers + u32::from(pick) % INTEGERS)
    }

    fn double(&self, pick: u8) -> Register {
        Register(self.doubles + u32::from(pick) % DOUBLES)
    }

    /// An address that may be written through.
    fn writable(&self, pick: u8) -> Register {
        Register(self.addresses + u32::from(pick) % (ADDRESSES - 1))
    }

    fn temporary(&mut self, kind: RegisterType) -> Register {
        self.function.registers.push(kind);
        Register(self.function.registers.len() as u32 - 1)
    }

    fn site(&mut self) -> SiteId {
        *self.sites += 1;
        SiteId(*self.sites)
    }

    fn push(&mut self, instruction: Instruction) {
        let block = self.function.blocks.last_mut().expect("there is a block");
        block.instructions.push(instruction);
    }

    fn current(&self) -> BlockId {
        BlockId(self.function.blocks.len() as u32 - 1)
    }

    fn open(&mut self) -> BlockId {
        self.function.blocks.push(empty_block());
        self.current()
    }

    fn end(&mut self, terminator: Terminator) {
        let block = self.current();
        self.end_at(block, terminator);
    }

    fn end_at(&mut self, BlockId(block): BlockId, terminator: Terminator) {
        self.function.blocks[block as usize].terminator = terminator;
    }
}

fn empty_block() -> Block {
    Block {
        instructions: Vec::new(),
        terminator: Terminator::Return(None),
    }
}

fn word(base: Base, offset: u32) -> Address {
    Address {
        base,
        offset,
        index: None,
    }
}

fn pick_from<T: Copy>(choices: &[T], pick: u8) -> T {
    choices[usize::from(pick) % choices.len()]
}

const INTEGER_OPERATORS: [IntegerOperator; 13] = [
    IntegerOperator::Add,
    IntegerOperator::Subtract,
    IntegerOperator::Multiply,
    IntegerOperator::Divide,
    IntegerOperator::Remainder,
    IntegerOperator::Power,
    IntegerOperator::ShiftLeft,
    IntegerOperator::ShiftRight,
    IntegerOperator::And,
    IntegerOperator::Or,
    IntegerOperator::Xor,
    IntegerOperator::Minimum,
    IntegerOperator::Maximum,
];

const DOUBLE_OPERATORS: [DoubleOperator; 6] = [
    DoubleOperator::Add,
    DoubleOperator::Subtract,
    DoubleOperator::Multiply,
    DoubleOperator::Divide,
    DoubleOperator::Minimum,
    DoubleOperator::Maximum,
];

const RELATIONS: [Relation; 6] = [
    Relation::Less,
    Relation::LessEqual,
    Relation::Greater,
    Relation::GreaterEqual,
    Relation::Equal,
    Relation::NotEqual,
];

/// A state of these words, and the start of a run behind them.
fn state(word: impl Fn(i32) -> i32, seed: u64) -> Vec<i32> {
    let mut words: Vec<i32> = (0..WORDS as i32).map(word).collect();
    words.resize(WORDS + STREAM_WORDS, 0);
    Stream::start(&mut words[WORDS..], seed, 1);
    words
}

/// Compares the engines on a program, for several arguments and states.
fn check_agreement(program: &[Body], seeds: &[i32]) -> Result<(), TestCaseError> {
    let functions = lower(program);
    let constants: Vec<i32> = (0..WORDS as i32).map(|word| word * 7 % 11 - 3).collect();
    let last = FunctionId(functions.len() as u32 - 1);
    let all = OVERFLOWS.map(|overflow| engines(&functions, &constants, overflow));
    for (engines, &seed) in all
        .iter()
        .flat_map(|one| seeds.iter().map(move |seed| (one, seed)))
    {
        let (_, reference) = &engines[0];
        let arguments = vec![seed; functions[last.0 as usize].parameters as usize];
        let state = state(|word| seed.wrapping_mul(word) % 5, u64::from(seed as u32));
        let expected = run(&**reference, last, &arguments, &state);
        for (name, engine) in &engines[1..] {
            let actual = run(&**engine, last, &arguments, &state);
            if actual != expected {
                return Err(TestCaseError::fail(describe(
                    &functions, name, seed, &expected, &actual,
                )));
            }
        }
    }
    Ok(())
}

fn describe(
    functions: &[Function],
    engine: &str,
    seed: i32,
    expected: &impl std::fmt::Debug,
    actual: &impl std::fmt::Debug,
) -> String {
    let mut text =
        format!("{engine} differs for {seed}\nexpected {expected:?}\nactual   {actual:?}\n");
    for (index, function) in functions.iter().enumerate() {
        writeln!(text, "f{index} = {function:#?}").expect("strings can be written");
    }
    text
}

/// How many programs to try; `NTAGEN_CASES` says otherwise.
fn cases() -> u32 {
    std::env::var("NTAGEN_CASES")
        .ok()
        .and_then(|cases| cases.parse().ok())
        .unwrap_or(1000)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: cases(),
        max_shrink_iters: 20_000,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn all_engines_agree_on_random_programs(
        program in programs(),
        seeds in prop::collection::vec(integers(), 3),
    ) {
        check_agreement(&program, &seeds)?;
    }
}

#[test]
fn random_programs_end_in_every_way() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::deterministic();
    let mut ends = std::collections::BTreeMap::new();
    let mut wrapped = 0;
    for seed in 0..3000 {
        let program = programs()
            .new_tree(&mut runner)
            .expect("nothing is rejected")
            .current();
        let functions = lower(&program);
        let last = FunctionId(functions.len() as u32 - 1);
        let arguments = vec![seed % 7; functions[last.0 as usize].parameters as usize];
        for overflow in OVERFLOWS {
            let interpreter = Interpreter::new(&functions, &[1; WORDS]).with_overflow(overflow);
            let outcome = run(&interpreter, last, &arguments, &state(|_| 2, 0));
            let end = match outcome.result {
                Ok(_) => "end".to_owned(),
                Err(RunTimeError {
                    kind: RunTimeErrorKind::Parameter(_),
                    ..
                }) => "Parameter".to_owned(),
                Err(error) => format!("{:?}", error.kind),
            };
            *ends.entry(end).or_insert(0) += 1;
            wrapped += i32::from(outcome.wrapped.is_some());
        }
    }
    assert!(
        wrapped > 150,
        "results wrap round in {wrapped} programs only"
    );
    assert!(
        ends["end"] > 2000,
        "too few programs run to their end: {ends:?}"
    );
    assert_eq!(ends.len(), 11, "not all errors come up: {ends:?}");
}
