//! What is kept of the runs of a statistical query while they are made: how their values are
//! distributed, and the estimate so far for whoever waits.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::engine::limits::LimitWatch;
use crate::engine::options::{RunObserver, RunsSoFar};
use crate::ir::Statistical;
use crate::stochastic::statistics::{Expectation, Interval, clopper_pearson};
use crate::stochastic::{RunWatch, Samples, Shown, ValuesOfRuns};

/// How often the estimate so far is shown.
pub(super) const SHOW_EVERY: Duration = Duration::from_millis(100);

/// Watches the runs of a query.
pub(super) struct WatchedRuns<'w> {
    limits: &'w mut LimitWatch,
    observer: Option<RunObserver>,
    shown: Instant,
    alpha: f64,
    of_broken: bool,
    runs: u64,
    satisfied: u64,
    mean: Expectation,
    samples: Samples,
}

impl<'w> WatchedRuns<'w> {
    pub(super) fn new(
        query: &Statistical,
        alpha: f64,
        limits: &'w mut LimitWatch,
        observer: Option<RunObserver>,
    ) -> WatchedRuns<'w> {
        WatchedRuns {
            limits,
            observer,
            shown: Instant::now(),
            alpha,
            of_broken: ValuesOfRuns::are_of_broken(query),
            runs: 0,
            satisfied: 0,
            mean: Expectation::default(),
            samples: Samples::default(),
        }
    }

    /// What was seen; `None` if that is nothing, or the runs of such a query have no values.
    pub(super) fn values(self, query: &Statistical) -> Option<Arc<ValuesOfRuns>> {
        if self.runs == 0 {
            return None;
        }
        let values = ValuesOfRuns::new(query, self.runs, self.alpha, self.samples)?;
        Some(Arc::new(values))
    }

    /// The estimate of the runs until now.
    fn so_far(&self, runs: u64) -> RunsSoFar {
        let (estimate, interval) = if self.mean.count() > 0 {
            (self.mean.mean(), self.mean.student(self.alpha))
        } else if self.runs > 0 {
            let interval = clopper_pearson(self.satisfied, self.runs, self.alpha);
            (self.satisfied as f64 / self.runs as f64, Some(interval))
        } else {
            (f64::NAN, None)
        };
        let nothing = Interval {
            lower: f64::NAN,
            upper: f64::NAN,
        };
        RunsSoFar {
            runs,
            estimate,
            interval: interval.unwrap_or(nothing),
        }
    }
}

impl RunWatch for WatchedRuns<'_> {
    fn see(&mut self, shown: Shown) {
        self.runs += 1;
        match shown {
            Shown::Decided { satisfied, at } => {
                self.satisfied += u64::from(satisfied);
                if satisfied != self.of_broken {
                    self.samples.push(at);
                }
            }
            Shown::Value(value) => {
                self.mean.push(value);
                self.samples.push(value);
            }
        }
    }

    fn ends(&mut self, runs: u64) -> bool {
        if let Some(observer) = &self.observer
            && self.shown.elapsed() >= SHOW_EVERY
        {
            self.shown = Instant::now();
            (observer.0)(&self.so_far(runs));
        }
        self.limits.ends_runs(runs)
    }
}
