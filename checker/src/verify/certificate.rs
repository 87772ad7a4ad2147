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

use crate::ir::{ClockId, FixedConstraint, Network, Predicate, Urgency};

use super::code::Combination;
use super::moves::{Error, Part};
use super::symbolic::{Possible, Symbolic, by_priority, guarded, without_all};
use super::zone::{Comparison, Zone, is_exact};

const MAY_LEAVE: &str =
    "waits that may lead out of it, with a clock that stands still beside two that run,";

/// The states with some words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct States {
    /// The words.
    pub words: Vec<i32>,
    /// The zones, each as constraints that all hold; values from 0 are understood.
    pub zones: Vec<Vec<FixedConstraint>>,
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
        symbolic: Symbolic::new(network),
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
    let is_clock = |clock: ClockId| (clock.0 as usize) < clocks;
    let mut locations = network.processes.iter().zip(&entry.words);
    let fits = entry.words.len() == network.layout.words as usize
        && locations.all(|(process, &location)| {
            usize::try_from(location).is_ok_and(|location| location < process.locations.len())
        })
        && entry
            .zones
            .iter()
            .flatten()
            .all(|one| is_clock(one.left) && is_clock(one.right) && one.left != one.right);
    fits.then(|| {
        let zones = entry.zones.iter().map(|constraints| {
            Zone::universe(clocks).within(constraints.iter().map(Comparison::from))
        });
        zones.collect()
    })
}

struct ClosureCheck<'a> {
    symbolic: Symbolic<'a>,
    zones: HashMap<&'a [i32], Vec<Zone>>,
    coverage: Coverage,
}

impl ClosureCheck<'_> {
    fn of(&self, words: &[i32]) -> &[Zone] {
        self.zones.get(words).map_or(&[], Vec::as_slice)
    }

    fn has_initial_state(&self) -> Result<bool, Error> {
        let words = &self.symbolic.network().initial;
        let Some(invariant) = self.symbolic.invariant(words)? else {
            return Err(Error::InitialInvariant);
        };
        let point = self.symbolic.initial().within(invariant);
        if point.is_empty() {
            return Err(Error::InitialInvariant);
        }
        Ok(point.is_covered(self.of(words)))
    }

    /// What is wrong with the states with these words.
    fn defect(&mut self, words: &[i32], avoided: &Predicate) -> Result<Option<Defect>, Error> {
        let Some(invariant) = self.symbolic.invariant(words)? else {
            // No state has these words: the zones stand for nothing, and claim nothing.
            return Ok(None);
        };
        let candidates = self.symbolic.candidates(words)?;
        let code = &self.symbolic.code;
        let is_urgent = (0..self.symbolic.network().processes.len())
            .any(|process| code.urgency(process, words) != Urgency::Normal);
        let stopped = code.stopped(words)?;
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
                zone.future(&stopped).within(invariant.iter().copied())
            };
            let combinations = self.symbolic.combinations(&candidates, words, &around)?;
            let urgent = combinations
                .iter()
                .filter(|one| self.symbolic.is_urgent(one));
            let barriers: Vec<Zone> = urgent
                .flat_map(|one| guarded(&one.guard, &one.excluded, &around))
                .collect();
            if !is_urgent {
                let futures = futures(&zone, &stopped, &barriers).into_iter();
                let futures = &mut futures.map(|later| later.within(invariant.iter().copied()));
                if !futures.all(|later| later.is_covered(&own)) {
                    let leaves = is_exact(&stopped).then_some(Defect::DelayLeaves);
                    return leaves.ok_or(Error::Unsupported(MAY_LEAVE)).map(Some);
                }
            }
            let possible = self.symbolic.possible(&combinations, words, &zone)?;
            let enabled = self.enabled(&possible);
            let state = Looked {
                words,
                enabled: &enabled,
                combinations: &combinations,
                around: &around,
                may_wait: !is_urgent,
                stopped: &stopped,
                barriers: &barriers,
            };
            let alive =
                |zone: &Zone| Ok(without_all(vec![zone.clone()], &self.alive(zone, &state)?));
            let met = self.symbolic.part(avoided, words, &zone, &alive)?;
            if met.iter().any(|part| !part.is_empty()) {
                return Ok(Some(Defect::Met));
            }
            self.coverage.moves += possible.len() as u64;
            let mut moves = possible.iter().zip(&enabled);
            if let Some((one, _)) = moves.find(|(one, enabled)| self.leaves(one, enabled)) {
                return Ok(Some(Defect::MoveLeaves(one.parts.clone())));
            }
        }
        Ok(None)
    }

    /// Whether a move leads out of the certificate from where it is possible.
    fn leaves(&self, one: &Possible, enabled: &[Zone]) -> bool {
        let states = self.of(&one.effect.target);
        let mut entered = enabled
            .iter()
            .map(|part| part.after(&one.effect.assignments));
        entered.any(|zone| !zone.is_covered(states))
    }

    /// Where moves are possible.
    fn enabled(&self, moves: &[Possible]) -> Vec<Vec<Zone>> {
        if self.symbolic.network().features.priorities {
            by_priority(moves)
        } else {
            moves.iter().map(|one| one.enabled.clone()).collect()
        }
    }

    /// From where in the zone a move is possible, now or after a wait.
    fn alive(&self, zone: &Zone, state: &Looked<'_>) -> Result<Vec<Zone>, Error> {
        let now = || state.enabled.iter().flatten().cloned().collect();
        if !state.may_wait {
            return Ok(now());
        }
        if !is_exact(state.stopped) {
            let alive: Vec<Zone> = now();
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
            return Ok(now());
        }
        // What is possible later need not be possible in the zone.
        let (combinations, around) = (state.combinations, state.around);
        let possible = self.symbolic.possible(combinations, state.words, around)?;
        let enabled = self.enabled(&possible).into_iter().flatten();
        Ok(enabled.map(|one| one.past(state.stopped)).collect())
    }
}

/// What is known about a zone in which a predicate is searched.
struct Looked<'l> {
    words: &'l [i32],
    /// Where moves are possible.
    enabled: &'l [Vec<Zone>],
    /// What words and guards make possible in the zone or after a wait.
    combinations: &'l [Combination],
    /// What can be waited for in the zone, and possibly more.
    around: &'l Zone,
    may_wait: bool,
    stopped: &'l [bool],
    barriers: &'l [Zone],
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
                if one.left() == 0 && !stopped[one.right()] {
                    let mut end = end.clone();
                    end.push(Comparison::new(one.right(), 0, -one.bound(), false));
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
        .map(|(start, end)| start.future(stopped).within(end.iter().copied()));
    futures.collect()
}
