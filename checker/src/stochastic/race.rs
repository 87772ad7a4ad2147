//! The race: every process draws a delay, the least wins, and the winner moves.
//!
//! A process competes with its *outputs*: internal edges and sending edges. Its delay is drawn
//! among the times at which one of them is enabled: uniformly if its invariant bounds them, else by
//! the exponential distribution with the rate of its location, of which only those times count.
//! Drawing anew after every move gives the same law as keeping what was drawn: both distributions,
//! conditioned on "not yet", are themselves again.
//!
//! Where time stands still (urgent and committed locations), and at the first moment at which an
//! urgent channel can be used, the delay is 0 and every process with an output competes.
//! The winner takes one of its outputs, all with the same chance; a sender on a binary channel
//! competes while a receiver is ready, and takes one of them.
//!
//! Source: A. David et al., "Uppaal SMC tutorial", STTT 17 (2015), sections 2 and 3.

use super::failure::{Failure, Stand};
use super::machine::{Machine, Mask};
use super::windows::Windows;
use crate::exec::Executor;
use crate::ir::{Branch, Edge, EdgeId, LocationId, Network, ProcessId, Sync, Urgency};

/// So many moves in less than [`ZENO_TIME`] are taken for a run that never gets on.
pub const ZENO_MOVES: u64 = 100_000;
/// The time that so many moves must take, in units of the model.
pub const ZENO_TIME: f64 = 1e-6;

/// Delays that differ by less than this part, and less than this, are the same.
const TOLERANCE: f64 = 1e-12;

/// The changes of a condition that are followed within one delay.
const MOST_CHANGES: usize = 100_000;

/// What comes next: the delay until then, and who moves; nobody if it is infinite.
#[derive(Clone, Copy, Debug)]
pub(super) struct Next {
    pub(super) delay: f64,
    pub(super) winner: Option<usize>,
    /// Who keeps time from passing beyond the delay, if nobody moves then.
    stopped_by: Option<usize>,
}

/// An edge with the values of its `select` bindings.
#[derive(Clone, Debug)]
struct Instance {
    process: usize,
    edge: EdgeId,
    values: Vec<i32>,
}

/// A run in progress.
pub(super) struct Race<'a> {
    pub(super) machine: Machine<'a>,
    has_rates: bool,
    windows: Windows,
    /// How long the run has lasted.
    pub(super) time: f64,
    /// How many moves it has made.
    pub(super) moves: u64,
    /// When the moves since then are counted for [`Failure::Zeno`]: time and number.
    since: (f64, u64),
}

impl<'a> Race<'a> {
    pub(super) fn new(network: &'a Network, executor: &'a dyn Executor) -> Race<'a> {
        let mut locations = network.processes.iter().flat_map(|one| &one.locations);
        Race {
            machine: Machine::new(network, executor),
            has_rates: locations.any(|location| location.chances.rates.is_some()),
            windows: Windows::default(),
            time: 0.0,
            moves: 0,
            since: (0.0, 0),
        }
    }

    /// Goes back to the initial state.
    pub(super) fn start(&mut self, seed: u64, run: u64) -> Result<(), Failure> {
        self.machine.start(seed, run);
        self.time = 0.0;
        self.moves = 0;
        self.since = (0.0, 0);
        self.set_rates()
    }

    fn network(&self) -> &'a Network {
        self.machine.network
    }

    fn stand(&self, process: usize) -> Stand {
        Stand {
            process: ProcessId(process as u32),
            location: self.machine.location(process),
        }
    }

    fn urgency(&self, process: usize) -> Urgency {
        let LocationId(location) = self.machine.location(process);
        self.network().processes[process].locations[location as usize].urgency
    }

    /// Draws what comes next.
    pub(super) fn next(&mut self) -> Result<Next, Failure> {
        let processes = 0..self.network().processes.len();
        let mut frozen = None;
        for process in processes.clone() {
            let bound = self.invariant(process, 0.0)?;
            if !bound.now {
                return Err(Failure::InvariantBroken(self.stand(process)));
            }
            if self.urgency(process) != Urgency::Normal {
                frozen = frozen.or(Some(process));
            }
        }
        if let Some(process) = frozen {
            return self.next_without_time(process);
        }
        let mut best = Next {
            delay: f64::INFINITY,
            winner: None,
            stopped_by: None,
        };
        let (mut ties, mut least, mut least_of) = (0, f64::INFINITY, None);
        for process in processes {
            let bound = self.invariant_bound(process)?;
            if bound < least {
                (least, least_of) = (bound, Some(process));
            }
            let delay = self.draw(process, bound)?;
            if delay < best.delay {
                best.delay = delay;
                best.winner = Some(process);
                ties = 1;
            } else if delay <= best.delay && delay.is_finite() {
                ties += 1;
                if self.machine.stream().below(ties) == 0 {
                    best.winner = Some(process);
                }
            }
        }
        if best.delay > least * (1.0 + TOLERANCE) + TOLERANCE {
            return Ok(Next {
                delay: least,
                winner: None,
                stopped_by: least_of,
            });
        }
        Ok(best)
    }

    /// What comes next where time stands still because of this process.
    fn next_without_time(&mut self, by: usize) -> Result<Next, Failure> {
        let (mut winner, mut ties) = (None, 0);
        for process in 0..self.network().processes.len() {
            if self.outputs(process)?.is_empty() {
                continue;
            }
            ties += 1;
            if ties == 1 || self.machine.stream().below(ties) == 0 {
                winner = Some(process);
            }
        }
        Ok(Next {
            delay: 0.0,
            winner,
            stopped_by: Some(by),
        })
    }

    /// The failure of a run in which nobody moves and time cannot pass.
    pub(super) fn time_lock(&self, next: Next) -> Option<Failure> {
        let by = next.stopped_by.filter(|_| next.winner.is_none())?;
        Some(Failure::TimeLock(self.stand(by)))
    }

    fn invariant(&mut self, process: usize, ahead: f64) -> Result<Mask, Failure> {
        let LocationId(location) = self.machine.location(process);
        let location = &self.network().processes[process].locations[location as usize];
        self.machine.mask(&location.invariant, &[], ahead)
    }

    /// How long a process may stay where it is.
    fn invariant_bound(&mut self, process: usize) -> Result<f64, Failure> {
        let mut ahead = 0.0;
        for _ in 0..MOST_CHANGES {
            let mask = self.invariant(process, ahead)?;
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

    /// The delay of a process that may stay until `bound`.
    fn draw(&mut self, process: usize, bound: f64) -> Result<f64, Failure> {
        let mut windows = std::mem::take(&mut self.windows);
        windows.clear();
        let urgent = self.output_windows(process, bound, &mut windows);
        let delay = urgent.and_then(|urgent| Ok(self.drawn(process, bound, &windows)?.min(urgent)));
        self.windows = windows;
        delay
    }

    fn drawn(&mut self, process: usize, bound: f64, windows: &Windows) -> Result<f64, Failure> {
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
        let stand = self.stand(process);
        let location = stand.location.0 as usize;
        let chances = &self.network().processes[process].locations[location].chances;
        let Some(rate) = chances.exponential_rate else {
            return Err(Failure::NoRate(stand));
        };
        let rate = self.machine.real(rate, &[])?;
        if !(rate >= 0.0 && rate.is_finite()) {
            return Err(Failure::Rate(stand, rate));
        }
        if rate == 0.0 {
            return Ok(f64::INFINITY);
        }
        if length == 0.0 {
            return Ok(first);
        }
        let passed = self.machine.stream().exponential(rate);
        Ok(windows.after(passed))
    }

    /// Adds the times until `bound` at which an output of the process is enabled that is not on an
    /// urgent channel; returns the first at which one on an urgent channel is.
    fn output_windows(
        &mut self,
        process: usize,
        bound: f64,
        windows: &mut Windows,
    ) -> Result<f64, Failure> {
        let mut urgent = f64::INFINITY;
        for &edge in self.machine.edges(process) {
            let instances = self.instances(process, edge, true);
            for instance in instances {
                if self.is_urgent(&instance)? {
                    // It is taken as soon as it can be, so no time is drawn for it.
                    let mut all = Windows::default();
                    urgent = urgent.min(self.instance_windows(&instance, bound, &mut all)?);
                } else {
                    self.instance_windows(&instance, bound, windows)?;
                }
            }
        }
        Ok(urgent)
    }

    /// Adds the times until `bound` at which an instance is enabled; returns the first.
    fn instance_windows(
        &mut self,
        instance: &Instance,
        bound: f64,
        windows: &mut Windows,
    ) -> Result<f64, Failure> {
        let (mut ahead, mut before) = (0.0, false);
        let mut first = f64::INFINITY;
        for _ in 0..MOST_CHANGES {
            let mask = self.output(instance, ahead)?;
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
        Err(Failure::NoProgress(self.stand(instance.process)))
    }

    /// Whether an instance is enabled after this time; a sender on a binary channel needs a
    /// receiver.
    fn output(&mut self, instance: &Instance, ahead: f64) -> Result<Mask, Failure> {
        let edge = self.edge(instance);
        let guard = self.machine.mask(&edge.guard, &instance.values, ahead)?;
        let Some(sync) = edge.sync.filter(|_| guard.now || guard.behind) else {
            return Ok(guard);
        };
        let channel = self.channel(sync, &instance.values)?;
        if self.network().channels[channel as usize].broadcast {
            return Ok(guard);
        }
        let mut ready = Mask::constant(false);
        for process in (0..self.network().processes.len()).filter(|&one| one != instance.process) {
            for receiver in self.receivers(process, channel)? {
                let edge = self.edge(&receiver);
                ready = ready.or(self.machine.mask(&edge.guard, &receiver.values, ahead)?);
            }
        }
        Ok(guard.and(ready))
    }

    fn edge(&self, instance: &Instance) -> &'a Edge {
        &self.network().processes[instance.process].edges[instance.edge.0 as usize]
    }

    fn channel(&mut self, sync: Sync, values: &[i32]) -> Result<u32, Failure> {
        Ok(match sync.index {
            None => sync.channel.0,
            Some(index) => sync.channel.0 + self.machine.call(index, values)? as u32,
        })
    }

    fn is_urgent(&mut self, instance: &Instance) -> Result<bool, Failure> {
        let Some(sync) = self.edge(instance).sync else {
            return Ok(false);
        };
        let channel = self.channel(sync, &instance.values)?;
        Ok(self.network().channels[channel as usize].urgent)
    }

    /// The instances of an edge, if it is an output (or, if that is not wanted, if it receives).
    fn instances(&self, process: usize, edge: EdgeId, outputs: bool) -> Vec<Instance> {
        let known = &self.network().processes[process].edges[edge.0 as usize];
        let is_output = known.sync.is_none_or(|sync| sync.send);
        if is_output != outputs {
            return Vec::new();
        }
        let mut values: Vec<i32> = known.select.iter().map(|one| one.low).collect();
        let mut instances = Vec::new();
        loop {
            instances.push(Instance {
                process,
                edge,
                values: values.clone(),
            });
            let mut place = values.len();
            loop {
                if place == 0 {
                    return instances;
                }
                place -= 1;
                if values[place] < known.select[place].high {
                    values[place] += 1;
                    break;
                }
                values[place] = known.select[place].low;
            }
        }
    }

    /// The receiving instances of a process on a channel, whatever their guards say.
    fn receivers(&mut self, process: usize, channel: u32) -> Result<Vec<Instance>, Failure> {
        let mut found = Vec::new();
        for &edge in self.machine.edges(process) {
            for instance in self.instances(process, edge, false) {
                let Some(sync) = self.edge(&instance).sync else {
                    continue;
                };
                if self.channel(sync, &instance.values)? == channel {
                    found.push(instance);
                }
            }
        }
        Ok(found)
    }

    /// The receiving instances that are enabled now.
    fn ready(&mut self, process: usize, channel: u32) -> Result<Vec<Instance>, Failure> {
        let mut ready = Vec::new();
        for instance in self.receivers(process, channel)? {
            let edge = self.edge(&instance);
            if self.machine.mask(&edge.guard, &instance.values, 0.0)?.now {
                ready.push(instance);
            }
        }
        Ok(ready)
    }

    /// The outputs of a process that are enabled now: only those that leave a committed location if
    /// there is one.
    fn outputs(&mut self, process: usize) -> Result<Vec<Instance>, Failure> {
        let all = 0..self.network().processes.len();
        let is_committed = |race: &Race<'_>, one| race.urgency(one) == Urgency::Committed;
        let must_commit = all.clone().any(|one| is_committed(self, one));
        let leaves_committed = !must_commit || is_committed(self, process);
        let mut enabled = Vec::new();
        for &edge in self.machine.edges(process) {
            for instance in self.instances(process, edge, true) {
                if !self.output(&instance, 0.0)?.now {
                    continue;
                }
                if leaves_committed || self.partner_commits(&instance)? {
                    enabled.push(instance);
                }
            }
        }
        Ok(enabled)
    }

    /// Whether somebody who can receive from a sender is in a committed location.
    fn partner_commits(&mut self, sender: &Instance) -> Result<bool, Failure> {
        let Some(sync) = self.edge(sender).sync else {
            return Ok(false);
        };
        let channel = self.channel(sync, &sender.values)?;
        for process in 0..self.network().processes.len() {
            if process != sender.process
                && self.urgency(process) == Urgency::Committed
                && !self.ready(process, channel)?.is_empty()
            {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Lets time pass.
    pub(super) fn wait(&mut self, delay: f64) {
        self.machine.advance(delay);
        self.time += delay;
    }

    /// Lets a process move, if it can after all.
    pub(super) fn take(&mut self, process: usize) -> Result<(), Failure> {
        let outputs = self.outputs(process)?;
        let Some(sender) = self.one_of(&outputs) else {
            // Rounding has put the delay beside the window: it is drawn again.
            return self.count_move(process, false);
        };
        let mut movers = vec![sender.clone()];
        if let Some(sync) = self.edge(&sender).sync {
            let channel = self.channel(sync, &sender.values)?;
            self.add_receivers(&sender, channel, &mut movers)?;
        }
        self.carry_out(&movers)?;
        self.count_move(process, true)
    }

    fn one_of(&mut self, instances: &[Instance]) -> Option<Instance> {
        match instances {
            [] => None,
            [one] => Some(one.clone()),
            many => {
                let chosen = self.machine.stream().below(many.len() as u32);
                Some(many[chosen as usize].clone())
            }
        }
    }

    fn add_receivers(
        &mut self,
        sender: &Instance,
        channel: u32,
        movers: &mut Vec<Instance>,
    ) -> Result<(), Failure> {
        let is_broadcast = self.network().channels[channel as usize].broadcast;
        let needs_commitment = !is_broadcast
            && self.urgency(sender.process) != Urgency::Committed
            && (0..self.network().processes.len())
                .any(|one| self.urgency(one) == Urgency::Committed);
        let mut all = Vec::new();
        for process in (0..self.network().processes.len()).filter(|&one| one != sender.process) {
            if needs_commitment && self.urgency(process) != Urgency::Committed {
                continue;
            }
            let ready = self.ready(process, channel)?;
            if is_broadcast {
                movers.extend(self.one_of(&ready));
            } else {
                all.extend(ready);
            }
        }
        movers.extend(self.one_of(&all));
        Ok(())
    }

    /// Runs the updates of those who move, the sender first, and lets them enter their locations.
    fn carry_out(&mut self, movers: &[Instance]) -> Result<(), Failure> {
        let network = self.network();
        let mut branches = Vec::with_capacity(movers.len());
        for mover in movers {
            branches.push(self.branch(mover)?);
        }
        if let Some(update) = &network.before_update {
            self.machine.update(update, &[])?;
        }
        for (mover, branch) in movers.iter().zip(&branches) {
            self.machine
                .update(&self.edge(mover).update, &mover.values)?;
            self.machine.update(&branch.update, &mover.values)?;
        }
        for (mover, branch) in movers.iter().zip(&branches) {
            let process = ProcessId(mover.process as u32);
            self.machine.enter(process, branch.target);
        }
        if let Some(update) = &network.after_update {
            self.machine.update(update, &[])?;
        }
        self.set_rates()
    }

    /// The branch that a mover takes: by weight.
    fn branch(&mut self, mover: &Instance) -> Result<&'a Branch, Failure> {
        let branches = &self.edge(mover).branches;
        if let [only] = &branches[..] {
            return Ok(only);
        }
        let stand = self.stand(mover.process);
        let mut weights = Vec::with_capacity(branches.len());
        for branch in branches {
            let weight = match branch.weight {
                Some(weight) => self.machine.real(weight, &mover.values)?,
                None => 1.0,
            };
            if !(weight >= 0.0 && weight.is_finite()) {
                return Err(Failure::Weight(stand, mover.edge));
            }
            weights.push(weight);
        }
        let total: f64 = weights.iter().sum();
        let mut rest = self.machine.stream().uniform() * total;
        let mut chosen = None;
        for (branch, weight) in branches.iter().zip(weights) {
            if weight > 0.0 {
                // The last one takes what rounding leaves.
                chosen = Some(branch);
                if rest < weight {
                    break;
                }
                rest -= weight;
            }
        }
        chosen.ok_or(Failure::NoWeight(stand, mover.edge))
    }

    /// Gives every clock its rate: that of a location, else 1.
    fn set_rates(&mut self) -> Result<(), Failure> {
        if !self.has_rates {
            return Ok(());
        }
        let network = self.network();
        for &clock in &network.chances.clocks {
            self.machine.set_rate(clock, 1.0);
        }
        let mut rated: Vec<(u32, usize)> = Vec::new();
        for (process, known) in network.processes.iter().enumerate() {
            let LocationId(location) = self.machine.location(process);
            let chances = &known.locations[location as usize].chances;
            let Some(rates) = chances.rates else { continue };
            for &clock in &chances.rated_clocks {
                if let Some(&(_, other)) = rated.iter().find(|one| one.0 == clock) {
                    let (first, second) = (self.stand(other), self.stand(process));
                    return Err(Failure::RatesConflict(first, second));
                }
                rated.push((clock, process));
            }
            self.machine.call(rates, &[])?;
            for &clock in &chances.rated_clocks {
                if !self.machine.clock(clock).1.is_finite() {
                    return Err(Failure::ClockRate(self.stand(process)));
                }
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
