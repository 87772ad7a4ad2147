//! What a query asks for, and the parts of its text, by the text alone, without a model.

use crate::diagnostics::SourceMap;
use crate::syntax;
use crate::syntax::ast::{Extremum, Measured, Name, Optimum, Query, QueryKind, Statistical};

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

/// The query that a text is; `None` if it is none.
fn parsed(text: &str) -> Option<Query> {
    let mut sources = SourceMap::default();
    let span = syntax::add_query_text(text, &mut sources);
    syntax::parse_query(span, &sources).0
}

/// The text of a query without the `strategy S =` before it, if it has one.
pub fn unnamed(text: &str) -> &str {
    match parsed(text) {
        Some(query) => &text[query.formula.start as usize..query.span.end as usize],
        None => text.trim(),
    }
}

/// The text of a query without the `under S` after it, if it has that.
pub fn without_under(text: &str) -> &str {
    match parsed(text) {
        Some(query) if query.under.is_some() => &text[..query.formula.end as usize],
        _ => text,
    }
}

/// The texts of the observations of a query, `{o1, o2, …} control: …`.
pub fn observations(text: &str) -> Vec<String> {
    let observations = match parsed(text).map(|query| query.kind) {
        Some(QueryKind::Control(control)) => control.observations.unwrap_or_default(),
        _ => Vec::new(),
    };
    let spans = observations.iter().map(|observation| observation.span);
    spans
        .map(|span| text[span.start as usize..span.end as usize].to_owned())
        .collect()
}

/// The form of a query; `None` if the text is no query.
pub fn query_form(text: &str) -> Option<QueryForm> {
    let query = parsed(text)?;
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
        QueryKind::Optimum(Optimum {
            measured,
            is_greatest,
            ..
        }) => match (measured, is_greatest) {
            (Measured::Expected(_), false) => "minE",
            (Measured::Expected(_), true) => "maxE",
            (Measured::Probability, false) => "minPr",
            (Measured::Probability, true) => "maxPr",
        },
        QueryKind::Shield(_) => "acontrol",
        QueryKind::Statistical(Statistical::Expectation { .. }) => "E",
        QueryKind::Statistical(Statistical::Simulation { .. }) => "simulate",
        QueryKind::Statistical(_) => "Pr",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_query_are_found() {
        let whole = "strategy S = control: A<> x[a == 1 ? 0 : 1] == 2 under T";
        assert_eq!(
            unnamed(whole),
            "control: A<> x[a == 1 ? 0 : 1] == 2 under T"
        );
        assert_eq!(
            without_under(whole),
            "strategy S = control: A<> x[a == 1 ? 0 : 1] == 2"
        );
        for text in ["control: A<> strategy_1 == under_2", "no query"] {
            assert_eq!((unnamed(text), without_under(text)), (text, text));
        }
    }

    #[test]
    fn observations_keep_their_brackets() {
        let query = "{ (a || b) && c, f(1, 2) == x[0],(d)} control: A[] true";
        assert_eq!(
            observations(query),
            ["(a || b) && c", "f(1, 2) == x[0]", "(d)"]
        );
        for query in ["{} control: A<> p", "control: A<> forall (i : int[0, 1]) p"] {
            assert!(observations(query).is_empty());
        }
    }
}
