//! Moves and predicates on sets of clock values, from the definitions: what
//! [`super::concrete`] says of single values.

use crate::cancellation;
use crate::exec::EmittedAssignment;
use crate::ir::{FixedConstraint, Network, Predicate};

use super::code::{Candidate, Code, Combination};
use super::moves::{Error, Part};
use super::zone::{Comparison, Zone};

/// A move from the states with some words.
pub(super) struct Possible {
    pub(super) parts: Vec<Part>,
    pub(super) channel: Option<u32>,
    /// The priority of its channel, then the greatest of its participants.
    pub(super) level: (u32, u32),
    /// The words after it, and what it assigns to clocks.
    pub(super) effect: Effect,
    /// Where its guards hold, every receiver that must take part does, and the invariants of the
    /// target hold after it.
    pub(super) enabled: Vec<Zone>,
}

/// What a move does.
pub(super) struct Effect {
    pub(super) target: Vec<i32>,
    pub(super) assignments: Vec<EmittedAssignment>,
    /// What must hold before it so that the invariants hold after it, and no clock is below 0.
    pub(super) needed: Vec<Comparison>,
}

/// The semantics of a network on sets of clock values.
pub(super) struct Symbolic<'a> {
    pub(super) code: Code<'a>,
    pub(super) clocks: usize,
}

impl<'a> Symbolic<'a> {
    /// The semantics of a network. The code must be that of the network.
    pub(super) fn new(network: &'a Network) -> Symbolic<'a> {
        Symbolic {
            code: Code::new(network),
            clocks: network.clocks.len().max(1),
        }
    }

    pub(super) fn network(&self) -> &'a Network {
        self.code.network()
    }

    /// What the invariants ask of the clocks; `None` if the words break one.
    pub(super) fn invariant(&self, words: &[i32]) -> Result<Option<Vec<Comparison>>, Error> {
        let invariants = self.code.invariants(words)?;
        Ok(invariants.map(|all| all.iter().map(Comparison::from).collect()))
    }

    /// The edges whose guards the words allow, by process.
    pub(super) fn candidates(&self, words: &[i32]) -> Result<Vec<Vec<Candidate>>, Error> {
        let processes = 0..self.network().processes.len();
        let candidates = processes.map(|process| self.code.candidates(process, words, &|_| true));
        candidates.collect()
    }

    /// The combinations of edges that words and guards make possible somewhere in a zone.
    pub(super) fn combinations(
        &self,
        candidates: &[Vec<Candidate>],
        words: &[i32],
        zone: &Zone,
    ) -> Result<Vec<Combination>, Error> {
        let is_possible = |guard: &[FixedConstraint], excluded: &[Vec<FixedConstraint>]| {
            !guarded(guard, excluded, zone).is_empty()
        };
        self.code.combinations(candidates, words, &is_possible)
    }

    /// Whether a combination synchronises on an urgent channel.
    pub(super) fn is_urgent(&self, one: &Combination) -> bool {
        let channels = &self.network().channels;
        one.channel
            .is_some_and(|channel| channels[channel as usize].urgent)
    }

    /// What a combination does; `None` if it breaks an invariant whatever the clocks are.
    pub(super) fn effect(&self, parts: &[Part], words: &[i32]) -> Result<Option<Effect>, Error> {
        let mut target = words.to_vec();
        let assignments = self.code.take(parts, &mut target)?;
        let Some(invariant) = self.invariant(&target)? else {
            return Ok(None);
        };
        let positive = assignments.iter().enumerate().map(|(index, assigned)| {
            let (source, value) = (assigned.source.0 as usize, assigned.value.into());
            Comparison::new(0, source, value, false).before(&assignments[..index])
        });
        let after = invariant.iter().map(|one| one.before(&assignments));
        let needed = after.chain(positive).collect();
        Ok(Some(Effect {
            target,
            assignments,
            needed,
        }))
    }

    /// The moves that are possible somewhere in the zone, priorities apart.
    pub(super) fn possible(
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
            let Some(effect) = self.effect(&one.parts, words)? else {
                continue;
            };
            found.push(Possible {
                parts: one.parts.clone(),
                channel: one.channel,
                level: self.code.level(&one.parts, one.channel),
                enabled: within_all(&guard, &effect.needed),
                effect,
            });
        }
        Ok(found)
    }

    /// Where in the zone a predicate holds; `deadlock` says where the predicate of this name does.
    pub(super) fn part(
        &self,
        predicate: &Predicate,
        words: &[i32],
        zone: &Zone,
        deadlock: &dyn Fn(&Zone) -> Result<Vec<Zone>, Error>,
    ) -> Result<Vec<Zone>, Error> {
        let all = || vec![zone.clone()];
        let all_if = |holds: bool| if holds { all() } else { Vec::new() };
        Ok(match predicate {
            Predicate::Data(function) => all_if(self.code.value(*function, words)? != 0),
            Predicate::Constant(value) => all_if(*value),
            Predicate::Location(process, location) => {
                all_if(words[process.0 as usize] == location.0 as i32)
            }
            Predicate::Clock(clock) => vec![zone.within([self.code.comparison(clock, words)?])],
            Predicate::Not(inner) => without_all(all(), &self.part(inner, words, zone, deadlock)?),
            Predicate::And(parts) => {
                let mut rest = all();
                for inner in parts {
                    let mut next = Vec::new();
                    for part in &rest {
                        next.extend(self.part(inner, words, part, deadlock)?);
                    }
                    rest = next;
                    rest.retain(|part| !part.is_empty());
                }
                rest
            }
            Predicate::Or(parts) => {
                let mut found = Vec::new();
                for inner in parts {
                    found.extend(self.part(inner, words, zone, deadlock)?);
                }
                found
            }
            Predicate::Deadlock => deadlock(zone)?,
        })
    }

    /// The clock values at the start.
    pub(super) fn initial(&self) -> Zone {
        let values = self.network().initial_clocks.iter().enumerate().skip(1);
        let point = values.flat_map(|(clock, &value)| {
            let value = i64::from(value);
            [
                Comparison::new(clock, 0, value, false),
                Comparison::new(0, clock, -value, false),
            ]
        });
        Zone::universe(self.clocks).within(point)
    }
}

/// Where the moves are possible, those of higher priority subtracted.
pub(super) fn by_priority(moves: &[Possible]) -> Vec<Vec<Zone>> {
    let enabled = moves.iter().map(|one| {
        let mut parts = one.enabled.clone();
        let above = moves.iter().filter(|other| other.level > one.level);
        for higher in above {
            parts = without_all(parts, &higher.enabled);
        }
        parts
    });
    enabled.collect()
}

/// The parts of zones in which all comparisons hold, without the empty ones.
pub(super) fn within_all(zones: &[Zone], comparisons: &[Comparison]) -> Vec<Zone> {
    let parts = zones.iter();
    let parts = parts.map(|zone| zone.within(comparisons.iter().copied()));
    parts.filter(|part| !part.is_empty()).collect()
}

/// The zones without those that others cover: the same set of states. Sets that are computed from
/// each other round after round would double each time otherwise.
pub(super) fn without_covered(zones: Vec<Zone>) -> Vec<Zone> {
    let mut kept: Vec<Zone> = Vec::new();
    for zone in zones {
        cancellation::work(kept.len() + 1);
        if !zone.is_covered(&kept) {
            kept.retain(|one| !one.is_covered(std::slice::from_ref(&zone)));
            kept.push(zone);
        }
    }
    kept
}

/// What is left of zones outside of others.
pub(super) fn without_all(zones: Vec<Zone>, others: &[Zone]) -> Vec<Zone> {
    let others = others.iter().filter(|other| !other.is_empty());
    without_conjunctions(zones, others.map(Zone::comparisons))
}

/// What is left of zones where none of the conjunctions holds.
pub(super) fn without_conjunctions<C: AsRef<[Comparison]>>(
    mut zones: Vec<Zone>,
    conjunctions: impl IntoIterator<Item = C>,
) -> Vec<Zone> {
    for one in conjunctions {
        if zones.is_empty() {
            break;
        }
        let rest = zones.iter();
        let rest = rest.flat_map(|zone| zone.without_conjunction(one.as_ref()));
        zones = rest.collect();
    }
    zones
}

/// The part of a zone in which the guards hold, and every receiver that must take part does.
pub(super) fn guarded(
    guard: &[FixedConstraint],
    excluded: &[Vec<FixedConstraint>],
    zone: &Zone,
) -> Vec<Zone> {
    let within = zone.within(guard.iter().map(Comparison::from));
    let mut parts = vec![within];
    parts.retain(|part| !part.is_empty());
    let excluded = excluded.iter();
    let excluded = excluded.map(|one| one.iter().map(Comparison::from).collect::<Vec<_>>());
    without_conjunctions(parts, excluded)
}
