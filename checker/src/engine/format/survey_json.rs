//! What an editor asks about a model, as JSON. Places are `[file, start, end]`: 0 for the model and
//! 1 for the file of queries, and bytes of its text as UTF-8.

use serde_json::{Value as Json, json};

use super::model_json::expected;
use crate::diagnostics::{Diagnostic, Severity, SourceMap, Span};
use crate::engine::survey::Survey;
use crate::names::{Symbol, SymbolKind};
use crate::syntax::ast::QueryText;

/// All of it; `paths` are those of the model and of the file of queries.
pub fn survey(survey: &Survey, paths: &[&str]) -> Json {
    let places = Places {
        sources: &survey.sources,
        paths,
    };
    let names = &survey.names;
    json!({
        "mistakes": each(&survey.mistakes, |one| places.mistake(one)),
        "symbols": each(&names.symbols, |one| places.symbol(one)),
        "uses": placed(names.uses.iter().map(|one| (places.of(one.span), json!(one.symbol)))),
        "everywhere": names.everywhere,
        "areas": placed(names.areas.iter().map(|one| (places.of(one.span), json!(one.scope)))),
        "scopes": names.scopes,
        "groups": names.groups,
        "queries": each(&survey.queries, |one| places.query(one)),
    })
}

fn each<T>(items: &[T], told: impl Fn(&T) -> Json) -> Json {
    items.iter().map(told).collect()
}

/// Those that stand in a file, with their places.
fn placed(items: impl Iterator<Item = (Json, Json)>) -> Json {
    let known = items.filter(|(place, _)| !place.is_null());
    known.map(|(place, told)| json!([place, told])).collect()
}

struct Places<'a> {
    sources: &'a SourceMap,
    paths: &'a [&'a str],
}

impl Places<'_> {
    /// `null` for what stands in no file.
    fn of(&self, span: Span) -> Json {
        let path = &*self.sources.get(span.source).path;
        let Some(file) = self.paths.iter().position(|known| *known == path) else {
            return Json::Null;
        };
        let range = self.sources.file_range(span);
        json!([file, range.start, range.end])
    }

    fn mistake(&self, one: &Diagnostic) -> Json {
        let severity = match one.code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        json!({
            "code": one.code.code,
            "severity": severity,
            "at": self.of(one.span),
            "place": self.sources.get(one.span.source).place,
            "message": one.message,
            "notes": one.notes,
            "hint": one.help,
        })
    }

    fn symbol(&self, one: &Symbol) -> Json {
        json!({
            "name": one.name,
            "kind": kind(one.kind),
            "at": self.of(one.span),
            "detail": one.detail,
            "comment": one.comment,
            "members": one.members,
        })
    }

    fn query(&self, one: &QueryText) -> Json {
        json!({
            "at": self.of(one.span),
            "text": one.text,
            "comment": one.comment,
            "expect": one.expect.as_ref().map(expected),
        })
    }
}

fn kind(kind: SymbolKind) -> &'static str {
    match kind {
        SymbolKind::Constant => "constant",
        SymbolKind::Variable => "variable",
        SymbolKind::Clock => "clock",
        SymbolKind::Channel => "channel",
        SymbolKind::Type => "type",
        SymbolKind::Field => "field",
        SymbolKind::Function => "function",
        SymbolKind::Parameter => "parameter",
        SymbolKind::Template => "template",
        SymbolKind::Process => "process",
        SymbolKind::Location => "location",
        SymbolKind::Bound => "bound",
        SymbolKind::Strategy => "strategy",
    }
}
