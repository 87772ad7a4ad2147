//! Which nodes are explored, and in which order.
//!
//! All kinds of exploration are sound, since what is not explored counts as an escape of the
//! evader. The plain kind is the list of waiting nodes ([`waiting`]). For a verdict, other parts
//! are plugged in that need less of the graph. Each can be switched off ([`crate::tuning`]): moves
//! of the evader in reserve where time does not pass ([`lazy_zero_time`]), moves held back where it
//! does ([`lazy_safety`]), and the computation of who may still win at all. They are called at
//! three points: for the next node ([`next`]), when a node was expanded, and when a node has gained
//! something ([`expanding`]).

pub(super) mod dead_ends;
pub(super) mod expanding;
pub(super) mod held_moves;
pub(super) mod lazy_safety;
pub(super) mod lazy_zero_time;
pub(super) mod next;
pub(super) mod waiting;

use crate::search::limits::StopReason;

use held_moves::HeldMoves;
use waiting::WaitingList;

/// What is explored, and what is not.
#[derive(Debug, Default)]
pub(super) struct Exploration {
    /// The waiting list.
    pub(super) waiting: WaitingList,
    /// The moves of the evader that it is known not to need.
    pub(super) reserve: Reserve,
    /// The moves that the evader holds back.
    pub(super) held: HeldMoves,
    /// For each node that was checked: whether the seeker may still win; see
    /// [`crate::game::backward::losing_untimed`].
    pub(super) may_win: Vec<bool>,
    /// The number of explored states at the next such check.
    pub(super) next_may_win: u64,
    /// When to compute with zones what the seeker may still win.
    pub(super) schedule: Schedule,
}

impl Exploration {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        let marks = self.reserve.sources.len() + self.may_win.len();
        self.waiting.bytes() + self.held.bytes() + marks
    }

    /// Makes room for one more node, which does not wait.
    pub(super) fn add_node(&mut self) {
        self.waiting.add_node();
        self.reserve.sources.push(false);
        self.held.add_node();
    }

    /// Forgets all nodes; they must be added again.
    pub(super) fn forget_nodes(&mut self) {
        self.waiting.forget_nodes();
        self.reserve.sources.clear();
        self.held.forget_nodes();
    }
}

/// The nodes from which some moves of the evader are kept in reserve: see [`lazy_zero_time`].
#[derive(Debug, Default)]
pub(in crate::game) struct Reserve {
    /// Whether anything more is to be kept.
    pub(in crate::game) is_kept: bool,
    /// Whether anything was ever kept.
    pub(in crate::game) is_used: bool,
    /// For each node: whether it leads to something in reserve.
    sources: Vec<bool>,
    /// The number of nodes that were visited to find those in play.
    looks: u64,
}

/// When prospects are computed: see [`crate::game::backward::losing_timed`].
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::game) struct Schedule {
    /// The number of explored states at which they are computed again.
    pub(in crate::game) next: u64,
    /// The factor by which that number grows the next time.
    pub(in crate::game) growth: u64,
    /// Whether they are computed now, instead of what is won.
    pub(in crate::game) is_running: bool,
}

/// How the game continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::game) enum LookAhead {
    /// The seeker cannot win any more.
    EvaderWins,
    /// It may win, and the evader uses more of its moves.
    Open,
    /// What it may win does not depend on any held move.
    Settled,
    /// A limit came first.
    Stopped(StopReason),
}

/// What was done in this turn of the solver before it explores.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) struct Turn {
    /// Whether no node waited when it began.
    pub(in crate::game) is_dry: bool,
    /// Whether everything was computed.
    pub(in crate::game) is_computed: bool,
}

/// What comes next.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) enum Next {
    /// This node must be expanded.
    Expand(u32),
    /// There may be something to compute first.
    Compute,
    /// Nothing: the seeker wins nothing else.
    Nothing,
    /// A limit came first.
    Stopped(StopReason),
}
