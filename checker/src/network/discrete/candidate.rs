//! The parts of moves: enabled edge instances, the receivers of a broadcast, and the participants.

use crate::ir::FixedConstraint;

use super::transition::Part;

/// One enabled edge instance: a process, an edge, its select values and its clock constraints.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) process: u32,
    pub(super) edge: u32,
    pub(super) select: u32,
    pub(super) is_controllable: bool,
    pub(super) constraints: (u32, u32),
}

impl Candidate {
    /// Its part in a move, with its first branch.
    pub(super) fn part(&self) -> Part {
        Part {
            process: self.process,
            edge: self.edge,
            branch: 0,
            select: self.select,
        }
    }
}

/// A receiving process of a broadcast: its candidates, and what it does in the current combination.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub(super) first: usize,
    pub(super) last: usize,
    /// One past the last pick.
    pub(super) end: usize,
    /// A candidate, or `last` for abstaining.
    pub(super) pick: usize,
    /// The number of moves that the choices before it stand for, by the branches of their edges.
    pub(super) before: u64,
    /// The number of moves that the groups after it stand for.
    pub(super) after: u64,
    /// The number of ways to choose: candidates and the branches of their edges.
    pub(super) ways: u64,
}

/// What a process does in a move that is being made.
#[derive(Clone, Copy, Debug)]
pub(super) enum Choice {
    /// It takes part with this candidate.
    Takes(u32),
    /// It abstains: none of these clock-guarded candidates holds.
    Abstains(u32, u32),
}

impl Group {
    /// How many choices there are.
    pub(super) fn picks(&self) -> u64 {
        (self.end - self.first) as u64
    }

    /// The same group for candidates that begin at another place.
    pub(super) fn starting_at(&self, first: usize) -> Group {
        Group {
            first,
            last: first + (self.last - self.first),
            end: first + (self.end - self.first),
            pick: first,
            ..*self
        }
    }

    /// Puts it before groups that stand for this many moves; returns how many moves they stand for
    /// with it.
    pub(super) fn put_before(&mut self, after: u64) -> u64 {
        self.after = after;
        after.saturating_mul(self.ways)
    }

    /// What it does in the current combination.
    pub(super) fn choice(&self) -> Choice {
        if self.pick < self.last {
            Choice::Takes(self.pick as u32)
        } else {
            Choice::Abstains(self.first as u32, self.last as u32)
        }
    }
}

/// The receivers of the channel that was sent on last.
#[derive(Debug, Default)]
pub(super) struct Audience {
    /// The state, by the stepper's count, and the channel; round 0 means none.
    pub(super) round: u64,
    pub(super) channel: u32,
    /// The candidates with their constraints; the first candidate is a sender's.
    pub(super) candidates: Vec<Candidate>,
    pub(super) constraints: Vec<FixedConstraint>,
    /// The groups of the receivers, in their order.
    pub(super) groups: Vec<Group>,
    /// The sender that was not asked what it receives.
    pub(super) left_out: Option<u32>,
}

impl Audience {
    /// The process of a group.
    pub(super) fn process_of(&self, group: &Group) -> u32 {
        self.candidates[group.first].process
    }
}
