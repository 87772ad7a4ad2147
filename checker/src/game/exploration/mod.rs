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
        self.waiting.bytes() + self.reserve.bytes() + self.held.bytes() + self.may_win.len()
    }

    /// Makes room for one more node, which does not wait.
    pub(super) fn add_node(&mut self) {
        self.waiting.add_node();
        self.reserve.add_node();
        self.held.add_node();
    }

    /// Forgets all nodes; they must be added again.
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
