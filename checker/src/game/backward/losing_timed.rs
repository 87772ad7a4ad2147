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
//! states as before, ever more times, and if some node is undefended; in between the evader uses
//! weak moves as well. Where the controller seeks a goal they are computed a few times early on.
//!
//! Source: the losing states of F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient
//! On-the-Fly Algorithms for the Analysis of Timed Games", CONCUR 2005. There they are kept beside
//! the winning ones as the graph grows; here they are what lies outside of the prospects.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;
use crate::zones::federation::table_bytes;

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::backward::winning_sets::wins_bytes;
use crate::game::exploration::schedule::LookAhead;
use crate::game::solver::Solver;

/// Prospects are computed again when this many times as many states are explored as the first time,
const FIRST_GROWTH: u64 = 3;
/// and this many more. Each time that they did not end the game, the next ones wait for twice the
/// growth.
const LEAST_GROWTH: u64 = 16;

/// Where the controller seeks a goal, nothing is held back, and prospects only tell that it has
/// lost. They are computed each time that this many times as many states are explored,
const GROWTH_OF_A_GOAL: u64 = 6;
/// up to about this many: losing shows early, or rather late, and beside many states they took a
/// third of the time that winning takes.
const MOST_STATES_OF_A_GOAL: u64 = 1 << 13;

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
    pub(in crate::game) fn look_at_all(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<LookAhead, Failure> {
        if self.exploration.held.uses_weak || !self.exploration.held.is_undefended() {
            return Ok(LookAhead::Settled);
        }
        if self.graph.symbolic.tuning().losing_timed
            && self.graph.explored >= self.exploration.schedule.next
        {
            return self.look_ahead(watch);
        }
        self.use_weak_moves();
        Ok(LookAhead::Open)
    }

    /// Whether it is time to compute the prospects although nodes in play wait to be explored.
    pub(in crate::game) fn is_look_ahead_due(&self) -> bool {
        let explored = self.graph.explored;
        let is_of_use = self.graph.symbolic.tuning().losing_timed
            && match self.seeker {
                Player::Environment => self.exploration.held.uses_weak,
                Player::Controller => explored <= MOST_STATES_OF_A_GOAL,
            };
        is_of_use && explored >= self.exploration.schedule.next
    }

    /// Computes the prospects, when all else is computed. If there are none, they count as won
    /// afterwards, so that the strategy of the evader keeps out of all that is not explored.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(in crate::game) fn look_ahead(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<LookAhead, Failure> {
        let explored = self.graph.explored;
        let growth = match self.seeker {
            Player::Environment => self.exploration.schedule.growth.max(FIRST_GROWTH),
            Player::Controller => GROWTH_OF_A_GOAL,
        };
        self.exploration.schedule.next = growth * explored + LEAST_GROWTH;
        self.exploration.schedule.growth = 2 * growth;
        let win = self.won.win.clone();
        let rest = self.won.rest.clone();
        let attackers = self.exploration.held.attackers.clone();
        let gained_bytes = self.won.bytes;
        let rests: usize = rest.values().map(Federation::heap_bytes).sum();
        let tables = table_bytes::<(u32, Federation)>(rest.capacity()) + size_of_val(&*attackers);
        let aside_bytes = wins_bytes(&win) + (rests + tables) as u64;
        self.aside_bytes += aside_bytes;
        let reason = self.add_what_may_be_won(watch);
        self.aside_bytes -= aside_bytes;
        let reason = reason?;
        if reason.is_none() && !self.is_won() {
            return Ok(LookAhead::EvaderWins);
        }
        self.won.rest = rest;
        self.won.bytes = gained_bytes;
        let prospects = Prospects {
            win: std::mem::replace(&mut self.won.win, win),
            attackers: std::mem::replace(&mut self.exploration.held.attackers, attackers),
        };
        if let Some(reason) = reason {
            return Ok(LookAhead::Stopped(reason));
        }
        if self.seeker == Player::Controller {
            return Ok(LookAhead::Settled);
        }
        self.hold_back_again();
        let is_in_play = self.wait_for_nodes_in_play();
        Ok(self.defend_against(&prospects, &is_in_play, watch))
    }

    /// Adds the prospects to what is won, unless there is a reason to stop before.
    fn add_what_may_be_won(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        let reserve = std::mem::take(&mut self.exploration.reserve);
        let holds = self.exploration.held.take_holds();
        self.exploration.schedule.is_running = true;
        for node in 0..self.graph.nodes.len() as u32 {
            if self.is_unexplored(node) {
                self.gain_everything(node);
            }
        }
        let reason = self.propagate(watch);
        self.exploration.schedule.is_running = false;
        self.exploration.held.put_holds_back(holds);
        self.exploration.reserve = reserve;
        reason
    }

    /// Lets the evader use a move in every node that is threatened: the strongest there is, none
    /// that is weak if there are others anywhere.
    fn defend_against(
        &mut self,
        prospects: &Prospects,
        is_in_play: &[bool],
        watch: &mut dyn Watch,
    ) -> LookAhead {
        if let Some(reason) = self.tell(watch) {
            return LookAhead::Stopped(reason);
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
            LookAhead::Settled
        } else {
            LookAhead::Open
        }
    }

    /// The strongest of the held moves from a node that help against what the seeker may win.
    fn best_defence(&self, node: u32, prospects: &Prospects) -> Option<(usize, u32)> {
        let edges = self.graph.edges_of(node);
        let held: Vec<usize> = edges
            .filter(|&edge| self.exploration.held.holds(edge))
            .collect();
        if held.is_empty() {
            return None;
        }
        let threatening = match &prospects.win[node as usize] {
            Win::Nothing => return None,
            Win::Everything => self.whole(node),
            Win::Part(part) => part.clone(),
        };
        let threatened = self.new_part(node, &threatening)?;
        let aims = self.aims(node, &prospects.win, &prospects.attackers);
        let (index, strength) = self.strongest(&held, aims, &threatened)?;
        Some((held[index], strength))
    }
}
