//! The race: every process draws a delay, the least wins, and the winner moves.
//!
//! A process competes with its *outputs*: internal edges and sending edges. Its delay is drawn
//! among the times at which one of them is enabled: uniformly if its invariant bounds them, else by
//! the exponential distribution with the rate of its location, of which only those times count. In
//! an urgent or committed location, and from the first moment at which an urgent channel can be
//! used, its delay is 0. So where time stands still, only those move who have drawn 0; if there are
//! none, all who have an output. The winner takes one of its outputs, all with the same chance; a
//! sender on a binary channel competes while a receiver is ready, and takes one of them.
//!
//! What a process has drawn is its *plan*. It stays as it is until something changes on which it
//! depends. Drawing anew at any other moment would give the same law: both distributions,
//! conditioned on "not yet", are themselves again. While somebody is in a committed location,
//! nobody plans, for the next move comes at once.
//!
//! Under a strategy of the controller (`advised.rs`) its moves count only where the strategy
//! allows them, and processes that have some plan anew before every move.
//!
//! Invariants, while no move is being made:
//! * `attempts` and `bounds` of a process that is not in `stale` are what its plan says, counted
//!   from now.
//! * `movers` are those of the last move, the sender first, then the receivers in their order.
//! * `spots` are the locations that the words of the state hold.
//!
//! Source: A. David et al., "Uppaal SMC tutorial", STTT 17 (2015), sections 2 and 3.

mod advised;
mod choosing;
mod direct;
mod outcomes;
mod outputs;
mod planning;
mod transition;
mod unfolded;
mod unfolding;

pub use unfolded::NotFinite;
pub(super) use unfolded::{Drawn, Found, Unfolded, known};

use std::cell::Cell;

use rustc_hash::FxHashMap;

use super::advice::Advice;
use super::behaviour::Behaviour;
use super::condition::Condition;
use super::constants::{MOVES_OF_A_PLAN, TOLERANCE, ZENO_MOVES, ZENO_TIME};
use super::control::{Control, Fence, Guidance, Uniform};
use super::failure::{Failure, Stand};
use super::machine::{Machine, Mask};
use super::motion::{Followed, Motion};
use super::program::Program;
use super::rules;
use super::run_id::RunId;
use crate::ir::{FunctionId, LocationId, Network, ProcessId, Urgency};

/// The changes of a condition that are followed within one delay.
const MOST_CHANGES: usize = 100_000;

/// How much longer than the rest of a run an invariant is looked at.
const FAR_BEYOND: f64 = 1000.0;

/// What comes next: the delay until then, and who moves; nobody if it is infinite.
#[derive(Clone, Copy, Debug)]
pub(in crate::stochastic) struct Next {
    pub(in crate::stochastic) delay: f64,
    pub(in crate::stochastic) winner: Option<usize>,
    /// Who keeps time from passing beyond the delay, if nobody moves then.
    stopped_by: Option<usize>,
}

/// A run in progress.
pub(in crate::stochastic) struct Race<'a> {
    pub(in crate::stochastic) machine: Machine<'a>,
    /// By process: in how long it tries to move; infinity if never.
    attempts: Vec<f64>,
    /// By process: how long it may stay where it is.
    bounds: Vec<f64>,
    /// The processes that plan anew before anything else happens.
    stale: Vec<u32>,
    is_stale: Vec<bool>,
    /// By process: where it is.
    locations: Vec<LocationId>,
    /// How many processes are in committed locations.
    committed: usize,
    /// The windows of the plan that is being made.
    windows: Vec<(f64, f64)>,
    /// How many exits of rules are open.
    exits: u32,
    /// The clocks that are rated in some location, ascending.
    rated_clocks: Vec<u32>,
    pub(in crate::stochastic) motion: Motion,
    /// By process: whether its plan was found by looking along the motion of clocks. It reaches
    /// only until somebody moves.
    is_stepped: Vec<bool>,
    /// How long the run may still last.
    rest: f64,
    /// How far ahead conditions are looked at along the motion of clocks.
    until: f64,
    /// The clocks that conditions read.
    clocks_of: FxHashMap<FunctionId, Box<[u32]>>,
    /// Whose rates apply to a clock: by its place among the clocks of the network.
    rated_by: Vec<Option<u32>>,
    movers: Vec<(u32, u32)>,
    choices: Vec<u32>,
    /// How long the run has lasted.
    pub(in crate::stochastic) time: f64,
    /// How many moves it has made.
    pub(in crate::stochastic) moves: u64,
    /// When the moves since then are counted for [`Failure::Zeno`]: time and number.
    since: (f64, u64),
    /// The moves until plans are drawn anew that wait for a clock.
    until_renewal: u32,
    /// Whether those of the last move have still to plan.
    has_moved: bool,
    /// What the strategy says, if the run is under one.
    advice: Option<Advice<'a>>,
    /// Who decides for the controller, if somebody does.
    pub(in crate::stochastic) control: Option<Control>,
    /// What keeps the controller from some of its moves.
    fence: Option<&'a dyn Fence>,
    /// The first time at which an urgent channel stops time for a move that the strategy forbids,
    /// and who could make it.
    standstill: Option<(f64, usize)>,
    /// How long all invariants together let time pass, if that matters to the strategy.
    longest_stay: f64,
    /// Which delays would be drawn, if none are: see `unfolding.rs`.
    pub(in crate::stochastic) drawn: Option<Drawn>,
}

impl<'a> Race<'a> {
    pub(in crate::stochastic) fn new(behaviour: Behaviour<'a>) -> Race<'a> {
        let Behaviour {
            network,
            executor,
            restriction,
            guidance,
            fence,
            fixed_step,
        } = behaviour;
        let guidance = guidance.or(fence.map(|_| &Uniform as &dyn Guidance));
        let processes = network.processes.len();
        Race {
            machine: Machine::new(network, executor),
            attempts: vec![f64::INFINITY; processes],
            bounds: vec![f64::INFINITY; processes],
            stale: Vec::with_capacity(processes),
            is_stale: vec![false; processes],
            locations: vec![LocationId(0); processes],
            committed: 0,
            windows: Vec::new(),
            exits: 0,
            rated_clocks: rated_clocks(network),
            motion: Motion::new(fixed_step),
            is_stepped: vec![false; processes],
            rest: f64::INFINITY,
            until: f64::INFINITY,
            clocks_of: FxHashMap::default(),
            rated_by: vec![None; network.chances.clocks.len()],
            movers: Vec::new(),
            choices: Vec::new(),
            time: 0.0,
            moves: 0,
            since: (0.0, 0),
            until_renewal: MOVES_OF_A_PLAN,
            has_moved: false,
            advice: restriction.map(Advice::new),
            control: guidance.map(Control::new),
            fence,
            standstill: None,
            longest_stay: f64::INFINITY,
            drawn: None,
        }
    }

    /// Goes back to the initial state.
    pub(in crate::stochastic) fn start(
        &mut self,
        program: &Program<'_>,
        RunId { seed, run }: RunId,
    ) -> Result<(), Failure> {
        self.machine.start(seed, run);
        self.time = 0.0;
        self.moves = 0;
        if let Some(control) = &mut self.control {
            control.chooser.begin();
        }
        self.resume(program)
    }

    /// Plans for the state that the words of the machine hold now.
    pub(in crate::stochastic) fn resume(&mut self, program: &Program<'_>) -> Result<(), Failure> {
        self.since = (self.time, 0);
        self.until_renewal = MOVES_OF_A_PLAN;
        self.committed = 0;
        self.has_moved = false;
        if let Some(control) = &mut self.control {
            control.renew();
        }
        self.stale.clear();
        self.is_stepped.fill(false);
        self.motion.start();
        for process in 0..self.locations.len() {
            let location = self.machine.location(process);
            self.locations[process] = location;
            let spot = program.spot(process, location);
            self.committed += usize::from(spot.urgency == Urgency::Committed);
            self.is_stale[process] = true;
            self.stale.push(process as u32);
        }
        if !program.rated.is_empty() {
            self.rated_by.fill(None);
            for &clock in &self.machine.network.chances.clocks {
                self.machine.set_rate(clock, 1.0);
            }
            for process in 0..self.locations.len() {
                self.set_rates(process)?;
            }
            self.find_flows(program);
        }
        Ok(())
    }

    /// Finds which clocks flow in the present locations.
    fn find_flows(&mut self, program: &Program<'_>) {
        if !program.has_flows {
            return;
        }
        let network = self.network();
        let flows = program.rated.iter().filter_map(|&process| {
            let stand = self.stand(process as usize);
            let known = &network.processes[process as usize];
            let chances = &known.locations[stand.location.0 as usize].chances;
            let rated = chances.rated_clocks.iter().zip(&chances.flows);
            let clocks: Vec<u32> = rated
                .filter(|(_, flows)| **flows)
                .map(|(&clock, _)| clock)
                .collect();
            let rates = chances.rates.filter(|_| !clocks.is_empty())?;
            Some((rates, stand, clocks))
        });
        let flows: Vec<_> = flows.collect();
        self.motion.set_flows(flows);
    }

    fn network(&self) -> &'a Network {
        self.machine.network
    }

    fn stand(&self, process: usize) -> Stand {
        Stand {
            process: ProcessId(process as u32),
            location: self.locations[process],
        }
    }

    fn urgency(&self, process: usize) -> Urgency {
        let LocationId(location) = self.locations[process];
        self.network().processes[process].locations[location as usize].urgency
    }

    fn make_stale(&mut self, process: u32) {
        let is_stale = &mut self.is_stale[process as usize];
        if !*is_stale {
            *is_stale = true;
            self.stale.push(process);
        }
    }

    /// Draws what comes next, if it comes before the end of the run, `rest` from now.
    pub(in crate::stochastic) fn next(
        &mut self,
        program: &Program<'_>,
        rest: f64,
    ) -> Result<Next, Failure> {
        self.rest = rest;
        self.take_advice(program)?;
        self.look_for_decisions(program);
        if self.committed > 0 {
            self.put_plans_off(program)?;
            return self.next_committed(program);
        }
        self.plan_anew(program)?;
        let mut delay = f64::INFINITY;
        for &attempt in &self.attempts {
            delay = delay.min(attempt);
        }
        let mut least = f64::INFINITY;
        for &bound in &self.bounds {
            least = least.min(bound);
        }
        if let Some(next) = self.next_by_advice(program, delay, least)? {
            return Ok(next);
        }
        if delay > least * (1.0 + TOLERANCE) + TOLERANCE {
            return self.next_at_the_latest(program, least);
        }
        let winner = if delay.is_finite() {
            Some(self.first_before(delay * (1.0 + TOLERANCE) + TOLERANCE))
        } else {
            None
        };
        Ok(Next {
            delay,
            winner,
            stopped_by: None,
        })
    }

    /// One of the processes whose attempts come until then.
    fn first_before(&mut self, latest: f64) -> usize {
        let mut attempts = self.attempts.iter().enumerate();
        let mut before = attempts.by_ref().filter(|(_, attempt)| **attempt <= latest);
        let (first, _) = before.next().expect("the least attempt comes until then");
        let ties = before.count();
        if ties == 0 {
            return first;
        }
        let chosen = self.machine.stream().below(ties as u32 + 1) as usize;
        let attempts = self.attempts.iter().enumerate();
        let mut before = attempts.filter(|(_, attempt)| **attempt <= latest);
        before.nth(chosen).expect("there are as many").0
    }

    /// What comes when time cannot pass as long as anybody has drawn: who can move then does; if
    /// nobody can, time is locked.
    fn next_at_the_latest(&mut self, program: &Program<'_>, least: f64) -> Result<Next, Failure> {
        let stopped_by = self.bounds.iter().position(|&bound| bound <= least);
        let mut winner = None;
        if least <= TOLERANCE {
            winner = self.one_with_outputs(program, false)?;
        }
        Ok(Next {
            delay: least,
            winner,
            stopped_by,
        })
    }

    /// What comes next where a committed location must be left.
    fn next_committed(&mut self, program: &Program<'_>) -> Result<Next, Failure> {
        let mut winner = self.one_with_outputs(program, true)?;
        if winner.is_none() {
            // Somebody else may send to a committed location.
            winner = self.one_with_outputs(program, false)?;
        }
        let mut all = 0..self.locations.len();
        Ok(Next {
            delay: 0.0,
            winner,
            stopped_by: all.find(|&one| self.urgency(one) == Urgency::Committed),
        })
    }

    /// One of the processes with an output that is enabled now, or of those in committed locations.
    fn one_with_outputs(
        &mut self,
        program: &Program<'_>,
        only_committed: bool,
    ) -> Result<Option<usize>, Failure> {
        let (mut winner, competitors) = (None, Cell::new(0));
        loop {
            for process in 0..self.locations.len() {
                let is_asked = !only_committed || self.urgency(process) == Urgency::Committed;
                if !is_asked || !self.find_outputs(program, process)? {
                    continue;
                }
                rules::compete(self, &competitors, |_| {
                    winner = Some(process);
                    Ok(())
                })?;
            }
            if winner.is_some() || !self.hurry() {
                return Ok(winner);
            }
        }
    }

    /// The failure of a run in which nobody moves and time cannot pass.
    pub(in crate::stochastic) fn time_lock(&self, next: Next) -> Option<Failure> {
        let by = next.stopped_by.filter(|_| next.winner.is_none())?;
        Some(Failure::TimeLock(self.stand(by)))
    }

    /// Lets time pass.
    pub(in crate::stochastic) fn wait(&mut self, delay: f64) -> Result<(), Failure> {
        if delay > 0.0 {
            if self.motion.is_flowing() {
                self.motion.go_to(&mut self.machine, delay)?;
                self.motion.end();
            } else {
                self.machine.advance(delay);
            }
            self.time += delay;
            if let Some(control) = &mut self.control {
                control.hold = (control.hold - delay).max(0.0);
            }
            for attempt in &mut self.attempts {
                *attempt -= delay;
            }
            for bound in &mut self.bounds {
                *bound -= delay;
            }
        }
        Ok(())
    }

    /// Lets a process move, if it can after all.
    pub(in crate::stochastic) fn take(
        &mut self,
        program: &Program<'_>,
        process: usize,
    ) -> Result<(), Failure> {
        self.motion.end();
        for process in 0..self.is_stepped.len() {
            if self.is_stepped[process] {
                self.make_stale(process as u32);
            }
        }
        self.take_advice_again();
        let is_able = self.find_outputs(program, process)?
            || self.hurry() && self.find_outputs(program, process)?;
        if !is_able {
            // Rounding has put the delay beside the window: it is drawn again.
            self.make_stale(process as u32);
            return self.count_move(process, false);
        }
        let choices = std::mem::take(&mut self.choices);
        let chosen = self.one_of(program, &choices);
        self.choices = choices;
        let mut chosen = chosen?;
        if self.is_decided(program.instance(chosen)) {
            let Some(decided) = self.decide(program, process)? else {
                self.make_stale(process as u32);
                return self.count_move(process, false);
            };
            chosen = decided;
        }
        self.make(program, process, chosen)
    }

    /// Makes a move with an output that is enabled, if the strategy does not wait, now that the
    /// delay of a process is over.
    fn make(&mut self, program: &Program<'_>, process: usize, chosen: u32) -> Result<(), Failure> {
        self.movers.clear();
        self.movers.push((chosen, 0));
        let sender = program.instance(chosen);
        if let Some(channel) = self.channel(sender)? {
            self.add_receivers(program, sender, channel)?;
            let mut attempts = 0;
            while !self.allows_move(program) {
                // Some receivers make a move that the strategy allows.
                attempts += 1;
                if attempts == MOST_CHANGES {
                    return Err(Failure::NoProgress(self.stand(process)));
                }
                self.movers.truncate(1);
                self.add_receivers(program, sender, channel)?;
            }
        }
        if self.waits_instead(program)? {
            self.make_stale(process as u32);
            return self.count_move(process, false);
        }
        self.carry_out(program)?;
        if let Some(control) = &mut self.control {
            control.renew();
        }
        self.has_moved = true;
        self.until_renewal -= 1;
        self.count_move(process, true)
    }

    /// Counts a move; fails if there are too many in no time.
    fn count_move(&mut self, process: usize, was_taken: bool) -> Result<(), Failure> {
        self.moves += u64::from(was_taken);
        self.since.1 += 1;
        if self.since.1 >= ZENO_MOVES {
            if self.time - self.since.0 < ZENO_TIME {
                return Err(Failure::Zeno(self.stand(process)));
            }
            self.since = (self.time, 0);
        }
        Ok(())
    }

    /// Counts moves from here on, so that none is taken for Zeno's: the run is bounded by moves.
    pub(in crate::stochastic) fn forget_moves(&mut self) {
        self.since = (self.time, 0);
    }
}

impl Race<'_> {
    /// What a condition of a query says of the state after this time; changes are looked for until
    /// the delay is over.
    pub(in crate::stochastic) fn mask(
        &mut self,
        condition: Condition,
        ahead: f64,
        delay: f64,
    ) -> Result<Mask, Failure> {
        let (function, is_linear) = match condition {
            Condition::Curved(function) => (function, false),
            Condition::Timed(function) if self.motion.is_flowing() && self.reads_flow(function) => {
                (function, true)
            }
            _ => return self.machine.mask(condition, &[], ahead),
        };
        let asked = Followed {
            function,
            arguments: &[],
            is_simple: is_linear && self.clocks_of[&function].len() == 1,
        };
        self.motion.mask(&mut self.machine, asked, ahead, delay)
    }

    /// Looks at the state after this time, if nothing happens until then.
    pub(in crate::stochastic) fn look_ahead<R>(
        &mut self,
        time: f64,
        look: impl FnOnce(&mut Machine<'_>) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        if self.motion.is_flowing() {
            self.motion.look(&mut self.machine, time, look)
        } else {
            self.machine.look_ahead(time, look)
        }
    }
}

/// The clocks that are rated in some location, ascending.
fn rated_clocks(network: &Network) -> Vec<u32> {
    let locations = network.processes.iter().flat_map(|one| &one.locations);
    let clocks = locations.flat_map(|one| &one.chances.rated_clocks);
    let mut clocks: Vec<u32> = clocks.copied().collect();
    clocks.sort_unstable();
    clocks.dedup();
    clocks
}
