//! Shields: what a controller may do so that something holds for ever, found by sampling cells of a
//! grid over the states in which it has a choice.
//!
//! Invariants:
//! * A cell is safe if all its samples have what must be kept, and in each of them in which the
//!   controller has a choice some move that is enabled there is allowed.
//! * A move is allowed in a safe cell if, from each sample in which it was enabled, no run broke
//!   what must be kept, and each came to a choice in a safe cell or to none at all.
//! * So where no sample of a cell has a choice all is allowed; the same goes for a move that no
//!   sample of the cell enabled.
//! * All is determined by the seed: the number of a cell says which random numbers its runs draw.
//!
//! Source: A. H. Brorholt et al., "Shielded Reinforcement Learning for Hybrid Systems", `AISoLA`
//! 2023; "Uppaal Coshy: Automatic Synthesis of Compact Shields for Hybrid Systems", 2025.

mod fixed_point;
mod grid;
mod options;
mod steps;
mod strategy;
mod synthesis;
mod trial;

pub use fixed_point::BYTES_OF_CELL;
pub use grid::Grid;
pub use options::{Manner, Outside, Sampling};
pub use strategy::{Barrier, MOST_MOVES, Shield};
pub use synthesis::{Facts, Left, Made, shield};
pub use trial::{CHOICES, trial};
