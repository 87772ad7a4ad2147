//! Learned strategies and their files: saved in the form of UPPAAL, and read for this model.
//!
//! The features of a file are texts, which are compiled in the stochastic reading, as those of a
//! query are. A strategy that is read has all moves of the controller of this model, so that its
//! actions have the numbers that they would have if it had been learned here.
//!
//! An observation holds as long as the analysis of the model that it was compiled in.

use std::sync::Arc;

use serde_json::Value as Json;

use crate::diagnostics::{Diagnostic, Span};
use crate::engine::codes;
use crate::engine::format::json_reader::Mismatch;
use crate::engine::format::learned_code::{self, Language};
use crate::engine::format::{learned_actions, learned_json, text};
use crate::engine::loaded_model::{ANALYSED, LoadedModel, NamedStrategy};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Feature, FeatureTexts, Network, Observation, Part, Seen, Shape};
use crate::learning::LearnedStrategy;
use crate::semantics::Reading;
use crate::syntax;

const SEE_FEATURES: &str =
    "the names in \"statevars\" and \"pointvars\" must have a meaning in this model";

/// What the file of a learned strategy is about.
pub(super) struct Meaning {
    /// What it sees.
    observation: Arc<Observation>,
    /// All moves of the controller.
    moves: Vec<Part>,
}

impl LoadedModel {
    /// The network that learned strategies are about.
    pub(super) fn network_of_runs(&self) -> &Network {
        match &self.stochastic {
            Some(compiled) => compiled.network(),
            None => self.network(),
        }
    }

    /// A learned strategy as the text of a file.
    ///
    /// # Errors
    /// Why it cannot be written.
    pub fn learned_text(&self, strategy: &LearnedStrategy) -> Result<String, String> {
        let depth = learned_json::depth(strategy);
        if depth > learned_json::MOST_DEPTH {
            let most = learned_json::MOST_DEPTH;
            return Err(format!(
                "its trees are {depth} deep, and a file may have trees of {most} levels"
            ));
        }
        Ok(learned_json::text(self.network_of_runs(), strategy))
    }

    /// A learned strategy as a function in another language, which begins with this name.
    pub fn learned_code(
        &self,
        strategy: &LearnedStrategy,
        language: Language,
        name: &str,
        query: &str,
    ) -> String {
        let network = self.network_of_runs();
        learned_code::write(network, strategy, language, name, query)
    }

    /// The texts of all actions of the controller; the last one is to wait.
    pub(in crate::engine) fn all_actions(&self) -> Vec<String> {
        let moves = self.moves_of_controller();
        let parts: Vec<Part> = moves.iter().map(|one| one.part).collect();
        learned_actions::texts(self.network_of_runs(), &parts)
    }

    /// The texts of the actions of a learned strategy.
    pub fn learned_actions(&self, strategy: &LearnedStrategy) -> Vec<String> {
        learned_actions::texts(self.network_of_runs(), &strategy.moves)
    }

    /// What the file of a learned strategy is about in this model; the query at `span` may say what
    /// it sees.
    pub(super) fn meaning_of(
        &mut self,
        file: &Json,
        wanted: Option<&FeatureTexts>,
        span: Span,
        options: &Options,
    ) -> Result<Result<Meaning, Mismatch>, Rejection> {
        let texts = match learned_json::features(file).and_then(|texts| alike(texts, wanted)) {
            Ok(texts) => texts,
            Err(mismatch) => return Ok(Err(mismatch)),
        };
        self.expect_stochastic()?;
        let observation = match self.observation_of(&texts) {
            Ok(observation) => Arc::new(observation),
            Err(mismatch) => return Ok(Err(mismatch)),
        };
        self.prepare_code(Reading::Stochastic, options.code, options.tuning, span)?;
        let moves = self.moves_of_controller();
        Ok(Ok(Meaning {
            observation,
            moves: moves.iter().map(|one| one.part).collect(),
        }))
    }

    /// Reads the file of a learned strategy.
    pub(super) fn read_learned(
        &self,
        file: &Json,
        meaning: &Meaning,
    ) -> Result<LearnedStrategy, Mismatch> {
        let names = learned_json::Names {
            network: self.network_of_runs(),
            observation: &meaning.observation,
            moves: &meaning.moves,
        };
        learned_json::read(file, &names)
    }

    /// What the features of a file are in this model.
    pub(super) fn observation_of(&mut self, texts: &FeatureTexts) -> Result<Observation, Mismatch> {
        let mut seen = |texts: &[String], list: &str, is_discrete: bool| {
            let features = texts.iter().enumerate().map(|(index, text)| {
                self.feature_of(text, is_discrete).map_err(|why| Mismatch {
                    place: format!("{list}[{index}]"),
                    message: format!("{text} is nothing that is seen of a state: {why}"),
                    help: Some(SEE_FEATURES),
                })
            });
            features.collect::<Result<Vec<Feature>, Mismatch>>()
        };
        Ok(Observation {
            discrete: seen(&texts.discrete, "statevars", true)?,
            continuous: seen(&texts.continuous, "pointvars", false)?,
        })
    }

    /// Keeps a learned strategy of this model, which answers a query, under a name.
    pub fn keep_known(
        &mut self,
        name: &str,
        query: &str,
        learned: Arc<LearnedStrategy>,
    ) -> Result<(), Rejection> {
        self.keep_strategy(NamedStrategy {
            learned: Some(learned),
            ..NamedStrategy::new(name.to_owned(), query.to_owned(), None)
        });
        // It may have been made before the model was analysed the last time.
        self.renew_learned()
    }

    /// Compiles again what learned strategies and shields see, where the model is analysed anew:
    /// code and places of variables are others then.
    pub(in crate::engine) fn renew_learned(&mut self) -> Result<(), Rejection> {
        self.renew_policies()?;
        for index in 0..self.strategies.len() {
            if let Some(shield) = self.strategies[index].shield.take() {
                self.expect_stochastic()?;
                self.strategies[index].shield = self.renewed(&shield);
            }
            let Some(learned) = self.strategies[index].learned.take() else {
                continue;
            };
            self.expect_stochastic()?;
            let seen = self.observation_of(&learned_json::texts(&learned.observation));
            self.strategies[index].learned = seen.ok().map(|observation| {
                Arc::new(LearnedStrategy {
                    observation: Arc::new(observation),
                    ..(*learned).clone()
                })
            });
        }
        Ok(())
    }

    /// What a text stands for: an expression, or the name of a variable that no expression can be
    /// about, such as one of a scalar set.
    pub(super) fn feature_of(&mut self, text: &str, is_discrete: bool) -> Result<Feature, String> {
        let span = syntax::add_query_text(text, &mut self.sources);
        let (expr, mut found) = syntax::parse_expression(span, &self.sources);
        let compiled = self.stochastic.as_mut().expect(ANALYSED);
        let feature = expr.and_then(|expr| {
            let model = &mut compiled.model;
            let (feature, more) = model.compile_feature(&expr, &self.sources, is_discrete);
            found.extend(more);
            feature
        });
        let named = feature.or_else(|| named(compiled.network(), text));
        named.ok_or_else(|| {
            let first = found.into_iter().find(Diagnostic::is_error);
            first.map_or_else(|| String::from("it has no value"), |one| one.message)
        })
    }

    /// The refusal of a file by the query at `span`.
    pub(super) fn mismatched(&self, span: Span, path: &str, mismatch: &Mismatch) -> Rejection {
        let message = format!("{path}: {mismatch}");
        let mut diagnostic = Diagnostic::new(codes::STRATEGY_FILE, span, message);
        diagnostic.help = mismatch.help.map(str::to_owned);
        Rejection::new(vec![diagnostic], &self.sources)
    }
}

/// The variable, or the part of one, with this name.
fn named(network: &Network, text: &str) -> Option<Feature> {
    let mut found = None;
    text::for_each_place(network, |name, place| {
        if name == text {
            let word = place.offset as u32;
            let is_clock = network.chances.clocks.binary_search(&word).is_ok();
            let seen = match place.shape {
                _ if is_clock => Seen::Clock(word),
                Shape::Double => Seen::Double(word),
                _ => Seen::Integer(word),
            };
            let text = text.to_owned();
            found = Some(Feature { text, seen });
        }
    });
    found
}

/// The texts of a file if they are those of the query, up to blanks.
fn alike(texts: FeatureTexts, wanted: Option<&FeatureTexts>) -> Result<FeatureTexts, Mismatch> {
    let Some(wanted) = wanted else {
        return Ok(texts);
    };
    let lists = [
        ("statevars", &texts.discrete, &wanted.discrete),
        ("pointvars", &texts.continuous, &wanted.continuous),
    ];
    for (list, texts, wanted) in lists {
        let plain = |texts: &[String]| -> Vec<String> {
            let texts = texts.iter();
            texts
                .map(|one| learned_actions::without_blanks(one))
                .collect()
        };
        if plain(texts) != plain(wanted) {
            return Err(Mismatch {
                place: list.to_owned(),
                message: format!(
                    "the strategy of the file sees {{{}}}, and the query says {{{}}}",
                    texts.join(", "),
                    wanted.join(", ")
                ),
                help: Some("name the same features in the same order, or leave them out"),
            });
        }
    }
    Ok(texts)
}
