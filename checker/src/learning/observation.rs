//! What a strategy sees of a state.

use crate::exec::arithmetic::double_words;
use crate::ir::{Feature, Observation, Seen};
use crate::stochastic::{Failure, StateView};

/// What is seen of a state: the exact values as words, and the values in intervals.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sight {
    /// Integers take one word, doubles two.
    pub(super) key: Vec<i32>,
    /// One number for each continuous feature.
    pub(super) point: Vec<f64>,
    /// How fast each of them changes as time passes, as far as that is known.
    pub(super) rates: Vec<f64>,
}

impl Sight {
    /// Sees a state.
    ///
    /// # Errors
    /// The code of a feature failed, or left no finite number.
    pub(super) fn look(
        &mut self,
        observation: &Observation,
        state: &mut StateView<'_>,
    ) -> Result<(), Failure> {
        self.look_exactly(observation, state)?;
        self.look_at_point(observation, state)
    }

    /// Sees the exact values.
    pub(super) fn look_exactly(
        &mut self,
        observation: &Observation,
        state: &mut StateView<'_>,
    ) -> Result<(), Failure> {
        self.key.clear();
        for feature in &observation.discrete {
            match feature.seen {
                Seen::Location(process) => self.key.push(state.location(process).0 as i32),
                Seen::Integer(word) => self.key.push(state.integer(word)),
                _ => {
                    // Both zeros are the same.
                    let value = number(feature, state)? + 0.0;
                    self.key.extend(double_words(value));
                }
            }
        }
        Ok(())
    }

    /// Sees the values in intervals.
    pub(super) fn look_at_point(
        &mut self,
        observation: &Observation,
        state: &mut StateView<'_>,
    ) -> Result<(), Failure> {
        self.point.clear();
        for feature in &observation.continuous {
            self.point.push(number(feature, state)?);
        }
        Ok(())
    }

    /// Finds how fast the continuous features change. Returns whether any does.
    pub(super) fn look_at_rates(
        &mut self,
        observation: &Observation,
        state: &StateView<'_>,
    ) -> bool {
        let rates = observation.continuous.iter().map(|one| rate(one, state));
        self.rates.clear();
        self.rates.extend(rates);
        self.rates.iter().any(|&rate| rate != 0.0)
    }
}

/// The number that a feature is.
pub(super) fn number(feature: &Feature, state: &mut StateView<'_>) -> Result<f64, Failure> {
    let value = match feature.seen {
        Seen::Location(process) => f64::from(state.location(process).0),
        Seen::Integer(word) => f64::from(state.integer(word)),
        Seen::Double(word) | Seen::Clock(word) => state.double(word),
        Seen::Computed(function) => state.real(function)?,
    };
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Failure::NoNumber)
    }
}

fn rate(feature: &Feature, state: &StateView<'_>) -> f64 {
    match feature.seen {
        Seen::Clock(clock) => state.rate(clock),
        _ => 0.0,
    }
}
