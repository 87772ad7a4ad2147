//! What the seeker wants to get to: the valuations of each node that are won from the start.

use crate::zones::Federation;

use super::memory::gains_bytes;
use super::solver::{AfterGoal, Gain, Pending, Solver, Win};
use crate::game::Player;
use crate::game::forward::node::Standing;

impl Solver<'_, '_, '_> {
    /// Gives nodes that were just made their place: what is sought is won from the start.
    pub(in crate::game) fn adopt_new_nodes(&mut self) {
        for node in self.win.len()..self.graph.nodes.len() {
            let win = self.sought(node as u32);
            if let Win::Part(part) = &win {
                let mut rest = self.whole(node as u32);
                rest.subtract(part);
                rest.shrink();
                self.replace_rest(node as u32, Some(rest));
            }
            let gains = match &win {
                Win::Nothing => Vec::new(),
                Win::Everything => vec![Gain {
                    stamp: 0,
                    part: None,
                }],
                Win::Part(part) => vec![Gain {
                    stamp: 0,
                    part: Some(part.clone()),
                }],
            };
            self.gained_bytes += win.heap_bytes() + gains_bytes(&gains);
            self.win.push(win);
            self.gains.push(gains);
            self.frontier.add_node();
            self.pending.push(Pending::No);
            self.defences.add_node();
            if node == 0 {
                self.wait_for(0);
            }
        }
    }

    /// The valuations of a node that the seeker wants to get to.
    fn sought(&self, node: u32) -> Win {
        if let Some(targets) = &self.targets {
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
        if part.is_empty() {
            Win::Nothing
        } else {
            Win::Part(part)
        }
    }

    /// Whether the words decide who has won in a node.
    pub(in crate::game) fn is_decided(&self, node: u32) -> bool {
        match self.graph.nodes[node as usize].standing {
            Standing::Broken | Standing::Dead => true,
            Standing::Goal => self.targets.is_none() && self.after_goal != AfterGoal::IsLikeBefore,
            Standing::Open | Standing::Mixed => false,
        }
    }

    /// Whether play has ended in a node, won by this player, whatever the clocks say.
    pub(in crate::game) fn is_over(&self, winner: Player, node: u32) -> bool {
        let (standing, depends_on_time) = match winner {
            Player::Controller => (Standing::Goal, self.graph.latest.is_some()),
            Player::Environment => (Standing::Broken, false),
        };
        self.graph.nodes[node as usize].standing == standing
            && self.targets.is_none()
            && !depends_on_time
    }

    /// Where the goal holds, or what is sought lies, in a node that is neither a goal nor broken as
    /// a whole.
    pub(in crate::game) fn goal(&self, node: u32) -> Federation {
        let dimension = self.graph.dimension();
        if let Some(targets) = &self.targets {
            return match &targets[node as usize] {
                Win::Nothing => Federation::empty(dimension),
                Win::Everything => self.whole(node),
                Win::Part(part) => part.clone(),
            };
        }
        let none = || Federation::empty(dimension);
        if self.after_goal == AfterGoal::IsLikeBefore {
            return none();
        }
        let parts = self.graph.parts(node);
        parts.map_or_else(none, |parts| parts.goal.clone())
    }

    /// As [`Solver::goal`], where what must be kept does not hold, goals excepted.
    pub(in crate::game) fn broken(&self, node: u32) -> Federation {
        let none = || Federation::empty(self.graph.dimension());
        let parts = self.graph.parts(node);
        parts.map_or_else(none, |parts| parts.broken.clone())
    }
}
