//! The race under a strategy of the controller.
//!
//! Until the strategy demands a move, a controllable output counts in the delay of its process
//! where the strategy allows it. Where it demands a move, time stops, and every process with one
//! that is allowed competes. A process without a rate whose stay no invariant bounds draws
//! uniformly among the times until then.
//!
//! Where the strategy also allows to wait, waiting is one choice more: a process whose delay is
//! over and that has n allowed moves makes one of them with a chance of n / (n + 1), and else draws
//! anew from there. So its moves come at n / (n + 1) of the rate at which they would come without a
//! strategy, and a uniform delay with the hazard reduced in the same way. Moves of the environment
//! are not touched.
//!
//! An urgent channel stops time also if the strategy forbids to use it. Then who else can move
//! does.

use super::{Next, Race, TOLERANCE};
use crate::ir::Urgency;
use crate::stochastic::advice::{Advice, Ready, View};
use crate::stochastic::entry::entry;
use crate::stochastic::failure::Failure;
use crate::stochastic::machine::Mask;
use crate::stochastic::program::{Instance, Program};
use crate::stochastic::restriction::Entry;

/// Where a move is to be made as soon as possible, and there is no first moment, it is made this
/// part, or this long, after the beginning.
pub(super) const SOON: f64 = 5.0 * TOLERANCE;

impl Race<'_> {
    /// Lets the strategy look at the state before anybody plans.
    pub(super) fn take_advice(&mut self, program: &Program<'_>) -> Result<(), Failure> {
        let Some(advice) = &mut self.advice else {
            return Ok(());
        };
        let machine = &self.machine;
        advice.look(machine.words(), |clock| machine.clock(clock), self.time);
        self.standstill = None;
        self.longest_stay = f64::INFINITY;
        self.until = self.rest;
        for process in 0..self.locations.len() {
            let spot = program.spot(process, self.locations[process]);
            if self.has_decisions() {
                let bound = if spot.urgency != Urgency::Normal {
                    0.0
                } else if self.is_stale[process] {
                    self.invariant_bound(program, spot, process)?
                } else {
                    self.bounds[process]
                };
                self.longest_stay = self.longest_stay.min(bound);
            }
            if spot.is_controllable {
                self.make_stale(process as u32);
            }
        }
        Ok(())
    }

    /// Lets the strategy look at the state after the delay for which it has looked at it.
    pub(super) fn take_advice_again(&mut self) {
        if let Some(advice) = &mut self.advice {
            let machine = &self.machine;
            advice.look_again(|clock| machine.clock(clock), self.time);
        }
    }

    /// What comes before a delay, and before time has to stop, because of the strategy.
    pub(super) fn next_by_advice(
        &mut self,
        program: &Program<'_>,
        delay: f64,
        least: f64,
    ) -> Result<Option<Next>, Failure> {
        let first = delay.min(least);
        if let Some((standstill, process)) = self.standstill
            && standstill < first
        {
            let is_now = standstill <= TOLERANCE;
            let winner = if is_now {
                self.one_with_outputs(program, false)?
            } else {
                // What it can do then is found then.
                Some(process)
            };
            return Ok(Some(Next {
                delay: if is_now { 0.0 } else { standstill },
                winner,
                stopped_by: Some(process),
            }));
        }
        match self.demand() {
            Some(demand) if demand * (1.0 + TOLERANCE) + TOLERANCE < first => {
                Err(Failure::ImpossibleDemand)
            }
            _ => Ok(None),
        }
    }

    pub(super) fn has_decisions(&self) -> bool {
        self.advice.as_ref().is_some_and(Advice::has_decisions)
    }

    /// Whether the strategy has a say in an output.
    pub(super) fn is_advised(&self, instance: &Instance<'_>) -> bool {
        instance.edge.controllable && self.has_decisions()
    }

    /// Lets the controller make a move that is allowed, but not demanded. Returns whether that
    /// makes a difference.
    pub(super) fn hurry(&mut self) -> bool {
        self.advice.as_mut().is_some_and(Advice::hurry)
    }

    /// Whether the process of the movers waits instead, where the strategy leaves it both and time
    /// can pass.
    pub(super) fn waits_instead(&mut self, program: &Program<'_>) -> Result<bool, Failure> {
        let may_wait = self.control.is_none()
            && self.has_decisions()
            && self.advice.as_ref().is_some_and(Advice::may_wait)
            && self.committed == 0
            && self.bounds.iter().all(|&bound| bound > TOLERANCE);
        let mut movers = self.movers.iter().map(|&(one, _)| program.instance(one));
        if !may_wait || movers.any(|one| !one.edge.controllable) {
            return Ok(false);
        }
        let sender = program.instance(self.movers[0].0);
        if sender.may_be_urgent && self.is_urgent(sender)? {
            return Ok(false);
        }
        let choices = self.choices.iter().map(|&one| program.instance(one));
        let moves = choices.filter(|one| one.edge.controllable).count() as u32;
        Ok(self.machine.stream().below(moves + 1) == 0)
    }

    /// When the strategy demands a move.
    pub(super) fn demand(&self) -> Option<f64> {
        let demand = self.advice.as_ref()?.demand();
        demand.is_finite().then_some(demand)
    }

    /// Adds the times until `bound` at which the strategy allows a controllable output, and a
    /// delay for it is drawn; returns the first at which it is made without.
    pub(super) fn advised_windows(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        bound: f64,
    ) -> Result<f64, Failure> {
        let view = View::Drawn(self.longest_stay);
        let mut urgent = self.demanded(program, instance, bound)?;
        if instance.may_be_urgent && self.is_urgent(instance)? {
            let first = self.instance_windows(program, instance, bound, view, true)?;
            urgent = urgent.min(first);
            let possible = self.instance_windows(program, instance, bound, View::Model, true)?;
            if possible < urgent && self.standstill.is_none_or(|one| possible < one.0) {
                self.standstill = Some((possible, instance.process as usize));
            }
        } else if self.advice.as_ref().is_some_and(Advice::is_eager) {
            let first = self.instance_windows(program, instance, bound, view, true)?;
            if first.is_finite() {
                let mask = self.output(program, instance, first, view)?;
                // Without a first moment one soon after the beginning is taken.
                let soon = (SOON * first.max(1.0)).min(mask.horizon / 2.0);
                urgent = urgent.min(if mask.now { first } else { first + soon });
            }
        } else {
            self.instance_windows(program, instance, bound, view, false)?;
        }
        Ok(urgent)
    }

    /// When the strategy demands a move that this instance can make; infinity if it cannot.
    pub(super) fn demanded(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        bound: f64,
    ) -> Result<f64, Failure> {
        let latest = bound * (1.0 + TOLERANCE) + TOLERANCE;
        let Some(demand) = self.demand().filter(|&demand| demand <= latest) else {
            return Ok(f64::INFINITY);
        };
        let is_enabled = self.output(program, instance, demand, View::Allowed)?.now;
        Ok(if is_enabled { demand } else { f64::INFINITY })
    }

    /// When the strategy allows a controllable output together with those who can receive.
    pub(super) fn partners(
        &mut self,
        program: &Program<'_>,
        sender: &Instance<'_>,
        ahead: f64,
        view: View,
    ) -> Result<Mask, Failure> {
        let network = self.network();
        let (own, is_alone) = (entry(network, sender), is_alone(sender));
        let Some(channel) = self.channel(sender)? else {
            return Ok(self.allowed(&[own], ahead, view));
        };
        let is_broadcast = self.network().channels[channel as usize].broadcast;
        let mut ready = Mask::constant(false);
        let mut audience = Vec::new();
        for &process in program.receivers(channel) {
            if process == sender.process {
                continue;
            }
            let location = self.locations[process as usize];
            let inputs = program.spot(process as usize, location).inputs;
            for receiver in program.range(inputs) {
                if self.channel(receiver)? != Some(channel) {
                    continue;
                }
                let mut mask = self.mask_of(program, receiver.guard, &receiver.values, ahead)?;
                if is_broadcast {
                    audience.push(Ready {
                        entry: entry(network, receiver),
                        controllable: receiver.edge.controllable,
                        mask,
                    });
                } else if receiver.edge.controllable {
                    let movers = [own, entry(network, receiver)];
                    let named = if is_alone { &movers[..1] } else { &movers };
                    mask = mask.and(self.allowed(named, ahead, view));
                }
                ready = ready.or(mask);
            }
        }
        Ok(match &self.advice {
            Some(advice) if is_broadcast => {
                advice.allows_broadcast(own, is_alone, &audience, ahead, view)
            }
            _ => ready,
        })
    }

    /// When the strategy allows a move of these participants, all controllable.
    fn allowed(&self, movers: &[Entry], ahead: f64, view: View) -> Mask {
        let advice = self.advice.as_ref();
        advice.map_or(Mask::constant(true), |advice| {
            advice.allows(movers, ahead, view)
        })
    }

    /// Whether the strategy allows the movers to move now.
    pub(super) fn allows_move(&self, program: &Program<'_>) -> bool {
        let Some(advice) = self.advice.as_ref().filter(|one| one.has_decisions()) else {
            return true;
        };
        let mut movers = self.movers.iter().map(|&(one, _)| program.instance(one));
        if movers.clone().any(|one| !one.edge.controllable) {
            return true;
        }
        let named = match program.instance(self.movers[0].0) {
            sender if is_alone(sender) => 1,
            _ => self.movers.len(),
        };
        let network = self.network();
        let movers = movers.by_ref().take(named);
        let movers: Vec<Entry> = movers.map(|one| entry(network, one)).collect();
        advice.allows_now(&movers)
    }
}

/// Whether the entry of a sender names the move, whoever receives.
fn is_alone(sender: &Instance<'_>) -> bool {
    let leg = sender.edge.leg.as_ref();
    leg.is_some_and(|leg| !leg.follows_sync)
}
