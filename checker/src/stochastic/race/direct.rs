//! The race carries out rules at once, on its state.

use std::cell::Cell;

use super::Race;
use crate::exec::RunTimeError;
use crate::exec::arithmetic::{double, relate};
use crate::ir::{DoubleOperator, FunctionId, ProcessId, Relation};
use crate::stochastic::advice::View;
use crate::stochastic::condition::Condition;
use crate::stochastic::failure::{Failure, Stand};
use crate::stochastic::program::{Program, Spot};
use crate::stochastic::rules::{self, Backend, Flow};

/// An exit that is open: the number of those around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::stochastic) struct Exit(u32);

/// How a rule ends early.
#[derive(Debug)]
pub(in crate::stochastic) enum End {
    Left(Exit),
    /// Behind a pointer, so that what rules return fits into registers.
    Failed(Box<Failure>),
}

impl From<Failure> for End {
    fn from(failure: Failure) -> End {
        End::Failed(Box::new(failure))
    }
}

impl From<RunTimeError> for End {
    fn from(error: RunTimeError) -> End {
        Failure::from(error).into()
    }
}

impl From<End> for Failure {
    fn from(end: End) -> Failure {
        match end {
            End::Failed(failure) => *failure,
            End::Left(_) => unreachable!("an exit leads out of nothing but its own rule"),
        }
    }
}

impl Backend for Race<'_> {
    type Integer = i32;
    type Real = f64;
    type Exit = Exit;
    type End = End;

    fn integer(&mut self, value: i32) -> i32 {
        value
    }

    fn real(&mut self, value: f64) -> f64 {
        value
    }

    fn set(&mut self, variable: &Cell<i32>, value: i32) {
        variable.set(value);
    }

    fn set_real(&mut self, variable: &Cell<f64>, value: f64) {
        variable.set(value);
    }

    fn plus(&mut self, left: i32, right: i32) -> i32 {
        left + right
    }

    fn sum(&mut self, left: i32, right: i32) -> i32 {
        left + right
    }

    fn doubles(&mut self, operator: DoubleOperator, left: f64, right: f64) -> f64 {
        double(operator, left, right)
    }

    fn compare(&mut self, left: i32, relation: Relation, right: i32) -> i32 {
        relate(relation, left, right).into()
    }

    fn compare_reals(&mut self, left: f64, relation: Relation, right: f64) -> i32 {
        relate(relation, left, right).into()
    }

    fn when(&mut self, condition: i32, then: impl FnOnce(&mut Self) -> Flow<Self>) -> Flow<Self> {
        if condition == 0 { Ok(()) } else { then(self) }
    }

    fn choose(
        &mut self,
        condition: i32,
        then: impl FnOnce(&mut Self) -> Flow<Self>,
        otherwise: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        if condition == 0 {
            otherwise(self)
        } else {
            then(self)
        }
    }

    fn cases(
        &mut self,
        number: i32,
        _: usize,
        mut each: impl FnMut(&mut Self, usize) -> Flow<Self>,
    ) -> Flow<Self> {
        each(self, number as usize)
    }

    fn repeat(
        &mut self,
        mut condition: impl FnMut(&mut Self) -> i32,
        mut body: impl FnMut(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        while condition(self) != 0 {
            body(self)?;
        }
        Ok(())
    }

    fn within(
        &mut self,
        body: impl FnOnce(&mut Self, Exit) -> Flow<Self>,
        left: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        let exit = Exit(self.exits);
        self.exits += 1;
        let end = body(self, exit);
        self.exits -= 1;
        match end {
            Err(End::Left(by)) if by == exit => left(self),
            other => other,
        }
    }

    fn leave(&mut self, exit: Exit) -> Flow<Self> {
        Err(End::Left(exit))
    }

    fn fail(&mut self, why: impl FnOnce(&Self) -> Failure) -> Flow<Self> {
        Err(why(self).into())
    }

    fn draw_uniform(&mut self, maximum: f64) -> f64 {
        if let Some(drawn) = &mut self.drawn {
            drawn.note(maximum > 0.0);
            return 0.0;
        }
        maximum * self.machine.stream().uniform()
    }

    fn draw_exponential(&mut self, rate: f64) -> f64 {
        if let Some(drawn) = &mut self.drawn {
            drawn.note(true);
            return 0.0;
        }
        self.machine.stream().exponential(rate)
    }

    fn draw_below(&mut self, count: i32) -> i32 {
        if let Some(drawn) = &mut self.drawn {
            drawn.note(count > 1);
            return 0;
        }
        self.machine.stream().below(count as u32) as i32
    }

    fn load_real(&mut self, word: u32) -> f64 {
        self.machine.double(word)
    }

    fn call(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, i32> {
        Ok(self.machine.call(function, values)?)
    }

    fn call_for_real(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, f64> {
        Ok(self.machine.real(function, values)?)
    }

    fn is_rated(&self, clock: u32) -> bool {
        self.rated_clocks.binary_search(&clock).is_ok()
    }

    fn stand(&self, process: usize) -> Stand {
        Stand {
            process: ProcessId(process as u32),
            location: self.locations[process],
        }
    }

    fn shown(&self, value: f64) -> f64 {
        value
    }

    fn set_plan(&mut self, process: usize, attempt: Option<f64>, stay: Option<f64>, _: bool) {
        self.attempts[process] = attempt.unwrap_or(f64::INFINITY);
        self.bounds[process] = stay.unwrap_or(f64::INFINITY);
        if let Some(drawn) = &mut self.drawn {
            drawn.keep(process);
        }
    }

    fn set_window_count(&mut self, count: i32) {
        self.windows.truncate(count as usize);
    }

    fn window_count(&mut self) -> i32 {
        self.windows.len() as i32
    }

    fn window(&mut self, number: i32) -> (f64, f64) {
        self.windows[number as usize]
    }

    fn set_window(&mut self, number: i32, low: f64, high: f64) {
        match self.windows.get_mut(number as usize) {
            Some(window) => *window = (low, high),
            None => self.windows.push((low, high)),
        }
    }

    fn delay_in_windows(&mut self, rate: Option<f64>) -> Flow<Self, f64> {
        rules::delay_in_windows(self, rate.is_none().into(), rate.unwrap_or(f64::NAN))
    }
    fn holds(&mut self, condition: Condition, values: &[i32]) -> Flow<Self, i32> {
        Ok(self.machine.holds(condition, values)?.into())
    }

    fn knows_stay(&mut self, program: &Program<'_>, spot: &Spot) -> bool {
        !matches!(spot.invariant, Condition::Timed(_) | Condition::Curved(_))
            && !self.steps(program, spot.invariant)
    }

    fn other_stay(
        &mut self,
        program: &Program<'_>,
        process: usize,
        spot: &Spot,
    ) -> Flow<Self, f64> {
        Ok(if self.steps(program, spot.invariant) {
            self.stepped_bound(program, spot, process)?
        } else {
            self.looked_bound(program, spot, process)?
        })
    }

    fn knows_outputs(&mut self, program: &Program<'_>, spot: &Spot) -> bool {
        self.is_known(program, spot)
    }

    fn other_ability(&mut self, program: &Program<'_>, spot: &Spot) -> Flow<Self, i32> {
        for output in program.range(spot.outputs) {
            if self.output(program, output, 0.0, View::Allowed)?.now {
                return Ok(1);
            }
        }
        Ok(0)
    }

    fn other_attempt(
        &mut self,
        program: &Program<'_>,
        process: usize,
        spot: &Spot,
        stay: Option<f64>,
    ) -> Flow<Self, f64> {
        Ok(self.draw(program, spot, process, stay.unwrap_or(f64::INFINITY))?)
    }
}
