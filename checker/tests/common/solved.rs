//! Games of files, solved with what the winner does.

use std::fs;
use std::path::Path;

use checker::engine::{Answer, CodeEngine, LoadedModel, Options};

/// The answer to a query, with what the winner does, if the model of the file accepts the query;
/// and the model.
pub(crate) fn solved(path: &Path, query: &str) -> Option<(LoadedModel, Answer)> {
    let bytes = fs::read(path).expect("the model is there");
    let mut model = LoadedModel::load("model.xta", &bytes).expect("the model is right");
    let text = model.add_query(query);
    let options = Options {
        code: CodeEngine::Interpreter,
        strategy: true,
        ..Options::default()
    };
    let answer = model.check(&text, &options).ok()?;
    Some((model, answer))
}
