//! The finite decision process that a partition makes of all remembered decisions, and the values
//! of its actions.
//!
//! A *slot* is an action in a cell. A *stand* is a cell with the actions that are possible there;
//! its worth is the value of the best of them.
//!
//! Of several actions the one that seems best is often the one that was lucky. If its luck counted
//! as its value, waiting would always seem good: one of the cells ahead is lucky. So the runs are
//! in two halves; each chooses by its own samples, and takes the value from those of the other.
//!
//! Source: H. van Hasselt, "Double Q-learning", NIPS 2010, for the halves.
//!
//! Invariants:
//! * `order` sorts the samples by slots, and those of a slot by the stands behind them.
//! * `worths` are those of the values at hand, but while they are computed.

use std::borrow::Cow;

use super::partition::{Cell, Known, WAIT};
use super::sample::Sample;
use super::slopes::Slopes;
use super::sums::Sums;

/// The samples of a slot that lead to the same stand.
#[derive(Clone, Copy, Debug)]
struct Way {
    next: u32,
    /// Their costs, by the half of the runs.
    costs: [Sums; 2],
}

/// What the samples of a slot say of its value.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    value: f64,
    /// Its standard error.
    error: f64,
}

impl Estimate {
    /// The mean of costs: its error is as if one more cost were off by as much as all runs differ.
    fn of(costs: Sums, spread: f64) -> Estimate {
        let variance = (costs.deviation() + spread * spread) / costs.count;
        Estimate {
            value: costs.mean(),
            error: (variance / costs.count).sqrt(),
        }
    }

    /// What is known from few samples counts as worse by its error, or else luck would be taken for
    /// skill.
    fn cautious(self) -> f64 {
        self.value + self.error
    }
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
    /// By slot: by all samples, and by those of each half of the runs. A half without samples has
    /// those of the other.
    values: Vec<Estimate>,
    halves: Vec<[Estimate; 2]>,
    /// By slot: how often its action was taken, if that is more than there are samples.
    visits: Vec<f64>,
    /// By stand: for each half of the runs.
    worths: Vec<[f64; 2]>,
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
            let mut costs = [Sums::default(); 2];
            for &one in of_way {
                let sample = &samples[one as usize];
                costs[sample.half as usize].add(sample.cost);
            }
            ways.push(Way { next, costs });
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
            values: vec![Estimate::default(); slots.len()],
            halves: vec![[Estimate::default(); 2]; slots.len()],
            visits: Vec::new(),
            worths: vec![[0.0; 2]; stands.len()],
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

    /// Sets the value of a slot, whichever half of the runs asks.
    fn set(&mut self, slot: usize, estimate: Estimate) {
        self.values[slot] = estimate;
        self.halves[slot] = [estimate; 2];
    }

    /// Computes the worth of a stand: the value of the best action there; 0 where nothing is known.
    /// The error of a value is not handed on: in a run of many decisions it would add up, and make
    /// short runs look better than long ones.
    fn appraise(&mut self, stand: u32) {
        let halves = &self.halves;
        let slots = self.stands[stand as usize].slots.iter();
        for half in 0..2 {
            let cautious = |slot: &u32| halves[*slot as usize][half].cautious();
            let best = slots
                .clone()
                .min_by(|one, other| cautious(one).total_cmp(&cautious(other)));
            let worth = best.map_or(0.0, |&slot| halves[slot as usize][1 - half].value);
            self.worths[stand as usize][half] = worth;
        }
    }

    /// What a stand is worth to a half of the runs.
    fn worth(&self, stand: u32, half: u8) -> f64 {
        self.worths[stand as usize][half as usize]
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
        sample.cost + discount * self.worth(sample.next, sample.half)
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
                let mut next = self.worth(sample.next, sample.half);
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
            for (slot, &sums) in sums.iter().enumerate() {
                self.set(slot, Estimate::of(sums, spread));
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
                    let before = self.values[slot as usize].value;
                    self.average(slot, discount, spread);
                    let value = self.values[slot as usize].value;
                    change = change.max((value - before).abs());
                    greatest = greatest.max(value.abs());
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

    /// Computes the value of a slot: the mean of what its samples cost.
    fn average(&mut self, slot: u32, discount: f64, spread: f64) {
        let discount = self.discount(slot, discount);
        let slot = slot as usize;
        let ways = self.first_ways[slot]..self.first_ways[slot + 1];
        let mut sums = [Sums::default(); 2];
        for way in &self.ways[ways.start as usize..ways.end as usize] {
            for (half, sums) in sums.iter_mut().enumerate() {
                let worth = discount * self.worths[way.next as usize][half];
                *sums = sums.with(way.costs[half].raised(worth));
            }
        }
        let all = Estimate::of(sums[0].with(sums[1]), spread);
        self.values[slot] = all;
        self.halves[slot] = sums.map(|half| {
            if half.count > 0.0 {
                Estimate::of(half, spread)
            } else {
                all
            }
        });
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
            let value = self.values[slot].value;
            let estimate = Estimate {
                value: value + rate * (cost - value),
                error: spread / visits,
            };
            self.set(slot, estimate);
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
                value: self.values[slot as usize].value,
                error: self.values[slot as usize].error,
            });
        }
        for cell in cells {
            cell.known.sort_by_key(|one| one.action);
        }
    }

    /// Begins with the values that actions had in the cells.
    pub(super) fn begin_with(&mut self, cells: &[Cell]) {
        for slot in 0..self.slots.len() {
            let (cell, action) = self.slots[slot];
            if let Some(&Known { value, error, .. }) = cells[cell as usize].of(action) {
                self.set(slot, Estimate { value, error });
            }
        }
        for stand in 0..self.stands.len() as u32 {
            self.appraise(stand);
        }
    }
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

#[cfg(test)]
mod tests {
    use super::{Process, Sample, Stand};

    /// A decision that leads to a choice of two actions.
    const BEFORE: (u32, u32) = (0, 0);
    const LUCKY: (u32, u32) = (1, 0);
    const STEADY: (u32, u32) = (1, 1);

    #[test]
    fn luck_in_one_half_of_the_runs_counts_for_nothing() {
        let sample = |slot, next, cost, half| Sample {
            slot,
            next,
            cost,
            point: 0,
            at: f64::from(2 - next),
            is_followed: false,
            half,
        };
        let mut samples = Vec::new();
        for _ in 0..100 {
            for (half, luck) in [(0, -10.0), (1, 10.0)] {
                samples.push(sample(0, 1, 0.0, half));
                samples.push(sample(1, 0, luck, half));
                samples.push(sample(2, 0, 0.0, half));
            }
        }
        let stands = [(u32::MAX, &[][..]), (1, &[1, 2][..])].map(|(cell, slots)| Stand {
            cell,
            slots: slots.into(),
        });
        let slots = vec![BEFORE, LUCKY, STEADY];
        let mut process = Process::new(samples, Vec::new(), slots, stands.into());
        process.iterate(1.0, 1.0);
        // The first half chooses the lucky one, which the other half has seen to cost 10.
        let values = process.values.iter().map(|one| one.value.round() as i32);
        assert_eq!(values.collect::<Vec<_>>(), [5, 0, 0]);
    }
}
