//! Truth along a run, as it becomes known: positions, cuts between them, and what holds where.
//!
//! A run has *positions*: a state together with a moment at which it is the current one. Two states
//! can share a moment, that of the move between them, so positions are ordered by their moments,
//! and at one moment by the number of moves before them.
//!
//! Invariants:
//! * A [`Cut`] lies between positions, and each place between positions has one cut only: `order`
//!   is 0 before all positions of the moment, n before the state behind the n-th move if that is
//!   not the first of the moment, and [`AFTER`] behind all of them. So cuts are equal if there is
//!   nothing between them.
//! * Moments are whole multiples of 2^-32 of the unit. Bounds of operators are added to moments
//!   without rounding, and a moment that is reached by adding delays is the one that is meant in
//!   spite of rounding.

use std::collections::VecDeque;

/// Behind all positions of a moment.
pub(super) const AFTER: u64 = u64::MAX;

/// The parts of the unit of time that are told apart.
const PARTS: f64 = 4_294_967_296.0;

/// A moment, or a distance in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Moment(i128);

impl Moment {
    /// Later than all that happens: half of what fits, so that sums fit too.
    pub(super) const NEVER: Moment = Moment(i128::MAX / 4);

    pub(super) const ZERO: Moment = Moment(0);

    pub(super) fn new(time: f64) -> Moment {
        // The conversion saturates.
        Moment(((time * PARTS).round() as i128).min(Moment::NEVER.0))
    }

    pub(super) fn earlier_by(self, distance: Moment) -> Moment {
        Moment(self.0 - distance.0)
    }
}

/// A place between two positions of a run, or before or behind all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Cut {
    pub(super) moment: Moment,
    pub(super) order: u64,
}

impl Cut {
    pub(super) const START: Cut = Cut {
        moment: Moment::ZERO,
        order: 0,
    };

    /// Behind all positions of all runs.
    pub(super) const END: Cut = Cut {
        moment: Moment::NEVER,
        order: AFTER,
    };

    pub(super) fn before(moment: Moment) -> Cut {
        Cut { moment, order: 0 }
    }

    pub(super) fn after(moment: Moment) -> Cut {
        Cut {
            moment,
            order: AFTER,
        }
    }

    /// Whether what begins here has a position at the moment itself.
    pub(super) fn starts_at_moment(self) -> bool {
        self.order != AFTER
    }

    /// Whether what ends here has a position at the moment itself.
    pub(super) fn ends_at_moment(self) -> bool {
        self.order != 0
    }
}

/// What holds at all positions up to a cut, from the cut before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) end: Cut,
    pub(super) holds: bool,
}

/// The parts that were not used yet, in order; the first one begins where the last use ended.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    parts: VecDeque<Part>,
}

impl Parts {
    /// Adds what holds from the end of the last part to this cut.
    pub(super) fn push(&mut self, end: Cut, holds: bool) {
        match self.parts.back_mut() {
            Some(last) if last.end >= end => {}
            Some(last) if last.holds == holds => last.end = end,
            _ => self.parts.push_back(Part { end, holds }),
        }
    }

    /// The part behind this cut, if it is known.
    pub(super) fn behind(&mut self, cut: Cut) -> Option<Part> {
        while self.parts.front().is_some_and(|part| part.end <= cut) {
            self.parts.pop_front();
        }
        self.parts.front().copied()
    }
}
