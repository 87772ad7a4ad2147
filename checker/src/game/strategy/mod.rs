//! Strategies: what a player does, state by state.
//!
//! A strategy lists, for each discrete state that play under it can reach, decisions. A decision is
//! a move of its owner, or to wait: let time pass as long as the zones of the decision go, and
//! leave moving to the opponent. A decision of the controller names the edges that it takes, and
//! the environment picks the legs of branch points behind them: a strategy of the environment lists
//! which. States inside chains of forced moves are listed too, so that a strategy can be followed,
//! and checked, move by move. Where play has ended there is nothing to decide.
//!
//! There are six kinds, by who wins and how:
//! * The controller of a reachability game, and the environment of a safety game, follow the stamps
//!   of the gains: from valuations of stamp k they move only into valuations of smaller stamps, or
//!   wait for them; so they make progress and get there.
//! * The controller of a game with a goal that is to come again and again does the same, and from
//!   the goal goes on into anything from which it wins; the ranks count anew from there.
//! * The controller of a safety game may do whatever keeps it safe: its strategy allows all such
//!   moves and all such waiting. It is the most permissive one, with one choice made: where what is
//!   safe has no last moment, and a move must be made before, it is made in the last stretch of
//!   time in which it is possible.
//! * The environment of a game with a goal that is to come again and again keeps it from coming, or
//!   leads play to where the goal comes less often: see [`super::co_buchi`].
//! * The environment of a reachability game that it wins moves where that leads to what the
//!   controller does not win, and else waits: it never gets under pressure there.
//!
//! Source: Cassez et al., CONCUR 2005, section 5 (strategies from the order in which winning states
//! were found).

pub mod attractor;
pub(super) mod chains;
pub mod closed_loop;
pub mod co_buchi;
pub(super) mod extraction;
pub mod plans;
pub(super) mod safety;

use std::sync::Arc;

use crate::network::Part;
use crate::zones::Federation;
use crate::zones::federation::block_bytes;

use crate::game::Player;

/// What to do in some part of a state.
#[derive(Clone, Debug)]
pub struct Decision {
    /// Where it applies.
    pub zones: Federation,
    /// The move to take, where its owner is the controller with whichever branches; `None` is to
    /// wait.
    pub action: Option<Vec<Part>>,
    /// The rank of the valuations: all moves lead to smaller ones, also inside chains. 0 is where
    /// what was sought is reached, and everywhere in a strategy that only has to avoid.
    pub rank: u32,
}

/// A discrete state with its decisions.
#[derive(Clone, Debug)]
pub struct StrategyState {
    /// The words.
    pub words: Vec<i32>,
    /// The decisions, in order.
    pub decisions: Vec<Decision>,
    /// If the owner is the environment: the legs that it picks, as moves of the controller. Of
    /// those with the same entry the first that applies is picked.
    pub legs: Vec<Decision>,
    /// Whether play has ended here, won, whatever the clocks say.
    pub is_goal: bool,
}

impl StrategyState {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        let decisions = self.decisions.iter().chain(&self.legs).map(|decision| {
            let action = decision.action.as_ref();
            let parts = action.map_or(0, |parts| block_bytes(size_of_val(&**parts)));
            decision.zones.heap_bytes() + parts
        });
        let own = size_of::<StrategyState>()
            + block_bytes(size_of_val(&*self.words))
            + block_bytes(self.decisions.capacity() * size_of::<Decision>())
            + block_bytes(self.legs.capacity() * size_of::<Decision>());
        own + decisions.sum::<usize>()
    }
}

/// Which of the decisions that apply counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// The first.
    First,
    /// Any of them: each is allowed.
    Any,
}

/// A strategy.
#[derive(Clone, Debug)]
pub struct Strategy {
    /// Who plays by it.
    pub owner: Player,
    /// Which of the decisions that apply counts. Decisions of states with the same words are one
    /// list, in the order of ranks.
    pub selection: Selection,
    /// Within which time the controller reaches the goal, or up to which the environment prevents
    /// it, if that is limited. Zones have a clock more then: the last one is 0 in the initial state
    /// and nothing sets it.
    pub time_limit: Option<i32>,
    /// The strategy of the controller under which the game is played, if it is under one.
    pub under: Option<Arc<Under>>,
    /// Where play begins.
    pub start: Start,
    /// The states; if play begins in one, that first.
    pub states: Vec<StrategyState>,
}

/// What the controller is allowed in a game.
#[derive(Clone, Debug)]
pub struct Under {
    /// The query that the strategy answers.
    pub query: String,
    /// The strategy: where it says something, the controller makes no other moves and waits only
    /// where it does.
    pub strategy: Arc<Strategy>,
}

/// Where play by a strategy begins.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// In the initial state.
    #[default]
    Initial,
    /// Where both players get to together.
    After(Way),
    /// In any state that can be reached.
    Anywhere,
}

/// Moves of both players from the initial state, with their times.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// How many ticks make one unit of time.
    pub ticks_per_unit: i64,
    /// The moves, each with the wait before it in ticks.
    pub moves: Vec<(i64, Vec<Part>)>,
    /// The wait after the last move, in ticks.
    pub wait: i64,
}

impl Strategy {
    /// One that says nothing yet.
    pub(super) fn empty(owner: Player, selection: Selection) -> Strategy {
        Strategy {
            owner,
            selection,
            time_limit: None,
            under: None,
            start: Start::default(),
            states: Vec::new(),
        }
    }
}

impl Decision {
    /// One of no rank.
    pub(super) fn new(zones: Federation, action: Option<Vec<Part>>) -> Decision {
        Decision {
            zones,
            action,
            rank: 0,
        }
    }
}
