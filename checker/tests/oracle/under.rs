//! Games under a strategy of the controller: random strategies, and most permissive ones, against
//! the graph of regions of which only what they allow is left.

use std::sync::Arc;

use checker::engine::format::strategy_json;
use checker::engine::{NamedStrategy, Options};
use checker::game::strategy::Strategy;
use checker::game::{Player, Priorities};
use checker::verify::{Regions, Semantics};
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::closed_loops::{Said, own_moves};
use crate::compare::{self, Tally};
use crate::explicit::Graph;
use crate::games::{Kind, RULES, SHAPE, check_file, objectives, seeded_games, wins};
use crate::generate::{Formula, Network};
use crate::random::Random;

/// Leaves only what the strategy allows.
fn restrict(graph: &mut Graph, strategy: &Strategy) {
    let ticks = graph.ticks;
    let network = &graph.network;
    for node in &mut graph.nodes {
        let said = Said::new(network, strategy, &node.state, ticks);
        node.steps
            .retain(|step| !step.controllable || said.allows(&step.parts));
        node.is_obliged = !said.allows_waiting();
    }
}

fn compare(
    (network, goal, keep, seed): &(Network, Formula, Formula, u64),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let Ok(Some(mut graph)) = compare::regions(&model, i64::from(SHAPE.constant), true, tally)
    else {
        return Ok(());
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let mut random = Random(seed | 1);
    let options = Options {
        priorities: Priorities::Kept,
        strategy: true,
        ..compare::options()
    };
    let strategy = if random.chance(50) {
        let ir = model.network().clone();
        let semantics = Semantics::new(&ir, Regions::ticks_per_unit(&ir));
        let words = own_moves(&semantics, &graph, Player::Controller);
        random.strategy(Player::Controller, &words, ir.clocks.len().max(1))
    } else {
        let answer = try_ask(&mut model, &format!("control: A[] {keep_text}"), &options);
        let strategy = answer.ok().and_then(|answer| answer.evidence.strategy);
        let Some(strategy) = strategy.filter(|one| one.owner == Player::Controller) else {
            return Ok(());
        };
        // In the file, the decisions of states with the same words are together.
        let file = strategy_json::text(model.network(), &strategy, "control: A[] true");
        let read = strategy_json::read(model.network(), file.as_bytes());
        read.expect("what is written is read").1
    };
    restrict(&mut graph, &strategy);
    let description = strategy_json::text(model.network(), &strategy, "control: A[] true");
    model.keep_strategy(NamedStrategy::new(
        "S".to_owned(),
        "control: A[] true".to_owned(),
        Some(Arc::new(strategy)),
    ));
    for (query, kind) in objectives(&goal_text, &keep_text) {
        let query = match kind {
            // What a most permissive strategy keeps would hold in any case.
            Kind::Safe => format!("control: A[] not ({goal_text})"),
            _ => query,
        };
        for (rule, forced) in RULES {
            let expected = if kind == Kind::Safe {
                let avoided = Formula::Not(Box::new(goal.clone()));
                wins(network, (goal, &avoided), &graph, kind, rule)[0]
            } else {
                wins(network, (goal, keep), &graph, kind, rule)[0]
            };
            let query = format!("{query} under S");
            let options = Options {
                forced,
                verify: true,
                ..options.clone()
            };
            let answer = try_ask(&mut model, &query, &options);
            let describe = || format!("{text}{query}\n{forced:?}\n{description:#}");
            compare::check(&answer, Ok(expected), tally, describe)?;
            compare::check_strategy(&model, &answer, tally, describe)?;
            if let Ok(answer) = &answer {
                check_file(&model, &query, answer, describe)?;
            }
        }
    }
    Ok(())
}

#[test]
fn games_under_a_strategy_equal_brute_force() {
    let strategy = seeded_games();
    compare::run("games under a strategy", 100, &strategy, compare);
}
