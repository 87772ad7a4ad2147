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

use serde_json::Value as Json;

use crate::diagnostics::Span;
use crate::game::strategy::Strategy;
use crate::game::strategy::freedom::Freedom;

use super::learned_files::Meaning;
use super::shield_files::ShieldMeaning;
use super::strategy_place::{self, Refusal};
use crate::engine::answer::{Answer, Evidence, Verdict};
use crate::engine::codes;
use crate::engine::format::json_reader::Mismatch;
use crate::engine::format::{learned_json, shield_json, strategy_json};
use crate::engine::limits::{LimitWatch, ended_text, stop_text};
use crate::engine::loaded_model::{LoadedModel, NamedStrategy, PreparedQuery};
use crate::engine::options::Options;
use crate::engine::query_form::unnamed;
use crate::engine::rejection::Rejection;
use crate::ir::{FeatureTexts, Query};
use crate::learning::LearnedStrategy;
use crate::search::limits::Counters;
use crate::semantics::Reading;
use crate::shield::Shield;

/// What the file of a strategy is about.
enum FileMeaning {
    Learned(Meaning),
    Shield(ShieldMeaning),
    InZones,
}

/// What the file of a strategy has.
enum Loaded {
    Learned(Arc<LearnedStrategy>),
    Shield(Arc<Shield>),
    InZones {
        query: String,
        strategy: Arc<Strategy>,
    },
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
        if named.is_some_and(|one| one.policy.is_some()) {
            return Err(self.only_in_runs(name, span));
        }
        let Some(definition) = named.and_then(|one| one.definition.clone()) else {
            let reason = match named {
                Some(one) if one.learned.is_some() => {
                    "it is a learned one, and one of a game is needed"
                }
                Some(one) if one.shield.is_some() => "it is a shield, and one of a game is needed",
                _ => "its query gave none",
            };
            return Err(self.no_strategy(name, span, reason));
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
        let named = self.strategy(name);
        let learned = named.and_then(|one| one.learned.clone());
        let shield = named.and_then(|one| one.shield.clone());
        let known = match (&learned, &shield) {
            (None, None) => Some(self.existing_strategy(name, span, options)?),
            _ => None,
        };
        let query = self.strategy(name).map_or("", |one| one.query.as_str());
        let mut watch = LimitWatch::new(options.limits.clone());
        let written = watch.bound(|_| match (&known, &learned, &shield) {
            (Some(strategy), _, _) => Ok(strategy_json::text(self.network(), strategy, query)),
            (None, Some(learned), _) => self.learned_text(learned),
            (None, None, Some(shield)) => Ok(self.shield_text(shield, query)),
            (None, None, None) => unreachable!("there is a strategy, or an error"),
        });
        let path = self.strategy_path(file, options);
        let text = match written {
            Ok(Ok(text)) => text,
            Ok(Err(why)) => {
                let message = format!("{} cannot be written: {why}", path.display());
                let help = "learn it with fewer cells";
                return Err(self.refusal(codes::STRATEGY_FILE, span, message, help));
            }
            Err((reason, counters)) => {
                let mut answer = Answer::new(Verdict::Unknown(reason), counters);
                answer.remark(format!(
                    "writing strategy {name} was {}",
                    ended_text(reason)
                ));
                return Ok(answer);
            }
        };
        strategy_place::save(&path, &(text + "\n"), &options.allow_write).map_err(|refusal| {
            let Refusal { message, help } = refusal;
            self.refusal(codes::STRATEGY_FILE, span, message, help)
        })?;
        let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
        answer.remark(format!("strategy {name} written to {}", path.display()));
        Ok(answer)
    }

    /// Answers `strategy S = loadStrategy {d} -> {c} ("file")`.
    pub(crate) fn load_strategy(
        &mut self,
        query: &Query,
        file: &str,
        features: Option<&FeatureTexts>,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        let (name, span) = (query.strategy.as_deref().unwrap_or_default(), query.span);
        let path = self.strategy_path(file, options);
        let from = path.display().to_string();
        let bytes = strategy_place::load(&path).map_err(|refusal| {
            let Refusal { message, help } = refusal;
            self.refusal(codes::STRATEGY_FILE, span, message, help)
        })?;
        let mut watch = LimitWatch::new(options.limits.clone());
        let cut = |(reason, counters)| {
            let mut answer = Answer::new(Verdict::Unknown(reason), counters);
            let ended = ended_text(reason);
            answer.remark(format!("reading strategy {name} was {ended}"));
            Ok(answer)
        };
        let file = match watch.bound(|_| learned_json::parsed(&bytes)) {
            Ok(file) => file.map_err(|mismatch| self.mismatched(span, &from, &mismatch))?,
            Err(stopped) => return cut(stopped),
        };
        drop(bytes);
        // What is compiled for the file must not be cut off.
        let meaning = self.meaning(&file, features, span, options)?;
        let meaning = meaning.map_err(|mismatch| self.mismatched(span, &from, &mismatch))?;
        let loaded = match watch.bound(|_| self.loaded(&file, &meaning)) {
            Ok(read) => read.map_err(|mismatch| self.mismatched(span, &from, &mismatch))?,
            Err(stopped) => return cut(stopped),
        };
        let mut evidence = Evidence::default();
        let mut named = NamedStrategy::new(name.to_owned(), unnamed(&query.text).to_owned(), None);
        let what = match loaded {
            Loaded::Learned(learned) => {
                evidence.learned = Some(Arc::clone(&learned));
                let what = format!("{} leaves", learned.leaves());
                named.learned = Some(learned);
                what
            }
            Loaded::Shield(shield) => {
                evidence.shield = Some(Arc::clone(&shield));
                let what = format!("{} safe cells", shield.safe_cells());
                named.shield = Some(shield);
                what
            }
            Loaded::InZones { query, strategy } => {
                evidence.strategy = Some(Arc::clone(&strategy));
                let what = format!("{} states", strategy.states.len());
                named = NamedStrategy::new(name.to_owned(), query, Some(strategy));
                what
            }
        };
        self.keep_strategy(named);
        let message = format!("strategy {name} with {what} read from {from}");
        Ok(Answer {
            message: Some(message),
            evidence,
            ..Answer::new(Verdict::Satisfied, Counters::default())
        })
    }

    /// What the file of a strategy is about in this model.
    fn meaning(
        &mut self,
        file: &Json,
        features: Option<&FeatureTexts>,
        span: Span,
        options: &Options,
    ) -> Result<Result<FileMeaning, Mismatch>, Rejection> {
        Ok(if learned_json::is_one(file) {
            let meaning = self.meaning_of(file, features, span, options)?;
            meaning.map(FileMeaning::Learned)
        } else if shield_json::is_one(file) {
            let meaning = self.shield_meaning(file, span, options)?;
            meaning.map(FileMeaning::Shield)
        } else {
            Ok(FileMeaning::InZones)
        })
    }

    /// Reads the file of a strategy.
    fn loaded(&self, file: &Json, meaning: &FileMeaning) -> Result<Loaded, Mismatch> {
        match meaning {
            FileMeaning::Learned(meaning) => {
                let learned = self.read_learned(file, meaning)?;
                Ok(Loaded::Learned(Arc::new(learned)))
            }
            FileMeaning::Shield(meaning) => {
                let shield = self.read_shield(file, meaning)?;
                Ok(Loaded::Shield(Arc::new(shield)))
            }
            FileMeaning::InZones => self.read_zones(file),
        }
    }

    /// Reads the file of a strategy in zones. It sees the whole state, whatever features are named.
    fn read_zones(&self, file: &Json) -> Result<Loaded, Mismatch> {
        let (query, strategy) = strategy_json::read_parsed(self.network(), file)?;
        Ok(Loaded::InZones {
            query,
            strategy: Arc::new(strategy),
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
