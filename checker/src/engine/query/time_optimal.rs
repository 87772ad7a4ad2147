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
//! The clock tells apart when a state is reached, so that there are soon many zones for each
//! discrete state. Then there is one node for each, if that is possible: how much time is needed
//! does not hang on how much has passed. The limit has no part in how many these are, so that a
//! generous one is tried first.
//!
//! For a strategy the game is solved again, with the time that was found as the limit and a clock
//! that starts at 0.

use std::sync::Arc;

use crate::analysis::{Abstraction, ClockBounds};
use crate::exec::Executor;
use crate::game::backward::budget::Allowance;
use crate::game::backward::solver::{Answer as GameAnswer, Extent, Solver, Win};
use crate::game::forward::graph::{Deadline, Graph, Objective as GameObjective};
use crate::game::strategy::attractor::{self, Strategy};
use crate::game::{Nodes, Player};
use crate::ir::{ClockAtom, ClockId, ClockRange, FunctionId, Network, Objective, Predicate};
use crate::network::{Failure, Stepper};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::search::optimum::extremum::{Extreme, Extremes};
use crate::zones::{Bound, Zone};

use super::budgets::{IN_DISCRETE_STATES, STATES_BEFORE_CROWD};
use super::game::{self, objective_atoms};
use super::subject::has_differences;
use super::time_clock::{TIME, with_time};
use crate::engine::answer::{Answer, Values, Verdict};
use crate::engine::evidence::strategy_check::Asked;
use crate::engine::limits::{LimitWatch, cut_as_interrupted, stop_text};
use crate::engine::options::Options;

/// The limit to start from if the query has none.
const FIRST_LIMIT: i32 = 16;

/// The limit to start from in discrete states.
const FIRST_LIMIT_IN_DISCRETE_STATES: i32 = 1 << 12;

/// So many zones for each discrete state are many: with more of them, there will be more still.
const CROWD: usize = 2;

/// Discrete states that are explored, at most. Beside the clock, zones that are reached are rarely
/// few enough to be worth more.
const MOST_DISCRETE_STATES: u64 = 1 << 20;

/// What is asked: the goal, what is kept, and the bounds u and g.
pub(super) struct Race<'q> {
    pub(super) objective: &'q Objective,
    pub(super) limit: Option<FunctionId>,
    pub(super) rest: Option<FunctionId>,
}

/// The least time, and whether it is reached or only approached.
type Time = (i32, bool);

enum Run {
    Time(Option<Time>),
    Stopped(StopReason),
    Approximate,
    /// There are many zones for each discrete state, or discrete states take too much.
    GivenUp,
}

/// Answers a time-optimal query.
pub(super) fn fastest(
    network: &Network,
    executor: &dyn Executor,
    race: &Race<'_>,
    options: &Options,
    watch: &mut LimitWatch,
) -> Answer {
    let mut counters = Counters::default();
    let is_strategy_wanted = options.strategy || options.verify;
    let mut limit = if let Some(limit) = race.limit {
        let mut words = network.initial.clone();
        match Stepper::tuned(network, executor, options.tuning).evaluate(limit, &mut words) {
            // Time is never negative.
            Ok(limit) => limit.max(-1),
            Err(error) => {
                let failure = Verdict::Error(error.into());
                return Answer::new(failure, counters);
            }
        }
    } else {
        let asked = (race.objective, false);
        let plain = Options {
            limits: options.limits.clone(),
            forced: options.forced,
            priorities: options.priorities,
            tuning: options.tuning,
            ..Options::default()
        };
        let answer = game::game((network, None), executor, asked, &plain, watch);
        if answer.verdict == Verdict::NotSatisfied && is_strategy_wanted {
            let with_strategy = Options {
                strategy: options.strategy,
                verify: options.verify,
                ..plain
            };
            return game::game((network, None), executor, asked, &with_strategy, watch);
        }
        if answer.verdict != Verdict::Satisfied {
            return answer;
        }
        counters = answer.counters;
        FIRST_LIMIT
    };
    let (timed, clock) = with_time(network);
    let game = Timed {
        network: &timed,
        clock,
        executor,
        race,
        options,
    };
    let mut nodes = game.first_nodes();
    loop {
        if race.limit.is_none() && nodes == Nodes::Discrete {
            limit = limit.max(FIRST_LIMIT_IN_DISCRETE_STATES);
        }
        let run = game.time_needed(limit, nodes, &mut counters, watch);
        let (verdict, time) = match run {
            Ok(Run::Time(None)) if race.limit.is_none() && limit <= Bound::MAX_VALUE / 2 => {
                limit *= 2;
                continue;
            }
            Ok(Run::GivenUp) if nodes == Nodes::Automatic => {
                nodes = Nodes::Discrete;
                continue;
            }
            // A run-time error may lie in a state that no run reaches.
            Ok(Run::GivenUp) | Err(_) if nodes == Nodes::Discrete => {
                nodes = Nodes::Symbolic;
                if race.limit.is_none() {
                    limit = FIRST_LIMIT;
                }
                continue;
            }
            Ok(Run::GivenUp) => unreachable!("symbolic states are all there is"),
            Ok(Run::Time(None)) => (Verdict::NotSatisfied, None),
            Ok(Run::Time(time)) => (Verdict::Satisfied, time),
            Ok(Run::Stopped(reason)) => (Verdict::Unknown(reason), None),
            Ok(Run::Approximate) => (Verdict::Maybe, None),
            Err(failure) => (Verdict::Error(failure), None),
        };
        let mut answer = Answer::new(verdict, counters);
        let mut remarks = Vec::new();
        if let Some((value, is_reached)) = time {
            let least = Some(Extreme::Value { value, is_reached });
            answer.value = Some(Values {
                least: true,
                greatest: false,
                items: vec![Extremes {
                    least,
                    greatest: None,
                }],
            });
            if !is_reached {
                remarks.push(format!("time > {value}: the value itself is not reached"));
            }
        }
        // Where the time is only approached, the strategy needs less than a unit more.
        let limit = match (verdict, time) {
            (Verdict::Satisfied, Some((value, is_reached))) => Some(value + i32::from(!is_reached)),
            (Verdict::NotSatisfied, _) if race.limit.is_some() => Some(limit),
            _ => None,
        };
        if let Some(limit) = limit.filter(|_| is_strategy_wanted) {
            match cut_as_interrupted(|| game.strategy(limit, watch)) {
                Ok(Ok(strategy)) => {
                    if options.verify {
                        let asked = Asked {
                            objective: race.objective,
                            is_cooperative: false,
                            time_optimal: Some((race.limit, race.rest)),
                        };
                        let verification =
                            game::verified(network, asked, &strategy, options, watch);
                        answer.evidence.verification = Some(verification);
                    }
                    remarks.push(match strategy.owner {
                        Player::Controller => {
                            format!("the strategy gets there within {TIME} <= {limit}")
                        }
                        Player::Environment => {
                            format!("the environment holds out as long as {TIME} <= {limit}")
                        }
                    });
                    answer.evidence.strategy = Some(Arc::new(strategy));
                }
                Ok(Err(reason)) => remarks.push(format!("no strategy: {}", stop_text(reason))),
                Err(Failure::Interrupted) => {
                    remarks.push(format!("no strategy: {}", stop_text(watch.stop())));
                }
                Err(failure) => answer.verdict = Verdict::Error(failure),
            }
        }
        answer.message = (!remarks.is_empty()).then(|| remarks.join("; "));
        return answer;
    }
}

/// The game on the network with the clock.
struct Timed<'a, 'q> {
    network: &'a Network,
    clock: usize,
    executor: &'a dyn Executor,
    race: &'a Race<'q>,
    options: &'a Options,
}

impl Timed<'_, '_> {
    /// What nodes are tried first.
    fn first_nodes(&self) -> Nodes {
        let can_be_discrete = self.options.tuning.discrete_nodes
            && game::can_be_discrete(self.network, false, self.options)
            && !has_differences(self.network, &objective_atoms(self.race.objective));
        if can_be_discrete {
            self.options.nodes
        } else {
            Nodes::Symbolic
        }
    }

    /// The time that is needed, if it is at most the limit.
    fn time_needed(
        &self,
        limit: i32,
        nodes: Nodes,
        counters: &mut Counters,
        watch: &mut LimitWatch,
    ) -> Result<Run, Failure> {
        if limit < 0 {
            return Ok(Run::Time(None));
        }
        let conclude = |result, solver: &mut Solver<'_, '_, '_>, _: &mut dyn Watch| {
            *counters = *counters + solver.counters();
            Ok(match result {
                GameAnswer::Stopped(_) if solver.has_given_up => Run::GivenUp,
                GameAnswer::Stopped(reason) => Run::Stopped(reason),
                GameAnswer::Won(_) if solver.graph.symbolic.is_approximate() => Run::Approximate,
                GameAnswer::Won(_) => Run::Time(needed(solver, self.clock, limit)),
            })
        };
        let start = (limit, Some(nodes));
        self.solve(start, watch, conclude)
    }

    /// The strategy of the player who wins with this limit.
    fn strategy(
        &self,
        limit: i32,
        watch: &mut dyn Watch,
    ) -> Result<Result<Strategy, StopReason>, Failure> {
        self.solve((limit, None), watch, |result, solver, watch| {
            if let GameAnswer::Stopped(reason) = result {
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

    /// Solves the game with a limit: as far as it takes to know who wins if the clock starts at 0,
    /// or in these nodes wholly, with a clock that starts anywhere up to the limit.
    fn solve<R>(
        &self,
        (limit, nodes): (i32, Option<Nodes>),
        watch: &mut dyn Watch,
        conclude: impl FnOnce(GameAnswer, &mut Solver<'_, '_, '_>, &mut dyn Watch) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let mut atoms = objective_atoms(self.race.objective);
        atoms.extend(limits_of(self.clock, limit.max(0)));
        let abstraction = match nodes {
            _ if has_differences(self.network, &atoms) => Abstraction::Differences,
            Some(Nodes::Discrete) => Abstraction::Exact,
            _ => Abstraction::Maximum,
        };
        let bounds = ClockBounds::new(self.network, &atoms, abstraction, self.options.tuning);
        let mut symbolic = game::zones_of(self.network, self.executor, bounds, self.options);
        let (goal, keep): (&Predicate, _) = match self.race.objective {
            Objective::Until(keep, goal) => (goal, Some(keep)),
            Objective::Reach(goal) => (goal, None),
            _ => unreachable!("other objectives were refused"),
        };
        let wanted = GameObjective {
            goal: Some(goal),
            keep,
            must_progress: true,
            deadline: Some(Deadline {
                clock: self.clock,
                limit,
                starts_anywhere: nodes.is_some(),
                rest: self.race.rest,
            }),
            leaves_dead_ends: true,
        };
        let mut graph = match nodes {
            Some(Nodes::Discrete) => Graph::of_discrete_states(&mut symbolic, wanted),
            _ => Graph::new(&mut symbolic, wanted),
        }?;
        let mut solver = Solver::new(&mut graph, Player::Controller, self.options.forced);
        solver.share_among(self.options.thread_count());
        match nodes {
            Some(Nodes::Automatic) => solver.give_up_if_crowded(STATES_BEFORE_CROWD, CROWD),
            Some(Nodes::Discrete) => solver.give_up_beyond(Some(Allowance {
                explored: MOST_DISCRETE_STATES,
                ..IN_DISCRETE_STATES
            })),
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
    let range = |clock: usize| ClockRange {
        first: ClockId(clock as u32),
        count: 1,
    };
    let atom = |left: usize, right: usize, low: i32, high: i32| ClockAtom {
        left: range(left),
        right: range(right),
        low,
        high,
        strict: false,
    };
    [atom(clock, 0, 0, limit), atom(0, clock, -limit, 0)]
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
    let latest = match &solver.win[0] {
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
