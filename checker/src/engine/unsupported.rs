//! What the engine refuses to answer, since there is no algorithm for it.

use super::codes;
use super::loaded_model::{LoadedModel, PreparedQuery};
use super::query;
use super::query::statistical::contradiction;
use super::rejection::Rejection;
use crate::diagnostics::Diagnostic;
use crate::game::Player;
use crate::game::strategy::Strategy;
use crate::ir::{Control, Query, QueryKind};
use crate::stochastic::Precision;

impl LoadedModel {
    /// Refuses a statistical query that contradicts what is asked of its interval.
    pub(super) fn refuse_contradiction(
        &self,
        query: &Query,
        precision: &Precision,
    ) -> Result<(), Rejection> {
        let QueryKind::Statistical(asked) = &query.kind else {
            return Ok(());
        };
        match contradiction(asked, precision) {
            Some((message, help)) => {
                Err(self.refusal(codes::UNSUPPORTED_QUERY, query.span, message, help))
            }
            None => Ok(()),
        }
    }

    /// Refuses, by name, what there is no algorithm for.
    pub(super) fn refuse_unsupported(&self, prepared: &PreparedQuery) -> Result<(), Rejection> {
        let PreparedQuery { query, options, .. } = prepared;
        self.refuse_contradiction(query, &options.precision)?;
        let control = match &query.kind {
            QueryKind::Optimum(_) if prepared.decider.is_some() => {
                return Err(self.refusal(
                    codes::UNSUPPORTED_QUERY,
                    query.span,
                    "a best strategy within a learned one, or within a policy, is not supported",
                    "ask under the strategy that the learned one refines, or without `under`",
                ));
            }
            QueryKind::Statistical(_)
            | QueryKind::Optimum(_)
            | QueryKind::Shield(_)
            | QueryKind::SaveStrategy { .. }
            | QueryKind::LoadStrategy { .. } => return Ok(()),
            _ if prepared.shield.is_some() => {
                return Err(self.refusal(
                    codes::UNSUPPORTED_QUERY,
                    query.span,
                    "symbolic queries under a shield are not supported",
                    "ask Pr, E, simulate, minE, maxE, minPr or maxPr under it",
                ));
            }
            QueryKind::Control(control) => Some(control),
            _ => None,
        };
        let kind = control.and_then(query::game::unsupported_game);
        let is_observed = control.is_some_and(|control| control.observations.is_some());
        let network = self.network();
        let features = &network.features;
        let is_kept = query.strategy.is_some() && is_observed;
        let kind = kind.or(is_kept.then_some("observations and a named strategy"));
        let kind = kind.map(|kind| format!("queries with {kind}"));
        let strategy = prepared.under.as_ref().map(|under| &under.strategy);
        let under = control.zip(strategy);
        let under = under.and_then(|(control, strategy)| unsupported_under(control, strategy));
        let construct = if strategy.is_some() && features.stopwatches {
            Some("stopwatches in a query under a strategy")
        } else if is_observed {
            query::partial_observation::unsupported(network, options.priorities)
        } else if !features.clock_guarded_urgent {
            None
        } else if features.stopwatches {
            Some("clock guards on edges of urgent channels together with stopwatches")
        } else {
            None
        };
        let is_for_under = kind.is_none() && !is_observed;
        let diagnostic = if let Some(kind) = kind.or(under.map(str::to_owned)) {
            Diagnostic::new(
                codes::UNSUPPORTED_QUERY,
                query.span,
                format!("{kind} are not supported"),
            )
            .help(if is_for_under {
                "supported under a strategy are control: with every objective, and E<>, A[], E[], A<>, -->, sup, inf and bounds"
            } else if is_observed {
                "supported with observations is control: without a name, with A<>, A[], A[ U ] and A[ W ]; or ask without them, for a \
                 controller that sees everything"
            } else {
                "supported are E<>, A[], E[], A<>, -->, sup, inf, bounds, control:, E<> control: and control_t*:"
            })
        } else if let Some(construct) = construct {
            Diagnostic::new(
                codes::UNSUPPORTED_CONSTRUCT,
                query.span,
                format!("the model uses {construct}, which the engine does not support"),
            )
        } else {
            return Ok(());
        };
        Err(Rejection::new(vec![diagnostic], &self.sources))
    }
}

/// Names what makes a game under a strategy one that there is no algorithm for.
fn unsupported_under(control: &Control, strategy: &Strategy) -> Option<&'static str> {
    if control.cooperative || control.time_optimal.is_some() {
        Some("E<> control: and control_t* under a strategy")
    } else if control.observations.is_some() {
        Some("games under partial observation and a strategy")
    } else if strategy.owner == Player::Environment {
        Some("games under a strategy of the environment")
    } else if strategy.time_limit.is_some() {
        Some("games under a strategy within a time")
    } else {
        None
    }
}
