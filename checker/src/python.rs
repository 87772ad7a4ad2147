//! The Python module `ntagen._checker`: conversions only.
//!
//! A model is behind a lock, so that Python threads may share it; the interpreter is released while
//! the engine works, and signals (Ctrl-C) are looked for now and then.

mod answer;
mod convert;
mod learned;
mod long_text;
mod model;
mod options;
mod plans;
mod play;
mod policies;
mod walks;

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::diagnostics::Severity;
use crate::engine::LoadedModel;
use crate::engine::format::{explain, survey_json};
use crate::engine::query_form;
use crate::engine::survey::survey_of;
use crate::exec::Libraries;
use crate::tuning::PARTS;

use answer::{Answer, InterruptedError, block_of_runs, check, check_jointly};
use convert::{FailedError, RejectedError, rejected, until_signal_apart};
use model::Model;
use policies::follow;
use walks::{ExactWalk, Simulation, simulate, walk_exactly};

/// Loads a model from its bytes, which come in pieces so that they are in memory once; `path` names
/// it in diagnostics. Libraries that it imports may come from these files and folders.
#[pyfunction]
fn load(
    py: Python<'_>,
    path: &str,
    pieces: &Bound<'_, PyAny>,
    allow_external: Vec<PathBuf>,
) -> PyResult<Model> {
    let libraries = Libraries::new(allow_external);
    let mut bytes = Vec::new();
    for piece in pieces.try_iter()? {
        bytes.extend_from_slice(piece?.cast::<PyBytes>()?.as_bytes());
    }
    let path = path.to_owned();
    let load = move || LoadedModel::load_with(&path, bytes, &libraries);
    Ok(Model::new(until_signal_apart(py, load)?.map_err(rejected)?))
}

/// What is wrong with a model and with a file of queries, if there is one, and what their names
/// stand for, as JSON. The model may be wrong. Libraries may come from these files and folders.
#[pyfunction]
fn survey(
    py: Python<'_>,
    path: String,
    text: Vec<u8>,
    queries: Option<(String, Vec<u8>)>,
    allow_external: Vec<PathBuf>,
) -> PyResult<String> {
    let libraries = Libraries::new(allow_external);
    let look = move || {
        let listed = queries
            .as_ref()
            .map(|(path, text)| (path.as_str(), &text[..]));
        let found = survey_of((&path, &text), listed, &libraries);
        let mut paths = vec![path.as_str()];
        paths.extend(listed.map(|(path, _)| path));
        survey_json::survey(&found, &paths).to_string()
    };
    until_signal_apart(py, look)
}

/// For each code: the code, its name, its severity ("error" or "warning"), and its page in
/// Markdown.
#[pyfunction]
fn explanations() -> Vec<(&'static str, &'static str, &'static str, &'static str)> {
    let explanations = explain::explanations().map(|(code, page)| {
        let severity = match code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        (code.code, code.name, severity, page)
    });
    explanations.collect()
}

/// What a query asks for, by its text alone: its kind, the strategies that it defines and uses, and
/// whether the controller sees observations only; `None` if the text is no query.
#[pyfunction]
fn form_of_query(text: &str) -> Option<(&'static str, Option<String>, Option<String>, bool)> {
    let form = query_form::query_form(text)?;
    Some((form.kind, form.defines, form.uses, form.is_observed))
}

/// The engine of ntagen.
#[pymodule]
fn _checker(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Model>()?;
    module.add_class::<Answer>()?;
    module.add_class::<ExactWalk>()?;
    module.add_class::<Simulation>()?;
    module.add_class::<play::Strategy>()?;
    module.add_class::<play::Play>()?;
    module.add_class::<learned::LearnedStrategy>()?;
    module.add_class::<policies::Environment>()?;
    module.add_class::<policies::Moment>()?;
    module.add_class::<plans::Plans>()?;
    module.add_class::<long_text::LongText>()?;
    module.add("FailedError", module.py().get_type::<FailedError>())?;
    module.add(
        "InterruptedError",
        module.py().get_type::<InterruptedError>(),
    )?;
    module.add("RejectedError", module.py().get_type::<RejectedError>())?;
    module.add("PARTS", PARTS.to_vec())?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(check_jointly, module)?)?;
    module.add_function(wrap_pyfunction!(block_of_runs, module)?)?;
    module.add_function(wrap_pyfunction!(simulate, module)?)?;
    module.add_function(wrap_pyfunction!(walk_exactly, module)?)?;
    module.add_function(wrap_pyfunction!(follow, module)?)?;
    module.add_function(wrap_pyfunction!(form_of_query, module)?)?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(survey, module)?)?;
    module.add_function(wrap_pyfunction!(explanations, module)?)
}
