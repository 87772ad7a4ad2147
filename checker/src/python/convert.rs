//! What all of the module shares: errors, names of choices, interruption, and moves.

use std::panic;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::cancellation::{self, Cut, Look};
use crate::engine::format::learned_code::Language;
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

/// What a name stands for among these; `what` says what they are.
pub(super) fn choice<T: Copy>(what: &str, name: &str, known: &[(&str, T)]) -> PyResult<T> {
    let found = known.iter().find(|one| one.0 == name);
    found.map(|one| one.1).ok_or_else(|| unknown(what, name))
}

pub(super) fn code_language(name: &str) -> PyResult<Language> {
    let known = [("c", Language::C), ("python", Language::Python)];
    choice("language", name, &known)
}

pub(super) fn code_engine(name: &str) -> PyResult<CodeEngine> {
    use CodeEngine::{Interpreter, Jit};
    choice(
        "engine",
        name,
        &[("jit", Jit), ("interpreter", Interpreter)],
    )
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
        StopReason::Disk => Some("disk"),
        StopReason::Time => Some("time"),
        StopReason::Interrupted => None,
        StopReason::Clocks => Some("clocks"),
    }
}

pub(super) fn forced_rule(name: &str) -> PyResult<Forced> {
    use Forced::{Neutral, Product, Tiga};
    let known = [("tiga", Tiga), ("product", Product), ("neutral", Neutral)];
    choice("rule for forced moves", name, &known)
}

pub(super) fn overflow_rule(name: &str) -> PyResult<Overflow> {
    let known = [("wrap", Overflow::Wrap), ("error", Overflow::Error)];
    choice("rule for overflows", name, &known)
}

pub(super) fn priority_rule(name: &str) -> PyResult<Priorities> {
    let known = [("ignore", Priorities::Ignored), ("keep", Priorities::Kept)];
    choice("rule for priorities", name, &known)
}

pub(super) fn rejected(rejection: Rejection) -> PyErr {
    RejectedError::new_err((rejection.rendered,))
}

/// Why a learned strategy has no file, as a refusal.
#[expect(clippy::needless_pass_by_value, reason = "errors are mapped by it")]
pub(super) fn unwritten(why: String) -> PyErr {
    RejectedError::new_err((vec![format!(
        "error: the strategy cannot be written: {why}"
    )],))
}

/// How often the counters are shown to Python.
const SHOW_EVERY: Duration = Duration::from_millis(50);

/// Shows the counters to a Python function, and ends the search if it raises or a signal came.
pub(super) fn observer(progress: Option<Py<PyAny>>) -> Observer {
    let shown = Mutex::new(None::<Instant>);
    Arc::new(move |counters| {
        let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
        let is_shown = shown.is_none_or(|shown| shown.elapsed() >= SHOW_EVERY);
        let progress = progress.as_ref().filter(|_| is_shown);
        Python::attach(|py| {
            let result = match progress {
                Some(progress) => {
                    *shown = Some(Instant::now());
                    let counters = (
                        counters.explored,
                        counters.stored,
                        counters.waiting,
                        counters.bytes,
                    );
                    progress.call1(py, counters).map(drop)
                }
                None => Ok(()),
            };
            let result = result.and_then(|()| py.check_signals());
            result.err().map(|raised| reason_of(py, &raised))
        })
    })
}

/// Why a signal, or a function that was called, ends the work: an exception whose attribute `limit`
/// is "time" or "memory" tells of a limit that Python watches; any other one is the user.
pub(super) fn reason_of(py: Python<'_>, raised: &PyErr) -> StopReason {
    let limit = raised.value(py).getattr("limit");
    let limit = limit.and_then(|limit| limit.extract::<String>());
    match limit.as_deref() {
        Ok("time") => StopReason::Time,
        Ok("memory") => StopReason::Memory,
        _ => StopReason::Interrupted,
    }
}

/// How often signals are looked for: see the observer of `engine::limits`.
const LOOK_FOR_SIGNALS_EVERY: Duration = Duration::from_millis(3);

/// Does work without the interpreter, which a signal ends: Ctrl-C, or a limit that Python watches.
/// The error is what the handler of the signal raised.
pub(super) fn until_signal<T: Send>(py: Python<'_>, run: impl FnOnce() -> T + Send) -> PyResult<T> {
    let owner = thread::current().id();
    let looked = Mutex::new(Instant::now());
    let raised = Arc::new(Mutex::new(None));
    let raised_here = Arc::clone(&raised);
    let look: Look = Arc::new(move |_| {
        if thread::current().id() != owner {
            return false;
        }
        let mut looked = looked.lock().unwrap_or_else(PoisonError::into_inner);
        if looked.elapsed() < LOOK_FOR_SIGNALS_EVERY {
            return false;
        }
        *looked = Instant::now();
        let error = Python::attach(|py| py.check_signals().err());
        let is_raised = error.is_some();
        if is_raised {
            *raised_here.lock().unwrap_or_else(PoisonError::into_inner) = error;
        }
        is_raised
    });
    let result = py.detach(|| cancellation::within(look, run));
    // Code that cannot unwind ends with some result, which counts for nothing.
    let raised = raised.lock().unwrap_or_else(PoisonError::into_inner).take();
    match raised {
        Some(error) => Err(error),
        None => result.map_err(|Cut| PyKeyboardInterrupt::new_err(())),
    }
}

/// Does work as [`until_signal`] does, but in a thread of its own, which is left behind after a
/// signal: what the work took until then, perhaps tens of millions of blocks, is given back
/// meanwhile, or never if the process ends before.
pub(super) fn until_signal_apart<T: Send + 'static>(
    py: Python<'_>,
    run: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let is_over = Arc::new(AtomicBool::new(false));
    let is_over_there = Arc::clone(&is_over);
    let look: Look = Arc::new(move |_| is_over_there.load(Ordering::Relaxed));
    let (sender, receiver) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().stack_size(STACK_BYTES);
    let thread = thread.spawn(move || {
        let result = cancellation::within(look, run);
        // Nobody may wait for it any more.
        sender.send(result).ok();
    })?;
    let received = py.detach(move || {
        loop {
            match receiver.recv_timeout(LOOK_FOR_SIGNALS_EVERY) {
                Ok(result) => return Ok(Some(result)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {
                    let raised = Python::attach(|py| py.check_signals().err());
                    if let Some(error) = raised {
                        is_over.store(true, Ordering::Relaxed);
                        return Err(error);
                    }
                }
            }
        }
    })?;
    match received {
        Some(result) => result.map_err(|Cut| PyKeyboardInterrupt::new_err(())),
        None => match thread.join() {
            Err(panic) => panic::resume_unwind(panic),
            Ok(()) => unreachable!("the thread ends with a result or a panic"),
        },
    }
}

/// The stack of a thread that loads a model: as much as a process has.
const STACK_BYTES: usize = 8 << 20;

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
