//! Reachability games: can the controller force the goal, keeping what must be kept until then?
//!
//! The algorithm is on the fly and goes forward and backward in turns. Forward, nodes are expanded; backward, the winning
//! valuations of a node are computed anew when those of a successor have grown:
//!
//! ```text
//! good   = goal ∪ ⋃ Pre_c(win)                     what the controller can reach by a move
//! bad    = ⋃ Pre_u(not win) ∪ broken, less goal    what the environment can spoil
//! forced = stop ∩ ⋃ enabled_u, less bad and less where the controller could move (see Forced)
//! win    = Pred_t(good ∪ forced, bad)              wait into good without meeting bad
//! ```
//!
//! A move of the environment into a node that is not explored counts as lost, so every intermediate result is sound, and the
//! search ends as soon as the initial valuation is winning. Each gain is recorded with a stamp: a strategy that moves from
//! valuations of one stamp into those of smaller ones makes progress.
//!
//! Forward, the solver dives: it follows the first moves of newly made nodes as far as they go, then takes up the oldest node that
//! waits and dives from there. Ways with few departures from the first moves so come first (W. D. Harvey, M. L. Ginsberg, "Limited
//! Discrepancy Search", IJCAI 1995), which finds a first win early where wins are spread.
//!
//! Nodes that are won or lost as a whole are handled without zones; in models where clocks do not decide who wins, all are.
//!
//! Source: F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient On-the-Fly Algorithms for the Analysis of Timed
//! Games", CONCUR 2005; the forced moves are those of G. Behrmann et al., "UPPAAL-TIGA: Time for Playing Games!", CAV 2007,
//! and the tool's manual, section 3.1.

use std::collections::VecDeque;

use crate::network::Failure;
use crate::search::limits::{Counters, StopReason, Watch};
use crate::zones::{ClockSet, Federation, past};

use super::Forced;
use super::graph::{Edge, Graph, NONE, Standing};

/// Expanded nodes between two looks at the limits.
const LOOK_EVERY: u64 = 64;

/// The winning valuations of a node.
#[derive(Clone, Debug)]
pub enum Win {
    /// None, as far as known.
    Nothing,
    /// All.
    Everything,
    /// These.
    Part(Federation),
}

/// What a stamp added to the winning valuations of a node.
#[derive(Clone, Debug)]
pub struct Gain {
    /// Greater stamps came later.
    pub stamp: u32,
    /// What was added; `None` is the whole zone.
    pub part: Option<Federation>,
}

/// How much is to be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Until the verdict is known.
    Verdict,
    /// The winning valuations of all nodes that can be reached.
    Everything,
}

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The controller wins from the initial valuation.
    Winning,
    /// It does not.
    NotWinning,
    /// A limit came first.
    Stopped(StopReason),
}

/// A solver with its graph.
pub struct Solver<'g, 's, 'a> {
    /// The graph.
    pub graph: &'g mut Graph<'s, 'a>,
    /// By node: the winning valuations.
    pub win: Vec<Win>,
    /// By node: the gains, by ascending stamp. Goals have stamp 0.
    pub gains: Vec<Vec<Gain>>,
    forced: Forced,
    stamp: u32,
    /// Nodes to be expanded, the oldest first.
    waiting: VecDeque<u32>,
    is_waiting: Vec<bool>,
    /// Whether the last expansion made no node to go on with.
    is_dive_over: bool,
    updates: Vec<u32>,
    is_updated: Vec<bool>,
}

impl<'g, 's, 'a> Solver<'g, 's, 'a> {
    /// A solver that has looked at the initial node only.
    pub fn new(graph: &'g mut Graph<'s, 'a>, forced: Forced) -> Solver<'g, 's, 'a> {
        let mut solver = Solver {
            graph,
            win: Vec::new(),
            gains: Vec::new(),
            forced,
            stamp: 0,
            waiting: VecDeque::new(),
            is_dive_over: false,
            is_waiting: Vec::new(),
            updates: Vec::new(),
            is_updated: Vec::new(),
        };
        solver.adopt_new_nodes();
        solver
    }

    /// What was done so far.
    pub fn counters(&self) -> Counters {
        Counters {
            explored: self.graph.explored,
            stored: self.graph.nodes.len() as u64,
            waiting: self.waiting.len() as u64,
            bytes: self.graph.bytes()
                + (self.win.capacity() * (size_of::<Win>() + size_of::<Vec<Gain>>() + 2)) as u64,
        }
    }

    /// Solves the game.
    pub fn solve(&mut self, extent: Extent, watch: &mut dyn Watch) -> Result<Answer, Failure> {
        let mut next_look = LOOK_EVERY;
        loop {
            while let Some(node) = self.updates.pop() {
                self.is_updated[node as usize] = false;
                self.update(node)?;
            }
            if extent == Extent::Verdict && self.is_winning()? {
                return Ok(Answer::Winning);
            }
            let Some(node) = self.next_waiting() else {
                break;
            };
            self.is_waiting[node as usize] = false;
            if self.graph.nodes[node as usize].is_expanded
                || (extent == Extent::Verdict && !self.is_relevant(node))
            {
                continue;
            }
            self.expand(node)?;
            if self.graph.explored >= next_look {
                next_look = self.graph.explored + LOOK_EVERY;
                if let Some(reason) = watch.look(&self.counters()) {
                    return Ok(Answer::Stopped(reason));
                }
            }
        }
        Ok(if self.is_winning()? {
            Answer::Winning
        } else {
            Answer::NotWinning
        })
    }

    fn next_waiting(&mut self) -> Option<u32> {
        if self.is_dive_over {
            self.waiting.pop_front()
        } else {
            self.waiting.pop_back()
        }
    }

    /// Whether the initial valuation is winning.
    pub fn is_winning(&mut self) -> Result<bool, Failure> {
        match &self.win[0] {
            Win::Nothing => Ok(false),
            Win::Everything => Ok(true),
            Win::Part(part) => {
                let values: Vec<i64> = self
                    .graph
                    .symbolic
                    .stepper
                    .network()
                    .initial_clocks
                    .iter()
                    .map(|&value| i64::from(value))
                    .collect();
                Ok(part.contains(&values, 1))
            }
        }
    }

    /// Whether the winning valuations of some predecessor may still grow by those of the node.
    fn is_relevant(&self, node: u32) -> bool {
        if node == 0 {
            return true;
        }
        let mut edge = self.graph.nodes[node as usize].first_in;
        while edge != NONE {
            let Edge {
                source, next_in, ..
            } = self.graph.edges[edge as usize];
            if !matches!(self.win[source as usize], Win::Everything) {
                return true;
            }
            edge = next_in;
        }
        false
    }

    fn expand(&mut self, node: u32) -> Result<(), Failure> {
        self.graph.expand(node)?;
        self.adopt_new_nodes();
        let waiting = self.waiting.len();
        for edge in self.graph.edges_of(node).rev() {
            let target = self.graph.edges[edge].target;
            self.wait_for(target);
        }
        self.is_dive_over = self.waiting.len() == waiting;
        self.mark(node);
        Ok(())
    }

    /// Gives nodes that were just made their place: goals are won from the start.
    fn adopt_new_nodes(&mut self) {
        for node in self.win.len()..self.graph.nodes.len() {
            let (win, gains) = match self.graph.nodes[node].standing {
                Standing::Goal => (
                    Win::Everything,
                    vec![Gain {
                        stamp: 0,
                        part: None,
                    }],
                ),
                Standing::Open | Standing::Broken => (Win::Nothing, Vec::new()),
                Standing::Mixed => match self
                    .graph
                    .parts(node as u32)
                    .map(|parts| parts.goal.clone())
                {
                    Some(goal) if !goal.is_empty() => (
                        Win::Part(goal.clone()),
                        vec![Gain {
                            stamp: 0,
                            part: Some(goal),
                        }],
                    ),
                    _ => (Win::Nothing, Vec::new()),
                },
            };
            self.win.push(win);
            self.gains.push(gains);
            self.is_waiting.push(false);
            self.is_updated.push(false);
            if node == 0 {
                self.wait_for(0);
            }
        }
    }

    /// Lets a node wait for its expansion unless it is decided.
    fn wait_for(&mut self, node: u32) {
        let Some(known) = self.graph.nodes.get(node as usize) else {
            return;
        };
        let is_decided = matches!(known.standing, Standing::Goal | Standing::Broken);
        if !known.is_expanded && !is_decided && !self.is_waiting[node as usize] {
            self.is_waiting[node as usize] = true;
            self.waiting.push_back(node);
        }
    }

    fn mark(&mut self, node: u32) {
        if !std::mem::replace(&mut self.is_updated[node as usize], true) {
            self.updates.push(node);
        }
    }

    /// Computes the winning valuations of a node anew; if they grew, its predecessors are to be updated.
    fn update(&mut self, node: u32) -> Result<(), Failure> {
        let state = self.graph.nodes[node as usize];
        if !state.is_expanded || matches!(self.win[node as usize], Win::Everything) {
            return Ok(());
        }
        let grown = match self.quick(node) {
            Some(true) => Some(Win::Everything),
            Some(false) => None,
            None => self.grown(node)?,
        };
        let Some(grown) = grown else { return Ok(()) };
        self.stamp += 1;
        let part = match &grown {
            Win::Part(part) => Some(self.without_old(node, part.clone())),
            _ => match &self.win[node as usize] {
                Win::Part(_) => {
                    let whole = Federation::of_zone(self.graph.dimension(), self.graph.zone(node));
                    Some(self.without_old(node, whole))
                }
                _ => None,
            },
        };
        self.gains[node as usize].push(Gain {
            stamp: self.stamp,
            part,
        });
        self.win[node as usize] = grown;
        let mut edge = state.first_in;
        while edge != NONE {
            let Edge {
                source, next_in, ..
            } = self.graph.edges[edge as usize];
            self.mark(source);
            edge = next_in;
        }
        Ok(())
    }

    fn without_old(&self, node: u32, mut part: Federation) -> Federation {
        if let Win::Part(old) = &self.win[node as usize] {
            part.subtract(old);
        }
        part
    }

    /// Decides without zones whether the node is won as a whole (`true`) or nothing new is won (`false`); `None` if zones
    /// are needed.
    fn quick(&self, node: u32) -> Option<bool> {
        let mut can_move = false;
        let mut is_spoiled = false;
        let mut has_opponent = false;
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            match (&self.win[edge.target as usize], edge.controllable) {
                (Win::Part(_), _) => return None,
                (Win::Everything, true) => can_move |= edge.is_total,
                (Win::Nothing, true) => {}
                (Win::Everything, false) if edge.length > 1 && !edge.is_total => return None,
                (Win::Everything, false) => has_opponent = true,
                (Win::Nothing, false) => {
                    has_opponent = true;
                    is_spoiled = true;
                }
            }
        }
        if self.graph.nodes[node as usize].standing != Standing::Open {
            return None;
        }
        if can_move && !is_spoiled {
            return Some(true);
        }
        let wins_nothing = |index: usize| {
            let edge = &self.graph.edges[index];
            !matches!(self.win[edge.target as usize], Win::Everything)
        };
        // Without a winning move and without an opponent that could be forced, there is nothing to gain.
        if self.graph.edges_of(node).all(wins_nothing) && (!has_opponent || is_spoiled) {
            return Some(false);
        }
        None
    }

    /// The winning valuations of a node; `None` if they did not grow.
    fn grown(&mut self, node: u32) -> Result<Option<Win>, Failure> {
        let dimension = self.graph.dimension();
        let mut good = match &self.win[node as usize] {
            Win::Part(part) => part.clone(),
            _ => Federation::empty(dimension),
        };
        let goal = self
            .graph
            .parts(node)
            .map_or_else(|| Federation::empty(dimension), |parts| parts.goal.clone());
        let mut bad = self.graph.parts(node).map_or_else(
            || Federation::empty(dimension),
            |parts| parts.broken.clone(),
        );
        let mut opponent = Federation::empty(dimension);
        for index in self.graph.edges_of(node) {
            let edge = self.graph.edges[index];
            if edge.controllable {
                good.unite(&self.before(&edge, &self.win[edge.target as usize]));
            } else {
                bad.unite(&self.spoiling(&edge));
                opponent.unite(&self.enabled(&edge));
            }
        }
        bad.subtract(&goal);
        let forced = self.forced(node, opponent, &bad)?;
        good.unite(&forced);
        let delays = self.graph.nodes[node as usize].delays;
        let stopped = self.stopped(node)?;
        let mut won = if delays {
            past::predecessors(&good, &bad, &stopped)
        } else {
            good.subtract(&bad);
            good
        };
        won.unite(&goal);
        won.intersect_zone(self.graph.zone(node));
        let whole = self.graph.zone(node);
        if won.is_empty() {
            return Ok(None);
        }
        if won.includes_zone(whole) {
            return Ok(Some(Win::Everything));
        }
        let is_new = match &self.win[node as usize] {
            Win::Part(old) => !won.is_subset(old),
            _ => true,
        };
        won.reduce();
        Ok(is_new.then_some(Win::Part(won)))
    }

    fn stopped(&mut self, node: u32) -> Result<ClockSet, Failure> {
        let mut words = self.graph.symbolic.stepper.network().initial.clone();
        self.graph.load(node, &mut words);
        self.graph.symbolic.stopped(&words)
    }

    /// The valuations of an edge's source from which it leads into the given valuations of its target.
    pub fn before(&self, edge: &Edge, target: &Win) -> Federation {
        let dimension = self.graph.dimension();
        let mut part = match target {
            Win::Nothing => return Federation::empty(dimension),
            Win::Everything if edge.is_total => {
                return Federation::of_zone(dimension, self.graph.zone(edge.source));
            }
            Win::Everything => Federation::of_zone(dimension, self.graph.zone(edge.target)),
            Win::Part(part) => part.clone(),
        };
        self.graph.programs.preimage(edge.program, &mut part);
        part.intersect_zone(self.graph.zone(edge.source));
        part
    }

    /// The valuations of an edge's source in which its first move is possible.
    fn enabled(&self, edge: &Edge) -> Federation {
        self.graph.programs.enabled(
            edge.program,
            self.graph.zone(edge.source),
            self.graph.dimension(),
        )
    }

    /// The valuations from which a move of the environment is not known to lead into winning ones. In a chain the controller
    /// may still wait well or get stuck, so there it is what is not led into winning valuations.
    fn spoiling(&self, edge: &Edge) -> Federation {
        if edge.length == 1 {
            return self.before(edge, &self.lost(edge.target));
        }
        let mut spoiling = self.enabled(edge);
        spoiling.subtract(&self.before(edge, &self.win[edge.target as usize]));
        spoiling
    }

    /// The valuations of a node that are not known to be winning.
    fn lost(&self, node: u32) -> Win {
        match &self.win[node as usize] {
            Win::Nothing => Win::Everything,
            Win::Everything => Win::Nothing,
            Win::Part(part) => {
                let mut rest = Federation::of_zone(self.graph.dimension(), self.graph.zone(node));
                rest.subtract(part);
                Win::Part(rest)
            }
        }
    }

    /// The valuations in which time stops, the environment has a move, and must take one.
    fn forced(
        &mut self,
        node: u32,
        opponent: Federation,
        bad: &Federation,
    ) -> Result<Federation, Failure> {
        if opponent.is_empty() {
            return Ok(opponent);
        }
        let mut words = self.graph.symbolic.stepper.network().initial.clone();
        self.graph.load(node, &mut words);
        let mut stops = self.stops(node, &mut words)?;
        let mut all = Federation::empty(self.graph.dimension());
        for (component, stop) in &mut stops {
            *stop = stop.intersection(&opponent);
            stop.subtract(bad);
            for (mover, edge) in self.controllable_movers(node, &mut words)? {
                let blocks = match (self.forced, *component) {
                    (Forced::Neutral, _) => false,
                    (Forced::Tiga, Some(component)) => mover.contains(&component),
                    (Forced::Product, _) | (Forced::Tiga, None) => true,
                };
                if blocks {
                    stop.subtract(&self.enabled(&self.graph.edges[edge]));
                }
            }
            all.unite(stop);
        }
        Ok(all)
    }

    /// The valuations in which time cannot pass, with the process that stops it (`None`: an urgent channel).
    fn stops(
        &mut self,
        node: u32,
        words: &mut [i32],
    ) -> Result<Vec<(Option<u32>, Federation)>, Failure> {
        let dimension = self.graph.dimension();
        let whole = Federation::of_zone(dimension, self.graph.zone(node));
        let network = self.graph.symbolic.stepper.network();
        let mut stops = Vec::new();
        for (index, process) in network.processes.iter().enumerate() {
            let urgency = process.locations[words[index] as usize].urgency;
            if urgency != crate::ir::Urgency::Normal {
                stops.push((Some(index as u32), whole.clone()));
            }
        }
        if stops.is_empty() && !self.graph.nodes[node as usize].delays {
            stops.push((None, whole));
        }
        let stopped = self.graph.symbolic.stopped(words)?;
        for (process, bound) in self.graph.symbolic.upper_bounds(words)? {
            let mut faces = Federation::empty(dimension);
            faces.add_upper_faces(self.graph.zone(node), &[bound], &stopped);
            stops.push((Some(process), faces));
        }
        Ok(stops)
    }

    /// The controllable edges of a node, each with the processes that take part in its first move.
    fn controllable_movers(
        &mut self,
        node: u32,
        words: &mut [i32],
    ) -> Result<Vec<(Vec<u32>, usize)>, Failure> {
        let mut moves = crate::network::Moves::default();
        self.graph.symbolic.stepper.moves(words, &mut moves)?;
        let edges = self
            .graph
            .edges_of(node)
            .filter(|&index| self.graph.edges[index].controllable);
        Ok(edges
            .map(|index| {
                let parts = moves.get(self.graph.edges[index].ordinal as usize).parts;
                (parts.iter().map(|part| part.process).collect(), index)
            })
            .collect())
    }
}
