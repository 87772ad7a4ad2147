//! The making of a shield: all cells are sampled, and the greatest fixed point is taken.

use std::cell::RefCell;
use std::sync::Arc;

use super::fixed_point::{BYTES_OF_CELL, Game};
use super::grid::Grid;
use super::options::{Manner, Outside, Sampling};
use super::steps::{CellSteps, LeftCell, Sampler};
use super::strategy::{Places, Shield};
use crate::cancellation;
use crate::ir;
use crate::search::limits::{Counters, StopReason};
use crate::stochastic::{
    Behaviour, ControllerMove, Failure, RunId, Runner, Scouts, StepEnd, runs_by,
};

/// The numbers of the runs that begin at the beginning, and of those from the first cell: no query
/// for runs under the shield makes them again.
const BEGINNING: u64 = 1 << 40;
const CELLS: u64 = 1 << 42;
/// How many there are at least.
const BEGINNINGS: u64 = 100;
/// What it takes to look at a sample: see [`cancellation::work`].
const UNITS_FOR_SAMPLE: usize = 32;

/// What is known of a shield.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// How many cells its grid has.
    pub cells: u64,
    /// How many of them are safe.
    pub safe_cells: u64,
    /// In how many cells some sample has a choice.
    pub seen_cells: u64,
    /// Of cells whose samples have what must be kept: the pairs with a move that none of the
    /// samples enabled.
    pub unseen_pairs: u64,
    /// How many runs were stuck.
    pub stuck: u64,
}

/// What the making of a shield came to.
#[derive(Clone, Debug)]
pub enum Made {
    /// There is a shield.
    Shield {
        /// The shield.
        shield: Arc<Shield>,
        /// What is known of it.
        facts: Facts,
        /// Whether all first choices of runs of the model lie in safe cells.
        holds: bool,
    },
    /// A run left the grid, where that is an error.
    Left(Left),
    /// A limit came first; `None` if the user or time did.
    Cut(Option<StopReason>),
}

/// A run that left the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Left {
    /// Where it began, along the axes.
    pub from: Vec<f64>,
    /// The move that it began with; none if it is the beginning of a run of the model.
    pub by: Option<ir::Part>,
    /// Where it was when the controller had a choice again.
    pub to: Vec<f64>,
}

/// Makes a shield; `look` may end that.
///
/// # Errors
/// A run failed.
pub fn shield(
    behaviour: Behaviour<'_>,
    asked: &ir::Shield,
    sampling: Sampling,
    manner: Manner,
    mut look: impl FnMut(&Counters) -> Option<StopReason>,
) -> Result<Made, Failure> {
    let behaviour = Behaviour {
        guidance: Some(&Scouts),
        ..behaviour
    };
    let mut runners = Runner::several(behaviour, manner.threads);
    let moves = runners[0].moves_of_controller();
    let grid = Grid {
        axes: asked.axes.clone(),
    };
    let sampler = Sampler {
        sampling: Sampling {
            outside: outside(&mut runners[0], &grid, asked, sampling.outside)?,
            ..sampling
        },
        grid: &grid,
        keep: &asked.keep,
        places: &Places::new(&moves),
    };
    let found = match sampled(&mut runners, &sampler, moves.len(), manner.seed, &mut look)? {
        Sampled::All(found) => found,
        Sampled::Left(left) => return Ok(Made::Left(of_moves(left, &moves))),
        Sampled::Cut(reason) => return Ok(Made::Cut(reason)),
    };
    let mut facts = found.facts;
    let shield = Shield {
        allowed: found.game.solve(),
        moves: moves.iter().map(|one| one.part).collect(),
        grid: grid.clone(),
    };
    facts.safe_cells = shield.safe_cells();
    let begins = begins_safely(&mut runners[0], &sampler, &shield, manner.seed)?;
    Ok(match begins {
        Err(left) => Made::Left(of_moves(left, &moves)),
        Ok(holds) => Made::Shield {
            shield: Arc::new(shield),
            facts,
            holds,
        },
    })
}

/// What the samples of all cells came to.
enum Sampled {
    All(Box<Found>),
    Left(LeftCell),
    Cut(Option<StopReason>),
}

/// Samples all cells.
fn sampled(
    runners: &mut [Runner<'_>],
    sampler: &Sampler<'_>,
    moves: usize,
    seed: u64,
    look: &mut dyn FnMut(&Counters) -> Option<StopReason>,
) -> Result<Sampled, Failure> {
    let cells = sampler.grid.cells();
    let found = RefCell::new(Found::new(cells, moves));
    let mut stop = None;
    let is_whole = runs_by(
        runners,
        0..cells,
        |runner, cell| {
            let run = CELLS + cell;
            runner.begin_steps(RunId { seed, run })?;
            sampler.look(runner, cell as u32)
        },
        |steps| found.borrow_mut().add(steps),
        |_| {
            let found = found.borrow();
            stop = look(&found.counters());
            stop.is_some() || found.left.is_some()
        },
    )?;
    let mut found = found.into_inner();
    let stop = stop.or_else(|| look(&found.counters()));
    Ok(match found.left.take() {
        Some(left) => Sampled::Left(left),
        None if is_whole && stop.is_none() => Sampled::All(Box::new(found)),
        None => Sampled::Cut(stop),
    })
}

/// What is known of the cells that were sampled.
struct Found {
    game: Game,
    facts: Facts,
    /// All moves, as bits.
    moves: u64,
    left: Option<LeftCell>,
}

impl Found {
    fn new(cells: u64, moves: usize) -> Found {
        cancellation::ask_for((cells * BYTES_OF_CELL) as usize);
        Found {
            game: Game::new(cells as usize),
            facts: Facts {
                cells,
                ..Facts::default()
            },
            moves: if moves == 0 {
                1
            } else {
                u64::MAX >> (64 - moves)
            },
            left: None,
        }
    }

    fn add(&mut self, steps: CellSteps) {
        self.game.add(&steps, self.moves);
        let facts = &mut self.facts;
        let seen = steps.choices.iter().fold(0, |all, one| all | one);
        facts.seen_cells += u64::from(seen != 0);
        facts.stuck += steps.stuck;
        if steps.keeps {
            facts.unseen_pairs += u64::from((self.moves & !seen).count_ones());
        }
        self.left = self.left.take().or(steps.left);
    }

    fn counters(&self) -> Counters {
        let done = self.game.cells() as u64;
        Counters {
            explored: done,
            stored: done,
            waiting: self.facts.cells - done,
            bytes: self.game.bytes(),
        }
    }
}

/// What counts where a run leaves the grid: of samples outside, whether they have what must be
/// kept.
fn outside(
    runner: &mut Runner<'_>,
    grid: &Grid,
    asked: &ir::Shield,
    wanted: Outside,
) -> Result<Outside, Failure> {
    if wanted != Outside::Sampled {
        return Ok(wanted);
    }
    for number in 0..grid.samples_outside() {
        cancellation::work(UNITS_FOR_SAMPLE);
        let Some(sample) = grid.sample_outside(number) else {
            continue;
        };
        runner.stand(|words| grid.put(&sample, words))?;
        if !runner.keeps(&asked.keep)? {
            return Ok(Outside::Unsafe);
        }
    }
    Ok(Outside::Safe)
}

/// Whether runs of the model come to their first choices in safe cells, with nothing broken before;
/// or the first that leaves the grid, where that is an error.
fn begins_safely(
    runner: &mut Runner<'_>,
    sampler: &Sampler<'_>,
    shield: &Shield,
    seed: u64,
) -> Result<Result<bool, LeftCell>, Failure> {
    let count = u64::from(sampler.sampling.repeats).max(BEGINNINGS);
    for run in BEGINNING..BEGINNING + count {
        runner.begin_steps(RunId { seed, run })?;
        match runner.step(None, sampler.keep)? {
            StepEnd::Never => continue,
            StepEnd::Broken | StepEnd::Stuck => return Ok(Ok(false)),
            StepEnd::Choice => {}
        }
        let is_safe = match shield.grid.cell_of(&runner.view()) {
            Some(cell) => shield.allowed[cell as usize] != 0,
            None if sampler.sampling.outside == Outside::Error => {
                return Ok(Err(LeftCell {
                    from: Vec::new(),
                    by: None,
                    to: shield.grid.values_of(&runner.view()),
                }));
            }
            None => sampler.sampling.outside == Outside::Safe,
        };
        if !is_safe {
            return Ok(Ok(false));
        }
    }
    Ok(Ok(true))
}

fn of_moves(left: LeftCell, moves: &[ControllerMove]) -> Left {
    let by = left
        .by
        .and_then(|by| moves.iter().find(|one| one.number == by));
    Left {
        from: left.from,
        by: by.map(|one| one.part),
        to: left.to,
    }
}
