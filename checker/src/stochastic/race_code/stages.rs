//! When runs are made by code: once they have taken so long that writing and compiling it pays.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::runs::{RaceCode, WrittenRace};
use super::watching::Watched;
use crate::exec::Executor;
use crate::ir::RunBound;
use crate::stochastic::control::Control;
use crate::stochastic::observer::Outcome;
use crate::stochastic::program::Program;
use crate::stochastic::run_id::RunId;

/// The moves before it is looked at whether there is code for a race.
const MOVES_BEFORE_WRITING: u64 = 20_000;
/// The moves for each instruction that is to be compiled, which take about as long.
const MOVES_OF_AN_INSTRUCTION: u64 = 10;
/// The runs after which code is dropped that gives up one run in [`FEW`].
const ENOUGH_RUNS: u64 = 64;
const FEW: u64 = 4;

/// Makes runs by code as soon as that pays.
pub(in crate::stochastic) struct Stages {
    stage: Stage,
    /// What the code watches.
    watched: Option<Watched>,
    /// Whether who decides for the controller sees clocks, if anybody does.
    sees_time: Option<bool>,
    /// How many moves were made without code, by all threads.
    moves: Arc<AtomicU64>,
}

enum Stage {
    Waiting,
    Written(Box<WrittenRace>),
    Ready {
        code: Box<RaceCode>,
        runs: u64,
        given_up: u64,
    },
    Without,
}

impl Stages {
    /// `sees_time` says of who decides for the controller, if anybody does, whether it sees clocks.
    pub(in crate::stochastic) fn new(executor: &dyn Executor, sees_time: Option<bool>) -> Stages {
        Stages {
            stage: if executor.compiles_runs() {
                Stage::Waiting
            } else {
                Stage::Without
            },
            watched: None,
            sees_time,
            moves: Arc::default(),
        }
    }

    /// Those of another thread, which counts with this one.
    pub(in crate::stochastic) fn of_another(&self, executor: &dyn Executor) -> Stages {
        Stages {
            moves: Arc::clone(&self.moves),
            ..Stages::new(executor, self.sees_time)
        }
    }

    /// Writes the code now, and makes all runs with it that it can make. Returns whether there is
    /// any.
    pub(in crate::stochastic) fn begin(
        &mut self,
        program: &Program<'_>,
        executor: &dyn Executor,
        watched: Watched,
    ) -> bool {
        self.watched = Some(watched);
        let written = WrittenRace::of(program, &watched, self.sees_time);
        self.stage = match written.and_then(|written| written.prepare(program, executor)) {
            None => Stage::Without,
            Some(code) => Stage::ready(code),
        };
        matches!(self.stage, Stage::Ready { .. })
    }

    /// Makes a run by code; `None` if it must be made in another way.
    pub(in crate::stochastic) fn run(
        &mut self,
        program: &Program<'_>,
        executor: &dyn Executor,
        watched: Watched,
        id: RunId,
        bound: &RunBound,
        control: Option<&mut Control>,
    ) -> Option<Outcome> {
        self.go_on(program, executor, watched);
        if self.watched != Some(watched) {
            return None;
        }
        let Stage::Ready {
            code,
            runs,
            given_up,
        } = &mut self.stage
        else {
            return None;
        };
        *runs += 1;
        let outcome = code.run(program, executor, id, bound, control);
        if outcome.is_none() {
            *given_up += 1;
            if *runs >= ENOUGH_RUNS && *given_up > *runs / FEW {
                self.stage = Stage::Without;
            }
        }
        outcome
    }

    /// Writes or compiles the code if it is time to do so.
    fn go_on(&mut self, program: &Program<'_>, executor: &dyn Executor, watched: Watched) {
        let moves = self.moves.load(Ordering::Relaxed);
        if matches!(self.stage, Stage::Waiting) && moves >= MOVES_BEFORE_WRITING {
            self.watched = Some(watched);
            self.stage = match WrittenRace::of(program, &watched, self.sees_time) {
                None => Stage::Without,
                Some(written) => Stage::Written(Box::new(written)),
            };
        }
        let is_due =
            |written: &WrittenRace| moves >= MOVES_OF_AN_INSTRUCTION * written.instructions as u64;
        if matches!(&self.stage, Stage::Written(written) if is_due(written))
            && let Stage::Written(written) = std::mem::replace(&mut self.stage, Stage::Without)
            && let Some(code) = written.prepare(program, executor)
        {
            self.stage = Stage::ready(code);
        }
    }

    /// How many runs were made by code.
    pub(in crate::stochastic) fn runs(&self) -> u64 {
        match self.stage {
            Stage::Ready { runs, given_up, .. } => runs - given_up,
            _ => 0,
        }
    }

    /// Counts the moves of a run that was made without code.
    pub(in crate::stochastic) fn count(&mut self, moves: u64) {
        self.moves.fetch_add(moves, Ordering::Relaxed);
    }
}

impl Stage {
    fn ready(code: RaceCode) -> Stage {
        Stage::Ready {
            code: Box::new(code),
            runs: 0,
            given_up: 0,
        }
    }
}
