//! The best strategy in what the controller sees.
//!
//! All decisions at which the same is seen exactly make a tree over what is seen in intervals. It
//! is cut half-way between values that occur, until in each leaf one order of the actions is best
//! at every decision. Where two decisions cannot be told apart, and no order is best at both, the
//! controller sees too little for the best value.
//!
//! Invariant: at each decision the strategy takes the choice that [`Chosen::choices`] has there.

use super::explore::Explored;
use super::process::Process;
use super::solution::Solution;
use crate::cancellation;
use crate::learning::strategy::{Ranked, Rated};

/// Actions whose costs differ by less than this part are as good as each other, if that is needed
/// for one order of them. What it costs is found out afterwards.
const ALIKE: f64 = 1e-10;
/// By so much, as a part of its cost, other actions are worse than the one that is taken.
const WORSE: f64 = 1e-9;
/// For up to so many decisions the cost of every action is kept, for more that of the best.
const ALL_ACTIONS: usize = 100_000;
/// Where more decisions are cut in two, the middle is taken, and not the best cut.
const MOST_COMPARED: usize = 20_000;

/// The strategy, and what it does.
pub(super) struct Chosen {
    /// By exact values.
    pub(super) trees: Vec<(Vec<i32>, Ranked)>,
    /// By place among the decisions: the choice that is taken; none where no strategy ends.
    pub(super) choices: Vec<Option<u32>>,
}

struct Chooser<'e> {
    process: &'e Process,
    solution: &'e Solution,
    decisions: &'e [u32],
    points: &'e [f64],
    /// How many numbers are seen in intervals.
    depth: usize,
    keeps_all: bool,
    choices: Vec<Option<u32>>,
}

/// Finds a strategy for those decisions that count; `None` if too little is seen.
pub(super) fn choose(
    explored: &Explored<'_>,
    solution: &Solution,
    counts: impl Fn(u32) -> bool,
) -> Option<Chosen> {
    let decisions = &explored.decisions;
    let total = decisions.len().max(1);
    let width = explored.keys.len() / total;
    let mut chooser = Chooser {
        process: &explored.process,
        solution,
        decisions,
        points: &explored.points,
        depth: explored.points.len() / total,
        keeps_all: decisions.len() <= ALL_ACTIONS,
        choices: vec![None; decisions.len()],
    };
    let key = |place: u32| &explored.keys[place as usize * width..][..width];
    let mut places: Vec<u32> = (0..decisions.len() as u32)
        .filter(|&place| {
            let node = decisions[place as usize];
            counts(node) && solution.upper[node as usize].is_finite()
        })
        .collect();
    places.sort_by(|&one, &other| key(one).cmp(key(other)));
    let mut trees = Vec::new();
    let mut rest = &mut places[..];
    while let Some(&first) = rest.first() {
        let same = rest.partition_point(|&one| key(one) <= key(first));
        let (group, others) = rest.split_at_mut(same);
        trees.push((key(first).to_vec(), chooser.tree(group)?));
        rest = others;
    }
    Some(Chosen {
        trees,
        choices: chooser.choices,
    })
}

impl Chooser<'_> {
    fn node(&self, place: u32) -> u32 {
        self.decisions[place as usize]
    }

    fn policy(&self, place: u32) -> usize {
        self.solution.policy[self.node(place) as usize] as usize
    }

    /// The action that is best at a decision.
    fn best(&self, place: u32) -> u32 {
        self.process.labels[self.policy(place)]
    }

    fn seen(&self, place: u32, feature: usize) -> f64 {
        self.points[place as usize * self.depth + feature]
    }

    /// The tree of some decisions; `None` if it cannot be cut any more, but must.
    fn tree(&mut self, places: &mut [u32]) -> Option<Ranked> {
        cancellation::work(places.len());
        if let Some(leaf) = self.leaf(places) {
            return Some(Ranked::Cell(leaf));
        }
        let (feature, bound) = self.cut(places)?;
        places.sort_by(|&one, &other| {
            let (one, other) = (self.seen(one, feature), self.seen(other, feature));
            one.total_cmp(&other)
        });
        let low = places.partition_point(|&one| self.seen(one, feature) <= bound);
        let (low, high) = places.split_at_mut(low);
        let parts = Box::new([self.tree(low)?, self.tree(high)?]);
        Some(Ranked::Cut {
            feature: feature as u32,
            bound,
            parts,
        })
    }

    /// By action: by how much it is worse than the best one at these decisions, at most; the best
    /// actions first.
    fn regrets(&self, places: &[u32]) -> Vec<(f64, u32)> {
        let mut regrets: Vec<(f64, u32)> = Vec::new();
        for &place in places {
            let policy = self.policy(place);
            let least = self.total(policy);
            for choice in self.process.choices(self.node(place)) {
                let slack = ALIKE * least.abs().max(1.0);
                let regret = (self.total(choice) - least).max(0.0);
                let is_alike = regret <= slack && places.len() > 1;
                let regret = if choice == policy || is_alike {
                    0.0
                } else {
                    regret.max(WORSE * least.abs().max(1.0))
                };
                let label = self.process.labels[choice];
                match regrets.iter_mut().find(|one| one.1 == label) {
                    Some(known) => known.0 = known.0.max(regret),
                    None => regrets.push((regret, label)),
                }
            }
        }
        regrets.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        regrets
    }

    /// One order of the actions that is best at all of these decisions, if there is one.
    fn leaf(&mut self, places: &[u32]) -> Option<Vec<Rated>> {
        let regrets = self.regrets(places);
        let rank = |label: u32| regrets.iter().position(|one| one.1 == label);
        let mut taken = Vec::with_capacity(places.len());
        for &place in places {
            let choices = self.process.choices(self.node(place));
            let first = choices.min_by_key(|&choice| rank(self.process.labels[choice]))?;
            let least = self.total(self.policy(place));
            let slack = if places.len() > 1 { ALIKE } else { 0.0 };
            let is_best = first == self.policy(place)
                || self.total(first) - least <= slack * least.abs().max(1.0);
            if !is_best {
                return None;
            }
            taken.push(first as u32);
        }
        let mean = places.iter().map(|&one| self.total(self.policy(one)));
        let mean = mean.sum::<f64>() / places.len() as f64;
        let mut rated: Vec<Rated> = Vec::with_capacity(regrets.len());
        for &(regret, action) in &regrets {
            let is_taken = || {
                let mut taken = taken.iter();
                taken.any(|&choice| self.process.labels[choice as usize] == action)
            };
            if !self.keeps_all && !is_taken() {
                continue;
            }
            let before = rated.last().map_or(f64::NEG_INFINITY, |one| one.cost);
            let cost = mean + regret;
            let cost = if cost > before {
                cost
            } else {
                before + WORSE * before.abs().max(1.0)
            };
            rated.push(Rated {
                action,
                cost,
                visits: places.len() as f64,
            });
        }
        rated.sort_by_key(|one| one.action);
        for (&place, choice) in places.iter().zip(taken) {
            self.choices[place as usize] = Some(choice);
        }
        Some(rated)
    }

    fn total(&self, choice: usize) -> f64 {
        self.process.total(choice, &self.solution.upper)
    }

    /// Where some decisions are cut in two.
    fn cut(&self, places: &[u32]) -> Option<(usize, f64)> {
        let is_small = places.len() <= MOST_COMPARED;
        let mut found: Option<(f64, usize, f64)> = None;
        for feature in 0..self.depth {
            let mut values: Vec<(f64, u32)> = places
                .iter()
                .map(|&one| (self.seen(one, feature), self.best(one)))
                .collect();
            values.sort_by(|one, other| one.0.total_cmp(&other.0));
            let cut = if is_small {
                purest(&values)
            } else {
                middle(&values)
            };
            if let Some((score, bound)) = cut
                && found.is_none_or(|(best, ..)| score < best)
            {
                found = Some((score, feature, bound));
            }
        }
        found.map(|(_, feature, bound)| (feature, bound))
    }
}

/// A number between two others: half-way, so that rounding decides nothing.
fn between(low: f64, high: f64) -> f64 {
    let half = low + (high - low) / 2.0;
    if half < high { half } else { low }
}

/// The cut behind which fewest decisions take another action than most do on their side, with how
/// many that are.
fn purest(values: &[(f64, u32)]) -> Option<(f64, f64)> {
    use std::collections::BTreeMap;
    let mut above: BTreeMap<u32, u32> = BTreeMap::new();
    for one in values {
        *above.entry(one.1).or_default() += 1;
    }
    let mut below: BTreeMap<u32, u32> = BTreeMap::new();
    let mut found: Option<(f64, f64)> = None;
    // The Gini index of both sides.
    let impurity = |side: &BTreeMap<u32, u32>| {
        let all: u32 = side.values().sum();
        let squares: f64 = side.values().map(|&one| f64::from(one).powi(2)).sum();
        f64::from(all) - squares / f64::from(all)
    };
    for pair in values.windows(2) {
        let (one, next) = (pair[0], pair[1]);
        *below.entry(one.1).or_default() += 1;
        if let Some(count) = above.get_mut(&one.1) {
            *count -= 1;
        }
        if one.0 < next.0 {
            let score = impurity(&below) + impurity(&above);
            if found.is_none_or(|(best, _)| score < best) {
                found = Some((score, between(one.0, next.0)));
            }
        }
    }
    found
}

/// The cut that is nearest to the middle; of several features that in which the parts are most
/// alike counts.
fn middle(values: &[(f64, u32)]) -> Option<(f64, f64)> {
    let half = values.len() / 2;
    let middle = values[half].0;
    let low = values.partition_point(|one| one.0 < middle);
    let high = values.partition_point(|one| one.0 <= middle);
    let low_distance = (low > 0).then(|| half - low);
    let high_distance = (high < values.len()).then(|| high - half);
    let place = match (low_distance, high_distance) {
        (Some(one), Some(other)) if one <= other => low,
        (_, Some(_)) => high,
        (Some(_), None) => low,
        (None, None) => return None,
    };
    let score = values.len().abs_diff(2 * place);
    Some((score as f64, between(values[place - 1].0, values[place].0)))
}
