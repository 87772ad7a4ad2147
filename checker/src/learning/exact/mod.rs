//! The best strategy exactly, where what may happen is finite.
//!
//! The states that can be reached make a Markov decision process (`explore.rs`) if time stands
//! still, or passes by known delays, wherever something is decided or drawn
//! ([`crate::stochastic::Unfolder`]). Its best value is computed between bounds (`solve.rs`), and
//! the strategy is written in what the controller sees (`policy.rs`). What is not finite, too
//! large, or not seen is left to learning, with the reason.

mod collapse;
mod components;
mod cycles;
mod ending;
mod explore;
mod policy;
mod process;
mod solution;
mod solve;
mod states;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use self::explore::{Explored, Unexplored, explore};
use self::policy::{Chosen, choose};
use self::process::Process;
use self::solution::{Solution, Unsolved};
use self::solve::solve;
use self::states::Counting;
use super::strategy::LearnedStrategy;
use super::whole_state::{clock_of_time, whole_state_without_time};
use crate::ir::{Feature, Observation, Optimum, RunLimit, Seen};
use crate::search::limits::{Counters, StopReason};
use crate::stochastic::{Behaviour, Failure, NotFinite, Runner, Unfolder};

/// The best value, and who attains it.
#[derive(Debug)]
pub struct Exact {
    /// The best value lies between these numbers.
    pub lower: f64,
    /// The greater one.
    pub upper: f64,
    /// What the strategy is worth lies between these numbers, too.
    pub strategy: Arc<LearnedStrategy>,
    /// What was explored.
    pub counters: Counters,
}

/// What came of it.
#[derive(Debug)]
pub enum ExactAnswer {
    /// The best value.
    Best(Exact),
    /// Runs can cycle in no time, and gain by it each time: there is no best value.
    Unbounded,
    /// Under no strategy do runs end almost surely.
    NeverEnds,
    /// Others have to answer.
    Left(Inexact),
}

/// Why the answer is left to learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inexact {
    /// What may happen is not finite.
    NotFinite(NotFinite),
    /// What functions of libraries do is not known.
    Library,
    /// A shield goes by words that make no other difference.
    Shield,
    /// There are too many states.
    TooLarge,
    /// A limit was reached.
    Limit(StopReason),
    /// States look alike in which different moves are best.
    Hidden,
    /// Cycles that take no time have both gains and costs.
    MixedCycles,
    /// Bounds come too slowly near to each other.
    Slow,
}

/// The nearness of what the strategy is worth to the best value, as a part of it.
const PRECISION: f64 = 1e-6;
/// And as a part of the greatest cost of a move, where the costs of a run cancel out.
const ROUNDING: f64 = 1e-10;

/// Answers a query for the best strategy exactly, if that is possible. `look` sees the counters now
/// and then; a reason ends it.
///
/// # Errors
/// A run fails in some state.
pub fn solve_exactly(
    behaviour: Behaviour<'_>,
    asked: &Optimum,
    look: &mut dyn FnMut(&Counters) -> Option<StopReason>,
) -> Result<ExactAnswer, Failure> {
    let network = behaviour.network;
    if !network.externals.is_empty() {
        return Ok(ExactAnswer::Left(Inexact::Library));
    }
    if behaviour.fence.is_some() {
        return Ok(ExactAnswer::Left(Inexact::Shield));
    }
    if behaviour.restriction.is_some() && asked.bound.limit != RunLimit::Time {
        // It may look at the time, which is then no part of the state.
        return Ok(ExactAnswer::Left(Inexact::NotFinite(NotFinite::Demand)));
    }
    if let Some(features) = &asked.features {
        return solve_for(behaviour, asked, features.clone(), None, look);
    }
    let observation = whole_state_without_time(network, asked);
    let mut with_time = observation.clone();
    let found = solve_for(behaviour, asked, observation, None, look)?;
    // How much time is left is part of the whole state, too, if a clock shows it.
    if let (ExactAnswer::Left(Inexact::Hidden), Some(clock)) =
        (&found, clock_of_time(asked, network))
        && !with_time.continuous.contains(&clock)
    {
        with_time.continuous.push(clock.clone());
        return solve_for(behaviour, asked, with_time, Some(&clock), look);
    }
    Ok(found)
}

/// Answers it for a controller that sees this, and a feature in any case.
fn solve_for(
    behaviour: Behaviour<'_>,
    asked: &Optimum,
    mut observation: Observation,
    shown: Option<&Feature>,
    look: &mut dyn FnMut(&Counters) -> Option<StopReason>,
) -> Result<ExactAnswer, Failure> {
    let network = behaviour.network;
    let mut unfolder = Unfolder::new(behaviour, observation.has_clocks());
    let is_refined = behaviour.restriction.is_some();
    // What is seen by name keeps its value; of the whole state only what may still be read.
    let words: Vec<u32> = features(&observation).filter_map(first_word).collect();
    let mut kept: Vec<u32> = Vec::new();
    if asked.features.is_some() {
        kept.extend(features(&observation).flat_map(words_of));
    }
    kept.extend(shown.into_iter().flat_map(words_of));
    let asked_about: &[u32] = if asked.features.is_none() {
        &words
    } else {
        &[]
    };
    let mut explored = loop {
        let counting = Counting::new(network, asked, &observation, &kept, is_refined);
        let seen = (&observation, asked_about);
        let found = explore(behaviour, asked, &mut unfolder, counting, seen, look)?;
        let explored = match found {
            Ok(explored) => explored,
            Err(why) => return Ok(ExactAnswer::Left(why.into())),
        };
        let before = kept.len();
        for (place, &word) in asked_about.iter().enumerate() {
            let is_both = explored.is_live[place] && explored.is_dead[place];
            if is_both && !kept.contains(&word) {
                let mut features = features(&observation);
                let feature = features.find(|one| first_word(one) == Some(word));
                kept.extend(feature.into_iter().flat_map(words_of));
            }
        }
        if kept.len() == before {
            break explored;
        }
    };
    if asked.features.is_none() {
        leave_out(&mut explored, &mut observation, asked_about, shown);
    }
    Ok(answer(behaviour, asked, &explored, observation))
}

fn answer(
    behaviour: Behaviour<'_>,
    asked: &Optimum,
    explored: &Explored<'_>,
    observation: Observation,
) -> ExactAnswer {
    let mut solution = match solve(&explored.process) {
        Ok(solution) => solution,
        Err(Unsolved::Unbounded) => return ExactAnswer::Unbounded,
        Err(Unsolved::MixedCycles) => return ExactAnswer::Left(Inexact::MixedCycles),
        Err(Unsolved::Slow) => return ExactAnswer::Left(Inexact::Slow),
    };
    if !solution.upper[0].is_finite() {
        return ExactAnswer::NeverEnds;
    }
    let Some(chosen) = strategy(explored, &mut solution) else {
        return ExactAnswer::Left(Inexact::Hidden);
    };
    let moves = Runner::of(behaviour).moves_of_controller();
    let strategy = LearnedStrategy::of_trees(
        chosen.trees.into_iter(),
        &Arc::new(observation),
        &moves,
        asked.is_greatest,
    );
    let (least, greatest) = (solution.lower[0], solution.upper[0]);
    let (lower, upper) = if asked.is_greatest {
        (explored.start - greatest, explored.start - least)
    } else {
        (explored.start + least, explored.start + greatest)
    };
    ExactAnswer::Best(Exact {
        lower: lower + 0.0,
        upper: upper + 0.0,
        strategy: Arc::new(strategy),
        counters: explored.counters(explored.states.len()),
    })
}

/// A strategy that is as good as the best one; `None` if too little is seen for that. The upper
/// bound of the initial state becomes its own.
fn strategy(explored: &Explored<'_>, solution: &mut Solution) -> Option<Chosen> {
    let process = &explored.process;
    let chosen = choose(explored, solution, |_| true).or_else(|| {
        // Only what the best strategy can come to has to be told apart.
        let reached = reached(process, solution);
        choose(explored, solution, |node| reached[node as usize])
    })?;
    let decisions = explored.decisions.iter().zip(&chosen.choices);
    let differs = |(&node, choice): (&u32, &Option<u32>)| {
        choice.is_some_and(|choice| choice != solution.policy[node as usize])
    };
    if decisions.clone().any(differs) {
        let mut taken = vec![None; process.nodes()];
        for (&node, &choice) in decisions {
            taken[node as usize] = choice;
        }
        let alone = solve(&process.under(&taken)).ok()?;
        let (least, own) = (solution.lower[0], alone.upper[0]);
        let costs = process.costs.iter().map(|cost| cost.abs());
        let rounding = ROUNDING * costs.fold(0.0, f64::max);
        if !own.is_finite() || own - least > PRECISION * least.abs() + rounding {
            return None;
        }
        solution.upper[0] = own;
    }
    Some(chosen)
}

/// By node: whether it can be reached under the policy.
fn reached(process: &Process, solution: &Solution) -> Vec<bool> {
    let mut reached = vec![false; process.nodes()];
    let mut open = vec![0];
    while let Some(node) = open.pop() {
        if std::mem::replace(&mut reached[node as usize], true) {
            continue;
        }
        let choice = solution.policy[node as usize] as usize;
        open.extend(process.outcomes(choice).map(|(target, _)| target));
    }
    reached
}

fn features(observation: &Observation) -> impl Iterator<Item = &Feature> {
    observation.discrete.iter().chain(&observation.continuous)
}

/// The word that a feature is, or begins with.
fn first_word(feature: &Feature) -> Option<u32> {
    match feature.seen {
        Seen::Location(_) | Seen::Computed(_) => None,
        Seen::Integer(word) | Seen::Double(word) | Seen::Clock(word) => Some(word),
    }
}

/// The words of a feature.
fn words_of(feature: &Feature) -> Vec<u32> {
    match feature.seen {
        Seen::Location(_) | Seen::Computed(_) => Vec::new(),
        Seen::Integer(word) => vec![word],
        Seen::Double(word) | Seen::Clock(word) => vec![word, word + 1],
    }
}

/// Leaves out of the whole state what nothing reads any more at any decision: its value is not
/// kept. One clock stays where there was one, for the controller is asked as one that sees time.
fn leave_out(
    explored: &mut Explored<'_>,
    observation: &mut Observation,
    words: &[u32],
    shown: Option<&Feature>,
) {
    let stays = |feature: &Feature| {
        let word = first_word(feature);
        let place = words.iter().position(|&one| Some(one) == word);
        Some(feature) == shown || place.is_none_or(|place| explored.is_live[place])
    };
    let has_clocks = observation.has_clocks();
    let discrete: Vec<bool> = observation.discrete.iter().map(stays).collect();
    let mut continuous: Vec<bool> = observation.continuous.iter().map(stays).collect();
    let is_clock = |one: &Feature| matches!(one.seen, Seen::Clock(_));
    let mut clocks = observation.continuous.iter().zip(&continuous);
    if has_clocks && !clocks.any(|(one, stays)| *stays && is_clock(one)) {
        let first = observation.continuous.iter().position(is_clock);
        let first = first.expect("there is a clock");
        continuous[first] = true;
        // Its value was not kept, and says nothing.
        let depth = continuous.len();
        for point in explored.points.chunks_mut(depth) {
            point[first] = 0.0;
        }
    }
    let widths: Vec<usize> = observation
        .discrete
        .iter()
        .map(|one| match one.seen {
            Seen::Location(_) | Seen::Integer(_) => 1,
            _ => 2,
        })
        .collect();
    let of_words = discrete.iter().zip(&widths);
    let of_words: Vec<bool> = of_words
        .flat_map(|(&stays, &width)| std::iter::repeat_n(stays, width))
        .collect();
    retain(&mut explored.keys, &of_words);
    retain(&mut explored.points, &continuous);
    retain(&mut observation.discrete, &discrete);
    retain(&mut observation.continuous, &continuous);
}

/// Keeps of each row what stays.
fn retain<T>(rows: &mut Vec<T>, stays: &[bool]) {
    let mut place = 0;
    rows.retain(|_| {
        let is_kept = stays[place % stays.len()];
        place += 1;
        is_kept
    });
}

impl From<Unexplored> for Inexact {
    fn from(why: Unexplored) -> Inexact {
        match why {
            Unexplored::NotFinite(reason) => Inexact::NotFinite(reason),
            Unexplored::Limit(reason) => Inexact::Limit(reason),
            Unexplored::TooLarge => Inexact::TooLarge,
        }
    }
}
