//! Statistical queries: random runs of the model in the stochastic reading, and what they say.

use std::sync::Arc;
use std::time::Instant;

use super::libraries::{begin_libraries, has_libraries};
use super::run_failure::GREATEST_POOL;
use super::splitting::{splitting_of, splitting_remark};
use super::watched_runs::WatchedRuns;
use crate::engine::answer::{Answer, Verdict};
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, PreparedQuery};
use crate::engine::options::Options;
use crate::engine::rejection::Rejection;
use crate::ir::{RunTimeErrorKind, Statistical};
use crate::search::limits::{Counters, StopReason};
use crate::stochastic::statistics::{Decision, Method};
use crate::stochastic::{
    Behaviour, Failure, Fence, MeanMethod, Precision, Restriction, RunWatch as _, Runs, block,
    compare, estimate, estimate_rare, simulate,
};

/// What is said if the first run takes too long.
const NO_RUN: &str = "no run has ended until then: bound runs by less, and see that the clock that bounds them is not set back";

impl LoadedModel {
    /// Answers a statistical query whose code is ready.
    pub(in crate::engine) fn answer_by_runs(
        &mut self,
        prepared: &PreparedQuery,
        asked: &Statistical,
    ) -> Result<Answer, Rejection> {
        let PreparedQuery { query, options, .. } = prepared;
        let start = Instant::now();
        let restriction = self.restriction(prepared)?;
        let decider = prepared.decider.as_ref();
        let followed = decider.map(|one| self.followed_in_runs(one));
        let barrier = prepared.shield.as_ref().map(|one| self.barrier(one));
        let behaviour = Behaviour {
            guidance: followed.as_deref(),
            fence: barrier.as_ref().map(|one| one as &dyn Fence),
            ..self.behaviour(restriction.as_ref(), options)
        };
        let may_have_more_room = self.pool < GREATEST_POOL;
        let mut watch = LimitWatch::new(options.limits.left_since(start));
        let result = watch.bound(|watch| {
            let _hooks = begin_libraries(behaviour, &[asked], options.precision.seed)?;
            match &options.only_runs {
                Some(numbers) if !matches!(asked, Statistical::Simulation(_)) => {
                    let seed = options.precision.seed;
                    let (results, failure) = block(behaviour, asked, seed, numbers.clone());
                    // All other failures are found again where the query is answered.
                    if let Some(Failure::RunTime(error)) = failure
                        && (error.kind == RunTimeErrorKind::Interrupted
                            || error.kind == RunTimeErrorKind::NoRoom && may_have_more_room)
                    {
                        return Err(Failure::RunTime(error));
                    }
                    Ok(Answer {
                        block: Some(results),
                        ..Answer::new(Verdict::Satisfied, Counters::default())
                    })
                }
                _ => shown_by_runs(behaviour, prepared, asked, watch),
            }
        });
        let mut answer = match result {
            Err((reason, counters)) => without_runs(reason, counters),
            Ok(Err(failure)) => self.after_failure(&failure, query, &watch)?,
            Ok(Ok(answer)) => concluded(answer, asked, &options.precision, &watch),
        };
        answer.measure(&watch);
        Ok(answer)
    }

    /// What makes runs; the code is ready.
    pub(in crate::engine) fn behaviour<'a>(
        &'a self,
        restriction: Option<&'a Restriction>,
        options: &Options,
    ) -> Behaviour<'a> {
        let compiled = self.stochastic.as_ref().expect(ANALYSED);
        Behaviour {
            network: compiled.network(),
            executor: compiled.executor(),
            restriction,
            guidance: None,
            fence: None,
            fixed_step: options.precision.discretisation,
        }
    }
}

/// How exact answers are to be, and how many threads make runs.
pub(super) fn precision_of(behaviour: Behaviour<'_>, options: &Options) -> Precision {
    Precision {
        // Libraries need not stand several calls at a time.
        threads: if has_libraries(behaviour.network) {
            1
        } else {
            options.thread_count()
        },
        ..options.precision
    }
}

/// What runs show, as an answer whose verdict is not known yet.
fn shown_by_runs(
    behaviour: Behaviour<'_>,
    prepared: &PreparedQuery,
    asked: &Statistical,
    watch: &mut LimitWatch,
) -> Result<Answer, Failure> {
    let options = &prepared.options;
    let precision = precision_of(behaviour, options);
    let observer = options.run_observer.clone();
    let mut watched = WatchedRuns::new(asked, precision.alpha, watch, observer);
    let runs_anywhere = Runs {
        behaviour,
        source: options.run_source.as_ref(),
    };
    let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
    match (asked, splitting_of(prepared)) {
        (Statistical::Simulation(asked), _) => {
            let simulated = simulate(behaviour, asked, &precision, |runs| watched.ends(runs))?;
            answer.estimate.clone_from(&simulated.estimate);
            answer.simulated = Some(Arc::new(simulated));
        }
        (Statistical::Probability(bound, path), Some(splitting)) => {
            let ends = |runs| watched.ends(runs);
            let rare = estimate_rare(behaviour, bound, path, &splitting, &precision, ends)?;
            answer.remark(splitting_remark(&rare));
            answer.estimate = Some(rare.estimate);
        }
        (Statistical::Comparison { .. }, _) => {
            let ends = |runs| watched.ends(runs);
            answer.estimate = Some(compare(runs_anywhere, asked, &precision, ends)?);
        }
        _ => {
            let estimate = estimate(runs_anywhere, asked, &precision, &mut watched)?;
            answer.estimate = Some(estimate);
            answer.values_of_runs = watched.values(asked);
        }
    }
    Ok(answer)
}

/// The answer if time is over before the first run is.
pub(super) fn without_runs(reason: StopReason, counters: Counters) -> Answer {
    let mut answer = Answer::new(Verdict::Unknown(reason), counters);
    answer.remark(NO_RUN);
    answer
}

/// An answer with what runs show, with its verdict and what the numbers do not say themselves.
pub(super) fn concluded(
    mut answer: Answer,
    asked: &Statistical,
    precision: &Precision,
    watch: &LimitWatch,
) -> Answer {
    let estimate = answer.estimate.as_ref();
    let method = estimate.map(|estimate| estimate.method);
    answer.verdict = match estimate.and_then(|estimate| estimate.decision) {
        Some(Decision::Below) => Verdict::NotSatisfied,
        None if watch.has_stopped() => Verdict::Unknown(watch.stop()),
        None if is_test(asked) => Verdict::Maybe,
        Some(Decision::AtLeast) | None => Verdict::Satisfied,
    };
    if let Some(remark) = remark(asked, answer.verdict, method) {
        answer.remark(remark);
    }
    if let Statistical::Expectation { bound, .. } = asked
        && let Some(runs) = precision.assumed_runs(bound)
    {
        answer.remark(format!(
            "the query names no number of runs: {runs}, as many as a probability of 1/2 takes"
        ));
    }
    let simulated = answer.simulated.as_ref();
    if simulated.is_some_and(|simulated| simulated.is_cut) {
        answer.remark("there is room for these runs only: ask for fewer, or for shorter ones");
    }
    answer
}

fn is_test(query: &Statistical) -> bool {
    matches!(
        query,
        Statistical::Hypothesis { .. } | Statistical::Comparison { .. }
    )
}

/// What the numbers do not say themselves.
fn remark(query: &Statistical, verdict: Verdict, method: Option<Method>) -> Option<&'static str> {
    match (query, verdict) {
        (_, Verdict::Unknown(_)) => Some("the estimate is that of the runs until then"),
        (Statistical::Hypothesis { .. }, Verdict::Maybe) => {
            Some("these runs do not decide the test")
        }
        (Statistical::Comparison { .. }, Verdict::Maybe) => {
            Some("these runs do not decide which of the two is greater")
        }
        (Statistical::Comparison { .. }, _) => Some(
            "decided by a sequential test of pairs of runs; the intervals are those of as many runs",
        ),
        (Statistical::Hypothesis { .. }, _) => {
            Some("decided by a sequential test; the interval is that of as many runs")
        }
        (Statistical::Expectation { .. }, _) if method == Some(Method::Student) => {
            Some("the interval is Student's: asymptotic, for many runs")
        }
        _ => None,
    }
}

/// Why an interval cannot be made as it is asked for, and what to do.
pub(in crate::engine) fn contradiction(
    query: &Statistical,
    precision: &Precision,
) -> Option<(&'static str, &'static str)> {
    let Statistical::Expectation { range, .. } = query else {
        return None;
    };
    let has_bounds = precision.value_bounds.or(*range).is_some();
    let is_sequential = precision.anytime || precision.relative.is_some();
    match precision.mean_method {
        MeanMethod::DvoretzkyKieferWolfowitz if is_sequential => Some((
            "an interval of Dvoretzky, Kiefer and Wolfowitz is for a fixed number of runs",
            "leave the choice to empirical Bernstein intervals, which hold at any moment",
        )),
        MeanMethod::Student if is_sequential => Some((
            "Student's interval is for a fixed number of runs",
            "leave the choice to empirical Bernstein intervals, which hold at any moment",
        )),
        MeanMethod::Student => None,
        MeanMethod::Auto if !is_sequential => None,
        _ if !has_bounds => Some((
            "such an interval of a mean needs bounds of the value, and none are known",
            "give them: --set 'value bounds LOW,HIGH'",
        )),
        _ => None,
    }
}
