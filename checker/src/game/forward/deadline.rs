//! Games in which the goal is to be reached in time.
//!
//! A clock that nothing sets measures the time. What is later than the deadline is lost for good,
//! so zones end there: no state past it is ever made.

use crate::ir::FunctionId;
use crate::network::{Extent, Failure};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, ClockSet, Zone};

use super::graph::Graph;

/// A limit on the time that play takes.
#[derive(Clone, Copy, Debug)]
pub struct Deadline {
    /// The clock that measures the time; nothing sets it.
    pub clock: usize,
    /// The limit.
    pub limit: i32,
    /// Whether the clock may start at any value up to the limit, so that the valuations of the
    /// initial node show how much time is needed; else it starts at 0.
    pub starts_anywhere: bool,
    /// How much time, at least, is still to be left in a state before the goal; a negative value
    /// counts as 0.
    pub rest: Option<FunctionId>,
}

impl Deadline {
    /// That the clock shows at most this.
    pub(super) fn until(&self, limit: i32) -> Result<Constraint, Failure> {
        Ok(Constraint {
            left: self.clock,
            right: 0,
            bound: Bound::weak(limit).ok_or(Failure::ClockLimit(limit))?,
        })
    }
}

impl Graph<'_, '_> {
    /// The parts of the extents of the goal, and of what must be kept, that are in time.
    pub(super) fn in_time(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
        (goal, keep): (Extent, Extent),
    ) -> Result<(Extent, Extent), Failure> {
        let Some(deadline) = self.objective.deadline else {
            return Ok((goal, keep));
        };
        let rest = match deadline.rest {
            Some(rest) => self.symbolic.stepper.evaluate(rest, words)?.max(0),
            None => 0,
        };
        let kept = deadline.until(deadline.limit.saturating_sub(rest))?;
        let keep = within(&keep, kept, zone);
        Ok((within(&goal, deadline.until(deadline.limit)?, zone), keep))
    }

    /// Whether time may come to a stop in a node: what the deadline ends goes on.
    pub(in crate::game) fn is_delay_bounded(&self, node: u32) -> bool {
        let mut others = ClockSet::default();
        if let Some(deadline) = self.objective.deadline {
            others.insert(deadline.clock);
        }
        crate::zones::dbm::is_delay_bounded(self.zone(node), self.dimension(), &others)
    }
}

/// The part of an extent that satisfies a constraint.
fn within(extent: &Extent, constraint: Constraint, zone: &Zone) -> Extent {
    let mut inside = zone.clone();
    if inside.constrain_all(&[constraint]) && inside == *zone {
        return extent.clone();
    }
    let mut part = extent.to_federation(zone.bounds(), zone.dimension());
    part.constrain_all(&[constraint]);
    if part.is_empty() {
        Extent::Nowhere
    } else {
        Extent::Part(part)
    }
}
