//! What processes plan: how long they may stay, and when they try to move.

use std::cell::Cell;

use super::{FAR_BEYOND, MOST_CHANGES, Race};
use crate::cancellation;
use crate::ir::FunctionId;
use crate::stochastic::condition::Condition;
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Program, Spot, clocks_of};
use crate::stochastic::rules::{self, Backend};

/// What a plan takes: see [`cancellation::work`].
const UNITS_FOR_PLAN: usize = 128;

impl Race<'_> {
    /// Lets all processes plan whose plans may have changed.
    pub(super) fn plan_anew(&mut self, program: &Program<'_>) -> Result<(), Failure> {
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

    /// Where all have to plan: lets those who look along the motion of clocks do it last, so that
    /// they need not look far.
    pub(in crate::stochastic) fn plan_flows_last(&mut self, program: &Program<'_>) {
        if !self.motion.is_flowing() {
            return;
        }
        self.attempts.fill(f64::INFINITY);
        for process in 0..self.locations.len() {
            let outputs = program.spot(process, self.locations[process]).outputs;
            let mut outputs = program.range(outputs).iter();
            self.is_stepped[process] = outputs.any(|output| self.steps(program, output.guard));
        }
    }

    /// Where time stands still, no process plans that may have to, but the invariants hold.
    pub(super) fn put_plans_off(&mut self, program: &Program<'_>) -> Result<(), Failure> {
        if self.until_renewal == 0 {
            self.renew(program);
        }
        self.until = 0.0;
        for index in 0..self.stale.len() {
            let process = self.stale[index] as usize;
            let spot = program.spot(process, self.locations[process]);
            rules::require_invariant(self, program, process, spot)?;
        }
        Ok(())
    }

    fn plan(&mut self, program: &Program<'_>, process: usize) -> Result<(), Failure> {
        let spot = program.spot(process, self.locations[process]);
        Ok(rules::plan(self, program, process, spot)?)
    }

    /// Whether the rules know when the outputs of a process are enabled: each has one window, which
    /// neither a receiver nor a strategy nor whoever decides nor the motion of clocks changes.
    pub(super) fn is_known(&mut self, program: &Program<'_>, spot: &Spot) -> bool {
        if spot.is_controllable && (self.has_decisions() || self.control.is_some()) {
            return false;
        }
        let mut outputs = program.range(spot.outputs).iter();
        spot.is_plain
            || spot.has_spans
                && !(self.motion.is_flowing()
                    && outputs.any(|output| self.steps(program, output.guard)))
    }

    /// How long a process may stay where it is.
    pub(super) fn invariant_bound(
        &mut self,
        program: &Program<'_>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        Ok(rules::stay(self, program, process, spot)?.unwrap_or(f64::INFINITY))
    }

    /// How long a process may stay where it is, if its invariant is found by masks.
    pub(super) fn looked_bound(
        &mut self,
        program: &Program<'_>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
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
        program: &Program<'_>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        self.is_stepped[process] = true;
        let until = self.until;
        let needs_bound = spot.exponential_rate.is_none() && !spot.outputs.is_empty();
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
    pub(super) fn steps(&mut self, program: &Program<'_>, condition: Condition) -> bool {
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
        program: &Program<'_>,
        spot: &Spot,
        process: usize,
        bound: f64,
    ) -> Result<f64, Failure> {
        self.windows.clear();
        if bound.is_finite() {
            // A uniform delay is drawn from all of its windows.
            self.until = bound;
        }
        let urgent = self.output_windows(program, spot, bound)?;
        let drawn = Cell::new(f64::INFINITY);
        self.attempt(|race, never| {
            if race.windows.is_empty() {
                return Ok(());
            }
            let is_demanded =
                race.demand().is_some() && race.windows.iter().all(|one| one.1.is_finite());
            let is_uniform = bound.is_finite() || spot.exponential_rate.is_none() && is_demanded;
            let rate = if is_uniform {
                None
            } else {
                Some(rules::exponential_rate(race, process, spot, never)?)
            };
            drawn.set(race.delay_in_windows(rate)?);
            Ok(())
        })?;
        Ok(drawn.get().min(urgent))
    }
}
