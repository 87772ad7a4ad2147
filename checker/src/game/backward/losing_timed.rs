//! What the seeker may still win, where clocks decide.
//!
//! If all that is not explored counts as won by the seeker, the result is an upper bound of what it
//! can win: the *prospects*. They are computed from what is won. If the initial valuation is not
//! among them, the evader has won, whatever waits in the worklist. Otherwise they show where the
//! evader is threatened, even many moves before it is too late. So the moves that the evader has
//! held back ([`crate::game::exploration::lazy_safety`]) are chosen against the attacks of the
//! whole game. Moves that aim at an attacker come first, and weak moves are used only where there
//! are no others.
//!
//! Prospects shrink as the graph grows, so they are computed again each time. That costs as much as
//! everything that was computed before. So it is done only if the number of explored states has
//! grown several times, by a growing factor, and if some node is undefended. In between, the evader
//! uses weak moves too. If the controller seeks a goal, they are computed a few times at the
//! beginning.
//!
//! Source: the losing states of F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient
//! On-the-Fly Algorithms for the Analysis of Timed Games", CONCUR 2005. There they grow with the
//! graph, like the winning states; here they are the complement of the prospects.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};
use crate::zones::Federation;
use crate::zones::federation::table_bytes;

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::backward::winning_sets::wins_bytes;
use crate::game::exploration::LookAhead;
use crate::game::solver::Solver;

/// Prospects are computed again when the number of explored states is this many times the number at
/// the first time,
const FIRST_GROWTH: u64 = 3;
/// and this much greater. Each time that they did not end the game, they wait for twice the growth.
const LEAST_GROWTH: u64 = 16;

/// If the controller seeks a goal, nothing is held back, and prospects only show that it has lost.
/// They are computed each time that the number of explored states has grown by this factor,
const GROWTH_OF_A_GOAL: u64 = 6;
/// up to about this number. A loss is usually seen early or very late, and with many states the
/// prospects took a third of the time of the game.
const MOST_STATES_OF_A_GOAL: u64 = 1 << 13;

/// The prospects of the seeker.
struct Prospects {
    /// For each node: what the seeker may win.
    win: Vec<Win>,
    /// For each node: the processes that take part.
    attackers: Vec<u32>,
}

impl Solver<'_, '_, '_> {
    /// What follows when all nodes in play are explored and computed.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(in crate::game) fn conclude_in_play(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<LookAhead, Failure> {
        if self.exploration.held.uses_weak || self.exploration.held.undefended.is_empty() {
            return Ok(LookAhead::Settled);
        }
        if self.graph.symbolic.tuning().losing_timed
            && self.graph.explored >= self.exploration.schedule.next
        {
            return self.compute_prospects(watch);
        }
        self.use_weak_moves();
        Ok(LookAhead::Open)
    }

    /// Whether the prospects should be computed now, although nodes in play wait to be explored.
    pub(in crate::game) fn are_prospects_due(&self) -> bool {
        let explored = self.graph.explored;
        let is_of_use = self.graph.symbolic.tuning().losing_timed
            && match self.seeker {
                Player::Environment => self.exploration.held.uses_weak,
                Player::Controller => explored <= MOST_STATES_OF_A_GOAL,
            };
        is_of_use && explored >= self.exploration.schedule.next
    }

    /// Computes the prospects after everything else is computed. If the initial valuation is not
    /// among them, they count as won afterwards, so that the strategy of the evader avoids all that
    /// is not explored.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(in crate::game) fn compute_prospects(
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
        let reason = self.add_prospects(watch);
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

    /// Adds the prospects to what is won, unless a limit ends this before.
    fn add_prospects(&mut self, watch: &mut dyn Watch) -> Result<Option<StopReason>, Failure> {
        let reserve = std::mem::take(&mut self.exploration.reserve);
        let holds = std::mem::take(&mut self.exploration.held.holds);
        self.exploration.schedule.is_running = true;
        for node in 0..self.graph.nodes.len() as u32 {
            if self.is_unexplored(node) {
                self.gain_everything(node);
            }
        }
        let reason = self.propagate(watch);
        self.exploration.schedule.is_running = false;
        self.exploration.held.holds = holds;
        self.exploration.reserve = reserve;
        reason
    }

    /// Lets the evader use a move in every node that is threatened: the strongest one. Weak moves
    /// are used only if there are no others in any node.
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

    /// The strongest held move from a node that helps against what the seeker may win.
    fn best_defence(&self, node: u32, prospects: &Prospects) -> Option<(usize, u32)> {
        let edges = self.graph.edges_of(node);
        let held: Vec<usize> = edges
            .filter(|&edge| self.exploration.held.holds(edge))
            .collect();
        if held.is_empty() {
            return None;
        }
        let threatening = self.federation_of(node, &prospects.win[node as usize]);
        let threatened = self.new_part(node, &threatening)?;
        let aims = self.aims(node, &prospects.win, &prospects.attackers);
        let (index, strength) = self.strongest(&held, aims, &threatened)?;
        Some((held[index], strength))
    }
}
