//! Statistical queries: their static rules, and lowering to masks and functions of doubles.

use super::checker::Checker;
use super::codes;
use super::lower::horizons::curved_number;
use super::offsets::state_offset;
use super::typed::{Expr, Kind, conjuncts};
use super::types::{Memory, Type};
use crate::diagnostics::Span;
use crate::exec::arithmetic;
use crate::ir::{FunctionId, Guard, Path, RunBound, RunLimit, ShownItem, Simulation, Statistical};
use crate::syntax::ast;

impl Checker<'_> {
    /// Checks and lowers a statistical query.
    pub(super) fn statistical(
        &mut self,
        asked: &ast::Statistical,
        span: Span,
    ) -> Option<Statistical> {
        self.refuse_priorities(span)?;
        Some(match asked {
            ast::Statistical::Probability(estimated) => {
                let (bound, path) = self.estimated(estimated)?;
                Statistical::Probability(bound, path)
            }
            ast::Statistical::Hypothesis {
                estimated,
                at_least,
                threshold,
            } => {
                let (bound, path) = self.estimated(estimated)?;
                Statistical::Hypothesis {
                    bound,
                    path,
                    at_least: *at_least,
                    threshold: self.known_real(threshold, "a probability", (0.0, 1.0))?,
                }
            }
            ast::Statistical::Comparison {
                left,
                right,
                at_least,
            } => {
                let (left, right) = (self.estimated(left), self.estimated(right));
                Statistical::Comparison {
                    left: left?,
                    right: right?,
                    at_least: *at_least,
                }
            }
            ast::Statistical::Expectation {
                bound,
                maximum,
                value,
            } => {
                let bound = self.run_bound(bound)?;
                let (value, range) = self.number(value)?;
                Statistical::Expectation {
                    bound,
                    maximum: *maximum,
                    range,
                    value,
                }
            }
            ast::Statistical::Simulation {
                bound,
                items,
                filter,
            } => Statistical::Simulation(self.simulation(bound, items, filter.as_ref())?),
        })
    }

    /// Refuses random runs of models with priorities.
    pub(super) fn refuse_priorities(&mut self, span: Span) -> Option<()> {
        if self.world.network.features.priorities {
            return self.refused(
                codes::QUERY_UNSUPPORTED,
                span,
                "statistical queries are not supported on models with priorities",
                "remove the priorities of channels and processes",
            );
        }
        Some(())
    }

    /// Checks and lowers the number that `E` measures: a function that leaves it as a double, and
    /// between which numbers it always lies, if that is known.
    pub(super) fn number(&mut self, value: &ast::Expr) -> Option<(FunctionId, Option<(f64, f64)>)> {
        let value = self.expression(value);
        self.expect_pure(&value, "a query");
        if !value.is_error() && !value.ty.is_number() {
            return self.refused(
                codes::NUMBER_EXPECTED,
                value.span,
                format!(
                    "an expected value is that of a number, but this is {}",
                    value.ty.described()
                ),
                "name a clock, or an expression of integers, doubles and clocks",
            );
        }
        let range = super::value_ranges::range(&value);
        Some((self.make_real(value, &[], String::from("query"))?, range))
    }

    fn simulation(
        &mut self,
        bound: &ast::RunBound,
        items: &[ast::Shown],
        filter: Option<&(Option<ast::Expr>, ast::Expr)>,
    ) -> Option<Simulation> {
        let bound = self.run_bound(bound)?;
        let mut shown = Vec::new();
        for item in items {
            for (value, text) in self.shown(item) {
                self.report_members(&value, value.span);
                self.expect_pure(&value, "a query");
                if !value.is_error() && !value.ty.is_number() {
                    self.error(
                        codes::NUMBER_EXPECTED,
                        value.span,
                        format!(
                            "only numbers can be shown, but this is {}",
                            value.ty.described()
                        ),
                        "name clocks, integers, doubles, or conditions",
                    );
                }
                shown.push(ShownItem {
                    is_curved: curved_number(&value).is_some(),
                    text,
                    value: self.make_real(value, &[], String::from("query"))?,
                });
            }
        }
        let filter = match filter {
            None => None,
            Some((runs, reached)) => {
                let runs = match runs {
                    Some(runs) => {
                        self.known_real(runs, "the number of runs that are shown", (1.0, 1e15))?
                            as u64
                    }
                    None => u64::MAX,
                };
                Some((self.state_condition(reached)?, runs))
            }
        };
        Some(Simulation {
            bound,
            items: shown,
            filter,
        })
    }

    fn estimated(&mut self, estimated: &ast::Estimated) -> Option<(RunBound, Path)> {
        let bound = match (&estimated.bound, &estimated.path) {
            (Some(bound), _) => self.run_bound(bound),
            (None, ast::Path::Formula(_)) => Some(RunBound {
                limit: RunLimit::Time,
                value: f64::INFINITY,
                runs: None,
            }),
            (
                None,
                ast::Path::Eventually(state)
                | ast::Path::Always(state)
                | ast::Path::Until(_, state),
            ) => {
                self.report_unbounded(state.span);
                None
            }
        };
        let path = match &estimated.path {
            ast::Path::Eventually(goal) => Path::Eventually(self.state_condition(goal)?),
            ast::Path::Always(keep) => Path::Always(self.state_condition(keep)?),
            ast::Path::Until(keep, goal) => {
                let (keep, goal) = (self.state_condition(keep), self.state_condition(goal));
                Path::Until(keep?, goal?)
            }
            ast::Path::Formula(formula) => {
                Path::Formula(self.formula(formula, estimated.bound.is_some())?)
            }
        };
        Some((bound?, path))
    }

    pub(super) fn run_bound(&mut self, bound: &ast::RunBound) -> Option<RunBound> {
        let limit = match &bound.limit {
            ast::RunLimit::Time => RunLimit::Time,
            ast::RunLimit::Moves => RunLimit::Moves,
            ast::RunLimit::Clock(clock) => {
                let place = self.place(clock);
                let offset = state_offset(&place, Memory::Words);
                let is_clock = place.ty == Type::RealClock;
                let Some(offset) = offset.filter(|_| is_clock) else {
                    if !place.is_error() {
                        self.error(
                            codes::MEASURE_EXPECTED,
                            clock.span,
                            "a run is bounded by time, by a clock, or by its moves",
                            "write [<=10], [x<=10] for a clock x, or [#<=10]",
                        );
                    }
                    return None;
                };
                RunLimit::Clock(self.relocation.offset(offset))
            }
        };
        let value = self.known_real(&bound.value, "the bound of a run", (0.0, f64::INFINITY))?;
        let runs = match &bound.runs {
            None => None,
            Some(runs) => Some(self.known_real(runs, "the number of runs", (1.0, 1e15))? as u64),
        };
        Some(RunBound { limit, value, runs })
    }

    /// A number that is known now and between these two.
    pub(super) fn known_real(
        &mut self,
        expr: &ast::Expr,
        what: &str,
        range: (f64, f64),
    ) -> Option<f64> {
        let value = self.expression(expr);
        let value = self.converted(value, &Type::Double)?;
        let span = value.span;
        let words = self.known_words(&value, &Type::Double, what)?;
        let value = arithmetic::double_of_words(words[0], words[1]);
        if !(range.0 <= value && value <= range.1) {
            let (low, high) = range;
            let help = if high.is_finite() {
                format!("write a number from {low} to {high}")
            } else {
                format!("write a number that is at least {low}")
            };
            return self.refused(
                codes::CONSTANT_OUT_OF_RANGE,
                span,
                format!("{what} cannot be {value}"),
                &help,
            );
        }
        Some(value)
    }

    /// The mask of a condition on states.
    pub(super) fn state_condition(&mut self, expr: &ast::Expr) -> Option<Guard> {
        let span = expr.span;
        let expr = self.query_condition(expr)?;
        let is_strange = |e: &Expr| matches!(e.kind, Kind::Deadlock | Kind::Rate { .. });
        if expr.any(&is_strange) {
            return self.refused(
                codes::QUERY_UNSUPPORTED,
                span,
                "statistical queries cannot ask for deadlocks and rates",
                "ask for locations, variables and clocks",
            );
        }
        let never = expr.constant() == Some(0);
        let mut parts = Vec::new();
        conjuncts(expr, &mut parts);
        let guard = self.make_guard(&parts, &[], "query");
        let never_holds = guard.never_holds || never;
        self.can_lower().then_some(Guard {
            never_holds,
            ..guard
        })
    }
}
