//! All decisions that are remembered, and what the partition makes of them: the samples of a finite
//! decision process ([`super::process`]).
//!
//! A decision to wait while what is seen moves from cell to cell is one decision in each of them.

use rustc_hash::FxHashMap;

use super::episode::Episode;
use super::partition::{DRAW, Partition, WAIT};
use super::process::{Process, Stand};
use super::sample::Sample;
use super::tree;

/// The stand after which nothing costs any more.
const END: u32 = 0;

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
    /// Which half of the runs its run belongs to: 0 or 1.
    half: u8,
    /// A node of the tree of the observation that its point lies below, not far from the leaf.
    node: u32,
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
    /// The number that was asked for last, which is often asked for again.
    last_set: u32,
    /// The half of the runs to which the next one belongs.
    next_half: u8,
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
            let set = self.set(possible);
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
                half: self.next_half,
                node: 0,
            });
            self.points
                .extend_from_slice(&episode.points[point..point + numbers]);
            point += numbers;
            choice += step.choices as usize;
            at += step.time;
        }
        self.next_half = 1 - self.next_half;
    }

    /// The number of a set of possible actions.
    fn set(&mut self, possible: &[u32]) -> u32 {
        let last = self.sets.get(self.last_set as usize);
        if last.is_some_and(|last| last.iter().eq(possible)) {
            return self.last_set;
        }
        if let Some(&known) = self.set_numbers.get(possible) {
            self.last_set = known;
            return known;
        }
        let new = self.sets.len() as u32;
        self.sets.push(possible.into());
        self.set_numbers.insert(possible.into(), new);
        new
    }

    /// How many decisions are remembered.
    pub(super) fn len(&self) -> usize {
        self.memories.len()
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

    /// What a partition makes of all decisions: the same one as before, or one that was cut
    /// further.
    pub(super) fn process(&mut self, partition: &Partition) -> Process {
        let points = &self.points;
        let cells = self.memories.iter_mut().map(|memory| {
            let point = &points[memory.point as usize..][..self.dimension];
            let tree = partition.tree(memory.observation);
            tree::leaf_below(tree, &mut memory.node, point)
        });
        let cells: Vec<u32> = cells.collect();
        let mut builder = Builder {
            partition,
            samples: Vec::with_capacity(self.memories.len()),
            points: Vec::with_capacity(self.memories.len() * self.dimension),
            slot_parts: Vec::new(),
            slots: vec![Vec::new(); partition.cells.len()],
            stands: vec![Vec::new(); partition.cells.len()],
            sets: &self.sets,
            stand_parts: vec![(u32::MAX, u32::MAX)],
            is_followed: false,
            half: 0,
        };
        let mut here = Vec::with_capacity(self.dimension);
        for (number, memory) in self.memories.iter().enumerate() {
            if memory.action == DRAW {
                continue;
            }
            builder.half = memory.half;
            here.clear();
            let numbers = &self.points[memory.point as usize..];
            here.extend_from_slice(&numbers[..self.dimension]);
            let next = self.memories.get(number + 1).filter(|_| !memory.is_last);
            builder.is_followed = next.is_some_and(|next| next.action != DRAW);
            let next = next.map_or(END, |next| builder.stand(cells[number + 1], next.set));
            if memory.moves {
                let rates = &numbers[self.dimension..2 * self.dimension];
                builder.add_wait(memory, &mut here, rates, next);
            } else {
                let slot = builder.slot(cells[number], memory.action);
                builder.add(slot, next, memory.cost, &here, memory.at);
            }
        }
        builder.finish()
    }
}

struct Builder<'e> {
    partition: &'e Partition,
    samples: Vec<Sample>,
    points: Vec<f64>,
    /// By slot: its cell and its action.
    slot_parts: Vec<(u32, u32)>,
    /// By cell: its few actions with their slots, and its sets with their stands.
    slots: Vec<Vec<(u32, u32)>>,
    stands: Vec<Vec<(u32, u32)>>,
    sets: &'e [Box<[u32]>],
    /// By stand: its cell and its set.
    stand_parts: Vec<(u32, u32)>,
    /// Whether the decision behind the one at hand has samples, too.
    is_followed: bool,
    /// The half of the runs to which the one at hand belongs.
    half: u8,
}

impl Builder<'_> {
    fn slot(&mut self, cell: u32, action: u32) -> u32 {
        numbered(&mut self.slots, &mut self.slot_parts, cell, action)
    }

    fn stand(&mut self, cell: u32, set: u32) -> u32 {
        numbered(&mut self.stands, &mut self.stand_parts, cell, set)
    }

    fn add(&mut self, slot: u32, next: u32, cost: f64, point: &[f64], at: f64) {
        self.samples.push(Sample {
            slot,
            next,
            cost,
            point: self.points.len() as u32,
            at,
            is_followed: self.is_followed,
            half: self.half,
        });
        self.points.extend_from_slice(point);
    }

    /// Adds a wait, cell by cell.
    fn add_wait(&mut self, memory: &Memory, here: &mut [f64], rates: &[f64], next: u32) {
        let (mut left, mut at) = (memory.time, memory.at);
        let cost_rate = memory.cost / memory.time;
        let mut before = here.to_vec();
        let observation = memory.observation;
        let (mut cell, mut exit) = self.partition.cell_and_exit(observation, here, rates);
        let is_followed = std::mem::replace(&mut self.is_followed, true);
        while exit < left {
            before.copy_from_slice(here);
            for (value, rate) in here.iter_mut().zip(rates) {
                *value += rate * exit;
            }
            let slot = self.slot(cell, WAIT);
            let passed = exit;
            (cell, exit) = self.partition.cell_and_exit(observation, here, rates);
            let stand = self.stand(cell, memory.set);
            self.add(slot, stand, cost_rate * passed, &before, at);
            left -= passed;
            at += passed;
        }
        self.is_followed = is_followed;
        let slot = self.slot(cell, WAIT);
        let cost = if memory.time > 0.0 {
            cost_rate * left
        } else {
            memory.cost
        };
        self.add(slot, next, cost, here, at);
    }

    fn finish(self) -> Process {
        let actions = |set: u32| self.sets.get(set as usize).map_or(&[][..], |set| set);
        let stands = self.stand_parts.iter().map(|&(cell, set)| {
            let slots = actions(set).iter();
            let known = self.slots.get(cell as usize).map_or(&[][..], |known| known);
            let slots = slots.filter_map(|action| {
                let found = known.iter().find(|one| one.0 == *action);
                found.map(|one| one.1)
            });
            let slots = slots.collect();
            Stand { cell, slots }
        });
        let stands = stands.collect();
        Process::new(self.samples, self.points, self.slot_parts, stands)
    }
}

/// The number of a part of a cell, by its own number there; a new one gets the next number.
fn numbered(
    by_cell: &mut [Vec<(u32, u32)>],
    parts: &mut Vec<(u32, u32)>,
    cell: u32,
    own: u32,
) -> u32 {
    let known = &mut by_cell[cell as usize];
    if let Some(&(_, number)) = known.iter().find(|one| one.0 == own) {
        return number;
    }
    let number = parts.len() as u32;
    known.push((own, number));
    parts.push((cell, own));
    number
}
