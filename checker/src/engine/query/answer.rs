//! From a compiled query to its answer.

use std::sync::Arc;
use std::time::Instant;

use crate::analysis::{Abstraction, ClockBounds, LiveVariables};
use crate::cancellation;
use crate::exec::Executor;
use crate::game::Priorities;
use crate::game::partial_observation::Machine;
use crate::game::strategy::attractor::{Strategy, Under};
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::plans::Plan;
use crate::ir::{ClockAtom, FunctionId, Network, Predicate, Query, QueryKind, SiteId};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Restriction, Stepper, Symbolic, Symmetry};
use crate::search::Trace;
use crate::search::limits::{Counters, StopReason};
use crate::search::liveness::ending::RunEnding;
use crate::search::optimum::extremum::{Extremes, Question};
use crate::verify::strategy::Outcome as StrategyCheck;
use crate::zones::Bound;

use super::extremum::extremum;
use super::liveness::{always, leads_to};
use super::reachable::reachable;
use super::time_optimal::{Race, fastest};
use super::{game, partial_observation};
use crate::engine::Options;
use crate::engine::evidence::certificate::{CLOCKS_GREW, Certificate};
use crate::engine::evidence::strategy_check::Verification;
use crate::engine::evidence::timed_run::{self, Kind, Missing, Proof, Shows, Takes, Witness};
use crate::engine::limits::LimitWatch;

/// What a query came out as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It holds.
    Satisfied,
    /// It does not.
    NotSatisfied,
    /// An over-approximation could not decide.
    Maybe,
    /// A limit came first.
    Unknown(StopReason),
    /// The model failed.
    Error(Failure),
}

/// What backs a verdict.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Witnesses, counterexamples, or the way to a failure: one, or one a value.
    pub witnesses: Vec<Witness>,
    /// The states that a search for such a state has reached, if there is none and they were
    /// wanted.
    pub certificate: Option<Certificate>,
    /// The strategy of the player who wins, if it was wanted.
    pub strategy: Option<Arc<Strategy>>,
    /// The strategy of the controller in a game with observations, if it wins and it was wanted.
    pub machine: Option<Arc<Machine>>,
    /// How the check of the strategy ended, if it was wanted.
    pub verification: Option<Verification>,
    /// Plans, if they were wanted.
    pub plans: Option<Vec<Plan>>,
    /// Whether there are more plans than were wanted, or may be: after the first, no other is
    /// looked for.
    pub has_more_plans: bool,
}

impl Evidence {
    /// Leaves the last clock, which is none of the model, out of all runs.
    pub(in crate::engine) fn forget_last_clock(&mut self) {
        for witness in &mut self.witnesses {
            for (_, zone) in &mut witness.trace.states {
                *zone = zone.without_last_clock();
            }
            if let Some(Proof::Replayed(_, states, _)) = &mut witness.run {
                for state in states {
                    state.clocks.pop();
                }
            }
        }
    }

    /// Whether the strategy and all runs passed their independent checks; `None` if there was none,
    /// or one came to no end.
    pub fn is_verified(&self) -> Option<bool> {
        let strategy = self.verification.iter().map(|check| match check {
            Ok(StrategyCheck::Verified(_)) => Some(true),
            Ok(StrategyCheck::Violated(..)) => Some(false),
            Ok(StrategyCheck::GivenUp(..)) | Err(_) => None,
        });
        let runs = self.witnesses.iter().filter_map(|one| one.run.as_ref());
        let runs = runs.map(|run| match run {
            Proof::Replayed(..) => Some(true),
            Proof::Violated(..) | Proof::Impossible => Some(false),
            Proof::Missing(_) => None,
        });
        let checks: Vec<Option<bool>> = strategy.chain(runs).collect();
        if checks.contains(&Some(false)) {
            return Some(false);
        }
        (!checks.is_empty() && !checks.contains(&None)).then_some(true)
    }
}

/// The values of the items of a query with `sup`, `inf` or `bounds`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Values {
    /// Whether the least values were asked for.
    pub least: bool,
    /// Whether the greatest values were asked for.
    pub greatest: bool,
    /// Of each item.
    pub items: Vec<Extremes>,
}

/// The answer to a query.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// The values of a query for them.
    pub value: Option<Values>,
    /// A remark for the user.
    pub message: Option<String>,
    /// Warnings about the query, rendered.
    pub warnings: Vec<String>,
    /// What backs it.
    pub evidence: Evidence,
    /// What was done.
    pub counters: Counters,
    /// The greatest number of bytes that states and tables took.
    pub peak_bytes: u64,
    /// Seconds of the search alone.
    pub seconds: f64,
    /// Seconds of loading the model and compiling its code.
    pub load_seconds: f64,
    /// The first place, in the order of the model, where the result of integer arithmetic did not
    /// fit and wrapped round.
    pub wrapped: Option<SiteId>,
}

/// What a query is about.
#[derive(Clone, Copy)]
pub(in crate::engine) struct Subject<'a> {
    pub(in crate::engine) network: &'a Network,
    pub(in crate::engine) executor: &'a dyn Executor,
    /// The strategy that the controller follows.
    pub(in crate::engine) under: Option<&'a ClosedLoop>,
    /// The same for games, whose strategies are within it.
    pub(in crate::engine) within: Option<&'a Arc<Under>>,
    /// Whether priorities count under the strategy.
    pub(in crate::engine) priorities: Priorities,
}

impl<'a> Subject<'a> {
    /// The comparisons of the strategy.
    fn atoms(&self) -> &'a [ClockAtom] {
        self.under.map_or(&[], Restriction::atoms)
    }
}

/// Answers a query that [`crate::engine::LoadedModel`] has accepted.
pub(in crate::engine) fn answer(subject: Subject<'_>, query: &Query, options: &Options) -> Answer {
    let start = Instant::now();
    let zone_bytes = subject.network.clocks.len().pow(2) * size_of::<Bound>();
    let at_hand_bytes = (zones_at_hand(&query.kind) * zone_bytes) as u64;
    let mut watch = LimitWatch::with_at_hand(options.limits.clone(), at_hand_bytes);
    let result = watch.bound(|watch| {
        // Where there are thousands of clocks this alone may be too much.
        cancellation::ask_for(zone_bytes);
        answer_within(subject, query, options, watch)
    });
    let mut answer = result.unwrap_or_else(|(reason, counters)| {
        new_answer(Verdict::Unknown(reason), Evidence::default(), counters)
    });
    // What is known by then does not matter to a user who interrupts.
    if answer.verdict == Verdict::Error(Failure::Interrupted) || watch.is_interrupted() {
        let counters = answer.counters;
        let verdict = Verdict::Unknown(watch.stop());
        answer = new_answer(verdict, Evidence::default(), counters);
    }
    if answer.verdict == Verdict::Error(Failure::ClockRange) {
        let verdict = Verdict::Unknown(StopReason::Clocks);
        answer = new_answer(verdict, Evidence::default(), answer.counters);
        answer.message = Some(CLOCKS_GREW.to_owned());
    }
    if options.plans.is_some() {
        game::note_missing_plans(&mut answer, &query.kind, subject.under.is_some());
    }
    answer.seconds = start.elapsed().as_secs_f64();
    answer.peak_bytes = watch.peak_bytes.max(answer.counters.bytes);
    answer
}

/// So many zones stand side by side in one step of the search, beside those of its account, at most
/// about: where it is a matter of cutting zones by each other, more.
fn zones_at_hand(kind: &QueryKind) -> usize {
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
fn answer_within(
    subject: Subject<'_>,
    query: &Query,
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let Subject {
        network, executor, ..
    } = subject;
    match &query.kind {
        QueryKind::Reachable(goal) => reduced(subject, options, |symmetry| {
            reachable(subject, goal, options, symmetry, watch)
        }),
        QueryKind::Invariantly(invariant) => {
            let broken = negation(invariant);
            negated(reduced(subject, options, |symmetry| {
                reachable(subject, &broken, options, symmetry, watch)
            }))
        }
        QueryKind::PotentiallyAlways(keep) => always(subject, keep, options, watch),
        QueryKind::Eventually(goal) => {
            let keep = negation(goal);
            negated(always(subject, &keep, options, watch))
        }
        QueryKind::LeadsTo(cause, effect) => {
            let open = Predicate::And(vec![cause.clone(), negation(effect)]);
            let keep = negation(effect);
            leads_to(subject, (&open, &keep), options, watch)
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
            reduced(subject, options, |symmetry| {
                extremum(subject, question, options, symmetry, watch)
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
            fastest(network, executor, &race, options, watch)
        }
        QueryKind::Control {
            objective,
            observations: Some(observations),
            ..
        } => {
            let asked = (objective, &observations[..]);
            partial_observation::game(network, executor, asked, options, watch)
        }
        QueryKind::Control {
            objective,
            cooperative,
            ..
        } => {
            let asked = (objective, *cooperative);
            let under = subject.under.zip(subject.within);
            game::game((network, under), executor, asked, options, watch)
        }
        QueryKind::SaveStrategy { .. } | QueryKind::LoadStrategy { .. } => {
            unreachable!("strategies are saved and loaded elsewhere")
        }
    }
}

/// Answers with a search that takes states that differ only by exchanged members of scalar sets for
/// the same, if that is wanted and sound. Whether a failure is met can hang on the order in which a
/// quantifier runs through members, so that one that is found so is looked for again among all
/// states.
fn reduced(
    subject: Subject<'_>,
    options: &Options,
    mut answer: impl FnMut(Option<&Arc<Symmetry>>) -> Answer,
) -> Answer {
    let is_allowed = options.symmetry && subject.under.is_none();
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

/// The variables that a search whose question reads words by `functions` may forget where they are
/// not live. What a strategy allows hangs on all of them.
pub(super) fn live_variables(
    subject: Subject<'_>,
    functions: impl IntoIterator<Item = FunctionId>,
    options: &Options,
    symmetry: Option<&Arc<Symmetry>>,
) -> Option<Arc<LiveVariables>> {
    if !options.live_variables || subject.under.is_some() {
        return None;
    }
    // An initial value is the same member for all, so that states would no longer be each other's
    // images.
    let keeps_scalars = symmetry.is_some();
    LiveVariables::new(subject.network, functions, keeps_scalars).map(Arc::new)
}

pub(in crate::engine) fn new_answer(
    verdict: Verdict,
    evidence: Evidence,
    counters: Counters,
) -> Answer {
    Answer {
        verdict,
        value: None,
        message: None,
        warnings: Vec::new(),
        evidence,
        counters,
        peak_bytes: 0,
        seconds: 0.0,
        load_seconds: 0.0,
        wrapped: None,
    }
}

/// The answer to a query on a model that has no meaning.
pub(in crate::engine) fn failed(failure: Failure) -> Answer {
    let verdict = Verdict::Error(failure);
    new_answer(verdict, Evidence::default(), Counters::default())
}

pub(super) fn negation(predicate: &Predicate) -> Predicate {
    Predicate::Not(Box::new(predicate.clone()))
}

/// The answer to the negated query.
pub(super) fn negated(answer: Answer) -> Answer {
    let verdict = match answer.verdict {
        Verdict::Satisfied => Verdict::NotSatisfied,
        Verdict::NotSatisfied => Verdict::Satisfied,
        other => other,
    };
    Answer { verdict, ..answer }
}

/// Whether the network or a query compares two clocks.
pub(in crate::engine) fn has_differences(network: &Network, atoms: &[ClockAtom]) -> bool {
    network.features.diagonals || atoms.iter().any(ClockAtom::is_difference)
}

/// Zones for searches, with an abstraction that is sound for the network and these predicates, and
/// keeps what further comparisons tell.
pub(in crate::engine) fn symbolic<'a>(
    subject: Subject<'a>,
    predicates: &[&Predicate],
    further: &[ClockAtom],
    wanted: Abstraction,
) -> Symbolic<'a> {
    let Subject {
        network,
        executor,
        under,
        priorities,
        ..
    } = subject;
    let mut atoms: Vec<ClockAtom> = predicates
        .iter()
        .flat_map(|one| predicate::atoms(one))
        .chain(further.iter().cloned())
        .chain(subject.atoms().iter().cloned())
        .collect();
    let mut needs_maximum = predicates.iter().any(|one| predicate::has_deadlock(one));
    if predicate::depends_on_negations(network) {
        if further.is_empty() {
            needs_maximum = true;
        } else {
            // What is measured is to be kept from one side only.
            atoms.extend(predicate::negated_atoms(network));
        }
    }
    let abstraction = if has_differences(network, &atoms) {
        Abstraction::Differences
    } else if needs_maximum {
        Abstraction::Maximum
    } else {
        wanted
    };
    let bounds = ClockBounds::new(network, &atoms, abstraction);
    let symbolic = Symbolic::new(Stepper::new(network, executor), bounds)
        .restricted(under.map(|one| one as &dyn Restriction));
    if under.is_some() && priorities == Priorities::Ignored {
        symbolic.without_priorities()
    } else {
        symbolic
    }
}

/// Zones that may be too large for what is asked, where those of [`symbolic`] would be many more:
/// nothing that these zones do not have is there, but what they have may not be. `None` if there
/// are none but those of [`symbolic`].
pub(super) fn coarser<'a>(subject: Subject<'a>, predicates: &[&Predicate]) -> Option<Symbolic<'a>> {
    if predicate::depends_on_negations(subject.network) {
        return None;
    }
    let atoms: Vec<ClockAtom> = predicates
        .iter()
        .flat_map(|one| predicate::atoms(one))
        .collect();
    let all: Vec<ClockAtom> = [&atoms, subject.atoms()]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    if has_differences(subject.network, &all) {
        return None;
    }
    // What simulates a valuation may have more moves: a deadlock could be left out for a state that
    // has none.
    Some(symbolic(subject, &[], &atoms, Abstraction::LowerUpper).comparing_as_sets())
}

/// The verdict on something that was found, in zones that may be too large.
pub(super) fn found(is_approximate: bool) -> Verdict {
    if is_approximate {
        Verdict::Maybe
    } else {
        Verdict::Satisfied
    }
}

/// Collects what backs an answer.
pub(super) struct Witnesses<'w, 'a> {
    pub(super) symbolic: &'w mut Symbolic<'a>,
    has_runs: bool,
    /// Whether what was found is sure only if a run is replayed.
    is_doubtful: bool,
    /// Whether the runs follow a strategy.
    is_restricted: bool,
    found: Vec<Witness>,
}

impl<'w, 'a> Witnesses<'w, 'a> {
    pub(super) fn new(symbolic: &'w mut Symbolic<'a>, options: &Options) -> Witnesses<'w, 'a> {
        Witnesses {
            has_runs: options.runs,
            is_doubtful: symbolic.is_approximate(),
            is_restricted: symbolic.is_restricted(),
            symbolic,
            found: Vec::new(),
        }
    }

    /// The same for what is sure only if a run is replayed, where there is a doubt beside zones
    /// that are too large.
    pub(super) fn doubting(self, is_doubtful: bool) -> Witnesses<'w, 'a> {
        Witnesses {
            is_doubtful: self.is_doubtful || is_doubtful,
            ..self
        }
    }

    /// Whether what was found is sure only if a run is replayed.
    pub(super) fn is_doubtful(&self) -> bool {
        self.is_doubtful
    }

    /// Adds a trace, with its run if runs are wanted; returns the verdict on what it shows: a run
    /// is also looked for where there is a doubt, since then it alone makes sure.
    pub(super) fn add(
        &mut self,
        trace: Trace,
        ending: Option<RunEnding>,
        shows: Shows<'_>,
    ) -> Verdict {
        let kind = match shows {
            Shows::Possible => Kind::Failure,
            Shows::Reaches(..) | Shows::Stays(_) => Kind::Predicate,
            Shows::Takes(takes) => Kind::Value(takes.item, takes.shown),
        };
        let mut witness = Witness::new(trace, ending, kind);
        // An initial state that cannot be entered is no run. What is stuck under a strategy may go
        // on in the model, which is what the replay knows, and priorities count in the model.
        let is_dead = match shows {
            Shows::Reaches(predicate, _) | Shows::Takes(Takes { predicate, .. }) => {
                predicate::has_deadlock(predicate)
            }
            Shows::Stays(_) => ending == Some(RunEnding::Stuck),
            Shows::Possible => false,
        };
        let is_comparable = !(self.is_restricted && is_dead || self.symbolic.ignores_priorities());
        let mut is_replayed = false;
        let is_wanted = self.has_runs || self.is_doubtful;
        if is_wanted && is_comparable && !witness.trace.states.is_empty() {
            let network = self.symbolic.stepper.network();
            let is_doubtful = self.is_doubtful || self.symbolic.is_approximate();
            let subject = (ending, shows);
            let trace = &witness.trace;
            let symbolic = &mut *self.symbolic;
            let prove = || timed_run::prove(symbolic, network, trace, subject, is_doubtful);
            let proof = cancellation::unless_cut(prove);
            let proof = proof.unwrap_or(Proof::Missing(Missing::Stopped));
            is_replayed = matches!(proof, Proof::Replayed(..));
            witness.run = self.has_runs.then_some(proof);
        }
        self.found.push(witness);
        found(self.is_doubtful && !is_replayed)
    }

    pub(super) fn into_evidence(self) -> Evidence {
        Evidence {
            witnesses: self.found,
            ..Evidence::default()
        }
    }
}
