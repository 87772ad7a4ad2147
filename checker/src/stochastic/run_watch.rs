//! Whoever watches runs as they are counted: sees what each of them shows, and may end them.

use super::run::Trajectory;

/// What a run shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// Whether it has what was asked, and what bounds the run when that was decided: the time, the
    /// value of a clock, or the number of moves.
    Decided {
        /// Whether it has what was asked.
        satisfied: bool,
        /// What bounds the run, when that was decided.
        at: f64,
    },
    /// The value of the run.
    Value(f64),
}

/// The result of a run that shows something.
pub(super) trait Shows {
    /// What it shows; `None` if that is nothing to count.
    fn shows(&self) -> Option<Shown> {
        None
    }
}

impl Shows for Shown {
    fn shows(&self) -> Option<Shown> {
        Some(*self)
    }
}

impl Shows for Trajectory {}

/// The value of a repetition, and its parts.
impl Shows for (f64, u64) {}

/// Whether the two runs of a pair have what was asked.
impl Shows for (bool, bool) {}

/// Watches runs.
pub trait RunWatch {
    /// Sees what a run shows; runs come in the order of their numbers.
    fn see(&mut self, shown: Shown);

    /// Returns whether to end; is asked now and then, with the number of runs so far.
    fn ends(&mut self, runs: u64) -> bool;
}

/// Sees nothing, and ends runs when a function says so.
pub(super) struct Ends<F>(pub(super) F);

impl<F: FnMut(u64) -> bool> RunWatch for Ends<F> {
    fn see(&mut self, _: Shown) {}

    fn ends(&mut self, runs: u64) -> bool {
        self.0(runs)
    }
}
