//! The other kinds of symbolic queries: `E[]`, `A<>`, `-->`, `bounds`, and the shortest and fastest
//! traces of `E<>`.

use std::time::Duration;

use checker::engine::evidence::witness::{Proof, WitnessKind};
use checker::engine::{Answer, LoadedModel, Options, TraceWanted, Verdict};
use checker::search::limits::StopReason;
use checker::search::optimum::extremum::{Extreme, Extremes};
use checker::verify::Error;
use checker::verify::replay::{End, Run};
use proptest::collection::vec;
use proptest::strategy::Strategy as _;
use proptest::test_runner::TestCaseError;
use proptest::{prop_assert, prop_assert_eq};

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::endless::Endless;
use crate::explicit::Graph;
use crate::generate::explorer::explore;
use crate::generate::{self, Formula, Network, Shape};

const LIVENESS: Shape = Shape {
    clocks: 3,
    constant: 4,
    strict_invariants: true,
    uncontrollable: false,
    deadlock: false,
    priorities: true,
    guarded_urgency: true,
    legs: false,
};

/// Values are compared up to [`TOP`], which takes many regions.
const VALUES: Shape = Shape {
    clocks: 2,
    constant: 3,
    ..LIVENESS
};

/// Regions that brute force explores before it gives a case up.
const MOST_REGIONS: usize = 10_000;

/// Regions tell the values of clocks apart up to this one.
const TOP: i64 = 5;

/// Where a formula holds, node by node.
fn labels(network: &Network, graph: &Graph, formula: &Formula) -> Vec<bool> {
    let holds = |node: usize| {
        let state = &graph.nodes[node].state;
        let deadlock = || graph.is_deadlock(node);
        network.holds(formula, &state.words, &state.clocks, graph.ticks, &deadlock)
    };
    (0..graph.nodes.len()).map(holds).collect()
}

fn negated(labels: &[bool]) -> Vec<bool> {
    labels.iter().map(|holds| !holds).collect()
}

/// The nodes from which a run stays for ever where `keep` holds: what remains when nodes without a
/// way on are taken away again and again. Time alone goes on for ever only in a region without end;
/// all other cycles have a move.
fn staying(graph: &Graph, keep: &[bool]) -> Vec<bool> {
    let mut staying = keep.to_vec();
    loop {
        let mut is_changed = false;
        for node in (0..graph.nodes.len()).rev() {
            let facts = &graph.nodes[node];
            let ends = facts.steps.is_empty() && facts.later.is_none();
            let mut next = facts
                .steps
                .iter()
                .map(|step| step.target)
                .chain(facts.later);
            if staying[node] && !ends && !next.any(|next| staying[next]) {
                staying[node] = false;
                is_changed = true;
            }
        }
        if !is_changed {
            return staying;
        }
    }
}

/// The fewest moves on a way to a node that is wanted.
fn fewest_moves(graph: &Graph, wanted: &[bool]) -> Option<usize> {
    let mut found = vec![false; graph.nodes.len()];
    let mut layer = vec![0];
    found[0] = true;
    for moves in 0.. {
        let mut next = Vec::new();
        while let Some(node) = layer.pop() {
            if wanted[node] {
                return Some(moves);
            }
            next.extend(graph.nodes[node].steps.iter().map(|step| step.target));
            if let Some(later) = graph.nodes[node].later
                && !std::mem::replace(&mut found[later], true)
            {
                layer.push(later);
            }
        }
        next.retain(|&node| !std::mem::replace(&mut found[node], true));
        if next.is_empty() {
            return None;
        }
        layer = next;
    }
    None
}

fn compare_liveness(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let model = load(&network.text());
    let graph = compare::regions_for(&model, (formulas, LIVENESS.constant), tally);
    graph.map_or(Ok(()), |graph| {
        check_liveness(network, formulas, graph, tally)
    })
}

/// The same with regions that are computed from the tree of the network, not from what the engine
/// makes of its text.
fn compare_liveness_of_the_tree(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let graph = explore(network, LIVENESS.constant, MOST_REGIONS);
    graph.map_or(Ok(()), |graph| {
        check_liveness(network, formulas, Ok(graph), tally)
    })
}

fn check_liveness(
    network: &Network,
    formulas: &[Formula],
    graph: Result<Graph, Error>,
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let (p, q) = (network.formula(&formulas[0]), network.formula(&formulas[1]));
    let verdicts = graph.as_ref().map(|graph| {
        let p = labels(network, graph, &formulas[0]);
        let avoiding = staying(graph, &negated(&labels(network, graph, &formulas[1])));
        let is_answered = !p.iter().zip(&avoiding).any(|(p, avoiding)| *p && *avoiding);
        [staying(graph, &p)[0], !avoiding[0], is_answered]
    });
    let queries = [
        format!("E[] {p}"),
        format!("A<> {q}"),
        format!("{p} --> {q}"),
    ];
    for (index, query) in queries.iter().enumerate() {
        let expected = verdicts
            .map(|verdicts| verdicts[index])
            .map_err(|error| *error);
        let answer = try_ask(&mut model, query, &compare::certifying(&text, query));
        compare::check(&answer, expected, tally, || format!("{text}{query}"))?;
        if let Ok(answer) = &answer {
            compare::check_certificate(&mut model, answer, query, || format!("{text}{query}"))?;
        }
    }
    let Ok(graph) = graph else {
        return Ok(());
    };
    let p = labels(network, &graph, &formulas[0]);
    let avoided = negated(&labels(network, &graph, &formulas[1]));
    let wanted = [(None, &p), (None, &avoided), (Some(&p), &avoided)];
    for (query, (open, keep)) in queries.iter().zip(wanted) {
        let Some(answer) = answer(&mut model, query, TraceWanted::Shortest, tally)? else {
            continue;
        };
        let found = answer.evidence.witnesses.first();
        let found = found.map(|witness| witness.trace.moves.len());
        let fewest = Endless::new(&graph, open.map(Vec::as_slice), keep).fewest_moves(found);
        prop_assert_eq!(found, fewest, "{}{}", text, query);
    }
    Ok(())
}

/// Twice a value, and one more or less if it is not reached; what lies above [`TOP`] is one.
fn doubled(extreme: Extreme, is_least: bool) -> i64 {
    match extreme {
        Extreme::Infinite => 2 * TOP + 1,
        Extreme::Value { value, is_reached } => {
            let beside = i64::from(!is_reached);
            let value = 2 * i64::from(value) + if is_least { beside } else { -beside };
            value.min(2 * TOP + 1)
        }
    }
}

fn compare_values(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    // A network that fails has neither values nor traces that end.
    let Some(Ok(graph)) = compare::regions_for(&model, (formulas, TOP as i32), tally) else {
        return Ok(());
    };
    let wanted = labels(network, &graph, &formulas[0]);
    let condition = network.formula(&formulas[0]);
    for clock in 0..network.clocks {
        let query = format!("bounds{{{condition}}}: {}", network.clock(clock));
        let Some(answer) = answer(&mut model, &query, TraceWanted::Any, tally)? else {
            continue;
        };
        let found = answer.value.map(|value| {
            let Extremes { least, greatest } = value.items[0];
            let least = least.map(|extreme| doubled(extreme, true));
            (least, greatest.map(|extreme| doubled(extreme, false)))
        });
        let expected = Some(extremes(&graph, &wanted, clock));
        prop_assert_eq!(found, expected, "{}{}", text, query);
        check_best_values(network, (&condition, clock), (&graph, &wanted), tally)?;
    }
    let query = format!("E<> {condition}");
    let moves = |run: Run| run.steps.len();
    if let Some(answer) = answer(&mut model, &query, TraceWanted::Shortest, tally)? {
        let shortest = run(&answer).map(moves);
        let fewest = fewest_moves(&graph, &wanted);
        prop_assert_eq!(shortest, fewest, "{}{}", text, query);
    }
    if let Some(answer) = answer(&mut model, &query, TraceWanted::Fastest, tally)?
        && let Some(run) = run(&answer)
    {
        check_time(&text, &condition, &run, tally)?;
    }
    Ok(())
}

/// The extremes over the regions of a clock's value where something holds, doubled as in
/// [`doubled`].
fn extremes(graph: &Graph, wanted: &[bool], clock: usize) -> (Option<i64>, Option<i64>) {
    let counting = (0..wanted.len()).filter(|&node| wanted[node]).map(|node| {
        let ticks = graph.nodes[node].state.clocks[1 + clock];
        let (whole, fraction) = (ticks / graph.ticks, ticks % graph.ticks);
        (2 * whole + i64::from(fraction > 0)).min(2 * TOP + 1)
    });
    (counting.clone().min(), counting.max())
}

/// Two clocks that nothing sets stay in step, whatever is compared with their difference.
fn compare_clocks_in_step(
    (network, formulas): &(Network, Vec<Formula>),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let text = text.replacen("chan a;", "clock total, twin;\nchan a;", 1);
    let mut model = load(&text);
    let Some(Ok(graph)) = compare::regions_for(&model, (formulas, TOP as i32), tally) else {
        return Ok(());
    };
    let wanted = labels(network, &graph, &formulas[0]);
    let condition = network.formula(&formulas[0]);
    let query = format!("bounds{{({condition}) && total - twin < 1}}: total");
    let Some(answer) = answer(&mut model, &query, TraceWanted::Any, tally)? else {
        return Ok(());
    };
    let found = answer.value.map(|value| {
        let Extremes { least, greatest } = value.items[0];
        let least = least.map(|extreme| doubled(extreme, true));
        (least, greatest.map(|extreme| doubled(extreme, false)))
    });
    let expected = Some(extremes(&graph, &wanted, network.clocks));
    prop_assert_eq!(found, expected, "{}{}", text, query);
    Ok(())
}

/// The shortest run to a least or greatest value of a clock has as many moves as the way through
/// the regions with the fewest, and the fastest takes the least time.
fn check_best_values(
    network: &Network,
    (condition, clock): (&str, usize),
    (graph, wanted): (&Graph, &[bool]),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let name = network.clock(clock);
    let query = format!("bounds{{{condition}}}: {name}");
    let mut model = load(&text);
    for trace in [TraceWanted::Shortest, TraceWanted::Fastest] {
        let Some(answer) = answer(&mut model, &query, trace, tally)? else {
            continue;
        };
        for witness in &answer.evidence.witnesses {
            let (WitnessKind::Value(_, shown), Some(Proof::Replayed(run, ..))) =
                (witness.kind, &witness.run)
            else {
                return Err(TestCaseError::fail(format!("{text}{query}\n{witness:?}")));
            };
            if shown.value >= TOP {
                continue;
            }
            if trace == TraceWanted::Fastest {
                let value = shown.value;
                let there = match (shown.is_reached, shown.is_greatest) {
                    (true, _) => format!("{name} == {value}"),
                    (false, true) => format!("{name} > {} && {name} < {value}", value - 1),
                    (false, false) => format!("{name} > {value} && {name} < {}", value + 1),
                };
                check_time(&text, &format!("({condition}) && {there}"), run, tally)?;
                continue;
            }
            let has_value = |node: usize| {
                let ticks = graph.nodes[node].state.clocks[1 + clock];
                let (whole, fraction) = (ticks / graph.ticks, ticks % graph.ticks);
                let below = i64::from(shown.is_greatest && !shown.is_reached);
                whole == shown.value - below && (fraction == 0) == shown.is_reached
            };
            let nodes: Vec<bool> = (0..wanted.len())
                .map(|node| wanted[node] && has_value(node))
                .collect();
            let fewest = fewest_moves(graph, &nodes);
            prop_assert_eq!(Some(run.steps.len()), fewest, "{}{}", text, query);
        }
    }
    Ok(())
}

/// A fastest run takes the least time, as a clock that nothing sets says; less than a unit more
/// where the least is not reached.
fn check_time(text: &str, condition: &str, run: &Run, tally: &Tally) -> Result<(), TestCaseError> {
    let End::After(last) = run.end else {
        return Err(TestCaseError::fail(format!("{text}{condition}\n{run:?}")));
    };
    let ticks = run.steps.iter().map(|step| step.wait).sum::<i64>() + last;
    let query = format!("inf{{{condition}}}: total");
    let mut timed = load(&format!("clock total;\n{text}"));
    let Some(answer) = answer(&mut timed, &query, TraceWanted::Any, tally)? else {
        return Ok(());
    };
    let least = answer.value.and_then(|value| value.items[0].least);
    let is_right = match least {
        Some(Extreme::Value { value, is_reached }) => {
            let least = i64::from(value) * run.ticks_per_unit;
            if is_reached {
                ticks == least
            } else {
                least < ticks && ticks < least + run.ticks_per_unit
            }
        }
        _ => false,
    };
    prop_assert!(is_right, "{}{}: {:?}\n{:?}", text, query, least, run);
    Ok(())
}

/// The exact run that an answer comes with.
fn run(answer: &Answer) -> Option<Run> {
    match &answer.evidence.witnesses.first()?.run {
        Some(Proof::Replayed(run, ..)) => Some(run.clone()),
        _ => None,
    }
}

/// The answer to a query on a network without failures; `None`, counted, if the engine gave it up.
fn answer(
    model: &mut LoadedModel,
    query: &str,
    trace: TraceWanted,
    tally: &Tally,
) -> Result<Option<Answer>, TestCaseError> {
    let mut options = Options {
        trace,
        ..compare::certifying("", query)
    };
    // A clock without greatest value that is copied to and fro is followed up to the limit of clock
    // values.
    options.limits.timeout = Some(Duration::from_secs(1));
    let answer = try_ask(model, query, &options);
    let answer = answer.map_err(|rejection| TestCaseError::fail(rejection.rendered.join("\n")))?;
    if let Verdict::Unknown(StopReason::States | StopReason::Time) = answer.verdict {
        tally.count_stopped();

        return Ok(None);
    }
    tally.count_compared();
    compare::check_witnesses(&answer, || query.to_owned())?;
    compare::check_certificate(model, &answer, query, || query.to_owned())?;
    Ok(Some(answer))
}

#[test]
fn liveness_equals_brute_force() {
    let formulas = vec(generate::formula(LIVENESS), 2..=2);
    let strategy = (generate::network(LIVENESS), formulas);
    compare::run("liveness", 600, &strategy, compare_liveness);
}

#[test]
fn liveness_equals_brute_force_on_the_tree() {
    let formula = generate::formula(LIVENESS).prop_map(Formula::without_differences);
    let network = generate::network(LIVENESS).prop_map(Network::without_differences);
    let strategy = (network, vec(formula, 2..=2));
    compare::run(
        "liveness of trees",
        600,
        &strategy,
        compare_liveness_of_the_tree,
    );
}

#[test]
fn values_and_best_traces_equal_brute_force() {
    let formulas = vec(generate::formula(VALUES), 1..=1);
    let strategy = (generate::network(VALUES), formulas);
    compare::run("values", 600, &strategy, compare_values);
}

#[test]
fn values_of_clocks_in_step_equal_brute_force() {
    let formulas = vec(generate::formula(VALUES), 1..=1);
    let strategy = (generate::network(VALUES), formulas);
    compare::run("in step", 200, &strategy, compare_clocks_in_step);
}
