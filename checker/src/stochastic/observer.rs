//! What is seen of a run, for one thing that is asked of it.

use super::condition::Condition;
use super::constants::MOST_CHANGES;
use super::extreme::Extreme;
use super::failure::Failure;
use super::machine::Mask;
use super::mitl::Watch;
use super::program::Program;
use super::race::Race;
use crate::ir::{Aim, Asked, Optimum, Path};

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// The extreme value that was asked for; or 1 if the run has what a path says, and else 0.
    pub value: f64,
    /// When that was decided, in units of the model.
    pub time: f64,
    /// How many moves it took.
    pub moves: u64,
    /// What bounds the run, when that was decided: its time, the value of a clock, or its moves.
    pub at: f64,
}

/// Looks at the states of a run.
pub(super) enum Observer<'q> {
    /// No formula with operators over time.
    Path(&'q Path),
    Formula(Watch<'q>),
    Extreme {
        extreme: Extreme,
        /// Whether the value may change as time passes.
        is_timed: bool,
    },
    End(&'q Optimum),
}

impl<'q> Observer<'q> {
    pub(super) fn new(program: &Program<'_>, asked: Asked<'q>) -> Observer<'q> {
        match asked {
            Asked::Path(Path::Formula(formula)) => Observer::Formula(Watch::new(formula)),
            Asked::Path(path) => Observer::Path(path),
            Asked::Extreme(value, maximum) => Observer::Extreme {
                extreme: Extreme::new(value, maximum),
                is_timed: program.is_timed(value),
            },
            Asked::End(optimum) => Observer::End(optimum),
        }
    }

    /// Looks at a state and the delay that follows it. Returns whether the run has what is asked,
    /// and after which time, if that is decided.
    pub(super) fn look(
        &mut self,
        race: &mut Race<'_>,
        delay: f64,
    ) -> Result<Option<(bool, f64)>, Failure> {
        match self {
            Observer::Path(path) => watched(race, path, delay),
            Observer::Formula(watch) => watch.state(race, delay),
            Observer::Extreme { extreme, is_timed } => {
                extreme.look(&mut race.machine)?;
                if *is_timed && delay > 0.0 && delay.is_finite() {
                    extreme.look_through(race, delay)?;
                }
                Ok(None)
            }
            Observer::End(optimum) => match &optimum.goal {
                Some(goal) => watched(race, goal, delay),
                None => Ok(None),
            },
        }
    }

    /// The result of a run that was decided so much later than its state says.
    pub(super) fn decided(
        &self,
        race: &mut Race<'_>,
        satisfied: bool,
        ahead: f64,
    ) -> Result<f64, Failure> {
        match self {
            Observer::End(optimum) => aim_of(race, optimum.aim, satisfied, ahead),
            _ => Ok(f64::from(satisfied)),
        }
    }

    /// The result of a run that ends at its bound before anything is decided: its value, or 1 if it
    /// has what is asked and else 0.
    pub(super) fn finish(&mut self, race: &mut Race<'_>) -> Result<f64, Failure> {
        Ok(match self {
            Observer::Path(path) => f64::from(matches!(path, Path::Always(_))),
            Observer::Formula(watch) => f64::from(watch.finish()),
            Observer::Extreme { extreme, .. } => {
                extreme.look(&mut race.machine)?;
                extreme.value()
            }
            Observer::End(optimum) => aim_of(race, optimum.aim, false, 0.0)?,
        })
    }
}

/// What a run is worth that ends so much later than its state says.
pub(super) fn aim_of(
    race: &mut Race<'_>,
    aim: Aim,
    satisfied: bool,
    ahead: f64,
) -> Result<f64, Failure> {
    Ok(match aim {
        Aim::Probability => f64::from(satisfied),
        Aim::Time => race.time + ahead,
        Aim::Expected(value) => race.look_ahead(ahead, |machine| machine.real(value, &[]))?,
    })
}

/// Whether a path is decided by the state or within the delay behind it, and after which time.
pub(super) fn watched(
    race: &mut Race<'_>,
    path: &Path,
    delay: f64,
) -> Result<Option<(bool, f64)>, Failure> {
    let mut ahead = 0.0;
    for _ in 0..MOST_CHANGES {
        let (keep, reach) = match path {
            Path::Eventually(goal) => (
                Mask::constant(true),
                race.mask(Condition::of(goal), ahead, delay)?,
            ),
            Path::Always(keep) => (
                race.mask(Condition::of(keep), ahead, delay)?,
                Mask::constant(false),
            ),
            Path::Until(keep, goal) => (
                race.mask(Condition::of(keep), ahead, delay)?,
                race.mask(Condition::of(goal), ahead, delay)?,
            ),
            Path::Formula(_) => unreachable!("formulas have a watch of their own"),
        };
        if reach.now || !keep.now {
            return Ok(Some((reach.now, ahead)));
        }
        let is_inside = ahead < delay;
        if is_inside && (reach.behind || !keep.behind) {
            return Ok(Some((reach.behind, ahead)));
        }
        let horizon = reach.horizon.min(keep.horizon);
        let next = ahead + horizon;
        if !is_inside || next.is_infinite() || next > delay || next <= ahead {
            return Ok(None);
        }
        ahead = next;
    }
    Ok(None)
}
