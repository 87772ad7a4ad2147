//! Rules written as code.

use std::cell::Cell;
use std::convert::Infallible;

use super::writer::Writer;
use crate::ir::{
    BlockId, Distribution, DoubleOperator, FunctionId, Instruction, LocationId, ProcessId,
    Register, RegisterType, Relation,
};
use crate::stochastic::condition::Condition;
use crate::stochastic::failure::{Failure, Stand};
use crate::stochastic::program::{Program, Spot};
use crate::stochastic::rules::{Backend, Flow, Held};

impl Backend for Writer<'_> {
    type Integer = Register;
    type Real = Register;
    type Exit = BlockId;
    type End = Infallible;

    fn integer(&mut self, value: i32) -> Register {
        self.result(RegisterType::Integer, |target| Instruction::Integer {
            target,
            value,
        })
    }

    fn real(&mut self, value: f64) -> Register {
        let value = value.into();
        self.result(RegisterType::Double, |target| Instruction::Double {
            target,
            value,
        })
    }

    fn set(&mut self, variable: &Cell<Register>, value: Register) {
        self.copy(variable.get(), value);
    }

    fn set_real(&mut self, variable: &Cell<Register>, value: Register) {
        self.copy(variable.get(), value);
    }

    fn plus(&mut self, left: Register, right: i32) -> Register {
        let right = self.integer(right);
        self.add_integers(left, right)
    }

    fn sum(&mut self, left: Register, right: Register) -> Register {
        self.add_integers(left, right)
    }

    fn doubles(&mut self, operator: DoubleOperator, left: Register, right: Register) -> Register {
        self.result(RegisterType::Double, |target| {
            Instruction::DoubleArithmetic {
                operator,
                target,
                left,
                right,
            }
        })
    }

    fn compare(&mut self, left: Register, relation: Relation, right: Register) -> Register {
        self.result(RegisterType::Integer, |target| {
            Instruction::CompareIntegers {
                relation,
                target,
                left,
                right,
            }
        })
    }

    fn compare_reals(&mut self, left: Register, relation: Relation, right: Register) -> Register {
        self.result(RegisterType::Integer, |target| {
            Instruction::CompareDoubles {
                relation,
                target,
                left,
                right,
            }
        })
    }

    fn when(
        &mut self,
        condition: Register,
        then: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        self.when(condition, |w| {
            let Ok(()) = then(w);
        });
        Ok(())
    }

    fn choose(
        &mut self,
        condition: Register,
        then: impl FnOnce(&mut Self) -> Flow<Self>,
        otherwise: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        let (holds, fails, next) = (self.block(), self.block(), self.block());
        self.branch(condition, holds, fails);
        self.at(holds);
        then(self)?;
        self.jump(next);
        self.at(fails);
        otherwise(self)?;
        self.jump(next);
        self.at(next);
        Ok(())
    }

    fn cases(
        &mut self,
        number: Register,
        count: usize,
        mut each: impl FnMut(&mut Self, usize) -> Flow<Self>,
    ) -> Flow<Self> {
        if count == 1 {
            return each(self, 0);
        }
        let (start, next) = (self.block(), self.block());
        self.jump(start);
        let mut places = Vec::with_capacity(count);
        for place in 0..count {
            let block = self.block();
            self.at(block);
            each(self, place)?;
            let is_idle = self.is_empty(block);
            places.push((place as i32, if is_idle { next } else { block }));
            self.jump(next);
        }
        self.at(start);
        self.select(number, &places);
        self.at(next);
        Ok(())
    }

    fn repeat(
        &mut self,
        mut condition: impl FnMut(&mut Self) -> Register,
        mut body: impl FnMut(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        let (head, inside, next) = (self.block(), self.block(), self.block());
        self.jump(head);
        self.at(head);
        let holds = condition(self);
        self.branch(holds, inside, next);
        self.at(inside);
        body(self)?;
        self.jump(head);
        self.at(next);
        Ok(())
    }

    fn within(
        &mut self,
        body: impl FnOnce(&mut Self, BlockId) -> Flow<Self>,
        left: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self> {
        let (exit, next) = (self.block(), self.block());
        body(self, exit)?;
        self.jump(next);
        if self.is_reached(exit) {
            self.at(exit);
            left(self)?;
            self.jump(next);
        }
        self.at(next);
        Ok(())
    }

    fn leave(&mut self, exit: BlockId) -> Flow<Self> {
        self.jump(exit);
        Ok(())
    }

    fn fail(&mut self, _: impl FnOnce(&Self) -> Failure) -> Flow<Self> {
        self.give_up();
        Ok(())
    }

    fn unless(&mut self, condition: Register, exit: BlockId) -> Flow<Self> {
        self.unless(condition, exit);
        Ok(())
    }

    fn insist(&mut self, condition: Register, _: impl FnOnce(&Self) -> Failure) -> Flow<Self> {
        self.insist(condition);
        Ok(())
    }

    fn draw_uniform(&mut self, maximum: Register) -> Register {
        self.draw(Distribution::Uniform, maximum)
    }

    fn draw_exponential(&mut self, rate: Register) -> Register {
        self.draw(Distribution::Exponential, rate)
    }

    fn draw_below(&mut self, count: Register) -> Register {
        let count = self.double_of(count);
        let drawn = self.draw(Distribution::Below, count);
        self.integer_of(drawn)
    }

    fn load_real(&mut self, word: u32) -> Register {
        self.load_double(word)
    }

    fn call(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, Register> {
        let arguments = values.iter().map(|&value| self.integer(value)).collect();
        Ok(self.call_for(function, arguments))
    }

    fn call_for_real(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, Register> {
        self.call(function, values);
        Ok(self.load_double(self.layout.result))
    }

    fn is_rated(&self, clock: u32) -> bool {
        self.layout.is_rated(clock)
    }

    fn stand(&self, process: usize) -> Stand {
        // Failures have no places in code.
        Stand {
            process: ProcessId(process as u32),
            location: LocationId(0),
        }
    }

    fn shown(&self, _: Register) -> f64 {
        f64::NAN
    }

    fn set_plan(
        &mut self,
        process: usize,
        attempt: Option<Register>,
        stay: Option<Register>,
        is_late: bool,
    ) {
        if let Some(word) = self.layout.attempts[process] {
            let attempt = attempt.unwrap_or_else(|| self.real(f64::INFINITY));
            self.store_double(word, attempt);
        }
        if let Some(word) = self.layout.stays[process] {
            // Who moves in time need not be watched, unless it matters to who decides.
            let stay = stay.filter(|_| is_late || self.layout.decisions.is_some());
            if stay.is_some() && is_late {
                self.store_integer(self.layout.has_stays, 1);
            }
            let stay = stay.unwrap_or_else(|| self.real(f64::INFINITY));
            self.store_double(word, stay);
        }
    }

    fn set_window_count(&mut self, count: Register) {
        self.store(self.layout.windows, count);
    }

    fn window_count(&mut self) -> Register {
        self.load(self.layout.windows)
    }

    fn window(&mut self, number: Register) -> (Register, Register) {
        let place = self.place_of_double(number, self.layout.most_windows);
        let low = self.load_double_at(self.layout.lows, Some(place));
        (low, self.load_double_at(self.layout.highs, Some(place)))
    }

    fn set_window(&mut self, number: Register, low: Register, high: Register) {
        let place = self.place_of_double(number, self.layout.most_windows);
        self.store_double_at(self.layout.lows, Some(place), low);
        self.store_double_at(self.layout.highs, Some(place), high);
    }

    fn delay_in_windows(&mut self, rate: Option<Register>) -> Flow<Self, Register> {
        if let Some(rate) = rate {
            self.store_double(self.layout.rate, rate);
        }
        let is_uniform = self.integer(rate.is_none().into());
        Ok(self.call_for_double(self.layout.in_windows, vec![is_uniform]))
    }

    fn knows_decisions(&self, spot: &Spot) -> bool {
        spot.is_controllable && self.layout.decisions.is_some()
    }

    fn held(&mut self) -> Held<Self> {
        let decisions = self.layout.decisions.as_ref().expect("somebody decides");
        Held {
            time: self.load_double(decisions.hold),
            draws: if decisions.sees_time {
                self.load(decisions.draws)
            } else {
                self.integer(1)
            },
        }
    }

    fn set_question(&mut self, process: usize, is_question: Register) {
        let decisions = self.layout.decisions.as_ref().expect("somebody decides");
        if let Some(word) = decisions.questions[process] {
            self.store(word, is_question);
        }
    }

    fn holds(&mut self, _: Condition, _: &[i32]) -> Flow<Self, Register> {
        unreachable!("networks with such conditions are not written as code")
    }

    fn other_stay(&mut self, _: &Program<'_>, _: usize, _: &Spot) -> Flow<Self, Register> {
        unreachable!("the rules know all of a network that is written as code")
    }

    fn other_ability(&mut self, _: &Program<'_>, _: &Spot) -> Flow<Self, Register> {
        unreachable!("the rules know all of a network that is written as code")
    }

    fn other_attempt(
        &mut self,
        _: &Program<'_>,
        _: usize,
        _: &Spot,
        _: Option<Register>,
    ) -> Flow<Self, Register> {
        unreachable!("the rules know all of a network that is written as code")
    }
}
