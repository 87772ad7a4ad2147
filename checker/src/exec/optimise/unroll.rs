//! Writes out loops that run a known, small number of rounds.
//!
//! How often a loop runs is found by running it on what is known: from the constants that its
//! registers hold on entry, the blocks that every round passes are evaluated until one of them
//! leaves the loop. Whatever depends on memory, parameters or ways that not every round takes is
//! unknown, and a loop that leaves by such a value alone is not written out. (It may leave early by
//! one.)

use rustc_hash::FxHashMap;

use crate::exec::arithmetic;
use crate::ir::{Block, BlockId, Function, Instruction, Register, Terminator};

use super::graph::{dominates, dominators, predecessors, successors_of};
use super::size_of_blocks;

/// Loops of more rounds are left alone.
const MAX_ROUNDS: usize = 64;

/// Writes out one innermost loop of a [`super::graph::clean`] function, if there is one and the
/// function stays below `max_size`; says whether it did.
pub(super) fn unroll_one(function: &mut Function, max_size: usize) -> bool {
    let predecessors = predecessors(function);
    let dominators = dominators(function, &predecessors);
    let size = size_of_blocks(&function.blocks);
    for found in innermost_loops(function, &predecessors, &dominators) {
        let Some(end) = find_end(function, &found, &dominators) else {
            continue;
        };
        let body: usize = found
            .blocks
            .iter()
            .map(|&block| function.blocks[block].instructions.len() + 1)
            .sum();
        if size + end.rounds * body <= max_size {
            write_out(function, &found, &end);
            return true;
        }
    }
    false
}

/// A natural loop with one edge back and no loop within.
struct Loop {
    head: usize,
    latch: usize,
    /// Its blocks in ascending order.
    blocks: Vec<usize>,
    /// The only block outside that leads into it.
    entry: usize,
}

fn innermost_loops(
    function: &Function,
    predecessors: &[Vec<usize>],
    dominators: &[usize],
) -> Vec<Loop> {
    let mut loops = Vec::new();
    for head in 1..function.blocks.len() {
        let (back, entries): (Vec<usize>, Vec<usize>) = predecessors[head]
            .iter()
            .partition(|&&block| dominates(dominators, head, block));
        let ([latch], [entry]) = (&back[..], &entries[..]) else {
            continue;
        };
        let blocks = blocks_of_loop(head, *latch, predecessors);
        // Blocks stand in reverse postorder, so that a loop within goes back to a block before.
        let contains_loop = blocks.iter().any(|&block| {
            successors_of(function, block)
                .any(|next| next <= block && next != head && blocks.contains(&next))
        });
        if !contains_loop {
            loops.push(Loop {
                head,
                latch: *latch,
                blocks,
                entry: *entry,
            });
        }
    }
    loops
}

fn blocks_of_loop(head: usize, latch: usize, predecessors: &[Vec<usize>]) -> Vec<usize> {
    let mut blocks = vec![head];
    let mut pending = vec![latch];
    while let Some(block) = pending.pop() {
        if !blocks.contains(&block) {
            blocks.push(block);
            pending.extend(&predecessors[block]);
        }
    }
    blocks.sort_unstable();
    blocks
}

/// The integers that are known, by register.
type Integers = FxHashMap<Register, i32>;

/// How a loop ends.
struct LoopEnd {
    /// How often control comes to the head.
    rounds: usize,
    /// The block that leaves the loop in the last round.
    block: usize,
    /// Where it leads.
    next: BlockId,
}

/// How the loop ends at the latest, if that is known and not after too many rounds.
fn find_end(function: &Function, found: &Loop, dominators: &[usize]) -> Option<LoopEnd> {
    let always: Vec<usize> = found
        .blocks
        .iter()
        .copied()
        .filter(|&block| dominates(dominators, block, found.latch))
        .collect();
    let sometimes: Vec<Register> = found
        .blocks
        .iter()
        .filter(|block| !always.contains(block))
        .flat_map(|&block| &function.blocks[block].instructions)
        .filter_map(Instruction::target)
        .collect();
    let mut integers = integers_at_entry(function, found, dominators);
    for rounds in 1..=MAX_ROUNDS {
        for &block in &always {
            for instruction in &function.blocks[block].instructions {
                evaluate(instruction, &mut integers);
            }
            for register in &sometimes {
                integers.remove(register);
            }
            if let Terminator::Branch(condition, then, otherwise) =
                function.blocks[block].terminator
                && let Some(&condition) = integers.get(&condition)
            {
                let next = if condition != 0 { then } else { otherwise };
                if found.blocks.binary_search(&(next.0 as usize)).is_err() {
                    return Some(LoopEnd {
                        rounds,
                        block,
                        next,
                    });
                }
            }
        }
    }
    None
}

/// The constants that hold where the loop begins: those of the blocks that lead there, in order.
fn integers_at_entry(function: &Function, found: &Loop, dominators: &[usize]) -> Integers {
    let mut way = vec![found.entry];
    while let Some(&block) = way.last()
        && block != 0
    {
        way.push(dominators[block]);
    }
    // Only registers that are written once, or in the block before the loop, are sure to hold their
    // constant still.
    let mut writes: FxHashMap<Register, u32> = FxHashMap::default();
    for instruction in function.instructions() {
        if let Some(target) = instruction.target() {
            *writes.entry(target).or_default() += 1;
        }
    }
    let mut integers = Integers::default();
    for &block in way.iter().rev() {
        for instruction in &function.blocks[block].instructions {
            evaluate(instruction, &mut integers);
        }
        if block != found.entry {
            integers.retain(|register, _| writes[register] == 1);
        }
    }
    integers
}

/// Does what an instruction does, if that is known.
fn evaluate(instruction: &Instruction, integers: &mut Integers) {
    let Some(target) = instruction.target() else {
        return;
    };
    let value = arithmetic::value_of(instruction, |register| integers.get(&register).copied());
    match value {
        Some(value) => integers.insert(target, value),
        None => integers.remove(&target),
    };
}

/// Appends a copy of the loop forevery round after the first; in the last round, the block that
/// leaves the loop only does so.
fn write_out(function: &mut Function, found: &Loop, end: &LoopEnd) {
    let count = found.blocks.len();
    let first_copy = function.blocks.len();
    let copy_of = |round: usize, block: usize| -> Option<usize> {
        let position = found.blocks.binary_search(&block).ok()?;
        Some(match round {
            0 => block,
            _ => first_copy + (round - 1) * count + position,
        })
    };
    let bodies: Vec<Block> = found
        .blocks
        .iter()
        .map(|&block| without_count(function.blocks[block].clone()))
        .collect();
    for round in 0..end.rounds {
        let is_last = round + 1 == end.rounds;
        for (&block, body) in found.blocks.iter().zip(&bodies) {
            let mut copy = body.clone();
            if is_last && block == end.block {
                copy.terminator = Terminator::Jump(end.next);
            }
            for target in copy.terminator.successors_mut() {
                let is_back = block == found.latch && target.0 as usize == found.head;
                let round = if is_back && !is_last {
                    round + 1
                } else {
                    round
                };
                if let Some(new) = copy_of(round, target.0 as usize) {
                    target.0 = new as u32;
                }
            }
            match copy_of(round, block) {
                Some(place) if round == 0 => function.blocks[place] = copy,
                _ => function.blocks.push(copy),
            }
        }
    }
    debug_assert!(
        successors_of(function, found.entry).any(|block| block == found.head),
        "the entry still leads to the first round"
    );
}

/// A block without the count of rounds: what is written out ends by itself.
fn without_count(mut block: Block) -> Block {
    block
        .instructions
        .retain(|instruction| !matches!(instruction, Instruction::CountRound { .. }));
    block
}
