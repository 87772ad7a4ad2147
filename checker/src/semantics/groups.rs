//! Sets of processes, and their members as queries name them.

use super::typed::Expr;
use super::types::Type;

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

/// A process, or one of a set that the state chooses.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub(super) group: Group,
    /// The arguments; none for a single process.
    pub(super) arguments: Vec<Expr>,
    /// Whether it is an instance of a dynamic template.
    pub(super) is_instance: bool,
}

impl Member {
    /// The instance of a dynamic template in the slot with this number.
    pub(super) fn of_instance(group: Group, number: Expr) -> Member {
        Member {
            group,
            arguments: vec![number],
            is_instance: true,
        }
    }
}
