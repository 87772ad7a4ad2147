//! Which combinations of broadcast receivers are wanted, decided while they are put together.
//!
//! Where n receivers have clock guards there are up to 2^n combinations of who takes part, and a zone leaves most of them without a
//! valuation. So a combination is given up with its first choice that leaves nothing.
//!
//! Invariant: what a scope leaves out is never possible, or not wanted; what it lets pass may still turn out to be impossible.

use crate::exec::EmittedConstraint;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation};

use super::symbolic::add_constraints;
use super::{Failure, Part};

/// Which moves are wanted; only combinations of a broadcast are left out.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scope<'z> {
    /// All.
    Everything,
    /// Those that are possible at some valuation of the zone.
    Within(&'z [Bound]),
    /// Those that are possible whatever the clocks say.
    Unconditional,
    /// Those with these edges.
    Of(&'z [Part]),
}

/// A choice of a process in a broadcast, with what must hold for it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Demand<'c> {
    /// It takes part by this edge instance, whose guard emitted the constraints.
    Takes(Part, &'c [EmittedConstraint]),
    /// This process abstains: the conjunction does not hold; asked for each of its candidates.
    Abstains(u32, &'c [EmittedConstraint]),
}

/// Follows the choices of a combination under a scope. Holds the buffers.
#[derive(Debug)]
pub(super) struct Sieve {
    dimension: usize,
    /// After each choice the valuations at which all choices are possible, for [`Scope::Within`].
    left: Vec<Federation>,
    /// How many of them count.
    depth: usize,
    constraints: Vec<Constraint>,
    /// Whether clocks have decided anything since this was false.
    pub(super) has_narrowed: bool,
}

impl Sieve {
    pub(super) fn new(dimension: usize) -> Sieve {
        Sieve {
            dimension,
            left: Vec::new(),
            depth: 0,
            constraints: Vec::new(),
            has_narrowed: false,
        }
    }

    /// Begins a combination.
    pub(super) fn begin(&mut self, scope: Scope<'_>) {
        self.depth = 0;
        if let Scope::Within(zone) = scope {
            self.grow();
            self.left[0].clear();
            self.left[0].push(zone);
            self.depth = 1;
        }
    }

    /// Makes a choice; returns false, with nothing chosen, if the scope leaves out everything with it.
    pub(super) fn choose<'c>(
        &mut self,
        scope: Scope<'_>,
        demands: impl IntoIterator<Item = Demand<'c>>,
    ) -> Result<bool, Failure> {
        if matches!(scope, Scope::Within(_)) {
            self.grow();
            let (before, after) = self.left.split_at_mut(self.depth);
            after[0].clone_from(&before[self.depth - 1]);
        }
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
                Scope::Within(_) => self.narrow(demand)?,
            };
            if !passes {
                return Ok(false);
            }
        }
        if matches!(scope, Scope::Within(_)) {
            self.depth += 1;
        }
        Ok(true)
    }

    /// Takes the last choice back.
    pub(super) fn take_back(&mut self) {
        self.depth = self.depth.saturating_sub(1);
    }

    fn narrow(&mut self, demand: Demand<'_>) -> Result<bool, Failure> {
        let left = &mut self.left[self.depth];
        let (Demand::Takes(_, emitted) | Demand::Abstains(_, emitted)) = demand;
        self.has_narrowed |= !emitted.is_empty();
        // A conjunction in which a clock is less than itself never holds.
        let may_hold = add_constraints(emitted, &mut self.constraints)?;
        match demand {
            Demand::Takes(..) if !may_hold => left.clear(),
            Demand::Takes(..) => left.constrain_all(&self.constraints),
            Demand::Abstains(..) if may_hold => left.subtract_conjunction(&self.constraints),
            Demand::Abstains(..) => {}
        }
        Ok(!left.is_empty())
    }

    fn grow(&mut self) {
        if self.left.len() <= self.depth {
            self.left.push(Federation::empty(self.dimension));
        }
    }
}
