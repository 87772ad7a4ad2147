//! A component of states that may come again.
//!
//! First it is brought into a form in which iteration cannot go wrong: nodes without a strategy
//! that ends almost surely are left out, and nodes between which the controller can go to and fro
//! for nothing become one (`collapse.rs`). Then lower bounds rise by value iteration, from values
//! that no look can lower. Upper bounds come from the strategy that is best by the lower ones: its
//! mean numbers of moves say how far above them its own costs can lie. They are guessed by that,
//! verified by one look at each node, and lowered by further ones.
//!
//! Invariants:
//! * Lower bounds never exceed what one look at them gives, so no strategy costs less.
//! * Upper bounds are never below what one look under the policy gives, and the policy leaves the
//!   component almost surely, so it costs no more.
//!
//! Sources: A. Hartmanns, B. L. Kaminski, "Optimistic value iteration", CAV 2020; D. Bertsekas,
//! J. Tsitsiklis, "An analysis of stochastic shortest path problems", Math. Oper. Res. 16 (1991).

use super::collapse::{Local, collapsed};
use super::solution::{Cyclic, Unsolved};
use crate::cancellation;

/// So many sweeps, and the bounds are as near as they come.
const MOST_SWEEPS: usize = 100_000;
/// From above, bounds meet within so many sweeps, or it is tried from below.
const SWEEPS_FROM_ABOVE: usize = 2_000;
/// A policy that leaves a component is looked for so many times.
const PASSES: usize = 200;
/// So many guesses of upper bounds, and there are none.
const MOST_GUESSES: usize = 12;
/// After a guess that was wrong, lower bounds must rise so many times less.
const NEARER: f64 = 8.0;
/// A guess takes so many sweeps more than there were before, at most.
const FIRST_SWEEPS: usize = 64;
/// A mean number of moves counts as an upper bound if each move takes this much of it, or more.
const STEP: f64 = 0.5;

/// Finds the bounds in a component.
pub(super) fn solve(mut cyclic: Cyclic<'_>) -> Result<(), Unsolved> {
    let precision = cyclic.precision;
    let Some((local, members)) = collapsed(&mut cyclic)? else {
        // None of its states has a strategy that ends.
        return Ok(());
    };
    if let Some((lower, upper, policy)) = local.bounds_from_above(precision) {
        members.give(
            cyclic.process,
            &local,
            (&lower, &upper, &policy),
            cyclic.solution,
        );
        return Ok(());
    }
    let mut lower = local.start();
    // Where costs cancel out, the bounds can be no nearer than their sums are rounded.
    let costs = local.costs.iter().map(|one| one.abs()).fold(0.0, f64::max);
    let (mut sweeps, mut guesses) = (0, 0);
    let mut near = precision;
    loop {
        let rise = local.raise(&mut lower);
        sweeps += 1;
        let scale = lower.iter().map(|one| one.abs()).fold(costs, f64::max);
        if rise <= near * scale {
            let policy = local.best(&lower);
            let most = (sweeps + FIRST_SWEEPS) << guesses;
            let slack = precision * scale + local.gap_behind;
            if let Some(upper) = local.upper(&lower, &policy, slack, most) {
                let found = (&lower[..], &upper[..], &policy[..]);
                members.give(cyclic.process, &local, found, cyclic.solution);
                return Ok(());
            }
            near /= NEARER;
            guesses += 1;
        }
        if sweeps > MOST_SWEEPS || guesses > MOST_GUESSES {
            return Err(Unsolved::Slow);
        }
    }
}

impl Local {
    /// The bounds and the policy, where each choice costs something: value iteration from above is
    /// faster there, for lower bounds rise by a cost at a time.
    ///
    /// If one look lowers no upper bound by more than a part of the least cost, all of them are
    /// lower bounds once they are less by that part: a look at these gains as much as it loses.
    fn bounds_from_above(&self, precision: f64) -> Option<(Vec<f64>, Vec<f64>, Vec<u32>)> {
        let least = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        if least <= 0.0 {
            return None;
        }
        let policy = self.nearest()?;
        let moves = self.moves_of(&policy, SWEEPS_FROM_ABOVE)?;
        let base = self.least_behind;
        let constant = vec![base; self.nodes()];
        let above = |node: usize| {
            let choice = policy[node] as usize;
            self.upper_behind[choice] + self.inside(choice, &constant) - base
        };
        let excess = (0..self.nodes()).map(above).fold(0.0, f64::max);
        let mut upper: Vec<f64> = moves
            .iter()
            .map(|moves| base + excess / STEP * moves)
            .collect();
        for _ in 0..SWEEPS_FROM_ABOVE {
            let best = |node: usize, behind: &[f64], values: &[f64]| {
                let choices = self.choices(node);
                let totals = choices.map(|choice| behind[choice] + self.inside(choice, values));
                totals.fold(f64::INFINITY, f64::min)
            };
            for node in 0..self.nodes() {
                upper[node] = upper[node].min(best(node, &self.upper_behind, &upper));
            }
            let fall = |node: usize| upper[node] - best(node, &self.lower_behind, &upper);
            let falls = (0..self.nodes()).map(fall).fold(0.0, f64::max);
            cancellation::work(2 * self.targets.len());
            let part = falls / least;
            if part <= precision {
                let less = |&value: &f64| base + (1.0 - part) * (value - base);
                let lower = upper.iter().map(less).collect();
                let policy = self.best_by(&self.upper_behind, &upper);
                return Some((lower, upper, policy));
            }
        }
        None
    }

    /// A policy that comes nearer to a way out with each choice, by chance; `None` if that takes
    /// long to find.
    fn nearest(&self) -> Option<Vec<u32>> {
        let mut policy = vec![u32::MAX; self.nodes()];
        let mut rest = self.nodes();
        for pass in 0..PASSES {
            for place in 0..self.nodes() {
                let node = if pass % 2 == 0 {
                    place
                } else {
                    self.nodes() - 1 - place
                };
                if policy[node] != u32::MAX {
                    continue;
                }
                let mut choices = self.choices(node);
                let leads = |choice: &usize| {
                    let mut targets = self.targets[self.ways(*choice)].iter();
                    !self.stays[*choice] || targets.any(|&to| policy[to as usize] != u32::MAX)
                };
                if let Some(choice) = choices.find(leads) {
                    policy[node] = choice as u32;
                    rest -= 1;
                }
            }
            cancellation::work(self.targets.len());
            if rest == 0 {
                return Some(policy);
            }
        }
        None
    }

    /// Values that one look at them does not lower.
    fn start(&self) -> Vec<f64> {
        let least = self.least_behind;
        let deepest = self.costs.iter().copied().fold(0.0, f64::min);
        match &self.longest {
            Some(longest) if deepest < 0.0 => longest
                .iter()
                .map(|moves| least + deepest * moves)
                .collect(),
            _ => vec![least; self.nodes()],
        }
    }

    /// One sweep of value iteration; returns the greatest rise.
    fn raise(&self, values: &mut [f64]) -> f64 {
        let mut rise: f64 = 0.0;
        for node in 0..self.nodes() {
            let totals = self.choices(node).map(|choice| self.total(choice, values));
            let best = totals.fold(f64::INFINITY, f64::min);
            rise = rise.max(best - values[node]);
            values[node] = values[node].max(best);
        }
        cancellation::work(self.targets.len());
        rise
    }

    /// What a choice costs by lower bounds.
    fn total(&self, choice: usize, values: &[f64]) -> f64 {
        self.lower_behind[choice] + self.inside(choice, values)
    }

    /// The part of the nodes of the component.
    pub(super) fn inside(&self, choice: usize, values: &[f64]) -> f64 {
        let ways = self.ways(choice);
        let targets = self.targets[ways.clone()].iter();
        let chances = &self.chances[ways];
        targets
            .zip(chances)
            .map(|(&to, chance)| chance * values[to as usize])
            .sum()
    }

    /// The best choices by lower bounds.
    fn best(&self, values: &[f64]) -> Vec<u32> {
        self.best_by(&self.lower_behind, values)
    }

    /// The best choices by what lies behind the component, and the values of its nodes.
    fn best_by(&self, behind: &[f64], values: &[f64]) -> Vec<u32> {
        let total = |choice: usize| behind[choice] + self.inside(choice, values);
        let best = |node: usize| {
            let mut choices = self.choices(node);
            let first = choices.next().expect("every node has a choice");
            let (mut best, mut least) = (first, total(first));
            for choice in choices {
                let total = total(choice);
                if total < least {
                    (best, least) = (choice, total);
                }
            }
            best as u32
        };
        (0..self.nodes()).map(best).collect()
    }

    /// Upper bounds of what a policy costs that are as near to the lower bounds as `slack`; `None`
    /// if so many sweeps find none.
    fn upper(&self, lower: &[f64], policy: &[u32], slack: f64, most: usize) -> Option<Vec<f64>> {
        let moves = self.moves_of(policy, most)?;
        let above = |node: usize| {
            let choice = policy[node] as usize;
            self.upper_behind[choice] + self.inside(choice, lower) - lower[node]
        };
        let excess = (0..self.nodes()).map(above).fold(0.0, f64::max);
        let mut upper: Vec<f64> = lower.to_vec();
        for (upper, moves) in upper.iter_mut().zip(&moves) {
            *upper += excess / STEP * moves;
        }
        for _ in 0..most {
            let mut gap: f64 = 0.0;
            for node in 0..self.nodes() {
                let choice = policy[node] as usize;
                let total = self.upper_behind[choice] + self.inside(choice, &upper);
                upper[node] = upper[node].min(total);
                gap = gap.max(upper[node] - lower[node]);
            }
            cancellation::work(self.targets.len());
            if gap <= slack {
                return Some(upper);
            }
        }
        None
    }

    /// Upper bounds, for this purpose, of the moves until a policy leaves the component; `None` if
    /// so many sweeps do not find them.
    fn moves_of(&self, policy: &[u32], most: usize) -> Option<Vec<f64>> {
        let mut moves = vec![0.0; self.nodes()];
        for _ in 0..most {
            let mut rise: f64 = 0.0;
            for (node, &choice) in policy.iter().enumerate() {
                let next = 1.0 + self.inside(choice as usize, &moves);
                rise = rise.max(next - moves[node]);
                moves[node] = next;
            }
            cancellation::work(self.targets.len());
            let takes = |node: usize| moves[node] - self.inside(policy[node] as usize, &moves);
            if rise <= STEP / 2.0 && (0..self.nodes()).all(|node| takes(node) >= STEP) {
                return Some(moves);
            }
        }
        None
    }
}
