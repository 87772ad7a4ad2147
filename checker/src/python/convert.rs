//! What all of the module shares: errors, names of choices, interruption, and moves.

use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::cancellation::{self, Cut, Look};
use crate::engine::format::text;
use crate::engine::limits::Observer;
use crate::engine::{CodeEngine, MOST_THREADS, Rejection, Rules};
use crate::game::{Forced, Priorities};
use crate::ir::{Network, Overflow};
use crate::network::Part;
use crate::search::limits::StopReason;

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

pub(super) fn unknown(what: &str, value: &str) -> PyErr {
    PyValueError::new_err(format!("unknown {what}: {value}"))
}

pub(super) fn code_engine(name: &str) -> PyResult<CodeEngine> {
    match name {
        "jit" => Ok(CodeEngine::Jit),
        "interpreter" => Ok(CodeEngine::Interpreter),
        other => Err(unknown("engine", other)),
    }
}

pub(super) fn time_limit(seconds: Option<f64>) -> PyResult<Option<Duration>> {
    let limit = seconds.map(Duration::try_from_secs_f64).transpose();
    limit.map_err(|_| unknown("time limit", &format!("{seconds:?}")))
}

/// The number of threads that is meant; 0 is one for each core that this process may use.
pub(super) fn thread_count(threads: usize) -> PyResult<usize> {
    match threads {
        0 => Ok(thread::available_parallelism().map_or(1, |cores| cores.get().min(MOST_THREADS))),
        1..=MOST_THREADS => Ok(threads),
        _ => Err(PyValueError::new_err(format!(
            "{threads} threads: there can be at most {MOST_THREADS}"
        ))),
    }
}

pub(super) fn stop_name(reason: StopReason) -> Option<&'static str> {
    match reason {
        StopReason::States => Some("states"),
        StopReason::Memory => Some("memory"),
        StopReason::Time => Some("time"),
        StopReason::Interrupted => None,
        StopReason::Clocks => Some("clocks"),
    }
}

pub(super) fn forced_rule(name: &str) -> PyResult<Forced> {
    match name {
        "tiga" => Ok(Forced::Tiga),
        "product" => Ok(Forced::Product),
        "neutral" => Ok(Forced::Neutral),
        other => Err(unknown("rule for forced moves", other)),
    }
}

pub(super) fn overflow_rule(name: &str) -> PyResult<Overflow> {
    match name {
        "wrap" => Ok(Overflow::Wrap),
        "error" => Ok(Overflow::Error),
        other => Err(unknown("rule for overflows", other)),
    }
}

pub(super) fn priority_rule(name: &str) -> PyResult<Priorities> {
    match name {
        "ignore" => Ok(Priorities::Ignored),
        "keep" => Ok(Priorities::Kept),
        other => Err(unknown("rule for priorities", other)),
    }
}

pub(super) fn rejected(rejection: Rejection) -> PyErr {
    RejectedError::new_err((rejection.rendered,))
}

/// Shows the counters to a Python function, and ends the search if it raises or a signal came.
pub(super) fn observer(progress: Option<Py<PyAny>>) -> Observer {
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
pub(super) fn until_signal<T: Send>(py: Python<'_>, run: impl FnOnce() -> T + Send) -> PyResult<T> {
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

/// The rules of a game, by their names.
pub(super) fn rules(forced: &str, priorities: &str) -> PyResult<Rules> {
    Ok(Rules {
        forced: forced_rule(forced)?,
        priorities: priority_rule(priorities)?,
    })
}

/// A step of a plan: for each edge that is taken, process, edge, branch and select values.
pub(super) type StepEntry = Vec<(u32, u32, u32, Vec<i32>)>;

pub(super) fn step_entry(network: &Network, parts: &[Part]) -> StepEntry {
    let entry = |part: &Part| {
        let values = text::selects(network, *part)
            .into_iter()
            .map(|one| one.1)
            .collect();
        (part.process, part.edge, part.branch, values)
    };
    parts.iter().map(entry).collect()
}
