//! What the results of runs say for one query: which are looked at, and when they are enough.
//!
//! Results come in the order of run numbers, so what is said does not depend on threads.

use super::blocks::{Runs, from_anywhere, shown};
use super::failure::Failure;
use super::precision::{Estimate, MeanMethod, Precision};
use super::run_id::RunId;
use super::run_watch::{RunWatch, Shown};
use super::statistics::{
    BoundedMean, Decision, Distribution, Expectation, FixedWidth, Interval, Method,
    ProbabilitySequence, SequentialTest, clopper_pearson,
};
use crate::ir::Statistical;

/// The results of runs, for one query.
#[derive(Clone, Debug)]
pub(super) struct Collector {
    precision: Precision,
    /// The number of runs that is wanted; `None` leaves it to the results.
    wanted: Option<u64>,
    runs: u64,
    satisfied: u64,
    /// The mean of the results.
    mean: Expectation,
    /// The number of runs at which a confidence sequence is looked at again.
    next_look: u64,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Fixed(FixedWidth),
    Sequence,
    Test {
        test: SequentialTest,
        at_least: bool,
        decision: Option<Decision>,
    },
    Student,
    Bounded(BoundedMean),
    Distribution(Distribution),
}

/// Confidence sequences are looked at so much more seldom than runs are made.
const RUNS_FOR_A_LOOK: u64 = 1000;

impl Collector {
    /// One for a query whose answer is an estimate.
    pub(super) fn new(query: &Statistical, precision: &Precision) -> Collector {
        let (wanted, kind) = match query {
            Statistical::Probability(bound, _) => (bound.runs, Collector::probability(precision)),
            Statistical::Hypothesis {
                bound,
                at_least,
                threshold,
                ..
            } => {
                let (below, above) = precision.delta;
                // p <= t is "not p at least 1 - t" with satisfied runs counted as they are.
                let (threshold, deltas) = if *at_least {
                    (*threshold, (below, above))
                } else {
                    (1.0 - *threshold, (above, below))
                };
                let test = SequentialTest::new(threshold, deltas, precision.alpha, precision.beta);
                let kind = Kind::Test {
                    test,
                    at_least: *at_least,
                    decision: None,
                };
                (bound.runs, kind)
            }
            Statistical::Expectation { bound, range, .. } => {
                let said = precision.runs.or(bound.runs);
                let wanted = said.or_else(|| precision.assumed_runs(bound));
                (wanted, Collector::mean(precision, *range, wanted))
            }
            Statistical::Comparison { .. } => {
                unreachable!("probabilities are compared by `compare`")
            }
            Statistical::Simulation(_) => unreachable!("runs are shown by `simulate`"),
        };
        Collector {
            precision: *precision,
            wanted: precision.runs.or(wanted),
            runs: 0,
            satisfied: 0,
            mean: Expectation::default(),
            next_look: 1,
            kind,
        }
    }

    fn probability(precision: &Precision) -> Kind {
        if precision.is_sequential() {
            Kind::Sequence
        } else {
            Kind::Fixed(FixedWidth::new(precision.alpha, precision.epsilon))
        }
    }

    fn mean(precision: &Precision, proven: Option<(f64, f64)>, wanted: Option<u64>) -> Kind {
        let bounds = precision.value_bounds.or(proven);
        match (precision.mean_method, bounds) {
            (MeanMethod::DvoretzkyKieferWolfowitz, Some(bounds)) => {
                Kind::Distribution(Distribution::new(bounds))
            }
            (MeanMethod::Auto | MeanMethod::EmpiricalBernstein, Some(bounds)) => {
                let planned = wanted.filter(|_| !precision.is_sequential());
                Kind::Bounded(BoundedMean::new(bounds, precision.alpha, planned))
            }
            (MeanMethod::Student, _) | (_, None) => Kind::Student,
        }
    }

    /// Adds the result of a run: for probabilities 1 or 0. Returns whether it is the last one.
    pub(super) fn push(&mut self, value: f64) -> Result<bool, Failure> {
        self.runs += 1;
        let satisfied = value != 0.0;
        self.satisfied += u64::from(satisfied);
        if let Some((low, high)) = self.precision.value_bounds
            && self.is_mean()
            && !(low <= value && value <= high)
        {
            return Err(Failure::ValueOutOfBounds(value));
        }
        if self.is_mean() {
            self.mean.push(value);
        }
        let is_enough = match &mut self.kind {
            Kind::Fixed(rule) => self.wanted.is_none() && rule.push(satisfied),
            Kind::Test {
                test,
                at_least,
                decision,
            } => {
                *decision = test.push(satisfied == *at_least);
                decision.is_some()
            }
            Kind::Sequence | Kind::Student => false,
            Kind::Bounded(mean) => {
                mean.push(value);
                false
            }
            Kind::Distribution(values) => {
                values.push(value);
                false
            }
        };
        Ok(is_enough || self.wanted.is_some_and(|most| self.runs >= most) || self.is_near())
    }

    /// Whether a confidence sequence is narrow enough.
    fn is_near(&mut self) -> bool {
        if !self.precision.is_sequential() || self.runs < self.next_look {
            return false;
        }
        self.next_look = self.runs + 1 + self.runs / RUNS_FOR_A_LOOK;
        let Precision {
            alpha,
            epsilon,
            relative,
            ..
        } = self.precision;
        match &self.kind {
            Kind::Sequence => {
                let share = self.satisfied as f64 / self.runs as f64;
                let half = match (relative, self.wanted) {
                    (Some(part), _) => part * share,
                    (None, None) => epsilon,
                    (None, Some(_)) => return false,
                };
                half > 0.0
                    && ProbabilitySequence::after(self.runs, self.satisfied).is_within(half, alpha)
            }
            Kind::Bounded(mean) => {
                let Some(part) = relative else { return false };
                let (mean, interval) = (self.mean.mean(), mean.interval());
                let half = (mean - interval.lower).max(interval.upper - mean);
                half <= part * mean.abs()
            }
            _ => false,
        }
    }

    fn is_mean(&self) -> bool {
        matches!(
            self.kind,
            Kind::Student | Kind::Bounded(_) | Kind::Distribution(_)
        )
    }

    /// What the runs until now say.
    pub(super) fn estimate(&self, is_complete: bool) -> Estimate {
        let (alpha, runs) = (self.precision.alpha, self.runs);
        let share = self.satisfied as f64 / runs as f64;
        let unknown = Interval {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        };
        let (value, interval, method) = match &self.kind {
            Kind::Fixed(_) | Kind::Test { .. } => {
                let interval = clopper_pearson(self.satisfied, runs, alpha);
                (share, interval, Method::ClopperPearson)
            }
            Kind::Sequence => {
                let sequence = ProbabilitySequence::after(runs, self.satisfied);
                (share, sequence.interval(alpha), Method::ConfidenceSequence)
            }
            Kind::Student => {
                let interval = self.mean.student(alpha).unwrap_or(unknown);
                (self.mean.mean(), interval, Method::Student)
            }
            Kind::Bounded(mean) => {
                let method = if self.precision.is_sequential() {
                    Method::EmpiricalBernsteinSequence
                } else {
                    Method::EmpiricalBernstein
                };
                (self.mean.mean(), mean.interval(), method)
            }
            Kind::Distribution(values) => (
                self.mean.mean(),
                values.interval(alpha),
                Method::DvoretzkyKieferWolfowitz,
            ),
        };
        let decision = match &self.kind {
            Kind::Test { decision, .. } => *decision,
            _ => None,
        };
        Estimate {
            value,
            lower: interval.lower,
            upper: interval.upper,
            confidence: 1.0 - alpha,
            method,
            runs,
            satisfied_runs: (!self.is_mean()).then_some(self.satisfied),
            decision,
            compared: None,
            is_complete,
        }
    }
}

/// Answers a statistical query whose runs are watched.
///
/// # Errors
/// A run failed: the one with the least number.
pub fn estimate(
    runs: Runs<'_>,
    query: &Statistical,
    precision: &Precision,
    ends: &mut dyn RunWatch,
) -> Result<Estimate, Failure> {
    let mut collector = Collector::new(query, precision);
    let most = collector.wanted;
    let mut failure = None;
    let mut push = |value: f64| match collector.push(value) {
        Ok(is_last) => is_last,
        Err(found) => {
            failure = Some(found);
            true
        }
    };
    let is_complete = from_anywhere(
        runs,
        precision.threads,
        most,
        |runner, run| {
            let seed = precision.seed;
            shown(runner, query, RunId { seed, run })
        },
        |shown| match shown {
            Shown::Decided { satisfied, .. } => push(f64::from(satisfied)),
            Shown::Value(value) => push(value),
        },
        ends,
    )?;
    match failure {
        Some(failure) => Err(failure),
        None => Ok(collector.estimate(is_complete)),
    }
}
