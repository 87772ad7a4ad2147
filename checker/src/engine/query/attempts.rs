//! Attempts to answer a query, as data: the cheap one is made first, and the next one if it is of
//! no use.

use crate::analysis::Abstraction;
use crate::game::Nodes;
use crate::game::backward::budget::Budget;
use crate::zones::wide;

/// The first result that is of use. The last attempt always counts.
///
/// # Panics
///
/// If there is no attempt.
pub(super) fn first_of_use<A: Copy, T>(
    attempts: &[A],
    mut make: impl FnMut(A) -> T,
    mut is_of_use: impl FnMut(A, &mut T) -> bool,
) -> T {
    let (&last, others) = attempts.split_last().expect("there is an attempt");
    // What one attempt forgets says nothing of the next.
    let mut make = |attempt| {
        wide::start();
        make(attempt)
    };
    for &attempt in others {
        let mut result = make(attempt);
        if is_of_use(attempt, &mut result) {
            return result;
        }
    }
    make(last)
}

/// In which zones a search is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Accuracy {
    /// In zones that may be too large: that there is nothing, they prove.
    Coarse,
    /// In zones that are right for what is asked.
    Exact,
}

/// One attempt to play a game.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attempt {
    /// How zones are abstracted.
    pub(super) abstraction: Abstraction,
    /// What the nodes of the graph are.
    pub(super) nodes: Nodes,
    /// What it may take before it is given up.
    pub(super) allowance: Option<Budget>,
    /// Which failure may be none of the game.
    pub(super) doubt: Doubt,
}

/// Which failure of an attempt may be none of the game, so that another attempt is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// None.
    Nothing,
    /// Any: it may lie in a state that no run reaches.
    AnyFailure,
    /// That bounds grow too large: another abstraction keeps them small.
    ClockRange,
}
