//! From a compiled query to its answer.

use std::time::Instant;

use crate::exec::Executor;
use crate::game::graph::{Graph, Objective as GameObjective};
use crate::game::plans::{NoPlans, Plan, Plans};
use crate::game::reach::{Answer as GameAnswer, Extent, Solver};
use crate::game::strategy::{self, Strategy};
use crate::ir::{ClockAtom, Network, Objective, Predicate, Query, QueryKind};
use crate::network::{Abstraction, ClockBounds, Failure, Stepper, Symbolic, predicate};
use crate::search::limits::{Counters, StopReason};
use crate::search::reach::{self, Outcome, Trace};

use super::limits::LimitWatch;
use super::{Options, PlansWanted};

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
    /// A witness, a counterexample, or the way to a failure.
    pub trace: Option<Trace>,
    /// A winning strategy, if it was wanted.
    pub strategy: Option<Strategy>,
    /// Plans, if they were wanted.
    pub plans: Option<Vec<Plan>>,
    /// Whether there are more plans than were wanted.
    pub has_more_plans: bool,
}

/// The answer to a query.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// A remark for the user.
    pub message: Option<String>,
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
}

/// Names the part of a game query that there is no algorithm for.
pub(super) fn unsupported_game(
    objective: &Objective,
    cooperative: bool,
    time_optimal: bool,
    observations: bool,
) -> Option<&'static str> {
    match objective {
        _ if cooperative => Some("E<> control:"),
        _ if time_optimal => Some("control_t*"),
        _ if observations => Some("partial observation"),
        Objective::Reach(_) | Objective::Until(..) => None,
        Objective::Safe(_) => Some("control: A[]"),
        Objective::WeakUntil(..) => Some("control: A[ W ]"),
        Objective::Buchi(..) => Some("control: A[] (p && A<> q)"),
    }
}

/// Answers a query that [`super::LoadedModel`] has accepted.
pub(super) fn answer(
    network: &Network,
    executor: &dyn Executor,
    query: &Query,
    options: &Options,
) -> Answer {
    let start = Instant::now();
    let mut watch = LimitWatch::new(options.limits.clone());
    let mut answer = match &query.kind {
        QueryKind::Reachable(goal) => reachable(network, executor, goal, options, &mut watch),
        QueryKind::Invariantly(invariant) => {
            let broken = Predicate::Not(Box::new(invariant.clone()));
            let mut answer = reachable(network, executor, &broken, options, &mut watch);
            answer.verdict = match answer.verdict {
                Verdict::Satisfied => Verdict::NotSatisfied,
                Verdict::NotSatisfied => Verdict::Satisfied,
                other => other,
            };
            answer
        }
        QueryKind::Control { objective, .. } => {
            game(network, executor, objective, options, &mut watch)
        }
        _ => unreachable!("unsupported queries were refused"),
    };
    answer.seconds = start.elapsed().as_secs_f64();
    answer.peak_bytes = watch.peak_bytes.max(answer.counters.bytes);
    answer
}

fn new_answer(verdict: Verdict, evidence: Evidence, counters: Counters) -> Answer {
    Answer {
        verdict,
        message: None,
        evidence,
        counters,
        peak_bytes: 0,
        seconds: 0.0,
        load_seconds: 0.0,
    }
}

/// Extrapolation that is sound for the network: with differences of clocks in guards there is none.
fn abstraction(network: &Network, atoms: &[ClockAtom], wanted: Abstraction) -> Abstraction {
    let is_difference = |atom: &ClockAtom| atom.left.first.0 != 0 && atom.right.first.0 != 0;
    if network.features.diagonals || atoms.iter().any(is_difference) {
        Abstraction::Exact
    } else {
        wanted
    }
}

fn symbolic<'a>(
    network: &'a Network,
    executor: &'a dyn Executor,
    predicates: &[&Predicate],
    wanted: Abstraction,
) -> Symbolic<'a> {
    let atoms: Vec<ClockAtom> = predicates
        .iter()
        .flat_map(|one| predicate::atoms(one))
        .collect();
    let needs_maximum = predicates.iter().any(|one| predicate::has_deadlock(one));
    let wanted = if needs_maximum {
        Abstraction::Maximum
    } else {
        wanted
    };
    let bounds = ClockBounds::new(network, &atoms, abstraction(network, &atoms, wanted));
    Symbolic::new(Stepper::new(network, executor), bounds)
}

fn reachable(
    network: &Network,
    executor: &dyn Executor,
    goal: &Predicate,
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let mut symbolic = symbolic(network, executor, &[goal], Abstraction::LowerUpper);
    let report = reach::search(&mut symbolic, goal, options.order, watch);
    let mut evidence = Evidence::default();
    let verdict = match report.outcome {
        Ok(Outcome::Found(trace)) => {
            evidence.trace = Some(trace);
            if network.features.stopwatches {
                Verdict::Maybe
            } else {
                Verdict::Satisfied
            }
        }
        Ok(Outcome::Exhausted) => Verdict::NotSatisfied,
        Ok(Outcome::Stopped(reason)) => Verdict::Unknown(reason),
        Err((failure, trace)) => {
            evidence.trace = Some(trace);
            Verdict::Error(failure)
        }
    };
    new_answer(verdict, evidence, report.counters)
}

fn game(
    network: &Network,
    executor: &dyn Executor,
    objective: &Objective,
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let (goal, keep) = match objective {
        Objective::Reach(goal) => (goal, None),
        Objective::Until(keep, goal) => (goal, Some(keep)),
        _ => unreachable!("unsupported objectives were refused"),
    };
    let predicates: Vec<&Predicate> = std::iter::once(goal).chain(keep).collect();
    let mut symbolic = symbolic(network, executor, &predicates, Abstraction::Maximum);
    let objective = GameObjective {
        goal: Some(goal),
        keep,
        must_progress: true,
    };
    let mut graph = match Graph::new(&mut symbolic, objective) {
        Ok(graph) => graph,
        Err(failure) => {
            return new_answer(
                Verdict::Error(failure),
                Evidence::default(),
                Counters::default(),
            );
        }
    };
    let mut solver = Solver::new(&mut graph, options.forced);
    let extent = if let PlansWanted::All(_) = options.plans {
        Extent::Everything
    } else {
        Extent::Verdict
    };
    let result = solver.solve(extent, watch);
    let counters = solver.counters();
    match result {
        Ok(GameAnswer::Winning) => won(&mut solver, options, counters),
        Ok(GameAnswer::NotWinning) => {
            let evidence = Evidence {
                plans: no_plans(options),
                ..Evidence::default()
            };
            new_answer(Verdict::NotSatisfied, evidence, counters)
        }
        Ok(GameAnswer::Stopped(reason)) => {
            new_answer(Verdict::Unknown(reason), Evidence::default(), counters)
        }
        Err(failure) => new_answer(Verdict::Error(failure), Evidence::default(), counters),
    }
}

fn no_plans(options: &Options) -> Option<Vec<Plan>> {
    (options.plans != PlansWanted::No).then(Vec::new)
}

/// The answer for a won game, with the evidence that is wanted.
fn won(solver: &mut Solver<'_, '_, '_>, options: &Options, counters: Counters) -> Answer {
    let mut answer = new_answer(Verdict::Satisfied, Evidence::default(), counters);
    if options.strategy {
        match strategy::extract(solver) {
            Ok(strategy) => answer.evidence.strategy = Some(strategy),
            Err(failure) => answer.verdict = Verdict::Error(failure),
        }
    }
    let most = match options.plans {
        PlansWanted::No => return answer,
        PlansWanted::First => 1,
        PlansWanted::All(most) => most,
    };
    match plans(solver, most) {
        Ok(Ok((plans, has_more))) => {
            answer.evidence.plans = Some(plans);
            answer.evidence.has_more_plans = has_more && most > 1;
        }
        Ok(Err(NoPlans::EnvironmentChooses)) => {
            let message = "the environment has choices, so the strategy is no list of plans";
            answer.message = Some(message.to_owned());
        }
        Err(failure) => answer.verdict = Verdict::Error(failure),
    }
    answer
}

/// At most this many plans, and whether there are more.
fn plans(
    solver: &mut Solver<'_, '_, '_>,
    most: usize,
) -> Result<Result<(Vec<Plan>, bool), NoPlans>, Failure> {
    let mut paths = match Plans::new(solver) {
        Ok(paths) => paths,
        Err(reason) => return Ok(Err(reason)),
    };
    let mut plans = Vec::new();
    while let Some(path) = paths.next_path() {
        if plans.len() == most {
            return Ok(Ok((plans, true)));
        }
        let path = path.to_vec();
        plans.push(paths.spell(&path)?);
    }
    Ok(Ok((plans, false)))
}
