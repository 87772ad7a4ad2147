//! What the seeker may still win, where clocks decide.
//!
//! If all that is not explored counts as won by the seeker, then all that it can win at all is won:
//! the *prospects*. They are computed from what is won, and where the initial valuation is not
//! among them the evader has won, whatever waits. Else they show where the evader is threatened,
//! also many moves before it is too late; so moves that it has held back
//! ([`crate::game::exploration::lazy_safety`]) are chosen against the attacks of the whole game,
//! those that aim at somebody who takes part first, and weak moves only where there are no others.
//!
//! Prospects shrink as the graph grows, so each time they are computed anew. That costs as much as
//! all that was computed before, and is done only if there are several times as many explored
//! states as before, ever more times, and if some node is pressed; in between the evader uses weak
//! moves as well. Where the controller seeks a goal they are computed a few times early on.
//!
//! Source: the losing states of F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient
//! On-the-Fly Algorithms for the Analysis of Timed Games", CONCUR 2005. There they are kept beside
//! the winning ones as the graph grows; here they are what lies outside of the prospects.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;

use super::memory::wins_bytes;
use super::solver::{Solver, Win};
use crate::game::Player;
use crate::zones::federation::table_bytes;

/// Prospects are computed again when there are so many times as many explored states as the first
/// time,
const FIRST_GROWTH: u64 = 3;
/// and so many more. Each time they did not end the game, the next ones wait for twice the growth.
const LEAST_GROWTH: u64 = 16;

/// Where the controller seeks a goal, nothing is held back, and prospects only tell that it has
/// lost. They are computed each time that there are so many times as many explored states,
const GROWTH_OF_A_GOAL: u64 = 6;
/// up to about so many: losing shows early, or rather late, and beside many states they took a
/// third of the time that winning takes.
const MOST_STATES_OF_A_GOAL: u64 = 1 << 13;

/// How the game goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outlook {
    /// The seeker cannot win any more.
    Hopeless,
    /// It may win, and the evader uses more of its moves.
    Open,
    /// What it may win does not hang on anything that the evader holds back.
    Settled,
    /// A limit came first.
    Stopped(StopReason),
}

/// When prospects are computed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Schedule {
    /// How many states are to be explored before they are computed again.
    next: u64,
    /// How many times as many as the next time.
    growth: u64,
    /// Whether they are being computed, instead of what is won.
    pub(super) is_running: bool,
}

/// The prospects of the seeker.
struct Prospects {
    /// By node.
    win: Vec<Win>,
    /// By node: who takes part.
    attackers: Vec<u32>,
}

impl Solver<'_, '_, '_> {
    /// What follows when all nodes in play are explored and computed.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(super) fn outlook(&mut self, watch: &mut dyn Watch) -> Result<Outlook, Failure> {
        if self.defences.uses_weak || !self.defences.is_pressed() {
            return Ok(Outlook::Settled);
        }
        if self.graph.symbolic.tuning().losing_timed && self.graph.explored >= self.schedule.next {
            return self.look_ahead(watch);
        }
        self.use_weak_moves();
        Ok(Outlook::Open)
    }

    /// Whether it is time to compute the prospects although nodes in play wait to be explored.
    pub(super) fn is_prospect_due(&self) -> bool {
        let explored = self.graph.explored;
        let is_of_use = self.graph.symbolic.tuning().losing_timed
            && match self.seeker {
                Player::Environment => self.defences.uses_weak,
                Player::Controller => explored <= MOST_STATES_OF_A_GOAL,
            };
        is_of_use && explored >= self.schedule.next
    }

    /// Computes the prospects, when all else is computed. If there are none, they count as won
    /// afterwards, so that the strategy of the evader keeps out of all that is not explored.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(super) fn look_ahead(&mut self, watch: &mut dyn Watch) -> Result<Outlook, Failure> {
        let explored = self.graph.explored;
        let growth = match self.seeker {
            Player::Environment => self.schedule.growth.max(FIRST_GROWTH),
            Player::Controller => GROWTH_OF_A_GOAL,
        };
        self.schedule.next = growth * explored + LEAST_GROWTH;
        self.schedule.growth = 2 * growth;
        let win = self.win.clone();
        let rest = self.rest.clone();
        let attackers = self.defences.attackers.clone();
        let gained_bytes = self.gained_bytes;
        let rests: usize = rest.values().map(Federation::heap_bytes).sum();
        let tables = table_bytes::<(u32, Federation)>(rest.capacity()) + size_of_val(&*attackers);
        let aside_bytes = wins_bytes(&win) + (rests + tables) as u64;
        self.aside_bytes += aside_bytes;
        let reason = self.hope(watch);
        self.aside_bytes -= aside_bytes;
        let reason = reason?;
        if reason.is_none() && !self.is_won() {
            return Ok(Outlook::Hopeless);
        }
        self.rest = rest;
        self.gained_bytes = gained_bytes;
        let prospects = Prospects {
            win: std::mem::replace(&mut self.win, win),
            attackers: std::mem::replace(&mut self.defences.attackers, attackers),
        };
        if let Some(reason) = reason {
            return Ok(Outlook::Stopped(reason));
        }
        if self.seeker == Player::Controller {
            return Ok(Outlook::Settled);
        }
        self.hold_back_again();
        let is_in_play = self.wait_for_nodes_in_play();
        Ok(self.defend_against(&prospects, &is_in_play, watch))
    }

    /// Adds the prospects to what is won, unless there is a reason to stop before.
    fn hope(&mut self, watch: &mut dyn Watch) -> Result<Option<StopReason>, Failure> {
        let reserve = std::mem::take(&mut self.frontier.reserve);
        let holds = self.defences.take_holds();
        self.schedule.is_running = true;
        for node in 0..self.graph.nodes.len() as u32 {
            if self.is_unexplored(node) {
                self.gain_everything(node);
            }
        }
        let reason = self.propagate(watch);
        self.schedule.is_running = false;
        self.defences.put_holds_back(holds);
        self.frontier.reserve = reserve;
        reason
    }

    /// Lets the evader use a move in every node that is threatened: the strongest there is, none
    /// that is weak if there are others anywhere.
    fn defend_against(
        &mut self,
        prospects: &Prospects,
        is_in_play: &[bool],
        watch: &mut dyn Watch,
    ) -> Outlook {
        if let Some(reason) = self.tell(watch) {
            return Outlook::Stopped(reason);
        }
        let nodes = (0..is_in_play.len() as u32).filter(|&node| is_in_play[node as usize]);
        let best = nodes.filter_map(|node| self.best_defence(node, prospects));
        let best: Vec<(usize, u32)> = best.collect();
        let is_any_strong = best.iter().any(|(_, strength)| *strength > 0);
        for (edge, strength) in &best {
            if *strength > 0 || !is_any_strong {
                self.use_move(*edge);
            }
        }
        if best.is_empty() {
            Outlook::Settled
        } else {
            Outlook::Open
        }
    }

    /// The strongest of the held moves from a node that help against what the seeker may win.
    fn best_defence(&self, node: u32, prospects: &Prospects) -> Option<(usize, u32)> {
        let edges = self.graph.edges_of(node);
        let held: Vec<usize> = edges.filter(|&edge| self.defences.holds(edge)).collect();
        if held.is_empty() {
            return None;
        }
        let hoped = match &prospects.win[node as usize] {
            Win::Nothing => return None,
            Win::Everything => self.whole(node),
            Win::Part(part) => part.clone(),
        };
        let threatened = self.new_part(node, &hoped)?;
        let aims = self.aims(node, &prospects.win, &prospects.attackers);
        let (index, strength) = self.strongest(&held, aims, &threatened)?;
        Some((held[index], strength))
    }
}
