//! Strategies of `E<> control: …`: from where both players get to together if the controller wins
//! from there, and of the environment from everywhere if it wins from nowhere.

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::objectives::cooperative::Winning;
use crate::game::solver::Solver;
use crate::game::strategy::co_buchi;
use crate::game::strategy::freedom::Freedom;
use crate::game::strategy::{Start, Strategy, Way, attractor};
use crate::ir::Predicate;
use crate::network::{Failure, Symbolic};
use crate::search::limits::{StopReason, Watch};
use crate::search::reachability::search;
use crate::search::timed_trace::schedule::Finish;
use crate::search::{Outcome, Trace};
use crate::verify::replay::{End, Run};
use crate::zones::minimal;

use crate::engine::Options;
use crate::engine::evidence::witness::Missing;
use crate::engine::evidence::{strategy_check, timed_run};
use crate::engine::format::text;
use crate::engine::limits::stop_text;

/// What is known about a solved game, without its graph.
pub(super) struct Solved<'s, 'n> {
    /// The winner.
    pub(super) winner: Player,
    /// The rounds of a goal that is to recur.
    pub(super) rounds: Option<&'s [Vec<Win>]>,
    /// Fresh zones of the game, to look for runs in.
    pub(super) zones: &'s mut Symbolic<'n>,
    pub(super) options: &'s Options,
    /// How much a strategy of the controller leaves to choose.
    pub(super) freedom: Option<Freedom>,
}

/// The strategy of the winner of a game that was solved with both players working together. An
/// error of the inner result says why there is none.
pub(super) fn strategy(
    solver: &mut Solver<'_, '_, '_>,
    solved: Solved<'_, '_>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, String>, Failure> {
    let Solved {
        winner,
        rounds,
        zones,
        options,
        freedom: _,
    } = solved;
    if winner == Player::Environment {
        let nodes = (0..solver.graph.nodes.len() as u32).rev().collect();
        let strategy = match rounds {
            Some(rounds) => co_buchi::extract(solver, rounds, nodes, watch)?,
            None => attractor::extract_from(solver, winner, nodes, watch)?,
        };
        return Ok(started(strategy, Start::Anywhere));
    }
    let mut winning = Winning::of(solver);
    let report = search::search(zones, &mut winning, options.order, watch);
    let trace = match report.outcome {
        Ok(Outcome::Found(trace)) => trace,
        Ok(Outcome::Exhausted) => return Ok(Err("no way to where it begins is found".to_owned())),
        Ok(Outcome::Stopped(reason)) => return Ok(Err(stop_text(reason).to_owned())),
        Err((failure, _)) => return Err(failure),
    };
    let way = match way(zones, &winning, &trace) {
        Ok(way) => way,
        Err(reason) => return Ok(Err(reason)),
    };
    let network = zones.stepper.network();
    let (_, states) = match strategy_check::follow(network, &way, options.priorities) {
        Ok(Some(followed)) => followed,
        Ok(None) => return Ok(Err("the way to where it begins fails its replay".to_owned())),
        Err(error) => return Ok(Err(text::missing_text(Missing::NotCovered(error)))),
    };
    let last = states.last().expect("a run has a state");
    let Some(node) = winning.node(&last.words, &last.clocks, way.ticks_per_unit) else {
        return Ok(Err(
            "the way does not end where the controller wins".to_owned()
        ));
    };
    let strategy = attractor::extract_from(solver, winner, vec![node], watch)?;
    Ok(started(strategy, Start::After(way)))
}

/// A strategy that begins there, or why there is none.
fn started(strategy: Result<Strategy, StopReason>, start: Start) -> Result<Strategy, String> {
    match strategy {
        Ok(strategy) => Ok(Strategy { start, ..strategy }),
        Err(reason) => Err(stop_text(reason).to_owned()),
    }
}

/// A trace with times at whose end the controller wins.
fn way(zones: &mut Symbolic<'_>, winning: &Winning, trace: &Trace) -> Result<Way, String> {
    let last = trace.states.last();
    let won = last.and_then(|(words, zone)| winning.zone_in(words, zone));
    let won = won.ok_or("the trace does not end where the controller wins")?;
    let mut constraints = Vec::new();
    minimal::for_each_minimal(won.bounds(), won.dimension(), |one| constraints.push(one));
    let always = Predicate::Constant(true);
    let finish = Finish::Holds(&always, constraints);
    let wanted = timed_run::wanted(&trace.moves, finish);
    let run = timed_run::timed(zones, &wanted).map_err(text::missing_text)?;
    Ok(to_way(&run))
}

/// The moves and times of a run that ends.
pub(super) fn to_way(run: &Run) -> Way {
    let moves = run.steps.iter().map(|step| (step.wait, step.parts.clone()));
    Way {
        ticks_per_unit: run.ticks_per_unit,
        moves: moves.collect(),
        wait: match run.end {
            End::After(wait) => wait,
            End::Loop(_) | End::Waits(_) | End::Stuck(_) => 0,
        },
    }
}
