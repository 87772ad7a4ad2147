//! Grids: half-open boxes of equal size over some of the words of a state.
//!
//! The number of a cell is that of its places along the axes, of which the last one changes first.

use crate::exec::arithmetic::double_words;
use crate::ir::{Axis, Seen};
use crate::stochastic::StateView;

/// The last sample of a cell lies before its end by such a part of its width.
const INSIDE: f64 = 1e-6;

/// A grid.
#[derive(Clone, Debug)]
pub struct Grid {
    /// What its cells are made of.
    pub axes: Vec<Axis>,
}

impl Grid {
    /// How many cells it has; as many as can be counted if there are more.
    pub fn cells(&self) -> u64 {
        let counts = self.axes.iter().map(|axis| u64::from(axis.cells));
        counts.fold(1, u64::saturating_mul)
    }

    /// The cell of a state, if it lies in the grid.
    pub fn cell_of(&self, state: &StateView<'_>) -> Option<u32> {
        let mut cell = 0;
        for axis in &self.axes {
            cell = cell * u64::from(axis.cells) + u64::from(place_of(axis, value_of(axis, state))?);
        }
        Some(cell as u32)
    }

    /// What a state has along the axes.
    pub fn values_of(&self, state: &StateView<'_>) -> Vec<f64> {
        let values = self.axes.iter().map(|axis| value_of(axis, state));
        values.collect()
    }

    /// How many samples each cell has, if so many lie along an axis.
    pub fn samples(&self, along_axis: u32) -> u64 {
        let counts = self.axes.iter().map(|axis| samples_along(axis, along_axis));
        counts.fold(1, |all, one| all.saturating_mul(u64::from(one)))
    }

    /// The values of a sample of a cell, by its number: one along each axis.
    pub fn sample(&self, cell: u32, along_axis: u32, mut number: u64) -> Vec<f64> {
        let mut values = vec![0.0; self.axes.len()];
        let mut cell = u64::from(cell);
        for (axis, value) in self.axes.iter().zip(&mut values).rev() {
            let place = (cell % u64::from(axis.cells)) as f64;
            cell /= u64::from(axis.cells);
            let count = u64::from(samples_along(axis, along_axis));
            let part = part_of_cell(number % count, count);
            number /= count;
            *value = if axis.is_exact() {
                axis.low + place
            } else {
                axis.low + (place + part) * axis.width()
            };
        }
        values
    }

    /// Puts values along the axes into the words of a state.
    pub fn put(&self, values: &[f64], words: &mut [i32]) {
        for (axis, &value) in self.axes.iter().zip(values) {
            match axis.feature.seen {
                Seen::Location(process) => words[process.0 as usize] = value as i32,
                Seen::Integer(word) => words[word as usize] = value as i32,
                Seen::Double(word) | Seen::Clock(word) => {
                    let word = word as usize;
                    words[word..word + 2].copy_from_slice(&double_words(value));
                }
                Seen::Computed(_) => unreachable!("axes are variables"),
            }
        }
    }

    /// The corner of samples outside the grid with this number: along each axis of intervals the
    /// middle, or as far behind an end as the grid is long; `None` for the one inside. All values
    /// of exact axes are taken.
    pub fn sample_outside(&self, mut number: u64) -> Option<Vec<f64>> {
        let mut is_outside = false;
        let mut values = Vec::with_capacity(self.axes.len());
        for axis in &self.axes {
            let count = outside_along(axis);
            let place = number % count;
            number /= count;
            let length = axis.high - axis.low;
            values.push(match place {
                _ if axis.is_exact() => axis.low + place as f64,
                0 => axis.low + length / 2.0,
                1 => axis.low - length,
                _ => axis.high + length,
            });
            is_outside |= !axis.is_exact() && place > 0;
        }
        is_outside.then_some(values)
    }

    /// How many such corners there are, with that inside.
    pub fn samples_outside(&self) -> u64 {
        let counts = self.axes.iter().map(outside_along);
        counts.fold(1, u64::saturating_mul)
    }
}

fn outside_along(axis: &Axis) -> u64 {
    if axis.is_exact() {
        u64::from(axis.cells)
    } else {
        3
    }
}

fn samples_along(axis: &Axis, along_axis: u32) -> u32 {
    if axis.is_exact() { 1 } else { along_axis }
}

/// Where a sample lies in its cell, as a part of the width.
fn part_of_cell(number: u64, count: u64) -> f64 {
    if count == 1 {
        0.0
    } else if number + 1 == count {
        1.0 - INSIDE
    } else {
        number as f64 / (count - 1) as f64
    }
}

fn value_of(axis: &Axis, state: &StateView<'_>) -> f64 {
    match axis.feature.seen {
        Seen::Location(process) => f64::from(state.location(process).0),
        Seen::Integer(word) => f64::from(state.integer(word)),
        Seen::Double(word) | Seen::Clock(word) => state.double(word),
        Seen::Computed(_) => unreachable!("axes are variables"),
    }
}

/// The place of the cell along an axis in which a value lies.
fn place_of(axis: &Axis, value: f64) -> Option<u32> {
    let place = ((value - axis.low) / axis.width()).floor();
    let is_inside = 0.0 <= place && place < f64::from(axis.cells);
    is_inside.then_some(place as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Feature;

    fn axis(seen: Seen, low: f64, high: f64, cells: u32) -> Axis {
        let text = String::from("x");
        Axis {
            feature: Feature { text, seen },
            low,
            high,
            cells,
        }
    }

    fn places(grid: &Grid, values: &[f64]) -> Vec<Option<u32>> {
        let axes = grid.axes.iter().zip(values);
        axes.map(|(axis, &value)| place_of(axis, value)).collect()
    }

    #[test]
    fn samples_lie_in_their_cells() {
        let grid = Grid {
            axes: vec![
                axis(Seen::Integer(0), -2.0, 3.0, 6),
                axis(Seen::Double(1), -13.0, 13.0, 8),
                axis(Seen::Clock(3), 0.5, 4.5, 5),
            ],
        };
        assert_eq!((grid.cells(), grid.samples(4)), (240, 16));
        for cell in 0..240 {
            let wanted = [cell / 40, cell / 5 % 8, cell % 5].map(Some);
            for number in 0..16 {
                let values = grid.sample(cell, 4, number);
                // Where cells meet, rounding may put the lower end into the cell before.
                let inside: Vec<f64> = values.iter().map(|value| value + 1e-9).collect();
                assert_eq!(places(&grid, &inside), wanted, "{cell} {number}");
            }
        }
    }

    #[test]
    fn cells_are_half_open() {
        let axis = axis(Seen::Double(0), 0.0, 10.0, 4);
        let found = [-0.1, 0.0, 2.4, 2.5, 9.9, 10.0, f64::NAN].map(|one| place_of(&axis, one));
        assert_eq!(
            found,
            [None, Some(0), Some(0), Some(1), Some(3), None, None]
        );
    }

    #[test]
    fn samples_outside_are_as_far_away_as_the_grid_is_long() {
        let grid = Grid {
            axes: vec![
                axis(Seen::Integer(0), 1.0, 2.0, 2),
                axis(Seen::Double(1), 10.0, 20.0, 7),
            ],
        };
        let all = (0..grid.samples_outside()).filter_map(|number| grid.sample_outside(number));
        let all: Vec<Vec<f64>> = all.collect();
        assert_eq!(all, [[1.0, 0.0], [2.0, 0.0], [1.0, 30.0], [2.0, 30.0]]);
    }
}
