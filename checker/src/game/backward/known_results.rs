//! How nodes are told to be cases of which it is known what they win ([`super::result_cache`]).

use crate::ir::Urgency;
use crate::network::Failure;
use crate::zones::federation::block_bytes;

use super::result_cache::{Case, MOST_CASES, TRIAL, WORTH};
use super::winning_sets::{Gained, Win};
use crate::game::Forced;
use crate::game::exploration::held_moves::Defence;
use crate::game::forward::node::Standing;
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
    /// Looks whether a node is a case, and one that was met before.
    pub(super) fn case_of(&mut self, node: u32) -> Result<Case, Failure> {
        let repeats = &self.results;
        if !self.graph.symbolic.tuning().result_cache
            || repeats.lookups >= TRIAL && repeats.hits < repeats.lookups / WORTH
            || !self.is_case(node)
        {
            return Ok(Case::None);
        }
        self.make_key(node)?;
        let repeats = &mut self.results;
        repeats.lookups += 1;
        if let Some((gained, defence)) = repeats.cases.get(&repeats.key[..]) {
            repeats.hits += 1;
            return Ok(Case::Known(gained.clone(), defence.clone()));
        }
        Ok(Case::New(repeats.key.clone().into_boxed_slice()))
    }

    /// Remembers what a case gains, and how the evader defends itself.
    pub(super) fn remember_case(&mut self, key: Box<[u32]>, gained: &Gained, defence: &Defence) {
        if self.results.cases.len() < MOST_CASES {
            let key_bytes = block_bytes(size_of_val(&*key)) as u64;
            self.results.kept_bytes += key_bytes + gained.heap_bytes() + defence.heap_bytes();
            self.results
                .cases
                .insert(key, (gained.clone(), defence.clone()));
        }
    }

    fn is_case(&self, node: u32) -> bool {
        if self.sought.targets.is_some()
            || self.graph.nodes[node as usize].standing != Standing::Open
            || !matches!(self.won.win[node as usize], Win::Nothing)
            || self.graph.urgent(node).is_some()
        {
            return false;
        }
        let mut edges = self.graph.edges[self.graph.edges_of(node)].iter();
        let has_part = edges.any(|edge| matches!(self.won.win[edge.target as usize], Win::Part(_)));
        let processes = &self.graph.symbolic.stepper.network().processes;
        !has_part && (processes.len() <= u32::BITS as usize || !self.depends_on_movers(node))
    }

    /// Whether it may matter which processes move in a node: the environment may be forced to move
    /// because of them.
    fn depends_on_movers(&self, node: u32) -> bool {
        let mut has_owner = [false; 2];
        for edge in &self.graph.edges[self.graph.edges_of(node)] {
            has_owner[usize::from(edge.controllable)] = true;
        }
        self.forced == Forced::Tiga && has_owner == [true; 2]
    }

    fn make_key(&mut self, node: u32) -> Result<(), Failure> {
        let mut key = std::mem::take(&mut self.results.key);
        key.clear();
        let depends_on_movers = self.depends_on_movers(node);
        let mut words = std::mem::take(&mut self.words);
        self.graph.load(node, &mut words);
        let symbolic = &mut *self.graph.symbolic;
        let locations = symbolic.stepper.network().processes.iter().zip(&words);
        let mut is_urgent = false;
        for (index, (process, &location)) in locations.enumerate() {
            if process.locations[location as usize].urgency != Urgency::Normal {
                is_urgent = true;
                if depends_on_movers {
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
        let flags = [self.exploration.held.uses_weak, known.delays, is_urgent];
        key.push(flags.iter().fold(0, |all, one| all * 2 + u32::from(*one)));
        for clock in &stopped? {
            key.push(clock as u32);
        }
        key.push(u32::MAX);
        for (process, bound) in bounds? {
            key.extend([bound.left as u32, bound.bound.raw().cast_unsigned()]);
            if depends_on_movers {
                key.push(process);
            }
        }
        for index in self.graph.edges_of(node) {
            let edge = &self.graph.edges[index];
            let is_held = self.exploration.held.holds(index);
            let is_won = matches!(self.won.win[edge.target as usize], Win::Everything);
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
            if depends_on_movers && edge.controllable {
                key.push(edge.movers);
            }
        }
        self.results.key = key;
        Ok(())
    }
}
