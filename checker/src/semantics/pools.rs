//! The slots for the instances of dynamic templates: see `dynamic`.

use std::sync::Arc;

use super::groups::Group;
use super::typed::{Place, Signature};
use super::types::Type;
use crate::ir::{FunctionId, LocationId};
use crate::syntax::ast::Name;

/// A dynamic template.
#[derive(Clone, Debug)]
pub(super) struct Dynamic {
    pub(super) name: Name,
    /// The function that makes an instance.
    pub(super) spawn: FunctionId,
    pub(super) signature: Arc<Signature>,
    /// The variable that counts the instances.
    pub(super) counter: Place,
    /// Its slots, once they are made.
    pub(super) slots: Option<Slots>,
    /// Whether a process of the system spawns it, as far as was seen.
    pub(super) is_spawned: bool,
}

/// The slots of a dynamic template.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    /// The first process, and how many there are.
    pub(super) first: u32,
    pub(super) count: u32,
    /// The first word of the variables of the first slot, and how many words a slot has; the same
    /// of `meta` variables.
    pub(super) words: (u32, u32),
    pub(super) meta_words: (u32, u32),
    /// Where the parameters lie in the first slot.
    pub(super) parameters: Vec<Place>,
    /// Where an instance begins, and where a slot is that is not in use.
    pub(super) initial: LocationId,
    pub(super) absent: LocationId,
}

impl Dynamic {
    /// A set of processes, numbered from 0.
    pub(super) fn group(&self) -> Group {
        let (first, count) = self
            .slots
            .as_ref()
            .map_or((0, 0), |one| (one.first, one.count));
        Group {
            first,
            parameters: vec![Type::below(count)],
        }
    }
}
