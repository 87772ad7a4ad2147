//! Statistical queries that are answered together: those with the same bound share their runs, and
//! all intervals hold together.

use std::time::Instant;

use super::prepared::{begin_libraries, without_runs};
use super::statistical::{remark, verdict};
use crate::diagnostics::Diagnostic;
use crate::engine::answer::Answer;
use crate::engine::codes;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{LoadedModel, StochasticModel};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Statistical, StatisticalQuery};
use crate::search::limits::{Counters, Watch as _};
use crate::stochastic::{Behaviour, Estimate, Precision, bound_of, estimate_jointly};
use crate::syntax::ast::QueryText;

impl LoadedModel {
    /// Answers queries for probabilities and means from the same runs.
    pub fn check_jointly(
        &mut self,
        queries: &[QueryText],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        let asked = |query: &QueryText| (query.clone(), options.precision);
        let queries: Vec<(QueryText, Precision)> = queries.iter().map(asked).collect();
        self.check_each_jointly(&queries, options)
    }

    /// The same with what is asked of each query, in place of what `options` say of precision.
    pub fn check_each_jointly(
        &mut self,
        queries: &[(QueryText, Precision)],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        self.in_stochastic_reading(options, |kept, stochastic| {
            kept.joint_answers(stochastic, queries, options)
        })
    }

    fn joint_answers(
        &mut self,
        stochastic: &mut StochasticModel,
        queries: &[(QueryText, Precision)],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        let start = Instant::now();
        let mut compiled = Vec::new();
        let mut warnings = Vec::new();
        for (text, precision) in queries {
            let alone = Options {
                precision: *precision,
                ..options.clone()
            };
            let (query, found) = self.joint_query(stochastic, text, &alone)?;
            compiled.push(query);
            warnings.push(found);
        }
        let Some(first) = compiled.first() else {
            return Ok(Vec::new());
        };
        self.prepare_stochastic(stochastic, (first.span, start), options)?;
        let network = &stochastic.model.network;
        let behaviour = stochastic.behaviour(None, options);
        let threads = stochastic.precision(options).threads;
        let count = compiled.len() as f64;
        let alone = |precision: &Precision| Precision {
            alpha: precision.alpha / count,
            beta: precision.beta / count,
            threads,
            ..*precision
        };
        let precisions: Vec<Precision> = queries.iter().map(|(_, asked)| alone(asked)).collect();
        let start = Instant::now();
        let mut watch = LimitWatch::new(options.limits.clone());
        let kinds: Vec<&Statistical> = compiled.iter().map(|query| &query.kind).collect();
        // The first query of the group whose runs are made.
        let mut at_hand = 0;
        let result = watch.bound(|watch| {
            let _hooks = begin_libraries(behaviour, &kinds, precisions[0].seed)?;
            let mut estimates: Vec<Option<Estimate>> = vec![None; compiled.len()];
            for group in same_runs(&compiled, &precisions) {
                at_hand = group[0];
                let asked: Vec<(&Statistical, Precision)> =
                    group.iter().map(|&i| (kinds[i], precisions[i])).collect();
                let behaviour = Behaviour {
                    fixed_step: precisions[at_hand].discretisation,
                    ..behaviour
                };
                let ends = |runs| {
                    let counters = Counters {
                        explored: runs,
                        ..Counters::default()
                    };
                    watch.look(&counters).is_some()
                };
                let found = estimate_jointly(behaviour, &asked, ends)?;
                for (&index, estimate) in group.iter().zip(found) {
                    estimates[index] = Some(estimate);
                }
            }
            Ok(estimates)
        });
        let unknown = |answer: Answer| Ok(vec![answer; queries.len()]);
        let estimates = match result {
            Err((reason, counters)) => return unknown(without_runs(reason, counters)),
            Ok(Err(failure)) => {
                let failed = (&failure, &compiled[at_hand]);
                let verdict = self.after_failure(network, failed, &watch)?;
                return unknown(Answer::new(verdict, Counters::default()));
            }
            Ok(Ok(estimates)) => estimates,
        };
        let seconds = start.elapsed().as_secs_f64();
        let together = together(&precisions);
        let parts = compiled.iter().zip(estimates).zip(warnings);
        let answers = parts.map(|((query, estimate), warnings)| {
            let verdict = verdict(&query.kind, estimate.as_ref(), &watch);
            let mut answer = Answer::new(verdict, Counters::default());
            let method = estimate.as_ref().map(|estimate| estimate.method);
            if let Some(remark) = remark(&query.kind, verdict, method) {
                answer.remark(remark);
            }
            if let Some(together) = &together {
                answer.remark(together);
            }
            answer.estimate = estimate;
            answer.seconds = seconds;
            answer.load_seconds = self.load_seconds;
            answer.warnings = warnings;
            answer
        });
        Ok(answers.collect())
    }

    /// A query that can be answered together with others, and warnings about it.
    fn joint_query(
        &self,
        stochastic: &mut StochasticModel,
        text: &QueryText,
        options: &Options,
    ) -> Result<(StatisticalQuery, Vec<String>), Rejection> {
        let refused = |message: &str, help: &str| {
            let error = Diagnostic::new(codes::UNSUPPORTED_QUERY, text.span, message).help(help);
            Rejection::new(vec![error], &self.sources)
        };
        let Some(parsed) = self.statistical_query(text.span) else {
            return Err(refused(
                "only statistical queries can be answered from the same runs",
                "ask for this one alone",
            ));
        };
        let (query, warnings) = self.compiled(stochastic, &parsed, &[], options)?;
        if matches!(query.kind, Statistical::Simulation(_)) {
            return Err(refused(
                "simulate shows runs, and has no part in a joint guarantee",
                "ask for this one alone",
            ));
        }
        if matches!(query.kind, Statistical::Comparison { .. }) {
            return Err(refused(
                "a comparison has runs of its own, and no part in a joint guarantee",
                "ask for this one alone",
            ));
        }
        Ok((query, warnings))
    }
}

/// The queries by the runs that they can share, in order.
fn same_runs(queries: &[StatisticalQuery], precisions: &[Precision]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, query) in queries.iter().enumerate() {
        let bound = bound_of(&query.kind);
        let known = groups.iter_mut().find(|group| {
            let other = bound_of(&queries[group[0]].kind);
            let (one, another) = (&precisions[index], &precisions[group[0]]);
            other.limit == bound.limit
                && other.value.to_bits() == bound.value.to_bits()
                && one.seed == another.seed
                && one.discretisation.map(f64::to_bits) == another.discretisation.map(f64::to_bits)
        });
        match known {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// What the intervals promise together: the sum of their risks; `None` for a single one.
fn together(precisions: &[Precision]) -> Option<String> {
    let count = precisions.len();
    let alpha: f64 = precisions.iter().map(|precision| precision.alpha).sum();
    // Without the last digits, which are rounding.
    let percent = (1e6 * (1.0 - alpha)).round() / 1e4;
    (count > 1).then(|| format!("all {count} intervals hold together at {percent} %"))
}
