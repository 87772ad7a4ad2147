//! Functions that UPPAAL calls by their names: `__ON_CONSTRUCT__` once the model is built,
//! `__ON_BEGIN__` before a query is answered, `__ON_END__` and `__ON_DESTRUCT__` after it.
//!
//! Every query starts from the initial state, so that the first two are run once, in this order,
//! when the model is loaded: what they leave in variables and clocks is the initial state. What the
//! other two do comes after all that a query sees; they are only checked.
//!
//! Source: UPPAAL's documentation, "Functions", section "Special Functions".

use super::checker::Checker;
use super::codes;
use super::constants::reason;
use super::scope::Entity;
use super::typed::Signature;
use super::types::Type;
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::{EmittedAssignment, RunTimeError};
use crate::ir::{CLOCK_LIMIT, FunctionId, RunTimeErrorKind};

/// The hooks that are run, in order.
const BEFORE_QUERIES: [&str; 2] = ["__ON_CONSTRUCT__", "__ON_BEGIN__"];
/// Those that are not.
const AFTER_QUERIES: [&str; 2] = ["__ON_END__", "__ON_DESTRUCT__"];

impl Checker<'_> {
    /// Runs the hooks of a model on its initial state, whose words are in their final order.
    pub(super) fn hooks(&mut self) {
        let before = BEFORE_QUERIES.map(|name| self.hook(name));
        for name in AFTER_QUERIES {
            if let Some((_, span)) = self.hook(name) {
                self.report(
                    Diagnostic::new(
                        codes::HOOK_WITHOUT_EFFECT,
                        span,
                        format!(
                            "'{name}' is not run: it comes after everything that a query reads"
                        ),
                    )
                    .help("keep it if UPPAAL needs it; no answer depends on it"),
                );
            }
        }
        if self.can_lower() {
            for (function, span) in before.into_iter().flatten() {
                self.run_hook(function, span);
            }
        }
    }

    /// The hook with this name, and where it is declared; one that cannot be called is reported.
    fn hook(&mut self, name: &str) -> Option<(FunctionId, Span)> {
        let found = self.scopes.iter().rev().find_map(|scope| scope.get(name));
        let (entity, span) = found?;
        let (span, entity) = (*span, entity.clone());
        match entity {
            Entity::Function(function, signature) => self
                .is_callable_hook(name, &signature, span)
                .then_some((function, span)),
            // A variable or a location may have the name: nobody calls it.
            _ => None,
        }
    }

    fn is_callable_hook(&mut self, name: &str, signature: &Signature, span: Span) -> bool {
        if let Some(unknown) = &signature.unknown {
            let diagnostic = unknown.diagnostic.clone();
            self.report(
                diagnostic.note(format!("in '{name}', on which the initial state depends")),
            );
            return false;
        }
        let is_plain = signature.parameters.is_empty() && signature.result == Type::Void;
        if !is_plain && !signature.result.is_error() {
            self.error(
                codes::HOOK_SIGNATURE,
                span,
                format!("UPPAAL calls '{name}' without arguments and uses no result"),
                &format!("declare it as void {name}(), or give it another name"),
            );
        }
        is_plain
    }

    /// Runs a hook on the initial state.
    fn run_hook(&mut self, function: FunctionId, span: Span) {
        let initial = self.world.network.initial.clone();
        let mut assignments = Vec::new();
        match self.run_on(function, initial, &mut assignments) {
            Ok(words) => {
                self.world.network.initial = words;
                let clocks = &mut self.world.network.initial_clocks;
                for EmittedAssignment {
                    target,
                    source,
                    value,
                } in assignments
                {
                    clocks[target.0 as usize] = clocks[source.0 as usize].saturating_add(value);
                }
                if !clocks.iter().all(|value| (0..=CLOCK_LIMIT).contains(value)) {
                    self.report_hook(RunTimeErrorKind::ClockValue, span);
                }
            }
            Err(RunTimeError { kind, site }) => {
                let place = self.world.network.sites.get(site.0 as usize);
                self.report_hook(kind, place.map_or(span, |site| site.span));
            }
        }
    }

    fn report_hook(&mut self, kind: RunTimeErrorKind, span: Span) {
        let reason = reason(kind);
        let diagnostic = Diagnostic::new(
            codes::HOOK_FAILS,
            span,
            format!("there is no initial state, because the hook that makes it ends in {reason}"),
        );
        self.report(
            diagnostic
                .note("it is run when the model is loaded, to make the initial state")
                .help("correct the function"),
        );
    }
}
