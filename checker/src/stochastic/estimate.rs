//! Answers to statistical queries: which results of runs are looked at, and until when.

use super::collector::Collector;
use super::failure::Failure;
use super::in_order::in_order;
use super::run::Trajectory;
use super::run_watch::{Ends, RunWatch};
use super::statistics::{Decision, Method, clopper_pearson};
use crate::exec::Executor;
use crate::ir::{Network, Simulation, Statistical};

/// What an estimate is to promise, and how it is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// The risk that the interval misses, or that a test says "below" wrongly.
    pub alpha: f64,
    /// The risk that a test says "at least" wrongly.
    pub beta: f64,
    /// Half the width of the interval of a probability.
    pub epsilon: f64,
    /// So far below and above its threshold a test promises nothing.
    pub delta: (f64, f64),
    /// A comparison of two probabilities promises nothing if the ratio of their odds lies between
    /// these.
    pub odds_ratios: (f64, f64),
    /// The step with which equations of clocks are solved; `None` leaves it to their errors.
    pub discretisation: Option<f64>,
    /// Whether intervals hold at every moment, so that anyone may look and stop.
    pub anytime: bool,
    /// Runs are made until both ends of the interval are within this part of the estimate.
    pub relative: Option<f64>,
    /// Between which numbers the values lie whose mean is asked for, if the user says so.
    pub value_bounds: Option<(f64, f64)>,
    /// What makes the interval of a mean.
    pub mean_method: MeanMethod,
    /// How many runs are made; `None` leaves it to the query and to the results.
    pub runs: Option<u64>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// How many threads make runs; results do not depend on it.
    pub threads: usize,
}

/// What makes the interval of a mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeanMethod {
    /// Empirical Bernstein intervals if bounds of the values are known, else Student's.
    Auto,
    /// Student's, which is right in the limit of many runs only.
    Student,
    /// Empirical Bernstein intervals; bounds of the values must be known.
    EmpiricalBernstein,
    /// By a band around the distribution; bounds of the values must be known.
    DvoretzkyKieferWolfowitz,
}

impl Precision {
    /// Whether the number of runs may depend on the results in any way.
    pub(super) fn is_sequential(&self) -> bool {
        self.anytime || self.relative.is_some()
    }
}

impl Default for Precision {
    fn default() -> Precision {
        Precision {
            alpha: 0.05,
            beta: 0.05,
            epsilon: 0.05,
            delta: (0.01, 0.01),
            odds_ratios: (0.9, 1.1),
            discretisation: None,
            anytime: false,
            relative: None,
            value_bounds: None,
            mean_method: MeanMethod::Auto,
            runs: None,
            seed: 0,
            threads: 1,
        }
    }
}

/// What was found out.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The share of runs that are satisfied, or the mean of their values.
    pub value: f64,
    /// The least value of the interval.
    pub lower: f64,
    /// The greatest value of the interval.
    pub upper: f64,
    /// The confidence of the interval; the method says what it means.
    pub confidence: f64,
    /// What made the interval.
    pub method: Method,
    /// How many runs were made.
    pub runs: u64,
    /// How many of them are satisfied; `None` for expectations.
    pub satisfied_runs: Option<u64>,
    /// What a test decided.
    pub decision: Option<Decision>,
    /// Whether all runs were made that were wanted.
    pub is_complete: bool,
}

/// Answers a statistical query; `ends` is asked now and then, with the number of runs so far.
///
/// # Errors
/// A run failed: the one with the least number.
pub fn estimate(
    network: &Network,
    executor: &dyn Executor,
    query: &Statistical,
    precision: &Precision,
    ends: impl FnMut(u64) -> bool,
) -> Result<Estimate, Failure> {
    estimate_watched(network, executor, query, precision, &mut Ends(ends))
}

/// Answers a statistical query whose runs are watched.
///
/// # Errors
/// A run failed: the one with the least number.
pub fn estimate_watched(
    network: &Network,
    executor: &dyn Executor,
    query: &Statistical,
    precision: &Precision,
    ends: &mut dyn RunWatch,
) -> Result<Estimate, Failure> {
    let program = (network, executor);
    let mut collector = Collector::new(query, precision);
    let mut failure = None;
    let mut push = |value: f64| match collector.push(value) {
        Ok(is_last) => is_last,
        Err(found) => {
            failure = Some(found);
            true
        }
    };
    let seed = precision.seed;
    let is_complete = match query {
        Statistical::Probability(bound, path) | Statistical::Hypothesis { bound, path, .. } => {
            in_order(
                program,
                precision.threads,
                |runner, run| runner.path((seed, run), bound, path),
                |outcome| push(f64::from(outcome.satisfied)),
                ends,
            )?
        }
        Statistical::Expectation {
            bound,
            maximum,
            value,
            ..
        } => in_order(
            program,
            precision.threads,
            |runner, run| runner.extreme((seed, run), bound, *value, *maximum),
            |(value, _)| push(value),
            ends,
        )?,
        Statistical::Simulation(_) => unreachable!("runs are shown by `simulate`"),
    };
    match failure {
        Some(failure) => Err(failure),
        None => Ok(collector.estimate(is_complete)),
    }
}

/// The runs that a query shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulated {
    /// The texts of what is shown.
    pub items: Vec<String>,
    /// The runs, in the order of their numbers.
    pub runs: Vec<Trajectory>,
    /// How likely it is that a run reaches what it must, if it must.
    pub estimate: Option<Estimate>,
    /// Whether runs were left out because there was no more room.
    pub is_cut: bool,
}

/// All runs that are shown have at most this number of points together: each takes 16 bytes.
const MOST_POINTS: usize = 10_000_000;
/// A run takes as much memory beside its points as this number of points.
const POINTS_OF_A_RUN: usize = 16;

/// Answers `simulate`; `ends` is asked now and then, with the number of runs so far.
///
/// # Errors
/// A run failed: the one with the least number.
pub fn simulate(
    network: &Network,
    executor: &dyn Executor,
    query: &Simulation,
    precision: &Precision,
    ends: impl FnMut(u64) -> bool,
) -> Result<Simulated, Failure> {
    let wanted = precision.runs.or(query.bound.runs).unwrap_or(1);
    let most = query.filter.as_ref().map_or(u64::MAX, |(_, most)| *most);
    let mut shown = Vec::new();
    let (mut made, mut points, mut is_cut) = (0, 0, false);
    let is_complete = in_order(
        (network, executor),
        precision.threads,
        |runner, run| runner.trajectory((precision.seed, run), query),
        |trajectory| {
            made += 1;
            if trajectory.satisfied {
                points += POINTS_OF_A_RUN;
                points += trajectory.points.iter().map(Vec::len).sum::<usize>();
                shown.push(trajectory);
            }
            let is_enough = made >= wanted || shown.len() as u64 >= most;
            is_cut = !is_enough && points >= MOST_POINTS;
            is_enough || is_cut
        },
        &mut Ends(ends),
    )?;
    let counted = (made, shown.len() as u64);
    let estimate = share(counted, precision.alpha, is_complete);
    Ok(Simulated {
        items: query.items.iter().map(|item| item.text.clone()).collect(),
        runs: shown,
        estimate: query.filter.is_some().then_some(estimate),
        is_cut,
    })
}

/// The estimate of a probability from the numbers of runs and of satisfied ones.
fn share((runs, satisfied): (u64, u64), alpha: f64, is_complete: bool) -> Estimate {
    let interval = clopper_pearson(satisfied, runs, alpha);
    Estimate {
        value: satisfied as f64 / runs as f64,
        lower: interval.lower,
        upper: interval.upper,
        confidence: 1.0 - alpha,
        method: Method::ClopperPearson,
        runs,
        satisfied_runs: Some(satisfied),
        decision: None,
        is_complete,
    }
}
