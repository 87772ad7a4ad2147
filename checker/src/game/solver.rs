//! Attractor games: can one player, the *seeker*, force play into a set, whatever the other player,
//! the *evader*, does?
//!
//! For reachability the controller seeks the goal. For safety the environment seeks a valuation in
//! which what must be kept is broken; the controller wins where the environment cannot get there.
//! In both games, play ends in the goal, if there is one.
//!
//! The algorithm is on the fly, and alternates between forward and backward steps. Forward, nodes
//! are expanded. Backward, the valuations of a node from which the seeker wins are computed again
//! when those of a successor have grown. For the controller as the seeker:
//!
//! ```text
//! good   = goal ∪ ⋃ Pre_c(win)                     what a controllable move reaches
//! bad    = ⋃ Pre_u(not win) ∪ broken, without goal what the environment can spoil
//! forced = stop ∩ ⋃ enabled_u, without bad and without where Forced lets it decline
//! win    = Pred_t(good ∪ forced, bad)              wait into good without meeting bad
//! ```
//!
//! For the environment. It is faster, and its opponent must move where time stops and the
//! environment need not move:
//!
//! ```text
//! now    = broken ∪ ⋃ Pre_u(win), without goal     what the environment has at once
//! escape = ⋃ Pre_c(not win), without now           where the controller gets away
//! stuck  = stop ∩ ⋃ enabled_c, without escape and without where the environment must move
//! win    = Pred_t(now ∪ stuck, escape ∪ goal)
//! ```
//!
//! Here `stop` are the valuations in which time cannot pass, `enabled_u` and `enabled_c` those in
//! which a move of the environment or of the controller is possible, and [`Forced`] is the rule
//! that says when the environment must move.
//!
//! A move of the evader into an unexplored node counts as an escape, so every intermediate result
//! is sound, and the search ends as soon as the initial valuation is won. Each gain is recorded
//! with a stamp: a strategy that moves from valuations of one stamp into those of smaller ones
//! makes progress. Once the seeker can win nothing more, the evader only has to stay outside of
//! what is won.
//!
//! Forward, the solver follows random moves as deep as they go. For a verdict it explores only as
//! many moves of the evader as the evader needs ([`super::exploration`]). From time to time it
//! computes whether the seeker can still win at all ([`super::backward::losing_untimed`], and with
//! zones [`super::backward::losing_timed`]), so that both answers can come early.
//!
//! Nodes that are won or lost as a whole are handled without zones; in models where clocks do not
//! decide the winner, all are. Work on zones waits until the graph has grown by a quarter, so that
//! a node sees the gains of several successors at once.
//!
//! Source: F. Cassez, A. David, E. Fleury, K. G. Larsen, D. Lime, "Efficient On-the-Fly Algorithms
//! for the Analysis of Timed Games", CONCUR 2005; the forced moves are those of G. Behrmann et al.,
//! "UPPAAL-TIGA: Time for Playing Games!", CAV 2007, and the tool's manual, section 3.1.

use crate::ir::FunctionId;
use crate::network::Failure;
use crate::search::limits::Watch;

use super::backward::agenda::Agenda;
use super::backward::budget::Stops;
use super::backward::winning_sets::{Win, WinningSets};
use super::exploration::{Exploration, Next, Turn};
use super::forward::graph::Graph;
use super::{AfterGoal, Extent, Forced, Player, Solution};

/// Nodes whose winning valuations depend on clocks are computed when the number of explored states
/// has grown by this part. Such a computation costs more than one by words, and the more is known,
/// the fewer nodes are computed twice.
const BETWEEN_COMPUTATIONS: u64 = 4;

/// A solver with its graph.
pub struct Solver<'g, 's, 'a> {
    /// The graph.
    pub graph: &'g mut Graph<'s, 'a>,
    /// The player who seeks something.
    pub seeker: Player,
    pub(in crate::game) forced: Forced,
    /// The target of the seeker.
    pub(in crate::game) sought: Sought,
    /// The winning sets.
    pub won: WinningSets,
    /// The nodes that must be computed again.
    pub(in crate::game) agenda: Agenda,
    /// Which nodes are explored, and in which order.
    pub(in crate::game) exploration: Exploration,
    pub(in crate::game) stops: Stops,
    /// The bytes of what belongs to the game but is kept elsewhere for a while.
    pub(in crate::game) aside_bytes: u64,
    /// The number of threads that compute what nodes win.
    pub(in crate::game) threads: usize,
    /// The words of some node.
    pub(in crate::game) words: Vec<i32>,
}

/// The target of the seeker.
#[derive(Debug)]
pub(in crate::game) struct Sought {
    /// For each node, if the target is not the goal. Play does not end there, and all nodes are
    /// expanded.
    pub(in crate::game) targets: Option<Vec<Win>>,
    pub(in crate::game) after_goal: AfterGoal,
    /// Whether the question is what can be reached at all, even after one player has won.
    pub(in crate::game) is_cooperative: bool,
}

impl<'g, 's, 'a> Solver<'g, 's, 'a> {
    /// A solver that has evaluated only the initial node.
    pub fn new(graph: &'g mut Graph<'s, 'a>, seeker: Player, forced: Forced) -> Solver<'g, 's, 'a> {
        let mut solver = Solver {
            words: graph.symbolic.stepper.network().initial.clone(),
            graph,
            seeker,
            forced,
            sought: Sought {
                targets: None,
                after_goal: AfterGoal::Ends,
                is_cooperative: false,
            },
            won: WinningSets::default(),
            agenda: Agenda::default(),
            exploration: Exploration::default(),
            stops: Stops::default(),
            aside_bytes: 0,
            threads: 1,
        };
        solver.adopt_new_nodes();
        solver
    }

    /// Sets the number of threads that compute what nodes win.
    pub fn share_among(&mut self, threads: usize) {
        self.threads = threads;
    }

    /// Explores first where the value of this function is least.
    pub fn be_guided_by(&mut self, guide: Option<FunctionId>) {
        if let Some(guide) = guide {
            self.exploration.waiting.be_guided_by(guide);
        }
    }

    /// Whether a guide says where to explore first.
    pub(in crate::game) fn has_guide(&self) -> bool {
        self.exploration.waiting.guide().is_some()
    }

    /// Solves the game.
    ///
    /// # Errors
    /// The model fails in a state of it.
    pub fn solve(&mut self, extent: Extent, watch: &mut dyn Watch) -> Result<Solution, Failure> {
        self.begin(extent);
        loop {
            let turn = self.begin_turn();
            let reason = if turn.is_computed {
                self.propagate(watch)?
            } else {
                self.propagate_words(watch)
            };
            if let Some(reason) = reason {
                return Ok(Solution::Stopped(reason));
            }
            if extent != Extent::Everything && self.is_won() {
                break;
            }
            match self.next(turn, extent, watch)? {
                Next::Expand(node) => {
                    self.expand(node)?;
                    let finds_losses = self.graph.symbolic.tuning().losing_untimed;
                    if extent == Extent::Verdict && self.has_guide() && finds_losses {
                        self.note_if_lost(node);
                    }
                }
                Next::Compute => continue,
                Next::Nothing => break,
                Next::Stopped(reason) => return Ok(Solution::Stopped(reason)),
            }
            if let Some(reason) = self.check_limits(watch) {
                return Ok(Solution::Stopped(reason));
            }
        }
        self.graph.symbolic.check_differences()?;
        if !self.is_won() && extent == Extent::Verdict {
            self.avoid_unexpanded();
        }
        Ok(Solution::Won(self.winner()))
    }

    fn begin(&mut self, extent: Extent) {
        self.schedule_limit_check();
        self.stops.next_crowd = 1;
        self.exploration.next_may_win = 1;
        self.exploration.reserve.is_kept = extent == Extent::Verdict;
    }

    /// Begins a turn. What needs zones is computed if the graph has grown by a part of itself, or
    /// if no node waits.
    fn begin_turn(&mut self) -> Turn {
        let explored = self.graph.explored;
        let is_dry = self.exploration.waiting.len() == 0;
        let is_computed = is_dry || explored >= self.agenda.next_computation;
        if is_computed {
            // A guide waits for no computation: what it seeks next depends on what is won.
            let is_delayed = self.graph.symbolic.tuning().delayed_zones && !self.has_guide();
            self.agenda.next_computation = if is_delayed {
                explored + explored / BETWEEN_COMPUTATIONS
            } else {
                explored
            };
        }
        Turn {
            is_dry,
            is_computed,
        }
    }

    /// Who has won, as far as it is known.
    pub(in crate::game) fn winner(&self) -> Player {
        if self.is_won() {
            self.seeker
        } else {
            self.seeker.opponent()
        }
    }

    /// Whether the seeker wins from the initial valuation.
    pub fn is_won(&self) -> bool {
        let values = self.graph.symbolic.stepper.network().initial_clocks.iter();
        let values: Vec<i64> = values.map(|&value| i64::from(value)).collect();
        self.won.contains(0, &values)
    }
}
