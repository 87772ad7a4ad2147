//! What a move does: receivers and branches are chosen, updates run, locations are entered, rates
//! set, and those found who plan anew.

use std::cell::Cell;

use super::Race;
use crate::ir::{Branch, LocationId, ProcessId, Update, Urgency};
use crate::stochastic::constants::MOVES_OF_A_PLAN;
use crate::stochastic::failure::Failure;
use crate::stochastic::program::{Instance, Program};
use crate::stochastic::readers::Reader;
use crate::stochastic::rules::{self, Backend, Candidate};

impl Race<'_> {
    /// Makes plans stale that wait for a clock.
    pub(super) fn renew(&mut self, program: &Program<'_>) {
        self.until_renewal = MOVES_OF_A_PLAN;
        for process in 0..self.locations.len() {
            let spot = program.spot(process, self.locations[process]);
            if spot.waits_for_a_clock() {
                self.make_stale(process as u32);
            }
        }
    }

    pub(super) fn add_receivers(
        &mut self,
        program: &Program<'_>,
        sender: &Instance<'_>,
        channel: u32,
    ) -> Result<(), Failure> {
        let is_broadcast = self.network().channels[channel as usize].broadcast;
        let needs_commitment = !is_broadcast
            && self.committed > 0
            && self.urgency(sender.process as usize) != Urgency::Committed;
        let mut first = self.movers.len();
        for &process in program.receivers(channel) {
            if process == sender.process
                || (needs_commitment && self.urgency(process as usize) != Urgency::Committed)
            {
                continue;
            }
            self.add_ready(program, process, channel)?;
            if is_broadcast {
                self.keep_one(program, first)?;
                first = self.movers.len();
            }
        }
        if !is_broadcast {
            self.keep_one(program, first)?;
        }
        Ok(())
    }

    /// Keeps one of the movers from this place on.
    pub(super) fn keep_one(&mut self, program: &Program<'_>, first: usize) -> Result<(), Failure> {
        if self.movers.len() > first {
            let inputs: Vec<u32> = self.movers.drain(first..).map(|mover| mover.0).collect();
            let chosen = self.one_of(program, &inputs)?;
            self.movers.push((chosen, 0));
        }
        Ok(())
    }

    /// One of some enabled instances, of which there are any.
    pub(super) fn one_of(
        &mut self,
        program: &Program<'_>,
        instances: &[u32],
    ) -> Result<u32, Failure> {
        if let [only] = *instances
            && program.instance(only).edge.leg.is_none()
        {
            return Ok(only);
        }
        let candidates = instances.iter().map(|&number| Candidate {
            instance: program.instance(number),
            number: number as i32,
            flag: None,
        });
        let chosen = Cell::new(0);
        self.attempt(|race, none| {
            chosen.set(rules::one_of(race, program, candidates.clone(), none)?);
            Ok(())
        })?;
        Ok(chosen.get() as u32)
    }

    /// Runs the updates of those who move, the sender first, and lets them enter their locations.
    pub(super) fn carry_out(&mut self, program: &Program<'_>) -> Result<(), Failure> {
        let network = self.network();
        for index in 0..self.movers.len() {
            let mover = program.instance(self.movers[index].0);
            if mover.edge.branches.len() > 1 {
                self.movers[index].1 = rules::branch(self, program, mover)? as u32;
            }
        }
        self.run_updates(program)?;
        for index in 0..self.movers.len() {
            let (number, branch) = self.movers[index];
            let mover = program.instance(number);
            self.enter(program, mover, branch as usize);
        }
        if let Some(update) = &network.after_update {
            self.machine.update(update, &[])?;
        }
        // Whoever sets rates that may have changed is stale.
        let mut rated = program.rated.iter();
        if rated.any(|&process| self.is_stale[process as usize]) {
            self.renew_rates(program)?;
        }
        Ok(())
    }

    /// Runs what comes before the updates of a move, and these, the sender's first.
    pub(super) fn run_updates(&mut self, program: &Program<'_>) -> Result<(), Failure> {
        if let Some(update) = &self.network().before_update {
            self.machine.update(update, &[])?;
        }
        for index in 0..self.movers.len() {
            let (number, branch) = self.movers[index];
            let mover = program.instance(number);
            let branch: &Branch = &mover.edge.branches[branch as usize];
            self.update(&mover.edge.update, &mover.values)?;
            self.update(&branch.update, &mover.values)?;
        }
        Ok(())
    }

    pub(super) fn update(&mut self, update: &Update, values: &[i32]) -> Result<(), Failure> {
        if update.function.is_some() {
            self.machine.update(update, values)?;
        }
        Ok(())
    }

    /// Lets a mover enter the target of its branch, and finds who plans anew.
    pub(super) fn enter(&mut self, program: &Program<'_>, mover: &Instance<'_>, branch: usize) {
        self.make_stale(mover.process);
        self.make_readers_stale(program.concerned(mover, branch));
        for &placed in program.placed(mover, branch) {
            let location = self.machine.location(placed as usize);
            self.place(program, placed, location);
        }
        let target = mover.edge.branches[branch].target;
        self.machine.enter(ProcessId(mover.process), target);
        self.place(program, mover.process, target);
    }

    /// Lets those plan anew who are where their plans depend on what has changed.
    fn make_readers_stale(&mut self, readers: &[Reader]) {
        for &Reader { process, location } in readers {
            let LocationId(is_at) = self.locations[process as usize];
            if location.is_none_or(|location| location == is_at) {
                self.make_stale(process);
            }
        }
    }

    /// Notes where a process is now.
    fn place(&mut self, program: &Program<'_>, process: u32, location: LocationId) {
        let before = self.locations[process as usize];
        if location == before {
            return;
        }
        let is_committed = |location| {
            let spot = program.spot(process as usize, location);
            usize::from(spot.urgency == Urgency::Committed)
        };
        self.committed += is_committed(location);
        self.committed -= is_committed(before);
        self.locations[process as usize] = location;
        self.make_stale(process);
        for &follower in program.followers(ProcessId(process)) {
            self.make_stale(follower);
        }
    }

    /// Gives the clocks their rates anew of which a stale process sets some, and finds whose plans
    /// that concerns.
    pub(super) fn renew_rates(&mut self, program: &Program<'_>) -> Result<(), Failure> {
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
        for &process in &program.rated {
            self.set_rates(process as usize)?;
        }
        self.find_flows(program);
        for (&clock, before) in clocks.iter().zip(before) {
            if !self.motion.flows(clock)
                && self.machine.clock(clock).1.to_bits() != before.to_bits()
                && let Some(readers) = program.rate_readers.get(&clock)
            {
                self.make_readers_stale(readers);
            }
        }
        Ok(())
    }

    /// Lets the location of a process set the rates of clocks.
    pub(super) fn set_rates(&mut self, process: usize) -> Result<(), Failure> {
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
}
