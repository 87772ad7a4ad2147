//! Replaying a run: exact waits and moves, step by step, and what is claimed about it.
//!
//! A run is right if
//! * time may pass in every state for as long as the run waits in it: the invariants hold at its
//!   end (they are conjunctions of comparisons, so they hold before), no location is urgent, and no
//!   synchronisation on an urgent channel becomes enabled before the end of the wait;
//! * every move is one of the possible moves of the state, of the highest priority;
//! * it ends as it says: in a loop, if its last state and the state to which it leads back lie in
//!   the same region ([`super::regions`]; with stopwatches if their relevant values are the same),
//!   so that the same moves are possible again and again; waiting forever; or without any move, now
//!   or after any wait.
//!
//! What must hold during a wait is checked at all moments at which something may change
//! ([`super::moments`]).
//!
//! Cost: each step is visited once; a region for each loop.

use std::collections::HashMap;

use crate::ir::{Measure, Network, Predicate};

use super::concrete::Semantics;
use super::moments::{self, Moments};
use super::moves::{Error, Move, Part, State};
use super::regions::{Bounding, Regions};

/// A wait and the move after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// How long the run waits first, in ticks.
    pub wait: i64,
    /// The move.
    pub parts: Vec<Part>,
}

/// How a run ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// In its last state, after waiting this number of ticks.
    After(i64),
    /// Its last state is one of the same region as the state with this index (the first is 0), on
    /// entry of both.
    Loop(usize),
    /// After this number of ticks in its last state, time continues forever.
    Waits(i64),
    /// After this number of ticks in its last state, nothing is possible any more.
    Stuck(i64),
}

/// A moment of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment {
    /// The index of the state; the first is 0.
    pub state: usize,
    /// How long the run has been in it, in ticks.
    pub wait: i64,
}

/// A run from the initial state.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// How many ticks make one unit of the model's time.
    pub ticks_per_unit: i64,
    /// The steps.
    pub steps: Vec<Step>,
    /// How it ends.
    pub end: End,
    /// From which moment on what must stay does; the first but for `-->`.
    pub from: Moment,
}

/// A least or greatest value that a run shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// The value.
    pub value: i64,
    /// Whether it is the greatest.
    pub is_greatest: bool,
    /// Whether the run has the value; otherwise it comes nearer to it than 1.
    pub is_reached: bool,
}

/// What a run is said to show.
#[derive(Clone, Copy, Debug)]
pub enum Claim<'a> {
    /// That the model allows it.
    Possible,
    /// At its end the predicate holds.
    Reaches(&'a Predicate),
    /// The first predicate holds at [`Run::from`], and the second from there on forever.
    Stays(&'a Predicate, &'a Predicate),
    /// At its end the predicate holds, and the measure has the value.
    Takes(&'a Predicate, &'a Measure, Shown),
}

/// What was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// States on entry.
    pub states: u64,
    /// Moves.
    pub moves: u64,
    /// Moments of waits.
    pub moments: u64,
}

/// What is wrong with a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// A wait is negative, or the end or the moment from which something holds is not part of the
    /// run.
    Malformed,
    /// Time cannot pass here, or not so long.
    NoTime,
    /// The move is not possible here.
    NoMove,
    /// The goal does not hold at the end.
    NotReached,
    /// What is to hold at the moment from which something stays does not.
    NotOpen,
    /// What must stay does not hold here.
    NotKept,
    /// The last state is not like the one that it is said to lead back to.
    NoLoop,
    /// Time does not go on forever here.
    NotEndless,
    /// Something is possible here.
    NotStuck,
    /// The measure has another value.
    OtherValue,
}

/// A run that is not right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// What is wrong.
    pub defect: Defect,
    /// The state in which it is; the first is 0.
    pub state: usize,
}

/// How a replay ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The run is right. The states on entry, in ticks of the run; and, if it waits in the last,
    /// the one after the wait.
    Replayed(Vec<State>, Coverage),
    /// It is not.
    Violated(Violation),
}

/// Replays a run. The network must hold the code of the claim.
pub fn replay(network: &Network, run: &Run, claim: &Claim<'_>) -> Result<Outcome, Error> {
    let predicates: Vec<&Predicate> = match *claim {
        Claim::Possible => Vec::new(),
        Claim::Reaches(goal) => vec![goal],
        Claim::Stays(open, keep) => vec![open, keep],
        Claim::Takes(predicate, ..) => vec![predicate],
    };
    let violated = |defect, state| Outcome::Violated(Violation { defect, state });
    // An even number of ticks: there is one between each two moments.
    let Some(ticks_per_unit) = run.ticks_per_unit.checked_mul(2).filter(|&ticks| ticks > 0) else {
        return Ok(violated(Defect::Malformed, 0));
    };
    let mut replay = Replay {
        semantics: Semantics::new(network, ticks_per_unit),
        moments: Moments::new(network, &predicates)?,
        keep: match *claim {
            Claim::Stays(_, keep) => Some(keep),
            _ => None,
        },
        from: run.from,
        states: Vec::new(),
        coverage: Coverage::default(),
    };
    let result = replay.run(run, claim, &predicates)?;
    let at_last = replay.states.len().saturating_sub(1);
    if let Err(defect) = result {
        return Ok(violated(defect, at_last));
    }
    let mut states = replay.states;
    for clock in states.iter_mut().flat_map(|state| &mut state.clocks) {
        *clock /= 2;
    }
    Ok(Outcome::Replayed(states, replay.coverage))
}

/// What became of a part of a run.
type Checked = Result<Result<(), Defect>, Error>;

/// Ends a check with what is wrong.
macro_rules! sound {
    ($checked:expr) => {
        if let Err(defect) = $checked {
            return Ok(Err(defect));
        }
    };
}

struct Replay<'a> {
    semantics: Semantics<'a>,
    moments: Moments,
    keep: Option<&'a Predicate>,
    from: Moment,
    /// The states on entry, so far.
    states: Vec<State>,
    coverage: Coverage,
}

impl Replay<'_> {
    fn run(&mut self, run: &Run, claim: &Claim<'_>, predicates: &[&Predicate]) -> Checked {
        let initial = self.semantics.initial()?;
        self.enter(initial);
        for (index, step) in run.steps.iter().enumerate() {
            sound!(self.wait(index, Some(step.wait), claim)?);
            let Some(target) = self.target(index, step)? else {
                return Ok(Err(Defect::NoMove));
            };
            self.coverage.moves += 1;
            self.enter(target);
        }
        let last = run.steps.len();
        if self.from.state > last {
            return Ok(Err(Defect::Malformed));
        }
        match run.end {
            End::After(wait) => {
                sound!(self.wait(last, Some(wait), claim)?);
                let end = self.later(&self.states[last], wait)?;
                sound!(self.reached(&end, claim)?);
                self.arrive(end, wait);
                Ok(Ok(()))
            }
            End::Loop(start) => self.looped(start, claim, predicates),
            End::Waits(wait) => {
                sound!(self.wait(last, Some(wait), claim)?);
                sound!(self.wait(last, None, claim)?);
                self.arrive(self.later(&self.states[last], wait)?, wait);
                Ok(never_ending(claim))
            }
            End::Stuck(wait) => {
                sound!(self.wait(last, Some(wait), claim)?);
                let end = self.later(&self.states[last], wait)?;
                sound!(self.stuck(&end)?);
                self.arrive(end, wait);
                Ok(never_ending(claim))
            }
        }
    }

    fn enter(&mut self, state: State) {
        self.coverage.states += 1;
        self.states.push(state);
    }

    /// Notes the state at the end of the last wait.
    fn arrive(&mut self, end: State, wait: i64) {
        if wait > 0 {
            self.states.push(end);
        }
    }

    /// The state after a wait in ticks of the run.
    fn later(&self, state: &State, wait: i64) -> Result<State, Error> {
        self.semantics.after(state, 2 * wait)
    }

    /// Whether time may pass in the state with this index so long, or forever, and what must hold
    /// does meanwhile.
    fn wait(&mut self, index: usize, wait: Option<i64>, claim: &Claim<'_>) -> Checked {
        if wait.is_some_and(|wait| wait < 0) {
            return Ok(Err(Defect::Malformed));
        }
        let state = self.states[index].clone();
        // The part of the wait in which something must stay.
        let kept_from = match self.keep {
            Some(_) if self.from.state < index => Some(0),
            Some(_) if self.from.state == index => Some(2 * self.from.wait),
            _ => None,
        };
        if self.from.state == index {
            let is_outside = wait.is_some_and(|wait| self.from.wait > wait);
            if self.from.wait < 0 || is_outside {
                return Ok(Err(Defect::Malformed));
            }
            if let Claim::Stays(open, _) = *claim
                && !self.holds(open, &self.later(&state, self.from.wait)?)?
            {
                return Ok(Err(Defect::NotOpen));
            }
        }
        let limit = wait.map(|wait| 2 * wait);
        for moment in self.moments_of(&state, limit, kept_from)? {
            self.coverage.moments += 1;
            let now = self.semantics.after(&state, moment)?;
            if !self.semantics.invariants_hold(&now)? {
                return Ok(Err(Defect::NoTime));
            }
            if let Some(keep) = self.keep
                && kept_from.is_some_and(|from| moment >= from)
                && !self.holds(keep, &now)?
            {
                return Ok(Err(Defect::NotKept));
            }
            if limit.is_none_or(|limit| moment < limit) && self.is_time_stopped(&now)? {
                let defect = if wait.is_none() {
                    Defect::NotEndless
                } else {
                    Defect::NoTime
                };
                return Ok(Err(defect));
            }
        }
        Ok(Ok(()))
    }

    /// The moments of a wait at which something must be checked.
    fn moments_of(
        &self,
        state: &State,
        limit: Option<i64>,
        kept_from: Option<i64>,
    ) -> Result<Vec<i64>, Error> {
        let features = &self.semantics.network().features;
        let is_kept = kept_from.is_some() && self.keep.is_some_and(|keep| !keep.is_of_words());
        let mut moments = match limit {
            Some(0) => vec![0],
            Some(limit) if !features.clock_guarded_urgent && !is_kept => vec![0, limit],
            _ => {
                let is_stopped = self.semantics.stopped(state)?;
                let unit = self.semantics.ticks_per_unit();
                self.moments.of(state, &is_stopped, unit, limit)?
            }
        };
        moments.extend(kept_from.filter(|&from| limit.is_none_or(|limit| from <= limit)));
        moments.sort_unstable();
        moments.dedup();
        Ok(moments)
    }

    fn is_time_stopped(&self, state: &State) -> Result<bool, Error> {
        let moves = self.semantics.moves(state)?;
        Ok(self.semantics.is_time_stopped(state, &moves))
    }

    /// The target of a step, if it is possible.
    fn target(&self, index: usize, step: &Step) -> Result<Option<State>, Error> {
        let source = self.later(&self.states[index], step.wait)?;
        let successors = self.semantics.successors(&source)?;
        let mut successors = successors.into_iter();
        let is_step = |(one, _): &(Move, State)| one.parts == step.parts;
        Ok(successors.find(is_step).map(|(_, target)| target))
    }

    fn holds(&self, predicate: &Predicate, state: &State) -> Result<bool, Error> {
        let deadlock = || self.is_dead(state);
        self.semantics.holds_where(predicate, state, &deadlock)
    }

    /// Whether no move is possible, now or after any wait.
    fn is_dead(&self, state: &State) -> Result<bool, Error> {
        Ok(self.waits_without_moves(state, None)?.is_ok())
    }

    fn stuck(&self, state: &State) -> Checked {
        self.waits_without_moves(state, self.keep)
    }

    /// Whether, for as long as time may pass, no move is possible and the predicate stays.
    fn waits_without_moves(&self, state: &State, keep: Option<&Predicate>) -> Checked {
        let is_stopped = self.semantics.stopped(state)?;
        let unit = self.semantics.ticks_per_unit();
        let moments = self.moments.of(state, &is_stopped, unit, None)?;
        for (index, moment) in moments.into_iter().enumerate() {
            let now = self.semantics.after(state, moment)?;
            if !self.semantics.invariants_hold(&now)? {
                break;
            }
            // Between two changes: no moment of this kind is the first, so time stops before all of
            // them.
            if index % 2 == 1 && self.is_time_stopped(&now)? {
                break;
            }
            if !self.semantics.successors(&now)?.is_empty() {
                return Ok(Err(Defect::NotStuck));
            }
            if let Some(keep) = keep
                && !self.holds(keep, &now)?
            {
                return Ok(Err(Defect::NotKept));
            }
            if self.is_time_stopped(&now)? {
                break;
            }
        }
        Ok(Ok(()))
    }

    /// Whether the end shows what it is said to.
    fn reached(&self, end: &State, claim: &Claim<'_>) -> Checked {
        let is_shown = match *claim {
            Claim::Possible => true,
            Claim::Reaches(goal) => self.holds(goal, end)?,
            // A run that ends does not stay forever.
            Claim::Stays(..) => return Ok(Err(Defect::NotEndless)),
            Claim::Takes(predicate, measure, shown) => {
                if self.holds(predicate, end)? && !self.shows(measure, shown, end)? {
                    return Ok(Err(Defect::OtherValue));
                }
                self.holds(predicate, end)?
            }
        };
        Ok(if is_shown {
            Ok(())
        } else {
            Err(Defect::NotReached)
        })
    }

    fn shows(&self, measure: &Measure, shown: Shown, end: &State) -> Result<bool, Error> {
        let unit = self.semantics.ticks_per_unit();
        let value = match *measure {
            Measure::Integer(function) => unit * i64::from(self.semantics.value(function, end)?),
            Measure::Clock(choice) => {
                let clock = self.semantics.code.chosen_clock(choice, &end.words)?;
                end.clocks[clock.0 as usize]
            }
        };
        let missing = if shown.is_greatest {
            shown.value * unit - value
        } else {
            value - shown.value * unit
        };
        Ok(if shown.is_reached {
            missing == 0
        } else {
            0 < missing && missing < unit
        })
    }

    /// Whether the last state leads back to the one with this index, and the loop lies where
    /// something must stay.
    fn looped(&mut self, start: usize, claim: &Claim<'_>, predicates: &[&Predicate]) -> Checked {
        let last = self.states.len() - 1;
        let head = Moment {
            state: start,
            wait: 0,
        };
        if start >= last || self.from > head {
            return Ok(Err(Defect::Malformed));
        }
        sound!(self.wait(last, Some(0), claim)?);
        let network = self.semantics.network();
        let unit = self.semantics.ticks_per_unit();
        let heads = [&self.states[start], &self.states[last]];
        if repeated(network, &heads, unit, predicates)?.is_none() {
            return Ok(Err(Defect::NoLoop));
        }
        Ok(never_ending(claim))
    }
}

/// Whether a run without end may show the claim.
fn never_ending(claim: &Claim<'_>) -> Result<(), Defect> {
    match claim {
        Claim::Possible | Claim::Stays(..) => Ok(()),
        Claim::Reaches(_) | Claim::Takes(..) => Err(Defect::NotReached),
    }
}

/// The regions that also distinguish the predicates.
fn regions_for(network: &Network, predicates: &[&Predicate]) -> Result<Regions, Error> {
    let (constant, has_differences) = moments::constants(predicates);
    if network.features.stopwatches {
        return Ok(Regions::of_values(network, constant, has_differences));
    }
    Regions::new(network, constant, has_differences)
}

/// A value above which [`repeated`] does not tell those of a clock apart, if there is one.
pub fn indifferent_above(network: &Network, predicates: &[&Predicate]) -> Option<i64> {
    match regions_for(network, predicates).ok()?.bounding() {
        Bounding::Values(constant) => Some(constant),
        Bounding::Gaps(_) | Bounding::Nothing => None,
    }
}

/// The indices of two states in the same region, the first state and a later one; `None` if all
/// regions differ. The regions also distinguish the predicates. With stopwatches regions are single
/// values.
pub fn repeated(
    network: &Network,
    states: &[&State],
    ticks_per_unit: i64,
    predicates: &[&Predicate],
) -> Result<Option<(usize, usize)>, Error> {
    // As many ticks as the ranks of the fractions need.
    let scale = 1 + Regions::ticks_per_unit(network) / ticks_per_unit;
    let regions = regions_for(network, predicates)?;
    let regions = regions.with_ticks_per_unit(scale * ticks_per_unit);
    let identity = network.layout.identity_words as usize;
    let mut seen = HashMap::new();
    for (index, state) in states.iter().enumerate() {
        let mut state = (*state).clone();
        state.words.truncate(identity);
        state.clocks.iter_mut().for_each(|clock| *clock *= scale);
        regions.represent_state(&mut state);
        if let Some(first) = seen.insert(state, index) {
            return Ok(Some((first, index)));
        }
    }
    Ok(None)
}
