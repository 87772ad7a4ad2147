//! What guards ask and updates do, where this is known without running code.

use super::code::Relation;
use super::ids::{ClockId, FunctionId};

/// A condition on words and clocks: a guard or an invariant. It holds if `function` returns 1, and
/// then on the clock values that satisfy `fixed` and all constraints that the function emitted.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent fact")]
pub struct Guard {
    /// Decides the part on the words and emits clock constraints ([`Instruction::Constrain`]);
    /// `None` is true. Its parameters are the edge's select values; it returns an integer.
    pub function: Option<FunctionId>,
    /// Clock constraints with constant bounds that hold whatever the words say.
    pub fixed: Vec<FixedConstraint>,
    /// Whether `function` may emit constraints.
    pub emits: bool,
    /// All clock comparisons in it that can matter, fixed ones included: for static analysis.
    pub atoms: Vec<ClockAtom>,
    /// Whether it is known to fail in every state, if it does not end in a run-time error.
    pub never_holds: bool,
    /// In the stochastic reading, where `function` returns a mask (see [`super::Chances`]): whether
    /// it leaves the time for which the mask stands.
    pub is_timed: bool,
    /// In the stochastic reading: whether it is not linear in time even where its clocks are.
    pub is_curved: bool,
    /// In the stochastic reading: the same condition in parts, where it compares clocks with
    /// numbers that do not change as time passes, and nothing else in it does.
    pub parts: Option<Box<GuardParts>>,
}

impl Guard {
    /// Whether it is the condition true.
    pub fn is_trivial(&self) -> bool {
        self.function.is_none() && self.fixed.is_empty()
    }
}

/// A condition as a conjunction: of one on words, and of comparisons of real clocks with numbers.
#[derive(Clone, Debug)]
pub struct GuardParts {
    /// Returns the mask of the condition on words; `None` is true. Its parameters are the edge's
    /// select values.
    pub on_words: Option<FunctionId>,
    /// The comparisons.
    pub comparisons: Vec<RealComparison>,
}

/// The comparison of a real clock with a number that does not change as time passes.
#[derive(Clone, Copy, Debug)]
pub struct RealComparison {
    /// The first word of the clock.
    pub clock: u32,
    /// How they relate; the clock stands at the left.
    pub relation: Relation,
    /// The number.
    pub bound: RealBound,
}

/// A number that does not change as time passes.
#[derive(Clone, Copy, Debug)]
pub enum RealBound {
    /// It is known.
    Constant(f64),
    /// The function leaves it as a double; its parameters are the edge's select values.
    Computed(FunctionId),
}

/// `left - right < bound`, or `<=` if not strict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
#[expect(missing_docs, reason = "the formula says it")]
pub struct FixedConstraint {
    pub left: ClockId,
    pub right: ClockId,
    pub bound: i32,
    pub strict: bool,
}

/// A comparison `left - right ≺ bound` as static analysis sees it: which clocks it may concern, and
/// how large the bound may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClockAtom {
    /// The clocks that may stand at the left (one, or all of an array indexed at run time), the
    /// reference clock included.
    pub left: ClockRange,
    /// The same at the right.
    pub right: ClockRange,
    /// The least value that the bound may take.
    pub low: i32,
    /// The greatest value that the bound may take.
    pub high: i32,
    /// Whether the comparison is strict.
    pub strict: bool,
}

impl From<FixedConstraint> for ClockAtom {
    fn from(fixed: FixedConstraint) -> ClockAtom {
        let (left, right) = (ClockRange::one(fixed.left), ClockRange::one(fixed.right));
        ClockAtom {
            strict: fixed.strict,
            ..ClockAtom::weak(left, right, fixed.bound, fixed.bound)
        }
    }
}

impl ClockAtom {
    /// `left - right <= bound`, for a bound from the least to the greatest value.
    pub fn weak(left: ClockRange, right: ClockRange, low: i32, high: i32) -> ClockAtom {
        ClockAtom {
            left,
            right,
            low,
            high,
            strict: false,
        }
    }

    /// Whether the comparison concerns two clocks.
    pub fn is_difference(&self) -> bool {
        self.left.has_clock() && self.right.has_clock()
    }

    /// Whether it is a strict upper bound of a clock, or of a difference.
    pub fn is_strict_upper(&self) -> bool {
        self.strict && self.left.has_clock()
    }

    /// Whether it is a strict lower bound of a clock.
    pub fn is_strict_lower(&self) -> bool {
        self.strict && !self.left.has_clock()
    }
}

/// Consecutive clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockRange {
    /// The first.
    pub first: ClockId,
    /// How many, at least 1.
    pub count: u32,
}

impl ClockRange {
    /// The reference clock.
    pub const REFERENCE: ClockRange = ClockRange::one(ClockId(0));

    /// One clock.
    pub const fn one(first: ClockId) -> ClockRange {
        ClockRange { first, count: 1 }
    }

    /// Whether there is another one than the reference clock.
    pub fn has_clock(self) -> bool {
        self.first.0 != 0 || self.count > 1
    }
}

/// What happens to words and clocks. First `function` runs; then the clocks of `fixed` are set.
#[derive(Clone, Debug, Default)]
pub struct Update {
    /// Changes words and emits clock assignments ([`Instruction::SetClock`],
    /// [`Instruction::CopyClock`]); `None` changes nothing.
    pub function: Option<FunctionId>,
    /// Clocks that are set to constants. Used only where the order against `function` does not
    /// matter.
    pub fixed: Vec<(ClockId, i32)>,
    /// Whether `function` may emit clock assignments.
    pub emits: bool,
    /// All assignments to clocks in it, fixed ones included: for static analysis.
    pub assignments: Vec<ClockAssignment>,
    /// The words that `function` may write, as ascending disjoint ranges (first, count); for static
    /// analysis.
    pub writes: Vec<(u32, u32)>,
}

/// An assignment to a clock as static analysis sees it.
#[derive(Clone, Debug)]
pub struct ClockAssignment {
    /// The clocks that may be assigned.
    pub target: ClockRange,
    /// What is assigned.
    pub value: AssignedValue,
}

/// What a clock is set to.
#[derive(Clone, Debug)]
pub enum AssignedValue {
    /// An integer between the two values.
    Integer(i32, i32),
    /// The value of one of these clocks plus an integer between the two values.
    Clock(ClockRange, i32, i32),
}
