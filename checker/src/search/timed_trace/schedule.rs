//! When the moves of a symbolic run can happen: exact times for a given sequence of moves.
//!
//! Along a known sequence of moves, a clock's value is the time since the move that set it last,
//! plus the value that it got. So guards, invariants and predicates become bounds on differences of
//! the times of events (moves, and moments that are checked), and the earliest times that satisfy
//! them are longest paths. Two kinds of constraints have alternatives. If something must not hold
//! at a moment (a receiver that abstains, a move of higher priority), one of its comparisons must
//! fail. If a wait must not pass through a zone, it must end before the zone begins, start after
//! the zone has ended, or never enter it for the whole wait. The alternatives are tried one after
//! the other, and only where the earliest times violate them.
//!
//! A strict bound is a weak one with an infinitesimal distance: times are pairs of an integer and a
//! count of infinitesimals. In the end the infinitesimal becomes `1 / (n + 1)`, where n is the
//! greatest count. Then a bound that is not met exactly has at least one whole unit of room, and n
//! infinitesimals do not fill it.
//!
//! If clocks stand still at times, a clock's value is the sum of the waits in which it ran, and
//! bounds become linear in durations ([`super::simplex`]), with the same alternatives.
//!
//! Invariant: without such clocks, times are the least that satisfy all bounds until now, or the
//! bounds contradict each other.
//!
//! Source: R. Dechter, I. Meiri, J. Pearl, "Temporal constraint networks", Artificial Intelligence
//! 49, 1991 (times as shortest paths, alternatives by backtracking); A. Armando, C. Castellini, E.
//! Giunchiglia, "SAT-based procedures for temporal reasoning", ECP 1999 (alternatives only where
//! they are violated).
//!
//! Cost: a bound that moves n times costs up to n times the bounds among them; alternatives are
//! exponential in the worst case, and given up after [`MOST_ATTEMPTS`].

use std::ops::Range;

use crate::ir::Predicate;
use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::clocks::Assignment;
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Federation, Zone, minimal};

use super::difference_constraints::{Alternatives, Distance, Limit, Mark, Solver, Times};
use super::simplex::{Durations, LinearBound, TooHard};
use crate::search::liveness::delay_inside;

/// Alternatives that are tried before a schedule is given up.
const MOST_ATTEMPTS: usize = 100_000;

/// What must hold at the end of a run.
#[derive(Clone, Debug)]
pub enum Finish<'t> {
    /// Nothing: it ends on entry of its last state.
    Entry,
    /// The predicate holds, and these constraints on the clocks.
    Holds(&'t Predicate, Vec<Constraint>),
    /// Time can pass for ever within what must stay.
    Waits,
    /// Nothing is possible any more, within what must stay.
    Stuck,
}

/// Something that must stay.
#[derive(Clone, Copy, Debug)]
pub struct Stays<'t> {
    /// From some moment in the state with this index at which this holds; or from the beginning.
    pub from: Option<(usize, &'t Predicate)>,
    /// What must stay.
    pub keep: &'t Predicate,
}

/// A run that is wanted.
#[derive(Clone, Debug)]
pub struct Wanted<'t> {
    /// Its moves.
    pub moves: &'t [Vec<Part>],
    /// What must stay, and from when on.
    pub stays: Option<Stays<'t>>,
    /// How it ends.
    pub finish: Finish<'t>,
    /// The latest time of its end; with 1, it must end before one unit has passed since then.
    pub deadline: Option<(i32, u32)>,
    /// If the run returns to a state: on entry of that state, all clocks have the same values as on
    /// entry of the last one.
    pub closing: Option<Closing>,
}

/// How a run returns to a state of its own.
#[derive(Clone, Copy, Debug)]
pub struct Closing {
    /// The index of the state.
    pub head: usize,
    /// Two values of a clock that are both above this one count as the same.
    pub above: Option<i64>,
}

/// How a clock got its value: what it was set to, and the waits in which it ran since then.
type Value = (i64, Vec<usize>);

/// Exact times of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// How many ticks make one unit of time.
    pub ticks_per_unit: i64,
    /// When each move happens.
    pub moves: Vec<i64>,
    /// The time from which something stays true; 0 if nothing has to.
    pub from: i64,
    /// The time at which the end is checked.
    pub end: i64,
}

/// Why there are no times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unscheduled {
    /// The moves are not possible in this order.
    Impossible,
    /// Too many alternatives.
    TooHard,
    /// The model failed.
    Failed(Failure),
}

impl From<TooHard> for Unscheduled {
    fn from(_: TooHard) -> Unscheduled {
        Unscheduled::TooHard
    }
}

impl From<Failure> for Unscheduled {
    fn from(failure: Failure) -> Unscheduled {
        Unscheduled::Failed(failure)
    }
}

/// The earliest times of a run; if clocks stand still on the way, any times.
pub fn schedule(symbolic: &mut Symbolic<'_>, wanted: &Wanted<'_>) -> Result<Schedule, Unscheduled> {
    let mut plan = Plan::new(symbolic, Solver::Times(Times::new()))?;
    // Whether two values of a clock are the same is no question of distances.
    let is_closing = wanted.closing.is_some();
    let written = if is_closing {
        Ok(())
    } else {
        plan.write(wanted)
    };
    if plan.meets_stopped || is_closing {
        let mut plan = Plan::new(symbolic, Solver::Durations(Durations::default()))?;
        plan.write(wanted)?;
        return plan.solve();
    }
    written?;
    plan.solve()
}

/// The run that is being written down.
struct Plan<'s, 'a> {
    symbolic: &'s mut Symbolic<'a>,
    words: Vec<i32>,
    /// For each clock: the event that set it last, and its value; unused for the reference clock.
    set: Vec<(usize, i64)>,
    /// For each clock: the waits in which it ran since then, if the search looks for durations.
    ran: Vec<Vec<usize>>,
    /// Whether a clock stands still in some wait.
    meets_stopped: bool,
    /// The event at which the current state was entered or last checked.
    now: usize,
    /// What must stay true in the current state.
    keep: Option<Predicate>,
    solver: Solver,
    alternatives: Vec<Alternatives>,
    /// The events of the moves, of the look, and of the end.
    moves: Vec<usize>,
    look: usize,
    end: usize,
}

impl<'s, 'a> Plan<'s, 'a> {
    fn new(symbolic: &'s mut Symbolic<'a>, solver: Solver) -> Result<Plan<'s, 'a>, Unscheduled> {
        let (words, _, invariant) = symbolic.start()?;
        let network = symbolic.stepper.network();
        let initial = network.initial_clocks.iter();
        let mut set: Vec<(usize, i64)> = initial.map(|&value| (0, i64::from(value))).collect();
        set.resize(symbolic.dimension(), (0, 0));
        let mut plan = Plan {
            symbolic,
            words,
            ran: vec![Vec::new(); set.len()],
            meets_stopped: false,
            set,
            now: 0,
            keep: None,
            solver,
            alternatives: Vec::new(),
            moves: Vec::new(),
            look: 0,
            end: 0,
        };
        plan.require_all(0, &invariant)?;
        Ok(plan)
    }

    fn write(&mut self, wanted: &Wanted<'_>) -> Result<(), Unscheduled> {
        if let Some(Stays { from: None, keep }) = wanted.stays {
            self.stay_from(0, keep)?;
        }
        let mut head = None;
        for state in 0..=wanted.moves.len() {
            if let Some(closing) = wanted.closing
                && closing.head == state
            {
                head = Some((self.values(), closing.above));
            }
            if let Some(Stays {
                from: Some((first, open)),
                keep,
            }) = wanted.stays
                && first == state
            {
                let look = self.wait()?;
                let part = self.extent(open)?;
                self.require_part(look, &part)?;
                self.stay_from(look, keep)?;
            }
            if let Some(parts) = wanted.moves.get(state) {
                let event = self.wait()?;
                self.moves.push(event);
                self.take(event, parts)?;
            }
        }
        if let Some((values, above)) = head {
            self.close(&values, above);
        }
        self.finish(&wanted.finish)?;
        if let Some((time, is_open)) = wanted.deadline {
            let time = i64::from(time) + i64::from(is_open);
            self.require(Distance {
                earlier: self.end,
                later: 0,
                apart: (-time, i64::from(is_open)),
            })?;
        }
        Ok(())
    }

    /// The values of the clocks on entry of the current state.
    fn values(&self) -> Vec<Value> {
        let values = self.set.iter().zip(&self.ran);
        values.map(|(set, ran)| (set.1, ran.clone())).collect()
    }

    /// Each clock has the value that it had before, or both are greater than a number.
    fn close(&mut self, before: &[Value], above: Option<i64>) {
        for ((old, ran_before), (new, ran)) in before.iter().zip(self.values()).skip(1) {
            // new + ran - old - ran_before >= 0
            let bound = |plus: &[usize], minus: &[usize], least: i64, strict: i64| {
                let only = |waits: &[usize], others: &[usize]| -> Vec<usize> {
                    let waits = waits.iter().copied();
                    waits.filter(|wait| !others.contains(wait)).collect()
                };
                Limit::Linear(LinearBound {
                    plus: only(plus, minus),
                    minus: only(minus, plus),
                    least: (least, strict),
                })
            };
            let same = vec![
                bound(&ran, ran_before, old - new, 0),
                bound(ran_before, &ran, new - old, 0),
            ];
            let beyond = above.map(|above| {
                vec![
                    bound(&ran, &[], above - new, 1),
                    bound(ran_before, &[], above - old, 1),
                ]
            });
            self.alternatives
                .push([same].into_iter().chain(beyond).collect());
        }
    }

    /// From this event in the current state on, the predicate stays true.
    fn stay_from(&mut self, event: usize, keep: &Predicate) -> Result<(), Unscheduled> {
        self.look = event;
        self.keep = Some(keep.clone());
        self.keep_at(event)
    }

    fn finish(&mut self, finish: &Finish<'_>) -> Result<(), Unscheduled> {
        self.end = self.now;
        let part = match finish {
            Finish::Entry => {
                return Ok(());
            }
            Finish::Holds(predicate, constraints) => {
                self.end = self.wait()?;
                self.require_all(self.end, constraints)?;
                self.extent(predicate)?
            }
            Finish::Waits | Finish::Stuck => {
                self.end = self.wait()?;
                let whole = self.whole()?;
                let keep = self.keep.clone().unwrap_or(Predicate::Constant(true));
                let (waits, stuck) =
                    delay_inside::endings(self.symbolic, &keep, &mut self.words, whole)?;
                if let Finish::Waits = finish {
                    waits
                } else {
                    stuck
                }
            }
        };
        self.require_part(self.end, &part)
    }

    /// All clock values that the invariants of the current state allow.
    fn whole(&mut self) -> Result<Zone, Unscheduled> {
        let mut whole = Zone::universe(self.symbolic.dimension());
        let invariant = self.symbolic.invariant(&mut self.words)?;
        if !invariant.is_some_and(|invariant| whole.constrain_all(&invariant)) {
            return Err(Unscheduled::Impossible);
        }
        Ok(whole)
    }

    fn extent(&mut self, predicate: &Predicate) -> Result<Federation, Unscheduled> {
        let whole = self.whole()?;
        Ok(self.symbolic.part(predicate, &mut self.words, &whole)?)
    }

    /// A new event, reached by waiting in the current state.
    fn wait(&mut self) -> Result<usize, Unscheduled> {
        let (start, end) = (self.now, self.solver.add_event());
        self.require(Distance {
            earlier: start,
            later: end,
            apart: (0, 0),
        })?;
        self.now = end;
        if !self.symbolic.may_delay(&mut self.words)? {
            return self
                .require(Distance {
                    earlier: end,
                    later: start,
                    apart: (0, 0),
                })
                .map(|()| end);
        }
        let stopped = self.symbolic.stopped(&self.words)?;
        if let Solver::Durations(_) = self.solver {
            for (clock, ran) in self.ran.iter_mut().enumerate().skip(1) {
                if !stopped.contains(clock) {
                    ran.push(start);
                }
            }
        } else if !stopped.is_empty() {
            self.meets_stopped = true;
            return Err(Unscheduled::Impossible);
        }
        let whole = self.whole()?;
        let invariant = self.symbolic.invariant(&mut self.words)?;
        self.require_all(end, &invariant.unwrap_or_default())?;
        let barriers = self.symbolic.barriers(&mut self.words, whole.bounds())?;
        let mut stops = barriers.stops;
        // Inside an open part time may run. The times need not show that it does not run out of the
        // part.
        barriers.open.iter().for_each(|part| stops.subtract(part));
        for barrier in stops.zones() {
            self.avoid(start..end, barrier, true);
        }
        let outside = self.outside(&whole)?;
        for zone in outside.zones() {
            self.avoid(start..end, zone, false);
        }
        Ok(end)
    }

    /// Where what must stay does not hold.
    fn outside(&mut self, whole: &Zone) -> Result<Federation, Unscheduled> {
        let Some(keep) = &self.keep else {
            return Ok(Federation::empty(whole.dimension()));
        };
        Ok(self
            .symbolic
            .part(&keep.negated(), &mut self.words, whole)?)
    }

    /// What must stay holds at an event.
    fn keep_at(&mut self, event: usize) -> Result<(), Unscheduled> {
        let Some(keep) = self.keep.clone() else {
            return Ok(());
        };
        let part = self.extent(&keep)?;
        self.require_part(event, &part)
    }

    fn take(&mut self, event: usize, parts: &[Part]) -> Result<(), Unscheduled> {
        let mut moves = Moves::default();
        self.symbolic.moves_of(&mut self.words, parts, &mut moves)?;
        let one = moves.iter().find(|one| one.parts == parts);
        let one = one.ok_or(Unscheduled::Impossible)?;
        let mut words = self.words.clone();
        let effect = self.symbolic.fire(one, &mut words)?;
        let effect = effect.ok_or(Unscheduled::Impossible)?;
        self.require_all(event, &effect.guard)?;
        for conjunction in &effect.excluded {
            let broken = conjunction.iter().map(|one| one.negated());
            let broken = broken.filter_map(|one| self.limit(event, one));
            let broken: Alternatives = broken.map(|one| vec![one]).collect();
            self.alternatives.push(broken);
        }
        self.words = words;
        for assignment in &effect.assignments {
            match *assignment {
                Assignment::Value { clock, value } => {
                    self.set[clock] = (event, i64::from(value));
                    self.ran[clock].clear();
                }
                Assignment::Copy {
                    clock,
                    source,
                    increment,
                } => {
                    let (since, value) = self.set[source];
                    self.set[clock] = (since, value + i64::from(increment));
                    let ran = self.ran[source].clone();
                    self.ran[clock] = ran;
                    // No clock is negative.
                    self.require_all(event, &[at_least_zero(clock)])?;
                }
            }
        }
        self.require_all(event, &effect.invariant)?;
        self.keep_at(event)
    }

    fn require_all(&mut self, event: usize, all: &[Constraint]) -> Result<(), Unscheduled> {
        for &one in all {
            if let Some(limit) = self.limit(event, one) {
                self.require_limit(&limit)?;
            }
        }
        Ok(())
    }

    fn require(&mut self, distance: Distance) -> Result<(), Unscheduled> {
        self.require_limit(&Limit::Apart(distance))
    }

    fn require_limit(&mut self, limit: &Limit) -> Result<(), Unscheduled> {
        if self.solver.require(limit)? {
            Ok(())
        } else {
            Err(Unscheduled::Impossible)
        }
    }

    /// The clock values at an event lie in the federation.
    fn require_part(&mut self, event: usize, part: &Federation) -> Result<(), Unscheduled> {
        let alternatives: Alternatives = part
            .zones()
            .map(|zone| {
                let mut limits = Vec::new();
                minimal::for_each_minimal(zone, part.dimension(), |one| {
                    limits.extend(self.limit(event, one));
                });
                limits
            })
            .collect();
        match alternatives.as_slice() {
            [] => Err(Unscheduled::Impossible),
            [only] => only.iter().try_for_each(|limit| self.require_limit(limit)),
            _ => {
                self.alternatives.push(alternatives);
                Ok(())
            }
        }
    }

    /// The wait between two events does not pass through the zone; with `may_meet` it may end in
    /// the zone's first moment.
    ///
    /// All bounds of the closed zone count, not only the minimal ones. Suppose that a lower bound
    /// is first met after an upper one has failed: then the bound on their difference, which
    /// follows from the two, shows it.
    fn avoid(&mut self, wait: Range<usize>, zone: &[Bound], may_meet: bool) {
        let dimension = self.symbolic.dimension();
        let mut alternatives = Alternatives::new();
        for (index, &bound) in zone.iter().enumerate() {
            let (left, right) = (index / dimension, index % dimension);
            if left == right || bound.is_infinite() {
                continue;
            }
            let is_lower = left == 0;
            let failing = if is_lower && may_meet {
                // The wait ends at the latest when the lower bound is met.
                Constraint {
                    left: right,
                    right: 0,
                    bound: Bound::weak(-bound.value()).unwrap_or(Bound::INFINITY),
                }
            } else {
                let one = Constraint { left, right, bound };
                one.negated()
            };
            // A lower bound fails until the end, and an upper one fails from the start on. A bound
            // on a difference fails all the time if it fails at both ends: it changes in one
            // direction if one of the clocks stands still, and otherwise not at all.
            let events = match (left, right) {
                (0, _) => vec![wait.end],
                (_, 0) => vec![wait.start],
                _ if matches!(self.solver, Solver::Times(_)) => vec![wait.start],
                _ => vec![wait.start, wait.end],
            };
            let limits = events.into_iter().map(|event| self.limit(event, failing));
            alternatives.extend(limits.collect::<Option<Vec<Limit>>>());
        }
        if may_meet {
            // A wait of no length meets nothing new.
            alternatives.push(vec![Limit::Apart(Distance {
                earlier: wait.end,
                later: wait.start,
                apart: (0, 0),
            })]);
        }
        self.alternatives.push(alternatives);
    }

    /// A constraint on the clock values at an event as one on times or durations; `None` for one
    /// that says nothing.
    fn limit(&self, event: usize, one: Constraint) -> Option<Limit> {
        if one.bound.is_infinite() {
            return None;
        }
        Some(match self.solver {
            Solver::Times(_) => Limit::Apart(self.distance(event, one)),
            Solver::Durations(_) => Limit::Linear(self.linear(event, one)),
        })
    }

    /// The value of a clock is what it was set to and the waits in which it ran.
    fn linear(&self, event: usize, one: Constraint) -> LinearBound {
        let waits = |clock: usize, other: usize| {
            let ran = self.ran[clock].iter().copied();
            let ran = ran.filter(|&wait| wait < event);
            ran.filter(|wait| self.ran[other].binary_search(wait).is_err())
                .collect()
        };
        let offset = |clock: usize| if clock == 0 { 0 } else { self.set[clock].1 };
        let bound = i64::from(one.bound.value()) - offset(one.left) + offset(one.right);
        LinearBound {
            plus: waits(one.right, one.left),
            minus: waits(one.left, one.right),
            least: (-bound, i64::from(one.bound.is_strict())),
        }
    }

    fn distance(&self, event: usize, one: Constraint) -> Distance {
        // A clock's value is `times[event] - times[since] + offset`.
        let (left, right) = (self.set[one.left], self.set[one.right]);
        let bound = i64::from(one.bound.value());
        let (later, earlier, bound) = match (one.left, one.right) {
            (_, 0) => (left.0, event, bound - left.1),
            (0, _) => (event, right.0, bound + right.1),
            _ => (left.0, right.0, bound - left.1 + right.1),
        };
        Distance {
            earlier,
            later,
            apart: (-bound, i64::from(one.bound.is_strict())),
        }
    }

    fn solve(mut self) -> Result<Schedule, Unscheduled> {
        self.choose()?;
        let (times, ticks_per_unit) = self.solver.in_ticks(&self.alternatives)?;
        let ticks = |event: usize| times[event];
        Ok(Schedule {
            ticks_per_unit,
            moves: self.moves.iter().map(|&event| ticks(event)).collect(),
            from: ticks(self.look),
            end: ticks(self.end),
        })
    }

    /// Finds times that satisfy one of each alternatives.
    fn choose(&mut self) -> Result<(), Unscheduled> {
        // For each decision: its alternatives, the next one to try, and the state before.
        let mut decisions: Vec<(usize, usize, Mark)> = Vec::new();
        let mut attempts = 0;
        while let Some(violated) = self.first_violated()? {
            decisions.push((violated, 0, self.solver.mark()));
            loop {
                let Some((index, next, mark)) = decisions.last_mut() else {
                    return Err(Unscheduled::Impossible);
                };
                self.solver.undo(*mark)?;
                let Some(limits) = self.alternatives[*index].get(*next) else {
                    decisions.pop();
                    continue;
                };
                *next += 1;
                attempts += 1;
                if attempts > MOST_ATTEMPTS {
                    return Err(Unscheduled::TooHard);
                }
                if self.solver.require_all(limits)? {
                    break;
                }
            }
        }
        Ok(())
    }

    fn first_violated(&self) -> Result<Option<usize>, TooHard> {
        for (index, ways) in self.alternatives.iter().enumerate() {
            let mut is_met = false;
            for way in ways {
                is_met |= self.solver.are_met(way)?;
            }
            if !is_met {
                return Ok(Some(index));
            }
        }
        Ok(None)
    }
}

fn at_least_zero(clock: usize) -> Constraint {
    Constraint {
        left: 0,
        right: clock,
        bound: Bound::LE_ZERO,
    }
}
