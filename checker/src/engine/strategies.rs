//! Strategies that have a name: what queries define, and are asked under.
//!
//! A name stays for all later queries of the same loaded model. Its strategy is missing if the query that defines it did not come
//! out satisfied; to be asked under such a name is an error.

use std::sync::Arc;

use crate::diagnostics::{Diagnostic, Span};
use crate::game::closed_loop::ClosedLoop;
use crate::game::strategy::Strategy;

use super::{LoadedModel, Rejection, codes};

/// A strategy with the query that it answers.
#[derive(Clone, Debug)]
pub struct NamedStrategy {
    /// Its name.
    pub name: String,
    /// The text of the query, without the name.
    pub query: String,
    /// `None` if the query was not satisfied.
    pub strategy: Option<Arc<Strategy>>,
}

impl LoadedModel {
    /// The names of the strategies so far.
    pub(super) fn strategy_names(&self) -> Vec<String> {
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

    /// The closed loop of a strategy that a query is asked under.
    pub(super) fn existing_strategy(
        &self,
        name: &str,
        span: Span,
    ) -> Result<Arc<Strategy>, Rejection> {
        let known = self.strategy(name);
        if let Some(strategy) = known.and_then(|one| one.strategy.clone()) {
            return Ok(strategy);
        }
        let query = known.map_or("", |one| one.query.as_str());
        let message = format!("there is no strategy '{name}': its query gave none");
        let diagnostic = Diagnostic::new(codes::NO_STRATEGY, span, message)
            .help(format!("the query was {query}"));
        Err(Rejection::new(vec![diagnostic], &self.sources))
    }

    /// What the strategy leaves of the model.
    pub(super) fn closed_loop(&self, name: &str, span: Span) -> Result<ClosedLoop, Rejection> {
        let strategy = self.existing_strategy(name, span)?;
        Ok(ClosedLoop::new(self.network(), &strategy))
    }
}
