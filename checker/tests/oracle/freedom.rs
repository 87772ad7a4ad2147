//! What a query under a strategy to reach something allows, against its definition on regions: all
//! pairs of a region and a move, or a wait, after which the win stays certain; and where the goal
//! could be put off for ever then, all that come nearer to it.
//!
//! Brute force gives a closed loop that allows at least as much as the engine may, and one that
//! allows at most as much. They differ in two places. Where winning regions end without a last
//! moment, any last stretch of time in which the controller must act is right. And a region that is
//! first met after the goal may be restricted or not, since a strategy has no memory. Where both
//! loops say the same, so must the engine; else it must say what lies between.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::Write as _;

use checker::engine::{Options, Verdict};
use checker::game::{Nodes, Priorities};
use proptest::prop_assert;
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::{Graph, Rule, is_won};
use crate::games::{Kind, RULES, labels, wins};
use crate::generate::{self, Formula, Network, Shape};
use crate::random::Random;

const SHAPE: Shape = Shape {
    clocks: 2,
    constant: 3,
    strict_invariants: false,
    uncontrollable: true,
    deadlock: false,
    priorities: true,
    guarded_urgency: false,
    legs: false,
};

/// A decision to act: the rank and the edges of its moves.
type Acting = (usize, Vec<(u32, u32, u32)>);

/// What is allowed in a region: which of its steps, and to wait.
#[derive(Clone, Default)]
struct Allowed {
    steps: Vec<bool>,
    waits: bool,
    /// What time runs on in, where it came without a first moment.
    acting: Vec<Acting>,
}

/// All that keeps the win, and for each region whether anything is decided there.
fn winning_moves(graph: &Graph, goal: &[bool], win: &[bool]) -> Vec<Option<Allowed>> {
    let good = |_: usize, target: usize| win[target];
    let may_wait = |node: usize, _: bool| graph.nodes[node].later.is_some_and(|later| win[later]);
    allowed(graph, (goal, win), &vec![0; win.len()], good, may_wait)
}

/// All moves that lead to smaller ranks, and to wait where there are none.
fn nearer_moves(graph: &Graph, goal: &[bool], ranks: &[Option<usize>]) -> Vec<Option<Allowed>> {
    let win: Vec<bool> = ranks.iter().map(Option::is_some).collect();
    let good =
        |node: usize, target: usize| ranks[target].is_some_and(|rank| Some(rank) < ranks[node]);
    let may_wait = |_: usize, acts: bool| !acts;
    let known: Vec<usize> = ranks.iter().map(|rank| rank.unwrap_or(0)).collect();
    allowed(graph, (goal, &win), &known, good, may_wait)
}

fn allowed(
    graph: &Graph,
    (goal, win): (&[bool], &[bool]),
    ranks: &[usize],
    good: impl Fn(usize, usize) -> bool,
    may_wait: impl Fn(usize, bool) -> bool,
) -> Vec<Option<Allowed>> {
    let decide = |index: usize| {
        let node = &graph.nodes[index];
        if goal[index] || !win[index] {
            return None;
        }
        // The environment picks the branch.
        let mut entries: BTreeMap<Vec<(u32, u32, u32)>, bool> = BTreeMap::new();
        for step in node.steps.iter().filter(|step| step.controllable) {
            *entries.entry(step.entry.clone()).or_insert(true) &= good(index, step.target);
        }
        let steps = node.steps.iter();
        let acts = entries.values().any(|good| *good);
        Some(Allowed {
            steps: steps
                .map(|step| !step.controllable || entries[&step.entry])
                .collect(),
            waits: may_wait(index, acts),
            acting: entries
                .into_iter()
                .filter(|entry| entry.1)
                .map(|entry| (ranks[index], entry.0))
                .collect(),
        })
    };
    (0..graph.nodes.len()).map(decide).collect()
}

/// The number of turns, each a wait and a move, after which the controller has reached the goal.
fn ranks(graph: &Graph, (goal, keep): (&[bool], &[bool]), rule: Rule) -> Vec<Option<usize>> {
    let mut ranks: Vec<Option<usize>> = goal.iter().map(|goal| goal.then_some(0)).collect();
    for rank in 1.. {
        let before: Vec<bool> = ranks.iter().map(Option::is_some).collect();
        let mut now = before.clone();
        loop {
            let mut changed = false;
            for node in 0..graph.nodes.len() {
                if !now[node] && keep[node] && is_won(graph, node, (&before, &now), true, rule) {
                    now[node] = true;
                    ranks[node] = Some(rank);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        if now == before {
            break;
        }
    }
    ranks
}

/// A closed loop: its nodes are regions, with the acting decisions in which time runs there.
struct Loop {
    /// The region of each node.
    regions: Vec<usize>,
    /// The nodes that moves lead to.
    steps: Vec<Vec<usize>>,
    /// The node that time leads to, and whether it may stay out of it for ever.
    later: Vec<Option<usize>>,
    runs: Vec<bool>,
}

/// The closed loop of what is allowed; `runs_on` says whether time that came to an acting decision
/// without a first moment runs on in it.
fn close(
    graph: &Graph,
    allowed: &[Option<Allowed>],
    stops: impl Fn(usize) -> bool,
    runs_on: bool,
) -> Loop {
    type Key = (usize, Vec<Acting>);
    let mut known: Vec<Key> = vec![(0, Vec::new())];
    let mut found = Loop {
        regions: Vec::new(),
        steps: Vec::new(),
        later: Vec::new(),
        runs: Vec::new(),
    };
    let id = |known: &mut Vec<Key>, key: Key| {
        known.iter().position(|one| *one == key).unwrap_or_else(|| {
            known.push(key);
            known.len() - 1
        })
    };
    while found.regions.len() < known.len() {
        let (region, running) = known[found.regions.len()].clone();
        let node = &graph.nodes[region];
        let (mut steps, mut later) = (Vec::new(), None);
        if !stops(region) {
            for (index, step) in node.steps.iter().enumerate() {
                if allowed[region].as_ref().is_none_or(|one| one.steps[index]) {
                    steps.push(id(&mut known, (step.target, Vec::new())));
                }
            }
            let waits = allowed[region].as_ref().is_none_or(|one| one.waits);
            let acting = |region: usize| match &allowed[region] {
                Some(one) if !one.waits => one.acting.clone(),
                _ => Vec::new(),
            };
            later = match node.later {
                Some(next) if waits && next == region => Some(found.regions.len()),
                Some(next) if waits => {
                    let running = if runs_on && is_boundary(graph, region) {
                        acting(next)
                    } else {
                        Vec::new()
                    };
                    Some(id(&mut known, (next, running)))
                }
                Some(next) if next != region => {
                    let mut running = running.clone();
                    let then = acting(next);
                    running.retain(|one| then.contains(one));
                    (!running.is_empty()).then(|| id(&mut known, (next, running)))
                }
                _ => None,
            };
        }
        found.regions.push(region);
        found.steps.push(steps);
        found.later.push(later);
        found.runs.push(!running.is_empty());
    }
    found
}

/// Whether a delay, however short, leaves the region.
fn is_boundary(graph: &Graph, region: usize) -> bool {
    let clocks = &graph.nodes[region].state.clocks;
    let constant = i64::from(SHAPE.constant) * graph.ticks;
    clocks[1..]
        .iter()
        .any(|clock| *clock <= constant && clock % graph.ticks == 0)
}

impl Loop {
    /// Whether some run never meets the goal.
    fn can_avoid(&self, goal: &[bool]) -> bool {
        let mut staying: Vec<bool> = self.regions.iter().map(|&region| !goal[region]).collect();
        loop {
            let mut changed = false;
            for node in 0..self.regions.len() {
                let is_stuck = self.steps[node].is_empty() && self.later[node].is_none();
                let goes_on = is_stuck
                    || self.steps[node].iter().any(|&next| staying[next])
                    || self.later[node].is_some_and(|next| staying[next]);
                if staying[node] && !goes_on {
                    staying[node] = false;
                    changed = true;
                }
            }
            if !changed {
                return staying[0];
            }
        }
    }

    fn reaches(&self, holds: &[bool]) -> bool {
        self.regions.iter().any(|&region| holds[region])
    }
}

/// Whether winning regions end without a last moment somewhere.
fn has_open_end(graph: &Graph, goal: &[bool], win: &[bool]) -> bool {
    (0..graph.nodes.len()).any(|region| {
        let ends = graph.nodes[region].later.is_some_and(|later| !win[later]);
        ends && win[region] && !goal[region] && !is_boundary(graph, region)
    })
}

/// How many strategies left each freedom, and how many answers were compared where the two loops
/// differ.
#[derive(Default)]
struct Counts {
    winning: Cell<u32>,
    nearer: Cell<u32>,
    between: Cell<u32>,
}

fn count(cell: &Cell<u32>) {
    cell.set(cell.get() + 1);
}

fn compare(
    (network, goal, keep, p, seed): &(Network, Formula, Formula, Formula, u64),
    tally: &Tally,
    counts: &Counts,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let Ok(Some(graph)) = compare::regions(&model, i64::from(SHAPE.constant), true, tally) else {
        return Ok(());
    };
    let mut random = Random(seed | 1);
    let (rule, forced) = RULES[random.below(RULES.len())];
    let kind = if random.chance(70) {
        Kind::Reach
    } else {
        Kind::Until
    };
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let query = match kind {
        Kind::Until => format!("strategy S = control: A[ {keep_text} U {goal_text} ]"),
        _ => format!("strategy S = control: A<> {goal_text}"),
    };
    let win = wins(network, (goal, keep), &graph, kind, rule);
    let (goal, mut keep) = (labels(network, goal, &graph), labels(network, keep, &graph));
    if kind == Kind::Reach {
        keep.fill(true);
    }
    let options = Options {
        forced,
        priorities: Priorities::Kept,
        nodes: [Nodes::Automatic, Nodes::Symbolic, Nodes::Discrete][random.below(3)],
        ..compare::options()
    };
    let answer = try_ask(&mut model, &query, &options);
    compare::check(&answer, Ok(win[0]), tally, || {
        format!("{text}{query}\n{forced:?}")
    })?;
    if !answer.is_ok_and(|answer| answer.verdict == Verdict::Satisfied) {
        return Ok(());
    }
    let mut ask = |query: &str| {
        let answer = try_ask(&mut model, &format!("{query} under S"), &options);
        // Its limits end the making of the strategy too.
        answer
            .ok()
            .filter(|one| !matches!(one.verdict, Verdict::Unknown(_)))
    };
    let Some(reached) = ask(&format!("A<> {goal_text}")) else {
        tally.count_stopped();
        return Ok(());
    };
    let describe = || format!("{text}{query}\n{forced:?}\n{:?}", reached.message);
    prop_assert!(reached.verdict == Verdict::Satisfied, "{}", describe());
    tally.count(true);
    let in_goal = |region: usize| goal[region];
    let is_open = has_open_end(&graph, &goal, &win);
    let most = winning_moves(&graph, &goal, &win);
    let is_reached = !close(&graph, &most, in_goal, true).can_avoid(&goal);
    let message = reached.message.clone().unwrap_or_default();
    let is_winning = message.contains("stays certain");
    prop_assert!(is_winning || message.contains("nearer"), "{}", describe());
    count(if is_winning {
        &counts.winning
    } else {
        &counts.nearer
    });
    if !is_open {
        prop_assert!(
            is_winning == is_reached,
            "winning: {is_reached}\n{}",
            describe()
        );
    }
    let allowed = if is_winning {
        most
    } else {
        nearer_moves(&graph, &goal, &ranks(&graph, (&goal, &keep), rule))
    };
    let least = close(&graph, &allowed, |_| false, false);
    // What is met before the goal is restricted in any case.
    let before = close(&graph, &allowed, in_goal, true);
    let mut met = vec![false; graph.nodes.len()];
    for &region in &before.regions {
        met[region] = true;
    }
    let only_met: Vec<Option<Allowed>> = allowed
        .into_iter()
        .zip(&met)
        .map(|(one, is_met)| one.filter(|_| *is_met))
        .collect();
    let greatest = close(&graph, &only_met, |_| false, true);
    let holds = labels(network, p, &graph);
    let before_goal: Vec<bool> = holds
        .iter()
        .zip(&goal)
        .map(|(p, goal)| *p && !goal)
        .collect();
    let p = network.formula(p);
    for (query, holds) in [
        (format!("E<> {p}"), &holds),
        (format!("E<> ({p}) and not ({goal_text})"), &before_goal),
    ] {
        let (least, greatest) = (!is_open && least.reaches(holds), greatest.reaches(holds));
        let Some(answer) = ask(&query) else {
            tally.count_stopped();
            continue;
        };
        let found = answer.verdict == Verdict::Satisfied;
        prop_assert!(
            least <= found && found <= greatest,
            "{}\n{query}: {found}, not {least} to {greatest}",
            describe()
        );
        if least == greatest {
            tally.count(found);
        } else {
            count(&counts.between);
        }
    }
    Ok(())
}

#[test]
fn moves_under_a_reach_strategy_are_those_that_keep_the_win() {
    let strategy = (
        generate::network(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
        generate::formula(SHAPE),
        proptest::num::u64::ANY,
    );
    let counts = Counts::default();
    compare::run("all winning moves", 300, &strategy, |case, tally| {
        compare(case, tally, &counts)
    });
    let (winning, nearer) = (counts.winning.get(), counts.nearer.get());
    let between = counts.between.get();
    writeln!(
        std::io::stderr(),
        "{winning} strategies leave all winning moves, {nearer} those that come nearer; \
         {between} answers lie between two bounds"
    )
    .expect("standard error can be written");
    assert!(winning > 0 && nearer > 0, "{winning} and {nearer}");
}
