//! The operations that rules consist of.

use std::cell::Cell;

use crate::ir::{DoubleOperator, FunctionId, Relation};
use crate::stochastic::condition::Condition;
use crate::stochastic::failure::{Failure, Stand};
use crate::stochastic::program::{Program, Spot};

/// What comes of a rule, if it does not end early.
pub(in crate::stochastic) type Flow<B, T = ()> = Result<T, <B as Backend>::End>;

/// For how long the controller waits, and whether a delay is drawn for its moves meanwhile.
pub(in crate::stochastic) struct Held<B: Backend> {
    pub(in crate::stochastic) time: B::Real,
    pub(in crate::stochastic) draws: B::Integer,
}

/// What carries out rules: at once, or as code.
pub(in crate::stochastic) trait Backend: Sized {
    type Integer: Copy;
    type Real: Copy;
    /// Where a rule goes on that does not go on here.
    type Exit: Copy;
    /// How a rule ends early. Code is written to its end.
    type End;

    fn integer(&mut self, value: i32) -> Self::Integer;
    fn real(&mut self, value: f64) -> Self::Real;

    /// A variable that begins with a number.
    fn variable(&mut self, value: i32) -> Cell<Self::Integer> {
        Cell::new(self.integer(value))
    }

    fn real_variable(&mut self, value: f64) -> Cell<Self::Real> {
        Cell::new(self.real(value))
    }

    /// A variable that begins with what a value is now.
    fn copy_of(&mut self, value: Self::Real) -> Cell<Self::Real> {
        let variable = self.real_variable(0.0);
        self.set_real(&variable, value);
        variable
    }

    fn set(&mut self, variable: &Cell<Self::Integer>, value: Self::Integer);
    fn set_real(&mut self, variable: &Cell<Self::Real>, value: Self::Real);

    /// The sum of small integers: nobody looks whether it fits.
    fn plus(&mut self, left: Self::Integer, right: i32) -> Self::Integer;
    fn sum(&mut self, left: Self::Integer, right: Self::Integer) -> Self::Integer;
    fn doubles(
        &mut self,
        operator: DoubleOperator,
        left: Self::Real,
        right: Self::Real,
    ) -> Self::Real;

    fn add(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Add, left, right)
    }

    fn subtract(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Subtract, left, right)
    }

    fn multiply(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Multiply, left, right)
    }

    fn divide(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Divide, left, right)
    }

    fn least(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Minimum, left, right)
    }

    fn greatest(&mut self, left: Self::Real, right: Self::Real) -> Self::Real {
        self.doubles(DoubleOperator::Maximum, left, right)
    }

    /// `0 - value`
    fn negate(&mut self, value: Self::Real) -> Self::Real {
        let zero = self.real(0.0);
        self.subtract(zero, value)
    }

    /// Whether a relation holds: 0 or 1.
    fn compare(
        &mut self,
        left: Self::Integer,
        relation: Relation,
        right: Self::Integer,
    ) -> Self::Integer;
    fn compare_reals(
        &mut self,
        left: Self::Real,
        relation: Relation,
        right: Self::Real,
    ) -> Self::Integer;

    fn compare_to(&mut self, left: Self::Integer, relation: Relation, right: i32) -> Self::Integer {
        let right = self.integer(right);
        self.compare(left, relation, right)
    }

    fn compare_real_to(
        &mut self,
        left: Self::Real,
        relation: Relation,
        right: f64,
    ) -> Self::Integer {
        let right = self.real(right);
        self.compare_reals(left, relation, right)
    }

    /// Does something only if a condition holds.
    fn when(
        &mut self,
        condition: Self::Integer,
        then: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self>;

    /// Does one of two things.
    fn choose(
        &mut self,
        condition: Self::Integer,
        then: impl FnOnce(&mut Self) -> Flow<Self>,
        otherwise: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self>;

    /// Does what a number says that is less than `count`.
    fn cases(
        &mut self,
        number: Self::Integer,
        count: usize,
        each: impl FnMut(&mut Self, usize) -> Flow<Self>,
    ) -> Flow<Self>;

    /// Does something again and again as long as a condition holds.
    fn repeat(
        &mut self,
        condition: impl FnMut(&mut Self) -> Self::Integer,
        body: impl FnMut(&mut Self) -> Flow<Self>,
    ) -> Flow<Self>;

    /// Does something that may leave by the exit, and then something else.
    fn within(
        &mut self,
        body: impl FnOnce(&mut Self, Self::Exit) -> Flow<Self>,
        left: impl FnOnce(&mut Self) -> Flow<Self>,
    ) -> Flow<Self>;

    /// Does something that may leave by the exit, and goes on.
    fn attempt(&mut self, body: impl FnOnce(&mut Self, Self::Exit) -> Flow<Self>) -> Flow<Self> {
        self.within(body, |_| Ok(()))
    }

    /// Leaves by an exit.
    fn leave(&mut self, exit: Self::Exit) -> Flow<Self>;

    /// Ends the run, which has no result.
    fn fail(&mut self, why: impl FnOnce(&Self) -> Failure) -> Flow<Self>;

    /// Goes on if a condition holds, else leaves by an exit.
    fn unless(&mut self, condition: Self::Integer, exit: Self::Exit) -> Flow<Self> {
        self.choose(condition, |_| Ok(()), |b| b.leave(exit))
    }

    /// Goes on if a condition holds, else ends the run.
    fn insist(
        &mut self,
        condition: Self::Integer,
        why: impl FnOnce(&Self) -> Failure,
    ) -> Flow<Self> {
        self.choose(condition, |_| Ok(()), |b| b.fail(why))
    }

    /// Goes on if a number is finite and not negative, else ends the run.
    fn insist_on_range(
        &mut self,
        value: Self::Real,
        why: impl Copy + FnOnce(&Self) -> Failure,
    ) -> Flow<Self> {
        let is_least = self.compare_real_to(value, Relation::GreaterEqual, 0.0);
        self.insist(is_least, why)?;
        let is_finite = self.compare_real_to(value, Relation::Less, f64::INFINITY);
        self.insist(is_finite, why)
    }

    /// A number from 0 to a maximum, or one with a mean delay, or one of so many integers.
    fn draw_uniform(&mut self, maximum: Self::Real) -> Self::Real;
    fn draw_exponential(&mut self, rate: Self::Real) -> Self::Real;
    fn draw_below(&mut self, count: Self::Integer) -> Self::Integer;

    fn load_real(&mut self, word: u32) -> Self::Real;

    /// Calls a function of the network.
    fn call(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, Self::Integer>;
    /// Calls one that leaves a number.
    fn call_for_real(&mut self, function: FunctionId, values: &[i32]) -> Flow<Self, Self::Real>;

    /// Whether the rate of a clock may differ from 1.
    fn is_rated(&self, clock: u32) -> bool;

    /// Where a process is, and a number, for what is said of a failure.
    fn stand(&self, process: usize) -> Stand;
    fn shown(&self, value: Self::Real) -> f64;

    /// Notes in how long a process tries to move, and how long it may stay; nothing if never, or
    /// for ever. `is_late` says whether it may have to leave before it tries to.
    fn set_plan(
        &mut self,
        process: usize,
        attempt: Option<Self::Real>,
        stay: Option<Self::Real>,
        is_late: bool,
    );

    /// The windows of the plan that is being made; their ends are in order.
    fn set_window_count(&mut self, count: Self::Integer);
    fn window_count(&mut self) -> Self::Integer;
    fn window(&mut self, number: Self::Integer) -> (Self::Real, Self::Real);
    fn set_window(&mut self, number: Self::Integer, low: Self::Real, high: Self::Real);

    /// See [`super::delay_in_windows`].
    fn delay_in_windows(&mut self, rate: Option<Self::Real>) -> Flow<Self, Self::Real>;

    /// Whether a condition holds now that is no conjunction of comparisons.
    fn holds(&mut self, condition: Condition, values: &[i32]) -> Flow<Self, Self::Integer>;

    /// Whether the rules know how long a process may stay by its invariant.
    fn knows_stay(&mut self, _: &Program<'_>, _: &Spot) -> bool {
        true
    }

    /// How long it may stay by one that they do not know.
    fn other_stay(
        &mut self,
        program: &Program<'_>,
        process: usize,
        spot: &Spot,
    ) -> Flow<Self, Self::Real>;

    /// Whether the rules know when the outputs of a process are enabled.
    fn knows_outputs(&mut self, _: &Program<'_>, _: &Spot) -> bool {
        true
    }

    /// Whether somebody decides about the controllable outputs of a process, and the rules know
    /// when.
    fn knows_decisions(&self, _: &Spot) -> bool {
        false
    }

    /// For how long the controller waits, and whether delays are drawn for its moves.
    fn held(&mut self) -> Held<Self> {
        unreachable!("the rules do not know when anybody decides")
    }

    /// Notes whether a process tries to move when the controller is asked.
    fn set_question(&mut self, _: usize, _: Self::Integer) {
        unreachable!("the rules do not know when anybody decides")
    }

    /// Whether one is enabled now that they do not know.
    fn other_ability(&mut self, program: &Program<'_>, spot: &Spot) -> Flow<Self, Self::Integer>;

    /// In how long a process tries to move whose outputs they do not know.
    fn other_attempt(
        &mut self,
        program: &Program<'_>,
        process: usize,
        spot: &Spot,
        stay: Option<Self::Real>,
    ) -> Flow<Self, Self::Real>;
}
