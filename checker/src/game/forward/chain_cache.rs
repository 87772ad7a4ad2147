//! A cache of chains of moves that were followed before.
//!
//! The effect of a move on clocks mostly depends on the locations, the zone and the answers of
//! guards, not on variables. A *trail* holds what is known at a point of a chain: the zone there,
//! and the effect of the moves until there on clocks. Trails form trees, whose roots are moves of
//! nodes, by list of moves and zone. To follow a chain along its trail, the graph evaluates guards
//! and runs updates, but computes no zones.
//!
//! Invariants:
//! * A trail gives the same result as [`super::graph::Graph`] when it follows the chain move by
//!   move. Where the result depends on variables, the trail ends, and the graph continues move by
//!   move from its end.
//! * Trails never decide which states there are, only how fast they are found. Their memory is
//!   bounded.

use rustc_hash::FxHashMap;

use crate::cancellation;
use crate::ir::Predicate;
use crate::network::{FixedMove, MoveListId, Moves, VectorId};
use crate::zones::federation::block_bytes;
use crate::zones::zone_table::ZoneId;
use crate::zones::{Bound, Zone};

use super::clock_programs::{ProgramId, ProgramStep, steps_bytes};
use super::objective::Objective;

/// The approximate number of bytes that trails may take.
pub(super) const MOST_BYTES: usize = 32 << 20;

/// The index of a trail.
pub(super) type TrailId = u32;

/// What a move leads to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Onward {
    /// Not known yet.
    Unknown,
    /// To no state: the move is not possible, or the chain ends before it.
    Ends,
    /// It depends on variables: the move must be followed on its own.
    Varies,
    /// To the end of this trail.
    To(TrailId),
}

/// A point of a chain.
#[derive(Clone, Debug)]
pub(super) struct Trail {
    /// The move that leads here.
    pub(super) last: FixedMove,
    /// The location vector here, once it is known.
    pub(super) vector: Option<VectorId>,
    /// The zone here, with its future if time may pass.
    pub(super) zone: Zone,
    pub(super) may_delay: bool,
    /// How many moves lead here.
    pub(super) length: u32,
    /// The effect of these moves on clocks.
    pub(super) steps: Vec<ProgramStep>,
    /// Whether every chain ends here.
    pub(super) is_end: bool,
    /// How the chain continues, for each move list.
    pub(super) onward: Vec<(MoveListId, Onward)>,
    pub(super) ending: Option<Ending>,
}

/// The result of a chain that ends here, for clocks.
#[derive(Clone, Debug)]
pub(super) struct Ending {
    /// The zone, extrapolated.
    pub(super) zone: Zone,
    /// Its id.
    pub(super) id: ZoneId,
    /// The effect of the edge on clocks.
    pub(super) program: ProgramId,
    /// The zone of the node that was entered last, and whether the edge leads into it from every
    /// valuation.
    pub(super) totality: Option<(ZoneId, bool)>,
}

/// The trails of a graph.
#[derive(Debug, Default)]
pub(super) struct ChainCache {
    /// Whether locations and zones decide how time passes. Otherwise there are no trails.
    pub(super) is_useful: bool,
    /// Whether locations alone decide where the objective holds.
    pub(super) is_objective_fixed: bool,
    /// For each list of moves and zone of a node: where its moves start in `first`; `None` if the
    /// two were met only once.
    pub(super) roots: FxHashMap<(MoveListId, ZoneId), Option<u32>>,
    /// The results of the first moves.
    pub(super) first: Vec<Onward>,
    /// The ends of all trails.
    pub(super) points: Vec<Trail>,
    pub(super) bytes: usize,
}

/// The moves of a node that have trails.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root(pub(super) u32);

impl ChainCache {
    /// No trails yet. `is_useful` says whether locations and zones alone decide how time passes.
    pub(super) fn new(is_useful: bool, objective: &Objective<'_>) -> ChainCache {
        let mut predicates = objective.goal.iter().chain(&objective.keep);
        ChainCache {
            is_useful,
            is_objective_fixed: objective.deadline.is_none()
                && predicates.all(|predicate| depends_on_locations(predicate)),
            ..ChainCache::default()
        }
    }

    /// The approximate number of bytes that trails take.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Whether trails are possible.
    pub(super) fn is_useful(&self) -> bool {
        self.is_useful
    }

    /// The root of a list of moves at a zone. `None` if they were not met before: most are met only
    /// once.
    pub(super) fn root(&mut self, list: MoveListId, zone: ZoneId, moves: &Moves) -> Option<Root> {
        if self.bytes > MOST_BYTES {
            return self.roots.get(&(list, zone)).copied().flatten().map(Root);
        }
        match self.roots.entry((list, zone)) {
            std::collections::hash_map::Entry::Vacant(entry) => {
                entry.insert(None);
                self.bytes += 32;
                None
            }
            std::collections::hash_map::Entry::Occupied(mut entry) => {
                let first = *entry.get_mut().get_or_insert_with(|| {
                    let first = cancellation::number(self.first.len());
                    self.first
                        .resize(self.first.len() + moves.len(), Onward::Unknown);
                    self.bytes += moves.len() * size_of::<Onward>();
                    first
                });
                Some(Root(first))
            }
        }
    }

    pub(super) fn add(&mut self, trail: Trail) -> Onward {
        let dimension = trail.zone.dimension();
        // The end of the trail has a zone too.
        self.bytes += size_of::<Trail>() + 2 * block_bytes(size_of::<Bound>() * dimension.pow(2));
        self.bytes += steps_bytes(&trail.steps) + trail.last.heap_bytes();
        self.points.push(trail);
        Onward::To(cancellation::number(self.points.len()) - 1)
    }
}

/// Whether the locations alone decide a predicate.
fn depends_on_locations(predicate: &Predicate) -> bool {
    let is_of_locations =
        |leaf: &Predicate| matches!(leaf, Predicate::Constant(_) | Predicate::Location(..));
    predicate.leaves().into_iter().all(is_of_locations)
}
