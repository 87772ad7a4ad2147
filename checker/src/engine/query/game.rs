//! Game queries: who wins, how, and by which plans.

use std::sync::Arc;

use crate::analysis::{Abstraction, ClockBounds, LiveVariables};
use crate::cancellation::{self, Cut};
use crate::exec::Executor;
use crate::game::backward::budget::Allowance;
use crate::game::backward::solver::{Answer as GameAnswer, Extent, Solver, Win};
use crate::game::forward::graph::{Graph, Objective as GameObjective};
use crate::game::objectives::buchi;
use crate::game::strategy::attractor::{self, Strategy, Under};
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::game::strategy::co_buchi;
use crate::game::strategy::plans::{NoPlans, Plan, Plans};
use crate::game::{Nodes, Player, Priorities};
use crate::ir::{ClockAtom, Network, Objective, Predicate, QueryKind};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Restriction, Stepper, Symbolic};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::verify::Effort;

use super::budgets::{
    CROWD, IN_DISCRETE_STATES, IN_DISCRETE_STATES_BY_ROUNDS, STATES_BEFORE_CROWD,
    WITHOUT_ABSTRACTION,
};
use super::cooperative;
use super::subject::has_differences;
use crate::engine::answer::{Answer, Verdict, Verification};
use crate::engine::evidence::strategy_check::{self, Asked, Played};
use crate::engine::limits::{LimitWatch, cut_as_interrupted, stop_text};
use crate::engine::options::Options;
/// What is said of a game whose model has priorities.
pub(super) const IGNORED_PRIORITIES: &str =
    "games ignore the priorities of the model, unless they are told to keep them";

/// What is said where plans are wanted of a game for which none are listed.
const NO_PLANS: &str = "plans are listed for control: A<> and A[ U ] only, and not under a strategy; what to do is in the strategy";

/// Says so if plans are wanted of a game that sees everything and for which none are listed,
/// whoever wins.
pub(super) fn note_missing_plans(answer: &mut Answer, query: &QueryKind, is_under: bool) {
    let QueryKind::Control {
        objective,
        cooperative,
        time_optimal,
        observations: None,
    } = query
    else {
        return;
    };
    let is_race = matches!(objective, Objective::Reach(_) | Objective::Until(..));
    if is_race && !cooperative && time_optimal.is_none() && !is_under {
        return;
    }
    answer.message = Some(match answer.message.take() {
        Some(message) => format!("{message}; {NO_PLANS}"),
        None => NO_PLANS.to_owned(),
    });
}

/// Names the part of a game query that there is no algorithm for.
pub(crate) fn unsupported_game(
    objective: &Objective,
    is_time_optimal: bool,
    is_cooperative: bool,
    has_observations: bool,
) -> Option<&'static str> {
    let can_race = matches!(objective, Objective::Reach(_) | Objective::Until(..));
    if has_observations && matches!(objective, Objective::Buchi(..)) {
        Some("observations and A[] (p && A<> q)")
    } else if is_time_optimal && (is_cooperative || !can_race) {
        Some("control_t* and other objectives than A<> and A[ U ]")
    } else {
        None
    }
}

/// The strategy that a game is played under: as a restriction, and as a value.
pub(super) type Allowed<'a> = (&'a ClosedLoop, &'a Arc<Under>);

/// Answers a game query: with Extra-M+, or, where two clocks are compared, without abstraction
/// first.
pub(super) fn game(
    (network, under): (&Network, Option<Allowed<'_>>),
    executor: &dyn Executor,
    asked: (&Objective, bool),
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let mut atoms = objective_atoms(asked.0);
    atoms.extend(under.iter().flat_map(|(closed, _)| closed.atoms()).cloned());
    let zones = |abstraction| {
        let bounds = ClockBounds::new(network, &atoms, abstraction, options.tuning);
        let restriction = under.map(|(closed, _)| closed as &dyn Restriction);
        zones_of(network, executor, bounds, options).restricted(restriction)
    };
    let played = |zones, nodes, allowance, watch: &mut dyn Watch| {
        let within = under.map(|(_, within)| within);
        played(zones, (asked, within), options, (nodes, allowance), watch)
    };
    if !has_differences(network, &atoms) {
        let in_discrete_states = |watch: &mut LimitWatch| {
            let zones = zones(Abstraction::Exact);
            let allowance = match asked.0 {
                Objective::Buchi(..) => IN_DISCRETE_STATES_BY_ROUNDS,
                _ => IN_DISCRETE_STATES,
            };
            let allowance = Some(allowance);
            let (answer, has_given_up) = played(zones, Nodes::Discrete, allowance, watch);
            // A run-time error may lie in a state that no run reaches.
            let is_of_use = !has_given_up && !matches!(answer.verdict, Verdict::Error(_));
            (answer, is_of_use)
        };
        let in_symbolic_states =
            |nodes, watch: &mut LimitWatch| played(zones(Abstraction::Maximum), nodes, None, watch);
        let nodes = if options.tuning.discrete_nodes
            && under.is_none()
            && can_be_discrete(network, asked.1, options)
        {
            options.nodes
        } else {
            Nodes::Symbolic
        };
        let mut before = Counters::default();
        if nodes == Nodes::Automatic {
            let (answer, has_given_up) = in_symbolic_states(nodes, watch);
            if !has_given_up {
                return answer;
            }
            before = answer.counters;
        }
        let mut answer = if nodes == Nodes::Symbolic {
            in_symbolic_states(nodes, watch).0
        } else {
            let (answer, is_of_use) = in_discrete_states(watch);
            if is_of_use {
                answer
            } else {
                before.explored += answer.counters.explored;
                in_symbolic_states(Nodes::Symbolic, watch).0
            }
        };
        answer.counters.explored += before.explored;
        return answer;
    }
    let mut before = 0;
    if options.tuning.exact_first {
        let exact = zones(Abstraction::Exact);
        let allowance = Some(WITHOUT_ABSTRACTION);
        let (first, has_given_up) = played(exact, Nodes::Symbolic, allowance, watch);
        if !has_given_up && first.verdict != Verdict::Error(Failure::ClockRange) {
            return first;
        }
        before = first.counters.explored;
    }
    let cut = zones(Abstraction::Differences);
    let (mut answer, _) = played(cut, Nodes::Symbolic, None, watch);
    answer.counters.explored += before;
    answer
}

/// The zones of games: with the priorities of the network, if they are to count.
pub(super) fn zones_of<'a>(
    network: &'a Network,
    executor: &'a dyn Executor,
    bounds: ClockBounds,
    options: &Options,
) -> Symbolic<'a> {
    let symbolic = Symbolic::new(Stepper::tuned(network, executor, options.tuning), bounds);
    match options.priorities {
        Priorities::Kept => symbolic,
        Priorities::Ignored => symbolic.without_priorities(),
    }
}

/// Whether the game may be played in discrete states with all that invariants allow: if it does not
/// matter what is reached, and if neither clocks that stop, nor priorities, nor clock guards on
/// urgent channels make it hang on more than the state.
pub(super) fn can_be_discrete(network: &Network, is_cooperative: bool, options: &Options) -> bool {
    let has_priorities = network.features.priorities && options.priorities == Priorities::Kept;
    let is_urgent = network.features.clock_guarded_urgent;
    let hangs_on_more = network.features.stopwatches || has_priorities || is_urgent;
    options.plans.is_none() && !is_cooperative && !hangs_on_more
}

/// The clock comparisons of an objective.
pub(super) fn objective_atoms(objective: &Objective) -> Vec<ClockAtom> {
    let (one, other) = match objective {
        Objective::Reach(goal) => (goal, None),
        Objective::Safe(keep) => (keep, None),
        Objective::Until(keep, goal)
        | Objective::WeakUntil(keep, goal)
        | Objective::Buchi(keep, goal) => (keep, Some(goal)),
    };
    let both = std::iter::once(one).chain(other);
    both.flat_map(predicate::atoms).collect()
}

/// Plays the game of a query in these zones; also says whether it was given up, for having many
/// zones for each discrete state or for taking more than is allowed.
fn played(
    mut symbolic: Symbolic<'_>,
    ((objective, is_cooperative), within): ((&Objective, bool), Option<&Arc<Under>>),
    options: &Options,
    (nodes, allowance): (Nodes, Option<Allowance>),
    watch: &mut dyn Watch,
) -> (Answer, bool) {
    let network = symbolic.stepper.network();
    let recurring;
    let (goal, keep, seeker) = match objective {
        Objective::Reach(goal) => (Some(goal), None, Player::Controller),
        Objective::Until(keep, goal) => (Some(goal), Some(keep), Player::Controller),
        Objective::Safe(keep) => (None, Some(keep), Player::Environment),
        Objective::WeakUntil(keep, goal) => (Some(goal), Some(keep), Player::Environment),
        Objective::Buchi(keep, goal) => {
            recurring = Predicate::And(vec![keep.clone(), goal.clone()]);
            (Some(&recurring), Some(keep), Player::Controller)
        }
    };
    let is_recurring = matches!(objective, Objective::Buchi(..));
    let is_strategy_wanted = options.strategy || options.verify;
    let wanted = GameObjective {
        goal,
        keep,
        must_progress: seeker == Player::Controller,
        deadline: None,
        // The most permissive strategy says what to do there too, and so does one that begins
        // anywhere. Under a strategy the controller may be obliged to move there, and lose for
        // having no move.
        leaves_dead_ends: !is_recurring
            && within.is_none()
            && (!is_strategy_wanted || (seeker == Player::Controller && !is_cooperative)),
    };
    // A strategy says what to do in states with all their values, and plans have such states.
    let forgets = options.reductions.live_variables
        && !is_strategy_wanted
        && options.plans.is_none()
        && within.is_none();
    if forgets {
        let read = [goal, keep].into_iter().flatten();
        let read = read.flat_map(predicate::functions);
        let live = LiveVariables::new(network, read, false);
        symbolic = symbolic.forgetting(live.map(Arc::new));
    }
    let mut zones_for_ways = symbolic.another();
    let plain = |verdict, counters| (Answer::new(verdict, counters), false);
    let graph = match nodes {
        Nodes::Automatic | Nodes::Symbolic => Graph::new(&mut symbolic, wanted),
        Nodes::Discrete => Graph::of_discrete_states(&mut symbolic, wanted),
    };
    let mut graph = match graph {
        Ok(graph) => graph,
        Err(failure) => return plain(Verdict::Error(failure), Counters::default()),
    };
    let mut solver = Solver::new(&mut graph, seeker, options.forced);
    solver.share_among(options.thread_count());
    solver.give_up_beyond(allowance);
    if nodes == Nodes::Automatic {
        solver.give_up_if_crowded(STATES_BEFORE_CROWD, CROWD);
    }
    let is_planned = options.plans.is_some()
        && matches!(objective, Objective::Reach(_) | Objective::Until(..))
        && !is_cooperative
        && within.is_none();
    if is_cooperative && is_strategy_wanted {
        solver.graph.leave_out_chains();
    }
    let extent = match options.plans {
        Some(most) if most > 1 && is_planned => Extent::Everything,
        // A strategy that keeps out of what was not explored would not be the most permissive one.
        _ if is_strategy_wanted && seeker == Player::Environment => Extent::Permissive,
        _ => Extent::Verdict,
    };
    let mut rounds = Vec::new();
    let result = if is_recurring {
        let wanted = is_strategy_wanted.then_some(&mut rounds);
        buchi::solve(&mut solver, is_cooperative, wanted, watch)
    } else if is_cooperative {
        solver.solve_cooperative(watch)
    } else {
        solver.solve(extent, watch)
    };
    let counters = solver.counters();
    let winner = match result {
        Ok(GameAnswer::Won(winner)) => winner,
        Ok(GameAnswer::Stopped(reason)) => {
            let has_given_up = solver.has_given_up;
            return (plain(Verdict::Unknown(reason), counters).0, has_given_up);
        }
        Err(failure) => {
            return plain(Verdict::Error(failure), counters);
        }
    };
    // Beside stopped clocks the past of a zone may be too large, so that nobody is known to win.
    if solver.graph.symbolic.is_approximate() {
        return plain(Verdict::Maybe, counters);
    }
    let verdict = match winner {
        Player::Controller => Verdict::Satisfied,
        Player::Environment => Verdict::NotSatisfied,
    };
    let mut answer = Answer::new(verdict, counters);
    if solver.graph.symbolic.ignores_priorities() {
        answer.message = Some(IGNORED_PRIORITIES.to_owned());
    }
    if is_planned {
        add_plans(&mut answer, &mut solver, options, watch);
    }
    if is_strategy_wanted {
        let strategy = if is_cooperative {
            let denied = is_recurring.then_some(&rounds[..]);
            let zones = &mut zones_for_ways;
            cut_as_interrupted(|| {
                cooperative::strategy(&mut solver, (winner, denied), zones, options, watch)
            })
        } else {
            let explored = cut_as_interrupted(|| solver.explore_dead_ends(watch));
            answer.counters = solver.counters();
            if solver.has_given_up {
                return (answer, true);
            }
            let denied = (winner == Player::Environment && is_recurring).then_some(&rounds[..]);
            let strategy = match explored {
                Ok(None) => cut_as_interrupted(|| strategy_of(&mut solver, denied, watch)),
                Ok(Some(reason)) => Ok(Err(reason)),
                Err(failure) => Err(failure),
            };
            strategy.map(|result| result.map_err(|reason| stop_text(reason).to_owned()))
        };
        // What was asked is known, so that an end of the strategy is none of the answer.
        let strategy = match strategy {
            Err(Failure::Interrupted) => {
                let reason = watch.look(&solver.counters());
                let reason = reason.unwrap_or(StopReason::Interrupted);
                Ok(Err(stop_text(reason).to_owned()))
            }
            strategy => strategy,
        };
        match strategy {
            Ok(Err(reason)) => {
                let message = answer.message.map(|message| format!("{message}; "));
                let message = message.unwrap_or_default();
                answer.message = Some(format!("{message}no strategy: {reason}"));
            }
            Ok(Ok(mut strategy)) => {
                strategy.under = within.cloned();
                if options.verify {
                    let asked = Asked {
                        objective,
                        is_cooperative,
                        time_optimal: None,
                    };
                    let verification = verified(network, asked, &strategy, options, watch);
                    answer.evidence.verification = Some(verification);
                }
                answer.evidence.strategy = Some(Arc::new(strategy));
            }
            Err(failure) => answer.verdict = Verdict::Error(failure),
        }
    }
    (answer, false)
}

/// The strategy of the player who wins a solved game; that of the environment where a goal does not
/// recur is in these rounds. An error of the inner result is why it was not finished.
fn strategy_of(
    solver: &mut Solver<'_, '_, '_>,
    denied: Option<&[Vec<Win>]>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    solver.put_into_layers(watch)?;
    match denied {
        Some(rounds) => co_buchi::extract(solver, rounds, vec![0], watch),
        None => attractor::extract(solver, watch),
    }
}

/// Checks a strategy in closed loop, until the watch wants it to end.
pub(super) fn verified(
    network: &Network,
    asked: Asked<'_>,
    strategy: &Strategy,
    options: &Options,
    watch: &mut dyn Watch,
) -> Verification {
    let mut ends = || watch.look(&Counters::default()).is_some();
    let decisions = strategy_check::decisions(network, strategy);
    let played = Played::new(strategy, &decisions);
    let rules = options.rules();
    let effort = &mut effort_of(options).unless(&mut ends);
    strategy_check::verify(network, asked, played, rules, effort)
}

/// How much a check may look at.
pub(super) fn effort_of<'a>(options: &Options) -> Effort<'a> {
    Effort::up_to(
        options
            .limits
            .states
            .unwrap_or(strategy_check::MOST_REGIONS),
    )
}

/// Adds the plans that are wanted to the answer for a solved game.
fn add_plans(
    answer: &mut Answer,
    solver: &mut Solver<'_, '_, '_>,
    options: &Options,
    watch: &mut dyn Watch,
) {
    let most = match options.plans {
        None => return,
        _ if answer.verdict == Verdict::NotSatisfied => {
            answer.evidence.plans = Some(Vec::new());
            return;
        }
        Some(most) => most,
    };
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

/// Plans between two looks at the memory that they take.
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
            Some(path) => paths.spell(&path).map(Some),
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
