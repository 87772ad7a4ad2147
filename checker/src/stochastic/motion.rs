//! What clocks do while nothing else happens, where some of them *flow*: their rates change as time
//! passes. And conditions there, which change where a comparison changes its side.
//!
//! Times are counted from the last move. Invariant: unless a function says otherwise, the words of
//! the machine are those of time 0.

use super::failure::{Failure, Stand};
use super::integrator::Integrator;
use super::machine::{Machine, Mask};
use crate::cancellation;
use crate::ir::FunctionId;

/// A step of the integrator is looked at so many times if more than one clock may count at a time.
const LOOKS: f64 = 4.0;
/// Where no clock flows, conditions that are not linear in time are looked at so often.
const STEP_OF_LOOKS: f64 = 0.01;
/// How far behind a moment a condition is asked what holds behind it, as a part of the time to the
/// next look.
const NUDGE: f64 = 1e-9;
/// Nothing is looked for behind this time.
const LAST_LOOK: f64 = 1e12;
/// Tangents that are followed towards a change, at most.
const MOST_TANGENTS: usize = 8;
/// How near to the end of the tangents a change is looked for first, relative to the time.
const NEAR: f64 = 1e-15;
/// By how much it is looked for farther, if it is not there.
const GROWTH: f64 = 16.0;
/// What a look takes: see [`cancellation::work`].
const UNITS_FOR_LOOK: usize = 256;

/// A condition that is followed along the motion of clocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Followed<'a> {
    pub(super) function: FunctionId,
    pub(super) arguments: &'a [i32],
    /// Whether each of its comparisons is linear, and of one clock with a number: so none of them
    /// changes more than once while that clock rises or falls.
    pub(super) is_simple: bool,
}

/// The clocks of a network between two moves.
#[derive(Debug, Default)]
pub(super) struct Motion {
    integrator: Integrator,
    /// The first words of the clocks that flow.
    flowing: Vec<u32>,
    /// What sets their rates, and who does.
    rates: Vec<(FunctionId, Stand)>,
    /// All clocks at time 0: their first words, values and rates.
    base: Vec<(u32, f64, f64)>,
    has_begun: bool,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Motion {
    /// With steps of this length, by Euler's method; adaptive ones without it.
    pub(super) fn new(fixed_step: Option<f64>) -> Motion {
        Motion {
            integrator: Integrator::new(fixed_step),
            ..Motion::default()
        }
    }

    /// Says which clocks flow, and what sets their rates.
    pub(super) fn set_flows(
        &mut self,
        flows: impl IntoIterator<Item = (FunctionId, Stand, Vec<u32>)>,
    ) {
        self.flowing.clear();
        self.rates.clear();
        for (function, stand, clocks) in flows {
            self.rates.push((function, stand));
            self.flowing.extend(clocks);
        }
        self.has_begun = false;
    }

    pub(super) fn is_flowing(&self) -> bool {
        !self.flowing.is_empty()
    }

    /// Whether a clock flows.
    pub(super) fn flows(&self, clock: u32) -> bool {
        self.flowing.contains(&clock)
    }

    /// Says that a run begins now, with the words of the machine.
    pub(super) fn start(&mut self) {
        self.integrator.forget();
        self.has_begun = false;
    }

    /// Says that the words of the machine are those of time 0 now.
    pub(super) fn end(&mut self) {
        self.has_begun = false;
    }

    fn begin(&mut self, machine: &Machine<'_>) {
        if self.has_begun {
            return;
        }
        self.has_begun = true;
        self.base.clear();
        for &clock in &machine.network.chances.clocks {
            let (value, rate) = machine.clock(clock);
            self.base.push((clock, value, rate));
        }
        self.values.clear();
        let flowing = self.flowing.iter();
        self.values
            .extend(flowing.map(|&clock| machine.clock(clock).0));
        self.integrator.begin(&self.values);
    }

    /// Makes the words of the machine those of a time, with the rates that clocks have then.
    pub(super) fn go_to(&mut self, machine: &mut Machine<'_>, time: f64) -> Result<(), Failure> {
        self.begin(machine);
        if !self.is_flowing() {
            linear(machine, &self.base, time);
            return Ok(());
        }
        let (base, flowing, rates) = (&self.base, &self.flowing, &self.rates);
        let mut slopes = |time: f64, values: &[f64], target: &mut [f64]| {
            slopes_at(machine, (base, flowing, rates), time, values, target)
        };
        let (values, rates) = (&mut self.values, &mut self.slopes);
        self.integrator.at(time, &mut slopes, values, rates)?;
        linear(machine, &self.base, time);
        for (&clock, &value) in self.flowing.iter().zip(&self.values) {
            machine.set_double(clock, value);
        }
        for (&clock, &slope) in self.flowing.iter().zip(&self.slopes) {
            machine.set_rate(clock, slope);
        }
        Ok(())
    }

    /// Makes the words of the machine those of time 0 again.
    fn go_back(&self, machine: &mut Machine<'_>) {
        for &(clock, value, rate) in &self.base {
            machine.set_double(clock, value);
            machine.set_rate(clock, rate);
        }
    }

    /// Looks at the state at a time.
    pub(super) fn look<R>(
        &mut self,
        machine: &mut Machine<'_>,
        time: f64,
        look: impl FnOnce(&mut Machine<'_>) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let arrived = self.go_to(machine, time);
        let found = arrived.and_then(|()| look(machine));
        self.go_back(machine);
        found
    }

    /// The next time behind this one at which something that changes is looked at.
    pub(super) fn next_look(
        &mut self,
        machine: &mut Machine<'_>,
        time: f64,
    ) -> Result<f64, Failure> {
        self.next_of(machine, time, LOOKS)
    }

    /// The next look if each step of the integrator has so many.
    fn next_of(
        &mut self,
        machine: &mut Machine<'_>,
        time: f64,
        looks: f64,
    ) -> Result<f64, Failure> {
        self.begin(machine);
        if !self.is_flowing() {
            return Ok(time + self.integrator.fixed_step.unwrap_or(STEP_OF_LOOKS));
        }
        let (base, flowing, rates) = (&self.base, &self.flowing, &self.rates);
        let mut slopes = |time: f64, values: &[f64], target: &mut [f64]| {
            slopes_at(machine, (base, flowing, rates), time, values, target)
        };
        let found = self.integrator.next_look(time, looks, &mut slopes);
        self.go_back(machine);
        found
    }

    /// The mask of a condition after a time; its horizon is when it changes next, infinity if that
    /// is not before `until`.
    pub(super) fn mask(
        &mut self,
        machine: &mut Machine<'_>,
        Followed {
            function,
            arguments,
            is_simple,
        }: Followed<'_>,
        time: f64,
        until: f64,
    ) -> Result<Mask, Failure> {
        let looks = if is_simple { 1.0 } else { LOOKS };
        let ask = |motion: &mut Motion, machine: &mut Machine<'_>, time: f64| {
            motion.look(machine, time, |machine| machine.view(function, arguments))
        };
        let now = ask(self, machine, time)?.now;
        let mut next = self.next_of(machine, time, looks)?;
        let mut known = time + NUDGE * (next - time);
        let mut seen = ask(self, machine, known)?;
        let mut mask = Mask {
            now,
            behind: seen.now,
            horizon: f64::INFINITY,
        };
        if time >= until {
            return Ok(mask);
        }
        let side = seen.signature.to_bits();
        loop {
            cancellation::work(UNITS_FOR_LOOK);
            let found = ask(self, machine, next)?;
            if found.signature.to_bits() != side {
                let mut probe = |time| {
                    let found = ask(self, machine, time)?;
                    let is_same = found.signature.to_bits() == side;
                    Ok(is_same.then_some(found.gap_closes_in))
                };
                let change = first_change(known, seen.gap_closes_in, next, &mut probe)?;
                mask.horizon = change - time;
                return Ok(mask);
            }
            if next >= until.min(LAST_LOOK) {
                return Ok(mask);
            }
            (known, seen) = (next, found);
            next = self.next_of(machine, next, looks)?;
        }
    }

    /// When a clock reaches a value, if that is before `until`.
    pub(super) fn reach(
        &mut self,
        machine: &mut Machine<'_>,
        clock: u32,
        value: f64,
        until: f64,
    ) -> Result<Option<f64>, Failure> {
        let is_below = |motion: &mut Motion, machine: &mut Machine<'_>, time: f64| {
            motion.look(machine, time, |machine| Ok(machine.clock(clock).0 < value))
        };
        if !is_below(self, machine, 0.0)? {
            return Ok(Some(0.0));
        }
        let mut known = 0.0;
        while known < until.min(LAST_LOOK) {
            cancellation::work(UNITS_FOR_LOOK);
            let next = self.next_of(machine, known, 1.0)?;
            if !is_below(self, machine, next)? {
                let mut probe = |time| {
                    let (found, rate) =
                        self.look(machine, time, |machine| Ok(machine.clock(clock)))?;
                    Ok((found < value).then_some((value - found) / rate))
                };
                let time = first_change(known, f64::INFINITY, next, &mut probe)?;
                return Ok((time <= until).then_some(time));
            }
            known = next;
        }
        Ok(None)
    }
}

/// What is asked whether something is the same at a time as before: `None` if it is not; else in
/// how long it would differ if all clocks went on as they do then, as far as that is known.
type Probe<'a> = dyn FnMut(f64) -> Result<Option<f64>, Failure> + 'a;

/// The first time at which something is different, to the last bit, between one where it is not,
/// with what was found there, and one where it is.
///
/// The method of Newton comes near; then steps that grow find both sides of the change; what is
/// left is halved.
fn first_change(
    mut same: f64,
    mut differs_in: f64,
    mut other: f64,
    probe: &mut Probe<'_>,
) -> Result<f64, Failure> {
    let is_between = |time: f64, same: f64, other: f64| time > same && time < other;
    let mut is_beyond = false;
    for _ in 0..MOST_TANGENTS {
        let time = same + differs_in;
        if !is_between(time, same, other) {
            break;
        }
        let Some(longer) = probe(time)? else {
            other = time;
            is_beyond = true;
            break;
        };
        (same, differs_in) = (time, longer);
    }
    let mut step = NEAR * other.abs().max(f64::MIN_POSITIVE);
    loop {
        let time = if is_beyond { other - step } else { same + step };
        if !is_between(time, same, other) || step > (other - same) / 2.0 {
            break;
        }
        let is_same = probe(time)?.is_some();
        if is_same {
            same = time;
        } else {
            other = time;
        }
        if is_same == is_beyond {
            break;
        }
        step *= GROWTH;
    }
    loop {
        let middle = same + (other - same) / 2.0;
        if !is_between(middle, same, other) {
            return Ok(other);
        }
        if probe(middle)?.is_some() {
            same = middle;
        } else {
            other = middle;
        }
    }
}

/// Makes the words of all clocks those of a time, as if none flowed.
fn linear(machine: &mut Machine<'_>, base: &[(u32, f64, f64)], time: f64) {
    for &(clock, value, rate) in base {
        machine.set_double(clock, value + rate * time);
    }
}

/// What flows: all clocks at time 0, those that flow, and what sets their rates.
type Equation<'a> = (&'a [(u32, f64, f64)], &'a [u32], &'a [(FunctionId, Stand)]);

/// The rates of the clocks that flow, if these have some values at a time.
fn slopes_at(
    machine: &mut Machine<'_>,
    (base, flowing, rates): Equation<'_>,
    time: f64,
    values: &[f64],
    target: &mut [f64],
) -> Result<(), Failure> {
    if !values.iter().all(|value| value.is_finite()) {
        return Err(Failure::ClockRate(rates[0].1));
    }
    linear(machine, base, time);
    for (&clock, &value) in flowing.iter().zip(values) {
        machine.set_double(clock, value);
    }
    for &(function, _) in rates {
        machine.call(function, &[])?;
    }
    for (target, &clock) in target.iter_mut().zip(flowing) {
        *target = machine.clock(clock).1;
    }
    if target.iter().all(|slope| slope.is_finite()) {
        Ok(())
    } else {
        Err(Failure::ClockRate(rates[0].1))
    }
}
