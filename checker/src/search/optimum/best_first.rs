//! A search without short cuts that explores states of least cost first. It finds shortest and
//! fastest traces, and the reached set of a certificate.
//!
//! Every state is stored, even with committed locations. A state is left out only if a stored one
//! with the same words contains its zone. So the stored extrapolated zones contain the successors
//! of each of them: they are closed under all moves and delays, which is what a certificate claims.
//! A stored state that contains a new one was reached at no greater cost, so no state of least cost
//! is lost.
//!
//! With *moves* as costs, this is a breadth-first search. *Time* as cost is the lower bound of a
//! clock that is never set, which the caller adds to the network. Its upper bounds are forgotten in
//! every state, as if any more time might have passed before. Then states that differ only in how
//! much time may be wasted are the same, and there are finitely many with bounded cost.
//!
//! Source: G. Behrmann, A. Fehnker, T. Hune, K. G. Larsen, P. Pettersson, J. Romijn, F. Vaandrager,
//! "Efficient Guiding Towards Cost-Optimality in UPPAAL", TACAS 2001 (least time by a clock of its
//! own, best first).
//!
//! Cost: that of a search with inclusion, times the states that short cuts would save.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::cancellation::{self, Room};
use crate::network::{Failure, Moves, Part, Symbolic};
use crate::zones::{Bound, Zone, dbm};

use crate::search::limits::{
    Counters, StopReason, Watch, moves_between_checks, states_between_checks,
};
use crate::search::outcome::Step;
use crate::search::outcome::{Outcome, Trace};
use crate::search::reachability::goal::{Goal, Target};
use crate::search::reachability::retrace;
use crate::search::store::discrete_states::{DiscreteId, StateStore};

/// The greatest number of states between two checks of the limits.
const LOOK_EVERY: u64 = 256;

/// No node.
const NONE: u32 = u32::MAX;

/// What must be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The number of moves.
    Moves,
    /// The value of the clock with this index, which nothing sets or compares.
    Time(usize),
}

/// A cost: a number, and 1 if it can only be approached.
pub type Cost = (i32, u32);

/// A path of least cost: the indices of its moves among those of its states.
#[derive(Clone, Debug)]
pub struct Way {
    pub(super) steps: Vec<Step>,
    /// Its cost.
    pub cost: Cost,
}

impl Way {
    /// The trace of the path. `symbolic` may be without the clock that measures time.
    pub fn trace(&self, symbolic: &mut Symbolic<'_>, goal: &mut dyn Goal) -> Trace {
        retrace::retrace(symbolic, &self.steps, Some(goal))
    }
}

/// The stored states: words with their zones.
pub type Reached = Vec<(Vec<i32>, Vec<Zone>)>;

/// A state as it was reached first.
#[derive(Clone, Debug)]
pub struct Met {
    /// Its words.
    pub words: Vec<i32>,
    /// Its zone, extrapolated.
    pub zone: Zone,
    /// The earlier state from which it was reached, and the move; `None` for the initial state.
    pub from: Option<(usize, Vec<Part>)>,
}

/// A move from one state of a list to another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// The index of the state from which it leads.
    pub source: usize,
    /// The edges that are taken together.
    pub parts: Vec<Part>,
    /// The index of the state that contains where it leads.
    pub target: usize,
}

struct Node {
    discrete: DiscreteId,
    zone: Zone,
    parent: u32,
    step: Step,
    cost: Cost,
}

/// An entry of the worklist: a node to explore, or one that satisfies the goal.
type Waiting = Reverse<(Cost, bool, u32)>;

/// A search for a state of least cost.
pub struct BestFirst<'s, 'a> {
    symbolic: &'s mut Symbolic<'a>,
    goal: &'s dyn Target,
    measure: Measure,
    store: StateStore,
    nodes: Vec<Node>,
    /// For each discrete state: its nodes.
    lists: Vec<Vec<u32>>,
    waiting: BinaryHeap<Waiting>,
    /// All moves: from which node, which move, and to which node; `None` if nobody asks for them.
    links: Option<Vec<(u32, Step, u32)>>,
    explored: u64,
    before: Counters,
}

impl<'s, 'a> BestFirst<'s, 'a> {
    /// A search for the goal. `before` is what was done outside this search, for the limits.
    pub fn new(
        symbolic: &'s mut Symbolic<'a>,
        goal: &'s dyn Target,
        measure: Measure,
        before: Counters,
    ) -> BestFirst<'s, 'a> {
        BestFirst {
            store: StateStore::new(symbolic.stepper.network()),
            symbolic,
            goal,
            measure,
            nodes: Vec::new(),
            lists: Vec::new(),
            waiting: BinaryHeap::new(),
            links: None,
            explored: 0,
            before,
        }
    }

    /// Remembers all moves, for [`BestFirst::into_graph`].
    #[must_use]
    pub fn with_links(mut self) -> Self {
        self.links = Some(Vec::new());
        self
    }

    /// What was done, with what was done before.
    pub fn counters(&self) -> Counters {
        let dimension = self.symbolic.dimension();
        let zone = dimension * dimension * size_of::<Bound>();
        let node = size_of::<Node>() + zone + 2 * size_of::<Waiting>();
        let links = self.links.as_ref().map_or(0, |links| size_of_val(&**links));
        let own = Counters {
            explored: self.explored,
            stored: self.nodes.len() as u64,
            waiting: self.waiting.len() as u64,
            bytes: (self.store.bytes() + self.nodes.len() * node + links) as u64,
        };
        own + self.before
    }

    /// Searches.
    pub fn run(&mut self, watch: &mut dyn Watch) -> Result<Outcome<Way>, Failure> {
        let (mut words, zone, invariant) = self.symbolic.start()?;
        let mut zones = vec![zone];
        self.symbolic
            .let_time_pass(&mut words, &invariant, &mut zones)?;
        self.enter(&mut words, &mut zones, NONE, 0)?;
        let look_every = states_between_checks(LOOK_EVERY, self.symbolic.dimension());
        let mut next_look = look_every;
        while let Some(Reverse((cost, is_goal, node))) = self.waiting.pop() {
            if is_goal {
                return Ok(Outcome::Found(self.way(node, cost)));
            }
            if let Some(reason) = self.explore(node, watch)? {
                return Ok(Outcome::Stopped(reason));
            }
            if self.explored >= next_look {
                next_look = self.explored + look_every;
                if let Some(reason) = watch.look(&self.counters()) {
                    return Ok(Outcome::Stopped(reason));
                }
            }
        }
        Ok(Outcome::Exhausted)
    }

    /// Enters the successors of a node; a limit may stop this.
    fn explore(&mut self, node: u32, watch: &mut dyn Watch) -> Result<Option<StopReason>, Failure> {
        let dimension = self.symbolic.dimension();
        let nodes_between = moves_between_checks(LOOK_EVERY, dimension) as usize;
        let mut nodes_at_look = self.nodes.len() + nodes_between;
        self.explored += 1;
        let Node { discrete, zone, .. } = &self.nodes[node as usize];
        let (mut words, zone) = (self.store.words(*discrete), zone.clone());
        let mut moves = Moves::default();
        self.symbolic
            .moves_within(&mut words, zone.bounds(), &mut moves)?;
        let mut target = words.clone();
        let mut zones = Vec::new();
        for one in moves.iter() {
            let symbolic = &mut *self.symbolic;
            let Some(effect) = symbolic.fire_within(one, &words, zone.bounds(), &mut target)?
            else {
                continue;
            };
            effect.entry_zones(zone.bounds(), self.symbolic.dimension(), &mut zones);
            self.symbolic
                .let_time_pass(&mut target, &effect.invariant, &mut zones)?;
            self.enter(&mut target, &mut zones, node, one.rank)?;
            if self.nodes.len() >= nodes_at_look {
                nodes_at_look = self.nodes.len() + nodes_between;
                let reason = watch.look(&self.counters());
                if reason.is_some() {
                    return Ok(reason);
                }
            }
        }
        Ok(None)
    }

    /// Stores the zones of a state that was reached, unless a stored one contains them, and looks
    /// for the goal in them.
    fn enter(
        &mut self,
        words: &mut [i32],
        zones: &mut Vec<Zone>,
        parent: u32,
        step: Step,
    ) -> Result<(), Failure> {
        if let Measure::Time(clock) = self.measure {
            for zone in &mut *zones {
                forget_upper_bounds(zone, clock);
            }
        }
        if zones.is_empty() {
            return Ok(());
        }
        let (discrete, is_new) = self.store.intern(words);
        if is_new {
            self.lists.push(Vec::new());
        }
        // The goal is evaluated before extrapolation; where it holds, nothing more is explored.
        for zone in &*zones {
            if let Some(cost) = self.goal_cost(words, zone, parent)? {
                let goal = self.push(discrete, zone.clone(), parent, step, cost);
                self.waiting.push(Reverse((cost, true, goal)));
            }
        }
        self.symbolic.extrapolate_all(words, zones);
        for zone in zones.drain(..) {
            let (nodes, list) = (&self.nodes, &mut self.lists[discrete.0 as usize]);
            let bounds_of = |node: u32| nodes[node as usize].zone.bounds();
            let mut known = list.iter().copied();
            let container = known.find(|&one| dbm::is_subset(zone.bounds(), bounds_of(one)));
            if let Some(links) = self.links.as_mut().filter(|_| parent != NONE) {
                let target = container.unwrap_or(self.nodes.len() as u32);
                links.push((parent, step, target));
            }
            if container.is_some() {
                continue;
            }
            // What the new zone contains was reached before, at no greater cost. It stays for the
            // paths through it, but not in the list.
            list.retain(|&one| !dbm::is_subset(bounds_of(one), zone.bounds()));
            let cost = match self.measure {
                Measure::Moves => self.moves_after(parent),
                Measure::Time(clock) => least_value(&zone, clock),
            };
            let node = self.push(discrete, zone, parent, step, cost);
            self.lists[discrete.0 as usize].push(node);
            self.waiting.push(Reverse((cost, false, node)));
        }
        Ok(())
    }

    fn push(
        &mut self,
        discrete: DiscreteId,
        zone: Zone,
        parent: u32,
        step: Step,
        cost: Cost,
    ) -> u32 {
        let node = cancellation::number(self.nodes.len());
        self.nodes.push(Node {
            discrete,
            zone,
            parent,
            step,
            cost,
        });
        node
    }

    fn moves_after(&self, parent: u32) -> Cost {
        match self.nodes.get(parent as usize) {
            None => (0, 0),
            Some(parent) => (parent.cost.0 + 1, 0),
        }
    }

    /// The least cost of a valuation of the zone that was looked for.
    fn goal_cost(
        &mut self,
        words: &mut [i32],
        zone: &Zone,
        parent: u32,
    ) -> Result<Option<Cost>, Failure> {
        let part = self.goal.part(self.symbolic, words, zone)?;
        let costs = part.to_zones().map(|zone| match self.measure {
            Measure::Moves => self.moves_after(parent),
            Measure::Time(clock) => least_value(&zone, clock),
        });
        Ok(costs.min())
    }

    fn way(&self, mut node: u32, cost: Cost) -> Way {
        let mut steps = Vec::new();
        while let Some(one) = self.nodes.get(node as usize) {
            if one.parent != NONE {
                steps.push(one.step);
            }
            node = one.parent;
        }
        steps.reverse();
        Way { steps, cost }
    }

    /// The stored states, none of which contains another.
    pub fn into_reached(self) -> Reached {
        let mut reached = Reached::new();
        let mut room = Room::default();
        for (index, list) in self.lists.iter().enumerate() {
            let words = self.store.words(DiscreteId(index as u32));
            let zones = list.iter();
            let zones = zones.map(|&node| self.nodes[node as usize].zone.clone());
            let zone_bytes = (self.symbolic.dimension().pow(2)) * size_of::<Bound>();
            room.take(size_of_val(&*words) + list.len() * (size_of::<Zone>() + zone_bytes));
            reached.push((words, zones.collect()));
        }
        reached
    }

    /// Like [`BestFirst::into_met`], with the moves between these states in the order in which they
    /// were taken. A move stands in it once for each zone that it leads to.
    pub fn into_graph(mut self, most: usize) -> Result<(Vec<Met>, Vec<Link>), Failure> {
        let mut moves = Moves::default();
        let mut moves_of = NONE;
        let mut links = Vec::new();
        for (source, step, target) in self.links.take().unwrap_or_default() {
            if source.max(target) as usize >= most {
                continue;
            }
            if moves_of != source {
                let mut words = self.store.words(self.nodes[source as usize].discrete);
                self.symbolic.moves(&mut words, &mut moves)?;
                moves_of = source;
            }
            links.extend(moves.with_rank(step).map(|one| Link {
                source: source as usize,
                parts: one.parts.to_vec(),
                target: target as usize,
            }));
        }
        Ok((self.into_met(most)?, links))
    }

    /// The first `most` states in the order in which they were reached, including those that a
    /// later one contains.
    pub fn into_met(self, most: usize) -> Result<Vec<Met>, Failure> {
        let mut moves = Moves::default();
        let mut moves_of = NONE;
        let mut met: Vec<Met> = Vec::new();
        for node in self.nodes.into_iter().take(most) {
            let words = self.store.words(node.discrete);
            let mut from = None;
            if node.parent != NONE {
                let parent = node.parent as usize;
                // All successors of a state were reached at once.
                if moves_of != node.parent {
                    let mut source = met[parent].words.clone();
                    self.symbolic.moves(&mut source, &mut moves)?;
                    moves_of = node.parent;
                }
                let taken = moves.with_rank(node.step);
                from = taken.map(|one| (parent, one.parts.to_vec()));
            }
            met.push(Met {
                words,
                zone: node.zone,
                from,
            });
        }
        Ok(met)
    }
}

/// Lets the clock have any greater value, whatever the others have.
fn forget_upper_bounds(zone: &mut Zone, clock: usize) {
    let dimension = zone.dimension();
    let row = &mut zone.bounds_mut()[clock * dimension..][..dimension];
    for (right, bound) in row.iter_mut().enumerate() {
        if right != clock {
            *bound = Bound::INFINITY;
        }
    }
}

fn least_value(zone: &Zone, clock: usize) -> Cost {
    let lower = zone.bound(0, clock);
    (-lower.value(), u32::from(lower.is_strict()))
}
