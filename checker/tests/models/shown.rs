//! What files of traces show: all that the corpus gives holds, and nothing that is changed in one
//! passes.

use std::fs;
use std::path::Path;

use checker::engine::format::json;
use checker::engine::{Options, Rules};
use serde_json::Value as Json;

use crate::checks::{load_file, try_ask};
use crate::corpus;

/// Leaves of a trace that are changed, at most.
const MOST_CHANGES: usize = 24;

/// The file of the traces of an answer, if it has one with exact times.
fn trace(path: &Path, query: &str) -> Option<Json> {
    let mut model = load_file(path);
    let options = Options {
        runs: true,
        ..Options::default()
    };
    let answer = try_ask(&mut model, query, &options).ok()?;
    let witnesses = &answer.evidence.witnesses;
    let is_exact = witnesses.iter().all(|one| one.run.is_some());
    (!witnesses.is_empty() && is_exact).then(|| json::witnesses(model.network(), witnesses, query))
}

/// The pointers to all leaves that say something which is checked.
fn leaves(value: &Json, pointer: &str, into: &mut Vec<String>) {
    // Other values than those shown may be right too: another wait, another moment from which
    // something stays, another state that a loop leads back to, a value that is nearly reached.
    let free = [
        "/format",
        "/version",
        "/query",
        "/title",
        "/from",
        "/end",
        "/ending/loop",
        "/value",
        "/item",
        "/wait",
        "/ticks_per_unit",
        "/kind",
    ];
    if free.iter().any(|name| pointer.ends_with(name)) {
        return;
    }
    match value {
        Json::Object(fields) => {
            for (name, value) in fields {
                let name = name.replace('~', "~0").replace('/', "~1");
                leaves(value, &format!("{pointer}/{name}"), into);
            }
        }
        Json::Array(entries) => {
            for (index, value) in entries.iter().enumerate() {
                leaves(value, &format!("{pointer}/{index}"), into);
            }
        }
        Json::Null => {}
        _ => into.push(pointer.to_owned()),
    }
}

fn changed(value: &Json) -> Json {
    match value {
        Json::Bool(value) => Json::Bool(!value),
        Json::Number(number) => match number.as_i64() {
            Some(number) => Json::from(number + 1),
            None => Json::from(number.as_f64().unwrap_or_default() + 1.0),
        },
        Json::String(text) => Json::from(format!("{text}x")),
        other => other.clone(),
    }
}

#[test]
fn what_traces_show_is_checked() {
    let (mut traces, mut changes) = (0, 0);
    for path in corpus::files("verdicts") {
        let text = fs::read_to_string(&path).expect("the corpus can be read");
        for query in corpus::queries(&text) {
            let Some(file) = trace(&path, &query) else {
                continue;
            };
            let mut model = load_file(&path);
            let place = format!("{}: {query}", path.display());
            let mut holds = |file: &Json| {
                let checked = model.verify_evidence("file", &file.to_string(), Rules::default());
                checked.map(|checked| (checked.holds, checked.lines))
            };
            match holds(&file) {
                Ok((Some(true), _)) => {}
                Ok((None, _)) => continue,
                other => panic!("{place}: {other:?}\n{file:#}"),
            }
            traces += 1;
            let mut pointers = Vec::new();
            leaves(&file, "", &mut pointers);
            let stride = pointers.len().div_ceil(MOST_CHANGES).max(1);
            for pointer in pointers.iter().step_by(stride) {
                let mut other = file.clone();
                let leaf = other.pointer_mut(pointer).expect("the leaf is there");
                *leaf = changed(leaf);
                let result = holds(&other);
                let passes = matches!(result, Ok((Some(true) | None, _)));
                assert!(
                    !passes,
                    "{place}: {pointer} can be changed: {result:?}\n{other:#}"
                );
                changes += 1;
            }
            let mut other = file.clone();
            other["surprise"] = Json::from(1);
            assert!(holds(&other).is_err(), "{place}: an unknown field passes");
        }
    }
    assert!(
        traces > 50 && changes > 1000,
        "{traces} traces, {changes} changes"
    );
}
