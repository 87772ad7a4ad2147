//! The variables that are left out, and why.

use std::collections::BTreeMap;

use rustc_hash::FxHashSet;

use crate::diagnostics::{Diagnostic, Span};
use crate::semantics::types::Type;

/// How many times a model is checked at most. If each double of a chain takes the value of the
/// next, a longer chain is refused.
pub(in crate::semantics) const MOST_ROUNDS: usize = 12;

/// Variables by the place of their declaration, each with the reason why ordinary variables could
/// not do.
pub(in crate::semantics) type Causes = BTreeMap<Span, Diagnostic>;

/// What is known of variables that are, or could be, left out.
#[derive(Debug, Default)]
pub(in crate::semantics) struct LeftOut {
    /// Those that are left out.
    pub(super) fixed: Causes,
    /// Those that would have to be.
    pub(super) candidates: Causes,
    /// The clocks that conditions depend on.
    pub(super) compared: FxHashSet<Span>,
    /// The warnings, if the model is accepted.
    pub(super) warnings: Vec<Diagnostic>,
}

impl LeftOut {
    /// With these variables left out.
    pub(in crate::semantics) fn of(fixed: Causes) -> LeftOut {
        LeftOut {
            fixed,
            ..LeftOut::default()
        }
    }

    /// What is left out.
    pub(in crate::semantics) fn into_fixed(self) -> Causes {
        self.fixed
    }

    /// What the next check leaves out; `None` if that is no more than this check.
    pub(in crate::semantics) fn next(&self) -> Option<Causes> {
        let mut next = self.fixed.clone();
        for (variable, cause) in &self.candidates {
            if !self.compared.contains(variable) {
                next.entry(*variable).or_insert_with(|| cause.clone());
            }
        }
        (next.len() > self.fixed.len()).then_some(next)
    }
}

/// The place of the declaration of a variable of this type, by which it can be left out.
pub(in crate::semantics) fn declared_at(ty: &Type, span: Span) -> Span {
    if holds_doubles_only(ty) || ty.size().clocks > 0 {
        span
    } else {
        Span::default()
    }
}

/// Whether a value of the type consists of doubles.
fn holds_doubles_only(ty: &Type) -> bool {
    match ty {
        Type::Double => true,
        Type::Array(array) => holds_doubles_only(&array.part),
        Type::Struct(record) => record.fields.iter().all(|(_, ty)| holds_doubles_only(ty)),
        _ => false,
    }
}
