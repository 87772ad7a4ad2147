//! What processes plan: how long they may stay, and when they try to move.

use super::{FAR_BEYOND, MOST_CHANGES, Race};
use crate::cancellation;
use crate::ir::{FunctionId, Urgency};
use crate::stochastic::advice::View;
use crate::stochastic::condition::{Condition, Number};
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Program, Spot, clocks_of};
use crate::stochastic::span::Span;
use crate::stochastic::windows::Windows;

/// What a plan takes: see [`cancellation::work`].
const UNITS_FOR_PLAN: usize = 128;

impl<'a> Race<'a> {
    /// Lets all processes plan whose plans may have changed.
    pub(super) fn plan_anew(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        // Random numbers are drawn first for those that have moved, and then in the order of
        // processes. Those who look along the motion of clocks come last, so that they need not
        // look farther than to the first attempt.
        if std::mem::take(&mut self.has_moved) {
            self.until = self.rest;
            for index in 0..self.movers.len() {
                let process = program.instance(self.movers[index].0).process as usize;
                if self.is_stale[process] && !self.is_stepped[process] {
                    self.is_stale[process] = false;
                    self.plan(program, process)?;
                }
            }
        }
        if self.until_renewal == 0 {
            self.renew(program);
        }
        let is_stepped = &self.is_stepped;
        self.stale
            .sort_unstable_by_key(|&process| (is_stepped[process as usize], process));
        for index in 0..self.stale.len() {
            let process = self.stale[index] as usize;
            if !std::mem::replace(&mut self.is_stale[process], false) {
                continue;
            }
            if self.is_stepped[process] {
                self.is_stepped[process] = false;
                self.attempts[process] = f64::INFINITY;
                let first = self.attempts.iter().copied().fold(self.rest, f64::min);
                self.until = first.max(0.0);
            } else {
                self.until = self.rest;
            }
            self.plan(program, process)?;
            cancellation::work(UNITS_FOR_PLAN);
        }
        self.stale.clear();
        Ok(())
    }

    /// Where time stands still, no process plans that may have to, but the invariants hold.
    pub(super) fn put_plans_off(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        if self.until_renewal == 0 {
            self.renew(program);
        }
        self.until = 0.0;
        for index in 0..self.stale.len() {
            let process = self.stale[index] as usize;
            let invariant = program.spot(process, self.locations[process]).invariant;
            let is_kept = match invariant {
                Condition::Compared(_) if !self.steps(program, invariant) => {
                    self.holds(program, invariant, &[])?
                }
                _ => self.mask_of(program, invariant, &[], 0.0)?.now,
            };
            if !is_kept {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
        }
        Ok(())
    }

    fn plan(&mut self, program: &Program<'a>, process: usize) -> Result<(), Failure> {
        let spot = program.spot(process, self.locations[process]);
        let bound = self.invariant_bound(program, spot, process)?;
        let is_urgent = spot.urgency != Urgency::Normal;
        self.bounds[process] = if is_urgent { 0.0 } else { bound };
        let is_advised = spot.is_controllable && self.has_decisions();
        self.attempts[process] = if spot.is_plain && !is_advised {
            self.find_plain_outputs(program, spot, process)?;
            if self.enabled[process].is_empty() {
                f64::INFINITY
            } else if is_urgent {
                0.0
            } else if bound.is_finite() {
                bound * self.machine.stream().uniform()
            } else {
                let rate = self.exponential_rate(spot, process)?;
                if rate == 0.0 {
                    f64::INFINITY
                } else {
                    self.machine.stream().exponential(rate)
                }
            }
        } else if is_urgent {
            let mut is_enabled = false;
            for output in program.range(spot.outputs) {
                is_enabled = is_enabled || self.output(program, output, 0.0, View::Allowed)?.now;
            }
            if is_enabled { 0.0 } else { f64::INFINITY }
        } else {
            self.draw(program, spot, process, bound)?
        };
        Ok(())
    }

    /// The outputs of a process whose guards do not change as time passes.
    pub(super) fn find_plain_outputs(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<(), Failure> {
        self.enabled[process].clear();
        for number in spot.outputs.0..spot.outputs.1 {
            let output = program.instance(number);
            if self.holds(program, output.guard, &output.values)? {
                self.enabled[process].push(number);
            }
        }
        Ok(())
    }

    /// How long a process may stay where it is.
    pub(super) fn invariant_bound(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        if self.steps(program, spot.invariant) {
            return self.stepped_bound(program, spot, process);
        }
        if let Condition::Compared(_) = spot.invariant {
            let span = self.span(program, spot.invariant, &[])?;
            let is_broken = |span: Option<Span>| span.is_none_or(|span| span.low > 0.0);
            if is_broken(span) {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            return Ok(span.map_or(0.0, |span| span.high));
        }
        let mut ahead = 0.0;
        for _ in 0..MOST_CHANGES {
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            if ahead == 0.0 && !mask.now {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            if !mask.behind {
                return Ok(ahead);
            }
            if mask.horizon.is_infinite() {
                return Ok(f64::INFINITY);
            }
            if ahead + mask.horizon <= ahead {
                break;
            }
            ahead += mask.horizon;
        }
        Err(Failure::NoProgress(self.stand(process)))
    }

    /// How long a process may stay where it is, if that is found by looking along the motion of
    /// clocks: not beyond the end of the run, but far beyond it where a process has no rate and so
    /// needs to know.
    pub(super) fn stepped_bound(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        self.is_stepped[process] = true;
        let until = self.until;
        let needs_bound = spot.exponential_rate.is_none() && spot.outputs.0 < spot.outputs.1;
        self.until = self.rest * if needs_bound { FAR_BEYOND } else { 1.0 };
        let mut ahead = 0.0;
        let found = loop {
            // When it changes again is not asked of an invariant that does not hold.
            let until = std::mem::replace(&mut self.until, ahead);
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            self.until = until;
            if ahead == 0.0 && !mask.now {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            if !mask.behind {
                break ahead;
            }
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            if mask.horizon.is_infinite() {
                break f64::INFINITY;
            }
            ahead += mask.horizon;
        };
        self.until = until;
        Ok(found)
    }

    /// Whether a condition is looked at along the motion of clocks.
    pub(super) fn steps(&mut self, program: &Program<'a>, condition: Condition) -> bool {
        match condition {
            Condition::Curved(_) => true,
            Condition::Always | Condition::Never | Condition::Words(_) => false,
            Condition::Compared(_) | Condition::Timed(_) if !self.motion.is_flowing() => false,
            Condition::Compared(place) => {
                let mut bounds = program.comparisons(place).bounds.iter();
                bounds.any(|&(clock, _, _)| self.motion.flows(clock))
            }
            Condition::Timed(function) => self.reads_flow(function),
        }
    }

    /// Whether a function reads a clock that flows.
    pub(in crate::stochastic) fn reads_flow(&mut self, function: FunctionId) -> bool {
        let network = self.network();
        let clocks = self
            .clocks_of
            .entry(function)
            .or_insert_with(|| clocks_of(network, function).into_boxed_slice());
        clocks.iter().any(|&clock| self.motion.flows(clock))
    }

    /// The delay of a process that may stay until `bound`.
    pub(super) fn draw(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
        bound: f64,
    ) -> Result<f64, Failure> {
        let mut windows = std::mem::take(&mut self.windows);
        windows.clear();
        if bound.is_finite() {
            // A uniform delay is drawn from all of its windows.
            self.until = bound;
        }
        let urgent = self.output_windows(program, spot, bound, &mut windows);
        let delay =
            urgent.and_then(|urgent| Ok(self.drawn(spot, process, bound, &windows)?.min(urgent)));
        self.windows = windows;
        delay
    }

    pub(super) fn drawn(
        &mut self,
        spot: &Spot,
        process: usize,
        bound: f64,
        windows: &Windows,
    ) -> Result<f64, Failure> {
        let Some(first) = windows.first() else {
            return Ok(f64::INFINITY);
        };
        let length = windows.length();
        let is_demanded = self.demand().is_some() && length.is_finite();
        if bound.is_finite() || spot.exponential_rate.is_none() && is_demanded {
            let mut stream = self.machine.stream();
            if length > 0.0 {
                let part = stream.uniform();
                return Ok(windows.after(part * length));
            }
            let moments = windows.count() as u32;
            let chosen = if moments == 1 {
                0
            } else {
                stream.below(moments)
            };
            return Ok(windows.start_of(chosen as usize));
        }
        let rate = self.exponential_rate(spot, process)?;
        if rate == 0.0 {
            return Ok(f64::INFINITY);
        }
        if length == 0.0 {
            return Ok(first);
        }
        let passed = self.machine.stream().exponential(rate);
        Ok(windows.after(passed))
    }

    pub(super) fn exponential_rate(&mut self, spot: &Spot, process: usize) -> Result<f64, Failure> {
        let rate = match spot.exponential_rate {
            None => return Err(Failure::NoRate(self.stand(process))),
            Some(Number::Known(rate)) => rate,
            Some(Number::Computed(rate)) => self.machine.real(rate, &[])?,
        };
        if rate >= 0.0 && rate.is_finite() {
            Ok(rate)
        } else {
            Err(Failure::Rate(self.stand(process), rate))
        }
    }
}
