//! A Markov decision process in flat arrays.
//!
//! Invariants:
//! * The choices of a node follow each other, and the ways of a choice. Every node has a choice.
//! * The chances of the ways of a choice sum to 1, or there are none: then the run ends.
//! * What a choice costs is the mean over its ways; who maximises counts with the opposite sign.

use std::ops::Range;

/// The label of what happens without a choice.
pub(super) const NOBODY: u32 = u32::MAX - 1;

/// A Markov decision process.
#[derive(Debug, Default)]
pub(super) struct Process {
    /// By node: its first choice. One more than there are nodes.
    first_choice: Vec<u32>,
    /// By choice: the first way. One more than there are choices.
    first_way: Vec<u32>,
    /// By choice: the move of the controller, or [`NOBODY`], or `WAIT`.
    pub(super) labels: Vec<u32>,
    pub(super) costs: Vec<f64>,
    pub(super) targets: Vec<u32>,
    pub(super) chances: Vec<f64>,
}

impl Process {
    pub(super) fn new() -> Process {
        Process {
            first_choice: vec![0],
            first_way: vec![0],
            ..Process::default()
        }
    }

    /// How many nodes there are.
    pub(super) fn nodes(&self) -> usize {
        self.first_choice.len() - 1
    }

    pub(super) fn ways(&self) -> usize {
        self.targets.len()
    }

    /// Adds a way to the choice that is being added.
    pub(super) fn add_way(&mut self, target: u32, chance: f64) {
        self.targets.push(target);
        self.chances.push(chance);
    }

    /// Ends the choice that is being added.
    pub(super) fn end_choice(&mut self, label: u32, cost: f64) {
        self.labels.push(label);
        // No zero has a sign.
        self.costs.push(cost + 0.0);
        self.first_way.push(self.targets.len() as u32);
    }

    /// Ends the node that is being added.
    pub(super) fn end_node(&mut self) {
        self.first_choice.push(self.labels.len() as u32);
    }

    /// The choices of a node.
    pub(super) fn choices(&self, node: u32) -> Range<usize> {
        let node = node as usize;
        self.first_choice[node] as usize..self.first_choice[node + 1] as usize
    }

    /// The ways of a choice.
    pub(super) fn ways_of(&self, choice: usize) -> Range<usize> {
        self.first_way[choice] as usize..self.first_way[choice + 1] as usize
    }

    /// The ways of all choices of a node.
    pub(super) fn ways_of_node(&self, node: u32) -> Range<usize> {
        let choices = self.choices(node);
        self.first_way[choices.start] as usize..self.first_way[choices.end] as usize
    }

    /// The nodes that a choice leads to, with their chances.
    pub(super) fn outcomes(&self, choice: usize) -> impl Iterator<Item = (u32, f64)> {
        let ways = self.ways_of(choice);
        let targets = self.targets[ways.clone()].iter().copied();
        targets.zip(self.chances[ways].iter().copied())
    }

    /// What a choice costs with all that follows, if nodes have these values.
    pub(super) fn total(&self, choice: usize, values: &[f64]) -> f64 {
        let rest = self.outcomes(choice);
        let rest: f64 = rest.map(|(to, chance)| chance * values[to as usize]).sum();
        self.costs[choice] + rest
    }

    /// Whether a choice of a node leads back to it.
    pub(super) fn returns(&self, node: u32) -> bool {
        self.targets[self.ways_of_node(node)].contains(&node)
    }

    pub(super) fn bytes(&self) -> u64 {
        let words = self.first_choice.capacity()
            + self.first_way.capacity()
            + self.labels.capacity()
            + self.targets.capacity();
        (words * 4 + (self.costs.capacity() + self.chances.capacity()) * 8) as u64
    }
}

impl Process {
    /// The process in which these choices are taken, where one is given.
    pub(super) fn under(&self, taken: &[Option<u32>]) -> Process {
        let mut under = Process::new();
        for (node, &taken) in (0..).zip(taken) {
            let choices = match taken {
                Some(choice) => choice as usize..choice as usize + 1,
                None => self.choices(node),
            };
            for choice in choices {
                for (target, chance) in self.outcomes(choice) {
                    under.add_way(target, chance);
                }
                under.end_choice(self.labels[choice], self.costs[choice]);
            }
            under.end_node();
        }
        under
    }
}
