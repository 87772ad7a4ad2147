//! Walks through a model, symbolic and with exact times.

use pyo3::IntoPyObjectExt;
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;

use super::convert::{FailedError, StepEntry, code_engine, rejected, step_entry};
use super::model::{Model, failed};
use crate::engine::LoadedModel;
use crate::engine::format::{json, text};
use crate::engine::session::walk::{Point, SIMULATED_TICKS_PER_UNIT};
use crate::network::Failure;
use crate::verify::timed::{Timed, least_multiple};

/// A walk through a model.
#[pyclass(module = "ntagen._checker")]
pub(super) struct Simulation {
    model: Py<Model>,
    point: Point,
}

/// A walk through a model from its initial state.
#[pyfunction]
pub(super) fn simulate(model: &Bound<'_, Model>, engine: &str) -> PyResult<Simulation> {
    let code = code_engine(engine)?;
    let point = model.get().with(|model| {
        model.prepare_simulation(code).map_err(rejected)?;
        model.start().map_err(|failure| failed(model, failure))
    })?;
    Ok(Simulation {
        model: model.clone().unbind(),
        point,
    })
}

impl Simulation {
    /// What the model gives, unless it fails.
    fn with_model<T>(
        &self,
        action: impl FnOnce(&LoadedModel) -> Result<T, Failure>,
    ) -> PyResult<T> {
        let model = self.model.get();
        model.with(|model| action(model).map_err(|failure| failed(model, failure)))
    }
}

#[pymethods]
impl Simulation {
    /// The location of each process, by its name.
    fn locations(&self) -> Vec<(String, String)> {
        self.model.get().with(|model| {
            let network = model.network();
            let name =
                |index: usize| text::location_name(network, index, &self.point.words).to_owned();
            let processes = network.processes.iter().enumerate();
            processes
                .map(|(index, process)| (process.name.clone(), name(index)))
                .collect()
        })
    }

    /// The value of each scalar part of each variable, by its name.
    fn variables(&self, py: Python<'_>) -> PyResult<Vec<(String, Py<PyAny>)>> {
        self.model.get().with(|model| {
            let mut values: Vec<PyResult<(String, Py<PyAny>)>> = Vec::new();
            text::for_each_value(model.network(), &self.point.words, |name, value| {
                let value = match value {
                    text::Value::Integer(value) => value.into_py_any(py),
                    text::Value::Double(value) => value.into_py_any(py),
                };
                values.push(value.map(|value| (name.to_owned(), value)));
            });
            values.into_iter().collect()
        })
    }

    /// The constraints on clock values that the moves so far leave.
    fn zone(&self) -> Vec<String> {
        self.model
            .get()
            .with(|model| text::zone_constraints(model.network(), &self.point.zone))
    }

    /// The moves: of each, process, edge, branch and select values of the edges that are taken.
    fn moves(&self) -> PyResult<Vec<StepEntry>> {
        self.with_model(|model| {
            let successors = model.successors(&self.point)?.into_iter();
            let entries = successors.map(|(parts, _)| step_entry(model.network(), &parts));
            Ok(entries.collect())
        })
    }

    /// Takes the move with this index.
    fn take(&mut self, index: usize) -> PyResult<()> {
        let successors = self.with_model(|model| model.successors(&self.point))?;
        let count = successors.len();
        let Some((_, point)) = successors.into_iter().nth(index) else {
            let message = format!("there is no move {index}; the state has {count}");
            return Err(PyIndexError::new_err(message));
        };
        self.point = point;
        Ok(())
    }

    /// Follows moves as long as time cannot pass and there is exactly one.
    fn settle(&mut self) -> PyResult<()> {
        self.point = self.with_model(|model| model.settle(self.point.clone()))?;
        Ok(())
    }
}

/// A run that is simulated with exact times.
#[pyclass(module = "ntagen._checker")]
pub(super) struct ExactWalk {
    model: Py<Model>,
    timed: Timed,
}

/// A run with exact times from the initial state of a model.
#[pyfunction]
pub(super) fn walk_exactly(model: &Bound<'_, Model>) -> PyResult<ExactWalk> {
    let ticks_per_unit = SIMULATED_TICKS_PER_UNIT;
    let state = model.get().with(|model| {
        model.expect_symbolic().map_err(rejected)?;
        let choices = model.choices(ticks_per_unit);
        let start = choices.and_then(|choices| choices.initial());
        start.map_err(|error| failed_exactly(model, error))
    })?;
    Ok(ExactWalk {
        model: model.clone().unbind(),
        timed: Timed {
            state,
            ticks_per_unit,
        },
    })
}

fn failed_exactly(model: &LoadedModel, error: crate::verify::Error) -> PyErr {
    FailedError::new_err(text::error_text(model, error))
}

#[pymethods]
impl ExactWalk {
    /// How many ticks make one unit of the model's time.
    #[getter]
    fn ticks_per_unit(&self) -> i64 {
        self.timed.ticks_per_unit
    }

    /// Makes ticks as short as this part of a unit needs; returns false if that is too short.
    fn refine(&mut self, denominator: i64) -> bool {
        let unit = self.timed.ticks_per_unit;
        let finer = (denominator > 0)
            .then(|| least_multiple(unit, denominator))
            .flatten()
            .and_then(|unit| self.timed.at_multiple_of(unit));
        match finer {
            Some(finer) => {
                self.timed = finer;
                true
            }
            None => false,
        }
    }

    /// The state as JSON, clock values in ticks.
    fn state_json(&self) -> String {
        self.model
            .get()
            .with(|model| json::state(model.network(), &self.timed.state).to_string())
    }

    /// What can happen as JSON, and for how many ticks time can pass; `None` for ever.
    fn choices_json(&self) -> PyResult<(String, Option<i64>)> {
        self.model.get().with(|model| {
            let choices = model.choices(self.timed.ticks_per_unit);
            let found = choices.and_then(|choices| choices.of(&self.timed.state));
            let (choices, longest) = found.map_err(|error| failed_exactly(model, error))?;
            Ok((
                json::choices(model.network(), &choices).to_string(),
                longest,
            ))
        })
    }

    /// Waits for this number of ticks and takes the choice with this index. Afterwards, the length
    /// of a tick follows from the state.
    fn take(&mut self, index: usize, wait: i64) -> PyResult<()> {
        let next = self.model.get().with(|model| {
            let choices = model.choices(self.timed.ticks_per_unit);
            let taken = choices.and_then(|choices| {
                let (all, _) = choices.of(&self.timed.state)?;
                match all.get(index) {
                    Some(one) => choices.take(&self.timed.state, wait, &one.parts),
                    None => Ok(None),
                }
            });
            taken.map_err(|error| failed_exactly(model, error))
        })?;
        let impossible =
            || PyIndexError::new_err(format!("choice {index} after {wait} ticks is not possible"));
        let next = Timed {
            state: next.ok_or_else(impossible)?,
            ticks_per_unit: self.timed.ticks_per_unit,
        };
        self.timed = next
            .at_multiple_of(SIMULATED_TICKS_PER_UNIT)
            .unwrap_or(next);
        Ok(())
    }
}
