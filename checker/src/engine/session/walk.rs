//! Walking through a model by hand: a state, its moves, the state after one of them.
//!
//! A state is symbolic: its zone holds all clock values that the moves until now allow. A move is
//! listed if it is possible at some of them. Nothing is extrapolated, except in the list of all
//! states, which would have no end otherwise.

use crate::analysis::{Abstraction, ClockBounds};
use crate::exec::Executor;
use crate::ir::{Network, Predicate};
use crate::network::{Failure, MoveRef, Moves, Part, Stepper, Symbolic};
use crate::search::Outcome;
use crate::search::StopReason;
use crate::search::limits::Counters;
use crate::search::optimum::best_first::{BestFirst, Link, Measure, Met};
use crate::semantics::Reading;
use crate::tuning::Tuning;
use crate::verify;
use crate::verify::choices::Choices;
use crate::zones::{Zone, wide};

use crate::engine::limits::{LimitWatch, Limits};
use crate::engine::loaded_model::LoadedModel;
use crate::engine::options::CodeEngine;
use crate::engine::query::problem::safe_abstraction;
use crate::engine::rejection::Rejection;

/// How finely the times of simulated runs are chosen, unless finer ones are asked for.
pub const SIMULATED_TICKS_PER_UNIT: i64 = 1000;

/// Moves that [`LoadedModel::settle`] takes at most.
const LONGEST_WAY: usize = 100_000;

/// A state of a simulation.
#[derive(Clone, Debug)]
pub struct Point {
    /// The words.
    pub words: Vec<i32>,
    /// The clock values that are possible.
    pub zone: Zone,
}

/// The states that a model can reach.
#[derive(Clone, Debug)]
pub struct Space {
    /// The states, those with the fewest moves first.
    pub states: Vec<Met>,
    /// The moves between them, if they were asked for.
    pub links: Vec<Link>,
    /// What stopped the search, if they are not all.
    pub stop: Option<StopReason>,
}

/// Moves, and where each leads.
pub type Successors = Vec<(Vec<Part>, Point)>;

impl LoadedModel {
    /// What can happen next in states with exact clock values, for simulating runs.
    pub fn choices(&self, ticks_per_unit: i64) -> Result<Choices<'_>, verify::Error> {
        Choices::new(self.network(), ticks_per_unit)
    }

    /// Makes the code ready to run; needed once before the other functions here.
    pub fn prepare_simulation(&mut self, code: CodeEngine) -> Result<(), Rejection> {
        self.expect_symbolic()?;
        let span = crate::diagnostics::Span::default();
        self.prepare_code(Reading::Symbolic, code, Tuning::default(), span)
    }

    /// The initial state.
    pub fn start(&self) -> Result<Point, Failure> {
        let mut symbolic = self.symbolic();
        let (mut words, zone, invariant) = symbolic.start()?;
        let mut zones = vec![zone];
        symbolic.let_time_pass(&mut words, &invariant, &mut zones)?;
        // From one valuation, time reaches one zone.
        let zone = zones.swap_remove(0);
        Ok(Point { words, zone })
    }

    /// The moves of a state, and where each leads. More than one entry for a move if a receiver
    /// abstains.
    pub fn successors(&self, point: &Point) -> Result<Successors, Failure> {
        successors(&mut self.symbolic(), point)
    }

    /// Follows moves as long as time cannot pass and there is exactly one; the state where time can
    /// pass, or there is a choice, or no move.
    pub fn settle(&self, mut point: Point) -> Result<Point, Failure> {
        for _ in 0..LONGEST_WAY {
            if self.symbolic().may_delay(&mut point.words)? {
                break;
            }
            let mut successors = self.successors(&point)?;
            if successors.len() != 1 {
                break;
            }
            point = successors.swap_remove(0).1;
        }
        Ok(point)
    }

    /// The reachable states, breadth first, the fewest moves first, at most `limits.states` of
    /// them; and what stopped the search, if they are not all. A state that an earlier one contains
    /// is left out. Zones are extrapolated by the constants of the model. With `has_links`, also
    /// all moves between these states.
    pub fn reached(&self, limits: Limits, has_links: bool) -> Result<Space, Failure> {
        let network = self.network();
        let abstraction = safe_abstraction(network, &[]);
        let bounds = ClockBounds::new(network, &[], abstraction, Tuning::default());
        let mut symbolic = Symbolic::new(Stepper::new(network, self.executor()), bounds);
        wide::start();
        let nothing = &Predicate::Constant(false);
        let most = limits.states.map_or(usize::MAX, |most| most as usize);
        let mut watch = LimitWatch::new(limits);
        let mut search =
            BestFirst::new(&mut symbolic, &nothing, Measure::Moves, Counters::default());
        if has_links {
            search = search.with_links();
        }
        let stop = match watch.bound(|watch| search.run(watch)) {
            Ok(Ok(Outcome::Stopped(reason))) | Err((reason, _)) => Some(reason),
            Ok(Ok(Outcome::Found(_) | Outcome::Exhausted)) => None,
            Ok(Err(Failure::Interrupted)) => Some(watch.stop()),
            Ok(Err(failure)) => return Err(failure),
        };
        // The search checks its limits only from time to time, so it may have found more.
        let is_cut = search.counters().stored > most as u64;
        let (states, links) = search.into_graph(most)?;
        Ok(Space {
            states,
            links,
            stop: stop.or(is_cut.then_some(StopReason::States)),
        })
    }

    /// Zones as they are, without abstraction.
    pub(crate) fn symbolic(&self) -> Symbolic<'_> {
        symbolic(self.network(), self.executor())
    }
}

/// The semantics of a network as simulations take it: nothing is extrapolated.
pub fn symbolic<'a>(network: &'a Network, executor: &'a dyn Executor) -> Symbolic<'a> {
    wide::start();
    let bounds = ClockBounds::new(network, &[], Abstraction::Exact, Tuning::default());
    Symbolic::new(Stepper::new(network, executor), bounds)
}

/// The moves of a state, and where each leads. More than one entry for a move if a receiver
/// abstains, or if an urgent synchronisation stops time in a part of its zone.
pub fn successors(symbolic: &mut Symbolic<'_>, point: &Point) -> Result<Successors, Failure> {
    successors_or_failure(symbolic, point).map_err(|(failure, _)| failure)
}

/// The same; a failure comes with the move that fails, unless it is the search for moves itself.
pub(crate) fn successors_or_failure(
    symbolic: &mut Symbolic<'_>,
    point: &Point,
) -> Result<Successors, (Failure, Option<Vec<Part>>)> {
    let mut words = point.words.clone();
    let mut moves = Moves::default();
    let found = symbolic.moves_within(&mut words, point.zone.bounds(), &mut moves);
    found.map_err(|error| (error, None))?;
    let mut successors = Vec::new();
    for one in moves.iter() {
        taken(symbolic, one, &words, &point.zone, &mut successors)
            .map_err(|failure| (failure, Some(one.parts.to_vec())))?;
    }
    Ok(successors)
}

/// Adds where a move leads from a state.
fn taken(
    symbolic: &mut Symbolic<'_>,
    one: MoveRef<'_>,
    words: &[i32],
    zone: &Zone,
    successors: &mut Successors,
) -> Result<(), Failure> {
    if !symbolic.is_enabled(one, zone.bounds())? {
        return Ok(());
    }
    let mut target = words.to_vec();
    let Some(effect) = symbolic.fire(one, &mut target)? else {
        return Ok(());
    };
    let mut entries = Vec::new();
    effect.entry_zones(zone.bounds(), symbolic.dimension(), &mut entries);
    symbolic.let_time_pass(&mut target, &effect.invariant, &mut entries)?;
    successors.extend(entries.into_iter().map(|zone| {
        let words = target.clone();
        (one.parts.to_vec(), Point { words, zone })
    }));
    Ok(())
}
