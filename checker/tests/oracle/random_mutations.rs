//! Strategies of random games, made wrong at random: the check in closed loop must come to what a
//! fixpoint over the graph of regions comes to, and those that lose by it are caught. Those of `E<>
//! control:` have to win after a way, or from everywhere; those of `control_t*` are about a graph
//! with a clock of its own that nothing resets.

use checker::engine::evidence::strategy_check;
use checker::engine::evidence::strategy_check::Played;
use checker::engine::{LoadedModel, Options, Rules};
use checker::game::strategy::{Selection, Start, Way};
use checker::game::{Forced, Player, Priorities};
use checker::ir;
use checker::syntax::ast::QueryText;
use checker::verify::strategy::{Constraint, Decision, Decisions, Outcome};
use checker::verify::timed::Timed;
use checker::verify::{Effort, Part, Regions, Semantics};
use proptest::test_runner::TestCaseError;
use proptest::{prop_assert, prop_assert_eq};

use crate::checks::load;
use crate::compare::{self, Tally};
use crate::explicit::{Graph, Node, Rule, Step, entry, is_forced};
use crate::games::{Kind, RULES, SHAPE, labels, objectives, seeded_games};
use crate::generate::{Formula, Network};
use crate::random::Random;

/// A strategy on the graph of regions, with what is asked.
struct Closed<'a> {
    graph: &'a Graph,
    decisions: &'a [Decisions],
    owner: Player,
    is_permissive: bool,
    kind: Kind,
    goal: &'a [bool],
    keep: &'a [bool],
    rule: Rule,
}

/// What a region comes to by itself.
enum Said {
    /// The owner has won, or lost.
    Over(bool),
    /// It hangs on all of these.
    Goes(Vec<usize>),
}

impl Closed<'_> {
    fn known(&self, node: &Node) -> Option<&Decisions> {
        let mut known = self.decisions.iter();
        known.find(|one| one.words == node.state.words)
    }

    fn applies(&self, node: &Node, decision: &Decision) -> bool {
        let ticks = self.graph.ticks;
        let holds = |one: &Constraint| {
            let difference = node.state.clocks[one.left] - node.state.clocks[one.right];
            let bound = i64::from(one.bound) * ticks;
            difference < bound || !one.strict && difference == bound
        };
        decision.zones.iter().any(|zone| zone.iter().all(holds))
    }

    fn applying(&self, node: &Node) -> Vec<&Decision> {
        let all = self.known(node).into_iter().flat_map(|one| &one.decisions);
        let applying = all.filter(|one| self.applies(node, one));
        let most = if self.is_permissive { usize::MAX } else { 1 };
        applying.take(most).collect()
    }

    /// The leg that the environment picks of those that a move of the controller may take.
    fn picked(&self, node: &Node, step: &Step) -> Option<&[Part]> {
        let mut legs = self.known(node).into_iter().flat_map(|one| &one.legs);
        let leg = legs.find(|leg| {
            let parts = leg.action.as_deref().unwrap_or_default();
            entry(&self.graph.network, parts) == step.entry && self.applies(node, leg)
        });
        leg.and_then(|leg| leg.action.as_deref())
    }

    fn says(&self, index: usize) -> Said {
        let node = &self.graph.nodes[index];
        let controller = self.owner == Player::Controller;
        if self.kind != Kind::Recur && self.goal[index] {
            return Said::Over(controller);
        }
        if !self.keep[index] {
            return Said::Over(!controller);
        }
        let decisions = self.applying(node);
        let mut targets = Vec::new();
        let mut is_first = false;
        for action in decisions.iter().filter_map(|one| one.action.as_ref()) {
            let own = node
                .steps
                .iter()
                .filter(|one| self.owner.owns(one.controllable));
            let meant = own.filter(|one| {
                one.parts == *action
                    || controller && one.entry == entry(&self.graph.network, action)
            });
            let before = targets.len();
            targets.extend(meant.map(|one| one.target));
            if targets.len() == before {
                return Said::Over(false);
            }
            is_first = !controller;
        }
        if !is_first {
            let others: Vec<&Step> = node
                .steps
                .iter()
                .filter(|one| !self.owner.owns(one.controllable))
                .collect();
            for step in &others {
                match self.picked(node, step).filter(|_| !controller) {
                    Some(leg) if !others.iter().any(|one| one.parts == leg) => {
                        return Said::Over(false);
                    }
                    Some(leg) if leg != step.parts => {}
                    _ => targets.push(step.target),
                }
            }
        }
        if decisions.iter().any(|one| one.action.is_none()) {
            match node.later {
                Some(later) => targets.push(later),
                None if self.may_rest(index) => {}
                None => return Said::Over(false),
            }
        } else if decisions.is_empty() {
            return Said::Over(false);
        }
        Said::Goes(targets)
    }

    /// Whether the owner may wait where time cannot pass.
    fn may_rest(&self, index: usize) -> bool {
        let node = &self.graph.nodes[index];
        let (own, others): (Vec<&Step>, Vec<&Step>) =
            node.steps.iter().partition(|step| step.controllable);
        let controller = self.owner == Player::Controller;
        let has_to_keep = match self.kind {
            Kind::Safe | Kind::WeakUntil => true,
            Kind::Recur => self.goal[index],
            Kind::Reach | Kind::Until => false,
        };
        if !others.is_empty() && is_forced(&node.stoppers, &own, self.rule) {
            return controller;
        }
        // Play stops, unless the controller has to move.
        controller == (has_to_keep && own.is_empty())
    }

    /// By region: whether the owner wins from it.
    fn wins(&self) -> Vec<bool> {
        let says: Vec<Said> = (0..self.graph.nodes.len())
            .map(|one| self.says(one))
            .collect();
        let step = |node: usize, inner: &[bool], outer: &[bool]| match &says[node] {
            Said::Over(wins) => *wins,
            Said::Goes(targets) => {
                let set = if self.kind == Kind::Recur && self.goal[node] {
                    outer
                } else {
                    inner
                };
                targets.iter().all(|&target| set[target])
            }
        };
        let fixpoint = |start: bool, outer: &[bool]| {
            let mut set = vec![start; says.len()];
            loop {
                let next: Vec<bool> = (0..says.len())
                    .map(|node| step(node, &set, outer))
                    .collect();
                if next == set {
                    return set;
                }
                set = next;
            }
        };
        let controller = self.owner == Player::Controller;
        if self.kind != Kind::Recur {
            let has_to_reach = matches!(self.kind, Kind::Reach | Kind::Until);
            return fixpoint(controller != has_to_reach, &[]);
        }
        // The controller gets from every goal to another one; the environment sees only finitely
        // many.
        let mut outer = vec![controller; says.len()];
        loop {
            let next = fixpoint(!controller, &outer);
            if next == outer {
                return outer;
            }
            outer = next;
        }
    }
}

/// Makes some decisions of a strategy wrong.
fn mutate(decisions: &mut [Decisions], random: &mut Random) {
    let actions: Vec<_> = decisions
        .iter()
        .flat_map(|state| state.decisions.iter().map(|one| one.action.clone()))
        .collect();
    if actions.is_empty() {
        return;
    }
    for _ in 0..=random.below(2) {
        let state = random.below(decisions.len());
        let has_legs = !decisions[state].legs.is_empty();
        let here = if has_legs && random.chance(30) {
            &mut decisions[state].legs
        } else {
            &mut decisions[state].decisions
        };
        if here.is_empty() {
            continue;
        }
        let index = random.below(here.len());
        match random.below(6) {
            0 => drop(here.remove(index)),
            1 => here[index].action = None,
            2 => here[index]
                .action
                .clone_from(&actions[random.below(actions.len())]),
            3 => {
                let mut widened = here.remove(index);
                widened.zones = vec![Vec::new()];
                here.insert(0, widened);
            }
            4 => here.rotate_left(1),
            _ => {
                let mut constraints: Vec<_> = here[index].zones.iter_mut().flatten().collect();
                if !constraints.is_empty() {
                    let which = random.below(constraints.len());
                    let strict = constraints[which].strict;
                    constraints[which].strict = !strict;
                    constraints[which].bound += random.below(3) as i32 - 1;
                }
            }
        }
    }
}

/// The region that a way leads to.
fn end_of(network: &ir::Network, graph: &Graph, constant: i64, way: &Way) -> Option<usize> {
    let semantics = Semantics::new(network, way.ticks_per_unit);
    let mut state = semantics.initial().ok()?;
    for (wait, parts) in &way.moves {
        state = semantics.after(&state, *wait).ok()?;
        state = semantics.take(&state, parts).ok()??;
    }
    let end = Timed {
        state: semantics.after(&state, way.wait).ok()?,
        ticks_per_unit: way.ticks_per_unit,
    };
    let Timed {
        mut state,
        ticks_per_unit,
    } = end.at_multiple_of(graph.ticks)?;
    let regions = Regions::new(network, constant, true).ok()?;
    let regions = regions.with_ticks_per_unit(ticks_per_unit);
    regions.represent_state(&mut state);
    graph.nodes.iter().position(|node| {
        let mut one = node.state.clone();
        for clock in &mut one.clocks {
            *clock *= ticks_per_unit / graph.ticks;
        }
        regions.represent_state(&mut one);
        one == state
    })
}

/// A graph of regions with what is asked of it.
struct Game<'a> {
    graph: &'a Graph,
    /// Values of clocks that its regions tell apart.
    constant: i64,
    kind: Kind,
    goal: Vec<bool>,
    keep: Vec<bool>,
}

/// Compares the check of the strategy of a query, as it is and made wrong, with the fixpoint on the
/// game that fits its time limit.
fn compare_query<'g>(
    model: &mut LoadedModel,
    (query, (rule, forced)): (&QueryText, (Rule, Forced)),
    game: impl Fn(Option<i32>) -> Option<Game<'g>>,
    random: &mut Random,
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let options = Options {
        priorities: Priorities::Kept,
        forced,
        strategy: true,
        ..compare::options()
    };
    let answer = model.check(query, &options);
    let Some(strategy) = answer.ok().and_then(|answer| answer.evidence.strategy) else {
        return Ok(());
    };
    let Some(game) = game(strategy.time_limit) else {
        return Ok(());
    };
    let start = match &strategy.start {
        Start::Initial => Some(0),
        Start::Anywhere => None,
        Start::After(way) => {
            let end = end_of(model.network(), game.graph, game.constant, way);
            prop_assert!(end.is_some(), "{}: the way is not possible", query.text);
            end
        }
    };
    for round in 0..4 {
        let mut decisions = strategy_check::decisions(model.network(), &strategy);
        if round > 0 {
            mutate(&mut decisions, random);
        }
        let closed = Closed {
            graph: game.graph,
            decisions: &decisions,
            owner: strategy.owner,
            is_permissive: strategy.selection == Selection::Any,
            kind: game.kind,
            goal: &game.goal,
            keep: &game.keep,
            rule,
        };
        let wins = closed.wins();
        let expected = match start {
            Some(start) => wins[start],
            None => !wins.contains(&false),
        };
        let played = Played::new(&strategy, &decisions);
        let rules = Rules {
            forced,
            priorities: Priorities::Kept,
        };
        let result = model.verify_strategy(query, played, rules, &mut Effort::up_to(100_000));
        let holds = match result.expect("the query is right") {
            Ok(Outcome::Verified(_)) => true,
            Ok(Outcome::Violated(..)) => false,
            Ok(Outcome::GivenUp(..)) | Err(_) => continue,
        };
        tally.count(holds);
        prop_assert_eq!(
            holds,
            expected,
            "{} {:?} {:?} {:?}\n{:#?}",
            query.text,
            forced,
            strategy.owner,
            strategy.start,
            decisions
        );
    }
    Ok(())
}

/// The constant of the regions: mutations move bounds by one.
const CONSTANT: i64 = SHAPE.constant as i64 + 1;

fn compare(
    (network, goal, keep, seed): &(Network, Formula, Formula, u64),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let Ok(Some(graph)) = compare::regions(&model, CONSTANT, true, tally) else {
        return Ok(());
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let mut random = Random(seed | 1);
    let all = vec![true; graph.nodes.len()];
    let none = vec![false; graph.nodes.len()];
    let (goals, kept) = (labels(network, goal, &graph), labels(network, keep, &graph));
    for (query, kind) in objectives(&goal_text, &keep_text) {
        let (goal, keep) = match kind {
            Kind::Reach => (&goals, &all),
            Kind::Safe => (&none, &kept),
            Kind::Until | Kind::WeakUntil | Kind::Recur => (&goals, &kept),
        };
        let rules = RULES[random.below(3)];
        for prefix in ["", "E<> "] {
            let query = model.add_query(&format!("{prefix}{query}"));
            let game = |_: Option<i32>| {
                Some(Game {
                    graph: &graph,
                    constant: CONSTANT,
                    kind,
                    goal: goal.clone(),
                    keep: keep.clone(),
                })
            };
            compare_query(&mut model, (&query, rules), game, &mut random, tally)
                .map_err(|error| TestCaseError::fail(format!("{text}{error}")))?;
        }
    }
    Ok(())
}

/// Time limits that are compared; more takes too many regions.
const MOST_TIME: i32 = 4;

fn compare_times(
    (network, goal, keep, seed): &(Network, Formula, Formula, u64),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    // The clock of time is the last one.
    let Some(place) = text.rfind("clock x").map(|last| last + "clock x0;\n".len()) else {
        return Ok(());
    };
    let timed = load(&format!("{}clock t;\n{}", &text[..place], &text[place..]));
    let constant = i64::from(MOST_TIME) + 1;
    let graph = compare::regions(&model, CONSTANT, true, tally);
    let graph_of_time = compare::regions(&timed, constant, true, tally);
    let (Ok(Some(graph)), Ok(Some(graph_of_time))) = (graph, graph_of_time) else {
        return Ok(());
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let mut random = Random(seed | 1);
    let game = |limit: Option<i32>| {
        let Some(limit) = limit else {
            return Some(Game {
                graph: &graph,
                constant: CONSTANT,
                kind: Kind::Until,
                goal: labels(network, goal, &graph),
                keep: labels(network, keep, &graph),
            });
        };
        let within = |formula: &Formula| {
            let holds = labels(network, formula, &graph_of_time).into_iter();
            let nodes = holds.zip(&graph_of_time.nodes);
            let most = i64::from(limit) * graph_of_time.ticks;
            let holds = nodes
                .map(|(holds, node)| holds && node.state.clocks.last().is_some_and(|&t| t <= most));
            holds.collect()
        };
        (limit <= MOST_TIME).then(|| Game {
            graph: &graph_of_time,
            constant,
            kind: Kind::Until,
            goal: within(goal),
            keep: within(keep),
        })
    };
    for limit in ["", "(3)", "(1)"] {
        let rules = RULES[random.below(3)];
        let query = format!("control_t*{limit}: A[ {keep_text} U {goal_text} ]");
        let query = model.add_query(&query);
        compare_query(&mut model, (&query, rules), game, &mut random, tally)
            .map_err(|error| TestCaseError::fail(format!("{text}{error}")))?;
    }
    Ok(())
}

#[test]
fn checks_of_mutated_strategies_equal_brute_force() {
    let strategy = seeded_games();
    compare::run("mutated strategies", 120, &strategy, compare);
}

#[test]
fn checks_of_mutated_strategies_within_a_time_equal_brute_force() {
    let strategy = seeded_games();
    let name = "mutated strategies within a time";
    compare::run(name, 60, &strategy, compare_times);
}
