//! Random runs: how long they are, and what is asked of them.

use super::formulas::Formula;
use super::labels::Guard;

/// How long a run is.
#[derive(Clone, Debug)]
pub struct RunBound {
    /// What is limited.
    pub limit: RunLimit,
    /// To which value.
    pub value: f64,
    /// How many runs, if the query says it.
    pub runs: Option<u64>,
}

/// What limits a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunLimit {
    /// Time.
    Time,
    /// The clock with this first word.
    Clock(u32),
    /// The number of moves.
    Moves,
}

/// What is asked of a run. Conditions are masks (see [`super::Chances`]).
#[derive(Clone, Debug)]
pub enum Path {
    /// `<> p`
    Eventually(Guard),
    /// `[] p`
    Always(Guard),
    /// `p U q`
    Until(Guard, Guard),
    /// Any other formula over time.
    Formula(Formula),
}
