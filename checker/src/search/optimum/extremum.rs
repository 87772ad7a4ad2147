//! `sup`, `inf` and `bounds`: the least and greatest values of integers and clocks over the
//! reachable states of a predicate.
//!
//! Integers are read from every state. A clock is read from the zones, which extrapolation must
//! leave exact where it matters. Up to a *ceiling*, the search keeps what comparisons of the clock
//! could distinguish: from below for a supremum, and from above for an infimum. A result within the
//! ceiling is exact, since such comparisons say whether it is reached and exceeded. Otherwise the
//! ceiling doubles, and the search starts again.
//!
//! A supremum beyond the ceiling may be infinite. It is infinite if time can pass without limit on
//! the path to the state, or if the path has a *pump*: two states of it with the same words, such
//! that the later zone contains the earlier one with some clocks moved up by the same number. These
//! clocks are above every constant of the model. At the end of the pump each of them has the value
//! of one of them plus what was added: they are not set, or only copied among each other. Above all
//! constants nothing depends on their values, and their differences do not change. So the path from
//! the one state to the other can be repeated for ever. If the measured clock grows without limit,
//! there are finitely many zones without such clocks, so the paths that exceed great ceilings have
//! a pump.
//!
//! Source of the exactness of a ceiling: G. Behrmann, P. Bouyer, K. G. Larsen, R. Pelánek, "Lower
//! and upper bounds in zone-based abstractions of timed automata", STTT 8, 2006; the pump is
//! derived here.

use crate::analysis::clock_differences;
use crate::ir::{ClockAtom, ClockChoice, ClockId, Measure, Network, Predicate};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::clocks::Assignment;
use crate::zones::{Bound, Zone, clocks, dbm, wide};

use crate::search::limits::{Counters, StopReason, Watch};
use crate::search::outcome::{Outcome, Trace};
use crate::search::reachability::goal::{Goal, Look, SharedGoal, Target, Visited};
use crate::search::reachability::report::Manner;
use crate::search::reachability::search;

/// A least or greatest value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extreme {
    /// A value; `is_reached` is false if the clock only comes as near to it as one likes.
    Value {
        /// The value.
        value: i32,
        /// Whether some state has it.
        is_reached: bool,
    },
    /// There is no greatest value.
    Infinite,
}

/// The question of a query.
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
    /// Comparisons that decide what happens, in addition to those of the network.
    pub further: &'q [ClockAtom],
}

/// The values of one item; `None` if they were not asked for, or no state counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extremes {
    /// The least.
    pub least: Option<Extreme>,
    /// The greatest.
    pub greatest: Option<Extreme>,
}

/// How the search for values ended.
#[derive(Debug)]
pub enum Values {
    /// The values of the items, in order.
    Found(Vec<Extremes>),
    /// A limit came first.
    Stopped(StopReason),
}

/// The end of a search for values.
#[derive(Debug)]
pub struct ValuesReport {
    /// The values, or the failure and the path to the state whose exploration failed.
    pub outcome: Result<Values, (Failure, Trace)>,
    /// What was done in all rounds; the stored states are those of the last round.
    pub counters: Counters,
    /// Whether some zone may contain more than what is reachable.
    pub is_approximate: bool,
}

/// Searches for the values. `symbolic` makes the zones of the network for given comparisons that
/// must be kept.
pub fn search<'a>(
    question: Question<'_>,
    network: &Network,
    symbolic: &mut dyn FnMut(&[ClockAtom]) -> Symbolic<'a>,
    manner: Manner,
    watch: &mut dyn Watch,
) -> ValuesReport {
    let greatest_constant = greatest_constant(network, &question);
    let mut measuring = Measuring::new(question, greatest_constant);
    let mut explored = 0;
    loop {
        measuring.forget();
        let mut zones = symbolic(&measuring.atoms(question.least));
        let report = search::search_shared(&mut zones, &mut measuring, manner, watch);
        explored += report.counters.explored;
        let outcome = match report.outcome {
            Ok(Outcome::Stopped(reason)) => Ok(Values::Stopped(reason)),
            Ok(Outcome::Exhausted) if measuring.is_settled() => {
                Ok(Values::Found(measuring.values()))
            }
            Ok(Outcome::Exhausted) => match measuring.raise_low() {
                Ok(()) => continue,
                Err(failure) => Err((failure, Trace::default())),
            },
            Ok(Outcome::Found(trace)) => {
                let mut zones = symbolic(&measuring.atoms_without_ceiling());
                if zones.splits() {
                    // Cut zones forget both bounds of a clock by the same ceiling, and without one
                    // a pump would not be visible.
                    zones = symbolic(&measuring.atoms(false));
                }
                match measuring.exceeded(&mut zones, &trace) {
                    Ok(()) => continue,
                    Err(failure) => Err((failure, trace)),
                }
            }
            Err(failed) => Err(failed),
        };
        return ValuesReport {
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
    let asked = predicate::atoms(question.predicate);
    let asked = asked.iter().chain(question.further);
    let asked = asked.map(clock_differences::greatest_in_atom);
    let greatest = clock_differences::greatest_constant(network).max(asked.max().unwrap_or(0));
    greatest.min(Bound::reach(greatest) - 1)
}

/// An item of the question, while it is measured.
#[derive(Clone, Copy, Debug)]
struct Item {
    /// A greatest value up to this one is exact.
    high_ceiling: i32,
    /// A least value up to this one is exact.
    low_ceiling: i32,
    is_infinite: bool,
    least: Option<Measured>,
    greatest: Option<Measured>,
}

/// The number of states of a path, evenly spread, that are tried as the start of a pump: a path
/// that exceeds a great ceiling has many pumps.
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

    /// The comparisons that the search must keep; those for the least values only with `least`.
    fn atoms(&self, least: bool) -> Vec<ClockAtom> {
        let reference = ClockId(0).into();
        let mut atoms = Vec::new();
        for ((measure, _), item) in self.question.items.iter().zip(&self.items) {
            let Measure::Clock(choice) = *measure else {
                continue;
            };
            let clock = choice.clocks();
            let atom = |left, right, bound| ClockAtom::weak(left, right, bound, bound);
            if self.question.greatest && !item.is_infinite {
                atoms.push(atom(reference, clock, -item.high_ceiling));
            }
            if least {
                atoms.push(atom(clock, reference, item.low_ceiling));
            }
        }
        atoms
    }

    /// The same for the greatest values, but without a limit for the clock that exceeded its
    /// ceiling, so that no zone forgets its value.
    fn atoms_without_ceiling(&self) -> Vec<ClockAtom> {
        let mut items = self.items.clone();
        if let Some(index) = self.exceeding {
            items[index].high_ceiling = Bound::reach(self.greatest_constant);
        }
        let measuring = Measuring { items, ..*self };
        measuring.atoms(false)
    }

    /// Adds a clock's bounds in a zone; returns false if its upper bound exceeds the ceiling.
    fn take_clock(&mut self, index: usize, lower: Bound, upper: Bound) -> bool {
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

    /// Whether all measured values lie within the ceilings.
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
                item.low_ceiling = doubled(item.low_ceiling, self.greatest_constant)?;
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
        let counting = self.question.predicate.part(symbolic, &mut words, zone)?;
        let is_unbounded =
            |zone: &[Bound]| dbm::clock_bounds(zone, dimension, clock).1.is_infinite();
        let pump = Pump {
            clock,
            // Extrapolation forgets the values of a clock only above its constants.
            above: self.greatest_constant.saturating_add(1),
            predicate: self.question.predicate,
        };
        let is_infinite = counting.zones().any(is_unbounded) || pump.is_on(symbolic, trace)?;
        if is_infinite && wide::has_forgotten() {
            // The bound may only be greater than zones can say.
            return Err(Failure::ClockRange);
        }
        let item = &mut self.items[index];
        if is_infinite {
            item.is_infinite = true;
        } else {
            item.high_ceiling = doubled(item.high_ceiling, self.greatest_constant)?;
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
        let counting = self.question.predicate.part(symbolic, words, zone)?;
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
                        let (lower, upper) = dbm::clock_bounds(part, symbolic.dimension(), clock);
                        if !self.take_clock(index, lower, upper) {
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
        Ok(self
            .question
            .predicate
            .part(symbolic, words, zone)?
            .zones()
            .any(exceeds))
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

fn doubled(ceiling: i32, greatest_constant: i32) -> Result<i32, Failure> {
    let doubled = ceiling.saturating_mul(2);
    if doubled > Bound::reach(greatest_constant) {
        return Err(Failure::ClockLimit(doubled));
    }
    Ok(doubled)
}

/// For each clock: the clock from which its value comes, if it does not come from a constant.
type Origins = Vec<Option<usize>>;

/// A part of a run that can be repeated, each time with a clock that is greater by at least one.
struct Pump<'p> {
    /// The clock at the end of the run.
    clock: usize,
    /// Nothing depends on the value of a clock above this one.
    above: i32,
    /// What must hold at the end of the run.
    predicate: &'p Predicate,
}

impl Pump<'_> {
    /// Whether the path has a pump.
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
        let (first_words, first_zone) = &trace.states[start];
        let mut zone = first_zone.clone();
        if !zone.constrain(0, self.clock, self.beyond()) {
            // It may get its value from another clock later.
            zone.clone_from(first_zone);
        }
        let unmoved: Origins = (0..zone.dimension()).map(Some).collect();
        let mut since_start = unmoved.clone();
        // The last state with these words, and the origins of clocks since then.
        let (mut before, mut since) = (zone.clone(), unmoved.clone());
        // For each pump that was found: the clocks that it moves in the current state.
        let mut pumped: Vec<Vec<bool>> = Vec::new();
        let mut words = first_words.clone();
        for parts in &trace.moves[start..] {
            let Some((next, assignments)) = take(symbolic, &mut words, &zone, parts)? else {
                return Ok(Attempt::Nothing);
            };
            zone = next;
            for origins in [&mut since_start, &mut since] {
                assign(origins, &assignments, None);
            }
            for moved in &mut pumped {
                assign(moved, &assignments, false);
            }
            if &words == first_words {
                // The start was cut, and this may have an effect for one more round. So each round
                // is compared with the one before.
                for moved in self.movable(&before, &since) {
                    if self.grows(symbolic, &words, &before, &zone, &moved) {
                        pumped.push(moved);
                    }
                }
                (before, since) = (zone.clone(), unmoved.clone());
            }
        }
        let extent = symbolic.extent(self.predicate, &mut words, zone.bounds())?;
        Ok(
            if pumped.iter().any(|moved| moved[self.clock]) && extent.is_somewhere() {
                Attempt::Pump
            } else if since_start[self.clock].is_none() {
                Attempt::IsSet
            } else {
                Attempt::Nothing
            },
        )
    }

    /// The value that a clock exceeds when nothing depends on it, as a bound on its negative value.
    fn beyond(&self) -> Bound {
        Bound::strict(-self.above).unwrap_or(Bound::LT_ZERO)
    }

    /// Sets of clocks that may have moved together since a zone: all clocks on which nothing
    /// depends, and the measured one.
    fn movable(&self, before: &Zone, since: &Origins) -> Vec<Vec<bool>> {
        let is_beyond = |clock: usize| clock > 0 && before.bound(0, clock) <= self.beyond();
        let all: Vec<bool> = (0..since.len()).map(is_beyond).collect();
        let only = |clock| all[clock] && clock == self.clock;
        let alone: Vec<bool> = (0..since.len()).map(only).collect();
        let mut sets: Vec<_> = [all, alone].map(|one| carried(one, since)).into();
        sets.dedup();
        sets.into_iter().flatten().collect()
    }

    /// Whether the later zone contains the earlier one with these clocks moved up: by one, or by as
    /// much as a bound of the measured clock grew.
    fn grows(
        &self,
        symbolic: &mut Symbolic<'_>,
        words: &[i32],
        before: &Zone,
        later: &Zone,
        moved: &[bool],
    ) -> bool {
        let dimension = symbolic.dimension();
        let (mut earlier, mut found) = (vec![before.clone()], vec![later.clone()]);
        symbolic.extrapolate_all(words, &mut earlier);
        symbolic.extrapolate_all(words, &mut found);
        let bounds = |zone: &Zone| dbm::clock_bounds(zone.bounds(), dimension, self.clock);
        let (old, new) = (bounds(before), bounds(later));
        let mut steps = vec![1, old.0.value() - new.0.value()];
        if !new.1.is_infinite() && !old.1.is_infinite() {
            steps.push(new.1.value() - old.1.value());
        }
        steps.dedup();
        steps.into_iter().filter(|&step| step > 0).any(|step| {
            earlier.iter().all(|one| {
                let mut shifted = one.clone();
                for clock in (0..dimension).filter(|&clock| moved[clock]) {
                    clocks::shift(shifted.bounds_mut(), dimension, clock, step);
                }
                found.iter().any(|found| shifted.is_subset(found))
            })
        })
    }
}

/// Takes a move of the trace from a zone; returns the zone that it leads to, and its effect on
/// clocks.
fn take(
    symbolic: &mut Symbolic<'_>,
    words: &mut [i32],
    zone: &Zone,
    parts: &[Part],
) -> Result<Option<(Zone, Vec<Assignment>)>, Failure> {
    let mut moves = Moves::default();
    symbolic.moves_of(words, parts, &mut moves)?;
    let Some(one) = moves.iter().find(|one| one.parts == parts) else {
        return Ok(None);
    };
    let Some(effect) = symbolic.fire(one, words)? else {
        return Ok(None);
    };
    let mut zones = Vec::new();
    effect.entry_zones(zone.bounds(), symbolic.dimension(), &mut zones);
    symbolic.let_time_pass(words, &effect.invariant, &mut zones)?;
    // Among several zones, the search follows one; the trace shows that one.
    let next = zones.into_iter().next();
    Ok(next.map(|zone| (zone, effect.assignments)))
}

/// Moves what is known about each clock along with its value. What becomes smaller, or comes from a
/// constant, is `lost`.
fn assign<T: Copy>(known: &mut [T], assignments: &[Assignment], lost: T) {
    for assignment in assignments {
        match *assignment {
            Assignment::Copy {
                clock,
                source,
                increment,
            } => known[clock] = if increment < 0 { lost } else { known[source] },
            Assignment::Value { clock, .. } => known[clock] = lost,
        }
    }
}

/// The greatest subset of clocks in which each has its value from one of the subset; `None` if it
/// is empty, or if a clock outside also has.
fn carried(mut set: Vec<bool>, origins: &Origins) -> Option<Vec<bool>> {
    loop {
        let has_origin = |origin: &Option<usize>| origin.is_some_and(|origin| set[origin]);
        let carrying: Vec<bool> = origins.iter().map(has_origin).collect();
        let both = set.iter().zip(&carrying).map(|(one, other)| *one && *other);
        let less: Vec<bool> = both.collect();
        if less == set {
            return (carrying == set && set.contains(&true)).then_some(set);
        }
        set = less;
    }
}

/// The result of the search for a pump from a state.
enum Attempt {
    Pump,
    /// The clock has its value from a constant that comes later on the path: no pump begins here or
    /// earlier.
    IsSet,
    Nothing,
}
