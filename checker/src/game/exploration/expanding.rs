//! How a node is expanded, and which nodes must be expanded then.

use crate::network::Failure;

use crate::game::AfterGoal;
use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::{Edge, Standing};
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
    /// Expands a node, and adds the new nodes to the waiting list.
    pub(in crate::game) fn expand(&mut self, node: u32) -> Result<(), Failure> {
        self.graph.expand(node)?;
        self.adopt_new_nodes();
        let waiting = self.exploration.waiting.len();
        let edges = self.graph.edges_of(node);
        let has_dives = self.graph.symbolic.tuning().dives;
        let first = if has_dives {
            edges.start + self.exploration.waiting.random.below(edges.len().max(1))
        } else {
            edges.start
        };
        let has_reserve = self.begin_reserve(node);
        let is_held = !has_reserve && self.hold_back(node)?;
        let turns: &[Option<bool>] = if self.exploration.waiting.is_impartial || !has_dives {
            &[None]
        } else {
            &[Some(false), Some(true)]
        };
        for turn in turns {
            for edge in (first..edges.end).chain(edges.start..first) {
                let Edge {
                    target,
                    controllable,
                    ..
                } = self.graph.edges[edge];
                let is_own = self.seeker.owns(controllable);
                if (is_own || !has_reserve && !is_held) && turn.is_none_or(|it| it == is_own) {
                    self.wait_for(target);
                }
            }
            if has_reserve && *turn != Some(true) {
                self.choose(node);
            }
        }
        let frontier = &mut self.exploration.waiting;
        frontier.is_over = frontier.len() == waiting;
        frontier.is_impartial ^= frontier.is_over;
        self.agenda.mark(node);
        Ok(())
    }

    /// Adds a node to the waiting list, unless it is decided.
    pub(in crate::game) fn wait_for(&mut self, node: u32) {
        let Some(known) = self.graph.nodes.get(node as usize) else {
            return;
        };
        let is_left = match known.standing {
            Standing::Goal => self.sought.after_goal == AfterGoal::Ends,
            Standing::Broken => !self.sought.is_cooperative,
            Standing::Dead => true,
            Standing::Open | Standing::Mixed => false,
        };
        if !known.is_expanded && !is_left {
            self.exploration.waiting.add(node);
        }
    }

    /// If more of a node may be won, moves forward in the list the nodes that the evader may move
    /// to from there.
    pub(in crate::game) fn note_spoilers(&mut self, node: u32) {
        let mut edges = self.graph.edges_from(node).iter();
        if edges.all(|edge| matches!(self.won.win[edge.target as usize], Win::Nothing)) {
            return;
        }
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            let target = edge.target as usize;
            if !self.seeker.owns(edge.controllable)
                && self.exploration.waiting.is_waiting[target]
                && !self.graph.nodes[target].is_expanded
            {
                self.exploration.waiting.spoilers.push(edge.target);
            }
        }
    }

    /// Whether the winning valuations of some predecessor may still grow by those of the node.
    pub(in crate::game) fn is_relevant(&self, node: u32) -> bool {
        if node == 0 || !self.graph.symbolic.tuning().relevance {
            return true;
        }
        let Some(source) = self.open_predecessor(node) else {
            return false;
        };
        // What lies behind a decided node is not relevant either, if this is the only way there.
        let mut before = source;
        while self.has_guide() && before != 0 && self.has_one_predecessor(before) {
            match self.open_predecessor(before) {
                Some(source) => before = source,
                None => return false,
            }
        }
        true
    }

    /// A predecessor that is not won everywhere yet.
    fn open_predecessor(&self, node: u32) -> Option<u32> {
        let mut sources = self.graph.edges_into(node).map(|edge| edge.source);
        sources.find(|&source| {
            self.may_win(source) && !matches!(self.won.win[source as usize], Win::Everything)
        })
    }

    fn has_one_predecessor(&self, node: u32) -> bool {
        self.graph.edges_into(node).take(2).count() == 1
    }

    /// What the parts do when a node was updated and is not won as a whole.
    pub(in crate::game) fn on_update(&mut self, node: u32) {
        if !self.exploration.schedule.is_running {
            self.choose(node);
            if self.has_guide() {
                // Zones are computed later, and the guide must not lead away from here meanwhile.
                self.note_spoilers(node);
            }
        }
    }

    /// What the parts note when a node is about to gain something.
    pub(in crate::game) fn on_gain(&mut self, node: u32) {
        if self.exploration.reserve.is_used || self.exploration.schedule.is_running {
            self.note_attackers(node);
        }
    }
}
