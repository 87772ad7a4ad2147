//! Types: what values there are, how much room they take, and which may stand for which.
//!
//! All bounds and sizes are known numbers: a template is checked once for each of its instances,
//! with its parameters known. [`Type::Error`] stands for a type that could not be found out;
//! nothing is reported about it again.
//!
//! A value may take room in three memories at once (a struct may hold integers, clocks and
//! channels), so a [`Size`] and a place count in all three.
//!
//! Source: UPPAAL's documentation on types, and the official parser's rules of equivalence (types
//! of equal structure are the same, ranges must have equal bounds, every `scalar[n]` is a set of
//! its own).

use std::fmt;
use std::sync::Arc;

use crate::exec::arithmetic;
use crate::ir;

/// The least and the greatest of some integers; empty if the first is the greater one.
pub(super) type Interval = (i32, i32);

/// The bounds of `int` without a range.
pub(super) const DEFAULT_INT: (i32, i32) = (-32768, 32767);

/// The most words, clocks or channels that a declaration may take, and the most words of all
/// declarations together.
pub(super) const SIZE_LIMIT: u64 = 1 << 24;

/// The most channels of a model: each has a name of its own.
pub(super) const CHANNEL_LIMIT: u64 = 1 << 20;

/// The most clocks of a model: one zone of them takes 64 MiB.
pub(super) const CLOCK_LIMIT: u64 = 4095;

/// A type.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Type {
    /// Unknown because of a mistake that was reported.
    Error,
    /// No value.
    Void,
    /// An integer between two bounds.
    Int { low: i32, high: i32 },
    /// A truth value; also an integer, 0 or 1.
    Bool,
    /// A double.
    Double,
    /// A text.
    String,
    /// A clock.
    Clock { hybrid: bool },
    /// A clock in the stochastic reading: words of the state that hold its value and its rate.
    RealClock,
    /// A channel.
    Channel { urgent: bool, broadcast: bool },
    /// A member of a scalar set.
    Scalar { set: u32, size: u32 },
    /// An array.
    Array(Arc<ArrayType>),
    /// A struct.
    Struct(Arc<StructType>),
    /// The difference of two clocks, or a clock and an integer; only while an expression is
    /// checked.
    ClockTerm,
    /// A condition on clocks.
    Constraint(Class),
}

/// The parts of an array type.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ArrayType {
    /// The type of a part.
    pub(super) part: Type,
    /// What it is indexed by.
    pub(super) index: Index,
}

/// What an array is indexed by, and what a quantifier ranges over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Index {
    /// The least index.
    pub(super) first: i32,
    /// How many there are.
    pub(super) length: u32,
    /// The scalar set, if it is one.
    pub(super) set: Option<u32>,
}

/// The fields of a struct type.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StructType {
    /// Names and types, in order.
    pub(super) fields: Vec<(String, Type)>,
}

/// How a condition on clocks may be used; each class includes the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Class {
    /// In invariants.
    Invariant,
    /// Only in invariants: it sets rates. Never combined with the classes above it.
    InvariantWithRate,
    /// In guards.
    Guard,
    /// In queries only.
    Query,
}

/// Room in the three memories.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Size {
    /// Words.
    pub(super) words: u32,
    /// Clocks.
    pub(super) clocks: u32,
    /// Channels.
    pub(super) channels: u32,
}

/// The three memories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Memory {
    Words,
    Clocks,
    Channels,
}

impl Size {
    /// So many words, and nothing else.
    pub(super) fn of_words(words: u32) -> Size {
        Size {
            words,
            ..Size::default()
        }
    }
    /// The amount in one memory.
    pub(super) fn of(self, memory: Memory) -> u32 {
        match memory {
            Memory::Words => self.words,
            Memory::Clocks => self.clocks,
            Memory::Channels => self.channels,
        }
    }

    /// The sum.
    pub(super) fn plus(self, other: Size) -> Size {
        Size {
            words: self.words + other.words,
            clocks: self.clocks + other.clocks,
            channels: self.channels + other.channels,
        }
    }

    /// The product with a number.
    pub(super) fn times(self, factor: u32) -> Size {
        Size {
            words: self.words * factor,
            clocks: self.clocks * factor,
            channels: self.channels * factor,
        }
    }
}

impl Index {
    /// The greatest index.
    pub(super) fn last(self) -> i32 {
        (i64::from(self.first) + i64::from(self.length) - 1) as i32
    }
}

impl Type {
    /// Every 32-bit integer.
    pub(super) const ANY_INT: Type = Type::Int {
        low: i32::MIN,
        high: i32::MAX,
    };

    /// The values that a clock may be set to.
    pub(super) const CLOCK_VALUE: Type = Type::Int {
        low: 0,
        high: ir::CLOCK_LIMIT,
    };

    /// The numbers of so many things.
    pub(super) fn below(count: u32) -> Type {
        Type::Int {
            low: 0,
            high: count as i32 - 1,
        }
    }

    /// The words of a real clock with this value, which runs at rate 1.
    pub(super) fn clock_words(value: f64) -> [i32; 4] {
        let ([a, b], [c, d]) = (
            arithmetic::double_words(value),
            arithmetic::double_words(1.0),
        );
        [a, b, c, d]
    }

    /// An array of `length` parts of this type.
    pub(super) fn array(part: Type, index: Index) -> Type {
        Type::Array(Arc::new(ArrayType { part, index }))
    }

    /// The type with an article, for messages.
    pub(super) fn described(&self) -> String {
        match self {
            Type::Error | Type::ClockTerm | Type::Constraint(_) => self.to_string(),
            Type::Void => String::from("no value"),
            Type::Array(_) => format!("an array ({self})"),
            Type::Struct(_) => format!("a struct ({self})"),
            Type::Int { .. } => format!("an integer ({self})"),
            _ => format!("a {self}"),
        }
    }

    /// The set that it is a member of.
    pub(super) fn scalar_set(&self) -> Option<u32> {
        match self {
            Type::Scalar { set, .. } => Some(*set),
            _ => None,
        }
    }

    /// Whether it is an integer or a truth value.
    pub(super) fn is_integral(&self) -> bool {
        matches!(self, Type::Int { .. } | Type::Bool)
    }

    /// Whether it is an integer, a truth value or a double.
    pub(super) fn is_number(&self) -> bool {
        self.is_integral() || *self == Type::Double
    }

    /// Whether a mistake was reported about it.
    pub(super) fn is_error(&self) -> bool {
        *self == Type::Error
    }

    /// Whether it is a clock.
    pub(super) fn is_clock(&self) -> bool {
        matches!(self, Type::Clock { .. })
    }

    /// Whether it is a clock or a channel: what has a name of its own in the network.
    pub(super) fn is_named_part(&self) -> bool {
        matches!(
            self,
            Type::Clock { .. } | Type::RealClock | Type::Channel { .. }
        )
    }

    /// Whether registers of doubles hold its values, and two words a value.
    pub(super) fn is_real(&self) -> bool {
        matches!(self, Type::Double | Type::RealClock)
    }

    /// Whether it is an integral type or a condition on clocks: what may stand as a condition.
    pub(super) fn is_condition(&self) -> bool {
        self.is_integral() || matches!(self, Type::Constraint(_))
    }

    /// Whether values lie in one register.
    pub(super) fn is_register(&self) -> bool {
        self.is_number() || matches!(self, Type::Scalar { .. } | Type::RealClock)
    }

    /// Whether it is an array or a struct.
    pub(super) fn is_aggregate(&self) -> bool {
        matches!(self, Type::Array(_) | Type::Struct(_))
    }

    /// Whether any part satisfies the condition.
    pub(super) fn any(&self, condition: &impl Fn(&Type) -> bool) -> bool {
        condition(self)
            || match self {
                Type::Array(array) => array.part.any(condition),
                Type::Struct(record) => record.fields.iter().any(|(_, ty)| ty.any(condition)),
                _ => false,
            }
    }

    /// Whether any part that a value has satisfies the condition: arrays without parts have none.
    pub(super) fn any_stored(&self, condition: &impl Fn(&Type) -> bool) -> bool {
        condition(self)
            || match self {
                Type::Array(array) => array.index.length > 0 && array.part.any_stored(condition),
                Type::Struct(record) => {
                    let mut fields = record.fields.iter();
                    fields.any(|(_, ty)| ty.any_stored(condition))
                }
                _ => false,
            }
    }

    /// The room that a value takes, or `None` if it is more than [`SIZE_LIMIT`] in any memory.
    pub(super) fn checked_size(&self) -> Option<Size> {
        let size = match self {
            Type::Array(array) => {
                let part = array.part.checked_size()?;
                let fits = |n: u32| u64::from(n) * u64::from(array.index.length) <= SIZE_LIMIT;
                if !(fits(part.words) && fits(part.clocks) && fits(part.channels)) {
                    return None;
                }
                part.times(array.index.length)
            }
            Type::Struct(record) => {
                let mut sum = Size::default();
                for (_, ty) in &record.fields {
                    sum = sum.plus(ty.checked_size()?);
                    let most = sum.words.max(sum.clocks).max(sum.channels);
                    if u64::from(most) > SIZE_LIMIT {
                        return None;
                    }
                }
                sum
            }
            _ => self.size(),
        };
        Some(size)
    }

    /// The room that a value takes; the type was checked with [`Type::checked_size`].
    pub(super) fn size(&self) -> Size {
        let one = |words, clocks, channels| Size {
            words,
            clocks,
            channels,
        };
        match self {
            Type::Int { .. } | Type::Bool | Type::Scalar { .. } => one(1, 0, 0),
            Type::Double => one(2, 0, 0),
            Type::RealClock => one(4, 0, 0),
            Type::Clock { .. } => one(0, 1, 0),
            Type::Channel { .. } => one(0, 0, 1),
            Type::Array(array) => array.part.size().times(array.index.length),
            Type::Struct(record) => record
                .fields
                .iter()
                .fold(Size::default(), |sum, (_, ty)| sum.plus(ty.size())),
            _ => Size::default(),
        }
    }

    /// Whether a value lies in words, be it in none of them.
    pub(super) fn has_words(&self) -> bool {
        let size = self.size();
        size.words > 0 || size.clocks + size.channels == 0
    }

    /// The values of an integer register of this type.
    pub(super) fn bounds(&self) -> (i32, i32) {
        match self {
            Type::Int { low, high } => (*low, *high),
            Type::Bool => (0, 1),
            Type::Scalar { size, .. } => (0, *size as i32 - 1),
            _ => (i32::MIN, i32::MAX),
        }
    }

    /// The value that an integer variable has without an initialiser: 0 where that is allowed.
    pub(super) fn default_value(&self) -> i32 {
        let (low, high) = self.bounds();
        if low <= 0 && 0 <= high { 0 } else { low }
    }

    /// The words of a value without an initialiser.
    pub(super) fn default_words(&self, words: &mut Vec<i32>) {
        match self {
            Type::Array(array) => {
                let start = words.len();
                array.part.default_words(words);
                let end = words.len();
                if array.index.length == 0 {
                    words.truncate(start);
                }
                for _ in 1..array.index.length {
                    words.extend_from_within(start..end);
                }
            }
            Type::Struct(record) => record
                .fields
                .iter()
                .for_each(|(_, ty)| ty.default_words(words)),
            Type::Double => words.extend([0, 0]),
            Type::RealClock => words.extend(Type::clock_words(0.0)),
            Type::Int { .. } | Type::Bool | Type::Scalar { .. } => {
                words.push(self.default_value());
            }
            _ => {}
        }
    }

    /// Whether the two are the same to a reference parameter.
    pub(super) fn is_equivalent(&self, other: &Type) -> bool {
        match (self, other) {
            (Type::Error, _) | (_, Type::Error) | (Type::Channel { .. }, Type::Channel { .. }) => {
                true
            }
            _ => {
                let parts = self.parts_agree(other, Type::is_equivalent);
                parts.unwrap_or_else(|| self == other)
            }
        }
    }

    /// Whether the parts of two arrays or of two structs are the same in number and agree; `None`
    /// for other types.
    fn parts_agree(&self, other: &Type, agree: fn(&Type, &Type) -> bool) -> Option<bool> {
        match (self, other) {
            (Type::Array(a), Type::Array(b)) => Some(a.index == b.index && agree(&a.part, &b.part)),
            (Type::Struct(a), Type::Struct(b)) => {
                let mut pairs = a.fields.iter().zip(&b.fields);
                let agree = pairs.all(|(a, b)| a.0 == b.0 && agree(&a.1, &b.1));
                Some(a.fields.len() == b.fields.len() && agree)
            }
            _ => None,
        }
    }

    /// The same with hybrid clocks for all clocks.
    pub(super) fn with_hybrid_clocks(&self) -> Type {
        match self {
            Type::Clock { .. } => Type::Clock { hybrid: true },
            Type::Array(array) if self.size().clocks > 0 => {
                let part = array.part.with_hybrid_clocks();
                let index = array.index;
                Type::Array(Arc::new(ArrayType { part, index }))
            }
            Type::Struct(record) if self.size().clocks > 0 => {
                let fields = record.fields.iter();
                let fields = fields.map(|(name, ty)| (name.clone(), ty.with_hybrid_clocks()));
                Type::Struct(Arc::new(StructType {
                    fields: fields.collect(),
                }))
            }
            _ => self.clone(),
        }
    }

    /// Whether every value of the other type, read word by word, is one of this type: ranges may be
    /// wider here.
    pub(super) fn holds(&self, other: &Type) -> bool {
        if let (Type::Int { low, high }, Type::Int { .. }) = (self, other) {
            let (least, greatest) = other.bounds();
            return *low <= least && greatest <= *high;
        }
        let parts = self.parts_agree(other, Type::holds);
        parts.unwrap_or_else(|| self.is_equivalent(other))
    }

    /// Whether values of the two types have the same parts, ranges apart.
    pub(super) fn has_parts_of(&self, other: &Type) -> bool {
        if let (Type::Int { .. }, Type::Int { .. }) = (self, other) {
            return true;
        }
        let parts = self.parts_agree(other, Type::has_parts_of);
        parts.unwrap_or_else(|| self.is_equivalent(other))
    }

    /// Whether the words are those of a value of this type; returns the rest.
    pub(super) fn split_value<'w>(&self, words: &'w [i32]) -> Option<&'w [i32]> {
        match self {
            Type::Array(array) => {
                (0..array.index.length).try_fold(words, |rest, _| array.part.split_value(rest))
            }
            Type::Struct(record) => record
                .fields
                .iter()
                .try_fold(words, |rest, (_, ty)| ty.split_value(rest)),
            _ => {
                let (low, high) = self.bounds();
                let (value, rest) = words.split_at_checked(self.size().words as usize)?;
                let fits = |&word: &i32| low <= word && word <= high;
                value.iter().all(fits).then_some(rest)
            }
        }
    }

    /// Whether a value of type `value` may be assigned to a variable of this type.
    pub(super) fn accepts(&self, value: &Type) -> bool {
        match (self, value) {
            (Type::Error, _) | (_, Type::Error) => true,
            (Type::Double | Type::RealClock, _) => value.is_number(),
            (Type::Clock { .. }, _) => {
                value.is_number() || value.is_clock() || *value == Type::ClockTerm
            }
            _ if self.is_integral() => value.is_integral(),
            _ => self.has_parts_of(value),
        }
    }

    fn channel_capability(&self) -> u32 {
        match self {
            Type::Channel { urgent: true, .. } => 0,
            Type::Channel {
                broadcast: true, ..
            } => 1,
            _ => 2,
        }
    }

    /// Whether a channel of type `argument` can do all that a parameter of this type promises.
    pub(super) fn accepts_channel(&self, argument: &Type) -> bool {
        match (self, argument) {
            (Type::Array(a), Type::Array(b)) => {
                a.index == b.index && a.part.accepts_channel(&b.part)
            }
            (Type::Channel { .. }, Type::Channel { .. }) => {
                argument.channel_capability() >= self.channel_capability()
            }
            _ => self.is_equivalent(argument),
        }
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Type::Error => f.write_str("an unknown type"),
            Type::Void => f.write_str("void"),
            Type::Int {
                low: i32::MIN,
                high: i32::MAX,
            } => f.write_str("int"),
            Type::Int { low, high } => write!(f, "int[{low},{high}]"),
            Type::Bool => f.write_str("bool"),
            Type::Double => f.write_str("double"),
            Type::String => f.write_str("string"),
            Type::Clock { hybrid: false } | Type::RealClock => f.write_str("clock"),
            Type::Clock { hybrid: true } => f.write_str("hybrid clock"),
            Type::Channel { urgent, broadcast } => {
                if *urgent {
                    f.write_str("urgent ")?;
                }
                if *broadcast {
                    f.write_str("broadcast ")?;
                }
                f.write_str("chan")
            }
            Type::Scalar { size, .. } => write!(f, "scalar[{size}]"),
            Type::Array(array) => {
                write!(f, "{}[", array.part)?;
                if array.index.first == 0 && array.index.set.is_none() {
                    write!(f, "{}]", array.index.length)
                } else if array.index.set.is_some() {
                    write!(f, "scalar[{}]]", array.index.length)
                } else {
                    write!(f, "int[{},{}]]", array.index.first, array.index.last())
                }
            }
            Type::Struct(record) => {
                f.write_str("struct {")?;
                for (name, ty) in &record.fields {
                    write!(f, " {ty} {name};")?;
                }
                f.write_str(" }")
            }
            Type::ClockTerm => f.write_str("a difference of clocks"),
            Type::Constraint(_) => f.write_str("a condition on clocks"),
        }
    }
}
