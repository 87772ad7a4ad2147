//! Queries for the probability of rare events: the level of states, and what splitting found.

use crate::engine::codes;
use crate::engine::loaded_model::{LoadedModel, PreparedQuery};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{FunctionId, Path, Query, QueryKind, Statistical};
use crate::stochastic::{Rare, Splitting};

impl LoadedModel {
    /// What says how near a state is to the rare event of a query, if that is wanted and the query
    /// is one for a probability.
    pub(in crate::engine) fn level(
        &mut self,
        query: &Query,
        options: &Options,
    ) -> Result<Option<FunctionId>, Rejection> {
        let (Some(wanted), QueryKind::Statistical(asked)) = (&options.rare, &query.kind) else {
            return Ok(None);
        };
        let Statistical::Probability(_, path) = &**asked else {
            return Ok(None);
        };
        let refused = |message: &str, help: &str| {
            self.refusal(codes::UNSUPPORTED_QUERY, query.span, message, help)
        };
        match path {
            Path::Always(_) => Err(refused(
                "levels lead to an event, and [] asks for none",
                "ask for the event: Pr[…](<> !p), and take 1 minus the estimate",
            )),
            Path::Formula(_) => Err(refused(
                "levels lead to a state, and whether a formula holds is seen of whole runs",
                "ask for a state: Pr[…](<> p) or Pr[…](p U q), without bounds behind them",
            )),
            _ => match self.compile_level(&wanted.levels) {
                Some(level) => Ok(Some(level)),
                None => Err(self.refusal(
                    codes::UNSUPPORTED_QUERY,
                    query.span,
                    format!("`{}` is no level", wanted.levels),
                    "write one expression of integers, doubles and clocks that says how near a \
                     state is to the event",
                )),
            },
        }
    }
}

/// How the rare event of a query is looked for, if it is.
pub(super) fn splitting_of(prepared: &PreparedQuery) -> Option<Splitting> {
    let wanted = prepared.options.rare.as_ref()?;
    Some(Splitting {
        level: prepared.level?,
        effort: wanted.effort,
        repetitions: wanted.repetitions,
    })
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
