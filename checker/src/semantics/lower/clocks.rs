//! Clock constraints and clock assignments.

use super::super::typed::{ClockEffect, ClockRelation, ClockSet, Expr, Kind};
use super::super::types::Interval;
use super::Builder;
use crate::ir::{BlockId, ClockAtom, ClockId, ClockOperand, ClockRange, Instruction, Register};
use crate::syntax::ast::Quantifier;

/// The reference clock as an operand.
const REFERENCE: ClockOperand = ClockOperand {
    first: ClockId(0),
    index: None,
};

/// The comparisons `left - right ≺ bound` that a clock comparison stands for: whether the clocks
/// are swapped, whether the bound is negated, whether it is strict.
pub(in crate::semantics) fn comparisons(
    relation: ClockRelation,
    negated: bool,
) -> Vec<(bool, bool, bool)> {
    match relation {
        ClockRelation::Less => vec![(false, negated, true)],
        ClockRelation::LessEqual => vec![(false, negated, false)],
        ClockRelation::Equal => vec![(false, negated, false), (true, !negated, false)],
        ClockRelation::NotEqual => Vec::new(),
    }
}

/// The values of a bound, or of its negation.
pub(in crate::semantics) fn bound_range(bounds: Interval, negated: bool) -> Interval {
    let (low, high) = bounds;
    if negated {
        (high.saturating_neg(), low.saturating_neg())
    } else {
        (low, high)
    }
}

impl Builder<'_> {
    /// Emits the clock constraints of a condition; goes to `fail` if its data part is false. Static
    /// analysis hears nothing of comparisons that cannot matter, since the condition holds or fails
    /// without them.
    pub(super) fn constrain(&mut self, expr: &Expr, fail: BlockId) {
        let before = self.effects.atoms.len();
        self.emit_constraints(expr, fail);
        if expr.interval.0 == expr.interval.1 {
            self.effects.atoms.truncate(before);
        }
    }

    fn emit_constraints(&mut self, expr: &Expr, fail: BlockId) {
        if !expr.mentions_clocks() {
            let next = self.new_block();
            self.condition(expr, next, fail);
            self.switch(next);
            return;
        }
        match &expr.kind {
            Kind::And(left, right) => {
                self.constrain(left, fail);
                self.constrain(right, fail);
            }
            Kind::Or(left, right) => {
                let (data, clocks) = if left.mentions_clocks() {
                    (right, left)
                } else {
                    (left, right)
                };
                let (other, end) = (self.new_block(), self.new_block());
                self.condition(data, end, other);
                self.switch(other);
                self.constrain(clocks, fail);
                self.jump(end);
                self.switch(end);
            }
            Kind::Quantifier {
                quantifier: Quantifier::ForAll,
                local,
                range,
                body,
            } => self.count(*local, *range, expr, &mut |builder| {
                builder.constrain(body, fail);
            }),
            Kind::ClockCompare {
                relation,
                left,
                right,
                bound,
                negated,
            } => self.compare_clocks(
                expr,
                comparisons(*relation, *negated),
                left.as_deref(),
                right.as_deref(),
                bound,
            ),
            _ => unreachable!("checking leaves only conditions of the class of guards"),
        }
    }

    fn compare_clocks(
        &mut self,
        expr: &Expr,
        comparisons: Vec<(bool, bool, bool)>,
        left: Option<&Expr>,
        right: Option<&Expr>,
        bound: &Expr,
    ) {
        let left = self.clock_or_reference(left);
        let right = self.clock_or_reference(right);
        let register = self.value(bound);
        self.effects.emits = true;
        for (swapped, negated, strict) in comparisons {
            let (left, right) = if swapped {
                (right, left)
            } else {
                (left, right)
            };
            let (low, high) = bound_range(bound.interval, negated);
            self.effects.atoms.push(ClockAtom {
                left: left.1,
                right: right.1,
                low,
                high,
                strict,
            });
            let site = self.site(expr.span);
            self.emit(Instruction::Constrain {
                left: left.0,
                right: right.0,
                strict,
                bound: register,
                negate_bound: negated,
                site,
            });
        }
    }

    fn clock_or_reference(&mut self, clock: Option<&Expr>) -> (ClockOperand, ClockRange) {
        match clock.map(|clock| self.clock(clock)) {
            None => (REFERENCE, ClockRange::REFERENCE),
            Some((operand, ClockSet::Range(range))) => (operand, range),
            Some((_, ClockSet::Parameter(_))) => {
                unreachable!("functions hold no clock comparisons")
            }
        }
    }

    /// Emits an assignment to a clock; returns the clock, for an assignment may stand where a clock
    /// does.
    pub(super) fn assign_clock(
        &mut self,
        expr: &Expr,
        target: &Expr,
        source: Option<&Expr>,
        value: Option<&Expr>,
    ) -> (ClockOperand, ClockSet) {
        self.effects.emits = true;
        let (clock, target_set) = self.clock(target);
        let Some(source) = source else {
            let value = value.expect("a clock is set to a clock or a value");
            self.effects.assignments.push(ClockEffect {
                target: target_set,
                source: None,
                range: value.interval,
            });
            let register = self.value(value);
            let site = self.site(expr.span);
            self.emit(Instruction::SetClock {
                clock,
                value: register,
                site,
            });
            return (clock, target_set);
        };
        let (source, source_set) = self.clock(source);
        let increment: Option<Register> = value.map(|value| self.value(value));
        self.effects.assignments.push(ClockEffect {
            target: target_set,
            source: Some(source_set),
            range: value.map_or((0, 0), |value| value.interval),
        });
        let site = self.site(expr.span);
        self.emit(Instruction::CopyClock {
            clock,
            source,
            increment,
            site,
        });
        (clock, target_set)
    }
}
