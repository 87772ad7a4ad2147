//! Statistical queries: random runs of the model in the stochastic reading, and what they say.

use std::sync::Arc;
use std::time::Instant;

use super::prepared::{GREATEST_POOL, begin_libraries, without_runs};
use super::splitting::splitting_remark;
use crate::diagnostics::{Diagnostic, Span};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::codes;
use crate::engine::limits::LimitWatch;
use crate::engine::loaded_model::{LoadedModel, StochasticModel};
use crate::engine::options::Options;
use crate::engine::query::watched_runs::WatchedRuns;
use crate::engine::rejection::Rejection;
use crate::ir::{EdgeId, Network, RunTimeErrorKind, Statistical, StatisticalQuery};
use crate::search::limits::Counters;
use crate::stochastic::statistics::{Decision, Method};
use crate::stochastic::{
    Estimate, Failure, MOVES_WITHOUT_RISE, Rare, RunWatch as _, Runs, Simulated, Stand,
    ValuesOfRuns, ZENO_MOVES, ZENO_TIME, block, compare, estimate_rare, estimate_watched, simulate,
};
use crate::syntax;
use crate::syntax::ast;

/// What runs show.
#[derive(Default)]
struct Found {
    estimate: Option<Estimate>,
    simulated: Option<Arc<Simulated>>,
    values: Option<Arc<ValuesOfRuns>>,
    rare: Option<Rare>,
    block: Option<Vec<u8>>,
}

impl LoadedModel {
    /// The query at this span, if it is a statistical one.
    pub(in crate::engine) fn statistical_query(&self, span: Span) -> Option<ast::Query> {
        let (query, _) = syntax::parse_query(span, &self.sources);
        query.filter(|query| matches!(query.kind, ast::QueryKind::Statistical(_)))
    }

    /// Answers a statistical query.
    pub(in crate::engine) fn check_statistical(
        &mut self,
        query: &ast::Query,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        self.in_stochastic_reading(options, |kept, stochastic| {
            kept.statistical_answer(stochastic, query, options)
        })
    }

    fn statistical_answer(
        &mut self,
        stochastic: &mut StochasticModel,
        query: &ast::Query,
        options: &Options,
    ) -> Result<Answer, Rejection> {
        let start = Instant::now();
        let names = self.strategy_names();
        let (compiled, warnings) = self.compiled(stochastic, query, &names, options)?;
        let splitting = self.splitting(&mut stochastic.model, &compiled, options)?;
        self.prepare_stochastic(stochastic, (query.span, start), options)?;
        let network = &stochastic.model.network;
        let start = Instant::now();
        let restriction = self.restriction(query, network, options)?;
        let limits = options.limits.left_since(start);
        let behaviour = stochastic.behaviour(restriction.as_ref(), options);
        let runs_anywhere = Runs {
            behaviour,
            source: options.run_source.as_ref(),
        };
        let may_have_more_room = self.pool < GREATEST_POOL;
        let precision = stochastic.precision(options);
        let start = Instant::now();
        let mut watch = LimitWatch::new(limits);
        let observer = options.run_observer.clone();
        let result = watch.bound(|watch| {
            let mut runs = WatchedRuns::new(&compiled.kind, precision.alpha, watch, observer);
            let _hooks = begin_libraries(behaviour, &[&compiled.kind], precision.seed)?;
            if let Some(numbers) = &options.only_runs
                && !matches!(compiled.kind, Statistical::Simulation(_))
            {
                let (results, failure) =
                    block(behaviour, &compiled.kind, precision.seed, numbers.clone());
                // All other failures are found again where the query is answered.
                if let Some(Failure::RunTime(error)) = failure
                    && (error.kind == RunTimeErrorKind::Interrupted
                        || error.kind == RunTimeErrorKind::NoRoom && may_have_more_room)
                {
                    return Err(Failure::RunTime(error));
                }
                return Ok(Found {
                    block: Some(results),
                    ..Found::default()
                });
            }
            match &compiled.kind {
                Statistical::Simulation(asked) => {
                    let ends = |number| runs.ends(number);
                    let simulated = simulate(behaviour, asked, &precision, ends)?;
                    Ok(Found {
                        estimate: simulated.estimate.clone(),
                        simulated: Some(Arc::new(simulated)),
                        ..Found::default()
                    })
                }
                Statistical::Probability(bound, path) if splitting.is_some() => {
                    let wanted = splitting.as_ref().expect("it was just seen");
                    let ends = |number| runs.ends(number);
                    let asked = (bound, path);
                    let rare = estimate_rare(behaviour, asked, wanted, &precision, ends)?;
                    Ok(Found {
                        estimate: Some(rare.estimate.clone()),
                        rare: Some(rare),
                        ..Found::default()
                    })
                }
                kind @ Statistical::Comparison { .. } => {
                    let ends = |number| runs.ends(number);
                    let estimate = compare(runs_anywhere, kind, &precision, ends)?;
                    Ok(Found {
                        estimate: Some(estimate),
                        ..Found::default()
                    })
                }
                kind => {
                    let estimate = estimate_watched(runs_anywhere, kind, &precision, &mut runs)?;
                    Ok(Found {
                        estimate: Some(estimate),
                        values: runs.values(kind),
                        ..Found::default()
                    })
                }
            }
        });
        let mut answer = match result {
            Err((reason, counters)) => without_runs(reason, counters),
            Ok(Err(failure)) => {
                let verdict = self.after_failure(network, (&failure, &compiled), &watch)?;
                Answer::new(verdict, Counters::default())
            }
            Ok(Ok(found)) => {
                let verdict = verdict(&compiled.kind, found.estimate.as_ref(), &watch);
                let mut answer = Answer::new(verdict, Counters::default());
                if let Some(rare) = &found.rare {
                    answer.remark(splitting_remark(rare));
                }
                let method = found.estimate.as_ref().map(|estimate| estimate.method);
                if let Some(remark) = remark(&compiled.kind, verdict, method) {
                    answer.remark(remark);
                }
                let simulated = found.simulated;
                if simulated.as_ref().is_some_and(|simulated| simulated.is_cut) {
                    answer.remark(
                        "there is room for these runs only: ask for fewer, or for shorter ones",
                    );
                }
                answer.estimate = found.estimate;
                answer.simulated = simulated;
                answer.values_of_runs = found.values;
                answer.block = found.block;
                answer
            }
        };
        if let Some(name) = &query.under {
            self.note_freedom(&name.text, &mut answer);
        }
        answer.seconds = start.elapsed().as_secs_f64();
        answer.warnings = warnings;
        answer.load_seconds = self.load_seconds;
        Ok(answer)
    }

    /// How a query goes on of which a run failed: with a verdict, or not at all. All begins again
    /// if the pool has grown.
    pub(super) fn after_failure(
        &mut self,
        network: &Network,
        (failure, query): (&Failure, &StatisticalQuery),
        watch: &LimitWatch,
    ) -> Result<Verdict, Rejection> {
        if let Failure::RunTime(error) = failure {
            match error.kind {
                RunTimeErrorKind::Interrupted => return Ok(Verdict::Unknown(watch.stop())),
                RunTimeErrorKind::NoRoom if self.pool < GREATEST_POOL => self.pool *= 2,
                _ => {}
            }
        }
        Err(self.run_fails(network, failure, query))
    }

    pub(super) fn run_time_error(
        &self,
        network: &Network,
        error: crate::exec::RunTimeError,
    ) -> Rejection {
        let span = network.sites[error.site.0 as usize].span;
        if error.kind == RunTimeErrorKind::NoRoom {
            let template = self.sources.text(span);
            let message = format!(
                "a random run has more than {GREATEST_POOL} instances of '{template}' at a time"
            );
            let help =
                "let instances end with exit(), or bound the run: spawn seems to have no end";
            return self.failing(span, message, help);
        }
        if error.kind == RunTimeErrorKind::NotLoaded {
            let message = "a random run calls this function of a library that is not allowed";
            let missing = network.externals.iter().filter(|one| !one.is_loaded);
            let names: Vec<&str> = missing.map(|one| one.name.as_str()).collect();
            let help = allowing(&names, !self.libraries.allowed().is_empty());
            return self.failing(span, message.to_owned(), &help);
        }
        let what = crate::engine::format::text::run_time_error(error.kind);
        let message = format!("a random run ends in an error: {what}");
        self.failing(
            span,
            message,
            "correct the model, or keep it out of this state",
        )
    }

    /// Why a random run has no result, with the place in the model.
    pub(super) fn run_fails(
        &self,
        network: &Network,
        failure: &Failure,
        query: &StatisticalQuery,
    ) -> Rejection {
        let span = |stand: Stand| {
            let process = &network.processes[stand.process.0 as usize];
            process.locations[stand.location.0 as usize].span
        };
        let name = |stand: Stand| {
            let process = &network.processes[stand.process.0 as usize];
            let location = &process.locations[stand.location.0 as usize];
            format!("{}.{}", process.name, location.name)
        };
        let edge = |stand: Stand, EdgeId(edge): EdgeId| {
            network.processes[stand.process.0 as usize].edges[edge as usize].span
        };
        let (span, message, help) = match *failure {
            Failure::RunTime(error) => return self.run_time_error(network, error),
            Failure::NoRate(stand) => (
                span(stand),
                format!(
                    "{} can be left at any time: nothing says how long a random run stays",
                    name(stand)
                ),
                if query.under.is_some() {
                    "give the location an exponential rate, or an invariant that bounds the time; \
                     or ask with --under-choice eager or lazy"
                } else {
                    "give the location an exponential rate, or an invariant that bounds the time"
                },
            ),
            Failure::Rate(stand, rate) => (
                span(stand),
                format!("the exponential rate of {} is {rate}", name(stand)),
                "make it a number that is 0 or greater; with 0 the location is never left",
            ),
            Failure::ClockRate(stand) => (
                span(stand),
                format!(
                    "{} gives a clock a rate that is no finite number",
                    name(stand)
                ),
                "correct the rate",
            ),
            Failure::RatesConflict(first, second) => (
                span(second),
                format!(
                    "{} and {} set the rate of one clock",
                    name(first),
                    name(second)
                ),
                "let one process set the rate of a clock",
            ),
            Failure::Weight(stand, one) => (
                edge(stand, one),
                format!("a weight behind {} is negative or no number", name(stand)),
                "make all weights 0 or greater",
            ),
            Failure::NoWeight(stand, one) => (
                edge(stand, one),
                format!("all weights behind {} are 0", name(stand)),
                "make one of them positive, or guard the edge",
            ),
            Failure::TimeLock(stand) => (
                span(stand),
                format!(
                    "{} lets no more time pass, and nothing can happen",
                    name(stand)
                ),
                "widen its invariant, or give it an edge that is enabled in time",
            ),
            Failure::ValueOutOfBounds(value) => (
                query.span,
                format!("in a random run the value is {value}, which is not between the bounds"),
                "give wider ones: --value-bounds LOW,HIGH",
            ),
            Failure::InvariantBroken(stand) => (
                span(stand),
                format!(
                    "{} is entered while its invariant does not hold",
                    name(stand)
                ),
                "guard the edges that lead there",
            ),
            Failure::Zeno(stand) => (
                span(stand),
                format!(
                    "{ZENO_MOVES} moves take less than {ZENO_TIME} units of time; the last is of {}",
                    name(stand)
                ),
                "let time pass in every loop, or bound the run by its moves: [#<=1000]",
            ),
            Failure::ImpossibleDemand => (
                query.span,
                "the strategy demands a move that is not possible in a random run".to_owned(),
                "a strategy from a file must be one of this model: make it again",
            ),
            Failure::BoundNeverReached => (
                query.span,
                "the clock that bounds the run stands still, and nothing happens any more"
                    .to_owned(),
                "bound the run by time: [<=100]",
            ),
            Failure::BoundNotApproached(highest) => (
                query.span,
                format!(
                    "in {MOVES_WITHOUT_RISE} moves of a random run, the clock that bounds it does not \
                     rise above {highest}"
                ),
                "bound the run by time, [<=100], or by its moves, [#<=1000]",
            ),
            Failure::NoNumber => (
                query.span,
                "the value of the expression is no finite number in some run".to_owned(),
                "keep arguments of functions in their domains, and divisors away from 0",
            ),
            Failure::NotRepeatable => (
                query.span,
                format!(
                    "a run with the same random numbers went another way: of {}, some function is \
                     not deterministic",
                    imported(network)
                ),
                "let functions of libraries return the same for the same arguments",
            ),
            Failure::NoProgress(stand) => (
                span(stand),
                format!(
                    "a condition in {} changes more often than can be followed",
                    name(stand)
                ),
                "keep clocks and rates within a few orders of magnitude",
            ),
        };
        self.failing(span, message, help)
    }

    fn failing(&self, span: Span, message: String, help: &str) -> Rejection {
        let diagnostic = Diagnostic::new(codes::RUN_FAILS, span, message).help(help);
        Rejection::new(vec![diagnostic], &self.sources)
    }
}

fn is_test(query: &Statistical) -> bool {
    matches!(
        query,
        Statistical::Hypothesis { .. } | Statistical::Comparison { .. }
    )
}

/// The verdict that goes with an estimate.
pub(super) fn verdict(
    query: &Statistical,
    estimate: Option<&Estimate>,
    watch: &LimitWatch,
) -> Verdict {
    match estimate.and_then(|estimate| estimate.decision) {
        Some(Decision::Below) => Verdict::NotSatisfied,
        None if watch.has_stopped() => Verdict::Unknown(watch.stop()),
        None if is_test(query) => Verdict::Maybe,
        Some(Decision::AtLeast) | None => Verdict::Satisfied,
    }
}

/// What the numbers do not say themselves.
pub(super) fn remark(
    query: &Statistical,
    verdict: Verdict,
    method: Option<Method>,
) -> Option<&'static str> {
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

/// How to allow libraries of these names.
fn allowing(names: &[&str], is_given: bool) -> String {
    let found = if is_given {
        "none of what is allowed holds it; "
    } else {
        ""
    };
    format!(
        "{found}allow it with --allow-external and its file or folder: {}; this runs the code of the \
         library, so do it only if you trust it",
        names.join(", ")
    )
}

/// The functions that a model imports, for a sentence.
fn imported(network: &Network) -> String {
    let functions = network.externals.iter().flat_map(|one| &one.functions);
    let names: Vec<String> = functions.map(|name| format!("'{name}'")).collect();
    names.join(", ")
}
