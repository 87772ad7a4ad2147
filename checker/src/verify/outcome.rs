//! How a check of a strategy ends.

use std::fmt;

use super::effort::GivenUp;
use super::moves::{Move, State};

/// What was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    /// What the parts are.
    pub kind: Kind,
    /// Parts of the closed loop, goals included: sets of clock values with their words.
    pub parts: u64,
    /// Moves that the strategy makes.
    pub own_moves: u64,
    /// Moves of the opponent that it is met by.
    pub opponent_moves: u64,
    /// Parts in which play ends, won.
    pub goals: u64,
}

/// What a check looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Zones of the strategy.
    #[default]
    Zones,
    /// Regions.
    Regions,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Zones => "zones",
            Kind::Regions => "regions",
        })
    }
}

/// What is wrong with a strategy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// There is no decision.
    NoDecision,
    /// The move of the decision is not possible, or not the owner's.
    ImpossibleAction,
    /// What must be kept does not hold.
    Broken,
    /// The goal holds, against the environment.
    GoalReached,
    /// The strategy waits where time cannot pass, although play may stop there, lost, or it must
    /// move itself.
    Stuck,
    /// Play continues forever without what the owner wants.
    Endless,
    /// The goal comes again and again, against the environment.
    Recurring,
    /// The strategy is for another start or time limit than what is asked.
    OtherGame,
    /// The way to where it begins is not possible.
    ImpossibleWay,
    /// The owner does not win, but the run that shows it is too long to be looked for.
    Lost,
}

/// A step of a run.
#[derive(Clone, Debug)]
pub enum Step {
    /// Time passes.
    Time,
    /// A move.
    Move(Move),
}

/// A run that shows a defect: it begins where play does.
#[derive(Clone, Debug)]
pub struct Violation {
    /// What is wrong in the last state.
    pub defect: Defect,
    /// The states, with the values of one valuation of each region in ticks.
    pub states: Vec<State>,
    /// The steps between them, one less.
    pub steps: Vec<Step>,
    /// How many ticks make one unit of time.
    pub ticks_per_unit: i64,
}

/// How a check ended.
#[derive(Clone, Debug)]
pub enum Outcome {
    /// The strategy does what is claimed.
    Verified(Coverage),
    /// It does not.
    Violated(Box<Violation>, Coverage),
    /// There is more to check than is allowed.
    GivenUp(GivenUp, Coverage),
}
