//! Answers to statistical queries: which results of runs are looked at, and until when.

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::in_order::in_order;
use super::precision::{Estimate, Precision};
use super::run::Trajectory;
use super::run_id::RunId;
use super::run_watch::Ends;
use super::statistics::{Method, clopper_pearson};
use crate::ir::Simulation;

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
    behaviour: Behaviour<'_>,
    query: &Simulation,
    precision: &Precision,
    ends: impl FnMut(u64) -> bool,
) -> Result<Simulated, Failure> {
    let wanted = precision.runs.or(query.bound.runs).unwrap_or(1);
    let most = query.filter.as_ref().map_or(u64::MAX, |(_, most)| *most);
    let mut shown = Vec::new();
    let (mut made, mut points, mut is_cut) = (0, 0, false);
    let is_complete = in_order(
        behaviour,
        precision.threads,
        |runner, run| {
            let seed = precision.seed;
            runner.trajectory(RunId { seed, run }, query)
        },
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
    let estimate = share(made, shown.len() as u64, precision.alpha, is_complete);
    Ok(Simulated {
        items: query.items.iter().map(|item| item.text.clone()).collect(),
        runs: shown,
        estimate: query.filter.is_some().then_some(estimate),
        is_cut,
    })
}

/// The estimate of a probability from the numbers of runs and of satisfied ones.
pub(super) fn share(runs: u64, satisfied: u64, alpha: f64, is_complete: bool) -> Estimate {
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
        compared: None,
        is_complete,
    }
}
