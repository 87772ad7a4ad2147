//! The partition of what is seen: for each combination of exact values a binary tree of cuts
//! `feature <= bound`, whose leaves are the *cells*. In a cell each action has a value.
//!
//! Invariants:
//! * Values are costs: less is better. Who maximises counts with the opposite sign.
//! * An action that was never taken in a cell has no value there.
//!
//! Source: M. Jaeger et al., "Teaching Stratego to play ball", ATVA 2019 (abstract).

use std::hash::{BuildHasher as _, Hash as _, Hasher as _};

use hashbrown::HashTable;
use rustc_hash::FxBuildHasher;

use super::tree::{self, Node};

/// The number of the action to wait. All others are numbers of entries of moves.
pub(super) const WAIT: u32 = u32::MAX;

/// What stands for an action where a delay was drawn at random. It is not the controller's choice,
/// and says nothing of what it costs to wait.
pub(super) const DRAW: u32 = u32::MAX - 1;

/// What is known of an action in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The action.
    pub action: u32,
    /// How often it was taken.
    pub visits: f64,
    /// The mean cost from there on.
    pub value: f64,
    /// The standard error of that.
    pub error: f64,
}

/// A cell.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// The combination of exact values it belongs to.
    pub observation: u32,
    /// Its node in the tree of that.
    node: u32,
    /// The actions that were taken.
    pub known: Vec<Known>,
}

impl Cell {
    /// What is known of an action.
    pub fn of(&self, action: u32) -> Option<&Known> {
        self.known.iter().find(|one| one.action == action)
    }
}

/// A partition.
#[derive(Clone, Debug, Default)]
pub struct Partition {
    table: HashTable<u32>,
    /// The words of the observations, one after the other.
    keys: Vec<i32>,
    width: usize,
    /// By observation: its tree; the leaves are numbers of cells.
    trees: Vec<Vec<Node<u32>>>,
    /// All cells.
    pub cells: Vec<Cell>,
}

impl Partition {
    /// An empty one, for so many words of exact values.
    pub fn new(width: usize) -> Partition {
        Partition {
            width,
            ..Partition::default()
        }
    }

    /// The number of the combination of these exact values, if it was seen before.
    pub fn observation(&self, key: &[i32]) -> Option<u32> {
        if self.width == 0 {
            return (!self.trees.is_empty()).then_some(0);
        }
        let is_it = |&one: &u32| is_same(self.key(one), key);
        self.table.find(hash(key), is_it).copied()
    }

    /// The number of the combination of these exact values, which is new or not.
    pub fn intern(&mut self, key: &[i32]) -> u32 {
        if let Some(known) = self.observation(key) {
            return known;
        }
        let number = self.trees.len() as u32;
        let (keys, width) = (&self.keys, self.width);
        let hash_of = |&one: &u32| hash(&keys[one as usize * width..][..width]);
        self.table.insert_unique(hash(key), number, hash_of);
        self.keys.extend_from_slice(key);
        self.trees.push(vec![Node::Leaf(self.cells.len() as u32)]);
        self.cells.push(Cell {
            observation: number,
            node: 0,
            known: Vec::new(),
        });
        number
    }

    /// How many combinations of exact values there are.
    pub fn observations(&self) -> usize {
        self.trees.len()
    }

    /// The exact values of an observation, as words.
    pub fn key(&self, observation: u32) -> &[i32] {
        &self.keys[observation as usize * self.width..][..self.width]
    }

    /// The tree of an observation.
    pub fn tree(&self, observation: u32) -> &[Node<u32>] {
        &self.trees[observation as usize]
    }

    /// The cell of a point.
    pub fn cell(&self, observation: u32, point: &[f64]) -> u32 {
        tree::leaf(self.tree(observation), point)
    }

    /// The cell of a point that moves with these rates, and in how long it is in another one;
    /// infinity if never.
    pub fn cell_and_exit(&self, observation: u32, point: &[f64], rates: &[f64]) -> (u32, f64) {
        tree::leaf_and_exit(self.tree(observation), point, rates)
    }

    /// Cuts a cell in two. Both parts know what the whole knew.
    pub fn cut(&mut self, cell: u32, feature: u32, bound: f64) -> u32 {
        let other = self.cells.len() as u32;
        let whole = &mut self.cells[cell as usize];
        let tree = &mut self.trees[whole.observation as usize];
        let low = tree.len() as u32;
        tree.extend([Node::Leaf(cell), Node::Leaf(other)]);
        tree[whole.node as usize] = Node::Cut {
            feature,
            bound,
            low,
            high: low + 1,
        };
        whole.node = low;
        let part = Cell {
            node: low + 1,
            ..whole.clone()
        };
        self.cells.push(part);
        other
    }
}

/// Whether two keys are the same. They are short, so that a call would take longer.
fn is_same(one: &[i32], other: &[i32]) -> bool {
    one.iter().zip(other).all(|(one, other)| one == other)
}

fn hash(key: &[i32]) -> u64 {
    let mut hasher = FxBuildHasher.build_hasher();
    i32::hash_slice(key, &mut hasher);
    hasher.finish()
}
