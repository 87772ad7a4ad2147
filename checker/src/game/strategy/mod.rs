//! Strategies: what a player does, state by state.
//!
//! A strategy lists decisions for each discrete state that play under it can reach. A decision is a
//! move of its owner, or a wait: let time pass inside the zones of the decision, and let the
//! opponent move. A decision of the controller names the edges that it takes, and the environment
//! picks the legs of the branch points after them; a strategy of the environment lists these legs.
//! States inside chains of forced moves are listed too, so that a strategy can be followed, and
//! checked, move by move. Where play has ended there is nothing to decide.
//!
//! There are six kinds, which differ in the winner and the way to win:
//! * The controller of a reachability game, and the environment of a safety game, follow the stamps
//!   of the gains. From valuations of stamp k they move only into valuations of smaller stamps, or
//!   wait for them, so they make progress and reach the target.
//! * The controller of a game with a goal that must recur does the same. From the goal, it
//!   continues into anything from which it wins; the ranks start again there.
//! * The controller of a safety game may do whatever keeps it safe: its strategy allows all such
//!   moves and all such waits. It is the most permissive strategy except for one choice: if the
//!   safe valuations have no last moment, and a move must be made before their end, it is made in
//!   the last stretch of time in which it is possible, of less than a unit.
//! * The environment of a game with a goal that must recur prevents it from recurring, or leads
//!   play to where the goal recurs less often: see [`super::co_buchi`].
//! * The environment of a reachability game that it wins moves where that leads to what the
//!   controller does not win, and otherwise waits: it is never forced to move there.
//!
//! Of a reachability game that the controller wins, [`freedom`] has all moves that keep the win:
//! what queries under the strategy follow.
//!
//! Source: Cassez et al., CONCUR 2005, section 5 (strategies from the order in which winning states
//! were found).

pub mod attractor;
pub(super) mod chains;
pub mod closed_loop;
pub mod co_buchi;
pub(super) mod extraction;
pub mod freedom;
pub mod plan_list;
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
    /// The move to take; if the controller owns it, with any legs. `None` means a wait.
    pub action: Option<Vec<Part>>,
    /// The rank of the valuations: all moves lead to smaller ones, also inside chains. The target
    /// has rank 0, and so has everything in a strategy that only has to avoid.
    pub rank: u32,
}

/// A discrete state with its decisions.
#[derive(Clone, Debug)]
pub struct StrategyState {
    /// The words.
    pub words: Vec<i32>,
    /// The decisions, in order.
    pub decisions: Vec<Decision>,
    /// If the owner is the environment: the legs that it picks, as moves of the controller. Among
    /// those with the same entry, the first that applies is picked.
    pub legs: Vec<Decision>,
    /// Whether play has ended here and is won, for all clock values.
    pub is_goal: bool,
}

impl StrategyState {
    /// The bytes that it takes.
    pub fn bytes(&self) -> usize {
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
    /// The player who uses it.
    pub owner: Player,
    /// Which of the decisions that apply counts. Decisions of states with the same words are one
    /// list, in the order of ranks.
    pub selection: Selection,
    /// The time within which the controller reaches the goal, or up to which the environment
    /// prevents it, if there is a limit. Zones have one more clock then: it is the last one, is 0
    /// in the initial state, and nothing sets it.
    pub time_limit: Option<i32>,
    /// The strategy of the controller under which the game is played, if there is one.
    pub under: Option<Arc<Under>>,
    /// Where play begins.
    pub start: Start,
    /// The states. If play begins in one state, that is the first.
    pub states: Vec<StrategyState>,
}

/// What the controller may do in a game under a strategy.
#[derive(Clone, Debug)]
pub struct Under {
    /// The query that the strategy answers.
    pub query: String,
    /// The strategy: where it has a decision, the controller makes no other moves and waits only
    /// where it does.
    pub strategy: Arc<Strategy>,
}

/// Where play under a strategy begins.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// In the initial state.
    #[default]
    Initial,
    /// In the state that both players reach together.
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
    /// A strategy without decisions.
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

/// Adds a decision, if it applies anywhere.
fn decide(decisions: &mut Vec<Decision>, zones: Federation, action: Option<Vec<Part>>, rank: u32) {
    if !zones.is_empty() {
        decisions.push(Decision {
            zones,
            action,
            rank,
        });
    }
}
