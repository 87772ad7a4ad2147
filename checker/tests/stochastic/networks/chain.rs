//! Networks without clocks as Markov chains: time-bounded paths by uniformisation, paths bounded by
//! moves by powers.
//!
//! Source: A. Jensen, "Markoff chains as an aid in the study of Markoff processes", Skandinavisk
//! Aktuarietidskrift 36 (1953).

use rustc_hash::FxHashMap;

use super::moves::{Game, State, Unfit};
use super::{Bound, Net, Path, Query, Urgency};

/// What is left over of moves without time is forgotten below this probability.
const LEAST: f64 = 1e-14;
/// So many moves without time in a row are too many.
const MOST_ROUNDS: usize = 400;
/// What is left over of the Poisson distribution.
const TAIL: f64 = 1e-12;

/// States with their probabilities.
pub(crate) type Distribution = FxHashMap<State, f64>;

/// Where the probability went.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Decided {
    pub(crate) satisfied: f64,
    pub(crate) violated: f64,
}

impl Decided {
    pub(crate) fn add(&mut self, satisfied: bool, chance: f64) {
        if satisfied {
            self.satisfied += chance;
        } else {
            self.violated += chance;
        }
    }

    /// The probability of a path once the bound is reached.
    pub(crate) fn probability(&self, path: &Path) -> f64 {
        match path {
            Path::Eventually(_) | Path::Until(..) => self.satisfied,
            Path::Always(_) => 1.0 - self.violated,
        }
    }
}

/// The probability of a query of a network without clocks.
pub(crate) fn probability(net: &Net, query: &Query) -> Result<f64, Unfit> {
    assert_eq!(net.clocks, 0, "clocks are for the grid");
    let game = Game {
        net,
        steps_in_unit: 1,
        last_step: 0,
    };
    match query.bound {
        Bound::Moves(moves) => by_moves(&game, &query.path, moves),
        Bound::HalfUnits(halves) => by_time(&game, &query.path, f64::from(halves) / 2.0),
    }
}

impl Game<'_> {
    /// The processes that wait for a move, with their rates.
    fn rates(&self, state: &State) -> Vec<(usize, f64)> {
        let mut rates = Vec::new();
        for (number, process) in self.net.processes.iter().enumerate() {
            let location = &process.locations[usize::from(state.locations[number])];
            assert_eq!(location.urgency, Urgency::Normal, "time passes");
            if self.outputs(number, state).is_empty() {
                continue;
            }
            let (factor, divisor) = location.rate.expect("it can be left, so it has a rate");
            let rate = f64::from(Self::number(factor, state, 0)) / f64::from(divisor);
            if rate > 0.0 {
                rates.push((number, rate));
            }
        }
        rates
    }
}

/// Lets everything happen that takes no time.
fn settle(
    game: &Game<'_>,
    path: &Path,
    mut moving: Distribution,
    decided: &mut Decided,
) -> Result<Distribution, Unfit> {
    let mut settled = Distribution::default();
    for _ in 0..MOST_ROUNDS {
        let mut next = Distribution::default();
        for (state, chance) in sorted(moving) {
            if let Some(satisfied) = game.decided(path, &state) {
                decided.add(satisfied, chance);
                continue;
            }
            let movers = game.at_once(&state, &|_| false)?;
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

/// In an order that does not depend on hashes, so that sums are the same each time.
pub(crate) fn sorted(distribution: Distribution) -> Vec<(State, f64)> {
    let mut sorted: Vec<(State, f64)> = distribution.into_iter().collect();
    sorted.sort_by_key(|one| one.0);
    sorted
}

fn by_moves(game: &Game<'_>, path: &Path, moves: u32) -> Result<f64, Unfit> {
    let mut decided = Decided::default();
    let mut now = Distribution::from_iter([(State::default(), 1.0)]);
    for left in (0..=moves).rev() {
        let mut next = Distribution::default();
        for (state, chance) in sorted(now) {
            if let Some(satisfied) = game.decided(path, &state) {
                decided.add(satisfied, chance);
                continue;
            }
            if left == 0 {
                continue;
            }
            let movers = game.at_once(&state, &|_| false)?;
            let movers = if movers.is_empty() {
                game.rates(&state)
            } else {
                movers.into_iter().map(|one| (one, 1.0)).collect()
            };
            let total: f64 = movers.iter().map(|one| one.1).sum();
            for (process, weight) in movers {
                for (part, target) in game.outcomes(process, &state, &state)? {
                    *next.entry(target).or_default() += chance * weight / total * part;
                }
            }
        }
        now = next;
    }
    Ok(decided.probability(path))
}

/// A row of the chain: the rate, and what a move comes to.
struct Row {
    rate: f64,
    targets: Vec<(usize, f64)>,
    decided: Decided,
}

fn by_time(game: &Game<'_>, path: &Path, time: f64) -> Result<f64, Unfit> {
    let mut known: FxHashMap<State, usize> = FxHashMap::default();
    let mut states: Vec<State> = Vec::new();
    let mut indexed = |distribution: Distribution, states: &mut Vec<State>| {
        let mut targets = Vec::new();
        for (state, chance) in sorted(distribution) {
            let index = *known.entry(state).or_insert_with(|| {
                states.push(state);
                states.len() - 1
            });
            targets.push((index, chance));
        }
        targets
    };
    let mut decided = Decided::default();
    let start = Distribution::from_iter([(State::default(), 1.0)]);
    let start = settle(game, path, start, &mut decided)?;
    let start = indexed(start, &mut states);
    let mut rows: Vec<Row> = Vec::new();
    while let Some(&state) = states.get(rows.len()) {
        let mut row = Row {
            rate: 0.0,
            targets: Vec::new(),
            decided: Decided::default(),
        };
        let rates = game.rates(&state);
        row.rate = rates.iter().map(|one| one.1).sum();
        let mut next = Distribution::default();
        for (process, rate) in rates {
            for (part, target) in game.outcomes(process, &state, &state)? {
                *next.entry(target).or_default() += rate / row.rate * part;
            }
        }
        let next = settle(game, path, next, &mut row.decided)?;
        row.targets = indexed(next, &mut states);
        rows.push(row);
    }
    let greatest = rows.iter().map(|row| row.rate).fold(0.0, f64::max);
    let mean = greatest * time;
    assert!(mean < 600.0, "the first Poisson weight is a number");
    let mut now = vec![0.0; rows.len()];
    for (index, chance) in start {
        now[index] = chance;
    }
    // After k jumps of the uniformised chain this much is decided.
    let mut weight = (-mean).exp();
    let (mut passed, mut result, mut jumps) = (0.0, Decided::default(), 0.0);
    while passed < 1.0 - TAIL {
        result.satisfied += weight * decided.satisfied;
        result.violated += weight * decided.violated;
        passed += weight;
        jumps += 1.0;
        weight *= mean / jumps;
        if weight < 1e-18 && jumps > mean {
            break;
        }
        let mut next = vec![0.0; rows.len()];
        for (index, row) in rows.iter().enumerate() {
            let jumping = if greatest > 0.0 {
                now[index] * row.rate / greatest
            } else {
                0.0
            };
            next[index] += now[index] - jumping;
            for &(target, part) in &row.targets {
                next[target] += jumping * part;
            }
            decided.satisfied += jumping * row.decided.satisfied;
            decided.violated += jumping * row.decided.violated;
        }
        now = next;
    }
    Ok(result.probability(path))
}
