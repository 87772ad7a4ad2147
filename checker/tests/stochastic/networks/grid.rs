//! Networks with clocks on a grid of moments: delays are rounded up to the grid, and what the grid
//! comes to is extrapolated to no rounding.
//!
//! All constants of a network lie on the grid, so the probability on the grid is a sum over the
//! points of polyhedra with corners on it, and has an expansion in powers of the step (Euler and
//! Maclaurin); Richardson's extrapolation from three steps takes away the first two. Networks in
//! which all delays are known moments are exact on every grid.
//!
//! A delay needs no memory but the clocks: a uniform or exponential distribution, conditioned on
//! "not yet", is itself again.

use super::chain::{Decided, Distribution, sorted};
use super::moves::{Game, MOST, Output, State, Unfit};
use super::{Atom, Bound, Compare, Net, Query};

/// The probability that is forgotten.
const LEAST: f64 = 1e-14;
/// So many moves without time in a row are too many.
const MOST_ROUNDS: usize = 200;
/// A step of the grid; odd numbers lie inside it.
const STEP: u16 = 2;

/// A probability, and how far it may be from the right one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Approximation {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

/// The probability of a query that is bounded by time: from grids of so many points a unit, twice
/// as many, and four times as many. The number is even.
///
/// Returns nothing if the coarsest grid shows that it is nothing that `is_wanted`.
pub(crate) fn probability(
    net: &Net,
    query: &Query,
    points: i32,
    is_wanted: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Approximation>, Unfit> {
    let coarse = on_grid(net, query, points)?;
    if !is_wanted(coarse) {
        return Ok(None);
    }
    let fine = on_grid(net, query, 2 * points)?;
    let finest = on_grid(net, query, 4 * points)?;
    let (first, second) = (2.0 * fine - coarse, 2.0 * finest - fine);
    let value = (4.0 * second - first) / 3.0;
    Ok(Some(Approximation {
        value: value.clamp(0.0, 1.0),
        error: (value - second).abs(),
    }))
}

/// The times at which a process can move.
struct Chances {
    /// How long it may stay, in half steps.
    bound: Option<i32>,
    /// How long its windows are together.
    length: Option<i32>,
    /// Whether a window is open now, and behind now.
    is_open: (bool, bool),
}

/// The probability on a grid of so many points a unit.
fn on_grid(net: &Net, query: &Query, points: i32) -> Result<f64, Unfit> {
    let Bound::HalfUnits(halves) = query.bound else {
        panic!("the grid is for times");
    };
    let steps_in_unit = points * i32::from(STEP);
    let game = Game {
        net,
        steps_in_unit,
        last_step: ((net.greatest_constant(query) + 1) * steps_in_unit) as u16,
    };
    let last = i32::try_from(halves).expect("the bound is small") * points / 2;
    let mut decided = Decided::default();
    let mut now = Distribution::from_iter([(State::default(), 1.0)]);
    for step in 0..=last {
        let settled = settle(&game, query, now, &mut decided)?;
        now = Distribution::default();
        if step < last {
            for (state, chance) in sorted(settled) {
                pass(&game, query, (state, chance), &mut now, &mut decided)?;
            }
        }
        now.retain(|_, chance| *chance > LEAST);
    }
    Ok(decided.probability(&query.path))
}

/// Lets everything happen that happens at this point of the grid.
fn settle(
    game: &Game<'_>,
    query: &Query,
    mut moving: Distribution,
    decided: &mut Decided,
) -> Result<Distribution, Unfit> {
    let mut settled = Distribution::default();
    for _ in 0..MOST_ROUNDS {
        let mut next = Distribution::default();
        for (state, chance) in sorted(moving) {
            let mut processes = 0..game.net.processes.len();
            if processes.any(|one| bound(game, one, &state).is_some_and(|bound| bound < 0)) {
                return Err(Unfit::InvariantBroken);
            }
            if let Some(satisfied) = game.decided(&query.path, &state) {
                decided.add(satisfied, chance);
                continue;
            }
            let movers = at_once(game, &state)?;
            if movers.is_empty() {
                *settled.entry(state).or_default() += chance;
            }
            let share = chance / movers.len() as f64;
            for process in movers {
                for (part, target) in game.outcomes(process, &state, &state)? {
                    *next.entry(target).or_default() += share * part;
                }
            }
        }
        next.retain(|_, chance| *chance > LEAST);
        if next.is_empty() {
            return Ok(settled);
        }
        moving = next;
    }
    Err(Unfit::Zeno)
}

/// The processes that move at this point of the grid; they are equally likely.
fn at_once(game: &Game<'_>, state: &State) -> Result<Vec<usize>, Unfit> {
    let is_forced = |process| {
        let chances = chances(game, process, state);
        chances.bound.is_some() && chances.length == Some(0) && chances.is_open.0
    };
    let moving = game.at_once(state, &is_forced)?;
    let mut processes = 0..game.net.processes.len();
    if moving.is_empty() && processes.any(|one| bound(game, one, state) == Some(0)) {
        return Err(Unfit::TimeLock);
    }
    Ok(moving)
}

/// How long a process may stay where it is, in half steps.
fn bound(game: &Game<'_>, process: usize, state: &State) -> Option<i32> {
    let location = usize::from(state.locations[process]);
    let (clock, most) = game.net.processes[process].locations[location].bound?;
    Some(most * game.steps_in_unit - i32::from(state.clocks[clock]))
}

/// When the outputs of a process that are not urgent are enabled, if nothing else happens.
fn chances(game: &Game<'_>, process: usize, state: &State) -> Chances {
    let bound = bound(game, process, state);
    let mut windows: Vec<(i32, i32)> = game
        .all_outputs(process, state)
        .into_iter()
        .filter(|&one| !game.is_urgent(process, one))
        .filter_map(|one| window(game, (process, one), state, bound))
        .collect();
    windows.sort_unstable();
    let (mut length, mut end) = (0_i64, 0);
    for &(low, high) in &windows {
        length += i64::from((high - low.max(end)).max(0));
        end = end.max(high);
    }
    Chances {
        bound,
        length: i32::try_from(length).ok().filter(|_| end < i32::MAX),
        is_open: (
            windows.iter().any(|one| one.0 <= 0),
            windows.iter().any(|one| one.0 <= 0 && one.1 > 0),
        ),
    }
}

/// From when until when an output is enabled, in half steps from now.
fn window(
    game: &Game<'_>,
    (process, output): (usize, Output),
    state: &State,
    bound: Option<i32>,
) -> Option<(i32, i32)> {
    let (mut low, mut high) = (0, bound.unwrap_or(i32::MAX));
    for atom in game.guard(process, output) {
        match *atom {
            Atom::Clock(clock, compare, constant) => {
                let ahead = constant * game.steps_in_unit - i32::from(state.clocks[clock]);
                if matches!(compare, Compare::AtLeast | Compare::Equal) {
                    low = low.max(ahead);
                }
                if matches!(compare, Compare::AtMost | Compare::Equal) {
                    high = high.min(ahead);
                }
            }
            Atom::Variable(..) if !game.is_true(*atom, state, output.1) => return None,
            Atom::Variable(..) => {}
        }
    }
    (low <= high).then_some((low, high))
}

/// Lets a step of time pass: one process at most moves in it, as if it were at its end.
fn pass(
    game: &Game<'_>,
    query: &Query,
    (state, chance): (State, f64),
    next: &mut Distribution,
    decided: &mut Decided,
) -> Result<(), Unfit> {
    let later = |steps: u16| {
        let mut later = state;
        for clock in 0..game.net.clocks {
            later.clocks[clock] = game.last_step.min(state.clocks[clock] + steps);
        }
        later
    };
    let (inside, end) = (later(1), later(STEP));
    if let Some(satisfied) = game.decided(&query.path, &inside) {
        decided.add(satisfied, chance);
        return Ok(());
    }
    let count = game.net.processes.len();
    let mut fires = [0.0; MOST];
    for (process, fires) in fires.iter_mut().enumerate().take(count) {
        *fires = in_step(game, process, &state);
    }
    for moving in 0..1_u32 << count {
        let mut part = chance;
        for (process, fires) in fires.iter().enumerate().take(count) {
            part *= if moving >> process & 1 == 1 {
                *fires
            } else {
                1.0 - *fires
            };
        }
        if part == 0.0 {
            continue;
        }
        if moving == 0 {
            *next.entry(end).or_default() += part;
        }
        let share = part / f64::from(moving.count_ones());
        for process in (0..count).filter(|process| moving >> process & 1 == 1) {
            for (part, target) in game.outcomes(process, &inside, &end)? {
                *next.entry(target).or_default() += share * part;
            }
        }
    }
    Ok(())
}

/// How likely a process is to move within the next step, if nobody else does.
fn in_step(game: &Game<'_>, process: usize, state: &State) -> f64 {
    let chances = chances(game, process, state);
    if !chances.is_open.1 {
        return 0.0;
    }
    if chances.bound.is_some() {
        let length = chances.length.expect("a bound is finite");
        return f64::from(STEP) / f64::from(length);
    }
    let location = usize::from(state.locations[process]);
    let location = &game.net.processes[process].locations[location];
    let (factor, divisor) = location.rate.expect("it can be left, so it has a rate");
    let rate = f64::from(Game::number(factor, state, 0)) / f64::from(divisor);
    1.0 - (-rate * f64::from(STEP) / f64::from(game.steps_in_unit)).exp()
}
