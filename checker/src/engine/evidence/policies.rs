//! Policies of others, which queries may name as strategies: they decide in random runs only.

use std::sync::Arc;

use crate::diagnostics::Span;
use crate::engine::codes;
use crate::engine::format::learned_json;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, NamedStrategy};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Observation, Query};
use crate::learning::{Policy, SeeingPolicy};
use crate::semantics::Reading;
use crate::syntax;

/// What a policy sees, and what it chooses from.
#[derive(Clone, Debug)]
pub struct Interface {
    /// What it sees, written `{a} -> {x}`.
    pub features: String,
    /// For how long it waits at most, if clocks are among the features.
    pub wait: Option<f64>,
    /// The texts of the actions between which it decides, if they are known: those of the model.
    pub actions: Option<Vec<String>>,
}

impl LoadedModel {
    /// Keeps a policy under a name. Returns the texts of the actions.
    pub fn keep_policy(
        &mut self,
        name: &str,
        interface: &Interface,
        policy: Arc<dyn Policy>,
    ) -> Result<Vec<String>, Rejection> {
        let wait = interface.wait;
        let span = syntax::add_query_text(&interface.features, &mut self.sources);
        self.expect_stochastic()?;
        let observation = Arc::new(self.observation_at(span)?);
        let options = Options::default();
        self.prepare_code(Reading::Stochastic, options.code, options.tuning, span)?;
        self.expect_moves(span)?;
        let actions = self.all_actions();
        if let Some(known) = &interface.actions
            && *known != actions
        {
            return Err(self.other_actions(known, &actions, span));
        }
        let Some(wait) = wait.or((!observation.has_clocks()).then_some(f64::INFINITY)) else {
            return Err(self.no_wait(span));
        };
        let policy = SeeingPolicy {
            observation,
            wait,
            policy,
        };
        self.keep_strategy(NamedStrategy {
            policy: Some(Arc::new(policy)),
            ..NamedStrategy::new(name.to_owned(), String::from("a policy"), None)
        });
        Ok(actions)
    }

    /// The refusal of a policy that decides between other actions than those of the model.
    fn other_actions(&self, known: &[String], actions: &[String], span: Span) -> Rejection {
        let differ = known.iter().zip(actions).position(|(one, own)| one != own);
        let place = differ.unwrap_or(known.len().min(actions.len()));
        let text = |list: &[String]| {
            let text = list.get(place).map(|text| format!("`{text}`"));
            text.unwrap_or_else(|| String::from("none"))
        };
        let message = format!(
            "the policy is for another model: its action {place} is {}, and that of this model {}",
            text(known),
            text(actions)
        );
        let help = "train it in an environment of this model";
        self.refusal(codes::UNSUPPORTED_QUERY, span, message, help)
    }

    /// The features at a span.
    fn observation_at(&mut self, span: Span) -> Result<Observation, Rejection> {
        let (features, mut found) = syntax::parse_features(span, &self.sources);
        let observation = features.and_then(|features| {
            let model = &mut self.stochastic.as_mut().expect(ANALYSED).model;
            let (observation, more) = model.compile_features(&features, &self.sources);
            found.extend(more);
            observation
        });
        observation.ok_or_else(|| Rejection::new(found, &self.sources))
    }

    /// Refuses a model in which the controller has nothing to decide.
    pub(in crate::engine) fn expect_moves(&self, span: Span) -> Result<(), Rejection> {
        if self.moves_of_controller().is_empty() {
            let message = "the controller has no edge, so there is nothing to decide";
            let help = "an edge is the controller's if it is written `->`, and not `-u->`";
            return Err(self.refusal(codes::UNSUPPORTED_QUERY, span, message, help));
        }
        Ok(())
    }

    /// The refusal of features with clocks where nobody says how long to wait is.
    pub(in crate::engine) fn no_wait(&self, span: Span) -> Rejection {
        let message = "a clock is seen, so it must be known how long to wait is";
        let help = "say after how many units of time it is asked again: wait=0.5";
        self.refusal(codes::UNSUPPORTED_QUERY, span, message, help)
    }

    /// The policy of this name that a query is asked under, if it is one.
    pub(in crate::engine) fn policy(
        &self,
        name: &str,
        query: &Query,
        is_symbolic: bool,
    ) -> Result<Option<Arc<SeeingPolicy>>, Rejection> {
        let policy = self.strategy(name).and_then(|one| one.policy.clone());
        if policy.is_some() && is_symbolic {
            return Err(self.only_in_runs(name, query.span));
        }
        Ok(policy)
    }

    /// The refusal of what a policy cannot do.
    pub(super) fn only_in_runs(&self, name: &str, span: Span) -> Rejection {
        let message = format!("'{name}' is a policy, which decides in random runs only");
        let help = "ask Pr, E or simulate under it";
        self.refusal(codes::UNSUPPORTED_QUERY, span, message, help)
    }

    /// Why the policy that a query is asked under has not decided.
    pub(in crate::engine) fn why_undecided(&self, query: &Query) -> String {
        let name = query.under.as_deref().unwrap_or_default();
        let policy = self.strategy(name).and_then(|one| one.policy.as_ref());
        let why = policy.map_or_else(String::new, |one| one.policy.failure());
        format!("the policy '{name}' has not decided: {why}")
    }

    /// Compiles again what policies see, where the model is analysed anew.
    pub(super) fn renew_policies(&mut self) -> Result<(), Rejection> {
        for index in 0..self.strategies.len() {
            let Some(policy) = self.strategies[index].policy.take() else {
                continue;
            };
            self.expect_stochastic()?;
            let seen = self.observation_of(&learned_json::texts(&policy.observation));
            self.strategies[index].policy = seen.ok().map(|observation| {
                Arc::new(SeeingPolicy {
                    observation: Arc::new(observation),
                    ..(*policy).clone()
                })
            });
        }
        Ok(())
    }
}
