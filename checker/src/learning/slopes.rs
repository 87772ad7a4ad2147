//! How costs change within cells, so that states that differ are told apart before the cell is cut.
//!
//! In each cell, what samples cost is a line over the numbers that are seen, the same for all
//! actions, and a value for each action: that at the *centre*, the mean of the points of the cell.
//! So a cell promises less on its worse side, and actions are compared at the same point, however
//! often each was taken on either side.
//!
//! Source: J. Quinlan, "Learning with continuous classes", AI 1992 (lines in the leaves of a
//! tree); R. Fisher, "Statistical methods for research workers", section 49 (analysis of
//! covariance).

use super::sample::Sample;

/// In a cell of n samples a line is as steep as it would be if `CAUTION` more samples said nothing.
const CAUTION: f64 = 10.0;

/// A number that differs from its mean by less than this part of it is the same everywhere.
const SAME: f64 = 1e-9;

/// The lines of all cells.
#[derive(Debug)]
pub(super) struct Slopes {
    dimension: usize,
    /// By sample: its action in its cell, and the cell.
    places: Vec<(u32, u32)>,
    /// By slot: the mean of its points.
    middles: Vec<f64>,
    /// By cell: the centre,
    centres: Vec<f64>,
    /// the Cholesky factor of how points scatter around the middles of their slots, row by row,
    factors: Vec<f64>,
    /// and how costs change with each number.
    rates: Vec<f64>,
}

impl Slopes {
    /// Flat lines in the cells of some samples: `slots` are their actions in cells, and `points`
    /// what was seen.
    pub(super) fn new(samples: &[Sample], points: &[f64], slots: &[(u32, u32)]) -> Slopes {
        let dimension = points.len() / samples.len().max(1);
        let cells = slots.iter().map(|slot| slot.0 + 1).max().unwrap_or(0) as usize;
        let mut slopes = Slopes {
            dimension,
            places: samples
                .iter()
                .map(|one| (one.slot, slots[one.slot as usize].0))
                .collect(),
            middles: vec![0.0; slots.len() * dimension],
            centres: vec![0.0; cells * dimension],
            factors: vec![0.0; cells * dimension * dimension],
            rates: vec![0.0; cells * dimension],
        };
        // Who sees no numbers has no lines.
        if dimension > 0 {
            let counts = slopes.centre(points, slots);
            slopes.scatter(points, &counts);
        }
        slopes
    }

    /// The samples in their order: slot, cell and point.
    fn all<'p>(
        &self,
        points: &'p [f64],
    ) -> impl Iterator<Item = (usize, usize, &'p [f64])> + use<'_, 'p> {
        let points = points.chunks_exact(self.dimension.max(1));
        let places = self.places.iter().zip(points);
        places.map(|(&(slot, cell), point)| (slot as usize, cell as usize, point))
    }

    /// Computes the middles of slots and the centres of cells; returns how many samples each cell
    /// has.
    fn centre(&mut self, points: &[f64], slots: &[(u32, u32)]) -> Vec<f64> {
        let dimension = self.dimension;
        let mut middles = std::mem::take(&mut self.middles);
        let mut of_slots = vec![0.0; slots.len()];
        for (slot, _, point) in self.all(points) {
            of_slots[slot] += 1.0;
            for (middle, value) in middles[slot * dimension..].iter_mut().zip(point) {
                *middle += value;
            }
        }
        let mut of_cells = vec![0.0; self.centres.len() / dimension];
        for (slot, &(cell, _)) in slots.iter().enumerate() {
            let cell = cell as usize;
            of_cells[cell] += of_slots[slot];
            let middle = &mut middles[slot * dimension..][..dimension];
            for (centre, middle) in self.centres[cell * dimension..].iter_mut().zip(middle) {
                *centre += *middle;
                *middle /= of_slots[slot];
            }
        }
        for (cell, count) in of_cells.iter().enumerate().filter(|one| *one.1 > 0.0) {
            for centre in &mut self.centres[cell * dimension..][..dimension] {
                *centre /= count;
            }
        }
        self.middles = middles;
        of_cells
    }

    /// Computes how points scatter in cells of so many samples.
    fn scatter(&mut self, points: &[f64], counts: &[f64]) {
        let dimension = self.dimension;
        let mut factors = std::mem::take(&mut self.factors);
        let mut off = vec![0.0; dimension];
        for (slot, cell, point) in self.all(points) {
            self.off_middle(slot, point, &mut off);
            let factor = &mut factors[cell * dimension * dimension..];
            for row in 0..dimension {
                for column in 0..=row {
                    factor[row * dimension + column] += off[row] * off[column];
                }
            }
        }
        for (cell, count) in counts.iter().enumerate() {
            let factor = &mut factors[cell * dimension * dimension..];
            for row in 0..dimension {
                let own = &mut factor[row * dimension + row];
                let least = SAME * self.centres[cell * dimension + row];
                *own = if *own > count * least * least {
                    *own * (1.0 + CAUTION / count)
                } else {
                    f64::INFINITY
                };
            }
            factorise(factor, dimension);
        }
        self.factors = factors;
    }

    /// How a point is off the middle of its slot.
    fn off_middle(&self, slot: usize, point: &[f64], off: &mut [f64]) {
        let middle = &self.middles[slot * self.dimension..];
        for ((off, value), middle) in off.iter_mut().zip(point).zip(middle) {
            *off = value - middle;
        }
    }

    /// By how much it costs more at a point than at the centre of a cell.
    pub(super) fn rise(&self, cell: u32, point: &[f64]) -> f64 {
        let first = cell as usize * self.dimension;
        let parts = self.rates[first..].iter().zip(&self.centres[first..]);
        let parts = parts.zip(&point[..self.dimension]);
        parts
            .map(|((slope, centre), value)| slope * (value - centre))
            .sum()
    }

    /// Fits all lines to what each sample costs.
    ///
    /// Source: least squares, by the normal equations.
    pub(super) fn fit(&mut self, points: &[f64], costs: &[f64]) {
        let dimension = self.dimension;
        let mut slopes = std::mem::take(&mut self.rates);
        slopes.fill(0.0);
        let mut off = vec![0.0; dimension];
        for ((slot, cell, point), cost) in self.all(points).zip(costs) {
            self.off_middle(slot, point, &mut off);
            for (slope, off) in slopes[cell * dimension..].iter_mut().zip(&off) {
                *slope += off * cost;
            }
        }
        let size = dimension.max(1);
        let factors = self.factors.chunks_exact(size * size);
        for (slopes, factor) in slopes.chunks_exact_mut(size).zip(factors) {
            solve(factor, slopes);
        }
        self.rates = slopes;
    }
}

/// Replaces the lower half of a symmetric matrix by its Cholesky factor.
fn factorise(matrix: &mut [f64], size: usize) {
    for row in 0..size {
        for column in 0..=row {
            let (first, second) = (row * size, column * size);
            let known: f64 = (0..column)
                .map(|place| matrix[first + place] * matrix[second + place])
                .sum();
            let rest = matrix[first + column] - known;
            matrix[first + column] = if row == column {
                rest.sqrt()
            } else {
                rest / matrix[second + column]
            };
        }
    }
}

/// Solves the equations of a matrix with this Cholesky factor; the right sides become the solution.
fn solve(factor: &[f64], sides: &mut [f64]) {
    let size = sides.len();
    for row in 0..size {
        let known: f64 = (0..row)
            .map(|place| factor[row * size + place] * sides[place])
            .sum();
        sides[row] = (sides[row] - known) / factor[row * size + row];
    }
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size)
            .map(|place| factor[place * size + row] * sides[place])
            .sum();
        sides[row] = (sides[row] - known) / factor[row * size + row];
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::Sample;
    use super::Slopes;

    /// Samples of one cell with two actions: the second one was taken where it costs more.
    fn fitted(points: &[f64], costs: &[f64]) -> Slopes {
        let dimension = points.len() / costs.len();
        let samples = (0..costs.len()).map(|place| Sample {
            slot: u32::from(place >= costs.len() / 2),
            next: 0,
            cost: costs[place],
            point: (place * dimension) as u32,
            at: 0.0,
            is_followed: false,
            half: (place % 2) as u8,
        });
        let samples: Vec<Sample> = samples.collect();
        let mut slopes = Slopes::new(&samples, points, &[(0, 0), (0, 1)]);
        slopes.fit(points, costs);
        slopes
    }

    #[test]
    fn a_line_is_found_whatever_actions_were_taken_where() {
        // 3 x - 2 y, and 10 more for the second action; the last number is the same everywhere.
        let (mut points, mut costs) = (Vec::new(), Vec::new());
        for place in 0..2000 {
            let (x, y) = (
                f64::from(place % 37) + f64::from(place / 1000) * 20.0,
                f64::from(place % 11),
            );
            points.extend([x, y, 0.1]);
            costs.push(3.0 * x - 2.0 * y + if place < 1000 { 0.0 } else { 10.0 });
        }
        let slopes = fitted(&points, &costs);
        let rise = slopes.rise(0, &[30.0, 5.0, 0.1]) - slopes.rise(0, &[29.0, 3.0, 7.0]);
        assert!((rise - (3.0 - 4.0)).abs() < 0.05, "{rise}");
    }

    #[test]
    fn few_samples_say_little() {
        let slopes = fitted(&[0.0, 1.0, 0.0, 1.0], &[0.0, 1.0, 0.0, 1.0]);
        let rise = slopes.rise(0, &[1.0]) - slopes.rise(0, &[0.0]);
        assert!(rise > 0.0 && rise < 0.5, "{rise}");
    }

    #[test]
    fn what_sees_no_numbers_has_no_slopes() {
        let slopes = fitted(&[], &[1.0, 2.0]);
        assert!(slopes.rise(0, &[]).abs() < f64::MIN_POSITIVE);
    }
}
