//! Queries under a strategy: random strategies, right or wrong, against the closed loop of regions.
//!
//! The explicit side follows the definition: the first decision that applies counts, or all, and
//! where there is none, everything is allowed. From a region in which waiting is allowed, time
//! passes to the next; from others only if time led there without a first moment, and within the
//! same decision.

use std::collections::HashMap;

use checker::engine::format::strategy_json;
use checker::engine::{NamedStrategy, Verdict};
use checker::game::Player;
use checker::game::strategy::{Decision, Selection, Start, Strategy, StrategyState};
use checker::ir;
use checker::network::Part;
use checker::verify::regions::Bounding;
use checker::verify::{Regions, Semantics, State};
use checker::zones::dbm::Constraint;
use checker::zones::{Bound, Federation, Zone};
use proptest::prop_assert_eq;
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::{self, Graph};
use crate::generate::{self, Formula, Network, Shape};
use crate::random::Random;

const SHAPE: Shape = Shape {
    clocks: 2,
    constant: 3,
    strict_invariants: true,
    uncontrollable: true,
    deadlock: true,
    priorities: false,
    guarded_urgency: false,
    legs: false,
};

/// Regions that brute force explores before it gives a case up.
const MOST_REGIONS: usize = 3_000;

/// What random strategies are made of.
impl Random {
    fn constraint(&mut self, dimension: usize) -> Constraint {
        let value = self.below(4) as i32;
        let is_upper = self.chance(50);
        let value = if is_upper { value } else { -value };
        let bound = if self.chance(50) {
            Bound::weak(value)
        } else {
            Bound::strict(value)
        };
        let clock = 1 + self.below(dimension - 1);
        let other = if dimension > 2 && self.chance(15) {
            3 - clock
        } else {
            0
        };
        let (left, right) = if is_upper {
            (clock, other)
        } else {
            (other, clock)
        };
        Constraint {
            left,
            right,
            bound: bound.expect("the constant is small"),
        }
    }

    fn zones(&mut self, dimension: usize) -> Federation {
        let mut zones = Federation::empty(dimension);
        for _ in 0..=self.below(2) {
            let constraints: Vec<_> = (0..self.below(3))
                .map(|_| self.constraint(dimension))
                .collect();
            zones.add(Zone::of_constraints(dimension, &constraints).bounds());
        }
        zones
    }

    /// Decisions for some of the given words, each with the moves that the owner has there.
    pub(crate) fn strategy(
        &mut self,
        owner: Player,
        words: &[(Vec<i32>, Vec<Vec<Part>>)],
        dimension: usize,
    ) -> Strategy {
        let mut strategy = Strategy {
            owner,
            selection: if self.chance(50) {
                Selection::First
            } else {
                Selection::Any
            },
            time_limit: None,
            under: None,
            start: Start::Initial,
            states: Vec::new(),
        };
        for (words, moves) in words {
            if self.chance(20) {
                continue;
            }
            let decisions = (0..=self.below(3)).map(|rank| Decision {
                zones: self.zones(dimension),
                action: (!moves.is_empty() && self.chance(60))
                    .then(|| moves[self.below(moves.len())].clone()),
                rank: rank as u32,
            });
            strategy.states.push(StrategyState {
                words: words.clone(),
                decisions: decisions.collect(),
                legs: Vec::new(),
                is_goal: self.chance(5),
            });
        }
        strategy
    }

    /// Legs of the moves of the controller, for some states of a strategy of the environment.
    fn pick_legs(
        &mut self,
        strategy: &mut Strategy,
        words: &[(Vec<i32>, Vec<Vec<Part>>)],
        dimension: usize,
    ) {
        for state in &mut strategy.states {
            let moves = words.iter().find(|one| one.0 == state.words);
            let Some((_, moves)) = moves.filter(|one| !one.1.is_empty()) else {
                continue;
            };
            let legs = (0..self.below(4)).map(|rank| Decision {
                zones: self.zones(dimension),
                action: Some(moves[self.below(moves.len())].clone()),
                rank: rank as u32,
            });
            state.legs = legs.collect();
        }
    }
}

/// What the strategy says in a state: the decisions that count; `None` is nothing, so that
/// everything is allowed. Then whose strategy it is, and the legs that apply, in order.
pub(crate) struct Said<'s>(
    Option<Vec<Counting<'s>>>,
    Player,
    Vec<&'s [Part]>,
    &'s ir::Network,
);

/// A decision by its index, with what it does.
type Counting<'s> = (usize, &'s Option<Vec<Part>>);

impl<'s> Said<'s> {
    pub(crate) fn new(
        network: &'s ir::Network,
        strategy: &'s Strategy,
        state: &State,
        ticks: i64,
    ) -> Said<'s> {
        let same = |one: &&StrategyState| one.words == state.words;
        let Some(known) = strategy.states.iter().find(same).filter(|one| !one.is_goal) else {
            return Said(None, strategy.owner, Vec::new(), network);
        };
        let legs = known.legs.iter();
        let legs = legs.filter(|one| one.zones.contains(&state.clocks, ticks));
        let legs = legs.filter_map(|one| one.action.as_deref()).collect();
        let decisions = known.decisions.iter().enumerate();
        let counting = decisions.filter(|one| one.1.zones.contains(&state.clocks, ticks));
        let counting = counting.map(|(index, one)| (index, &one.action));
        let counting: Vec<_> = match strategy.selection {
            Selection::First => counting.take(1).collect(),
            Selection::Any => counting.collect(),
        };
        let counting = (!counting.is_empty()).then_some(counting);
        Said(counting, strategy.owner, legs, network)
    }

    fn entry(&self, parts: &[Part]) -> explicit::Entry {
        explicit::entry(self.3, parts)
    }

    pub(crate) fn allows_waiting(&self) -> bool {
        let mut counting = self.0.iter().flatten();
        self.0.is_none() || counting.any(|one| one.1.is_none())
    }

    pub(crate) fn allows(&self, parts: &[Part]) -> bool {
        let mut counting = self.0.iter().flatten();
        let is_it = |action: &[Part]| match self.1 {
            Player::Controller => self.entry(action) == self.entry(parts),
            Player::Environment => action == parts,
        };
        self.0.is_none() || counting.any(|one| one.1.as_deref().is_some_and(is_it))
    }

    /// Whether a move of the other player is the one that is picked of those with the same edges.
    fn picks(&self, parts: &[Part]) -> bool {
        let mut legs = self.2.iter();
        legs.find(|leg| self.entry(leg) == self.entry(parts))
            .is_none_or(|leg| *leg == parts)
    }

    /// The decisions that act.
    fn acting(&self) -> Vec<usize> {
        let counting = self.0.iter().flatten();
        counting
            .filter(|one| one.1.is_some())
            .map(|one| one.0)
            .collect()
    }
}

/// A region of the closed loop. There are more nodes of it if time led into acting decisions
/// without a first moment, and runs in them.
struct Node {
    state: State,
    steps: Vec<usize>,
    later: Option<usize>,
    /// The same region when time does not run in it.
    at_rest: usize,
}

struct Loop {
    nodes: Vec<Node>,
    ticks: i64,
}

#[derive(Default)]
struct Known {
    /// A state, and the decisions in which time runs; none if it does not.
    index: HashMap<(State, Vec<usize>), usize>,
    states: Vec<(State, Vec<usize>)>,
}

impl Known {
    fn id(&mut self, state: State, running: Vec<usize>) -> usize {
        let next = self.states.len();
        let states = &mut self.states;
        *self
            .index
            .entry((state, running))
            .or_insert_with_key(|key| {
                states.push(key.clone());
                next
            })
    }
}

/// Whether a delay, however short, leaves the region.
fn is_boundary(regions: &Regions, state: &State, ticks: i64) -> bool {
    state.clocks[1..].iter().any(|clock| {
        let is_told_apart = match regions.bounding() {
            Bounding::Values(constant) => *clock <= constant * ticks,
            Bounding::Gaps(_) | Bounding::Nothing => true,
        };
        is_told_apart && clock % ticks == 0
    })
}

/// The closed loop; `None` if it is too large.
fn close(semantics: &Semantics<'_>, regions: &Regions, strategy: &Strategy) -> Option<Loop> {
    let ticks = semantics.ticks_per_unit();
    let mut known = Known::default();
    let mut initial = semantics.initial().ok()?;
    regions.represent_state(&mut initial);
    known.id(initial, Vec::new());
    let mut nodes = Vec::new();
    while nodes.len() < known.states.len() {
        if known.states.len() > MOST_REGIONS {
            return None;
        }
        let (state, running) = known.states[nodes.len()].clone();
        let now = Said::new(semantics.network(), strategy, &state, ticks);
        let moves = semantics.moves(&state).ok()?;
        let mut steps = Vec::new();
        for one in &moves {
            let is_allowed = if strategy.owner.owns(one.controllable) {
                now.allows(&one.parts)
            } else {
                now.picks(&one.parts)
            };
            if !is_allowed {
                continue;
            }
            if let Some(mut target) = semantics.take(&state, &one.parts).ok()? {
                regions.represent_state(&mut target);
                steps.push(known.id(target, Vec::new()));
            }
        }
        let mut next = state.clone();
        let has_next = regions.pass(&mut next.clocks);
        let is_stopped =
            semantics.is_time_stopped(&state, &moves) || !semantics.invariants_hold(&next).ok()?;
        let then = Said::new(semantics.network(), strategy, &next, ticks);
        let later = if is_stopped {
            None
        } else if now.allows_waiting() {
            // Into an open region there is no first moment.
            let is_running = !then.allows_waiting() && is_boundary(regions, &state, ticks);
            let running = if is_running {
                then.acting()
            } else {
                Vec::new()
            };
            Some(known.id(next, running))
        } else {
            let mut running = running;
            running.retain(|one| !then.allows_waiting() && then.acting().contains(one));
            (has_next && !running.is_empty()).then(|| known.id(next, running))
        };
        nodes.push(Node {
            at_rest: known.id(state.clone(), Vec::new()),
            state,
            steps,
            later,
        });
    }
    Some(Loop { nodes, ticks })
}

impl Loop {
    fn is_deadlock(&self, node: usize) -> bool {
        explicit::is_deadlock(self.nodes[node].at_rest, |node| {
            let node = &self.nodes[node];
            (!node.steps.is_empty(), node.later)
        })
    }

    fn labels(&self, network: &Network, formula: &Formula) -> Vec<bool> {
        let nodes = self.nodes.iter().enumerate();
        nodes
            .map(|(index, node)| {
                let State { words, clocks, .. } = &node.state;
                let deadlock = || self.is_deadlock(index);
                network.holds(formula, words, clocks, self.ticks, &deadlock)
            })
            .collect()
    }

    /// The nodes from which some run never leaves `keep`. Where time runs in an acting decision, it
    /// does not do so for ever.
    fn staying(&self, keep: &[bool]) -> Vec<bool> {
        let mut staying = keep.to_vec();
        loop {
            let mut found = vec![false; self.nodes.len()];
            let mut grows = true;
            while grows {
                grows = false;
                for (index, node) in self.nodes.iter().enumerate().rev() {
                    let goes_on = self.is_stuck(node.at_rest)
                        || node.steps.iter().any(|&next| staying[next])
                        || node.later.is_some_and(|next| {
                            if node.at_rest == index {
                                staying[next]
                            } else {
                                found[next]
                            }
                        });
                    if keep[index] && goes_on && !found[index] {
                        found[index] = true;
                        grows = true;
                    }
                }
            }
            if found == staying {
                return staying;
            }
            staying = found;
        }
    }

    fn is_stuck(&self, node: usize) -> bool {
        self.nodes[node].steps.is_empty() && self.nodes[node].later.is_none()
    }
}

/// The words of the nodes, each with the moves that a player may have there.
pub(crate) fn own_moves(
    semantics: &Semantics<'_>,
    graph: &Graph,
    owner: Player,
) -> Vec<(Vec<i32>, Vec<Vec<Part>>)> {
    let mut words: Vec<(Vec<i32>, Vec<Vec<Part>>)> = Vec::new();
    for node in &graph.nodes {
        let moves = semantics.moves(&node.state).unwrap_or_default();
        let own = moves.iter().filter(|one| owner.owns(one.controllable));
        let own = own.map(|one| one.parts.clone());
        let index = words.iter().position(|one| one.0 == node.state.words);
        let index = index.unwrap_or_else(|| {
            words.push((node.state.words.clone(), Vec::new()));
            words.len() - 1
        });
        for parts in own {
            if !words[index].1.contains(&parts) {
                words[index].1.push(parts);
            }
        }
    }
    words
}

fn compare(
    (network, p, q, seed): &(Network, Formula, Formula, u64),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let features = &model.network().features;
    let has_deadlock = generate::has_deadlock(p) || generate::has_deadlock(q);
    if features.clock_guarded_urgent || features.priorities {
        return Ok(());
    }
    let Ok(Some(graph)) = compare::regions(&model, i64::from(SHAPE.constant), true, tally) else {
        return Ok(());
    };
    let dimension = model.network().clocks.len().max(1);
    let ir = model.network().clone();
    let semantics = Semantics::new(&ir, Regions::ticks_per_unit(&ir));
    let mut random = Random(seed | 1);
    let owner = if random.chance(70) {
        Player::Controller
    } else {
        Player::Environment
    };
    let words = own_moves(&semantics, &graph, owner);
    let mut strategy = random.strategy(owner, &words, dimension);
    if owner == Player::Environment {
        let others = own_moves(&semantics, &graph, Player::Controller);
        random.pick_legs(&mut strategy, &others, dimension);
    }
    let regions = Regions::new(&ir, i64::from(SHAPE.constant), true);
    let regions = regions.expect("the networks have no stopwatches");
    let Some(closed) = close(&semantics, &regions, &strategy) else {
        return Ok(());
    };
    let states = strategy_json::text(&ir, &strategy, "");
    let read = strategy_json::read(&ir, states.as_bytes());
    let read = read.map(|(query, strategy)| strategy_json::text(&ir, &strategy, &query));
    prop_assert_eq!(read.as_ref(), Ok(&states), "{}", text);
    let description = format!("{text}\n{states}");
    model.keep_strategy(NamedStrategy::new(
        "S".to_owned(),
        String::new(),
        Some(std::sync::Arc::new(strategy)),
    ));
    let (p_holds, q_holds) = (closed.labels(network, p), closed.labels(network, q));
    let without: Vec<bool> = q_holds.iter().map(|holds| !holds).collect();
    let avoiding = closed.staying(&without);
    let (p, q) = (network.formula(p), network.formula(q));
    let unanswered = |node: usize| p_holds[node] && avoiding[node];
    let mut queries = vec![
        (format!("E<> {p}"), p_holds.contains(&true)),
        (format!("A[] {q}"), !without.contains(&true)),
    ];
    if !has_deadlock {
        let staying = closed.staying(&p_holds);
        queries.extend([
            (format!("E[] {p}"), staying[0]),
            (format!("A<> {q}"), !avoiding[0]),
            (
                format!("{p} --> {q}"),
                !(0..closed.nodes.len()).any(unanswered),
            ),
        ]);
    }
    for (query, expected) in queries {
        let answer = try_ask(&mut model, &format!("{query} under S"), &compare::options());
        if query.contains("-->")
            && answer
                .as_ref()
                .is_ok_and(|one| one.verdict == Verdict::Maybe)
        {
            continue;
        }
        compare::check(&answer, Ok(expected), tally, || {
            format!("{description}\n{query} under S")
        })?;
    }
    Ok(())
}

#[test]
fn queries_under_a_strategy_equal_brute_force() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
        proptest::num::u64::ANY,
    );
    compare::run("closed loops", 300, &strategy, compare);
}
