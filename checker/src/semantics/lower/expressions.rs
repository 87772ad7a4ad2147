//! Values and conditions.

use super::super::layout::chance_words;
use super::super::typed::{Expr, Kind};
use super::super::types::Type;
use super::{Builder, at, register_type};
use crate::ir::{Address, Base, BlockId, Instruction, Register, RegisterType, Terminator};

impl Builder<'_> {
    /// The value of a scalar expression.
    pub(super) fn value(&mut self, expr: &Expr) -> Register {
        match &expr.kind {
            Kind::Int(value) => self.integer(*value),
            Kind::Double(value) => self.double(*value),
            Kind::Variable(_) | Kind::Index(_) | Kind::Field { .. } => {
                let target = self.target(expr, false);
                self.load(target, &expr.ty)
            }
            Kind::Assign(..) | Kind::Compound(..) => {
                let target = self.target(expr, true);
                self.load(target, &expr.ty)
            }
            Kind::Step {
                target,
                delta,
                postfix,
            } => {
                let (place, old) = self.step(target, *delta, expr.span);
                if *postfix {
                    old
                } else {
                    self.load(place, &expr.ty)
                }
            }
            Kind::Call { .. } => self.call(expr, None).expect("the function returns a value"),
            Kind::Quantifier { .. } => self.quantifier(expr),
            Kind::Ternary(condition, then, otherwise) => {
                self.choose_value(condition, then, otherwise, &expr.ty)
            }
            Kind::Not(inner) => {
                let source = self.value(inner);
                self.not(source)
            }
            Kind::And(..) | Kind::Or(..) => self.truth(expr),
            _ => self.operation(expr),
        }
    }

    fn operation(&mut self, expr: &Expr) -> Register {
        match &expr.kind {
            Kind::ToDouble(inner) => {
                let source = self.value(inner);
                self.as_double(source)
            }
            Kind::ClockReading(inner) => {
                self.effects.mentions_clocks = true;
                self.value(inner)
            }
            Kind::Random(distribution, arguments) => {
                let arguments = self.stable_values(arguments);
                let site = self.site(expr.span);
                // The random numbers lie in the state.
                self.effects.reads_state = true;
                self.compute(RegisterType::Double, |target| Instruction::Random {
                    distribution: *distribution,
                    target,
                    arguments,
                    stream: at(Base::State, chance_words::STREAM),
                    site,
                })
            }
            Kind::ToInteger(inner) => {
                let source = self.value(inner);
                let site = self.site(expr.span);
                self.compute(RegisterType::Integer, |target| {
                    Instruction::DoubleToInteger {
                        target,
                        source,
                        site,
                    }
                })
            }
            Kind::Integer(operator, left, right) => {
                let (left, right) = self.operands(left, right);
                self.arithmetic(*operator, left, right, expr.span)
            }
            Kind::Real(operator, left, right) => {
                let (left, right) = self.operands(left, right);
                self.real(*operator, left, right)
            }
            Kind::Math(function, arguments) => {
                let arguments = self.stable_values(arguments);
                let site = self.site(expr.span);
                self.compute(register_type(&expr.ty), |target| Instruction::Math {
                    function: *function,
                    target,
                    arguments,
                    site,
                })
            }
            _ => self.comparison(expr),
        }
    }

    fn comparison(&mut self, expr: &Expr) -> Register {
        match &expr.kind {
            Kind::Compare(relation, left, right) => {
                let (left, right) = self.operands(left, right);
                self.compare(*relation, left, right)
            }
            Kind::CompareReal(relation, left, right) => {
                let (left, right) = self.operands(left, right);
                self.compare_doubles(*relation, left, right)
            }
            Kind::CompareWords(equal, left, right) => {
                let words = left.ty.size().words;
                let left = self.stable_address(left, right);
                let right = self.address(right);
                let are_equal =
                    self.compute(RegisterType::Integer, |target| Instruction::EqualWords {
                        target,
                        left,
                        right,
                        words,
                    });
                if *equal {
                    are_equal
                } else {
                    self.not(are_equal)
                }
            }
            other => unreachable!("checking leaves no such value: {other:?}"),
        }
    }

    /// The address of an array or struct that the evaluation of `later` does not change.
    fn stable_address(&mut self, expr: &Expr, later: &Expr) -> Address {
        let source = self.address(expr);
        if !later.has_effect() {
            return source;
        }
        self.copied(source, expr.ty.size().words)
    }

    /// A copy of words in the frame.
    pub(super) fn copied(&mut self, source: Address, words: u32) -> Address {
        let target = self.frame(words);
        self.copy_words(target, source, words);
        target
    }

    fn operands(&mut self, left: &Expr, right: &Expr) -> (Register, Register) {
        let first = self.stable_value(left, right.has_effect());
        (first, self.value(right))
    }

    fn stable_values(&mut self, exprs: &[Expr]) -> Vec<Register> {
        (0..exprs.len())
            .map(|i| {
                let changes = exprs[i + 1..].iter().any(Expr::has_effect);
                self.stable_value(&exprs[i], changes)
            })
            .collect()
    }

    /// The value of an expression, in a register of its own if a later operand changes variables.
    pub(super) fn stable_value(&mut self, expr: &Expr, changes_follow: bool) -> Register {
        let source = self.value(expr);
        if !changes_follow {
            return source;
        }
        let target = self.register(self.registers[source.0 as usize]);
        self.copy(target, source);
        target
    }

    fn truth(&mut self, expr: &Expr) -> Register {
        let target = self.register(RegisterType::Integer);
        self.either_side(expr, [1, 0], |builder, value| {
            builder.set_integer(target, value);
        });
        target
    }

    fn choose_value(
        &mut self,
        condition: &Expr,
        then: &Expr,
        otherwise: &Expr,
        ty: &Type,
    ) -> Register {
        let target = self.register(register_type(ty));
        self.either_side(condition, [then, otherwise], |builder, side| {
            let source = builder.value(side);
            builder.copy(target, source);
        });
        target
    }

    /// Goes to `yes` if the expression is true, to `no` otherwise.
    pub(super) fn condition(&mut self, expr: &Expr, yes: BlockId, no: BlockId) {
        match &expr.kind {
            Kind::Int(value) => self.jump(if *value == 0 { no } else { yes }),
            Kind::Not(inner) => self.condition(inner, no, yes),
            Kind::And(left, right) => {
                let next = self.new_block();
                self.condition(left, next, no);
                self.switch(next);
                self.condition(right, yes, no);
            }
            Kind::Or(left, right) => {
                let next = self.new_block();
                self.condition(left, yes, next);
                self.switch(next);
                self.condition(right, yes, no);
            }
            _ => {
                let value = self.value(expr);
                self.terminate(Terminator::Branch(value, yes, no));
            }
        }
    }
}
