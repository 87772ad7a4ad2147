//! Conditions and numbers, as runs ask them.

use crate::ir::{FunctionId, Guard, Relation};

/// A condition, as it is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    /// It holds whatever happens.
    Always,
    /// It never holds.
    Never,
    /// It does not change as time passes; the function returns its mask.
    Words(FunctionId),
    /// It compares clocks with numbers that do not change as time passes; the number is that of the
    /// parts in the program.
    Compared(u32),
    /// It may change as time passes; the function returns its mask.
    Timed(FunctionId),
    /// It may change as time passes, and is not linear in time: it is only asked of the state as it
    /// is.
    Curved(FunctionId),
}

/// A number that does not change as time passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Number {
    Known(f64),
    /// The function leaves it.
    Computed(FunctionId),
}

/// A conjunction: a condition on words, and comparisons of clocks with numbers.
#[derive(Debug)]
pub(super) struct Comparisons {
    /// What does not change as time passes.
    pub(super) on_words: Condition,
    /// The first word of a clock, its relation to a number, and the number.
    pub(super) bounds: Box<[(u32, Relation, Number)]>,
    /// Returns the mask of all of it.
    pub(super) whole: FunctionId,
}

impl Condition {
    /// A condition of a query.
    pub(super) fn of(guard: &Guard) -> Condition {
        match guard.function {
            _ if guard.never_holds => Condition::Never,
            None => Condition::Always,
            Some(function) if guard.is_curved => Condition::Curved(function),
            Some(function) if guard.is_timed => Condition::Timed(function),
            Some(function) => Condition::Words(function),
        }
    }

    pub(super) fn is_timed(self) -> bool {
        matches!(
            self,
            Condition::Compared(_) | Condition::Timed(_) | Condition::Curved(_)
        )
    }
}
