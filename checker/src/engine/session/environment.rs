//! Random runs in which somebody outside decides for the controller, decision by decision.
//!
//! A thread of its own makes the runs, with the race of all random runs. Who decides for the
//! controller is asked inside of it: it reports what it sees, and waits there for an action. So the
//! runs are those of any other query with the same decisions.
//!
//! Invariants:
//! * Each command gets one report, unless the thread has ended.
//! * A run whose end was reported gets no more actions.

use std::mem;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use crate::cancellation;
use crate::engine::codes;
use crate::engine::format::learned_json;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, PreparedQuery};
use crate::engine::options::Options;
use crate::engine::query::libraries::Hooks;
use crate::engine::rejection::Rejection;
use crate::ir::{Aim, FeatureTexts, Observation, Optimum, QueryKind, RunLimit};
use crate::learning::{Policy, SeeingPolicy, Situation, seen_values, whole_state};
use crate::stochastic::{Behaviour, Ended, Failure, Fence, RunId, Runner, StateView};
use crate::syntax;

/// The controller waits for so many parts of the bound, if nobody says it.
const WAITS: f64 = 100.0;

/// How many slots dynamic templates have.
const POOL: u32 = 256;

/// The stack of the thread: as much as a process has.
const STACK_BYTES: usize = 8 << 20;

/// Why a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The goal is reached.
    Goal,
    /// The bound is reached.
    Bound,
}

/// A moment at which the controller decides, or the end of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// What is seen: the exact values, then those in intervals.
    pub values: Vec<f64>,
    /// For each action whether it is possible; the last one is to wait.
    pub possible: Vec<bool>,
    /// How long the run has lasted.
    pub time: f64,
    /// What the run is worth until now.
    pub worth: f64,
    /// Why the run has ended, if it has.
    pub end: Option<End>,
}

enum Command {
    Begin(RunId),
    Act(usize),
}

/// A report, or why the run has none.
pub type Reported = Result<Report, Rejection>;

/// What an environment is made of.
#[derive(Clone, Debug)]
pub struct Question {
    /// The query for the best strategy.
    pub query: String,
    /// The queries that are answered before: they define the strategies that it names.
    pub before: Vec<String>,
    /// For how long the controller waits, if it sees clocks.
    pub wait: Option<f64>,
}

/// Runs in which somebody outside decides.
#[derive(Debug)]
pub struct Environment {
    /// The texts of the actions; the last one is to wait.
    pub actions: Vec<String>,
    /// The texts of what is seen.
    pub features: FeatureTexts,
    /// Whether the greatest value is the best.
    pub is_greatest: bool,
    /// For how long the controller waits at most.
    pub wait: f64,
    commands: Sender<Command>,
    reports: Receiver<Reported>,
    is_over: Arc<AtomicBool>,
}

impl Drop for Environment {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

impl Environment {
    /// Makes the environment of a query.
    pub fn new(mut model: LoadedModel, question: &Question) -> Result<Environment, Rejection> {
        model.pool = POOL;
        let options = Options::default();
        for text in &question.before {
            let text = model.add_query(text);
            model.check(&text, &options)?;
        }
        let asked = model.question(question, &options)?;
        let (commands, commanded) = channel();
        let (reporting, reports) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let environment = Environment {
            actions: model.all_actions(),
            features: learned_json::texts(&asked.observation),
            is_greatest: asked.optimum.is_greatest,
            wait: asked.wait,
            commands,
            reports,
            is_over: Arc::clone(&is_over),
        };
        let outside = Arc::new(Outside {
            commands: Mutex::new(commanded),
            reports: reporting,
            begun: Mutex::new(None),
            aim: asked.optimum.aim,
        });
        let look: cancellation::Look = Arc::new(move |_| is_over.load(Ordering::Relaxed));
        let thread = thread::Builder::new().stack_size(STACK_BYTES);
        // Runs that are cut off because nobody waits for them have no result.
        let serve = move || cancellation::within(look, || serve(&model, asked, &outside)).ok();
        thread.spawn(serve).map_err(|error| {
            Rejection::without_place(format!("error: no thread can be started: {error}"))
        })?;
        Ok(environment)
    }

    /// Begins a run.
    pub fn begin(&self, id: RunId) {
        // Where the thread has ended, that is found when a report is awaited.
        self.commands.send(Command::Begin(id)).ok();
    }

    /// Decides.
    pub fn act(&self, action: usize) {
        self.commands.send(Command::Act(action)).ok();
    }

    /// The report on the last command, if it comes within this time.
    pub fn report(&self, patience: Duration) -> Option<Reported> {
        match self.reports.recv_timeout(patience) {
            Ok(reported) => Some(reported),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Err(Rejection::without_place(
                "error: the thread that makes the runs has ended".to_owned(),
            ))),
        }
    }
}

/// What is asked in an environment.
struct Asked {
    prepared: PreparedQuery,
    optimum: Optimum,
    observation: Arc<Observation>,
    wait: f64,
}

impl LoadedModel {
    /// The query of an environment, whose code is ready.
    fn question(&mut self, question: &Question, options: &Options) -> Result<Asked, Rejection> {
        let span = self.add_query(&question.query).span;
        let refused = |model: &LoadedModel, message: &str, help: &str| {
            Err(model.refusal(codes::UNSUPPORTED_QUERY, span, message, help))
        };
        let (parsed, _) = syntax::parse_query(span, &self.sources);
        if let Some(parsed) = &parsed {
            if !matches!(parsed.kind, syntax::ast::QueryKind::Optimum(_)) {
                return refused(
                    self,
                    "an environment is made of a query for the best strategy",
                    "write minE(price)[<=bound] {exact} -> {intervals}: <> goal, or maxE, minPr, maxPr",
                );
            }
            if parsed.strategy.is_some() {
                return refused(
                    self,
                    "the query of an environment names no strategy: none is made",
                    "leave out the name and the `=` behind it",
                );
            }
        }
        let Ok((prepared, _)) = self.make_ready(span, options)? else {
            return refused(self, "the query cannot be compiled", "ask it by itself");
        };
        let QueryKind::Optimum(optimum) = &prepared.query.kind else {
            unreachable!("it is a query for the best strategy");
        };
        self.expect_moves(span)?;
        let optimum = Optimum::clone(optimum);
        let network = self.stochastic.as_ref().expect(ANALYSED).network();
        let features = optimum.features.clone();
        let observation = features.unwrap_or_else(|| whole_state(network, &optimum));
        let wait = question
            .wait
            .or_else(|| fitting_wait(&optimum, &observation));
        Ok(Asked {
            prepared,
            optimum,
            observation: Arc::new(observation),
            wait: wait.ok_or_else(|| self.no_wait(span))?,
        })
    }
}

/// For how long the controller waits if nobody says it; none if that cannot be told.
fn fitting_wait(optimum: &Optimum, observation: &Observation) -> Option<f64> {
    let wait = match optimum.bound.limit {
        _ if !observation.has_clocks() => f64::INFINITY,
        RunLimit::Time | RunLimit::Clock(_) => optimum.bound.value / WAITS,
        RunLimit::Moves => return None,
    };
    (wait > 0.0).then_some(wait)
}

/// Who decides outside: as the thread that makes runs sees it.
struct Outside {
    commands: Mutex<Receiver<Command>>,
    reports: Sender<Reported>,
    /// The run that was begun while another one was not at its end.
    begun: Mutex<Option<RunId>>,
    aim: Aim,
}

impl Outside {
    fn next_command(&self) -> Option<Command> {
        let commands = self.commands.lock();
        commands.unwrap_or_else(PoisonError::into_inner).recv().ok()
    }

    fn take_begun(&self) -> Option<RunId> {
        let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
        begun.take()
    }

    /// The run that is to be made next; none if there will be none.
    fn next_run(&self) -> Option<RunId> {
        loop {
            match self.next_command()? {
                Command::Begin(id) => return Some(id),
                Command::Act(_) => {}
            }
        }
    }
}

impl Policy for Outside {
    fn decide(
        &self,
        state: &mut StateView<'_>,
        situation: Situation<'_>,
    ) -> Result<usize, Failure> {
        let report = Report {
            values: situation.values.to_vec(),
            possible: situation.possible.to_vec(),
            time: situation.time,
            worth: finite(state.worth(self.aim, situation.time)?)?,
            end: None,
        };
        self.reports.send(Ok(report)).ok();
        match self.next_command() {
            Some(Command::Act(action)) => Ok(action),
            Some(Command::Begin(id)) => {
                let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
                *begun = Some(id);
                Err(Failure::NoDecision)
            }
            None => Err(Failure::NoDecision),
        }
    }

    fn failure(&self) -> String {
        "nobody decides any more".to_owned()
    }
}

fn finite(value: f64) -> Result<f64, Failure> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Failure::NoNumber)
    }
}

/// Makes runs as long as somebody begins them.
fn serve(model: &LoadedModel, asked: Asked, outside: &Arc<Outside>) {
    let Asked {
        prepared,
        optimum,
        observation,
        wait,
    } = asked;
    let restriction = match model.restriction(&prepared) {
        Ok(restriction) => restriction,
        Err(rejection) => {
            outside.reports.send(Err(rejection)).ok();
            return;
        }
    };
    let policy = Arc::new(SeeingPolicy {
        observation: Arc::clone(&observation),
        wait,
        policy: Arc::clone(outside) as Arc<dyn Policy>,
    });
    let moves = model.moves_of_controller();
    let guidance = policy.followed(&moves);
    let barrier = prepared.shield.as_ref().map(|one| model.barrier(one));
    let behaviour = Behaviour {
        guidance: Some(&guidance),
        fence: barrier.as_ref().map(|one| one as &dyn Fence),
        ..model.behaviour(restriction.as_ref(), &prepared.options)
    };
    let _hooks = Hooks::new(behaviour.network);
    let mut runner = Runner::of(behaviour);
    let mut next = None;
    while let Some(id) = mem::take(&mut next).or_else(|| outside.next_run()) {
        let see = |state: &mut StateView<'_>| seen_values(&observation, state);
        let reported = match runner.to_end(id, &optimum, see).and_then(|end| {
            finite(end.value)?;
            Ok(end)
        }) {
            Ok(end) => Ok(last_report(end, moves.len())),
            Err(Failure::NoDecision) => {
                next = outside.take_begun();
                continue;
            }
            Err(failure) => Err(model.run_fails(&failure, &prepared.query)),
        };
        outside.reports.send(reported).ok();
    }
}

/// The report of the end of a run.
fn last_report(end: Ended<Vec<f64>>, moves: usize) -> Report {
    let Ended {
        is_reached,
        value,
        time,
        seen,
    } = end;
    let mut possible = vec![false; moves];
    possible.push(true);
    Report {
        values: seen,
        possible,
        time,
        worth: value,
        end: Some(if is_reached { End::Goal } else { End::Bound }),
    }
}
