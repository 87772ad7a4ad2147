//! Which combinations of broadcast receivers are wanted. This is decided while they are made.
//!
//! Where n receivers have clock guards there are up to 2^n combinations of participants, and a zone
//! leaves most of them without a valuation. So a combination is given up at its first choice that
//! leaves nothing.
//!
//! Invariant: what a scope leaves out is impossible or not wanted; what it accepts may still be
//! impossible.

use crate::ir::FixedConstraint;
use crate::zones::dbm::{self, Constraint};
use crate::zones::{Bound, Federation};

use crate::network::symbolic::clock_effect::add_constraints;
use crate::network::{Failure, Part};

/// Which moves are wanted; a scope leaves out only combinations of a broadcast.
#[derive(Clone, Copy, Debug)]
pub(in crate::network) enum Scope<'z> {
    /// All.
    Everything,
    /// Those that are possible at some valuation of the zone.
    Within(&'z [Bound]),
    /// Those that are possible for all clock values.
    Unconditional,
    /// Those with these edges.
    Of(&'z [Part]),
}

/// A process that sends, and which moves with it are wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sending<'z> {
    pub(super) process: u32,
    /// Whether another process must leave a committed location.
    pub(super) needs_committed: bool,
    pub(super) scope: Scope<'z>,
}

/// A choice of a process in a broadcast, and what must hold for it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Demand<'c> {
    /// It takes part by this edge instance, whose guard emitted the constraints.
    Takes(Part, &'c [FixedConstraint]),
    /// This process abstains: the conjunction does not hold. Each of its candidates makes one such
    /// demand.
    Abstains(u32, &'c [FixedConstraint]),
}

/// Follows the choices of a combination under a scope. Holds the buffers.
#[derive(Debug)]
pub(super) struct BroadcastFilter {
    dimension: usize,
    /// The valuations at which all choices are possible, after each choice that took something
    /// away; for [`Scope::Within`].
    left: Vec<Federation>,
    /// For each choice: the index of the entry that counts after it. The first index is that of no
    /// choice.
    places: Vec<usize>,
    constraints: Vec<Constraint>,
    /// Whether clocks have decided anything since this was false.
    pub(super) has_narrowed: bool,
}

/// The part of valuations that a demand leaves.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Leaves {
    All,
    Nothing,
    Some,
}

impl BroadcastFilter {
    pub(super) fn new(dimension: usize) -> BroadcastFilter {
        BroadcastFilter {
            dimension,
            left: Vec::new(),
            places: Vec::new(),
            constraints: Vec::new(),
            has_narrowed: false,
        }
    }

    /// Begins a combination.
    pub(super) fn begin(&mut self, scope: Scope<'_>) {
        self.places.clear();
        if let Scope::Within(zone) = scope {
            self.grow(0);
            self.left[0].clear();
            self.left[0].push(zone);
            self.places.push(0);
        }
    }

    /// Makes a choice. Returns false, and chooses nothing, if the scope leaves out everything with
    /// it.
    pub(super) fn choose<'c>(
        &mut self,
        scope: Scope<'_>,
        demands: impl IntoIterator<Item = Demand<'c>>,
    ) -> Result<bool, Failure> {
        // If nothing is taken away, nothing is copied.
        let before = self.places.last().copied().unwrap_or_default();
        let mut place = before;
        for demand in demands {
            let passes = match scope {
                Scope::Everything => true,
                Scope::Unconditional => match demand {
                    Demand::Takes(_, constraints) => constraints.is_empty(),
                    Demand::Abstains(..) => false,
                },
                Scope::Of(parts) => match demand {
                    Demand::Takes(part, _) => parts.iter().any(|wanted| {
                        Part {
                            branch: 0,
                            ..*wanted
                        } == part
                    }),
                    Demand::Abstains(process, _) => {
                        parts.iter().all(|wanted| wanted.process != process)
                    }
                },
                Scope::Within(_) => match self.leaves(place, demand)? {
                    Leaves::All => true,
                    Leaves::Nothing => false,
                    Leaves::Some => {
                        if place == before {
                            place = before + 1;
                            self.grow(place);
                            let (before, after) = self.left.split_at_mut(place);
                            after[0].clone_from(&before[place - 1]);
                        }
                        self.narrow(place, demand)
                    }
                },
            };
            if !passes {
                return Ok(false);
            }
        }
        if matches!(scope, Scope::Within(_)) {
            self.places.push(place);
        }
        Ok(true)
    }

    /// Undoes the last choice.
    pub(super) fn take_back(&mut self) {
        self.places.pop();
    }

    /// The part of the current valuations that a demand leaves, where a glance shows it; reads its
    /// constraints.
    fn leaves(&mut self, place: usize, demand: Demand<'_>) -> Result<Leaves, Failure> {
        let (Demand::Takes(_, emitted) | Demand::Abstains(_, emitted)) = demand;
        self.has_narrowed |= !emitted.is_empty();
        // A conjunction in which a clock is less than itself never holds.
        let may_hold = add_constraints(emitted, &mut self.constraints)?;
        let mut zones = self.left[place].zones();
        let (zone, is_one) = (zones.next(), zones.next().is_none());
        let holds = match zone {
            _ if !may_hold => Leaves::Nothing,
            Some(zone) if is_one => part_within(zone, self.dimension, &self.constraints),
            _ => Leaves::Some,
        };
        Ok(match (demand, holds) {
            (Demand::Takes(..), holds) => holds,
            (Demand::Abstains(..), Leaves::All) => Leaves::Nothing,
            (Demand::Abstains(..), Leaves::Nothing) => Leaves::All,
            (Demand::Abstains(..), Leaves::Some) => Leaves::Some,
        })
    }

    /// Removes what the demand does not leave, after its constraints were read; returns whether
    /// something is left.
    fn narrow(&mut self, place: usize, demand: Demand<'_>) -> bool {
        let left = &mut self.left[place];
        match demand {
            Demand::Takes(..) => left.constrain_all(&self.constraints),
            Demand::Abstains(..) => left.subtract_conjunction(&self.constraints),
        }
        !left.is_empty()
    }

    fn grow(&mut self, place: usize) {
        if self.left.len() <= place {
            self.left.push(Federation::empty(self.dimension));
        }
    }
}

/// The part of a zone in which some constraints hold, where each constraint alone decides it.
fn part_within(zone: &[Bound], dimension: usize, constraints: &[Constraint]) -> Leaves {
    let mut part = Leaves::All;
    for one in constraints {
        if !dbm::satisfies(zone, dimension, one) {
            return Leaves::Nothing;
        }
        if zone[one.left * dimension + one.right] > one.bound {
            part = Leaves::Some;
        }
    }
    part
}
