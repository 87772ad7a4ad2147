//! Moves whose effect on clocks and locations does not depend on variables; the effect is computed
//! once.
//!
//! Invariant: to take a [`FixedMove`] runs the same functions as to take the move, in the same
//! order, and gives the same words. Its effect on clocks is [`FixedMove::effect`] in every state of
//! its location vector.

use crate::exec::RunTimeError;
use crate::ir::{FunctionId, Update};

use super::clock_effect::to_constraints;
use crate::network::discrete::selects::select_values;
use crate::network::{ClockEffect, MoveRef, Stepper};
use crate::zones::clocks::Assignment;
use crate::zones::dbm::Constraint;
use crate::zones::federation::block_bytes;

/// A move with a computed effect.
#[derive(Clone, Debug)]
pub struct FixedMove {
    /// The functions that change variables, with their arguments.
    calls: Vec<(FunctionId, Vec<i32>)>,
    /// The processes that move, each with the location that it enters.
    targets: Vec<(u32, i32)>,
    /// The effect of the move on clocks.
    pub effect: ClockEffect,
}

impl FixedMove {
    /// The bytes that it takes, without the value itself and the arguments of functions.
    pub fn heap_bytes(&self) -> usize {
        block_bytes(size_of_val(&*self.calls))
            + block_bytes(size_of_val(&*self.targets))
            + self.effect.heap_bytes()
    }

    /// Enters the locations of the target, and does not change variables.
    pub fn enter_locations(&self, words: &mut [i32]) {
        for &(process, location) in &self.targets {
            words[process as usize] = location;
        }
    }

    fn add(&mut self, update: &Update, arguments: &[i32]) -> Option<()> {
        if update.emits {
            return None;
        }
        let call = update
            .function
            .map(|function| (function, arguments.to_vec()));
        self.calls.extend(call);
        for &(clock, value) in &update.fixed {
            let clock = clock.0 as usize;
            let is_allowed = crate::zones::Bound::is_allowed(value);
            self.effect
                .assignments
                .push(is_allowed.then_some(Assignment::Value { clock, value })?);
        }
        Some(())
    }
}

impl Stepper<'_> {
    /// Takes a move with a computed effect: changes locations and variables.
    pub fn take(&mut self, one: &FixedMove, words: &mut [i32]) -> Result<(), RunTimeError> {
        for (function, arguments) in &one.calls {
            self.run(*function, arguments, words)?;
        }
        one.enter_locations(words);
        Ok(())
    }

    /// Computes the effect of a move in a state with these words. `None` if the effect on clocks,
    /// or whether the move is possible, may depend on variables.
    pub fn fix(&self, one: MoveRef<'_>, words: &[i32]) -> Option<FixedMove> {
        let network = self.network();
        let mut fixed = FixedMove {
            calls: Vec::new(),
            targets: Vec::new(),
            effect: ClockEffect::default(),
        };
        if one.excluded().next().is_some() {
            return None;
        }
        fixed.effect.guard = to_constraints(one.constraints).ok()??;
        if let Some(update) = &network.before_update {
            fixed.add(update, &[])?;
        }
        let mut arguments = Vec::new();
        for &part in one.parts {
            let edge = self.edge(part);
            let branch = &edge.branches[part.branch as usize];
            select_values(edge, part.select, &mut arguments);
            fixed.add(&edge.update, &arguments)?;
            fixed.add(&branch.update, &arguments)?;
            fixed.targets.push((part.process, branch.target.0 as i32));
        }
        if let Some(update) = &network.after_update {
            fixed.add(update, &[])?;
        }
        let mut locations = words[..network.processes.len()].to_vec();
        fixed.enter_locations(&mut locations);
        fixed.effect.invariant = self.fixed_invariant(&locations)?;
        Some(fixed)
    }

    /// The invariants of a location vector; `None` if they depend on variables or never hold.
    fn fixed_invariant(&self, locations: &[i32]) -> Option<Vec<Constraint>> {
        let mut emitted = Vec::new();
        for (process, &location) in self.network().processes.iter().zip(locations) {
            let invariant = &process.locations[location as usize].invariant;
            if invariant.function.is_some() {
                return None;
            }
            emitted.extend_from_slice(&invariant.fixed);
        }
        to_constraints(&emitted).ok()?
    }
}
