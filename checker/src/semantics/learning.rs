//! Queries for the best strategy: their static rules, and lowering.

use super::checker::Checker;
use super::codes;
use super::labels::collapse;
use super::offsets::state_offset;
use super::typed::{Expr, Kind, LOCATION_WORDS};
use super::types::{Memory, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{Aim, Feature, FeatureTexts, Observation, Optimum, Path, ProcessId, Seen};
use crate::syntax::ast;

impl Checker<'_> {
    /// Checks and lowers a query for the best strategy.
    pub(super) fn optimum(&mut self, asked: &ast::Optimum, span: Span) -> Option<Optimum> {
        self.refuse_priorities(span)?;
        let bound = self.run_bound(&asked.bound);
        let aim = match &asked.measured {
            ast::Measured::Probability => Some(Aim::Probability),
            ast::Measured::Expected(None) => Some(Aim::Time),
            ast::Measured::Expected(Some(price)) => {
                self.number(price).map(|(value, _)| Aim::Expected(value))
            }
        };
        let goal = match &asked.goal {
            None => Some(None),
            Some(goal) => {
                let goal = self.state_condition(goal);
                goal.map(|goal| Some(Path::Eventually(goal)))
            }
        };
        let features = match &asked.features {
            None => Some(None),
            Some(features) => self.features(features).map(Some),
        };
        self.warn_without_choice(span);
        Some(Optimum {
            is_greatest: asked.is_greatest,
            aim: aim?,
            bound: bound?,
            goal: goal?,
            features: features?,
        })
    }

    /// Warns of a query for a strategy of a controller that has no edge.
    pub(super) fn warn_without_choice(&mut self, span: Span) {
        let edges = self.world.network.edges();
        if edges.filter(|edge| edge.controllable).count() == 0 {
            self.report(
                Diagnostic::new(
                    codes::NOTHING_TO_CHOOSE,
                    span,
                    "the controller has no edge, so there is one strategy only",
                )
                .help("an edge is the controller's if it is written `->`, and not `-u->`"),
            );
        }
    }

    /// Checks and lowers what a strategy sees.
    pub(super) fn features(&mut self, features: &ast::Features) -> Option<Observation> {
        let mut seen = |list: &[ast::Expr], is_discrete| {
            let all: Vec<_> = list
                .iter()
                .map(|one| self.feature(one, is_discrete))
                .collect();
            all.into_iter().collect::<Option<Vec<_>>>()
        };
        let (discrete, continuous) = (
            seen(&features.discrete, true),
            seen(&features.continuous, false),
        );
        Some(Observation {
            discrete: discrete?,
            continuous: continuous?,
        })
    }

    /// Checks and lowers one number that a strategy sees.
    pub(super) fn feature(&mut self, asked: &ast::Expr, is_discrete: bool) -> Option<Feature> {
        let value = self.expression(asked);
        self.report_members(&value, asked.span);
        self.expect_pure(&value, "a feature");
        if value.is_error() {
            return None;
        }
        if !value.ty.is_number() {
            let described = value.ty.described();
            return self.refused(
                codes::FEATURE_EXPECTED,
                value.span,
                format!("a strategy sees numbers and locations, but this is {described}"),
                "name integers, doubles, clocks, parts of arrays such as a[0], or P.location",
            );
        }
        let is_clock = value.any(&|part| matches!(part.kind, Kind::ClockReading(_)));
        if is_discrete && (value.ty == Type::Double || is_clock) {
            self.report(
                Diagnostic::new(
                    codes::FEATURE_EXACT,
                    value.span,
                    "the exact values of this are compared, so hardly any state is seen twice",
                )
                .help(
                    "write it behind the arrow, `{…} -> {x}`: there values in intervals are seen",
                ),
            );
        }
        let text = collapse(self.sources.text(asked.span));
        let seen = match self.seen(&value) {
            Some(seen) => seen,
            None => Seen::Computed(self.make_real(value, &[], String::from("query"))?),
        };
        Some(Feature { text, seen })
    }

    /// Where a number is read without code.
    fn seen(&self, value: &Expr) -> Option<Seen> {
        let value = match &value.kind {
            Kind::ClockReading(clock) => clock,
            _ => value,
        };
        let offset = state_offset(value, Memory::Words)?;
        if offset >= LOCATION_WORDS {
            return Some(Seen::Location(ProcessId(offset - LOCATION_WORDS)));
        }
        let word = self.relocation.offset(offset);
        match value.ty {
            Type::Double => Some(Seen::Double(word)),
            Type::RealClock => Some(Seen::Clock(word)),
            _ if value.ty.is_integral() => Some(Seen::Integer(word)),
            _ => None,
        }
    }

    /// What a strategy that is loaded sees, as texts.
    pub(super) fn feature_texts(&self, features: &ast::Features) -> FeatureTexts {
        let texts = |list: &[ast::Expr]| {
            let texts = list.iter().map(|one| collapse(self.sources.text(one.span)));
            texts.collect()
        };
        FeatureTexts {
            discrete: texts(&features.discrete),
            continuous: texts(&features.continuous),
        }
    }
}
