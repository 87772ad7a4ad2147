//! Compiled queries for shields.

use super::learning::{Feature, Seen};
use super::runs::Path;

/// `acontrol: A[] p {…}`
#[derive(Clone, Debug)]
pub struct Shield {
    /// What must hold for ever, as `[] p`.
    pub keep: Path,
    /// What the cells of the grid are made of.
    pub axes: Vec<Axis>,
}

/// One of the axes of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// The location, the integer, the double or the clock.
    pub feature: Feature,
    /// Where the first cell begins.
    pub low: f64,
    /// Where the last cell ends, which is none of it; of exact values the last one.
    pub high: f64,
    /// How many cells there are.
    pub cells: u32,
}

impl Axis {
    /// Whether each cell is one value.
    pub fn is_exact(&self) -> bool {
        matches!(self.feature.seen, Seen::Location(_) | Seen::Integer(_))
    }

    /// How wide a cell is.
    pub fn width(&self) -> f64 {
        if self.is_exact() {
            1.0
        } else {
            (self.high - self.low) / f64::from(self.cells)
        }
    }
}
