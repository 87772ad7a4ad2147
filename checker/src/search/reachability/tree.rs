//! The tree of a search: stored states, each with its parent and the moves from there.
//!
//! If the states of a search are divided, several trees form one: each is a *shard* of the whole,
//! and the parent of a state may be in another shard.
//!
//! Cost: eight bytes for each state. A path of more than one move takes four bytes for each move
//! and four more.

use crate::cancellation;
use crate::network::Symbolic;

use crate::search::outcome::Step;
use crate::search::store::disk::Cold;
use crate::search::store::packed_paths;
use crate::search::store::packed_zones::Kept;
use crate::search::store::passed_list::{PassedList, Stored};
use crate::search::store::records::Records;

/// The greatest number of trees that form one.
pub(super) const MOST_SHARDS: usize = 1 << (31 - SHARD_SHIFT);

/// So many states are stored at once: see [`Tree::wait`].
const AT_ONCE: usize = 32;

/// Where the shard of the parent begins in a word, above a single move or the length of a way.
const SHARD_SHIFT: u32 = 20;

/// Marks a node to which several moves lead from its parent.
const MANY_STEPS: u32 = 1 << 31;

/// No node.
const NONE: u32 = u32::MAX;

/// A node of one of the trees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// The tree.
    pub(super) shard: u32,
    /// The node in it.
    pub(super) node: u32,
}

impl Origin {
    /// Where the initial states come from.
    pub(super) const NOWHERE: Origin = Origin {
        shard: 0,
        node: NONE,
    };
}

/// Stored states with how they were reached.
#[derive(Debug)]
pub(super) struct Tree {
    pub(super) passed: PassedList,
    /// How each was reached: the parent, and the only move from there with the parent's shard.
    /// With [`MANY_STEPS`]: the place in `paths` that has the number of words of the path with the
    /// shard, and then these words (see [`packed_paths`]).
    nodes: Records<u32>,
    paths: Records<u32>,
    waiting: Waiting,
}

/// How the states that wait to be stored were reached.
#[derive(Debug, Default)]
struct Waiting {
    /// Of each: its origin, and where the moves from there end.
    ways: Vec<(Origin, usize)>,
    moves: Vec<Step>,
    /// What became of each.
    found: Vec<Option<Stored>>,
}

impl Tree {
    /// An empty tree; see [`PassedList::new`].
    pub(super) fn new(symbolic: &Symbolic<'_>) -> Tree {
        Tree {
            passed: PassedList::new(symbolic),
            nodes: Records::new(2),
            paths: Records::new(1),
            waiting: Waiting::default(),
        }
    }

    /// The bytes that the tree takes.
    pub(super) fn bytes(&self) -> usize {
        self.passed.bytes() + self.nodes.bytes() + self.paths.bytes()
    }

    /// The most bytes that the next state may take.
    pub(super) fn growth(&self) -> usize {
        self.passed.growth()
    }

    /// What may be put on disk.
    pub(super) fn cold(&mut self) -> impl Iterator<Item = &mut dyn Cold> {
        let ways: [&mut dyn Cold; 2] = [&mut self.nodes, &mut self.paths];
        self.passed.cold().chain(ways)
    }

    /// Stores a state with the way to it, unless a stored one contains it.
    pub(super) fn add(
        &mut self,
        words: &[i32],
        zone: Kept<'_>,
        origin: Origin,
        path: &[Step],
    ) -> Option<Stored> {
        let stored = self.passed.add(words, zone)?;
        self.add_node(origin, path);
        Some(stored)
    }

    /// Lets a state without a zone wait to be stored, with others at once; those that are new are
    /// added to `out`. Returns whether it may wait.
    pub(super) fn wait(
        &mut self,
        words: &[i32],
        origin: Origin,
        path: &[Step],
        out: &mut impl Extend<Stored>,
    ) -> bool {
        self.wait_as(|passed| passed.wait(words), origin, path, out)
    }

    /// The same, for words that another tree has packed.
    pub(super) fn wait_record(
        &mut self,
        record: &[u8],
        origin: Origin,
        path: &[Step],
        out: &mut impl Extend<Stored>,
    ) -> bool {
        self.wait_as(|passed| passed.wait_record(record), origin, path, out)
    }

    fn wait_as(
        &mut self,
        wait: impl FnOnce(&mut PassedList),
        origin: Origin,
        path: &[Step],
        out: &mut impl Extend<Stored>,
    ) -> bool {
        if !self.passed.may_wait() {
            return false;
        }
        wait(&mut self.passed);
        let Waiting { ways, moves, .. } = &mut self.waiting;
        moves.extend_from_slice(path);
        ways.push((origin, moves.len()));
        if ways.len() == AT_ONCE {
            self.add_waiting(out);
        }
        true
    }

    /// Stores the states that wait, unless they were stored before; those that are new are added to
    /// `out`.
    pub(super) fn add_waiting(&mut self, out: &mut impl Extend<Stored>) {
        if self.waiting.ways.is_empty() {
            return;
        }
        let mut waiting = std::mem::take(&mut self.waiting);
        let Waiting { ways, moves, found } = &mut waiting;
        self.passed.add_waiting(|stored| found.push(stored));
        let mut first = 0;
        for (stored, &(origin, end)) in found.iter().zip(&*ways) {
            if stored.is_some() {
                self.add_node(origin, &moves[first..end]);
            }
            first = end;
        }
        ways.clear();
        moves.clear();
        out.extend(found.drain(..).flatten());
        self.waiting = waiting;
    }

    /// Like [`Tree::add`], for words that another tree has packed.
    pub(super) fn add_record(
        &mut self,
        record: &[u8],
        zone: Kept<'_>,
        origin: Origin,
        path: &[Step],
    ) -> Option<Stored> {
        let stored = self.passed.add_record(record, zone)?;
        self.add_node(origin, path);
        Some(stored)
    }

    fn add_node(&mut self, origin: Origin, path: &[Step]) {
        let shard = origin.shard << SHARD_SHIFT;
        let path = if let [step] = *path
            && step < 1 << SHARD_SHIFT
        {
            step as u32 | shard
        } else {
            let first = self.paths.len();
            let mut words = Vec::new();
            packed_paths::pack(path, &mut words);
            let length = cancellation::number_below(1 << SHARD_SHIFT, words.len());
            self.paths.push(&[length | shard]);
            for &word in &words {
                self.paths.push(&[word]);
            }
            cancellation::number_below(MANY_STEPS as usize, first) | MANY_STEPS
        };
        self.nodes.push(&[origin.node, path]);
    }
}

/// The moves from an initial state to a node, and after it the last ones.
pub(super) fn way(trees: &[&Tree], mut origin: Origin, last: &[Step]) -> Vec<Step> {
    const LENGTH: u32 = (1 << SHARD_SHIFT) - 1;
    let mut steps: Vec<Step> = last.iter().rev().copied().collect();
    while origin.node != NONE {
        let Tree { nodes, paths, .. } = trees[origin.shard as usize];
        let (parent, path) = (nodes.get(origin.node)[0], nodes.get(origin.node)[1]);
        let shard = if path < MANY_STEPS {
            steps.push(Step::from(path & LENGTH));
            path >> SHARD_SHIFT
        } else {
            let first = path - MANY_STEPS;
            let head = paths.first(first);
            let words = (first + 1..).take((head & LENGTH) as usize);
            let words: Vec<u32> = words.map(|place| paths.first(place)).collect();
            packed_paths::unpack_reversed(&words, &mut steps);
            head >> SHARD_SHIFT
        };
        origin = Origin {
            shard,
            node: parent,
        };
    }
    steps.reverse();
    steps
}
