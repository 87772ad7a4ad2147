//! How a query is answered: every option with its meaning and its default.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::limits::Limits;
use crate::game::{Forced, Nodes, Player, Priorities};
use crate::learning::Learning;
use crate::search::reachability::report::{MOST_THREADS, Manner, Order};
use crate::shield::Sampling;
use crate::stochastic::statistics::Interval;
use crate::stochastic::{Precision, RunSource, UnderChoice};
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

/// Whose strategy is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum StrategyWanted {
    /// That of the player who wins.
    #[default]
    Winner,
    /// That of the controller: none is made where it loses.
    Controller,
}

/// The rules by which games are played, and strategies checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Rules {
    /// The rule for forced moves of the environment.
    pub forced: Forced,
    /// Whether priorities count.
    pub priorities: Priorities,
}

/// Which reductions searches may make. Verdicts, values and traces do not depend on them; how many
/// states are stored does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reductions {
    /// Whether a search may take states that differ only in which member of a scalar set is which
    /// for the same.
    pub symmetry: bool,
    /// Whether a search for a state need not take independent moves in every order where time
    /// stands still.
    pub partial_order: bool,
    /// Whether a search for states or values, and a game of which only the winner is asked, may
    /// take states for the same that differ only in variables that are not live.
    pub live_variables: bool,
}

impl Reductions {
    /// All of them.
    pub const ALL: Reductions = Reductions {
        symmetry: true,
        partial_order: true,
        live_variables: true,
    };

    /// None of them.
    pub const NONE: Reductions = Reductions {
        symmetry: false,
        partial_order: false,
        live_variables: false,
    };

    /// Adds the reduction with this name; returns false if there is none.
    #[must_use]
    pub fn add(&mut self, name: &str) -> bool {
        match name {
            "symmetry" => self.symmetry = true,
            "partial-order" => self.partial_order = true,
            "live-variables" => self.live_variables = true,
            _ => return false,
        }
        true
    }
}

impl Default for Reductions {
    fn default() -> Reductions {
        Reductions::ALL
    }
}

/// What the runs of a statistical query say until now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunsSoFar {
    /// How many there are.
    pub runs: u64,
    /// The share of satisfied ones, or the mean of their values; no number if it is not known.
    pub estimate: f64,
    /// The interval of as many runs; no numbers if too few give none.
    pub interval: Interval,
}

/// Is shown now and then what runs say until now.
#[derive(Clone)]
pub struct RunObserver(pub Arc<dyn Fn(&RunsSoFar) + Send + Sync>);

impl std::fmt::Debug for RunObserver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("RunObserver")
    }
}

/// How the rare event of a query for a probability is looked for: by importance splitting.
#[derive(Clone, Debug)]
pub struct RareEvent {
    /// An expression of the state that says how near it is to the event.
    pub levels: String,
    /// How many parts of runs each stage has.
    pub effort: u64,
    /// How many independent repetitions the interval is made of.
    pub repetitions: u64,
}

/// How a query is answered.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent wish")]
pub struct Options {
    /// In which order states are explored.
    pub order: Order,
    /// An integer expression on the words: games explore first where its value is least.
    pub guide: Option<String>,
    /// How many threads share the work, at most [`MOST_THREADS`]; 0 counts as 1. More than one
    /// share searches for a reachable state and for values, breadth first, and compute what is won
    /// in games; other searches take one.
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
    /// How rare events are looked for; `None` is by plain runs.
    pub rare: Option<RareEvent>,
    /// At most how many plans are wanted; a single one is found without looking for the others.
    pub plans: Option<usize>,
    /// Whether a strategy is wanted.
    pub strategy: bool,
    /// Whose strategy is made; with `verify` the winner's in any case.
    pub wanted_strategy: StrategyWanted,
    /// Whether the strategy is checked in closed loop.
    pub verify: bool,
    /// Whether traces get exact times and are replayed.
    pub runs: bool,
    /// Where the files of `saveStrategy` and `loadStrategy` lie; `None` is the folder of the model.
    pub folder: Option<PathBuf>,
    /// The folders below which `saveStrategy` may write; it may always write below the current one.
    pub allow_write: Vec<PathBuf>,
    /// Which trace to a state is wanted.
    pub trace: TraceWanted,
    /// Whether a certificate is wanted for the verdict that no reachable state is such.
    pub certificate: bool,
    /// Which reductions searches may make.
    pub reductions: Reductions,
    /// Which heuristics are used.
    pub tuning: Tuning,
    /// What statistical queries promise; [`Options::threads`] counts for them too.
    pub precision: Precision,
    /// How strategies are learned; the seed and the threads are those of all runs.
    pub learning: Learning,
    /// How shields are sampled; the seed and the threads are those of all runs.
    pub shield: Sampling,
    /// When the controller moves in random runs where a strategy lets it choose.
    pub under_choice: UnderChoice,
    /// Sees what the runs of a statistical query say while they are made.
    pub run_observer: Option<RunObserver>,
    /// Where the results of random runs come from, if they are made elsewhere. `simulate`,
    /// importance splitting and queries that are answered together make their runs here.
    pub run_source: Option<RunSource>,
    /// Only the results of runs with these numbers are wanted, for whoever answers the query.
    pub only_runs: Option<Range<u64>>,
}

impl Options {
    /// The rules of games.
    pub fn rules(&self) -> Rules {
        Rules {
            forced: self.forced,
            priorities: self.priorities,
        }
    }

    /// The same with the time that is left if work began at this moment.
    pub(crate) fn left_since(&self, start: Instant) -> Options {
        Options {
            limits: self.limits.left_since(start),
            ..self.clone()
        }
    }

    /// Whether a strategy is wanted if this player wins.
    pub(crate) fn want_strategy_of(&self, winner: Player) -> bool {
        let is_made = match self.wanted_strategy {
            StrategyWanted::Winner => true,
            StrategyWanted::Controller => winner == Player::Controller,
        };
        self.verify || self.strategy && is_made
    }

    /// How many threads share the work, at least one.
    pub(crate) fn thread_count(&self) -> usize {
        self.threads.clamp(1, MOST_THREADS)
    }

    /// How searches are done that threads can share.
    pub(crate) fn manner(&self) -> Manner {
        Manner {
            order: self.order,
            threads: self.thread_count(),
        }
    }
}
