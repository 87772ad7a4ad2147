//! Backward steps: nodes are updated until nothing grows, by words where these are enough, and
//! otherwise with zones.

use crate::network::Failure;
use crate::search::limits::{StopReason, Watch};

use super::parallel::Task;
use super::winning_sets::{Gained, Win};
use crate::game::forward::node::{Edge, Standing};
use crate::game::solver::Solver;
use crate::game::{AfterGoal, Player};

/// At most this many nodes are computed from the same winning valuations. Some of them may gain
/// more from each other, and are computed again; in batches of this size that is rare.
pub(super) const MOST_TASKS: usize = 64;

/// Updates by words between two checks of the limits, if no node is expanded.
const UPDATES_BETWEEN_LOOKS: u32 = 1024;

/// Computations with few zones between two checks of the limits.
const COMPUTATIONS_BETWEEN_LOOKS: u32 = 16;

impl Solver<'_, '_, '_> {
    /// Updates nodes until nothing grows.
    pub(in crate::game) fn propagate(
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
            if tasks.is_empty() && self.agenda.is_empty() {
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

    /// Takes some deferred nodes whose winning valuations must be computed.
    fn next_tasks(&mut self) -> Result<Vec<Task>, Failure> {
        let mut tasks = Vec::new();
        while tasks.len() < MOST_TASKS
            && let Some(node) = self.agenda.next_computed()
        {
            tasks.push(self.task_of(node)?);
        }
        Ok(tasks)
    }

    /// The task to compute what a node wins.
    pub(super) fn task_of(&mut self, node: u32) -> Result<Task, Failure> {
        let situation = self.situation_for_win(node)?;
        Ok(Task { node, situation })
    }

    /// Records the computed gain of a node.
    pub(super) fn gain_computed(&mut self, node: u32, gained: Gained) {
        self.gain(node, gained);
        if !self.exploration.schedule.is_running
            && !matches!(self.won.win[node as usize], Win::Everything)
        {
            self.note_spoilers(node);
        }
    }

    /// Updates nodes by words alone until nothing grows, and postpones the other nodes.
    pub(in crate::game) fn propagate_words(&mut self, watch: &mut dyn Watch) -> Option<StopReason> {
        let mut until_look = UPDATES_BETWEEN_LOOKS;
        while let Some(node) = self.agenda.next_update() {
            if !self.may_gain(node) {
                continue;
            }
            let decision = self.quick(node);
            if decision != Some(true) {
                self.on_update(node);
            }
            match decision {
                Some(true) => self.gain_everything(node),
                Some(false) => {}
                None => self.agenda.defer(node),
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

    /// Whether more may be won of a node, and what lies behind it is known.
    pub(super) fn may_gain(&self, node: u32) -> bool {
        self.graph.nodes[node as usize].is_expanded
            && !self.is_decided(node)
            && !matches!(self.won.win[node as usize], Win::Everything)
    }

    /// Decides without zones whether the node is won as a whole (`true`) or nothing new is won
    /// (`false`); `None` if zones are needed.
    pub(super) fn quick(&self, node: u32) -> Option<bool> {
        let mut can_move = false;
        let mut is_spoiled = false;
        let mut has_evader = false;
        for edge in self.graph.edges_from(node) {
            let is_own = self.seeker.owns(edge.controllable);
            match (&self.won.win[edge.target as usize], is_own) {
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
        let is_open = match &self.sought.targets {
            None => match self.graph.nodes[node as usize].standing {
                Standing::Open => true,
                Standing::Goal => self.sought.after_goal == AfterGoal::IsLikeBefore,
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
        let wins_nothing =
            |edge: &Edge| !matches!(self.won.win[edge.target as usize], Win::Everything);
        // A player that is obliged to move and cannot has lost.
        if self.seeker == Player::Environment && self.is_obliged(node) {
            return None;
        }
        // Without a winning move, and without an evader that could be forced, nothing can be
        // gained.
        if self.graph.edges_from(node).iter().all(wins_nothing) && (!has_evader || is_spoiled) {
            return Some(false);
        }
        None
    }
}
