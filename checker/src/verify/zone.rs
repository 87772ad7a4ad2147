//! Convex sets of clock values, for checking certificates: plain and slow on purpose.
//!
//! A zone is a matrix of bounds on all differences. It shares nothing with the zones of the engine.
//! After every change it is closed by shortest paths: over the one bound that became tighter, or
//! over all.
//!
//! Invariant: the matrix is closed, or the zone is empty and marked so.

use crate::exec::EmittedAssignment;
use crate::ir::FixedConstraint;

/// `difference < value`, or `<=` if weak; ordered from tight to loose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Bounded {
    value: i64,
    is_weak: bool,
}

/// No limit.
const NONE: Bounded = Bounded {
    value: i64::MAX,
    is_weak: true,
};

const ZERO: Bounded = Bounded {
    value: 0,
    is_weak: true,
};

fn sum(one: Bounded, other: Bounded) -> Bounded {
    if one == NONE || other == NONE {
        return NONE;
    }
    Bounded {
        value: one.value + other.value,
        is_weak: one.is_weak && other.is_weak,
    }
}

/// A comparison `x_left - x_right ≺ bound` of clocks by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Comparison {
    pub(super) left: usize,
    pub(super) right: usize,
    pub(super) bound: i64,
    pub(super) is_strict: bool,
}

impl Comparison {
    fn limit(self) -> Bounded {
        Bounded {
            value: self.bound,
            is_weak: !self.is_strict,
        }
    }

    /// The comparison that holds where this one fails.
    pub(super) fn negated(self) -> Comparison {
        Comparison {
            left: self.right,
            right: self.left,
            bound: -self.bound,
            is_strict: !self.is_strict,
        }
    }

    /// What it says before the assignments if it is to hold after them.
    pub(super) fn before(self, assignments: &[EmittedAssignment]) -> Comparison {
        let mut one = self;
        for assignment in assignments.iter().rev() {
            let (target, source) = (assignment.target.0 as usize, assignment.source.0 as usize);
            let value = i64::from(assignment.value);
            if one.left == target {
                (one.left, one.bound) = (source, one.bound - value);
            }
            if one.right == target {
                (one.right, one.bound) = (source, one.bound + value);
            }
        }
        one
    }
}

impl From<&FixedConstraint> for Comparison {
    fn from(one: &FixedConstraint) -> Comparison {
        Comparison {
            left: one.left.0 as usize,
            right: one.right.0 as usize,
            bound: one.bound.into(),
            is_strict: one.strict,
        }
    }
}

/// Whether what a zone becomes while time passes is a zone when the clocks of `stopped` keep their
/// values: if none does, or if only one runs.
pub(super) fn is_exact(stopped: &[bool]) -> bool {
    let running = stopped.iter().skip(1).filter(|&&is_stopped| !is_stopped);
    !stopped.contains(&true) || running.count() <= 1
}

/// A convex set of clock values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Zone {
    clocks: usize,
    limits: Vec<Bounded>,
    is_empty: bool,
}

impl Zone {
    /// All values from 0; the number of clocks includes the reference clock.
    pub(super) fn universe(clocks: usize) -> Zone {
        let mut zone = Zone {
            clocks,
            limits: vec![NONE; clocks * clocks],
            is_empty: false,
        };
        for clock in 0..clocks {
            *zone.at(clock, clock) = ZERO;
            *zone.at(0, clock) = ZERO;
        }
        zone
    }

    fn at(&mut self, left: usize, right: usize) -> &mut Bounded {
        &mut self.limits[left * self.clocks + right]
    }

    fn get(&self, left: usize, right: usize) -> Bounded {
        self.limits[left * self.clocks + right]
    }

    /// Whether it contains no values.
    pub(super) fn is_empty(&self) -> bool {
        self.is_empty
    }

    /// Tightens every bound to the least sum over a third clock.
    fn close(&mut self) {
        for via in 0..self.clocks {
            for left in 0..self.clocks {
                for right in 0..self.clocks {
                    let detour = sum(self.get(left, via), self.get(via, right));
                    if detour < self.get(left, right) {
                        *self.at(left, right) = detour;
                    }
                }
            }
        }
        self.is_empty |= (0..self.clocks).any(|clock| self.get(clock, clock) < ZERO);
    }

    /// Tightens every bound by the least sum that goes through one bound that was made tighter in a
    /// closed zone.
    fn close_with(&mut self, one: Comparison) {
        for left in 0..self.clocks {
            let to = sum(self.get(left, one.left), self.get(one.left, one.right));
            if to == NONE {
                continue;
            }
            for right in 0..self.clocks {
                let detour = sum(to, self.get(one.right, right));
                if detour < self.get(left, right) {
                    *self.at(left, right) = detour;
                }
            }
        }
        self.is_empty |= (0..self.clocks).any(|clock| self.get(clock, clock) < ZERO);
    }

    /// The part in which all comparisons hold.
    pub(super) fn within(&self, comparisons: impl IntoIterator<Item = Comparison>) -> Zone {
        let mut part = self.clone();
        for one in comparisons {
            if part.is_empty {
                break;
            }
            if one.limit() < part.get(one.left, one.right) {
                *part.at(one.left, one.right) = one.limit();
                part.close_with(one);
            }
        }
        part
    }

    /// Whether a comparison holds everywhere in it.
    fn implies(&self, one: Comparison) -> bool {
        self.is_empty || self.get(one.left, one.right) <= one.limit()
    }

    /// The bounds that say something, as comparisons.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let mut found = Vec::new();
        for left in 0..self.clocks {
            for right in (0..self.clocks).filter(|&right| right != left) {
                let limit = self.get(left, right);
                if limit != NONE {
                    found.push(Comparison {
                        left,
                        right,
                        bound: limit.value,
                        is_strict: !limit.is_weak,
                    });
                }
            }
        }
        found
    }

    /// What both contain.
    pub(super) fn intersection(&self, other: &Zone) -> Zone {
        let mut both = self.within(other.comparisons());
        both.is_empty |= other.is_empty;
        both
    }

    /// What is left without the other zone: disjoint parts.
    pub(super) fn without(&self, other: &Zone) -> Vec<Zone> {
        let mut parts = Vec::new();
        if self.intersection(other).is_empty() {
            parts.extend((!self.is_empty).then(|| self.clone()));
            return parts;
        }
        let mut rest = self.clone();
        for one in other.comparisons() {
            if !rest.implies(one) {
                parts.push(rest.within([one.negated()]));
                rest = rest.within([one]);
            }
        }
        parts
    }

    /// Whether the others together contain it.
    pub(super) fn is_covered(&self, others: &[Zone]) -> bool {
        if self.is_empty {
            return true;
        }
        let Some((first, others)) = others.split_first() else {
            return false;
        };
        self.without(first)
            .iter()
            .all(|part| part.is_covered(others))
    }

    /// The zone after time has passed, while the clocks of `stopped` keep their values. It is exact
    /// where [`is_exact`] says so, and otherwise the least zone that contains the result.
    pub(super) fn future(&self, stopped: &[bool]) -> Zone {
        let mut later = self.clone();
        for clock in (1..self.clocks).filter(|&clock| !stopped[clock]) {
            // Against what stands still, a clock that runs gets ever greater.
            for still in (0..self.clocks).filter(|&still| still == 0 || stopped[still]) {
                *later.at(clock, still) = NONE;
            }
        }
        later.close();
        later
    }

    /// What becomes it while time passes and the clocks of `stopped` keep their values; where
    /// [`is_exact`] says so.
    pub(super) fn past(&self, stopped: &[bool]) -> Zone {
        let mut before = self.clone();
        for clock in (1..self.clocks).filter(|&clock| !stopped[clock]) {
            *before.at(0, clock) = ZERO;
            for still in (1..self.clocks).filter(|&still| stopped[still]) {
                *before.at(still, clock) = NONE;
            }
        }
        before.close();
        before
    }

    /// What it becomes by the assignments; what would make a clock negative is left out.
    pub(super) fn after(&self, assignments: &[EmittedAssignment]) -> Zone {
        let mut zone = self.clone();
        for one in assignments {
            let (target, source) = (one.target.0 as usize, one.source.0 as usize);
            let value = i64::from(one.value);
            // source + value >= 0
            zone = zone.within([Comparison {
                left: 0,
                right: source,
                bound: value,
                is_strict: false,
            }]);
            let shifted = |limit: Bounded, by: i64| match limit {
                NONE => NONE,
                _ => Bounded {
                    value: limit.value + by,
                    ..limit
                },
            };
            let before = zone.clone();
            for other in (0..self.clocks).filter(|&other| other != target) {
                *zone.at(target, other) = shifted(before.get(source, other), value);
                *zone.at(other, target) = shifted(before.get(other, source), -value);
            }
            zone.close();
        }
        zone
    }
}
