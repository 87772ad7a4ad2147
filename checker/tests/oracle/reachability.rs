//! `E<>` and `A[]`, with clocks and `deadlock`, in every search order.

use checker::engine::Options;
use checker::search::reachability::report::Order;
use checker::zones::Bound;
use proptest::collection::vec;
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::Graph;
use crate::generate::{self, Formula, Network, Shape};
use crate::process::alone;

const SHAPE: Shape = Shape {
    clocks: 3,
    constant: 4,
    strict_invariants: true,
    uncontrollable: false,
    deadlock: true,
    priorities: false,
    guarded_urgency: true,
    legs: false,
};

/// With all clock values multiplied by `scale`, the engine must say what brute force says without.
fn compare(
    (network, formulas): &(Network, Vec<Formula>),
    scale: i32,
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let model = load(&network.text());
    let Some(graph) = compare::regions_for(&model, (formulas, SHAPE.constant), tally) else {
        return Ok(());
    };
    let scaled = network.scaled(scale);
    let text = scaled.text();
    let mut model = load(&text);
    for (index, formula) in formulas.iter().enumerate() {
        let is_invariant = index % 3 == 2;
        let expected = match &graph {
            Ok(graph) => Ok(is_somewhere(network, formula, graph, is_invariant) != is_invariant),
            Err(error) => Err(*error),
        };
        let quantifier = if is_invariant { "A[]" } else { "E<>" };
        let query = format!("{quantifier} {}", scaled.formula(formula));
        for order in [Order::BreadthFirst, Order::DepthFirst, Order::Random(7)] {
            let options = Options {
                order,
                // The independent check lists the values of bounds, which are too many.
                runs: scale == 1,
                certificate: scale == 1,
                ..compare::certifying(&text, &query)
            };
            let answer = try_ask(&mut model, &query, &options);
            if scale == 1
                && let Ok(answer) = &answer
            {
                compare::check_certificate(&mut model, answer, &query, || {
                    format!("{text}{query}")
                })?;
            }
            if scale > 1 && compare::has_grown(&answer) {
                tally.count_stopped();
                continue;
            }
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
    compare::run("reachability", 300, &strategy, |case, tally| {
        compare(case, 1, tally)
    });
}

#[test]
fn reachability_with_the_greatest_constants_equals_brute_force_with_small_ones() {
    let name =
        "reachability::reachability_with_the_greatest_constants_equals_brute_force_with_small_ones";
    alone(name, || {
        let strategy = (
            generate::network(SHAPE),
            vec(generate::formula(SHAPE), 3..=3),
        );
        let scale = Bound::MAX_VALUE / SHAPE.constant - 1;
        compare::run(
            "reachability with great constants",
            300,
            &strategy,
            |case, tally| compare(case, scale, tally),
        );
    });
}
