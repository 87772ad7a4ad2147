//! Winning valuations that were computed before, for nodes that differ in nothing that they hang
//! on.
//!
//! In models with much data, many nodes have the same zone, the same edges as far as clocks go, and
//! the same successors won. What they win first is computed once. It depends on nothing but what
//! the key of such a case holds:
//! * the zone of the node, whether time may pass, which clocks stand still, and where invariants
//!   stop time;
//! * of each edge what it does to clocks, who owns it, the zone of its target, and whether all of
//!   the target is won or nothing, and whether the evader holds it back;
//! * if that may decide whether the environment is forced to move ([`super::forced_moves`]): which
//!   processes stop time, and which take part in the moves of the controller.
//!
//! Other nodes are no such cases: those in which the goal or what must be kept depend on clocks, or
//! time is cut short, those of which something is won or that lead to nodes of which a part is; and
//! those in which it matters which processes move, if there are more than
//! [`Edge::movers`](crate::game::forward::graph::Edge::movers) tells apart.

use crate::zones::federation::table_bytes;
use rustc_hash::FxHashMap;

use super::winning_sets::Gained;
use crate::game::exploration::held_moves::Defence;

/// Cases that are remembered, at most.
pub(super) const MOST_CASES: usize = 1 << 14;
/// After this many look-ups it is seen whether
pub(super) const TRIAL: u32 = 1 << 10;
/// at least one in this many meets a case that is known; else no more are made.
pub(super) const WORTH: u32 = 4;

/// What cases win.
#[derive(Debug, Default)]
pub(in crate::game) struct ResultCache {
    pub(super) cases: FxHashMap<Box<[u32]>, (Gained, Defence)>,
    pub(super) key: Vec<u32>,
    /// What keys and gains take beside the table.
    pub(super) kept_bytes: u64,
    pub(super) lookups: u32,
    pub(super) hits: u32,
}

/// Whether a node is a case.
pub(super) enum Case {
    /// It is none.
    None,
    /// One that is not remembered, with its key.
    New(Box<[u32]>),
    /// One of which it is known what it gains, and how the evader defends itself.
    Known(Gained, Defence),
}

impl ResultCache {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let table = table_bytes::<(Box<[u32]>, (Gained, Defence))>(self.cases.capacity());
        self.kept_bytes + table as u64
    }
}
