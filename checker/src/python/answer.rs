//! Queries are answered, and answers taken apart.

use std::sync::Arc;

use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::convert::{
    RejectedError, StepEntry, code_language, rejected, step_entry, stop_name, until_signal,
    until_signal_apart, unwritten,
};
use super::long_text::LongText;
use super::model::{BoundRow, Model, bound_rows};
use super::options;
use super::plans::Plans;
use crate::engine::evidence::strategy_check;
use crate::engine::format::{
    decisions, distribution_json, json, machine_c, machine_json, strategy_c, strategy_json,
    strategy_text, text, trajectory_json,
};
use crate::engine::query_form::unnamed;
use crate::engine::session::plan_texts::PlanTexts;
use crate::engine::{self, JointQuery, LoadedModel, Options, Rejection, Verdict, Wanted};
use crate::game::strategy::plan_list::PlanWalk;
use crate::ir::Network;
use crate::search::limits::StopReason;
use crate::stochastic::Precision;

/// So many states of a certificate are written at once.
const STATES_IN_PIECE: usize = 1_000;

/// Answers a query; `options` is an `Options` of `ntagen.checker.options`.
#[pyfunction]
pub(super) fn check(
    model: &Bound<'_, Model>,
    query: &str,
    options: &Bound<'_, PyAny>,
) -> PyResult<Answer> {
    let (options, raised) = options::read(options)?;
    let answer = answered(model, query, &options);
    if let Some(failure) = raised.failure(model.py()) {
        return Err(failure);
    }
    let answer = answer.map_err(rejected)?;
    let is_interrupted = answer.verdict == Verdict::Unknown(StopReason::Interrupted);
    if is_interrupted && answer.estimate.is_none() && answer.simulated.is_none() {
        return Err(PyKeyboardInterrupt::new_err(()));
    }
    let answer = Answer {
        model: model.clone().unbind(),
        query: query.to_owned(),
        inner: answer,
    };
    if is_interrupted {
        return Err(InterruptedError::new_err((answer,)));
    }
    Ok(answer)
}

/// Answers a query while other threads of Python run.
fn answered(
    model: &Bound<'_, Model>,
    query: &str,
    options: &Options,
) -> Result<engine::Answer, Rejection> {
    let inner = model.get();
    model.py().detach(|| {
        inner.with(|model| {
            let text = model.add_query(query);
            model.check(&text, options)
        })
    })
}

/// Makes runs of a statistical query, from number `first` on: their results, for the `run_source`
/// of whoever answers the query.
#[pyfunction]
pub(super) fn block_of_runs<'py>(
    model: &Bound<'py, Model>,
    query: &str,
    options: &Bound<'py, PyAny>,
    first: u64,
    count: u64,
) -> PyResult<Bound<'py, PyBytes>> {
    let (options, _) = options::read(options)?;
    let options = Options {
        run_source: None,
        only_runs: Some(first..first.saturating_add(count)),
        ..options
    };
    let answer = answered(model, query, &options).map_err(rejected)?;
    match answer.block {
        Some(block) => Ok(PyBytes::new(model.py(), &block)),
        None if matches!(answer.verdict, Verdict::Unknown(_)) => {
            Err(PyKeyboardInterrupt::new_err(()))
        }
        None => Err(PyValueError::new_err(format!(
            "{query}: its runs have no results to count"
        ))),
    }
}

pyo3::create_exception!(
    _checker,
    InterruptedError,
    PyKeyboardInterrupt,
    "The user interrupted random runs; `args[0]` is the answer of the runs until then."
);

/// Numbers as native doubles, one after the other.
fn doubles(py: Python<'_>, numbers: impl Iterator<Item = f64>) -> Bound<'_, PyBytes> {
    let bytes: Vec<u8> = numbers.flat_map(f64::to_ne_bytes).collect();
    PyBytes::new(py, &bytes)
}

/// Answers statistical queries from the same runs; their intervals hold together. There are options
/// for each; those of the first one count for what is no matter of statistics.
#[pyfunction]
pub(super) fn check_jointly(
    model: &Bound<'_, Model>,
    queries: Vec<String>,
    options: Vec<Bound<'_, PyAny>>,
) -> PyResult<Vec<Answer>> {
    let options = options.into_iter().map(|one| options::read(&one));
    let mut all = options.collect::<PyResult<Vec<_>>>()?;
    if all.len() != queries.len() {
        return Err(PyValueError::new_err("each query needs options"));
    }
    let precisions: Vec<Precision> = all.iter().map(|(options, _)| options.precision).collect();
    if all.is_empty() {
        return Ok(Vec::new());
    }
    let (options, _) = all.swap_remove(0);
    let inner = model.get();
    let answers = model.py().detach(|| {
        inner.with(|model| {
            let asked = queries.iter().zip(precisions);
            let asked = asked.map(|(query, precision)| JointQuery {
                text: model.add_query(query),
                precision,
            });
            let asked: Vec<JointQuery> = asked.collect();
            model.check_jointly(&asked, &options)
        })
    });
    let answers = answers.map_err(rejected)?;
    let is_interrupted = |one: &engine::Answer| {
        one.estimate.is_none() && one.verdict == Verdict::Unknown(StopReason::Interrupted)
    };
    if answers.iter().any(is_interrupted) {
        return Err(PyKeyboardInterrupt::new_err(()));
    }
    let answers = answers.into_iter().zip(queries);
    let answers = answers.map(|(inner, query)| Answer {
        model: model.clone().unbind(),
        query,
        inner,
    });
    Ok(answers.collect())
}

/// The answer to a query.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct Answer {
    pub(super) model: Py<Model>,
    pub(super) query: String,
    pub(super) inner: engine::Answer,
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

    /// The values of a query for them, or the estimate of a statistical one, as JSON; `None` for
    /// other queries.
    fn value_json(&self) -> Option<String> {
        if let Some(estimate) = &self.inner.estimate {
            return Some(json::real(estimate.value).to_string());
        }
        let values = self.inner.value.as_ref()?;
        Some(json::values(values).to_string())
    }

    /// The texts of the items of `simulate`, and how many runs it shows; `None` for other queries.
    fn shown_runs(&self) -> Option<(Vec<String>, usize)> {
        let simulated = self.inner.simulated.as_ref()?;
        Some((simulated.items.clone(), simulated.runs.len()))
    }

    /// One of the runs that `simulate` shows: its number and, of each item, the moments, each with
    /// its value behind it, as native doubles.
    fn shown_run<'py>(
        &self,
        py: Python<'py>,
        index: usize,
    ) -> Option<(u64, Vec<Bound<'py, PyBytes>>)> {
        let one = self.inner.simulated.as_ref()?.runs.get(index)?;
        let items = one.points.iter().map(|points| {
            let numbers = points.iter().flat_map(|&(time, value)| [time, value]);
            doubles(py, numbers)
        });
        Some((one.run, items.collect()))
    }

    /// The same as JSON: an object with the number and the points, by item.
    fn shown_run_json(&self, py: Python<'_>, index: usize) -> PyResult<Option<String>> {
        until_signal(py, || {
            let simulated = self.inner.simulated.as_ref()?;
            let run = simulated.runs.get(index)?;
            Some(trajectory_json::write(&simulated.items, run))
        })
    }

    /// How the values of runs are distributed, as JSON; `None` for queries whose runs have no
    /// values.
    fn distribution_json(&self) -> Option<String> {
        let values = self.inner.values_of_runs.as_ref()?;
        Some(distribution_json::write(values).to_string())
    }

    /// The values of runs in ascending order, and how often each came, as native doubles and as
    /// native unsigned integers of 64 bits; `None` for queries whose runs have no values.
    fn distribution_points<'py>(
        &self,
        py: Python<'py>,
    ) -> Option<(Bound<'py, PyBytes>, Bound<'py, PyBytes>)> {
        let points = &self.inner.values_of_runs.as_ref()?.distribution.points;
        let counts: Vec<u8> = points.iter().flat_map(|one| one.1.to_ne_bytes()).collect();
        let values = doubles(py, points.iter().map(|one| one.0));
        Some((values, PyBytes::new(py, &counts)))
    }

    /// What a statistical query found out, as JSON; `None` for other queries.
    fn estimate_json(&self) -> Option<String> {
        let estimate = self.inner.estimate.as_ref()?;
        Some(json::estimate(estimate).to_string())
    }

    /// How the best strategy was found, as JSON; `None` for other queries.
    fn optimised_json(&self) -> Option<String> {
        let optimised = self.inner.optimised.as_ref()?;
        Some(json::optimised(optimised).to_string())
    }

    /// Whether there is a shield.
    #[getter]
    fn is_shield(&self) -> bool {
        self.inner.evidence.shield.is_some()
    }

    /// The shield as a function in "c" or "python", whose names begin so; `None` without one.
    fn shield_code(
        slf: &Bound<'_, Self>,
        language: &str,
        name: String,
    ) -> PyResult<Option<String>> {
        let language = code_language(language)?;
        let Some(shield) = slf.get().inner.evidence.shield.clone() else {
            return Ok(None);
        };
        let held = slf.get().model.clone_ref(slf.py());
        let query = unnamed(&slf.get().query).to_owned();
        let written = until_signal_apart(slf.py(), move || {
            let write =
                |model: &mut LoadedModel| model.shield_code(&shield, language, &name, &query);
            held.get().with(write)
        })?;
        Ok(Some(written))
    }

    /// What is known of a shield, as JSON; `None` for other queries.
    fn shielded_json(&self) -> Option<String> {
        let shielded = self.inner.shielded.as_ref()?;
        Some(json::shielded(shielded).to_string())
    }

    /// "states", "memory" or "time" if a limit stopped the search, "interrupted" if the user ended
    /// random runs.
    #[getter]
    fn stop(&self) -> Option<&'static str> {
        match self.inner.verdict {
            Verdict::Unknown(StopReason::Interrupted) => Some("interrupted"),
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
    fn plan_count(&self) -> Option<u64> {
        Some(self.inner.evidence.plans.as_ref()?.count())
    }

    /// Whether there are more plans than were asked for.
    #[getter]
    fn has_more_plans(&self) -> bool {
        self.inner.evidence.has_more_plans
    }

    /// "states", "memory" or "time" if a limit ended the list of plans.
    #[getter]
    fn plans_stop(&self) -> Option<&'static str> {
        self.inner.evidence.plans_stop.and_then(stop_name)
    }

    /// What was wanted beside the verdict and is missing, each with the limit that came before:
    /// "states", "memory" or "time".
    #[getter]
    fn stopped(&self) -> Vec<(&'static str, Option<&'static str>)> {
        let stopped = self.inner.evidence.stopped.iter();
        stopped
            .map(|one| {
                let what = match one.what {
                    Wanted::Strategy => "strategy",
                    Wanted::Check => "check",
                    Wanted::Certificate => "certificate",
                };
                (what, stop_name(one.reason))
            })
            .collect()
    }

    /// The plans, one after the other; `None` without plans.
    fn plans(&self, py: Python<'_>) -> Option<Plans> {
        let list = self.inner.evidence.plans.as_ref()?;
        Some(Plans {
            model: self.model.clone_ref(py),
            texts: PlanTexts::new(PlanWalk::new(Arc::clone(list))),
        })
    }

    /// What stands before the plans as JSON, and what after them; `None` without plans.
    fn around_plans(&self) -> Option<(String, &'static str)> {
        let evidence = &self.inner.evidence;
        let count = evidence.plans.as_ref()?.count();
        Some(json::around_plans(
            &self.query,
            count,
            evidence.has_more_plans,
        ))
    }

    /// The traces in UPPAAL's form, with the runs with exact times; `None` without a trace.
    fn trace_text(slf: &Bound<'_, Self>) -> PyResult<Option<String>> {
        written(slf, |answer, network| {
            let witnesses = &answer.inner.evidence.witnesses;
            let texts = witnesses.iter().map(|one| text::witness_text(network, one));
            (!witnesses.is_empty()).then(|| texts.collect::<Vec<_>>().join("\n"))
        })
    }

    /// The traces as JSON; `None` without a trace.
    fn trace_json(slf: &Bound<'_, Self>) -> PyResult<Option<String>> {
        written(slf, |answer, network| {
            let witnesses = &answer.inner.evidence.witnesses;
            let write = || json::written(&json::witnesses(network, witnesses, &answer.query));
            (!witnesses.is_empty()).then(write)
        })
    }

    /// Of each trace, the zones of its states as matrices.
    fn trace_zones(&self) -> Vec<Vec<Vec<BoundRow>>> {
        let witnesses = self.inner.evidence.witnesses.iter();
        let zones = witnesses.map(|one| {
            let states = one.trace.states.iter();
            states.map(|(_, zone)| bound_rows(zone)).collect()
        });
        zones.collect()
    }

    /// How many states the certificate has; `None` without one.
    #[getter]
    fn certificate_states(&self) -> Option<usize> {
        let certificate = self.inner.evidence.certificate.as_ref()?;
        Some(certificate.state_count())
    }

    /// A piece of the file of the certificate: the first line is the piece 0. `None` without a
    /// certificate, and behind the last piece.
    fn certificate_piece(&self, py: Python<'_>, index: usize) -> PyResult<Option<String>> {
        until_signal(py, || {
            let certificate = self.inner.evidence.certificate.as_ref()?;
            let Some(before) = index.checked_sub(1) else {
                let head = |network: &Network| certificate.head(network, &self.query);
                return Some(self.with_network(head));
            };
            let first = before * STATES_IN_PIECE;
            let end = certificate.state_count().min(first + STATES_IN_PIECE);
            (first < end).then(|| certificate.lines(first..end))
        })
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
            let stopped = &mut evidence.stopped.iter();
            let stop = stopped.find(|one| one.what == Wanted::Check);
            let stop = stop.map(|one| one.reason);
            let describe = |network: &Network| strategy_check::describe(network, result, stop);
            lines.extend(self.with_network(describe));
        }
        lines
    }

    /// The strategy, or the machine of a game with observations, as JSON; `None` without any.
    fn strategy_json(slf: &Bound<'_, Self>) -> PyResult<Option<LongText>> {
        if let Some(learned) = slf.get().inner.evidence.learned.clone() {
            let held = slf.get().model.clone_ref(slf.py());
            let text = until_signal_apart(slf.py(), move || {
                held.get().with(|model| model.learned_text(&learned))
            })?;
            return Ok(Some(LongText::new(text.map_err(unwritten)?)));
        }
        if let Some(shield) = slf.get().inner.evidence.shield.clone() {
            let held = slf.get().model.clone_ref(slf.py());
            let query = unnamed(&slf.get().query).to_owned();
            let text = until_signal_apart(slf.py(), move || {
                held.get().with(|model| model.shield_text(&shield, &query))
            })?;
            return Ok(Some(LongText::new(text)));
        }
        written(slf, |answer, network| {
            let (evidence, query) = (&answer.inner.evidence, &answer.query);
            let text = if let Some(machine) = &evidence.machine {
                json::written(&machine_json::write(network, machine, query))
            } else {
                strategy_json::text(network, evidence.strategy.as_ref()?, query)
            };
            Some(LongText::new(text))
        })
    }

    /// The decisions of the strategy in which a process moves: for each the values of variables by
    /// name, and the edges; `None` without a strategy, or if a name is unknown.
    fn decisions_of(
        &self,
        py: Python<'_>,
        process: &str,
        variables: Vec<String>,
    ) -> PyResult<Option<Vec<DecisionEntry>>> {
        until_signal(py, move || {
            let strategy = self.inner.evidence.strategy.as_ref()?;
            self.with_network(|network| {
                let found = decisions::of_process(network, strategy, process, &variables)?;
                let entries = found.into_iter();
                let entries = entries.map(|one| (one.values, step_entry(network, &one.parts)));
                Some(entries.collect())
            })
        })
    }

    /// The strategy, or the machine of a game with observations, as a controller in C; `None`
    /// without any.
    fn controller_c(slf: &Bound<'_, Self>) -> PyResult<Option<String>> {
        let text = written(slf, |answer, network| {
            let (evidence, query) = (&answer.inner.evidence, &answer.query);
            match (&evidence.machine, &evidence.strategy) {
                (Some(machine), _) => Ok(Some(machine_c::write(network, machine, query))),
                (None, Some(strategy)) => strategy_c::write(network, strategy, query).map(Some),
                (None, None) => Ok(None),
            }
        })?;
        text.map_err(|reason| RejectedError::new_err((vec![format!("error: {reason}")],)))
    }

    /// The strategy as text in TIGA's form, or the machine of a game with observations; `None`
    /// without any.
    fn strategy_text(slf: &Bound<'_, Self>) -> PyResult<Option<LongText>> {
        written(slf, |answer, network| {
            let text = match &answer.inner.evidence.machine {
                Some(machine) => machine_json::text(network, machine, &answer.query),
                None => strategy_text::write(network, answer.inner.evidence.strategy.as_ref()?),
            };
            Some(LongText::new(text))
        })
    }
}

/// Writes something of an answer, perhaps something long, unless a signal comes.
fn written<T: Send + 'static>(
    answer: &Bound<'_, Answer>,
    write: impl FnOnce(&Answer, &Network) -> T + Send + 'static,
) -> PyResult<T> {
    let held = answer.clone().unbind();
    until_signal_apart(answer.py(), move || {
        let answer = held.get();
        answer.with_network(|network| write(answer, network))
    })
}

/// A decision: the values of variables, each with all elements, and the edges of its move.
type DecisionEntry = (Vec<Vec<i32>>, StepEntry);

impl Answer {
    fn with_network<T>(&self, action: impl FnOnce(&Network) -> T) -> T {
        self.model.get().with(|model| action(model.network()))
    }
}
