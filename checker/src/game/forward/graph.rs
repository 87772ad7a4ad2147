//! The forward part of a game: nodes are symbolic states, edges are moves, and both are made on
//! demand.
//!
//! Invariants:
//! * A node's zone contains its own future where time may pass, and satisfies the invariants.
//! * An edge may stand for a *chain* of moves: a move and the moves that follow without any choice.
//!   A state belongs to the inside of a chain on these conditions: by its words it has exactly one
//!   move; the goal holds nowhere in it, and what must be kept holds everywhere; and either time
//!   cannot pass in it, or the one move is the controller's and waiting never helps the controller.
//!   Nothing of the inside is stored. The winning valuations of the inside follow from those of the
//!   end, since no player has a choice.
//! * Where a move of the controller leads to a branch point, its edges are the *legs* of one entry
//!   ([`super::branch_points`]): the controller chooses among entries only.
//! * An edge leads to a node whose zone contains the zone that the moves reach.
//! * In a graph of discrete states ([`Graph::of_discrete_states`]) there is one node for each
//!   discrete state, whose zone is all that its invariants allow. The winner from a valuation does
//!   not depend on the path to it, so the answer is the same. There may be far fewer nodes, but
//!   also nodes that no run reaches, so a run-time error in such a graph means nothing.
//! * All states from which the target cannot be reached any more are one node
//!   ([`super::dead_ends`]), unless the initial state is among them; the states after them are left
//!   out.
//!
//! Where synchronisations on urgent channels have clock guards, time does not reach all of a node's
//! zone: see [`super::urgent_nodes`].
//!
//! Extrapolation is Extra-M+ here, because backward steps use the constants of guards and goals
//! exactly. If the model compares two clocks, zones are cut along the comparisons, and a move has
//! an edge for each piece; there are no chains then.

use crate::cancellation;
use crate::network::{ClockEffect, Failure, Moves, Symbolic};
use crate::search::store::discrete_states::{DiscreteId, StateStore};
use crate::zones::dbm::{self, Constraint};
use crate::zones::federation::table_bytes;
use crate::zones::zone_table::{ZoneId, ZoneTable};
use crate::zones::{Bound, Federation, Zone, clocks};

use super::branch_points::BranchPoints;
use super::chain_cache::ChainCache;
use super::clock_programs::{ProgramStep, Programs};
use super::dead_ends::DeadEnds;
use super::node::{Edge, LONGEST_CHAIN, NONE, Node, Parts, Standing};
use super::objective::Objective;
use super::urgent_nodes::Urgent;

/// The game graph.
pub struct Graph<'s, 'a> {
    /// The network.
    pub symbolic: &'s mut Symbolic<'a>,
    pub(super) objective: Objective<'s>,
    /// The latest time of a state, if there is a deadline.
    pub(in crate::game) latest: Option<Constraint>,
    pub(super) store: StateStore,
    pub(in crate::game) zones: ZoneTable,
    /// The effects of edges on clocks.
    pub programs: Programs,
    /// The nodes; the first is the initial one.
    pub nodes: Vec<Node>,
    /// The edges.
    pub edges: Vec<Edge>,
    pub(super) heads: Vec<u32>,
    pub(super) parts: rustc_hash::FxHashMap<u32, Parts>,
    pub(super) urgent: rustc_hash::FxHashMap<u32, Urgent>,
    /// The bytes that the zones of `parts` and `urgent` take.
    pub(super) cut_bytes: usize,
    /// The number of zones at the last report to the account.
    pub(in crate::game) counted_zones: usize,
    /// How many states were expanded, those inside chains included.
    pub explored: u64,
    pub(super) words: Vec<i32>,
    pub(super) target: Vec<i32>,
    /// The words after a move that may belong to a chain.
    pub(super) spare: Vec<i32>,
    pub(super) moves: Moves,
    pub(super) chain_moves: Moves,
    pub(super) steps: Vec<ProgramStep>,
    /// The effect on clocks of the last move.
    pub(super) effect: ClockEffect,
    pub(super) entries: Vec<Zone>,
    pub(super) chains_delays: bool,
    pub(super) trails: ChainCache,
    pub(in crate::game) branch_points: BranchPoints,
    /// Whether there is one node for each discrete state.
    pub(super) has_discrete_nodes: bool,
    pub(super) dead_ends: DeadEnds,
    /// The greatest number of moves in one chain.
    pub(super) longest_chain: usize,
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
        graph.trails = ChainCache::new(false, &graph.objective);
        let (mut words, _, invariant) = graph.symbolic.start()?;
        let zone = graph.anything_within(&invariant);
        let id = graph.zones.intern(zone.bounds());
        graph.node_of(&mut words, &zone, id, None)?;
        Ok(graph)
    }

    /// Makes a node of every state, instead of chains. It must be called before the first node is
    /// expanded.
    pub fn disable_chains(&mut self) {
        self.longest_chain = 1;
        self.trails = ChainCache::new(false, &self.objective);
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
            trails: ChainCache::new(has_trails, &objective),
            branch_points: BranchPoints::new(network),
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

    /// All that an invariant allows, up to the deadline.
    pub(super) fn anything_within(&self, invariant: &[Constraint]) -> Zone {
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
            + self.branch_points.bytes()
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

    /// The words of a node.
    pub fn words_of(&self, node: u32) -> Vec<i32> {
        self.store.words(self.nodes[node as usize].discrete)
    }

    /// The edges of an expanded node.
    pub fn edges_of(&self, node: u32) -> std::ops::Range<usize> {
        let (first, last) = self.nodes[node as usize].edges;
        first as usize..last as usize
    }

    /// The edges of a node.
    pub fn edges_from(&self, node: u32) -> &[Edge] {
        &self.edges[self.edges_of(node)]
    }

    /// The edges into a node, the last one first.
    pub fn edges_into(&self, node: u32) -> impl Iterator<Item = &Edge> {
        // There is none beyond the list.
        let edge = |index: u32| self.edges.get(index as usize);
        let last = edge(self.nodes[node as usize].first_in);
        std::iter::successors(last, move |one| edge(one.next_in))
    }

    /// How time is stopped in a node; `None` if nothing stops it for only some clock values.
    pub fn urgent(&self, node: u32) -> Option<&Urgent> {
        if self.urgent.is_empty() {
            return None;
        }
        self.urgent.get(&node)
    }

    /// All valuations of a node that count.
    pub fn whole(&self, node: u32) -> Federation {
        match self.urgent(node) {
            Some(urgent) => urgent.reached.clone(),
            None => Federation::of_zone(self.dimension(), self.zone(node)),
        }
    }

    /// Whether a node whose zone contains that of a state also reaches everything that the state
    /// reaches.
    pub(super) fn covers(&self, node: u32, zone: &Zone, urgent: Option<&Urgent>) -> bool {
        match (self.urgent(node), urgent) {
            (None, _) => true,
            (Some(known), None) => known.reached.includes_zone(zone.bounds()),
            (Some(known), Some(new)) => new.reached.is_subset(&known.reached),
        }
    }

    /// The node of a state whose zone has this id. It is made if no stored node contains the state.
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
        let made = cancellation::number(self.nodes.len());
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

    /// Makes a node that is not found by its words.
    pub(super) fn push_node(
        &mut self,
        discrete: DiscreteId,
        zone: ZoneId,
        standing: Standing,
    ) -> u32 {
        let node = cancellation::number(self.nodes.len());
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
        node
    }
}
