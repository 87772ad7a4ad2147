//! Time-optimal games, `control_t*(u, g)`: the least time within which the controller can force the goal.
//!
//! A clock of its own measures the time. The game is solved once, with the goal to be reached before that clock passes the limit u;
//! the clock may start at any value up to u, and the greatest one from which the controller wins leaves just the time that is
//! needed: the least limit with which the game is won. Where g is what it is meant to be, a time that certainly passes before the
//! goal, that is the least time. Without u, the limit is doubled until it is enough, if the goal can be forced at all.

use crate::exec::Executor;
use crate::game::Player;
use crate::game::graph::{Deadline, Graph, Objective as GameObjective};
use crate::game::reach::{Answer as GameAnswer, Extent, Solver, Win};
use crate::ir::{ClockAtom, ClockId, ClockRange, FunctionId, Network, Objective, Predicate};
use crate::network::{Abstraction, ClockBounds, Failure, Stepper};
use crate::search::extremum::{Extreme, Extremes};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::zones::{Bound, Zone};

use super::Options;
use super::answer::{Answer, Evidence, Values, Verdict, has_differences, new_answer};
use super::games::{self, objective_atoms};
use super::limits::LimitWatch;
use super::reachable::with_time;

/// The limit to start from if the query has none.
const FIRST_LIMIT: i32 = 16;

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
    let mut limit = if let Some(limit) = race.limit {
        let mut words = network.initial.clone();
        match Stepper::new(network, executor).evaluate(limit, &mut words) {
            Ok(limit) => limit,
            Err(error) => {
                let failure = Verdict::Error(error.into());
                return new_answer(failure, Evidence::default(), counters);
            }
        }
    } else {
        let asked = (race.objective, false);
        let plain = Options {
            limits: options.limits.clone(),
            forced: options.forced,
            priorities: options.priorities,
            ..Options::default()
        };
        let answer = games::game(network, executor, asked, &plain, watch);
        if answer.verdict != Verdict::Satisfied {
            return answer;
        }
        counters = answer.counters;
        FIRST_LIMIT
    };
    let (timed, clock) = with_time(network);
    loop {
        let run = within(
            (&timed, clock),
            executor,
            race,
            limit,
            options,
            &mut counters,
            watch,
        );
        let (verdict, time) = match run {
            Ok(Run::Time(None)) if race.limit.is_none() && limit <= Bound::MAX_VALUE / 2 => {
                limit *= 2;
                continue;
            }
            Ok(Run::Time(None)) => (Verdict::NotSatisfied, None),
            Ok(Run::Time(time)) => (Verdict::Satisfied, time),
            Ok(Run::Stopped(reason)) => (Verdict::Unknown(reason), None),
            Ok(Run::Approximate) => (Verdict::Maybe, None),
            Err(failure) => (Verdict::Error(failure), None),
        };
        let mut answer = new_answer(verdict, Evidence::default(), counters);
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
            let mut remarks = Vec::new();
            if !is_reached {
                remarks.push(format!("time > {value}: the value itself is not reached"));
            }
            if options.strategy || options.verify {
                let text = "control_t* gives no strategy: ask control: for the goal within the time, with a clock of the model";
                remarks.push(text.to_owned());
            }
            answer.message = (!remarks.is_empty()).then(|| remarks.join("; "));
        }
        return answer;
    }
}

/// Solves the game with a limit.
fn within(
    (timed, clock): (&Network, usize),
    executor: &dyn Executor,
    race: &Race<'_>,
    limit: i32,
    options: &Options,
    counters: &mut Counters,
    watch: &mut dyn Watch,
) -> Result<Run, Failure> {
    if limit < 0 {
        return Ok(Run::Time(None));
    }
    let mut atoms = objective_atoms(race.objective);
    atoms.extend(limits_of(clock, limit));
    let abstraction = if has_differences(timed, &atoms) {
        Abstraction::Differences
    } else {
        Abstraction::Maximum
    };
    let bounds = ClockBounds::new(timed, &atoms, abstraction);
    let mut symbolic = games::zones_of(timed, executor, bounds, options);
    let (goal, keep): (&Predicate, _) = match race.objective {
        Objective::Until(keep, goal) => (goal, Some(keep)),
        Objective::Reach(goal) => (goal, None),
        _ => unreachable!("other objectives were refused"),
    };
    let wanted = GameObjective {
        goal: Some(goal),
        keep,
        must_progress: true,
        deadline: Some(Deadline {
            clock,
            limit,
            rest: race.rest,
        }),
    };
    let mut graph = Graph::new(&mut symbolic, wanted)?;
    let mut solver = Solver::new(&mut graph, Player::Controller, options.forced);
    let result = solver.solve(Extent::Start, watch)?;
    *counters = *counters + solver.counters();
    Ok(match result {
        GameAnswer::Stopped(reason) => Run::Stopped(reason),
        GameAnswer::Won(_) if solver.graph.symbolic.is_approximate() => Run::Approximate,
        GameAnswer::Won(_) => Run::Time(needed(&solver, clock, limit)),
    })
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
