//! Branch points whose legs have guards, selects and synchronisations: verdicts against regions
//! that are computed from the tree of a network, not from what the engine makes of its text.
//!
//! An edge and a leg are one transition, with one synchronisation, one priority, and one look at
//! committed locations.

use checker::engine::Options;
use checker::game::Priorities;
use proptest::collection::vec;
use proptest::strategy::Strategy as _;
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::Graph;
use crate::games::{self, RULES, objectives, wins};
use crate::generate::explorer::explore;
use crate::generate::{self, Formula, Network, Shape};

/// Regions that brute force explores before it gives a case up.
const MOST_REGIONS: usize = 10_000;

const SHAPE: Shape = Shape {
    legs: true,
    priorities: false,
    deadlock: true,
    uncontrollable: false,
    ..games::SHAPE
};

const SHAPE_OF_GAMES: Shape = Shape {
    legs: true,
    ..games::SHAPE
};

const SHAPE_OF_PRIORITIES: Shape = Shape {
    priorities: true,
    deadlock: false,
    ..SHAPE
};

fn is_somewhere(network: &Network, formula: &Formula, graph: &Graph) -> bool {
    (0..graph.nodes.len()).any(|node| {
        let state = &graph.nodes[node].state;
        let deadlock = || graph.is_deadlock(node);
        network.holds(formula, &state.words, &state.clocks, graph.ticks, &deadlock)
    })
}

fn compare_states(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let Some(graph) = explore(network, SHAPE.constant, MOST_REGIONS) else {
        return Ok(());
    };
    let text = network.text();
    let mut model = load(&text);
    for formula in formulas {
        let expected = Ok(is_somewhere(network, formula, &graph));
        let query = format!("E<> {}", network.formula(formula));
        let answer = try_ask(&mut model, &query, &compare::certifying(&text, &query));
        compare::check(&answer, expected, tally, || format!("{text}{query}"))?;
        if let Ok(answer) = &answer {
            compare::check_certificate(&mut model, answer, &query, || format!("{text}{query}"))?;
        }
    }
    Ok(())
}

#[test]
fn states_behind_legs_equal_brute_force() {
    let strategy = (
        generate::network(SHAPE).prop_map(Network::without_differences),
        vec(
            generate::formula(SHAPE).prop_map(Formula::without_differences),
            4..=4,
        ),
    );
    compare::run("legs", 300, &strategy, compare_states);
}

#[test]
fn states_behind_legs_with_priorities_equal_brute_force() {
    let shape = SHAPE_OF_PRIORITIES;
    let strategy = (
        generate::network(shape).prop_map(Network::without_differences),
        vec(
            generate::formula(shape).prop_map(Formula::without_differences),
            4..=4,
        ),
    );
    compare::run("legs with priorities", 200, &strategy, compare_states);
}

fn compare_games(
    (network, goal, keep): &(Network, Formula, Formula),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let Some(graph) = explore(network, SHAPE.constant, MOST_REGIONS) else {
        return Ok(());
    };
    let text = network.text();
    let mut model = load(&text);
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    for (query, kind) in objectives(&goal_text, &keep_text) {
        for (rule, forced) in RULES {
            let expected = Ok(wins(network, (goal, keep), &graph, kind, rule)[0]);
            let options = Options {
                forced,
                priorities: Priorities::Kept,
                verify: true,
                ..compare::options()
            };
            let answer = try_ask(&mut model, &query, &options);
            let describe = || format!("{text}{query}\n{forced:?}");
            compare::check(&answer, expected, tally, describe)?;
            compare::check_strategy(&model, &answer, tally, describe)?;
        }
    }
    Ok(())
}

#[test]
fn games_with_legs_equal_brute_force() {
    let formula = || generate::formula(SHAPE_OF_GAMES).prop_map(Formula::without_differences);
    let strategy = (
        generate::network(SHAPE_OF_GAMES).prop_map(Network::without_differences),
        formula(),
        formula(),
    );
    compare::run("games with legs", 150, &strategy, compare_games);
}
