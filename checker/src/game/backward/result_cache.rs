//! Winning valuations that were computed before, for nodes that differ in nothing that they hang
//! on.
//!
//! In models with much data, many nodes have the same zone, the same edges as far as clocks go, and
//! the same successors won. What they win first is computed once. It hangs on nothing but what the
//! key of such a case holds:
//! * the zone of the node, whether time may pass, which clocks stand still, and where invariants
//!   stop time;
//! * of each edge what it does to clocks, who owns it, the zone of its target, and whether all of
//!   the target is won or nothing, and whether the evader holds it back;
//! * if that may decide whether the environment is forced to move ([`super::forced_moves`]): which
//!   processes stop time, and which take part in the moves of the controller.
//!
//! Other nodes are no such cases: those in which the goal or what must be kept hang on clocks, or
//! time is cut short, those of which something is won or that lead to nodes of which a part is; and
//! those in which it matters which processes move, if there are more than
//! [`Edge::movers`](crate::game::forward::graph::Edge::movers) tells apart.

use rustc_hash::FxHashMap;

use crate::ir::Urgency;
use crate::network::Failure;
use crate::zones::federation::block_bytes;

use super::solver::{Solver, Win};
use super::winning_sets::Gained;
use crate::game::Forced;
use crate::game::exploration::lazy_safety::Defence;
use crate::game::forward::node::Standing;
use crate::zones::federation::table_bytes;

/// Cases that are remembered, at most.
const MOST_CASES: usize = 1 << 14;
/// After so many look-ups it is seen whether
const TRIAL: u32 = 1 << 10;
/// one in so many, at least, meets a case that is known; else no more are made.
const WORTH: u32 = 4;

/// What cases win.
#[derive(Debug, Default)]
pub(super) struct Repeats {
    cases: FxHashMap<Box<[u32]>, (Gained, Defence)>,
    key: Vec<u32>,
    /// What keys and gains take beside the table.
    kept_bytes: u64,
    lookups: u32,
    hits: u32,
}

/// Whether a node is a case.
pub(super) enum Case {
    /// It is none.
    None,
    /// One that is not remembered, with its key.
    New(Box<[u32]>),
    /// One of which it is known what it gains, and how the evader defends itself.
    Known(Gained, Defence),
}

impl Repeats {
    /// The bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let table = table_bytes::<(Box<[u32]>, (Gained, Defence))>(self.cases.capacity());
        self.kept_bytes + table as u64
    }
}

impl Solver<'_, '_, '_> {
    /// Looks whether a node is a case, and one that was met before.
    pub(super) fn case_of(&mut self, node: u32) -> Result<Case, Failure> {
        let repeats = &self.repeats;
        if !self.graph.symbolic.tuning().result_cache
            || repeats.lookups >= TRIAL && repeats.hits < repeats.lookups / WORTH
            || !self.is_case(node)
        {
            return Ok(Case::None);
        }
        self.make_key(node)?;
        let repeats = &mut self.repeats;
        repeats.lookups += 1;
        if let Some((gained, defence)) = repeats.cases.get(&repeats.key[..]) {
            repeats.hits += 1;
            return Ok(Case::Known(gained.clone(), defence.clone()));
        }
        Ok(Case::New(repeats.key.clone().into_boxed_slice()))
    }

    /// Remembers what a case gains, and how the evader defends itself.
    pub(super) fn remember_case(&mut self, key: Box<[u32]>, gained: &Gained, defence: &Defence) {
        if self.repeats.cases.len() < MOST_CASES {
            let key_bytes = block_bytes(size_of_val(&*key)) as u64;
            self.repeats.kept_bytes += key_bytes + gained.heap_bytes() + defence.heap_bytes();
            self.repeats
                .cases
                .insert(key, (gained.clone(), defence.clone()));
        }
    }

    fn is_case(&self, node: u32) -> bool {
        if self.targets.is_some()
            || self.graph.nodes[node as usize].standing != Standing::Open
            || !matches!(self.win[node as usize], Win::Nothing)
            || self.graph.urgent(node).is_some()
        {
            return false;
        }
        let mut edges = self.graph.edges[self.graph.edges_of(node)].iter();
        let has_part = edges.any(|edge| matches!(self.win[edge.target as usize], Win::Part(_)));
        let processes = &self.graph.symbolic.stepper.network().processes;
        !has_part && (processes.len() <= u32::BITS as usize || !self.hangs_on_movers(node))
    }

    /// Whether it may matter which processes move in a node: the environment may be forced to move
    /// because of them.
    fn hangs_on_movers(&self, node: u32) -> bool {
        let mut has_owner = [false; 2];
        for edge in &self.graph.edges[self.graph.edges_of(node)] {
            has_owner[usize::from(edge.controllable)] = true;
        }
        self.forced == Forced::Tiga && has_owner == [true; 2]
    }

    fn make_key(&mut self, node: u32) -> Result<(), Failure> {
        let mut key = std::mem::take(&mut self.repeats.key);
        key.clear();
        let hangs_on_movers = self.hangs_on_movers(node);
        let mut words = std::mem::take(&mut self.words);
        self.graph.load(node, &mut words);
        let symbolic = &mut *self.graph.symbolic;
        let locations = symbolic.stepper.network().processes.iter().zip(&words);
        let mut is_urgent = false;
        for (index, (process, &location)) in locations.enumerate() {
            if process.locations[location as usize].urgency != Urgency::Normal {
                is_urgent = true;
                if hangs_on_movers {
                    key.push(index as u32);
                }
            }
        }
        key.push(u32::MAX);
        let bounds = symbolic.upper_bounds(&mut words);
        let stopped = symbolic.stopped(&words);
        self.words = words;
        let known = &self.graph.nodes[node as usize];
        key.push(known.zone.0);
        let flags = [self.defences.uses_weak, known.delays, is_urgent];
        key.push(flags.iter().fold(0, |all, one| all * 2 + u32::from(*one)));
        for clock in &stopped? {
            key.push(clock as u32);
        }
        key.push(u32::MAX);
        for (process, bound) in bounds? {
            key.extend([bound.left as u32, bound.bound.raw().cast_unsigned()]);
            if hangs_on_movers {
                key.push(process);
            }
        }
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            let is_held = self.defences.holds(index);
            let is_won = matches!(self.win[edge.target as usize], Win::Everything);
            let is_one = edge.length == 1;
            let flags = [
                edge.controllable,
                edge.is_total,
                is_one,
                is_won,
                is_held,
                edge.is_leg,
            ];
            let flags = flags.iter().fold(1, |all, one| all * 2 + u32::from(*one));
            let target = self.graph.nodes[edge.target as usize].zone;
            key.extend([edge.program.0, target.0, flags]);
            if hangs_on_movers && edge.controllable {
                key.push(edge.movers);
            }
        }
        self.repeats.key = key;
        Ok(())
    }
}
