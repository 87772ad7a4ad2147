//! The effect of an edge of the game graph on clocks: the effects of its moves, one after the
//! other. The first move is always part of it; later moves that change nothing are left out.
//!
//! Edges with the same effects share one program. Most models have few.

use rustc_hash::FxHashMap;

use crate::cancellation;
use crate::network::ClockEffect;
use crate::zones::dbm::Constraint;
use crate::zones::federation::{block_bytes, table_bytes};
use crate::zones::zone_table::{ZoneId, ZoneTable};
use crate::zones::{Bound, ClockSet, Federation, Zone};

/// The index of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ProgramId(pub u32);

/// A move of a program.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct ProgramStep {
    /// Whether time may pass before it.
    pub delays: bool,
    /// Its effect.
    pub effect: ClockEffect,
}

/// All programs of a graph.
#[derive(Debug, Default)]
pub struct Programs {
    steps: Vec<Vec<ProgramStep>>,
    /// The index of the program that was asked for last.
    last: u32,
    index: FxHashMap<Vec<ProgramStep>, u32>,
    /// For each program, source zone and target zone: whether every valuation of the source gets
    /// into the target.
    totals: FxHashMap<(ProgramId, ZoneId, ZoneId), bool>,
    /// The bytes of the steps.
    step_bytes: usize,
}

/// The bytes that some steps take.
pub(super) fn steps_bytes(steps: &[ProgramStep]) -> usize {
    let effects = steps.iter().map(|step| step.effect.heap_bytes());
    block_bytes(size_of_val(steps)) + effects.sum::<usize>()
}

impl Programs {
    /// The program with these steps.
    pub fn intern(&mut self, steps: &[ProgramStep]) -> ProgramId {
        // The last program is the most likely one, and comparing costs less than hashing.
        if self
            .steps
            .get(self.last as usize)
            .is_some_and(|last| last == steps)
        {
            return ProgramId(self.last);
        }
        if let Some(&id) = self.index.get(steps) {
            self.last = id;
            return ProgramId(id);
        }
        let id = cancellation::number(self.steps.len());
        self.last = id;
        self.step_bytes += 2 * steps_bytes(steps);
        self.steps.push(steps.to_vec());
        self.index.insert(steps.to_vec(), id);
        ProgramId(id)
    }

    /// The bytes that they take.
    pub(super) fn bytes(&self) -> usize {
        self.step_bytes
            + self.steps.len() * size_of::<Vec<ProgramStep>>()
            + table_bytes::<(Vec<ProgramStep>, u32)>(self.index.capacity())
            + table_bytes::<((ProgramId, ZoneId, ZoneId), bool)>(self.totals.capacity())
    }

    /// Whether time may pass between the moves of the program.
    pub(in crate::game) fn waits(&self, program: ProgramId) -> bool {
        self.steps[program.0 as usize]
            .iter()
            .any(|step| step.delays)
    }

    /// The valuations from which the first move of the program is possible.
    pub fn enabled(&self, program: ProgramId, zone: &[Bound], dimension: usize) -> Federation {
        match self.steps[program.0 as usize].first() {
            Some(first) => first.effect.enabled_part(zone, dimension),
            None => Federation::of_zone(dimension, zone),
        }
    }

    /// The valuations from which the program leads into the federation.
    pub fn preimage(&self, program: ProgramId, federation: &mut Federation) {
        let steps = &self.steps[program.0 as usize];
        for (index, step) in steps.iter().enumerate().rev() {
            step.effect.preimage(federation);
            if step.delays {
                // A wait ends where the invariant of the state ends.
                federation.constrain_all(&steps[index - 1].effect.invariant);
                federation.down(&ClockSet::default());
            }
        }
    }

    /// The zones that the program reaches from a zone; with their future within the invariant if
    /// time may pass at the end.
    pub fn image(&self, program: ProgramId, zone: &Zone, delays: bool) -> Vec<Zone> {
        let dimension = zone.dimension();
        let mut zones = vec![zone.clone()];
        let mut entries = Vec::new();
        let mut invariant: &[_] = &[];
        for step in &self.steps[program.0 as usize] {
            let mut next = Vec::new();
            for mut zone in zones {
                if step.delays {
                    delay(&mut zone, invariant);
                }
                step.effect
                    .entry_zones(zone.bounds(), dimension, &mut entries);
                next.append(&mut entries);
            }
            invariant = &step.effect.invariant;
            zones = next;
        }
        if delays {
            for zone in &mut zones {
                delay(zone, invariant);
            }
        }
        zones
    }

    /// Whether the program leads from every valuation of the source zone into the target zone.
    pub(super) fn is_total(
        &mut self,
        program: ProgramId,
        source: ZoneId,
        target: ZoneId,
        zones: &ZoneTable,
        dimension: usize,
    ) -> bool {
        if self.steps[program.0 as usize]
            .iter()
            .all(|step| step.effect.is_trivial())
        {
            return true;
        }
        if let Some(&total) = self.totals.get(&(program, source, target)) {
            return total;
        }
        let mut before = Federation::of_zone(dimension, zones.get(target));
        self.preimage(program, &mut before);
        let total = before.includes_zone(zones.get(source));
        self.totals.insert((program, source, target), total);
        total
    }
}

fn delay(zone: &mut Zone, invariant: &[Constraint]) {
    zone.up(&ClockSet::default());
    zone.constrain_all(invariant);
}
