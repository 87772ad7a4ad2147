//! The plans of a solved game, as many as are wanted.

use std::sync::Arc;

use crate::game::solver::Solver;
use crate::game::strategy::plan_list::{EndOfPlans, PlanList, list_plans};
use crate::game::strategy::plans::NoPlans;
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
        answer.evidence.plans = Some(Arc::default());
        return;
    }
    let (plans, end) = match cut_as_interrupted(|| list_plans(solver, most as u64)) {
        Ok(Ok(listed)) => listed,
        Ok(Err(NoPlans::EnvironmentChooses)) => {
            let message = "the environment has choices, so the strategy is no list of plans";
            answer.message = Some(message.to_owned());
            return;
        }
        Err(Failure::Interrupted) => (PlanList::default(), EndOfPlans::Stopped),
        Err(failure) => {
            answer.verdict = Verdict::Error(failure);
            return;
        }
    };
    answer.evidence.plans = Some(Arc::new(plans));
    answer.evidence.has_more_plans = end != EndOfPlans::All;
    if end == EndOfPlans::Stopped {
        let reason = watch.look(&solver.counters());
        let reason = reason.unwrap_or(StopReason::Interrupted);
        answer.evidence.plans_stop = Some(reason);
        answer.message = Some(format!("there may be more plans: {}", stop_text(reason)));
    }
}
