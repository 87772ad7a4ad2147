//! Games solved: who won, what it took, and what the winner does.

use std::path::Path;

use checker::engine::{Answer, LoadedModel, Options, Verdict};

use crate::checks::{interpreted, load_file, try_ask};

/// The answer to a query, with what the winner does, if the model of the file accepts the query;
/// and the model.
pub(crate) fn solved(path: &Path, query: &str) -> Option<(LoadedModel, Answer)> {
    let mut model = load_file(path);
    let options = Options {
        strategy: true,
        ..interpreted()
    };
    let answer = try_ask(&mut model, query, &options).ok()?;
    Some((model, answer))
}

/// Whether the player that the query is about wins, and how many states were explored for it.
#[track_caller]
pub(crate) fn won_and_explored(answer: &Answer) -> (bool, u64) {
    let is_won = match answer.verdict {
        Verdict::Satisfied => true,
        Verdict::NotSatisfied => false,
        other => panic!("{other:?}"),
    };
    (is_won, answer.counters.explored)
}
