//! `E<>` and `A[]`, with clocks and `deadlock`, in every search order.

use checker::engine::Options;
use checker::search::reachability::report::Order;
use proptest::collection::vec;
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::Graph;
use crate::generate::{self, Formula, Network, Shape};

const SHAPE: Shape = Shape {
    clocks: 3,
    constant: 4,
    strict_invariants: true,
    uncontrollable: false,
    deadlock: true,
    priorities: false,
    guarded_urgency: false,
    legs: false,
};

fn compare(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let Some(graph) = compare::regions_for(&model, (formulas, SHAPE.constant), tally) else {
        return Ok(());
    };
    for (index, formula) in formulas.iter().enumerate() {
        let is_invariant = index % 3 == 2;
        let expected = match &graph {
            Ok(graph) => Ok(is_somewhere(network, formula, graph, is_invariant) != is_invariant),
            Err(error) => Err(*error),
        };
        let quantifier = if is_invariant { "A[]" } else { "E<>" };
        let query = format!("{quantifier} {}", network.formula(formula));
        for order in [Order::BreadthFirst, Order::DepthFirst, Order::Random(7)] {
            let options = Options {
                order,
                ..compare::options()
            };
            let answer = try_ask(&mut model, &query, &options);
            compare::check(&answer, expected, tally, || {
                format!("{text}{query}\n{order:?}")
            })?;
        }
    }
    Ok(())
}

/// Whether some region satisfies the formula, or its negation.
fn is_somewhere(network: &Network, formula: &Formula, graph: &Graph, is_negated: bool) -> bool {
    (0..graph.nodes.len()).any(|node| {
        let state = &graph.nodes[node].state;
        let deadlock = || graph.is_deadlock(node);
        let holds = network.holds(formula, &state.words, &state.clocks, graph.ticks, &deadlock);
        holds != is_negated
    })
}

#[test]
fn reachability_equals_brute_force() {
    let strategy = (
        generate::network(SHAPE),
        vec(generate::formula(SHAPE), 3..=3),
    );
    compare::run("reachability", 300, &strategy, compare);
}
