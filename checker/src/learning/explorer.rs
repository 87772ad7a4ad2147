//! Who decides for the controller while a strategy is learned or judged, and keeps what happens.

use std::sync::{Arc, Mutex, PoisonError};

use super::episode::{Episode, Step};
use super::observation::Sight;
use super::partition::{Cell, DRAW, Partition, WAIT};
use crate::analysis::LiveVariables;
use crate::ir::{Aim, Observation, Seen};
use crate::stochastic::{Chooser, Chosen, Failure, Guidance, Moment, StateView};

/// How an explorer decides.
#[derive(Clone, Debug)]
pub(super) struct Manner {
    /// What is known until now.
    pub(super) partition: Arc<Partition>,
    /// How often it decides at random, from 0 to 1.
    pub(super) randomness: f64,
    /// Whether it tries what is not known well, and keeps what happens.
    pub(super) learns: bool,
}

/// Makes explorers.
pub(super) struct Explorers {
    observation: Arc<Observation>,
    aim: Aim,
    sign: f64,
    /// What is seen of variables and clocks that nothing reads before they are set again.
    live: Option<Arc<LiveVariables>>,
    manner: Mutex<Manner>,
}

impl Explorers {
    /// For a strategy that sees this and is best for that; `sign` is -1 if the greatest value is
    /// the best.
    pub(super) fn new(
        observation: Arc<Observation>,
        aim: Aim,
        sign: f64,
        manner: Manner,
    ) -> Explorers {
        Explorers {
            observation,
            aim,
            sign,
            live: None,
            manner: Mutex::new(manner),
        }
    }

    /// The same, but what is dead by this analysis is not seen.
    pub(super) fn without_dead(self, live: Option<LiveVariables>) -> Explorers {
        Explorers {
            live: live.map(Arc::new),
            ..self
        }
    }
}

impl Guidance for Explorers {
    fn chooser(&self) -> Box<dyn Chooser> {
        let manner = self.manner.lock().unwrap_or_else(PoisonError::into_inner);
        Box::new(Explorer {
            observation: Arc::clone(&self.observation),
            aim: self.aim,
            sign: self.sign,
            live: self.live.clone(),
            words: Vec::new(),
            manner: Some(manner.clone()),
            sight: Sight::default(),
            episode: Episode::default(),
            worth: 0.0,
            since: 0.0,
            draws: false,
            plan: None,
        })
    }
}

/// Decides for the controller, and keeps what happens.
pub(super) struct Explorer {
    observation: Arc<Observation>,
    aim: Aim,
    sign: f64,
    live: Option<Arc<LiveVariables>>,
    /// The state without what is dead.
    words: Vec<i32>,
    manner: Option<Manner>,
    sight: Sight,
    episode: Episode,
    /// What the run was worth at the last decision, and when that was.
    worth: f64,
    since: f64,
    /// Whether it waits for a delay that is drawn.
    draws: bool,
    /// When it moves, and how, if nothing happens before.
    plan: Option<Plan>,
}

/// A move that was chosen for later.
#[derive(Clone, Copy, Debug)]
struct Plan {
    time: f64,
    action: u32,
}

impl Explorer {
    /// From now on it decides in this manner; without one it must not be asked.
    pub(super) fn set(&mut self, manner: Option<Manner>) {
        self.manner = manner;
    }

    /// The decisions of the run that has ended after this time with this value.
    pub(super) fn ended(&mut self, value: f64, time: f64) -> Episode {
        let mut episode = std::mem::take(&mut self.episode);
        let cost = self.sign * value;
        if let Some(last) = episode.steps.last_mut() {
            last.cost = cost - self.worth;
            last.time = time - self.since;
        }
        episode.cost = cost;
        episode
    }

    /// What the run is worth until now.
    fn worth(&self, state: &mut StateView<'_>, time: f64) -> Result<f64, Failure> {
        let value = state.worth(self.aim, time)?;
        if value.is_finite() {
            Ok(self.sign * value)
        } else {
            Err(Failure::NoNumber)
        }
    }

    fn record(&mut self, moment: Moment<'_>, worth: f64, action: u32, moves: bool) {
        let episode = &mut self.episode;
        if let Some(last) = episode.steps.last_mut() {
            last.cost = worth - self.worth;
            last.time = moment.time - self.since;
        }
        self.worth = worth;
        self.since = moment.time;
        let waits = u32::from(moment.may_wait);
        episode.steps.push(Step {
            action,
            choices: moment.moves.len() as u32 + waits,
            cost: 0.0,
            time: 0.0,
            moves,
        });
        episode.choices.extend_from_slice(moment.moves);
        if moment.may_wait {
            episode.choices.push(WAIT);
        }
        episode.keys.extend_from_slice(&self.sight.key);
        episode.points.extend_from_slice(&self.sight.point);
        if moves {
            episode.points.extend_from_slice(&self.sight.rates);
        }
    }
}

impl Chooser for Explorer {
    fn begin(&mut self) {
        self.episode = Episode::default();
        self.worth = 0.0;
        self.since = 0.0;
        self.draws = false;
        self.plan = None;
    }

    fn renew(&mut self) {
        self.draws = false;
        self.plan = None;
    }

    fn sees_time(&self) -> bool {
        self.observation.has_clocks()
    }

    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        let is_moving = match &self.live {
            None => {
                self.sight.look(&self.observation, state)?;
                self.sight.look_at_rates(&self.observation, state)
            }
            Some(live) => {
                self.sight.look_exactly(&self.observation, state)?;
                self.words.clear();
                self.words.extend_from_slice(state.words);
                live.forget(&mut self.words);
                let mut state = StateView {
                    words: &mut self.words,
                    executor: state.executor,
                    network: state.network,
                };
                self.sight.look_at_point(&self.observation, &mut state)?;
                self.sight.look_at_rates(&self.observation, &state);
                let Sight { rates, .. } = &mut self.sight;
                for (feature, rate) in self.observation.continuous.iter().zip(&mut *rates) {
                    if let Seen::Clock(clock) = feature.seen
                        && live.is_dead(state.words, clock)
                    {
                        *rate = 0.0;
                    }
                }
                rates.iter().any(|&rate| rate != 0.0)
            }
        };
        let manner = self.manner.take().expect("it is asked in a run");
        let chosen = self.decided(&manner, state, moment, is_moving);
        if manner.learns {
            let worth = self.worth(state, moment.time)?;
            let (action, waits) = match chosen {
                Chosen::Move(place) => (moment.moves[place], false),
                Chosen::Wait(_) => (WAIT, true),
                Chosen::Draw => (DRAW, false),
            };
            self.record(moment, worth, action, waits && is_moving);
        }
        self.manner = Some(manner);
        Ok(chosen)
    }
}

impl Explorer {
    fn decided(
        &mut self,
        manner: &Manner,
        state: &mut StateView<'_>,
        moment: Moment<'_>,
        is_moving: bool,
    ) -> Chosen {
        let count = moment.moves.len() as u32;
        if std::mem::take(&mut self.draws) {
            // The moment was drawn at random, and so is the move.
            return Chosen::Move(state.stream().below(count) as usize);
        }
        if let Some(plan) = self.plan.take()
            && plan.time <= moment.time
            && let Some(place) = moment.moves.iter().position(|&one| one == plan.action)
        {
            return Chosen::Move(place);
        }
        let is_random = manner.randomness > 0.0 && state.stream().uniform() < manner.randomness;
        let observation = manner.partition.observation(&self.sight.key);
        let place = match observation {
            Some(one) if !is_random => {
                let cell = manner.partition.cell(one, &self.sight.point);
                let cell = &manner.partition.cells[cell as usize];
                best(cell, moment, manner.learns.then_some(&mut *state))
            }
            _ => None,
        };
        if let Some(place) = place {
            if place < moment.moves.len() {
                return Chosen::Move(place);
            }
            let observation = observation.expect("what is known was seen before");
            return Chosen::Wait(self.wait(manner, state, moment, observation));
        }
        let all = count + u32::from(moment.may_wait);
        let drawn = if all > 1 {
            state.stream().below(all)
        } else {
            0
        };
        if drawn < count {
            return Chosen::Move(drawn as usize);
        }
        self.draws = is_moving;
        if is_moving {
            Chosen::Draw
        } else {
            Chosen::Wait(f64::INFINITY)
        }
    }

    /// How long it waits: until what is seen is in a cell where to wait is not the best.
    fn wait(
        &mut self,
        manner: &Manner,
        state: &mut StateView<'_>,
        moment: Moment<'_>,
        observation: u32,
    ) -> f64 {
        let partition = &manner.partition;
        let Sight { point, rates, .. } = &mut self.sight;
        let start = point.clone();
        let (mut waited, mut exit) = (0.0, partition.cell_and_exit(observation, point, rates).1);
        loop {
            waited += exit;
            if waited.is_infinite() || !moment.is_straight {
                break;
            }
            for ((value, start), rate) in point.iter_mut().zip(&start).zip(&*rates) {
                *value = start + rate * waited;
            }
            let (cell, next) = partition.cell_and_exit(observation, point, rates);
            exit = next;
            let cell = &partition.cells[cell as usize];
            let place = best(cell, moment, manner.learns.then_some(&mut *state));
            if let Some(&action) = place.and_then(|place| moment.moves.get(place)) {
                let time = moment.time + waited * (1.0 - f64::EPSILON);
                self.plan = Some(Plan { time, action });
                break;
            }
        }
        self.sight.point = start;
        waited
    }
}

/// Of actions that were taken less often than this, each is tried first.
const TRIES: f64 = 4.0;

/// The place of the action with the least cost; that to wait is behind the moves. Who learns adds a
/// random error to each cost, as large as it may be, so that it tries what may be best. `None` if
/// nothing is known.
fn best(cell: &Cell, moment: Moment<'_>, mut learner: Option<&mut StateView<'_>>) -> Option<usize> {
    let mut found: Option<(f64, usize)> = None;
    let waits = moment.may_wait.then_some(WAIT);
    for (place, action) in moment.moves.iter().copied().chain(waits).enumerate() {
        let cost = match (cell.of(action), &mut learner) {
            (None, None) => continue,
            (None, Some(_)) => f64::NEG_INFINITY,
            (Some(known), None) => known.value + known.error,
            (Some(known), Some(_)) if known.visits < TRIES => f64::NEG_INFINITY,
            (Some(known), Some(state)) => known.value + known.error * normal(state),
        };
        if found.is_none_or(|(least, _)| cost < least) {
            found = Some((cost, place));
        }
    }
    found.map(|(_, place)| place)
}

/// A number with about the standard normal distribution.
fn normal(state: &mut StateView<'_>) -> f64 {
    let mut stream = state.stream();
    let sum: f64 = (0..3).map(|_| stream.uniform() - 0.5).sum();
    2.0 * sum
}
