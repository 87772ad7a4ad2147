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

use std::collections::BTreeMap;

use super::{Next, Race};
use crate::ir::{Aim, Optimum, ProcessId, RunLimit, STREAM_WORDS, Urgency};
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::{Failure, Stand};
use crate::stochastic::observer::{aim_of, watched};
use crate::stochastic::program::{Instance, Program};
use crate::stochastic::rules;
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

/// Which delays would be drawn.
#[derive(Clone, Debug)]
pub(in crate::stochastic) struct Drawn {
    /// Of the plan that is being made.
    is_drawn: bool,
    of_process: Vec<bool>,
}

impl Drawn {
    pub(in crate::stochastic) fn new(processes: usize) -> Drawn {
        Drawn {
            is_drawn: false,
            of_process: vec![false; processes],
        }
    }

    pub(super) fn note(&mut self, is_drawn: bool) {
        self.is_drawn |= is_drawn;
    }

    /// The plan is that of this process.
    pub(super) fn keep(&mut self, process: usize) {
        self.of_process[process] = std::mem::take(&mut self.is_drawn);
    }
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

/// Some instances, one of which is taken, with their chances.
type Lottery = Vec<(u32, f64)>;

/// Who may move next, and when.
struct Rivals {
    delay: f64,
    winners: Vec<usize>,
    stopped_by: Option<usize>,
}

type Found<T> = Result<Result<T, NotFinite>, Failure>;

/// Goes on with what was found, or returns why nothing can be.
macro_rules! known {
    ($found:expr) => {
        match $found? {
            Ok(known) => known,
            Err(reason) => return Ok(Err(reason)),
        }
    };
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
    fn worth(&mut self, aim: Aim) -> Result<f64, Failure> {
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
                stopped_by: all
                    .find(|&one| self.urgency(one) == Urgency::Committed),
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
                let is_asked =
                    !only_committed || self.urgency(process) == Urgency::Committed;
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
            for legs in entries.values() {
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
        for &entry in &moves {
            let process = program.instance(entry).process as usize;
            self.find_outputs(program, process)?;
            let entries = self.entries(program);
            let legs = entries.get(&entry).cloned().unwrap_or_default();
            for (instance, chance) in self.of_legs(program, &legs, 1.0)? {
                known!(self.outcomes_of(program, context, instance, chance, found));
            }
            found.choices.push((Some(entry), found.outcomes.len()));
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
            for legs in entries.values() {
                for (instance, chance) in self.of_legs(program, legs, each)? {
                    known!(self.outcomes_of(program, context, instance, chance, found));
                }
            }
        }
        Ok(Ok(()))
    }

    /// The instances that are enabled, by their entries.
    fn entries(&self, program: &Program<'_>) -> BTreeMap<u32, Vec<u32>> {
        by_entry(program, &self.choices)
    }

    /// The legs of an entry, of which one is taken by weight.
    fn of_legs(
        &mut self,
        program: &Program<'_>,
        legs: &[u32],
        chance: f64,
    ) -> Result<Lottery, Failure> {
        if let [only] = *legs
            && program.instance(only).edge.leg.is_none()
        {
            return Ok(vec![(only, chance)]);
        }
        let mut weights = Vec::with_capacity(legs.len());
        for &leg in legs {
            weights.push(self.weight(program, program.instance(leg), 0)?);
        }
        let first = program.instance(legs[0]);
        let shares = self.shares(first, &weights, chance)?;
        Ok(legs.iter().copied().zip(shares).filter(|one| one.1 > 0.0).collect())
    }

    fn weight(
        &mut self,
        program: &Program<'_>,
        mover: &Instance<'_>,
        branch: usize,
    ) -> Result<f64, Failure> {
        let weight = rules::number(self, program.weight(mover, branch), &mover.values)?;
        if weight >= 0.0 && weight.is_finite() {
            Ok(weight)
        } else {
            Err(Failure::Weight(self.stand(mover.process as usize), mover.id))
        }
    }

    /// The chances of some weights.
    fn shares(
        &self,
        mover: &Instance<'_>,
        weights: &[f64],
        chance: f64,
    ) -> Result<Vec<f64>, Failure> {
        let total: f64 = weights.iter().sum();
        if total > 0.0 {
            return Ok(weights.iter().map(|weight| chance * weight / total).collect());
        }
        Err(Failure::NoWeight(self.stand(mover.process as usize), mover.id))
    }

    /// Adds all outcomes of the move that a sender begins.
    fn outcomes_of(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        sender: u32,
        chance: f64,
        found: &mut Unfolded,
    ) -> Found<()> {
        let mut moves: Vec<(Vec<u32>, f64)> = vec![(vec![sender], 1.0)];
        let instance = program.instance(sender);
        if let Some(channel) = self.channel(instance)? {
            for receivers in self.receivers_of(program, instance, channel)? {
                let with = moves.iter().flat_map(|(movers, chance)| {
                    receivers.iter().map(move |&(one, share)| {
                        let movers = movers.iter().copied().chain([one]);
                        (movers.collect(), chance * share)
                    })
                });
                moves = with.collect();
            }
            moves.retain(|(movers, _)| {
                self.movers.clear();
                self.movers.extend(movers.iter().map(|&one| (one, 0)));
                self.allows_move(program)
            });
            let total: f64 = moves.iter().map(|one| one.1).sum();
            if moves.is_empty() {
                return Err(Failure::NoProgress(self.stand(instance.process as usize)));
            }
            for one in &mut moves {
                one.1 /= total;
            }
        }
        for (movers, share) in moves {
            known!(self.branches_of(program, context, &movers, chance * share, found));
        }
        Ok(Ok(()))
    }

    /// Of each receiver, or of the one receiver, which instances it may be.
    fn receivers_of(
        &mut self,
        program: &Program<'_>,
        sender: &Instance<'_>,
        channel: u32,
    ) -> Result<Vec<Lottery>, Failure> {
        let is_broadcast = self.network().channels[channel as usize].broadcast;
        let is_committed = |race: &Self, process: u32| {
            race.urgency(process as usize) == Urgency::Committed
        };
        let needs_commitment =
            !is_broadcast && self.committed > 0 && !is_committed(self, sender.process);
        let mut lotteries = Vec::new();
        self.movers.clear();
        for &process in program.receivers(channel) {
            if process == sender.process
                || (needs_commitment && !is_committed(self, process))
            {
                continue;
            }
            self.add_ready(program, process, channel)?;
            if is_broadcast {
                lotteries.extend(self.one_of_movers(program)?);
            }
        }
        if !is_broadcast {
            lotteries.extend(self.one_of_movers(program)?);
        }
        Ok(lotteries)
    }

    fn one_of_movers(&mut self, program: &Program<'_>) -> Result<Option<Lottery>, Failure> {
        if self.movers.is_empty() {
            return Ok(None);
        }
        let inputs: Vec<u32> = self.movers.drain(..).map(|mover| mover.0).collect();
        let entries = by_entry(program, &inputs);
        let each = 1.0 / entries.len() as f64;
        let mut lottery = Lottery::new();
        for legs in entries.values() {
            lottery.extend(self.of_legs(program, legs, each)?);
        }
        Ok(Some(lottery))
    }

    /// Adds an outcome for each combination of the branches of those that move.
    fn branches_of(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        movers: &[u32],
        chance: f64,
        found: &mut Unfolded,
    ) -> Found<()> {
        let mut ways: Vec<(Vec<u32>, f64)> = vec![(Vec::new(), chance)];
        for &mover in movers {
            let instance = program.instance(mover);
            let branches = instance.edge.branches.len();
            let shares = if branches < 2 {
                vec![1.0]
            } else {
                let mut weights = Vec::with_capacity(branches);
                for branch in 0..branches {
                    weights.push(self.weight(program, instance, branch)?);
                }
                self.shares(instance, &weights, 1.0)?
            };
            let with = ways.iter().flat_map(|(way, chance)| {
                let shares = (0..).zip(&shares).filter(|(_, share)| **share > 0.0);
                shares.map(move |(branch, share)| {
                    (way.iter().copied().chain([branch]).collect(), chance * share)
                })
            });
            ways = with.collect();
        }
        for (way, chance) in ways {
            self.movers.clear();
            self.movers.extend(movers.iter().copied().zip(way));
            known!(self.outcome(program, context, chance, found));
        }
        Ok(Ok(()))
    }

    /// Adds the state after the move that `movers` make, and goes back.
    fn outcome(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        chance: f64,
        found: &mut Unfolded,
    ) -> Found<()> {
        self.run_updates(program)?;
        for index in 0..self.movers.len() {
            let (number, branch) = self.movers[index];
            let mover = program.instance(number);
            let target = mover.edge.branches[branch as usize].target;
            self.machine.enter(ProcessId(mover.process), target);
        }
        if let Some(update) = &self.network().after_update {
            self.machine.update(update, &[])?;
        }
        let stream = self.network().chances.stream as usize;
        let stream = stream..stream + STREAM_WORDS;
        if self.machine.words()[stream.clone()] != context.base[stream] {
            let sender = program.instance(self.movers[0].0);
            return Ok(Err(NotFinite::Random(self.stand(sender.process as usize))));
        }
        let gain = self.worth(context.aim)? - context.before;
        found.outcomes.push(Outcome { chance, gain });
        found.words.extend_from_slice(self.machine.words());
        self.machine.restore(&context.base);
        Ok(Ok(()))
    }
}

/// What all outcomes of a state share.
struct Context {
    aim: Aim,
    /// What the state said of the value before the delay.
    before: f64,
    /// The words after the delay.
    base: Vec<i32>,
}

fn by_entry(program: &Program<'_>, instances: &[u32]) -> BTreeMap<u32, Vec<u32>> {
    let mut entries: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &one in instances {
        let entry = program.instance(one).entry;
        entries.entry(entry).or_default().push(one);
    }
    entries
}
