//! The nodes that must be computed again, since some of their successors have gained something.

use std::collections::VecDeque;

/// Whether a node must be updated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pending {
    /// No.
    No,
    /// It waits for an update by words.
    Look,
    /// Words do not decide it; it waits to be computed with zones.
    Computation,
}

/// The nodes that must be updated.
#[derive(Debug, Default)]
pub(in crate::game) struct Agenda {
    /// The nodes that wait for an update by words, in the order in which they were added.
    pub(super) updates: VecDeque<u32>,
    /// Nodes whose winning valuations must be computed with zones; some may be decided meanwhile.
    pub(super) deferred: VecDeque<u32>,
    pub(super) pending: Vec<Pending>,
    /// How many states may be explored before the deferred nodes are computed.
    pub(in crate::game) next_computation: u64,
}

impl Agenda {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> usize {
        (self.updates.capacity() + self.deferred.capacity()) * size_of::<u32>()
            + self.pending.len() * size_of::<Pending>()
    }

    /// Makes room for one more node, which need not be updated.
    pub(super) fn add_node(&mut self) {
        self.pending.push(Pending::No);
    }

    /// Forgets all nodes.
    pub(super) fn forget_nodes(&mut self) {
        self.updates.clear();
        self.deferred.clear();
        self.pending.clear();
    }

    /// Lets a node be updated again.
    pub(in crate::game) fn mark(&mut self, node: u32) {
        let pending = &mut self.pending[node as usize];
        if std::mem::replace(pending, Pending::Look) != Pending::Look {
            self.updates.push_back(node);
        }
    }

    /// Lets a node be computed with zones.
    pub(super) fn defer(&mut self, node: u32) {
        self.pending[node as usize] = Pending::Computation;
        self.deferred.push_back(node);
    }

    /// The next node that waits for an update by words.
    pub(super) fn next_update(&mut self) -> Option<u32> {
        let node = self.updates.pop_front()?;
        self.pending[node as usize] = Pending::No;
        Some(node)
    }

    /// The next node that must be computed with zones.
    pub(super) fn next_computed(&mut self) -> Option<u32> {
        while let Some(node) = self.deferred.pop_front() {
            let pending = &mut self.pending[node as usize];
            if *pending == Pending::Computation {
                *pending = Pending::No;
                return Some(node);
            }
        }
        None
    }

    /// Whether no node must be updated.
    pub(super) fn is_empty(&self) -> bool {
        self.updates.is_empty() && self.deferred.is_empty()
    }

    /// The nodes that wait for an update by words, in order; afterwards none waits.
    pub(super) fn take_updates(&mut self) -> VecDeque<u32> {
        let nodes = std::mem::take(&mut self.updates);
        for &node in &nodes {
            self.pending[node as usize] = Pending::No;
        }
        nodes
    }
}
