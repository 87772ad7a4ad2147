//! From a symbolic trace to a run with exact times that was replayed independently.
//!
//! The search leaves a sequence of moves, and how it ends. [`crate::search::timed_trace::schedule`]
//! finds times for it, and [`crate::verify::replay`] follows the run and checks what it is said to
//! show. A run that fails there is a mistake of the engine.
//!
//! The loop of a run that never ends is found by taking the loop of the trace ever more often: the
//! earliest times settle into a pattern, and then two states on entry of the loop lie in the same
//! region.

use crate::ir::{Measure, Predicate};
use crate::network::{Failure, Part, Symbolic};
use crate::search::Trace;
use crate::search::liveness::ending::RunEnding;
use crate::search::timed_trace::schedule::{
    self, Closing, Finish, Schedule, Stays, Unscheduled, Wanted,
};
use crate::verify::State;
use crate::verify::replay::{self, Claim, End, Moment, Outcome, Run, Shown, Step};
use crate::zones::dbm::Constraint;

use super::witness::{Missing, Proof};

/// The greatest number of rounds of the loop of a trace.
const MOST_ROUNDS: usize = 64;

/// The greatest number of moves of a run when its loop is repeated.
const MOST_MOVES: usize = 20_000;

/// What a trace shows.
#[derive(Clone, Copy, Debug)]
pub enum Shows<'q> {
    /// That the model allows it.
    Possible,
    /// A state in which the predicate holds; at the latest at this time: see [`Wanted::deadline`].
    Reaches(&'q Predicate, Option<(i32, u32)>),
    /// A run that stays inside a predicate.
    Stays(Stays<'q>),
    /// A state in which the predicate holds and an item has a value.
    Takes(Takes<'q>),
}

/// What a trace to a value shows.
#[derive(Clone, Copy, Debug)]
pub struct Takes<'q> {
    /// The index of the item.
    pub item: usize,
    /// What is measured.
    pub measure: &'q Measure,
    /// What holds where it is.
    pub predicate: &'q Predicate,
    /// The value.
    pub shown: Shown,
    /// What the value asks of the clocks.
    pub constraints: &'q [Constraint],
    /// The time of the end at the latest: see [`Wanted::deadline`].
    pub deadline: Option<(i32, u32)>,
}

/// A trace of which it is to be proved that it shows something.
#[derive(Clone, Copy, Debug)]
pub struct ToProve<'t> {
    /// The symbolic run.
    pub trace: &'t Trace,
    /// Why it never ends, if it does not.
    pub ending: Option<RunEnding>,
    /// What it shows.
    pub shows: Shows<'t>,
    /// Whether there may be no run.
    pub is_doubtful: bool,
}

/// Finds times for a trace and replays it.
pub fn prove(symbolic: &mut Symbolic<'_>, what: ToProve<'_>) -> Proof {
    let ToProve {
        trace,
        ending,
        shows,
        is_doubtful,
    } = what;
    let network = symbolic.stepper.network();
    let result = match (shows, ending) {
        (Shows::Stays(stays), Some(RunEnding::Loop(start))) => {
            let lasso = Lasso::new(trace, start, stays);
            if network.features.stopwatches {
                lasso.closed(symbolic)
            } else {
                lasso.looped(symbolic)
            }
        }
        (Shows::Stays(stays), ending) => {
            let finish = if ending == Some(RunEnding::Waits) {
                Finish::Waits
            } else {
                Finish::Stuck
            };
            timed(
                symbolic,
                &Wanted {
                    stays: Some(stays),
                    ..wanted(&trace.moves, finish)
                },
            )
        }
        (Shows::Possible, _) => timed(symbolic, &wanted(&trace.moves, Finish::Entry)),
        (Shows::Reaches(goal, deadline), _) => {
            let finish = Finish::Holds(goal, Vec::new());
            timed(
                symbolic,
                &Wanted {
                    deadline,
                    ..wanted(&trace.moves, finish)
                },
            )
        }
        (Shows::Takes(takes), _) => {
            let finish = Finish::Holds(takes.predicate, takes.constraints.to_vec());
            timed(
                symbolic,
                &Wanted {
                    deadline: takes.deadline,
                    ..wanted(&trace.moves, finish)
                },
            )
        }
    };
    let has_meta = network.layout.variables.iter().any(|one| one.meta);
    let run = match result {
        Ok(run) => run,
        Err(Missing::Approximate) if !is_doubtful && has_meta => {
            return Proof::Missing(Missing::Meta);
        }
        Err(Missing::Approximate) if !is_doubtful => return Proof::Impossible,
        Err(missing) => return Proof::Missing(missing),
    };
    let always = Predicate::Constant(true);
    let claim = match shows {
        Shows::Possible => Claim::Possible,
        Shows::Reaches(goal, _) => Claim::Reaches(goal),
        Shows::Stays(Stays { from, keep }) => {
            Claim::Stays(from.map_or(&always, |(_, open)| open), keep)
        }
        Shows::Takes(takes) => Claim::Takes(takes.predicate, takes.measure, takes.shown),
    };
    Proof::of(network, run, &claim)
}

impl From<Unscheduled> for Missing {
    fn from(unscheduled: Unscheduled) -> Missing {
        match unscheduled {
            Unscheduled::Impossible => Missing::Approximate,
            Unscheduled::TooHard => Missing::TooHard,
            Unscheduled::Failed(Failure::Interrupted) => Missing::Stopped,
            Unscheduled::Failed(failure) => Missing::Failed(failure),
        }
    }
}

/// A run of these moves that ends so, and of which nothing else is wanted.
pub(crate) fn wanted<'t>(moves: &'t [Vec<Part>], finish: Finish<'t>) -> Wanted<'t> {
    Wanted {
        moves,
        stays: None,
        finish,
        deadline: None,
        closing: None,
    }
}

/// A run with the earliest times.
pub(crate) fn timed(symbolic: &mut Symbolic<'_>, wanted: &Wanted<'_>) -> Result<Run, Missing> {
    let schedule = schedule::schedule(symbolic, wanted)?;
    let Schedule {
        ticks_per_unit,
        moves: times,
        from,
        end,
    } = schedule;
    let mut before = 0;
    let steps = wanted.moves.iter().zip(&times).map(|(parts, &time)| Step {
        wait: time - std::mem::replace(&mut before, time),
        parts: parts.clone(),
    });
    let steps = steps.collect();
    let entered = |state: usize| state.checked_sub(1).map_or(0, |last| times[last]);
    let last = end - entered(times.len());
    let from_state = wanted
        .stays
        .and_then(|stays| stays.from)
        .map_or(0, |from| from.0);
    Ok(Run {
        ticks_per_unit,
        steps,
        end: match wanted.finish {
            Finish::Entry | Finish::Holds(..) => End::After(last),
            Finish::Waits => End::Waits(last),
            Finish::Stuck => End::Stuck(last),
        },
        from: Moment {
            state: from_state,
            wait: from - entered(from_state),
        },
    })
}

/// The greatest number of rounds of a loop before the one in which a run with stopwatches closes
/// it.
const MOST_EARLIER_ROUNDS: usize = 3;

/// A trace that ends in a loop.
struct Lasso<'t> {
    /// The moves before the loop.
    stem: &'t [Vec<Part>],
    /// The moves of the loop.
    cycle: &'t [Vec<Part>],
    /// What stays during the run.
    stays: Stays<'t>,
    /// What is asked of its states.
    predicates: Vec<&'t Predicate>,
}

impl<'t> Lasso<'t> {
    fn new(trace: &'t Trace, start: usize, stays: Stays<'t>) -> Lasso<'t> {
        let (stem, cycle) = trace.moves.split_at(start);
        let open = stays.from.map(|(_, open)| open);
        Lasso {
            stem,
            cycle,
            stays,
            predicates: open.into_iter().chain([stays.keep]).collect(),
        }
    }

    /// The moves, with the loop taken so often.
    fn moves(&self, rounds: usize) -> Vec<Vec<Part>> {
        let mut moves = self.stem.to_vec();
        for _ in 0..rounds {
            moves.extend_from_slice(self.cycle);
        }
        moves
    }

    /// The state on entry of the loop after this number of rounds.
    fn head(&self, rounds: usize) -> usize {
        self.stem.len() + rounds * self.cycle.len()
    }

    /// The run in a network with stopwatches: after some rounds of the loop, one more comes back to
    /// the same values.
    fn closed(&self, symbolic: &mut Symbolic<'_>) -> Result<Run, Missing> {
        let above = replay::indifferent_above(symbolic.stepper.network(), &self.predicates);
        for earlier in 0..=MOST_EARLIER_ROUNDS {
            let head = self.head(earlier);
            let moves = self.moves(earlier + 1);
            let run = timed(
                symbolic,
                &Wanted {
                    stays: Some(self.stays),
                    closing: Some(Closing { head, above }),
                    ..wanted(&moves, Finish::Entry)
                },
            );
            let entry = Moment {
                state: head,
                wait: 0,
            };
            match run {
                Ok(mut run) if run.from <= entry => {
                    run.end = End::Loop(head);
                    return Ok(run);
                }
                Ok(_) | Err(Missing::Approximate) => {}
                Err(missing) => return Err(missing),
            }
        }
        Err(Missing::OpenLoop)
    }

    /// The run with the loop taken as often as it needs to close.
    fn looped(&self, symbolic: &mut Symbolic<'_>) -> Result<Run, Missing> {
        let network = symbolic.stepper.network();
        let mut rounds = 1;
        while rounds <= MOST_ROUNDS && self.head(rounds) <= MOST_MOVES {
            let moves = self.moves(rounds);
            let mut run = timed(
                symbolic,
                &Wanted {
                    stays: Some(self.stays),
                    ..wanted(&moves, Finish::Entry)
                },
            )?;
            let replayed = replay::replay(network, &run, &Claim::Possible);
            let states = match replayed.map_err(Missing::NotCovered)? {
                Outcome::Replayed(states, _) => states,
                // The replay of the whole run says what is wrong.
                Outcome::Violated(_) => return Ok(run),
            };
            let mut heads: Vec<usize> = (0..=rounds).map(|round| self.head(round)).collect();
            heads.retain(|&state| run.from <= Moment { state, wait: 0 });
            let at_heads: Vec<&State> = heads.iter().map(|&head| &states[head]).collect();
            let unit = run.ticks_per_unit;
            let found = replay::repeated(network, &at_heads, unit, &self.predicates);
            if let Some((first, last)) = found.map_err(Missing::NotCovered)? {
                run.steps.truncate(heads[last]);
                run.end = End::Loop(heads[first]);
                return Ok(run);
            }
            rounds *= 2;
        }
        Err(Missing::OpenLoop)
    }
}
