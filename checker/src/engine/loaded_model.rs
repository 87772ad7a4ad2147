//! A model that was loaded and accepted: its network, its texts, its code, and the strategies that
//! queries named.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::code::PreparedCode;
use super::codes;
use super::constants;
use super::options::{CodeEngine, Options};
use super::rejection::Rejection;
use crate::diagnostics::{Diagnostic, SourceMap, Span, Text};
use crate::exec::{Executor, Libraries};
use crate::game::strategy::freedom::Freedom;
use crate::game::strategy::{Strategy, Under};
use crate::ir::{Network, Overflow, Query};
use crate::semantics::{self, FIRST_POOL, Model, Reading};
use crate::syntax::{
    self,
    ast::{QueryText, Template},
};
use crate::tuning::Tuning;

/// A model that was loaded and accepted.
pub struct LoadedModel {
    pub(super) model: Model,
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
    code: Option<PreparedCode>,
    /// Why only statistical queries can be asked, if that is so; `model` is then in the stochastic
    /// reading too.
    symbolic_refusal: Option<Rejection>,
    /// The libraries that the model may import.
    pub(super) libraries: Libraries,
    /// How many slots dynamic templates have in the stochastic reading.
    pub(super) pool: u32,
    /// The model in the stochastic reading, once a statistical query was asked.
    pub(super) stochastic: Option<StochasticModel>,
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
        let mut diagnostics = parsed.diagnostics;
        if diagnostics.iter().any(Diagnostic::is_error) {
            return Err(Rejection::new(diagnostics, &sources));
        }
        let analysed = |reading| {
            semantics::analyse_with(
                &parsed.document,
                &prelude,
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
        let warnings = Rejection::new(diagnostics, &sources).rendered;
        let queries = parsed.document.queries;
        let load_seconds = start.elapsed().as_secs_f64();
        Ok(LoadedModel {
            model,
            sources,
            templates: parsed.document.templates,
            path: path.to_owned(),
            text: parsed.text,
            folder: Path::new(path)
                .parent()
                .map(Path::to_owned)
                .unwrap_or_default(),
            strategies: Vec::new(),
            queries,
            listed: Vec::new(),
            warnings,
            load_seconds,
            code: None,
            symbolic_refusal,
            libraries: libraries.clone(),
            pool: FIRST_POOL,
            stochastic: None,
        })
    }

    /// The same model with other values of some of its constants: see [`constants::replaced`].
    pub fn with_constants(&self, values: &[(String, String)]) -> Result<LoadedModel, Rejection> {
        let text = constants::replaced(&self.path, &self.text, values)?;
        let mut model = LoadedModel::load_with(&self.path, text, &self.libraries)?;
        model.set_overflow(self.model.network.overflow);
        Ok(model)
    }

    /// The text of the model.
    pub fn text(&self) -> &str {
        &self.text
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
            comment: String::new(),
            expect: None,
            options: Vec::new(),
        }
    }

    /// What runs the code of the model.
    ///
    /// # Panics
    ///
    /// If no query was checked and no simulation prepared before.
    pub(super) fn executor(&self) -> &dyn Executor {
        let code = self.code.as_ref();
        code.expect("code is prepared before it is run").executor()
    }

    /// Makes the code of the model, or adds what queries brought since.
    pub(super) fn prepare_code(
        &mut self,
        wanted: CodeEngine,
        tuning: Tuning,
        span: Span,
    ) -> Result<(), Rejection> {
        let network = &self.model.network;
        PreparedCode::prepare(&mut self.code, network, wanted, tuning).map_err(|message| {
            let diagnostic = Diagnostic::new(codes::NO_COMPILED_CODE, span, message)
                .help("use the interpreter: --engine interpreter");
            Rejection::new(vec![diagnostic], &self.sources)
        })
    }

    /// Forgets the code of the model, which may be half made.
    pub(super) fn forget_code(&mut self) {
        self.code = None;
    }

    /// Compiles a query, whose code becomes part of the network: the query, and its warnings as
    /// text.
    pub fn compile(&mut self, span: Span) -> Result<(Query, Vec<String>), Rejection> {
        let (parsed, mut diagnostics) = syntax::parse_query(span, &self.sources);
        if let Some(parsed) = parsed.filter(|_| !diagnostics.iter().any(Diagnostic::is_error)) {
            self.expect_symbolic()?;
            let names = self.strategy_names();
            let (query, more) = self.model.compile_query(&parsed, &self.sources, &names);
            diagnostics.extend(more);
            if let Some(query) = query {
                return Ok((query, Rejection::new(diagnostics, &self.sources).rendered));
            }
        }
        Err(Rejection::new(diagnostics, &self.sources))
    }

    /// Refuses what needs zones if the model has a meaning in the stochastic reading only.
    pub fn expect_symbolic(&self) -> Result<(), Rejection> {
        self.symbolic_refusal.clone().map_or(Ok(()), Err)
    }

    /// The model in the stochastic reading: the text is analysed again when the first statistical
    /// query comes.
    pub(super) fn stochastic(&mut self) -> Result<&mut StochasticModel, Rejection> {
        if self.stochastic.is_none() {
            let prelude = syntax::prelude(&mut self.sources);
            let text = self.text.as_bytes().to_vec();
            let parsed = syntax::read_model(&self.path, text, &mut self.sources);
            let (model, found) = semantics::analyse_with(
                &parsed.document,
                &prelude,
                &self.sources,
                Reading::Stochastic,
                &self.libraries,
                self.pool,
            );
            let Some(model) = model else {
                let errors = found.into_iter().filter(Diagnostic::is_error).collect();
                return Err(Rejection::new(errors, &self.sources));
            };
            self.stochastic = Some(StochasticModel { model, code: None });
        }
        Ok(self.stochastic.as_mut().expect("it was just made"))
    }

    /// Says what happens where results of integer arithmetic do not fit into 32 bits; a query has
    /// an option of its own.
    pub fn set_overflow(&mut self, overflow: Overflow) {
        self.model.network.overflow = overflow;
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

/// A model in the stochastic reading.
pub(super) struct StochasticModel {
    pub(super) model: Model,
    pub(super) code: Option<PreparedCode>,
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
    /// How it is made when it is first used, and what it leaves to choose.
    pub(crate) recipe: Option<Arc<Recipe>>,
    /// What a query under it follows, once one was asked.
    pub(crate) permitted: Option<Permitted>,
}

/// How a strategy is made.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    pub(crate) query: Query,
    pub(crate) options: Options,
    /// What the query is asked under.
    pub(crate) within: Option<Arc<Under>>,
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
            recipe: None,
            permitted: None,
        }
    }
}
