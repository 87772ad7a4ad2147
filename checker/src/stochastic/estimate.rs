//! Answers to statistical queries: which results of runs are looked at, and until when.

use super::failure::Failure;
use super::in_order::in_order;
use super::run::Trajectory;
use super::statistics::{Decision, Expectation, FixedWidth, SequentialTest, clopper_pearson};
use crate::exec::Executor;
use crate::ir::{Network, Path, RunBound, Simulation, Statistical};

/// What an estimate is to promise, and how it is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Precision {
    /// The risk that the interval misses, or that a test says "below" wrongly.
    pub alpha: f64,
    /// The risk that a test says "at least" wrongly.
    pub beta: f64,
    /// Half the width of the interval of a probability.
    pub epsilon: f64,
    /// So near to its threshold a test promises nothing.
    pub delta: f64,
    /// How many runs are made; `None` leaves it to the query and to the results.
    pub runs: Option<u64>,
    /// The seed of all random numbers.
    pub seed: u64,
    /// How many threads make runs; results do not depend on it.
    pub threads: usize,
}

impl Default for Precision {
    fn default() -> Precision {
        Precision {
            alpha: 0.05,
            beta: 0.05,
            epsilon: 0.05,
            delta: 0.01,
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
    /// The confidence of the interval, if the number of runs was not chosen by the results.
    pub confidence: f64,
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
    mut ends: impl FnMut(u64) -> bool,
) -> Result<Estimate, Failure> {
    let program = (network, executor);
    match query {
        Statistical::Probability(bound, path) => {
            probability(program, bound, path, precision, &mut ends)
        }
        Statistical::Hypothesis {
            bound,
            path,
            at_least,
            threshold,
        } => {
            // p <= t is "not p at least 1 - t" with satisfied runs counted as they are.
            let mut test = SequentialTest::new(
                if *at_least {
                    *threshold
                } else {
                    1.0 - *threshold
                },
                precision.delta,
                precision.alpha,
                precision.beta,
            );
            let mut decision = None;
            let mut counted = (0, 0);
            let most = precision.runs.or(bound.runs).unwrap_or(u64::MAX);
            in_order(
                program,
                precision.threads,
                |runner, run| runner.path((precision.seed, run), bound, path),
                |outcome| {
                    counted = (counted.0 + 1, counted.1 + u64::from(outcome.satisfied));
                    decision = test.push(outcome.satisfied == *at_least);
                    decision.is_some() || counted.0 >= most
                },
                &mut ends,
            )?;
            let estimate = share(counted, precision.alpha, decision.is_some());
            Ok(Estimate {
                decision,
                ..estimate
            })
        }
        Statistical::Simulation(_) => unreachable!("runs are shown by `simulate`"),
        Statistical::Expectation {
            bound,
            maximum,
            value,
        } => {
            let wanted = precision.runs.or(bound.runs).unwrap_or(1);
            let mut mean = Expectation::default();
            let is_complete = in_order(
                program,
                precision.threads,
                |runner, run| runner.extreme((precision.seed, run), bound, *value, *maximum),
                |(value, _)| {
                    mean.push(value);
                    mean.count() >= wanted
                },
                &mut ends,
            )?;
            let interval = mean.student(precision.alpha);
            let (lower, upper) = interval.map_or((f64::NEG_INFINITY, f64::INFINITY), |interval| {
                (interval.lower, interval.upper)
            });
            Ok(Estimate {
                value: mean.mean(),
                lower,
                upper,
                confidence: 1.0 - precision.alpha,
                runs: mean.count(),
                satisfied_runs: None,
                decision: None,
                is_complete,
            })
        }
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
}

/// All runs that are shown have at most so many points together: each takes 16 bytes.
const MOST_POINTS: usize = 10_000_000;

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
    let (mut made, mut points) = (0, 0);
    let is_complete = in_order(
        (network, executor),
        precision.threads,
        |runner, run| runner.trajectory((precision.seed, run), query),
        |trajectory| {
            made += 1;
            if trajectory.satisfied {
                points += trajectory.points.iter().map(Vec::len).sum::<usize>();
                shown.push(trajectory);
            }
            made >= wanted || shown.len() as u64 >= most || points >= MOST_POINTS
        },
        ends,
    )?;
    let counted = (made, shown.len() as u64);
    let estimate = share(counted, precision.alpha, is_complete);
    Ok(Simulated {
        items: query.items.iter().map(|item| item.text.clone()).collect(),
        runs: shown,
        estimate: query.filter.is_some().then_some(estimate),
    })
}

fn probability(
    program: (&Network, &dyn Executor),
    bound: &RunBound,
    path: &Path,
    precision: &Precision,
    ends: &mut dyn FnMut(u64) -> bool,
) -> Result<Estimate, Failure> {
    let wanted = precision.runs.or(bound.runs);
    let mut rule = FixedWidth::new(precision.alpha, precision.epsilon);
    let is_complete = in_order(
        program,
        precision.threads,
        |runner, run| runner.path((precision.seed, run), bound, path),
        |outcome| {
            let is_narrow = rule.push(outcome.satisfied);
            match wanted {
                Some(wanted) => rule.runs() >= wanted,
                None => is_narrow,
            }
        },
        ends,
    )?;
    let counted = (rule.runs(), rule.satisfied());
    Ok(share(counted, precision.alpha, is_complete))
}

/// The estimate of a probability from the numbers of runs and of satisfied ones.
fn share((runs, satisfied): (u64, u64), alpha: f64, is_complete: bool) -> Estimate {
    let interval = clopper_pearson(satisfied, runs, alpha);
    Estimate {
        value: satisfied as f64 / runs as f64,
        lower: interval.lower,
        upper: interval.upper,
        confidence: 1.0 - alpha,
        runs,
        satisfied_runs: Some(satisfied),
        decision: None,
        is_complete,
    }
}
