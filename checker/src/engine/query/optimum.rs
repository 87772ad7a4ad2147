//! Queries for the best strategy.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use super::statistical::{precision_of, without_runs};
use super::watched_runs::SHOW_EVERY;
use crate::engine::answer::{Answer, Optimised, Verdict};
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{ANALYSED, LoadedModel, NamedStrategy, PreparedQuery};
use crate::engine::options::RunsSoFar;
use crate::engine::query_form::unnamed;
use crate::engine::rejection::Rejection;
use crate::ir::{Network, Optimum, Query};
use crate::learning::{
    Comparison, Exact, ExactAnswer, Followed, Inexact, Learned, LearnedStrategy, Learning, Mean,
    compared, judge, learn, solve_exactly, whole_state,
};
use crate::search::limits::{Counters, StopReason, Watch as _};
use crate::stochastic::statistics::{Interval, Method};
use crate::stochastic::{Behaviour, Estimate, Failure, NotFinite, Runner, Stand};

/// The numbers of the runs that say what a strategy is worth: learning never uses them.
const FRESH: u64 = 1 << 41;
/// How many there are, if nobody says it: so many moves of the controller,
const FRESH_STEPS: f64 = 500_000.0;
/// but not fewer runs, and not more.
const FRESH_RUNS: Range<f64> = 1_000.0..100_000.0;

impl LoadedModel {
    /// Answers a query for the best strategy whose code is ready.
    pub(in crate::engine) fn answer_optimum(
        &mut self,
        prepared: &PreparedQuery,
        asked: &Optimum,
    ) -> Result<Answer, Rejection> {
        let PreparedQuery { query, options, .. } = prepared;
        let start = Instant::now();
        let restriction = self.restriction(prepared)?;
        let behaviour = self.behaviour(restriction.as_ref(), options);
        let mut watch = LimitWatch::new(options.limits.left_since(start));
        let result = watch.bound(|watch| found(behaviour, prepared, asked, watch));
        let (answer, strategy) = match result {
            Err((reason, counters)) => (without_runs(reason, counters), None),
            Ok(Err(failure)) => (self.after_failure(&failure, query, &watch)?, None),
            Ok(Ok(None)) => {
                let reason = watch.stop();
                (without_runs(reason, Counters::default()), None)
            }
            Ok(Ok(Some((answer, strategy)))) => (answer, Some(strategy)),
        };
        let mut answer = answer;
        answer.measure(&watch);
        if let Some(name) = &query.strategy {
            self.keep_learned(name, query, prepared, strategy);
        }
        Ok(answer)
    }

    fn keep_learned(
        &mut self,
        name: &str,
        query: &Query,
        prepared: &PreparedQuery,
        strategy: Option<Arc<LearnedStrategy>>,
    ) {
        let text = unnamed(&query.text).to_owned();
        self.keep_strategy(NamedStrategy {
            learned: strategy,
            within: prepared.under.clone(),
            ..NamedStrategy::new(name.to_owned(), text, None)
        });
    }

    /// A learned strategy, prepared to be followed in random runs.
    pub(super) fn followed_in_runs(&self, strategy: &Arc<LearnedStrategy>) -> Followed {
        let compiled = self.stochastic.as_ref().expect(ANALYSED);
        let behaviour = Behaviour::new(compiled.network(), compiled.executor());
        Followed::new(strategy, &Runner::of(behaviour).moves_of_controller())
    }
}

/// Finds the best strategy; `None` if a limit came first.
fn found(
    behaviour: Behaviour<'_>,
    prepared: &PreparedQuery,
    asked: &Optimum,
    watch: &mut LimitWatch,
) -> Result<Option<(Answer, Arc<LearnedStrategy>)>, Failure> {
    let inexact = match solve_exactly(behaviour, asked, &mut |counters| watch.look(counters))? {
        ExactAnswer::Best(best) => return Ok(Some(exact(best))),
        ExactAnswer::Unbounded => return Err(Failure::NoBest),
        ExactAnswer::NeverEnds => return Err(Failure::NeverEnds),
        ExactAnswer::Left(Inexact::Limit(StopReason::Time | StopReason::Interrupted)) => {
            return Ok(None);
        }
        ExactAnswer::Left(reason) => reason,
    };
    let options = &prepared.options;
    let observation = match &asked.features {
        Some(features) => Arc::new(features.clone()),
        None => Arc::new(whole_state(behaviour.network, asked)),
    };
    let precision = precision_of(behaviour, options);
    let moves = Runner::of(behaviour).moves_of_controller();
    let mut shown = Instant::now();
    let learning = Learning {
        seed: precision.seed,
        threads: precision.threads,
        width: observation.words(),
        ..options.learning.clone()
    };
    let Learned {
        partition,
        progress,
        resets,
        iterations_in_last_reset,
        is_complete,
    } = learn(behaviour, asked, &observation, &learning, |progress| {
        if let (Some(observer), Some(best)) = (&options.run_observer, progress.best)
            && shown.elapsed() >= SHOW_EVERY
        {
            shown = Instant::now();
            (observer.0)(&so_far(progress.runs, best));
        }
        is_due(watch, progress.runs)
    })?;
    let Some(best) = progress.best else {
        return Ok(None);
    };
    let strategy = LearnedStrategy::new(&partition, &observation, &moves, asked.is_greatest);
    let strategy = Arc::new(strategy);
    let followed = Followed::new(&strategy, &moves);
    let under = Behaviour {
        guidance: Some(&followed),
        ..behaviour
    };
    let steps = progress.steps_of_run;
    let fitting = (FRESH_STEPS / steps).clamp(FRESH_RUNS.start, FRESH_RUNS.end) as u64;
    let count = precision.runs.or(asked.bound.runs).unwrap_or(fitting);
    let mut values = |behaviour, first: u64| {
        judge(
            behaviour,
            asked,
            precision.seed,
            first..first + count,
            precision.threads,
            precision.alpha,
            |runs| is_due(watch, runs),
        )
    };
    let value = values(under, FRESH)?;
    let uniform = values(behaviour, FRESH)?;
    let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
    answer.estimate.clone_from(&value);
    answer.evidence.learned = Some(Arc::clone(&strategy));
    let comparison = value.as_ref().zip(uniform.as_ref());
    let comparison = comparison.map(|(value, uniform)| compared(value, uniform, asked.is_greatest));
    let inexact = not_exact(behaviour.network, inexact);
    answer.remark(format!("not computed exactly: {inexact}"));
    answer.remark(remark(
        progress.runs,
        progress.iterations,
        uniform.as_ref(),
        comparison,
    ));
    answer.optimised = Some(Optimised {
        runs: progress.runs,
        iterations: progress.iterations,
        iterations_in_last_reset,
        resets,
        judged: best,
        comparison,
        uniform,
        is_complete,
        observation: Arc::clone(&observation),
        leaves: strategy.leaves() as u64,
    });
    Ok(Some((answer, strategy)))
}

/// The answer that was computed.
fn exact(best: Exact) -> (Answer, Arc<LearnedStrategy>) {
    let Exact {
        lower,
        upper,
        strategy,
        counters,
    } = best;
    let mut answer = Answer::new(Verdict::Satisfied, counters);
    answer.estimate = Some(Estimate {
        value: lower + (upper - lower) / 2.0,
        lower,
        upper,
        confidence: 1.0,
        method: Method::ValueIteration,
        runs: 0,
        satisfied_runs: None,
        decision: None,
        compared: None,
        is_complete: true,
    });
    let states = counters.stored;
    answer.remark(format!("exact: value iteration over {states} states"));
    (answer, strategy)
}

/// Why a value is learned and not computed.
fn not_exact(network: &Network, reason: Inexact) -> String {
    let place = |stand: Stand| {
        let process = &network.processes[stand.process.0 as usize];
        let location = &process.locations[stand.location.0 as usize];
        format!("{}.{}", process.name, location.name)
    };
    match reason {
        Inexact::NotFinite(reason) => match reason {
            NotFinite::Drawn(stand) => format!("the delay in {} is drawn", place(stand)),
            NotFinite::Wait(stand) => {
                format!(
                    "the controller chooses how long it waits in {}",
                    place(stand)
                )
            }
            NotFinite::Flow => "rates of clocks change as time passes".to_owned(),
            NotFinite::Random(stand) => {
                format!("an update behind {} draws a random number", place(stand))
            }
            NotFinite::Rounded(stand) => {
                format!("rounding decides when {} can be left", place(stand))
            }
            NotFinite::Demand => "the strategy that is refined demands moves in time".to_owned(),
        },
        Inexact::Library => "functions of libraries may be of any kind".to_owned(),
        Inexact::TooLarge => {
            "there are more than 10 million states, or they take more than 4 GiB".to_owned()
        }
        Inexact::Limit(reason) => match reason {
            StopReason::Memory => "its states take more memory than allowed".to_owned(),
            _ => "there are more states than allowed".to_owned(),
        },
        Inexact::Hidden => {
            "the features do not tell states apart in which different moves are best".to_owned()
        }
        Inexact::MixedCycles => "cycles that take no time have both gains and costs".to_owned(),
        Inexact::Slow => "bounds of the value come too slowly near to each other".to_owned(),
    }
}

/// Whether a limit was reached.
fn is_due(watch: &mut LimitWatch, runs: u64) -> bool {
    let counters = Counters {
        explored: runs,
        ..Counters::default()
    };
    watch.look(&counters).is_some()
}

/// What is shown while a strategy is learned: the value of the best one until now.
fn so_far(runs: u64, best: Mean) -> RunsSoFar {
    let half = 2.0 * best.error;
    RunsSoFar {
        runs,
        estimate: best.value,
        interval: Interval {
            lower: best.value - half,
            upper: best.value + half,
        },
    }
}

/// What the numbers do not say themselves.
fn remark(
    runs: u64,
    iterations: u64,
    uniform: Option<&Estimate>,
    comparison: Option<Comparison>,
) -> String {
    let learned = format!("learned from {runs} runs in {iterations} iterations");
    let Some((uniform, comparison)) = uniform.zip(comparison) else {
        return learned;
    };
    let how = match comparison {
        Comparison::Better => "better than",
        Comparison::Worse => "worse than",
        Comparison::Alike => "not better than",
    };
    let Estimate { lower, upper, .. } = uniform;
    format!("{learned}; {how} the uniform choice, which gives [{lower:.6}, {upper:.6}]")
}
