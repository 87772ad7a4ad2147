//! Somebody in Python decides for the controller: environments, and policies as strategies.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;

use super::convert::{rejected, until_signal_apart};
use super::model::Model;
use crate::engine::evidence::policies::Interface;
use crate::engine::session::environment::{self, End, Question, Report};
use crate::learning::{Policy, Situation};
use crate::stochastic::{Failure, RunId, StateView};

/// How often signals are looked for while a report is awaited.
const LOOK_FOR_SIGNALS_EVERY: Duration = Duration::from_millis(20);

/// A moment at which the controller decides, or the end of a run.
#[pyclass(frozen, get_all, module = "ntagen._checker")]
pub(super) struct Moment {
    values: Vec<f64>,
    possible: Vec<bool>,
    time: f64,
    worth: f64,
    end: Option<&'static str>,
}

impl From<Report> for Moment {
    fn from(report: Report) -> Moment {
        let Report {
            values,
            possible,
            time,
            worth,
            end,
        } = report;
        Moment {
            values,
            possible,
            time,
            worth,
            end: end.map(|end| match end {
                End::Goal => "goal",
                End::Bound => "bound",
            }),
        }
    }
}

/// Random runs of a model in which somebody outside decides.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct Environment {
    inner: Mutex<environment::Environment>,
}

impl Environment {
    fn with<T>(&self, action: impl FnOnce(&environment::Environment) -> T) -> T {
        action(&self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Waits for the report on a command.
    fn report(&self, py: Python<'_>) -> PyResult<Moment> {
        loop {
            let report = || self.with(|inner| inner.report(LOOK_FOR_SIGNALS_EVERY));
            if let Some(reported) = py.detach(report) {
                return reported.map(Moment::from).map_err(rejected);
            }
            py.check_signals()?;
        }
    }
}

#[pymethods]
impl Environment {
    /// The environment of a query for the best strategy; the queries before define strategies.
    #[new]
    fn new(
        model: &Bound<'_, Model>,
        query: String,
        before: Vec<String>,
        wait: Option<f64>,
    ) -> PyResult<Environment> {
        let held = model.clone().unbind();
        let question = Question {
            query,
            before,
            wait,
        };
        let begin = move || {
            let model = held.get().with(|model| model.with_constants(&[]))?;
            environment::Environment::new(model, &question)
        };
        let inner = until_signal_apart(model.py(), begin)?.map_err(rejected)?;
        Ok(Environment {
            inner: Mutex::new(inner),
        })
    }

    /// The texts of the actions; the last one is to wait.
    fn actions(&self) -> Vec<String> {
        self.with(|inner| inner.actions.clone())
    }

    /// The texts of what is seen: exactly, and in intervals.
    fn features(&self) -> (Vec<String>, Vec<String>) {
        self.with(|inner| {
            let texts = inner.features.clone();
            (texts.discrete, texts.continuous)
        })
    }

    /// Whether the greatest value is the best.
    #[getter]
    fn is_greatest(&self) -> bool {
        self.with(|inner| inner.is_greatest)
    }

    /// For how long the controller waits at most.
    #[getter]
    fn wait(&self) -> f64 {
        self.with(|inner| inner.wait)
    }

    /// Begins a run.
    fn begin(&self, py: Python<'_>, seed: u64, run: u64) -> PyResult<Moment> {
        self.with(|inner| inner.begin(RunId { seed, run }));
        self.report(py)
    }

    /// Decides.
    fn act(&self, py: Python<'_>, action: usize) -> PyResult<Moment> {
        self.with(|inner| inner.act(action));
        self.report(py)
    }
}

/// A function of Python that decides: it gets the values that are seen and which actions are
/// possible, and returns the number of one.
struct PythonPolicy {
    decide: Py<PyAny>,
    failure: Mutex<String>,
}

impl Policy for PythonPolicy {
    fn decide(&self, _: &mut StateView<'_>, situation: Situation<'_>) -> Result<usize, Failure> {
        let decided = Python::attach(|py| {
            let asked = (situation.values.to_vec(), situation.possible.to_vec());
            let decided = self.decide.call1(py, asked);
            let decided = decided.and_then(|action| action.extract::<usize>(py));
            // What is wrong, and what to do, may be several lines.
            decided.map_err(|error| error.to_string().replace('\n', "; "))
        });
        decided.map_err(|why| {
            *self.failure.lock().unwrap_or_else(PoisonError::into_inner) = why;
            Failure::NoDecision
        })
    }

    fn failure(&self) -> String {
        let failure = self.failure.lock();
        failure.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Lets queries of a model be asked under a policy by a name; returns the texts of the actions. The
/// policy sees features, waits at most for a time, and may say between which actions it decides.
#[pyfunction]
#[pyo3(signature = (model, name, features, decide, *, wait, actions))]
pub(super) fn follow(
    model: &Bound<'_, Model>,
    name: &str,
    features: String,
    decide: Py<PyAny>,
    wait: Option<f64>,
    actions: Option<Vec<String>>,
) -> PyResult<Vec<String>> {
    let policy = Arc::new(PythonPolicy {
        decide,
        failure: Mutex::new(String::new()),
    });
    let interface = Interface {
        features,
        wait,
        actions,
    };
    let kept = model
        .get()
        .with(|model| model.keep_policy(name, &interface, policy));
    kept.map_err(rejected)
}
