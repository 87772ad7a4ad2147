//! A model that was loaded and accepted: its network, its texts, its code, and the strategies that
//! queries named.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::code::CompiledModel;
use super::codes;
use super::constants;
use super::options::{CodeEngine, Options};
use super::rejection::Rejection;
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span, Text};
use crate::exec::{Executor, Libraries};
use crate::game::strategy::freedom::Freedom;
use crate::game::strategy::{Strategy, Under};
use crate::ir::{FunctionId, Measure, Network, Overflow, Query};
use crate::learning::{LearnedStrategy, SeeingPolicy};
use crate::semantics::{self, FIRST_POOL, Reading};
use crate::shield::Shield;
use crate::syntax::{
    self, Parsed,
    ast::{Declaration, QueryKind, QueryText, Template},
};
use crate::tuning::Tuning;

/// What holds once something was compiled in the stochastic reading.
pub(super) const ANALYSED: &str = "the stochastic reading was analysed";

/// A model that was loaded and accepted.
pub struct LoadedModel {
    /// The model in the symbolic reading, or in the stochastic one if it has no other.
    pub(super) symbolic: CompiledModel,
    /// The model in the stochastic reading, once a statistical query was asked.
    pub(super) stochastic: Option<CompiledModel>,
    pub(super) sources: SourceMap,
    pub(super) templates: Vec<Template>,
    /// The file as the user named it.
    path: String,
    /// The text of the file.
    text: Text,
    /// The folder of the file.
    pub(super) folder: PathBuf,
    /// The strategies that queries defined, in the order of their definition.
    pub(super) strategies: Vec<NamedStrategy>,
    /// The queries of the file.
    pub queries: Vec<QueryText>,
    /// The queries of the `.q` file that was read last.
    listed: Vec<QueryText>,
    /// Warnings of loading the model and files of queries, rendered.
    pub warnings: Vec<String>,
    /// Seconds that loading took, compilation of code included once a query was checked.
    pub load_seconds: f64,
    /// Why only statistical queries can be asked, if that is so.
    symbolic_refusal: Option<Rejection>,
    /// The libraries that the model may import.
    pub(super) libraries: Libraries,
    /// How many slots dynamic templates have in the stochastic reading.
    pub(super) pool: u32,
}

impl LoadedModel {
    /// Reads and checks a model. `path` names it in diagnostics.
    pub fn load(path: &str, bytes: impl Into<Vec<u8>>) -> Result<LoadedModel, Rejection> {
        LoadedModel::load_with(path, bytes, &Libraries::default())
    }

    /// The same with the libraries that the model may import.
    pub fn load_with(
        path: &str,
        bytes: impl Into<Vec<u8>>,
        libraries: &Libraries,
    ) -> Result<LoadedModel, Rejection> {
        let start = Instant::now();
        let mut sources = SourceMap::default();
        let prelude = syntax::prelude(&mut sources);
        let parsed = syntax::read_model(path, bytes, &mut sources);
        let (mut model, found) = LoadedModel::accept(path, parsed, &prelude, sources, libraries)?;
        model.warnings = Rejection::new(found, &model.sources).rendered;
        model.load_seconds = start.elapsed().as_secs_f64();
        Ok(model)
    }

    /// Checks a model that was read: the model and its warnings.
    pub(super) fn accept(
        path: &str,
        parsed: Parsed,
        prelude: &[Declaration],
        sources: SourceMap,
        libraries: &Libraries,
    ) -> Result<(LoadedModel, Vec<Diagnostic>), Rejection> {
        let mut diagnostics = parsed.diagnostics;
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Rejection::new(diagnostics, &sources));
        }
        let analysed = |reading| {
            semantics::analyse(
                &parsed.document,
                prelude,
                &sources,
                reading,
                libraries,
                FIRST_POOL,
            )
        };
        let (mut model, more) = analysed(Reading::Symbolic);
        let mut symbolic_refusal = None;
        let errors: Vec<Diagnostic> = more.iter().filter(|one| one.is_error()).cloned().collect();
        let mut stochastic_errors = Vec::new();
        if errors.iter().any(semantics::is_symbolic) {
            let (stochastic, found) = analysed(Reading::Stochastic);
            model = stochastic;
            stochastic_errors.extend(found.into_iter().filter(Diagnostic::is_error));
        }
        let Some(model) = model else {
            if stochastic_errors.is_empty() {
                diagnostics.extend(more);
            } else {
                // Symbolic queries exclude even more; what keeps it from having any meaning counts.
                diagnostics.extend(stochastic_errors);
            }
            return Err(Rejection::new(diagnostics, &sources));
        };
        if errors.is_empty() {
            diagnostics.extend(more);
        } else {
            diagnostics.push(statistical_only(&errors[0], &sources));
            symbolic_refusal = Some(Rejection::new(errors, &sources));
        }
        let model = LoadedModel {
            symbolic: CompiledModel::new(model),
            stochastic: None,
            sources,
            templates: parsed.document.templates,
            path: path.to_owned(),
            text: parsed.text,
            folder: Path::new(path)
                .parent()
                .map(Path::to_owned)
                .unwrap_or_default(),
            strategies: Vec::new(),
            queries: parsed.document.queries,
            listed: Vec::new(),
            warnings: Vec::new(),
            load_seconds: 0.0,
            symbolic_refusal,
            libraries: libraries.clone(),
            pool: FIRST_POOL,
        };
        Ok((model, diagnostics))
    }

    /// The same model with other values of some of its constants: see [`constants::replaced`].
    pub fn with_constants(&self, values: &[(String, String)]) -> Result<LoadedModel, Rejection> {
        let text = constants::replaced(&self.path, &self.text, values)?;
        let mut model = LoadedModel::load_with(&self.path, text, &self.libraries)?;
        model.set_overflow(self.network().overflow);
        Ok(model)
    }

    /// The text of the model.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The network.
    pub fn network(&self) -> &Network {
        self.symbolic.network()
    }

    /// Whether only statistical queries can be asked of it.
    pub fn has_only_random_runs(&self) -> bool {
        self.symbolic_refusal.is_some()
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
        self.listed.clone_from(&queries);
        Ok(queries)
    }

    /// A query given as text. If a file that was read has this query, mistakes are shown there.
    pub fn add_query(&mut self, text: &str) -> QueryText {
        let words = || text.split_whitespace();
        let mut known = self.listed.iter().chain(&self.queries);
        let is_it = |one: &&QueryText| self.sources.text(one.span).split_whitespace().eq(words());
        if let Some(known) = known.find(is_it) {
            return known.clone();
        }
        let span = syntax::add_query_text(text, &mut self.sources);
        QueryText {
            span,
            text: text.trim().to_owned(),
            ..QueryText::default()
        }
    }

    /// What runs the code of the model in the symbolic reading, once it was made.
    pub(super) fn executor(&self) -> &dyn Executor {
        self.symbolic.executor()
    }

    /// The model in a reading; in the stochastic one once something was compiled in it.
    pub(super) fn compiled(&mut self, reading: Reading) -> &mut CompiledModel {
        match reading {
            Reading::Symbolic => &mut self.symbolic,
            Reading::Stochastic => self.stochastic.as_mut().expect(ANALYSED),
        }
    }

    /// Makes the code of the model in a reading, or adds what queries brought since. `span` is the
    /// query that needs it.
    pub(super) fn prepare_code(
        &mut self,
        reading: Reading,
        wanted: CodeEngine,
        tuning: Tuning,
        span: Span,
    ) -> Result<(), Rejection> {
        let prepared = self.compiled(reading).prepare(wanted, tuning);
        prepared.map_err(|message| {
            let help = "use the interpreter: --engine interpreter";
            self.refusal(codes::NO_COMPILED_CODE, span, message, help)
        })
    }

    /// The refusal of something at one place, with what to do.
    pub(super) fn refusal(
        &self,
        code: Code,
        span: Span,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Rejection {
        let diagnostic = Diagnostic::new(code, span, message).help(help);
        Rejection::new(vec![diagnostic], &self.sources)
    }

    /// Compiles a symbolic or game query, whose code becomes part of the network: the query, and
    /// its warnings as text.
    pub fn compile(&mut self, span: Span) -> Result<(Query, Vec<String>), Rejection> {
        let names = self.strategy_names();
        self.compile_in(Reading::Symbolic, span, &names)
    }

    /// The same in a reading; the query may name these strategies.
    pub(super) fn compile_in(
        &mut self,
        reading: Reading,
        span: Span,
        strategies: &[String],
    ) -> Result<(Query, Vec<String>), Rejection> {
        let (query, warnings) = self.compile_found(reading, span, strategies)?;
        Ok((query, Rejection::new(warnings, &self.sources).rendered))
    }

    /// The same with the warnings as values.
    pub(super) fn compile_found(
        &mut self,
        reading: Reading,
        span: Span,
        strategies: &[String],
    ) -> Result<(Query, Vec<Diagnostic>), Rejection> {
        let (parsed, mut diagnostics) = syntax::parse_query(span, &self.sources);
        if let Some(parsed) = parsed {
            let compiled = match reading {
                Reading::Symbolic => {
                    self.expect_symbolic()?;
                    &mut self.symbolic
                }
                Reading::Stochastic => {
                    self.expect_stochastic()?;
                    self.stochastic.as_mut().expect(ANALYSED)
                }
            };
            let model = &mut compiled.model;
            let (query, more) = model.compile_query(&parsed, &self.sources, strategies);
            diagnostics.extend(more);
            if let Some(query) = query {
                return Ok((query, diagnostics));
            }
        }
        Err(Rejection::new(diagnostics, &self.sources))
    }

    /// The guide of games, if there is one.
    pub(super) fn compile_guide(
        &mut self,
        guide: Option<&str>,
    ) -> Result<Option<FunctionId>, Rejection> {
        let Some(guide) = guide else {
            return Ok(None);
        };
        let span = syntax::add_query_text(guide, &mut self.sources);
        let (expr, mut diagnostics) = syntax::parse_expression(span, &self.sources);
        let measure = expr.and_then(|expr| {
            let model = &mut self.symbolic.model;
            let (measure, more) = model.compile_measure(&expr, &self.sources);
            diagnostics.extend(more);
            measure
        });
        match measure {
            Some(Measure::Integer(function)) => Ok(Some(function)),
            Some(Measure::Clock(_)) => Err(self.refusal(
                codes::UNSUPPORTED_QUERY,
                span,
                format!("`{guide}` is no guide"),
                "write one integer expression without clocks",
            )),
            None => Err(Rejection::new(diagnostics, &self.sources)),
        }
    }

    /// What says how near a state is to a rare event, if this is an expression that can.
    pub(super) fn compile_level(&mut self, level: &str) -> Option<FunctionId> {
        let span = syntax::add_query_text(level, &mut self.sources);
        let (expr, _) = syntax::parse_expression(span, &self.sources);
        let model = &mut self.stochastic.as_mut().expect(ANALYSED).model;
        model.compile_number(&expr?, &self.sources).0
    }

    /// The reading that a query needs.
    pub(super) fn reading_of(&self, span: Span) -> Reading {
        let (parsed, _) = syntax::parse_query(span, &self.sources);
        match parsed.map(|query| query.kind) {
            Some(QueryKind::Statistical(_) | QueryKind::Optimum(_) | QueryKind::Shield(_)) => {
                Reading::Stochastic
            }
            Some(QueryKind::SaveStrategy { .. } | QueryKind::LoadStrategy { .. })
                if self.symbolic_refusal.is_some() =>
            {
                Reading::Stochastic
            }
            _ => Reading::Symbolic,
        }
    }

    /// Refuses what needs zones if the model has a meaning in the stochastic reading only.
    pub fn expect_symbolic(&self) -> Result<(), Rejection> {
        self.symbolic_refusal.clone().map_or(Ok(()), Err)
    }

    /// Analyses the text again, when the first statistical query comes.
    pub(super) fn expect_stochastic(&mut self) -> Result<(), Rejection> {
        if self.stochastic.is_some() {
            return Ok(());
        }
        let prelude = syntax::prelude(&mut self.sources);
        let text = self.text.as_bytes().to_vec();
        let parsed = syntax::read_model(&self.path, text, &mut self.sources);
        let (model, found) = semantics::analyse(
            &parsed.document,
            &prelude,
            &self.sources,
            Reading::Stochastic,
            &self.libraries,
            self.pool,
        );
        let Some(mut model) = model else {
            let errors = found.into_iter().filter(Diagnostic::is_error).collect();
            return Err(Rejection::new(errors, &self.sources));
        };
        model.network.overflow = self.network().overflow;
        self.stochastic = Some(CompiledModel::new(model));
        Ok(())
    }

    /// Says what happens where results of integer arithmetic do not fit into 32 bits.
    pub fn set_overflow(&mut self, overflow: Overflow) {
        for compiled in self.stochastic.iter_mut().chain([&mut self.symbolic]) {
            compiled.model.network.overflow = overflow;
        }
    }

    /// The names of the strategies that exist until now.
    pub(crate) fn strategy_names(&self) -> Vec<String> {
        let names = self.strategies.iter().map(|one| one.name.clone());
        names.collect()
    }

    /// The strategy with this name, if a query defined it.
    pub fn strategy(&self, name: &str) -> Option<&NamedStrategy> {
        self.strategies.iter().find(|one| one.name == name)
    }

    /// Keeps a strategy under its name, in the place of an earlier one.
    pub fn keep_strategy(&mut self, named: NamedStrategy) {
        self.strategies.retain(|one| one.name != named.name);
        self.strategies.push(named);
    }
}

/// The warning about a model that only statistical queries can be asked of.
fn statistical_only(error: &Diagnostic, sources: &SourceMap) -> Diagnostic {
    let line = sources.position(error.span).line;
    Diagnostic::new(
        semantics::codes::STATISTICAL_ONLY,
        error.span,
        "only statistical queries can be asked of this model",
    )
    .note(format!("line {line}: {}", error.message))
    .help("ask Pr, E or simulate; or change this, to ask symbolic and game queries too")
}

/// A strategy with the query that it answers.
#[derive(Clone, Debug)]
pub struct NamedStrategy {
    /// Its name.
    pub name: String,
    /// The text of the query, without the name.
    pub query: String,
    /// `None` if the query was not satisfied, or the strategy was not made.
    pub strategy: Option<Arc<Strategy>>,
    /// The query that defines it, if the strategy is made when it is first used.
    pub(crate) definition: Option<Arc<PreparedQuery>>,
    /// What a query under it follows, once one was asked.
    pub(crate) permitted: Option<Permitted>,
    /// The strategy, if it was learned.
    pub learned: Option<Arc<LearnedStrategy>>,
    /// The policy, if somebody else decides.
    pub(crate) policy: Option<Arc<SeeingPolicy>>,
    /// The strategy that a learned one refines.
    pub(crate) within: Option<Arc<Under>>,
    /// The shield, if it is one; or the one that a learned strategy refines.
    pub(crate) shield: Option<Arc<Shield>>,
    /// The decisions of a learned strategy in zones, once a symbolic query under it was asked.
    pub(crate) in_zones: Option<Arc<Under>>,
}

/// A compiled query with all that it is answered by.
#[derive(Clone, Debug)]
pub(crate) struct PreparedQuery {
    pub(crate) query: Query,
    pub(crate) options: Options,
    /// Where a game is explored first: where the value of this function is least.
    pub(crate) guide: Option<FunctionId>,
    /// How near a state is to a rare event, as a double.
    pub(crate) level: Option<FunctionId>,
    /// What the query is asked under.
    pub(crate) under: Option<Arc<Under>>,
    /// Who decides in its runs, if it is asked under a learned strategy or a policy.
    pub(crate) decider: Option<Decider>,
    /// The shield that it is asked under, or that the learned strategy refines.
    pub(crate) shield: Option<Arc<Shield>>,
}

/// Who decides for the controller in random runs.
#[derive(Clone, Debug)]
pub(crate) enum Decider {
    Learned(Arc<LearnedStrategy>),
    Policy(Arc<SeeingPolicy>),
}

/// What a query under a strategy follows.
#[derive(Clone, Debug)]
pub(crate) struct Permitted {
    pub(crate) strategy: Arc<Strategy>,
    /// How much of the game it leaves to choose; `None` is what the strategy itself says.
    pub(crate) freedom: Option<Freedom>,
}

impl NamedStrategy {
    /// A strategy that is known, or known to be missing.
    pub fn new(name: String, query: String, strategy: Option<Arc<Strategy>>) -> NamedStrategy {
        NamedStrategy {
            name,
            query,
            strategy,
            definition: None,
            permitted: None,
            learned: None,
            policy: None,
            within: None,
            shield: None,
            in_zones: None,
        }
    }

    /// Whether it is one of a game, and neither learned, a shield nor a policy.
    pub fn is_of_game(&self) -> bool {
        self.learned.is_none() && self.shield.is_none() && self.policy.is_none()
    }
}
