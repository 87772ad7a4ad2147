//! Where the objective holds in a state: whether the words decide it in a node.

use crate::network::{Extent, Failure};
use crate::zones::dbm::{self, Constraint};
use crate::zones::{ClockSet, Federation, Zone};

use super::graph::Graph;
use super::node::{Parts, Standing};
use super::urgent_nodes::Urgent;

impl Graph<'_, '_> {
    /// Evaluates the objective in a node again.
    pub(super) fn reevaluate(&mut self, node: u32) -> Result<(), Failure> {
        let mut words = self.words_of(node);
        let zone = Zone::from_bounds(self.dimension(), self.zone(node));
        let urgent = self.urgent.remove(&node);
        let standing = self.standing(node, &mut words, &zone, urgent.as_ref())?;
        self.nodes[node as usize].standing = standing;
        if let Some(urgent) = urgent {
            self.urgent.insert(node, urgent);
        }
        Ok(())
    }

    /// Evaluates the objective in a state that becomes the node `made`.
    pub(super) fn standing(
        &mut self,
        made: u32,
        words: &mut [i32],
        zone: &Zone,
        urgent: Option<&Urgent>,
    ) -> Result<Standing, Failure> {
        let (goal, keep) = self.extents(words, zone)?;
        match (goal, keep) {
            (Extent::Everywhere, _) => Ok(Standing::Goal),
            (Extent::Nowhere, Extent::Nowhere) => Ok(Standing::Broken),
            (Extent::Nowhere, _) if self.dead_ends.contain(words) => Ok(Standing::Dead),
            (Extent::Nowhere, Extent::Everywhere) => Ok(Standing::Open),
            (goal, keep) => {
                let dimension = self.dimension();
                let goal = goal.to_federation(zone.bounds(), dimension);
                let mut broken = Federation::of_zone(dimension, zone.bounds())
                    .minus(&keep.to_federation(zone.bounds(), dimension));
                broken.subtract(&goal);
                let mut goal = goal;
                if let Some(urgent) = urgent {
                    goal = goal.intersection(&urgent.reached);
                    broken = broken.intersection(&urgent.reached);
                    if urgent.reached.is_subset(&goal) {
                        return Ok(Standing::Goal);
                    }
                    if goal.is_empty() && broken.is_empty() {
                        return Ok(Standing::Open);
                    }
                    if goal.is_empty() && urgent.reached.is_subset(&broken) {
                        return Ok(Standing::Broken);
                    }
                }
                goal.shrink();
                broken.shrink();
                self.cut_bytes += goal.heap_bytes() + broken.heap_bytes();
                if let Some(old) = self.parts.insert(made, Parts { goal, broken }) {
                    self.cut_bytes -= old.goal.heap_bytes() + old.broken.heap_bytes();
                }
                Ok(Standing::Mixed)
            }
        }
    }

    /// Where the goal holds, and where what must be kept holds.
    pub(super) fn extents(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<(Extent, Extent), Failure> {
        let goal = match self.objective.goal {
            Some(goal) => self.symbolic.extent(goal, words, zone.bounds())?,
            None => Extent::Nowhere,
        };
        let keep = match self.objective.keep {
            Some(keep) => self.symbolic.extent(keep, words, zone.bounds())?,
            None => Extent::Everywhere,
        };
        self.in_time(words, zone, goal, keep)
    }

    /// Whether play continues: the goal holds nowhere in the state, nothing is broken, and it is
    /// not a dead end.
    pub(super) fn is_open(&mut self, words: &mut [i32], zone: &Zone) -> Result<bool, Failure> {
        if self.dead_ends.contain(words) {
            return Ok(false);
        }
        let extents = self.extents(words, zone)?;
        Ok(matches!(extents, (Extent::Nowhere, Extent::Everywhere)))
    }

    /// The parts of the extents of the goal, and of what must be kept, that lie before the
    /// deadline.
    pub(super) fn in_time(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
        goal: Extent,
        keep: Extent,
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

    /// Whether time may stop in a node. The end of play at the deadline does not count.
    pub(in crate::game) fn is_delay_bounded(&self, node: u32) -> bool {
        let mut others = ClockSet::default();
        if let Some(deadline) = self.objective.deadline {
            others.insert(deadline.clock);
        }
        dbm::is_delay_bounded(self.zone(node), self.dimension(), &others)
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
