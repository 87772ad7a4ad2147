//! Formulas over time: their bounds, and lowering to conditions on states and operators.

use super::checker::Checker;
use super::codes;
use super::scope::Entity;
use super::typed::Expr;
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{Formula, Guard, Temporal};
use crate::syntax::ast;

/// The greatest distance in time that a formula may speak of.
const GREATEST_DISTANCE: f64 = 1e15;

/// The most values of a quantifier over operators.
const MOST_VALUES: i64 = 1024;

/// The most conditions on states of a formula with quantifiers.
const MOST_CONDITIONS: usize = 4096;

/// What the operators of a formula may rely on.
struct Reading {
    /// Whether the runs are bounded, so that operators need no bounds.
    has_bound: bool,
    atoms: Vec<Guard>,
}

impl Checker<'_> {
    /// Checks and lowers a formula; `has_bound` says whether the query bounds the runs.
    pub(super) fn formula(&mut self, formula: &ast::Formula, has_bound: bool) -> Option<Formula> {
        let mut reading = Reading {
            has_bound,
            atoms: Vec::new(),
        };
        let root = self.temporal(formula, &mut reading)?;
        let atoms = reading.atoms;
        Some(Formula { atoms, root })
    }

    fn temporal(&mut self, formula: &ast::Formula, reading: &mut Reading) -> Option<Temporal> {
        Some(match formula {
            ast::Formula::State(state) => {
                let condition = self.state_condition(state)?;
                reading.atoms.push(condition);
                Temporal::Atom(reading.atoms.len() - 1)
            }
            ast::Formula::Not(inner) => self.temporal(inner, reading)?.negated(),
            ast::Formula::And(left, right) => {
                let (left, right) = self.both(left, right, reading)?;
                left.and(right)
            }
            ast::Formula::Or(left, right) => {
                let (left, right) = self.both(left, right, reading)?;
                left.or(right)
            }
            ast::Formula::Next(inner) => Temporal::Next(Box::new(self.temporal(inner, reading)?)),
            ast::Formula::Eventually(interval, goal) => {
                let interval = self.distances(interval.as_ref(), goal.span(), reading);
                let goal = self.temporal(goal, reading)?;
                Temporal::True.until(interval?, goal)
            }
            ast::Formula::Always(interval, keep) => {
                let interval = self.distances(interval.as_ref(), keep.span(), reading);
                let keep = self.temporal(keep, reading)?;
                Temporal::True.until(interval?, keep.negated()).negated()
            }
            ast::Formula::Until(interval, keep, goal) => {
                let interval = self.distances(interval.as_ref(), goal.span(), reading);
                let (keep, goal) = self.both(keep, goal, reading)?;
                keep.until(interval?, goal)
            }
            ast::Formula::Release(interval, keep, goal) => {
                let interval = self.distances(interval.as_ref(), goal.span(), reading);
                let (keep, goal) = self.both(keep, goal, reading)?;
                keep.release(interval?, goal)
            }
            ast::Formula::Quantified(is_for_all, name, ty, inner) => {
                self.quantified(*is_for_all, name, ty, inner, reading)?
            }
        })
    }

    /// A formula for all values, or for some: the bound variable stays what it is as time passes.
    fn quantified(
        &mut self,
        is_for_all: bool,
        name: &ast::Name,
        ty: &ast::TypeExpr,
        inner: &ast::Formula,
        reading: &mut Reading,
    ) -> Option<Temporal> {
        if let ast::TypeKind::Named(template) = &ty.kind
            && self.dynamic(&template.text).is_some()
        {
            return self.refused(
                codes::DYNAMIC_MISUSED,
                ty.span,
                "operators over time cannot be asked of each instance of a dynamic template",
                "let instances count what they do in a global variable, and ask for it",
            );
        }
        let (range, (low, high)) = self.iterated(ty)?;
        let values = i64::from(high) - i64::from(low) + 1;
        if values > MOST_VALUES {
            return self.refused(
                codes::RANGE_TOO_LARGE,
                ty.span,
                format!("a quantifier over operators over time has more than {MOST_VALUES} values"),
                "use a smaller range",
            );
        }
        let mut parts = Vec::new();
        for value in low..=high {
            let value = Expr::int(value, range.clone(), name.span);
            let entity = Entity::Constant { value, free: false };
            parts.push(self.scoped(name, entity, |checker| checker.temporal(inner, reading))?);
            if reading.atoms.len() > MOST_CONDITIONS {
                return self.refused(
                    codes::RANGE_TOO_LARGE,
                    ty.span,
                    format!("this formula asks for more than {MOST_CONDITIONS} conditions"),
                    "use a smaller range",
                );
            }
        }
        Some(balanced(is_for_all, parts))
    }

    fn both(
        &mut self,
        left: &ast::Formula,
        right: &ast::Formula,
        reading: &mut Reading,
    ) -> Option<(Temporal, Temporal)> {
        let left = self.temporal(left, reading);
        let right = self.temporal(right, reading);
        Some((left?, right?))
    }

    /// The least and the greatest distance of an operator; `operand` is what it speaks of.
    fn distances(
        &mut self,
        interval: Option<&ast::Interval>,
        operand: Span,
        reading: &Reading,
    ) -> Option<(f64, f64)> {
        let Some(interval) = interval else {
            if !reading.has_bound {
                self.report_unbounded(operand);
                return None;
            }
            return Some((0.0, f64::INFINITY));
        };
        let range = (0.0, GREATEST_DISTANCE);
        let from = self.known_real(&interval.from, "the first bound of an operator", range);
        let to = self.known_real(&interval.to, "the second bound of an operator", range);
        let (from, to) = (from?, to?);
        if from > to {
            return self.refused(
                codes::CONSTANT_OUT_OF_RANGE,
                interval.span,
                format!("no distance is at least {from} and at most {to}"),
                "write the smaller bound first",
            );
        }
        Some((from, to))
    }

    /// Reports that nothing says when a run is over.
    pub(super) fn report_unbounded(&mut self, operand: Span) {
        self.report(
            Diagnostic::new(
                codes::RUN_UNBOUNDED,
                operand,
                "nothing says how long the runs are in which this is looked for",
            )
            .help("bound the runs, Pr[<=10](<> p), or the operator, Pr(<>[0,10] p)"),
        );
    }
}

/// Conditions joined pair by pair, so that the tree is not high; of none, what holds of all or of
/// some of nothing.
fn balanced(is_for_all: bool, mut parts: Vec<Temporal>) -> Temporal {
    while parts.len() > 1 {
        let mut pairs = parts.into_iter();
        let mut joined = Vec::new();
        while let Some(left) = pairs.next() {
            joined.push(match pairs.next() {
                Some(right) if is_for_all => left.and(right),
                Some(right) => left.or(right),
                None => left,
            });
        }
        parts = joined;
    }
    let of_nothing = if is_for_all {
        Temporal::True
    } else {
        Temporal::True.negated()
    };
    parts.pop().unwrap_or(of_nothing)
}
