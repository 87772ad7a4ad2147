//! Strongly connected components, each behind all that it leads to.
//!
//! Source: R. Tarjan, "Depth-first search and linear graph algorithms", SIAM J. Comput. 1 (1972).

use std::ops::Range;

/// The components of a graph.
#[derive(Debug, Default)]
pub(super) struct Components {
    /// The nodes, component by component.
    pub(super) order: Vec<u32>,
    /// Where components end in the order.
    ends: Vec<u32>,
}

impl Components {
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// The nodes of a component.
    pub(super) fn nodes(&self, component: usize) -> &[u32] {
        let start = component.checked_sub(1).map_or(0, |one| self.ends[one]);
        &self.order[start as usize..self.ends[component] as usize]
    }
}

/// Not met yet.
const NEW: u32 = u32::MAX;
/// In a component that is complete.
const DONE: u32 = u32::MAX - 1;

/// Finds the components of a graph whose nodes have these edges, by their places in `targets`.
pub(super) fn components(
    nodes: usize,
    targets: &[u32],
    edges: impl Fn(u32) -> Range<usize>,
) -> Components {
    let mut found = Components::default();
    let mut low = vec![NEW; nodes];
    let mut stack: Vec<u32> = Vec::new();
    // The node, when it was met, and its next edge.
    let mut calls: Vec<(u32, u32, usize)> = Vec::new();
    let mut met = 0;
    for root in 0..nodes as u32 {
        if low[root as usize] != NEW {
            continue;
        }
        low[root as usize] = met;
        calls.push((root, met, edges(root).start));
        stack.push(root);
        met += 1;
        while let Some((node, index, edge)) = calls.last_mut() {
            let node = *node;
            if *edge < edges(node).end {
                let target = targets[*edge];
                *edge += 1;
                match low[target as usize] {
                    NEW => {
                        low[target as usize] = met;
                        calls.push((target, met, edges(target).start));
                        stack.push(target);
                        met += 1;
                    }
                    DONE => {}
                    known => low[node as usize] = low[node as usize].min(known),
                }
                continue;
            }
            let (index, own) = (*index, low[node as usize]);
            calls.pop();
            if let Some((before, ..)) = calls.last() {
                let before = *before as usize;
                low[before] = low[before].min(own);
            }
            if own == index {
                loop {
                    let member = stack.pop().expect("the node is on the stack");
                    low[member as usize] = DONE;
                    found.order.push(member);
                    if member == node {
                        break;
                    }
                }
                found.ends.push(found.order.len() as u32);
            }
        }
    }
    found
}
