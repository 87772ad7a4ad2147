//! The processes of a network as queries name them.

use std::collections::HashMap;

use super::scope::Scope;
use super::types::Type;

/// The processes of a network as queries name them.
#[derive(Debug, Default)]
pub(super) struct Processes {
    /// By the name in the system line.
    pub(super) groups: HashMap<String, Group>,
    /// The names that each process declares.
    pub(super) scopes: Vec<Scope>,
}

/// What a name in the system line stands for.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The first process.
    pub(super) first: u32,
    /// The types of the free parameters; a single process has none.
    pub(super) parameters: Vec<Type>,
}

impl Group {
    /// How many processes it has.
    pub(super) fn count(&self) -> u32 {
        self.parameters.iter().map(parameter_count).product()
    }
}

/// How many values a parameter of this type can have.
pub(super) fn parameter_count(ty: &Type) -> u32 {
    let (low, high) = ty.bounds();
    if low > high {
        return 0;
    }
    high.abs_diff(low).saturating_add(1)
}
