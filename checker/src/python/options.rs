//! The options of a query, read from an `Options` of `ntagen.checker.options`: a row for each.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyKeyboardInterrupt, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::convert::{
    choice, code_engine, forced_rule, observer, priority_rule, reason_of, thread_count, time_limit,
};
use crate::engine::limits::Observer;
use crate::engine::options::RunObserver;
use crate::engine::{Limits, Options, RareEvent, Reductions, StrategyWanted, TraceWanted};
use crate::learning::{Learning, Method};
use crate::search::limits::StopReason;
use crate::search::reachability::report::Order;
use crate::search::store::disk::Disk;
use crate::shield::{Outside, Sampling};
use crate::stochastic::{MeanMethod, Precision, RunSource, UnderChoice};
use crate::tuning::Tuning;

/// What ends the work, and what is to be raised in the end unless it is the user or a limit.
type Cause = (StopReason, Option<PyErr>);

/// What a function has raised that the engine has called: it ends the work.
#[derive(Clone, Default)]
pub(super) struct Raised(Arc<Mutex<Option<Cause>>>);

impl Raised {
    fn note(&self, reason: StopReason, error: Option<PyErr>) {
        self.first().get_or_insert((reason, error));
    }

    fn first(&self) -> MutexGuard<'_, Option<Cause>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why the work ends, if something was raised.
    fn reason(&self) -> Option<StopReason> {
        self.first().as_ref().map(|first| first.0)
    }

    /// What ended the work, if it is neither the user nor a limit.
    pub(super) fn failure(&self, py: Python<'_>) -> Option<PyErr> {
        let (reason, error) = self.first().take()?;
        let is_user = |error: &PyErr| error.is_instance_of::<PyKeyboardInterrupt>(py);
        error.filter(|error| reason == StopReason::Interrupted && !is_user(error))
    }
}

/// The file for states that have no room in memory, if there is a folder for it.
fn disk(given: &Bound<'_, PyAny>) -> PyResult<Option<Arc<Disk>>> {
    let Some(place) = field::<Option<PathBuf>>(given, "spill")? else {
        return Ok(None);
    };
    let disk = Disk::new(&place, field(given, "memory_bytes")?);
    let disk = disk.map_err(|error| {
        let place = place.display();
        PyOSError::new_err(format!("{place}: states cannot be written there: {error}"))
    })?;
    Ok(Some(Arc::new(disk)))
}

/// The options that a Python value holds, and what its functions will have raised.
pub(super) fn read(given: &Bound<'_, PyAny>) -> PyResult<(Options, Raised)> {
    let text = |name| field::<String>(given, name);
    let raised = Raised::default();
    let options = Options {
        order: order(&text("search")?, field(given, "seed")?)?,
        guide: field(given, "guide")?,
        threads: threads(given)?,
        forced: forced_rule(&text("forced")?)?,
        priorities: priority_rule(&text("priorities")?)?,
        code: code_engine(&text("engine")?)?,
        limits: Limits {
            states: field(given, "states")?,
            memory_bytes: field(given, "memory_bytes")?,
            disk: disk(given)?,
            timeout: time_limit(field(given, "timeout_s")?)?,
            observer: Some(or_raised(
                observer(field(given, "progress")?),
                raised.clone(),
            )),
        },
        plans: plans(&text("plans")?, field(given, "max_plans")?)?,
        strategy: field(given, "strategy")?,
        wanted_strategy: strategy_wanted(&text("wanted_strategy")?)?,
        verify: field(given, "verify")?,
        runs: field(given, "trace")?,
        trace: trace_wanted(&text("wanted_trace")?)?,
        certificate: field(given, "certificate")?,
        reductions: reductions(&text("reductions")?)?,
        tuning: tuning(field(given, "without")?)?,
        folder: field(given, "folder")?,
        allow_write: field(given, "allow_write")?,
        precision: precision(given)?,
        under_choice: under_choice(&text("under_choice")?)?,
        run_observer: run_observer(field(given, "run_progress")?, raised.clone()),
        run_source: run_source(field(given, "run_source")?, &raised),
        rare: rare_event(given)?,
        learning: learning(given)?,
        shield: sampling(given)?,
        ..Options::default()
    };
    Ok((options, raised))
}

/// How long a source of runs that has raised is not asked again: the work ends before.
const PAUSE: Duration = Duration::from_millis(10);

/// Takes the results of runs from a Python function, and notes what it raises.
fn run_source(source: Option<Py<PyAny>>, raised: &Raised) -> Option<RunSource> {
    let source = source?;
    let raised = raised.clone();
    Some(RunSource(Arc::new(move |first, most| {
        if raised.reason().is_some() {
            thread::sleep(PAUSE);
            return Vec::new();
        }
        Python::attach(|py| {
            let block = source.call1(py, (first, most)).and_then(|block| {
                PyResult::Ok(block.bind(py).cast::<PyBytes>()?.as_bytes().to_vec())
            });
            block.unwrap_or_else(|error| {
                raised.note(reason_of(py, &error), Some(error));
                Vec::new()
            })
        })
    })))
}

/// Shows what runs say until now to a Python function, and notes that it raises: what a signal
/// raises comes out of whatever Python code runs then.
fn run_observer(progress: Option<Py<PyAny>>, raised: Raised) -> Option<RunObserver> {
    let progress = progress?;
    Some(RunObserver(Arc::new(move |so_far| {
        let known = |value: f64| value.is_finite().then_some(value);
        let shown = (
            so_far.runs,
            known(so_far.estimate),
            known(so_far.interval.lower),
            known(so_far.interval.upper),
        );
        Python::attach(|py| {
            if let Err(error) = progress.call1(py, shown) {
                raised.note(reason_of(py, &error), None);
            }
        });
    })))
}

/// What an observer says, or whether something was raised elsewhere.
fn or_raised(observer: Observer, raised: Raised) -> Observer {
    Arc::new(move |counters| raised.reason().or_else(|| observer(counters)))
}

/// What statistical queries promise.
fn precision(given: &Bound<'_, PyAny>) -> PyResult<Precision> {
    Ok(Precision {
        alpha: field(given, "alpha")?,
        beta: field(given, "beta")?,
        epsilon: field(given, "epsilon")?,
        delta: either_side(given, "delta")?,
        odds_ratios: field(given, "odds_ratios")?,
        discretisation: field(given, "discretisation")?,
        anytime: field(given, "anytime")?,
        relative: field(given, "relative")?,
        value_bounds: field(given, "value_bounds")?,
        mean_method: mean_method(&field::<String>(given, "mean_interval")?)?,
        runs: field(given, "runs")?,
        seed: field(given, "seed")?,
        ..Precision::default()
    })
}

/// How strategies are learned; what is not given is left to the engine.
fn learning(given: &Bound<'_, PyAny>) -> PyResult<Learning> {
    let usual = Learning::default();
    let methods = [("auto", usual.method), ("q", Method::Q), ("m", Method::M)];
    let method = field::<String>(given, "learning_method")?;
    let discount: Option<f64> = field(given, "discount")?;
    let alpha: Option<f64> = field(given, "qlearning_alpha")?;
    let number = |name: &str, usual: u64| -> PyResult<u64> {
        Ok(field::<Option<u64>>(given, name)?.unwrap_or(usual))
    };
    Ok(Learning {
        method: choice("method of learning", &method, &methods)?,
        learning_runs: field(given, "good_runs")?,
        judging_runs: field(given, "eval_runs")?,
        iterations: number("max_iterations", usual.iterations)?,
        patience: field(given, "reset_no_better")?,
        resets: number("max_reset_learning", usual.resets)?,
        discount: discount.or(usual.discount),
        alpha: alpha.unwrap_or(usual.alpha),
        ..usual
    })
}

/// How shields are sampled.
fn sampling(given: &Bound<'_, PyAny>) -> PyResult<Sampling> {
    use Outside::{Error, Safe, Sampled, Unsafe};
    let known = [
        ("error", Error),
        ("safe", Safe),
        ("unsafe", Unsafe),
        ("sample", Sampled),
    ];
    let outside = field::<String>(given, "out_of_bounds")?;
    Ok(Sampling {
        samples: field(given, "shield_samples")?,
        repeats: field(given, "shield_repeats")?,
        outside: choice("rule for what is out of bounds", &outside, &known)?,
    })
}

/// How rare events are looked for, if a level is given.
fn rare_event(given: &Bound<'_, PyAny>) -> PyResult<Option<RareEvent>> {
    let Some(levels) = field(given, "levels")? else {
        return Ok(None);
    };
    Ok(Some(RareEvent {
        levels,
        effort: field(given, "effort")?,
        repetitions: field(given, "repetitions")?,
    }))
}

fn mean_method(name: &str) -> PyResult<MeanMethod> {
    let known = [
        ("auto", MeanMethod::Auto),
        ("student", MeanMethod::Student),
        ("bernstein", MeanMethod::EmpiricalBernstein),
        ("dkw", MeanMethod::DvoretzkyKieferWolfowitz),
    ];
    choice("interval of means", name, &known)
}

/// A number for both sides of a threshold, or a number for each.
fn either_side(given: &Bound<'_, PyAny>, name: &str) -> PyResult<(f64, f64)> {
    field(given, name).or_else(|_| field(given, name).map(|both: f64| (both, both)))
}

/// An attribute.
fn field<'py, T: FromPyObjectOwned<'py>>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<T> {
    given.getattr(name)?.extract().map_err(Into::into)
}

/// A number of threads, or `all` for one for each core.
fn threads(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    let is_all = field::<String>(given, "threads").is_ok_and(|text| text == "all");
    thread_count(if is_all { 0 } else { field(given, "threads")? })
}

fn order(name: &str, seed: u64) -> PyResult<Order> {
    use Order::{BreadthFirst, DepthFirst, Random};
    let known = [
        ("bfs", BreadthFirst),
        ("dfs", DepthFirst),
        ("random", Random(seed)),
    ];
    choice("search order", name, &known)
}

fn under_choice(name: &str) -> PyResult<UnderChoice> {
    use UnderChoice::{Eager, Lazy, Race};
    let known = [("race", Race), ("eager", Eager), ("lazy", Lazy)];
    choice("choice under a strategy", name, &known)
}

fn plans(wanted: &str, most: usize) -> PyResult<Option<usize>> {
    choice(
        "choice of plans",
        wanted,
        &[("none", None), ("all", Some(most))],
    )
}

fn strategy_wanted(name: &str) -> PyResult<StrategyWanted> {
    use StrategyWanted::{Controller, Winner};
    choice(
        "strategy",
        name,
        &[("winner", Winner), ("controller", Controller)],
    )
}

fn trace_wanted(name: &str) -> PyResult<TraceWanted> {
    use TraceWanted::{Any, Fastest, Shortest};
    let known = [("any", Any), ("shortest", Shortest), ("fastest", Fastest)];
    choice("trace", name, &known)
}

/// `all`, `none`, or names with commas between them.
fn reductions(names: &str) -> PyResult<Reductions> {
    let mut reductions = match names {
        "all" => return Ok(Reductions::ALL),
        "none" => return Ok(Reductions::NONE),
        _ => Reductions::NONE,
    };
    for name in names.split(',').map(str::trim) {
        if !reductions.add(name) {
            return Err(PyValueError::new_err(format!(
                "unknown reduction: {name}; write all, none, or some of symmetry, partial-order \
                 and live-variables with commas between them"
            )));
        }
    }
    Ok(reductions)
}

/// All heuristics but these.
fn tuning(without: Vec<String>) -> PyResult<Tuning> {
    Tuning::without(without).map_err(|error| PyValueError::new_err(error.to_string()))
}
