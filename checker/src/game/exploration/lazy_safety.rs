//! Which moves the evader uses where time passes: only as many as it is known to need.
//!
//! Where time passes, the evader may wait. As long as the seeker cannot win, the evader needs no
//! move, except where it must move because time stops. So in a safety game for a verdict its other
//! moves are *held back*, and the states after them are not explored, until the seeker *threatens*
//! to win something more: if the evader did not use the held moves, the seeker would win valuations
//! that it has not won. Then the held moves that help are taken, one after the other. Those that
//! share a process with the attack come first. Moves that share no process with the attack are
//! *weak*. They mostly delay the attack, and there may be many of them. So a node that only weak
//! moves can help is left *undefended*, until a look at the whole game decides
//! ([`crate::game::backward::losing_timed`]).
//!
//! A held move counts as an escape for what the seeker wins, and a win is recorded only where the
//! move does not help. So all results stay sound. When nothing is left to explore or compute and no
//! node is undefended, the seeker wins nothing else: as in [`super::lazy_zero_time`], what it wins
//! of the nodes in play follows only from what it wins of each other.
//!
//! If the controller seeks a goal, nothing is held back: the moves of the environment often lead to
//! the goal, and whether dives without them find it sooner is a matter of luck.

use crate::network::Failure;
use crate::zones::Federation;

use super::held_moves::{Defence, Hold};
use crate::game::Player;
use crate::game::backward::predecessors::Situation;
use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::Edge;
use crate::game::solver::Solver;

/// Hubs are counted again when the edges have grown by this part of them.
const BETWEEN_COUNTS: usize = 4;

impl Solver<'_, '_, '_> {
    /// Holds back the evader's moves from a node that was just expanded, if it may wait there;
    /// returns whether it does.
    ///
    /// # Errors
    /// The model fails in saying where time stops.
    pub(super) fn hold_back(&mut self, node: u32) -> Result<bool, Failure> {
        let edges = self.graph.edges_of(node);
        let mut own = self.graph.edges[edges.clone()].iter();
        if self.seeker == Player::Controller
            || !self.exploration.reserve.is_kept
            || !self.graph.symbolic.tuning().lazy_safety
            || !self.graph.nodes[node as usize].delays
            || self.graph.urgent(node).is_some()
            || !self.graph.branch_points.of(node).is_empty()
            || self.graph.symbolic.stepper.network().features.stopwatches
            || !own.any(|edge| !self.seeker.owns(edge.controllable))
        {
            return Ok(false);
        }
        let mut forced = Federation::empty(self.graph.dimension());
        if self.may_stop(node) {
            let situation = self.situation(node)?;
            forced = self.forced_controller(node, &situation);
        }
        self.exploration.reserve.is_used = true;
        let holds = &mut self.exploration.held.holds;
        holds.resize(edges.start, Hold::None);
        for edge in &self.graph.edges[edges.clone()] {
            holds.push(if self.seeker.owns(edge.controllable) {
                Hold::None
            } else {
                Hold::Held
            });
        }
        // If it must move because time stops, it needs one of the moves at once.
        for index in edges {
            let edge = self.graph.edges[index];
            if forced.is_empty() {
                break;
            }
            let enabled = self.enabled(&edge);
            if self.exploration.held.holds(index) && enabled.intersects(&forced) {
                forced.subtract(&enabled);
                self.use_move(index);
            }
        }
        Ok(true)
    }

    /// Lets the evader use a move that is held back.
    pub(in crate::game) fn use_move(&mut self, edge: usize) {
        self.exploration.held.holds[edge] = Hold::Used;
        let target = self.graph.edges[edge].target;
        if self.is_unexplored(target) {
            self.wait_for(target);
            self.exploration.waiting.add_spoiler(target);
        }
    }

    /// Defends a node.
    pub(in crate::game) fn defend(&mut self, node: u32, defence: &Defence) {
        let first = self.graph.edges_of(node).start;
        for edge in &defence.moves {
            self.use_move(first + *edge as usize);
        }
        if defence.is_undefended {
            self.exploration.held.undefended.push(node);
        }
    }

    /// Uses weak moves from now on, and lets the undefended nodes be computed.
    pub(in crate::game) fn use_weak_moves(&mut self) {
        self.exploration.held.uses_weak = true;
        for node in std::mem::take(&mut self.exploration.held.undefended) {
            self.agenda.mark(node);
        }
    }

    /// Stops using weak moves, and holds back again the moves to unexplored nodes.
    pub(in crate::game) fn hold_back_again(&mut self) {
        self.exploration.held.uses_weak = false;
        for index in 0..self.exploration.held.holds.len() {
            let Edge { source, target, .. } = self.graph.edges[index];
            if self.exploration.held.holds[index] == Hold::Used && self.is_unexplored(target) {
                self.exploration.held.holds[index] = Hold::Held;
                self.agenda.mark(source);
            }
        }
    }

    /// Notes the processes that take part in what the seeker wins in a node.
    pub(in crate::game) fn note_attackers(&mut self, node: u32) {
        self.exploration.held.attackers[node as usize] |=
            self.attack(node, &self.won.win, &self.exploration.held.attackers);
    }

    /// The processes that take part in winning moves of the seeker, or in its win after them.
    fn attack(&self, node: u32, win: &[Win], attackers: &[u32]) -> u32 {
        let edges = self.graph.edges_from(node).iter();
        let winning = edges.filter(|edge| {
            self.seeker.owns(edge.controllable)
                && !matches!(win[edge.target as usize], Win::Nothing)
        });
        winning.fold(0, |all, edge| {
            all | edge.movers | attackers[edge.target as usize]
        })
    }

    /// The processes by which one can recognise moves that help against an attack: not those that
    /// take part in most moves, if there are others.
    pub(in crate::game) fn aims(&self, node: u32, win: &[Win], attackers: &[u32]) -> u32 {
        let attack = self.attack(node, win, attackers);
        match attack & !self.exploration.held.hubs {
            0 => attack,
            telling => telling,
        }
    }

    /// Counts the processes that take part in moves, if there are many new moves.
    pub(in crate::game) fn count_hubs(&mut self) {
        let count = self.graph.edges.len();
        if !self.exploration.reserve.is_used || count < self.exploration.held.next_count {
            return;
        }
        self.exploration.held.next_count = count + count / BETWEEN_COUNTS + 1;
        let mut moves = [0; u32::BITS as usize];
        for edge in &self.graph.edges {
            for (bit, moves) in moves.iter_mut().enumerate() {
                *moves += edge.movers as usize >> bit & 1;
            }
        }
        let hubs = (0..u32::BITS).filter(|&bit| 2 * moves[bit as usize] > count);
        self.exploration.held.hubs = hubs.fold(0, |all, bit| all | 1 << bit);
    }

    /// What a node wins, given what is known about its successors, and the held moves that the
    /// evader must use against a greater win.
    pub(in crate::game) fn winnable_against_defence(
        &self,
        node: u32,
        situation: &Situation,
    ) -> (Federation, Defence) {
        let edges = self.graph.edges_of(node);
        let first = edges.start;
        let mut held: Vec<usize> = edges
            .filter(|&edge| self.exploration.held.holds(edge))
            .collect();
        if held.is_empty() {
            let won = self.winnable(node, situation);
            return (won, Defence::default());
        }
        let aims = self.aims(node, &self.won.win, &self.exploration.held.attackers);
        let mut moves = Vec::new();
        let mut is_undefended = false;
        let won = loop {
            let (won, decided) = self.winnable_without(node, situation, &held);
            let Some(mut threatened) = self.new_part(node, &won) else {
                break won;
            };
            threatened.subtract(&decided);
            match self.strongest(&held, aims, &threatened) {
                None => break won,
                Some((_, 0)) if !self.exploration.held.uses_weak => {
                    is_undefended = true;
                    break self.winnable(node, situation);
                }
                Some((index, _)) => moves.push((held.remove(index) - first) as u32),
            }
        };
        let defence = Defence {
            moves: moves.into(),
            is_undefended,
        };
        (won, defence)
    }

    /// The part of these valuations that the node has not won; `None` if there is none.
    pub(in crate::game) fn new_part(&self, node: u32, won: &Federation) -> Option<Federation> {
        let part = match &self.won.win[node as usize] {
            Win::Everything => return None,
            Win::Part(_) => self.won.rest[&node].intersection(won),
            Win::Nothing => won.clone(),
        };
        (!part.is_empty()).then_some(part)
    }

    /// The first held move among those that help somewhere in these valuations and share the most
    /// of the processes, and the number of shared ones.
    pub(in crate::game) fn strongest(
        &self,
        held: &[usize],
        aims: u32,
        threatened: &Federation,
    ) -> Option<(usize, u32)> {
        let mut best: Option<(usize, u32)> = None;
        for (index, &edge) in held.iter().enumerate() {
            let edge = &self.graph.edges[edge];
            let strength = (edge.movers & aims).count_ones();
            if best.is_none_or(|(_, most)| strength > most)
                && !matches!(self.won.win[edge.target as usize], Win::Everything)
                && self.spoiling(edge).intersects(threatened)
            {
                best = Some((index, strength));
            }
        }
        best
    }
}
