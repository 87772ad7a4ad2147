//! How the edges of a node are made: takes each of its moves, and after it the moves without a
//! choice.

use crate::cancellation;
use crate::network::{ClockEffect, Failure, Moves, Symbolic};
use crate::zones::dbm::Constraint;
use crate::zones::{Bound, Zone};

use super::chain_cache::{Ending, Root};
use super::clock_programs::{ProgramId, ProgramStep};
use super::graph::Graph;
use super::node::{Edge, Origin};

/// This many bytes of zones need not be in the account.
const MOST_UNTOLD_BYTES: usize = 4 << 20;

impl Graph<'_, '_> {
    /// Computes the edges of a node. The new nodes come after the old ones.
    pub fn expand(&mut self, node: u32) -> Result<(), Failure> {
        let mut words = std::mem::take(&mut self.words);
        let mut moves = std::mem::take(&mut self.moves);
        self.load(node, &mut words);
        let result = self.expand_from(node, &mut words, &mut moves);
        self.symbolic.stepper.moves_beside = 0;
        self.words = words;
        self.moves = moves;
        result
    }

    fn expand_from(
        &mut self,
        node: u32,
        words: &mut [i32],
        moves: &mut Moves,
    ) -> Result<(), Failure> {
        self.explored += 1;
        let root = self.moves_of(node, words, moves)?;
        self.symbolic.stepper.moves_beside = moves.heap_bytes();
        let delays = self.symbolic.may_delay_with(words, moves)?;
        let first = self.edges.len() as u32;
        for ordinal in 0..moves.len() as u32 {
            let one = moves.get(ordinal as usize);
            let processes = one.parts.iter().map(|part| part.process % u32::BITS);
            let origin = Origin {
                node,
                ordinal,
                controllable: one.controllable,
                movers: processes.fold(0, |all, process| all | 1 << process),
            };
            let mut target = std::mem::take(&mut self.target);
            target.copy_from_slice(words);
            let result = self.follow(origin, root, moves, &mut target);
            self.target = target;
            result?;
        }
        let network = self.symbolic.stepper.network();
        self.branch_points
            .find(network, node, &mut self.edges, first as usize, moves);
        let node = &mut self.nodes[node as usize];
        node.edges = (first, self.edges.len() as u32);
        node.delays = delays;
        node.is_expanded = true;
        Ok(())
    }

    /// Computes the moves of a node; returns the root of their trails, if they were met before.
    fn moves_of(
        &mut self,
        node: u32,
        words: &mut [i32],
        moves: &mut Moves,
    ) -> Result<Option<Root>, Failure> {
        let stepper = &mut self.symbolic.stepper;
        if self.trails.is_useful()
            && let Some(vector) = stepper.vector(words)
            && let Some(list) = stepper.move_list(vector, words)?
        {
            moves.copy_from(stepper.listed(list));
            let zone = self.nodes[node as usize].zone;
            return Ok(self.trails.root(list, zone, moves));
        }
        self.symbolic.remembered_moves(words, moves)?;
        Ok(None)
    }

    /// Takes a move of a node, and then the following moves as long as there is no choice; adds the
    /// edge.
    fn follow(
        &mut self,
        origin: Origin,
        root: Option<Root>,
        moves: &Moves,
        target: &mut Vec<i32>,
    ) -> Result<(), Failure> {
        if self.symbolic.has_barriers() {
            return self.follow_urgently(origin, moves, target);
        }
        if let Some(root) = root.filter(|_| !self.symbolic.splits())
            && self.follow_trail(root, moves, origin, target)?
        {
            return Ok(());
        }
        let one = moves.get(origin.ordinal as usize);
        let zone = self.zones.get(self.nodes[origin.node as usize].zone);
        if !self.symbolic.is_enabled(one, zone)?
            || !self.symbolic.fire_into(one, target, &mut self.effect)?
        {
            return Ok(());
        }
        self.effect
            .entry_zones(zone, self.symbolic.dimension(), &mut self.entries);
        self.steps.clear();
        push_step(&mut self.steps, false, &self.effect);
        if self.entries.len() != 1 || self.symbolic.splits() {
            return self.end_in_pieces(target, origin);
        }
        let mut zone = self.entries.swap_remove(0);
        let may_delay = delay_after(self.symbolic, target, &self.steps, self.latest, &mut zone)?;
        self.continue_chain(origin, target, zone, 1, may_delay)
    }

    /// Continues a chain after `length` moves, and adds its edge. The zone contains its future if
    /// time may pass.
    pub(super) fn continue_chain(
        &mut self,
        origin: Origin,
        target: &mut Vec<i32>,
        mut zone: Zone,
        mut length: u32,
        mut may_delay: bool,
    ) -> Result<(), Failure> {
        while (length as usize) < self.longest_chain
            && !self.symbolic.is_almost_out_of_range(zone.bounds())
            && self.only_move(target, &mut zone, may_delay)?
        {
            push_step(&mut self.steps, may_delay, &self.effect);
            std::mem::swap(target, &mut self.spare);
            length += 1;
            may_delay = delay_after(self.symbolic, target, &self.steps, self.latest, &mut zone)?;
        }
        self.end(target, zone, origin, length)
    }

    /// Takes the only move of a state inside a chain. Writes its effect to `effect`, the words
    /// after it to `spare`, and the zone on entry to `zone`. Returns false, with the zone
    /// unchanged, if the chain ends at the state.
    fn only_move(
        &mut self,
        words: &mut [i32],
        zone: &mut Zone,
        may_delay: bool,
    ) -> Result<bool, Failure> {
        if may_delay && !self.chains_delays {
            return Ok(false);
        }
        if !self.is_open(words, zone)? {
            return Ok(false);
        }
        self.symbolic
            .remembered_moves(words, &mut self.chain_moves)?;
        if self.chain_moves.len() != 1 || (may_delay && !self.chain_moves.get(0).controllable) {
            return Ok(false);
        }
        self.spare.copy_from_slice(words);
        let one = self.chain_moves.get(0);
        if !self.symbolic.is_enabled(one, zone.bounds())?
            || !self
                .symbolic
                .fire_into(one, &mut self.spare, &mut self.effect)?
        {
            return Ok(false);
        }
        if !self.effect.is_trivial() {
            let mut entry = zone.clone();
            if !self.effect.excluded.is_empty() || !self.effect.enter(&mut entry) {
                return Ok(false);
            }
            *zone = entry;
        }
        self.explored += 1;
        Ok(true)
    }

    /// Ends an edge whose first move leads to several zones or to none: adds one edge for each
    /// zone.
    fn end_in_pieces(&mut self, target: &mut [i32], origin: Origin) -> Result<(), Failure> {
        let mut zones = std::mem::take(&mut self.entries);
        if !zones.is_empty() && self.dead_ends.contain(target) {
            let program = self.programs.intern(&self.steps);
            self.end_dead(target, program, origin, 1);
            return Ok(());
        }
        for zone in &mut zones {
            delay_after(self.symbolic, target, &self.steps, self.latest, zone)?;
        }
        if self.has_discrete_nodes {
            // All pieces end in the same node, and the steps say where each comes from.
            zones.truncate(1);
        } else if self.symbolic.splits() {
            self.symbolic.extrapolate_all(target, &mut zones);
        }
        for zone in zones {
            self.end(target, zone, origin, 1)?;
        }
        Ok(())
    }

    /// Adds the edge of the current steps, which lead to this zone.
    fn end(
        &mut self,
        target: &mut [i32],
        mut zone: Zone,
        origin: Origin,
        length: u32,
    ) -> Result<(), Failure> {
        if self.dead_ends.contain(target) {
            let program = self.programs.intern(&self.steps);
            self.end_dead(target, program, origin, length);
            return Ok(());
        }
        if self.has_discrete_nodes {
            zone = self.anything_within(invariant_after(&self.steps));
        } else {
            self.symbolic.extrapolate(target, zone.bounds_mut());
        }
        let mut ending = Ending {
            id: self.zones.intern(zone.bounds()),
            zone,
            program: self.programs.intern(&self.steps),
            totality: None,
        };
        self.check_zone_memory();
        self.add_edge(target, &mut ending, origin, length)
    }

    /// Asks for the memory of zones that are not in the account yet, if they are many: one node can
    /// have thousands of successors.
    fn check_zone_memory(&self) {
        let count = self.zones.len() - self.counted_zones;
        let bytes = count * self.dimension().pow(2) * size_of::<Bound>();
        if bytes > MOST_UNTOLD_BYTES {
            cancellation::ask_for(bytes);
        }
    }

    /// Adds an edge to the state with these words in which a chain ended.
    pub(super) fn add_edge(
        &mut self,
        words: &mut [i32],
        ending: &mut Ending,
        origin: Origin,
        length: u32,
    ) -> Result<(), Failure> {
        let source = origin.node;
        if self.dead_ends.contain(words) {
            self.end_dead(words, ending.program, origin, length);
            return Ok(());
        }
        let target = self.node_of(words, &ending.zone, ending.id, None)?;
        let program = ending.program;
        let from = self.nodes[source as usize].zone;
        let to = self.nodes[target as usize].zone;
        let is_total = match ending.totality {
            Some((known, is_total)) if known == to => is_total,
            _ => {
                let dimension = self.symbolic.dimension();
                self.programs
                    .is_total(program, from, to, &self.zones, dimension)
            }
        };
        ending.totality = Some((to, is_total));
        self.link(origin, target, program, length, is_total);
        Ok(())
    }

    /// Adds an edge between two nodes that stands for `length` moves.
    pub(super) fn link(
        &mut self,
        origin: Origin,
        target: u32,
        program: ProgramId,
        length: u32,
        is_total: bool,
    ) {
        let Origin {
            node: source,
            ordinal,
            controllable,
            movers,
        } = origin;
        let edge = cancellation::number(self.edges.len());
        let next_in = std::mem::replace(&mut self.nodes[target as usize].first_in, edge);
        self.edges.push(Edge {
            source,
            target,
            next_in,
            program,
            ordinal,
            movers,
            length: length as u8,
            controllable,
            is_total,
            is_leg: false,
        });
    }
}

/// Lets time pass in the state that the steps reach, if it may: within its invariant and up to the
/// deadline. Returns whether it may.
pub(super) fn delay_after(
    symbolic: &mut Symbolic<'_>,
    words: &mut [i32],
    steps: &[ProgramStep],
    latest: Option<Constraint>,
    zone: &mut Zone,
) -> Result<bool, Failure> {
    let may_delay = symbolic.may_delay(words)?;
    symbolic.delay(words, may_delay, invariant_after(steps), zone.bounds_mut())?;
    zone.constrain_all(latest.as_slice());
    Ok(may_delay)
}

/// The invariant of the state that the steps reach: that of the last step, since steps that are
/// left out have none.
fn invariant_after(steps: &[ProgramStep]) -> &[Constraint] {
    steps.last().map_or(&[][..], |last| &last.effect.invariant)
}

/// Adds a step to a program. One that changes nothing is left out, unless it is the first or ends
/// an invariant.
pub(super) fn push_step(steps: &mut Vec<ProgramStep>, delays: bool, effect: &ClockEffect) {
    let is_kept = steps
        .last()
        .is_none_or(|last| !last.effect.invariant.is_empty());
    if delays || is_kept || !effect.is_trivial() {
        let effect = effect.clone();
        steps.push(ProgramStep { delays, effect });
    }
}
