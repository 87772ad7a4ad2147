//! Queries for the best strategy.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use super::statistical::{precision_of, without_runs};
use super::watched_runs::SHOW_EVERY;
use crate::engine::answer::{Answer, Optimised, Verdict};
use crate::engine::limits::{DISK_FAILED, LimitWatch};
use crate::engine::loaded_model::{ANALYSED, Decider, LoadedModel, NamedStrategy, PreparedQuery};
use crate::engine::options::{RunObserver, RunsSoFar};
use crate::engine::query_form::unnamed;
use crate::engine::rejection::Rejection;
use crate::ir::{Network, Optimum, Query};
use crate::learning::{
    Comparison, Exact, ExactAnswer, Followed, Inexact, LearnedStrategy, Learning, Mean, Progress,
    compared, judge, learn, solve_exactly, whole_state,
};
use crate::search::limits::{Counters, StopReason, Watch as _};
use crate::stochastic::statistics::{Interval, Method};
use crate::stochastic::{
    Behaviour, ControllerMove, Estimate, Failure, Fence, Guidance, NotFinite, Runner, Stand,
};

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
        let barrier = prepared.shield.as_ref().map(|one| self.barrier(one));
        let behaviour = Behaviour {
            fence: barrier.as_ref().map(|one| one as &dyn Fence),
            ..self.behaviour(restriction.as_ref(), options)
        };
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
        let none = NamedStrategy::new(name.to_owned(), text, None);
        self.keep_strategy(match strategy {
            Some(learned) => NamedStrategy {
                learned: Some(learned),
                within: prepared.under.clone(),
                shield: prepared.shield.clone(),
                ..none
            },
            // What it was to refine is no strategy of this name.
            None => none,
        });
    }

    /// Who decides, prepared to be followed in random runs.
    pub(super) fn followed_in_runs(&self, decider: &Decider) -> Box<dyn Guidance> {
        let moves = self.moves_of_controller();
        match decider {
            Decider::Learned(strategy) => Box::new(Followed::new(strategy, &moves)),
            Decider::Policy(policy) => Box::new(policy.followed(&moves)),
        }
    }

    /// The moves that the controller may make in random runs; the code is ready.
    pub(in crate::engine) fn moves_of_controller(&self) -> Vec<ControllerMove> {
        let compiled = self.stochastic.as_ref().expect(ANALYSED);
        let behaviour = Behaviour::new(compiled.network(), compiled.executor());
        Runner::of(behaviour).moves_of_controller()
    }
}

/// The best strategy with the answer that tells of it; `None` if a limit came first.
type Found = Option<(Answer, Arc<LearnedStrategy>)>;

/// Finds the best strategy.
fn found(
    behaviour: Behaviour<'_>,
    prepared: &PreparedQuery,
    asked: &Optimum,
    watch: &mut LimitWatch,
) -> Result<Found, Failure> {
    match solve_exactly(behaviour, asked, &mut |counters| watch.look(counters))? {
        ExactAnswer::Best(best) => Ok(Some(exact(best))),
        ExactAnswer::Unbounded => Err(Failure::NoBest),
        ExactAnswer::NeverEnds => Err(Failure::NeverEnds),
        ExactAnswer::Left(Inexact::Limit(StopReason::Time | StopReason::Interrupted)) => Ok(None),
        ExactAnswer::Left(reason) => {
            let reason = not_exact(behaviour.network, reason);
            let mut found = learned(behaviour, prepared, asked, watch)?;
            if let Some((answer, _)) = &mut found {
                let learned = answer.message.take().unwrap_or_default();
                answer.remark(format!("not computed exactly: {reason}"));
                answer.remark(learned);
            }
            Ok(found)
        }
    }
}

/// Learns the best strategy.
fn learned(
    behaviour: Behaviour<'_>,
    prepared: &PreparedQuery,
    asked: &Optimum,
    watch: &mut LimitWatch,
) -> Result<Found, Failure> {
    let options = &prepared.options;
    let features = asked.features.clone();
    let features = features.unwrap_or_else(|| whole_state(behaviour.network, asked));
    let observation = Arc::new(features);
    let precision = precision_of(behaviour, options);
    let moves = Runner::of(behaviour).moves_of_controller();
    let learning = Learning {
        seed: precision.seed,
        threads: precision.threads,
        width: observation.words(),
        ..options.learning.clone()
    };
    let mut show = progress_shown(options.run_observer.as_ref());
    let learned = learn(behaviour, asked, &observation, &learning, |progress| {
        show(progress);
        watch.ends_runs(progress.runs)
    })?;
    let Some(judged) = learned.progress.best else {
        return Ok(None);
    };
    let strategy =
        LearnedStrategy::new(&learned.partition, &observation, &moves, asked.is_greatest);
    let strategy = Arc::new(strategy);
    let followed = Followed::new(&strategy, &moves);
    let under = Behaviour {
        guidance: Some(&followed),
        ..behaviour
    };
    let count = precision.runs.or(asked.bound.runs);
    let runs = FRESH..FRESH + count.unwrap_or_else(|| fresh_runs(&learned.progress));
    let mut value_under = |behaviour| {
        let runs = runs.clone();
        judge(behaviour, asked, &precision, runs, |runs| {
            watch.ends_runs(runs)
        })
    };
    let (value, uniform) = (value_under(under)?, value_under(behaviour)?);
    let mut answer = Answer::new(Verdict::Satisfied, Counters::default());
    let comparison = value.as_ref().zip(uniform.as_ref());
    let comparison = comparison.map(|(value, uniform)| compared(value, uniform, asked.is_greatest));
    answer.estimate = value;
    answer.evidence.learned = Some(Arc::clone(&strategy));
    answer.remark(remark(&learned.progress, uniform.as_ref().zip(comparison)));
    answer.optimised = Some(Optimised {
        runs: learned.progress.runs,
        iterations: learned.progress.iterations,
        iterations_in_last_reset: learned.iterations_in_last_reset,
        resets: learned.resets,
        judged,
        comparison,
        uniform,
        history: learned.history,
        is_complete: learned.is_complete,
        leaves: strategy.leaves() as u64,
        observation,
    });
    Ok(Some((answer, strategy)))
}

/// How many runs say what a strategy is worth, if nobody says it.
fn fresh_runs(progress: &Progress) -> u64 {
    let fitting = FRESH_STEPS / progress.steps_of_run;
    fitting.clamp(FRESH_RUNS.start, FRESH_RUNS.end) as u64
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
    answer.evidence.learned = Some(Arc::clone(&strategy));
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
        Inexact::Shield => "a shield is known on cells only".to_owned(),
        Inexact::Library => "functions of libraries may be of any kind".to_owned(),
        Inexact::TooLarge => {
            "there are more than 10 million states, or they take more than 4 GiB".to_owned()
        }
        Inexact::Limit(reason) => match reason {
            StopReason::Disk => DISK_FAILED.to_owned(),
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

/// Shows now and then how far learning is.
fn progress_shown(observer: Option<&RunObserver>) -> impl FnMut(&Progress) {
    let mut shown = Instant::now();
    move |progress| {
        if let (Some(observer), Some(best)) = (observer, progress.best)
            && shown.elapsed() >= SHOW_EVERY
        {
            shown = Instant::now();
            (observer.0)(&so_far(progress.runs, best));
        }
    }
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

/// What the numbers do not say themselves; the uniform choice with how the strategy compares with
/// it.
fn remark(progress: &Progress, uniform: Option<(&Estimate, Comparison)>) -> String {
    let Progress {
        runs, iterations, ..
    } = progress;
    let learned = format!("learned from {runs} runs in {iterations} iterations");
    let Some((Estimate { lower, upper, .. }, comparison)) = uniform else {
        return learned;
    };
    let how = match comparison {
        Comparison::Better => "better than",
        Comparison::Worse => "worse than",
        Comparison::Alike => "not better than",
    };
    format!("{learned}; {how} the uniform choice, which gives [{lower:.6}, {upper:.6}]")
}
