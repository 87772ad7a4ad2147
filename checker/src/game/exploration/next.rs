//! The next step: a node to expand, or the end.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};

use super::{LookAhead, Next, Turn};
use crate::game::Extent;
use crate::game::solver::Solver;

/// The nodes in play are found again when the number of explored states has grown by this part.
const BETWEEN_PLAYS: u64 = 3;

impl Solver<'_, '_, '_> {
    /// Decides the next step.
    ///
    /// # Errors
    /// The model fails in computing what a node wins.
    pub(in crate::game) fn next(
        &mut self,
        turn: Turn,
        extent: Extent,
        watch: &mut dyn Watch,
    ) -> Result<Next, Failure> {
        if extent == Extent::Verdict {
            let has_reserve = self.exploration.reserve.is_used;
            if let Some(next) = self.next_by_prospects(turn, watch)? {
                return Ok(next);
            }
            let is_lost = !self.may_win(0) && !self.may_seeker_win();
            if is_lost || !self.may_win_untimed(has_reserve) {
                return Ok(Next::Nothing);
            }
        }
        if extent != Extent::Everything {
            let has_reserve = self.exploration.reserve.is_used;
            if self.check_crowd() {
                return Ok(Next::Stopped(StopReason::States));
            }
            if has_reserve && self.exploration.waiting.len() == 0 {
                return self.next_from_reserve(turn, watch);
            }
        }
        let tuning = self.graph.symbolic.tuning();
        let Some(node) = self.exploration.waiting.next(&self.graph.nodes, tuning) else {
            return Ok(Next::Nothing);
        };
        let is_skipped = self.graph.nodes[node as usize].is_expanded
            || (extent != Extent::Everything && !self.is_relevant(node));
        Ok(if is_skipped {
            Next::Compute
        } else {
            Next::Expand(node)
        })
    }

    /// Computes what the seeker may still win, if this is due; returns the next step if that ends
    /// the game.
    fn next_by_prospects(
        &mut self,
        turn: Turn,
        watch: &mut dyn Watch,
    ) -> Result<Option<Next>, Failure> {
        if !turn.is_computed || !self.are_prospects_due() {
            return Ok(None);
        }
        Ok(match self.compute_prospects(watch)? {
            LookAhead::Open | LookAhead::Settled => None,
            LookAhead::EvaderWins => Some(Next::Nothing),
            LookAhead::Stopped(reason) => Some(Next::Stopped(reason)),
        })
    }

    /// Whether the seeker may still win, as the graph shows. It is computed only if this is due.
    fn may_win_untimed(&mut self, has_reserve: bool) -> bool {
        let explored = self.graph.explored;
        if explored < self.exploration.next_may_win {
            return true;
        }
        if self.graph.symbolic.tuning().losing_untimed && !self.may_seeker_win() {
            return false;
        }
        self.exploration.next_may_win = if has_reserve {
            self.wait_for_nodes_in_play();
            explored + explored / BETWEEN_PLAYS
        } else {
            2 * explored
        };
        true
    }

    /// Decides the next step if no node waits, but some moves of the evader are not explored.
    fn next_from_reserve(&mut self, turn: Turn, watch: &mut dyn Watch) -> Result<Next, Failure> {
        let is_in_play = self.wait_for_nodes_in_play();
        if !turn.is_dry || self.exploration.waiting.len() > 0 {
            return Ok(Next::Compute);
        }
        Ok(match self.conclude_in_play(watch)? {
            LookAhead::Open => Next::Compute,
            LookAhead::EvaderWins => Next::Nothing,
            LookAhead::Settled => {
                self.avoid_out_of_play(&is_in_play);
                Next::Nothing
            }
            LookAhead::Stopped(reason) => Next::Stopped(reason),
        })
    }
}
