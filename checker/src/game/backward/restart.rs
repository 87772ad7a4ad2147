//! Solving again, in an explored graph: with another target, another seeker, or both players
//! together.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};

use super::winning_sets::{Win, WinningSets};
use crate::game::solver::Solver;
use crate::game::{AfterGoal, Extent, Player, Solution};

impl Solver<'_, '_, '_> {
    /// Forgets what was won, and seeks these parts of the nodes, in all of which play goes on.
    pub(in crate::game) fn restart(&mut self, targets: Vec<Win>) {
        self.sought.targets = Some(targets);
        self.begin_anew();
    }

    /// Forgets what was won. All nodes are to be updated.
    pub(super) fn begin_anew(&mut self) {
        self.won = WinningSets::default();
        self.exploration.forget_nodes();
        self.agenda.forget_nodes();
        self.adopt_new_nodes();
        for node in 0..self.graph.nodes.len() as u32 {
            self.agenda.mark(node);
        }
    }

    /// Computes anew, in an explored graph, from where the environment can break what must be kept,
    /// whether the goal was met or not. A chain in which the controller waits counts as a way to
    /// get away, since it chooses how long.
    pub(in crate::game) fn seek_to_break(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        self.seeker = Player::Environment;
        self.sought.after_goal = AfterGoal::IsLikeBefore;
        self.sought.targets = None;
        self.begin_anew();
        let reason = self.sweep(watch)?;
        self.sought.after_goal = AfterGoal::GoesOn;
        Ok(reason)
    }

    /// Lets nodes be expanded in which the goal holds; in a cooperative game also those that are
    /// broken.
    pub(in crate::game) fn go_on(&mut self, is_cooperative: bool) {
        self.sought.after_goal = AfterGoal::GoesOn;
        self.sought.is_cooperative = is_cooperative;
        self.wait_for(0);
    }

    /// Whether both players together can get to where the controller wins; explores everything.
    pub fn solve_cooperative(&mut self, watch: &mut dyn Watch) -> Result<Solution, Failure> {
        self.go_on(true);
        if let Solution::Stopped(reason) = self.solve(Extent::Everything, watch)? {
            return Ok(Solution::Stopped(reason));
        }
        Ok(Solution::Won(if self.has_won_somewhere() {
            Player::Controller
        } else {
            Player::Environment
        }))
    }

    /// Whether the controller wins somewhere, inside chains included.
    pub(in crate::game) fn has_won_somewhere(&self) -> bool {
        if self.seeker == Player::Controller {
            return self.won.win.iter().any(|win| !matches!(win, Win::Nothing));
        }
        let mut edges = self.graph.edges.iter();
        self.won
            .win
            .iter()
            .any(|win| !matches!(win, Win::Everything))
            || edges.any(|edge| edge.length > 1 && !self.spoiling(edge).is_empty())
    }
}
