//! Importance splitting of the runs of a network: the level is an expression of the state, looked
//! at in every state that a run enters.

use super::behaviour::Behaviour;
use super::failure::Failure;
use super::in_order::in_order;
use super::observer::watched;
use super::precision::{Estimate, Precision};
use super::race::Race;
use super::run::Runner;
use super::run_id::RunId;
use super::run_watch::Ends;
use super::splitting::{End, Part, Parts, pilot, repetition};
use super::statistics::{Expectation, Interval, Method};
use crate::ir::{FunctionId, Path, RunBound};

/// How a rare event is looked for.
#[derive(Clone, Copy, Debug)]
pub struct Splitting {
    /// Leaves the level of a state as a double.
    pub level: FunctionId,
    /// How many parts of runs each stage has; less than [`super::MOST_EFFORT`].
    pub effort: u64,
    /// How many independent repetitions the interval is made of, at least 2.
    pub repetitions: u64,
}

/// What splitting found.
#[derive(Clone, Debug, PartialEq)]
pub struct Rare {
    /// The estimate.
    pub estimate: Estimate,
    /// The thresholds of the levels.
    pub thresholds: Vec<f64>,
    /// Whether any repetition reached the event.
    pub has_reached: bool,
}

/// Estimates the probability of `<> p` or `p U q`; `ends` is asked now and then, with the number of
/// repetitions so far.
///
/// # Errors
/// A part of a run failed.
pub fn estimate_rare(
    behaviour: Behaviour<'_>,
    bound: &RunBound,
    path: &Path,
    splitting: &Splitting,
    precision: &Precision,
    ends: impl FnMut(u64) -> bool,
) -> Result<Rare, Failure> {
    let seed = precision.seed;
    let level = splitting.level;
    let mut runner = Runner::of(behaviour);
    let mut parts = RunParts {
        runner: &mut runner,
        seed,
        bound,
        path,
        level,
    };
    let found = pilot(&mut parts, seed, splitting.effort)?;
    let mut mean = Expectation::default();
    let mut made = found.parts;
    let is_complete = in_order(
        behaviour,
        precision.threads,
        |runner, number| {
            let mut parts = RunParts {
                runner,
                seed,
                bound,
                path,
                level,
            };
            // The pilot has the number 0.
            let number = number + 1;
            repetition(
                &mut parts,
                &found.thresholds,
                splitting.effort,
                seed,
                number,
            )
        },
        |(value, parts)| {
            mean.push(value);
            made += parts;
            mean.count() >= splitting.repetitions
        },
        &mut Ends(ends),
    )?;
    let has_reached = mean.mean() > 0.0;
    let unknown = Interval {
        lower: 0.0,
        upper: 1.0,
    };
    let interval = mean
        .student_of_logarithm(precision.alpha)
        .unwrap_or(unknown);
    Ok(Rare {
        estimate: Estimate {
            value: mean.mean(),
            lower: interval.lower,
            upper: interval.upper.min(1.0),
            confidence: 1.0 - precision.alpha,
            method: Method::ImportanceSplitting,
            runs: made,
            satisfied_runs: None,
            decision: None,
            compared: None,
            is_complete,
        },
        thresholds: found.thresholds,
        has_reached,
    })
}

/// A run that was stopped, with all that is needed to go on.
struct Halt {
    words: Vec<i32>,
    time: f64,
    moves: u64,
}

impl Halt {
    fn of(race: &Race<'_>) -> Halt {
        Halt {
            words: race.machine.words().to_vec(),
            time: race.time,
            moves: race.moves,
        }
    }

    /// Lets a runner go back to this state, with random numbers of its own.
    fn resume(&self, runner: &mut Runner<'_>, seed: u64, numbers: u64) -> Result<(), Failure> {
        let race = &mut runner.race;
        race.machine.restore(&self.words);
        race.machine.start_stream(seed, numbers);
        race.time = self.time;
        race.moves = self.moves;
        race.resume(&runner.program)
    }
}

/// Parts of the runs of a network.
struct RunParts<'r, 'a> {
    runner: &'r mut Runner<'a>,
    seed: u64,
    bound: &'r RunBound,
    path: &'r Path,
    level: FunctionId,
}

impl Parts for RunParts<'_, '_> {
    type State = Halt;
    type Failure = Failure;

    fn part(
        &mut self,
        from: Option<&Halt>,
        threshold: f64,
        numbers: u64,
    ) -> Result<Part<Halt>, Failure> {
        match from {
            None => {
                let Runner { program, race, .. } = &mut *self.runner;
                race.start(
                    program,
                    RunId {
                        seed: self.seed,
                        run: numbers,
                    },
                )?;
            }
            Some(halt) => halt.resume(self.runner, self.seed, numbers)?,
        }
        let mut part = Part {
            end: End::Nothing,
            highest: f64::NEG_INFINITY,
        };
        let (level, path) = (self.level, self.path);
        self.runner.go_on(self.bound, &mut |race, delay| {
            let level = race.machine.real(level, &[])?;
            part.highest = part.highest.max(level);
            if level >= threshold {
                part.end = End::Threshold(Halt::of(race));
                return Ok(true);
            }
            let decided = watched(race, path, delay)?;
            if let Some((true, _)) = decided {
                part.end = End::Event;
            }
            Ok(decided.is_some())
        })?;
        Ok(part)
    }
}
