//! Which processes keep time from passing in a state for as long as they do not move.
//!
//! * A process in an urgent location, or in a committed one.
//! * A process in a location whose invariant bounds a clock from above, where all valuations have
//!   reached the bound.
//! * A process that takes part in a synchronisation on an urgent channel which is possible for all
//!   clock values.
//!
//! The last two can also end because of other processes: those that write what the invariant, or
//! the guards of the synchronisation, read. These processes are in conflict with the holder (see
//! [`crate::analysis::dependence`]).
//!
//! Where the rate of a clock may be 0, bounds of invariants do not count.

use crate::ir::{Location, Network, Urgency};
use crate::tuning::Tuning;
use crate::zones::{Bound, Zone};

use crate::analysis::dependence::Still;
use crate::network::Failure;
use crate::network::discrete::stepper::Stepper;
use crate::network::discrete::transition::{MoveRef, Moves};
use crate::network::symbolic::clock_effect::to_constraint;

/// A weak upper bound on some of several successive clocks, at least `low`.
#[derive(Clone, Copy, Debug)]
struct Limit {
    first: usize,
    count: usize,
    low: i32,
}

/// Why processes may keep time from passing, for each process and location.
#[derive(Debug)]
pub(super) struct Holders {
    urgencies: Vec<Vec<Urgency>>,
    limits: Vec<Vec<Vec<Limit>>>,
    has_urgent_channels: bool,
}

impl Holders {
    pub(super) fn new(network: &Network, tuning: Tuning) -> Holders {
        let processes = || network.processes.iter();
        let of_process = |locations: &[Location]| -> Vec<Vec<Limit>> {
            locations
                .iter()
                .map(|location| {
                    if network.features.stopwatches || !tuning.time_stoppers {
                        Vec::new()
                    } else {
                        limits(location)
                    }
                })
                .collect()
        };
        Holders {
            urgencies: processes()
                .map(|process| process.locations.iter().map(|one| one.urgency).collect())
                .collect(),
            limits: processes()
                .map(|process| of_process(&process.locations))
                .collect(),
            has_urgent_channels: tuning.time_stoppers
                && network.channels.iter().any(|channel| channel.urgent),
        }
    }

    /// Whether anything other than a committed location may keep time from passing.
    pub(super) fn are_possible(&self) -> bool {
        self.has_urgent_channels
            || self
                .limits
                .iter()
                .flatten()
                .any(|limits| !limits.is_empty())
            || self
                .urgencies
                .iter()
                .flatten()
                .any(|one| *one == Urgency::Urgent)
    }

    /// Notes for each process whether it keeps time from passing in a state with these words, zone
    /// and moves; returns why time stops. If some location is committed, only processes in
    /// committed locations count.
    pub(super) fn find(
        &self,
        stepper: &mut Stepper<'_>,
        words: &mut [i32],
        zone: &Zone,
        moves: &Moves,
        holds: &mut Vec<bool>,
    ) -> Result<Option<Still>, Failure> {
        holds.clear();
        holds.resize(self.urgencies.len(), false);
        let mut still = None;
        for (process, urgencies) in self.urgencies.iter().enumerate() {
            match urgencies[words[process] as usize] {
                Urgency::Committed => {
                    if still != Some(Still::Committed) {
                        holds.fill(false);
                    }
                    still = Some(Still::Committed);
                    holds[process] = true;
                }
                Urgency::Urgent if still != Some(Still::Committed) => {
                    still = Some(Still::Urgent);
                    holds[process] = true;
                }
                _ => {}
            }
        }
        if still == Some(Still::Committed) {
            return Ok(still);
        }
        for (process, limits) in self.limits.iter().enumerate() {
            let limits = &limits[words[process] as usize];
            if limits.iter().any(|limit| limit.may_be_reached(zone))
                && has_reached_limit(stepper, process, words, zone)?
            {
                still = Some(Still::Urgent);
                holds[process] = true;
            }
        }
        if self.has_urgent_channels {
            let is_urgent =
                |one: &MoveRef<'_>| one.is_unconditional() && stepper.is_urgent_move(*one);
            for part in moves.iter().filter(is_urgent).flat_map(|one| one.parts) {
                still = Some(Still::Urgent);
                holds[part.process as usize] = true;
            }
        }
        Ok(still)
    }
}

/// The weak upper bounds of single clocks in an invariant.
fn limits(location: &Location) -> Vec<Limit> {
    let atoms = location.invariant.atoms.iter();
    let bounds_clock = |atom: &&crate::ir::ClockAtom| {
        !atom.strict && atom.right.first.0 == 0 && atom.right.count == 1
    };
    let limits = atoms.filter(bounds_clock).map(|atom| Limit {
        first: atom.left.first.0 as usize,
        count: atom.left.count as usize,
        low: atom.low,
    });
    limits.collect()
}

impl Limit {
    /// Whether all valuations of the zone have reached a value that the bound may have.
    fn may_be_reached(self, zone: &Zone) -> bool {
        let mut clocks = self.first..self.first + self.count;
        clocks.any(|clock| clock != 0 && is_at_least(zone, clock, self.low))
    }
}

fn is_at_least(zone: &Zone, clock: usize, value: i32) -> bool {
    Bound::weak(value).is_some_and(|value| zone.bound(0, clock) + value <= Bound::LE_ZERO)
}

/// Whether all valuations of the zone have reached an upper bound that the invariant of a process
/// has now.
fn has_reached_limit(
    stepper: &mut Stepper<'_>,
    process: usize,
    words: &mut [i32],
    zone: &Zone,
) -> Result<bool, Failure> {
    let Some(emitted) = stepper.invariant_of(process, words)? else {
        return Ok(false);
    };
    for one in emitted {
        let one = to_constraint(one)?;
        let is_limit = one.right == 0 && one.left != 0 && !one.bound.is_strict();
        if is_limit && is_at_least(zone, one.left, one.bound.value()) {
            return Ok(true);
        }
    }
    Ok(false)
}
