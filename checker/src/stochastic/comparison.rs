//! Answers `Pr[…](…) >= Pr[…](…)`: runs in pairs, until the test decides.

use super::blocks::{Runs, from_anywhere, pair_of_runs};
use super::estimate::share;
use super::failure::Failure;
use super::precision::{Estimate, Precision};
use super::run_id::RunId;
use super::run_watch::Ends;
use super::statistics::DoubleSampling;
use crate::ir::Statistical;

/// After so many pairs the test gives up: two probabilities that are both near to 0 or 1 hardly
/// ever differ, and those that are equal may never be told apart.
const MOST_PAIRS: u64 = 1_000_000;

/// Answers a comparison; `ends` is asked now and then, with the number of runs so far.
///
/// # Errors
/// A run failed: that of the pair with the least number.
///
/// # Panics
/// The query is no comparison.
pub fn compare(
    runs: Runs<'_>,
    query: &Statistical,
    precision: &Precision,
    mut ends: impl FnMut(u64) -> bool,
) -> Result<Estimate, Failure> {
    let Statistical::Comparison {
        left,
        right,
        at_least,
    } = query
    else {
        panic!("this compares no probabilities");
    };
    let mut test = {
        let (u0, u1) = precision.odds_ratios;
        DoubleSampling::new(u0, u1, precision.alpha, precision.beta)
    };
    let mut decision = None;
    let (mut pairs, mut first, mut second) = (0, 0, 0);
    let said = left.0.runs.max(right.0.runs);
    let most = precision.runs.or(said).unwrap_or(MOST_PAIRS);
    from_anywhere(
        runs,
        precision.threads,
        Some(most),
        |runner, pair| {
            let (seed, run) = (precision.seed, 2 * pair);
            pair_of_runs(runner, left, right, RunId { seed, run })
        },
        |(left, right)| {
            pairs += 1;
            first += u64::from(left);
            second += u64::from(right);
            // p <= q is q >= p.
            let (greater, smaller) = if *at_least {
                (left, right)
            } else {
                (right, left)
            };
            decision = test.push(greater, smaller);
            decision.is_some() || pairs >= most
        },
        &mut Ends(|pairs| ends(2 * pairs)),
    )?;
    let is_complete = decision.is_some();
    let share = |satisfied| share(pairs, satisfied, precision.alpha, is_complete);
    Ok(Estimate {
        decision,
        compared: Some(Box::new(share(second))),
        ..share(first)
    })
}
