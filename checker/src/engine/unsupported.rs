//! What the engine refuses to answer, since there is no algorithm for it.

use super::codes;
use super::loaded_model::LoadedModel;
use super::query;
use super::rejection::Rejection;
use crate::diagnostics::Diagnostic;
use crate::game::{Player, Priorities};
use crate::ir::{Query, QueryKind};

impl LoadedModel {
    /// Names what makes a game under a strategy one that there is no algorithm for.
    fn unsupported_under(&self, query: &Query) -> Option<&'static str> {
        let QueryKind::Control {
            cooperative,
            time_optimal,
            observations,
            ..
        } = &query.kind
        else {
            return None;
        };
        let named = self.strategy(query.under.as_deref()?)?;
        let strategy = &named.permitted.as_ref()?.strategy;
        if *cooperative || time_optimal.is_some() {
            Some("E<> control: and control_t* under a strategy")
        } else if observations.is_some() {
            Some("games under partial observation and a strategy")
        } else if strategy.owner == Player::Environment {
            Some("games under a strategy of the environment")
        } else if strategy.time_limit.is_some() {
            Some("games under a strategy within a time")
        } else {
            None
        }
    }

    /// Refuses, by name, what there is no algorithm for.
    pub(super) fn refuse_unsupported(
        &self,
        query: &Query,
        priorities: Priorities,
    ) -> Result<(), Rejection> {
        let is_under = query.under.is_some();
        let kind = match &query.kind {
            QueryKind::Reachable(_)
            | QueryKind::Invariantly(_)
            | QueryKind::PotentiallyAlways(_)
            | QueryKind::Eventually(_)
            | QueryKind::LeadsTo(..)
            | QueryKind::Extremum { .. }
            | QueryKind::SaveStrategy { .. }
            | QueryKind::LoadStrategy { .. } => None,
            QueryKind::Control {
                objective,
                cooperative,
                time_optimal,
                observations,
            } => query::game::unsupported_game(
                objective,
                time_optimal.is_some(),
                *cooperative,
                observations.is_some(),
            ),
        };
        let is_observed = matches!(
            query.kind,
            QueryKind::Control {
                observations: Some(_),
                ..
            }
        );
        let features = &self.model.network.features;
        let is_kept = query.strategy.is_some() && is_observed;
        let kind = kind.or(is_kept.then_some("observations and a named strategy"));
        let kind = kind.map(|kind| format!("queries with {kind}"));
        let under = self.unsupported_under(query).map(str::to_owned);
        let construct = if is_under && features.stopwatches {
            Some("stopwatches in a query under a strategy")
        } else if is_observed {
            query::partial_observation::unsupported(&self.model.network, priorities)
        } else if !features.clock_guarded_urgent {
            None
        } else if features.stopwatches {
            Some("clock guards on edges of urgent channels together with stopwatches")
        } else {
            None
        };
        let is_for_under = kind.is_none() && !is_observed;
        let diagnostic = if let Some(kind) = kind.or(under) {
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
