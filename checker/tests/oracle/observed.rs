//! Games under partial observation, against the subset construction on the graph of regions.
//!
//! Regions are exact here: two valuations of one region allow the same observations, moves and
//! goals, now and after delays into the same regions, and a controller that sees observations only
//! cannot tell how long it takes. So plays over regions have the same observations as plays over
//! valuations. Where time passes from region to region, an observation `x >= c` or `x < c` changes
//! when a region is entered, and so does what is possible for the controller: strict lower bounds
//! are not generated for it.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use checker::engine::format::machine_json;
use checker::engine::query::partial_observation;
use checker::engine::{LoadedModel, Options, Rules, Verdict};
use checker::game::Forced;
use checker::game::partial_observation::Machine;
use checker::ir::{ChannelId, Control, Part, QueryKind};
use checker::verify::Effort;
use checker::verify::observed::{Action, MachineState};
use checker::verify::strategy::Outcome;
use proptest::collection::vec;
use proptest::prelude::{Strategy, any};
use proptest::test_runner::TestCaseError;

use crate::checks::{load, try_ask};
use crate::compare::{self, Tally};
use crate::explicit::{self, Graph, Label, Objective, Rule, winning};
use crate::games::{RULES, labels};
use crate::generate::{self, Formula, Network, Shape};

const SHAPE: Shape = Shape {
    clocks: 2,
    constant: 3,
    strict_invariants: false,
    uncontrollable: true,
    deadlock: false,
    priorities: false,
    guarded_urgency: false,
    legs: false,
};

/// Knowledge sets that brute force explores before it gives a case up.
const MOST_SETS: usize = 400;

/// Places of a machine and a region that a check goes through before it gives up.
const MOST_PLACES: u64 = 20_000;

/// What is seen and what is wanted, region by region.
struct Game<'g> {
    graph: &'g Graph,
    seen: &'g [Vec<bool>],
    objective: &'g Objective<'g>,
    rule: Rule,
}

/// A knowledge set.
type Set = BTreeSet<usize>;

impl Game<'_> {
    /// The sets that the action leads to, by what is seen in them; `None` if play may be lost
    /// before.
    fn outcome(&self, from: &Set, action: Option<Label>) -> Option<Vec<Set>> {
        let nodes = &self.graph.nodes;
        let Objective {
            goal,
            keep,
            must_reach,
        } = *self.objective;
        let here = &self.seen[*from.first()?];
        let mut exits: BTreeMap<&Vec<bool>, Set> = BTreeMap::new();
        let mut inside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut waiting: Vec<usize> = from.iter().copied().collect();
        while let Some(index) = waiting.pop() {
            if inside.contains_key(&index) {
                continue;
            }
            if !keep[index] {
                return None;
            }
            let node = &nodes[index];
            let is_proposed =
                |step: &&explicit::Step| step.controllable && Some(step.label) == action;
            let own = node.steps.iter().filter(is_proposed);
            let others = node.steps.iter().filter(|step| !step.controllable);
            let controllable: Vec<_> = node.steps.iter().filter(|step| step.controllable).collect();
            let mut next: Vec<usize> = own.clone().map(|step| step.target).collect();
            let is_possible = !next.is_empty();
            next.extend(others.clone().map(|step| step.target));
            match node.later {
                _ if is_possible => {}
                Some(later) => next.push(later),
                None if others.count() > 0
                    && explicit::is_forced(&node.stoppers, &controllable, self.rule) => {}
                None if must_reach || !controllable.is_empty() => return None,
                None => {}
            }
            let mut edges = Vec::new();
            for target in next.into_iter().filter(|&target| !goal[target]) {
                if self.seen[target] == *here {
                    edges.push(target);
                    waiting.push(target);
                } else {
                    exits.entry(&self.seen[target]).or_default().insert(target);
                }
            }
            inside.insert(index, edges);
        }
        if must_reach && goes_on_for_ever(&inside) {
            return None;
        }
        Some(exits.into_values().collect())
    }

    /// Whether the controller wins; `None` if there are too many knowledge sets.
    fn is_won(&self) -> Option<bool> {
        if self.objective.goal[0] {
            return Some(true);
        }
        let steps = self.graph.nodes.iter().flat_map(|node| &node.steps);
        let labels: BTreeSet<Label> = steps
            .filter(|step| step.controllable)
            .map(|step| step.label)
            .collect();
        let mut actions: Vec<Option<Label>> = labels.into_iter().map(Some).collect();
        actions.push(None);
        let mut sets = vec![Set::from([0])];
        let mut numbers = HashMap::from([(sets[0].clone(), 0)]);
        let mut choices: Vec<Vec<Vec<usize>>> = Vec::new();
        while choices.len() < sets.len() {
            if sets.len() > MOST_SETS {
                return None;
            }
            let set = sets[choices.len()].clone();
            let outcomes = actions
                .iter()
                .filter_map(|&action| self.outcome(&set, action));
            let outcomes: Vec<Vec<Set>> = outcomes.collect();
            let number = |target: Set| {
                *numbers.entry(target.clone()).or_insert_with(|| {
                    sets.push(target);
                    sets.len() - 1
                })
            };
            let mut number = number;
            let outcomes = outcomes
                .into_iter()
                .map(|exits| exits.into_iter().map(&mut number).collect());
            choices.push(outcomes.collect());
        }
        let mut win = vec![!self.objective.must_reach; sets.len()];
        loop {
            let wins = choices.iter().map(|choices| {
                let mut choices = choices.iter();
                choices.any(|targets| targets.iter().all(|&target| win[target]))
            });
            let wins: Vec<bool> = wins.collect();
            if wins == win {
                return Some(win[0]);
            }
            win = wins;
        }
    }
}

/// Whether a machine wins: the sets that its actions lead to, one after the other, are never lost
/// and, if the goal must be reached, come to an end. `None` if there are too many.
fn wins(game: &Game<'_>, machine: &[MachineState]) -> Option<bool> {
    if game.objective.goal[0] {
        return Some(true);
    }
    let mut numbers = BTreeMap::from([((0, Set::from([0])), 0)]);
    let mut waiting = vec![(0, Set::from([0]))];
    let mut edges: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    while let Some((state, set)) = waiting.pop() {
        if numbers.len() > MOST_SETS {
            return None;
        }
        let here = numbers[&(state, set.clone())];
        let label = match machine[state].action {
            Action::Wait => None,
            Action::Channel(channel) => Some(Label::Channel(channel.0)),
            Action::Edge(part) => Some(Label::Edge(part.process, part.edge, part.select)),
        };
        let Some(exits) = game.outcome(&set, label) else {
            return Some(false);
        };
        let mut targets = Vec::new();
        for exit in exits {
            let seen = &game.seen[*exit.first().expect("no exit is empty")];
            let mut next = machine[state].next.iter();
            let Some((_, next)) = next.find(|(one, _)| one == seen) else {
                return Some(false);
            };
            let place = (*next, exit);
            let number = numbers.len();
            targets.push(*numbers.entry(place.clone()).or_insert_with(|| {
                waiting.push(place);
                number
            }));
        }
        edges.insert(here, targets);
    }
    Some(!(game.objective.must_reach && goes_on_for_ever(&edges)))
}

/// The check in closed loop says of a machine, and of the same with another action in one of its
/// states, what brute force says.
fn check_machine(
    model: &mut LoadedModel,
    query: &str,
    (game, forced): (&Game<'_>, Forced),
    machine: &Machine,
) -> Result<(), TestCaseError> {
    let text = model.add_query(query);
    let (compiled, _) = model.compile(text.span).expect("it was answered");
    let QueryKind::Control(Control {
        objective,
        observations: Some(observations),
        ..
    }) = &compiled.kind
    else {
        panic!("it is a game with observations");
    };
    let network = model.network();
    let states = machine_json::to_check(machine);
    let file = machine_json::write(network, machine, query);
    let again = machine_json::read(network, &file, observations.len());
    let again = again.map_err(|mismatch| TestCaseError::fail(format!("{mismatch:?}")))?;
    let (before, after) = (format!("{states:?}"), format!("{again:?}"));
    if before != after {
        return Err(TestCaseError::fail(format!("{before} is read as {after}")));
    }
    let steps = game.graph.nodes.iter().flat_map(|node| &node.steps);
    let labels: BTreeSet<Label> = steps
        .filter(|step| step.controllable)
        .map(|step| step.label)
        .collect();
    let actions = labels.into_iter().map(|label| match label {
        Label::Channel(channel) => Action::Channel(ChannelId(channel)),
        Label::Edge(process, edge, select) => Action::Edge(Part {
            process,
            edge,
            branch: 0,
            select,
        }),
    });
    let actions: Vec<Action> = actions.chain([Action::Wait]).collect();
    for changed in 0..states.len().min(4) {
        for &action in &actions {
            let mut states = states.clone();
            states[changed].action = action;
            let Some(expected) = wins(game, &states) else {
                continue;
            };
            let rules = Rules {
                forced,
                ..Rules::default()
            };
            let checked = partial_observation::verify(
                network,
                objective,
                observations,
                &states,
                rules,
                &mut Effort::up_to(MOST_PLACES),
            );
            let is_right = match checked {
                Ok(Outcome::Verified(_)) => expected,
                Ok(Outcome::Violated(..)) => !expected,
                _ => continue,
            };
            if !is_right {
                return Err(TestCaseError::fail(format!(
                    "{query}\n{forced:?}\n{states:#?}\nbrute force says {expected}, the check {checked:?}"
                )));
            }
        }
    }
    Ok(())
}

/// Whether a graph has a cycle: nodes that lead nowhere else are taken away until there is none.
fn goes_on_for_ever(edges: &BTreeMap<usize, Vec<usize>>) -> bool {
    let mut left: BTreeSet<usize> = edges.keys().copied().collect();
    loop {
        let goes_on = |node: &usize| edges[node].iter().any(|target| left.contains(target));
        let next: BTreeSet<usize> = left.iter().copied().filter(goes_on).collect();
        if next.len() == left.len() {
            return !left.is_empty();
        }
        left = next;
    }
}

fn compare(
    (network, observations, (goal, keep)): &(Network, Vec<Formula>, (Formula, Formula)),
    tally: &Tally,
) -> Result<(), TestCaseError> {
    let text = network.text();
    let mut model = load(&text);
    let has_differences = generate::has_differences(goal) || generate::has_differences(keep);
    let constant = i64::from(SHAPE.constant);
    let Ok(Some(graph)) = compare::regions(&model, constant, has_differences, tally) else {
        return Ok(());
    };
    let labels = |formula: &Formula| labels(network, formula, &graph);
    let columns: Vec<Vec<bool>> = observations.iter().map(labels).collect();
    let seen: Vec<Vec<bool>> = (0..graph.nodes.len())
        .map(|node| columns.iter().map(|column| column[node]).collect())
        .collect();
    let shown: Vec<String> = observations
        .iter()
        .map(|one| network.formula(one))
        .collect();
    let shown = shown.join(", ");
    let (goal_text, keep_text) = (network.formula(goal), network.formula(keep));
    let (goals, kept) = (labels(goal), labels(keep));
    let asked = Asked {
        graph: &graph,
        seen: &seen,
        text: &text,
        observations: &shown,
        goal: (&goal_text, &goals),
        keep: (&keep_text, &kept),
    };
    asked.compare(&mut model, tally)
}

/// What is asked of one model.
struct Asked<'a> {
    graph: &'a Graph,
    seen: &'a [Vec<bool>],
    text: &'a str,
    observations: &'a str,
    /// As text, and region by region.
    goal: (&'a str, &'a [bool]),
    keep: (&'a str, &'a [bool]),
}

impl Asked<'_> {
    /// Compares all objectives under all rules.
    fn compare(&self, model: &mut LoadedModel, tally: &Tally) -> Result<(), TestCaseError> {
        let Asked {
            graph,
            seen,
            text,
            observations,
            ..
        } = *self;
        let ((goal_text, goals), (keep_text, kept)) = (self.goal, self.keep);
        let never = vec![false; seen.len()];
        let always = vec![true; seen.len()];
        for (query, goal, keep, must_reach) in [
            (format!("A<> {goal_text}"), goals, &always[..], true),
            (format!("A[ {keep_text} U {goal_text} ]"), goals, kept, true),
            (format!("A[] {keep_text}"), &never[..], kept, false),
            (
                format!("A[ {keep_text} W {goal_text} ]"),
                goals,
                kept,
                false,
            ),
        ] {
            let objective = Objective {
                goal,
                keep,
                must_reach,
            };
            for (rule, forced) in RULES {
                let game = Game {
                    graph,
                    seen,
                    objective: &objective,
                    rule,
                };
                let Some(expected) = game.is_won() else {
                    continue;
                };
                let query = format!("{{{observations}}} control: {query}");
                let options = Options {
                    forced,
                    verify: true,
                    ..compare::options()
                };
                let answer = try_ask(model, &query, &options);
                let describe = || format!("{text}{query}\n{forced:?}");
                compare::check(&answer, Ok(expected), tally, describe)?;
                compare::check_strategy(model, &answer, tally, describe)?;
                let machine = answer.as_ref().ok();
                if let Some(machine) = machine.and_then(|one| one.evidence.machine.clone()) {
                    check_machine(model, &query, (&game, forced), &machine)
                        .map_err(|error| TestCaseError::fail(format!("{text}{error}")))?;
                }
                let is_won = answer.is_ok_and(|answer| answer.verdict == Verdict::Satisfied);
                if is_won && !winning(graph, &objective, rule)[0] {
                    let text = describe();
                    return Err(TestCaseError::fail(format!("{text}\nlost if all is seen")));
                }
            }
        }
        Ok(())
    }
}

#[test]
fn games_under_partial_observation_equal_the_subset_construction() {
    let strategy = (
        generate::observable_network(SHAPE),
        vec(generate::observation(SHAPE), 1..=3),
        (generate::formula(SHAPE), generate::formula(SHAPE)),
    );
    compare::run("games under partial observation", 150, &strategy, compare);
}

/// A game in two rounds that follow each other, each with locations of its own: in each an action
/// leads to some locations of the next round, of which the environment chooses one. Without clocks
/// many knowledge sets contain others.
#[derive(Clone, Debug)]
struct Rounds {
    /// By round, location and action: where it leads to.
    targets: [Vec<[Vec<usize>; ACTIONS]>; 2],
    /// By round and location: whether it looks different, is a goal, and is to be kept out of.
    marks: [Vec<(bool, bool, bool)>; 2],
}

/// The actions of a game in rounds.
const ACTIONS: usize = 3;

fn rounds() -> impl Strategy<Value = Rounds> {
    (3..=6_usize).prop_flat_map(|count| {
        let led = || vec(vec(0..count, 0..=2), ACTIONS);
        let led = move || led().prop_map(|led| led.try_into().expect("there are so many actions"));
        let mark = || {
            (any::<bool>(), 0..4_u8, 0..5_u8)
                .prop_map(|(looks, goal, bad)| (looks, goal == 0, bad == 0))
        };
        let targets = [vec(led(), count), vec(led(), count)];
        let marks = [vec(mark(), count), vec(mark(), count)];
        (targets, marks).prop_map(|(targets, marks)| Rounds { targets, marks })
    })
}

impl Rounds {
    fn text(&self) -> String {
        let count = self.marks[0].len();
        let name = |round: usize, index: usize| format!("{}{index}", ["L", "M"][round]);
        let names: Vec<String> = (0..2 * count)
            .map(|one| name(one / count, one % count))
            .collect();
        let mut edges = Vec::new();
        for (round, locations) in self.targets.iter().enumerate() {
            for (index, actions) in locations.iter().enumerate() {
                for (action, targets) in actions.iter().enumerate() {
                    for &target in targets {
                        let (from, to) = (name(round, index), name(1 - round, target));
                        edges.push(format!("{from} -> {to} {{ sync c[{action}]?; }}"));
                    }
                }
            }
        }
        let names = names.join(", ");
        let edges = if edges.is_empty() {
            String::new()
        } else {
            format!("trans {};", edges.join(", "))
        };
        format!(
            "chan c[{ACTIONS}];\nprocess P() {{ state {names}; urgent {names}; init L0; {edges} }}\n\
             process C() {{ state I; init I; trans I -> I {{ select a : int[0, {ACTIONS} - 1]; sync c[a]!; }}; }}\nsystem P, C;\n"
        )
    }

    /// The locations with a mark as a predicate, and whether each has it.
    fn marked(&self, is_marked: impl Fn(usize, (bool, bool, bool)) -> bool) -> (String, Vec<bool>) {
        let count = self.marks[0].len();
        let marks = self.marks.iter().enumerate();
        let has: Vec<bool> = marks
            .flat_map(|(round, marks)| marks.iter().map(move |&mark| (round, mark)))
            .map(|(round, mark)| is_marked(round, mark))
            .collect();
        let names = (0..has.len()).filter(|&one| has[one]);
        let names: Vec<String> = names
            .map(|one| format!("P.{}{}", ["L", "M"][one / count], one % count))
            .collect();
        let text = if names.is_empty() {
            "false".to_owned()
        } else {
            names.join(" || ")
        };
        (format!("({text})"), has)
    }
}

fn compare_rounds(rounds: &Rounds, tally: &Tally) -> Result<(), TestCaseError> {
    let text = rounds.text();
    let mut model = load(&text);
    let Ok(Some(graph)) = compare::regions(&model, 0, false, tally) else {
        return Ok(());
    };
    let at = |has: &[bool]| -> Vec<bool> {
        let nodes = graph.nodes.iter();
        nodes
            .map(|node| has[node.state.words[0] as usize])
            .collect()
    };
    let (second, is_second) = rounds.marked(|round, _| round == 1);
    let (looks, is_different) = rounds.marked(|_, mark| mark.0);
    let (goal_text, is_goal) = rounds.marked(|_, mark| mark.1);
    let (keep_text, is_kept) = rounds.marked(|_, mark| !mark.2);
    let (is_second, is_different) = (at(&is_second), at(&is_different));
    let seen: Vec<Vec<bool>> = (0..graph.nodes.len())
        .map(|node| vec![is_second[node], is_different[node]])
        .collect();
    let (goals, kept) = (at(&is_goal), at(&is_kept));
    let observations = format!("{second}, {looks}");
    let asked = Asked {
        graph: &graph,
        seen: &seen,
        text: &text,
        observations: &observations,
        goal: (&goal_text, &goals),
        keep: (&keep_text, &kept),
    };
    asked.compare(&mut model, tally)
}

#[test]
fn games_whose_knowledge_sets_contain_each_other_equal_the_subset_construction() {
    let name = "games in rounds under partial observation";
    compare::run(name, 150, &rounds(), compare_rounds);
}

/// A belt that is stopped when it was seen to run long enough, and goes on after a rest; all
/// constants are multiplied by a factor.
fn belt(factor: i64) -> String {
    let times = |value: i64| value * factor;
    format!(
        "
clock move, load, rest;
bool heavy;
chan stop, go;
process Belt() {{
  state Rest, Loads {{ load <= {loaded} }}, Runs {{ move <= {far} }}, Full {{ load <= {kept} }}, Jam;
  init Rest;
  trans Rest -u-> Loads {{ guard rest >= {pause}; assign load = 0; }},
        Loads -u-> Runs {{ guard load >= {slow}; assign move = 0; }},
        Loads -u-> Runs {{ guard load < {quick}; assign move = 0, heavy = true; }},
        Runs -> Full {{ guard move >= {near}; sync stop?; assign rest = 0; }},
        Runs -u-> Jam {{ guard move >= {jam}; }},
        Full -> Rest {{ guard rest >= {short}; sync go?; assign rest = 0, heavy = false; }},
        Full -u-> Jam {{ guard rest >= {long}; }};
}}
process Hand() {{
  state Ready;
  init Ready;
  trans Ready -> Ready {{ sync stop!; }}, Ready -> Ready {{ sync go!; }};
}}
system Belt, Hand;
",
        loaded = times(5),
        far = times(9),
        kept = times(11),
        pause = times(3),
        slow = times(2),
        quick = times(2) - 1,
        near = times(4),
        jam = times(8),
        short = times(1),
        long = times(3),
    )
}

#[test]
fn checks_of_machines_do_not_count_up_to_constants() {
    for factor in [2, 250_000] {
        let mut model = load(&belt(factor));
        let (near, rest) = (5 * factor, 2 * factor);
        let query = format!(
            "{{Belt.Runs, Belt.Full, move >= {near}, rest >= {rest}}} control: A[] not Belt.Jam"
        );
        let options = Options {
            verify: true,
            ..compare::options()
        };
        let answer = try_ask(&mut model, &query, &options).expect("it is answered");
        assert_eq!(answer.verdict, Verdict::Satisfied, "{factor}");
        let check = answer.evidence.verification.expect("it was asked for");
        assert!(
            matches!(&check, Ok(Outcome::Verified(_))),
            "{factor}: {check:?}"
        );
        let text = model.add_query(&query);
        let (compiled, _) = model.compile(text.span).expect("it was answered");
        let QueryKind::Control(Control {
            objective,
            observations: Some(observations),
            ..
        }) = &compiled.kind
        else {
            panic!("it is a game with observations");
        };
        let mut states =
            machine_json::to_check(&answer.evidence.machine.expect("there is a machine"));
        let acting = states.iter_mut().find(|one| one.action != Action::Wait);
        acting.expect("it stops the belt").action = Action::Wait;
        let rules = options.rules();
        let network = model.network();
        let effort = &mut Effort::up_to(2_000_000);
        let checked =
            partial_observation::verify(network, objective, observations, &states, rules, effort);
        assert!(
            matches!(&checked, Ok(Outcome::Violated(..))),
            "{factor}: {checked:?}"
        );
    }
}
