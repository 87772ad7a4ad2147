//! Games with every rule for forced moves.

use std::sync::Arc;

use checker::engine::format::strategy_json;
use checker::engine::{Answer, LoadedModel, NamedStrategy, Options, Verdict};
use checker::game::strategy::{self, Start};
use checker::game::{Forced, Nodes, Player, Priorities};
use checker::search::optimum::extremum::Extreme;
use checker::zones::Bound;
use proptest::strategy::Strategy;
use proptest::test_runner::TestCaseError;
use proptest::{prop_assert, prop_assert_eq};

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::{Graph, Objective, Rule, recurring, winning};
use crate::generate::{self, Formula, Network, Shape};
use crate::process::alone;

pub(crate) const SHAPE: Shape = Shape {
    clocks: 2,
    constant: 3,
    strict_invariants: false,
    uncontrollable: true,
    deadlock: false,
    priorities: true,
    guarded_urgency: true,
    legs: false,
};

/// The rules for forced moves: those of brute force, and those of the engine.
pub(crate) const RULES: [(Rule, Forced); 3] = [
    (Rule::Tiga, Forced::Tiga),
    (Rule::Product, Forced::Product),
    (Rule::Neutral, Forced::Neutral),
];

/// No good guide, but one that changes the order.
const GUIDE: &str = "v0";

/// Networks with a goal, what is to be kept, and a seed.
pub(crate) fn seeded_games() -> impl Strategy<Value = (Network, Formula, Formula, u64)> {
    (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
        proptest::num::u64::ANY,
    )
}

/// A query for each objective that has a goal to reach, or something to keep, or both.
pub(crate) fn objectives(goal_text: &str, keep_text: &str) -> [(String, Kind); 5] {
    [
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
    ]
}

fn compare(
    (network, goal, keep): &(Network, Formula, Formula),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let has_differences = generate::has_differences(goal) || generate::has_differences(keep);
    let constant = i64::from(SHAPE.constant);
    let graph = match compare::regions(&model, constant, has_differences, tally) {
        Ok(Some(graph)) => Ok(graph),
        Ok(None) => return Ok(()),
        Err(error) => Err(error),
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    for (query, kind) in objectives(&goal_text, &keep_text) {
        for (rule, forced) in RULES {
            let wins = match &graph {
                Ok(graph) => Ok(wins(network, (goal, keep), graph, kind, rule)),
                Err(error) => Err(*error),
            };
            for (is_cooperative, nodes) in [
                (false, Nodes::Symbolic),
                (false, Nodes::Discrete),
                (true, Nodes::Automatic),
            ] {
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
                    nodes,
                    priorities: Priorities::Kept,
                    verify: true,
                    ..compare::options()
                };
                // Without a strategy games may end earlier.
                let quick = Options {
                    verify: false,
                    threads: 2,
                    ..options.clone()
                };
                compare::check(
                    &try_ask(&mut model, &query, &quick),
                    expected,
                    tally,
                    || format!("{text}{query}\n{forced:?} {nodes:?} without strategy"),
                )?;
                let guided = Options {
                    guide: Some(GUIDE.to_owned()),
                    ..quick
                };
                compare::check(
                    &try_ask(&mut model, &query, &guided),
                    expected,
                    tally,
                    || format!("{text}{query}\n{forced:?} {nodes:?} with a guide"),
                )?;
                let answer = try_ask(&mut model, &query, &options);
                compare::check(&answer, expected, tally, || {
                    format!("{text}{query}\n{forced:?} {nodes:?}")
                })?;
                compare::check_strategy(&model, &answer, tally, || {
                    format!("{text}{query}\n{forced:?} {nodes:?}")
                })?;
                if let Ok(answer) = &answer {
                    check_file(&model, &query, answer, || format!("{text}{query}"))?;
                }
                let strategy = answer.ok().and_then(|answer| answer.evidence.strategy);
                // What holds after some way, or from everywhere, need not hold from the start.
                if let Some(strategy) = strategy.filter(|one| one.start == Start::Initial) {
                    for enforced in enforced(kind, strategy.owner, (&goal_text, &keep_text)) {
                        let strategy = Arc::clone(&strategy);
                        let result = check_under(&mut model, strategy, &enforced, tally);
                        result.map_err(|error| {
                            TestCaseError::fail(format!(
                                "{text}{query} {forced:?} {nodes:?}: {error}"
                            ))
                        })?;
                    }
                }
            }
        }
    }
    Ok(())
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    Reach,
    Until,
    Safe,
    WeakUntil,
    Recur,
}

/// By region: whether the controller wins.
pub(crate) fn wins(
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

/// What holds under a strategy of the winner, as far as it can be said without play ending on the
/// way: in every run if it is the controller's, and in some run if it is the environment's. In a
/// game the environment is faster where both act at the same instant, but the closed loop leaves
/// all moves of the other player possible, so that it also has the runs in which the controller was
/// faster.
fn enforced(kind: Kind, owner: Player, (goal, keep): (&str, &str)) -> Vec<String> {
    match (kind, owner) {
        (Kind::Reach | Kind::Until, Player::Controller) => vec![format!("A<> {goal}")],
        (Kind::Reach, Player::Environment) => vec![format!("E[] not ({goal})")],
        (Kind::Safe, Player::Controller) => vec![format!("A[] {keep}")],
        (Kind::Safe, Player::Environment) => vec![format!("E<> not ({keep})")],
        (Kind::Recur, Player::Controller) => {
            vec![format!("A[] {keep}"), format!("not ({goal}) --> {goal}")]
        }
        _ => Vec::new(),
    }
}

/// Under a strategy, what it was made for must hold.
fn check_under(
    model: &mut LoadedModel,
    strategy: Arc<strategy::Strategy>,
    query: &str,
    tally: &Tally,
) -> Result<(), TestCaseError> {
    model.keep_strategy(NamedStrategy::new(
        "S".to_owned(),
        String::new(),
        Some(strategy),
    ));
    let query = format!("{query} under S");
    let options = Options {
        priorities: Priorities::Kept,
        ..compare::options()
    };
    let answer = try_ask(model, &query, &options);
    compare::check(&answer, Ok(true), tally, || query.clone())
}

/// By region: whether the formula holds.
pub(crate) fn labels(network: &Network, formula: &Formula, graph: &Graph) -> Vec<bool> {
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

/// The least time of `control_t*` must be the least bound within which an ordinary game with a
/// clock of its own is won.
fn compare_times(
    (network, goal, keep): &(Network, Formula, Formula),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = format!("clock t;\n{}", network.text());
    let mut model = load(&text);
    let (goal, keep) = (network.formula(goal), network.formula(keep));
    let options = Options {
        priorities: Priorities::Kept,
        verify: true,
        ..compare::options()
    };
    let ask = |model: &mut LoadedModel, query: &str| try_ask(model, query, &options);
    for limit in ["", "(4)", "(3, 1)"] {
        let within = |value: i32| match limit {
            // One unit is to be left wherever the goal does not hold yet.
            "(3, 1)" => format!(
                "control: A[ ({keep}) && t <= {} U ({goal}) && t <= {value} ]",
                value - 1
            ),
            _ => format!("control: A[ {keep} U ({goal}) && t <= {value} ]"),
        };
        let query = format!("control_t*{limit}: A[ {keep} U {goal} ]");
        let answer = ask(&mut model, &query);
        let describe = || format!("{text}{query}\n{answer:?}");
        check_in_discrete_states(&mut model, &query, answer.as_ref().ok(), describe)?;
        let value = answer.as_ref().ok().and_then(|answer| answer.value.clone());
        let least = value.and_then(|values| values.items[0].least);
        let expected = if let Some(Extreme::Value { value, is_reached }) = least {
            // At the time itself it is won if the time is reached, before it never, after it
            // always.
            for (value, wins) in [(value, is_reached), (value - 1, false), (value + 1, true)] {
                let game = within(value);
                compare::check(&ask(&mut model, &game), Ok(wins), tally, || {
                    format!("{}\n{game}", describe())
                })?;
            }
            true
        } else {
            let game = match limit {
                "" => format!("control: A[ {keep} U {goal} ]"),
                "(4)" => within(4),
                _ => within(3),
            };
            let other = ask(&mut model, &game);
            let is_error = |answer: &Answer| matches!(answer.verdict, Verdict::Error(_));
            if other.as_ref().is_ok_and(is_error) {
                return Ok(());
            }
            compare::check(&other, Ok(false), tally, || {
                format!("{}\n{game}", describe())
            })?;
            false
        };
        compare::check(&answer, Ok(expected), tally, describe)?;
        compare::check_strategy(&model, &answer, tally, describe)?;
        if let Ok(answer) = &answer {
            check_file(&model, &query, answer, describe)?;
            let strategy = answer.evidence.strategy.clone();
            if let Some(strategy) = strategy.filter(|one| one.owner == Player::Controller) {
                let enforced = format!("A<> {goal}");
                check_under(&mut model, strategy, &enforced, tally)
                    .map_err(|error| TestCaseError::fail(format!("{}\n{error}", describe())))?;
            }
        }
    }
    Ok(())
}

/// The time must be the same with one node for each discrete state.
fn check_in_discrete_states(
    model: &mut LoadedModel,
    query: &str,
    answer: Option<&Answer>,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    let options = Options {
        priorities: Priorities::Kept,
        nodes: Nodes::Discrete,
        ..compare::options()
    };
    let other = try_ask(model, query, &options);
    let is_known = |answer: &&Answer| !matches!(answer.verdict, Verdict::Unknown(_));
    let both = answer
        .filter(is_known)
        .zip(other.as_ref().ok().filter(is_known));
    if let Some((answer, other)) = both {
        prop_assert_eq!(&answer.verdict, &other.verdict, "{}", describe());
        prop_assert_eq!(&answer.value, &other.value, "{}", describe());
    }
    Ok(())
}

/// A strategy must be the same after it was written and read again.
pub(crate) fn check_file(
    model: &LoadedModel,
    query: &str,
    answer: &Answer,
    describe: impl Fn() -> String,
) -> Result<(), TestCaseError> {
    let Some(strategy) = &answer.evidence.strategy else {
        let is_won = matches!(answer.verdict, Verdict::Satisfied | Verdict::NotSatisfied);
        let message = answer.message.as_deref().unwrap_or_default();
        let is_stopped = message.contains("stopped by the state limit");
        prop_assert!(
            !is_won || is_stopped,
            "{}\n{:?}",
            describe(),
            answer.message
        );
        return Ok(());
    };
    let file = strategy_json::text(model.network(), strategy, query);
    let read = strategy_json::read(model.network(), file.as_bytes());
    let again =
        read.map(|(query, strategy)| strategy_json::text(model.network(), &strategy, &query));
    prop_assert_eq!(again.as_ref(), Ok(&file), "{}", describe());
    Ok(())
}

#[test]
fn least_times_are_the_bounds_of_ordinary_games() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
    );
    compare::run("least times", 100, &strategy, compare_times);
}

/// A scale for which all constants stay below this one, and differences leave the range of zones
/// in a few rounds of a loop.
const fn scale(most: i32) -> i32 {
    most / SHAPE.constant - 1
}

/// Who wins does not depend on the unit of time: with all clock values multiplied, the engine must
/// say what brute force says without.
fn compare_scaled(
    (network, goal, keep): &(Network, Formula, Formula),
    scale: i32,
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let has_differences = generate::has_differences(goal) || generate::has_differences(keep);
    let constant = i64::from(SHAPE.constant);
    let model = load(&network.text());
    let Ok(Some(graph)) = compare::regions(&model, constant, has_differences, tally) else {
        return Ok(());
    };
    let large = network.scaled(scale);
    let text = large.text();
    let mut model = load(&text);
    let (goal_text, keep_text) = (large.formula(goal), large.formula(keep));
    let reached = labels(network, goal, &graph).contains(&true);
    let mut queries = vec![(format!("E<> {goal_text}"), reached, Forced::Tiga)];
    let objectives = objectives(&goal_text, &keep_text).into_iter();
    for (query, kind) in objectives.filter(|(_, kind)| *kind != Kind::Until) {
        for (rule, forced) in RULES {
            let wins = wins(network, (goal, keep), &graph, kind, rule)[0];
            queries.push((query.clone(), wins, forced));
        }
    }
    for (query, expected, forced) in queries {
        let options = Options {
            forced,
            priorities: Priorities::Kept,
            // The independent replay has no regions for so many values.
            runs: false,
            strategy: query.starts_with("control"),
            verify: query.starts_with("control"),
            ..compare::options()
        };
        let answer = try_ask(&mut model, &query, &options);
        if compare::has_grown(&answer) {
            tally.count_stopped();
            continue;
        }
        let describe = || format!("{text}{query}\n{forced:?}");
        compare::check(&answer, Ok(expected), tally, describe)?;
        compare::check_strategy(&model, &answer, tally, describe)?;
    }
    Ok(())
}

fn compare_with_constants_to(most: i32) {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
    );
    let name = format!("games with constants to {most}");
    compare::run(&name, 150, &strategy, |game, tally| {
        compare_scaled(game, scale(most), tally)
    });
}

#[test]
fn games_with_large_constants_equal_brute_force_with_small_ones() {
    compare_with_constants_to(Bound::NARROW_VALUE);
}

#[test]
fn games_with_the_greatest_constants_equal_brute_force_with_small_ones() {
    let name = "games::games_with_the_greatest_constants_equal_brute_force_with_small_ones";
    alone(name, || compare_with_constants_to(Bound::MAX_VALUE));
}
