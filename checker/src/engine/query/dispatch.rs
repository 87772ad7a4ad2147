//! From a compiled query to its answer: which search each kind of query takes, within which limits.

use std::sync::Arc;

use crate::cancellation;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::freedom::Freedom;
use crate::ir::{Predicate, QueryKind};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Symmetry};
use crate::search::limits::StopReason;
use crate::search::optimum::extremum::Question;
use crate::zones::{Bound, wide};

use super::extremum::extremum;
use super::liveness::{always, leads_to};
use super::problem::{Followed, Problem};
use super::reachable::reachable;
use super::time_optimal::fastest;
use super::{game, partial_observation, time_clock};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::limits::{CLOCKS_GREW, LimitWatch, OUT_OF_STATES};
use crate::engine::loaded_model::{LoadedModel, PreparedQuery};

impl LoadedModel {
    /// Answers a query by a search or a game; a strategy to reach something leaves this much to
    /// choose.
    pub(in crate::engine) fn answer_in_zones(
        &self,
        prepared: &PreparedQuery,
        freedom: Option<Freedom>,
    ) -> Answer {
        let PreparedQuery {
            query,
            options,
            guide,
            under,
            ..
        } = prepared;
        let under = under.as_ref();
        let time_limit = under.and_then(|under| under.strategy.time_limit);
        let network = time_clock::with_limit(self.network(), time_limit);
        let moves = under.map(|under| ClosedLoop::new(&network, &under.strategy));
        let followed = moves.as_ref().zip(under);
        let problem = Problem {
            network: &network,
            executor: self.executor(),
            under: followed.map(|(moves, strategy)| Followed { moves, strategy }),
            options,
            guide: *guide,
            freedom,
        };
        let mut answer = answer_within_limits(problem, &query.kind);
        if time_limit.is_some() && query.strategy.is_none() {
            answer.evidence.forget_last_clock();
        }
        answer
    }
}

/// Answers a query that [`LoadedModel`] has accepted.
fn answer_within_limits(problem: Problem<'_>, query: &QueryKind) -> Answer {
    let options = problem.options;
    wide::start();
    let zone_bytes = problem.network.clocks.len().pow(2) * size_of::<Bound>();
    let at_hand_bytes = (zones_in_use(query) * zone_bytes) as u64;
    let mut watch = LimitWatch::with_at_hand(options.limits.clone(), at_hand_bytes);
    let result = watch.bound(|watch| {
        // Where there are thousands of clocks this alone may be too much.
        cancellation::ask_for(zone_bytes);
        dispatch(problem, query, watch)
    });
    let mut answer =
        result.unwrap_or_else(|(reason, counters)| Answer::new(Verdict::Unknown(reason), counters));
    // A user who interrupts does not need what is known until then.
    if answer.verdict == Verdict::Error(Failure::Interrupted) || watch.is_interrupted() {
        let counters = answer.counters;
        let verdict = Verdict::Unknown(watch.stop());
        answer = Answer::new(verdict, counters);
    }
    if answer.verdict == Verdict::Error(Failure::ClockRange) {
        let verdict = Verdict::Unknown(StopReason::Clocks);
        answer = Answer::new(verdict, answer.counters);
        answer.message = Some(CLOCKS_GREW.to_owned());
    }
    if watch.is_out_of_numbers() {
        answer.remark(OUT_OF_STATES);
    }
    if options.plans.is_some() {
        game::note_missing_plans(&mut answer, query, problem.under.is_some());
    }
    answer.measure(&watch);
    answer
}

/// The approximate greatest number of zones that one step of the search has in addition to those of
/// its account. It is greater where zones are cut by each other.
fn zones_in_use(kind: &QueryKind) -> usize {
    match kind {
        QueryKind::Reachable(predicate) | QueryKind::Invariantly(predicate)
            if !predicate::has_deadlock(predicate) =>
        {
            1
        }
        QueryKind::Extremum { .. } => 1,
        QueryKind::Control(_) => 4,
        _ => 8,
    }
}

/// What answers each kind of query.
fn dispatch(problem: Problem<'_>, query: &QueryKind, watch: &mut LimitWatch) -> Answer {
    match query {
        QueryKind::Reachable(goal) => reduced(problem, |symmetry| {
            reachable(problem, goal, symmetry, watch)
        }),
        QueryKind::Invariantly(invariant) => {
            let broken = invariant.negated();
            let answer = reduced(problem, |symmetry| {
                reachable(problem, &broken, symmetry, watch)
            });
            answer.negated()
        }
        QueryKind::PotentiallyAlways(keep) => always(problem, keep, watch),
        QueryKind::Eventually(goal) => {
            let keep = goal.negated();
            always(problem, &keep, watch).negated()
        }
        QueryKind::LeadsTo(cause, effect) => {
            let open = Predicate::And(vec![cause.clone(), effect.negated()]);
            let keep = effect.negated();
            leads_to(problem, &open, &keep, watch)
        }
        QueryKind::Extremum {
            least,
            greatest,
            predicate,
            items,
        } => {
            let question = Question {
                predicate,
                items,
                least: *least,
                greatest: *greatest,
                further: problem.atoms(),
            };
            reduced(problem, |symmetry| {
                extremum(problem, question, symmetry, watch)
            })
        }
        QueryKind::Control(control) => match (control.time_optimal, &control.observations) {
            (Some(bounds), _) => fastest(problem, control, bounds, watch),
            (None, Some(observations)) => {
                partial_observation::game(problem, &control.objective, observations, watch)
            }
            (None, None) => game::game(problem, control, watch),
        },
        QueryKind::SaveStrategy { .. }
        | QueryKind::LoadStrategy { .. }
        | QueryKind::Optimum(_)
        | QueryKind::Shield(_)
        | QueryKind::Statistical(_) => {
            unreachable!("neither files nor random runs need zones")
        }
    }
}

/// Answers with a search that treats states as the same if they differ only by exchanged members of
/// scalar sets, if that is wanted and sound. Whether a failure is met can depend on the order in
/// which a quantifier runs through members. So a failure that is found in this way is searched
/// again among all states.
fn reduced(
    problem: Problem<'_>,
    mut answer: impl FnMut(Option<&Arc<Symmetry>>) -> Answer,
) -> Answer {
    let is_allowed = problem.options.reductions.symmetry && problem.under.is_none();
    let symmetry = is_allowed
        .then(|| Symmetry::of_network(problem.network))
        .flatten();
    let first = answer(symmetry.as_ref());
    match first.verdict {
        Verdict::Error(failure) if symmetry.is_some() && failure != Failure::Interrupted => {
            answer(None)
        }
        _ => first,
    }
}
