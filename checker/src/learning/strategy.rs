//! A strategy that was learned, or read from a file: for each combination of exact values, and for
//! each action, a tree over the values in intervals, whose leaves say what the action is worth.
//!
//! The controller takes the best of the actions that are possible; of several best ones the first.
//! Where it has never seen the exact values, or none of the actions, it chooses at random.

use std::cmp::Ordering;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::observation::Sight;
use super::partition::{Partition, WAIT};
use super::tree::{self, Node};
use crate::exec::arithmetic::{double_of_words, double_words};
use crate::ir::{Observation, Part, Seen};
use crate::stochastic::{Chooser, Chosen, ControllerMove, Failure, Guidance, Moment, StateView};

/// What an action is worth where the exact values are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Appraisal {
    /// The action: the place of a move, or behind the last one for waiting.
    pub action: u32,
    /// The tree, whose leaves say what it is worth.
    pub tree: Vec<Node<f64>>,
}

/// What is known where the exact values are these.
#[derive(Clone, Debug, PartialEq)]
pub struct Regressor {
    /// The exact values, as words.
    pub key: Vec<i32>,
    /// By action, ascending.
    pub appraisals: Vec<Appraisal>,
}

/// A learned strategy.
#[derive(Clone, Debug)]
pub struct LearnedStrategy {
    /// Whether the greatest value is the best.
    pub is_greatest: bool,
    /// What it sees.
    pub observation: Arc<Observation>,
    /// The moves of the controller. The number of the action to wait is their number.
    pub moves: Vec<Part>,
    /// In the order of the exact values.
    pub regressors: Vec<Regressor>,
}

impl LearnedStrategy {
    /// The strategy that a partition makes; the moves are those of the controller.
    pub fn new(
        partition: &Partition,
        observation: &Arc<Observation>,
        moves: &[ControllerMove],
        is_greatest: bool,
    ) -> LearnedStrategy {
        let trees = (0..partition.observations() as u32)
            .map(|one| (partition.key(one).to_vec(), simplified(partition, one, 0)));
        LearnedStrategy::of_trees(trees, observation, moves, is_greatest)
    }

    /// The strategy of these trees, by exact values.
    pub(super) fn of_trees(
        trees: impl Iterator<Item = (Vec<i32>, Ranked)>,
        observation: &Arc<Observation>,
        moves: &[ControllerMove],
        is_greatest: bool,
    ) -> LearnedStrategy {
        let sign = if is_greatest { -1.0 } else { 1.0 };
        let numbers = trees.filter_map(|(key, tree)| {
            let appraisals = appraisals(&tree, moves, sign);
            (!appraisals.is_empty()).then_some(Regressor { key, appraisals })
        });
        let mut regressors: Vec<Regressor> = numbers.collect();
        regressors.sort_by_cached_key(|one| ranks(observation, &one.key).collect::<Vec<i64>>());
        LearnedStrategy {
            is_greatest,
            observation: Arc::clone(observation),
            moves: moves.iter().map(|one| one.part).collect(),
            regressors,
        }
    }

    /// How many leaves all trees have.
    pub fn leaves(&self) -> usize {
        let trees = self.regressors.iter().flat_map(|one| &one.appraisals);
        trees
            .flat_map(|one| &one.tree)
            .filter(|node| matches!(node, Node::Leaf(_)))
            .count()
    }

    /// The best of the actions that are `enabled`, each by its place, the last one to wait: of
    /// several best ones the first. There is none where it has never seen the exact values, or has
    /// tried none of these actions.
    pub fn decide(
        &self,
        discrete: &[f64],
        continuous: &[f64],
        enabled: impl Fn(u32) -> bool,
    ) -> Option<u32> {
        let key = words(&self.observation, discrete)?;
        let found = self
            .regressors
            .binary_search_by(|one| order(&self.observation, &one.key, &key));
        let known = &self.regressors[found.ok()?].appraisals;
        let options = known.iter().filter(|one| enabled(one.action));
        let options = options.map(|one| Choice {
            place: one.action as usize,
            tree: &one.tree,
        });
        let options: Vec<Choice<'_>> = options.collect();
        best(&options, continuous, self.is_greatest).map(|place| place as u32)
    }
}

/// How exact values are ordered: by the first number that differs.
pub fn order(observation: &Observation, one: &[i32], other: &[i32]) -> Ordering {
    ranks(observation, one).cmp(ranks(observation, other))
}

/// Numbers in whose order exact values are.
fn ranks<'o>(observation: &'o Observation, key: &'o [i32]) -> impl Iterator<Item = i64> + 'o {
    numbers(observation, key).map(in_total_order)
}

/// The words that exact values are; `None` if some feature cannot have its value.
pub fn words(observation: &Observation, values: &[f64]) -> Option<Vec<i32>> {
    let mut words = Vec::with_capacity(observation.words());
    for (feature, &value) in observation.discrete.iter().zip(values) {
        match feature.seen {
            Seen::Location(_) | Seen::Integer(_) => {
                let word = value as i32;
                if f64::from(word).total_cmp(&(value + 0.0)).is_ne() {
                    return None;
                }
                words.push(word);
            }
            // Both zeros are the same.
            _ => words.extend(double_words(value + 0.0)),
        }
    }
    Some(words)
}

/// A number that is as great among others as [`f64::total_cmp`] says.
fn in_total_order(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// The numbers that exact values are.
pub fn values(observation: &Observation, key: &[i32]) -> Vec<f64> {
    numbers(observation, key).collect()
}

fn numbers<'o>(observation: &'o Observation, key: &'o [i32]) -> impl Iterator<Item = f64> + 'o {
    let mut words = key.iter();
    let mut word = move || words.next().copied().unwrap_or(0);
    let features = observation.discrete.iter();
    features.map(move |feature| match feature.seen {
        Seen::Location(_) | Seen::Integer(_) => f64::from(word()),
        Seen::Double(_) | Seen::Clock(_) | Seen::Computed(_) => double_of_words(word(), word()),
    })
}

/// A part of the partition, in which neighbours are one where they rank the actions alike.
pub(super) enum Ranked {
    /// Its actions.
    Cell(Vec<Rated>),
    /// Two parts.
    Cut {
        /// The feature that is compared.
        feature: u32,
        /// The number it is compared with.
        bound: f64,
        /// Where it is not greater, and where it is.
        parts: Box<[Ranked; 2]>,
    },
}

/// An action with its cost.
#[derive(Clone, Copy)]
pub(super) struct Rated {
    pub(super) action: u32,
    pub(super) cost: f64,
    pub(super) visits: f64,
}

fn simplified(partition: &Partition, observation: u32, node: u32) -> Ranked {
    match partition.tree(observation)[node as usize] {
        Node::Leaf(cell) => {
            let known = partition.cells[cell as usize].known.iter();
            let rated = known.map(|one| Rated {
                action: one.action,
                cost: one.value + one.error,
                visits: one.visits,
            });
            Ranked::Cell(rated.collect())
        }
        Node::Cut {
            feature,
            bound,
            low,
            high,
        } => {
            let parts = [low, high].map(|part| simplified(partition, observation, part));
            if let [Ranked::Cell(low), Ranked::Cell(high)] = &parts {
                if low.is_empty() || high.is_empty() {
                    let known = if low.is_empty() { high } else { low };
                    return Ranked::Cell(known.clone());
                }
                if ranking(low) == ranking(high) {
                    return Ranked::Cell(merged(low, high));
                }
            }
            Ranked::Cut {
                feature,
                bound,
                parts: Box::new(parts),
            }
        }
    }
}

/// The actions, the best first.
fn ranking(cell: &[Rated]) -> Vec<u32> {
    let mut order: Vec<&Rated> = cell.iter().collect();
    order.sort_by(|one, other| {
        one.cost
            .total_cmp(&other.cost)
            .then(one.action.cmp(&other.action))
    });
    order.iter().map(|one| one.action).collect()
}

/// The means of the costs in two cells. All actions weigh the same there, so that they rank as in
/// each of them.
fn merged(one: &[Rated], other: &[Rated]) -> Vec<Rated> {
    let visits = |cell: &[Rated]| cell.iter().map(|rated| rated.visits).sum::<f64>();
    let (first, second) = (visits(one), visits(other));
    let share = first / (first + second);
    let pairs = one.iter().zip(other);
    let merged = pairs.map(|(one, other)| Rated {
        action: one.action,
        cost: share * one.cost + (1.0 - share) * other.cost,
        visits: one.visits + other.visits,
    });
    merged.collect()
}

fn appraisals(tree: &Ranked, moves: &[ControllerMove], sign: f64) -> Vec<Appraisal> {
    let mut actions = Vec::new();
    let mut worst = f64::NEG_INFINITY;
    collect(tree, &mut |cell| {
        for rated in cell {
            worst = worst.max(rated.cost);
            if !actions.contains(&rated.action) {
                actions.push(rated.action);
            }
        }
    });
    actions.sort_unstable();
    let appraisals = actions.iter().map(|&action| {
        let place = if action == WAIT {
            moves.len()
        } else {
            let found = moves.binary_search_by_key(&action, |one| one.number);
            found.expect("it is a move of the controller")
        };
        let mut nodes = Vec::new();
        // Where it was never taken, it is worse than anything that was.
        let unknown = worst + worst.abs() + 1.0;
        grow(tree, action, sign, unknown, &mut nodes);
        Appraisal {
            action: place as u32,
            tree: nodes,
        }
    });
    appraisals.collect()
}

fn collect<'t>(tree: &'t Ranked, see: &mut impl FnMut(&'t [Rated])) {
    match tree {
        Ranked::Cell(cell) => see(cell),
        Ranked::Cut { parts, .. } => {
            for part in &**parts {
                collect(part, see);
            }
        }
    }
}

/// Adds the tree of one action; returns its root.
fn grow(tree: &Ranked, action: u32, sign: f64, unknown: f64, nodes: &mut Vec<Node<f64>>) -> u32 {
    let place = nodes.len();
    match tree {
        Ranked::Cell(cell) => {
            let rated = cell.iter().find(|one| one.action == action);
            let cost = rated.map_or(unknown, |one| one.cost);
            // No zero has a sign, so that the text of a file is the same again.
            nodes.push(Node::Leaf(sign * cost + 0.0));
        }
        Ranked::Cut {
            feature,
            bound,
            parts,
        } => {
            nodes.push(Node::Leaf(0.0));
            let low = grow(&parts[0], action, sign, unknown, nodes);
            let high = grow(&parts[1], action, sign, unknown, nodes);
            nodes[place] = match (nodes[low as usize], nodes[high as usize]) {
                (Node::Leaf(one), Node::Leaf(other)) if one.to_bits() == other.to_bits() => {
                    nodes.truncate(place + 1);
                    Node::Leaf(one)
                }
                _ => Node::Cut {
                    feature: *feature,
                    bound: *bound,
                    low,
                    high,
                },
            };
        }
    }
    place as u32
}

/// A strategy, prepared to be followed in random runs of a model.
#[derive(Clone, Debug)]
pub struct Followed {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    strategy: Arc<LearnedStrategy>,
    /// By number of a move: its action.
    actions: FxHashMap<u32, u32>,
    /// By exact values: the place of the regressor.
    regressors: FxHashMap<Box<[i32]>, u32>,
}

impl Followed {
    /// The moves are those that the controller may make in the model.
    pub fn new(strategy: &Arc<LearnedStrategy>, moves: &[ControllerMove]) -> Followed {
        let places = (0..).zip(&strategy.moves);
        let places: FxHashMap<Part, u32> = places.map(|(place, &part)| (part, place)).collect();
        let actions = moves
            .iter()
            .filter_map(|one| Some((one.number, *places.get(&one.part)?)));
        let regressors = (0..).zip(&strategy.regressors);
        Followed {
            inner: Arc::new(Inner {
                strategy: Arc::clone(strategy),
                actions: actions.collect(),
                regressors: regressors
                    .map(|(place, one)| (one.key.as_slice().into(), place))
                    .collect(),
            }),
        }
    }
}

impl Guidance for Followed {
    fn chooser(&self) -> Box<dyn Chooser> {
        Box::new(Follower {
            inner: Arc::clone(&self.inner),
            sight: Sight::default(),
        })
    }
}

struct Follower {
    inner: Arc<Inner>,
    sight: Sight,
}

impl Chooser for Follower {
    fn sees_time(&self) -> bool {
        self.inner.strategy.observation.has_clocks()
    }

    fn choose(&mut self, state: &mut StateView<'_>, moment: Moment<'_>) -> Result<Chosen, Failure> {
        let inner = Arc::clone(&self.inner);
        let strategy = &inner.strategy;
        let sight = &mut self.sight;
        sight.look(&strategy.observation, state)?;
        sight.look_at_rates(&strategy.observation, state);
        let options = inner.options(&sight.key, moment);
        let count = moment.moves.len();
        let Some(place) = best(&options, &sight.point, strategy.is_greatest) else {
            let all = count as u32 + u32::from(moment.may_wait);
            let drawn = state.stream().below(all) as usize;
            return Ok(if drawn < count {
                Chosen::Move(drawn)
            } else {
                Chosen::Draw
            });
        };
        if place < count {
            return Ok(Chosen::Move(place));
        }
        // It waits until another action is the best.
        let (mut waited, mut point) = (0.0, sight.point.clone());
        while best(&options, &point, strategy.is_greatest).is_none_or(|best| best == place) {
            let exits = options
                .iter()
                .map(|one| tree::leaf_and_exit(one.tree, &point, &sight.rates).1);
            waited += exits.fold(f64::INFINITY, f64::min);
            if waited.is_infinite() || !moment.is_straight {
                break;
            }
            for (place, value) in point.iter_mut().enumerate() {
                *value = sight.point[place] + sight.rates[place] * waited;
            }
        }
        Ok(Chosen::Wait(waited))
    }
}

/// An action that is possible, and known.
struct Choice<'t> {
    /// The place of the move among those that are possible; behind them to wait.
    place: usize,
    tree: &'t [Node<f64>],
}

impl Inner {
    /// The possible actions that are known where the exact values are these.
    fn options(&self, key: &[i32], moment: Moment<'_>) -> Vec<Choice<'_>> {
        let Some(&regressor) = self.regressors.get(key) else {
            return Vec::new();
        };
        let known = &self.strategy.regressors[regressor as usize].appraisals;
        let wait = moment.may_wait.then_some(self.strategy.moves.len() as u32);
        let moves = moment.moves.iter();
        let moves = moves.map(|number| self.actions.get(number).copied());
        let possible = moves.chain(wait.map(Some)).enumerate();
        let known = possible.filter_map(|(place, action)| {
            let found = known.iter().find(|one| Some(one.action) == action)?;
            let tree = &found.tree[..];
            Some(Choice { place, tree })
        });
        known.collect()
    }
}

/// The place of the best action; of several best ones the first.
fn best(options: &[Choice<'_>], point: &[f64], is_greatest: bool) -> Option<usize> {
    let sign = if is_greatest { -1.0 } else { 1.0 };
    let mut best: Option<(f64, usize)> = None;
    for Choice { place, tree } in options {
        let cost = sign * tree::leaf(tree, point);
        if best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, *place));
        }
    }
    best.map(|(_, place)| place)
}
