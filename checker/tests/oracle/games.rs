//! Games with every rule for forced moves.

use checker::engine::Options;
use checker::game::Forced;
use proptest::test_runner::TestCaseError;

use crate::compare::{self, Tally};
use crate::explicit::{Graph, Objective, Rule, recurring, winning};
use crate::generate::{self, Formula, Network, Shape};

const SHAPE: Shape = Shape {
    clocks: 2,
    constant: 3,
    strict_invariants: false,
    uncontrollable: true,
    deadlock: false,
};

fn compare(
    (network, goal, keep): &(Network, Formula, Formula),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = compare::load(&text);
    let has_differences = generate::has_differences(goal) || generate::has_differences(keep);
    let constant = i64::from(SHAPE.constant);
    let graph = match compare::regions(&model, constant, has_differences, tally) {
        Ok(Some(graph)) => Ok(graph),
        Ok(None) => return Ok(()),
        Err(error) => Err(error),
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let rules = [
        (Rule::Tiga, Forced::Tiga),
        (Rule::Product, Forced::Product),
        (Rule::Neutral, Forced::Neutral),
    ];
    for (query, kind) in [
        (format!("control: A<> {goal_text}"), Kind::Reach),
        (
            format!("control: A[ {keep_text} U {goal_text} ]"),
            Kind::Until,
        ),
        (format!("control: A[] {keep_text}"), Kind::Safe),
        (
            format!("control: A[ {keep_text} W {goal_text} ]"),
            Kind::WeakUntil,
        ),
        (
            format!("control: A[] ({keep_text} && A<> {goal_text})"),
            Kind::Recur,
        ),
    ] {
        let has_rule = matches!(kind, Kind::Reach | Kind::Until | Kind::Recur);
        for (rule, forced) in rules.into_iter().take(if has_rule { 3 } else { 1 }) {
            let wins = match &graph {
                Ok(graph) => Ok(wins(network, (goal, keep), graph, kind, rule)),
                Err(error) => Err(*error),
            };
            for is_cooperative in [false, true] {
                let query = if is_cooperative {
                    format!("E<> {query}")
                } else {
                    query.clone()
                };
                let expected = match &wins {
                    Ok(wins) if is_cooperative => Ok(wins.contains(&true)),
                    Ok(wins) => Ok(wins[0]),
                    Err(error) => Err(*error),
                };
                let options = Options {
                    forced,
                    verify: true,
                    ..compare::options()
                };
                let query_text = model.add_query(&query);
                let answer = model.check(&query_text, &options);
                compare::check(&answer, expected, tally, || {
                    format!("{text}{query}\n{forced:?}")
                })?;
                compare::check_strategy(&model, &answer, tally, || {
                    format!("{text}{query}\n{forced:?}")
                })?;
            }
        }
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Reach,
    Until,
    Safe,
    WeakUntil,
    Recur,
}

/// By region: whether the controller wins.
fn wins(
    network: &Network,
    (goal, keep): (&Formula, &Formula),
    graph: &Graph,
    kind: Kind,
    rule: Rule,
) -> Vec<bool> {
    let count = graph.nodes.len();
    let goal = match kind {
        Kind::Safe => vec![false; count],
        _ => labels(network, goal, graph),
    };
    let keep = match kind {
        Kind::Reach => vec![true; count],
        _ => labels(network, keep, graph),
    };
    if kind == Kind::Recur {
        return recurring(graph, &goal, &keep, rule);
    }
    let objective = Objective {
        goal: &goal,
        keep: &keep,
        must_reach: matches!(kind, Kind::Reach | Kind::Until),
    };
    winning(graph, &objective, rule)
}

/// By region: whether the formula holds.
fn labels(network: &Network, formula: &Formula, graph: &Graph) -> Vec<bool> {
    let nodes = graph.nodes.iter();
    nodes
        .map(|node| {
            let state = &node.state;
            network.holds(formula, &state.words, &state.clocks, graph.ticks, &|| false)
        })
        .collect()
}

#[test]
fn games_equal_brute_force() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
    );
    compare::run("games", 150, &strategy, compare);
}
