//! What the strategy that a statistical query names allows in random runs.

use crate::diagnostics::Diagnostic;
use crate::engine::codes;
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::Network;
use crate::stochastic::{Restriction, Unfit};
use crate::syntax::ast;

impl LoadedModel {
    /// What the strategy of a statistical query allows; `stochastic` is the network in that
    /// reading. `None` if the query names none.
    pub(super) fn restriction(
        &mut self,
        query: &ast::Query,
        stochastic: &Network,
        options: &Options,
    ) -> Result<Option<Restriction>, Rejection> {
        let Some(name) = &query.under else {
            return Ok(None);
        };
        self.expect_symbolic()?;
        let strategy = self.permitted_by(&name.text, query.span, options)?.strategy;
        let readings = (self.network(), stochastic);
        let restriction = Restriction::new(readings, &strategy, options.under_choice);
        restriction.map(Some).map_err(|unfit| {
            let (message, help) = match unfit {
                Unfit::Environment => (
                    "statistical queries under a strategy of the environment are not supported",
                    "ask under one of the controller: strategy S = control: …",
                ),
                Unfit::Readings => (
                    "random runs of this model cannot follow a strategy: its readings differ",
                    "ask without `under`",
                ),
            };
            let diagnostic =
                Diagnostic::new(codes::UNSUPPORTED_QUERY, name.span, message).help(help);
            Rejection::new(vec![diagnostic], &self.sources)
        })
    }
}
