//! Certificates: a set of states that contains all reachable ones and none that is asked about.
//!
//! A certificate is a list of words with zones. It is right if
//! * the initial state is in it;
//! * no time takes a state of it out of it: what each zone becomes within the invariants, up to
//!   where an urgent synchronisation stops time, lies in the zones of the same words;
//! * no move does: where a move is possible in a zone, what it becomes lies in the zones of the
//!   words after it;
//! * the predicate holds nowhere in it.
//!
//! Then no reachable state satisfies the predicate, whatever made the certificate: each point is
//! checked exactly, by subtracting zones from zones ([`super::zone`]). That the zones are larger
//! than what is reachable (extrapolation makes them so) does no harm as long as the four points
//! hold.
//!
//! Where a clock stands still while two others run, the future of a zone is no zone. If the least
//! zone around it lies in the zones of the same words, the check succeeds; otherwise that shows
//! nothing, and the check has no result. The same holds for deadlocks there, unless a move is
//! possible at once.
//!
//! Words are all words, `meta` variables included, whether or not a search takes states that differ
//! in them alone for the same. So what holds does so whichever of them are kept.
//!
//! Cost: for each zone and move, one zone minus all those of the words after it.

use std::collections::HashMap;

use crate::exec::EmittedAssignment;
use crate::ir::{ClockChoice, ClockId, FixedConstraint, Network, Predicate, Urgency};

use super::code::{Candidate, Code, Combination};
use super::moves::{Error, Part};
use super::strategy::Constraint;
use super::zone::{Comparison, Zone, is_exact};

/// The states with some words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct States {
    /// The words.
    pub words: Vec<i32>,
    /// The zones, each as constraints that all hold; values from 0 are understood.
    pub zones: Vec<Vec<Constraint>>,
}

/// What was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// Different words.
    pub words: u64,
    /// Zones.
    pub zones: u64,
    /// Moves from zones.
    pub moves: u64,
}

/// What is wrong with a certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Defect {
    /// The initial state is not in it.
    NoInitialState,
    /// Two entries have the same words.
    TwiceTheSame,
    /// An entry has words or clocks that the model has not.
    Malformed,
    /// Time takes a state out of it.
    DelayLeaves,
    /// A move takes a state out of it.
    MoveLeaves(Vec<Part>),
    /// The predicate holds in it.
    Met,
}

/// How a check ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The certificate is right.
    Verified(Coverage),
    /// It is not; the defect, and the words of the states that have it.
    Violated(Defect, Vec<i32>),
}

/// Checks that the certificate shows that no reachable state satisfies the predicate. The network
/// must hold its code.
pub fn verify(network: &Network, states: &[States], avoided: &Predicate) -> Result<Outcome, Error> {
    if network.features.stopwatches && network.features.clock_guarded_urgent {
        let what = "stopwatches beside clock guards on urgent channels";
        return Err(Error::Unsupported(what));
    }
    let clocks = network.clocks.len().max(1);
    let mut check = ClosureCheck {
        code: Code::new(network),
        clocks,
        zones: HashMap::new(),
        coverage: Coverage::default(),
    };
    for entry in states {
        let Some(zones) = zones(network, entry, clocks) else {
            return Ok(Outcome::Violated(Defect::Malformed, entry.words.clone()));
        };
        check.coverage.words += 1;
        check.coverage.zones += zones.len() as u64;
        if check.zones.insert(&entry.words, zones).is_some() {
            return Ok(Outcome::Violated(Defect::TwiceTheSame, entry.words.clone()));
        }
    }
    if !check.has_initial_state()? {
        let words = network.initial.clone();
        return Ok(Outcome::Violated(Defect::NoInitialState, words));
    }
    for entry in states {
        if let Some(defect) = check.defect(&entry.words, avoided)? {
            return Ok(Outcome::Violated(defect, entry.words.clone()));
        }
    }
    Ok(Outcome::Verified(check.coverage))
}

/// The zones of an entry; `None` if it does not fit the network.
fn zones(network: &Network, entry: &States, clocks: usize) -> Option<Vec<Zone>> {
    let mut locations = network.processes.iter().zip(&entry.words);
    let fits = entry.words.len() == network.layout.words as usize
        && locations.all(|(process, &location)| {
            usize::try_from(location).is_ok_and(|location| location < process.locations.len())
        })
        && entry
            .zones
            .iter()
            .flatten()
            .all(|one| one.left < clocks && one.right < clocks && one.left != one.right);
    fits.then(|| {
        let zones = entry.zones.iter().map(|constraints| {
            let comparisons = constraints.iter().map(|one| Comparison {
                left: one.left,
                right: one.right,
                bound: one.bound.into(),
                is_strict: one.strict,
            });
            Zone::universe(clocks).within(comparisons)
        });
        zones.collect()
    })
}

/// A move from some words, where only they decide.
struct Possible {
    parts: Vec<Part>,
    level: (u32, u32),
    target: Vec<i32>,
    assignments: Vec<EmittedAssignment>,
    /// Where its guards hold, every receiver that must take part does, and the invariants of the
    /// target hold after it.
    enabled: Vec<Zone>,
}

struct ClosureCheck<'a> {
    code: Code<'a>,
    clocks: usize,
    zones: HashMap<&'a [i32], Vec<Zone>>,
    coverage: Coverage,
}

impl ClosureCheck<'_> {
    fn of(&self, words: &[i32]) -> &[Zone] {
        self.zones.get(words).map_or(&[], Vec::as_slice)
    }

    fn has_initial_state(&self) -> Result<bool, Error> {
        let network = self.code.network();
        let values = network.initial_clocks.iter().enumerate().skip(1);
        let point = values.flat_map(|(clock, &value)| {
            let upper = Comparison {
                left: clock,
                right: 0,
                bound: value.into(),
                is_strict: false,
            };
            let lower = Comparison {
                left: 0,
                right: clock,
                bound: -i64::from(value),
                is_strict: false,
            };
            [upper, lower]
        });
        let Some(invariant) = self.invariant(&network.initial)? else {
            return Err(Error::InitialInvariant);
        };
        let point = Zone::universe(self.clocks).within(point).within(invariant);
        if point.is_empty() {
            return Err(Error::InitialInvariant);
        }
        Ok(point.is_covered(self.of(&network.initial)))
    }

    /// What the invariants ask of the clocks; `None` if the words break one.
    fn invariant(&self, words: &[i32]) -> Result<Option<Vec<Comparison>>, Error> {
        let invariants = self.code.invariants(words)?;
        Ok(invariants.map(|all| all.iter().map(Comparison::from).collect()))
    }

    /// What is wrong with the states with these words.
    fn defect(&mut self, words: &[i32], avoided: &Predicate) -> Result<Option<Defect>, Error> {
        let Some(invariant) = self.invariant(words)? else {
            // No state has these words: the zones stand for nothing, and claim nothing.
            return Ok(None);
        };
        let network = self.code.network();
        let mut candidates = Vec::new();
        for process in 0..network.processes.len() {
            candidates.push(self.code.candidates(process, words, &|_| true)?);
        }
        let is_urgent = (0..network.processes.len())
            .any(|process| self.code.urgency(process, words) != Urgency::Normal);
        let stopped = self.code.stopped(words)?;
        let own: Vec<Zone> = self.of(words).to_vec();
        for zone in &own {
            let zone = zone.within(invariant.iter().copied());
            if zone.is_empty() {
                continue;
            }
            // All that can be waited for, and possibly more.
            let around = if is_urgent {
                zone.clone()
            } else {
                within_all(&zone.future(&stopped), &invariant)
            };
            let (combinations, barriers) = self.combinations(&candidates, words, &around)?;
            if !is_urgent {
                for later in futures(&zone, &stopped, &barriers) {
                    let later = later.within(invariant.iter().copied());
                    if !later.is_covered(&own) {
                        let what = "waits that may lead out of it, with a clock that stands still beside two that run,";
                        return if is_exact(&stopped) {
                            Ok(Some(Defect::DelayLeaves))
                        } else {
                            Err(Error::Unsupported(what))
                        };
                    }
                }
            }
            let possible = self.possible(&combinations, words, &zone)?;
            let state = Looked {
                words,
                possible: &possible,
                combinations: &combinations,
                around: &around,
                may_wait: !is_urgent,
                stopped: &stopped,
                barriers: &barriers,
            };
            let met = self.part(avoided, &zone, &state)?;
            if met.iter().any(|part| !part.is_empty()) {
                return Ok(Some(Defect::Met));
            }
            for one in &possible {
                self.coverage.moves += 1;
                for part in &self.enabled(one, &possible) {
                    let entered = part.after(&one.assignments);
                    if !entered.is_covered(self.of(&one.target)) {
                        return Ok(Some(Defect::MoveLeaves(one.parts.clone())));
                    }
                }
            }
        }
        Ok(None)
    }

    /// The combinations of edges that words and guards make possible somewhere in a zone, and where
    /// an urgent combination stops time.
    fn combinations(
        &self,
        candidates: &[Vec<Candidate>],
        words: &[i32],
        zone: &Zone,
    ) -> Result<(Vec<Combination>, Vec<Zone>), Error> {
        let network = self.code.network();
        let is_possible = |guard: &[FixedConstraint], excluded: &[Vec<FixedConstraint>]| {
            !guarded(guard, excluded, zone).is_empty()
        };
        let combinations = self.code.combinations(candidates, words, &is_possible)?;
        let is_urgent = |channel: u32| network.channels[channel as usize].urgent;
        let urgent = combinations
            .iter()
            .filter(|one| one.channel.is_some_and(is_urgent));
        let barriers = urgent
            .flat_map(|one| guarded(&one.guard, &one.excluded, zone))
            .collect();
        Ok((combinations, barriers))
    }

    /// The moves that are possible somewhere in the zone, priorities apart.
    fn possible(
        &self,
        combinations: &[Combination],
        words: &[i32],
        zone: &Zone,
    ) -> Result<Vec<Possible>, Error> {
        let mut found = Vec::new();
        for one in combinations {
            let guard = guarded(&one.guard, &one.excluded, zone);
            if guard.is_empty() {
                continue;
            }
            let mut target = words.to_vec();
            let assignments = self.code.take(&one.parts, &mut target)?;
            let Some(invariant) = self.invariant(&target)? else {
                continue;
            };
            let positive = assignments.iter().enumerate().map(|(index, assigned)| {
                let at_least_zero = Comparison {
                    left: 0,
                    right: assigned.source.0 as usize,
                    bound: assigned.value.into(),
                    is_strict: false,
                };
                at_least_zero.before(&assignments[..index])
            });
            let before: Vec<Comparison> = invariant
                .iter()
                .map(|one| one.before(&assignments))
                .chain(positive)
                .collect();
            let enabled: Vec<Zone> = guard
                .iter()
                .map(|part| within_all(part, &before))
                .filter(|part| !part.is_empty())
                .collect();
            found.push(Possible {
                parts: one.parts.clone(),
                level: self.code.level(&one.parts, one.channel),
                target,
                assignments,
                enabled,
            });
        }
        Ok(found)
    }

    /// Where a move is possible, those of higher priority subtracted.
    fn enabled(&self, one: &Possible, all: &[Possible]) -> Vec<Zone> {
        let mut parts = one.enabled.clone();
        if self.code.network().features.priorities {
            let above = all.iter().filter(|other| other.level > one.level);
            for higher in above.flat_map(|other| &other.enabled) {
                parts = parts.iter().flat_map(|part| part.without(higher)).collect();
            }
        }
        parts
    }

    /// Where in the zone the predicate holds.
    fn part(
        &self,
        predicate: &Predicate,
        zone: &Zone,
        state: &Looked<'_>,
    ) -> Result<Vec<Zone>, Error> {
        let all = || vec![zone.clone()];
        let all_if = |holds: bool| if holds { all() } else { Vec::new() };
        Ok(match predicate {
            Predicate::Data(function) => all_if(self.code.value(*function, state.words)? != 0),
            Predicate::Constant(value) => all_if(*value),
            Predicate::Location(process, location) => {
                all_if(state.words[process.0 as usize] == location.0 as i32)
            }
            Predicate::Clock(clock) => {
                let one = Comparison {
                    left: self.clock(clock.left, state.words)?,
                    right: self.clock(clock.right, state.words)?,
                    bound: self.code.value(clock.bound, state.words)?.into(),
                    is_strict: clock.strict,
                };
                vec![within_all(zone, &[one])]
            }
            Predicate::Not(inner) => without_all(all(), &self.part(inner, zone, state)?),
            Predicate::And(parts) => {
                let mut rest = all();
                for inner in parts {
                    let mut next = Vec::new();
                    for part in &rest {
                        next.extend(self.part(inner, part, state)?);
                    }
                    rest = next;
                    rest.retain(|part| !part.is_empty());
                }
                rest
            }
            Predicate::Or(parts) => {
                let mut found = Vec::new();
                for inner in parts {
                    found.extend(self.part(inner, zone, state)?);
                }
                found
            }
            Predicate::Deadlock => without_all(all(), &self.alive(zone, state)?),
        })
    }

    /// From where in the zone a move is possible, now or after a wait.
    fn alive(&self, zone: &Zone, state: &Looked<'_>) -> Result<Vec<Zone>, Error> {
        let now = |possible: &[Possible]| -> Vec<Zone> {
            let parts = possible.iter().flat_map(|one| self.enabled(one, possible));
            parts.collect()
        };
        if !state.may_wait {
            return Ok(now(state.possible));
        }
        if !is_exact(state.stopped) {
            let alive = now(state.possible);
            return if zone.is_covered(&alive) {
                Ok(alive)
            } else {
                let what = "deadlocks with a clock that stands still beside two that run";
                Err(Error::Unsupported(what))
            };
        }
        if !state.barriers.is_empty() {
            if !zone.is_covered(state.barriers) {
                return Err(Error::Unsupported(
                    "deadlocks beside clock-guarded urgent channels",
                ));
            }
            return Ok(now(state.possible));
        }
        // What is possible later need not be possible in the zone.
        let possible = self.possible(state.combinations, state.words, state.around)?;
        let enabled = now(&possible);
        Ok(enabled.iter().map(|one| one.past(state.stopped)).collect())
    }

    fn clock(&self, choice: ClockChoice, words: &[i32]) -> Result<usize, Error> {
        let clock = match choice {
            ClockChoice::Fixed(ClockId(clock)) => clock,
            ClockChoice::Indexed(range, offset) => {
                range.first.0 + self.code.value(offset, words)? as u32
            }
        };
        Ok(clock as usize)
    }
}

/// What is known about a zone in which a predicate is searched.
struct Looked<'l> {
    words: &'l [i32],
    possible: &'l [Possible],
    /// What words and guards make possible in the zone or after a wait.
    combinations: &'l [Combination],
    /// What can be waited for in the zone, and possibly more.
    around: &'l Zone,
    may_wait: bool,
    stopped: &'l [bool],
    barriers: &'l [Zone],
}

/// The part in which all comparisons hold, those of a clock with itself included.
fn within_all(zone: &Zone, comparisons: &[Comparison]) -> Zone {
    zone.within(comparisons.iter().copied())
}

fn without_all(mut zones: Vec<Zone>, others: &[Zone]) -> Vec<Zone> {
    for other in others {
        zones = zones.iter().flat_map(|zone| zone.without(other)).collect();
    }
    zones
}

/// The part of a zone in which the guards hold, and every receiver that must take part does.
fn guarded(guard: &[FixedConstraint], excluded: &[Vec<FixedConstraint>], zone: &Zone) -> Vec<Zone> {
    let within = zone.within(guard.iter().map(Comparison::from));
    let mut parts = vec![within];
    parts.retain(|part| !part.is_empty());
    for conjunction in excluded {
        let excluded = zone.within(conjunction.iter().map(Comparison::from));
        parts = without_all(parts, std::slice::from_ref(&excluded));
    }
    parts
}

/// The future of a zone up to the barriers. Each stops time, so a wait ends before the barrier
/// begins or in its first moment, starts after its end, or never enters it. Clocks that stand still
/// must not occur together with barriers.
fn futures(zone: &Zone, stopped: &[bool], barriers: &[Zone]) -> Vec<Zone> {
    // Where a wait may start, and what holds at its end.
    let mut waits: Vec<(Zone, Vec<Comparison>)> = vec![(zone.clone(), Vec::new())];
    for barrier in barriers {
        let mut next = Vec::new();
        for (start, end) in &waits {
            for one in barrier.comparisons() {
                if one.left == 0 && !stopped[one.right] {
                    let mut end = end.clone();
                    end.push(Comparison {
                        left: one.right,
                        right: 0,
                        bound: -one.bound,
                        is_strict: false,
                    });
                    next.push((start.clone(), end));
                } else {
                    let start = start.within([one.negated()]);
                    if !start.is_empty() {
                        next.push((start, end.clone()));
                    }
                }
            }
        }
        waits = next;
    }
    let futures = waits
        .iter()
        .map(|(start, end)| within_all(&start.future(stopped), end));
    futures.collect()
}
