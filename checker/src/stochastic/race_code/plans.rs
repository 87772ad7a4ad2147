//! Code for what processes plan, as `stochastic/race/planning.rs` says it.

use super::race_writer::RaceWriter;
use crate::ir::{BlockId, Function, FunctionId, Register, RegisterType, Urgency};
use crate::stochastic::condition::Condition;
use crate::stochastic::program::Spot;
use crate::stochastic::rules::{self, Backend};

impl RaceWriter<'_, '_> {
    /// The function that lets a process plan in a location.
    pub(super) fn plan_in(&self, process: usize, location: usize) -> Function {
        let name = format!("plan of process {process} in location {location}");
        let mut w = self.writer(&name, 0, None);
        let spot = &self.program.spots_of(process)[location];
        let Ok(()) = rules::plan(&mut w, self.program, process, spot);
        w.return_value(None);
        w.finish()
    }

    /// The function that lets a process plan wherever it is.
    pub(super) fn plan(&self, process: usize, by_location: &[Option<FunctionId>]) -> Function {
        let mut w = self.writer(&format!("plan of process {process}"), 0, None);
        let location = w.load(process as u32);
        let (idle, wrong) = (w.block(), w.block());
        let mut places = Vec::new();
        let mut calls = Vec::new();
        for (spot, &function) in self.program.spots_of(process).iter().zip(by_location) {
            places.push(match function {
                None => wrong,
                Some(_) if is_idle(spot) => idle,
                Some(function) => {
                    let block = w.block();
                    calls.push((block, function));
                    block
                }
            });
        }
        w.switch(location, places, wrong);
        for (block, function) in calls {
            w.at(block);
            w.call(function, &[]);
            w.return_value(None);
        }
        w.at(idle);
        w.set_plan(process, None, None, false);
        w.return_value(None);
        w.at(wrong);
        w.give_up();
        w.finish()
    }

    /// The function that gives up unless the invariant of a process holds; `None` if it has none.
    pub(super) fn invariant(&self, process: usize) -> Option<Function> {
        let spots = self.program.spots_of(process);
        if spots.iter().all(|spot| spot.invariant == Condition::Always) {
            return None;
        }
        let mut w = self.writer(&format!("invariant of process {process}"), 0, None);
        let location = w.load(process as u32);
        let (kept, broken) = (w.block(), w.block());
        let places: Vec<BlockId> = spots
            .iter()
            .map(|spot| match spot.invariant {
                Condition::Always => kept,
                _ => w.block(),
            })
            .collect();
        w.switch(location, places.clone(), broken);
        for (spot, block) in spots.iter().zip(places) {
            if block != kept {
                w.at(block);
                let Ok(()) = rules::require(&mut w, self.program, spot.invariant, &[], broken);
                w.jump(kept);
            }
        }
        w.at(kept);
        w.return_value(None);
        w.at(broken);
        w.give_up();
        Some(w.finish())
    }

    /// The function that draws a delay in the windows that lie in their words: uniformly if its
    /// argument is 1, else by the rate that lies beside them.
    pub(super) fn windows(&self) -> Function {
        let mut w = self.writer("a delay in windows", 1, Some(RegisterType::Double));
        let rate = w.load_real(self.layout.rate);
        let Ok(delay) = rules::delay_in_windows(&mut w, Register(0), rate);
        w.return_value(Some(delay));
        w.finish()
    }
}

/// Whether nothing ever comes of a plan.
fn is_idle(spot: &Spot) -> bool {
    spot.outputs.is_empty()
        && spot.urgency == Urgency::Normal
        && spot.invariant == Condition::Always
}
