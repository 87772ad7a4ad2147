//! When to compute what the seeker may still win: see [`crate::game::backward::losing_timed`].

use crate::search::limits::StopReason;

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

/// When prospects are computed.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::game) struct Schedule {
    /// The number of explored states at which they are computed again.
    pub(in crate::game) next: u64,
    /// The factor by which that number grows the next time.
    pub(in crate::game) growth: u64,
    /// Whether they are computed now, instead of what is won.
    pub(in crate::game) is_running: bool,
}
