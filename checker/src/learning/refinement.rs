//! Where the partition is cut further: where an action costs more on one side than on the other.
//!
//! For each cell and each feature, all cuts between two samples are looked at. The best one has the
//! greatest sum, over actions, of the squares of Welch's t. It is made if that cannot be chance,
//! and if the difference matters: if it is more than a small part of what runs differ by.
//!
//! Of the numbers between the two samples the cut is made at the one with the fewest binary digits:
//! an integer if one lies between them. So trees are short to write, and integers cut zones.
//!
//! Source: M. Jaeger et al., "Teaching Stratego to play ball", ATVA 2019 (abstract: cuts by tests
//! of both sides); B. L. Welch, Biometrika 34 (1947), for the test.

use super::partition::Partition;
use super::process::Process;
use super::sums::Sums;

/// When a cell is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule {
    /// The least sum of squares of t.
    pub(super) score: f64,
    /// The least difference of costs.
    pub(super) difference: f64,
    /// The least number of samples of an action on each side.
    pub(super) samples: usize,
    /// The most cells.
    pub(super) cells: usize,
}

/// So many samples of a cell are looked at.
const LOOKED_AT: usize = 4096;

/// A sample of a cell.
#[derive(Clone, Copy)]
struct Point {
    /// Which of the actions of the cell.
    action: u32,
    cost: f64,
    /// Where its numbers begin.
    place: u32,
}

/// A cut, and how much it tells apart.
#[derive(Clone, Copy, Debug)]
struct Cut {
    feature: u32,
    bound: f64,
    score: f64,
}

/// Cuts all cells of a partition by what was sampled in them. Returns how many cuts it made.
pub(super) fn refine(
    partition: &mut Partition,
    process: &Process,
    dimension: usize,
    rule: Rule,
    discount: f64,
) -> usize {
    let before = partition.cells.len();
    if dimension == 0 {
        return 0;
    }
    let mut by_cell: Vec<Vec<u32>> = vec![Vec::new(); before];
    for slot in 0..process.slots() {
        by_cell[process.cell(slot) as usize].push(slot);
    }
    let costs = process.telling_costs(discount);
    for (cell, slots) in by_cell.iter().enumerate() {
        let all: usize = slots.iter().map(|&slot| process.of(slot).len()).sum();
        let stride = all.div_ceil(LOOKED_AT).max(1);
        let mut points = Vec::with_capacity(all / stride + slots.len());
        for (action, &slot) in slots.iter().enumerate() {
            let samples = process.of(slot).step_by(stride);
            points.extend(samples.map(|(place, sample)| Point {
                action: action as u32,
                cost: costs[place],
                place: sample.point,
            }));
        }
        let refiner = Refiner {
            process,
            dimension,
            rule,
            actions: slots.len(),
        };
        refiner.cut(partition, cell as u32, points);
    }
    partition.cells.len() - before
}

struct Refiner<'p> {
    process: &'p Process,
    dimension: usize,
    rule: Rule,
    actions: usize,
}

impl Refiner<'_> {
    fn at(&self, point: &Point, feature: usize) -> f64 {
        self.process.points[point.place as usize + feature]
    }

    /// Cuts a cell, and the parts of it, as long as that tells anything apart.
    fn cut(&self, partition: &mut Partition, cell: u32, points: Vec<Point>) {
        let mut open = vec![(cell, points)];
        while let Some((cell, mut points)) = open.pop() {
            let is_small = points.len() < 2 * self.rule.samples;
            if is_small || partition.cells.len() >= self.rule.cells {
                continue;
            }
            let cuts = (0..self.dimension).filter_map(|feature| self.best(&mut points, feature));
            let Some(cut) = cuts.max_by(|one, other| one.score.total_cmp(&other.score)) else {
                continue;
            };
            let other = partition.cut(cell, cut.feature, cut.bound);
            let (low, high) = points
                .into_iter()
                .partition(|one| self.at(one, cut.feature as usize) <= cut.bound);
            open.push((cell, low));
            open.push((other, high));
        }
    }

    /// The best cut of a feature, if there is one that counts.
    fn best(&self, points: &mut [Point], feature: usize) -> Option<Cut> {
        points.sort_by(|one, other| {
            let values = (self.at(one, feature), self.at(other, feature));
            values.0.total_cmp(&values.1)
        });
        let mut all = vec![Sums::default(); self.actions];
        for point in points.iter() {
            all[point.action as usize].add(point.cost);
        }
        let mut low = vec![Sums::default(); self.actions];
        // What the actions say of a cut; only one of them changes from point to point.
        let mut scores = vec![0.0; self.actions];
        let mut total = 0.0;
        // The best of many cuts is the greatest of as many scores that are chance.
        let tried = (points.len() * self.dimension) as f64;
        let least = self.rule.score + 3.0 * self.actions as f64 + 2.0 * tried.ln();
        let mut best: Option<Cut> = None;
        for pair in points.windows(2) {
            let action = pair[0].action as usize;
            low[action].add(pair[0].cost);
            let score = self.score(low[action], all[action].without(low[action]));
            total += score - scores[action];
            scores[action] = score;
            let (value, next) = (self.at(&pair[0], feature), self.at(&pair[1], feature));
            if value >= next || total < least {
                continue;
            }
            if best.is_none_or(|best| total > best.score) {
                best = Some(Cut {
                    feature: feature as u32,
                    bound: simplest_between(value, next),
                    score: total,
                });
            }
        }
        best
    }

    /// The square of t, if the difference counts.
    fn score(&self, low: Sums, high: Sums) -> f64 {
        let least = self.rule.samples as f64;
        if low.count < least || high.count < least {
            return 0.0;
        }
        let difference = (low.mean() - high.mean()).abs();
        if difference < self.rule.difference {
            return 0.0;
        }
        let error = variance_of_mean(low) + variance_of_mean(high);
        // Where costs are no chance at all, the difference alone counts.
        let least = self.rule.difference * self.rule.difference / 1e4;
        difference * difference / error.max(least)
    }
}

fn variance_of_mean(costs: Sums) -> f64 {
    costs.deviation() / (costs.count - 1.0) / costs.count
}

/// The number between two others, of which the first is less, that has the fewest binary digits.
fn simplest_between(low: f64, high: f64) -> f64 {
    let mut step = 2.0_f64.powi(low.abs().max(high.abs()).log2().ceil() as i32);
    // At most 53 halvings lead to the digits of the greater number.
    while step > 0.0 && step.is_finite() {
        let least = ((low / step).floor() + 1.0) * step;
        if low < least && least < high {
            return least;
        }
        if step < high - low {
            break;
        }
        step /= 2.0;
    }
    let middle = f64::midpoint(low, high);
    // Between neighbours there is none, and a cut at the greater one would cut nothing off.
    if middle < high { middle } else { low }
}

#[cfg(test)]
mod tests {
    use super::simplest_between;

    fn assert_cut(low: f64, high: f64, cut: f64) {
        let found = simplest_between(low, high);
        assert!(
            found.total_cmp(&cut).is_eq(),
            "{found} between {low} and {high}"
        );
    }

    #[test]
    fn a_cut_has_few_digits() {
        assert_cut(1.2, 1.4, 1.25);
        assert_cut(0.9, 1.1, 1.0);
        assert_cut(2.0, 3.0, 2.5);
        assert_cut(2.9, 9.5, 8.0);
        assert_cut(-3.4, -3.1, -3.25);
        assert_cut(-1.0, 7.0, 0.0);
        assert_cut(1.386_1, 1.386_4, 1.386_230_468_75);
        assert_cut(f64::MIN, f64::MAX, 0.0);
    }

    #[test]
    fn a_cut_of_neighbours_lies_between_them() {
        let mut low = 1.0_f64;
        for _ in 0..4 {
            let high = low.next_up();
            assert!((low..high).contains(&simplest_between(low, high)));
            low = high;
        }
    }
}
