//! What may come next from a cell, as far as its samples show.

use super::grid::Grid;
use super::options::{Outside, Sampling};
use super::strategy::Places;
use crate::ir::Path;
use crate::stochastic::{Failure, Runner, StepEnd};

/// What the samples of a cell show.
#[derive(Clone, Debug, Default)]
pub(super) struct CellSteps {
    /// Whether all of them have what must be kept.
    pub(super) keeps: bool,
    /// The moves that are enabled together where there is a choice, as bits; each once.
    pub(super) choices: Vec<u64>,
    /// The moves after which something was broken.
    pub(super) broken: u64,
    /// By move that is enabled somewhere and breaks nothing: where it leads, ascending.
    pub(super) leads: Vec<(u32, Vec<u32>)>,
    /// How many runs were stuck; they count as if something was broken.
    pub(super) stuck: u64,
    /// The first run that left the grid, where that is an error.
    pub(super) left: Option<LeftCell>,
}

/// A run that left the grid.
#[derive(Clone, Debug)]
pub(super) struct LeftCell {
    /// Where it began, along the axes.
    pub(super) from: Vec<f64>,
    /// The move that it began with; none if it is the beginning of a run of the model.
    pub(super) by: Option<u32>,
    /// Where it was when the controller had a choice again.
    pub(super) to: Vec<f64>,
}

/// How cells are sampled.
pub(super) struct Sampler<'s> {
    pub(super) grid: &'s Grid,
    pub(super) keep: &'s Path,
    pub(super) sampling: Sampling,
    pub(super) places: &'s Places,
}

impl Sampler<'_> {
    /// Looks at the samples of a cell.
    pub(super) fn look(&self, runner: &mut Runner<'_>, cell: u32) -> Result<CellSteps, Failure> {
        let mut found = CellSteps {
            keeps: true,
            ..CellSteps::default()
        };
        let count = self.grid.samples(self.sampling.samples);
        for number in 0..count {
            let sample = self.grid.sample(cell, self.sampling.samples, number);
            runner.stand(|words| self.grid.put(&sample, words))?;
            if !runner.keeps(self.keep)? {
                // The cell is not safe, wherever its moves lead.
                return Ok(CellSteps::default());
            }
        }
        for number in 0..count {
            let sample = self.grid.sample(cell, self.sampling.samples, number);
            runner.stand(|words| self.grid.put(&sample, words))?;
            let moves = runner.enabled_moves()?;
            if moves.len() < 2 {
                continue;
            }
            let enabled = self.places.bits(&moves);
            if !found.choices.contains(&enabled) {
                found.choices.push(enabled);
            }
            for entry in moves {
                self.try_move(runner, &sample, entry, &mut found)?;
            }
        }
        let broken = found.broken;
        found.leads.retain(|(place, _)| broken >> place & 1 == 0);
        found.leads.sort_unstable_by_key(|(place, _)| *place);
        for (_, cells) in &mut found.leads {
            cells.sort_unstable();
            cells.dedup();
            cells.shrink_to_fit();
        }
        Ok(found)
    }

    /// Makes a move in a sample, as often as is wanted, and notes where it leads.
    fn try_move(
        &self,
        runner: &mut Runner<'_>,
        sample: &[f64],
        entry: u32,
        found: &mut CellSteps,
    ) -> Result<(), Failure> {
        let place = self.places.place(entry);
        let at = found.leads.iter().position(|(known, _)| *known == place);
        let at = at.unwrap_or_else(|| {
            found.leads.push((place, Vec::new()));
            found.leads.len() - 1
        });
        for _ in 0..self.sampling.repeats {
            if found.broken >> place & 1 == 1 {
                return Ok(());
            }
            runner.stand(|words| self.grid.put(sample, words))?;
            match runner.step(Some(entry), self.keep)? {
                StepEnd::Never => {}
                StepEnd::Broken => found.broken |= 1 << place,
                StepEnd::Stuck => {
                    found.stuck += 1;
                    found.broken |= 1 << place;
                }
                StepEnd::Choice => match self.grid.cell_of(&runner.view()) {
                    Some(cell) => found.leads[at].1.push(cell),
                    None if self.sampling.outside == Outside::Error => {
                        found.left.get_or_insert_with(|| LeftCell {
                            from: sample.to_vec(),
                            by: Some(entry),
                            to: self.grid.values_of(&runner.view()),
                        });
                    }
                    None if self.sampling.outside == Outside::Safe => {}
                    None => found.broken |= 1 << place,
                },
            }
        }
        Ok(())
    }
}
