//! Stored states that wait, in order. Most of a long queue can be put on disk.
//!
//! Cost: a state takes four bytes if it has no zone, else twelve.

use super::disk::Cold;
use super::passed_list::Stored;
use super::records::Records;

/// Stored states that wait.
#[derive(Debug)]
pub(in crate::search) struct Queue {
    /// The numbers of each, as [`Stored::numbers`] has them; those of the first ones are given
    /// back.
    all: Records<u32>,
    /// How many have left at the front.
    first: usize,
}

impl Queue {
    /// No states, which will have zones or not.
    pub(in crate::search) fn new(has_zones: bool) -> Queue {
        Queue {
            all: Records::new(if has_zones { 3 } else { 1 }),
            first: 0,
        }
    }

    /// How many wait.
    pub(in crate::search) fn len(&self) -> usize {
        self.all.len() - self.first
    }

    /// The bytes that the queue takes in memory.
    pub(in crate::search) fn bytes(&self) -> usize {
        self.all.bytes()
    }

    /// What may be put on disk.
    pub(in crate::search) fn cold(&mut self) -> &mut dyn Cold {
        &mut self.all
    }

    /// Adds a state at the end.
    pub(in crate::search) fn push(&mut self, stored: Stored) {
        self.all.push(&stored.numbers()[..self.all.size()]);
    }

    /// Takes the first state.
    pub(in crate::search) fn pop_front(&mut self) -> Option<Stored> {
        if self.len() == 0 {
            // All numbers are free again.
            self.all.clear();
            self.first = 0;
            return None;
        }
        let stored = Stored::of_numbers(self.all.get(self.first as u32));
        self.first += 1;
        self.all.release_before(self.first as u32);
        Some(stored)
    }

    /// Takes the last state.
    pub(in crate::search) fn pop_back(&mut self) -> Option<Stored> {
        let last = self.len().checked_sub(1)? + self.first;
        let stored = Stored::of_numbers(self.all.get(last as u32));
        self.all.pop();
        Some(stored)
    }

    /// Exchanges the states in two places.
    pub(in crate::search) fn swap(&mut self, one: usize, other: usize) {
        let [one, other] = [one, other].map(|place| (self.first + place) as u32);
        let mut numbers = [0; 3];
        let numbers = &mut numbers[..self.all.size()];
        numbers.copy_from_slice(self.all.get(one));
        for part in 0..numbers.len() {
            self.all.get_mut(one)[part] = self.all.get(other)[part];
        }
        self.all.get_mut(other).copy_from_slice(numbers);
    }
}

impl Extend<Stored> for Queue {
    fn extend<T: IntoIterator<Item = Stored>>(&mut self, states: T) {
        states.into_iter().for_each(|stored| self.push(stored));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::fs;

    use super::super::disk::{Disk, test_place};
    use super::*;

    #[test]
    fn states_leave_in_order_also_from_disk() {
        let place = test_place("queue");
        let disk = Disk::new(&place, Some(1 << 20)).expect("there is room");
        for has_zones in [false, true] {
            let (mut queue, mut known) = (Queue::new(has_zones), VecDeque::new());
            let state = |number: u32| {
                let numbers = [number, number, number / 3];
                Stored::of_numbers(if has_zones { &numbers } else { &numbers[..1] })
            };
            for number in 0..400_000 {
                queue.push(state(number));
                known.push_back(number);
                let count = queue.len();
                match number % 8 {
                    0 => assert_eq!(queue.pop_front().map(|one| one.node), known.pop_front()),
                    1 => assert_eq!(queue.pop_back().map(|one| one.node), known.pop_back()),
                    2 => {
                        queue.swap(count / 2, count - 1);
                        known.swap(count / 2, count - 1);
                    }
                    _ => {}
                }
                if number % 50_000 == 49_999 {
                    queue.cold().spill(&disk).expect("there is room");
                }
            }
            assert!(queue.bytes() < 4 * known.len());
            while let Some(number) = known.pop_front() {
                let stored = queue.pop_front().map(Stored::numbers);
                assert_eq!(stored, Some(state(number).numbers()));
            }
            assert!(queue.pop_front().is_none() && queue.pop_back().is_none());
            assert_eq!((queue.len(), queue.bytes()), (0, 0));
        }
        drop(disk);
        fs::remove_dir(place).expect("it is empty");
    }
}
