//! Whether runs can be repeated: what a library computes may change from call to call.

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::run::Runner;
use super::run_id::RunId;
use crate::ir::Statistical;

/// How many runs are made twice.
const RUNS: u64 = 3;

/// What is seen of a run, bit by bit: its values and how many moves it took.
type Seen = (Vec<u64>, u64);

/// Makes the first runs of a query twice; whether they are the same both times.
///
/// # Errors
/// A run fails, for the first time or the second.
pub fn is_repeatable(
    behaviour: Behaviour<'_>,
    query: &Statistical,
    seed: u64,
) -> Result<bool, Failure> {
    let mut runner = Runner::of(behaviour);
    for run in 0..RUNS {
        let id = RunId { seed, run };
        let first = seen(&mut runner, query, id)?;
        if seen(&mut runner, query, id)? != first {
            return Ok(false);
        }
    }
    Ok(true)
}

fn seen(runner: &mut Runner<'_>, query: &Statistical, run: RunId) -> Result<Seen, Failure> {
    match query {
        Statistical::Probability(bound, path) | Statistical::Hypothesis { bound, path, .. } => {
            let outcome = runner.path(run, bound, path)?;
            let satisfied = u64::from(outcome.satisfied);
            Ok((vec![satisfied, outcome.time.to_bits()], outcome.moves))
        }
        Statistical::Expectation {
            bound,
            maximum,
            value,
            ..
        } => {
            let (value, moves) = runner.extreme(run, bound, *value, *maximum)?;
            Ok((vec![value.to_bits()], moves))
        }
        Statistical::Comparison { left, right, .. } => {
            let mut seen = Vec::new();
            let mut moves = 0;
            for (bound, path) in [left, right] {
                let outcome = runner.path(run, bound, path)?;
                seen.extend([u64::from(outcome.satisfied), outcome.time.to_bits()]);
                moves += outcome.moves;
            }
            Ok((seen, moves))
        }
        Statistical::Simulation(asked) => {
            let trajectory = runner.trajectory(run, asked)?;
            let points = trajectory.points.iter().flatten();
            let bits = points.flat_map(|(time, value)| [time.to_bits(), value.to_bits()]);
            Ok((bits.collect(), 0))
        }
    }
}
