//! Statistical queries that are answered together: those with the same bound share their runs, and
//! all intervals hold together.

use std::time::Instant;

use super::statistical::{GREATEST_POOL, contradiction, remark, verdict};
use crate::diagnostics::Diagnostic;
use crate::engine::answer::{Answer, Verdict};
use crate::engine::code::PreparedCode;
use crate::engine::codes;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{LoadedModel, StochasticModel};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{RunTimeErrorKind, Statistical, StatisticalQuery};
use crate::search::limits::{Counters, Watch as _};
use crate::stochastic::{Behaviour, Estimate, Failure, Precision, bound_of, estimate_jointly};
use crate::syntax::ast::QueryText;

impl LoadedModel {
    /// Answers queries for probabilities and means from the same runs.
    pub fn check_jointly(
        &mut self,
        queries: &[QueryText],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        self.stochastic()?;
        let mut stochastic = self.stochastic.take().expect("it was just made");
        let pool = self.pool;
        let answers = self.joint_answers(&mut stochastic, queries, options);
        if self.pool > pool {
            return self.check_jointly(queries, options);
        }
        self.stochastic = Some(stochastic);
        answers
    }

    fn joint_answers(
        &mut self,
        stochastic: &mut StochasticModel,
        queries: &[QueryText],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        let start = Instant::now();
        stochastic.model.network.overflow = options.overflow;
        let mut compiled = Vec::new();
        let mut warnings = Vec::new();
        for text in queries {
            let (query, found) = self.joint_query(stochastic, text, &options.precision)?;
            compiled.push(query);
            warnings.push(found);
        }
        let Some(first) = compiled.first() else {
            return Ok(Vec::new());
        };
        let network = &stochastic.model.network;
        PreparedCode::prepare(&mut stochastic.code, network, options.code, options.tuning)
            .map_err(|message| {
                let error = Diagnostic::new(codes::NO_COMPILED_CODE, first.span, message)
                    .help("use the interpreter: --engine interpreter");
                Rejection::new(vec![error], &self.sources)
            })?;
        self.load_seconds += start.elapsed().as_secs_f64();
        let executor = stochastic.code.as_ref().map(PreparedCode::executor);
        let behaviour = Behaviour {
            fixed_step: options.precision.discretisation,
            ..Behaviour::new(network, executor.expect("code was just prepared"))
        };
        let count = compiled.len() as f64;
        let precision = Precision {
            threads: options.thread_count(),
            alpha: options.precision.alpha / count,
            beta: options.precision.beta / count,
            ..options.precision
        };
        let start = Instant::now();
        let mut watch = LimitWatch::new(options.limits.clone());
        let result = watch.bound(|watch| {
            let mut estimates: Vec<Option<Estimate>> = vec![None; compiled.len()];
            for group in same_bounds(&compiled) {
                let kinds: Vec<&Statistical> = group.iter().map(|&i| &compiled[i].kind).collect();
                let ends = |runs| {
                    let counters = Counters {
                        explored: runs,
                        ..Counters::default()
                    };
                    watch.look(&counters).is_some()
                };
                let found = estimate_jointly(behaviour, &kinds, &precision, ends);
                let found = found.map_err(|failure| (failure, group[0]))?;
                for (&index, estimate) in group.iter().zip(found) {
                    estimates[index] = Some(estimate);
                }
            }
            Ok(estimates)
        });
        let estimates = match result {
            Err((reason, counters)) => {
                let unknown = |_: &QueryText| Answer::new(Verdict::Unknown(reason), counters);
                return Ok(queries.iter().map(unknown).collect());
            }
            Ok(Err((Failure::RunTime(error), _))) => {
                if error.kind == RunTimeErrorKind::NoRoom && self.pool < GREATEST_POOL {
                    // All begins again with more slots.
                    self.pool *= 2;
                }
                return Err(self.run_time_error(network, error));
            }
            Ok(Err((failure, index))) => {
                return Err(self.run_fails(network, &failure, &compiled[index]));
            }
            Ok(Ok(estimates)) => estimates,
        };
        let seconds = start.elapsed().as_secs_f64();
        let together = together(queries.len(), options.precision.alpha);
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
        &mut self,
        stochastic: &mut StochasticModel,
        text: &QueryText,
        precision: &Precision,
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
        let (query, found) = stochastic
            .model
            .compile_statistical(&parsed, &self.sources, &[]);
        let Some(query) = query else {
            return Err(Rejection::new(found, &self.sources));
        };
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
        if let Some((message, help)) = contradiction(&query.kind, precision) {
            return Err(refused(message, help));
        }
        Ok((query, Rejection::new(found, &self.sources).rendered))
    }
}

/// The queries by the bound of their runs, in order.
fn same_bounds(queries: &[StatisticalQuery]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, query) in queries.iter().enumerate() {
        let bound = bound_of(&query.kind);
        let known = groups.iter_mut().find(|group| {
            let other = bound_of(&queries[group[0]].kind);
            other.limit == bound.limit && other.value.to_bits() == bound.value.to_bits()
        });
        match known {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// What the intervals promise together; `None` for a single one.
fn together(queries: usize, alpha: f64) -> Option<String> {
    // Without the last digits, which are rounding.
    let percent = (1e6 * (1.0 - alpha)).round() / 1e4;
    (queries > 1).then(|| format!("all {queries} intervals hold together at {percent} %"))
}
