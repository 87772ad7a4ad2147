//! Somebody else decides for the controller: a policy that was not learned here.
//!
//! It sees the values that a learned strategy with the same features sees, and its actions have the
//! same numbers. An action that is not possible is replaced by one of those that are, drawn with
//! equal chances from the random numbers of the run.

use std::sync::Arc;

use super::observation::number;
use crate::ir::Observation;
use crate::stochastic::{Chooser, Chosen, ControllerMove, Failure, Guidance, Moment, StateView};

/// What a policy is asked about.
#[derive(Clone, Copy, Debug)]
pub struct Situation<'s> {
    /// What it sees: the exact values, then those in intervals.
    pub values: &'s [f64],
    /// For each action whether it is possible; the last one is to wait.
    pub possible: &'s [bool],
    /// How long the run has lasted.
    pub time: f64,
}

/// Decides from outside.
pub trait Policy: Send + Sync {
    /// The number of an action.
    ///
    /// # Errors
    /// [`Failure::NoDecision`], or why the value of the run is not known.
    fn decide(&self, state: &mut StateView<'_>, situation: Situation<'_>)
    -> Result<usize, Failure>;

    /// Why it has not decided the last time.
    fn failure(&self) -> String;
}

/// A policy with what it sees.
#[derive(Clone)]
pub struct SeeingPolicy {
    /// What it sees.
    pub observation: Arc<Observation>,
    /// If it sees clocks: for how long it waits at most, until it is asked again.
    pub wait: f64,
    /// Who decides.
    pub policy: Arc<dyn Policy>,
}

impl std::fmt::Debug for SeeingPolicy {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut shown = formatter.debug_struct("SeeingPolicy");
        shown.field("observation", &self.observation);
        shown.field("wait", &self.wait);
        shown.finish_non_exhaustive()
    }
}

impl SeeingPolicy {
    /// The same, prepared to be followed in a model in which the controller may make these moves.
    pub fn followed(self: &Arc<Self>, moves: &[ControllerMove]) -> Asking {
        Asking {
            policy: Arc::clone(self),
            numbers: moves.iter().map(|one| one.number).collect(),
        }
    }
}

/// The values that are seen of a state: the exact ones, then those in intervals.
///
/// # Errors
/// The code of a feature failed, or left no finite number.
pub fn seen_values(
    observation: &Observation,
    state: &mut StateView<'_>,
) -> Result<Vec<f64>, Failure> {
    let features = observation.discrete.iter().chain(&observation.continuous);
    features.map(|feature| number(feature, state)).collect()
}

/// Asks a policy.
#[derive(Clone, Debug)]
pub struct Asking {
    policy: Arc<SeeingPolicy>,
    /// By action: the number of the move.
    numbers: Arc<[u32]>,
}

impl Guidance for Asking {
    fn chooser(&self) -> Box<dyn Chooser> {
        Box::new(Asker(self.clone()))
    }

    fn can_begin_anew(&self) -> bool {
        // It may remember what it was asked.
        false
    }
}

struct Asker(Asking);

impl Chooser for Asker {
    fn sees_time(&self) -> bool {
        self.0.policy.observation.has_clocks()
    }

    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        let Asking { policy, numbers } = &self.0;
        let values = seen_values(&policy.observation, state)?;
        let mut possible: Vec<bool> = numbers
            .iter()
            .map(|number| moment.moves.contains(number))
            .collect();
        possible.push(moment.may_wait);
        let situation = Situation {
            values: &values,
            possible: &possible,
            time: moment.time,
        };
        let action = policy.policy.decide(state, situation)?;
        let count = moment.moves.len();
        let place = if possible.get(action) == Some(&true) {
            let number = numbers.get(action);
            let place = number.and_then(|number| moment.moves.iter().position(|one| one == number));
            place.unwrap_or(count)
        } else {
            let all = count as u32 + u32::from(moment.may_wait);
            state.stream().below(all) as usize
        };
        Ok(if place < count {
            Chosen::Move(place)
        } else {
            Chosen::Wait(policy.wait)
        })
    }
}
