//! The order in which nodes are expanded: dives.
//!
//! A dive follows a random move of each new node as long as there is one. Every other dive prefers
//! moves of the seeker: moves of the evader usually lead away from what is sought, but sometimes
//! they are the way to it. Random dives find wins that lie close together sooner than dives in the
//! order of moves (C. P. Gomes, B. Selman, H. Kautz, "Boosting Combinatorial Search Through
//! Randomization", AAAI 1998). The random numbers are the same in every run.
//!
//! Where the seeker has won something, the win depends on the nodes that the evader may move to
//! from there: these come first after a dive. Then the next dive starts from a random waiting
//! node. Sometimes it starts from the oldest node instead, so that a win near the start is found
//! however deep dives are.
//!
//! With a guide, a dive follows the move to the least value as long as values do not grow. Then the
//! spoilers are next, and then the waiting node with the least value, the newest one of equal ones:
//! best first (J. Pearl, "Heuristics", 1984). The guide says how far a state seems to be from what
//! is sought; it is no part of the question, so a bad one costs time only.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::iter;

use crate::game::forward::node::Node;
use crate::ir::FunctionId;
use crate::tuning::Tuning;

/// One in this many dives starts from the oldest node.
const STARTS_FROM_OLDEST: u32 = 16;

/// The nodes to be expanded.
#[derive(Debug, Default)]
pub(in crate::game) struct WaitingList {
    /// The nodes for the dive are at the end. Some may be expanded meanwhile.
    pub(super) waiting: Vec<u32>,
    /// For each node: whether it waits.
    pub(super) is_waiting: Vec<bool>,
    /// Targets of moves of the evader that decide whether more of a node is won; the newest are at
    /// the end.
    pub(super) spoilers: Vec<u32>,
    /// All nodes before this one were expanded, or do not wait.
    pub(super) oldest: u32,
    pub(super) starts: u32,
    pub(super) random: Random,
    /// Whether this dive does not prefer moves of the seeker.
    pub(super) is_impartial: bool,
    /// Whether the last expansion made no node for the dive.
    pub(super) is_over: bool,
    guided: Option<Guided>,
}

/// The nodes in the order of a guide.
#[derive(Debug)]
struct Guided {
    /// What computes the values.
    guide: FunctionId,
    /// The value of each node.
    values: Vec<i32>,
    /// Nodes that wait, with their values. Some were taken out of turn meanwhile.
    heap: BinaryHeap<(Reverse<i32>, u32)>,
    /// How many nodes wait.
    waiting: usize,
    /// The value of the node that was expanded last, and the best node that was added since.
    last: i32,
    best: Option<(i32, u32)>,
}

impl Guided {
    fn value(&self, node: u32) -> i32 {
        self.values.get(node as usize).copied().unwrap_or(i32::MAX)
    }

    fn add(&mut self, node: u32) {
        let value = self.value(node);
        self.heap.push((Reverse(value), node));
        self.waiting += 1;
        if self.best.is_none_or(|(least, _)| value < least) {
            self.best = Some((value, node));
        }
    }

    /// Where the dive goes on.
    fn dive(&mut self) -> Option<u32> {
        let (value, node) = self.best.take()?;
        (value <= self.last).then_some(node)
    }

    fn take(&mut self, node: u32) {
        self.last = self.value(node);
        self.waiting -= 1;
    }
}

impl WaitingList {
    /// Takes the node with the least value of this function first from now on.
    pub(in crate::game) fn be_guided_by(&mut self, guide: FunctionId) {
        let heap = self.waiting.drain(..).map(|node| (Reverse(0), node));
        let heap: BinaryHeap<_> = heap.collect();
        self.guided = Some(Guided {
            guide,
            values: vec![0; self.is_waiting.len()],
            waiting: heap.len(),
            heap,
            last: i32::MAX,
            best: None,
        });
    }

    /// The guide, if there is one.
    pub(in crate::game) fn guide(&self) -> Option<FunctionId> {
        self.guided.as_ref().map(|guided| guided.guide)
    }

    /// Notes the value of the guide in a node.
    pub(in crate::game) fn set_value(&mut self, node: u32, value: i32) {
        if let Some(guided) = &mut self.guided {
            guided.values.resize(node as usize, i32::MAX);
            guided.values.push(value);
        }
    }

    /// How many nodes wait.
    pub(in crate::game) fn len(&self) -> usize {
        let guided = self.guided.as_ref().map_or(0, |guided| guided.waiting);
        self.waiting.len() + guided
    }

    /// The bytes that it takes.
    pub(in crate::game) fn bytes(&self) -> usize {
        let lists = self.waiting.len() + self.spoilers.len();
        let guided = self.guided.as_ref().map_or(0, |guided| {
            guided.heap.len() * size_of::<(i32, u32)>() + guided.values.len() * size_of::<i32>()
        });
        lists * size_of::<u32>() + self.is_waiting.len() + guided
    }

    /// Makes room for one more node, which does not wait.
    pub(in crate::game) fn add_node(&mut self) {
        self.is_waiting.push(false);
    }

    /// Forgets which nodes wait, so that all nodes are to be added again.
    pub(in crate::game) fn forget_nodes(&mut self) {
        self.is_waiting.clear();
    }

    /// Removes all nodes.
    pub(super) fn clear(&mut self) {
        let heap = self.guided.as_mut().map(|guided| {
            guided.waiting = 0;
            guided.best = None;
            guided.heap.drain()
        });
        let guided = heap.into_iter().flatten().map(|(_, node)| node);
        for node in self.waiting.drain(..).chain(guided) {
            self.is_waiting[node as usize] = false;
        }
    }

    /// Lets a waiting node be expanded as soon as the dive is over.
    pub(super) fn add_spoiler(&mut self, node: u32) {
        self.spoilers.push(node);
    }

    /// The next node to expand; some are expanded already.
    pub(in crate::game) fn next(&mut self, nodes: &[Node], tuning: Tuning) -> Option<u32> {
        let node = if self.guided.is_some() {
            self.next_guided(nodes, tuning)
        } else if self.is_over && (tuning.dives || tuning.spoilers) {
            self.next_start(nodes, tuning)
        } else {
            self.waiting.pop()
        };
        if let Some(node) = node {
            self.is_waiting[node as usize] = false;
        }
        node
    }

    fn next_guided(&mut self, nodes: &[Node], tuning: Tuning) -> Option<u32> {
        let guided = self.guided.as_mut()?;
        let is_waiting = &self.is_waiting;
        let dive = guided.dive().filter(|_| tuning.dives);
        let spoiler = || {
            iter::from_fn(|| self.spoilers.pop())
                .filter(|_| tuning.spoilers)
                .find(|&node| is_waiting[node as usize] && !nodes[node as usize].is_expanded)
        };
        let node = dive.or_else(spoiler).or_else(|| {
            iter::from_fn(|| guided.heap.pop())
                .map(|(_, node)| node)
                .find(|&node| is_waiting[node as usize])
        })?;
        guided.take(node);
        Some(node)
    }

    fn next_start(&mut self, nodes: &[Node], tuning: Tuning) -> Option<u32> {
        self.starts += 1;
        if tuning.dives
            && self.starts.is_multiple_of(STARTS_FROM_OLDEST)
            && let Some(node) = self.oldest_waiting(nodes)
        {
            return Some(node);
        }
        while let Some(node) = self.spoilers.pop() {
            if tuning.spoilers && !nodes[node as usize].is_expanded {
                return Some(node);
            }
        }
        let WaitingList {
            waiting, random, ..
        } = self;
        if waiting.is_empty() {
            return None;
        }
        if !tuning.dives {
            return waiting.pop();
        }
        let index = random.below(waiting.len());
        Some(waiting.swap_remove(index))
    }

    fn oldest_waiting(&mut self, nodes: &[Node]) -> Option<u32> {
        loop {
            let node = self.oldest;
            let is_expanded = nodes.get(node as usize)?.is_expanded;
            if !is_expanded && self.is_waiting[node as usize] {
                return Some(node);
            }
            self.oldest += 1;
        }
    }

    pub(super) fn add(&mut self, node: u32) {
        if !std::mem::replace(&mut self.is_waiting[node as usize], true) {
            match &mut self.guided {
                Some(guided) => guided.add(node),
                None => self.waiting.push(node),
            }
        }
    }
}

/// Random numbers: G. L. Steele, D. Lea, C. H. Flood, "Fast Splittable Pseudorandom Number
/// Generators", OOPSLA 2014.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Random(u64);

impl Random {
    /// A number below `limit`, which is not 0.
    pub(super) fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % limit as u64) as usize
    }
}
