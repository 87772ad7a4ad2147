//! The greatest set of cells in which the controller can stay.

use super::steps::CellSteps;
use crate::cancellation;

/// What it takes to look at a cell: see [`cancellation::work`].
const UNITS_FOR_CELL: usize = 8;

/// How many bytes a cell takes at least, until all are known and when they are looked at.
pub const BYTES_OF_CELL: u64 = 25;

/// What is known of all cells, in flat arrays.
#[derive(Debug, Default)]
pub(super) struct Game {
    /// By cell: the moves that are allowed, as far as is known.
    allowed: Vec<u64>,
    /// By cell: whether it is safe, as far as is known.
    safe: Vec<bool>,
    /// The moves that are enabled together; those of a cell end here.
    choices: Vec<u64>,
    choice_ends: Vec<u64>,
    /// Moves with the ends of the cells that they lead to; those of a cell end here.
    leads: Vec<(u8, u64)>,
    lead_ends: Vec<u64>,
    cells: Vec<u32>,
}

impl Game {
    /// Without cells; there will be so many.
    pub(super) fn new(count: usize) -> Game {
        Game {
            allowed: Vec::with_capacity(count),
            safe: Vec::with_capacity(count),
            choice_ends: Vec::with_capacity(count),
            lead_ends: Vec::with_capacity(count),
            ..Game::default()
        }
    }

    /// Adds the next cell; the moves are these bits.
    pub(super) fn add(&mut self, steps: &CellSteps, moves: u64) {
        self.safe.push(steps.keeps);
        let allowed = if steps.keeps {
            moves & !steps.broken
        } else {
            0
        };
        self.allowed.push(allowed);
        self.choices.extend_from_slice(&steps.choices);
        self.choice_ends.push(self.choices.len() as u64);
        for (place, cells) in &steps.leads {
            self.cells.extend_from_slice(cells);
            self.leads.push((*place as u8, self.cells.len() as u64));
        }
        self.lead_ends.push(self.leads.len() as u64);
    }

    /// How many cells were added.
    pub(super) fn cells(&self) -> usize {
        self.safe.len()
    }

    /// How many bytes all takes.
    pub(super) fn bytes(&self) -> u64 {
        let cells = self.safe.capacity() as u64 * BYTES_OF_CELL;
        let words = self.choices.capacity() * 8 + self.leads.capacity() * 16;
        cells + words as u64 + self.cells.capacity() as u64 * 4
    }

    /// Finds the greatest fixed point; gives the moves that are allowed in each cell.
    pub(super) fn solve(mut self) -> Vec<u64> {
        let mut forwards = true;
        while self.sweep(forwards) {
            forwards = !forwards;
        }
        self.allowed
    }

    /// Looks at all cells once, in one direction or the other; returns whether something changed.
    fn sweep(&mut self, forwards: bool) -> bool {
        let count = self.safe.len();
        let mut has_changed = false;
        for number in 0..count {
            let cell = if forwards { number } else { count - 1 - number };
            if self.safe[cell] {
                has_changed |= self.look(cell);
                cancellation::work(UNITS_FOR_CELL);
            }
        }
        has_changed
    }

    /// Looks at a safe cell; returns whether something changed.
    fn look(&mut self, cell: usize) -> bool {
        let first = |ends: &[u64]| cell.checked_sub(1).map_or(0, |before| ends[before]) as usize;
        let before = self.allowed[cell];
        let leads = first(&self.lead_ends)..self.lead_ends[cell] as usize;
        for lead in leads {
            let (place, end) = self.leads[lead];
            let start = lead.checked_sub(1).map_or(0, |before| self.leads[before].1);
            let bit = 1 << place;
            if self.allowed[cell] & bit == 0 {
                continue;
            }
            let mut cells = self.cells[start as usize..end as usize].iter();
            if cells.any(|&one| !self.safe[one as usize]) {
                self.allowed[cell] &= !bit;
            }
        }
        let allowed = self.allowed[cell];
        let choices = first(&self.choice_ends)..self.choice_ends[cell] as usize;
        let mut enabled = self.choices[choices].iter();
        if enabled.any(|together| together & allowed == 0) {
            self.safe[cell] = false;
            self.allowed[cell] = 0;
            return true;
        }
        allowed != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell whose moves lead to these cells, all of them enabled together.
    fn cell(leads: &[&[u32]]) -> CellSteps {
        let numbered = (0..).zip(leads);
        CellSteps {
            keeps: true,
            choices: vec![(1 << leads.len()) - 1],
            leads: numbered
                .map(|(place, cells)| (place, cells.to_vec()))
                .collect(),
            ..CellSteps::default()
        }
    }

    fn solved(cells: &[CellSteps], moves: u64) -> Vec<u64> {
        let mut game = Game::new(cells.len());
        for steps in cells {
            game.add(steps, moves);
        }
        game.solve()
    }

    #[test]
    fn what_leads_to_an_unsafe_cell_is_not_allowed() {
        let bad = CellSteps::default();
        let cells = [
            cell(&[&[1], &[3]]),
            cell(&[&[2], &[3]]),
            cell(&[&[0], &[1, 3]]),
            bad,
        ];
        assert_eq!(solved(&cells, 0b11), [0b01, 0b01, 0b01, 0]);
    }

    #[test]
    fn a_cell_that_must_be_left_for_an_unsafe_one_is_not_safe() {
        let cells = [
            cell(&[&[1], &[1]]),
            cell(&[&[2], &[2]]),
            CellSteps::default(),
            cell(&[&[3], &[0]]),
        ];
        assert_eq!(solved(&cells, 0b11), [0, 0, 0, 0b01]);
    }

    #[test]
    fn a_move_must_be_left_wherever_there_is_a_choice() {
        let broken = CellSteps {
            choices: vec![0b011, 0b110],
            broken: 0b010,
            ..cell(&[&[0], &[], &[0]])
        };
        let hopeless = CellSteps {
            broken: 0b110,
            ..broken.clone()
        };
        assert_eq!(solved(&[broken], 0b111), [0b101]);
        assert_eq!(solved(&[hopeless], 0b111), [0]);
    }

    #[test]
    fn where_nothing_was_seen_all_is_allowed() {
        let unseen = CellSteps {
            choices: Vec::new(),
            leads: Vec::new(),
            ..cell(&[])
        };
        assert_eq!(solved(&[unseen], 0b11), [0b11]);
    }
}
