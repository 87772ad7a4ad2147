//! Strategies that are followed and played against.

use std::sync::Arc;

use pyo3::exceptions::{PyIndexError, PyLookupError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::answer::Answer;
use super::convert::{FailedError, priority_rule, rejected, rules, until_signal};
use super::model::Model;
use super::options;
use crate::engine::evidence::strategy_check;
use crate::engine::format::{strategy_json, text};
use crate::engine::query::time_clock;
use crate::engine::query_form::unnamed;
use crate::engine::session::play::{self as engine, Done, Follower, Refused, Unadvised, Wait};
use crate::engine::{LoadedModel, NamedStrategy};
use crate::game::strategy::{self, Selection};
use crate::ir::Network;
use crate::verify::{self, Effort};

/// A strategy of one of the players.
#[pyclass(frozen, module = "ntagen._checker")]
pub(super) struct Strategy {
    model: Py<Model>,
    inner: Arc<Follower>,
}

impl Strategy {
    fn new(model: Py<Model>, query: String, strategy: Arc<strategy::Strategy>) -> Strategy {
        let follower = |model: &mut LoadedModel| Follower::new(model.network(), query, strategy);
        let inner = Arc::new(model.get().with(follower));
        Strategy { model, inner }
    }
}

/// What the network of a model answers; `refused` makes the exception if it does not.
fn asked<T, E>(
    model: &Py<Model>,
    ask: impl FnOnce(&Network) -> Result<T, E>,
    refused: fn(&LoadedModel, E) -> PyErr,
) -> PyResult<T> {
    let answer = |model: &mut LoadedModel| ask(model.network()).map_err(|why| refused(model, why));
    model.get().with(answer)
}

fn unadvised(model: &LoadedModel, why: Unadvised) -> PyErr {
    match why {
        Unadvised::Mismatch(mismatch) => {
            PyValueError::new_err(format!("in the {}: {}", mismatch.place, mismatch.message))
        }
        Unadvised::TooFine => {
            let most = verify::timed::MOST_TICKS_PER_UNIT;
            PyValueError::new_err(format!(
                "in the clocks: the values are no whole numbers of any part of the unit down to 1/{most}, or too large"
            ))
        }
        Unadvised::UnknownState => PyLookupError::new_err("state"),
        Unadvised::NoDecision => PyLookupError::new_err("decision"),
        Unadvised::Failed(error) => failed(model, error),
    }
}

fn object(text: &str) -> PyResult<serde_json::Value> {
    serde_json::from_str(text).map_err(|error| PyValueError::new_err(error.to_string()))
}

#[pymethods]
impl Strategy {
    /// The winner's strategy of an answer; `None` if it has none.
    #[staticmethod]
    fn of_answer(py: Python<'_>, answer: &Bound<'_, Answer>) -> Option<Strategy> {
        let answer = answer.get();
        let strategy = Arc::clone(answer.inner.evidence.strategy.as_ref()?);
        let query = unnamed(&answer.query).to_owned();
        Some(Strategy::new(answer.model.clone_ref(py), query, strategy))
    }

    /// What a query under the strategy with this name follows, made now if only its winner is known
    /// so far; `None` if no query of the model defined one. `query` is the one that needs it.
    #[staticmethod]
    fn named(
        model: &Bound<'_, Model>,
        name: &str,
        query: &str,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<Option<Strategy>> {
        let (options, raised) = options::read(options)?;
        let inner = model.get();
        let follower = model.py().detach(|| {
            inner.with(|model| {
                let Some(definition) = model.strategy(name).map(|one| one.query.clone()) else {
                    return Ok(None);
                };
                let span = model.add_query(query).span;
                let strategy = model.permitted_by(name, span, &options)?.strategy;
                let follower = Follower::new(model.network(), definition, strategy);
                Ok(Some(Arc::new(follower)))
            })
        });
        if let Some(failure) = raised.failure(model.py()) {
            return Err(failure);
        }
        let follower = follower.map_err(rejected)?;
        Ok(follower.map(|inner| Strategy {
            model: model.clone().unbind(),
            inner,
        }))
    }

    /// Whether the strategy with this name is one of a game; `None` if there is none.
    #[staticmethod]
    fn is_of_game(model: &Bound<'_, Model>, name: &str) -> Option<bool> {
        let inner = model.get();
        inner.with(|model| model.strategy(name).map(NamedStrategy::is_of_game))
    }

    /// Reads a strategy from the bytes of a file; `path` names it.
    #[staticmethod]
    fn read(model: &Bound<'_, Model>, path: &str, data: &Bound<'_, PyBytes>) -> PyResult<Strategy> {
        let inner = model.get();
        let read = inner.with(|model| model.read_strategy(path, data.as_bytes()));
        let (query, strategy) = read.map_err(rejected)?;
        Ok(Strategy::new(
            model.clone().unbind(),
            query,
            Arc::new(strategy),
        ))
    }

    /// How many states it has.
    fn __len__(&self) -> usize {
        self.inner.state_count()
    }

    /// The names of the model's processes and clocks.
    fn names(&self) -> (Vec<String>, Vec<String>) {
        self.model.get().with(|model| {
            let network = time_clock::network_of(model.network(), &self.inner.strategy);
            let processes = network.processes.iter().map(|one| one.name.clone());
            let clocks = network.clocks.iter().skip(1).map(|one| one.name.clone());
            (processes.collect(), clocks.collect())
        })
    }

    /// The query that it answers.
    #[getter]
    fn query(&self) -> &str {
        &self.inner.query
    }

    /// "controller" or "environment".
    #[getter]
    fn owner(&self) -> &'static str {
        self.inner.strategy.owner.name()
    }

    /// Whether each decision that applies is allowed, and not only the first.
    #[getter]
    fn is_permissive(&self) -> bool {
        self.inner.strategy.selection == Selection::Any
    }

    /// The strategy under which the game is played; `None` if it is under none.
    fn under(&self, py: Python<'_>) -> Option<Strategy> {
        let under = self.inner.strategy.under.as_ref()?;
        let (query, strategy) = (under.query.clone(), Arc::clone(&under.strategy));
        Some(Strategy::new(self.model.clone_ref(py), query, strategy))
    }

    /// Where play begins, as JSON: "initial", "anywhere" or the run that leads there.
    fn start_json(&self, priorities: &str) -> PyResult<String> {
        let priorities = priority_rule(priorities)?;
        let start = |network: &Network| self.inner.start(network, priorities);
        Ok(asked(&self.model, start, failed)?.to_string())
    }

    /// The time limit that it is for; `None` without one.
    #[getter]
    fn time_limit(&self) -> Option<i32> {
        self.inner.strategy.time_limit
    }

    /// The strategy as a file.
    fn json(&self) -> String {
        let (strategy, query) = (&self.inner.strategy, &self.inner.query);
        self.model
            .get()
            .with(|model| strategy_json::text(model.network(), strategy, query))
    }

    /// The entry of its file for a state, given as JSON with `locations` and `variables`.
    fn state_json(&self, state: &str) -> PyResult<String> {
        let state = object(state)?;
        let entry = |network: &Network| self.inner.state(network, &state);
        Ok(asked(&self.model, entry, unadvised)?.to_string())
    }

    /// What it says in a state, given as JSON with `clocks` too; see `engine::play`.
    fn advice_json(&self, state: &str) -> PyResult<String> {
        let state = object(state)?;
        let advice = |network: &Network| self.inner.advice(network, &state);
        Ok(asked(&self.model, advice, unadvised)?.to_string())
    }

    /// Checks it in closed loop: whether its owner wins (`None` if the check does not cover it),
    /// and what was looked at.
    fn verify(
        &self,
        py: Python<'_>,
        forced: &str,
        priorities: &str,
        states: Option<u64>,
    ) -> PyResult<(Option<bool>, Vec<String>)> {
        let rules = rules(forced, priorities)?;
        let most = states.unwrap_or(strategy_check::MOST_PARTS);
        let model = self.model.get();
        let inner = &self.inner;
        let result = until_signal(py, || {
            let effort = &mut Effort::up_to(most);
            model.with(|model| inner.verify(model, rules, effort))
        })?;
        let checked = result.map_err(rejected)?;
        Ok((checked.holds, checked.lines))
    }

    /// Lets queries of the model be asked under it by a name.
    fn keep(&self, name: &str) {
        let strategy = Some(Arc::clone(&self.inner.strategy));
        let query = self.inner.query.clone();
        self.model.get().with(|model| {
            model.keep_strategy(NamedStrategy::new(name.to_owned(), query, strategy));
        });
    }

    /// Begins a play against it.
    fn play(&self, py: Python<'_>, query: &str, forced: &str, priorities: &str) -> PyResult<Play> {
        let rules = rules(forced, priorities)?;
        let inner = self.model.get().with(|model| {
            let play = model.play(Arc::clone(&self.inner), query, rules);
            let play = play.map_err(rejected)?;
            play.map_err(|error| failed(model, error))
        })?;
        Ok(Play {
            model: self.model.clone_ref(py),
            inner,
        })
    }
}

fn failed(model: &LoadedModel, error: verify::Error) -> PyErr {
    FailedError::new_err(text::error_text(model, error))
}

fn refused(model: &LoadedModel, why: Refused) -> PyErr {
    match why {
        Refused::Impossible => PyIndexError::new_err("this is not possible now"),
        Refused::TooFine => {
            let most = verify::timed::MOST_TICKS_PER_UNIT;
            PyValueError::new_err(format!(
                "times finer than 1/{most} of the unit, or so long, cannot be waited"
            ))
        }
        Refused::Failed(error) => failed(model, error),
    }
}

/// A play against a strategy.
#[pyclass(module = "ntagen._checker")]
pub(super) struct Play {
    model: Py<Model>,
    inner: engine::Play,
}

#[pymethods]
impl Play {
    /// How many steps were made.
    #[getter]
    fn length(&self) -> usize {
        self.inner.length()
    }

    /// The state as JSON, and how many of its ticks make a unit of time.
    fn state_json(&self) -> (String, i64) {
        let model = self.model.get();
        let (state, unit) = model.with(|model| self.inner.state(model.network()));
        (state.to_string(), unit)
    }

    /// What can happen, as JSON; see `engine::play`.
    fn situation_json(&self) -> PyResult<String> {
        let situation = |network: &Network| self.inner.situation(network);
        Ok(asked(&self.model, situation, failed)?.to_string())
    }

    /// Lets a fraction of the unit pass, and then a move be made: the reply of the opponent with an
    /// index, or what a permissive strategy allows, or none.
    #[pyo3(signature = (numerator, denominator, *, reply, allowed))]
    #[pyo3(name = "pass_time")]
    fn pass(
        &mut self,
        numerator: i64,
        denominator: i64,
        reply: Option<usize>,
        allowed: Option<usize>,
    ) -> PyResult<()> {
        if numerator < 0 || denominator < 1 {
            return Err(PyIndexError::new_err("a wait is not negative"));
        }
        let done = match (reply, allowed) {
            (Some(index), _) => Done::Reply(index),
            (None, Some(index)) => Done::Allowed(index),
            (None, None) => Done::Nothing,
        };
        let wait = Wait {
            numerator,
            denominator,
        };
        let inner = &mut self.inner;
        asked(
            &self.model,
            |network| inner.pass(network, wait, done),
            refused,
        )
    }

    /// Time passes until the strategy acts, and it does.
    fn follow(&mut self) -> PyResult<()> {
        let inner = &mut self.inner;
        asked(&self.model, |network| inner.follow(network), refused)
    }

    /// Takes back steps until only this number is left.
    fn undo(&mut self, length: usize) {
        self.inner.undo(length);
    }

    /// The play as a trace; `None` if its times have no common resolution.
    fn trace_json(&self) -> PyResult<Option<String>> {
        let trace = asked(&self.model, |network| self.inner.trace(network), failed)?;
        Ok(trace.map(|trace| trace.to_string()))
    }
}
