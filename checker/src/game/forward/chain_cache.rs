//! Chains of moves that were followed before, remembered.
//!
//! What a move does to clocks mostly hangs on the locations, the zone and the answers of guards,
//! not on variables. A *trail* is what is known at a point of a chain: the zone there and what the
//! moves so far do to clocks. Trails make trees; their roots are moves of nodes, by offer and zone.
//! Following a chain along its trail evaluates guards and runs updates, and handles no zone at all.
//!
//! Invariants:
//! * A trail says what [`super::graph::Graph`] would find by following the chain move by move;
//!   where that hangs on variables, the trail ends and the graph goes on from its end in that way.
//! * Trails never decide which states there are, only how fast they are found. Their memory is
//!   bounded.

use rustc_hash::FxHashMap;

use crate::ir::Predicate;
use crate::network::{Extent, Failure, FixedMove, Moves, OfferId, VectorId};
use crate::zones::federation::block_bytes;
use crate::zones::zone_table::ZoneId;
use crate::zones::{Bound, Zone};

use super::clock_programs::{ProgramId, ProgramStep, steps_bytes};
use super::graph::{Graph, LONGEST_CHAIN, Objective, Origin, delay_after, push_step};

/// Trails take at most about so many bytes.
const MOST_BYTES: usize = 32 << 20;

/// The index of a trail.
type TrailId = u32;

/// What a move leads to.
#[derive(Clone, Copy, Debug)]
enum Onward {
    /// Not asked yet.
    Unknown,
    /// Nowhere: the move is not possible, or the chain ends before it.
    Ends,
    /// Variables decide: it must be followed move by move.
    Varies,
    /// To the end of this trail.
    To(TrailId),
}

/// A point of a chain.
#[derive(Clone, Debug)]
struct Trail {
    /// The move that leads here.
    last: FixedMove,
    /// The location vector here, once it is known.
    vector: Option<VectorId>,
    /// The zone here, with its future if time may pass.
    zone: Zone,
    may_delay: bool,
    /// How many moves lead here.
    length: u32,
    /// What they do to clocks.
    steps: Vec<ProgramStep>,
    /// Whether every chain that comes here ends.
    is_end: bool,
    /// How it goes on, by offer.
    onward: Vec<(OfferId, Onward)>,
    ending: Option<Ending>,
}

/// What a chain that ends here makes of clocks.
#[derive(Clone, Debug)]
pub(super) struct Ending {
    /// The zone, extrapolated.
    pub(super) zone: Zone,
    /// Its id.
    pub(super) id: ZoneId,
    /// What the edge does to clocks.
    pub(super) program: ProgramId,
    /// The zone of the node that was entered last, and whether the edge leads from every valuation
    /// into it.
    pub(super) totality: Option<(ZoneId, bool)>,
}

/// The trails of a graph.
#[derive(Debug, Default)]
pub(super) struct Trails {
    /// Whether locations and zones decide how time passes, so that there can be trails.
    is_useful: bool,
    /// Whether locations alone decide where the objective holds.
    is_objective_fixed: bool,
    /// By offer and zone of a node: where its moves are in `first`; `None` if the two were met
    /// once.
    roots: FxHashMap<(OfferId, ZoneId), Option<u32>>,
    /// What the first moves lead to.
    first: Vec<Onward>,
    /// The ends of all trails.
    points: Vec<Trail>,
    bytes: usize,
}

/// The moves of a node that have trails.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root(u32);

impl Trails {
    /// No trails yet. `is_useful` says whether locations and zones alone decide how time passes.
    pub(super) fn new(is_useful: bool, objective: &Objective<'_>) -> Trails {
        let mut predicates = objective.goal.iter().chain(&objective.keep);
        Trails {
            is_useful,
            is_objective_fixed: objective.deadline.is_none()
                && predicates.all(|predicate| hangs_on_locations(predicate)),
            ..Trails::default()
        }
    }

    /// The bytes that trails take, about.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// Whether there can be trails.
    pub(super) fn is_useful(&self) -> bool {
        self.is_useful
    }

    /// The root of the moves of an offer at a zone; `None` if they were not met before, as most are
    /// never met again.
    pub(super) fn root(&mut self, offer: OfferId, zone: ZoneId, moves: &Moves) -> Option<Root> {
        if self.bytes > MOST_BYTES {
            return self.roots.get(&(offer, zone)).copied().flatten().map(Root);
        }
        match self.roots.entry((offer, zone)) {
            std::collections::hash_map::Entry::Vacant(entry) => {
                entry.insert(None);
                self.bytes += 32;
                None
            }
            std::collections::hash_map::Entry::Occupied(mut entry) => {
                let first = *entry.get_mut().get_or_insert_with(|| {
                    let first = self.first.len() as u32;
                    self.first
                        .resize(self.first.len() + moves.len(), Onward::Unknown);
                    self.bytes += moves.len() * size_of::<Onward>();
                    first
                });
                Some(Root(first))
            }
        }
    }

    fn add(&mut self, trail: Trail) -> Onward {
        let dimension = trail.zone.dimension();
        // The end has its zone too.
        self.bytes += size_of::<Trail>() + 2 * block_bytes(size_of::<Bound>() * dimension.pow(2));
        self.bytes += steps_bytes(&trail.steps) + trail.last.heap_bytes();
        self.points.push(trail);
        Onward::To(self.points.len() as u32 - 1)
    }
}

impl Graph<'_, '_> {
    /// Follows a move of a node along its trail, if there is one, and adds the edge. Returns false,
    /// with the words as they were, if the chain must be followed move by move from its start.
    pub(super) fn follow_trail(
        &mut self,
        root: Root,
        moves: &Moves,
        origin: Origin,
        target: &mut Vec<i32>,
    ) -> Result<bool, Failure> {
        let mut trails = std::mem::take(&mut self.trails);
        let result = self.follow_trail_in(&mut trails, root, moves, origin, target);
        self.trails = trails;
        result
    }

    fn follow_trail_in(
        &mut self,
        trails: &mut Trails,
        Root(first): Root,
        moves: &Moves,
        origin: Origin,
        target: &mut Vec<i32>,
    ) -> Result<bool, Failure> {
        let position = (first + origin.ordinal) as usize;
        if matches!(trails.first[position], Onward::Unknown) {
            trails.first[position] = self.first_onward(trails, moves, origin, target)?;
        }
        let mut at = match trails.first[position] {
            Onward::Unknown | Onward::Varies => return Ok(false),
            Onward::Ends => return Ok(true),
            Onward::To(trail) => trail,
        };
        self.symbolic
            .stepper
            .take(&trails.points[at as usize].last, target)?;
        loop {
            match self.onward(trails, at, target)? {
                Onward::To(next) => {
                    let one = &trails.points[next as usize].last;
                    self.symbolic.stepper.take(one, target)?;
                    self.explored += 1;
                    at = next;
                }
                Onward::Ends => break,
                Onward::Unknown | Onward::Varies => {
                    let trail = &trails.points[at as usize];
                    self.steps.clone_from(&trail.steps);
                    let zone = trail.zone.clone();
                    let reached = (trail.length, trail.may_delay);
                    self.go_on(origin, target, zone, reached)?;
                    return Ok(true);
                }
            }
        }
        self.end_trail(&mut trails.points[at as usize], target, origin)?;
        Ok(true)
    }

    /// What a move of a node leads to.
    fn first_onward(
        &mut self,
        trails: &mut Trails,
        moves: &Moves,
        origin: Origin,
        words: &[i32],
    ) -> Result<Onward, Failure> {
        let one = moves.get(origin.ordinal as usize);
        let zone = self.zone(origin.node);
        if !self.symbolic.is_enabled(one, zone)? {
            return Ok(Onward::Ends);
        }
        let Some(last) = self.symbolic.stepper.fix(one, words) else {
            return Ok(Onward::Varies);
        };
        let mut zone = Zone::from_bounds(self.dimension(), zone);
        if !last.effect.enter(&mut zone) {
            return Ok(Onward::Varies);
        }
        let mut steps = Vec::new();
        push_step(&mut steps, false, &last.effect);
        self.add_trail(trails, words, last, zone, (steps, 1))
    }

    /// How a chain goes on from the end of a trail, in a state with these words.
    fn onward(
        &mut self,
        trails: &mut Trails,
        at: TrailId,
        words: &mut [i32],
    ) -> Result<Onward, Failure> {
        let is_objective_fixed = trails.is_objective_fixed;
        let trail = &mut trails.points[at as usize];
        if trail.is_end || !(is_objective_fixed || self.is_open(words, &trail.zone)?) {
            return Ok(Onward::Ends);
        }
        let stepper = &mut self.symbolic.stepper;
        trail.vector = trail.vector.or_else(|| stepper.vector(words));
        let Some(vector) = trail.vector else {
            return Ok(Onward::Varies);
        };
        let Some(offer) = stepper.offer(vector, words)? else {
            return Ok(Onward::Varies);
        };
        if let Some(&(_, onward)) = trail.onward.iter().find(|known| known.0 == offer) {
            return Ok(onward);
        }
        let onward = self.new_onward(trails, at, offer, words)?;
        if !matches!(onward, Onward::Unknown) {
            trails.points[at as usize].onward.push((offer, onward));
        }
        Ok(onward)
    }

    /// As [`Graph::onward`], where it is not known what the offer leads to.
    fn new_onward(
        &mut self,
        trails: &mut Trails,
        at: TrailId,
        offer: OfferId,
        words: &[i32],
    ) -> Result<Onward, Failure> {
        let trail = &trails.points[at as usize];
        let moves = self.symbolic.stepper.offered(offer);
        if moves.len() != 1 {
            return Ok(Onward::Ends);
        }
        let one = moves.get(0);
        if (trail.may_delay && !one.controllable)
            || !self.symbolic.is_enabled(one, trail.zone.bounds())?
        {
            return Ok(Onward::Ends);
        }
        if trails.bytes > MOST_BYTES {
            return Ok(Onward::Unknown);
        }
        let Some(last) = self.symbolic.stepper.fix(one, words) else {
            return Ok(Onward::Varies);
        };
        let mut zone = trail.zone.clone();
        if !last.effect.is_trivial() && !last.effect.enter(&mut zone) {
            return Ok(Onward::Varies);
        }
        let mut steps = trail.steps.clone();
        push_step(&mut steps, trail.may_delay, &last.effect);
        let length = trail.length + 1;
        self.add_trail(trails, words, last, zone, (steps, length))
    }

    /// Adds the trail that ends with `last`, taken in a state with these words, and enters `zone`.
    fn add_trail(
        &mut self,
        trails: &mut Trails,
        words: &[i32],
        last: FixedMove,
        mut zone: Zone,
        (steps, length): (Vec<ProgramStep>, u32),
    ) -> Result<Onward, Failure> {
        let mut target = words.to_vec();
        last.enter_locations(&mut target);
        let may_delay = delay_after(self.symbolic, &mut target, (&steps, self.latest), &mut zone)?;
        let is_end = length as usize == LONGEST_CHAIN
            || (may_delay && !self.chains_delays)
            || self.symbolic.is_almost_out_of_range(zone.bounds())
            || (trails.is_objective_fixed && !self.is_open(&mut target, &zone)?);
        Ok(trails.add(Trail {
            last,
            vector: None,
            zone,
            may_delay,
            length,
            steps,
            is_end,
            onward: Vec::new(),
            ending: None,
        }))
    }

    /// Adds the edge of a chain that ends at the end of a trail.
    fn end_trail(
        &mut self,
        trail: &mut Trail,
        words: &mut [i32],
        origin: Origin,
    ) -> Result<(), Failure> {
        if trail.ending.is_none() {
            let mut zone = trail.zone.clone();
            self.symbolic.extrapolate(words, zone.bounds_mut());
            trail.ending = Some(Ending {
                id: self.zones.intern(zone.bounds()),
                program: self.programs.intern(&trail.steps),
                totality: None,
                zone,
            });
        }
        let Some(ending) = &mut trail.ending else {
            return Ok(());
        };
        self.add_edge(words, ending, origin, trail.length)
    }

    /// Whether play goes on: neither the goal holds anywhere in the state, nor is anything broken,
    /// nor is it a dead end.
    pub(super) fn is_open(&mut self, words: &mut [i32], zone: &Zone) -> Result<bool, Failure> {
        if self.dead_ends.contain(words) {
            return Ok(false);
        }
        let extents = self.extents(words, zone)?;
        Ok(matches!(extents, (Extent::Nowhere, Extent::Everywhere)))
    }
}

/// Whether locations alone decide where a predicate holds.
fn hangs_on_locations(predicate: &Predicate) -> bool {
    match predicate {
        Predicate::Constant(_) | Predicate::Location(..) => true,
        Predicate::Data(_) | Predicate::Clock(_) | Predicate::Deadlock => false,
        Predicate::Not(inner) => hangs_on_locations(inner),
        Predicate::And(parts) | Predicate::Or(parts) => parts.iter().all(hangs_on_locations),
    }
}
