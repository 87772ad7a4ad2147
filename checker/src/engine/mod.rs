//! The face of the engine: load a model, ask it queries, get answers.
//!
//! Everything here is a value: diagnostics, answers, traces, strategies, plans. Nothing prints, and
//! the only clock that is read is the one for the time limit and the measured seconds.

pub mod evidence;
pub mod format;
pub mod limits;

pub mod query;
pub mod session;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use crate::diagnostics::{Diagnostic, SourceMap, Span};
#[cfg(feature = "jit")]
use crate::exec::Jit;
use crate::exec::{Executor, Interpreter, RunTimeError};
use crate::ir::{Network, Overflow, QueryKind, RunTimeErrorKind, SiteId};
use crate::network::Failure;
use crate::semantics::{self, Model};
use crate::syntax::{
    self,
    ast::{QueryText, Template},
};
use crate::verify::{self, Effort};

use evidence::named_strategies::Due;
pub use evidence::named_strategies::NamedStrategy;
pub use evidence::strategy_check::Verification;
use evidence::strategy_check::{Asked, Played};
pub use limits::Limits;
pub use query::answer::{Answer, Evidence, Verdict};

use crate::game::strategy::attractor::Under;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::{Forced, Nodes, Player, Priorities};
pub use crate::search::reachability::report::MOST_THREADS;
use crate::search::reachability::report::{Manner, Order};

/// Codes of what the engine refuses to answer although the model is right.
pub mod codes {
    crate::diagnostics::codes! {
        /// A kind of query that the engine has no algorithm for.
        UNSUPPORTED_QUERY = "E0801" "unsupported-query";
        /// A construct of the model that the engine has no algorithm for.
        UNSUPPORTED_CONSTRUCT = "E0802" "unsupported-construct";
        /// Compiled code was asked for, and this build or machine has none.
        NO_COMPILED_CODE = "E0803" "no-compiled-code";
        /// A strategy is asked for whose query was not satisfied.
        NO_STRATEGY = "E0804" "no-strategy";
        /// A file of a strategy that cannot be read or written, or does not fit the model.
        STRATEGY_FILE = "E0805" "strategy-file";
    }
}

/// What runs the code of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum CodeEngine {
    /// Compiled by Cranelift.
    #[default]
    Jit,
    /// Interpreted: the reference.
    Interpreter,
}

/// Which trace to a state is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TraceWanted {
    /// The one that the search finds.
    #[default]
    Any,
    /// One with the fewest moves.
    Shortest,
    /// One that takes the least time.
    Fastest,
}

/// How a query is to be answered.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent wish")]
pub struct Options {
    /// In which order states are explored.
    pub order: Order,
    /// How many threads share the work, from 1 to [`MOST_THREADS`]. More than one share searches
    /// for a reachable state and for values, breadth first, and compute what is won in games; other
    /// searches take one.
    pub threads: usize,
    /// The rule for forced moves of the environment.
    pub forced: Forced,
    /// Whether priorities count in games and under strategies.
    pub priorities: Priorities,
    /// What the nodes of game graphs are.
    pub nodes: Nodes,
    /// What runs the code of the model.
    pub code: CodeEngine,
    /// When to give up.
    pub limits: Limits,
    /// At most how many plans are wanted; a single one is found without looking for the others.
    pub plans: Option<usize>,
    /// Whether a strategy is wanted.
    pub strategy: bool,
    /// Whether the strategy is to be checked in closed loop.
    pub verify: bool,
    /// Whether traces are to be timed exactly, and replayed.
    pub runs: bool,
    /// Where the files of `saveStrategy` and `loadStrategy` lie; `None` is the folder of the model.
    pub folder: Option<PathBuf>,
    /// Below which folders `saveStrategy` may write, beside the current one.
    pub allow_write: Vec<PathBuf>,
    /// Which trace to a state is wanted.
    pub trace: TraceWanted,
    /// Whether a certificate is wanted for the verdict that no reachable state is such.
    pub certificate: bool,
    /// What happens where results of integer arithmetic do not fit into 32 bits.
    pub overflow: Overflow,
    /// Whether a search may take states that differ only in which member of a scalar set is which
    /// for the same.
    pub symmetry: bool,
    /// Whether a search for a state need not take independent moves in every order where time
    /// stands still.
    pub partial_order: bool,
    /// Whether a search for states or values, and a game of which only the winner is asked, may
    /// take states for the same that differ only in variables that are not live.
    pub live_variables: bool,
}

impl Options {
    /// How searches are done that threads can share.
    fn manner(&self) -> Manner {
        Manner {
            order: self.order,
            threads: self.threads.clamp(1, MOST_THREADS),
        }
    }
}

impl Default for Options {
    fn default() -> Options {
        Options {
            order: Order::BreadthFirst,
            threads: 1,
            forced: Forced::default(),
            priorities: Priorities::default(),
            nodes: Nodes::default(),
            code: CodeEngine::default(),
            limits: Limits::default(),
            plans: None,
            strategy: false,
            verify: false,
            runs: false,
            folder: None,
            allow_write: Vec::new(),
            trace: TraceWanted::default(),
            certificate: false,
            overflow: Overflow::default(),
            symmetry: true,
            partial_order: true,
            live_variables: true,
        }
    }
}

/// A model or query that is not accepted: what is wrong, rendered for the user.
#[derive(Clone, Debug)]
pub struct Rejection {
    /// The diagnostics with their sources.
    pub diagnostics: Vec<Diagnostic>,
    /// One text for each diagnostic.
    pub rendered: Vec<String>,
}

impl Rejection {
    fn new(diagnostics: Vec<Diagnostic>, sources: &SourceMap) -> Rejection {
        let rendered = diagnostics
            .iter()
            .map(|diagnostic| diagnostic.render(sources))
            .collect();
        Rejection {
            diagnostics,
            rendered,
        }
    }
}

/// A model that was loaded and accepted.
pub struct LoadedModel {
    model: Model,
    sources: SourceMap,
    templates: Vec<Template>,
    /// The folder of the file.
    folder: PathBuf,
    /// The strategies that queries defined, in the order of their definition.
    strategies: Vec<NamedStrategy>,
    /// The queries of the file.
    pub queries: Vec<QueryText>,
    /// Warnings of loading the model and files of queries, rendered.
    pub warnings: Vec<String>,
    /// Seconds that loading took, compilation of code included once a query was checked.
    pub load_seconds: f64,
    code: Option<(CodeEngine, Overflow, PreparedCode)>,
}

/// The code of the model, ready to run.
enum PreparedCode {
    Interpreter(Interpreter),
    #[cfg(feature = "jit")]
    Jit(Box<Jit>),
}

impl PreparedCode {
    fn executor(&self) -> &dyn Executor {
        match self {
            PreparedCode::Interpreter(interpreter) => interpreter,
            #[cfg(feature = "jit")]
            PreparedCode::Jit(jit) => jit.as_ref(),
        }
    }
}

impl LoadedModel {
    /// Reads and checks a model. `path` names it in diagnostics.
    pub fn load(path: &str, bytes: &[u8]) -> Result<LoadedModel, Rejection> {
        let start = Instant::now();
        let mut sources = SourceMap::default();
        let prelude = syntax::prelude(&mut sources);
        let parsed = syntax::read_model(path, bytes, &mut sources);
        let mut diagnostics = parsed.diagnostics;
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Rejection::new(diagnostics, &sources));
        }
        let (model, more) = semantics::analyse(&parsed.document, &prelude, &sources);
        diagnostics.extend(more);
        let Some(model) = model else {
            return Err(Rejection::new(diagnostics, &sources));
        };
        let warnings = Rejection::new(diagnostics, &sources).rendered;
        let queries = parsed.document.queries;
        let load_seconds = start.elapsed().as_secs_f64();
        Ok(LoadedModel {
            model,
            sources,
            templates: parsed.document.templates,
            folder: Path::new(path)
                .parent()
                .map(Path::to_owned)
                .unwrap_or_default(),
            strategies: Vec::new(),
            queries,
            warnings,
            load_seconds,
            code: None,
        })
    }

    /// The network.
    pub fn network(&self) -> &Network {
        &self.model.network
    }

    /// Where a span lies, as `file:line:column`, with the text it covers.
    pub fn place(&self, span: Span) -> (String, String) {
        let source = self.sources.get(span.source);
        let position = self.sources.position(span);
        let (line, column) = (position.line, position.column);
        let place = match (&*source.path, source.place.as_str()) {
            (path, "") => format!("{path}:{line}:{column}"),
            ("", words) => format!("{words}:{line}:{column}"),
            (path, words) => format!("{path}:{line}:{column} ({words})"),
        };
        (place, self.sources.text(span).to_owned())
    }

    /// Reads the queries of a `.q` file.
    pub fn read_queries(&mut self, path: &str, bytes: &[u8]) -> Result<Vec<QueryText>, Rejection> {
        let (queries, diagnostics) = syntax::read_queries(path, bytes, &mut self.sources);
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Rejection::new(diagnostics, &self.sources));
        }
        let warnings = Rejection::new(diagnostics, &self.sources).rendered;
        self.warnings.extend(warnings);
        Ok(queries)
    }

    /// A query given as text.
    pub fn add_query(&mut self, text: &str) -> QueryText {
        let span = syntax::add_query_text(text, &mut self.sources);
        QueryText {
            span,
            text: text.trim().to_owned(),
            comment: String::new(),
            expect: None,
        }
    }

    /// Answers a query.
    pub fn check(&mut self, text: &QueryText, options: &Options) -> Result<Answer, Rejection> {
        let before = std::mem::replace(&mut self.model.network.overflow, options.overflow);
        let answer = self.check_it(text, options);
        self.model.network.overflow = before;
        answer
    }

    fn check_it(&mut self, text: &QueryText, options: &Options) -> Result<Answer, Rejection> {
        let start = Instant::now();
        let (query, warnings) = self.compile(text.span)?;
        self.load_seconds += start.elapsed().as_secs_f64();
        if let Some(name) = &query.under {
            // What is supported hangs on it.
            self.existing_strategy(name, query.span, options)?;
        }
        let start = Instant::now();
        self.refuse_unsupported(&query, options.priorities)?;
        self.prepare_code(options.code, query.span)?;
        self.executor().wraps().clear();
        self.load_seconds += start.elapsed().as_secs_f64();
        let mut answer = match (&query.kind, self.constant_failure()) {
            (_, Some(failure)) => query::answer::failed(failure),
            (QueryKind::SaveStrategy { file, strategy }, None) => {
                self.save_strategy((file, strategy), query.span, options)?
            }
            (QueryKind::LoadStrategy { file }, None) => {
                let name = query.strategy.as_deref().unwrap_or_default();
                self.load_strategy((file, name), query.span, options)?
            }
            _ => self.answer(&query, options)?,
        };
        answer.wrapped = self.first_wrap();
        self.complete_failure(&query, options, &mut answer);
        answer.warnings = warnings;
        answer.load_seconds = self.load_seconds;
        Ok(answer)
    }

    /// Answers a query that is no file operation; keeps the strategy that it defines.
    fn answer(&mut self, query: &crate::ir::Query, options: &Options) -> Result<Answer, Rejection> {
        let within = match &query.under {
            None => None,
            Some(name) => {
                let strategy = self.existing_strategy(name, query.span, options)?;
                let query = self.strategy(name).map(|one| one.query.clone());
                Some(Arc::new(Under {
                    query: query.unwrap_or_default(),
                    strategy,
                }))
            }
        };
        let answer = self.answer_within(query, options, within.as_ref());
        let Some(name) = query.strategy.clone() else {
            return Ok(answer);
        };
        let text = evidence::named_strategies::unnamed(self.sources.text(query.span)).to_owned();
        // Where the query is not satisfied, the strategy is the environment's.
        let is_won = answer.verdict == Verdict::Satisfied;
        let known = is_won.then(|| answer.evidence.strategy.clone()).flatten();
        let due = (is_won && known.is_none()).then(|| {
            Box::new(Due {
                query: query.clone(),
                options: options.clone(),
                within,
            })
        });
        self.keep_strategy(NamedStrategy {
            due,
            ..NamedStrategy::new(name, text, known)
        });
        Ok(answer)
    }

    /// Answers a query that is no file operation, under this strategy.
    fn answer_within(
        &self,
        query: &crate::ir::Query,
        options: &Options,
        within: Option<&Arc<Under>>,
    ) -> Answer {
        let time_limit = within.and_then(|within| within.strategy.time_limit);
        let network = query::time_clock::with_limit(&self.model.network, time_limit);
        let under = within.map(|within| ClosedLoop::new(&network, &within.strategy));
        let subject = query::answer::Subject {
            network: &network,
            executor: self.executor(),
            under: under.as_ref(),
            within,
            priorities: options.priorities,
        };
        let mut answer = query::answer::answer(subject, query, options);
        if time_limit.is_some() && query.strategy.is_none() {
            answer.evidence.forget_last_clock();
        }
        answer
    }

    /// What runs the code of the model.
    ///
    /// # Panics
    ///
    /// If no query was checked and no simulation prepared before.
    fn executor(&self) -> &dyn Executor {
        let (_, _, code) = self
            .code
            .as_ref()
            .expect("code is prepared before it is run");
        code.executor()
    }

    /// Checks in closed loop that decisions for a control query win, wherever they come from.
    pub fn verify_strategy(
        &mut self,
        text: &QueryText,
        strategy: Played<'_>,
        rules: (Forced, Priorities),
        effort: &mut Effort<'_>,
    ) -> Result<Verification, Rejection> {
        let (query, _) = self.compile(text.span)?;
        let network = &self.model.network;
        Ok(match Asked::of(&query.kind) {
            Some(asked) => {
                evidence::strategy_check::verify(network, asked, strategy, rules, effort)
            }
            None => Err(verify::Error::Unsupported("queries other than control")),
        })
    }

    /// Compiles a query, whose code becomes part of the network: the query, and its warnings as
    /// text.
    pub fn compile(&mut self, span: Span) -> Result<(crate::ir::Query, Vec<String>), Rejection> {
        let (parsed, mut diagnostics) = syntax::parse_query(span, &self.sources);
        if let Some(parsed) = parsed.filter(|_| !diagnostics.iter().any(Diagnostic::is_error)) {
            let names = self.strategy_names();
            let (query, more) = self.model.compile_query(&parsed, &self.sources, &names);
            diagnostics.extend(more);
            if let Some(query) = query {
                return Ok((query, Rejection::new(diagnostics, &self.sources).rendered));
            }
        }
        Err(Rejection::new(diagnostics, &self.sources))
    }

    /// Says what happens where results of integer arithmetic do not fit into 32 bits; a query has
    /// an option of its own.
    pub fn set_overflow(&mut self, overflow: Overflow) {
        self.model.network.overflow = overflow;
    }

    /// Why the model has no meaning if what does not fit is an error: a constant wrapped round.
    fn constant_failure(&self) -> Option<Failure> {
        let network = self.network();
        let site = network.wrapped_constant?;
        let kind = RunTimeErrorKind::Overflow;
        let is_error = network.overflow == Overflow::Error;
        is_error.then_some(Failure::RunTime(RunTimeError { kind, site }))
    }

    /// Where the answer to a query first wrapped round, in the order of the model, or a constant
    /// did.
    fn first_wrap(&self) -> Option<SiteId> {
        let in_constants = self.network().wrapped_constant;
        let noted = self.executor().wraps().first();
        noted.into_iter().chain(in_constants).min()
    }

    /// Makes the code of the model, or adds what queries brought since.
    pub(super) fn prepare_code(&mut self, wanted: CodeEngine, span: Span) -> Result<(), Rejection> {
        let network = &self.model.network;
        let overflow = network.overflow;
        self.code.take_if(|code| code.1 != overflow);
        let result = match (&mut self.code, wanted) {
            (Some((_, _, PreparedCode::Interpreter(interpreter))), CodeEngine::Interpreter) => {
                interpreter.extend(&network.functions, &network.constants);
                Ok(())
            }
            #[cfg(feature = "jit")]
            (Some((_, _, PreparedCode::Jit(jit))), CodeEngine::Jit) => jit
                .extend(&network.functions, &network.constants)
                .map_err(|error| error.to_string()),
            (code, CodeEngine::Interpreter) => {
                let interpreter = Interpreter::new(&network.functions, &network.constants)
                    .with_overflow(overflow);
                *code = Some((wanted, overflow, PreparedCode::Interpreter(interpreter)));
                Ok(())
            }
            #[cfg(feature = "jit")]
            (code, CodeEngine::Jit) => {
                Jit::with_overflow(&network.functions, &network.constants, overflow)
                    .map(|jit| {
                        jit.prepare(network.functions_of_edges());
                        *code = Some((wanted, overflow, PreparedCode::Jit(Box::new(jit))));
                    })
                    .map_err(|error| error.to_string())
            }
            #[cfg(not(feature = "jit"))]
            (_, CodeEngine::Jit) => Err("this build of the engine has no compiler".to_owned()),
        };
        result.map_err(|message| {
            let diagnostic = Diagnostic::new(codes::NO_COMPILED_CODE, span, message)
                .help("use the interpreter: --engine interpreter");
            Rejection::new(vec![diagnostic], &self.sources)
        })
    }

    /// Names what makes a game under a strategy one that there is no algorithm for.
    fn unsupported_under(&self, query: &crate::ir::Query) -> Option<&'static str> {
        let QueryKind::Control {
            cooperative,
            time_optimal,
            observations,
            ..
        } = &query.kind
        else {
            return None;
        };
        let named = self.strategy(query.under.as_deref()?)?;
        let strategy = named.strategy.as_ref()?;
        if *cooperative || time_optimal.is_some() {
            Some("E<> control: and control_t* under a strategy")
        } else if observations.is_some() {
            Some("games under partial observation and a strategy")
        } else if strategy.owner == Player::Environment {
            Some("games under a strategy of the environment")
        } else if strategy.time_limit.is_some() {
            Some("games under a strategy within a time")
        } else {
            None
        }
    }

    /// Refuses, by name, what there is no algorithm for.
    fn refuse_unsupported(
        &self,
        query: &crate::ir::Query,
        priorities: Priorities,
    ) -> Result<(), Rejection> {
        let is_under = query.under.is_some();
        let kind = match &query.kind {
            QueryKind::Reachable(_)
            | QueryKind::Invariantly(_)
            | QueryKind::PotentiallyAlways(_)
            | QueryKind::Eventually(_)
            | QueryKind::LeadsTo(..)
            | QueryKind::Extremum { .. }
            | QueryKind::SaveStrategy { .. }
            | QueryKind::LoadStrategy { .. } => None,
            QueryKind::Control {
                objective,
                cooperative,
                time_optimal,
                observations,
            } => query::game::unsupported_game(
                objective,
                time_optimal.is_some(),
                *cooperative,
                observations.is_some(),
            ),
        };
        let is_observed = matches!(
            query.kind,
            QueryKind::Control {
                observations: Some(_),
                ..
            }
        );
        let features = &self.model.network.features;
        let is_kept = query.strategy.is_some() && is_observed;
        let kind = kind.or(is_kept.then_some("observations and a named strategy"));
        let kind = kind.map(|kind| format!("queries with {kind}"));
        let under = self.unsupported_under(query).map(str::to_owned);
        let construct = if is_under && features.stopwatches {
            Some("stopwatches in a query under a strategy")
        } else if is_observed {
            query::partial_observation::unsupported(&self.model.network, priorities)
        } else if !features.clock_guarded_urgent {
            None
        } else if features.stopwatches {
            Some("clock guards on edges of urgent channels together with stopwatches")
        } else {
            None
        };
        let is_for_under = kind.is_none() && !is_observed;
        let diagnostic = if let Some(kind) = kind.or(under) {
            Diagnostic::new(
                codes::UNSUPPORTED_QUERY,
                query.span,
                format!("{kind} are not supported"),
            )
            .help(if is_for_under {
                "supported under a strategy are control: with every objective, and E<>, A[], E[], A<>, -->, sup, inf and bounds"
            } else if is_observed {
                "supported with observations is control: without a name, with A<>, A[], A[ U ] and A[ W ]; or ask without them, for a \
                 controller that sees everything"
            } else {
                "supported are E<>, A[], E[], A<>, -->, sup, inf, bounds, control:, E<> control: and control_t*:"
            })
        } else if let Some(construct) = construct {
            Diagnostic::new(
                codes::UNSUPPORTED_CONSTRUCT,
                query.span,
                format!("the model uses {construct}, which the engine does not support"),
            )
        } else {
            return Ok(());
        };
        Err(Rejection::new(vec![diagnostic], &self.sources))
    }
}
