//! `sup`, `inf` and `bounds`: the least and greatest values of integers and clocks over the reachable states of a predicate.
//!
//! Integers are read off every state. A clock is read off the zones, which extrapolation must leave exact where it matters: up to a
//! *ceiling* the search keeps what comparisons of the clock could tell, from below for a supremum and from above for an infimum. A
//! result within the ceiling is exact, since its being reached and not exceeded are such comparisons; otherwise the ceiling
//! grows twofold and the search begins anew.
//!
//! A supremum beyond the ceiling may be infinite. It is if time can pass without limit on the way to the state, or if the way holds
//! a *pump*: two states of it with the same words between which the clock is not set and is above every constant of the
//! model, such that the later zone contains the earlier one with the clock moved up by one. Above all constants nothing
//! depends on the clock any more, so the way from the one to the other can be taken again and again. If the clock grows
//! without limit, the zones without it are finitely many, and so the ways that exceed great ceilings have a pump.
//!
//! Source of the exactness of a ceiling: G. Behrmann, P. Bouyer, K. G. Larsen, R. Pelánek, "Lower and upper bounds in zone-based
//! abstractions of timed automata", STTT 8, 2006; the pump is derived here.

use crate::ir::{ClockAtom, ClockChoice, ClockId, ClockRange, Measure, Network, Predicate};
use crate::network::{Failure, Moves, Part, Symbolic, differences, predicate};
use crate::zones::clocks::Assignment;
use crate::zones::{Bound, Federation, Zone, clocks, dbm};

use super::goal::{Goal, Look, SharedGoal, Visited};
use super::limits::{Counters, StopReason, Watch};
use super::reach::{self, Manner, Trace};

/// A least or greatest value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extreme {
    /// A value; `is_reached` is false if the clock comes as near to it as one likes and no nearer.
    Value {
        /// The value.
        value: i32,
        /// Whether some state has it.
        is_reached: bool,
    },
    /// There is no greatest value.
    Infinite,
}

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct Question<'q> {
    /// The states that count.
    pub predicate: &'q Predicate,
    /// What is measured.
    pub items: &'q [(Measure, String)],
    /// Whether the least value is wanted.
    pub least: bool,
    /// Whether the greatest value is wanted.
    pub greatest: bool,
    /// Comparisons that decide what happens, beside those of the network.
    pub further: &'q [ClockAtom],
}

/// The values of one item; `None` where they were not asked for, or no state counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extremes {
    /// The least.
    pub least: Option<Extreme>,
    /// The greatest.
    pub greatest: Option<Extreme>,
}

/// How the search for values ended.
#[derive(Debug)]
pub enum Outcome {
    /// The values of the items, in order.
    Found(Vec<Extremes>),
    /// A limit came first.
    Stopped(StopReason),
}

/// The end of a search for values.
#[derive(Debug)]
pub struct Report {
    /// The values, or the failure and the way to the state whose exploration failed.
    pub outcome: Result<Outcome, (Failure, Trace)>,
    /// What was done, in all rounds; the stored states are those of the last.
    pub counters: Counters,
    /// Whether some zone may contain more than what is reachable.
    pub is_approximate: bool,
}

/// Searches for the values. `symbolic` makes the zones of the network for given comparisons that must be kept.
pub fn search<'a>(
    question: Question<'_>,
    network: &Network,
    symbolic: &mut dyn FnMut(&[ClockAtom]) -> Symbolic<'a>,
    manner: Manner,
    watch: &mut dyn Watch,
) -> Report {
    let greatest_constant = greatest_constant(network, &question);
    let mut measuring = Measuring::new(question, greatest_constant);
    let mut explored = 0;
    loop {
        measuring.forget();
        let mut zones = symbolic(&measuring.atoms(question.least));
        let report = reach::search_shared(&mut zones, &mut measuring, manner, watch);
        explored += report.counters.explored;
        let outcome = match report.outcome {
            Ok(reach::Outcome::Stopped(reason)) => Ok(Outcome::Stopped(reason)),
            Ok(reach::Outcome::Exhausted) if measuring.is_settled() => {
                Ok(Outcome::Found(measuring.values()))
            }
            Ok(reach::Outcome::Exhausted) => match measuring.raise_low() {
                Ok(()) => continue,
                Err(failure) => Err((failure, Trace::default())),
            },
            Ok(reach::Outcome::Found(trace)) => {
                let mut zones = symbolic(&measuring.atoms_without_ceiling());
                if zones.splits() {
                    // Cut zones forget both bounds of a clock by the same ceiling, and without one a pump would not show.
                    zones = symbolic(&measuring.atoms(false));
                }
                match measuring.exceeded(&mut zones, &trace) {
                    Ok(()) => continue,
                    Err(failure) => Err((failure, trace)),
                }
            }
            Err(failed) => Err(failed),
        };
        return Report {
            outcome,
            counters: Counters {
                explored,
                ..report.counters
            },
            is_approximate: zones.is_approximate(),
        };
    }
}

/// A value that no comparison of the model or the query exceeds.
fn greatest_constant(network: &Network, question: &Question<'_>) -> i32 {
    let guards = network.processes.iter().flat_map(|process| {
        let edges = process.edges.iter().map(|edge| &edge.guard);
        edges.chain(process.locations.iter().map(|location| &location.invariant))
    });
    let atoms = guards.flat_map(|guard| guard.atoms.iter().cloned());
    let all = atoms
        .chain(predicate::atoms(question.predicate))
        .chain(question.further.iter().cloned());
    let greatest = all.map(|atom| atom.low.saturating_abs().max(atom.high.saturating_abs()));
    let greatest = greatest.max().unwrap_or(0);
    let reset = differences::greatest_reset(network);
    greatest.saturating_add(reset).min(Bound::MAX_VALUE / 4)
}

/// An item of the question, while it is measured.
#[derive(Clone, Copy, Debug)]
struct Item {
    /// Up to here a greatest value is exact.
    high_ceiling: i32,
    /// Up to here a least value is exact.
    low_ceiling: i32,
    is_infinite: bool,
    least: Option<Measured>,
    greatest: Option<Measured>,
}

/// States of a way that are tried as the start of a pump, evenly over it: a way that exceeds a great ceiling has many.
const MOST_STARTS: usize = 64;

/// A value, and whether it is reached.
type Measured = (i32, bool);

struct Measuring<'q> {
    question: Question<'q>,
    greatest_constant: i32,
    items: Vec<Item>,
    /// The item that exceeded its ceiling.
    exceeding: Option<usize>,
}

impl<'q> Measuring<'q> {
    fn new(question: Question<'q>, greatest_constant: i32) -> Measuring<'q> {
        let ceiling = greatest_constant.saturating_add(1);
        let item = Item {
            high_ceiling: ceiling,
            low_ceiling: ceiling,
            is_infinite: false,
            least: None,
            greatest: None,
        };
        Measuring {
            question,
            greatest_constant,
            items: vec![item; question.items.len()],
            exceeding: None,
        }
    }

    /// Forgets what was measured, but not what is known to be infinite.
    fn forget(&mut self) {
        self.exceeding = None;
        for item in &mut self.items {
            (item.least, item.greatest) = (None, None);
        }
    }

    /// The comparisons that the search must keep; those for the least values only if `least`.
    fn atoms(&self, least: bool) -> Vec<ClockAtom> {
        let reference = ClockRange {
            first: ClockId(0),
            count: 1,
        };
        let mut atoms = Vec::new();
        for ((measure, _), item) in self.question.items.iter().zip(&self.items) {
            let Measure::Clock(choice) = *measure else {
                continue;
            };
            let clock = match choice {
                ClockChoice::Fixed(first) => ClockRange { first, count: 1 },
                ClockChoice::Indexed(range, _) => range,
            };
            let atom = |left, right, bound| ClockAtom {
                left,
                right,
                low: bound,
                high: bound,
                strict: false,
            };
            if self.question.greatest && !item.is_infinite {
                atoms.push(atom(reference, clock, -item.high_ceiling));
            }
            if least {
                atoms.push(atom(clock, reference, item.low_ceiling));
            }
        }
        atoms
    }

    /// The same for the greatest values, but without limit for the clock that exceeded its ceiling: no zone forgets how far it
    /// has come.
    fn atoms_without_ceiling(&self) -> Vec<ClockAtom> {
        let mut items = self.items.clone();
        if let Some(index) = self.exceeding {
            items[index].high_ceiling = Bound::MAX_VALUE / 2;
        }
        let measuring = Measuring { items, ..*self };
        measuring.atoms(false)
    }

    /// Takes a clock's bounds in a zone into account; false if its upper bound exceeds the ceiling.
    fn take_clock(&mut self, index: usize, (lower, upper): (Bound, Bound)) -> bool {
        let item = &mut self.items[index];
        if self.question.greatest && !item.is_infinite {
            if upper > Bound::weak(item.high_ceiling).unwrap_or(Bound::INFINITY) {
                self.exceeding = Some(index);
                return false;
            }
            item.admit_greatest((upper.value(), !upper.is_strict()));
        }
        // A lower bound is one on `0 - x`.
        item.admit_least((-lower.value(), !lower.is_strict()));
        true
    }

    /// Whether all that was measured lies within the ceilings.
    fn is_settled(&self) -> bool {
        let items = self.question.items.iter().zip(&self.items);
        items.into_iter().all(|((measure, _), item)| {
            matches!(measure, Measure::Integer(_))
                || !self.question.least
                || item.least.is_none_or(|least| least.0 < item.low_ceiling)
        })
    }

    fn raise_low(&mut self) -> Result<(), Failure> {
        for item in &mut self.items {
            if item.least.is_some_and(|least| least.0 >= item.low_ceiling) {
                item.low_ceiling = doubled(item.low_ceiling)?;
            }
        }
        Ok(())
    }

    /// Finds out why a clock exceeded its ceiling in the last state of the trace.
    fn exceeded(&mut self, symbolic: &mut Symbolic<'_>, trace: &Trace) -> Result<(), Failure> {
        let (words, zone) = trace.states.last().expect("the search ended in a state");
        let mut words = words.clone();
        let Some((index, choice)) = self.exceeding() else {
            return Ok(());
        };
        let clock = symbolic.chosen_clock(choice, &mut words)?.0 as usize;
        let dimension = symbolic.dimension();
        let counting = self.counting(symbolic, &mut words, zone)?;
        let is_unbounded =
            |zone: &[Bound]| dbm::clock_bounds(zone, dimension, clock).1.is_infinite();
        let pump = Pump {
            clock,
            // Extrapolation forgets how far a clock is above its constants only beyond them.
            above: self.greatest_constant.saturating_add(1),
            predicate: self.question.predicate,
        };
        let is_infinite = counting.zones().any(is_unbounded) || pump.is_on(symbolic, trace)?;
        let item = &mut self.items[index];
        if is_infinite {
            item.is_infinite = true;
        } else {
            item.high_ceiling = doubled(item.high_ceiling)?;
        }
        Ok(())
    }

    /// The item that exceeded its ceiling, and its clock.
    fn exceeding(&self) -> Option<(usize, ClockChoice)> {
        let index = self.exceeding?;
        match self.question.items[index].0 {
            Measure::Clock(choice) => Some((index, choice)),
            Measure::Integer(_) => None,
        }
    }

    fn values(&self) -> Vec<Extremes> {
        let value = |(value, is_reached): Measured| Extreme::Value { value, is_reached };
        let extremes = |item: &Item| Extremes {
            least: item.least.filter(|_| self.question.least).map(value),
            greatest: if item.is_infinite {
                Some(Extreme::Infinite)
            } else {
                item.greatest.filter(|_| self.question.greatest).map(value)
            },
        };
        self.items.iter().map(extremes).collect()
    }

    /// Where in the zone the predicate holds.
    fn counting(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<Federation, Failure> {
        let extent = symbolic.extent(self.question.predicate, words, zone.bounds())?;
        Ok(extent.to_federation(zone.bounds(), symbolic.dimension()))
    }
}

impl Item {
    fn admit_least(&mut self, new: Measured) {
        let is_less = |old: Measured| (new.0, !new.1) < (old.0, !old.1);
        if self.least.is_none_or(is_less) {
            self.least = Some(new);
        }
    }

    fn admit_greatest(&mut self, new: Measured) {
        self.greatest = self.greatest.max(Some(new));
    }
}

impl Goal for Measuring<'_> {
    /// Measures; ends the search at a state in which a clock exceeds its ceiling.
    fn look(&mut self, visited: Visited<'_, '_>) -> Result<Look, Failure> {
        let Visited {
            symbolic,
            words,
            zone,
            ..
        } = visited;
        let counting = self.counting(symbolic, words, zone)?;
        if counting.is_empty() {
            return Ok(Look::Continue);
        }
        for (index, (measure, _)) in self.question.items.iter().enumerate() {
            match *measure {
                Measure::Integer(function) => {
                    let value = symbolic.stepper.evaluate(function, words)?;
                    self.items[index].admit_least((value, true));
                    self.items[index].admit_greatest((value, true));
                }
                Measure::Clock(choice) => {
                    let clock = symbolic.chosen_clock(choice, words)?.0 as usize;
                    for part in counting.zones() {
                        let bounds = dbm::clock_bounds(part, symbolic.dimension(), clock);
                        if !self.take_clock(index, bounds) {
                            return Ok(Look::Found);
                        }
                    }
                }
            }
        }
        Ok(Look::Continue)
    }

    fn confirms(
        &mut self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<bool, Failure> {
        let Some((index, choice)) = self.exceeding() else {
            return Ok(true);
        };
        let clock = symbolic.chosen_clock(choice, words)?.0 as usize;
        let ceiling = Bound::weak(self.items[index].high_ceiling);
        let exceeds = |part| {
            let upper = dbm::clock_bounds(part, zone.dimension(), clock).1;
            ceiling.is_some_and(|ceiling| upper > ceiling)
        };
        Ok(self.counting(symbolic, words, zone)?.zones().any(exceeds))
    }
}

impl SharedGoal for Measuring<'_> {
    fn fork(&self) -> Self {
        let mut copy = Measuring {
            question: self.question,
            greatest_constant: self.greatest_constant,
            items: self.items.clone(),
            exceeding: None,
        };
        copy.forget();
        copy
    }

    fn join(&mut self, other: Self) {
        for (item, seen) in self.items.iter_mut().zip(other.items) {
            if let Some(least) = seen.least {
                item.admit_least(least);
            }
            if let Some(greatest) = seen.greatest {
                item.admit_greatest(greatest);
            }
        }
        self.exceeding = self.exceeding.or(other.exceeding);
    }
}

fn doubled(ceiling: i32) -> Result<i32, Failure> {
    let doubled = ceiling.saturating_mul(2);
    if doubled > Bound::MAX_VALUE / 2 {
        return Err(Failure::ClockLimit(doubled));
    }
    Ok(doubled)
}

/// A part of a run that can be repeated, each time with a clock that is greater by at least one.
struct Pump<'p> {
    clock: usize,
    /// Above this value nothing depends on the clock.
    above: i32,
    /// What must hold at the end of the run.
    predicate: &'p Predicate,
}

impl Pump<'_> {
    /// Whether there is a pump on the way.
    fn is_on(&self, symbolic: &mut Symbolic<'_>, trace: &Trace) -> Result<bool, Failure> {
        let count = trace.moves.len();
        let starts = (0..count).rev().step_by(count.div_ceil(MOST_STARTS).max(1));
        for start in starts {
            match self.is_from(symbolic, trace, start)? {
                Attempt::Pump => return Ok(true),
                Attempt::IsSet => return Ok(false),
                Attempt::Nothing => {}
            }
        }
        Ok(false)
    }

    /// Whether a pump begins at the state with this index.
    fn is_from(
        &self,
        symbolic: &mut Symbolic<'_>,
        trace: &Trace,
        start: usize,
    ) -> Result<Attempt, Failure> {
        let (first_words, zone) = &trace.states[start];
        let mut zone = zone.clone();
        let above = Bound::strict(-self.above).unwrap_or(Bound::LT_ZERO);
        if !zone.constrain(0, self.clock, above) {
            return Ok(Attempt::Nothing);
        }
        let mut shifted = self.shifted(symbolic, first_words, &zone);
        let mut words = first_words.clone();
        let mut is_pump = false;
        for parts in &trace.moves[start..] {
            match self.take(symbolic, &mut words, &zone, parts)? {
                Taken::Zone(next) => zone = next,
                Taken::Set => return Ok(Attempt::IsSet),
                Taken::Nothing => return Ok(Attempt::Nothing),
            }
            if &words == first_words {
                let mut later = vec![zone.clone()];
                symbolic.extrapolate_all(&words, &mut later);
                let is_contained = |one: &Zone| later.iter().any(|later| one.is_subset(later));
                is_pump |= shifted.iter().all(is_contained);
                // What the start was cut to may take a round to wear off, so that each round is compared with the one before.
                shifted = self.shifted(symbolic, first_words, &zone);
            }
        }
        let extent = symbolic.extent(self.predicate, &mut words, zone.bounds())?;
        Ok(if is_pump && extent.is_somewhere() {
            Attempt::Pump
        } else {
            Attempt::Nothing
        })
    }

    /// The zone, extrapolated, with the clock moved up by one.
    fn shifted(&self, symbolic: &mut Symbolic<'_>, words: &[i32], zone: &Zone) -> Vec<Zone> {
        let mut zones = vec![zone.clone()];
        symbolic.extrapolate_all(words, &mut zones);
        let dimension = symbolic.dimension();
        for zone in &mut zones {
            clocks::shift(zone.bounds_mut(), dimension, self.clock, 1);
        }
        zones
    }

    /// Takes a move of the trace from a zone.
    fn take(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &mut [i32],
        zone: &Zone,
        parts: &[Part],
    ) -> Result<Taken, Failure> {
        let mut moves = Moves::default();
        symbolic.moves_of(words, parts, &mut moves)?;
        let Some(one) = moves.iter().find(|one| one.parts == parts) else {
            return Ok(Taken::Nothing);
        };
        let Some(effect) = symbolic.fire(one, words)? else {
            return Ok(Taken::Nothing);
        };
        let sets = |assignment: &Assignment| match *assignment {
            // A clock that is set to itself or to more goes on as it was.
            Assignment::Copy {
                clock,
                source,
                increment,
            } => clock == self.clock && (source != clock || increment < 0),
            Assignment::Value { clock, .. } | Assignment::Free { clock } => clock == self.clock,
        };
        if effect.assignments.iter().any(sets) {
            return Ok(Taken::Set);
        }
        let mut zones = Vec::new();
        effect.entry_zones(zone.bounds(), symbolic.dimension(), &mut zones);
        symbolic.let_time_pass(words, &effect.invariant, &mut zones)?;
        // Of several zones one is followed: what it shows is shown.
        Ok(zones.into_iter().next().map_or(Taken::Nothing, Taken::Zone))
    }
}

/// What became of the search for a pump from a state.
enum Attempt {
    Pump,
    /// The clock is set later on the way: no pump begins here or earlier.
    IsSet,
    Nothing,
}

/// What became of a move.
enum Taken {
    Zone(Zone),
    /// It sets the clock.
    Set,
    Nothing,
}
