//! Closing the loop: a strategy against every move of its opponent.
//!
//! From a state in which the strategy waits, the opponent may make any of its moves, or time
//! passes. Where the controller acts, the environment may still be first; where the environment
//! acts, it is first. A strategy of the controller is right if
//! * every state that is met before the goal satisfies what must be kept and has a decision;
//! * every action is one of the moves of the state, is the controller's, and its target satisfies
//!   the invariants; whichever branches of its edges the environment picks, play continues
//!   correctly;
//! * where it waits and time cannot pass, the environment has a move and must take it (see
//!   [`Forcing`]); if it has only to keep something, play may also stop there, if the controller
//!   has no move;
//! * if it has to reach the goal, no play continues forever without it, not even by waiting or with
//!   infinitely many moves in a finite time; if the goal must recur, the same holds from each goal
//!   on.
//!
//! One of the environment, which may say which branches of the controller's edges it picks, is
//! right if no play meets the goal before what must be kept is broken, every decision is there and
//! possible, and
//! * against a controller that has to reach the goal, it never waits where it must move;
//! * against one that has to keep something, every play ends in a state in which that is broken;
//! * against one whose goal is to recur, no play meets the goal again and again, and none stops at
//!   one.
//!
//! If the game is played under a strategy of the controller ([`Claim::under`]), the controller has
//! only the moves that this strategy allows. Where it does not allow waiting, no time passes: the
//! controller must move, and has lost if it cannot.
//!
//! From which states the owner wins is computed on sets of clock values ([`super::winning`]). Where
//! it does not win from where play begins, a run over regions shows it ([`super::defects`]).

use crate::ir::{ClockAtom, Network};

use super::defects;
use super::effort::Effort;
use super::moves::{Error, State};
use super::regions::Regions;
use super::rules::Rules;
use super::timed::{Timed, least_multiple};
use super::winning::Winning;

pub use super::outcome::{Coverage, Defect, Kind, Outcome, Step, Violation};
pub use super::rules::{Aim, Claim, Decision, Decisions, Forcing, Owner};

/// Where play begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In the initial state.
    Initial,
    /// In this state.
    State(Timed),
    /// In every state that the model can get to: the strategy must win from each.
    Anywhere,
}

/// The regions that a strategy and what it claims distinguish.
fn regions(network: &Network, strategy: &[Decisions], claim: &Claim<'_>) -> Result<Regions, Error> {
    let under = claim.under.map_or(&[][..], |(under, _)| under);
    let all = strategy.iter().chain(under);
    let all = all.flat_map(|state| state.decisions.iter().chain(&state.legs));
    let mut zones = all.flat_map(|decision| decision.zones.iter().flatten());
    let constants = zones.clone().map(|one| i64::from(one.bound).abs());
    let constant = constants.max().unwrap_or(0).max(claim.constant);
    let has_differences =
        claim.has_differences || zones.any(|one| ClockAtom::from(*one).is_difference());
    Regions::new(network, constant, has_differences)
}

/// Checks a strategy, with this effort.
pub fn verify(
    network: &Network,
    strategy: &[Decisions],
    claim: &Claim<'_>,
    start: &Origin,
    effort: &mut Effort<'_>,
) -> Result<Outcome, Error> {
    let mut ticks_per_unit = Regions::ticks_per_unit(network);
    if let Origin::State(timed) = start {
        ticks_per_unit = least_multiple(ticks_per_unit, timed.ticks_per_unit)
            .ok_or(Error::Unsupported("times so fine"))?;
    }
    if network.features.strict_invariants {
        return Err(Error::Unsupported("strict invariants"));
    }
    let rules = Rules::new(network, ticks_per_unit, strategy, claim);
    let regions = regions(network, strategy, claim)?.with_ticks_per_unit(ticks_per_unit);
    let mut first = match start {
        Origin::Initial | Origin::Anywhere => rules.semantics.initial()?,
        Origin::State(timed) => {
            let timed = timed
                .at_multiple_of(ticks_per_unit)
                .filter(|timed| timed.ticks_per_unit == ticks_per_unit);
            timed.ok_or(Error::Unsupported("times so fine"))?.state
        }
    };
    regions.represent_state(&mut first);
    let is_everywhere = *start == Origin::Anywhere;
    let (mut winning, coverage) = match Winning::new(&rules, &first.words, is_everywhere, effort)? {
        Ok(winning) => {
            let coverage = winning.coverage();
            (winning, coverage)
        }
        Err((why, coverage)) => return Ok(Outcome::GivenUp(why, coverage)),
    };
    let begin = (&*first.words, &*first.clocks);
    effort.restart_count();
    let mut wins = winning.solve(begin, effort)?;
    if wins == Ok(true) && is_everywhere {
        wins = winning.wins_everywhere(begin, effort)?;
    }
    match wins {
        Ok(true) => return Ok(Outcome::Verified(coverage)),
        Ok(false) => {}
        Err(why) => return Ok(Outcome::GivenUp(why, coverage)),
    }
    let is_won = |state: &State| !is_everywhere && winning.wins(&state.words, &state.clocks);
    let start = first.clone();
    let violation = defects::find(&rules, regions, start, is_everywhere, &is_won, effort)?;
    let violation = violation.unwrap_or_else(|| Violation {
        defect: Defect::Lost,
        states: vec![first],
        steps: Vec::new(),
        ticks_per_unit,
    });
    Ok(Outcome::Violated(Box::new(violation), coverage))
}
