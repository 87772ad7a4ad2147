//! The outcomes of moves, with their chances: which legs, receivers and branches take part, and
//! what the updates do. See `unfolding.rs`.

use super::Race;
use super::unfolded::{Found, Lottery, NotFinite, Outcome, Unfolded, known};
use crate::ir::{Aim, ProcessId, STREAM_WORDS, Urgency};
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Instance, Program};
use crate::stochastic::rules;

impl Race<'_> {
    /// The instances that are enabled, by their entries.
    pub(super) fn entries(&self, program: &Program<'_>) -> Entries {
        Entries::of(program, &self.choices)
    }

    /// The legs of an entry, of which one is taken by weight.
    pub(super) fn of_legs(
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
        Ok(legs
            .iter()
            .copied()
            .zip(shares)
            .filter(|one| one.1 > 0.0)
            .collect())
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
            Err(Failure::Weight(
                self.stand(mover.process as usize),
                mover.id,
            ))
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
            return Ok(weights
                .iter()
                .map(|weight| chance * weight / total)
                .collect());
        }
        Err(Failure::NoWeight(
            self.stand(mover.process as usize),
            mover.id,
        ))
    }

    /// Adds all outcomes of the move that a sender begins.
    pub(super) fn outcomes_of(
        &mut self,
        program: &Program<'_>,
        context: &mut Context,
        sender: u32,
        chance: f64,
        found: &mut Unfolded,
    ) -> Found<()> {
        let instance = program.instance(sender);
        if instance.edge.sync.is_none() && self.advice.is_none() {
            return self.branches_of(program, context, &[sender], chance, found);
        }
        let mut moves: Vec<(Vec<u32>, f64)> = vec![(vec![sender], 1.0)];
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
        let is_committed =
            |race: &Self, process: u32| race.urgency(process as usize) == Urgency::Committed;
        let needs_commitment =
            !is_broadcast && self.committed > 0 && !is_committed(self, sender.process);
        let mut lotteries = Vec::new();
        self.movers.clear();
        for &process in program.receivers(channel) {
            if process == sender.process || (needs_commitment && !is_committed(self, process)) {
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
        let entries = Entries::of(program, &inputs);
        let each = 1.0 / entries.len() as f64;
        let mut lottery = Lottery::new();
        for legs in entries.iter() {
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
        if let [mover] = *movers {
            let shares = self.branch_shares(program, program.instance(mover), chance)?;
            for (branch, chance) in (0..).zip(shares).filter(|one| one.1 > 0.0) {
                self.movers.clear();
                self.movers.push((mover, branch));
                known!(self.outcome(program, context, chance, found));
            }
            return Ok(Ok(()));
        }
        let mut ways: Vec<(Vec<u32>, f64)> = vec![(Vec::new(), chance)];
        for &mover in movers {
            let shares = self.branch_shares(program, program.instance(mover), 1.0)?;
            let with = ways.iter().flat_map(|(way, chance)| {
                let shares = (0..).zip(&shares).filter(|(_, share)| **share > 0.0);
                shares.map(move |(branch, share)| {
                    (
                        way.iter().copied().chain([branch]).collect(),
                        chance * share,
                    )
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

    /// The chances of the branches of a mover.
    fn branch_shares(
        &mut self,
        program: &Program<'_>,
        mover: &Instance<'_>,
        chance: f64,
    ) -> Result<Vec<f64>, Failure> {
        let branches = mover.edge.branches.len();
        if branches < 2 {
            return Ok(vec![chance]);
        }
        let mut weights = Vec::with_capacity(branches);
        for branch in 0..branches {
            weights.push(self.weight(program, mover, branch)?);
        }
        self.shares(mover, &weights, chance)
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
pub(super) struct Context {
    pub(super) aim: Aim,
    /// What the state said of the value before the delay.
    pub(super) before: f64,
    /// The words after the delay.
    pub(super) base: Vec<i32>,
}

/// Some instances by their entries.
pub(super) struct Entries {
    instances: Vec<u32>,
    /// Where the instances of an entry end; none if each has its own.
    ends: Option<Vec<usize>>,
}

impl Entries {
    pub(super) fn of(program: &Program<'_>, instances: &[u32]) -> Entries {
        let mut instances = instances.to_vec();
        let of_leg = |&one: &u32| program.instance(one).edge.leg.is_some();
        let ends = instances.iter().any(of_leg).then(|| {
            instances.sort_by_key(|&one| program.instance(one).entry);
            let same = |one: &u32, other: &u32| {
                program.instance(*one).entry == program.instance(*other).entry
            };
            let mut end = 0;
            let parts = instances.chunk_by(same);
            parts
                .map(|part| {
                    end += part.len();
                    end
                })
                .collect()
        });
        Entries { instances, ends }
    }

    pub(super) fn len(&self) -> usize {
        let ends = self.ends.as_ref();
        ends.map_or(self.instances.len(), Vec::len)
    }

    /// The instances of each entry.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|place| match &self.ends {
            None => &self.instances[place..=place],
            Some(ends) => {
                let start = place.checked_sub(1).map_or(0, |before| ends[before]);
                &self.instances[start..ends[place]]
            }
        })
    }
}
