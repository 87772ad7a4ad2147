//! The moments of a wait at which something may change.
//!
//! While time passes, a comparison of a running clock with a constant changes its truth only where
//! the clock meets the constant, and one of two running clocks never does. So what holds at the
//! moments where some clock meets some constant of the model or the query, at one moment between
//! each two of them, and at one after the last, holds at all moments. Among the constants are those
//! that a clock meets only through the update of a move: with `x = y + k` a comparison of x with c
//! is one of y with c - k; with `y = r` one of x - y with c is one of x with c + r.

use std::collections::BTreeSet;

use crate::ir::{AssignedValue, ClockAtom, Network, Predicate};

use super::moves::{Error, State};
use super::regions;

/// Values of an expression that are tried one by one; with more of them every integer counts as a
/// constant.
const MOST_VALUES: i64 = 4096;

/// The greatest number of moments of one wait that are checked.
const MOST_MOMENTS: usize = 1 << 20;

/// The constants that clocks meet.
#[derive(Clone, Debug)]
pub(super) struct Moments {
    constants: BTreeSet<i64>,
    /// Whether a running clock may be compared with one that stands still.
    compares_stopped: bool,
}

/// A stretch of a wait in which nothing changes: one moment, or all moments strictly between two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    /// The moment, or the one before, in ticks.
    pub(super) first: i64,
    /// The moment, or the one after; `None` forever.
    pub(super) last: Option<i64>,
    /// A moment of it.
    pub(super) moment: i64,
}

impl Stretch {
    /// Whether it is more than a moment.
    pub(super) fn is_open(&self) -> bool {
        self.last != Some(self.first)
    }
}

impl Moments {
    /// Those of some constants alone; `has_differences` is whether two clocks are compared.
    pub(super) fn of_constants(
        network: &Network,
        constants: BTreeSet<i64>,
        has_differences: bool,
    ) -> Moments {
        Moments {
            constants,
            compares_stopped: has_differences && network.features.stopwatches,
        }
    }

    /// The same with more constants.
    pub(super) fn with(&self, other: &Moments) -> Moments {
        Moments {
            constants: self.constants.union(&other.constants).copied().collect(),
            compares_stopped: self.compares_stopped || other.compares_stopped,
        }
    }

    /// Those of a network and of the comparisons of predicates; an error if a comparison has too
    /// many possible bounds.
    pub(super) fn new(network: &Network, predicates: &[&Predicate]) -> Result<Moments, Error> {
        let mut atoms = Vec::new();
        for predicate in predicates {
            collect(predicate, &mut atoms);
        }
        let has_differences = network.features.diagonals
            || atoms
                .iter()
                .any(|atom| atom.left.first.0 != 0 && atom.right.first.0 != 0);
        atoms.extend(regions::atoms(network).cloned());
        let mut constants = BTreeSet::new();
        for atom in atoms {
            let (low, high) = (i64::from(atom.low), i64::from(atom.high));
            if high - low > MOST_VALUES {
                return Err(Error::Unsupported("clock bounds with too many values"));
            }
            constants.extend((low..=high).flat_map(|value| [value, -value]));
        }
        let mut shifts = BTreeSet::new();
        for assignment in regions::assignments(network) {
            let (low, high, sign) = match assignment.value {
                AssignedValue::Clock(_, low, high) => (low, high, -1),
                AssignedValue::Integer(low, high) if has_differences => (low, high, 1),
                AssignedValue::Integer(..) => continue,
            };
            if i64::from(high) - i64::from(low) > MOST_VALUES {
                return Err(Error::Unsupported("clock assignments with too many values"));
            }
            shifts.extend((low..=high).map(|shift| sign * i64::from(shift)));
        }
        let plain: Vec<i64> = constants.iter().copied().collect();
        for shift in shifts {
            constants.extend(plain.iter().map(|constant| constant + shift));
        }
        if constants.len() > MOST_MOMENTS {
            return Err(Error::Unsupported("clock comparisons with too many values"));
        }
        Ok(Moments {
            constants,
            compares_stopped: has_differences && network.features.stopwatches,
        })
    }

    /// The stretches of a wait from a state, however long. Clock values must be even numbers of
    /// ticks; so are the ends then.
    pub(super) fn stretches(
        &self,
        state: &State,
        is_stopped: &[bool],
        ticks_per_unit: i64,
    ) -> Result<Vec<Stretch>, Error> {
        let moments = self.of(state, is_stopped, ticks_per_unit, None)?;
        // After the last change all is one stretch, and the last moment lies in it.
        let last = moments.len() - 1;
        let stretches = moments[..last].iter().enumerate().map(|(index, &moment)| {
            if index % 2 == 0 {
                Stretch {
                    first: moment,
                    last: Some(moment),
                    moment,
                }
            } else {
                let is_last = index + 1 == last;
                Stretch {
                    first: moments[index - 1],
                    last: (!is_last).then(|| moments[index + 1]),
                    moment: if is_last { moments[last] } else { moment },
                }
            }
        });
        Ok(stretches.collect())
    }

    /// The waits from a state that must be checked: 0, those at which something may change, one
    /// between each two of them, and the last one. Without a limit, nothing changes after the last
    /// one. All are in ticks; values and the limit must be even numbers of ticks.
    pub(super) fn of(
        &self,
        state: &State,
        is_stopped: &[bool],
        ticks_per_unit: i64,
        limit: Option<i64>,
    ) -> Result<Vec<i64>, Error> {
        if self.compares_stopped && is_stopped.contains(&true) {
            return Err(Error::Unsupported("differences with stopped clocks"));
        }
        let mut changes = BTreeSet::from([0]);
        for (value, _) in state.clocks[1..]
            .iter()
            .zip(&is_stopped[1..])
            .filter(|(_, stopped)| !**stopped)
        {
            for constant in &self.constants {
                let wait = constant * ticks_per_unit - value;
                if wait > 0 && limit.is_none_or(|limit| wait < limit) {
                    changes.insert(wait);
                }
            }
            if changes.len() > MOST_MOMENTS {
                return Err(Error::Unsupported("waits with too many moments"));
            }
        }
        let last = changes.last().copied().unwrap_or(0);
        changes.insert(limit.unwrap_or(last + ticks_per_unit));
        let changes: Vec<i64> = changes.into_iter().collect();
        let mut moments = Vec::with_capacity(2 * changes.len());
        for pair in changes.windows(2) {
            moments.extend([pair[0], i64::midpoint(pair[0], pair[1])]);
        }
        moments.extend(changes.last());
        Ok(moments)
    }
}

/// The clock comparisons of a predicate.
fn collect(predicate: &Predicate, atoms: &mut Vec<ClockAtom>) {
    match predicate {
        Predicate::Clock(clock) => atoms.push(ClockAtom {
            left: clock.left.clocks(),
            right: clock.right.clocks(),
            low: clock.range.0,
            high: clock.range.1,
            strict: clock.strict,
        }),
        Predicate::Not(inner) => collect(inner, atoms),
        Predicate::And(parts) | Predicate::Or(parts) => {
            for part in parts {
                collect(part, atoms);
            }
        }
        Predicate::Data(_)
        | Predicate::Constant(_)
        | Predicate::Location(..)
        | Predicate::Deadlock => {}
    }
}

/// The greatest constant, in absolute value, that predicates compare clocks with, and whether they
/// compare two clocks.
pub(super) fn constants(predicates: &[&Predicate]) -> (i64, bool) {
    let mut atoms = Vec::new();
    for predicate in predicates {
        collect(predicate, &mut atoms);
    }
    let greatest = atoms.iter().map(regions::greatest_constant).max();
    let has_differences = atoms
        .iter()
        .any(|atom| atom.left.first.0 != 0 && atom.right.first.0 != 0);
    (greatest.unwrap_or(0), has_differences)
}

/// Whether a predicate compares clocks or mentions `deadlock`: whether it may change while time
/// passes.
pub(super) fn depends_on_time(predicate: &Predicate) -> bool {
    match predicate {
        Predicate::Clock(_) | Predicate::Deadlock => true,
        Predicate::Not(inner) => depends_on_time(inner),
        Predicate::And(parts) | Predicate::Or(parts) => parts.iter().any(depends_on_time),
        Predicate::Data(_) | Predicate::Constant(_) | Predicate::Location(..) => false,
    }
}
