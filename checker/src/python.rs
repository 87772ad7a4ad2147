//! The Python module `ntagen._checker`: conversions only.
//!
//! A model is behind a lock, so that Python threads may share it; the interpreter is released while
//! the engine works, and signals (Ctrl-C) are looked for now and then.

mod play;
mod walks;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::cancellation::{self, Cut, Look};
use crate::diagnostics::Severity;
use crate::engine::evidence::strategy_check;
use crate::engine::format::{
    explain, json, machine_c, machine_json, model_json, strategy_c, strategy_json, strategy_text,
    text,
};
use crate::engine::limits::Observer;
use crate::engine::{
    self, CodeEngine, Limits, LoadedModel, MOST_THREADS, Options, Rejection, TraceWanted, Verdict,
};
use crate::game::{Forced, Nodes, Priorities};
use crate::ir::Overflow;
use crate::search::limits::StopReason;
use crate::search::optimum::best_first::Met;
use crate::search::reachability::report::Order;
use crate::tuning::{PARTS, Tuning};

use walks::{ExactWalk, Simulation};

pyo3::create_exception!(
    _checker,
    RejectedError,
    PyValueError,
    "The engine does not accept a model or query; `args[0]` is a list of diagnostics as text."
);

pyo3::create_exception!(
    _checker,
    FailedError,
    PyRuntimeError,
    "The model ran into a run-time error; `args[0]` says which, and where."
);

fn json_list(entries: Vec<serde_json::Value>) -> String {
    serde_json::Value::Array(entries).to_string()
}

fn unknown(what: &str, value: &str) -> PyErr {
    PyValueError::new_err(format!("unknown {what}: {value}"))
}

fn code_engine(name: &str) -> PyResult<CodeEngine> {
    match name {
        "jit" => Ok(CodeEngine::Jit),
        "interpreter" => Ok(CodeEngine::Interpreter),
        other => Err(unknown("engine", other)),
    }
}

fn time_limit(seconds: Option<f64>) -> PyResult<Option<Duration>> {
    let limit = seconds.map(Duration::try_from_secs_f64).transpose();
    limit.map_err(|_| unknown("time limit", &format!("{seconds:?}")))
}

/// The number of threads that is meant; 0 is one for each core that this process may use.
fn thread_count(threads: usize) -> PyResult<usize> {
    match threads {
        0 => Ok(thread::available_parallelism().map_or(1, |cores| cores.get().min(MOST_THREADS))),
        1..=MOST_THREADS => Ok(threads),
        _ => Err(PyValueError::new_err(format!(
            "{threads} threads: there can be at most {MOST_THREADS}"
        ))),
    }
}

fn stop_name(reason: StopReason) -> Option<&'static str> {
    match reason {
        StopReason::States => Some("states"),
        StopReason::Memory => Some("memory"),
        StopReason::Time => Some("time"),
        StopReason::Interrupted => None,
        StopReason::Clocks => Some("clocks"),
    }
}

fn forced_rule(name: &str) -> PyResult<Forced> {
    match name {
        "tiga" => Ok(Forced::Tiga),
        "product" => Ok(Forced::Product),
        "neutral" => Ok(Forced::Neutral),
        other => Err(unknown("rule for forced moves", other)),
    }
}

fn overflow_rule(name: &str) -> PyResult<Overflow> {
    match name {
        "wrap" => Ok(Overflow::Wrap),
        "error" => Ok(Overflow::Error),
        other => Err(unknown("rule for overflows", other)),
    }
}

fn priority_rule(name: &str) -> PyResult<Priorities> {
    match name {
        "ignore" => Ok(Priorities::Ignored),
        "keep" => Ok(Priorities::Kept),
        other => Err(unknown("rule for priorities", other)),
    }
}

fn rejected(rejection: Rejection) -> PyErr {
    RejectedError::new_err((rejection.rendered,))
}

/// Shows the counters to a Python function, and ends the search if it raises or a signal came.
fn observer(progress: Option<Py<PyAny>>) -> Observer {
    Arc::new(move |counters| {
        Python::attach(|py| {
            let shown = match &progress {
                Some(progress) => progress.call1(
                    py,
                    (
                        counters.explored,
                        counters.stored,
                        counters.waiting,
                        counters.bytes,
                    ),
                ),
                None => Ok(py.None()),
            };
            shown.and_then(|_| py.check_signals()).is_err()
        })
    })
}

/// How often signals are looked for.
const LOOK_FOR_SIGNALS_EVERY: Duration = Duration::from_millis(50);

/// Does work without the interpreter, which a signal (Ctrl-C) ends.
fn until_signal<T: Send>(py: Python<'_>, run: impl FnOnce() -> T + Send) -> PyResult<T> {
    let owner = thread::current().id();
    let looked = Mutex::new(Instant::now());
    let look: Look = Arc::new(move |_| {
        if thread::current().id() != owner {
            return false;
        }
        let mut looked = looked.lock().unwrap_or_else(PoisonError::into_inner);
        if looked.elapsed() < LOOK_FOR_SIGNALS_EVERY {
            return false;
        }
        *looked = Instant::now();
        Python::attach(|py| py.check_signals().is_err())
    });
    let result = py.detach(|| cancellation::within(look, run));
    result.map_err(|Cut| PyKeyboardInterrupt::new_err(()))
}

/// A loaded model.
#[pyclass(frozen, module = "ntagen._checker")]
struct Model {
    inner: Mutex<LoadedModel>,
}

impl Model {
    fn with<T>(&self, action: impl FnOnce(&mut LoadedModel) -> T) -> T {
        action(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// An edge as it stands in the model: process, source, targets of the branches, select names,
/// synchronisation, whether controllable.
type EdgeEntry = (String, String, Vec<String>, Vec<String>, String, bool);

/// A step of a plan: for each edge that is taken, process, edge, branch and select values.
type StepEntry = Vec<(u32, u32, u32, Vec<i32>)>;

/// A row of a matrix of bounds: of each the value and whether it is strict, `None` for one that is
/// infinite.
type BoundRow = Vec<Option<(i32, bool)>>;

/// A reached state: locations and variables as JSON, the constraints, the matrix, and the state and
/// move that led to it.
type ReachedEntry = (
    String,
    Vec<String>,
    Vec<BoundRow>,
    Option<(usize, StepEntry)>,
);

fn reached_entry(network: &crate::ir::Network, met: Met) -> ReachedEntry {
    let clocks = 0..met.zone.dimension();
    let bound = |left: usize, right: usize| {
        let bound = met.zone.bound(left, right);
        (!bound.is_infinite()).then(|| (bound.value(), bound.is_strict()))
    };
    let row = |left: usize| clocks.clone().map(|right| bound(left, right)).collect();
    (
        json::discrete(network, &met.words).to_string(),
        text::minimal_constraints(network, &met.zone),
        clocks.clone().map(row).collect(),
        met.from
            .map(|(source, parts)| (source, step_entry(network, &parts))),
    )
}

#[pymethods]
impl Model {
    /// The warnings of loading.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.with(|model| model.warnings.clone())
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

    /// What is in the model, as JSON; see `engine::facts`.
    fn facts_json(&self) -> String {
        self.with(|model| model_json::facts(model).to_string())
    }

    /// The queries of the file, as JSON.
    fn queries_json(&self) -> String {
        self.with(|model| json_list(model_json::queries(&model.queries)))
    }

    /// By process: its edges.
    fn edges(&self) -> Vec<Vec<EdgeEntry>> {
        self.with(|model| {
            let processes = model.network().processes.iter().map(|process| {
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
            });
            processes.collect()
        })
    }

    /// The reachable symbolic states, and "states", "memory" or "time" if a limit stopped the
    /// search.
    #[pyo3(signature = (engine, *, states, memory_bytes, timeout_s))]
    fn states(
        slf: &Bound<'_, Self>,
        engine: &str,
        states: Option<u64>,
        memory_bytes: Option<u64>,
        timeout_s: Option<f64>,
    ) -> PyResult<(Vec<ReachedEntry>, Option<&'static str>)> {
        let code = code_engine(engine)?;
        let limits = Limits {
            states,
            memory_bytes,
            timeout: time_limit(timeout_s)?,
            observer: Some(observer(None)),
        };
        let model = slf.get();
        let found = slf.py().detach(|| {
            model.with(|model| {
                model.prepare_simulation(code).map_err(rejected)?;
                let (met, stop) = model
                    .reached(limits)
                    .map_err(|failure| Simulation::failed(model, failure))?;
                let network = model.network();
                let states = met.into_iter().map(|one| reached_entry(network, one));
                Ok::<_, PyErr>((states.collect(), stop))
            })
        });
        let (states, stop): (Vec<ReachedEntry>, _) = found?;
        match stop {
            Some(StopReason::Interrupted) => Err(PyKeyboardInterrupt::new_err(())),
            stop => Ok((states, stop.and_then(stop_name))),
        }
    }

    /// A walk through the model from its initial state.
    fn simulate(slf: &Bound<'_, Self>, engine: &str) -> PyResult<Simulation> {
        Simulation::start(slf, code_engine(engine)?)
    }

    /// Reads the queries of a `.q` file, as JSON.
    fn read_queries_json(&self, path: &str, data: &Bound<'_, PyBytes>) -> PyResult<String> {
        let queries = self
            .with(|model| model.read_queries(path, data.as_bytes()))
            .map_err(rejected)?;
        Ok(json_list(model_json::queries(&queries)))
    }

    /// Checks a file with a certificate, a trace or a strategy: whether it holds (`None` if the
    /// check does not cover it), and what was looked at.
    fn verify(
        slf: &Bound<'_, Self>,
        path: &str,
        text: &str,
        forced: &str,
        priorities: &str,
    ) -> PyResult<(Option<bool>, Vec<String>)> {
        let rules = (forced_rule(forced)?, priority_rule(priorities)?);
        let model = slf.get();
        let verify = || model.with(|model| model.verify_evidence(path, text, rules));
        let checked = until_signal(slf.py(), verify)?.map_err(rejected)?;
        Ok((checked.holds, checked.lines))
    }

    /// A run with exact times from the initial state.
    fn walk_exactly(slf: &Bound<'_, Self>) -> PyResult<ExactWalk> {
        ExactWalk::start(slf)
    }

    /// Answers a query.
    #[pyo3(signature = (query, *, search, threads, seed, forced, priorities, engine, states, memory_bytes, timeout_s, max_plans, strategy, verify, trace, wanted_trace, certificate, symmetry, partial_order, live_variables, without, folder, allow_write, progress))]
    #[expect(
        clippy::too_many_arguments,
        clippy::fn_params_excessive_bools,
        reason = "one for each option of the command line"
    )]
    fn check(
        slf: &Bound<'_, Self>,
        query: &str,
        search: &str,
        threads: usize,
        seed: u64,
        forced: &str,
        priorities: &str,
        engine: &str,
        states: Option<u64>,
        memory_bytes: Option<u64>,
        timeout_s: Option<f64>,
        max_plans: Option<usize>,
        strategy: bool,
        verify: bool,
        trace: bool,
        wanted_trace: &str,
        certificate: bool,
        symmetry: bool,
        partial_order: bool,
        live_variables: bool,
        without: Vec<String>,
        folder: Option<PathBuf>,
        allow_write: Vec<PathBuf>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Answer> {
        let timeout = time_limit(timeout_s)?;
        let options = Options {
            order: match search {
                "bfs" => Order::BreadthFirst,
                "dfs" => Order::DepthFirst,
                "random" => Order::Random(seed),
                other => return Err(unknown("search order", other)),
            },
            threads: thread_count(threads)?,
            nodes: Nodes::Automatic,
            forced: forced_rule(forced)?,
            priorities: priority_rule(priorities)?,
            code: code_engine(engine)?,
            limits: Limits {
                states,
                memory_bytes,
                timeout,
                observer: Some(observer(progress)),
            },
            plans: max_plans,
            strategy,
            verify,
            runs: trace,
            trace: match wanted_trace {
                "any" => TraceWanted::Any,
                "shortest" => TraceWanted::Shortest,
                "fastest" => TraceWanted::Fastest,
                other => return Err(unknown("trace", other)),
            },
            certificate,
            symmetry,
            partial_order,
            live_variables,
            tuning: Tuning::without(without)
                .map_err(|error| PyValueError::new_err(error.to_string()))?,
            folder,
            allow_write,
            overflow: Overflow::default(),
        };
        let model = slf.get();
        let answer = slf.py().detach(|| {
            model.with(|model| {
                let text = model.add_query(query);
                let overflow = model.network().overflow;
                model.check(
                    &text,
                    &Options {
                        overflow,
                        ..options
                    },
                )
            })
        });
        let answer = answer.map_err(rejected)?;
        if answer.verdict == Verdict::Unknown(StopReason::Interrupted) {
            return Err(PyKeyboardInterrupt::new_err(()));
        }
        Ok(Answer {
            model: slf.clone().unbind(),
            query: query.to_owned(),
            inner: answer,
        })
    }
}

fn step_entry(network: &crate::ir::Network, parts: &[crate::network::Part]) -> StepEntry {
    let entry = |part: &crate::network::Part| {
        let values = text::selects(network, *part)
            .into_iter()
            .map(|one| one.1)
            .collect();
        (part.process, part.edge, part.branch, values)
    };
    parts.iter().map(entry).collect()
}

/// The answer to a query.
#[pyclass(frozen, module = "ntagen._checker")]
struct Answer {
    model: Py<Model>,
    query: String,
    inner: engine::Answer,
}

#[pymethods]
impl Answer {
    /// "satisfied", "not satisfied", "maybe", "unknown" or "error".
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.inner.verdict {
            Verdict::Satisfied => "satisfied",
            Verdict::NotSatisfied => "not satisfied",
            Verdict::Maybe => "maybe",
            Verdict::Unknown(_) => "unknown",
            Verdict::Error(_) => "error",
        }
    }

    /// The values of a query for them as JSON; `None` for other queries.
    fn value_json(&self) -> Option<String> {
        let values = self.inner.value.as_ref()?;
        Some(json::values(values).to_string())
    }

    /// "states", "memory" or "time" if a limit stopped the search.
    #[getter]
    fn stop(&self) -> Option<&'static str> {
        match self.inner.verdict {
            Verdict::Unknown(reason) => stop_name(reason),
            _ => None,
        }
    }

    /// A remark, or what went wrong in the model.
    #[getter]
    fn message(&self) -> Option<String> {
        match self.inner.verdict {
            Verdict::Error(failure) => Some(
                self.model
                    .get()
                    .with(|model| text::failure_text(model, failure)),
            ),
            _ => self.inner.message.clone(),
        }
    }

    /// Warnings about the query.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.inner.warnings.clone()
    }

    #[getter]
    fn explored(&self) -> u64 {
        self.inner.counters.explored
    }

    #[getter]
    fn stored(&self) -> u64 {
        self.inner.counters.stored
    }

    /// The first place where a result wrapped round, and the expression.
    #[getter]
    fn wrapped(&self) -> Option<(String, String)> {
        let site = self.inner.wrapped?;
        let place =
            |model: &mut LoadedModel| model.place(model.network().sites[site.0 as usize].span);
        Some(self.model.get().with(place))
    }

    #[getter]
    fn seconds(&self) -> f64 {
        self.inner.seconds
    }

    #[getter]
    fn load_seconds(&self) -> f64 {
        self.inner.load_seconds
    }

    #[getter]
    fn peak_bytes(&self) -> u64 {
        self.inner.peak_bytes
    }

    /// How many plans there are; `None` if none were asked for or there is no list of plans.
    #[getter]
    fn plan_count(&self) -> Option<usize> {
        self.inner.evidence.plans.as_ref().map(Vec::len)
    }

    /// Whether there are more plans than were asked for.
    #[getter]
    fn has_more_plans(&self) -> bool {
        self.inner.evidence.has_more_plans
    }

    /// The plans: of each, the steps that leave a state without committed locations.
    fn plans(&self) -> Vec<Vec<StepEntry>> {
        self.model.get().with(|model| {
            let network = model.network();
            let plans = self.inner.evidence.plans.iter().flatten().map(|plan| {
                let steps = plan
                    .steps
                    .iter()
                    .filter(|step| !step.was_committed)
                    .map(|step| step_entry(network, &step.parts));
                steps.collect()
            });
            plans.collect()
        })
    }

    /// The plans as JSON; `None` without plans.
    fn plans_json(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.plans_json_or_none())
    }

    /// The traces in UPPAAL's form, with the runs with exact times; `None` without a trace.
    fn trace_text(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.trace_text_or_none())
    }

    /// The traces as JSON; `None` without a trace.
    fn trace_json(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.trace_json_or_none())
    }

    /// The certificate as a file; `None` without one.
    fn certificate_text(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.certificate_text_or_none())
    }

    /// Whether the strategy and the traces passed their checks; `None` if none was made or one came
    /// to no end.
    #[getter]
    fn verified(&self) -> Option<bool> {
        self.inner.evidence.is_verified()
    }

    /// What the checks of strategy and traces covered, or what is wrong, line by line; empty
    /// without a check.
    fn verification(&self) -> Vec<String> {
        let evidence = &self.inner.evidence;
        let runs = evidence.witnesses.iter().filter_map(|one| one.run.as_ref());
        let mut lines: Vec<String> = runs.flat_map(text::proof_lines).collect();
        if let Some(result) = &evidence.verification {
            lines.extend(
                self.model
                    .get()
                    .with(|model| strategy_check::describe(model.network(), result)),
            );
        }
        lines
    }

    /// The strategy, or the machine of a game with observations, as JSON; `None` without any.
    fn strategy_json(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.strategy_json_or_none())
    }

    /// The strategy, or the machine of a game with observations, as a controller in C; `None`
    /// without any.
    fn controller_c(&self, py: Python<'_>) -> PyResult<Option<String>> {
        let text = until_signal(py, || self.controller_c_or_reason())?;
        text.map_err(|reason| RejectedError::new_err((vec![format!("error: {reason}")],)))
    }

    /// The strategy as text in TIGA's form, or the machine of a game with observations; `None`
    /// without any.
    fn strategy_text(&self, py: Python<'_>) -> PyResult<Option<String>> {
        until_signal(py, || self.strategy_text_or_none())
    }
}

impl Answer {
    fn plans_json_or_none(&self) -> Option<String> {
        let evidence = &self.inner.evidence;
        let plans = evidence.plans.as_ref()?;
        let more = evidence.has_more_plans;
        Some(
            self.model
                .get()
                .with(|model| json::plans(model.network(), plans, &self.query, more).to_string()),
        )
    }

    fn trace_text_or_none(&self) -> Option<String> {
        let witnesses = &self.inner.evidence.witnesses;
        if witnesses.is_empty() {
            return None;
        }
        let texts: Vec<String> = self.model.get().with(|model| {
            let texts = witnesses.iter();
            texts
                .map(|one| text::witness_text(model.network(), one))
                .collect()
        });
        Some(texts.join("\n"))
    }

    fn trace_json_or_none(&self) -> Option<String> {
        let witnesses = &self.inner.evidence.witnesses;
        if witnesses.is_empty() {
            return None;
        }
        Some(
            self.model
                .get()
                .with(|model| json::witnesses(model.network(), witnesses, &self.query).to_string()),
        )
    }

    fn certificate_text_or_none(&self) -> Option<String> {
        let certificate = self.inner.evidence.certificate.as_ref()?;
        Some(
            self.model
                .get()
                .with(|model| certificate.text(model.network(), &self.query)),
        )
    }

    fn strategy_json_or_none(&self) -> Option<String> {
        if let Some(machine) = &self.inner.evidence.machine {
            let write = |model: &mut LoadedModel| {
                machine_json::write(model.network(), machine, &self.query).to_string()
            };
            return Some(self.model.get().with(write));
        }
        let strategy = self.inner.evidence.strategy.as_ref()?;
        Some(
            self.model
                .get()
                .with(|model| strategy_json::text(model.network(), strategy, &self.query)),
        )
    }

    fn strategy_text_or_none(&self) -> Option<String> {
        if let Some(machine) = &self.inner.evidence.machine {
            let write =
                |model: &mut LoadedModel| machine_json::text(model.network(), machine, &self.query);
            return Some(self.model.get().with(write));
        }
        let strategy = self.inner.evidence.strategy.as_ref()?;
        let write = |model: &mut LoadedModel| strategy_text::write(model.network(), strategy);
        Some(self.model.get().with(write))
    }

    fn controller_c_or_reason(&self) -> Result<Option<String>, strategy_c::NoController> {
        if let Some(machine) = &self.inner.evidence.machine {
            let write =
                |model: &mut LoadedModel| machine_c::write(model.network(), machine, &self.query);
            return Ok(Some(self.model.get().with(write)));
        }
        let Some(strategy) = self.inner.evidence.strategy.as_ref() else {
            return Ok(None);
        };
        let text = self
            .model
            .get()
            .with(|model| strategy_c::write(model.network(), strategy, &self.query));
        text.map(Some)
    }
}

/// Loads a model from its bytes; `path` names it in diagnostics.
#[pyfunction]
fn load(py: Python<'_>, path: &str, data: &Bound<'_, PyBytes>) -> PyResult<Model> {
    let bytes = data.as_bytes();
    let model = until_signal(py, || LoadedModel::load(path, bytes))?.map_err(rejected)?;
    Ok(Model {
        inner: Mutex::new(model),
    })
}

/// Of every code: the code, its name, its severity ("error" or "warning"), and its page in
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

/// The engine of ntagen.
#[pymodule]
fn _checker(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Model>()?;
    module.add_class::<Answer>()?;
    module.add_class::<ExactWalk>()?;
    module.add_class::<Simulation>()?;
    module.add_class::<play::Strategy>()?;
    module.add_class::<play::Play>()?;
    module.add("FailedError", module.py().get_type::<FailedError>())?;
    module.add("RejectedError", module.py().get_type::<RejectedError>())?;
    module.add("PARTS", PARTS.to_vec())?;
    module.add_function(wrap_pyfunction!(load, module)?)?;
    module.add_function(wrap_pyfunction!(explanations, module)?)
}
