//! The order in which nodes are expanded: dives.
//!
//! A dive follows a random move of each newly made node as far as this goes, in every other dive
//! one of the seeker where there is one: those of the evader rather lead away from what is sought,
//! but sometimes they are the way. Dives from everywhere meet wins that lie close together sooner
//! than dives in the order of moves (C. P. Gomes, B. Selman, H. Kautz, "Boosting Combinatorial
//! Search Through Randomization", AAAI 1998). The random numbers are the same in every run.
//!
//! After a dive come first the nodes that the evader may move to from where the seeker has won
//! something, since the win hangs on them; then the next dive starts from one of the nodes that
//! wait, at random. Now and then it starts from the one that was made first instead, so that a win
//! near the start is found however far dives go.

use crate::network::Failure;

use super::lazy_zero_time::Reserve;
use crate::game::backward::solver::{AfterGoal, Solver, Win};
use crate::game::forward::node::{Edge, NONE, Standing};

/// One in so many starts is from the oldest node.
const STARTS_FROM_OLDEST: u32 = 16;

/// The nodes to be expanded.
#[derive(Debug, Default)]
pub(in crate::game) struct Frontier {
    /// Those to dive into stand last. Some may be expanded meanwhile.
    waiting: Vec<u32>,
    /// By node.
    is_waiting: Vec<bool>,
    /// Nodes that moves of the evader lead to, and of which it hangs whether more of a node is won;
    /// those met last stand last.
    spoilers: Vec<u32>,
    /// All nodes before this one were expanded, or do not wait.
    oldest: u32,
    starts: u32,
    random: Random,
    /// Whether this dive takes moves of the evader as readily as those of the seeker.
    is_impartial: bool,
    /// Whether the last expansion made no node to go on with.
    is_over: bool,
    /// What the evader may move to and does not need, as far as known.
    pub(in crate::game) reserve: Reserve,
}

impl Frontier {
    /// How many nodes wait.
    pub(in crate::game) fn len(&self) -> usize {
        self.waiting.len()
    }

    /// The bytes that it takes.
    pub(in crate::game) fn bytes(&self) -> usize {
        let lists = self.waiting.len() + self.spoilers.len();
        lists * size_of::<u32>() + self.is_waiting.len() + self.reserve.bytes()
    }

    /// Makes room for one more node, which does not wait.
    pub(in crate::game) fn add_node(&mut self) {
        self.is_waiting.push(false);
        self.reserve.add_node();
    }

    /// Forgets which nodes wait, so that all nodes are to be added again.
    pub(in crate::game) fn forget_nodes(&mut self) {
        self.is_waiting.clear();
        self.reserve.forget_nodes();
    }

    /// Lets no node wait.
    pub(super) fn clear(&mut self) {
        for node in self.waiting.drain(..) {
            self.is_waiting[node as usize] = false;
        }
    }

    /// Lets a waiting node be expanded as soon as the dive is over.
    pub(super) fn add_spoiler(&mut self, node: u32) {
        self.spoilers.push(node);
    }

    fn add(&mut self, node: u32) {
        if !std::mem::replace(&mut self.is_waiting[node as usize], true) {
            self.waiting.push(node);
        }
    }
}

/// Random numbers: G. L. Steele, D. Lea, C. H. Flood, "Fast Splittable Pseudorandom Number
/// Generators", OOPSLA 2014.
#[derive(Clone, Copy, Debug, Default)]
struct Random(u64);

impl Random {
    /// A number below `limit`, which is not 0.
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % limit as u64) as usize
    }
}

impl Solver<'_, '_, '_> {
    /// The node to be expanded next; some are expanded already.
    pub(in crate::game) fn next_waiting(&mut self) -> Option<u32> {
        let tuning = self.graph.symbolic.tuning();
        let node = if self.frontier.is_over && (tuning.dives || tuning.spoilers) {
            self.next_start()
        } else {
            self.frontier.waiting.pop()
        };
        if let Some(node) = node {
            self.frontier.is_waiting[node as usize] = false;
        }
        node
    }

    fn next_start(&mut self) -> Option<u32> {
        let tuning = self.graph.symbolic.tuning();
        self.frontier.starts += 1;
        if tuning.dives
            && self.frontier.starts.is_multiple_of(STARTS_FROM_OLDEST)
            && let Some(node) = self.oldest_waiting()
        {
            return Some(node);
        }
        while let Some(node) = self.frontier.spoilers.pop() {
            if tuning.spoilers && !self.graph.nodes[node as usize].is_expanded {
                return Some(node);
            }
        }
        let Frontier {
            waiting, random, ..
        } = &mut self.frontier;
        if waiting.is_empty() {
            return None;
        }
        if !tuning.dives {
            return waiting.pop();
        }
        let index = random.below(waiting.len());
        Some(waiting.swap_remove(index))
    }

    fn oldest_waiting(&mut self) -> Option<u32> {
        loop {
            let node = self.frontier.oldest;
            let is_expanded = self.graph.nodes.get(node as usize)?.is_expanded;
            if !is_expanded && self.frontier.is_waiting[node as usize] {
                return Some(node);
            }
            self.frontier.oldest += 1;
        }
    }

    /// Expands a node, and lets the nodes wait that this makes.
    pub(in crate::game) fn expand(&mut self, node: u32) -> Result<(), Failure> {
        self.graph.expand(node)?;
        self.adopt_new_nodes();
        let waiting = self.frontier.len();
        let edges = self.graph.edges_of(node);
        let has_dives = self.graph.symbolic.tuning().dives;
        let first = if has_dives {
            edges.start + self.frontier.random.below(edges.len().max(1))
        } else {
            edges.start
        };
        let has_reserve = self.begin_reserve(node);
        let is_held = !has_reserve && self.hold_back(node)?;
        let turns: &[Option<bool>] = if self.frontier.is_impartial || !has_dives {
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
        let frontier = &mut self.frontier;
        frontier.is_over = frontier.len() == waiting;
        frontier.is_impartial ^= frontier.is_over;
        self.mark(node);
        Ok(())
    }

    /// Lets a node wait for its expansion unless it is decided.
    pub(in crate::game) fn wait_for(&mut self, node: u32) {
        let Some(known) = self.graph.nodes.get(node as usize) else {
            return;
        };
        let is_left = match known.standing {
            Standing::Goal => self.after_goal == AfterGoal::Ends,
            Standing::Broken => !self.is_cooperative,
            Standing::Dead => true,
            Standing::Open | Standing::Mixed => false,
        };
        if !known.is_expanded && !is_left {
            self.frontier.add(node);
        }
    }

    /// Lets the nodes be expanded soon to which the evader may move from a node of which more may
    /// be won.
    pub(in crate::game) fn note_spoilers(&mut self, node: u32) {
        let mut edges = self.graph.edges[self.graph.edges_of(node)].iter();
        if edges.all(|edge| matches!(self.win[edge.target as usize], Win::Nothing)) {
            return;
        }
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            let target = edge.target as usize;
            if !self.seeker.owns(edge.controllable)
                && self.frontier.is_waiting[target]
                && !self.graph.nodes[target].is_expanded
            {
                self.frontier.spoilers.push(edge.target);
            }
        }
    }

    /// Whether the winning valuations of some predecessor with hope may still grow by those of the
    /// node.
    pub(in crate::game) fn is_relevant(&self, node: u32) -> bool {
        if node == 0 || !self.graph.symbolic.tuning().relevance {
            return true;
        }
        let mut edge = self.graph.nodes[node as usize].first_in;
        while edge != NONE {
            let Edge {
                source, next_in, ..
            } = self.graph.edges[edge as usize];
            let has_hope = self.may_have_hope(source);
            if has_hope && !matches!(self.win[source as usize], Win::Everything) {
                return true;
            }
            edge = next_in;
        }
        false
    }
}
