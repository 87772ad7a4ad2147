//! One run: from the initial state until its bound, or until what is asked of it is decided.
//!
//! What is asked is watched at all moments: after every move, and all through every delay.

use std::any::Any;
use std::iter;
use std::sync::Arc;

use super::behaviour::Behaviour;
use super::constants::{MOVES_WITHOUT_RISE, TOLERANCE, UNITS_FOR_MOVE};
use super::control::{Chooser, Control, ControllerMove, Guidance, StateView};
use super::entry::entry;
use super::failure::Failure;
use super::machine::Machine;
use super::observer::{Observer, Outcome, aim_of, watched};
use super::program::Program;
use super::race::Race;
use super::race_code::{RaceCode, Stages, Watched};
use super::restriction::Entry;
use super::run_id::RunId;
use crate::cancellation;
use crate::exec::Executor;
use crate::ir::{Asked, Network, Optimum, Part, Path, RunBound, RunLimit, Simulation};

/// The values of expressions during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The number of the run.
    pub run: u64,
    /// Whether it has reached what it must; true if that is nothing.
    pub satisfied: bool,
    /// Of each expression the moments, in units of the model, with its values. Between two moments
    /// it is linear; two values at one moment are those before and after a move.
    pub points: Vec<Vec<(f64, f64)>>,
}

/// Values that are not linear are shown so many times over a run.
const SAMPLES: f64 = 300.0;

/// The end of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended<T> {
    /// Whether its goal is reached.
    pub is_reached: bool,
    /// What it is worth.
    pub value: f64,
    /// How long it has lasted.
    pub time: f64,
    /// What is seen of its last state.
    pub seen: T,
}

/// From so many moments of an expression on, every second one is left out.
const MOST_POINTS: usize = 100_000;

impl Trajectory {
    /// Records the values of a state at a time; within a delay only those that are not linear.
    fn record(
        &mut self,
        machine: &mut Machine<'_>,
        asked: &Simulation,
        time: f64,
        is_end: bool,
        flows: bool,
    ) -> Result<(), Failure> {
        for (item, points) in asked.items.iter().zip(&mut self.points) {
            if !(is_end || item.is_curved || flows) {
                continue;
            }
            let value = machine.real(item.value, &[])?;
            if let [.., before, last] = &mut points[..]
                && before.1.to_bits() == value.to_bits()
                && last.1.to_bits() == value.to_bits()
            {
                // It goes on as it was.
                last.0 = time;
                continue;
            }
            if points.last() != Some(&(time, value)) {
                points.push((time, value));
            }
            if points.len() > MOST_POINTS {
                let mut is_kept = false;
                points.retain(|_| {
                    is_kept = !is_kept;
                    is_kept
                });
            }
        }
        Ok(())
    }
}

/// Makes runs of a network, one after the other.
pub struct Runner<'a> {
    pub(super) program: Arc<Program<'a>>,
    pub(super) race: Race<'a>,
    executor: &'a dyn Executor,
    /// Runs as code; none where what restricts them is not known to the code.
    stages: Option<Stages>,
}

impl<'a> Runner<'a> {
    /// What makes runs of a network in the stochastic reading.
    pub fn new(network: &'a Network, executor: &'a dyn Executor) -> Runner<'a> {
        Runner::of(Behaviour::new(network, executor))
    }

    /// What makes runs in which the controller does only what a strategy allows, or equations are
    /// solved by Euler's method.
    pub fn of(behaviour: Behaviour<'a>) -> Runner<'a> {
        let program = Program::new(behaviour.network, behaviour.executor);
        let mut runner = Runner::with(Arc::new(program), behaviour, None);
        let sees_time = runner.race.control.as_ref().map(Control::sees_time);
        let guidance = behaviour.guidance;
        let is_free = behaviour.restriction.is_none()
            && behaviour.fence.is_none()
            && guidance.is_none_or(Guidance::can_begin_anew);
        runner.stages = is_free.then(|| Stages::new(behaviour.executor, sees_time));
        runner
    }

    fn with(
        program: Arc<Program<'a>>,
        behaviour: Behaviour<'a>,
        stages: Option<Stages>,
    ) -> Runner<'a> {
        Runner {
            program,
            race: Race::new(behaviour),
            executor: behaviour.executor,
            stages,
        }
    }

    /// Makes runs of what a path or a value asks as code of the network from now on, as otherwise
    /// happens once that pays. Returns whether it can.
    pub fn write_runs(&mut self, bound: &RunBound, asked: Asked<'_>) -> bool {
        let watched = Watched::of(asked).filter(|_| RaceCode::knows(bound));
        let (Some(watched), Some(stages)) = (watched, &mut self.stages) else {
            return false;
        };
        stages.begin(&self.program, self.executor, watched)
    }

    /// How many runs were made as code.
    pub fn written_runs(&self) -> u64 {
        self.stages.as_ref().map_or(0, Stages::runs)
    }

    /// Makes a run as code, if there is any.
    fn written(&mut self, id: RunId, bound: &RunBound, asked: Asked<'_>) -> Option<Outcome> {
        let stages = self.stages.as_mut().filter(|_| RaceCode::knows(bound))?;
        let watched = Watched::of(asked)?;
        let control = self.race.control.as_mut();
        stages.run(&self.program, self.executor, watched, id, bound, control)
    }

    /// Who decides for the controller, if it is one of this type.
    pub fn chooser<C: Chooser>(&mut self) -> Option<&mut C> {
        let chooser: &mut dyn Any = &mut *self.race.control.as_mut()?.chooser;
        chooser.downcast_mut()
    }

    /// The moves that the controller may make, by their numbers, ascending.
    pub fn moves_of_controller(&self) -> Vec<ControllerMove> {
        let network = self.program.network;
        let instances = self.program.outputs_of_controller();
        let moves = instances.map(|(number, instance)| {
            let Entry {
                process,
                edge,
                select,
            } = entry(network, instance);
            let part = Part {
                process,
                edge,
                branch: 0,
                select,
            };
            ControllerMove { number, part }
        });
        moves.collect()
    }

    /// One for each thread, at least one: what does not change from run to run is shared.
    pub fn several(behaviour: Behaviour<'a>, threads: usize) -> Vec<Runner<'a>> {
        let first = Runner::of(behaviour);
        let others = (1..threads).map(|_| {
            let stages = first.stages.as_ref();
            let stages = stages.map(|stages| stages.of_another(behaviour.executor));
            Runner::with(Arc::clone(&first.program), behaviour, stages)
        });
        let others: Vec<Runner<'a>> = others.collect();
        iter::once(first).chain(others).collect()
    }

    /// A run, until what is asked of it is decided or its bound is reached.
    pub fn observe(
        &mut self,
        id: RunId,
        bound: &RunBound,
        asked: Asked<'_>,
    ) -> Result<Outcome, Failure> {
        if let Some(outcome) = self.written(id, bound, asked) {
            return Ok(outcome);
        }
        let mut observer = Observer::new(&self.program, asked);
        let (value, ahead) = match self.until_decided(id, bound, &mut observer)? {
            Some((satisfied, ahead)) => {
                (observer.decided(&mut self.race, satisfied, ahead)?, ahead)
            }
            None => (observer.finish(&mut self.race)?, 0.0),
        };
        if let Some(stages) = &mut self.stages {
            stages.count(self.race.moves);
        }
        Ok(Outcome {
            value,
            time: self.race.time + ahead,
            moves: self.race.moves,
            at: position(&self.race, bound, ahead),
        })
    }

    /// Makes a run until what is asked of it is decided: whether it has that, and how much later
    /// than the state says.
    fn until_decided(
        &mut self,
        id: RunId,
        bound: &RunBound,
        observer: &mut Observer<'_>,
    ) -> Result<Option<(bool, f64)>, Failure> {
        let mut decided = None;
        self.until_bound(id, bound, &mut |race, delay| {
            decided = observer.look(race, delay)?;
            Ok(decided.is_some())
        })?;
        Ok(decided)
    }

    /// A run until its goal or its bound, and what is seen of its last state.
    ///
    /// # Errors
    /// The run failed.
    pub fn to_end<T>(
        &mut self,
        id: RunId,
        asked: &Optimum,
        see: impl FnOnce(&mut StateView<'_>) -> Result<T, Failure>,
    ) -> Result<Ended<T>, Failure> {
        let mut observer = Observer::new(&self.program, Asked::End(asked));
        let decided = self.until_decided(id, &asked.bound, &mut observer)?;
        let (is_reached, ahead) = decided.unwrap_or((false, 0.0));
        let race = &mut self.race;
        Ok(Ended {
            is_reached,
            value: aim_of(race, asked.aim, is_reached, ahead)?,
            time: race.time + ahead,
            seen: race.look_ahead(ahead, |machine| see(&mut machine.view_of_state()))?,
        })
    }

    /// A run, as the values of expressions over time; until what it must
    /// reach, if that is given.
    pub fn trajectory(&mut self, id: RunId, asked: &Simulation) -> Result<Trajectory, Failure> {
        let mut trajectory = Trajectory {
            run: id.run,
            satisfied: asked.filter.is_none(),
            points: vec![Vec::new(); asked.items.len()],
        };
        let reached = asked
            .filter
            .as_ref()
            .map(|(reached, _)| Path::Eventually(reached.clone()));
        let step = asked.bound.value / SAMPLES;
        let is_sampled = asked.bound.limit == RunLimit::Time && step > 0.0;
        let is_curved = asked.items.iter().any(|item| item.is_curved);
        self.until_bound(id, &asked.bound, &mut |race, delay| {
            let start = race.time;
            trajectory.record(&mut race.machine, asked, start, true, false)?;
            let mut shown = delay;
            if let Some(path) = &reached
                && let Some((true, ahead)) = watched(race, path, delay)?
            {
                trajectory.satisfied = true;
                shown = ahead;
            }
            let flows = race.motion.is_flowing();
            let mut ahead = 0.0;
            while ahead < shown && shown.is_finite() {
                let next = if !(flows || is_curved) {
                    shown
                } else if is_sampled {
                    ahead + step
                } else {
                    race.motion.next_look(&mut race.machine, ahead)?
                };
                ahead = shown.min(next);
                let is_end = ahead >= shown;
                race.look_ahead(ahead, |machine| {
                    trajectory.record(machine, asked, start + ahead, is_end, flows)
                })?;
            }
            Ok(reached.is_some() && trajectory.satisfied)
        })?;
        Ok(trajectory)
    }

    /// Makes a run; `watch` sees every state with the delay that follows, and ends the run if it
    /// returns true.
    pub(super) fn until_bound(
        &mut self,
        id: RunId,
        bound: &RunBound,
        watch: &mut dyn FnMut(&mut Race<'_>, f64) -> Result<bool, Failure>,
    ) -> Result<(), Failure> {
        self.race.start(&self.program, id)?;
        self.go_on(bound, watch)
    }

    /// Goes on with a run until its bound, as [`Runner::until_bound`] does.
    pub(super) fn go_on(
        &mut self,
        bound: &RunBound,
        watch: &mut dyn FnMut(&mut Race<'_>, f64) -> Result<bool, Failure>,
    ) -> Result<(), Failure> {
        let Runner { program, race, .. } = self;
        let mut rise = Rise::new();
        loop {
            if bound.limit == RunLimit::Moves {
                race.forget_moves();
                if race.moves as f64 >= bound.value {
                    watch(race, 0.0)?;
                    return Ok(());
                }
            }
            let rest = rest(race, bound);
            let next = race.next(program, rest)?;
            let rest = match bound.limit {
                RunLimit::Clock(clock) if race.motion.flows(clock) => {
                    let (goal, until) = (bound.value, next.delay);
                    let reached = race.motion.reach(&mut race.machine, clock, goal, until)?;
                    reached.unwrap_or(f64::INFINITY)
                }
                _ => rest,
            };
            // Moves at the very moment of the bound still count. If nobody moves then, it does not
            // matter any more that time cannot pass.
            // Once the bound is reached, what rounding has put behind it comes too late.
            let slack = if rest > 0.0 {
                TOLERANCE * bound.value.max(1.0)
            } else {
                TOLERANCE
            };
            let is_over = rest + slack < next.delay
                || (next.winner.is_none() && rest.is_finite() && rest <= next.delay + slack);
            let delay = next.delay.min(rest).max(0.0);
            if watch(race, delay)? {
                return Ok(());
            }
            if is_over {
                race.wait(delay)?;
                return Ok(());
            }
            let Some(winner) = next.winner else {
                return match race.time_lock(next) {
                    Some(failure) => Err(failure),
                    // Nothing happens any more, for ever.
                    None if bound.limit == RunLimit::Moves => Ok(()),
                    None => Err(Failure::BoundNeverReached),
                };
            };
            race.wait(delay)?;
            if let RunLimit::Clock(clock) = bound.limit {
                rise.note(race.machine.clock(clock).0)?;
            }
            race.take(program, winner)?;
            cancellation::work(UNITS_FOR_MOVE);
        }
    }
}

/// How high the clock has risen that bounds a run.
struct Rise {
    highest: f64,
    /// The moves since then.
    moves: u64,
}

impl Rise {
    fn new() -> Rise {
        Rise {
            highest: f64::NEG_INFINITY,
            moves: 0,
        }
    }

    /// Looks at its value before a move; fails if it has not risen for too long.
    fn note(&mut self, value: f64) -> Result<(), Failure> {
        if value > self.highest {
            *self = Rise {
                highest: value,
                moves: 0,
            };
            return Ok(());
        }
        self.moves += 1;
        if self.moves > MOVES_WITHOUT_RISE {
            return Err(Failure::BoundNotApproached(self.highest));
        }
        Ok(())
    }
}

/// What bounds a run, so much later than the time of the race: time, a clock, or moves.
fn position(race: &Race<'_>, bound: &RunBound, ahead: f64) -> f64 {
    match bound.limit {
        RunLimit::Time => race.time + ahead,
        RunLimit::Moves => race.moves as f64,
        RunLimit::Clock(clock) => {
            let (value, rate) = race.machine.clock(clock);
            value + rate * ahead
        }
    }
}

/// How much time the bound leaves if nothing happens.
pub(super) fn rest(race: &Race<'_>, bound: &RunBound) -> f64 {
    match bound.limit {
        RunLimit::Time => (bound.value - race.time).max(0.0),
        RunLimit::Moves => f64::INFINITY,
        RunLimit::Clock(clock) => {
            let (value, rate) = race.machine.clock(clock);
            if value >= bound.value {
                0.0
            } else if race.motion.flows(clock) {
                // It is found when it is known how long nothing happens.
                f64::INFINITY
            } else if rate > 0.0 {
                (bound.value - value) / rate
            } else {
                f64::INFINITY
            }
        }
    }
}
