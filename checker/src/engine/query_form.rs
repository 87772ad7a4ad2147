//! What a query asks for, by its text alone, without a model.

use crate::diagnostics::SourceMap;
use crate::syntax;
use crate::syntax::ast::{Extremum, Name, QueryKind};

/// What a query asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QueryForm {
    /// How its kind is written, such as `E<>`, `-->` or `control`.
    pub kind: &'static str,
    /// The name of the strategy that it defines.
    pub defines: Option<String>,
    /// The name of the strategy that it is asked under, or that it saves.
    pub uses: Option<String>,
    /// Whether it is a game in which the controller sees observations only.
    pub is_observed: bool,
}

/// The form of a query; `None` if the text is no query.
pub fn query_form(text: &str) -> Option<QueryForm> {
    let mut sources = SourceMap::default();
    let span = syntax::add_query_text(text, &mut sources);
    let query = syntax::parse_query(span, &sources).0?;
    let kind = match &query.kind {
        QueryKind::Reachable(_) => "E<>",
        QueryKind::Invariantly(_) => "A[]",
        QueryKind::PotentiallyAlways(_) => "E[]",
        QueryKind::Eventually(_) => "A<>",
        QueryKind::LeadsTo(..) => "-->",
        QueryKind::Extremum { extremum, .. } => match extremum {
            Extremum::Sup => "sup",
            Extremum::Inf => "inf",
            Extremum::Bounds => "bounds",
        },
        QueryKind::Control(control) if control.cooperative => "E<> control",
        QueryKind::Control(control) if control.time_optimal.is_some() => "control_t*",
        QueryKind::Control(_) => "control",
        QueryKind::SaveStrategy { .. } => "saveStrategy",
        QueryKind::LoadStrategy { .. } => "loadStrategy",
        QueryKind::Unsupported(_) => "unsupported",
    };
    let saved = match &query.kind {
        QueryKind::SaveStrategy { strategy, .. } => Some(strategy),
        _ => None,
    };
    let is_observed =
        matches!(&query.kind, QueryKind::Control(control) if control.observations.is_some());
    let text = |name: &Name| name.text.clone();
    Some(QueryForm {
        kind,
        defines: query.strategy.as_ref().map(text),
        uses: query.under.as_ref().or(saved).map(text),
        is_observed,
    })
}
