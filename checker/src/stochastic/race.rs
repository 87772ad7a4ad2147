//! The race: every process draws a delay, the least wins, and the winner moves.
//!
//! A process competes with its *outputs*: internal edges and sending edges. Its delay is drawn
//! among the times at which one of them is enabled: uniformly if its invariant bounds them, else by
//! the exponential distribution with the rate of its location, of which only those times count.
//! Where time stands still (urgent and committed locations), and at the first moment at which an
//! urgent channel can be used, the delay is 0. The winner takes one of its outputs, all with the
//! same chance; a sender on a binary channel competes while a receiver is ready, and takes one of
//! them.
//!
//! What a process has drawn is its *plan*. It stays as it is until something changes on which it
//! depends. Drawing anew at any other moment would give the same law: both distributions,
//! conditioned on "not yet", are themselves again.
//!
//! Invariants, while no move is being made:
//! * `attempts` and `bounds` of a process that is not in `stale` are what its plan says, counted
//!   from now.
//! * `spots` are the locations that the words of the state hold.
//!
//! Source: A. David et al., "Uppaal SMC tutorial", STTT 17 (2015), sections 2 and 3.

use rustc_hash::FxHashMap;

use super::condition::{Condition, Number};
use super::failure::{Failure, Stand};
use super::machine::{Machine, Mask};
use super::motion::Motion;
use super::program::{Channel, Instance, Program, Spot, clocks_of};
use super::span::Span;
use super::windows::Windows;
use crate::exec::Executor;
use crate::ir::{Branch, FunctionId, LocationId, Network, ProcessId, Update, Urgency};

/// So many moves in less than [`ZENO_TIME`] are taken for a run that never gets on.
pub const ZENO_MOVES: u64 = 100_000;
/// The time that so many moves must take, in units of the model.
pub const ZENO_TIME: f64 = 1e-6;

/// Delays that differ by less than this part, and less than this, are the same.
const TOLERANCE: f64 = 1e-12;

/// The changes of a condition that are followed within one delay.
const MOST_CHANGES: usize = 100_000;

/// How much longer than the rest of a run an invariant is looked at.
const FAR_BEYOND: f64 = 1000.0;

/// After this number of moves plans that wait for a clock are drawn anew, so that the rounding of
/// the delays in between does not add up.
const MOVES_OF_A_PLAN: u32 = 4096;

/// What comes next: the delay until then, and who moves; nobody if it is infinite.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    pub(super) delay: f64,
    pub(super) winner: Option<usize>,
    /// Who keeps time from passing beyond the delay, if nobody moves then.
    stopped_by: Option<usize>,
}

/// A run in progress.
pub(super) struct Race<'a> {
    pub(super) machine: Machine<'a>,
    /// By process: in how long it tries to move; infinity if never.
    attempts: Vec<f64>,
    /// By process: how long it may stay where it is.
    bounds: Vec<f64>,
    /// The processes that plan anew before anything else happens.
    stale: Vec<u32>,
    is_stale: Vec<bool>,
    /// By process: its enabled outputs, as found when it planned; only where the spot is plain.
    enabled: Vec<Vec<u32>>,
    /// By process: where it is.
    locations: Vec<LocationId>,
    /// How many processes are in committed locations.
    committed: usize,
    windows: Windows,
    pub(super) motion: Motion,
    /// By process: whether its plan was found by looking along the motion of clocks. It reaches only
    /// until somebody moves.
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
    pub(super) time: f64,
    /// How many moves it has made.
    pub(super) moves: u64,
    /// When the moves since then are counted for [`Failure::Zeno`]: time and number.
    since: (f64, u64),
    /// The moves until plans are drawn anew that wait for a clock.
    until_renewal: u32,
}

impl<'a> Race<'a> {
    pub(super) fn new(
        network: &'a Network,
        executor: &'a dyn Executor,
        fixed_step: Option<f64>,
    ) -> Race<'a> {
        let processes = network.processes.len();
        Race {
            machine: Machine::new(network, executor),
            attempts: vec![f64::INFINITY; processes],
            bounds: vec![f64::INFINITY; processes],
            stale: Vec::with_capacity(processes),
            is_stale: vec![false; processes],
            enabled: vec![Vec::new(); processes],
            locations: vec![LocationId(0); processes],
            committed: 0,
            windows: Windows::default(),
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
        }
    }

    /// Goes back to the initial state.
    pub(super) fn start(
        &mut self,
        program: &Program<'a>,
        (seed, run): (u64, u64),
    ) -> Result<(), Failure> {
        self.machine.start(seed, run);
        self.time = 0.0;
        self.moves = 0;
        self.resume(program)
    }

    /// Plans for the state that the words of the machine hold now.
    pub(super) fn resume(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        self.since = (self.time, 0);
        self.until_renewal = MOVES_OF_A_PLAN;
        self.committed = 0;
        self.stale.clear();
        self.is_stepped.fill(false);
        self.motion.end();
        for process in 0..self.locations.len() {
            let location = self.machine.location(process);
            self.locations[process] = location;
            let spot = program.spot(process, location);
            self.committed += usize::from(spot.urgency == Urgency::Committed);
            self.is_stale[process] = true;
            self.stale.push(process as u32);
        }
        if program.has_rates {
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
    fn find_flows(&mut self, program: &Program<'a>) {
        if !program.has_flows {
            return;
        }
        let network = self.network();
        let flows = network
            .processes
            .iter()
            .enumerate()
            .filter_map(|(process, known)| {
                let stand = self.stand(process);
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
    pub(super) fn next(&mut self, program: &Program<'a>, rest: f64) -> Result<Next, Failure> {
        self.rest = rest;
        self.plan_anew(program)?;
        if self.committed > 0 {
            return self.next_committed(program);
        }
        let mut delay = f64::INFINITY;
        for &attempt in &self.attempts {
            delay = delay.min(attempt);
        }
        let mut least = f64::INFINITY;
        for &bound in &self.bounds {
            least = least.min(bound);
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
    fn next_at_the_latest(&mut self, program: &Program<'a>, least: f64) -> Result<Next, Failure> {
        let stopped_by = self.bounds.iter().position(|&bound| bound <= least);
        let mut winner = None;
        if least <= TOLERANCE {
            let all = 0..self.attempts.len();
            winner = self.one_with_outputs(program, all)?;
        }
        Ok(Next {
            delay: least,
            winner,
            stopped_by,
        })
    }

    /// What comes next where a committed location must be left.
    fn next_committed(&mut self, program: &Program<'a>) -> Result<Next, Failure> {
        let all = 0..self.attempts.len();
        let is_committed = |race: &Race<'_>, one: usize| race.urgency(one) == Urgency::Committed;
        let committed: Vec<usize> = all.clone().filter(|&one| is_committed(self, one)).collect();
        let by = committed[0];
        let mut winner = self.one_with_outputs(program, committed)?;
        if winner.is_none() && program.has_binary_channels {
            winner = self.one_with_outputs(program, all)?;
        }
        Ok(Next {
            delay: 0.0,
            winner,
            stopped_by: Some(by),
        })
    }

    /// One of the processes with an output that is enabled now.
    fn one_with_outputs(
        &mut self,
        program: &Program<'a>,
        processes: impl IntoIterator<Item = usize>,
    ) -> Result<Option<usize>, Failure> {
        let (mut winner, mut ties) = (None, 0);
        for process in processes {
            if !self.find_outputs(program, process)? {
                continue;
            }
            ties += 1;
            if ties == 1 || self.machine.stream().below(ties) == 0 {
                winner = Some(process);
            }
        }
        Ok(winner)
    }

    /// The failure of a run in which nobody moves and time cannot pass.
    pub(super) fn time_lock(&self, next: Next) -> Option<Failure> {
        let by = next.stopped_by.filter(|_| next.winner.is_none())?;
        Some(Failure::TimeLock(self.stand(by)))
    }

    /// Lets all processes plan whose plans may have changed.
    fn plan_anew(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        // The order of random numbers is that of processes. Those who look along the motion of
        // clocks come last, so that they need not look farther than to the first attempt.
        let is_stepped = &self.is_stepped;
        self.stale
            .sort_unstable_by_key(|&process| (is_stepped[process as usize], process));
        for index in 0..self.stale.len() {
            let process = self.stale[index] as usize;
            self.is_stale[process] = false;
            if self.is_stepped[process] {
                self.is_stepped[process] = false;
                self.attempts[process] = f64::INFINITY;
                let first = self.attempts.iter().copied().fold(self.rest, f64::min);
                self.until = first.max(0.0);
            } else {
                self.until = self.rest;
            }
            self.plan(program, process)?;
        }
        self.stale.clear();
        Ok(())
    }

    fn plan(&mut self, program: &Program<'a>, process: usize) -> Result<(), Failure> {
        let spot = program.spot(process, self.locations[process]);
        let bound = self.invariant_bound(program, spot, process)?;
        let is_urgent = spot.urgency != Urgency::Normal;
        self.bounds[process] = if is_urgent { 0.0 } else { bound };
        self.attempts[process] = if spot.is_plain {
            self.find_plain_outputs(program, spot, process)?;
            if self.enabled[process].is_empty() {
                f64::INFINITY
            } else if is_urgent {
                0.0
            } else if bound.is_finite() {
                bound * self.machine.stream().uniform()
            } else {
                let rate = self.exponential_rate(spot, process)?;
                if rate == 0.0 {
                    f64::INFINITY
                } else {
                    self.machine.stream().exponential(rate)
                }
            }
        } else if is_urgent {
            let mut is_enabled = false;
            for output in program.range(spot.outputs) {
                is_enabled = is_enabled || self.output(program, output, 0.0)?.now;
            }
            if is_enabled { 0.0 } else { f64::INFINITY }
        } else {
            self.draw(program, spot, process, bound)?
        };
        Ok(())
    }

    /// The outputs of a process whose guards do not change as time passes.
    fn find_plain_outputs(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<(), Failure> {
        self.enabled[process].clear();
        for number in spot.outputs.0..spot.outputs.1 {
            let output = program.instance(number);
            if self.holds(program, output.guard, &output.values)? {
                self.enabled[process].push(number);
            }
        }
        Ok(())
    }

    /// How long a process may stay where it is.
    fn invariant_bound(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        if self.steps(program, spot.invariant) {
            return self.stepped_bound(program, spot, process);
        }
        if let Condition::Compared(_) = spot.invariant {
            let span = self.span(program, spot.invariant, &[])?;
            let is_broken = |span: Option<Span>| span.is_none_or(|span| span.low > 0.0);
            if is_broken(span) {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            return Ok(span.map_or(0.0, |span| span.high));
        }
        let mut ahead = 0.0;
        for _ in 0..MOST_CHANGES {
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            if ahead == 0.0 && !mask.now {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            if !mask.behind {
                return Ok(ahead);
            }
            if mask.horizon.is_infinite() {
                return Ok(f64::INFINITY);
            }
            if ahead + mask.horizon <= ahead {
                break;
            }
            ahead += mask.horizon;
        }
        Err(Failure::NoProgress(self.stand(process)))
    }

    /// How long a process may stay where it is, if that is found by looking along the motion of
    /// clocks: not beyond the end of the run, but where a process without a rate needs to know, which
    /// is far beyond it.
    fn stepped_bound(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
    ) -> Result<f64, Failure> {
        self.is_stepped[process] = true;
        let until = self.until;
        let needs_bound = spot.exponential_rate.is_none() && spot.outputs.0 < spot.outputs.1;
        self.until = self.rest * if needs_bound { FAR_BEYOND } else { 1.0 };
        let mut ahead = 0.0;
        let found = loop {
            // When it changes again is not asked of an invariant that does not hold.
            let until = std::mem::replace(&mut self.until, ahead);
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            self.until = until;
            if ahead == 0.0 && !mask.now {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            if !mask.behind {
                break ahead;
            }
            let mask = self.mask_of(program, spot.invariant, &[], ahead)?;
            if mask.horizon.is_infinite() {
                break f64::INFINITY;
            }
            ahead += mask.horizon;
        };
        self.until = until;
        Ok(found)
    }

    /// Whether a condition is looked at along the motion of clocks.
    fn steps(&mut self, program: &Program<'a>, condition: Condition) -> bool {
        match condition {
            Condition::Curved(_) => true,
            Condition::Always | Condition::Never | Condition::Words(_) => false,
            Condition::Compared(_) | Condition::Timed(_) if !self.motion.is_flowing() => false,
            Condition::Compared(place) => {
                let mut bounds = program.comparisons(place).bounds.iter();
                bounds.any(|&(clock, _, _)| self.motion.flows(clock))
            }
            Condition::Timed(function) => self.reads_flow(function),
        }
    }

    /// Whether a function reads a clock that flows.
    pub(super) fn reads_flow(&mut self, function: FunctionId) -> bool {
        let network = self.network();
        let clocks = self
            .clocks_of
            .entry(function)
            .or_insert_with(|| clocks_of(network, function).into_boxed_slice());
        clocks.iter().any(|&clock| self.motion.flows(clock))
    }

    /// The delay of a process that may stay until `bound`.
    fn draw(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        process: usize,
        bound: f64,
    ) -> Result<f64, Failure> {
        let mut windows = std::mem::take(&mut self.windows);
        windows.clear();
        if bound.is_finite() {
            // A uniform delay is drawn from all of its windows.
            self.until = bound;
        }
        let urgent = self.output_windows(program, spot, bound, &mut windows);
        let delay =
            urgent.and_then(|urgent| Ok(self.drawn(spot, process, bound, &windows)?.min(urgent)));
        self.windows = windows;
        delay
    }

    fn drawn(
        &mut self,
        spot: &Spot,
        process: usize,
        bound: f64,
        windows: &Windows,
    ) -> Result<f64, Failure> {
        let Some(first) = windows.first() else {
            return Ok(f64::INFINITY);
        };
        let length = windows.length();
        if bound.is_finite() {
            let mut stream = self.machine.stream();
            if length > 0.0 {
                let part = stream.uniform();
                return Ok(windows.after(part * length));
            }
            let moments = windows.count() as u32;
            let chosen = if moments == 1 {
                0
            } else {
                stream.below(moments)
            };
            return Ok(windows.start_of(chosen as usize));
        }
        let rate = self.exponential_rate(spot, process)?;
        if rate == 0.0 {
            return Ok(f64::INFINITY);
        }
        if length == 0.0 {
            return Ok(first);
        }
        let passed = self.machine.stream().exponential(rate);
        Ok(windows.after(passed))
    }

    fn exponential_rate(&mut self, spot: &Spot, process: usize) -> Result<f64, Failure> {
        let rate = match spot.exponential_rate {
            None => return Err(Failure::NoRate(self.stand(process))),
            Some(Number::Known(rate)) => rate,
            Some(Number::Computed(rate)) => self.machine.real(rate, &[])?,
        };
        if rate >= 0.0 && rate.is_finite() {
            Ok(rate)
        } else {
            Err(Failure::Rate(self.stand(process), rate))
        }
    }

    /// Adds the times until `bound` at which an output of the process is enabled that is not on an
    /// urgent channel; returns the first at which one on an urgent channel is.
    fn output_windows(
        &mut self,
        program: &Program<'a>,
        spot: &Spot,
        bound: f64,
        windows: &mut Windows,
    ) -> Result<f64, Failure> {
        let mut urgent = f64::INFINITY;
        for instance in program.range(spot.outputs) {
            if instance.may_be_urgent && self.is_urgent(instance)? {
                // It is taken as soon as it can be, so no time is drawn for it.
                let mut all = Windows::default();
                let first = self.instance_windows(program, instance, bound, &mut all)?;
                urgent = urgent.min(first);
            } else {
                self.instance_windows(program, instance, bound, windows)?;
            }
        }
        Ok(urgent)
    }

    /// Adds the times until `bound` at which an instance is enabled; returns the first.
    fn instance_windows(
        &mut self,
        program: &Program<'a>,
        instance: &Instance<'a>,
        bound: f64,
        windows: &mut Windows,
    ) -> Result<f64, Failure> {
        let steps = self.steps(program, instance.guard);
        self.is_stepped[instance.process as usize] |= steps;
        if matches!(instance.guard, Condition::Compared(_)) && !instance.is_binary && !steps {
            let span = self.span(program, instance.guard, &instance.values)?;
            let latest = bound * (1.0 + TOLERANCE) + TOLERANCE;
            let Some(span) = span.filter(|span| span.low <= latest) else {
                return Ok(f64::INFINITY);
            };
            windows.add(span.low, span.high.min(bound).max(span.low));
            return Ok(span.low);
        }
        let (mut ahead, mut before) = (0.0, false);
        let mut first = f64::INFINITY;
        for _ in 0..MOST_CHANGES {
            let mask = self.output(program, instance, ahead)?;
            let end = (ahead + mask.horizon).min(bound);
            if mask.behind && ahead < bound {
                windows.add(ahead, end);
                first = first.min(ahead);
            } else if mask.now && !before {
                windows.add(ahead, ahead);
                first = first.min(ahead);
            }
            let next = ahead + mask.horizon;
            if next.is_infinite() || next > bound * (1.0 + TOLERANCE) + TOLERANCE {
                return Ok(first);
            }
            if next <= ahead {
                break;
            }
            before = mask.behind;
            ahead = next.min(bound);
        }
        Err(Failure::NoProgress(self.stand(instance.process as usize)))
    }

    /// Whether an instance is enabled after this time; a sender on a binary channel needs a
    /// receiver.
    fn output(
        &mut self,
        program: &Program<'a>,
        instance: &Instance<'a>,
        ahead: f64,
    ) -> Result<Mask, Failure> {
        let guard = self.mask_of(program, instance.guard, &instance.values, ahead)?;
        if !instance.is_binary || !(guard.now || guard.behind) {
            return Ok(guard);
        }
        let Some(channel) = self.channel(instance)? else {
            return Ok(guard);
        };
        if self.network().channels[channel as usize].broadcast {
            return Ok(guard);
        }
        let mut ready = Mask::constant(false);
        for &process in program.listeners(channel) {
            if process == instance.process {
                continue;
            }
            let inputs = program
                .spot(process as usize, self.locations[process as usize])
                .inputs;
            for receiver in program.range(inputs) {
                if self.channel(receiver)? == Some(channel) {
                    let mask = self.mask_of(program, receiver.guard, &receiver.values, ahead)?;
                    ready = ready.or(mask);
                }
            }
        }
        Ok(guard.and(ready))
    }

    fn channel(&mut self, instance: &Instance<'a>) -> Result<Option<u32>, Failure> {
        Ok(match instance.channel {
            Channel::None => None,
            Channel::Known(channel) => Some(channel),
            Channel::Computed(first, index) => {
                Some(first + self.machine.call(index, &instance.values)? as u32)
            }
        })
    }

    fn is_urgent(&mut self, instance: &Instance<'a>) -> Result<bool, Failure> {
        let channel = self.channel(instance)?;
        Ok(channel.is_some_and(|channel| self.network().channels[channel as usize].urgent))
    }

    /// When a conjunction of comparisons holds; `None` if never.
    #[inline]
    fn span(
        &mut self,
        program: &Program<'a>,
        condition: Condition,
        values: &[i32],
    ) -> Result<Option<Span>, Failure> {
        let Condition::Compared(place) = condition else {
            unreachable!("only comparisons are taken apart");
        };
        let comparisons = program.comparisons(place);
        if !self.machine.holds(comparisons.on_words, values)? {
            return Ok(None);
        }
        self.machine.span(comparisons, values)
    }

    /// Whether a condition holds now.
    #[inline]
    fn holds(
        &mut self,
        program: &Program<'a>,
        condition: Condition,
        values: &[i32],
    ) -> Result<bool, Failure> {
        if let Condition::Compared(_) = condition {
            let span = self.span(program, condition, values)?;
            return Ok(span.is_some_and(|span| span.low <= TOLERANCE));
        }
        self.machine.holds(condition, values)
    }

    /// A condition after this time, if nothing happens until then.
    fn mask_of(
        &mut self,
        program: &Program<'a>,
        condition: Condition,
        values: &[i32],
        ahead: f64,
    ) -> Result<Mask, Failure> {
        let steps = self.steps(program, condition);
        let whole = match condition {
            Condition::Compared(place) => Condition::Timed(program.comparisons(place).whole),
            other => other,
        };
        if let (true, Condition::Timed(function) | Condition::Curved(function)) = (steps, whole) {
            let asked = (function, values);
            return self
                .motion
                .mask(&mut self.machine, asked, ahead, self.until);
        }
        self.machine.mask(whole, values, ahead)
    }

    /// Puts the outputs of a process that are enabled now into `choices`: only those that leave a
    /// committed location if there is one. Returns whether there are any.
    fn find_outputs(&mut self, program: &Program<'a>, process: usize) -> Result<bool, Failure> {
        self.choices.clear();
        let spot = program.spot(process, self.locations[process]);
        let leaves_committed = self.committed == 0 || spot.urgency == Urgency::Committed;
        if spot.is_plain && !self.is_stale[process] {
            if leaves_committed {
                self.choices.extend_from_slice(&self.enabled[process]);
            }
            // None is on a binary channel, so that no partner can commit.
            return Ok(!self.choices.is_empty());
        }
        for number in spot.outputs.0..spot.outputs.1 {
            let instance = program.instance(number);
            let is_enabled = if instance.is_binary {
                self.output(program, instance, 0.0)?.now
            } else {
                self.holds(program, instance.guard, &instance.values)?
            };
            if !is_enabled {
                continue;
            }
            if leaves_committed || self.partner_commits(program, instance)? {
                self.choices.push(number);
            }
        }
        Ok(!self.choices.is_empty())
    }

    /// Whether somebody who can receive from a sender is in a committed location.
    fn partner_commits(
        &mut self,
        program: &Program<'a>,
        sender: &Instance<'a>,
    ) -> Result<bool, Failure> {
        let Some(channel) = self.channel(sender)? else {
            return Ok(false);
        };
        for &process in program.listeners(channel) {
            if process != sender.process && self.urgency(process as usize) == Urgency::Committed {
                let before = self.movers.len();
                self.add_ready(program, process, channel)?;
                let is_ready = self.movers.len() > before;
                self.movers.truncate(before);
                if is_ready {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Adds the receiving instances of a process on a channel that are enabled now to `movers`.
    fn add_ready(
        &mut self,
        program: &Program<'a>,
        process: u32,
        channel: u32,
    ) -> Result<(), Failure> {
        let inputs = program
            .spot(process as usize, self.locations[process as usize])
            .inputs;
        for number in inputs.0..inputs.1 {
            let input = program.instance(number);
            if self.channel(input)? == Some(channel)
                && self.holds(program, input.guard, &input.values)?
            {
                self.movers.push((number, 0));
            }
        }
        Ok(())
    }

    /// Lets time pass.
    pub(super) fn wait(&mut self, delay: f64) -> Result<(), Failure> {
        if delay > 0.0 {
            if self.motion.is_flowing() {
                self.motion.go_to(&mut self.machine, delay)?;
                self.motion.end();
            } else {
                self.machine.advance(delay);
            }
            self.time += delay;
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
    pub(super) fn take(&mut self, program: &Program<'a>, process: usize) -> Result<(), Failure> {
        self.motion.end();
        for process in 0..self.is_stepped.len() {
            if self.is_stepped[process] {
                self.make_stale(process as u32);
            }
        }
        if !self.find_outputs(program, process)? {
            // Rounding has put the delay beside the window: it is drawn again.
            self.make_stale(process as u32);
            return self.count_move(process, false);
        }
        let chosen = match self.choices[..] {
            [only] => only,
            ref many => many[self.machine.stream().below(many.len() as u32) as usize],
        };
        self.movers.clear();
        self.movers.push((chosen, 0));
        let sender = program.instance(chosen);
        if let Some(channel) = self.channel(sender)? {
            self.add_receivers(program, sender, channel)?;
        }
        self.carry_out(program)?;
        self.until_renewal -= 1;
        if self.until_renewal == 0 {
            self.renew(program);
        }
        self.count_move(process, true)
    }

    /// Makes plans stale that wait for a clock.
    fn renew(&mut self, program: &Program<'a>) {
        self.until_renewal = MOVES_OF_A_PLAN;
        for process in 0..self.locations.len() {
            let spot = program.spot(process, self.locations[process]);
            if !spot.is_plain || spot.invariant.is_timed() {
                self.make_stale(process as u32);
            }
        }
    }

    fn add_receivers(
        &mut self,
        program: &Program<'a>,
        sender: &Instance<'a>,
        channel: u32,
    ) -> Result<(), Failure> {
        let is_broadcast = self.network().channels[channel as usize].broadcast;
        let needs_commitment = !is_broadcast
            && self.committed > 0
            && self.urgency(sender.process as usize) != Urgency::Committed;
        let mut first = self.movers.len();
        for &process in program.listeners(channel) {
            if process == sender.process
                || (needs_commitment && self.urgency(process as usize) != Urgency::Committed)
            {
                continue;
            }
            self.add_ready(program, process, channel)?;
            if is_broadcast {
                self.keep_one(first);
                first = self.movers.len();
            }
        }
        if !is_broadcast {
            self.keep_one(first);
        }
        Ok(())
    }

    /// Keeps one of the movers from this place on.
    fn keep_one(&mut self, first: usize) {
        let many = self.movers.len() - first;
        if many > 1 {
            let chosen = self.machine.stream().below(many as u32) as usize;
            self.movers.swap(first, first + chosen);
            self.movers.truncate(first + 1);
        }
    }

    /// Runs the updates of those who move, the sender first, and lets them enter their locations.
    fn carry_out(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        let network = self.network();
        for index in 0..self.movers.len() {
            let mover = program.instance(self.movers[index].0);
            if mover.edge.branches.len() > 1 {
                self.movers[index].1 = self.branch(program, mover)?;
            }
        }
        if let Some(update) = &network.before_update {
            self.machine.update(update, &[])?;
        }
        for index in 0..self.movers.len() {
            let (number, branch) = self.movers[index];
            let mover = program.instance(number);
            let branch: &Branch = &mover.edge.branches[branch as usize];
            self.update(&mover.edge.update, &mover.values)?;
            self.update(&branch.update, &mover.values)?;
        }
        for index in 0..self.movers.len() {
            let (number, branch) = self.movers[index];
            let mover = program.instance(number);
            self.enter(program, mover, branch as usize);
        }
        if let Some(update) = &network.after_update {
            self.machine.update(update, &[])?;
        }
        if program.has_rates {
            self.renew_rates(program)?;
        }
        Ok(())
    }

    #[inline]
    fn update(&mut self, update: &Update, values: &[i32]) -> Result<(), Failure> {
        if update.function.is_some() {
            self.machine.update(update, values)?;
        }
        Ok(())
    }

    /// Lets a mover enter the target of its branch, and finds who plans anew.
    fn enter(&mut self, program: &Program<'a>, mover: &Instance<'a>, branch: usize) {
        let process = mover.process as usize;
        let id = ProcessId(mover.process);
        let target = mover.edge.branches[branch].target;
        self.make_stale(mover.process);
        for &concerned in program.concerned(mover, branch) {
            self.make_stale(concerned);
        }
        let before = self.locations[process];
        if target == before {
            return;
        }
        let is_committed =
            |location| usize::from(program.spot(process, location).urgency == Urgency::Committed);
        self.committed += is_committed(target);
        self.committed -= is_committed(before);
        self.locations[process] = target;
        self.machine.enter(id, target);
        for &follower in program.followers(id) {
            self.make_stale(follower);
        }
    }

    /// The branch that a mover takes: by weight.
    fn branch(&mut self, program: &Program<'a>, mover: &Instance<'a>) -> Result<u32, Failure> {
        let branches = &mover.edge.branches;
        let stand = self.stand(mover.process as usize);
        let mut weights = Vec::with_capacity(branches.len());
        for branch in 0..branches.len() {
            let weight = match program.weight(mover, branch) {
                Number::Known(weight) => weight,
                Number::Computed(weight) => self.machine.real(weight, &mover.values)?,
            };
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(Failure::Weight(stand, mover.id));
            }
            weights.push(weight);
        }
        let total: f64 = weights.iter().sum();
        let mut rest = self.machine.stream().uniform() * total;
        let mut chosen = None;
        for (branch, weight) in weights.into_iter().enumerate() {
            if weight > 0.0 {
                // The last one takes what rounding leaves.
                chosen = Some(branch as u32);
                if rest < weight {
                    break;
                }
                rest -= weight;
            }
        }
        chosen.ok_or(Failure::NoWeight(stand, mover.id))
    }

    /// Gives the clocks their rates anew of which a stale process sets some, and finds whose plans
    /// that concerns.
    fn renew_rates(&mut self, program: &Program<'a>) -> Result<(), Failure> {
        let network = self.network();
        let clocks = &network.chances.clocks;
        let before: Vec<f64> = clocks
            .iter()
            .map(|&clock| self.machine.clock(clock).1)
            .collect();
        for (place, &clock) in clocks.iter().enumerate() {
            if self.rated_by[place].is_some() {
                self.rated_by[place] = None;
                self.machine.set_rate(clock, 1.0);
            }
        }
        for process in 0..self.locations.len() {
            self.set_rates(process)?;
        }
        self.find_flows(program);
        for (&clock, before) in clocks.iter().zip(before) {
            if !self.motion.flows(clock)
                && self.machine.clock(clock).1.to_bits() != before.to_bits()
                && let Some(readers) = program.rate_readers.get(&clock)
            {
                for &reader in readers {
                    self.make_stale(reader);
                }
            }
        }
        Ok(())
    }

    /// Lets the location of a process set the rates of clocks.
    fn set_rates(&mut self, process: usize) -> Result<(), Failure> {
        let network = self.network();
        let LocationId(location) = self.locations[process];
        let chances = &network.processes[process].locations[location as usize].chances;
        let Some(rates) = chances.rates else {
            return Ok(());
        };
        let place = |clock: &u32| {
            let place = network.chances.clocks.binary_search(clock);
            place.expect("the clocks of the network are ascending, and all of them")
        };
        for clock in &chances.rated_clocks {
            let rated_by = &mut self.rated_by[place(clock)];
            if let Some(other) = *rated_by {
                let (first, second) = (self.stand(other as usize), self.stand(process));
                return Err(Failure::RatesConflict(first, second));
            }
            *rated_by = Some(process as u32);
        }
        self.machine.call(rates, &[])?;
        for &clock in &chances.rated_clocks {
            if !self.machine.clock(clock).1.is_finite() {
                return Err(Failure::ClockRate(self.stand(process)));
            }
        }
        Ok(())
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
    pub(super) fn forget_moves(&mut self) {
        self.since = (self.time, 0);
    }
}

impl Race<'_> {
    /// What a condition of a query says of the state after this time; changes are looked for until
    /// the delay is over.
    pub(super) fn mask(
        &mut self,
        condition: Condition,
        ahead: f64,
        delay: f64,
    ) -> Result<Mask, Failure> {
        let function = match condition {
            Condition::Curved(function) => function,
            Condition::Timed(function) if self.motion.is_flowing() && self.reads_flow(function) => {
                function
            }
            _ => return self.machine.mask(condition, &[], ahead),
        };
        let asked: (FunctionId, &[i32]) = (function, &[]);
        self.motion.mask(&mut self.machine, asked, ahead, delay)
    }

    /// Looks at the state after this time, if nothing happens until then.
    pub(super) fn look_ahead<R>(
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
