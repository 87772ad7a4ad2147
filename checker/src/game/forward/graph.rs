//! The forward part of a game: nodes are symbolic states, edges are moves, and both are made as
//! they are asked for.
//!
//! Invariants:
//! * A node's zone contains its own future where time may pass, and satisfies the invariants.
//! * An edge may stand for a *chain* of moves: a move and the moves that follow without any choice.
//!   A state belongs to the inside of a chain if it has exactly one move as far as words decide,
//!   the goal holds nowhere in it and what must be kept everywhere, and time cannot pass in it, or
//!   (if waiting never helps the controller) the one move is the controller's. Nothing of the
//!   inside is stored. The winning valuations of the inside follow from those of the end, since
//!   nobody has a choice.
//! * Where a move of the controller leads to a branch point, its edges are the *legs* of one entry
//!   ([`super::chance`]): the controller chooses among entries only.
//! * An edge leads to a node whose zone contains the zone that the moves reach.
//! * In a graph of discrete states ([`Graph::of_discrete_states`]) there is one node for each
//!   discrete state, whose zone is all that its invariants allow. Who wins from a valuation does
//!   not hang on how it is reached, so the answer is the same. There may be far fewer nodes, but
//!   also ones that no run reaches, so a run-time error in such a graph means nothing.
//! * All states from which what is sought cannot come any more are one node ([`super::dead_ends`]),
//!   unless the initial one is among them; what follows after them is left out.
//!
//! Where synchronisations on urgent channels have clock guards, time does not reach all of a node's
//! zone: see [`super::urgent_nodes`].
//!
//! Extrapolation is Extra-M+ here: backward steps use the constants of guards and goals exactly.
//! Where two clocks are compared, zones are cut along the comparisons, and a move has an edge for
//! each piece; there are no chains then.

use crate::cancellation;
use crate::ir::Predicate;
use crate::network::{ClockEffect, Extent, Failure, Moves, Symbolic};
use crate::search::store::discrete_states::{DiscreteId, StateStore};
use crate::zones::dbm::{self, Constraint};
use crate::zones::zone_table::{ZoneId, ZoneTable};
use crate::zones::{Bound, Federation, Zone, clocks};

use super::chain_cache::{Ending, Root, Trails};
use super::chance::Chances;
use super::clock_programs::{ProgramId, ProgramStep, Programs};
use super::dead_ends::DeadEnds;
pub use super::deadline::Deadline;
use super::urgent_nodes::Urgent;
use crate::game::backward::memory::table_bytes;

/// Bytes of zones that the account need not be told of.
const MOST_UNTOLD_BYTES: usize = 4 << 20;

/// Moves in one chain, at most; longer ones are cut by a node, so that loops end.
pub(super) const LONGEST_CHAIN: usize = 64;

/// No node or edge.
pub const NONE: u32 = u32::MAX;

/// A symbolic state.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Its words.
    pub discrete: DiscreteId,
    /// Its zone.
    pub zone: ZoneId,
    /// The next node with the same words.
    next: u32,
    /// Its edges, once it is expanded.
    pub edges: (u32, u32),
    /// The first edge into it, [`NONE`] without one.
    pub first_in: u32,
    /// Whether its edges are known.
    pub is_expanded: bool,
    /// Whether time may pass in it; known once it is expanded.
    pub delays: bool,
    /// Where the goal holds, and where what must be kept does not.
    pub standing: Standing,
}

/// Whether a node is decided by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Neither the goal holds anywhere nor is anything broken.
    Open,
    /// The goal holds in the whole node.
    Goal,
    /// What must be kept is broken in the whole node, and the goal holds nowhere.
    Broken,
    /// Both depend on the clocks; see [`Graph::parts`].
    Mixed,
    /// What is sought cannot come any more: see [`super::dead_ends`].
    Dead,
}

/// The parts of a mixed node.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Where the goal holds.
    pub goal: Federation,
    /// Where neither the goal holds nor what must be kept.
    pub broken: Federation,
}

/// A move, with those that follow without a choice.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Where it starts.
    pub source: u32,
    /// Where it ends.
    pub target: u32,
    /// The next edge into the same target.
    pub next_in: u32,
    /// What it does to clocks.
    pub program: ProgramId,
    /// The index of the first move among the moves of the source.
    pub ordinal: u32,
    /// The processes that take part in the first move, a bit for each; those with the same index
    /// modulo 32 share one.
    pub movers: u32,
    /// How many moves it stands for.
    pub length: u8,
    /// Whether the controller owns the first move.
    pub controllable: bool,
    /// Whether it leads from every valuation of the source into the target.
    pub is_total: bool,
    /// Whether it is one of several legs of an entry that the controller owns.
    pub is_leg: bool,
}

/// What is to be reached and kept.
#[derive(Clone, Copy, Debug)]
pub struct Objective<'q> {
    /// The goal; play ends where it holds. `None`: there is none (safety).
    pub goal: Option<&'q Predicate>,
    /// What must hold until then; `None`: nothing.
    pub keep: Option<&'q Predicate>,
    /// Whether waiting for ever never helps the controller.
    pub must_progress: bool,
    /// By when the goal must be reached.
    pub deadline: Option<Deadline>,
    /// Whether what follows after dead ends is left out.
    pub leaves_dead_ends: bool,
}

/// The game graph.
pub struct Graph<'s, 'a> {
    /// The network.
    pub symbolic: &'s mut Symbolic<'a>,
    pub(super) objective: Objective<'s>,
    /// How late a state may be, if there is a deadline.
    pub(in crate::game) latest: Option<Constraint>,
    store: StateStore,
    pub(in crate::game) zones: ZoneTable,
    /// What edges do to clocks.
    pub programs: Programs,
    /// The nodes; the first is the initial one.
    pub nodes: Vec<Node>,
    /// The edges.
    pub edges: Vec<Edge>,
    heads: Vec<u32>,
    parts: rustc_hash::FxHashMap<u32, Parts>,
    pub(super) urgent: rustc_hash::FxHashMap<u32, Urgent>,
    /// The bytes that the zones of `parts` and `urgent` take.
    cut_bytes: usize,
    /// How many zones there were when the account was told last.
    pub(in crate::game) counted_zones: usize,
    /// How many states were expanded, those inside chains included.
    pub explored: u64,
    words: Vec<i32>,
    target: Vec<i32>,
    /// The words after a move that may belong to a chain.
    spare: Vec<i32>,
    moves: Moves,
    chain_moves: Moves,
    pub(super) steps: Vec<ProgramStep>,
    /// What the move that was just taken does to clocks.
    pub(super) effect: ClockEffect,
    pub(super) entries: Vec<Zone>,
    pub(super) chains_delays: bool,
    pub(super) trails: Trails,
    pub(in crate::game) chances: Chances,
    /// Whether there is one node for each discrete state.
    has_discrete_nodes: bool,
    pub(super) dead_ends: DeadEnds,
    /// Moves in one chain, at most.
    longest_chain: usize,
}

/// Where an edge starts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    pub(super) node: u32,
    /// The index of the first move.
    pub(super) ordinal: u32,
    controllable: bool,
    movers: u32,
}

impl<'s, 'a> Graph<'s, 'a> {
    /// A graph that holds the initial node only.
    pub fn new(
        symbolic: &'s mut Symbolic<'a>,
        objective: Objective<'s>,
    ) -> Result<Graph<'s, 'a>, Failure> {
        let mut graph = Graph::without_nodes(symbolic, objective)?;
        if graph.symbolic.has_barriers() {
            graph.start_urgently()?;
            return Ok(graph);
        }
        let (mut words, mut zone) = graph.initial()?;
        graph.symbolic.extrapolate(&words, zone.bounds_mut());
        let id = graph.zones.intern(zone.bounds());
        graph.node_of(&mut words, &zone, id, None)?;
        Ok(graph)
    }

    /// A graph of discrete states that holds the initial node only. No clock may be stopped.
    ///
    /// Source: N. Jensen, K. G. Larsen, D. Lime, J. Srba, "On-the-Fly Symbolic Algorithm for Timed
    /// ATL with Abstractions", CONCUR 2025 (expansion abstraction).
    pub fn of_discrete_states(
        symbolic: &'s mut Symbolic<'a>,
        objective: Objective<'s>,
    ) -> Result<Graph<'s, 'a>, Failure> {
        let mut graph = Graph::without_nodes(symbolic, objective)?;
        graph.has_discrete_nodes = true;
        graph.trails = Trails::new(false, &graph.objective);
        let (mut words, _, invariant) = graph.symbolic.start()?;
        let zone = graph.anything_within(&invariant);
        let id = graph.zones.intern(zone.bounds());
        graph.node_of(&mut words, &zone, id, None)?;
        Ok(graph)
    }

    /// Makes a node of every state, instead of chains; before the first node is expanded.
    pub fn leave_out_chains(&mut self) {
        self.longest_chain = 1;
        self.trails = Trails::new(false, &self.objective);
    }

    fn without_nodes(
        symbolic: &'s mut Symbolic<'a>,
        objective: Objective<'s>,
    ) -> Result<Graph<'s, 'a>, Failure> {
        let network = symbolic.stepper.network();
        let deadline = objective.deadline;
        let latest = deadline.map(|deadline| deadline.until(deadline.limit));
        let tuning = symbolic.tuning();
        let has_trails = tuning.chains && tuning.chain_cache && symbolic.is_fixed();
        Ok(Graph {
            latest: latest.transpose()?,
            store: StateStore::new(network),
            zones: ZoneTable::new(symbolic.dimension()),
            programs: Programs::default(),
            nodes: Vec::new(),
            edges: Vec::new(),
            heads: Vec::new(),
            parts: rustc_hash::FxHashMap::default(),
            urgent: rustc_hash::FxHashMap::default(),
            cut_bytes: 0,
            explored: 0,
            words: network.initial.clone(),
            target: network.initial.clone(),
            spare: network.initial.clone(),
            moves: Moves::default(),
            chain_moves: Moves::default(),
            counted_zones: 0,
            steps: Vec::new(),
            effect: ClockEffect::default(),
            entries: Vec::new(),
            chains_delays: objective.must_progress && !network.features.stopwatches,
            trails: Trails::new(has_trails, &objective),
            chances: Chances::new(network),
            has_discrete_nodes: false,
            dead_ends: if objective.leaves_dead_ends && symbolic.tuning().dead_ends {
                DeadEnds::new(network, &objective)
            } else {
                DeadEnds::default()
            },
            longest_chain: if symbolic.tuning().chains {
                LONGEST_CHAIN
            } else {
                1
            },
            objective,
            symbolic,
        })
    }

    /// All that is allowed by an invariant, up to the deadline.
    fn anything_within(&self, invariant: &[Constraint]) -> Zone {
        let mut zone = Zone::of_constraints(self.dimension(), invariant);
        zone.constrain_all(self.latest.as_slice());
        zone
    }

    /// The initial words and zone.
    fn initial(&mut self) -> Result<(Vec<i32>, Zone), Failure> {
        let (mut words, mut zone, invariant) = self.start()?;
        let may_delay = self.symbolic.may_delay(&mut words)?;
        self.symbolic
            .delay(&words, may_delay, &invariant, zone.bounds_mut())?;
        zone.constrain_all(self.latest.as_slice());
        Ok((words, zone))
    }

    /// The initial words, the zone before time passes, and the invariants.
    pub(super) fn start(&mut self) -> Result<(Vec<i32>, Zone, Vec<Constraint>), Failure> {
        let (words, mut zone, invariant) = self.symbolic.start()?;
        if let Some(deadline) = self.objective.deadline.filter(|one| one.starts_anywhere) {
            clocks::free_clock(zone.bounds_mut(), self.dimension(), deadline.clock);
            zone.constrain_all(&[deadline.until(deadline.limit)?]);
        }
        Ok((words, zone, invariant))
    }

    /// The number of clocks, the reference clock included.
    pub fn dimension(&self) -> usize {
        self.symbolic.dimension()
    }

    /// The number of discrete states among the nodes.
    pub fn discrete_count(&self) -> usize {
        self.heads.len()
    }

    /// The zone of a node.
    pub fn zone(&self, node: u32) -> &[Bound] {
        self.zones.get(self.nodes[node as usize].zone)
    }

    /// The parts of a mixed node; `None` for all others.
    pub fn parts(&self, node: u32) -> Option<&Parts> {
        self.parts.get(&node)
    }

    /// The bytes that nodes, edges and states take.
    pub fn bytes(&self) -> u64 {
        let nodes = size_of_val(&*self.nodes) + size_of_val(&*self.heads);
        let cut = table_bytes::<(u32, Parts)>(self.parts.capacity())
            + table_bytes::<(u32, Urgent)>(self.urgent.capacity())
            + self.cut_bytes;
        (self.store.bytes()
            + self.zones.bytes()
            + self.programs.bytes()
            + self.trails.bytes()
            + self.chances.bytes()
            + self.symbolic.bytes()
            + nodes
            + size_of_val(&*self.edges)
            + self.moves.heap_bytes()
            + self.chain_moves.heap_bytes()
            + cut) as u64
    }

    /// Writes the words of a node over those of another state.
    pub fn load(&self, node: u32, words: &mut [i32]) {
        self.store.load(self.nodes[node as usize].discrete, words);
    }

    /// The edges of an expanded node.
    pub fn edges_of(&self, node: u32) -> std::ops::Range<usize> {
        let (first, last) = self.nodes[node as usize].edges;
        first as usize..last as usize
    }

    /// The node of a state, whose zone has this id, made if no stored one contains it.
    pub(super) fn node_of(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
        id: ZoneId,
        urgent: Option<Urgent>,
    ) -> Result<u32, Failure> {
        self.symbolic.forget(words);
        let discrete = self.discrete_of(words);
        let mut node = self.heads[discrete.0 as usize];
        while node != NONE {
            let Node {
                zone: other, next, ..
            } = self.nodes[node as usize];
            if (other == id || dbm::is_subset(zone.bounds(), self.zones.get(other)))
                && self.covers(node, zone, urgent.as_ref())
            {
                return Ok(node);
            }
            node = next;
        }
        let made = self.nodes.len() as u32;
        let standing = self.standing(made, words, zone, urgent.as_ref())?;
        self.push_node(discrete, id, standing);
        let head = &mut self.heads[discrete.0 as usize];
        self.nodes[made as usize].next = std::mem::replace(head, made);
        if let Some(urgent) = urgent {
            self.cut_bytes += urgent.heap_bytes();
            self.urgent.insert(made, urgent);
        }
        Ok(made)
    }

    /// The id of words.
    pub(super) fn discrete_of(&mut self, words: &[i32]) -> DiscreteId {
        let (discrete, is_new) = self.store.intern(words);
        if is_new {
            self.heads.push(NONE);
        }
        discrete
    }

    /// Evaluates the objective in a node anew.
    pub(super) fn judge_anew(&mut self, node: u32) -> Result<(), Failure> {
        let mut words = self.words.clone();
        self.load(node, &mut words);
        let zone = Zone::from_bounds(self.dimension(), self.zone(node));
        let urgent = self.urgent.remove(&node);
        let standing = self.standing(node, &mut words, &zone, urgent.as_ref())?;
        self.nodes[node as usize].standing = standing;
        if let Some(urgent) = urgent {
            self.urgent.insert(node, urgent);
        }
        Ok(())
    }

    /// Makes a node that is not found by its words.
    pub(super) fn push_node(
        &mut self,
        discrete: DiscreteId,
        zone: ZoneId,
        standing: Standing,
    ) -> u32 {
        self.nodes.push(Node {
            discrete,
            zone,
            next: NONE,
            edges: (0, 0),
            first_in: NONE,
            is_expanded: false,
            delays: false,
            standing,
        });
        self.nodes.len() as u32 - 1
    }

    /// Evaluates the objective in a state that becomes the node `made`.
    fn standing(
        &mut self,
        made: u32,
        words: &mut [i32],
        zone: &Zone,
        urgent: Option<&Urgent>,
    ) -> Result<Standing, Failure> {
        let (goal, keep) = self.extents(words, zone)?;
        match (goal, keep) {
            (Extent::Everywhere, _) => Ok(Standing::Goal),
            (Extent::Nowhere, Extent::Nowhere) => Ok(Standing::Broken),
            (Extent::Nowhere, _) if self.dead_ends.contain(words) => Ok(Standing::Dead),
            (Extent::Nowhere, Extent::Everywhere) => Ok(Standing::Open),
            (goal, keep) => {
                let dimension = self.dimension();
                let goal = goal.to_federation(zone.bounds(), dimension);
                let mut broken = Federation::of_zone(dimension, zone.bounds());
                broken.subtract(&keep.to_federation(zone.bounds(), dimension));
                broken.subtract(&goal);
                let mut goal = goal;
                if let Some(urgent) = urgent {
                    goal = goal.intersection(&urgent.reached);
                    broken = broken.intersection(&urgent.reached);
                    if urgent.reached.is_subset(&goal) {
                        return Ok(Standing::Goal);
                    }
                    if goal.is_empty() && broken.is_empty() {
                        return Ok(Standing::Open);
                    }
                    if goal.is_empty() && urgent.reached.is_subset(&broken) {
                        return Ok(Standing::Broken);
                    }
                }
                goal.shrink();
                broken.shrink();
                self.cut_bytes += goal.heap_bytes() + broken.heap_bytes();
                if let Some(old) = self.parts.insert(made, Parts { goal, broken }) {
                    self.cut_bytes -= old.goal.heap_bytes() + old.broken.heap_bytes();
                }
                Ok(Standing::Mixed)
            }
        }
    }

    /// Where the goal holds, and where what must be kept does.
    pub(super) fn extents(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
    ) -> Result<(Extent, Extent), Failure> {
        let goal = match self.objective.goal {
            Some(goal) => self.symbolic.extent(goal, words, zone.bounds())?,
            None => Extent::Nowhere,
        };
        let keep = match self.objective.keep {
            Some(keep) => self.symbolic.extent(keep, words, zone.bounds())?,
            None => Extent::Everywhere,
        };
        self.in_time(words, zone, (goal, keep))
    }

    /// Computes the edges of a node. Nodes that this makes are behind the ones there were.
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
        self.chances
            .find(node, (&mut self.edges, first as usize), moves);
        let node = &mut self.nodes[node as usize];
        node.edges = (first, self.edges.len() as u32);
        node.delays = delays;
        node.is_expanded = true;
        Ok(())
    }

    /// Computes the moves of a node; gives the root of their trails, if they were met before.
    fn moves_of(
        &mut self,
        node: u32,
        words: &mut [i32],
        moves: &mut Moves,
    ) -> Result<Option<Root>, Failure> {
        let stepper = &mut self.symbolic.stepper;
        if self.trails.is_useful()
            && let Some(vector) = stepper.vector(words)
            && let Some(offer) = stepper.offer(vector, words)?
        {
            moves.copy_from(stepper.offered(offer));
            let zone = self.nodes[node as usize].zone;
            return Ok(self.trails.root(offer, zone, moves));
        }
        self.symbolic.remembered_moves(words, moves)?;
        Ok(None)
    }

    /// Takes a move of a node, and the moves after it as long as there is no choice; adds the edge.
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
        let may_delay = delay_after(self.symbolic, target, (&self.steps, self.latest), &mut zone)?;
        self.go_on(origin, target, zone, (1, may_delay))
    }

    /// Goes on with a chain of which `length` moves were taken, and adds its edge. The zone
    /// contains its future if time may pass.
    pub(super) fn go_on(
        &mut self,
        origin: Origin,
        target: &mut Vec<i32>,
        mut zone: Zone,
        (mut length, mut may_delay): (u32, bool),
    ) -> Result<(), Failure> {
        while (length as usize) < self.longest_chain
            && !self.symbolic.is_almost_out_of_range(zone.bounds())
            && self.only_move(target, &mut zone, may_delay)?
        {
            push_step(&mut self.steps, may_delay, &self.effect);
            std::mem::swap(target, &mut self.spare);
            length += 1;
            may_delay = delay_after(self.symbolic, target, (&self.steps, self.latest), &mut zone)?;
        }
        self.end(target, zone, origin, length)
    }

    /// Takes the only move of a state inside a chain: leaves its effect in `effect`, the words
    /// after it in `spare`, and the zone on entry in `zone`. Returns false, with the zone as it
    /// was, if the chain ends with the state.
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

    /// Ends an edge whose first move enters in several zones, or none: an edge to each.
    fn end_in_pieces(&mut self, target: &mut [i32], origin: Origin) -> Result<(), Failure> {
        let mut zones = std::mem::take(&mut self.entries);
        if !zones.is_empty() && self.dead_ends.contain(target) {
            let program = self.programs.intern(&self.steps);
            self.end_dead(target, program, origin, 1);
            return Ok(());
        }
        for zone in &mut zones {
            delay_after(self.symbolic, target, (&self.steps, self.latest), zone)?;
        }
        if self.has_discrete_nodes {
            // All pieces end in the same node, and the steps say from where.
            zones.truncate(1);
        } else if self.symbolic.splits() {
            self.symbolic.extrapolate_all(target, &mut zones);
        }
        for zone in zones {
            self.end(target, zone, origin, 1)?;
        }
        Ok(())
    }

    /// Adds the edge of the steps at hand, which lead to this zone.
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
        self.ask_for_zones();
        self.add_edge(target, &mut ending, origin, length)
    }

    /// Asks whether there may be the zones that the account was not told of yet, if they are many:
    /// one node can have thousands of successors.
    fn ask_for_zones(&self) {
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
        let (from, to) = (
            self.nodes[source as usize].zone,
            self.nodes[target as usize].zone,
        );
        let is_total = match ending.totality {
            Some((known, is_total)) if known == to => is_total,
            _ => {
                let ends = ((from, self.zones.get(from)), (to, self.zones.get(to)));
                self.programs
                    .is_total(program, ends.0, ends.1, self.symbolic.dimension())
            }
        };
        ending.totality = Some((to, is_total));
        self.link(origin, target, program, (length, is_total));
        Ok(())
    }

    /// Adds an edge between two nodes that stands for `length` moves.
    pub(super) fn link(
        &mut self,
        origin: Origin,
        target: u32,
        program: ProgramId,
        (length, is_total): (u32, bool),
    ) {
        let Origin {
            node: source,
            ordinal,
            controllable,
            movers,
        } = origin;
        let edge = self.edges.len() as u32;
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

/// Lets time pass in a state that the steps lead to, within its invariant and until it is too late,
/// if it may; returns whether it may.
pub(super) fn delay_after(
    symbolic: &mut Symbolic<'_>,
    words: &mut [i32],
    (steps, latest): (&[ProgramStep], Option<Constraint>),
    zone: &mut Zone,
) -> Result<bool, Failure> {
    let may_delay = symbolic.may_delay(words)?;
    symbolic.delay(words, may_delay, invariant_after(steps), zone.bounds_mut())?;
    zone.constrain_all(latest.as_slice());
    Ok(may_delay)
}

/// The invariant of the state that the steps lead to: that of the last step, since steps that are
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
