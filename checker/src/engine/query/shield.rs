//! Queries for shields.

use std::sync::Arc;
use std::time::Instant;

use super::statistical::precision_of;
use crate::engine::answer::{Answer, Shielded, Verdict};
use crate::engine::codes;
use crate::engine::format::learned_actions;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, NamedStrategy, PreparedQuery};
use crate::engine::query_form::unnamed;
use crate::engine::rejection::Rejection;
use crate::ir::{self, Axis, Seen};
use crate::search::limits::{Counters, StopReason, Watch as _};
use crate::shield::{
    BYTES_OF_CELL, Barrier, CHOICES, Facts, Grid, Left, MOST_MOVES, Made, Manner, Shield, shield,
    trial,
};
use crate::stochastic::{Behaviour, Estimate, Failure};

impl LoadedModel {
    /// Answers a query for a shield whose code is ready.
    pub(in crate::engine) fn answer_shield(
        &mut self,
        prepared: &PreparedQuery,
        asked: &ir::Shield,
    ) -> Result<Answer, Rejection> {
        let PreparedQuery { query, options, .. } = prepared;
        self.refuse_too_large(prepared, asked)?;
        let start = Instant::now();
        let behaviour = self.behaviour(None, options);
        let mut watch = LimitWatch::new(options.limits.left_since(start));
        let result = watch.bound(|watch| found(behaviour, prepared, asked, watch));
        let found = match result {
            Err((reason, counters)) => Found::Cut(reason, counters),
            Ok(Err(failure)) => {
                let answer = self.after_failure(&failure, query, &watch)?;
                let Verdict::Unknown(reason) = answer.verdict else {
                    return Ok(answer);
                };
                Found::Cut(reason, answer.counters)
            }
            Ok(Ok(found)) => found,
        };
        let (mut answer, shield) = match found {
            Found::Cut(reason, counters) => (cut(reason, counters), None),
            Found::Left(left) => return Err(self.left(prepared, asked, &left)),
            Found::Shield(answer, shield) => {
                let holds = answer.verdict == Verdict::Satisfied;
                (*answer, holds.then_some(shield))
            }
        };
        answer.measure(&watch);
        if let Some(name) = &query.strategy {
            let text = unnamed(&query.text).to_owned();
            self.keep_strategy(NamedStrategy {
                shield,
                ..NamedStrategy::new(name.clone(), text, None)
            });
        }
        Ok(answer)
    }

    /// Refuses a grid or a controller that is too large.
    fn refuse_too_large(
        &self,
        prepared: &PreparedQuery,
        asked: &ir::Shield,
    ) -> Result<(), Rejection> {
        let span = prepared.query.span;
        let grid = Grid {
            axes: asked.axes.clone(),
        };
        let cells = grid.cells();
        let bytes = cells.saturating_mul(BYTES_OF_CELL);
        let limit = prepared.options.limits.memory_bytes;
        let why = if cells > u64::from(u32::MAX) {
            Some("4,294,967,295 is the most".to_owned())
        } else {
            let least = bytes.div_ceil(1 << 20);
            let is_over = limit.is_some_and(|limit| bytes >= limit);
            is_over.then(|| format!("they take at least {least} MiB, more than is allowed"))
        };
        if let Some(why) = why {
            let message = format!("the grid has {cells} cells: {why}");
            let help = "write fewer or coarser axes, or allow more memory with --memory";
            return Err(self.refusal(codes::GRID_TOO_LARGE, span, message, help));
        }
        let moves = self.moves_of_controller().len();
        if moves > MOST_MOVES {
            let message = format!(
                "a shield tells at most {MOST_MOVES} moves of the controller apart, and here are {moves}"
            );
            let help = "use fewer controllable edges, or fewer values of `select`";
            return Err(self.refusal(codes::UNSUPPORTED_QUERY, span, message, help));
        }
        Ok(())
    }

    /// The refusal of a grid that a run leaves.
    fn left(&self, prepared: &PreparedQuery, asked: &ir::Shield, left: &Left) -> Rejection {
        let network = self.stochastic.as_ref().expect(ANALYSED).network();
        let state = |values: &[f64]| {
            let values = asked.axes.iter().zip(values);
            let texts = values.map(|(axis, value)| state_text(network, axis, *value));
            texts.collect::<Vec<String>>().join(", ")
        };
        let begin = match left.by {
            None => "a run of the model".to_owned(),
            Some(part) => {
                let texts = learned_actions::texts(network, &[part]);
                format!("a run from {} by {}", state(&left.from), texts[0])
            }
        };
        let message = format!("{begin} comes to {}, outside the grid", state(&left.to));
        let help = "write wider bounds, or say what counts outside: --out-of-bounds safe, unsafe or sample";
        self.refusal(codes::GRID_LEFT, prepared.query.span, message, help)
    }

    /// A shield, prepared for random runs.
    pub(in crate::engine) fn barrier(&self, shield: &Arc<Shield>) -> Barrier {
        Barrier::new(shield, &self.moves_of_controller())
    }
}

fn state_text(network: &ir::Network, axis: &Axis, value: f64) -> String {
    let name = &axis.feature.text;
    match axis.feature.seen {
        Seen::Location(process) => {
            let locations = &network.processes[process.0 as usize].locations;
            format!("{name} = {}", locations[value as usize].name)
        }
        _ => format!("{name} = {value}"),
    }
}

/// What the making of a shield came to, as an answer.
enum Found {
    Cut(StopReason, Counters),
    Left(Left),
    Shield(Box<Answer>, Arc<Shield>),
}

/// Makes a shield, and tries it on fresh runs.
fn found(
    behaviour: Behaviour<'_>,
    prepared: &PreparedQuery,
    asked: &ir::Shield,
    watch: &mut LimitWatch,
) -> Result<Found, Failure> {
    let options = &prepared.options;
    let precision = precision_of(behaviour, options);
    let manner = Manner {
        seed: precision.seed,
        threads: precision.threads,
    };
    let mut seen = Counters::default();
    let made = shield(behaviour, asked, options.shield, manner, |counters| {
        seen = *counters;
        watch.look(counters)
    })?;
    let (shield, facts, holds) = match made {
        Made::Left(left) => return Ok(Found::Left(left)),
        Made::Cut(reason) => {
            return Ok(Found::Cut(reason.unwrap_or_else(|| watch.stop()), seen));
        }
        Made::Shield {
            shield,
            facts,
            holds,
        } => (shield, facts, holds),
    };
    let verdict = if holds {
        Verdict::Satisfied
    } else {
        Verdict::NotSatisfied
    };
    let mut answer = Answer::new(verdict, seen);
    let mut tried = None;
    if holds {
        let alpha = precision.alpha;
        let ends = |runs| watch.ends_runs(runs);
        tried = trial(behaviour, &shield, &asked.keep, manner, alpha, ends)?;
        answer.evidence.shield = Some(Arc::clone(&shield));
    }
    answer.remark(remark(&facts, holds, tried.as_ref()));
    answer.shielded = Some(Shielded {
        facts,
        moves: shield.moves.len() as u64,
        tried,
    });
    Ok(Found::Shield(Box::new(answer), shield))
}

/// The answer if a limit came first.
fn cut(reason: StopReason, counters: Counters) -> Answer {
    let mut answer = Answer::new(Verdict::Unknown(reason), counters);
    if counters.waiting > 0 {
        let all = counters.explored + counters.waiting;
        let done = counters.explored;
        answer.remark(format!("{done} of {all} cells were sampled until then"));
    }
    answer
}

/// What is known of the shield, in words.
fn remark(facts: &Facts, holds: bool, estimate: Option<&Estimate>) -> String {
    let Facts {
        cells,
        safe_cells,
        seen_cells,
        unseen_pairs,
        stuck,
    } = facts;
    let share = 100.0 * *safe_cells as f64 / *cells as f64;
    let mut parts = vec![
        format!("{safe_cells} of {cells} cells are safe ({share:.4} %)"),
        format!("{seen_cells} have a sample with a choice"),
        format!("{unseen_pairs} pairs of a cell and a move were never seen"),
    ];
    if *stuck > 0 {
        parts.push(format!("{stuck} runs were stuck, which counts as unsafe"));
    }
    if !holds {
        let why = "runs begin in a cell that is not safe, or break the condition before a choice";
        parts.push(why.to_owned());
    }
    if let Some(Estimate {
        satisfied_runs: Some(broken),
        runs,
        lower,
        upper,
        ..
    }) = estimate
    {
        parts.push(format!(
            "of {runs} fresh runs with {CHOICES} choices {broken} broke the condition: \
             [{lower:.6}, {upper:.6}]"
        ));
    }
    parts.join("; ")
}
