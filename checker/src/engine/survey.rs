//! What an editor asks about a model that is being typed: everything that is wrong with it and with
//! its queries, and what its names stand for. A model with mistakes has an answer, too.

use std::collections::HashSet;

use super::loaded_model::{LoadedModel, NamedStrategy};
use crate::diagnostics::{Diagnostic, SourceMap};
use crate::exec::Libraries;
use crate::names::{Names, names_of};
use crate::semantics::Reading;
use crate::semantics::codes::STATISTICAL_ONLY;
use crate::syntax::{self, ast};

/// What was found in a model and in a file of queries about it.
#[derive(Debug)]
pub struct Survey {
    /// The texts that the places count in.
    pub sources: SourceMap,
    /// What is wrong, in the order of the text, that of the queries behind that of the model.
    pub mistakes: Vec<Diagnostic>,
    /// What names stand for; none if the file is not well-formed.
    pub names: Names,
    /// The queries: those of the model, then those of the other file.
    pub queries: Vec<ast::QueryText>,
}

/// Looks at a model, and at a file of queries if one is given, each as its path and bytes.
pub fn survey_of(
    model: (&str, &[u8]),
    queries: Option<(&str, &[u8])>,
    libraries: &Libraries,
) -> Survey {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let (path, bytes) = model;
    let parsed = syntax::read_model(path, bytes, &mut sources);
    let mut listed = parsed.document.queries.clone();
    let mut mistakes = Vec::new();
    if let Some((path, bytes)) = queries {
        let (more, found) = syntax::read_queries(path, bytes, &mut sources);
        listed.extend(more);
        mistakes.extend(found);
    }
    let read = |query: &ast::QueryText| syntax::parse_query(query.span, &sources);
    let forms: Vec<ast::Query> = listed.iter().filter_map(|one| read(one).0).collect();
    let names = names_of(&parsed.document, &prelude, &forms, &sources);
    let texts = sources.clone();
    match LoadedModel::accept(path, parsed, &prelude, sources, libraries) {
        Ok((mut model, warnings)) => {
            mistakes.splice(0..0, warnings);
            for query in &listed {
                mistakes.extend(model.mistakes_of(query));
            }
            sources = model.sources;
        }
        Err(rejection) => {
            sources = texts;
            mistakes.splice(0..0, rejection.diagnostics);
            for query in &listed {
                mistakes.extend(syntax::parse_query(query.span, &sources).1);
            }
        }
    }
    let mut seen = HashSet::new();
    mistakes.retain(|one| seen.insert((one.code, one.span)));
    Survey {
        sources,
        mistakes,
        names,
        queries: listed,
    }
}

impl LoadedModel {
    /// What is wrong with a query. The strategy that it defines is known to those behind it.
    fn mistakes_of(&mut self, query: &ast::QueryText) -> Vec<Diagnostic> {
        let reading = self.reading_of(query.span);
        if reading == Reading::Symbolic && self.has_only_random_runs() {
            let message = "only statistical queries can be asked of this model";
            return vec![Diagnostic::new(STATISTICAL_ONLY, query.span, message)];
        }
        let known = self.strategy_names();
        let found = match self.compile_found(reading, query.span, &known) {
            Ok((_, warnings)) => warnings,
            Err(rejection) => rejection.diagnostics,
        };
        let (parsed, _) = syntax::parse_query(query.span, &self.sources);
        if let Some(name) = parsed.and_then(|query| query.strategy) {
            let text = query.text.clone();
            self.keep_strategy(NamedStrategy::new(name.text, text, None));
        }
        found
    }
}
