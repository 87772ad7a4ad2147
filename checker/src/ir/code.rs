//! Code: functions over virtual registers, in basic blocks.
//!
//! Invariants:
//! * Registers are typed and may be written more than once; every register is written before it is
//!   read.
//! * Arithmetic on integers is 32-bit: where a result does not fit, [`Overflow`] says whether it
//!   wraps round, and is noted with the instruction's [`SiteId`], or is an error.
//! * An error (a division by zero, a negative or too large shift, an index or a value out of range)
//!   ends the call with a [`RunTimeErrorKind`] at the instruction's [`SiteId`], and the state's
//!   words are then of no further use.
//! * Floating-point arithmetic is IEEE double precision in the order written; mathematical
//!   functions are those of the platform's C library, in the interpreter and in compiled code
//!   alike, so that the two agree bit for bit.
//! * Functions never call themselves, directly or indirectly.

use super::ids::{ClockId, ExternalId, FunctionId, SiteId};
use crate::builtins::Code;
pub use crate::builtins::{Distribution, MathFunction, STREAM_WORDS, Stream};

/// The greatest absolute value of a clock bound and of a value that a clock is set to; beyond it is
/// a [`RunTimeErrorKind::ClockValue`]. The limit of zones and of UPPAAL.
pub const CLOCK_LIMIT: i32 = (1 << 30) - 1;

/// Index of a virtual register in its function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Register(pub u32);

/// Index of a block in its function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BlockId(pub u32);

/// What happens where the result of integer arithmetic does not fit into 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Overflow {
    /// It wraps round, as in two's complement, which is noted: what UPPAAL does.
    #[default]
    Wrap,
    /// It is a [`RunTimeErrorKind::Overflow`].
    Error,
}

/// The type of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RegisterType {
    /// A 32-bit integer; truth values are 0 and 1.
    Integer,
    /// A double.
    Double,
    /// The address of a word: a reference parameter, or the place of an array or struct.
    Address,
}

/// A function.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Function {
    /// Its name, for diagnostics: `step`, or `template Gate, edge Free → Occ, guard`.
    pub name: String,
    /// The registers; the first ones are the parameters.
    pub registers: Vec<RegisterType>,
    /// How many of the registers are parameters.
    pub parameters: u32,
    /// The words of its frame.
    pub frame_words: u32,
    /// The type of what it returns.
    pub result: Option<RegisterType>,
    /// The blocks; execution starts at the first.
    pub blocks: Vec<Block>,
}

/// A basic block.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Block {
    /// What is done, in order.
    pub instructions: Vec<Instruction>,
    /// The next block.
    pub terminator: Terminator,
}

/// Where execution continues.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Terminator {
    /// To a block.
    Jump(BlockId),
    /// To the first block if the integer is not 0, to the second if it is.
    Branch(Register, BlockId, BlockId),
    /// To the block whose place in the list the integer is, or to the last one if there is none.
    Switch(Register, Box<[BlockId]>, BlockId),
    /// Back to the caller.
    Return(Option<Register>),
    /// Nowhere: a run-time error.
    Fail(RunTimeErrorKind, SiteId),
}

/// A word in memory: `base + offset + index`, in words. Indices were checked before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Address {
    /// Where it counts from.
    pub base: Base,
    /// A constant number of words.
    pub offset: u32,
    /// A computed number of words, never negative.
    pub index: Option<Register>,
}

/// Where an address counts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Base {
    /// The state's words.
    State,
    /// The constant memory.
    Constants,
    /// The function's frame.
    Frame,
    /// An address in a register.
    Register(Register),
}

/// A clock: `first + index`. The index was checked before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ClockOperand {
    /// The first clock; 0 where the register holds the clock itself (a clock parameter of a
    /// function).
    pub first: ClockId,
    /// A computed offset.
    pub index: Option<Register>,
}

/// A double constant; two are equal if all their bits are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct DoubleBits(u64);

impl DoubleBits {
    /// The double.
    pub fn value(self) -> f64 {
        f64::from_bits(self.0)
    }
}

impl From<f64> for DoubleBits {
    fn from(value: f64) -> DoubleBits {
        DoubleBits(value.to_bits())
    }
}

/// An instruction. Registers named `target` are written, all others read.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the fields are operands")]
pub enum Instruction {
    /// An integer constant.
    Integer { target: Register, value: i32 },
    /// A double constant.
    Double { target: Register, value: DoubleBits },
    /// A copy between registers of one type.
    Copy { target: Register, source: Register },
    /// Integer arithmetic.
    Arithmetic {
        operator: IntegerOperator,
        target: Register,
        left: Register,
        right: Register,
        site: SiteId,
    },
    /// Comparison of integers: 0 or 1.
    CompareIntegers {
        relation: Relation,
        target: Register,
        left: Register,
        right: Register,
    },
    /// Comparison of doubles: 0 or 1. A NaN is unequal to everything and in no order.
    CompareDoubles {
        relation: Relation,
        target: Register,
        left: Register,
        right: Register,
    },
    /// 1 if the integer is 0, else 0.
    Not { target: Register, source: Register },
    /// Arithmetic of doubles.
    DoubleArithmetic {
        operator: DoubleOperator,
        target: Register,
        left: Register,
        right: Register,
    },
    /// The integer `then` if the condition is not 0, else the integer `otherwise`.
    Select {
        target: Register,
        condition: Register,
        then: Register,
        otherwise: Register,
    },
    /// An integer as a double.
    IntegerToDouble { target: Register, source: Register },
    /// A double truncated towards zero; an error if it is not a number or does not fit.
    DoubleToInteger {
        target: Register,
        source: Register,
        site: SiteId,
    },
    /// A function of the mathematical library. `arguments` and `target` have the types that
    /// [`MathFunction`] says.
    Math {
        function: MathFunction,
        target: Register,
        arguments: Vec<Register>,
        site: SiteId,
    },
    /// Draws a random number from the stream whose [`STREAM_WORDS`] words begin at an address, and
    /// moves the stream on. `target` and `arguments`, as many as the distribution has parameters,
    /// are doubles. A [`RunTimeErrorKind::Parameter`] if an argument is out of its domain.
    Random {
        distribution: Distribution,
        target: Register,
        arguments: Vec<Register>,
        stream: Address,
        site: SiteId,
    },
    /// Reads an integer.
    LoadInteger { target: Register, address: Address },
    /// Reads a double from two words.
    LoadDouble { target: Register, address: Address },
    /// Writes an integer.
    StoreInteger { address: Address, source: Register },
    /// Writes a double into two words. Every NaN is written as the same one, so that equal states
    /// have equal words; if `is_number`, it never is one, and nobody has to look.
    StoreDouble {
        address: Address,
        source: Register,
        is_number: bool,
    },
    /// Copies words; the two ranges are the same or disjoint.
    CopyWords {
        target: Address,
        source: Address,
        words: u32,
    },
    /// Whether two ranges of words are the same: 0 or 1.
    EqualWords {
        target: Register,
        left: Address,
        right: Address,
        words: u32,
    },
    /// The address of a word, for a reference argument.
    AddressOf { target: Register, address: Address },
    /// An error unless `low <= value <= high`.
    CheckRange {
        value: Register,
        low: i32,
        high: i32,
        site: SiteId,
    },
    /// `target = (index - first) * stride`, an error unless `0 <= index - first < length`.
    ScaleIndex {
        target: Register,
        index: Register,
        first: i32,
        length: u32,
        stride: u32,
        site: SiteId,
    },
    /// `target = left + right` on scaled indices, which cannot overflow.
    AddIndices {
        target: Register,
        left: Register,
        right: Register,
    },
    /// One more round of a loop; an error of kind [`RunTimeErrorKind::StepLimit`] if the rounds of
    /// the whole call from outside exceed the limit. Engines put one into every cycle that has
    /// none, at the first site that they find there; the front end may put one at the head of a
    /// loop to name a better site.
    CountRound { site: SiteId },
    /// Calls a function.
    Call {
        target: Option<Register>,
        function: FunctionId,
        arguments: Vec<Register>,
    },
    /// Calls a function of a library. An argument is a value or, where the signature has a pointer,
    /// a place in memory.
    External {
        target: Option<Register>,
        function: ExternalId,
        arguments: Vec<ExternalArgument>,
        site: SiteId,
    },
    /// Emits the constraint `left - right ≺ bound` (guards and invariants only).
    Constrain {
        left: ClockOperand,
        right: ClockOperand,
        strict: bool,
        bound: Register,
        negate_bound: bool,
        site: SiteId,
    },
    /// Emits `clock := value`; an error if the value is negative (updates only).
    SetClock {
        clock: ClockOperand,
        value: Register,
        site: SiteId,
    },
    /// Emits `clock := source + increment` (updates only).
    CopyClock {
        clock: ClockOperand,
        source: ClockOperand,
        increment: Option<Register>,
        site: SiteId,
    },
    /// An error of this kind if the integer is 0 (assertions).
    Require {
        condition: Register,
        kind: RunTimeErrorKind,
        site: SiteId,
    },
}

/// An argument of a function of a library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExternalArgument {
    /// A value.
    Value(Register),
    /// A place in memory.
    Memory {
        /// Where it begins.
        address: Address,
        /// How many words it has.
        words: u32,
        /// Whether the function may change them.
        is_written: bool,
    },
}

/// Integer operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum IntegerOperator {
    /// Sum; may wrap round.
    Add,
    /// Difference; may wrap round.
    Subtract,
    /// Product; may wrap round.
    Multiply,
    /// Quotient, truncated towards zero; division by zero is an error, and `-2^31 / -1` wraps round
    /// to `-2^31`.
    Divide,
    /// Remainder with the dividend's sign; division by zero is an error, `-2^31 % -1` is 0.
    Remainder,
    /// Power; may wrap round; a negative exponent is an error; `0 ** 0` is 1.
    Power,
    /// Shift left by 0 to 31 bits; bits are lost without a word, as in C. C says nothing about
    /// other distances: they are errors.
    ShiftLeft,
    /// Arithmetic shift right by 0 to 31 bits; other distances are errors.
    ShiftRight,
    /// Bits.
    And,
    /// Bits.
    Or,
    /// Bits.
    Xor,
    /// The lesser.
    Minimum,
    /// The greater.
    Maximum,
}

/// Operators on doubles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it")]
pub enum DoubleOperator {
    Add,
    Subtract,
    Multiply,
    Divide,
    /// `a < b ? a : b`
    Minimum,
    /// `a > b ? a : b`
    Maximum,
}

/// Relations.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Relation {
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
}

impl Relation {
    /// The relation of the right side to the left side.
    #[must_use]
    pub fn swapped(self) -> Relation {
        match self {
            Relation::Less => Relation::Greater,
            Relation::LessEqual => Relation::GreaterEqual,
            Relation::Greater => Relation::Less,
            Relation::GreaterEqual => Relation::LessEqual,
            Relation::Equal | Relation::NotEqual => self,
        }
    }
}

impl MathFunction {
    /// The types of the parameters.
    pub fn parameters(self) -> &'static [RegisterType] {
        use RegisterType::{Double, Integer};
        match self.code() {
            Code::Integer(_) => &[Integer],
            Code::Unary(_) | Code::Classify(_) | Code::ToInteger(_) => &[Double],
            Code::Binary(_) => &[Double, Double],
            Code::Scale(_) => &[Double, Integer],
            Code::Ternary(_) => &[Double, Double, Double],
        }
    }

    /// The type of the result.
    pub fn result(self) -> RegisterType {
        match self.code() {
            Code::Integer(_) | Code::ToInteger(_) | Code::Classify(_) => RegisterType::Integer,
            Code::Unary(_) | Code::Binary(_) | Code::Scale(_) | Code::Ternary(_) => {
                RegisterType::Double
            }
        }
    }
}

/// What can go wrong while a model runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RunTimeErrorKind {
    /// The result of integer arithmetic does not fit into 32 bits ([`Overflow::Error`]).
    Overflow,
    /// A division by zero.
    DivisionByZero,
    /// A shift by a negative number of bits or by more than 31.
    ShiftDistance,
    /// A negative exponent of `**`.
    NegativeExponent,
    /// A value outside the range of the variable, parameter or result it is given to.
    OutOfRange,
    /// An array index outside the array.
    IndexOutOfBounds,
    /// A double that is not a number or does not fit into an integer.
    NotAnInteger,
    /// A parameter of a random function out of its domain.
    Parameter(Distribution),
    /// A call of a function of a library that was not loaded.
    NotLoaded,
    /// A new instance of a dynamic template for which there is no slot.
    NoRoom,
    /// A clock set to a negative value, or a clock bound beyond the limits of the engine.
    ClockValue,
    /// An `assert` that does not hold.
    AssertionFailed,
    /// A loop that ran longer than the limit of one call allows.
    StepLimit,
    /// Not an error of the model: the caller ended the call.
    Interrupted,
}
