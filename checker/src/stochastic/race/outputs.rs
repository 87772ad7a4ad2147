//! Which outputs and receivers are enabled, now and later.

use super::{MOST_CHANGES, Race};
use crate::ir::Urgency;
use crate::stochastic::advice::View;
use crate::stochastic::condition::Condition;
use crate::stochastic::constants::TOLERANCE;
use crate::stochastic::failure::Failure;
use crate::stochastic::machine::Mask;
use crate::stochastic::motion::Followed;
use crate::stochastic::program::{Channel, Instance, Program, Spot};
use crate::stochastic::span::Span;
use crate::stochastic::windows::Windows;

impl<'a> Race<'a> {
    /// Adds the times until `bound` at which an output of the process is enabled that is not on an
    /// urgent channel; returns the first at which one on an urgent channel is.
    pub(super) fn output_windows(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        bound: f64,
        windows: &mut Windows,
    ) -> Result<f64, Failure> {
        let mut urgent = f64::INFINITY;
        let view = View::Drawn(self.longest_stay);
        for instance in program.range(spot.outputs) {
            if self.is_advised(instance) {
                urgent = urgent.min(self.advised_windows(program, instance, bound, windows)?);
            } else if instance.may_be_urgent && self.is_urgent(instance)? {
                // It is taken as soon as it can be, so no time is drawn for it.
                let asked = (bound, view);
                let first = self.instance_windows(program, instance, asked, None)?;
                urgent = urgent.min(first);
            } else {
                self.instance_windows(program, instance, (bound, view), Some(windows))?;
            }
        }
        Ok(urgent)
    }

    /// Adds the times until `bound` at which an instance is enabled; returns the first.
    pub(super) fn instance_windows(
        &mut self,
        program: &Program<'a>,
        instance: &Instance<'a>,
        (bound, view): (f64, View),
        mut windows: Option<&mut Windows>,
    ) -> Result<f64, Failure> {
        let only_first = windows.is_none();
        let mut add = |low: f64, high: f64| {
            if let Some(windows) = &mut windows {
                windows.add(low, high);
            }
        };
        let steps = self.steps(program, instance.guard);
        self.is_stepped[instance.process as usize] |= steps;
        let is_span = !matches!(instance.guard, Condition::Timed(_) | Condition::Curved(_));
        let is_alone = !instance.is_binary && !self.is_advised(instance);
        if is_span && is_alone && !steps {
            let span = self.span(program, instance.guard, &instance.values)?;
            let latest = bound * (1.0 + TOLERANCE) + TOLERANCE;
            let Some(span) = span.filter(|span| span.low <= latest) else {
                return Ok(f64::INFINITY);
            };
            add(span.low, span.high.min(bound).max(span.low));
            return Ok(span.low);
        }
        let (mut ahead, mut before) = (0.0, false);
        let mut first = f64::INFINITY;
        for _ in 0..MOST_CHANGES {
            let mask = self.output(program, instance, ahead, view)?;
            let end = (ahead + mask.horizon).min(bound);
            if mask.behind && ahead < bound {
                add(ahead, end);
                first = first.min(ahead);
            } else if mask.now && !before {
                add(ahead, ahead);
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

    /// Whether an instance is enabled after this time; a sender on a binary channel needs a
    /// receiver.
    pub(super) fn output(
        &mut self,
        program: &Program<'a>,
        instance: &Instance<'a>,
        ahead: f64,
        view: View,
    ) -> Result<Mask, Failure> {
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
        for &process in program.listeners(channel) {
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

    pub(super) fn channel(&mut self, instance: &Instance<'a>) -> Result<Option<u32>, Failure> {
        Ok(match instance.channel {
            Channel::None => None,
            Channel::Known(channel) => Some(channel),
            Channel::Computed(first, index) => {
                Some(first + self.machine.call(index, &instance.values)? as u32)
            }
        })
    }

    pub(super) fn is_urgent(&mut self, instance: &Instance<'a>) -> Result<bool, Failure> {
        let channel = self.channel(instance)?;
        Ok(channel.is_some_and(|channel| self.network().channels[channel as usize].urgent))
    }

    /// When a condition holds that does so in one interval; `None` if never.
    #[inline]
    pub(super) fn span(
        &mut self,
        program: &Program<'a>,
        condition: Condition,
        values: &[i32],
    ) -> Result<Option<Span>, Failure> {
        let Condition::Compared(place) = condition else {
            let holds = self.machine.holds(condition, values)?;
            return Ok(holds.then_some(Span::ALL));
        };
        let comparisons = program.comparisons(place);
        if !self.machine.holds(comparisons.on_words, values)? {
            return Ok(None);
        }
        self.machine.span(comparisons, values)
    }

    /// Whether a condition holds now.
    #[inline]
    pub(super) fn holds(
        &mut self,
        program: &Program<'a>,
        condition: Condition,
        values: &[i32],
    ) -> Result<bool, Failure> {
        if let Condition::Compared(place) = condition {
            let comparisons = program.comparisons(place);
            return Ok(self.machine.holds(comparisons.on_words, values)?
                && self.machine.compare(comparisons, values)?);
        }
        self.machine.holds(condition, values)
    }

    /// A condition after this time, if nothing happens until then.
    pub(super) fn mask_of(
        &mut self,
        program: &Program<'a>,
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
        program: &Program<'a>,
        process: usize,
    ) -> Result<bool, Failure> {
        self.choices.clear();
        let spot = program.spot(process, self.locations[process]);
        let leaves_committed = self.committed == 0 || spot.urgency == Urgency::Committed;
        let is_advised = spot.is_controllable && self.advice.is_some();
        if spot.is_plain && !is_advised && !self.is_stale[process] {
            for index in 0..self.enabled[process].len() {
                let number = self.enabled[process][index];
                if leaves_committed || self.partner_commits(program, program.instance(number))? {
                    self.choices.push(number);
                }
            }
            return Ok(!self.choices.is_empty());
        }
        for number in spot.outputs.0..spot.outputs.1 {
            let instance = program.instance(number);
            let is_enabled = if instance.is_binary || is_advised {
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
        program: &Program<'a>,
        sender: &Instance<'a>,
    ) -> Result<bool, Failure> {
        let Some(channel) = self.channel(sender)? else {
            return Ok(false);
        };
        for &process in program.listeners(channel) {
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
        program: &Program<'a>,
        process: u32,
        channel: u32,
    ) -> Result<(), Failure> {
        let inputs = program
            .spot(process as usize, self.locations[process as usize])
            .inputs;
        for number in inputs.0..inputs.1 {
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
