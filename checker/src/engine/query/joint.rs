//! Statistical queries that are answered together: those with the same bound share their runs, and
//! all intervals hold together.

use std::time::Instant;

use super::libraries::begin_libraries;
use super::statistical::{concluded, precision_of, without_runs};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::codes;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{Query, QueryKind, Statistical};
use crate::search::limits::Counters;
use crate::semantics::Reading;
use crate::stochastic::{Behaviour, Estimate, Failure, Precision, estimate_jointly};
use crate::syntax::ast::QueryText;

/// A query that is answered together with others.
#[derive(Clone, Debug)]
pub struct JointQuery {
    /// Its text.
    pub text: QueryText,
    /// How exact its answer is to be.
    pub precision: Precision,
}

/// A compiled query that is answered together with others.
struct Member {
    query: Query,
    asked: Statistical,
    /// How exact the answer is to be, so that all intervals hold together.
    precision: Precision,
    warnings: Vec<String>,
}

impl LoadedModel {
    /// Answers queries for probabilities and means from the same runs, each as exactly as it says
    /// itself.
    pub fn check_jointly(
        &mut self,
        queries: &[JointQuery],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        self.with_room(|model| model.check_jointly_once(queries, options))
    }

    fn check_jointly_once(
        &mut self,
        queries: &[JointQuery],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        let start = Instant::now();
        let members = queries.iter().map(|one| self.member(one, queries.len()));
        let members = members.collect::<Result<Vec<Member>, Rejection>>()?;
        let Some(first) = members.first() else {
            return Ok(Vec::new());
        };
        self.load_seconds += start.elapsed().as_secs_f64();
        let span = first.query.span;
        let mut answers = match self.prepare_in_time(Reading::Stochastic, span, options)? {
            Some(cut) => vec![cut; members.len()],
            None => self.answer_by_same_runs(&members, options)?,
        };
        for (answer, member) in answers.iter_mut().zip(members) {
            answer.warnings = member.warnings;
            answer.load_seconds = self.load_seconds;
        }
        Ok(answers)
    }

    /// Answers queries whose code is ready.
    fn answer_by_same_runs(
        &mut self,
        members: &[Member],
        options: &Options,
    ) -> Result<Vec<Answer>, Rejection> {
        let behaviour = self.behaviour(None, options);
        let mut watch = LimitWatch::new(options.limits.clone());
        // The first query of the group whose runs are made.
        let mut at_hand = 0;
        let result = watch.bound(|watch| {
            let asked: Vec<&Statistical> = members.iter().map(|one| &one.asked).collect();
            let _hooks = begin_libraries(behaviour, &asked, members[0].precision.seed)?;
            let mut estimates: Vec<Option<Estimate>> = vec![None; members.len()];
            for group in same_runs(members) {
                at_hand = group[0];
                let found = estimates_of(behaviour, members, &group, options, watch)?;
                for (&index, estimate) in group.iter().zip(found) {
                    estimates[index] = Some(estimate);
                }
            }
            Ok(estimates)
        });
        let mut answers = match result {
            Err((reason, counters)) => vec![without_runs(reason, counters); members.len()],
            Ok(Err(failure)) => {
                let answer = self.after_failure(&failure, &members[at_hand].query, &watch)?;
                vec![answer; members.len()]
            }
            Ok(Ok(estimates)) => {
                let together = together(members);
                let answers = members.iter().zip(estimates).map(|(member, estimate)| {
                    let answer = Answer {
                        estimate,
                        ..Answer::new(Verdict::Satisfied, Counters::default())
                    };
                    let mut answer = concluded(answer, &member.asked, &member.precision, &watch);
                    if let Some(together) = &together {
                        answer.remark(together);
                    }
                    answer
                });
                answers.collect()
            }
        };
        for answer in &mut answers {
            answer.measure(&watch);
        }
        Ok(answers)
    }

    /// A query that is answered together with others; there are `count`.
    fn member(&mut self, one: &JointQuery, count: usize) -> Result<Member, Rejection> {
        let JointQuery { text, precision } = one;
        let refused = |model: &LoadedModel, message: &str| {
            let help = "ask for this one alone";
            Err(model.refusal(codes::UNSUPPORTED_QUERY, text.span, message, help))
        };
        let not_statistical = "only statistical queries can be answered from the same runs";
        if self.reading_of(text.span) == Reading::Symbolic {
            return refused(self, not_statistical);
        }
        let (query, warnings) = self.compile_in(Reading::Stochastic, text.span, &[])?;
        self.refuse_contradiction(&query, precision)?;
        let QueryKind::Statistical(asked) = &query.kind else {
            return refused(self, not_statistical);
        };
        match &**asked {
            Statistical::Simulation(_) => {
                let message = "simulate shows runs, and has no part in a joint guarantee";
                return refused(self, message);
            }
            Statistical::Comparison { .. } => {
                let message = "a comparison has runs of its own, and no part in a joint guarantee";
                return refused(self, message);
            }
            _ => {}
        }
        Ok(Member {
            asked: Statistical::clone(asked),
            precision: Precision {
                alpha: precision.alpha / count as f64,
                beta: precision.beta / count as f64,
                ..*precision
            },
            query,
            warnings,
        })
    }
}

/// The estimates of the queries of a group, in its order.
fn estimates_of(
    behaviour: Behaviour<'_>,
    members: &[Member],
    group: &[usize],
    options: &Options,
    watch: &mut LimitWatch,
) -> Result<Vec<Estimate>, Failure> {
    let threads = precision_of(behaviour, options).threads;
    let asked = group.iter().map(|&index| {
        let member = &members[index];
        let precision = Precision {
            threads,
            ..member.precision
        };
        (&member.asked, precision)
    });
    let asked: Vec<(&Statistical, Precision)> = asked.collect();
    let behaviour = Behaviour {
        fixed_step: asked[0].1.discretisation,
        ..behaviour
    };
    estimate_jointly(behaviour, &asked, |runs| watch.ends_runs(runs))
}

/// The queries by the runs that they can share, in order.
fn same_runs(members: &[Member]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, member) in members.iter().enumerate() {
        let bound = member.asked.bound();
        let known = groups.iter_mut().find(|group| {
            let first = &members[group[0]];
            let other = first.asked.bound();
            let (one, another) = (&member.precision, &first.precision);
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
fn together(members: &[Member]) -> Option<String> {
    let count = members.len();
    let alpha: f64 = members.iter().map(|member| member.precision.alpha).sum();
    // Without the last digits, which are rounding.
    let percent = (1e6 * (1.0 - alpha)).round() / 1e4;
    (count > 1).then(|| format!("all {count} intervals hold together at {percent} %"))
}
