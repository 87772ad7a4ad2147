//! What can happen next in a state with exact clock values, and when: for simulating runs.
//!
//! While time passes, what is possible changes only at the moments of [`super::moments`]; so a move
//! is possible in whole windows between them, which are found by looking once into each.

use crate::ir::Network;

use super::concrete::Semantics;
use super::moments::Moments;
use super::moves::{Error, Part, State};

/// A move and when it can happen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Its participants, the sender first.
    pub parts: Vec<Part>,
    /// The waits after which it is possible, as ascending windows of ticks from first to last;
    /// without a last one forever.
    pub windows: Vec<(i64, Option<i64>)>,
}

/// The moves of states.
pub struct Choices<'a> {
    /// With twice as many ticks, so that there is one between each two moments.
    semantics: Semantics<'a>,
    moments: Moments,
}

impl<'a> Choices<'a> {
    /// Those of a network; times are whole numbers of ticks.
    pub fn new(network: &'a Network, ticks_per_unit: i64) -> Result<Choices<'a>, Error> {
        Ok(Choices {
            semantics: Semantics::new(network, 2 * ticks_per_unit),
            moments: Moments::new(network, &[])?,
        })
    }

    /// The initial state, in ticks.
    pub fn initial(&self) -> Result<State, Error> {
        Ok(halved(self.semantics.initial()?))
    }

    /// What can happen in a state, in the order of the first moments; and how long time can pass,
    /// `None` forever.
    pub fn of(&self, state: &State) -> Result<(Vec<Choice>, Option<i64>), Error> {
        let state = doubled(state);
        let is_stopped = self.semantics.stopped(&state)?;
        let unit = self.semantics.ticks_per_unit();
        let mut choices: Vec<Choice> = Vec::new();
        let mut longest = Some(0);
        for stretch in self.moments.stretches(&state, &is_stopped, unit)? {
            let window = if stretch.is_open() {
                (stretch.first / 2 + 1, stretch.last.map(|last| last / 2 - 1))
            } else {
                (stretch.first / 2, Some(stretch.first / 2))
            };
            let now = self.semantics.after(&state, stretch.moment)?;
            if !self.semantics.invariants_hold(&now)? {
                break;
            }
            let moves = self.semantics.moves(&now)?;
            let is_time_stopped = self.semantics.is_time_stopped(&now, &moves);
            if stretch.is_open() && is_time_stopped {
                break;
            }
            if window.1.is_none_or(|last| window.0 <= last) {
                longest = window.1;
                for (one, _) in self.semantics.successors(&now)? {
                    add(&mut choices, &one.parts, window);
                }
            }
            if is_time_stopped {
                break;
            }
        }
        Ok((choices, longest))
    }

    /// The state after a wait in ticks and a move; `None` if they are not possible.
    pub fn take(&self, state: &State, wait: i64, parts: &[Part]) -> Result<Option<State>, Error> {
        let (choices, _) = self.of(state)?;
        let is_in = |window: &(i64, Option<i64>)| {
            window.0 <= wait && window.1.is_none_or(|last| wait <= last)
        };
        let mut choices = choices.iter();
        let is_possible = choices.any(|one| one.parts == parts && one.windows.iter().any(is_in));
        if !is_possible {
            return Ok(None);
        }
        let later = self.semantics.after(&doubled(state), 2 * wait)?;
        Ok(self.semantics.take(&later, parts)?.map(halved))
    }
}

/// Adds a window to a choice, or to the last window of it if they touch.
fn add(choices: &mut Vec<Choice>, parts: &[Part], window: (i64, Option<i64>)) {
    let Some(choice) = choices.iter_mut().find(|one| one.parts == parts) else {
        choices.push(Choice {
            parts: parts.to_vec(),
            windows: vec![window],
        });
        return;
    };
    match choice.windows.last_mut() {
        Some(last) if last.1 == Some(window.0 - 1) => last.1 = window.1,
        _ => choice.windows.push(window),
    }
}

pub(super) fn doubled(state: &State) -> State {
    let clocks = state.clocks.iter().map(|clock| 2 * clock);
    State {
        words: state.words.clone(),
        clocks: clocks.collect(),
    }
}

fn halved(state: State) -> State {
    let clocks = state.clocks.iter().map(|clock| clock / 2);
    State {
        clocks: clocks.collect(),
        ..state
    }
}
