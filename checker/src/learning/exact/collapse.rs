//! Brings a component of states that may come again into a form for value iteration.
//!
//! Invariants of the form:
//! * From every node some strategy leaves the component almost surely, by choices that are kept.
//! * No set of nodes can be kept to for ever at no cost: such nodes are one.
//! * Either no choice costs less than nothing, or the component is left whatever is chosen.
//!
//! Sources: L. de Alfaro, "Formal verification of probabilistic systems", thesis (1997), on end
//! components; S. Haddad, B. Monmege, TCS 735 (2018), on making them one node each.

use std::ops::Range;

use super::components::components;
use super::ending::ending;
use super::process::Process;
use super::solution::{Cyclic, Solution, Unsolved};
use crate::cancellation;

/// The component, with what lies behind it as numbers.
#[derive(Debug, Default)]
pub(super) struct Local {
    first_choice: Vec<u32>,
    first_way: Vec<u32>,
    pub(super) costs: Vec<f64>,
    /// By choice: what it costs with what lies behind the component, by lower and upper bounds.
    pub(super) lower_behind: Vec<f64>,
    pub(super) upper_behind: Vec<f64>,
    pub(super) targets: Vec<u32>,
    pub(super) chances: Vec<f64>,
    /// By choice: whether it cannot leave the component.
    pub(super) stays: Vec<bool>,
    /// By choice: that of the process.
    pub(super) of_process: Vec<u32>,
    /// The least lower bound behind it.
    pub(super) least_behind: f64,
    /// The greatest difference of bounds behind it.
    pub(super) gap_behind: f64,
    /// Bounds of the number of moves until it is left, where it is left whatever is chosen.
    pub(super) longest: Option<Vec<f64>>,
}

/// Which nodes of the process a node stands for.
pub(super) struct Members {
    /// By node of the component: its members, by their numbers in the process.
    of: Vec<Vec<u32>>,
}

impl Local {
    pub(super) fn nodes(&self) -> usize {
        self.first_choice.len() - 1
    }

    pub(super) fn choices(&self, node: usize) -> Range<usize> {
        self.first_choice[node] as usize..self.first_choice[node + 1] as usize
    }

    pub(super) fn ways(&self, choice: usize) -> Range<usize> {
        self.first_way[choice] as usize..self.first_way[choice + 1] as usize
    }

    /// Adds a choice of the process to the last node.
    fn add(&mut self, process: &Process, choice: usize, places: &[u32], known: &Solution) {
        let cost = process.costs[choice];
        let (mut lower, mut upper) = (cost, cost);
        let mut stays = true;
        for (target, chance) in process.outcomes(choice) {
            let place = places[target as usize];
            if place != u32::MAX {
                self.targets.push(place);
                self.chances.push(chance);
                continue;
            }
            stays = false;
            let target = target as usize;
            lower += chance * known.lower[target];
            upper += chance * known.upper[target];
            self.least_behind = self.least_behind.min(known.lower[target]);
            let gap = known.upper[target] - known.lower[target];
            self.gap_behind = self.gap_behind.max(gap);
        }
        self.costs.push(cost);
        self.lower_behind.push(lower);
        self.upper_behind.push(upper);
        self.stays.push(stays);
        self.of_process.push(choice as u32);
        self.first_way.push(self.targets.len() as u32);
    }
}

/// The form of a component; `None` if no node of it has a strategy that ends.
pub(super) fn collapsed(cyclic: &mut Cyclic<'_>) -> Result<Option<(Local, Members)>, Unsolved> {
    // Nodes that were found late are nearer to the end.
    let mut nodes = cyclic.nodes.to_vec();
    nodes.sort_unstable_by(|one, other| other.cmp(one));
    let kept = ending(cyclic, &nodes);
    if kept.is_empty() {
        return Ok(None);
    }
    let groups: Vec<Vec<u32>> = kept.iter().map(|&node| vec![node]).collect();
    let plain = local(cyclic, &groups, &[]);
    let free = end_components(&plain, |choice| plain.costs[choice] == 0.0);
    let (mut local, groups) = if free.is_empty() {
        (plain, groups)
    } else {
        let (groups, inner) = merged(&plain, groups, &free);
        (local(cyclic, &groups, &inner), groups)
    };
    if local.costs.iter().any(|&cost| cost < 0.0) {
        let loops = end_components(&local, |_| true);
        if let Some(loops) = loops.first() {
            let costs = loops.iter().map(|&choice| local.costs[choice as usize]);
            let is_falling = costs.clone().all(|cost| cost <= 0.0);
            return Err(if is_falling {
                Unsolved::Unbounded
            } else {
                Unsolved::MixedCycles
            });
        }
        local.longest = Some(local.longest_moves().ok_or(Unsolved::Slow)?);
    }
    Ok(Some((local, Members { of: groups })))
}

/// The component of these groups of nodes. `inner` choices of the process are left out, as are
/// those that may lead where no strategy ends.
fn local(cyclic: &mut Cyclic<'_>, groups: &[Vec<u32>], inner: &[u32]) -> Local {
    let (process, solution) = (cyclic.process, &*cyclic.solution);
    let places = &mut *cyclic.places;
    for (place, group) in (0..).zip(groups) {
        for &node in group {
            places[node as usize] = place;
        }
    }
    let mut local = Local {
        first_choice: vec![0],
        first_way: vec![0],
        least_behind: f64::INFINITY,
        ..Local::default()
    };
    for group in groups {
        let choices = group.iter().flat_map(|&node| process.choices(node));
        for choice in choices {
            let is_left_out = inner.binary_search(&(choice as u32)).is_ok();
            let mut outcomes = process.outcomes(choice);
            let ends = |node: u32| {
                places[node as usize] != u32::MAX || solution.upper[node as usize].is_finite()
            };
            if !is_left_out && outcomes.all(|(target, _)| ends(target)) {
                local.add(process, choice, places, solution);
            }
        }
        local.first_choice.push(local.costs.len() as u32);
    }
    for &node in groups.iter().flatten() {
        places[node as usize] = u32::MAX;
    }
    local
}

/// The greatest end components of those choices that may be looked at: of each its choices.
fn end_components(local: &Local, may: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
    let mut is_kept: Vec<bool> = (0..local.costs.len())
        .map(|choice| may(choice) && local.stays[choice])
        .collect();
    if !is_kept.contains(&true) {
        return Vec::new();
    }
    loop {
        // The graph of the choices that are kept.
        let mut targets = Vec::new();
        let mut ends = vec![0];
        for node in 0..local.nodes() {
            for choice in local.choices(node).filter(|&choice| is_kept[choice]) {
                targets.extend_from_slice(&local.targets[local.ways(choice)]);
            }
            ends.push(targets.len());
        }
        let edges = |node: u32| ends[node as usize]..ends[node as usize + 1];
        let parts = components(local.nodes(), &targets, edges);
        let mut part_of = vec![0; local.nodes()];
        for part in 0..parts.len() {
            for &node in parts.nodes(part) {
                part_of[node as usize] = part;
            }
        }
        let mut changes = false;
        for node in 0..local.nodes() {
            for choice in local
                .choices(node)
                .filter(|&choice| is_kept[choice])
                .collect::<Vec<_>>()
            {
                let mut targets = local.targets[local.ways(choice)].iter();
                if targets.any(|&to| part_of[to as usize] != part_of[node]) {
                    is_kept[choice] = false;
                    changes = true;
                }
            }
        }
        cancellation::work(local.targets.len());
        if changes {
            continue;
        }
        let mut found: Vec<Vec<u32>> = vec![Vec::new(); parts.len()];
        for node in 0..local.nodes() {
            let choices = local.choices(node).filter(|&choice| is_kept[choice]);
            found[part_of[node]].extend(choices.map(|choice| choice as u32));
        }
        found.retain(|choices| !choices.is_empty());
        return found;
    }
}

/// Puts the nodes of end components together; returns the groups, and the choices of the process
/// that are inside, ascending.
fn merged(local: &Local, groups: Vec<Vec<u32>>, parts: &[Vec<u32>]) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut owner: Vec<u32> = (0..local.nodes() as u32).collect();
    let mut inner = Vec::new();
    for choices in parts {
        let first = local.targets[local.ways(choices[0] as usize)][0];
        for &choice in choices {
            inner.push(local.of_process[choice as usize]);
            for &node in &local.targets[local.ways(choice as usize)] {
                owner[node as usize] = first;
            }
        }
    }
    inner.sort_unstable();
    let mut together: Vec<Vec<u32>> = vec![Vec::new(); groups.len()];
    for (group, owner) in groups.into_iter().zip(owner) {
        together[owner as usize].extend(group);
    }
    together.retain(|group| !group.is_empty());
    (together, inner)
}

impl Local {
    /// Bounds of the moves until the component is left, where it is left whatever is chosen.
    fn longest_moves(&self) -> Option<Vec<f64>> {
        let mut moves = vec![0.0; self.nodes()];
        for _ in 0..LONGEST_SWEEPS {
            let most = |node: usize, moves: &[f64]| {
                let choices = self.choices(node);
                choices
                    .map(|choice| self.inside(choice, moves))
                    .fold(0.0, f64::max)
            };
            let mut rise: f64 = 0.0;
            for node in 0..self.nodes() {
                let next = 1.0 + most(node, &moves);
                rise = rise.max(next - moves[node]);
                moves[node] = next;
            }
            cancellation::work(self.targets.len());
            if rise <= 0.25 && (0..self.nodes()).all(|node| moves[node] >= 0.5 + most(node, &moves))
            {
                // Twice as much takes a whole move each time.
                return Some(moves.iter().map(|moves| 2.0 * moves).collect());
            }
        }
        None
    }
}

/// The sweeps for the longest ways.
const LONGEST_SWEEPS: usize = 100_000;

impl Members {
    /// Gives the process the bounds of the component, and the policy.
    pub(super) fn give(
        &self,
        process: &Process,
        local: &Local,
        (lower, upper, policy): (&[f64], &[f64], &[u32]),
        solution: &mut Solution,
    ) {
        for (place, group) in self.of.iter().enumerate() {
            let best = local.of_process[policy[place] as usize];
            for &node in group {
                solution.lower[node as usize] = lower[place];
                solution.upper[node as usize] = upper[place];
                if process.choices(node).contains(&(best as usize)) {
                    solution.policy[node as usize] = best;
                }
            }
            if group.len() > 1 {
                lead_to_owner(process, group, solution);
            }
        }
    }
}

/// Lets all of a group go, for nothing, to the one that has a policy.
fn lead_to_owner(process: &Process, group: &[u32], solution: &mut Solution) {
    let mut group = group.to_vec();
    group.sort_unstable();
    let is_in = |node: u32| group.binary_search(&node).is_ok();
    loop {
        let mut changes = false;
        for &node in &group {
            if solution.policy[node as usize] != u32::MAX {
                continue;
            }
            let leads = |choice: &usize| {
                let mut is_inside = process.costs[*choice] == 0.0;
                let mut is_near = false;
                for (target, _) in process.outcomes(*choice) {
                    is_inside &= is_in(target);
                    is_near |= is_in(target) && solution.policy[target as usize] != u32::MAX;
                }
                is_inside && is_near
            };
            if let Some(choice) = process.choices(node).find(leads) {
                solution.policy[node as usize] = choice as u32;
                changes = true;
            }
        }
        if !changes {
            return;
        }
    }
}
