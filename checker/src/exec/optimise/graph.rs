//! The blocks of a function as a graph: cleaning it up, predecessors, dominators.

use crate::ir::{Block, BlockId, Function, Terminator};

/// The successors of a block.
pub(super) fn successors_of(function: &Function, block: usize) -> impl Iterator<Item = usize> {
    function.blocks[block]
        .terminator
        .successors()
        .map(|BlockId(target)| target as usize)
}

/// The predecessors of every block, in order, one entry an edge.
pub(super) fn predecessors(function: &Function) -> Vec<Vec<usize>> {
    let mut predecessors = vec![Vec::new(); function.blocks.len()];
    for block in 0..function.blocks.len() {
        for target in successors_of(function, block) {
            predecessors[target].push(block);
        }
    }
    predecessors
}

/// Removes unreachable blocks, joins blocks that always follow each other, and puts the rest into
/// reverse postorder, so that every block stands behind its dominators.
pub(super) fn clean(function: &mut Function) {
    join_chains(function);
    let order = reverse_postorder(function);
    let mut position = vec![None; function.blocks.len()];
    for (new, &old) in order.iter().enumerate() {
        position[old] = Some(new as u32);
    }
    let mut old: Vec<Option<Block>> = std::mem::take(&mut function.blocks)
        .into_iter()
        .map(Some)
        .collect();
    for index in order {
        let mut block = old[index].take().expect("every block is listed once");
        for target in block.terminator.successors_mut() {
            let new = position[target.0 as usize];
            target.0 = new.expect("the successors of a reachable block are reachable");
        }
        function.blocks.push(block);
    }
}

fn join_chains(function: &mut Function) {
    let reachable = reachable(function);
    let mut edges = vec![0; function.blocks.len()];
    for block in (0..function.blocks.len()).filter(|&block| reachable[block]) {
        let mut targets = successors_of(function, block);
        let only = targets
            .next()
            .filter(|only| targets.all(|target| target == *only));
        drop(targets);
        if let Some(only) = only {
            function.blocks[block].terminator = Terminator::Jump(BlockId(only as u32));
        }
        for target in successors_of(function, block) {
            edges[target] += 1;
        }
    }
    for block in (0..function.blocks.len()).filter(|&block| reachable[block]) {
        while let Terminator::Jump(BlockId(next)) = function.blocks[block].terminator {
            let next = next as usize;
            if edges[next] != 1 || next == block || next == 0 {
                break;
            }
            let rest = std::mem::take(&mut function.blocks[next].instructions);
            // What is left of the joined block leads nowhere, and nothing leads to it.
            edges[next] = 0;
            let terminator = &mut function.blocks[next].terminator;
            let terminator = std::mem::replace(terminator, Terminator::Return(None));
            function.blocks[block].instructions.extend(rest);
            function.blocks[block].terminator = terminator;
        }
    }
}

fn reachable(function: &Function) -> Vec<bool> {
    let mut reachable = vec![false; function.blocks.len()];
    let mut pending = vec![0];
    while let Some(block) = pending.pop() {
        if !std::mem::replace(&mut reachable[block], true) {
            pending.extend(successors_of(function, block));
        }
    }
    reachable
}

fn reverse_postorder(function: &Function) -> Vec<usize> {
    let mut seen = vec![false; function.blocks.len()];
    let mut order = Vec::new();
    let mut path = vec![(0, 0)];
    seen[0] = true;
    while let Some((block, next)) = path.last_mut() {
        let successor = successors_of(function, *block).nth(*next);
        *next += 1;
        match successor {
            None => {
                order.push(*block);
                path.pop();
            }
            Some(successor) if !seen[successor] => {
                seen[successor] = true;
                path.push((successor, 0));
            }
            Some(_) => {}
        }
    }
    order.reverse();
    order
}

/// The immediate dominator of every block of a [`clean`] function; the first block is its own.
///
/// The iteration of Cooper, Harvey and Kennedy, "A Simple, Fast Dominance Algorithm" (2001).
pub(super) fn dominators(function: &Function, predecessors: &[Vec<usize>]) -> Vec<usize> {
    let unknown = usize::MAX;
    let mut dominators = vec![unknown; function.blocks.len()];
    dominators[0] = 0;
    let mut changed = true;
    while changed {
        changed = false;
        for block in 1..function.blocks.len() {
            let mut known = predecessors[block]
                .iter()
                .copied()
                .filter(|&predecessor| dominators[predecessor] != unknown);
            let first = known.next().expect("a predecessor stands before the block");
            let meet = known.fold(first, |mut left, mut right| {
                while left != right {
                    if left > right {
                        left = dominators[left];
                    } else {
                        right = dominators[right];
                    }
                }
                left
            });
            if dominators[block] != meet {
                dominators[block] = meet;
                changed = true;
            }
        }
    }
    dominators
}

/// Whether a block dominates another, by the immediate dominators.
pub(super) fn dominates(dominators: &[usize], block: usize, mut other: usize) -> bool {
    while other > block {
        other = dominators[other];
    }
    other == block
}
