//! When it is computed what the seeker may still win: see [`crate::game::backward::losing_timed`].

use crate::search::limits::StopReason;

/// How the game goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::game) enum LookAhead {
    /// The seeker cannot win any more.
    EvaderWins,
    /// It may win, and the evader uses more of its moves.
    Open,
    /// What it may win does not depend on anything that the evader holds back.
    Settled,
    /// A limit came first.
    Stopped(StopReason),
}

/// When prospects are computed.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::game) struct Schedule {
    /// How many states are to be explored before they are computed again.
    pub(in crate::game) next: u64,
    /// How many times as many as the next time.
    pub(in crate::game) growth: u64,
    /// Whether they are being computed, instead of what is won.
    pub(in crate::game) is_running: bool,
}
