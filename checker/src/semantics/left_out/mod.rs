//! What symbolic and game queries cannot know, and what they see without: doubles that take the
//! values of clocks or of random numbers, and clocks with rates of their own.
//!
//! A model is first checked as if it had none. Where a double takes a value that is not known, or a
//! clock a rate or a value that ordinary clocks cannot have, that is an error, and the variable a
//! candidate. The model is then checked again without the candidates, like hybrid clocks: what is
//! assigned to them is not computed, and what is read from them is unknown, so that the other
//! variables that take such a value become candidates in turn. That ends when nothing is wrong any
//! more (then all that is left out decides nothing), or when there is no new candidate (then what
//! is wrong is said).
//!
//! Invariants:
//! * What is left out is fixed before a model is checked: nothing reads a variable as known whose
//!   changes are dropped elsewhere.
//! * A clock that a guard or an invariant compares, or that a function takes by reference, is never
//!   left out.
//! * Variables are left out as a whole, in all processes, and only if they hold nothing but
//!   doubles, or clocks.

pub(super) mod causes;

pub(super) use causes::{Causes, LeftOut, MOST_ROUNDS};

use super::checker::Checker;
use super::codes;
use super::typed::{Expr, Kind, Place};
use super::types::Type;
use crate::diagnostics::{Diagnostic, Span};

impl Checker<'_> {
    /// Why the variable declared there is left out, if it is.
    pub(super) fn cause_of(&self, declared: Span) -> Option<&Diagnostic> {
        self.left_out.fixed.get(&declared)
    }

    /// Whether the variable that a place is part of is left out.
    pub(super) fn is_left_out(&self, place: &Expr) -> bool {
        let root = place.variable();
        root.is_some_and(|root| self.cause_of(root.declared).is_some())
    }

    /// A variable that is used: unknown, if it holds doubles and is left out.
    pub(super) fn unless_left_out(&mut self, expr: Expr) -> Expr {
        let cause = expr
            .variable()
            .and_then(|place| Some((place.declared, self.cause_of(place.declared)?)));
        let Some((declared, cause)) = cause.filter(|_| expr.ty.size().clocks == 0) else {
            return expr;
        };
        let name = self.sources.text(declared);
        let line = self.sources.position(cause.span).line;
        let diagnostic = Diagnostic::new(
            cause.code,
            expr.span,
            format!("the double '{name}' has no value that is known here"),
        )
        .note(format!("line {line}: {}", cause.message))
        .help("keep it out of conditions, indices and integers; clocks can be compared in guards");
        let ty = expr.ty.clone();
        self.unknown(diagnostic, expr, ty)
    }

    /// The place that is meant by the expression checked last, where a part of it or a reference to
    /// it is taken: also if it is left out.
    pub(super) fn place_left_out(&mut self, expr: Expr) -> Expr {
        match expr.kind {
            Kind::Unknown(inner) if self.is_left_out(&inner) && inner.ty == expr.ty => {
                // It was checked last, so what would be said of it stands last.
                self.unknowns.pop();
                *inner
            }
            kind => Expr { kind, ..expr },
        }
    }

    /// The place that an expression means, if it is part of a variable of doubles that is left out.
    pub(super) fn target_left_out<'e>(&self, expr: &'e Expr) -> Option<&'e Expr> {
        match &expr.kind {
            Kind::Unknown(inner) if self.is_left_out(inner) && inner.ty == expr.ty => Some(inner),
            _ => None,
        }
    }

    /// Notes that a variable would have to be left out.
    pub(super) fn candidate(&mut self, place: Option<&Place>, cause: &Diagnostic) {
        if let Some(place) = place {
            self.candidate_at(place.declared, cause);
        }
    }

    /// Notes that the variable declared there would have to be left out.
    pub(super) fn candidate_at(&mut self, declared: Span, cause: &Diagnostic) {
        if declared != Span::default() && !self.is_generic {
            let candidates = &mut self.left_out.candidates;
            candidates.entry(declared).or_insert_with(|| cause.clone());
        }
    }

    /// Notes that a variable takes a value that may be unknown; what is said of values since
    /// `before` is why.
    pub(super) fn takes_unknown(&mut self, declared: Span, value: &Expr, before: usize) {
        if value.is_unknown()
            && let Some(cause) = self.unknowns.get(before).cloned()
        {
            self.candidate_at(declared, &cause);
        }
    }

    /// Notes that what happens depends on clocks.
    pub(super) fn depends_on_clocks(&mut self, expr: &Expr) {
        if self.is_generic || !expr.mentions_clocks() {
            return;
        }
        let mut compared = Vec::new();
        visit_clocks(expr, &mut compared);
        self.left_out.compared.extend(compared);
    }

    /// Notes that a function takes a place by reference.
    pub(super) fn refers_to(&mut self, place: &Expr) {
        if !self.is_generic
            && place.ty.size().clocks > 0
            && let Some(root) = place.variable()
        {
            self.left_out.compared.insert(root.declared);
        }
    }

    /// Keeps a warning for the case that the model is accepted without this variable.
    pub(super) fn warn_if_left_out(&mut self, name: &str, ty: &Type, declared: Span) {
        let Some(cause) = self.cause_of(declared) else {
            return;
        };
        let line = self.sources.position(cause.span).line;
        let (code, what) = if ty.size().clocks > 0 {
            (codes::CLOCK_IGNORED, "clock")
        } else {
            (codes::DOUBLE_IGNORED, "double")
        };
        let warning = Diagnostic::new(
            code,
            declared,
            format!("the {what} '{name}' is ignored in symbolic and game queries"),
        )
        .note(format!("line {line}: {}", cause.message))
        .note(
            "what is assigned to it is not computed, and nothing that a query reads depends on it",
        )
        .help("do nothing, unless the value matters");
        self.left_out.warnings.push(warning);
    }

    /// Reports what was left out.
    pub(super) fn report_left_out(&mut self) {
        for warning in std::mem::take(&mut self.left_out.warnings) {
            self.report(warning);
        }
    }
}

/// Where the clocks of the conditions in an expression were declared.
fn visit_clocks(expr: &Expr, found: &mut Vec<Span>) {
    if expr.ty.size().clocks > 0
        && let Some(place) = expr.variable()
    {
        found.push(place.declared);
    }
    expr.children(&mut |child| visit_clocks(child, found));
}
