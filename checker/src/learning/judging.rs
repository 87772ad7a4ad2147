//! What runs are worth on which learning never looked.

use std::ops::Range;

use crate::ir::{Aim, Asked, Optimum};
use crate::stochastic::statistics::{Expectation, Interval, Method, clopper_pearson};
use crate::stochastic::{Behaviour, Estimate, Failure, Precision, RunId, Runner, runs_by};

/// Makes these runs, and says what they are worth; `None` if it was ended before the second one.
///
/// # Errors
/// A run failed.
pub fn judge(
    behaviour: Behaviour<'_>,
    asked: &Optimum,
    precision: &Precision,
    runs: Range<u64>,
    ends: impl FnMut(u64) -> bool,
) -> Result<Option<Estimate>, Failure> {
    let Precision {
        seed,
        threads,
        alpha,
        ..
    } = *precision;
    let mut values = Expectation::default();
    let run = |runner: &mut Runner<'_>, run| {
        let outcome = runner.observe(RunId { seed, run }, &asked.bound, Asked::End(asked))?;
        if outcome.value.is_finite() {
            Ok(outcome.value)
        } else {
            Err(Failure::NoNumber)
        }
    };
    let mut runners = Runner::several(behaviour, threads);
    let is_complete = runs_by(&mut runners, runs, run, |value| values.push(value), ends)?;
    let runs = values.count();
    if runs < 2 {
        return Ok(None);
    }
    let is_probability = asked.aim == Aim::Probability;
    let satisfied = (values.mean() * runs as f64).round() as u64;
    let interval = if is_probability {
        Some(clopper_pearson(satisfied, runs, alpha))
    } else {
        values.student(alpha)
    };
    let Interval { lower, upper } = interval.expect("there are two values");
    Ok(Some(Estimate {
        value: values.mean(),
        lower,
        upper,
        confidence: 1.0 - alpha,
        method: if is_probability {
            Method::ClopperPearson
        } else {
            Method::Student
        },
        runs,
        satisfied_runs: is_probability.then_some(satisfied),
        decision: None,
        compared: None,
        is_complete,
    }))
}

/// How a strategy compares with the uniform choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// It is better: the intervals do not meet.
    Better,
    /// It is worse.
    Worse,
    /// The runs do not tell.
    Alike,
}

/// Compares the values of runs under a strategy and of those that choose uniformly.
pub fn compared(strategy: &Estimate, uniform: &Estimate, is_greatest: bool) -> Comparison {
    let (above, below) = (
        strategy.lower > uniform.upper,
        strategy.upper < uniform.lower,
    );
    match (above, below) {
        (true, _) if is_greatest => Comparison::Better,
        (_, true) if !is_greatest => Comparison::Better,
        (false, false) => Comparison::Alike,
        _ => Comparison::Worse,
    }
}
