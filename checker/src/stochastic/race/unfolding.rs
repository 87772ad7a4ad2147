//! All that may come next from a state, with its chances: the race, in which no number is drawn.
//!
//! It goes only where the chances are known without integrals: time stands still, or it is known
//! how long it passes, since the delay of whoever moves next is a *point*. A delay that would be
//! drawn counts as longer than any point that does not lie behind its window, for it is, almost
//! surely.
//!
//! Invariants:
//! * What comes next, and with which chance, is what random runs do (`race/mod.rs`, `run.rs`):
//!   those compete who would, all entries that are enabled are as likely as each other, receivers
//!   too, and legs and branches come by weight.
//! * What a process plans does not depend on when it has planned; so a state is all that counts.

use super::outcomes::{Context, Entries, Found, Lottery, known};
use super::{Next, Race};
use crate::ir::{Aim, Optimum, RunLimit, Urgency};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::{Failure, Stand};
use crate::stochastic::observer::{aim_of, watched};
use crate::stochastic::program::Program;
use crate::stochastic::run::rest;

/// Why a state has no finite number of outcomes with known chances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotFinite {
    /// The delay is drawn of a process that may move next.
    Drawn(Stand),
    /// The controller chooses how long it waits.
    Wait(Stand),
    /// The rates of clocks change as time passes.
    Flow,
    /// An update draws a random number.
    Random(Stand),
    /// Rounding has put the delay of a process beside the times at which it can move.
    Rounded(Stand),
    /// The strategy that is refined demands moves at certain times.
    Demand,
}

/// A state of which all is asked that may come next.
#[derive(Clone, Copy, Debug)]
pub(in crate::stochastic) struct Step<'s> {
    pub(in crate::stochastic) words: &'s [i32],
    /// How long the run has lasted.
    pub(in crate::stochastic) time: f64,
    /// How many moves it has made.
    pub(in crate::stochastic) moves: u64,
    /// Whether the controller is being asked, after chance has decided that it is.
    pub(in crate::stochastic) is_asked: bool,
}

/// What may come next.
#[derive(Clone, Debug, Default)]
pub(in crate::stochastic) struct Unfolded {
    /// What the run is worth beyond what its state says, if it ends here.
    pub(in crate::stochastic) end: Option<f64>,
    /// How long time passes before.
    pub(in crate::stochastic) delay: f64,
    /// The chance that the controller is asked.
    pub(in crate::stochastic) asked: f64,
    /// What it can do, each with the end of its outcomes; the first outcomes are those of nobody's
    /// choice.
    pub(in crate::stochastic) choices: Vec<(Option<u32>, usize)>,
    /// The end of the outcomes of nobody's choice.
    pub(in crate::stochastic) chance_end: usize,
    pub(in crate::stochastic) outcomes: Vec<Outcome>,
    /// The words of the states after the outcomes, one after the other.
    pub(in crate::stochastic) words: Vec<i32>,
}

/// A move that may be made.
#[derive(Clone, Copy, Debug)]
pub(in crate::stochastic) struct Outcome {
    pub(in crate::stochastic) chance: f64,
    /// By how much the value grows.
    pub(in crate::stochastic) gain: f64,
}

impl Unfolded {
    fn clear(&mut self) {
        self.end = None;
        self.delay = 0.0;
        self.asked = 0.0;
        self.choices.clear();
        self.chance_end = 0;
        self.outcomes.clear();
        self.words.clear();
    }
}

/// Who may move next, and when.
struct Rivals {
    delay: f64,
    winners: Vec<usize>,
    stopped_by: Option<usize>,
}

impl Race<'_> {
    /// Finds all that may come next.
    pub(in crate::stochastic) fn unfold(
        &mut self,
        program: &Program<'_>,
        asked: &Optimum,
        step: Step<'_>,
        found: &mut Unfolded,
    ) -> Found<()> {
        found.clear();
        self.machine.restore(step.words);
        (self.time, self.moves) = (step.time, step.moves);
        self.resume(program)?;
        if self.motion.is_flowing() {
            return Ok(Err(NotFinite::Flow));
        }
        let before = self.worth(asked.aim)?;
        let bound = &asked.bound;
        if bound.limit == RunLimit::Moves && self.moves as f64 >= bound.value {
            let (end, ahead) = self.watch(asked, 0.0)?.unwrap_or((false, 0.0));
            found.end = Some(aim_of(self, asked.aim, end, ahead)? - before);
            return Ok(Ok(()));
        }
        let rest = rest(self, bound);
        self.rest = rest;
        self.take_advice(program)?;
        self.look_for_decisions(program);
        let rivals = known!(self.rivals(program, rest));
        let slack = if rest > 0.0 {
            TOLERANCE * bound.value.max(1.0)
        } else {
            TOLERANCE
        };
        let nobody = rivals.winners.is_empty();
        let is_over = rest + slack < rivals.delay
            || (nobody && rest.is_finite() && rest <= rivals.delay + slack);
        let delay = rivals.delay.min(rest).max(0.0);
        if let Some((satisfied, ahead)) = self.watch(asked, delay)? {
            found.end = Some(aim_of(self, asked.aim, satisfied, ahead)? - before);
            return Ok(Ok(()));
        }
        if is_over || nobody {
            if !is_over {
                let next = Next {
                    delay: rivals.delay,
                    winner: None,
                    stopped_by: rivals.stopped_by,
                };
                return match self.time_lock(next) {
                    Some(failure) => Err(failure),
                    None if bound.limit == RunLimit::Moves => {
                        found.end = Some(aim_of(self, asked.aim, false, 0.0)? - before);
                        Ok(Ok(()))
                    }
                    None => Err(Failure::BoundNeverReached),
                };
            }
            self.wait(delay)?;
            found.end = Some(aim_of(self, asked.aim, false, 0.0)? - before);
            return Ok(Ok(()));
        }
        if delay > TOLERANCE && self.has_decisions() {
            return Ok(Err(NotFinite::Demand));
        }
        self.wait(delay)?;
        found.delay = delay;
        self.take_advice_again();
        self.go_on_from(program, asked.aim, &rivals.winners, before, step, found)
    }

    fn watch(&mut self, asked: &Optimum, delay: f64) -> Result<Option<(bool, f64)>, Failure> {
        match &asked.goal {
            Some(goal) => watched(self, goal, delay),
            None => Ok(None),
        }
    }

    /// What the state says of the value.
    pub(super) fn worth(&mut self, aim: Aim) -> Result<f64, Failure> {
        match aim {
            Aim::Probability => Ok(0.0),
            _ => aim_of(self, aim, false, 0.0),
        }
    }

    /// Who may move next, and when; all plans are stale.
    fn rivals(&mut self, program: &Program<'_>, rest: f64) -> Found<Rivals> {
        if self.committed > 0 {
            self.put_plans_off(program)?;
            let mut winners = self.all_with_outputs(program, true)?;
            if winners.is_empty() {
                winners = self.all_with_outputs(program, false)?;
            }
            let mut all = 0..self.locations.len();
            return Ok(Ok(Rivals {
                delay: 0.0,
                winners,
                stopped_by: all.find(|&one| self.urgency(one) == Urgency::Committed),
            }));
        }
        self.plan_anew(program)?;
        if self.standstill.is_some() || self.demand().is_some_and(|demand| demand > TOLERANCE) {
            return Ok(Err(NotFinite::Demand));
        }
        let earliest = self.set_drawn_apart();
        let delay = self.attempts.iter().copied().fold(f64::INFINITY, f64::min);
        let least = self.bounds.iter().copied().fold(f64::INFINITY, f64::min);
        if let Some((low, process)) = earliest
            && delay.min(least).min(rest) > low * (1.0 + TOLERANCE) + TOLERANCE
        {
            return Ok(Err(NotFinite::Drawn(self.stand(process))));
        }
        if delay > least * (1.0 + TOLERANCE) + TOLERANCE {
            let winners = if least <= TOLERANCE {
                self.all_with_outputs(program, false)?
            } else {
                Vec::new()
            };
            return Ok(Ok(Rivals {
                delay: least,
                winners,
                stopped_by: self.bounds.iter().position(|&bound| bound <= least),
            }));
        }
        let latest = delay * (1.0 + TOLERANCE) + TOLERANCE;
        let attempts = self.attempts.iter().enumerate();
        let before = attempts.filter(|one| delay.is_finite() && *one.1 <= latest);
        Ok(Ok(Rivals {
            delay,
            winners: before.map(|(process, _)| process).collect(),
            stopped_by: None,
        }))
    }

    /// The processes with an output that is enabled now, or of those in committed locations.
    fn all_with_outputs(
        &mut self,
        program: &Program<'_>,
        only_committed: bool,
    ) -> Result<Vec<usize>, Failure> {
        let mut all = Vec::new();
        loop {
            for process in 0..self.locations.len() {
                let is_asked = !only_committed || self.urgency(process) == Urgency::Committed;
                if is_asked && self.find_outputs(program, process)? {
                    all.push(process);
                }
            }
            if !all.is_empty() || !self.hurry() {
                return Ok(all);
            }
        }
    }

    /// Finds what the winners may do, now that the delay is over.
    fn go_on_from(
        &mut self,
        program: &Program<'_>,
        aim: Aim,
        winners: &[usize],
        before: f64,
        step: Step<'_>,
        found: &mut Unfolded,
    ) -> Found<()> {
        let base = self.machine.words().to_vec();
        let mut context = Context { aim, before, base };
        let share = 1.0 / winners.len() as f64;
        let mut decides = None;
        let mut by_chance: Lottery = Vec::new();
        for &winner in winners {
            if !self.find_outputs(program, winner)?
                && !(self.hurry() && self.find_outputs(program, winner)?)
            {
                return Ok(Err(NotFinite::Rounded(self.stand(winner))));
            }
            let entries = self.entries(program);
            let each = share / entries.len() as f64;
            for legs in entries.iter() {
                if self.is_decided(program.instance(legs[0])) {
                    found.asked += each;
                    decides = decides.or(Some(winner));
                } else {
                    by_chance.extend(self.of_legs(program, legs, each)?);
                }
            }
        }
        if !step.is_asked {
            for (instance, chance) in by_chance {
                known!(self.outcomes_of(program, &mut context, instance, chance, found));
            }
        }
        found.chance_end = found.outcomes.len();
        let Some(winner) = decides.filter(|_| step.is_asked || found.chance_end == 0) else {
            return Ok(Ok(()));
        };
        self.decisions(program, &mut context, winner, found)
    }

    /// Finds all that the controller can do.
    fn decisions(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        winner: usize,
        found: &mut Unfolded,
    ) -> Found<()> {
        let (moves, others) = self.moves_of_controller(program, winner)?;
        if self.can_time_pass(program, &moves)? {
            return Ok(Err(NotFinite::Wait(self.stand(winner))));
        }
        let mut known: Option<(u32, Entries)> = None;
        for &entry in &moves {
            let process = program.instance(entry).process;
            let entries = match known.take_if(|known| known.0 == process) {
                Some((_, entries)) => entries,
                None => {
                    self.find_outputs(program, process as usize)?;
                    self.entries(program)
                }
            };
            let is_it = |legs: &&[u32]| program.instance(legs[0]).entry == entry;
            let legs = entries.iter().find(is_it);
            let legs = legs.expect("the controller can make the move");
            for (instance, chance) in self.of_legs(program, legs, 1.0)? {
                known!(self.outcomes_of(program, context, instance, chance, found));
            }
            found.choices.push((Some(entry), found.outcomes.len()));
            known = Some((process, entries));
        }
        let waits = self.advice.as_ref().is_none_or(|one| one.waits());
        if let Some(control) = &mut self.control {
            control.moves = moves;
        }
        if others && waits {
            known!(self.outcomes_of_waiting(program, context, winner, found));
            found.choices.push((None, found.outcomes.len()));
        }
        Ok(Ok(()))
    }

    /// What may happen if the controller lets others move where time cannot pass.
    fn outcomes_of_waiting(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        winner: usize,
        found: &mut Unfolded,
    ) -> Found<()> {
        if let Some(control) = &mut self.control {
            control.passes = true;
            control.hold = f64::INFINITY;
        }
        self.make_stale(winner as u32);
        self.take_advice(program)?;
        self.look_for_decisions(program);
        let rivals = known!(self.rivals(program, self.rest));
        if rivals.delay > TOLERANCE || rivals.winners.is_empty() {
            return Ok(Err(NotFinite::Wait(self.stand(winner))));
        }
        let share = 1.0 / rivals.winners.len() as f64;
        for &winner in &rivals.winners {
            if !self.find_outputs(program, winner)? {
                return Ok(Err(NotFinite::Rounded(self.stand(winner))));
            }
            let entries = self.entries(program);
            let each = share / entries.len() as f64;
            for legs in entries.iter() {
                for (instance, chance) in self.of_legs(program, legs, each)? {
                    known!(self.outcomes_of(program, context, instance, chance, found));
                }
            }
        }
        Ok(Ok(()))
    }
}
