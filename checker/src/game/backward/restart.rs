//! Solving again, in an explored graph: with another target, another seeker, or both players
//! together.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};

use super::winning_sets::{Win, WinningSets};
use crate::game::solver::Solver;
use crate::game::{AfterGoal, Extent, Player, Solution};

impl Solver<'_, '_, '_> {
    /// Forgets what was won, and seeks these parts of the nodes. Play continues in all of them.
    pub(in crate::game) fn restart(&mut self, targets: Vec<Win>) {
        self.sought.targets = Some(targets);
        self.forget_wins();
    }

    /// Forgets what was won. All nodes must be updated.
    pub(super) fn forget_wins(&mut self) {
        self.won = WinningSets::default();
        self.exploration.forget_nodes();
        self.agenda.forget_nodes();
        self.adopt_new_nodes();
        for node in 0..self.graph.nodes.len() as u32 {
            self.agenda.mark(node);
        }
    }

    /// Computes again, in an explored graph, from where the environment can break what must be
    /// kept, whether the goal was met or not. A chain in which the controller waits counts as a way
    /// to escape, since it chooses how long.
    pub(in crate::game) fn compute_breaking(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        self.seeker = Player::Environment;
        self.sought.after_goal = AfterGoal::IsLikeBefore;
        self.sought.targets = None;
        self.forget_wins();
        let reason = self.sweep(watch)?;
        self.sought.after_goal = AfterGoal::GoesOn;
        Ok(reason)
    }

    /// Lets the solver also expand nodes in which the goal holds, and in a cooperative game broken
    /// nodes.
    pub(in crate::game) fn continue_after_goal(&mut self, is_cooperative: bool) {
        self.sought.after_goal = AfterGoal::GoesOn;
        self.sought.is_cooperative = is_cooperative;
        self.wait_for(0);
    }

    /// Whether both players together can get to a state from which the controller wins; explores
    /// everything.
    pub fn solve_cooperative(&mut self, watch: &mut dyn Watch) -> Result<Solution, Failure> {
        self.continue_after_goal(true);
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
