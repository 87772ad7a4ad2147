//! The states that can be reached, with all that may happen there.

use super::process::{NOBODY, Process};
use super::states::{Counting, States};
use crate::ir::{Observation, Optimum};
use crate::learning::observation::Sight;
use crate::learning::partition::WAIT;
use crate::search::limits::{Counters, StopReason};
use crate::stochastic::{Behaviour, Failure, NotFinite, PossibleMove, Stage, Unfolder};

/// Larger processes are left to learning.
const MOST_STATES: u32 = 10_000_000;
/// As are those with more ways.
const MOST_WAYS: usize = 1 << 30;
/// And those that take more bytes.
const MOST_BYTES: u64 = 4 << 30;
/// Limits are looked at after so many states.
const STATES_BETWEEN_LOOKS: u32 = 256;

/// What was found.
pub(super) struct Explored<'n> {
    pub(super) states: States<'n>,
    pub(super) process: Process,
    /// The nodes at which the controller is asked, ascending.
    pub(super) decisions: Vec<u32>,
    /// What it sees there, one after the other: exact values, and values in intervals.
    pub(super) keys: Vec<i32>,
    pub(super) points: Vec<f64>,
    /// Of the words that were asked about: whether nothing reads them at some decision, and whether
    /// something may at some.
    pub(super) is_dead: Vec<bool>,
    pub(super) is_live: Vec<bool>,
    /// What the initial state says of the value.
    pub(super) start: f64,
    live: Vec<bool>,
}

/// Why not all was explored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unexplored {
    NotFinite(NotFinite),
    Limit(StopReason),
    TooLarge,
}

/// Explores what can be reached. What is seen at decisions is kept; of those words it is found out
/// whether something may still read them there. `look` sees the counters now and then, and may end
/// it.
///
/// # Errors
/// A run fails in some state.
pub(super) fn explore<'n>(
    behaviour: Behaviour<'n>,
    asked: &Optimum,
    unfolder: &mut Unfolder<'_>,
    counting: Counting<'n>,
    seen: (&Observation, &[u32]),
    look: &mut dyn FnMut(&Counters) -> Option<StopReason>,
) -> Result<Result<Explored<'n>, Unexplored>, Failure> {
    let network = behaviour.network;
    let mut explored = Explored {
        states: States::new(counting),
        process: Process::new(),
        decisions: Vec::new(),
        keys: Vec::new(),
        points: Vec::new(),
        is_dead: vec![false; seen.1.len()],
        is_live: vec![false; seen.1.len()],
        start: unfolder.worth(asked, &network.initial)?,
        live: Vec::new(),
    };
    explored.states.intern(&network.initial, Stage::default());
    let (mut words, mut sight) = (Vec::new(), Sight::default());
    let mut next = 0;
    while next < explored.states.len() {
        if next % STATES_BETWEEN_LOOKS == 0 {
            let counters = explored.counters(next);
            if let Some(reason) = look(&counters) {
                return Ok(Err(Unexplored::Limit(reason)));
            }
            let is_large = explored.states.len() > MOST_STATES || counters.bytes > MOST_BYTES;
            if is_large || explored.process.ways() > MOST_WAYS {
                return Ok(Err(Unexplored::TooLarge));
            }
        }
        let stage = explored.states.load(next, &mut words);
        if let Err(reason) = unfolder.unfold(asked, &words, stage)? {
            return Ok(Err(Unexplored::NotFinite(reason)));
        }
        if unfolder.choices() > 0 {
            sight.look(seen.0, &mut unfolder.view())?;
            explored.see(next, &sight, &words, seen.1);
        }
        if !explored.add(unfolder, &words, stage, asked.is_greatest) {
            return Err(Failure::NoNumber);
        }
        next += 1;
    }
    if let Some(reason) = look(&explored.counters(next)) {
        return Ok(Err(Unexplored::Limit(reason)));
    }
    Ok(Ok(explored))
}

impl Explored<'_> {
    pub(super) fn counters(&self, explored: u32) -> Counters {
        let stored = u64::from(self.states.len());
        let seen =
            (self.keys.capacity() + self.decisions.capacity()) * 4 + self.points.capacity() * 8;
        Counters {
            explored: u64::from(explored),
            stored,
            waiting: stored - u64::from(explored),
            bytes: self.states.bytes() + self.process.bytes() + seen as u64,
        }
    }

    /// Notes what is seen at a decision.
    fn see(&mut self, node: u32, sight: &Sight, words: &[i32], asked: &[u32]) {
        self.decisions.push(node);
        self.keys.extend_from_slice(&sight.key);
        self.points.extend_from_slice(&sight.point);
        if asked.is_empty() {
            return;
        }
        let mut live = std::mem::take(&mut self.live);
        self.states.counting.are_live(words, asked, &mut live);
        for (place, &is_live) in live.iter().enumerate() {
            self.is_live[place] |= is_live;
            self.is_dead[place] |= !is_live;
        }
        self.live = live;
    }

    /// Adds the node of a state that was unfolded; returns whether all values are numbers.
    fn add(
        &mut self,
        unfolder: &Unfolder<'_>,
        words: &[i32],
        stage: Stage,
        is_greatest: bool,
    ) -> bool {
        let sign = if is_greatest { -1.0 } else { 1.0 };
        if let Some(end) = unfolder.end() {
            self.process.end_choice(NOBODY, sign * end);
            self.process.end_node();
            return end.is_finite();
        }
        let mut are_finite = true;
        let after = Stage {
            time: stage.time + unfolder.delay(),
            moves: stage.moves + 1,
            is_asked: false,
        };
        if unfolder.choices() == 0 {
            let cost = self.add_ways(unfolder.chances(), after);
            if unfolder.asked() > 0.0 {
                let asked = Stage {
                    is_asked: true,
                    ..stage
                };
                let target = self.states.intern(words, asked);
                self.process.add_way(target, unfolder.asked());
            }
            are_finite &= cost.is_finite();
            self.process.end_choice(NOBODY, sign * cost);
        } else {
            for choice in 0..unfolder.choices() {
                let cost = self.add_ways(unfolder.chances_of(choice), after);
                are_finite &= cost.is_finite();
                let label = unfolder.choice(choice).unwrap_or(WAIT);
                self.process.end_choice(label, sign * cost);
            }
        }
        self.process.end_node();
        are_finite
    }

    /// Adds ways; returns the mean gain.
    fn add_ways<'u>(&mut self, moves: impl Iterator<Item = PossibleMove<'u>>, after: Stage) -> f64 {
        let mut mean = 0.0;
        for PossibleMove {
            chance,
            gain,
            words,
        } in moves
        {
            mean += chance * gain;
            let target = self.states.intern(words, after);
            self.process.add_way(target, chance);
        }
        mean
    }
}
