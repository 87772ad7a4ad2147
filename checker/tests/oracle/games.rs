//! Games with every rule for forced moves.

use checker::engine::Options;
use checker::game::Forced;
use proptest::test_runner::TestCaseError;

use crate::compare::{self, Tally};
use crate::explicit::{Graph, Objective, Rule, winning};
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
    for (query, has_goal, has_keep, must_reach) in [
        (format!("control: A<> {goal_text}"), true, false, true),
        (
            format!("control: A[ {keep_text} U {goal_text} ]"),
            true,
            true,
            true,
        ),
        (format!("control: A[] {keep_text}"), false, true, false),
        (
            format!("control: A[ {keep_text} W {goal_text} ]"),
            true,
            true,
            false,
        ),
    ] {
        // The rule matters only where something must be reached.
        for (rule, forced) in rules.into_iter().take(if must_reach { 3 } else { 1 }) {
            let expected = match &graph {
                Ok(graph) => {
                    let count = graph.nodes.len();
                    let goal = if has_goal {
                        labels(network, goal, graph)
                    } else {
                        vec![false; count]
                    };
                    let keep = if has_keep {
                        labels(network, keep, graph)
                    } else {
                        vec![true; count]
                    };
                    let objective = Objective {
                        goal: &goal,
                        keep: &keep,
                        must_reach,
                    };
                    Ok(winning(graph, &objective, rule)[0])
                }
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
    Ok(())
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
    compare::run("games", 300, &strategy, compare);
}
