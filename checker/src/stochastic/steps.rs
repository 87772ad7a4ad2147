//! Steps of a controller: from any state, one of its moves and all that happens behind it, until it
//! has a choice again.
//!
//! The controller has a *choice* at a decision at which several of its moves are enabled. Where a
//! single one is, it makes it. All else is what random runs do.

use super::constants::UNITS_FOR_MOVE;
use super::control::{Chooser, Chosen, Guidance, Moment, StateView};
use super::failure::Failure;
use super::observer::watched;
use super::run::Runner;
use super::run_id::RunId;
use crate::cancellation;
use crate::ir::Path;

/// After so many moves without a choice a step counts as one behind which there is none.
const MOST_MOVES: u64 = 100_000;

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepEnd {
    /// The controller has a choice again.
    Choice,
    /// What had to be kept was broken.
    Broken,
    /// It never has a choice again.
    Never,
    /// An invariant does not hold, or time cannot pass and nothing can happen.
    Stuck,
}

/// Makes those who stop where there is a choice.
pub struct Scouts;

/// Stops where there is a choice.
struct Scout {
    has_choice: bool,
}

impl Guidance for Scouts {
    fn chooser(&self) -> Box<dyn Chooser> {
        Box::new(Scout { has_choice: false })
    }
}

impl Chooser for Scout {
    fn renew(&mut self) {
        self.has_choice = false;
    }

    fn sees_time(&self) -> bool {
        false
    }

    fn choose(&mut self, _: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        self.has_choice = moment.moves.len() > 1;
        Ok(if self.has_choice {
            Chosen::Draw
        } else {
            Chosen::Move(0)
        })
    }
}

/// Runners that [`Scouts`] guide make steps.
impl Runner<'_> {
    /// Begins with the random numbers of a run; goes to the initial state.
    ///
    /// # Errors
    /// The code of the model failed.
    pub fn begin_steps(&mut self, id: RunId) -> Result<(), Failure> {
        self.race.start(&self.program, id)
    }

    /// Goes to the initial state with what is changed in its words. The random numbers go on.
    ///
    /// # Errors
    /// The code of the model failed.
    pub fn stand(&mut self, change: impl FnOnce(&mut [i32])) -> Result<(), Failure> {
        let race = &mut self.race;
        let stream = race.machine.stream_words();
        race.machine.restore(&self.program.network.initial);
        race.machine.set_stream(stream);
        change(race.machine.view_of_state().words);
        (race.time, race.moves) = (0.0, 0);
        race.resume(&self.program)?;
        race.plan_flows_last(&self.program);
        Ok(())
    }

    /// The state.
    pub fn view(&mut self) -> StateView<'_> {
        self.race.machine.view_of_state()
    }

    /// The moves of the controller that are enabled now, by their numbers.
    ///
    /// # Errors
    /// The code of the model failed.
    pub fn enabled_moves(&mut self) -> Result<Vec<u32>, Failure> {
        Ok(self.race.moves_of_controller(&self.program, 0)?.0)
    }

    /// Whether a state has what must be kept.
    ///
    /// # Errors
    /// The code of the model failed.
    pub fn keeps(&mut self, keep: &Path) -> Result<bool, Failure> {
        let broken = watched(&mut self.race, keep, 0.0)?;
        Ok(broken.is_none_or(|(holds, _)| holds))
    }

    /// Makes a move that is enabled, if one is given, and goes on until there is a choice.
    ///
    /// # Errors
    /// The run failed, otherwise than that it is stuck.
    pub fn step(&mut self, first: Option<u32>, keep: &Path) -> Result<StepEnd, Failure> {
        match self.stepped(first, keep) {
            Err(Failure::InvariantBroken(_) | Failure::TimeLock(_)) => Ok(StepEnd::Stuck),
            ended => ended,
        }
    }

    fn stepped(&mut self, first: Option<u32>, keep: &Path) -> Result<StepEnd, Failure> {
        if let Some(entry) = first {
            self.race.take_entry(&self.program, entry)?;
        }
        while self.race.moves < MOST_MOVES {
            let Runner { program, race, .. } = self;
            let next = race.next(program, f64::INFINITY)?;
            let delay = next.delay.max(0.0);
            if let Some((false, _)) = watched(race, keep, delay)? {
                return Ok(StepEnd::Broken);
            }
            let Some(winner) = next.winner else {
                return race.time_lock(next).map_or(Ok(StepEnd::Never), Err);
            };
            race.wait(delay)?;
            race.take(program, winner)?;
            cancellation::work(UNITS_FOR_MOVE);
            if self
                .chooser::<Scout>()
                .is_some_and(|scout| scout.has_choice)
            {
                return Ok(StepEnd::Choice);
            }
        }
        Ok(StepEnd::Never)
    }
}
