//! Whether runs can be repeated: what a library computes may change from call to call.

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::run::Runner;
use super::run_id::RunId;
use crate::ir::{Asked, Statistical};

/// How many runs are made twice.
const RUNS: u64 = 3;

/// What is seen of a run, bit by bit: its values, and how many moves it took.
type Seen = Vec<u64>;

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
    if let Statistical::Simulation(shown) = query {
        let trajectory = runner.trajectory(run, shown)?;
        let points = trajectory.points.iter().flatten();
        let bits = points.flat_map(|(time, value)| [time.to_bits(), value.to_bits()]);
        return Ok(bits.collect());
    }
    let asked = match query {
        Statistical::Comparison { left, right, .. } => [left, right]
            .map(|(bound, path)| (bound, Some(Asked::Path(path))))
            .to_vec(),
        query => vec![(query.bound(), query.asked())],
    };
    let mut seen = Vec::new();
    for (bound, asked) in asked {
        let outcome = runner.observe(run, bound, asked.expect("runs that are not shown"))?;
        seen.extend([outcome.value, outcome.time].map(f64::to_bits));
        seen.push(outcome.moves);
    }
    Ok(seen)
}
