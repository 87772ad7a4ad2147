//! Symbolic states: words with a zone, and their successors.
//!
//! Invariants:
//! * The zone of a state is closed, not empty, satisfies all invariants and, where time may pass,
//!   contains its own future within them.
//! * Successors are exact; extrapolation is a separate step ([`Symbolic::extrapolate`]).
//! * A clock bound or value that zones cannot hold gives [`Failure::ClockLimit`], never a wrong
//!   zone.
//!
//! Source: Bengtsson and Yi, "Timed Automata: Semantics, Algorithms and Tools", 2004, section 4.

use std::sync::Arc;

use crate::cancellation;
use crate::ir::FixedConstraint;
use crate::zones::clocks::{self, Assignment};
use crate::zones::dbm::{self, Constraint};
use crate::zones::extrapolate::Ceilings;
use crate::zones::{Bound, ClockSet, Federation, Zone, simulation, wide};

use super::clock_effect::{
    ClockEffect, add_constraints, check_limit, to_assignment, to_constraint, to_constraints,
};
use super::successor_cache::ZoneMemo;
use crate::analysis::LiveVariables;
use crate::analysis::clock_bounds::ClockBounds;
use crate::analysis::clock_differences::greatest_reset;
use crate::network::discrete::broadcast_filter::Scope;
use crate::network::{Failure, MoveRef, Moves, Part, PartialOrder, Restriction, Stepper, Symmetry};
use crate::tuning::Tuning;

/// The work of taking a move, without its zones: see [`cancellation::work`].
const UNITS_FOR_MOVE: usize = 512;

/// Adds zones to the moves of a network. Each thread has its own.
#[expect(clippy::struct_excessive_bools, reason = "each is an independent fact")]
pub struct Symbolic<'a> {
    /// Moves and their effects on words.
    pub stepper: Stepper<'a>,
    pub(super) dimension: usize,
    pub(super) bounds: ClockBounds,
    has_rates: bool,
    /// The greatest bound that is allowed, if it must be checked: if zones are not extrapolated, or
    /// if constants are so large that bounds may exceed it in the few steps between two
    /// extrapolations.
    range: Option<i32>,
    has_urgent_channels: bool,
    pub(super) has_guarded_urgency: bool,
    pub(super) has_priorities: bool,
    pub(super) restriction: Option<&'a dyn Restriction>,
    symmetry: Option<Arc<Symmetry>>,
    order: Option<Arc<PartialOrder>>,
    live: Option<Arc<LiveVariables>>,
    is_approximate: bool,
    pub(super) ceilings: Ceilings,
    pub(super) memo: ZoneMemo,
    pub(super) inner_moves: Moves,
    pub(super) deadlock_buffers: DeadlockBuffers,
    /// The invariants of the state that [`Symbolic::take`] entered last.
    pub(super) invariant: Vec<Constraint>,
}

/// Buffers for finding deadlocks, which are reused.
#[derive(Debug, Default)]
pub(super) struct DeadlockBuffers {
    pub(super) moves: Moves,
    pub(super) target: Vec<i32>,
    pub(super) effect: ClockEffect,
    pub(super) needs: Vec<Constraint>,
    pub(super) invariant: Vec<Constraint>,
}

/// Constants up to this value cannot make bounds too great between two extrapolations, which are
/// fewer than a hundred steps apart.
const CALM_CONSTANT: i32 = 1 << 20;

impl<'a> Symbolic<'a> {
    /// Zones for the network of `stepper`; extrapolation must distinguish the constants in
    /// `bounds`.
    pub fn new(stepper: Stepper<'a>, bounds: ClockBounds) -> Symbolic<'a> {
        let network = stepper.network();
        let dimension = network.clocks.len().max(1);
        let greatest = bounds.greatest().max(greatest_reset(network));
        let is_looked_at = !bounds.simulates() || greatest > CALM_CONSTANT;
        Symbolic {
            dimension,
            has_rates: network.features.stopwatches,
            range: is_looked_at.then(|| Bound::most_in_zone(dimension, bounds.has_differences())),
            has_urgent_channels: network.channels.iter().any(|channel| channel.urgent),
            has_guarded_urgency: network.features.clock_guarded_urgent,
            has_priorities: network.features.priorities,
            restriction: None,
            symmetry: None,
            order: None,
            live: None,
            is_approximate: false,
            ceilings: bounds.everywhere().clone(),
            memo: ZoneMemo::new(network),
            bounds,
            inner_moves: Moves::default(),
            deadlock_buffers: DeadlockBuffers::default(),
            invariant: Vec::new(),
            stepper,
        }
    }

    /// The same for another thread.
    #[must_use]
    pub fn another(&self) -> Symbolic<'a> {
        Symbolic {
            has_priorities: self.has_priorities,
            restriction: self.restriction,
            symmetry: self.symmetry.clone(),
            order: self.order.clone(),
            live: self.live.clone(),
            ..Symbolic::new(self.stepper.another(), self.bounds.clone())
        }
        .remembering(self.memo.limits)
    }

    /// The heuristics in use.
    pub fn tuning(&self) -> Tuning {
        self.stepper.tuning
    }

    /// Takes over what is known about the zones that another thread has made.
    pub fn join(&mut self, other: &Symbolic<'_>) {
        self.is_approximate |= other.is_approximate;
    }

    /// The same under a restriction, whose atoms `bounds` must have been made with.
    #[must_use]
    pub fn restricted(mut self, restriction: Option<&'a dyn Restriction>) -> Symbolic<'a> {
        self.restriction = restriction;
        self
    }

    /// The same with all moves of the same priority.
    #[must_use]
    pub fn without_priorities(mut self) -> Self {
        self.has_priorities = false;
        self
    }

    /// Whether the network has priorities that are ignored here.
    pub fn ignores_priorities(&self) -> bool {
        self.stepper.network().features.priorities && !self.has_priorities
    }

    /// The same for states that this symmetry may exchange; a search needs to see only one state of
    /// each orbit.
    #[must_use]
    pub fn reduced_by(mut self, symmetry: Option<Arc<Symmetry>>) -> Symbolic<'a> {
        self.symmetry = symmetry;
        self
    }

    /// The symmetry by which states may be exchanged.
    pub fn symmetry(&self) -> Option<&Arc<Symmetry>> {
        self.symmetry.as_ref()
    }

    /// The same for a search that need not take independent moves in every order.
    #[must_use]
    pub fn ordered_by(mut self, order: Option<Arc<PartialOrder>>) -> Symbolic<'a> {
        self.order = order;
        self
    }

    /// The facts that say which orders of independent moves a search can leave out.
    pub fn order(&self) -> Option<&Arc<PartialOrder>> {
        self.order.as_ref()
    }

    /// The same for states in which variables that are not live have no value.
    #[must_use]
    pub fn forgetting(mut self, live: Option<Arc<LiveVariables>>) -> Symbolic<'a> {
        self.live = live;
        self
    }

    /// Sets the variables of a state that are not live to their initial values, if this is allowed.
    pub fn forget(&self, words: &mut [i32]) {
        if let Some(live) = &self.live {
            live.forget(words);
        }
    }

    /// Whether it is under a restriction.
    pub fn is_restricted(&self) -> bool {
        self.restriction.is_some()
    }

    /// The approximate number of bytes of the caches.
    pub fn bytes(&self) -> usize {
        self.stepper.bytes() + self.memo.bytes()
    }

    /// The number of clocks, the reference clock included.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// The greatest constant that a clock is compared with.
    pub fn greatest_constant(&self) -> i32 {
        self.bounds.greatest()
    }

    /// Whether some zone until now may contain more than what is reachable. If at least two clocks
    /// run while another is stopped, delays have no exact zone.
    pub fn is_approximate(&self) -> bool {
        self.is_approximate
    }

    /// The initial words, the zone before time passes, and the invariants.
    pub fn start(&mut self) -> Result<(Vec<i32>, Zone, Vec<Constraint>), Failure> {
        let (mut words, mut zone) = self.origin()?;
        let Some(invariant) = self.invariant(&mut words)? else {
            return Err(Failure::InitialInvariant);
        };
        if !dbm::constrain_all(zone.bounds_mut(), self.dimension, &invariant) {
            return Err(Failure::InitialInvariant);
        }
        Ok((words, zone, invariant))
    }

    /// The initial words and values of clocks, even if they do not satisfy the invariants.
    pub fn origin(&self) -> Result<(Vec<i32>, Zone), Failure> {
        let network = self.stepper.network();
        let mut zone = Zone::zero(self.dimension);
        for (clock, &value) in network.initial_clocks.iter().enumerate().skip(1) {
            if value != 0 {
                check_limit(value)?;
                zone.assign(&[Assignment::Value { clock, value }]);
            }
        }
        Ok((network.initial.clone(), zone))
    }

    /// Takes a move on `words`, and returns its effect on clocks; `None` if the invariants of the
    /// target or the guards forbid it for all clock values.
    pub fn fire(
        &mut self,
        one: MoveRef<'_>,
        words: &mut [i32],
    ) -> Result<Option<ClockEffect>, Failure> {
        let mut effect = ClockEffect::default();
        Ok(self.fire_into(one, words, &mut effect)?.then_some(effect))
    }

    /// The same for a move from a state with these words, which it copies to `target`; `None` also
    /// if nothing of the zone satisfies the guard.
    pub fn fire_within(
        &mut self,
        one: MoveRef<'_>,
        words: &[i32],
        zone: &[Bound],
        target: &mut [i32],
    ) -> Result<Option<ClockEffect>, Failure> {
        if !self.is_enabled(one, zone)? {
            return Ok(None);
        }
        target.copy_from_slice(words);
        self.fire(one, target)
    }

    /// Like [`Symbolic::fire`], but writes the effect to a value that is reused; returns whether
    /// the move is possible.
    pub fn fire_into(
        &mut self,
        one: MoveRef<'_>,
        words: &mut [i32],
        effect: &mut ClockEffect,
    ) -> Result<bool, Failure> {
        // Other code will make zones from this effect.
        cancellation::work(UNITS_FOR_MOVE + self.dimension * self.dimension);
        effect.excluded.clear();
        effect.assignments.clear();
        if !add_constraints(one.constraints, &mut effect.guard)? {
            return Ok(false);
        }
        for conjunction in one.excluded() {
            effect.excluded.extend(to_constraints(conjunction)?);
        }
        self.fire_parts(one.parts, words, &mut effect.assignments)?;
        match self.stepper.invariants(words)? {
            Some(emitted) => add_constraints(emitted, &mut effect.invariant),
            None => Ok(false),
        }
    }

    fn fire_parts(
        &mut self,
        parts: &[Part],
        words: &mut [i32],
        assignments: &mut Vec<Assignment>,
    ) -> Result<(), Failure> {
        let emitted = self.stepper.fire(parts, words)?;
        if !emitted.is_empty() {
            assignments.reserve(emitted.len());
            for one in emitted {
                assignments.push(to_assignment(one)?);
            }
        }
        Ok(())
    }

    /// Whether [`Symbolic::take`] and [`Symbolic::pass_time`] can take the move from this zone: the
    /// state that it leads to has one zone, since what must not hold is false everywhere.
    pub fn stays_whole(&self, one: MoveRef<'_>, zone: &[Bound]) -> bool {
        !self.has_barriers()
            && !self.bounds.splits()
            && one.excluded().all(|excluded| self.is_false(excluded, zone))
    }

    /// Whether some constraint of a conjunction holds nowhere in the zone.
    fn is_false(&self, conjunction: &[FixedConstraint], zone: &[Bound]) -> bool {
        conjunction.iter().any(|one| {
            let constraint = to_constraint(one);
            constraint.is_ok_and(|one| !dbm::satisfies(zone, self.dimension, &one))
        })
    }

    /// Takes a move on words and zone at once; returns whether it is possible. If it is not,
    /// neither is valid afterwards, and an update has run only if the guards leave something of the
    /// zone.
    pub fn take(
        &mut self,
        one: MoveRef<'_>,
        words: &mut [i32],
        zone: &mut [Bound],
    ) -> Result<bool, Failure> {
        let dimension = self.dimension;
        if !add_constraints(one.constraints, &mut self.invariant)?
            || !dbm::constrain_all(zone, dimension, &self.invariant)
        {
            return Ok(false);
        }
        for assignment in self.stepper.fire(one.parts, words)? {
            if !clocks::assign(zone, dimension, &[to_assignment(assignment)?]) {
                return Ok(false);
            }
        }
        Ok(match self.stepper.invariants(words)? {
            Some(emitted) => {
                add_constraints(emitted, &mut self.invariant)?
                    && dbm::constrain_all(zone, dimension, &self.invariant)
            }
            None => false,
        })
    }

    /// Lets time pass, if it may, in the state that [`Symbolic::take`] entered last.
    pub fn pass_time(&mut self, words: &mut [i32], zone: &mut [Bound]) -> Result<(), Failure> {
        if self.dimension == 1 {
            return Ok(());
        }
        let may_delay = self.may_delay(words)?;
        self.delay_by_invariant(words, may_delay, zone)
    }

    /// Lets time pass within the invariant that was made last.
    pub(super) fn delay_by_invariant(
        &mut self,
        words: &[i32],
        may_delay: bool,
        zone: &mut [Bound],
    ) -> Result<(), Failure> {
        let invariant = std::mem::take(&mut self.invariant);
        let result = self.delay(words, may_delay, &invariant, zone);
        self.invariant = invariant;
        result
    }

    /// Whether each constraint of the guards alone leaves something of the zone.
    pub fn may_satisfy(&self, one: MoveRef<'_>, zone: &[Bound]) -> Result<bool, Failure> {
        for emitted in one.constraints {
            if !dbm::satisfies(zone, self.dimension, &to_constraint(emitted)?) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The clock part of all invariants; `None` if they cannot hold.
    pub fn invariant(&mut self, words: &mut [i32]) -> Result<Option<Vec<Constraint>>, Failure> {
        match self.stepper.invariants(words)? {
            Some(emitted) => to_constraints(emitted),
            None => Ok(None),
        }
    }

    /// Whether time may pass in a state with these words.
    pub fn may_delay(&mut self, words: &mut [i32]) -> Result<bool, Failure> {
        if self.stepper.is_urgent(words) {
            return Ok(false);
        }
        if !self.has_urgent_channels {
            return Ok(true);
        }
        let mut moves = std::mem::take(&mut self.inner_moves);
        let result = self
            .stepper
            .compute_moves(words, Scope::Unconditional, &mut moves)
            .map(|()| self.stepper.may_delay(words, &moves));
        self.inner_moves = moves;
        result
    }

    /// The same; `moves` are those of the state as [`Symbolic::remembered_moves`] returns them.
    pub fn may_delay_with(&mut self, words: &mut [i32], moves: &Moves) -> Result<bool, Failure> {
        if (self.has_priorities || self.restriction.is_some()) && self.has_urgent_channels {
            // Neither priorities nor a restriction let time pass where they forbid an urgent
            // synchronisation.
            return self.may_delay(words);
        }
        Ok(self.stepper.may_delay(words, moves))
    }

    /// Lets time pass within the invariant if it may.
    ///
    /// # Errors
    /// Rates that have no meaning, code that fails, and bounds that grow too great.
    pub fn delay(
        &mut self,
        words: &[i32],
        may_delay: bool,
        invariant: &[Constraint],
        zone: &mut [Bound],
    ) -> Result<(), Failure> {
        if may_delay && self.dimension > 1 {
            self.delay_in_range(words, invariant, zone)?;
        }
        match self.range {
            Some(most) if !dbm::is_in_range(zone, most) => Err(Failure::ClockRange),
            _ => self.check_differences(),
        }
    }

    /// What zones say is right, although this thread may have lost bounds beyond what zones can
    /// hold: no comparison of a single clock can tell.
    ///
    /// # Errors
    /// Clocks are compared with each other.
    pub fn check_differences(&self) -> Result<(), Failure> {
        if self.bounds.has_differences() && wide::has_forgotten() {
            Err(Failure::ClockRange)
        } else {
            Ok(())
        }
    }

    /// Whether bounds of a zone have grown so much that it should be extrapolated before more
    /// steps. Zones of calm models are not checked.
    pub fn is_almost_out_of_range(&self, zone: &[Bound]) -> bool {
        self.range
            .is_some_and(|most| !dbm::is_in_range(zone, most / 2))
    }

    /// Whether bounds of a zone that was not extrapolated on a long path have grown so much that it
    /// must be extrapolated now.
    pub fn has_grown(&self, zone: &[Bound]) -> bool {
        let most = Bound::most_in_zone(self.dimension, self.bounds.has_differences());
        !dbm::is_in_range(zone, most / 2)
    }

    fn delay_in_range(
        &mut self,
        words: &[i32],
        invariant: &[Constraint],
        zone: &mut [Bound],
    ) -> Result<(), Failure> {
        if self.has_rates {
            let stopped = self.stopped(words)?;
            self.is_approximate |= !stopped.is_empty() && self.dimension - 1 > stopped.len() + 1;
            clocks::up_stopped(zone, self.dimension, &stopped);
        } else {
            let holds = |one: &Constraint| zone[one.left * self.dimension + one.right] <= one.bound;
            if invariant.iter().all(holds) {
                clocks::up_within(zone, self.dimension, invariant);
                return Ok(());
            }
            clocks::up(zone, self.dimension);
        }
        dbm::constrain_all(zone, self.dimension, invariant);
        Ok(())
    }

    /// The clocks whose rate is 0 in a state with these words.
    pub fn stopped(&mut self, words: &[i32]) -> Result<ClockSet, Failure> {
        let mut stopped = ClockSet::default();
        if !self.has_rates {
            return Ok(stopped);
        }
        let network = self.stepper.network();
        let mut words = words.to_vec();
        for (index, process) in network.processes.iter().enumerate() {
            for &(clock, function) in &process.locations[words[index] as usize].rates {
                match self.stepper.evaluate(function, &mut words)? {
                    0 => stopped.insert(clock.0 as usize),
                    1 => {}
                    rate => {
                        return Err(Failure::Rate {
                            process: index as u32,
                            rate,
                        });
                    }
                }
            }
        }
        Ok(stopped)
    }

    /// Forgets differences between clock values that no guard or invariant can distinguish from
    /// here on.
    pub fn extrapolate(&mut self, words: &[i32], zone: &mut [Bound]) {
        if self.dimension > 1 {
            self.bounds
                .extrapolate(words, zone, self.dimension, &mut self.ceilings);
        }
    }

    /// The same, but zones are compared by inclusion, even where simulation would pay.
    #[must_use]
    pub fn comparing_as_sets(mut self) -> Symbolic<'a> {
        self.bounds.compare_as_sets();
        self
    }

    /// Whether [`Symbolic::to_stored`] changes extrapolated zones.
    pub fn stores_reduced(&self) -> bool {
        self.dimension > 1 && self.tuning().simulation && self.bounds.compares_by_simulation()
    }

    /// Replaces the zone of a state, extrapolated or not, by its reduced form (see [`simulation`]),
    /// and returns the limits of its ceilings. If zones are compared as sets, it does not change
    /// the zone, which must have been extrapolated, and returns no limits.
    pub fn to_stored(&mut self, words: &[i32], zone: &mut [Bound]) -> &[Bound] {
        if !self.stores_reduced() {
            return &[];
        }
        self.bounds.ceilings_into(words, &mut self.ceilings);
        simulation::reduce(zone, self.dimension, &self.ceilings);
        self.ceilings.limits()
    }

    /// Replaces the result of [`Symbolic::to_stored`] by the extrapolated zone.
    pub fn from_stored(&mut self, words: &[i32], stored: &mut [Bound]) {
        if self.stores_reduced() {
            self.bounds.ceilings_into(words, &mut self.ceilings);
            simulation::restore(stored, self.dimension, &self.ceilings);
        }
    }

    /// Whether extrapolation cuts zones, so that one may become several: see
    /// [`Symbolic::extrapolate_all`].
    pub fn splits(&self) -> bool {
        self.bounds.splits()
    }

    /// Extrapolates each of the zones of a state; where guards compare clocks, one may become
    /// several.
    pub fn extrapolate_all(&mut self, words: &[i32], zones: &mut Vec<Zone>) {
        if self.bounds.splits() {
            let mut parts = Federation::empty(self.dimension);
            for zone in &*zones {
                self.bounds
                    .split(words, zone.bounds(), &mut self.ceilings, &mut parts);
            }
            zones.clear();
            zones.extend(parts.to_zones());
            return;
        }
        for zone in zones {
            self.extrapolate(words, zone.bounds_mut());
        }
    }

    /// The points at which invariants stop time: the weak upper bounds of each process's invariant,
    /// with the process.
    pub fn upper_bounds(&mut self, words: &mut [i32]) -> Result<Vec<(u32, Constraint)>, Failure> {
        let mut bounds = Vec::new();
        for process in 0..self.stepper.network().processes.len() {
            if let Some(emitted) = self.stepper.invariant_of(process, words)? {
                for one in to_constraints(emitted)?.unwrap_or_default() {
                    if one.right == 0 && one.left != 0 && !one.bound.is_strict() {
                        bounds.push((process as u32, one));
                    }
                }
            }
        }
        Ok(bounds)
    }
}
