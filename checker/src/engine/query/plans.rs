//! The plans of a solved game, as many as are wanted.

use crate::cancellation::{self, Cut};
use crate::game::solver::Solver;
use crate::game::strategy::plans::{NoPlans, Plan, Plans};
use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};

use crate::engine::answer::{Answer, Verdict};
use crate::engine::limits::{cut_as_interrupted, stop_text};

/// Adds at most this many plans to the answer for a solved game.
pub(super) fn add_plans(
    answer: &mut Answer,
    solver: &mut Solver<'_, '_, '_>,
    most: usize,
    watch: &mut dyn Watch,
) {
    if answer.verdict == Verdict::NotSatisfied {
        answer.evidence.plans = Some(Vec::new());
        return;
    }
    match plans(solver, most) {
        Ok(Ok((plans, end))) => {
            answer.evidence.plans = Some(plans);
            answer.evidence.has_more_plans = end != EndOfPlans::All;
            if end == EndOfPlans::Stopped {
                let reason = watch.look(&solver.counters());
                let reason = stop_text(reason.unwrap_or(StopReason::Interrupted));
                answer.message = Some(format!("there may be more plans: {reason}"));
            }
        }
        Ok(Err(NoPlans::EnvironmentChooses)) => {
            let message = "the environment has choices, so the strategy is no list of plans";
            answer.message = Some(message.to_owned());
        }
        Err(failure) => answer.verdict = Verdict::Error(failure),
    }
}

/// What follows the plans that are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EndOfPlans {
    /// None.
    All,
    /// More than are wanted, or, after a single one, nobody looked.
    More,
    /// A limit came first.
    Stopped,
}

/// Plans between two checks of the memory that they take.
const PLANS_BETWEEN_LOOKS: usize = 256;

/// At most this many plans, and what follows them.
fn plans(
    solver: &mut Solver<'_, '_, '_>,
    most: usize,
) -> Result<Result<(Vec<Plan>, EndOfPlans), NoPlans>, Failure> {
    let mut paths = match Plans::new(solver) {
        Ok(paths) => paths,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut plans = Vec::new();
    let mut bytes = 0;
    loop {
        if plans.len().is_multiple_of(PLANS_BETWEEN_LOOKS) && bytes > 0 {
            match cancellation::unless_cut(|| cancellation::ask_for(bytes)) {
                Ok(()) => {}
                Err(Cut) => return Ok(Ok((plans, EndOfPlans::Stopped))),
            }
        }
        let next = cut_as_interrupted(|| match paths.next_path().map(<[u32]>::to_vec) {
            Some(path) => paths.plan_of_path(&path).map(Some),
            None => Ok(None),
        });
        match next {
            Ok(None) => return Ok(Ok((plans, EndOfPlans::All))),
            Ok(Some(_)) if plans.len() == most => return Ok(Ok((plans, EndOfPlans::More))),
            Ok(Some(plan)) => {
                bytes += plan.heap_bytes();
                plans.push(plan);
            }
            Err(Failure::Interrupted) => return Ok(Ok((plans, EndOfPlans::Stopped))),
            Err(failure) => return Err(failure),
        }
        if most == 1 {
            return Ok(Ok((plans, EndOfPlans::More)));
        }
    }
}
