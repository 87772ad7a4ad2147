//! From a compiled query to its answer: which search each kind of query takes, within which limits.

use std::sync::Arc;
use std::time::Instant;

use crate::cancellation;
use crate::game::strategy::Under;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::freedom::Freedom;
use crate::ir::{Predicate, Query, QueryKind};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Symmetry};
use crate::search::limits::StopReason;
use crate::search::optimum::extremum::Question;
use crate::zones::{Bound, wide};

use super::extremum::extremum;
use super::liveness::{always, leads_to};
use super::partial_observation::ObservedGame;
use super::reachable::reachable;
use super::subject::{Followed, Subject};
use super::time_optimal::{Race, fastest};
use super::{game, partial_observation, time_clock};
use crate::engine::answer::{Answer, Verdict};
use crate::engine::evidence::strategy_check::Asked;
use crate::engine::limits::{CLOCKS_GREW, LimitWatch, OUT_OF_STATES};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::Options;

impl LoadedModel {
    /// Answers a query that is no file operation, under this strategy.
    pub(crate) fn answer_within(
        &self,
        query: &Query,
        options: &Options,
        within: Option<&Arc<Under>>,
    ) -> Answer {
        self.answer_leaving(query, options, within, None)
    }

    /// The same; a strategy to reach something leaves this much to choose.
    pub(crate) fn answer_leaving(
        &self,
        query: &Query,
        options: &Options,
        within: Option<&Arc<Under>>,
        freedom: Option<Freedom>,
    ) -> Answer {
        let time_limit = within.and_then(|within| within.strategy.time_limit);
        let network = time_clock::with_limit(&self.model.network, time_limit);
        let under = within.map(|within| ClosedLoop::new(&network, &within.strategy));
        let subject = Subject {
            network: &network,
            executor: self.executor(),
            under: under
                .as_ref()
                .zip(within)
                .map(|(moves, strategy)| Followed { moves, strategy }),
            options,
            guide: query.guide,
            freedom,
        };
        let mut answer = answer(subject, query);
        if time_limit.is_some() && query.strategy.is_none() {
            answer.evidence.forget_last_clock();
        }
        answer
    }
}

/// Answers a query that [`crate::engine::LoadedModel`] has accepted.
fn answer(subject: Subject<'_>, query: &Query) -> Answer {
    let options = subject.options;
    wide::start();
    let start = Instant::now();
    let zone_bytes = subject.network.clocks.len().pow(2) * size_of::<Bound>();
    let at_hand_bytes = (zones_in_use(&query.kind) * zone_bytes) as u64;
    let mut watch = LimitWatch::with_at_hand(options.limits.clone(), at_hand_bytes);
    let result = watch.bound(|watch| {
        // Where there are thousands of clocks this alone may be too much.
        cancellation::ask_for(zone_bytes);
        answer_within(subject, query, watch)
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
        game::note_missing_plans(&mut answer, &query.kind, subject.under.is_some());
    }
    answer.seconds = start.elapsed().as_secs_f64();
    answer.peak_bytes = watch.peak_bytes().max(answer.counters.bytes);
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
        QueryKind::Control { .. } => 4,
        _ => 8,
    }
}

/// The same, within the limits.
fn answer_within(subject: Subject<'_>, query: &Query, watch: &mut LimitWatch) -> Answer {
    match &query.kind {
        QueryKind::Reachable(goal) => reduced(subject, |symmetry| {
            reachable(subject, goal, symmetry, watch)
        }),
        QueryKind::Invariantly(invariant) => {
            let broken = invariant.negated();
            let answer = reduced(subject, |symmetry| {
                reachable(subject, &broken, symmetry, watch)
            });
            answer.negated()
        }
        QueryKind::PotentiallyAlways(keep) => always(subject, keep, watch),
        QueryKind::Eventually(goal) => {
            let keep = goal.negated();
            always(subject, &keep, watch).negated()
        }
        QueryKind::LeadsTo(cause, effect) => {
            let open = Predicate::And(vec![cause.clone(), effect.negated()]);
            let keep = effect.negated();
            leads_to(subject, &open, &keep, watch)
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
                further: subject.atoms(),
            };
            reduced(subject, |symmetry| {
                extremum(subject, question, symmetry, watch)
            })
        }
        QueryKind::Control {
            objective,
            time_optimal: Some((limit, rest)),
            ..
        } => {
            let (limit, rest) = (*limit, *rest);
            let race = Race {
                objective,
                limit,
                rest,
            };
            fastest(subject, &race, watch)
        }
        QueryKind::Control {
            objective,
            observations: Some(observations),
            ..
        } => {
            let asked = ObservedGame {
                objective,
                observations: &observations[..],
            };
            partial_observation::game(subject, asked, watch)
        }
        QueryKind::Control {
            objective,
            cooperative,
            ..
        } => {
            let asked = Asked {
                objective,
                is_cooperative: *cooperative,
                time_optimal: None,
            };
            game::game(subject, asked, watch)
        }
        QueryKind::SaveStrategy { .. } | QueryKind::LoadStrategy { .. } => {
            unreachable!("strategies are saved and loaded elsewhere")
        }
    }
}

/// Answers with a search that treats states as the same if they differ only by exchanged members of
/// scalar sets, if that is wanted and sound. Whether a failure is met can depend on the order in
/// which a quantifier runs through members. So a failure that is found in this way is searched
/// again among all states.
fn reduced(
    subject: Subject<'_>,
    mut answer: impl FnMut(Option<&Arc<Symmetry>>) -> Answer,
) -> Answer {
    let is_allowed = subject.options.reductions.symmetry && subject.under.is_none();
    let symmetry = is_allowed
        .then(|| Symmetry::of_network(subject.network))
        .flatten();
    let first = answer(symmetry.as_ref());
    match first.verdict {
        Verdict::Error(failure) if symmetry.is_some() && failure != Failure::Interrupted => {
            answer(None)
        }
        _ => first,
    }
}
