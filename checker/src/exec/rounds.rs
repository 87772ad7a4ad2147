//! Makes sure that every run ends: counts rounds of loops, and calls of functions that call others.
//!
//! Invariant: after [`count_rounds`] every cycle of blocks contains a [`Instruction::CountRound`],
//! and so does the first block of every function that calls another, for a few dozen functions that
//! call each other twice run as long as any loop. All engines run the counted code, so that they
//! stop at the same round.

use super::cycles::cycle_heads;
use crate::ir::{BlockId, Function, Instruction, SiteId};

/// How many rounds a call from outside may take.
pub const ROUND_LIMIT: u64 = 100_000_000;

/// Puts the missing counts into a function.
pub(crate) fn count_rounds(function: &mut Function) {
    for head in uncounted_cycle_heads(function) {
        let site = nearest_site(function, head);
        count_at(function, head, site);
    }
    let calls = function
        .blocks
        .iter()
        .any(|block| block.instructions.iter().any(is_call));
    if calls && !function.blocks[0].instructions.iter().any(is_count) {
        let site = nearest_site(function, 0);
        count_at(function, 0, site);
    }
}

fn is_call(instruction: &Instruction) -> bool {
    matches!(instruction, Instruction::Call { .. })
}

fn is_count(instruction: &Instruction) -> bool {
    matches!(instruction, Instruction::CountRound { .. })
}

fn count_at(function: &mut Function, block: usize, site: SiteId) {
    function.blocks[block]
        .instructions
        .insert(0, Instruction::CountRound { site });
}

/// Where the edges end that close a cycle without a count, in a depth-first walk over blocks
/// without a count.
fn uncounted_cycle_heads(function: &Function) -> Vec<usize> {
    let counted = |block: usize| function.blocks[block].instructions.iter().any(is_count);
    let uncounted_successors = |block: usize| {
        if counted(block) {
            return Vec::new();
        }
        let successors = function.blocks[block].terminator.successors();
        let successors = successors.map(|BlockId(successor)| successor as usize);
        successors
            .filter(|&successor| !counted(successor))
            .collect()
    };
    let mut heads = cycle_heads(function.blocks.len(), uncounted_successors);
    heads.sort_unstable();
    heads.dedup();
    heads
}

/// The first site at or after a block, else the first of the function; blocks stand in the order of
/// the text.
fn nearest_site(function: &Function, block: usize) -> SiteId {
    let (before, after) = function.blocks.split_at(block);
    after
        .iter()
        .chain(before)
        .flat_map(|block| &block.instructions)
        .find_map(Instruction::site)
        .unwrap_or(SiteId(0))
}
