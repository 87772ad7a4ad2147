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

use std::sync::Arc;

use crate::cancellation;
use crate::network::{ClockEffect, Failure, Moves, Part};
use crate::search::limits::{StopReason, Watch};
use crate::zones::dbm::Constraint;
use crate::zones::federation::block_bytes;
use crate::zones::{ClockSet, Federation};

use super::safety;
use crate::game::Player;
use crate::game::backward::solver::{Gain, Solver, Win};
use crate::game::forward::chance::entry_of;
use crate::game::forward::node::{Edge, Standing};

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
    fn bytes(&self) -> usize {
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

/// Reads the strategy of the player who wins a solved game.
///
/// # Errors
/// The model fails in a state of it. An error of the inner result says why it was not finished.
pub fn extract(
    solver: &mut Solver<'_, '_, '_>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    let owner = if solver.is_won() {
        solver.seeker
    } else {
        solver.seeker.opponent()
    };
    extract_from(solver, owner, vec![0], watch)
}

/// Reads the strategy of a player who wins from these nodes of a solved game.
///
/// # Errors
/// As [`extract`].
pub fn extract_from(
    solver: &mut Solver<'_, '_, '_>,
    owner: Player,
    mut waiting: Vec<u32>,
    watch: &mut dyn Watch,
) -> Result<Result<Strategy, StopReason>, Failure> {
    if let Some(reason) = solver.tell(watch) {
        return Ok(Err(reason));
    }
    let is_seeking = owner == solver.seeker;
    let mut strategy = Strategy {
        owner,
        selection: match owner {
            Player::Controller if !is_seeking => Selection::Any,
            _ => Selection::First,
        },
        time_limit: None,
        under: None,
        start: Start::default(),
        states: Vec::new(),
    };
    let mut bytes = 0;
    let mut steps_to_end = Vec::new();
    let mut seen = vec![false; solver.graph.nodes.len()];
    for &node in &waiting {
        seen[node as usize] = true;
    }
    while let Some(node) = waiting.pop() {
        let known = strategy.states.len();
        let mut words = solver.graph.symbolic.stepper.network().initial.clone();
        solver.graph.load(node, &mut words);
        let Choices {
            decisions,
            legs,
            taken,
        } = if is_seeking {
            choices(solver, node)?
        } else {
            safety::choices(solver, node)?
        };
        let standing = solver.graph.nodes[node as usize].standing;
        let source = words.clone();
        strategy.states.push(StrategyState {
            words,
            decisions,
            legs,
            is_goal: standing == won_standing(owner)
                && solver.targets.is_none()
                && !hangs_on_time(solver, owner),
        });
        steps_to_end.resize(strategy.states.len(), 0);
        for edge in taken {
            if is_seeking {
                inner_states(solver, edge, &source, &mut strategy)?;
                let inner = strategy.states.len() - steps_to_end.len();
                steps_to_end.extend((1..=inner as u32).rev());
            } else {
                safety::inner_states(solver, edge, &source, &mut strategy)?;
            }
            let target = solver.graph.edges[edge as usize].target;
            if !std::mem::replace(&mut seen[target as usize], true) {
                waiting.push(target);
            }
        }
        keep(&strategy.states[known..], &mut bytes);
    }
    if is_seeking {
        rank_chains(&mut strategy, &steps_to_end);
    }
    Ok(Ok(strategy))
}

/// Adds what new states take to the bytes of a strategy, and asks whether it may take so many.
pub(super) fn keep(states: &[StrategyState], bytes: &mut usize) {
    *bytes += states.iter().map(StrategyState::bytes).sum::<usize>();
    cancellation::ask_for(*bytes);
}

/// Ranks states inside chains above the end of their chain, by their steps to it. Their words may
/// be those of a node as well; at equal ranks the chain could be entered again from where it has
/// led.
fn rank_chains(strategy: &mut Strategy, steps_to_end: &[u32]) {
    let states = strategy.states.iter().zip(steps_to_end);
    let mut ranks: Vec<(u32, u32)> = states
        .flat_map(|(state, &steps)| {
            let decisions = state.decisions.iter().chain(&state.legs);
            decisions.map(move |one| (one.rank, steps))
        })
        .chain([(0, 0)])
        .collect();
    ranks.sort_unstable();
    ranks.dedup();
    for (state, &steps) in strategy.states.iter_mut().zip(steps_to_end) {
        for decision in state.decisions.iter_mut().chain(&mut state.legs) {
            let rank = ranks.partition_point(|&rank| rank < (decision.rank, steps));
            decision.rank = rank as u32;
        }
    }
}

/// Whether a player wins in the goal only until some time.
fn hangs_on_time(solver: &Solver<'_, '_, '_>, owner: Player) -> bool {
    owner == Player::Controller && solver.graph.latest.is_some()
}

/// The nodes in which play has ended in favour of a player.
fn won_standing(owner: Player) -> Standing {
    match owner {
        Player::Controller => Standing::Goal,
        Player::Environment => Standing::Broken,
    }
}

/// What is chosen in a node.
#[derive(Default)]
pub(super) struct Choices {
    pub(super) decisions: Vec<Decision>,
    /// See [`StrategyState::legs`].
    pub(super) legs: Vec<Decision>,
    /// The edges that play may take from it.
    pub(super) taken: Vec<u32>,
}

/// What the seeker chooses in a node.
fn choices(solver: &mut Solver<'_, '_, '_>, node: u32) -> Result<Choices, Failure> {
    let mut chosen = Choices::default();
    let is_over = solver.graph.nodes[node as usize].standing == won_standing(solver.seeker);
    let is_ever_over = solver.targets.is_none() && !hangs_on_time(solver, solver.seeker);
    if is_over && is_ever_over {
        return Ok(chosen);
    }
    let Choices {
        decisions,
        legs,
        taken,
    } = &mut chosen;
    let moves = moves_of(solver, node)?;
    for gain in solver.gains[node as usize].clone() {
        let mut rest = whole_or_part(solver, node, gain.part.as_ref());
        // Where what is sought is to come again and again, play goes on from there into anything
        // that is won.
        let goes_on = solver.targets.is_some();
        let earlier = |solver: &Solver<'_, '_, '_>, edge: u32| {
            let target = solver.graph.edges[edge as usize].target;
            if gain.stamp > 0 {
                won_before(solver, target, gain.stamp)
            } else {
                solver.win[target as usize].clone()
            }
        };
        if gain.stamp > 0 || goes_on {
            for edges in own_choices(solver, node) {
                let first = solver.graph.edges[edges[0] as usize];
                let wins = edges.iter().map(|&edge| earlier(solver, edge));
                let wins: Vec<Win> = wins.collect();
                let zones = match &wins[..] {
                    [win] => solver.before(&first, win),
                    wins => solver.before_all(edges.iter().copied().zip(wins)),
                };
                let zones = zones.intersection(&rest);
                if !zones.is_empty() {
                    rest.subtract(&zones);
                    decisions.push(Decision {
                        zones,
                        action: Some(named(solver, &moves, &first)),
                        rank: gain.stamp,
                    });
                    taken.extend(edges);
                }
            }
            if solver.seeker == Player::Environment {
                let whole = whole_or_part(solver, node, gain.part.as_ref());
                let mut picked = |solver: &Solver<'_, '_, '_>, leg: u32| {
                    solver.won_by_leg(leg, &earlier(solver, leg))
                };
                let chosen = (&mut *legs, &mut *taken);
                solver.pick_legs(node, (&whole, gain.stamp), &mut picked, chosen)?;
            }
        }
        if !rest.is_empty() {
            decisions.push(Decision {
                zones: rest,
                action: None,
                rank: gain.stamp,
            });
        }
    }
    let opponent = solver.graph.edges_of(node).filter(|&edge| {
        let edge = &solver.graph.edges[edge];
        !edge.is_leg && !solver.seeker.owns(edge.controllable)
    });
    taken.extend(opponent.map(|edge| edge as u32));
    Ok(chosen)
}

/// What the seeker can choose in a node: edges, each alone unless they are the legs of an entry.
fn own_choices(solver: &Solver<'_, '_, '_>, node: u32) -> Vec<Vec<u32>> {
    let edges = solver.graph.edges_of(node).filter(|&edge| {
        let edge = &solver.graph.edges[edge];
        !edge.is_leg && solver.seeker.owns(edge.controllable)
    });
    let mut choices: Vec<Vec<u32>> = edges.map(|edge| vec![edge as u32]).collect();
    if solver.seeker == Player::Controller {
        choices.extend_from_slice(solver.graph.chances.of(node));
        choices.sort_unstable();
    }
    choices
}

/// How a strategy names the first move of an edge, of a node with these moves, if the player who
/// owns the move takes it.
pub(super) fn named(solver: &Solver<'_, '_, '_>, moves: &Moves, edge: &Edge) -> Vec<Part> {
    let parts = moves.get(edge.ordinal as usize).parts;
    if solver.graph.chances.is_possible() && edge.controllable {
        entry_of(parts)
    } else {
        parts.to_vec()
    }
}

pub(in crate::game) fn moves_of(
    solver: &mut Solver<'_, '_, '_>,
    node: u32,
) -> Result<Moves, Failure> {
    let mut words = solver.graph.symbolic.stepper.network().initial.clone();
    solver.graph.load(node, &mut words);
    let mut moves = Moves::default();
    solver
        .graph
        .symbolic
        .remembered_moves(&mut words, &mut moves)?;
    Ok(moves)
}

pub(super) fn whole_or_part(
    solver: &Solver<'_, '_, '_>,
    node: u32,
    part: Option<&Federation>,
) -> Federation {
    match part {
        Some(part) => part.clone(),
        None => solver.whole(node),
    }
}

/// The valuations of a node that were won before a stamp.
fn won_before(solver: &Solver<'_, '_, '_>, node: u32, stamp: u32) -> Win {
    let mut won: Option<Federation> = None;
    for Gain { stamp: _, part } in solver.gains[node as usize]
        .iter()
        .filter(|gain| gain.stamp < stamp)
    {
        let Some(part) = part else {
            return Win::Everything;
        };
        match &mut won {
            None => won = Some(part.clone()),
            Some(won) => {
                won.unite(part);
            }
        }
    }
    won.map_or(Win::Nothing, Win::Part)
}

/// A state inside a chain, with its only move.
pub(super) struct Inner {
    pub(super) words: Vec<i32>,
    pub(super) parts: Vec<Part>,
    pub(super) controllable: bool,
    /// Whether time may pass before the move.
    pub(super) delays: bool,
    /// The invariant of the state.
    pub(super) invariant: Vec<Constraint>,
    pub(super) effect: ClockEffect,
}

/// Adds the states inside a chain. Each has one move, which is taken where the rest of the chain
/// leads into valuations of the end that are won; the smaller their stamp, the better. Until then
/// the strategy waits.
fn inner_states(
    solver: &mut Solver<'_, '_, '_>,
    edge: u32,
    source: &[i32],
    strategy: &mut Strategy,
) -> Result<(), Failure> {
    let edge = solver.graph.edges[edge as usize];
    let inside = walk(solver, &edge, source)?;
    let is_own = |inner: &Inner| solver.seeker.owns(inner.controllable);
    let mut decisions: Vec<Vec<Decision>> = vec![Vec::new(); inside.len()];
    for gain in &solver.gains[edge.target as usize] {
        let mut won = whole_or_part(solver, edge.target, gain.part.as_ref());
        for (inner, decisions) in inside.iter().zip(&mut decisions).rev() {
            inner.effect.preimage(&mut won);
            won.constrain_all(&inner.invariant);
            decisions.push(Decision {
                zones: won.clone(),
                action: is_own(inner).then(|| inner.parts.clone()),
                rank: gain.stamp,
            });
            if inner.delays {
                won.down(&ClockSet::default());
                won.constrain_all(&inner.invariant);
                decisions.push(Decision {
                    zones: won.clone(),
                    action: None,
                    rank: gain.stamp,
                });
            }
        }
    }
    for (inner, mut decisions) in inside.into_iter().zip(decisions) {
        decisions.retain(|decision| !decision.zones.is_empty());
        strategy.states.push(StrategyState {
            words: inner.words,
            decisions,
            legs: Vec::new(),
            is_goal: false,
        });
    }
    Ok(())
}

/// The states inside the chain of an edge, in order.
pub(super) fn walk(
    solver: &mut Solver<'_, '_, '_>,
    edge: &Edge,
    source: &[i32],
) -> Result<Vec<Inner>, Failure> {
    let symbolic = &mut *solver.graph.symbolic;
    let mut words = source.to_vec();
    let mut moves = Moves::default();
    symbolic.remembered_moves(&mut words, &mut moves)?;
    let mut inside = Vec::new();
    let Some(first) = symbolic.fire(moves.get(edge.ordinal as usize), &mut words)? else {
        return Ok(inside);
    };
    let mut invariant = first.invariant;
    for _ in 1..edge.length {
        let delays = symbolic.may_delay(&mut words)?;
        symbolic.remembered_moves(&mut words, &mut moves)?;
        let before = words.clone();
        let one = moves.get(0);
        let Some(effect) = symbolic.fire(one, &mut words)? else {
            break;
        };
        inside.push(Inner {
            words: before,
            parts: one.parts.to_vec(),
            controllable: one.controllable,
            delays,
            invariant: std::mem::replace(&mut invariant, effect.invariant.clone()),
            effect,
        });
    }
    Ok(inside)
}
