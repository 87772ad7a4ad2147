//! The code of a race as a whole: whether there can be one, and runs that it makes.

use super::decisions::{AS_AT_BEGIN, ASKED_AGAIN, ASKS, PASSES, deciders, knows_decisions};
use super::inline::{inlined, size_of};
use super::layout::Layout;
use super::race_writer::{Ids, Plans, RaceWriter};
use super::rates::rated_clocks;
use super::watching::{GOES_ON, IS_OVER, MISSED, REACHED, Watched};
use crate::analysis::function_reads::read_words;
use crate::cancellation;
use crate::exec::arithmetic::{double_of_words, double_words};
use crate::exec::{Context, Executor};
use crate::ir::{
    Aim, Function, FunctionId, LocationId, RunBound, RunLimit, STREAM_WORDS, Stream, Urgency,
};
use crate::stochastic::condition::Condition;
use crate::stochastic::constants::{MOVES_OF_A_PLAN, UNITS_FOR_MOVE, ZENO_MOVES, ZENO_TIME};
use crate::stochastic::control::{Chosen, Control, Moment, StateView};
use crate::stochastic::observer::Outcome;
use crate::stochastic::program::{Program, Spot};
use crate::stochastic::run_id::RunId;

/// A race of more instructions is not written as code.
const MOST_INSTRUCTIONS: usize = 100_000;
/// Of more processes there would be too many instructions anyway.
const MOST_PROCESSES: usize = 1_000;
/// Functions of the network that are at most so large are taken into those that call them.
const SMALL: usize = 60;
/// Likewise plans and moves, which have one caller each.
const LARGE: usize = 1200;
/// No function grows beyond this by what it takes in.
const MOST_TAKEN_IN: usize = 6_000;

/// The end of runs that moves bound: later than all that happens, but for what never does.
const NEVER: f64 = f64::MAX / 2.0;

/// The code of a race, written and not yet prepared to run.
pub(super) struct WrittenRace {
    layout: Layout,
    /// The functions of the network, and those of the race behind them.
    functions: Vec<Function>,
    rounds: FunctionId,
    watched: Watched,
    /// How many instructions those of the race have.
    pub(super) instructions: usize,
}

impl WrittenRace {
    /// Writes the race of a network; `None` if it has what the code does not know.
    /// `sees_time` says of who decides for the controller, if anybody does, whether it sees clocks.
    pub(super) fn of(
        program: &Program<'_>,
        watched: &Watched,
        sees_time: Option<bool>,
    ) -> Option<WrittenRace> {
        let network = program.network;
        let rated = rated_clocks(program)?;
        let layout = Layout::of(program, &rated, sees_time);
        let knows_decisions = sees_time.is_none() || knows_decisions(program);
        if !watched.is_known(program) || !is_known(program) || !knows_decisions {
            return None;
        }
        let is_committed = |spot: &Spot| spot.urgency == Urgency::Committed;
        let committing = (0..network.processes.len())
            .filter(|&process| program.spots_of(process).iter().any(is_committed));
        let committing: Vec<usize> = committing.collect();
        let has_committed = !committing.is_empty();
        let mut functions = network.functions.clone();
        let first = functions.len() as u32;
        let writer = RaceWriter {
            program,
            layout: &layout,
            renewal_of_rates: (!rated.is_empty()).then_some(FunctionId(first + 1)),
            committing,
            deciders: sees_time.map_or(Vec::new(), |_| deciders(program)),
        };
        functions.push(writer.windows());
        if !rated.is_empty() {
            let renewal = writer.renewal_of_rates();
            functions.push(inlined(renewal, &network.functions, SMALL, MOST_TAKEN_IN));
        }
        let mut instructions = 0;
        let mut add = |function: Function, largest: usize| {
            let function = inlined(function, &functions, largest, MOST_TAKEN_IN);
            instructions += size_of(&function);
            functions.push(function);
            let id = FunctionId(functions.len() as u32 - 1);
            (instructions <= MOST_INSTRUCTIONS).then_some(id)
        };
        let processes = 0..network.processes.len();
        let mut plans = Vec::new();
        for process in processes.clone() {
            let mut by_location = Vec::new();
            for (location, spot) in program.spots_of(process).iter().enumerate() {
                by_location.push(if is_committed(spot) {
                    None
                } else {
                    Some(add(writer.plan_in(process, location), SMALL)?)
                });
            }
            plans.push(Plans {
                anywhere: add(writer.plan(process, &by_location), SMALL)?,
                by_location,
            });
        }
        let mut invariants = Vec::new();
        for process in processes.clone() {
            invariants.push(match writer.invariant(process) {
                Some(function) if has_committed => Some(add(function, SMALL)?),
                _ => None,
            });
        }
        let mut ids = Ids {
            plans,
            moves: Vec::new(),
            abilities: Vec::new(),
            possible_moves: None,
            chosen_moves: Vec::new(),
            invariants,
        };
        for process in processes {
            let mut moves = Vec::new();
            for (location, spot) in program.spots_of(process).iter().enumerate() {
                moves.push(if spot.outputs.is_empty() {
                    None
                } else {
                    Some(add(writer.movement(process, location, &ids), SMALL)?)
                });
            }
            ids.moves.push(moves);
            ids.abilities.push(match layout.attempts[process] {
                None => None,
                Some(_) => Some(add(writer.ability(process), SMALL)?),
            });
        }
        if let Some(decisions) = &layout.decisions {
            ids.possible_moves = Some(add(writer.possible_moves(decisions), SMALL)?);
            for &entry in &decisions.entries {
                let id = add(writer.chosen_move(entry, &ids), SMALL)?;
                ids.chosen_moves.push(id);
            }
        }
        let rounds = add(writer.rounds(&ids, watched), LARGE)?;
        Some(WrittenRace {
            layout,
            functions,
            rounds,
            watched: *watched,
            instructions,
        })
    }

    /// Makes it ready to run; `None` if the executor cannot.
    pub(super) fn prepare(
        self,
        program: &Program<'_>,
        executor: &dyn Executor,
    ) -> Option<RaceCode> {
        let network = program.network;
        let executor = executor.with_code(&self.functions, &network.constants, self.rounds)?;
        let mut initial = network.initial.clone();
        initial.resize(self.layout.words as usize, 0);
        for process in 0..network.processes.len() {
            let (word, bit) = self.layout.stale_bit(process);
            initial[word as usize] |= bit;
            let location = LocationId(initial[process] as u32);
            let is_committed = program.spot(process, location).urgency == Urgency::Committed;
            initial[self.layout.committed as usize] += i32::from(is_committed);
        }
        let infinity = double_words(f64::INFINITY);
        let places = self.layout.attempts.iter().chain(&self.layout.stays);
        for &word in places.flatten() {
            initial[word as usize..word as usize + 2].copy_from_slice(&infinity);
        }
        let best = self.layout.best as usize;
        initial[best..best + 2].copy_from_slice(&double_words(f64::NEG_INFINITY));
        Some(RaceCode {
            executor,
            words: initial.clone(),
            initial,
            layout: self.layout,
            rounds: self.rounds,
            watched: self.watched,
        })
    }
}

/// Whether the code knows all that a network has.
fn is_known(program: &Program<'_>) -> bool {
    let network = program.network;
    let processes = network.processes.len() as u32;
    let reads_places = |function: FunctionId| {
        let read = read_words(network, [function], network.layout.words as usize);
        read.is_none_or(|words| words.iter().any(|&word| word < processes))
    };
    let edges = network.processes.iter().flat_map(|process| &process.edges);
    // The code lets a receiver enter its location before the next one runs its update.
    let mut updates = edges.flat_map(|edge| {
        let legs = edge.branches.iter().map(|branch| branch.update.function);
        legs.chain([edge.update.function]).flatten()
    });
    let mut spots = (0..processes as usize).flat_map(|process| program.spots_of(process));
    processes as usize <= MOST_PROCESSES
        && !program.has_flows
        && !program.places_others()
        && network.before_update.is_none()
        && network.after_update.is_none()
        && network.externals.is_empty()
        && spots.all(|spot| can_write(program, spot))
        && !updates.any(reads_places)
}

/// Whether all conditions of a spot can be written.
fn can_write(program: &Program<'_>, spot: &Spot) -> bool {
    let is_known = |condition| !matches!(condition, Condition::Timed(_) | Condition::Curved(_));
    let mut instances = [spot.outputs, spot.inputs]
        .into_iter()
        .flat_map(|range| program.range(range));
    is_known(spot.invariant) && instances.all(|one| is_known(one.guard) && !one.is_binary)
}

/// The code of a race, ready to make runs one after the other.
pub(in crate::stochastic) struct RaceCode {
    executor: Box<dyn Executor>,
    layout: Layout,
    rounds: FunctionId,
    watched: Watched,
    /// The words at the start of a run.
    initial: Vec<i32>,
    words: Vec<i32>,
}

impl RaceCode {
    /// Whether it makes runs with such a bound.
    pub(in crate::stochastic) fn knows(bound: &RunBound) -> bool {
        match bound.limit {
            RunLimit::Time => bound.value.is_finite(),
            RunLimit::Moves => true,
            RunLimit::Clock(_) => false,
        }
    }

    fn double(&self, word: u32) -> f64 {
        let word = word as usize;
        double_of_words(self.words[word], self.words[word + 1])
    }

    fn set_double(&mut self, word: u32, value: f64) {
        let word = word as usize;
        self.words[word..word + 2].copy_from_slice(&double_words(value));
    }

    /// Makes a run; `None` if the race must make it.
    pub(super) fn run(
        &mut self,
        program: &Program<'_>,
        executor: &dyn Executor,
        RunId { seed, run }: RunId,
        bound: &RunBound,
        mut control: Option<&mut Control>,
    ) -> Option<Outcome> {
        self.words.copy_from_slice(&self.initial);
        let stream = program.network.chances.stream as usize;
        Stream::start(&mut self.words[stream..stream + STREAM_WORDS], seed, run);
        let is_by_moves = bound.limit == RunLimit::Moves;
        let (time, most_moves) = if is_by_moves {
            (NEVER, bound.value)
        } else {
            (bound.value, f64::INFINITY)
        };
        self.set_double(self.layout.bound, time);
        if let Some(control) = &mut control {
            control.chooser.begin();
            control.renew();
        }
        let mut moves = 0;
        let result = loop {
            let before = self.double(self.layout.time);
            let share = (most_moves - moves as f64).min(f64::from(MOVES_OF_A_PLAN)) as u32;
            if share == 0 {
                break if self.is_reached(program)? {
                    REACHED
                } else {
                    IS_OVER
                };
            }
            let result = self.moves(program, share, control.as_deref_mut())?;
            let made = share - self.words[self.layout.moves_left as usize] as u32;
            moves += u64::from(made);
            cancellation::work(UNITS_FOR_MOVE * made as usize);
            if result == IS_OVER && is_by_moves {
                // Nothing happens any more.
                return None;
            }
            if result != GOES_ON {
                break result;
            }
            let is_short = self.double(self.layout.time) - before < ZENO_TIME;
            if is_short && !is_by_moves {
                return None;
            }
            if share == MOVES_OF_A_PLAN {
                self.renew(program);
            }
        };
        if let Some(site) = self.executor.wraps().first() {
            executor.wraps().note(site);
        }
        let ahead = self.double(self.layout.decided_after);
        let time = self.double(self.layout.time) + ahead;
        Some(Outcome {
            value: match (result, self.watched) {
                (REACHED | MISSED | IS_OVER, Watched::End(_, aim)) => match aim {
                    Aim::Probability => f64::from(result == REACHED),
                    Aim::Time => time,
                    Aim::Expected(number) => self.number(program, number, ahead)?,
                },
                (REACHED, _) | (IS_OVER, Watched::Always(_)) => 1.0,
                (IS_OVER, Watched::Extreme(_, sign)) => sign * self.double(self.layout.best),
                (MISSED | IS_OVER, _) => 0.0,
                _ => return None,
            },
            time,
            moves,
            at: if is_by_moves { moves as f64 } else { time },
        })
    }

    /// Makes at most so many moves, and asks who decides for the controller; returns how that
    /// ended, or `None` if the run is given up.
    fn moves(
        &mut self,
        program: &Program<'_>,
        share: u32,
        mut control: Option<&mut Control>,
    ) -> Option<i32> {
        self.words[self.layout.moves_left as usize] = share as i32;
        let mut resume = AS_AT_BEGIN;
        let mut left = share;
        let mut waits = 0;
        loop {
            if let Some(decisions) = &self.layout.decisions {
                self.words[decisions.resume as usize] = resume;
            }
            let result = self.call(self.rounds)?;
            let has_moved = self.words[self.layout.moves_left as usize] as u32 != left;
            if let Some(control) = control.as_mut().filter(|_| has_moved) {
                control.renew();
            }
            if result < ASKS {
                return Some(result);
            }
            left = self.words[self.layout.moves_left as usize] as u32;
            waits += 1;
            if waits > ZENO_MOVES {
                return None;
            }
            cancellation::work(UNITS_FOR_MOVE);
            resume = self.decided(program, result - ASKS, control.as_deref_mut()?)?;
        }
    }

    /// Calls a function.
    fn call(&mut self, function: FunctionId) -> Option<i32> {
        let mut context = Context {
            state: &mut self.words,
            constraints: &mut Vec::new(),
            assignments: &mut Vec::new(),
        };
        self.executor.call(function, &[], &mut context).ok()
    }

    /// Asks who decides for the controller; returns how the code goes on.
    fn decided(&mut self, program: &Program<'_>, may: i32, control: &mut Control) -> Option<i32> {
        let decisions = self.layout.decisions.as_ref()?;
        let count = self.words[decisions.move_count as usize] as usize;
        let first = decisions.moves as usize;
        let places = &self.words[first..first + count];
        let entries = places
            .iter()
            .map(|&place| decisions.entries[place as usize]);
        control.moves.clear();
        control.moves.extend(entries);
        let word = self.layout.time as usize;
        let moment = Moment {
            moves: &control.moves,
            may_wait: may != 0,
            is_straight: true,
            time: double_of_words(self.words[word], self.words[word + 1]),
        };
        let mut state = StateView {
            words: &mut self.words,
            executor: &*self.executor,
            network: program.network,
        };
        let chosen = control.chooser.choose(&mut state, moment).ok()?;
        let hold = match chosen {
            Chosen::Move(place) => {
                return Some(ASKED_AGAIN + 1 + self.words[first + place]);
            }
            Chosen::Wait(_) | Chosen::Draw if may & PASSES == 0 => return None,
            Chosen::Draw => {
                self.words[decisions.draws as usize] = 1;
                None
            }
            Chosen::Wait(_) if !decisions.sees_time => Some(f64::INFINITY),
            Chosen::Wait(_) if self.words[decisions.draws as usize] != 0 => Some(f64::INFINITY),
            Chosen::Wait(time) => Some(time),
        };
        let winner = self.words[decisions.winner as usize] as usize;
        let place = decisions.hold;
        if let Some(hold) = hold {
            self.set_double(place, hold);
        }
        let (word, bit) = self.layout.stale_bit(winner);
        self.words[word as usize] |= bit;
        Some(ASKED_AGAIN)
    }

    /// Whether the state has what a run with an end is to reach, or `None` if that is not known.
    fn is_reached(&mut self, program: &Program<'_>) -> Option<bool> {
        self.set_double(program.network.chances.ahead, 0.0);
        let (Watched::End(goal, _) | Watched::Eventually(goal)) = self.watched else {
            return None;
        };
        match goal {
            Condition::Always => Some(true),
            Condition::Never => Some(false),
            Condition::Words(function) => Some(self.call(function)? != 0),
            Condition::Timed(function) => Some(self.call(function)? & 1 != 0),
            Condition::Compared(_) | Condition::Curved(_) => None,
        }
    }

    /// The number that a function leaves so much later, if nothing happens until then.
    fn number(&mut self, program: &Program<'_>, function: FunctionId, ahead: f64) -> Option<f64> {
        for &clock in &program.network.chances.clocks {
            let value = self.double(clock) + self.double(clock + 2) * ahead;
            self.set_double(clock, value);
        }
        self.call(function)?;
        Some(self.double(program.network.chances.result))
    }

    /// Lets those plan anew who wait for a clock, so that rounding does not add up.
    fn renew(&mut self, program: &Program<'_>) {
        for process in 0..program.network.processes.len() {
            let location = LocationId(self.words[process] as u32);
            if program.spot(process, location).waits_for_a_clock() {
                let (word, bit) = self.layout.stale_bit(process);
                self.words[word as usize] |= bit;
            }
        }
    }
}
