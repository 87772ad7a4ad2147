//! Time-optimal games, `control_t*(u, g)`: the least time within which the controller can force the
//! goal.
//!
//! A clock of its own measures the time. The game is solved once, with the goal to be reached
//! before that clock passes the limit u; the clock may start at any value up to u, and the greatest
//! one from which the controller wins leaves just the time that is needed: the least limit with
//! which the game is won. Where g is what it is meant to be, a time that certainly passes before
//! the goal, that is the least time. Without u, the limit is doubled until it is enough, if the
//! goal can be forced at all.
//!
//! The clock distinguishes states by the time at which they are reached, so there are soon many
//! zones for each discrete state. Then there is one node for each discrete state, if that is
//! possible: the time that is needed does not depend on the time that has passed. The number of
//! these nodes does not depend on the limit, so a generous limit is tried first.
//!
//! For a strategy the game is solved again, with the time that was found as the limit and a clock
//! that starts at 0.

use std::sync::Arc;

use crate::analysis::Abstraction;
use crate::analysis::clock_differences::greatest_constant;
use crate::game::backward::winning_sets::Win;
use crate::game::forward::graph::Graph;
use crate::game::forward::objective::{Deadline, Objective as GameObjective};
use crate::game::solver::Solver;
use crate::game::strategy::{Strategy, attractor};
use crate::game::{Extent, Solution};
use crate::game::{Nodes, Player};
use crate::ir::{ClockAtom, ClockId, ClockRange, Control, TimeBounds};
use crate::network::{Failure, Stepper};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::search::optimum::extremum::{Extreme, Extremes};
use crate::zones::{Bound, Zone};

use super::attempts::first_of_use;
use super::budgets::{CROWD_IN_RACES, RACE_IN_DISCRETE_STATES, STATES_BEFORE_CROWD};
use super::game;
use super::game_zones::{self, add_check, objective_atoms, zones_of};
use super::problem::{Problem, has_differences};
use super::time_clock::{TIME, with_time};
use crate::engine::answer::{Answer, Values, Verdict};
use crate::engine::limits::{LimitWatch, cut_as_interrupted};
use crate::engine::options::Options;

/// The limit to start from if the query has none.
const FIRST_LIMIT: i32 = 16;

/// The limit to start from in discrete states.
const FIRST_LIMIT_IN_DISCRETE_STATES: i32 = 1 << 12;

/// The least time, and whether it is reached or only approached.
type Time = (i32, bool);

/// How an attempt to find the time ended.
enum RaceEnd {
    /// The least time, if it is within the limit.
    Time(Option<Time>),
    Stopped(StopReason),
    Approximate,
    /// There are many zones for each discrete state, or discrete states take too much.
    GivenUp,
}

/// Answers a time-optimal query.
pub(super) fn fastest(
    problem: Problem<'_>,
    control: &Control,
    bounds: TimeBounds,
    watch: &mut LimitWatch,
) -> Answer {
    let (first_limit, counters) = match first_limit(problem, control, bounds, watch) {
        Ok(found) => found,
        Err(answer) => return *answer,
    };
    let (timed, clock) = with_time(problem.network);
    let game = ClockedGame {
        problem: Problem {
            network: &timed,
            ..problem
        },
        clock,
        control,
        bounds,
    };
    let mut tried = Tried {
        limit: first_limit,
        counters,
    };
    let play = |nodes| game.least_time(nodes, &mut tried, watch);
    let end = first_of_use(game.attempts(), play, |nodes, end| match end {
        Ok(RaceEnd::GivenUp) => false,
        // A run-time error may lie in a state that no run reaches.
        Err(_) => nodes != Nodes::Discrete,
        Ok(_) => true,
    });
    let (verdict, time) = match end {
        Ok(RaceEnd::GivenUp) => unreachable!("symbolic states are all there is"),
        Ok(RaceEnd::Time(None)) => (Verdict::NotSatisfied, None),
        Ok(RaceEnd::Time(time)) => (Verdict::Satisfied, time),
        Ok(RaceEnd::Stopped(reason)) => (Verdict::Unknown(reason), None),
        Ok(RaceEnd::Approximate) => (Verdict::Maybe, None),
        Err(failure) => (Verdict::Error(failure), None),
    };
    let mut answer = Answer::new(verdict, tried.counters);
    if let Some((value, is_reached)) = time {
        answer.value = Some(least_value(value, is_reached));
        if !is_reached {
            answer.remark(format!("time > {value}: the value itself is not reached"));
        }
    }
    // Where the time is only approached, the strategy needs less than a unit more.
    let limit = match (verdict, time) {
        (Verdict::Satisfied, Some((value, is_reached))) => Some(value + i32::from(!is_reached)),
        (Verdict::NotSatisfied, _) if bounds.limit.is_some() => Some(tried.limit),
        _ => None,
    };
    let is_strategy_wanted = problem.options.strategy || problem.options.verify;
    if let Some(limit) = limit.filter(|_| is_strategy_wanted) {
        game.add_strategy(problem, limit, &mut answer, watch);
    }
    answer
}

/// The limit to begin with, and what was done to find it: that of the query, or a small one if the
/// goal can be forced at all. An error is the answer to the query.
fn first_limit(
    problem: Problem<'_>,
    control: &Control,
    bounds: TimeBounds,
    watch: &mut LimitWatch,
) -> Result<(i32, Counters), Box<Answer>> {
    let Problem {
        network,
        executor,
        options,
        ..
    } = problem;
    if let Some(limit) = bounds.limit {
        let mut words = network.initial.clone();
        let limit = Stepper::tuned(network, executor, options.tuning).evaluate(limit, &mut words);
        return match limit {
            // Time is never negative.
            Ok(limit) => Ok((limit.max(-1), Counters::default())),
            Err(error) => Err(Box::new(Answer::failed(error.into()))),
        };
    }
    let untimed = Control {
        time_optimal: None,
        ..control.clone()
    };
    let plain = Options {
        limits: options.limits.clone(),
        forced: options.forced,
        priorities: options.priorities,
        tuning: options.tuning,
        ..Options::default()
    };
    let plain_game = Problem {
        options: &plain,
        ..problem
    };
    let answer = game::game(plain_game, &untimed, watch);
    match answer.verdict {
        Verdict::Satisfied => Ok((FIRST_LIMIT, answer.counters)),
        Verdict::NotSatisfied if options.want_strategy_of(Player::Environment) => {
            let with_strategy = Options {
                strategy: options.strategy,
                verify: options.verify,
                ..plain
            };
            let game_with_strategy = Problem {
                options: &with_strategy,
                ..problem
            };
            Err(Box::new(game::game(game_with_strategy, &untimed, watch)))
        }
        _ => Err(Box::new(answer)),
    }
}

/// A least time as the value of a query.
fn least_value(value: i32, is_reached: bool) -> Values {
    let least = Some(Extreme::Value { value, is_reached });
    Values {
        least: true,
        greatest: false,
        items: vec![Extremes {
            least,
            greatest: None,
        }],
    }
}

/// What all attempts share.
struct Tried {
    /// The limit that was tried last.
    limit: i32,
    /// What was done.
    counters: Counters,
}

/// The game on the network with the clock.
struct ClockedGame<'a> {
    /// About the network with the clock.
    problem: Problem<'a>,
    clock: usize,
    control: &'a Control,
    bounds: TimeBounds,
}

impl ClockedGame<'_> {
    /// The kinds of graphs in which the time is searched, one after the other.
    fn attempts(&self) -> &'static [Nodes] {
        let Problem {
            network, options, ..
        } = self.problem;
        let can_be_discrete = game_zones::can_be_discrete(network, false, options)
            && !has_differences(network, &objective_atoms(&self.control.objective));
        match options.nodes {
            Nodes::Automatic if can_be_discrete => {
                &[Nodes::Automatic, Nodes::Discrete, Nodes::Symbolic]
            }
            Nodes::Discrete if can_be_discrete => &[Nodes::Discrete, Nodes::Symbolic],
            _ => &[Nodes::Symbolic],
        }
    }

    /// The least time. If the query has no limit, limits are doubled until one is enough.
    fn least_time(
        &self,
        nodes: Nodes,
        tried: &mut Tried,
        watch: &mut LimitWatch,
    ) -> Result<RaceEnd, Failure> {
        if self.bounds.limit.is_none() {
            tried.limit = match nodes {
                Nodes::Discrete => tried.limit.max(FIRST_LIMIT_IN_DISCRETE_STATES),
                Nodes::Automatic | Nodes::Symbolic => FIRST_LIMIT,
            };
        }
        let longest = Bound::reach(greatest_constant(self.problem.network));
        loop {
            let end = self.time_needed(nodes, tried, watch);
            let is_enough = !matches!(end, Ok(RaceEnd::Time(None)));
            let is_last = self.bounds.limit.is_some() || tried.limit >= longest;
            if is_enough || is_last {
                return end;
            }
            tried.limit = tried.limit.saturating_mul(2).min(longest);
        }
    }

    /// The time that is needed, if it is at most the limit that is tried.
    fn time_needed(
        &self,
        nodes: Nodes,
        tried: &mut Tried,
        watch: &mut LimitWatch,
    ) -> Result<RaceEnd, Failure> {
        let limit = tried.limit;
        if limit < 0 {
            return Ok(RaceEnd::Time(None));
        }
        let conclude = |result, solver: &mut Solver<'_, '_, '_>, _: &mut dyn Watch| {
            tried.counters = tried.counters + solver.counters();
            Ok(match result {
                Solution::Stopped(_) if solver.has_given_up() => RaceEnd::GivenUp,
                Solution::Stopped(reason) => RaceEnd::Stopped(reason),
                Solution::Won(_) if solver.graph.symbolic.is_approximate() => RaceEnd::Approximate,
                Solution::Won(_) => RaceEnd::Time(needed(solver, self.clock, limit)),
            })
        };
        self.solve(limit, Some(nodes), watch, conclude)
    }

    /// Adds the strategy of the player who wins with this limit, or why there is none. `problem` is
    /// about the network without the clock.
    fn add_strategy(
        &self,
        problem: Problem<'_>,
        limit: i32,
        answer: &mut Answer,
        watch: &mut LimitWatch,
    ) {
        let strategy = match cut_as_interrupted(|| self.strategy(limit, watch)) {
            Ok(Ok(strategy)) => strategy,
            Ok(Err(reason)) => return answer.lacks_strategy(reason),
            Err(Failure::Interrupted) => return answer.lacks_strategy(watch.stop()),
            Err(failure) => {
                answer.verdict = Verdict::Error(failure);
                return;
            }
        };
        if problem.options.verify {
            add_check(answer, problem, self.control, &strategy, watch);
        }
        answer.remark(match strategy.owner {
            Player::Controller => format!("the strategy gets there within {TIME} <= {limit}"),
            Player::Environment => {
                format!("the environment holds out as long as {TIME} <= {limit}")
            }
        });
        answer.evidence.strategy = Some(Arc::new(strategy));
    }

    /// The strategy of the player who wins with this limit.
    fn strategy(
        &self,
        limit: i32,
        watch: &mut dyn Watch,
    ) -> Result<Result<Strategy, StopReason>, Failure> {
        self.solve(limit, None, watch, |result, solver, watch| {
            if let Solution::Stopped(reason) = result {
                return Ok(Err(reason));
            }
            if let Some(reason) = solver.explore_dead_ends(watch)? {
                return Ok(Err(reason));
            }
            solver.put_into_layers(watch)?;
            let strategy = attractor::extract(solver, watch)?;
            Ok(strategy.map(|strategy| Strategy {
                time_limit: Some(limit),
                ..strategy
            }))
        })
    }

    /// Solves the game with a limit, until it is known who wins: either if the clock starts at 0,
    /// or in all of these nodes, with a clock that starts anywhere up to the limit.
    fn solve<R>(
        &self,
        limit: i32,
        nodes: Option<Nodes>,
        watch: &mut dyn Watch,
        conclude: impl FnOnce(Solution, &mut Solver<'_, '_, '_>, &mut dyn Watch) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let Problem {
            network, options, ..
        } = self.problem;
        let mut atoms = objective_atoms(&self.control.objective);
        atoms.extend(limits_of(self.clock, limit.max(0)));
        let abstraction = match nodes {
            _ if has_differences(network, &atoms) => Abstraction::Differences,
            Some(Nodes::Discrete) => Abstraction::Exact,
            _ => Abstraction::Maximum,
        };
        let mut symbolic = zones_of(self.problem, &atoms, abstraction);
        let wanted = GameObjective {
            goal: self.control.objective.goal(),
            keep: self.control.objective.keep(),
            must_progress: true,
            deadline: Some(Deadline {
                clock: self.clock,
                limit,
                starts_anywhere: nodes.is_some(),
                rest: self.bounds.rest,
            }),
            leaves_dead_ends: true,
        };
        let mut graph = match nodes {
            Some(Nodes::Discrete) => Graph::of_discrete_states(&mut symbolic, wanted),
            _ => Graph::new(&mut symbolic, wanted),
        }?;
        let mut solver = Solver::new(&mut graph, Player::Controller, options.forced);
        solver.share_among(options.thread_count());
        match nodes {
            Some(Nodes::Automatic) => {
                solver.set_crowd_limit(STATES_BEFORE_CROWD, CROWD_IN_RACES);
            }
            Some(Nodes::Discrete) => solver.give_up_beyond(Some(RACE_IN_DISCRETE_STATES)),
            Some(Nodes::Symbolic) | None => {}
        }
        let result = match nodes {
            Some(_) => solver.solve_backward(watch)?,
            None => solver.solve(Extent::Verdict, watch)?,
        };
        conclude(result, &mut solver, watch)
    }
}

/// The comparisons of the clock with values up to the limit, in both directions.
fn limits_of(clock: usize, limit: i32) -> [ClockAtom; 2] {
    let clock = ClockRange::one(ClockId(clock as u32));
    [
        ClockAtom::weak(clock, ClockRange::REFERENCE, 0, limit),
        ClockAtom::weak(ClockRange::REFERENCE, clock, -limit, 0),
    ]
}

/// What the greatest winning start of the clock leaves of the limit.
fn needed(solver: &Solver<'_, '_, '_>, clock: usize, limit: i32) -> Option<Time> {
    let network = solver.graph.symbolic.stepper.network();
    let dimension = solver.graph.dimension();
    let mut start = Zone::universe(dimension);
    let values = network.initial_clocks.iter().enumerate().skip(1);
    for (other, &value) in values.filter(|(other, _)| *other != clock) {
        start.constrain(other, 0, Bound::weak(value)?);
        start.constrain(0, other, Bound::weak(-value)?);
    }
    start.constrain(clock, 0, Bound::weak(limit)?);
    let latest = match &solver.won.win[0] {
        Win::Nothing => None,
        Win::Everything => Some(start.bound(clock, 0)),
        Win::Part(part) => {
            let mut part = part.clone();
            part.intersect_zone(start.bounds());
            let bounds = part.zones().map(|zone| zone[clock * dimension]);
            bounds.max()
        }
    }?;
    Some((limit - latest.value(), !latest.is_strict()))
}
