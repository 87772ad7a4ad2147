//! What is explored when.
//!
//! All ways of exploring are sound, since what is not explored counts as an escape of the evader.
//! The plain way is the list of nodes that wait ([`waiting`]). For a verdict, parts are plugged in
//! that need less of the graph, and each can be switched off ([`crate::tuning`]): moves of the
//! evader in reserve where time does not pass ([`lazy_zero_time`]) and held back where it does
//! ([`lazy_safety`]), and looks at who may still win at all. They are asked at three points: for
//! the next node ([`next`]), when a node was expanded, and when one has gained something
//! ([`expanding`]).

pub(super) mod dead_ends;
pub(super) mod expanding;
pub(super) mod held_moves;
pub(super) mod lazy_safety;
pub(super) mod lazy_zero_time;
pub(super) mod next;
pub(super) mod reserve;
pub(super) mod schedule;
pub(super) mod waiting;

use crate::search::limits::StopReason;

use held_moves::HeldMoves;
use reserve::Reserve;
use schedule::Schedule;
use waiting::WaitingList;

/// What is explored, and what is not.
#[derive(Debug, Default)]
pub(super) struct Exploration {
    /// The nodes to be expanded.
    pub(super) waiting: WaitingList,
    /// What the evader may move to and does not need, if it is known.
    pub(super) reserve: Reserve,
    /// The moves that the evader holds back.
    pub(super) held: HeldMoves,
    /// By node, if it was looked at: whether the seeker may still win; see
    /// [`crate::game::backward::losing_untimed`].
    pub(super) may_win: Vec<bool>,
    /// How many states are explored when that is looked at again.
    pub(super) next_may_win: u64,
    /// When it is computed with zones what the seeker may still win.
    pub(super) schedule: Schedule,
}

impl Exploration {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        self.waiting.bytes() + self.reserve.bytes() + self.held.bytes() + self.may_win.len()
    }

    /// Makes room for one more node, which does not wait.
    pub(super) fn add_node(&mut self) {
        self.waiting.add_node();
        self.reserve.add_node();
        self.held.add_node();
    }

    /// Forgets all nodes, which are to be added again.
    pub(super) fn forget_nodes(&mut self) {
        self.waiting.forget_nodes();
        self.reserve.forget_nodes();
        self.held.forget_nodes();
    }
}

/// What was done in this turn of the solver before it explores.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) struct Turn {
    /// Whether no node waited when it began.
    pub(in crate::game) is_dry: bool,
    /// Whether all was computed.
    pub(in crate::game) is_computed: bool,
}

/// What comes next.
#[derive(Clone, Copy, Debug)]
pub(in crate::game) enum Next {
    /// This node is to be expanded.
    Expand(u32),
    /// There may be something to be computed first.
    Compute,
    /// Nothing: the seeker wins nothing that is not known.
    Nothing,
    /// A limit came first.
    Stopped(StopReason),
}
