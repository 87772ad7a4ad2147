//! The finite decision process that a partition makes of all remembered decisions, and the values
//! of its actions.
//!
//! A *slot* is an action in a cell. A *stand* is a cell with the actions that are possible there;
//! its worth is the value of the best of them.
//!
//! Invariants:
//! * `order` sorts the samples by slots, and those of a slot by the stands behind them.
//! * `worths` are those of the values and errors at hand, but while they are computed.

use std::borrow::Cow;

use super::partition::{Cell, Known, WAIT};
use super::sample::Sample;
use super::slopes::Slopes;
use super::sums::Sums;

/// The samples of a slot that lead to the same stand.
#[derive(Clone, Copy, Debug)]
struct Way {
    next: u32,
    count: f64,
    /// The sum of their costs, and of the squares.
    cost: f64,
    squares: f64,
}

/// The finite process.
#[derive(Debug)]
pub(super) struct Process {
    /// In the order in which they came.
    samples: Vec<Sample>,
    pub(super) points: Vec<f64>,
    /// The places of the samples.
    order: Vec<u32>,
    /// By slot: its cell and its action.
    slots: Vec<(u32, u32)>,
    /// By slot: where its samples begin, and its ways.
    first_samples: Vec<u32>,
    ways: Vec<Way>,
    first_ways: Vec<u32>,
    stands: Vec<Stand>,
    /// The cells with their slots and stands, those of late decisions first.
    groups: Vec<Group>,
    values: Vec<f64>,
    /// By slot: the standard error of its value.
    errors: Vec<f64>,
    /// By slot: how often its action was taken, if that is more than there are samples.
    visits: Vec<f64>,
    /// By stand.
    worths: Vec<f64>,
    /// By sample: what it costs in the centre of its cell; empty if slopes were not looked at.
    level_costs: Vec<f64>,
}

/// A cell with the actions that are possible there.
#[derive(Debug)]
pub(super) struct Stand {
    /// The end has none.
    pub(super) cell: u32,
    /// The slots of the actions.
    pub(super) slots: Box<[u32]>,
}

/// What belongs to a cell.
#[derive(Clone, Debug, Default)]
struct Group {
    slots: Vec<u32>,
    stands: Vec<u32>,
}

/// So many times all values are computed from what has followed.
const SWEEPS_OF_TRACES: usize = 15;

/// Sweeps over all values end when no value changes by more than this part of the greatest one,
const SMALL: f64 = 1e-7;
/// or after so many.
const MOST_SWEEPS: usize = 500;

impl Process {
    /// The process of some samples. Slots are cells with actions, stands are cells with slots; the
    /// first stand is the end.
    pub(super) fn new(
        samples: Vec<Sample>,
        points: Vec<f64>,
        slots: Vec<(u32, u32)>,
        stands: Vec<Stand>,
    ) -> Process {
        let order = by_slots(&samples, slots.len(), stands.len());
        let way = |place: u32| {
            let sample = &samples[place as usize];
            (sample.slot, sample.next)
        };
        let (mut first_samples, mut first_ways) = (Vec::new(), Vec::new());
        let mut ways: Vec<Way> = Vec::new();
        for (place, of_way) in
            order
                .chunk_by(|&one, &other| way(one) == way(other))
                .scan(0, |end, way| {
                    let place = *end;
                    *end += way.len();
                    Some((place, way))
                })
        {
            // There is no slot without samples.
            let (slot, next) = way(of_way[0]);
            if first_samples.len() == slot as usize {
                first_samples.push(place as u32);
                first_ways.push(ways.len() as u32);
            }
            let costs = of_way.iter().map(|&one| samples[one as usize].cost);
            ways.push(Way {
                next,
                count: of_way.len() as f64,
                cost: costs.clone().sum(),
                squares: costs.map(|cost| cost * cost).sum(),
            });
        }
        first_samples.push(samples.len() as u32);
        first_ways.push(ways.len() as u32);
        let mut process = Process {
            samples,
            points,
            order,
            first_samples,
            ways,
            first_ways,
            groups: Vec::new(),
            values: vec![0.0; slots.len()],
            errors: vec![0.0; slots.len()],
            visits: Vec::new(),
            worths: vec![0.0; stands.len()],
            level_costs: Vec::new(),
            slots,
            stands,
        };
        process.group();
        process
    }

    /// Orders the cells by when decisions are taken in them.
    fn group(&mut self) {
        let cells = self.slots.iter().map(|slot| slot.0 + 1).max().unwrap_or(0);
        let mut groups = vec![Group::default(); cells as usize];
        let mut times = vec![0.0; cells as usize];
        let mut counts = vec![0.0; cells as usize];
        for (slot, &(cell, _)) in (0..).zip(&self.slots) {
            groups[cell as usize].slots.push(slot);
            for (_, sample) in self.of(slot) {
                times[cell as usize] += sample.at;
                counts[cell as usize] += 1.0;
            }
        }
        for (number, stand) in (0..).zip(&self.stands) {
            // The end belongs to no cell.
            if let Some(group) = groups.get_mut(stand.cell as usize) {
                group.stands.push(number);
            }
        }
        let mut order: Vec<usize> = (0..groups.len()).filter(|&one| counts[one] > 0.0).collect();
        order.sort_by(|&one, &other| {
            let (first, second) = (times[one] / counts[one], times[other] / counts[other]);
            second.total_cmp(&first).then(one.cmp(&other))
        });
        let groups = order
            .into_iter()
            .map(|cell| std::mem::take(&mut groups[cell]));
        self.groups = groups.collect();
    }

    /// How many samples there are.
    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    /// The samples of a slot with their places.
    pub(super) fn of(&self, slot: u32) -> impl ExactSizeIterator<Item = (usize, &Sample)> {
        let first = self.first_samples[slot as usize] as usize;
        let places = &self.order[first..self.first_samples[slot as usize + 1] as usize];
        places
            .iter()
            .map(|&place| (place as usize, &self.samples[place as usize]))
    }

    /// How many slots there are.
    pub(super) fn slots(&self) -> u32 {
        self.slots.len() as u32
    }

    /// The cell of a slot.
    pub(super) fn cell(&self, slot: u32) -> u32 {
        self.slots[slot as usize].0
    }

    /// Computes the worth of a stand: the value of the best action there; 0 where nothing is known.
    /// What is known from few samples counts as worse by its error when the best is chosen, or else
    /// luck would be taken for skill. The error is not handed on: in a run of many decisions it
    /// would add up, and make short runs look better than long ones.
    fn appraise(&mut self, stand: u32) {
        let (values, errors) = (&self.values, &self.errors);
        let cautious = |slot: u32| values[slot as usize] + errors[slot as usize];
        let slots = self.stands[stand as usize].slots.iter().copied();
        let best = slots.min_by(|&one, &other| cautious(one).total_cmp(&cautious(other)));
        self.worths[stand as usize] = best.map_or(0.0, |slot| values[slot as usize]);
    }

    /// To wait puts nothing off, so it is not discounted.
    fn discount(&self, slot: u32, discount: f64) -> f64 {
        if self.slots[slot as usize].1 == WAIT {
            1.0
        } else {
            discount
        }
    }

    /// What a sample costs from there on.
    pub(super) fn cost(&self, sample: &Sample, discount: f64) -> f64 {
        let discount = self.discount(sample.slot, discount);
        sample.cost + discount * self.worths[sample.next as usize]
    }

    /// By sample: what it costs, so that cells show where they differ: in the centre of its cell,
    /// or else as long as the same is done in the same cell.
    pub(super) fn telling_costs(&self, discount: f64) -> Cow<'_, [f64]> {
        if self.level_costs.is_empty() {
            Cow::Owned(self.costs_of_stays(discount))
        } else {
            Cow::Borrowed(&self.level_costs)
        }
    }

    /// By sample: what it costs as long as the same is done in the same cell, and from there on. So
    /// a cell shows where in it that soon costs more, and not at its border alone.
    fn costs_of_stays(&self, discount: f64) -> Vec<f64> {
        let mut costs = vec![0.0; self.samples.len()];
        for (place, sample) in self.samples.iter().enumerate().rev() {
            let stays = self.stands[sample.next as usize].cell == self.cell(sample.slot);
            let next = self.samples.get(place + 1);
            costs[place] = match next.filter(|_| sample.is_followed && stays) {
                Some(next) if next.slot == sample.slot => {
                    sample.cost + self.discount(sample.slot, discount) * costs[place + 1]
                }
                _ => self.cost(sample, discount),
            };
        }
        costs
    }

    /// Computes the values of all actions in all cells: what their samples cost in the centres of
    /// the cells. What is behind a decision is to a part of `trace` what has followed, and for the
    /// rest what its stand is worth at its point. What a cell promises counts the less: where
    /// states that differ are in one cell, it promises what no strategy can do.
    ///
    /// Source: R. Sutton and A. Barto, "Reinforcement Learning", 2nd edition, section 12.1
    /// (lambda-returns).
    pub(super) fn follow_traces(&mut self, discount: f64, trace: f64, spread: f64) {
        let mut slopes = Slopes::new(&self.samples, &self.points, &self.slots);
        let mut costs = vec![0.0; self.samples.len()];
        for _ in 0..SWEEPS_OF_TRACES {
            let mut behind = 0.0;
            for (place, sample) in self.samples.iter().enumerate().rev() {
                let mut next = self.worths[sample.next as usize];
                if sample.is_followed {
                    let point = self.samples[place + 1].point as usize;
                    let cell = self.stands[sample.next as usize].cell;
                    next += slopes.rise(cell, &self.points[point..]);
                    next += trace * (behind - next);
                }
                behind = sample.cost + self.discount(sample.slot, discount) * next;
                costs[place] = behind;
            }
            slopes.fit(&self.points, &costs);
            let mut sums = vec![Sums::default(); self.slots.len()];
            for (sample, cost) in self.samples.iter().zip(&mut costs) {
                let point = &self.points[sample.point as usize..];
                *cost -= slopes.rise(self.cell(sample.slot), point);
                sums[sample.slot as usize].add(*cost);
            }
            for (slot, sums) in sums.iter().enumerate() {
                (self.values[slot], self.errors[slot]) = mean_and_error(*sums, spread);
            }
            for stand in 0..self.stands.len() as u32 {
                self.appraise(stand);
            }
        }
        self.level_costs = costs;
    }

    /// Computes the values of all actions in all cells: the means of what the samples cost.
    ///
    /// Source: value iteration, with the latest decisions first (Gauss and Seidel).
    pub(super) fn iterate(&mut self, discount: f64, spread: f64) {
        let groups = std::mem::take(&mut self.groups);
        for _ in 0..MOST_SWEEPS {
            let (mut change, mut greatest) = (0.0_f64, 0.0_f64);
            for group in &groups {
                for &slot in &group.slots {
                    let (value, error) = self.mean(slot, discount, spread);
                    self.errors[slot as usize] = error;
                    change = change.max((value - self.values[slot as usize]).abs());
                    greatest = greatest.max(value.abs());
                    self.values[slot as usize] = value;
                }
                for &stand in &group.stands {
                    self.appraise(stand);
                }
            }
            if change <= SMALL * greatest {
                break;
            }
        }
        self.groups = groups;
    }

    /// The mean of what the samples of a slot cost, and its standard error.
    fn mean(&self, slot: u32, discount: f64, spread: f64) -> (f64, f64) {
        let discount = self.discount(slot, discount);
        let ways = self.first_ways[slot as usize]..self.first_ways[slot as usize + 1];
        let mut sums = Sums::default();
        for way in &self.ways[ways.start as usize..ways.end as usize] {
            let worth = discount * self.worths[way.next as usize];
            sums.count += way.count;
            sums.sum += way.cost + way.count * worth;
            sums.squares += way.squares + worth * (2.0 * way.cost + way.count * worth);
        }
        mean_and_error(sums, spread)
    }

    /// Moves the values of actions towards what each sample costs, the latest sample first. The
    /// n-th sample of an action counts for 1 / min(`most`, n + 1).
    ///
    /// Source: C. Watkins and P. Dayan, "Q-learning", Machine Learning 8 (1992).
    pub(super) fn follow(&mut self, cells: &[Cell], discount: f64, most: f64, spread: f64) {
        let visits = self.slots.iter().map(|&(cell, action)| {
            let known = cells[cell as usize].of(action);
            known.map_or(0.0, |known| known.visits)
        });
        self.visits = visits.collect();
        let mut stands_of = vec![Vec::new(); self.slots.len()];
        for (number, stand) in (0..).zip(&self.stands) {
            for &slot in &stand.slots {
                stands_of[slot as usize].push(number);
            }
        }
        for place in (0..self.samples.len()).rev() {
            let sample = self.samples[place];
            let slot = sample.slot as usize;
            let cost = self.cost(&sample, discount);
            self.visits[slot] += 1.0;
            let visits = self.visits[slot];
            let rate = if visits > 1.0 {
                1.0 / visits.min(most)
            } else {
                1.0
            };
            self.values[slot] += rate * (cost - self.values[slot]);
            self.errors[slot] = spread / visits;
            for &stand in &stands_of[slot] {
                self.appraise(stand);
            }
        }
    }

    /// Notes in the cells what is known of the actions.
    pub(super) fn note(&self, cells: &mut [Cell]) {
        let is_whole = self.visits.is_empty();
        for cell in cells.iter_mut().filter(|_| is_whole) {
            cell.known.clear();
        }
        for (slot, &(cell, action)) in (0..).zip(&self.slots) {
            let count = self.of(slot).len() as f64;
            let known = &mut cells[cell as usize].known;
            known.retain(|one| one.action != action);
            known.push(Known {
                action,
                visits: self.visits.get(slot as usize).copied().unwrap_or(count),
                value: self.values[slot as usize],
                error: self.errors[slot as usize],
            });
        }
        for cell in cells {
            cell.known.sort_by_key(|one| one.action);
        }
    }

    /// Begins with the values that actions had in the cells.
    pub(super) fn begin_with(&mut self, cells: &[Cell]) {
        for (slot, &(cell, action)) in self.slots.iter().enumerate() {
            if let Some(known) = cells[cell as usize].of(action) {
                self.values[slot] = known.value;
                self.errors[slot] = known.error;
            }
        }
        for stand in 0..self.stands.len() as u32 {
            self.appraise(stand);
        }
    }
}

/// The mean of costs, and its standard error: as if one more cost were off by as much as all runs
/// differ.
fn mean_and_error(costs: Sums, spread: f64) -> (f64, f64) {
    let variance = (costs.deviation() + spread * spread) / costs.count;
    (costs.mean(), (variance / costs.count).sqrt())
}

/// The places of samples in the order of their slots, and those of a slot in the order of the
/// stands behind them.
fn by_slots(samples: &[Sample], slots: usize, stands: usize) -> Vec<u32> {
    let sample = |place: u32| &samples[place as usize];
    let by_stands = counted(0..samples.len() as u32, stands, |place| sample(place).next);
    counted(by_stands.iter().copied(), slots, |place| sample(place).slot)
}

/// Places in the order of their keys, of which there are so many; else in the order they have.
/// Samples are many and keys are few, so keys are counted.
fn counted(
    places: impl ExactSizeIterator<Item = u32> + Clone,
    keys: usize,
    key: impl Fn(u32) -> u32,
) -> Vec<u32> {
    let mut ends = vec![0; keys + 1];
    for place in places.clone() {
        ends[key(place) as usize + 1] += 1;
    }
    for key in 0..keys {
        ends[key + 1] += ends[key];
    }
    let mut order = vec![0; places.len()];
    for place in places {
        let next: &mut usize = &mut ends[key(place) as usize];
        order[*next] = place;
        *next += 1;
    }
    order
}
