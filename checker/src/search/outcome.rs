//! How searches end, and the runs that they find.

use crate::network::Part;
use crate::zones::Zone;

use super::limits::StopReason;

/// How a search ended.
#[derive(Debug)]
pub enum Outcome<T> {
    /// This was found.
    Found(T),
    /// There is none.
    Exhausted,
    /// A limit was reached first.
    Stopped(StopReason),
}

/// A move of a state: its rank.
pub(in crate::search) type Step = u64;

/// A symbolic run: states, and the moves between them (one less).
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Words and zone of each state.
    pub states: Vec<(Vec<i32>, Zone)>,
    /// The parts of each move.
    pub moves: Vec<Vec<Part>>,
}
