//! How a search for a reachable state works, and how it ends.

use crate::network::Failure;
use crate::search::limits::Counters;
use crate::search::outcome::{Outcome, Trace};

use super::tree::MOST_SHARDS;

/// The order in which states are explored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Order {
    /// Breadth first: traces are shortest in stored states.
    #[default]
    BreadthFirst,
    /// Depth first.
    DepthFirst,
    /// Depth first among the successors of a state in random order, from this seed.
    Random(u64),
}

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Manner {
    /// The order in which states are explored.
    pub order: Order,
    /// The number of threads that share the work, from 1 to [`MOST_THREADS`]. Only a breadth-first
    /// search has more than one.
    pub threads: usize,
}

/// The most threads of a search.
pub const MOST_THREADS: usize = MOST_SHARDS;

/// The end of a search.
#[derive(Debug)]
pub struct Report {
    /// What was found, or the failure and the path to the state whose exploration failed.
    pub outcome: Result<Outcome<Trace>, (Failure, Trace)>,
    /// What was done.
    pub counters: Counters,
}
