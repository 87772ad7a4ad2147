//! Models of which statistical queries are measured.

use std::error::Error;

use checker::diagnostics::{Diagnostic, SourceMap};
use checker::ir::{Network, StatisticalQuery};
use checker::semantics::{self, Reading};
use checker::syntax;

/// A model in the stochastic reading, with a compiled query.
pub(crate) fn load(
    model: &str,
    query: &str,
) -> Result<(Network, StatisticalQuery), Box<dyn Error>> {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let parsed = syntax::read_model("model.xta", model.as_bytes(), &mut sources);
    let (model, more) =
        semantics::analyse(&parsed.document, &prelude, &sources, Reading::Stochastic);
    let mut found = parsed.diagnostics;
    found.extend(more);
    let span = syntax::add_query_text(query, &mut sources);
    let (parsed, more) = syntax::parse_query(span, &sources);
    found.extend(more);
    let mut compiled = None;
    let mut model = model.filter(|_| !found.iter().any(Diagnostic::is_error));
    if let (Some(model), Some(parsed)) = (&mut model, parsed) {
        let (query, more) = model.compile_statistical(&parsed, &sources, &[]);
        found.extend(more);
        compiled = query;
    }
    let (Some(model), Some(query)) = (model, compiled) else {
        let texts: Vec<String> = found.iter().map(|one| one.render(&sources)).collect();
        return Err(texts.join("\n").into());
    };
    Ok((model.network, query))
}
