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
            Predicate::Not(inner) => Ok(match self.extent(inner, words, zone)? {
                Extent::Part(part) => self.rest_of(zone, &part),
                Extent::Nowhere => Extent::Everywhere,
                Extent::Everywhere => Extent::Nowhere,
            }),
            Predicate::And(parts) => self.combination(parts, true, words, zone),
            Predicate::Or(parts) => self.combination(parts, false, words, zone),
            Predicate::Clock(clock) => self.clock_extent(clock, words, zone),
            Predicate::Deadlock => self.deadlock_extent(words, zone),
        }
    }

    /// The part of a zone in which a predicate holds, for a state with these words.
    pub fn part(
        &mut self,
        predicate: &Predicate,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<Federation, Failure> {
        let extent = self.extent(predicate, words, zone.bounds())?;
        Ok(extent.to_federation(zone.bounds(), self.dimension()))
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
                    let both = self.combination(parts, true, words, zone)?;
                    return Ok(both.is_somewhere());
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

    /// What is left of a zone outside of a part of it.
    pub(super) fn rest_of(&self, zone: &[Bound], part: &Federation) -> Extent {
        let whole = self.whole(zone);
        Extent::of(whole.clone().minus(part), &whole)
    }

    fn whole(&self, zone: &[Bound]) -> Federation {
        Federation::of_zone(self.dimension(), zone)
    }

    /// Where all parts hold, or where one does.
    fn combination(
        &mut self,
        parts: &[Predicate],
        is_conjunction: bool,
        words: &mut [i32],
        zone: &[Bound],
    ) -> Result<Extent, Failure> {
        let mut result: Option<Federation> = None;
        for part in parts {
            match self.extent(part, words, zone)? {
                Extent::Nowhere if is_conjunction => return Ok(Extent::Nowhere),
                Extent::Everywhere if !is_conjunction => return Ok(Extent::Everywhere),
                Extent::Nowhere | Extent::Everywhere => {}
                Extent::Part(part) => match &mut result {
                    None => result = Some(part),
                    Some(so_far) if is_conjunction => *so_far = so_far.intersection(&part),
                    Some(so_far) => _ = so_far.unite(&part),
                },
            }
        }
        Ok(match result {
            None => everywhere_if(is_conjunction),
            Some(part) => Extent::of(part, &self.whole(zone)),
        })
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

fn everywhere_if(holds: bool) -> Extent {
    if holds {
        Extent::Everywhere
    } else {
        Extent::Nowhere
    }
}

/// The clock comparisons of a predicate, for extrapolation.
pub fn atoms(predicate: &Predicate) -> Vec<ClockAtom> {
    // Under a negation the comparison turns round, so both directions count.
    let both = |comparison: &ClockPredicate| {
        let atom = comparison.atom();
        [negated(&atom), atom]
    };
    predicate.comparisons().flat_map(both).collect()
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
    let functions = predicate.leaves().into_iter().flat_map(|leaf| match leaf {
        Predicate::Data(function) => vec![*function],
        Predicate::Clock(clock) => {
            let sides = [clock.left, clock.right].into_iter();
            let chosen = sides.filter_map(chooser);
            std::iter::once(clock.bound).chain(chosen).collect()
        }
        _ => Vec::new(),
    });
    functions.collect()
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
    let mut leaves = predicate.leaves().into_iter();
    leaves.any(|leaf| matches!(leaf, Predicate::Deadlock))
}
