//! All decisions that are remembered, and what the partition makes of them: a finite decision process.
//!
//! A decision to wait while what is seen moves from cell to cell is one decision in each of them. A
//! *stand* is a cell with the actions that are possible there; the value of a stand is that of the
//! best of them. A *slot* is an action in a cell.

use rustc_hash::FxHashMap;

use super::episode::Episode;
use super::partition::{Cell, DRAW, Known, Partition, WAIT};

/// The stand after which nothing costs any more.
pub(super) const END: u32 = 0;

/// A remembered decision.
#[derive(Clone, Copy, Debug)]
struct Memory {
    observation: u32,
    /// Which actions were possible: the number of the set.
    set: u32,
    action: u32,
    cost: f64,
    time: f64,
    /// How long after the beginning of the run it was taken.
    at: f64,
    /// Where its point begins.
    point: u32,
    moves: bool,
    is_last: bool,
}

/// What a decision was in the finite process.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// The action in its cell.
    pub(super) slot: u32,
    /// The stand behind it.
    pub(super) next: u32,
    pub(super) cost: f64,
    /// Where its point begins, among those of the samples.
    pub(super) point: u32,
    pub(super) at: f64,
}

/// Remembered decisions.
#[derive(Debug, Default)]
pub(super) struct Experience {
    memories: Vec<Memory>,
    points: Vec<f64>,
    dimension: usize,
    width: usize,
    /// The sets of possible actions, one after the other.
    sets: Vec<Box<[u32]>>,
    set_numbers: FxHashMap<Box<[u32]>, u32>,
}

/// The finite process.
#[derive(Debug, Default)]
pub(super) struct Process {
    pub(super) samples: Vec<Sample>,
    pub(super) points: Vec<f64>,
    /// By slot: its cell and its action.
    slots: Vec<(u32, u32)>,
    /// By slot: where its samples begin; they are sorted by slots.
    firsts: Vec<u32>,
    /// By stand: the slots of its actions.
    stands: Vec<Box<[u32]>>,
    /// In which order values are computed: those of late decisions first.
    order: Vec<u32>,
    /// By slot: whether it waits.
    waits: Vec<bool>,
    /// The samples in the order in which they came.
    trail: Vec<Sample>,
    pub(super) values: Vec<f64>,
    /// By slot: the standard error of its value.
    errors: Vec<f64>,
    /// By slot: how often its action was taken, if that is more than there are samples.
    visits: Vec<f64>,
}

impl Experience {
    /// For what has so many words of exact values, and so many numbers in intervals.
    pub(super) fn new(width: usize, dimension: usize) -> Experience {
        Experience {
            dimension,
            width,
            ..Experience::default()
        }
    }

    /// How many decisions are remembered.
    pub(super) fn len(&self) -> usize {
        self.memories.len()
    }

    /// Remembers the decisions of a run.
    pub(super) fn add(&mut self, partition: &mut Partition, episode: &Episode) {
        let (mut point, mut choice, mut at) = (0, 0, 0.0);
        for (number, step) in episode.steps.iter().enumerate() {
            let key = &episode.keys[number * self.width..][..self.width];
            let numbers = if step.moves {
                2 * self.dimension
            } else {
                self.dimension
            };
            let possible = &episode.choices[choice..choice + step.choices as usize];
            let set = match self.set_numbers.get(possible) {
                Some(&known) => known,
                None => {
                    let new = self.sets.len() as u32;
                    self.sets.push(possible.into());
                    self.set_numbers.insert(possible.into(), new);
                    new
                }
            };
            self.memories.push(Memory {
                observation: partition.intern(key),
                set,
                action: step.action,
                cost: step.cost,
                time: step.time,
                at,
                point: self.points.len() as u32,
                moves: step.moves,
                is_last: number + 1 == episode.steps.len(),
            });
            self.points
                .extend_from_slice(&episode.points[point..point + numbers]);
            point += numbers;
            choice += step.choices as usize;
            at += step.time;
        }
    }

    /// Forgets the oldest decisions, whole runs of them, so that at most so many are left.
    pub(super) fn forget(&mut self, most: usize) {
        if self.memories.len() <= most {
            return;
        }
        let start = self.memories.len() - most;
        let ends = self.memories[start - 1..].iter();
        let first = ends.take_while(|one| !one.is_last).count() + start;
        let point = self.memories.get(first).map(|one| one.point);
        let point = point.unwrap_or(self.points.len() as u32);
        self.memories.drain(..first);
        self.points.drain(..point as usize);
        for one in &mut self.memories {
            one.point -= point;
        }
    }

    /// What a partition makes of all decisions.
    pub(super) fn process(&self, partition: &Partition) -> Process {
        let mut builder = Builder {
            partition,
            process: Process::default(),
            slots: FxHashMap::default(),
            stands: FxHashMap::default(),
            sets: &self.sets,
            stand_parts: vec![(u32::MAX, u32::MAX)],
        };
        let mut here = Vec::with_capacity(self.dimension);
        for (number, memory) in self.memories.iter().enumerate() {
            if memory.action == DRAW {
                continue;
            }
            here.clear();
            let numbers = &self.points[memory.point as usize..];
            here.extend_from_slice(&numbers[..self.dimension]);
            let next = self.memories.get(number + 1).filter(|_| !memory.is_last);
            let next = next.map_or(END, |next| {
                let point = &self.points[next.point as usize..][..self.dimension];
                let cell = partition.cell(next.observation, point);
                builder.stand(cell, next.set)
            });
            if memory.moves {
                let rates = &numbers[self.dimension..2 * self.dimension];
                builder.add_wait(memory, &mut here, rates, next);
            } else {
                let cell = partition.cell(memory.observation, &here);
                let slot = builder.slot(cell, memory.action);
                builder.add(slot, next, memory.cost, &here, memory.at);
            }
        }
        builder.finish()
    }
}

struct Builder<'e> {
    partition: &'e Partition,
    process: Process,
    slots: FxHashMap<(u32, u32), u32>,
    stands: FxHashMap<(u32, u32), u32>,
    sets: &'e [Box<[u32]>],
    /// By stand: its cell and its set.
    stand_parts: Vec<(u32, u32)>,
}

impl Builder<'_> {
    fn slot(&mut self, cell: u32, action: u32) -> u32 {
        let slots = &mut self.process.slots;
        *self.slots.entry((cell, action)).or_insert_with(|| {
            slots.push((cell, action));
            slots.len() as u32 - 1
        })
    }

    fn stand(&mut self, cell: u32, set: u32) -> u32 {
        let parts = &mut self.stand_parts;
        *self.stands.entry((cell, set)).or_insert_with(|| {
            parts.push((cell, set));
            parts.len() as u32 - 1
        })
    }

    fn add(&mut self, slot: u32, next: u32, cost: f64, point: &[f64], at: f64) {
        let process = &mut self.process;
        process.samples.push(Sample {
            slot,
            next,
            cost,
            point: process.points.len() as u32,
            at,
        });
        process.points.extend_from_slice(point);
    }

    /// Adds a wait, cell by cell.
    fn add_wait(&mut self, memory: &Memory, here: &mut [f64], rates: &[f64], next: u32) {
        let (mut left, mut at) = (memory.time, memory.at);
        let cost_rate = memory.cost / memory.time;
        let mut cell = self.partition.cell(memory.observation, here);
        loop {
            let exit = self.partition.exit(memory.observation, here, rates);
            let slot = self.slot(cell, WAIT);
            if exit >= left {
                let cost = if memory.time > 0.0 {
                    cost_rate * left
                } else {
                    memory.cost
                };
                self.add(slot, next, cost, here, at);
                return;
            }
            let before = here.to_vec();
            for (value, rate) in here.iter_mut().zip(rates) {
                *value += rate * exit;
            }
            cell = self.partition.cell(memory.observation, here);
            let stand = self.stand(cell, memory.set);
            self.add(slot, stand, cost_rate * exit, &before, at);
            left -= exit;
            at += exit;
        }
    }

    fn finish(mut self) -> Process {
        let stands = self.stand_parts.iter().map(|&(cell, set)| {
            let Some(actions) = self.sets.get(set as usize) else {
                return Box::from([]);
            };
            let slots = actions.iter();
            slots
                .filter_map(|&action| self.slots.get(&(cell, action)).copied())
                .collect()
        });
        let stands: Vec<Box<[u32]>> = stands.collect();
        let process = &mut self.process;
        process.stands = stands;
        process.trail.clone_from(&process.samples);
        process.samples.sort_by_key(|sample| sample.slot);
        let slots = process.slots.len();
        let mut firsts = vec![0; slots + 1];
        for sample in &process.samples {
            firsts[sample.slot as usize + 1] += 1;
        }
        for slot in 0..slots {
            firsts[slot + 1] += firsts[slot];
        }
        process.firsts = firsts;
        let mean_time = |slot: u32| {
            let samples = process.of(slot);
            samples.iter().map(|one| one.at).sum::<f64>() / samples.len() as f64
        };
        let mut order: Vec<(f64, u32)> =
            (0..slots as u32).map(|one| (mean_time(one), one)).collect();
        order.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.cmp(&other.1)));
        process.order = order.into_iter().map(|(_, slot)| slot).collect();
        process.waits = process.slots.iter().map(|slot| slot.1 == WAIT).collect();
        process.values = vec![0.0; slots];
        process.errors = vec![0.0; slots];
        self.process
    }
}

/// Sweeps over all values end when no value changes by more than this part of the greatest one,
const SMALL: f64 = 1e-9;
/// or after so many.
const MOST_SWEEPS: usize = 500;

impl Process {
    /// The samples of a slot.
    pub(super) fn of(&self, slot: u32) -> &[Sample] {
        let first = self.firsts[slot as usize] as usize;
        &self.samples[first..self.firsts[slot as usize + 1] as usize]
    }

    /// How many slots there are.
    pub(super) fn slots(&self) -> u32 {
        self.slots.len() as u32
    }

    /// The cell of a slot.
    pub(super) fn cell(&self, slot: u32) -> u32 {
        self.slots[slot as usize].0
    }

    /// The value of a stand: of the best action there; 0 where nothing is known. What is known from
    /// few samples counts as worse by its error, or else luck would be taken for skill.
    pub(super) fn value(&self, stand: u32) -> f64 {
        let slots = self.stands[stand as usize].iter();
        let cautious = slots.map(|&slot| self.values[slot as usize] + self.errors[slot as usize]);
        let least = cautious.fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// What a sample costs from there on. To wait puts nothing off, so it is not discounted.
    pub(super) fn cost(&self, sample: &Sample, discount: f64) -> f64 {
        let discount = if self.waits[sample.slot as usize] {
            1.0
        } else {
            discount
        };
        sample.cost + discount * self.value(sample.next)
    }

    /// Computes the values of all actions in all cells: the means of what the samples cost.
    ///
    /// Source: value iteration, with the latest decisions first (Gauss and Seidel).
    pub(super) fn iterate(&mut self, discount: f64, spread: f64) {
        for _ in 0..MOST_SWEEPS {
            let (mut change, mut greatest) = (0.0_f64, 0.0_f64);
            for place in 0..self.order.len() {
                let slot = self.order[place];
                let (value, error) = self.mean(slot, discount, spread);
                self.errors[slot as usize] = error;
                change = change.max((value - self.values[slot as usize]).abs());
                greatest = greatest.max(value.abs());
                self.values[slot as usize] = value;
            }
            if change <= SMALL * greatest {
                return;
            }
        }
    }

    /// The mean of what the samples of a slot cost, and its standard error: as if one more sample were
    /// off by as much as all runs differ.
    fn mean(&self, slot: u32, discount: f64, spread: f64) -> (f64, f64) {
        let samples = self.of(slot);
        let count = samples.len() as f64;
        let sum: f64 = samples.iter().map(|one| self.cost(one, discount)).sum();
        let mean = sum / count;
        let squares = samples.iter().map(|one| {
            let off = self.cost(one, discount) - mean;
            off * off
        });
        let variance = (squares.sum::<f64>() + spread * spread) / count;
        (mean, (variance / count).sqrt())
    }

    /// Moves the values of actions towards what each sample costs, the latest sample first. The n-th
    /// sample of an action counts for 1 / min(`most`, n + 1).
    ///
    /// Source: C. Watkins and P. Dayan, "Q-learning", Machine Learning 8 (1992).
    pub(super) fn follow(&mut self, cells: &[Cell], discount: f64, most: f64) {
        let visits = self.slots.iter().map(|&(cell, action)| {
            let known = cells[cell as usize].of(action);
            known.map_or(0.0, |known| known.visits)
        });
        self.visits = visits.collect();
        for place in (0..self.trail.len()).rev() {
            let sample = self.trail[place];
            let cost = self.cost(&sample, discount);
            let visits = &mut self.visits[sample.slot as usize];
            *visits += 1.0;
            let rate = if *visits > 1.0 {
                1.0 / visits.min(most)
            } else {
                1.0
            };
            let value = &mut self.values[sample.slot as usize];
            *value += rate * (cost - *value);
        }
    }

    /// Notes in the cells what is known of the actions.
    pub(super) fn note(&self, cells: &mut [Cell], discount: f64, spread: f64) {
        let is_whole = self.visits.is_empty();
        for cell in cells.iter_mut().filter(|_| is_whole) {
            cell.known.clear();
        }
        for slot in 0..self.slots() {
            let value = self.values[slot as usize];
            let count = self.of(slot).len() as f64;
            let visits = self.visits.get(slot as usize).copied().unwrap_or(count);
            let (_, error) = self.mean(slot, discount, spread);
            let (cell, action) = self.slots[slot as usize];
            let known = &mut cells[cell as usize].known;
            known.retain(|one| one.action != action);
            known.push(Known {
                action,
                visits,
                value,
                error,
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
    }
}
