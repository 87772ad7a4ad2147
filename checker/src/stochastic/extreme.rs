//! The least or the greatest value of an expression in a run.

use super::failure::Failure;
use super::machine::Machine;
use super::race::Race;
use crate::ir::FunctionId;

/// Where a value is not linear in time although all clocks are, a delay is looked at in this many
/// parts.
const PARTS: u32 = 64;
/// A value is linear if its middle lies on the line so exactly, relative to its size.
const STRAIGHT: f64 = 1e-9;
/// An extreme between two looks is narrowed down so often, each time to 0.62 of its place.
const NARROWINGS: u32 = 40;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// The most extreme value so far.
#[derive(Debug)]
pub(super) struct Extreme {
    function: FunctionId,
    /// 1 if the greatest value counts, -1 if the least does.
    sign: f64,
    /// The greatest value times `sign`.
    best: f64,
}

impl Extreme {
    pub(super) fn new(function: FunctionId, maximum: bool) -> Extreme {
        Extreme {
            function,
            sign: if maximum { 1.0 } else { -1.0 },
            best: f64::NEG_INFINITY,
        }
    }

    pub(super) fn value(&self) -> f64 {
        self.sign * self.best
    }

    /// Looks at a state.
    pub(super) fn look(&mut self, machine: &mut Machine<'_>) -> Result<(), Failure> {
        let value = self.sign * machine.real(self.function, &[])?;
        self.note(value)
    }

    /// Looks at all times of a delay.
    pub(super) fn look_through(&mut self, race: &mut Race<'_>, delay: f64) -> Result<(), Failure> {
        let flows = race.motion.is_flowing() && race.reads_flow(self.function);
        let begin = self.at(race, 0.0)?;
        let end = self.at(race, delay)?;
        if !flows {
            let middle = self.at(race, delay / 2.0)?;
            let size = begin.abs().max(end.abs()).max(1.0);
            if (middle - f64::midpoint(begin, end)).abs() <= STRAIGHT * size {
                return Ok(());
            }
        }
        // Three neighbouring looks, of which the one in the middle may be near an extreme.
        let (mut left, mut middle) = ((0.0, begin), (0.0, begin));
        while middle.0 < delay {
            let next = if flows {
                race.motion.next_look(&mut race.machine, middle.0)?
            } else {
                middle.0 + delay / f64::from(PARTS)
            };
            let time = next.min(delay);
            let right = (time, self.at(race, time)?);
            let rise = middle.1 - left.1.min(right.1);
            if middle.1 >= left.1 && middle.1 >= right.1 && middle.1 + rise > self.best {
                self.narrow(race, left.0, right.0)?;
            }
            (left, middle) = (middle, right);
        }
        Ok(())
    }

    /// The value after this time, times `sign`.
    fn at(&mut self, race: &mut Race<'_>, time: f64) -> Result<f64, Failure> {
        let value = race.look_ahead(time, |machine| machine.real(self.function, &[]))?;
        let value = self.sign * value;
        self.note(value)?;
        Ok(value)
    }

    fn note(&mut self, value: f64) -> Result<(), Failure> {
        if !value.is_finite() {
            return Err(Failure::NoNumber);
        }
        self.best = self.best.max(value);
        Ok(())
    }

    /// Looks for the extreme between two times, by golden section.
    fn narrow(&mut self, race: &mut Race<'_>, mut low: f64, mut high: f64) -> Result<(), Failure> {
        let places = |low: f64, high: f64| {
            let part = GOLDEN * (high - low);
            (high - part, low + part)
        };
        let (mut first, mut second) = places(low, high);
        let mut values = (self.at(race, first)?, self.at(race, second)?);
        for _ in 0..NARROWINGS {
            if values.0 > values.1 {
                high = second;
                (first, second) = places(low, high);
                values = (self.at(race, first)?, values.0);
            } else {
                low = first;
                (first, second) = places(low, high);
                values = (values.1, self.at(race, second)?);
            }
        }
        Ok(())
    }
}
