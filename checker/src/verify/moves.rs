//! States and moves as values, and why there may be none.

use crate::exec::RunTimeError;

/// Why a state could not be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The model's code failed.
    RunTime(RunTimeError),
    /// The initial state breaks an invariant.
    InitialInvariant,
    /// The check needs something that is not supported here; the text names it.
    Unsupported(&'static str),
}

impl From<RunTimeError> for Error {
    fn from(error: RunTimeError) -> Error {
        Error::RunTime(error)
    }
}

/// A state: words and clock values in ticks, the reference clock first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct State {
    /// The words.
    pub words: Vec<i32>,
    /// The clock values in ticks.
    pub clocks: Vec<i64>,
}

/// One process's share in a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Part {
    /// Index of the process.
    pub process: u32,
    /// Index of the edge in its process.
    pub edge: u32,
    /// Index of the branch of the edge.
    pub branch: u32,
    /// Which combination of `select` values, the last binding fastest.
    pub select: u32,
}

/// A move: the parts of its participants, the sender (or the only process) first.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Move {
    /// The participants.
    pub parts: Vec<Part>,
    /// Whether the controller owns it: all participating edges are controllable.
    pub controllable: bool,
    /// The index of the channel of the synchronisation; `None` for an internal edge.
    pub channel: Option<u32>,
    /// Whether it synchronises on an urgent channel.
    pub is_urgent: bool,
    /// The priority of its channel, then the greatest of its participants.
    pub level: (u32, u32),
}
