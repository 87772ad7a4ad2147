//! Which outputs and receivers are enabled, now and later.

use std::cell::Cell;

use super::{MOST_CHANGES, Race};
use crate::ir::Urgency;
use crate::stochastic::advice::View;
use crate::stochastic::condition::Condition;
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::Failure;
use crate::stochastic::machine::Mask;
use crate::stochastic::motion::Followed;
use crate::stochastic::program::{Channel, Instance, Program, Spot};
use crate::stochastic::rules::{self, Backend};

impl Race<'_> {
    /// Adds the times until `bound` at which an output of the process is enabled that is not on an
    /// urgent channel; returns the first at which one on an urgent channel is.
    pub(super) fn output_windows(
        &mut self,
        program: &Program<'_>,
        spot: &Spot,
        bound: f64,
    ) -> Result<f64, Failure> {
        let mut urgent = f64::INFINITY;
        let view = View::Drawn(self.longest_stay);
        for instance in program.range(spot.outputs) {
            if self.is_decided(instance) {
                let question = self.decided_windows(program, instance, bound)?;
                self.question = self.question.min(question);
                urgent = urgent.min(question);
            } else if self.is_advised(instance) {
                urgent = urgent.min(self.advised_windows(program, instance, bound)?);
            } else if instance.may_be_urgent && self.is_urgent(instance)? {
                // It is taken as soon as it can be, so no time is drawn for it.
                let first = self.instance_windows(program, instance, bound, view, true)?;
                urgent = urgent.min(first);
            } else {
                self.instance_windows(program, instance, bound, view, false)?;
            }
        }
        Ok(urgent)
    }

    /// Adds the times until `bound` at which an instance is enabled; returns the first, or looks
    /// for that alone.
    pub(super) fn instance_windows(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        bound: f64,
        view: View,
        only_first: bool,
    ) -> Result<f64, Failure> {
        let steps = self.steps(program, instance.guard);
        self.is_stepped[instance.process as usize] |= steps;
        let is_span = !matches!(instance.guard, Condition::Timed(_) | Condition::Curved(_));
        if is_span && !instance.is_binary && !self.is_advised(instance) && !steps {
            let Some((low, high)) = self.known_window(program, instance, bound)? else {
                return Ok(f64::INFINITY);
            };
            if !only_first {
                self.windows.push((low, high));
            }
            return Ok(low);
        }
        let (mut ahead, mut before) = (0.0, false);
        let mut first = f64::INFINITY;
        for _ in 0..MOST_CHANGES {
            let mask = self.output(program, instance, ahead, view)?;
            let end = (ahead + mask.horizon).min(bound);
            if mask.behind && ahead < bound {
                if !only_first {
                    self.windows.push((ahead, end));
                }
                first = first.min(ahead);
            } else if mask.now && !before {
                if !only_first {
                    self.windows.push((ahead, ahead));
                }
                first = first.min(ahead);
            }
            if only_first && first.is_finite() {
                return Ok(first);
            }
            let next = ahead + mask.horizon;
            if next.is_infinite() || next > bound * (1.0 + TOLERANCE) + TOLERANCE {
                return Ok(first);
            }
            if next <= ahead {
                break;
            }
            before = mask.behind;
            ahead = next.min(bound);
        }
        Err(Failure::NoProgress(self.stand(instance.process as usize)))
    }

    /// The one window of an instance until `bound`, if it has any.
    fn known_window(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        bound: f64,
    ) -> Result<Option<(f64, f64)>, Failure> {
        let found = Cell::new(None);
        self.attempt(|race, none| {
            let window = rules::span(race, program, instance.guard, &instance.values, none)?;
            let low = window.low.unwrap_or(0.0);
            if low <= rules::tolerant(race, bound) {
                let high = window.high.unwrap_or(f64::INFINITY).min(bound).max(low);
                found.set(Some((low, high)));
            }
            Ok(())
        })?;
        Ok(found.get())
    }

    /// Whether an instance is enabled after this time; a sender on a binary channel needs a
    /// receiver.
    pub(super) fn output(
        &mut self,
        program: &Program<'_>,
        instance: &Instance<'_>,
        ahead: f64,
        view: View,
    ) -> Result<Mask, Failure> {
        if self.passes(instance) {
            return Ok(Mask::constant(false));
        }
        let guard = self.mask_of(program, instance.guard, &instance.values, ahead)?;
        if (guard.now || guard.behind) && view != View::Model && self.is_advised(instance) {
            return Ok(guard.and(self.partners(program, instance, ahead, view)?));
        }
        if !instance.is_binary || !(guard.now || guard.behind) {
            return Ok(guard);
        }
        let Some(channel) = self.channel(instance)? else {
            return Ok(guard);
        };
        if self.network().channels[channel as usize].broadcast {
            return Ok(guard);
        }
        let mut ready = Mask::constant(false);
        for &process in program.receivers(channel) {
            if process == instance.process {
                continue;
            }
            let inputs = program
                .spot(process as usize, self.locations[process as usize])
                .inputs;
            for receiver in program.range(inputs) {
                if self.channel(receiver)? == Some(channel) {
                    let mask = self.mask_of(program, receiver.guard, &receiver.values, ahead)?;
                    ready = ready.or(mask);
                }
            }
        }
        Ok(guard.and(ready))
    }

    pub(super) fn channel(&mut self, instance: &Instance<'_>) -> Result<Option<u32>, Failure> {
        Ok(match instance.channel {
            Channel::None => None,
            Channel::Known(channel) => Some(channel),
            Channel::Computed(first, index) => {
                Some(first + self.machine.call(index, &instance.values)? as u32)
            }
        })
    }

    pub(super) fn is_urgent(&mut self, instance: &Instance<'_>) -> Result<bool, Failure> {
        let channel = self.channel(instance)?;
        Ok(channel.is_some_and(|channel| self.network().channels[channel as usize].urgent))
    }

    /// Whether a condition holds now.
    pub(super) fn holds(
        &mut self,
        program: &Program<'_>,
        condition: Condition,
        values: &[i32],
    ) -> Result<bool, Failure> {
        let holds = Cell::new(false);
        self.attempt(|race, not| {
            rules::require(race, program, condition, values, not)?;
            holds.set(true);
            Ok(())
        })?;
        Ok(holds.get())
    }

    /// A condition after this time, if nothing happens until then.
    pub(super) fn mask_of(
        &mut self,
        program: &Program<'_>,
        condition: Condition,
        values: &[i32],
        ahead: f64,
    ) -> Result<Mask, Failure> {
        let steps = self.steps(program, condition);
        let whole = match condition {
            Condition::Compared(place) => Condition::Timed(program.comparisons(place).whole),
            other => other,
        };
        if let (true, Condition::Timed(function) | Condition::Curved(function)) = (steps, whole) {
            let asked = Followed {
                function,
                arguments: values,
                is_simple: matches!(condition, Condition::Compared(_)),
            };
            return self
                .motion
                .mask(&mut self.machine, asked, ahead, self.until);
        }
        self.machine.mask(whole, values, ahead)
    }

    /// Puts the outputs of a process that are enabled now into `choices`: only those that leave a
    /// committed location if there is one. Returns whether there are any.
    pub(super) fn find_outputs(
        &mut self,
        program: &Program<'_>,
        process: usize,
    ) -> Result<bool, Failure> {
        self.choices.clear();
        let spot = program.spot(process, self.locations[process]);
        let leaves_committed = self.committed == 0 || spot.urgency == Urgency::Committed;
        let is_advised = spot.is_controllable && self.advice.is_some();
        for number in spot.outputs.numbers() {
            let instance = program.instance(number);
            let is_enabled = if self.passes(instance) {
                false
            } else if instance.is_binary || is_advised {
                self.output(program, instance, 0.0, View::Allowed)?.now
            } else {
                self.holds(program, instance.guard, &instance.values)?
            };
            if !is_enabled {
                continue;
            }
            if leaves_committed || self.partner_commits(program, instance)? {
                self.choices.push(number);
            }
        }
        Ok(!self.choices.is_empty())
    }

    /// Whether somebody who can receive from a sender is in a committed location.
    pub(super) fn partner_commits(
        &mut self,
        program: &Program<'_>,
        sender: &Instance<'_>,
    ) -> Result<bool, Failure> {
        let Some(channel) = self.channel(sender)? else {
            return Ok(false);
        };
        for &process in program.receivers(channel) {
            if process != sender.process && self.urgency(process as usize) == Urgency::Committed {
                let before = self.movers.len();
                self.add_ready(program, process, channel)?;
                let is_ready = self.movers.len() > before;
                self.movers.truncate(before);
                if is_ready {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Adds the receiving instances of a process on a channel that are enabled now to `movers`.
    pub(super) fn add_ready(
        &mut self,
        program: &Program<'_>,
        process: u32,
        channel: u32,
    ) -> Result<(), Failure> {
        let inputs = program
            .spot(process as usize, self.locations[process as usize])
            .inputs;
        for number in inputs.numbers() {
            let input = program.instance(number);
            if self.channel(input)? == Some(channel)
                && self.holds(program, input.guard, &input.values)?
            {
                self.movers.push((number, 0));
            }
        }
        Ok(())
    }
}
