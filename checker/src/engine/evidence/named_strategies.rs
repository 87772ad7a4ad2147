//! Strategies that have a name: what queries define, save, load, and are asked under.
//!
//! A name stays for all later queries of the same loaded model. Its strategy is missing if the
//! query that defines it was not satisfied; a query under such a name gets an error. It is often
//! known who wins long before the whole strategy is. So a strategy that is not wanted with the
//! answer is made when it is first used. Relative names of files start at the folder that
//! [`crate::engine::Options`] names, or else at the folder of the model; `strategy_place` says
//! which files may be written.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::diagnostics::{Diagnostic, Span};
use crate::game::strategy::Strategy;
use crate::game::strategy::freedom::Freedom;

use super::strategy_place::{self, Refusal};
use crate::engine::answer::{Answer, Evidence, Verdict};
use crate::engine::codes;
use crate::engine::format::strategy_json;
use crate::engine::limits::{LimitWatch, ended_text, stop_text};
use crate::engine::loaded_model::{LoadedModel, NamedStrategy, Recipe};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::search::limits::Counters;

/// What a query asks to save or load.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrategyFile<'q> {
    /// The file, as the query names it.
    pub(crate) file: &'q str,
    /// The name of the strategy.
    pub(crate) name: &'q str,
    /// The query.
    pub(crate) span: Span,
}

impl LoadedModel {
    /// The strategy with this name, as it is saved: one move a state. If it is not made yet, it is
    /// made within these limits. `span` is the query that needs it.
    pub(crate) fn existing_strategy(
        &mut self,
        name: &str,
        span: Span,
        options: &Options,
    ) -> Result<Arc<Strategy>, Rejection> {
        let named = self.strategy(name);
        if let Some(strategy) = named.and_then(|one| one.strategy.clone()) {
            return Ok(strategy);
        }
        let Some(recipe) = named.and_then(|one| one.recipe.clone()) else {
            return Err(self.no_strategy(name, span, "its query gave none"));
        };
        match self.made_by(&recipe, None, span, options)? {
            Ok(strategy) => {
                if let Some(named) = self.strategy_mut(name) {
                    named.strategy = Some(Arc::clone(&strategy));
                }
                Ok(strategy)
            }
            Err(reason) => Err(self.no_strategy(name, span, &reason)),
        }
    }

    /// Makes a strategy that leaves this much to choose. An error of the inner result says why
    /// there is none; then the next use tries again.
    pub(super) fn made_by(
        &mut self,
        recipe: &Recipe,
        freedom: Option<Freedom>,
        span: Span,
        options: &Options,
    ) -> Result<Result<Arc<Strategy>, String>, Rejection> {
        let own = &recipe.options;
        let with_strategy = Options {
            strategy: true,
            limits: options.limits.clone(),
            ..own.clone()
        };
        let with_strategy = match freedom {
            None => with_strategy,
            Some(_) => Options {
                verify: false,
                plans: None,
                ..with_strategy
            },
        };
        let answer = self.within_rules_of(recipe, span, options, |model| {
            model.answer_leaving(
                &recipe.query,
                &with_strategy,
                recipe.within.as_ref(),
                freedom,
            )
        })?;
        let missing = || match answer.verdict {
            Verdict::Unknown(reason) => stop_text(reason).to_owned(),
            _ => answer
                .message
                .unwrap_or_else(|| String::from("its query gave none")),
        };
        Ok(answer.evidence.strategy.ok_or_else(missing))
    }

    /// Answers something with the code, and the rule for overflows, of a strategy.
    pub(super) fn within_rules_of(
        &mut self,
        recipe: &Recipe,
        span: Span,
        options: &Options,
        answer: impl FnOnce(&LoadedModel) -> Answer,
    ) -> Result<Answer, Rejection> {
        self.model.network.overflow = recipe.options.overflow;
        let prepared = self.prepare_code(recipe.options.code, recipe.options.tuning, span);
        let answer = prepared.map(|()| answer(self));
        self.model.network.overflow = options.overflow;
        answer
    }

    /// The error of a query that needs a strategy that there is not, and why.
    pub(super) fn no_strategy(&self, name: &str, span: Span, reason: &str) -> Rejection {
        let query = self.strategy(name).map_or("", |one| one.query.as_str());
        let message = format!("there is no strategy '{name}': {reason}");
        let diagnostic = Diagnostic::new(codes::NO_STRATEGY, span, message)
            .help(format!("the query was {query}"));
        Rejection::new(vec![diagnostic], &self.sources)
    }

    pub(super) fn strategy_mut(&mut self, name: &str) -> Option<&mut NamedStrategy> {
        self.strategies.iter_mut().find(|one| one.name == name)
    }

    /// Answers `saveStrategy`.
    pub(crate) fn save_strategy(
        &mut self,
        asked: StrategyFile<'_>,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        let StrategyFile { file, name, span } = asked;
        let strategy = self.existing_strategy(name, span, options)?;
        let query = self.strategy(name).map_or("", |one| one.query.as_str());
        let mut watch = LimitWatch::new(options.limits.clone());
        let text = match watch.bound(|_| strategy_json::text(self.network(), &strategy, query)) {
            Ok(text) => text,
            Err((reason, counters)) => {
                let mut answer = Answer::new(Verdict::Unknown(reason), counters);
                answer.remark(format!(
                    "writing strategy {name} was {}",
                    ended_text(reason)
                ));
                return Ok(answer);
            }
        };
        let path = self.strategy_path(file, options);
        strategy_place::save(&path, &(text + "\n"), &options.allow_write).map_err(|refusal| {
            let Refusal { message, help } = refusal;
            self.refused(codes::STRATEGY_FILE, span, message, Some(&help))
        })?;
        let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
        answer.remark(format!("strategy {name} written to {}", path.display()));
        Ok(answer)
    }

    /// Answers `strategy S = loadStrategy("file")`.
    pub(crate) fn load_strategy(
        &mut self,
        asked: StrategyFile<'_>,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        let StrategyFile { file, name, span } = asked;
        let path = self.strategy_path(file, options);
        let bytes = strategy_place::load(&path).map_err(|refusal| {
            let Refusal { message, help } = refusal;
            self.refused(codes::STRATEGY_FILE, span, message, Some(&help))
        })?;
        let (query, strategy) =
            strategy_json::read(self.network(), &bytes).map_err(|mismatch| {
                let message = format!("{}: {mismatch}", path.display());
                self.refused(codes::STRATEGY_FILE, span, message, mismatch.help)
            })?;
        let strategy = Arc::new(strategy);
        let states = strategy.states.len();
        let known = Some(Arc::clone(&strategy));
        self.keep_strategy(NamedStrategy::new(name.to_owned(), query, known));
        let evidence = Evidence {
            strategy: Some(strategy),
            ..Evidence::default()
        };
        let from = path.display();
        let message = format!("strategy {name} with {states} states read from {from}");
        Ok(Answer {
            message: Some(message),
            evidence,
            ..Answer::new(Verdict::Satisfied, Counters::default())
        })
    }

    /// Reads a strategy from the bytes of a file; gives the query that it answers, and the
    /// strategy. `path` names the file.
    pub fn read_strategy(&self, path: &str, bytes: &[u8]) -> Result<(String, Strategy), Rejection> {
        self.expect_symbolic()?;
        strategy_json::read(self.network(), bytes).map_err(|mismatch| {
            let code = codes::STRATEGY_FILE.code;
            let help = mismatch.help.map(|help| format!("\n  hint: {help}"));
            Rejection {
                diagnostics: Vec::new(),
                rendered: vec![format!(
                    "{path}: error[{code}]: {mismatch}{}",
                    help.unwrap_or_default()
                )],
            }
        })
    }

    fn refused(
        &self,
        code: crate::diagnostics::Code,
        span: Span,
        message: String,
        help: Option<&str>,
    ) -> Rejection {
        let diagnostic = Diagnostic::new(code, span, message);
        let diagnostic = match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        };
        Rejection::new(vec![diagnostic], &self.sources)
    }

    fn strategy_path(&self, file: &str, options: &Options) -> PathBuf {
        let folder = options.folder.as_deref().unwrap_or(&self.folder);
        folder.join(Path::new(file))
    }
}
