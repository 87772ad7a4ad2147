//! Game queries: who wins, how, and by which plans.
//!
//! A game is played in one of several graphs, which give the same answer. The attempts to do so are
//! listed in [`Game::attempts`], and each of them is played by [`Game::play`]: the graph, the
//! solver, and then what backs the answer.

use std::borrow::Cow;
use std::sync::Arc;

use crate::analysis::{Abstraction, LiveVariables};
use crate::game::backward::winning_sets::Win;
use crate::game::forward::graph::Graph;
use crate::game::forward::objective::Objective as GameObjective;
use crate::game::objectives::buchi;
use crate::game::solver::Solver;
use crate::game::strategy::co_buchi;
use crate::game::strategy::freedom::{self, Freedom};
use crate::game::strategy::{Strategy, attractor};
use crate::game::{Extent, Solution};
use crate::game::{Nodes, Player};
use crate::ir::{ClockAtom, Control, Objective, Predicate, QueryKind};
use crate::network::symbolic::predicate;
use crate::network::{Failure, Symbolic};
use crate::search::limits::{StopReason, Watch};

use super::attempts::{Attempt, Doubt, first_of_use};
use super::budgets::{
    CROWD, IN_DISCRETE_STATES, IN_DISCRETE_STATES_BY_ROUNDS, STATES_BEFORE_CROWD,
    WITHOUT_ABSTRACTION,
};
use super::cooperative::{self, Solved};
use super::game_zones::{
    IGNORED_PRIORITIES, add_check, can_be_discrete, objective_atoms, zones_of,
};
use super::plans::add_plans;
use super::problem::{Problem, has_differences};
use crate::engine::answer::{Answer, Verdict, Wanted};
use crate::engine::limits::{LimitWatch, cut_as_interrupted, stop_text};

/// What is said where plans are wanted of a game for which none are listed.
const NO_PLANS: &str = "plans are listed for control: A<> and A[ U ] only, and not under a strategy; what to do is in the strategy";

/// Adds a remark if plans are wanted of a game that sees everything but for which none are listed,
/// whoever wins.
pub(super) fn note_missing_plans(answer: &mut Answer, query: &QueryKind, is_under: bool) {
    let Some(control) = query.full_game() else {
        return;
    };
    let has_plans = can_race(&control.objective) && !control.cooperative && !is_under;
    if !has_plans || control.time_optimal.is_some() {
        answer.remark(NO_PLANS);
    }
}

/// Whether the objective is to get somewhere.
fn can_race(objective: &Objective) -> bool {
    matches!(objective, Objective::Reach(_) | Objective::Until(..))
}

/// Names the part of a game query that there is no algorithm for.
pub(crate) fn unsupported_game(control: &Control) -> Option<&'static str> {
    let objective = &control.objective;
    if control.observations.is_some() && matches!(objective, Objective::Buchi(..)) {
        Some("observations and A[] (p && A<> q)")
    } else if control.time_optimal.is_some() && (control.cooperative || !can_race(objective)) {
        Some("control_t* and other objectives than A<> and A[ U ]")
    } else {
        None
    }
}

/// Answers a game query.
pub(super) fn game(problem: Problem<'_>, control: &Control, watch: &mut LimitWatch) -> Answer {
    let game = Game::new(problem, control);
    let mut explored = 0;
    let play = |attempt| {
        let mut end = game.play(attempt, watch);
        explored += end.answer.counters.explored;
        end.answer.counters.explored = explored;
        end
    };
    first_of_use(&game.attempts(), play, |attempt, end| {
        end.is_of_use(attempt)
    })
    .answer
}

/// The game of a query.
struct Game<'a> {
    problem: Problem<'a>,
    control: &'a Control,
    /// The comparisons of clocks that its zones keep.
    atoms: Vec<ClockAtom>,
}

/// How an attempt to play the game ended.
struct AttemptEnd {
    answer: Answer,
    /// Whether it was given up, for having many zones for each discrete state or for taking more
    /// than is allowed.
    has_given_up: bool,
}

impl AttemptEnd {
    fn is_of_use(&self, attempt: Attempt) -> bool {
        let is_doubtful = match (attempt.doubt, self.answer.verdict) {
            (Doubt::AnyFailure, Verdict::Error(_)) => true,
            (Doubt::ClockRange, verdict) => verdict == Verdict::Error(Failure::ClockRange),
            _ => false,
        };
        !self.has_given_up && !is_doubtful
    }
}

impl From<Answer> for AttemptEnd {
    fn from(answer: Answer) -> AttemptEnd {
        AttemptEnd {
            answer,
            has_given_up: false,
        }
    }
}

/// What the players play for.
struct Sides<'q> {
    goal: Option<Cow<'q, Predicate>>,
    keep: Option<&'q Predicate>,
    /// The player who wants to reach something: the goal, or the outside of what must be kept.
    seeker: Player,
}

impl<'q> Sides<'q> {
    fn new(objective: &'q Objective) -> Sides<'q> {
        let goal = match objective {
            Objective::Buchi(keep, goal) => {
                let recurring = Predicate::And(vec![keep.clone(), goal.clone()]);
                Some(Cow::Owned(recurring))
            }
            _ => objective.goal().map(Cow::Borrowed),
        };
        let seeker = match objective {
            Objective::Safe(_) | Objective::WeakUntil(..) => Player::Environment,
            _ => Player::Controller,
        };
        Sides {
            goal,
            keep: objective.keep(),
            seeker,
        }
    }
}

impl<'a> Game<'a> {
    fn new(problem: Problem<'a>, control: &'a Control) -> Game<'a> {
        let mut atoms = objective_atoms(&control.objective);
        atoms.extend(problem.atoms().iter().cloned());
        Game {
            problem,
            control,
            atoms,
        }
    }

    fn is_recurring(&self) -> bool {
        matches!(self.control.objective, Objective::Buchi(..))
    }

    fn is_strategy_wanted(&self) -> bool {
        self.problem.options.strategy || self.problem.options.verify
    }

    /// How many plans are wanted, if the game has plans.
    fn plans(&self) -> Option<usize> {
        let has_plans = can_race(&self.control.objective)
            && !self.control.cooperative
            && self.problem.under.is_none();
        self.problem.options.plans.filter(|_| has_plans)
    }

    /// The graphs in which the game is played: with zones, until these are many for each discrete
    /// state, then with one node for each, and if that takes too much with zones after all. Where
    /// two clocks are compared, without abstraction first.
    fn attempts(&self) -> Vec<Attempt> {
        let options = self.problem.options;
        let in_zones = |abstraction, nodes| Attempt {
            abstraction,
            nodes,
            allowance: None,
            doubt: Doubt::Nothing,
        };
        if has_differences(self.problem.network, &self.atoms) {
            let without_abstraction = Attempt {
                allowance: Some(WITHOUT_ABSTRACTION),
                doubt: Doubt::ClockRange,
                ..in_zones(Abstraction::Exact, Nodes::Symbolic)
            };
            let first = options.tuning.exact_first.then_some(without_abstraction);
            let last = in_zones(Abstraction::Differences, Nodes::Symbolic);
            return first.into_iter().chain([last]).collect();
        }
        let in_symbolic_states = |nodes| in_zones(Abstraction::Maximum, nodes);
        let in_discrete_states = Attempt {
            allowance: Some(if self.is_recurring() {
                IN_DISCRETE_STATES_BY_ROUNDS
            } else {
                IN_DISCRETE_STATES
            }),
            doubt: Doubt::AnyFailure,
            ..in_zones(Abstraction::Exact, Nodes::Discrete)
        };
        let network = self.problem.network;
        let can_be_discrete = self.problem.under.is_none()
            && can_be_discrete(network, self.control.cooperative, options);
        let last = in_symbolic_states(Nodes::Symbolic);
        match options.nodes {
            Nodes::Automatic if can_be_discrete => {
                vec![
                    in_symbolic_states(Nodes::Automatic),
                    in_discrete_states,
                    last,
                ]
            }
            Nodes::Discrete if can_be_discrete => vec![in_discrete_states, last],
            _ => vec![last],
        }
    }

    /// Plays the game once.
    fn play(&self, attempt: Attempt, watch: &mut dyn Watch) -> AttemptEnd {
        let sides = Sides::new(&self.control.objective);
        let mut symbolic = self.zones(attempt.abstraction, &sides);
        let mut zones_of_runs = symbolic.another();
        let objective = self.objective(&sides);
        let graph = match attempt.nodes {
            Nodes::Automatic | Nodes::Symbolic => Graph::new(&mut symbolic, objective),
            Nodes::Discrete => Graph::of_discrete_states(&mut symbolic, objective),
        };
        let mut graph = match graph {
            Ok(graph) => graph,
            Err(failure) => return Answer::failed(failure).into(),
        };
        if self.problem.freedom.is_some() {
            graph.disable_chains();
        }
        let mut solver = Solver::new(&mut graph, sides.seeker, self.problem.options.forced);
        solver.be_guided_by(self.problem.guide);
        solver.share_among(self.problem.options.thread_count());
        solver.give_up_beyond(attempt.allowance);
        if attempt.nodes == Nodes::Automatic {
            solver.set_crowd_limit(STATES_BEFORE_CROWD, CROWD);
        }
        let mut rounds = Vec::new();
        let result = self.solve(&mut solver, sides.seeker, &mut rounds, watch);
        let counters = solver.counters();
        let winner = match result {
            Ok(Solution::Won(winner)) => winner,
            Ok(Solution::Stopped(reason)) => {
                return AttemptEnd {
                    answer: Answer::new(Verdict::Unknown(reason), counters),
                    has_given_up: solver.has_given_up(),
                };
            }
            Err(failure) => return Answer::new(Verdict::Error(failure), counters).into(),
        };
        // Beside stopped clocks the past of a zone may be too large, so that nobody is known to
        // win.
        if solver.graph.symbolic.is_approximate() {
            return Answer::new(Verdict::Maybe, counters).into();
        }
        let verdict = match winner {
            Player::Controller => Verdict::Satisfied,
            Player::Environment => Verdict::NotSatisfied,
        };
        let mut answer = Answer::new(verdict, counters);
        if solver.graph.symbolic.ignores_priorities() {
            answer.remark(IGNORED_PRIORITIES);
        }
        if let Some(most) = self.plans() {
            add_plans(&mut answer, &mut solver, most, watch);
        }
        if !self.problem.options.want_strategy_of(winner) {
            return answer.into();
        }
        let solved = Solved {
            winner,
            rounds: self.is_recurring().then_some(&rounds[..]),
            zones: &mut zones_of_runs,
            options: self.problem.options,
            freedom: self.problem.freedom,
        };
        let has_given_up = self.find_strategy(&mut solver, solved, &mut answer, watch);
        AttemptEnd {
            answer,
            has_given_up,
        }
    }

    /// Adds the winner's strategy to the answer, or why there is none; returns whether the attempt
    /// was given up meanwhile.
    fn find_strategy(
        &self,
        solver: &mut Solver<'_, '_, '_>,
        solved: Solved<'_, '_>,
        answer: &mut Answer,
        watch: &mut dyn Watch,
    ) -> bool {
        let strategy = if self.control.cooperative {
            cut_as_interrupted(|| cooperative::strategy(solver, solved, watch))
        } else {
            let explored = cut_as_interrupted(|| solver.explore_dead_ends(watch));
            answer.counters = solver.counters();
            if solver.has_given_up() {
                return true;
            }
            let strategy = match explored {
                Ok(None) => cut_as_interrupted(|| strategy_of(solver, &solved, watch)),
                Ok(Some(reason)) => Ok(Err(reason)),
                Err(failure) => Err(failure),
            };
            strategy.map(|result| result.map_err(|reason| stop_text(reason).to_owned()))
        };
        match strategy {
            Ok(Ok(strategy)) => self.add_strategy(answer, strategy, watch),
            Ok(Err(reason)) => {
                answer.remark(format!("no strategy: {reason}"));
                if let Some(reason) = watch.look(&solver.counters()) {
                    answer.lacks(Wanted::Strategy, reason);
                }
            }
            // The winner is known, so the answer stays even if the search for the strategy ends
            // early.
            Err(Failure::Interrupted) => {
                let reason = watch.look(&solver.counters());
                answer.lacks_strategy(reason.unwrap_or(StopReason::Interrupted));
            }
            Err(failure) => answer.verdict = Verdict::Error(failure),
        }
        false
    }

    /// The zones of the game. A strategy says what to do in states with all their values, and plans
    /// have such states; where neither is wanted, values that nothing reads any more are forgotten.
    fn zones(&self, abstraction: Abstraction, sides: &Sides<'_>) -> Symbolic<'a> {
        let symbolic = zones_of(self.problem, &self.atoms, abstraction);
        let options = self.problem.options;
        let forgets = options.reductions.live_variables
            && !self.is_strategy_wanted()
            && options.plans.is_none()
            && self.problem.under.is_none();
        if !forgets {
            return symbolic;
        }
        let read = [sides.goal.as_deref(), sides.keep].into_iter().flatten();
        let read = read.flat_map(predicate::functions);
        let live = LiveVariables::new(self.problem.network, read, false);
        symbolic.forgetting(live.map(Arc::new))
    }

    /// What the graph is about.
    fn objective<'q>(&self, sides: &'q Sides<'_>) -> GameObjective<'q> {
        GameObjective {
            goal: sides.goal.as_deref(),
            keep: sides.keep,
            must_progress: sides.seeker == Player::Controller,
            deadline: None,
            // The most permissive strategy says what to do there too, and so does one that begins
            // anywhere. Under a strategy the controller may be obliged to move there, and lose for
            // having no move.
            leaves_dead_ends: !self.is_recurring()
                && self.problem.under.is_none()
                && (!self.is_strategy_wanted()
                    || (sides.seeker == Player::Controller && !self.control.cooperative)),
        }
    }

    /// Finds the winner. The rounds of a goal that must recur are recorded if they are needed.
    fn solve(
        &self,
        solver: &mut Solver<'_, '_, '_>,
        seeker: Player,
        rounds: &mut Vec<Vec<Win>>,
        watch: &mut dyn Watch,
    ) -> Result<Solution, Failure> {
        let is_strategy_wanted = self.is_strategy_wanted();
        let is_cooperative = self.control.cooperative;
        if is_cooperative && is_strategy_wanted {
            solver.graph.disable_chains();
        }
        if self.is_recurring() {
            let wanted = is_strategy_wanted.then_some(rounds);
            return buchi::solve(solver, is_cooperative, wanted, watch);
        }
        if is_cooperative {
            return solver.solve_cooperative(watch);
        }
        let extent = match self.plans() {
            _ if self.problem.freedom.is_some() => Extent::Everything,
            Some(most) if most > 1 => Extent::Everything,
            // A strategy that keeps out of what was not explored would not be the most permissive
            // one.
            _ if is_strategy_wanted && seeker == Player::Environment => Extent::Permissive,
            _ => Extent::Verdict,
        };
        solver.solve(extent, watch)
    }

    /// Adds the winner's strategy, with its check if that is wanted.
    fn add_strategy(&self, answer: &mut Answer, mut strategy: Strategy, watch: &mut dyn Watch) {
        strategy.under = self.problem.under.map(|under| Arc::clone(under.strategy));
        if self.problem.options.verify {
            add_check(answer, self.problem, self.control, &strategy, watch);
        }
        answer.evidence.strategy = Some(Arc::new(strategy));
    }
}

/// The strategy of the player who wins a solved game. An error of the inner result is why it was
/// not finished.
fn strategy_of(
    solver: &mut Solver<'_, '_, '_>,
    solved: &Solved<'_, '_>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    if let Some(freedom) = solved
        .freedom
        .filter(|_| solved.winner == Player::Controller)
    {
        if freedom == Freedom::Nearer && !solver.put_into_layers(watch)? {
            let reason = watch.look(&solver.counters());
            return Ok(Err(reason.unwrap_or(StopReason::Interrupted)));
        }
        return freedom::extract(solver, freedom, watch);
    }
    solver.put_into_layers(watch)?;
    match solved.rounds {
        Some(rounds) if solved.winner == Player::Environment => {
            co_buchi::extract(solver, rounds, vec![0], watch)
        }
        _ => attractor::extract(solver, watch),
    }
}
