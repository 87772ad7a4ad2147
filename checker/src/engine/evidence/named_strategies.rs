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
use crate::engine::loaded_model::{LoadedModel, NamedStrategy, PreparedQuery};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::search::limits::Counters;
use crate::semantics::Reading;

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
        let Some(definition) = named.and_then(|one| one.definition.clone()) else {
            return Err(self.no_strategy(name, span, "its query gave none"));
        };
        match self.made_by(&definition, None, span, options)? {
            Ok(strategy) => {
                if let Some(named) = self.strategy_mut(name) {
                    named.strategy = Some(Arc::clone(&strategy));
                }
                Ok(strategy)
            }
            Err(reason) => Err(self.no_strategy(name, span, &reason)),
        }
    }

    /// Makes the strategy of a query, with the code that was wanted for it; it leaves this much to
    /// choose. An error of the inner result says why there is none; then the next use tries again.
    pub(super) fn made_by(
        &mut self,
        definition: &PreparedQuery,
        freedom: Option<Freedom>,
        span: Span,
        options: &Options,
    ) -> Result<Result<Arc<Strategy>, String>, Rejection> {
        let own = &definition.options;
        self.prepare_code(Reading::Symbolic, own.code, own.tuning, span)?;
        let is_saved = freedom.is_none();
        let with_strategy = PreparedQuery {
            options: Options {
                strategy: true,
                verify: own.verify && is_saved,
                plans: own.plans.filter(|_| is_saved),
                limits: options.limits.clone(),
                ..own.clone()
            },
            ..definition.clone()
        };
        let answer = self.answer_in_zones(&with_strategy, freedom);
        let missing = || match answer.verdict {
            Verdict::Unknown(reason) => stop_text(reason).to_owned(),
            _ => answer
                .message
                .unwrap_or_else(|| String::from("its query gave none")),
        };
        Ok(answer.evidence.strategy.ok_or_else(missing))
    }

    /// The error of a query that needs a strategy that there is not, and why.
    pub(super) fn no_strategy(&self, name: &str, span: Span, reason: &str) -> Rejection {
        let query = self.strategy(name).map_or("", |one| one.query.as_str());
        let message = format!("there is no strategy '{name}': {reason}");
        let help = format!("the query was {query}");
        self.refusal(codes::NO_STRATEGY, span, message, help)
    }

    pub(super) fn strategy_mut(&mut self, name: &str) -> Option<&mut NamedStrategy> {
        self.strategies.iter_mut().find(|one| one.name == name)
    }

    /// Answers `saveStrategy`.
    pub(crate) fn save_strategy(
        &mut self,
        file: &str,
        name: &str,
        span: Span,
        options: &Options,
    ) -> Result<Answer, Rejection> {
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
            self.refusal(codes::STRATEGY_FILE, span, message, help)
        })?;
        let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
        answer.remark(format!("strategy {name} written to {}", path.display()));
        Ok(answer)
    }

    /// Answers `strategy S = loadStrategy("file")`.
    pub(crate) fn load_strategy(
        &mut self,
        file: &str,
        name: &str,
        span: Span,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        let path = self.strategy_path(file, options);
        let bytes = strategy_place::load(&path).map_err(|refusal| {
            let Refusal { message, help } = refusal;
            self.refusal(codes::STRATEGY_FILE, span, message, help)
        })?;
        let (query, strategy) =
            strategy_json::read(self.network(), &bytes).map_err(|mismatch| {
                let message = format!("{}: {mismatch}", path.display());
                let mut diagnostic = Diagnostic::new(codes::STRATEGY_FILE, span, message);
                diagnostic.help = mismatch.help.map(str::to_owned);
                Rejection::new(vec![diagnostic], &self.sources)
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
            let help = help.unwrap_or_default();
            Rejection::without_place(format!("{path}: error[{code}]: {mismatch}{help}"))
        })
    }

    fn strategy_path(&self, file: &str, options: &Options) -> PathBuf {
        let folder = options.folder.as_deref().unwrap_or(&self.folder);
        folder.join(Path::new(file))
    }
}
