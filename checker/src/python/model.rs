//! Models: what is in them, and the check of files of evidence.

use std::sync::{Mutex, PoisonError};
use std::thread;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

use super::convert::{
    FailedError, StepEntry, code_engine, observer, overflow_rule, rejected, rules, step_entry,
    stop_name, time_limit, until_signal, until_signal_apart,
};
use crate::cancellation;
use crate::engine::format::{json, model_json, network_json, text};
use crate::engine::{Limits, LoadedModel, Rejection};
use crate::ir::{Network, Overflow};
use crate::network::Failure;
use crate::search::limits::StopReason;
use crate::search::optimum::best_first::Met;
use crate::zones::Zone;

/// Which files are evidence.
const EVIDENCE: &str =
    "hint: give a trace, certificate or strategy as JSON, which `ntagen check` wrote";

/// A loaded model.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct Model {
    /// There is one until the end.
    inner: Mutex<Option<LoadedModel>>,
}

impl Model {
    pub(super) fn new(model: LoadedModel) -> Model {
        Model {
            inner: Mutex::new(Some(model)),
        }
    }

    pub(super) fn with<T>(&self, action: impl FnOnce(&mut LoadedModel) -> T) -> T {
        let mut model = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        action(model.as_mut().expect("there is a model until the end"))
    }
}

/// A model with more edges takes long to give back.
const MANY_EDGES: usize = 20_000;

impl Drop for Model {
    /// Gives a large model back in a thread of its own, tens of millions of blocks, so that a
    /// program that ends need not wait.
    fn drop(&mut self) {
        let inner = self.inner.get_mut().unwrap_or_else(PoisonError::into_inner);
        let Some(model) = inner.take() else { return };
        let processes = model.network().processes.iter();
        let edges: usize = processes.map(|process| process.edges.len()).sum();
        if edges > MANY_EDGES || model.text().len() > 1 << 20 {
            // Without a thread it is given back here.
            thread::Builder::new().spawn(move || drop(model)).ok();
        }
    }
}

/// An edge as it stands in the model: process, source, targets of the branches, select names,
/// synchronisation, whether controllable.
type EdgeEntry = (String, String, Vec<String>, Vec<String>, String, bool);

/// A row of a matrix of bounds: of each the value and whether it is strict, `None` for one that is
/// infinite.
pub(super) type BoundRow = Vec<Option<(i32, bool)>>;

/// A reached state: locations and variables as JSON, the constraints, the matrix, and the state and
/// move that led to it.
type ReachedEntry = (
    String,
    Vec<String>,
    Vec<BoundRow>,
    Option<(usize, StepEntry)>,
);

/// Reached states, the moves between them (index, move, index), and the limit that stopped the
/// search.
type SpaceEntry = (
    Vec<ReachedEntry>,
    Vec<(usize, StepEntry, usize)>,
    Option<&'static str>,
);

/// The matrix of a zone.
pub(super) fn bound_rows(zone: &Zone) -> Vec<BoundRow> {
    let clocks = 0..zone.dimension();
    let bound = |left: usize, right: usize| {
        let bound = zone.bound(left, right);
        (!bound.is_infinite()).then(|| (bound.value(), bound.is_strict()))
    };
    let row = |left: usize| clocks.clone().map(|right| bound(left, right)).collect();
    clocks.clone().map(row).collect()
}

/// What it takes to hand a move between states on: see [`cancellation::work`].
const UNITS_FOR_LINK: usize = 200;

fn reached_entry(network: &Network, met: Met) -> ReachedEntry {
    (
        json::discrete(network, &met.words).to_string(),
        text::minimal_constraints(network, &met.zone),
        bound_rows(&met.zone),
        met.from
            .map(|(source, parts)| (source, step_entry(network, &parts))),
    )
}

fn json_list(entries: Vec<serde_json::Value>) -> String {
    serde_json::Value::Array(entries).to_string()
}

/// Writes something of a model as JSON, unless a signal comes.
fn written(
    model: &Bound<'_, Model>,
    describe: impl FnOnce(&LoadedModel) -> serde_json::Value + Send + 'static,
) -> PyResult<String> {
    let held = model.clone().unbind();
    until_signal_apart(model.py(), move || {
        held.get().with(|model| json::written(&describe(model)))
    })
}

/// What went wrong in the model.
pub(super) fn failed(model: &LoadedModel, failure: Failure) -> PyErr {
    FailedError::new_err(text::failure_text(model, failure))
}

#[pymethods]
impl Model {
    /// The warnings of loading.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.with(|model| model.warnings.clone())
    }

    /// The text of the file.
    #[getter]
    fn text(&self) -> String {
        self.with(|model| model.text().to_owned())
    }

    /// The same model with other values of some of its constants.
    fn with_constants(slf: &Bound<'_, Self>, values: Vec<(String, String)>) -> PyResult<Model> {
        let model = slf.get();
        let load = move || model.with(|model| model.with_constants(&values));
        Ok(Model::new(until_signal(slf.py(), load)?.map_err(rejected)?))
    }

    /// What happens where results of integer arithmetic do not fit: "wrap" or "error".
    #[getter]
    fn overflow(&self) -> &'static str {
        self.with(|model| match model.network().overflow {
            Overflow::Wrap => "wrap",
            Overflow::Error => "error",
        })
    }

    fn set_overflow(&self, rule: &str) -> PyResult<()> {
        let overflow = overflow_rule(rule)?;
        self.with(|model| model.set_overflow(overflow));
        Ok(())
    }

    /// The seconds that loading took.
    #[getter]
    fn load_seconds(&self) -> f64 {
        self.with(|model| model.load_seconds)
    }

    /// What is in the model, as JSON, and what is stored of a state if that is wanted; see
    /// `engine::format::model_json`.
    #[pyo3(signature = (*, with_stored))]
    fn facts_json(slf: &Bound<'_, Self>, with_stored: bool) -> PyResult<String> {
        written(slf, move |model| model_json::facts(model, with_stored))
    }

    /// How large a state is and what is stored of it, as JSON.
    fn stored_state_json(slf: &Bound<'_, Self>) -> PyResult<String> {
        written(slf, model_json::stored_state)
    }

    /// The network, as JSON; see `engine::format::network_json`.
    fn network_json(slf: &Bound<'_, Self>) -> PyResult<String> {
        written(slf, network_json::network)
    }

    /// The queries of the file, as JSON.
    fn queries_json(&self) -> String {
        self.with(|model| json_list(model_json::queries(model, &model.queries)))
    }

    /// The edges of the process with this number.
    fn edges(&self, process: usize) -> Vec<EdgeEntry> {
        self.with(|model| {
            let process = &model.network().processes[process];
            let location = |index: u32| process.locations[index as usize].name.clone();
            let edges = process.edges.iter().map(|edge| {
                let targets = edge
                    .branches
                    .iter()
                    .map(|branch| location(branch.target.0))
                    .collect();
                let selects = edge
                    .select
                    .iter()
                    .map(|select| select.name.clone())
                    .collect();
                let sync = edge.labels.sync.clone();
                (
                    process.name.clone(),
                    location(edge.source.0),
                    targets,
                    selects,
                    sync,
                    edge.controllable,
                )
            });
            edges.collect()
        })
    }

    /// The reachable symbolic states, with `links` the moves between them, and "states", "memory"
    /// or "time" if a limit stopped the search.
    #[pyo3(signature = (engine, *, states, memory_bytes, timeout_s, links))]
    fn states(
        slf: &Bound<'_, Self>,
        engine: &str,
        states: Option<u64>,
        memory_bytes: Option<u64>,
        timeout_s: Option<f64>,
        links: bool,
    ) -> PyResult<SpaceEntry> {
        let code = code_engine(engine)?;
        let limits = Limits {
            states,
            memory_bytes,
            disk: None,
            timeout: time_limit(timeout_s)?,
            observer: Some(observer(None)),
        };
        let model = slf.get();
        let found = until_signal(slf.py(), || {
            model.with(|model| {
                model.prepare_simulation(code).map_err(rejected)?;
                let space = model
                    .reached(limits, links)
                    .map_err(|failure| failed(model, failure))?;
                let network = model.network();
                let met = space.states.into_iter();
                let states = met.map(|one| reached_entry(network, one)).collect();
                let links = space.links.iter().map(|link| {
                    cancellation::work(UNITS_FOR_LINK);
                    let step = step_entry(network, &link.parts);
                    (link.source, step, link.target)
                });
                Ok::<_, PyErr>((states, links.collect(), space.stop))
            })
        })?;
        let (states, links, stop): (_, _, Option<StopReason>) = found?;
        match stop {
            Some(StopReason::Interrupted) => Err(PyKeyboardInterrupt::new_err(())),
            stop => Ok((states, links, stop.and_then(stop_name))),
        }
    }

    /// Reads the queries of a `.q` file, as JSON.
    fn read_queries_json(&self, path: &str, data: &Bound<'_, PyBytes>) -> PyResult<String> {
        self.with(|model| {
            let queries = model.read_queries(path, data.as_bytes())?;
            Ok(json_list(model_json::queries(model, &queries)))
        })
        .map_err(rejected)
    }

    /// Checks a file with a certificate, a trace or a strategy: whether it holds (`None` if the
    /// check does not cover it), and what was looked at.
    fn verify(
        slf: &Bound<'_, Self>,
        path: String,
        data: PyBackedBytes,
        forced: &str,
        priorities: &str,
    ) -> PyResult<(Option<bool>, Vec<String>)> {
        let rules = rules(forced, priorities)?;
        let model = slf.clone().unbind();
        let verify = move || {
            let text = str::from_utf8(&data).map_err(|_| {
                let message = format!("error: {path}: this is not text in UTF-8\n{EVIDENCE}");
                Rejection::without_place(message)
            })?;
            let verify = |model: &mut LoadedModel| model.verify_evidence(&path, text, rules);
            model.get().with(verify)
        };
        let checked = until_signal_apart(slf.py(), verify)?.map_err(rejected)?;
        Ok((checked.holds, checked.lines))
    }
}
