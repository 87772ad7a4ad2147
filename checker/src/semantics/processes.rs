//! The processes of a network as queries name them.

use std::collections::HashMap;

use super::groups::Group;
use super::scope::Scope;

/// The processes of a network as queries name them.
#[derive(Debug, Default)]
pub(super) struct Processes {
    /// By the name in the system line.
    pub(super) groups: HashMap<String, Group>,
    /// The names that each process declares.
    pub(super) scopes: Vec<Scope>,
}
