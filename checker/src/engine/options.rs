//! How a query is to be answered: every option with its meaning and its default.

use std::path::PathBuf;

use super::limits::Limits;
use crate::game::{Forced, Nodes, Priorities};
use crate::ir::Overflow;
use crate::search::reachability::report::{MOST_THREADS, Manner, Order};
use crate::tuning::Tuning;

/// What runs the code of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum CodeEngine {
    /// Compiled by Cranelift.
    #[default]
    Jit,
    /// Interpreted: the reference.
    Interpreter,
}

/// Which trace to a state is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TraceWanted {
    /// The one that the search finds.
    #[default]
    Any,
    /// One with the fewest moves.
    Shortest,
    /// One that takes the least time.
    Fastest,
}

/// How a query is to be answered.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent wish")]
pub struct Options {
    /// In which order states are explored.
    pub order: Order,
    /// How many threads share the work, from 1 to [`MOST_THREADS`]. More than one share searches
    /// for a reachable state and for values, breadth first, and compute what is won in games; other
    /// searches take one.
    pub threads: usize,
    /// The rule for forced moves of the environment.
    pub forced: Forced,
    /// Whether priorities count in games and under strategies.
    pub priorities: Priorities,
    /// What the nodes of game graphs are.
    pub nodes: Nodes,
    /// What runs the code of the model.
    pub code: CodeEngine,
    /// When to give up.
    pub limits: Limits,
    /// At most how many plans are wanted; a single one is found without looking for the others.
    pub plans: Option<usize>,
    /// Whether a strategy is wanted.
    pub strategy: bool,
    /// Whether the strategy is to be checked in closed loop.
    pub verify: bool,
    /// Whether traces are to be timed exactly, and replayed.
    pub runs: bool,
    /// Where the files of `saveStrategy` and `loadStrategy` lie; `None` is the folder of the model.
    pub folder: Option<PathBuf>,
    /// Below which folders `saveStrategy` may write, beside the current one.
    pub allow_write: Vec<PathBuf>,
    /// Which trace to a state is wanted.
    pub trace: TraceWanted,
    /// Whether a certificate is wanted for the verdict that no reachable state is such.
    pub certificate: bool,
    /// What happens where results of integer arithmetic do not fit into 32 bits.
    pub overflow: Overflow,
    /// Whether a search may take states that differ only in which member of a scalar set is which
    /// for the same.
    pub symmetry: bool,
    /// Whether a search for a state need not take independent moves in every order where time
    /// stands still.
    pub partial_order: bool,
    /// Whether a search for states or values, and a game of which only the winner is asked, may
    /// take states for the same that differ only in variables that are not live.
    pub live_variables: bool,
    /// Which heuristics are used.
    pub tuning: Tuning,
}

impl Options {
    /// How searches are done that threads can share.
    pub(crate) fn manner(&self) -> Manner {
        Manner {
            order: self.order,
            threads: self.threads.clamp(1, MOST_THREADS),
        }
    }
}

impl Default for Options {
    fn default() -> Options {
        Options {
            order: Order::BreadthFirst,
            threads: 1,
            forced: Forced::default(),
            priorities: Priorities::default(),
            nodes: Nodes::default(),
            code: CodeEngine::default(),
            limits: Limits::default(),
            plans: None,
            strategy: false,
            verify: false,
            runs: false,
            folder: None,
            allow_write: Vec::new(),
            trace: TraceWanted::default(),
            certificate: false,
            overflow: Overflow::default(),
            symmetry: true,
            partial_order: true,
            live_variables: true,
            tuning: Tuning::default(),
        }
    }
}
