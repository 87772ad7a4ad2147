//! What the check of a file of evidence came to.

use crate::engine::answer::{Verification, holds};
use crate::ir::Network;

use super::strategy_check;

/// What the check of a file came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checked {
    /// Whether what the file claims is right; `None` if the check does not cover it.
    pub holds: Option<bool>,
    /// What was checked, or what is wrong, line by line.
    pub lines: Vec<String>,
}

impl Checked {
    /// What the check of a strategy came to.
    pub(crate) fn of_strategy(network: &Network, result: &Verification) -> Checked {
        Checked {
            holds: holds(result),
            lines: strategy_check::describe(network, result, None),
        }
    }

    /// The same; where the file holds, with a line that says what of it was not checked.
    #[must_use]
    pub(crate) fn without(mut self, unchecked: &str) -> Checked {
        if self.holds == Some(true) {
            self.lines.push(format!("  not checked: {unchecked}"));
        }
        self
    }
}

/// Why a file is not read.
pub(crate) type Unreadable = String;
