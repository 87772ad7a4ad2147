//! Models loaded from text, and queries asked about them: what nearly every test begins with.
//!
//! Models and queries must be accepted; a test fails with the diagnostics otherwise. Where a query
//! may be refused, [`try_ask`] leaves it to the test what that means.

use std::fs;
use std::path::Path;

use checker::engine::{Answer, CodeEngine, LoadedModel, Options, Rejection, Verdict};
use checker::ir::{Predicate, QueryKind};

/// Options with the interpreter, since small models are done before code is compiled.
pub(crate) fn interpreted() -> Options {
    Options {
        code: CodeEngine::Interpreter,
        ..Options::default()
    }
}

/// The model of a text in any format.
#[track_caller]
pub(crate) fn load(text: &str) -> LoadedModel {
    LoadedModel::load("model", text.as_bytes())
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

/// The model of a file.
#[track_caller]
pub(crate) fn load_file(path: &Path) -> LoadedModel {
    let bytes = fs::read(path).expect("the model is there");
    LoadedModel::load(&path.display().to_string(), bytes)
        .unwrap_or_else(|rejection| panic!("{}", rejection.rendered.join("\n")))
}

/// The answer to a query, or why it is refused.
pub(crate) fn try_ask(
    model: &mut LoadedModel,
    query: &str,
    options: &Options,
) -> Result<Answer, Rejection> {
    let query = model.add_query(query);
    model.check(&query, options)
}

/// The answer to a query.
#[track_caller]
pub(crate) fn ask(model: &mut LoadedModel, query: &str, options: &Options) -> Answer {
    try_ask(model, query, options)
        .unwrap_or_else(|rejection| panic!("{query}\n{}", rejection.rendered.join("\n")))
}

/// The answer to a query about the model of a text.
#[track_caller]
pub(crate) fn check(text: &str, query: &str, options: &Options) -> Answer {
    try_ask(&mut load(text), query, options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

/// That a query about the model of a text has this verdict; the answer.
#[track_caller]
pub(crate) fn expect(text: &str, query: &str, options: &Options, verdict: Verdict) -> Answer {
    let answer = check(text, query, options);
    assert_eq!(answer.verdict, verdict, "{query}\n{text}");
    answer
}

/// The states that a query is about: those that `E<>` looks for, and that `A[]` excludes.
#[track_caller]
pub(crate) fn goal_of(model: &mut LoadedModel, query: &str) -> Predicate {
    let text = model.add_query(query);
    let (query, _) = model.compile(text.span).expect("the query is right");
    match query.kind {
        QueryKind::Reachable(goal) => goal,
        QueryKind::Invariantly(keep) => Predicate::Not(Box::new(keep)),
        other => panic!("{other:?}"),
    }
}
