//! The target of the seeker: the valuations of each node that are won from the start.

use crate::zones::Federation;

use crate::game::AfterGoal;
use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Standing;
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
    /// Adds new nodes to the winning sets: their part of the target is won from the start.
    pub(in crate::game) fn adopt_new_nodes(&mut self) {
        for node in self.won.win.len()..self.graph.nodes.len() {
            let win = self.target_in(node as u32);
            let rest = match &win {
                Win::Part(part) => Some(self.whole(node as u32).minus(part)),
                Win::Nothing | Win::Everything => None,
            };
            self.won.add_node(win, rest);
            self.exploration.add_node();
            self.guide_node(node as u32);
            self.agenda.add_node();
            if node == 0 {
                self.wait_for(0);
            }
        }
    }

    /// Evaluates the guide in a new node. What it cannot be computed for is explored last.
    fn guide_node(&mut self, node: u32) {
        let Some(guide) = self.exploration.waiting.guide() else {
            return;
        };
        self.graph.load(node, &mut self.words);
        let value = self.graph.symbolic.stepper.evaluate(guide, &mut self.words);
        let value = value.unwrap_or(i32::MAX);
        self.exploration.waiting.set_value(node, value);
    }

    /// The part of a node that is the target of the seeker.
    fn target_in(&self, node: u32) -> Win {
        if let Some(targets) = &self.sought.targets {
            return targets[node as usize].clone();
        }
        let part = match (self.graph.nodes[node as usize].standing, self.seeker) {
            (Standing::Goal, Player::Controller) | (Standing::Broken, Player::Environment) => {
                return Win::Everything;
            }
            (Standing::Mixed, Player::Controller) => self.goal(node),
            (Standing::Mixed, Player::Environment) => self.broken(node),
            _ => return Win::Nothing,
        };
        Win::of(part)
    }

    /// Whether the words alone decide the winner in a node.
    pub(in crate::game) fn is_decided(&self, node: u32) -> bool {
        match self.graph.nodes[node as usize].standing {
            Standing::Broken | Standing::Dead => true,
            Standing::Goal => {
                self.sought.targets.is_none() && self.sought.after_goal != AfterGoal::IsLikeBefore
            }
            Standing::Open | Standing::Mixed => false,
        }
    }

    /// Whether play has ended in a node for all clock values, with this winner.
    pub(in crate::game) fn is_over(&self, winner: Player, node: u32) -> bool {
        let (standing, depends_on_time) = match winner {
            Player::Controller => (Standing::Goal, self.graph.latest.is_some()),
            Player::Environment => (Standing::Broken, false),
        };
        self.graph.nodes[node as usize].standing == standing
            && self.sought.targets.is_none()
            && !depends_on_time
    }

    /// Where the goal holds, or where the target is, in a node that is neither a goal nor broken as
    /// a whole.
    pub(in crate::game) fn goal(&self, node: u32) -> Federation {
        if let Some(targets) = &self.sought.targets {
            return self.federation_of(node, &targets[node as usize]);
        }
        let none = || Federation::empty(self.graph.dimension());
        if self.sought.after_goal == AfterGoal::IsLikeBefore {
            return none();
        }
        let parts = self.graph.parts(node);
        parts.map_or_else(none, |parts| parts.goal.clone())
    }

    /// Where what must be kept does not hold, without goals; the node is as for [`Solver::goal`].
    pub(in crate::game) fn broken(&self, node: u32) -> Federation {
        let none = || Federation::empty(self.graph.dimension());
        let parts = self.graph.parts(node);
        parts.map_or_else(none, |parts| parts.broken.clone())
    }
}
