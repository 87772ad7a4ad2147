//! Queries for the probability of rare events: the level of states, and what splitting found.

use crate::diagnostics::Diagnostic;
use crate::engine::codes;
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Path, Statistical, StatisticalQuery};
use crate::semantics::Model;
use crate::stochastic::{Rare, Splitting};

impl LoadedModel {
    /// How the rare event of a query is looked for, if that is wanted and the query is one for a
    /// probability.
    pub(super) fn splitting(
        &mut self,
        model: &mut Model,
        query: &StatisticalQuery,
        options: &Options,
    ) -> Result<Option<Splitting>, Rejection> {
        let Some(wanted) = &options.rare else {
            return Ok(None);
        };
        let Statistical::Probability(_, path) = &query.kind else {
            return Ok(None);
        };
        if matches!(path, Path::Always(_)) {
            let message = "levels lead to an event, and [] asks for none";
            let help = "ask for the event: Pr[…](<> !p), and take 1 minus the estimate";
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, query.span, message).help(help);
            return Err(Rejection::new(vec![error], &self.sources));
        }
        if matches!(path, Path::Formula(_)) {
            let message =
                "levels lead to a state, and whether a formula holds is seen of whole runs";
            let help = "ask for a state: Pr[…](<> p) or Pr[…](p U q), without bounds behind them";
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, query.span, message).help(help);
            return Err(Rejection::new(vec![error], &self.sources));
        }
        // Whatever `E` can measure is a level.
        let text = self.add_query(&format!("E[<=1; 1](max: {})", wanted.levels));
        let measured = self.statistical_query(text.span);
        let measured =
            measured.and_then(|asked| model.compile_statistical(&asked, &self.sources, &[]).0);
        let Some(Statistical::Expectation { value: level, .. }) = measured.map(|one| one.kind)
        else {
            let message = format!("`{}` is no level", wanted.levels);
            let help = "write one expression of integers, doubles and clocks that says how near a \
                        state is to the event";
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, query.span, message).help(help);
            return Err(Rejection::new(vec![error], &self.sources));
        };
        Ok(Some(Splitting {
            level,
            effort: wanted.effort,
            repetitions: wanted.repetitions,
        }))
    }
}

/// What splitting did, and what it gained.
pub(super) fn splitting_remark(rare: &Rare) -> String {
    /// So many thresholds are named.
    const NAMED: usize = 6;
    let found = &rare.thresholds;
    if found.is_empty() {
        return String::from("no run came to a higher level: these are plain runs");
    }
    let named: Vec<String> = found.iter().take(NAMED).map(f64::to_string).collect();
    let more = if found.len() > NAMED { ", …" } else { "" };
    let thresholds = format!("thresholds of levels: {}{more}", named.join(", "));
    if !rare.has_reached {
        return format!(
            "{thresholds}; no repetition reached the event: more effort, or a level that leads to \
             it, may help"
        );
    }
    let (value, half) = (
        rare.estimate.value,
        rare.estimate.upper - rare.estimate.value,
    );
    // As many plain runs have this standard error, at about two of them for half a width.
    let plain = 4.0 * value * (1.0 - value) / (half * half);
    if half > 0.0 && plain.is_finite() {
        format!("{thresholds}; about {plain:.1e} plain runs would say as much")
    } else {
        thresholds
    }
}
