//! The strategy of a shield: the moves that it allows, cell by cell.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::grid::Grid;
use crate::ir::Part;
use crate::stochastic::{ControllerMove, Fence, StateView};

/// The most moves that a shield tells apart.
pub const MOST_MOVES: usize = 64;

/// A shield.
#[derive(Clone, Debug)]
pub struct Shield {
    /// Its cells.
    pub grid: Grid,
    /// The moves of the controller, at most [`MOST_MOVES`].
    pub moves: Vec<Part>,
    /// By cell, as bits: the moves that are allowed, by their places; none if it is not safe.
    pub allowed: Vec<u64>,
}

impl Shield {
    /// How many cells are safe.
    pub fn safe_cells(&self) -> u64 {
        self.allowed.iter().filter(|&&bits| bits != 0).count() as u64
    }
}

/// The places of moves by their numbers.
pub(super) struct Places(FxHashMap<u32, u32>);

impl Places {
    pub(super) fn new(moves: &[ControllerMove]) -> Places {
        let numbers = moves.iter().map(|one| one.number);
        Places(numbers.zip(0..).collect())
    }

    pub(super) fn place(&self, entry: u32) -> u32 {
        self.0[&entry]
    }

    pub(super) fn bits(&self, entries: &[u32]) -> u64 {
        let bits = entries.iter().map(|&entry| 1 << self.place(entry));
        bits.fold(0, |all, one: u64| all | one)
    }
}

/// A shield, prepared for random runs of a model.
///
/// It says nothing, and all moves stay, where a single move is enabled, outside the grid, and where
/// it allows none of those that are enabled.
pub struct Barrier {
    shield: Arc<Shield>,
    /// By number of a move: its bit; none for a move that the shield does not know.
    bits: FxHashMap<u32, u64>,
}

impl Barrier {
    /// The moves are those that the controller may make in the model.
    pub fn new(shield: &Arc<Shield>, moves: &[ControllerMove]) -> Barrier {
        let places = (0..).zip(&shield.moves);
        let places: FxHashMap<Part, u32> = places.map(|(place, &part)| (part, place)).collect();
        let known = moves.iter();
        let bits = known.filter_map(|one| Some((one.number, 1 << places.get(&one.part)?)));
        Barrier {
            shield: Arc::clone(shield),
            bits: bits.collect(),
        }
    }
}

impl Fence for Barrier {
    fn keep_allowed(&self, state: &StateView<'_>, moves: &mut Vec<u32>) {
        if moves.len() < 2 {
            return;
        }
        let Some(cell) = self.shield.grid.cell_of(state) else {
            return;
        };
        let allowed = self.shield.allowed[cell as usize];
        let is_allowed = |number: &u32| {
            let bit = self.bits.get(number);
            bit.is_none_or(|bit| allowed & bit != 0)
        };
        if moves.iter().any(is_allowed) {
            moves.retain(is_allowed);
        }
    }
}
