//! What the strategy that a statistical query names allows in random runs.

use crate::engine::codes;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, PreparedQuery};
use crate::engine::rejection::Rejection;
use crate::stochastic::{Restriction, Unfit};

impl LoadedModel {
    /// What the strategy of a statistical query allows; `None` if the query names none.
    pub(in crate::engine) fn restriction(
        &self,
        prepared: &PreparedQuery,
    ) -> Result<Option<Restriction>, Rejection> {
        let Some(under) = &prepared.under else {
            return Ok(None);
        };
        let stochastic = self.stochastic.as_ref().expect(ANALYSED).network();
        let (symbolic, choice) = (self.network(), prepared.options.under_choice);
        let restriction = Restriction::new(symbolic, stochastic, &under.strategy, choice);
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
            self.refusal(codes::UNSUPPORTED_QUERY, prepared.query.span, message, help)
        })
    }
}
