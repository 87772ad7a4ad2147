//! State predicates of queries on symbolic states.
//!
//! The extent of a predicate in a state is the part of the zone in which it holds. Predicates
//! without clocks hold in all of it or in none, and cost no zone operation.

use crate::ir::{ClockAtom, ClockChoice, ClockId, ClockPredicate, FunctionId, Network, Predicate};
use crate::zones::{Bound, Federation, Zone};

use crate::network::{Failure, Symbolic};

/// Where in a zone a predicate holds.
#[derive(Clone, Debug)]
pub enum Extent {
    /// Nowhere.
    Nowhere,
    /// Everywhere.
    Everywhere,
    /// In this part, which is neither empty nor the whole zone.
    Part(Federation),
}

impl Extent {
    pub(super) fn of(part: Federation, zone: &Federation) -> Extent {
        if part.is_empty() {
            Extent::Nowhere
        } else if zone.is_subset(&part) {
            Extent::Everywhere
        } else {
            Extent::Part(part)
        }
    }

    fn negated(self, zone: &Federation) -> Extent {
        match self {
            Extent::Nowhere => Extent::Everywhere,
            Extent::Everywhere => Extent::Nowhere,
            Extent::Part(part) => Extent::of(difference(zone, &part), zone),
        }
    }

    /// Whether it holds somewhere.
    pub fn is_somewhere(&self) -> bool {
        !matches!(self, Extent::Nowhere)
    }

    /// The part of the zone as a federation.
    pub fn to_federation(&self, zone: &[Bound], dimension: usize) -> Federation {
        match self {
            Extent::Nowhere => Federation::empty(dimension),
            Extent::Everywhere => Federation::of_zone(dimension, zone),
            Extent::Part(part) => part.clone(),
        }
    }
}

impl Symbolic<'_> {
    /// Where in the zone the predicate holds.
    pub fn extent(
        &mut self,
        predicate: &Predicate,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        match predicate {
            Predicate::Constant(value) => Ok(everywhere_if(*value)),
            Predicate::Data(function) => {
                Ok(everywhere_if(self.stepper.evaluate(*function, words)? != 0))
            }
            Predicate::Location(process, location) => Ok(everywhere_if(
                words[process.0 as usize] == location.0 as i32,
            )),
            Predicate::Not(inner) => {
                let extent = self.extent(inner, words, zone)?;
                Ok(match extent {
                    Extent::Part(_) => extent.negated(&self.whole(zone)),
                    Extent::Nowhere => Extent::Everywhere,
                    Extent::Everywhere => Extent::Nowhere,
                })
            }
            Predicate::And(parts) => self.conjunction(parts, words, zone),
            Predicate::Or(parts) => self.disjunction(parts, words, zone),
            Predicate::Clock(clock) => self.clock_extent(clock, words, zone),
            Predicate::Deadlock => self.deadlock_extent(words, zone),
        }
    }

    /// Whether the predicate holds somewhere in the zone: what [`Symbolic::extent`] says, without
    /// computing where if that is dear.
    pub fn holds_somewhere(
        &mut self,
        predicate: &Predicate,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<bool, Failure> {
        match predicate {
            Predicate::Deadlock => self.has_deadlock(words, zone),
            Predicate::Not(inner) if let Predicate::Not(inner) = &**inner => {
                self.holds_somewhere(inner, words, zone)
            }
            Predicate::Or(parts) => {
                for part in parts {
                    if self.holds_somewhere(part, words, zone)? {
                        return Ok(true);
                    }
                }
                Ok(false)
            }
            Predicate::And(parts) => {
                // Locations come before deadlocks. Code that may fail is run in its place.
                let said = parts.iter().map_while(|part| match part {
                    Predicate::Deadlock => Some(true),
                    _ => decided_by_locations(part, words),
                });
                if said.into_iter().any(|holds| !holds) {
                    return Ok(false);
                }
                if parts.iter().filter(|part| !part.is_of_words()).count() > 1 {
                    return Ok(self.conjunction(parts, words, zone)?.is_somewhere());
                }
                for part in parts {
                    if !self.holds_somewhere(part, words, zone)? {
                        return Ok(false);
                    }
                }
                Ok(true)
            }
            _ => Ok(self.extent(predicate, words, zone)?.is_somewhere()),
        }
    }

    fn whole(&self, zone: &[Bound]) -> Federation {
        Federation::of_zone(self.dimension(), zone)
    }

    fn conjunction(
        &mut self,
        parts: &[Predicate],
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        let mut result: Option<Federation> = None;
        for part in parts {
            match self.extent(part, words, zone)? {
                Extent::Nowhere => return Ok(Extent::Nowhere),
                Extent::Everywhere => {}
                Extent::Part(part) => {
                    result = Some(match result {
                        None => part,
                        Some(so_far) => so_far.intersection(&part),
                    });
                }
            }
        }
        Ok(result.map_or(Extent::Everywhere, |part| {
            Extent::of(part, &self.whole(zone))
        }))
    }

    fn disjunction(
        &mut self,
        parts: &[Predicate],
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        let mut result: Option<Federation> = None;
        for part in parts {
            match self.extent(part, words, zone)? {
                Extent::Everywhere => return Ok(Extent::Everywhere),
                Extent::Nowhere => {}
                Extent::Part(part) => match &mut result {
                    None => result = Some(part),
                    Some(so_far) => {
                        so_far.unite(&part);
                    }
                },
            }
        }
        Ok(result.map_or(Extent::Nowhere, |part| Extent::of(part, &self.whole(zone))))
    }

    fn clock_extent(
        &mut self,
        predicate: &ClockPredicate,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        let left = self.chosen_clock(predicate.left, words)?;
        let right = self.chosen_clock(predicate.right, words)?;
        let value = self.stepper.evaluate(predicate.bound, words)?;
        let bound = if predicate.strict {
            Bound::strict(value)
        } else {
            Bound::weak(value)
        };
        let bound = bound.ok_or(Failure::ClockLimit(value))?;
        if left == right {
            return Ok(everywhere_if(bound >= Bound::LE_ZERO));
        }
        let mut within = Zone::from_bounds(self.dimension(), zone);
        if !within.constrain(left.0 as usize, right.0 as usize, bound) {
            return Ok(Extent::Nowhere);
        }
        if within.bounds() == zone {
            return Ok(Extent::Everywhere);
        }
        Ok(Extent::Part(Federation::of_zone(
            self.dimension(),
            within.bounds(),
        )))
    }

    /// The clock that a query means in a state with these words.
    pub fn chosen_clock(
        &mut self,
        choice: ClockChoice,
        words: &mut [i32],
    ) -> Result<ClockId, Failure> {
        match choice {
            ClockChoice::Fixed(clock) => Ok(clock),
            ClockChoice::Indexed(range, function) => Ok(ClockId(
                range.first.0 + self.stepper.evaluate(function, words)? as u32,
            )),
        }
    }
}

/// What a predicate comes to that asks for locations only.
fn decided_by_locations(predicate: &Predicate, words: &[i32]) -> Option<bool> {
    match predicate {
        Predicate::Constant(value) => Some(*value),
        Predicate::Location(process, location) => {
            Some(words[process.0 as usize] == location.0 as i32)
        }
        Predicate::Not(inner) => decided_by_locations(inner, words).map(|holds| !holds),
        _ => None,
    }
}

fn difference(from: &Federation, other: &Federation) -> Federation {
    let mut rest = from.clone();
    rest.subtract(other);
    rest
}

fn everywhere_if(holds: bool) -> Extent {
    if holds {
        Extent::Everywhere
    } else {
        Extent::Nowhere
    }
}

/// The clock comparisons of a predicate, for extrapolation.
pub fn atoms(predicate: &Predicate) -> Vec<ClockAtom> {
    let mut atoms = Vec::new();
    collect_atoms(predicate, &mut atoms);
    atoms
}

fn collect_atoms(predicate: &Predicate, atoms: &mut Vec<ClockAtom>) {
    match predicate {
        Predicate::Clock(clock) => {
            let atom = ClockAtom {
                left: clock.left.clocks(),
                right: clock.right.clocks(),
                low: clock.range.0,
                high: clock.range.1,
                strict: clock.strict,
            };
            // Under a negation the comparison turns round, so both directions count.
            atoms.push(negated(&atom));
            atoms.push(atom);
        }
        Predicate::Not(inner) => collect_atoms(inner, atoms),
        Predicate::And(parts) | Predicate::Or(parts) => {
            for part in parts {
                collect_atoms(part, atoms);
            }
        }
        Predicate::Data(_)
        | Predicate::Constant(_)
        | Predicate::Location(..)
        | Predicate::Deadlock => {}
    }
}

/// The comparison that holds where this one fails.
fn negated(atom: &ClockAtom) -> ClockAtom {
    ClockAtom {
        left: atom.right,
        right: atom.left,
        low: atom.high.saturating_neg(),
        high: atom.low.saturating_neg(),
        strict: !atom.strict,
    }
}

/// Whether something in the network depends on a guard's being false: what abstains from a
/// broadcast, what priorities leave, and how long time may pass before something urgent. Then
/// guards must be told apart from both sides.
pub fn depends_on_negations(network: &Network) -> bool {
    let features = &network.features;
    features.guarded_receivers || features.priorities || features.clock_guarded_urgent
}

/// The negations of all comparisons of a network.
pub fn negated_atoms(network: &Network) -> Vec<ClockAtom> {
    let guards = network.processes.iter().flat_map(|process| {
        let edges = process.edges.iter().map(|edge| &edge.guard);
        edges.chain(process.locations.iter().map(|location| &location.invariant))
    });
    guards.flat_map(|guard| &guard.atoms).map(negated).collect()
}

/// The code that decides a predicate, which reads words only.
pub fn functions(predicate: &Predicate) -> Vec<FunctionId> {
    match predicate {
        Predicate::Constant(_) | Predicate::Location(..) | Predicate::Deadlock => Vec::new(),
        Predicate::Data(function) => vec![*function],
        Predicate::Clock(clock) => {
            let sides = [clock.left, clock.right].into_iter();
            let chosen = sides.filter_map(chooser);
            std::iter::once(clock.bound).chain(chosen).collect()
        }
        Predicate::Not(inner) => functions(inner),
        Predicate::And(parts) | Predicate::Or(parts) => parts.iter().flat_map(functions).collect(),
    }
}

/// The code that chooses a clock.
pub fn chooser(clock: ClockChoice) -> Option<FunctionId> {
    match clock {
        ClockChoice::Fixed(_) => None,
        ClockChoice::Indexed(_, function) => Some(function),
    }
}

/// Whether a predicate mentions `deadlock`.
pub fn has_deadlock(predicate: &Predicate) -> bool {
    match predicate {
        Predicate::Deadlock => true,
        Predicate::Not(inner) => has_deadlock(inner),
        Predicate::And(parts) | Predicate::Or(parts) => parts.iter().any(has_deadlock),
        _ => false,
    }
}
