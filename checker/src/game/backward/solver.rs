//! Attractor games: can one player, the *seeker*, force play into a set, whatever the other one,
//! the *evader*, does?
//!
//! For reachability the controller seeks the goal. For safety the environment seeks a valuation in
//! which what must be kept is broken; the controller wins where it does not get there. In both,
//! play ends in the goal, if there is one.
//!
//! The algorithm is on the fly and goes forward and backward in turns. Forward, nodes are expanded;
//! backward, the valuations of a node from which the seeker wins are computed anew when those of a
//! successor have grown. For the controller as the seeker:
//!
//! ```text
//! good   = goal ∪ ⋃ Pre_c(win)                     what a controllable move reaches
//! bad    = ⋃ Pre_u(not win) ∪ broken, less goal    what the environment can spoil
//! forced = stop ∩ ⋃ enabled_u, less bad and less where the controller could move (see Forced)
//! win    = Pred_t(good ∪ forced, bad)              wait into good without meeting bad
//! ```
//!
//! For the environment, which is faster, and whose opponent must move where time stops and the
//! environment need not:
//!
//! ```text
//! now    = broken ∪ ⋃ Pre_u(win), less goal        what the environment has at once, in any case
//! escape = ⋃ Pre_c(not win), less now              where the controller gets away, on any leg
//! held   = stop ∩ ⋃ enabled_c, less escape and less where the environment must move (see Forced)
//! win    = Pred_t(now ∪ held, escape ∪ goal)
//! ```
//!
//! A move of the evader into a node that is not explored counts as an escape, so every intermediate
//! result is sound, and the search ends as soon as the initial valuation is won. Each gain is
//! recorded with a stamp: a strategy that moves from valuations of one stamp into those of smaller
//! ones makes progress. Where the seeker wins nowhere any more, the evader has only to stay outside
//! of what is won.
//!
//! Forward, the solver dives ([`crate::game::exploration::waiting`]), and explores only as many
//! moves of the evader as it needs ([`crate::game::exploration::lazy_zero_time`],
//! [`crate::game::exploration::lazy_safety`]). From time to time it is looked whether the seeker
//! may still win at all ([`super::losing_untimed`], and with zones [`super::losing_timed`]), so
//! that both answers can come early.
//!
//! Nodes that are won or lost as a whole are handled without zones; in models where clocks do not
//! decide who wins, all are. What takes zones is put off until the graph has grown by a part of
//! itself, and goes round in turns: so a node meets what several of its successors have gained at
//! once.
//!
//! Source: F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient On-the-Fly Algorithms
//! for the Analysis of Timed Games", CONCUR 2005; the forced moves are those of G. Behrmann et al.,
//! "UPPAAL-TIGA: Time for Playing Games!", CAV 2007, and the tool's manual, section 3.1.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch, states_between_looks};
use crate::zones::Federation;

use super::budget::Allowance;
use super::losing_timed::{Outlook, Schedule};
use super::parallel::Task;
use super::result_cache::{Case, Repeats};
use super::winning_sets::Gained;
use crate::game::exploration::lazy_safety::Defences;
use crate::game::exploration::waiting::Frontier;
use crate::game::forward::graph::Graph;
use crate::game::forward::node::Standing;
use crate::game::{Forced, Player};

/// Expanded nodes between two looks at the limits.
pub(super) const LOOK_EVERY: u64 = 64;

/// Bytes of zones that are made between two looks at the limits, at most, one expansion aside.
const ZONE_BYTES_BETWEEN_LOOKS: u64 = 4 << 20;

/// Nodes whose winning valuations hang on clocks are computed when the explored states have grown
/// by this part of them. Each time costs more than looking at words, and the more is known by then,
/// the fewer are computed twice.
const BETWEEN_COMPUTATIONS: u64 = 4;

/// It is looked what is still in play when the explored states have grown by this part of them.
const BETWEEN_PLAYS: u64 = 3;

/// Nodes that are computed from the same winning valuations, at most. Some of them may gain more
/// from each other, and are computed again; among so many that is rare.
pub(super) const MOST_TASKS: usize = 64;

/// Updates by words between two looks at the limits, where no node is expanded.
const UPDATES_BETWEEN_LOOKS: u32 = 1024;

/// Computations with few zones between two looks at the limits.
const COMPUTATIONS_BETWEEN_LOOKS: u32 = 16;

/// The valuations of a node from which the seeker wins.
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
    /// Until the verdict is known, and if the seeker loses, until nothing is left out that the
    /// evader may do.
    Permissive,
    /// The winning valuations of all nodes that can be reached.
    Everything,
}

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// This player wins from the initial valuation.
    Won(Player),
    /// A limit came first.
    Stopped(StopReason),
}

/// What becomes of play in the goal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::game) enum AfterGoal {
    /// It ends.
    Ends,
    /// It goes on, and what comes is to be known too.
    GoesOn,
    /// It goes on, and the goal makes no difference to it.
    IsLikeBefore,
}

/// A solver with its graph.
pub struct Solver<'g, 's, 'a> {
    /// The graph.
    pub graph: &'g mut Graph<'s, 'a>,
    /// Who seeks.
    pub seeker: Player,
    /// What is sought, by node, if it is not where the goal holds. Play does not end there, and all
    /// nodes are expanded.
    pub(in crate::game) targets: Option<Vec<Win>>,
    pub(in crate::game) after_goal: AfterGoal,
    /// Whether it matters what can be reached at all, through whatever has been won or lost.
    pub(in crate::game) is_cooperative: bool,
    /// By node: the valuations from which the seeker wins.
    pub win: Vec<Win>,
    /// The bytes that zones of the gains, the winning valuations and the rests take.
    pub(super) gained_bytes: u64,
    /// The bytes of what belongs to the game and is kept elsewhere meanwhile.
    pub(in crate::game) aside_bytes: u64,
    /// The rest of each node of which a part is won.
    pub(in crate::game) rest: FxHashMap<u32, Federation>,
    /// By node: the gains, by ascending stamp. What is sought has stamp 0.
    pub gains: Vec<Vec<Gain>>,
    pub(super) forced: Forced,
    pub(super) stamp: u32,
    /// After how many explored states it is looked whether there are many nodes for each discrete
    /// state.
    crowded_from: u64,
    /// So many are many.
    crowd: usize,
    /// Whether the solver has given up: for having many nodes for each discrete state, or for what
    /// it has taken.
    pub has_given_up: bool,
    pub(super) allowance: Option<Allowance>,
    /// The units of work that computing what nodes win has taken.
    pub(super) work: u64,
    /// The nodes to be expanded.
    pub(in crate::game) frontier: Frontier,
    /// By node, as far as it was looked at: whether the seeker may still win; see
    /// [`super::losing_untimed`].
    pub(super) has_hope: Vec<bool>,
    /// Nodes to be looked at again, first those that were put in first.
    pub(super) updates: VecDeque<u32>,
    /// Nodes whose winning valuations are to be computed with zones; some may be settled meanwhile.
    pub(super) deferred: VecDeque<u32>,
    pub(super) pending: Vec<Pending>,
    /// The moves that the evader holds back.
    pub(in crate::game) defences: Defences,
    /// When prospects are computed.
    pub(super) schedule: Schedule,
    /// What was computed before.
    pub(super) repeats: Repeats,
    /// How many threads compute what nodes win.
    pub(super) threads: usize,
    /// The words of some node.
    pub(super) words: Vec<i32>,
    /// How many states may be explored before the deferred nodes are computed.
    next_computation: u64,
}

/// Whether a node is to be updated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pending {
    /// No.
    No,
    /// It waits to be looked at.
    Look,
    /// Words do not decide it; it waits to be computed.
    Computation,
}

impl<'g, 's, 'a> Solver<'g, 's, 'a> {
    /// A solver that has looked at the initial node only.
    pub fn new(graph: &'g mut Graph<'s, 'a>, seeker: Player, forced: Forced) -> Solver<'g, 's, 'a> {
        let mut solver = Solver {
            words: graph.symbolic.stepper.network().initial.clone(),
            repeats: Repeats::default(),
            threads: 1,
            graph,
            seeker,
            targets: None,
            after_goal: AfterGoal::Ends,
            is_cooperative: false,
            win: Vec::new(),
            gained_bytes: 0,
            aside_bytes: 0,
            rest: FxHashMap::default(),
            gains: Vec::new(),
            forced,
            stamp: 0,
            crowded_from: u64::MAX,
            crowd: usize::MAX,
            has_given_up: false,
            allowance: None,
            work: 0,
            frontier: Frontier::default(),
            has_hope: Vec::new(),
            updates: VecDeque::new(),
            deferred: VecDeque::new(),
            pending: Vec::new(),
            defences: Defences::default(),
            schedule: Schedule::default(),
            next_computation: 0,
        };
        solver.adopt_new_nodes();
        solver
    }

    /// Lets the solver give up, when it has explored so many states, if it has so many nodes for
    /// each discrete state. It stops then for their number, and [`Solver::has_given_up`] is set.
    pub fn give_up_if_crowded(&mut self, explored: u64, crowd: usize) {
        self.crowded_from = explored;
        self.crowd = crowd;
    }

    /// Lets so many threads compute what nodes win.
    pub fn share_among(&mut self, threads: usize) {
        self.threads = threads;
    }

    pub(super) fn is_crowded(&self) -> bool {
        self.graph.explored >= self.crowded_from
            && self.graph.nodes.len() >= self.crowd * self.graph.discrete_count()
    }

    /// Solves the game.
    pub fn solve(&mut self, extent: Extent, watch: &mut dyn Watch) -> Result<Answer, Failure> {
        let look_every = states_between_looks(LOOK_EVERY, self.graph.dimension());
        let mut next_look = look_every;
        let zones_between_looks = (ZONE_BYTES_BETWEEN_LOOKS / self.zone_bytes()) as usize;
        let mut zones_at_look = self.graph.zones.len() + zones_between_looks;
        let (mut next_hope, mut next_crowd) = (1, 1);
        self.frontier.reserve.is_kept = extent == Extent::Verdict;
        loop {
            let explored = self.graph.explored;
            let is_dry = self.frontier.len() == 0;
            let is_computed = is_dry || explored >= self.next_computation;
            let reason = if is_computed {
                self.next_computation = if self.graph.symbolic.tuning().delayed_zones {
                    explored + explored / BETWEEN_COMPUTATIONS
                } else {
                    explored
                };
                self.propagate(watch)?
            } else {
                self.propagate_words(watch)
            };
            if let Some(reason) = reason {
                return Ok(Answer::Stopped(reason));
            }
            if matches!(extent, Extent::Verdict | Extent::Permissive) {
                if self.is_won() {
                    break;
                }
                let has_reserve = self.frontier.reserve.is_used;
                if is_computed && extent == Extent::Verdict && self.is_prospect_due() {
                    match self.look_ahead(watch)? {
                        Outlook::Open | Outlook::Settled => {}
                        Outlook::Hopeless => break,
                        Outlook::Stopped(reason) => return Ok(Answer::Stopped(reason)),
                    }
                }
                if explored >= next_hope && extent == Extent::Verdict {
                    let is_looked_at = self.graph.symbolic.tuning().losing_untimed;
                    if is_looked_at && !self.has_hope() {
                        break;
                    }
                    next_hope = if has_reserve {
                        self.wait_for_nodes_in_play();
                        explored + explored / BETWEEN_PLAYS
                    } else {
                        2 * explored
                    };
                }
                if explored >= next_crowd {
                    next_crowd = 2 * explored;
                    if self.is_crowded() {
                        self.has_given_up = true;
                        return Ok(Answer::Stopped(StopReason::States));
                    }
                }
                if has_reserve && self.frontier.len() == 0 {
                    let is_in_play = self.wait_for_nodes_in_play();
                    if is_dry && self.frontier.len() == 0 {
                        match self.outlook(watch)? {
                            Outlook::Open => {}
                            Outlook::Hopeless => break,
                            Outlook::Settled => {
                                self.keep_in_play(&is_in_play);
                                break;
                            }
                            Outlook::Stopped(reason) => return Ok(Answer::Stopped(reason)),
                        }
                    }
                    continue;
                }
            }
            let Some(node) = self.next_waiting() else {
                break;
            };
            if self.graph.nodes[node as usize].is_expanded
                || (extent != Extent::Everything && !self.is_relevant(node))
            {
                continue;
            }
            self.expand(node)?;
            if self.graph.explored >= next_look || self.graph.zones.len() >= zones_at_look {
                next_look = self.graph.explored + look_every;
                zones_at_look = self.graph.zones.len() + zones_between_looks;
                if let Some(reason) = self.look(watch) {
                    return Ok(Answer::Stopped(reason));
                }
            }
        }
        if self.is_won() {
            return Ok(Answer::Won(self.seeker));
        }
        if extent == Extent::Verdict {
            self.keep_out_of_unexpanded();
        }
        Ok(Answer::Won(self.seeker.opponent()))
    }

    /// Updates nodes until nothing grows.
    pub(super) fn propagate(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        let mut until_look = COMPUTATIONS_BETWEEN_LOOKS;
        self.count_hubs();
        loop {
            if let Some(reason) = self.propagate_words(watch) {
                return Ok(Some(reason));
            }
            let tasks = self.next_tasks()?;
            // Known cases that gained something have left updates.
            if tasks.is_empty() && self.deferred.is_empty() && self.updates.is_empty() {
                return Ok(None);
            }
            until_look = until_look.saturating_sub(tasks.len() as u32);
            if let Some(reason) = self.compute(tasks, watch) {
                return Ok(Some(reason));
            }
            if until_look == 0 {
                until_look = COMPUTATIONS_BETWEEN_LOOKS;
                let reason = self.look(watch);
                if reason.is_some() {
                    return Ok(reason);
                }
            }
        }
    }

    /// Takes some deferred nodes whose winning valuations are to be computed; those of nodes that
    /// are known cases are recorded.
    fn next_tasks(&mut self) -> Result<Vec<Task>, Failure> {
        let mut tasks = Vec::new();
        while tasks.len() < MOST_TASKS
            && let Some(node) = self.deferred.pop_front()
        {
            if self.pending[node as usize] != Pending::Computation {
                continue;
            }
            self.pending[node as usize] = Pending::No;
            tasks.extend(self.task_of(node)?);
        }
        Ok(tasks)
    }

    /// The task to compute what a node wins; if it is a known case, that is recorded, and there is
    /// none.
    pub(super) fn task_of(&mut self, node: u32) -> Result<Option<Task>, Failure> {
        let key = match self.case_of(node)? {
            Case::Known(gained, defence) => {
                self.defend(node, &defence);
                self.gain_computed(node, gained);
                return Ok(None);
            }
            Case::New(key) => Some(key),
            Case::None => None,
        };
        let situation = self.situation_for_win(node)?;
        Ok(Some(Task {
            node,
            situation,
            key,
        }))
    }

    /// Records what a node gains that was computed.
    pub(super) fn gain_computed(&mut self, node: u32, gained: Gained) {
        self.gain(node, gained);
        if !self.schedule.is_running && !matches!(self.win[node as usize], Win::Everything) {
            self.note_spoilers(node);
        }
    }

    /// Updates nodes until nothing grows as far as words decide, and puts the other nodes off.
    fn propagate_words(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let mut until_look = UPDATES_BETWEEN_LOOKS;
        while let Some(node) = self.updates.pop_front() {
            self.pending[node as usize] = Pending::No;
            let is_settled =
                self.is_decided(node) || matches!(self.win[node as usize], Win::Everything);
            if is_settled || !self.graph.nodes[node as usize].is_expanded {
                continue;
            }
            let decision = self.quick(node);
            if decision != Some(true) && !self.schedule.is_running {
                self.choose(node);
            }
            match decision {
                Some(true) => self.gain_everything(node),
                Some(false) => {}
                None => {
                    self.pending[node as usize] = Pending::Computation;
                    self.deferred.push_back(node);
                }
            }
            until_look -= 1;
            if until_look == 0 {
                until_look = UPDATES_BETWEEN_LOOKS;
                let reason = self.look(watch);
                if reason.is_some() {
                    return reason;
                }
            }
        }
        None
    }

    /// Forgets what was won, and seeks these parts of the nodes, in all of which play goes on.
    pub(in crate::game) fn restart(&mut self, targets: Vec<Win>) {
        self.targets = Some(targets);
        self.begin_anew();
    }

    /// Forgets what was won. All nodes are to be updated.
    pub(super) fn begin_anew(&mut self) {
        self.stamp = 0;
        self.win.clear();
        self.rest.clear();
        self.gained_bytes = 0;
        self.gains.clear();
        self.frontier.forget_nodes();
        self.pending.clear();
        self.defences.forget_nodes();
        self.updates.clear();
        self.deferred.clear();
        self.adopt_new_nodes();
        for node in 0..self.graph.nodes.len() as u32 {
            self.mark(node);
        }
    }

    /// Computes anew, in an explored graph, from where the environment can break what must be kept,
    /// whether the goal was met or not. A chain in which the controller waits counts as a way to
    /// get away, since it chooses how long.
    pub(in crate::game) fn seek_to_break(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        self.seeker = Player::Environment;
        self.after_goal = AfterGoal::IsLikeBefore;
        self.targets = None;
        self.begin_anew();
        let reason = self.sweep(watch)?;
        self.after_goal = AfterGoal::GoesOn;
        Ok(reason)
    }

    /// Lets nodes be expanded in which the goal holds; in a cooperative game also those that are
    /// broken.
    pub(in crate::game) fn go_on(&mut self, is_cooperative: bool) {
        self.after_goal = AfterGoal::GoesOn;
        self.is_cooperative = is_cooperative;
        self.wait_for(0);
    }

    /// Whether both players together can get to where the controller wins; explores everything.
    pub fn solve_cooperative(&mut self, watch: &mut dyn Watch) -> Result<Answer, Failure> {
        self.go_on(true);
        if let Answer::Stopped(reason) = self.solve(Extent::Everything, watch)? {
            return Ok(Answer::Stopped(reason));
        }
        Ok(Answer::Won(if self.has_won_somewhere() {
            Player::Controller
        } else {
            Player::Environment
        }))
    }

    /// Whether the controller wins somewhere, inside chains included.
    pub(in crate::game) fn has_won_somewhere(&self) -> bool {
        if self.seeker == Player::Controller {
            return self.win.iter().any(|win| !matches!(win, Win::Nothing));
        }
        let mut edges = self.graph.edges.iter();
        self.win.iter().any(|win| !matches!(win, Win::Everything))
            || edges.any(|edge| edge.length > 1 && !self.spoiling(edge).is_empty())
    }

    /// Whether the seeker wins from the initial valuation.
    pub fn is_won(&self) -> bool {
        match &self.win[0] {
            Win::Nothing => false,
            Win::Everything => true,
            Win::Part(part) => {
                let network = self.graph.symbolic.stepper.network();
                let values = network.initial_clocks.iter();
                let values: Vec<i64> = values.map(|&value| i64::from(value)).collect();
                part.contains(&values, 1)
            }
        }
    }

    /// The nodes that are to be updated, in order; none is any more.
    pub(super) fn take_updates(&mut self) -> VecDeque<u32> {
        let nodes = std::mem::take(&mut self.updates);
        for &node in &nodes {
            self.pending[node as usize] = Pending::No;
        }
        nodes
    }

    pub(in crate::game) fn mark(&mut self, node: u32) {
        let pending = &mut self.pending[node as usize];
        if std::mem::replace(pending, Pending::Look) != Pending::Look {
            self.updates.push_back(node);
        }
    }

    /// Decides without zones whether the node is won as a whole (`true`) or nothing new is won
    /// (`false`); `None` if zones are needed.
    pub(super) fn quick(&self, node: u32) -> Option<bool> {
        let mut can_move = false;
        let mut is_spoiled = false;
        let mut has_evader = false;
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            let is_own = self.seeker.owns(edge.controllable);
            match (&self.win[edge.target as usize], is_own) {
                (Win::Part(_), _) => return None,
                (Win::Everything, true) => can_move |= edge.is_total && !edge.is_leg,
                (Win::Nothing, true) => {}
                (Win::Everything, false) if edge.length > 1 && !edge.is_total => return None,
                (Win::Everything, false) => has_evader = true,
                (Win::Nothing, false) => {
                    has_evader = true;
                    is_spoiled = true;
                }
            }
        }
        let is_open = match &self.targets {
            None => match self.graph.nodes[node as usize].standing {
                Standing::Open => true,
                Standing::Goal => self.after_goal == AfterGoal::IsLikeBefore,
                Standing::Broken | Standing::Mixed | Standing::Dead => false,
            },
            Some(targets) => {
                matches!(targets[node as usize], Win::Nothing)
                    && self.graph.nodes[node as usize].standing != Standing::Mixed
            }
        };
        if !is_open {
            return None;
        }
        can_move |= self.wins_by_an_entry(node);
        if can_move && (!is_spoiled || self.seeker == Player::Environment) {
            return Some(true);
        }
        let wins_nothing = |index: usize| {
            let edge = &self.graph.edges[index];
            !matches!(self.win[edge.target as usize], Win::Everything)
        };
        // Who is obliged to move and cannot has lost.
        if self.seeker == Player::Environment && self.is_obliged(node) {
            return None;
        }
        // Without a winning move and without an evader that could be forced, there is nothing to
        // gain.
        if self.graph.edges_of(node).all(wins_nothing) && (!has_evader || is_spoiled) {
            return Some(false);
        }
        None
    }
}
