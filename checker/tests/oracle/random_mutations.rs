//! Strategies of random games, made wrong at random: the check in closed loop must come to what a fixpoint over the graph of regions
//! comes to, and those that lose by it are caught.

use checker::engine::verification::{self, Played};
use checker::engine::{LoadedModel, Options};
use checker::game::strategy::Selection;
use checker::game::{Forced, Player, Priorities};
use checker::syntax::ast::QueryText;
use checker::verify::strategy::{Constraint, Decision, Decisions, Outcome};
use proptest::prop_assert_eq;
use proptest::test_runner::TestCaseError;

use crate::closed_loops::Random;
use crate::compare::{self, Tally};
use crate::explicit::{Graph, Node, Rule, Step, is_forced};
use crate::games::{Kind, SHAPE, labels};
use crate::generate::{self, Formula, Network};

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
    fn applying(&self, node: &Node) -> Vec<&Decision> {
        let ticks = self.graph.ticks;
        let holds = |one: &Constraint| {
            let difference = node.state.clocks[one.left] - node.state.clocks[one.right];
            let bound = i64::from(one.bound) * ticks;
            difference < bound || !one.strict && difference == bound
        };
        let mut known = self.decisions.iter();
        let known = known.find(|one| one.words == node.state.words);
        let all = known.into_iter().flat_map(|one| &one.decisions);
        let applying = all.filter(|one| one.zones.iter().any(|zone| zone.iter().all(holds)));
        let most = if self.is_permissive { usize::MAX } else { 1 };
        applying.take(most).collect()
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
            let mut own = node
                .steps
                .iter()
                .filter(|one| self.owner.owns(one.controllable));
            let Some(step) = own.find(|one| one.parts == *action) else {
                return Said::Over(false);
            };
            targets.push(step.target);
            is_first = !controller;
        }
        if !is_first {
            let others = node
                .steps
                .iter()
                .filter(|one| !self.owner.owns(one.controllable));
            targets.extend(others.map(|one| one.target));
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
        if has_to_keep {
            let must_move = !own.is_empty() && others.is_empty();
            return controller != must_move;
        }
        let must_move = !others.is_empty() && is_forced(&node.stoppers, &own, self.rule);
        controller == must_move
    }

    /// Whether the owner wins from the start.
    fn wins(&self) -> bool {
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
            return fixpoint(controller != has_to_reach, &[])[0];
        }
        // The controller gets from every goal to another one; the environment sees only finitely many.
        let mut outer = vec![controller; says.len()];
        loop {
            let next = fixpoint(!controller, &outer);
            if next == outer {
                return outer[0];
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
        let here = &mut decisions[state].decisions;
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

/// Compares the check of the strategy of a query, as it is and made wrong, with the fixpoint.
fn compare_query(
    model: &mut LoadedModel,
    (query, forced): (&QueryText, Forced),
    closed: &Closed<'_>,
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
    for round in 0..4 {
        let mut decisions = verification::decisions(model.network(), &strategy);
        if round > 0 {
            mutate(&mut decisions, random);
        }
        let closed = Closed {
            decisions: &decisions,
            owner: strategy.owner,
            is_permissive: strategy.selection == Selection::Any,
            ..*closed
        };
        let expected = closed.wins();
        let played = Played::new(&strategy, &decisions);
        let rules = (forced, Priorities::Kept);
        let result = model.verify_strategy(query, played, rules, 100_000);
        let holds = match result.expect("the query is right") {
            Ok(Outcome::Verified(_)) => true,
            Ok(Outcome::Violated(..)) => false,
            Ok(Outcome::TooLarge(_)) | Err(_) => continue,
        };
        tally.count(holds);
        prop_assert_eq!(
            holds,
            expected,
            "{} {:?} {:?}\n{:#?}",
            query.text,
            forced,
            strategy.owner,
            decisions
        );
    }
    Ok(())
}

fn compare(
    (network, goal, keep, seed): &(Network, Formula, Formula, u64),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = compare::load(&text);
    // Mutations move bounds by one.
    let Ok(Some(graph)) = compare::regions(&model, i64::from(SHAPE.constant) + 1, true, tally)
    else {
        return Ok(());
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let mut random = Random(seed | 1);
    let all = vec![true; graph.nodes.len()];
    let none = vec![false; graph.nodes.len()];
    let (goals, kept) = (labels(network, goal, &graph), labels(network, keep, &graph));
    for (query, kind, goal, keep) in [
        (
            format!("control: A<> {goal_text}"),
            Kind::Reach,
            &goals,
            &all,
        ),
        (
            format!("control: A[] {keep_text}"),
            Kind::Safe,
            &none,
            &kept,
        ),
        (
            format!("control: A[ {keep_text} U {goal_text} ]"),
            Kind::Until,
            &goals,
            &kept,
        ),
        (
            format!("control: A[ {keep_text} W {goal_text} ]"),
            Kind::WeakUntil,
            &goals,
            &kept,
        ),
        (
            format!("control: A[] ({keep_text} && A<> {goal_text})"),
            Kind::Recur,
            &goals,
            &kept,
        ),
    ] {
        let rules = [
            (Rule::Tiga, Forced::Tiga),
            (Rule::Product, Forced::Product),
            (Rule::Neutral, Forced::Neutral),
        ];
        let (rule, forced) = rules[random.below(3)];
        let query = model.add_query(&query);
        let closed = Closed {
            graph: &graph,
            decisions: &[],
            owner: Player::Controller,
            is_permissive: false,
            kind,
            goal,
            keep,
            rule,
        };
        compare_query(&mut model, (&query, forced), &closed, &mut random, tally)
            .map_err(|error| TestCaseError::fail(format!("{text}{error}")))?;
    }
    Ok(())
}

#[test]
fn checks_of_mutated_strategies_equal_brute_force() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
        proptest::num::u64::ANY,
    );
    compare::run("mutated strategies", 120, &strategy, compare);
}
