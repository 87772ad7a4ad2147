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

use super::outcomes::{Context, Entries};
use super::unfolded::{Found, Lottery, NotFinite, Rivals, Unfolded, known};
use super::{Next, Race};
use crate::ir::{Aim, Urgency};
use crate::stochastic::advice::Advice;
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::Failure;
use crate::stochastic::program::Program;

impl Race<'_> {
    /// What the state says of the value.
    pub(in crate::stochastic) fn worth(&mut self, aim: Aim) -> Result<f64, Failure> {
        self.machine.view_of_state().worth(aim, self.time)
    }

    /// Goes to a state of which all is asked that may come next; without it if that is not finite.
    pub(in crate::stochastic) fn go_to(
        &mut self,
        program: &Program<'_>,
        words: &[i32],
        (time, moves): (f64, u64),
    ) -> Found<()> {
        self.machine.restore(words);
        (self.time, self.moves) = (time, moves);
        self.resume(program)?;
        let flows = self.motion.is_flowing();
        Ok(if flows { Err(NotFinite::Flow) } else { Ok(()) })
    }

    /// Who may move next if the run lasts so long from now on; no plan was made before.
    pub(in crate::stochastic) fn first_rivals(
        &mut self,
        program: &Program<'_>,
        rest: f64,
    ) -> Found<Rivals> {
        self.rest = rest;
        self.take_advice(program)?;
        self.look_for_decisions(program);
        self.rivals(program, rest)
    }

    /// Why the run fails in which nobody moves after that, if it does.
    pub(in crate::stochastic) fn lock_of(&self, rivals: &Rivals) -> Option<Failure> {
        self.time_lock(Next {
            delay: rivals.delay,
            winner: None,
            stopped_by: rivals.stopped_by,
        })
    }

    /// Lets time pass until the rivals move; not finite if a strategy may demand moves meanwhile.
    pub(in crate::stochastic) fn wait_for_rivals(&mut self, delay: f64) -> Found<()> {
        if delay > TOLERANCE && self.has_decisions() {
            return Ok(Err(NotFinite::Demand));
        }
        self.wait(delay)?;
        self.take_advice_again();
        Ok(Ok(()))
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

    /// Takes those out of the race whose delays would be drawn; returns when the first of them
    /// could move, and who.
    fn set_drawn_apart(&mut self) -> Option<(f64, usize)> {
        let drawn = self.drawn.as_ref().expect("nothing is drawn");
        let mut earliest: Option<(f64, usize)> = None;
        for (process, &is_drawn) in drawn.of_process.iter().enumerate() {
            if !is_drawn {
                continue;
            }
            let low = std::mem::replace(&mut self.attempts[process], f64::INFINITY);
            if low.is_finite() && earliest.is_none_or(|(known, _)| low < known) {
                earliest = Some((low, process));
            }
        }
        earliest
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
    pub(in crate::stochastic) fn go_on_from(
        &mut self,
        program: &Program<'_>,
        aim: Aim,
        winners: &[usize],
        before: f64,
        is_asked: bool,
        found: &mut Unfolded,
    ) -> Found<()> {
        let base = self.machine.words().to_vec();
        let mut context = Context { aim, before, base };
        let share = 1.0 / winners.len() as f64;
        let mut decides = None;
        let mut by_chance: Lottery = Vec::new();
        for &winner in winners {
            let is_able = self.find_outputs(program, winner)?
                || self.hurry() && self.find_outputs(program, winner)?;
            if !is_able {
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
        if !is_asked {
            for (instance, chance) in by_chance {
                known!(self.outcomes_of(program, &mut context, instance, chance, found));
            }
        }
        found.chance_end = found.outcomes.len();
        let Some(winner) = decides.filter(|_| is_asked || found.chance_end == 0) else {
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
            let entries = if let Some((_, entries)) = known.take_if(|known| known.0 == process) {
                entries
            } else {
                self.find_outputs(program, process as usize)?;
                self.entries(program)
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
        let waits = self.advice.as_ref().is_none_or(Advice::waits);
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
        // Who could only make a move of the controller tries again until another one wins.
        let mut winners = Vec::new();
        for one in rivals.winners {
            if self.find_outputs(program, one)? {
                winners.push(one);
            }
        }
        if rivals.delay > TOLERANCE || winners.is_empty() {
            return Ok(Err(NotFinite::Wait(self.stand(winner))));
        }
        let share = 1.0 / winners.len() as f64;
        for winner in winners {
            self.find_outputs(program, winner)?;
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
