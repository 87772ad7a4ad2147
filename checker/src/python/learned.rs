//! Strategies that were learned, and how that went.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::answer::Answer;
use super::convert::{code_language, rejected, until_signal_apart, unwritten};
use super::model::Model;
use crate::engine::LoadedModel;
use crate::engine::format::learned_json;
use crate::engine::query_form::unnamed;
use crate::learning;

/// A learned strategy.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct LearnedStrategy {
    model: Py<Model>,
    query: String,
    inner: Arc<learning::LearnedStrategy>,
}

#[pymethods]
impl LearnedStrategy {
    /// The learned strategy of an answer; `None` if it has none.
    #[staticmethod]
    fn of_answer(py: Python<'_>, answer: &Bound<'_, Answer>) -> Option<LearnedStrategy> {
        let answer = answer.get();
        Some(LearnedStrategy {
            model: answer.model.clone_ref(py),
            query: unnamed(&answer.query).to_owned(),
            inner: Arc::clone(answer.inner.evidence.learned.as_ref()?),
        })
    }

    /// The query that it answers, or that has loaded it.
    #[getter]
    fn query(&self) -> &str {
        &self.query
    }

    /// Whether the greatest value is the best.
    #[getter]
    fn is_greatest(&self) -> bool {
        self.inner.is_greatest
    }

    /// How many leaves its trees have.
    #[getter]
    fn leaves(&self) -> usize {
        self.inner.leaves()
    }

    /// The texts of what it sees: exactly, and in intervals.
    fn features(&self) -> (Vec<String>, Vec<String>) {
        let texts = learned_json::texts(&self.inner.observation);
        (texts.discrete, texts.continuous)
    }

    /// The texts of its actions; the last one is to wait.
    fn actions(&self) -> Vec<String> {
        let inner = &self.inner;
        self.model.get().with(|model| model.learned_actions(inner))
    }

    /// The best enabled action; `None` if none of them was tried here.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "Python's lists are read as vectors"
    )]
    fn decide(
        &self,
        discrete: Vec<f64>,
        continuous: Vec<f64>,
        enabled: Vec<bool>,
    ) -> PyResult<Option<u32>> {
        let inner = &self.inner;
        let lists = [
            ("discrete", discrete.len(), inner.observation.discrete.len()),
            (
                "continuous",
                continuous.len(),
                inner.observation.continuous.len(),
            ),
            ("enabled", enabled.len(), inner.moves.len() + 1),
        ];
        for (name, given, wanted) in lists {
            if given != wanted {
                let message = format!("{name} has {given} values, but there must be {wanted}");
                return Err(PyValueError::new_err(message));
            }
        }
        let enabled = |action: u32| enabled[action as usize];
        Ok(inner.decide(&discrete, &continuous, enabled))
    }

    /// The strategy as a file.
    fn json(slf: &Bound<'_, Self>) -> PyResult<String> {
        let text = written(slf, |own, model| model.learned_text(&own.inner))?;
        text.map_err(unwritten)
    }

    /// The strategy as a function in "c" or "python", whose names begin so.
    fn code(slf: &Bound<'_, Self>, language: &str, name: String) -> PyResult<String> {
        let language = code_language(language)?;
        written(slf, move |own, model| {
            model.learned_code(&own.inner, language, &name, &own.query)
        })
    }

    /// Lets queries of the model be asked under it by a name.
    fn keep(&self, name: &str) -> PyResult<()> {
        let kept = self.model.get().with(|model| {
            let learned = Arc::clone(&self.inner);
            model.keep_known(name, &self.query, learned)
        });
        kept.map_err(rejected)
    }
}

/// Writes something that may be long, unless a signal comes.
fn written<T: Send + 'static>(
    strategy: &Bound<'_, LearnedStrategy>,
    write: impl FnOnce(&LearnedStrategy, &LoadedModel) -> T + Send + 'static,
) -> PyResult<T> {
    let held = strategy.clone().unbind();
    until_signal_apart(strategy.py(), move || {
        let strategy = held.get();
        strategy.model.get().with(|model| write(strategy, model))
    })
}
