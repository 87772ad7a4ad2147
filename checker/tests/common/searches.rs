//! Searches in some manner, whose traces are shown to be runs.

use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, CodeEngine, LoadedModel, Options};
use checker::search::reachability::report::Order;

/// The answer to a query, found in this order by so many threads, with the options that `adjust`
/// leaves; `is_shown` says whether what an independent replay makes of a trace is all right.
pub(crate) fn answer_in(
    (order, threads): (Order, usize),
    (text, query): (&str, &str),
    adjust: impl FnOnce(&mut Options),
    is_shown: impl Fn(Option<&Proof>) -> bool,
) -> Answer {
    let mut model = LoadedModel::load("model.xta", text.as_bytes())
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")));
    let query_text = model.add_query(query);
    let mut options = Options {
        order,
        threads,
        code: CodeEngine::Interpreter,
        runs: true,
        ..Options::default()
    };
    adjust(&mut options);
    let answer = model
        .check(&query_text, &options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")));
    for witness in &answer.evidence.witnesses {
        assert!(
            is_shown(witness.run.as_ref()),
            "{query}: {:#?}\n{text}",
            witness.run
        );
    }
    answer
}
