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
    let queries = [
        format!("control: A<> {}", network.formula(goal)),
        format!(
            "control: A[ {} U {} ]",
            network.formula(keep),
            network.formula(goal)
        ),
    ];
    for (has_keep, query) in [false, true].into_iter().zip(queries) {
        for (rule, forced) in [
            (Rule::Tiga, Forced::Tiga),
            (Rule::Product, Forced::Product),
            (Rule::Neutral, Forced::Neutral),
        ] {
            let expected = match &graph {
                Ok(graph) => {
                    let goal = labels(network, goal, graph);
                    let keep = if has_keep {
                        labels(network, keep, graph)
                    } else {
                        vec![true; goal.len()]
                    };
                    let objective = Objective {
                        goal: &goal,
                        keep: &keep,
                        must_reach: true,
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
fn reachability_games_equal_brute_force() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
    );
    compare::run("reachability games", 300, &strategy, compare);
}
