//! Random networks with stopwatches and `meta` variables: nothing that a walk in concrete states
//! meets may contradict an answer or lie outside a certificate that was verified, mutilated ones
//! included.
//!
//! Reachability with stopwatches is undecidable, so that a walk cannot prove that something does
//! not come; it stays below a value of clocks and a number of states. It takes steps of half a
//! unit, which meets all values that closed and strict bounds on two clocks tell apart.
//!
//! `NETWORKS=20000 cargo test --release --test models stopwatches::` runs more of them than the
//! usual number.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::time::Duration;

use checker::engine::evidence::certificate::verify;
use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, Limits, LoadedModel, Options, Verdict};
use checker::ir::{ClockId, Predicate};
use checker::search::optimum::extremum::{Extreme, Extremes};
use checker::verify::certificate::States;
use checker::verify::{Semantics, State};

use crate::checks::{goal_of, interpreted, load, try_ask};
use crate::random::{Random, networks};

/// Networks without the environment variable `NETWORKS`.
const NETWORKS: u64 = 400;

/// States that a search stores, at most: with stopwatches one need not end.
const MOST_STATES: u64 = 2000;

/// States of a walk, at most.
const LONGEST_WALK: usize = 3000;

/// Ticks of a unit of time on a walk.
const TICKS: i64 = 2;

/// No clock of a walk exceeds this number of units.
const GREATEST_VALUE: i64 = 6;

const CLOCKS: [&str; 3] = ["x", "y", "z"];

fn atom(random: &mut Random, relations: &[&str]) -> String {
    let clock = random.one_of(&CLOCKS);
    let relation = random.one_of(relations);
    format!("{clock} {relation} {}", random.below(4))
}

fn location(random: &mut Random, has_rates: bool) -> String {
    let mut conditions = Vec::new();
    if random.chance(40) {
        conditions.push(atom(random, &["<=", "<", "<="]));
    }
    for clock in CLOCKS {
        if has_rates && random.chance(35) {
            conditions.push(format!(
                "{clock}' == {}",
                random.one_of(&["0", "0", "v > 0"])
            ));
        }
    }
    if conditions.is_empty() {
        String::new()
    } else {
        format!(" {{ {} }}", conditions.join(" && "))
    }
}

fn edge(random: &mut Random, locations: usize, sync: &str, variables: &[&str]) -> String {
    let mut guards = Vec::new();
    let mut updates = Vec::new();
    for _ in 0..random.below(3) {
        guards.push(atom(random, &["<=", "<", ">=", ">"]));
    }
    if random.chance(30) {
        guards.push(format!(
            "{} == {}",
            random.one_of(variables),
            random.below(3)
        ));
    }
    for clock in CLOCKS {
        if random.chance(30) {
            updates.push(format!("{clock} = {}", random.below(2)));
        }
    }
    if random.chance(60) {
        let (left, right) = (random.one_of(variables), random.one_of(variables));
        updates.push(match random.below(3) {
            0 => format!("{left} = {}", random.below(3)),
            1 => format!("{left} = {right}"),
            _ => format!("{left} = ({left} + 1) % 3"),
        });
    }
    let (source, target) = (random.below(locations), random.below(locations));
    let mut text = format!("L{source} -> L{target} {{");
    if !guards.is_empty() {
        let _ = write!(text, " guard {};", guards.join(" && "));
    }
    if random.chance(40) {
        let _ = write!(text, " sync {sync};");
    }
    if !updates.is_empty() {
        let _ = write!(text, " assign {};", updates.join(", "));
    }
    text + " }"
}

fn network(random: &mut Random) -> String {
    let has_rates = random.chance(80);
    let has_meta = !has_rates || random.chance(30);
    let variables: &[&str] = if has_meta { &["v", "m"] } else { &["v"] };
    let mut text = String::from("clock x, y, z; int[0,2] v;");
    if has_meta {
        text.push_str(" meta int[0,2] m;");
    }
    let _ = writeln!(text, "\n{} c;", random.one_of(&["chan", "broadcast chan"]));
    for (process, sync) in ["c!", "c?"].into_iter().enumerate() {
        let locations = 2 + random.below(2);
        let states = (0..locations).map(|index| format!("L{index}{}", location(random, has_rates)));
        let states: Vec<String> = states.collect();
        let _ = write!(text, "process P{process}() {{ state {};", states.join(", "));
        if random.chance(15) {
            let kind = random.one_of(&["urgent", "commit"]);
            let _ = write!(text, " {kind} L{};", random.below(locations));
        }
        let edges = (0..2 + random.below(3)).map(|_| edge(random, locations, sync, variables));
        let edges: Vec<String> = edges.collect();
        let _ = writeln!(text, " init L0;\n  trans {};\n}}", edges.join(",\n    "));
    }
    text + "system P0, P1;\n"
}

fn condition(random: &mut Random) -> String {
    let part = |random: &mut Random| match random.below(3) {
        0 => format!("P{}.L{}", random.below(2), random.below(2)),
        1 => format!("v == {}", random.below(3)),
        _ => atom(random, &["<=", "<", ">=", ">"]),
    };
    let (one, other) = (part(random), part(random));
    format!("{one} {} {other}", random.one_of(&["and", "and", "or"]))
}

/// States that are met by moves and waits, not necessarily all.
struct Walk<'s> {
    semantics: &'s Semantics<'s>,
    states: Vec<State>,
    /// By state: where moves and waits lead, as far as the walk went on from there.
    next: Vec<Vec<usize>>,
}

impl Walk<'_> {
    fn holds(&self, predicate: &Predicate) -> Vec<bool> {
        let holds = |state| self.semantics.holds(predicate, state);
        let states = self.states.iter();
        states
            .map(|state| holds(state).expect("it can be evaluated"))
            .collect()
    }

    /// The states from which a run of the walk stays in some for ever.
    fn staying(&self, keep: &[bool]) -> Vec<bool> {
        let mut staying = keep.to_vec();
        loop {
            let goes_on = |index: &usize| self.next[*index].iter().any(|&next| staying[next]);
            let staying_on = |index| staying[index] && goes_on(&index);
            let less: Vec<bool> = (0..keep.len()).map(staying_on).collect();
            if less == staying {
                return staying;
            }
            staying = less;
        }
    }
}

fn walk<'s>(semantics: &'s Semantics<'s>) -> Option<Walk<'s>> {
    let start = semantics.initial().ok()?;
    let mut index = HashMap::from([(start.clone(), 0)]);
    let mut states = vec![start];
    let mut arcs = Vec::new();
    while arcs.len() < states.len() && states.len() < LONGEST_WALK {
        let state = states[arcs.len()].clone();
        let moves = semantics.moves(&state).expect("guards do not fail");
        let successors = semantics.successors(&state).expect("updates do not fail");
        let mut next: Vec<State> = successors.into_iter().map(|(_, target)| target).collect();
        if !semantics.is_time_stopped(&state, &moves) {
            next.push(semantics.after(&state, 1).expect("rates are 0 or 1"));
        }
        let mut targets = Vec::new();
        for state in next {
            let is_near = state
                .clocks
                .iter()
                .all(|&clock| clock <= GREATEST_VALUE * TICKS);
            let is_valid = semantics
                .invariants_hold(&state)
                .expect("invariants do not fail");
            if is_near && is_valid {
                let count = states.len();
                let target = *index.entry(state.clone()).or_insert(count);
                targets.push(target);
                if target == count {
                    states.push(state);
                }
            }
        }
        arcs.push(targets);
    }
    arcs.resize(states.len(), Vec::new());
    Some(Walk {
        semantics,
        states,
        next: arcs,
    })
}

/// Whether a state lies in one of the zones of a certificate.
fn is_inside(states: &[States], state: &State) -> bool {
    let same = states.iter().find(|one| one.words == state.words);
    same.is_some_and(|one| {
        one.zones.iter().any(|zone| {
            zone.iter().all(|one| {
                let value = |clock: ClockId| state.clocks[clock.0 as usize];
                let difference = value(one.left) - value(one.right);
                let bound = i64::from(one.bound) * TICKS;
                difference < bound || (!one.strict && difference == bound)
            })
        })
    })
}

fn ask(model: &mut LoadedModel, text: &str, query: &str) -> Answer {
    let options = Options {
        limits: Limits {
            states: Some(MOST_STATES),
            // A greatest value beyond all constants is followed far.
            timeout: Some(Duration::from_secs(1)),
            ..Limits::default()
        },
        runs: true,
        certificate: true,
        ..interpreted()
    };
    try_ask(model, query, &options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

/// A certificate with something missing.
fn mutilated(random: &mut Random, states: &[States]) -> Vec<States> {
    let mut states = states.to_vec();
    let state = random.below(states.len());
    let zones = &mut states[state].zones;
    if zones.is_empty() || random.chance(20) {
        states.remove(state);
        return states;
    }
    let zone = random.below(zones.len());
    if zones[zone].is_empty() || random.chance(30) {
        zones.remove(zone);
    } else {
        let one = random.below(zones[zone].len());
        zones[zone][one].bound -= 1;
    }
    states
}

/// What there was.
#[derive(Debug, Default)]
struct Tally {
    certificates: u64,
    verified: u64,
    sure: u64,
    doubtful: u64,
}

impl Tally {
    fn count(&mut self, verdict: Verdict) {
        self.sure += u64::from(matches!(
            verdict,
            Verdict::Satisfied | Verdict::NotSatisfied
        ));
        self.doubtful += u64::from(verdict == Verdict::Maybe);
    }
}

fn check_certificate(
    random: &mut Random,
    (model, text): (&LoadedModel, &str),
    (query, goal): (&str, &Predicate),
    states: &[States],
    walk: &Walk<'_>,
    tally: &mut Tally,
) {
    let is_met = walk.holds(goal);
    let check = |states: &[States]| {
        let checked = verify(model.network(), states, goal);
        if checked.holds == Some(true) {
            for (state, is_met) in walk.states.iter().zip(&is_met) {
                assert!(is_inside(states, state), "{query}: {state:?}\n{text}");
                assert!(!is_met, "{query}: {state:?}\n{text}");
            }
        }
        checked
    };
    for _ in 0..4 {
        check(&mutilated(random, states));
    }
    let checked = check(states);
    assert_ne!(
        checked.holds,
        Some(false),
        "{query}: {:?}\n{text}",
        checked.lines
    );
    tally.certificates += 1;
    tally.verified += u64::from(checked.holds == Some(true));
}

/// Values are at least as far out as those that were met.
fn check_values(
    (model, text): (&mut LoadedModel, &str),
    walk: &Walk<'_>,
    (p, counting): (&str, &[bool]),
    clock: usize,
    is_exact: bool,
) -> Verdict {
    let query = format!("bounds{{{p}}}: {}", CLOCKS[clock]);
    let answer = ask(model, text, &query);
    let Some(values) = answer.value else {
        return answer.verdict;
    };
    let Extremes { least, greatest } = values.items[0];
    let met = walk
        .states
        .iter()
        .zip(counting)
        .filter(|(_, counts)| **counts);
    for (state, _) in met {
        let value = state.clocks[1 + clock];
        let is_within = |extreme: Option<Extreme>, is_least: bool| match extreme {
            None => false,
            Some(Extreme::Infinite) => true,
            Some(Extreme::Value { value: limit, .. }) if is_least => {
                i64::from(limit) * TICKS <= value
            }
            Some(Extreme::Value { value: limit, .. }) => value <= i64::from(limit) * TICKS,
        };
        assert!(
            !is_exact || is_within(least, true) && is_within(greatest, false),
            "{query}: {values:?}, met {state:?}\n{text}"
        );
    }
    answer.verdict
}

fn check_network(random: &mut Random, tally: &mut Tally) {
    let text = network(random);
    let mut model = load(&text);
    let (p, q) = (condition(random), condition(random));
    let predicates = [&p, &q].map(|one| goal_of(&mut model, &format!("E<> {one}")));
    // Code of queries is part of the network.
    let network = model.network().clone();
    let semantics = Semantics::new(&network, TICKS);
    let Some(walk) = walk(&semantics) else {
        return;
    };
    let [holds_p, holds_q] = [0, 1].map(|index| walk.holds(&predicates[index]));
    let avoiding: Vec<bool> = holds_q.iter().map(|holds| !holds).collect();
    let avoiding = walk.staying(&avoiding);
    let mut is_open = holds_p.iter().zip(&avoiding);
    let (no, yes) = (Verdict::NotSatisfied, Verdict::Satisfied);
    // Which of two states that differ in a `meta` variable is kept may decide.
    let is_exact = !text.contains("meta");
    for (query, is_met, contradiction) in [
        (format!("E<> {p}"), holds_p.contains(&true), no),
        (format!("E[] {p}"), walk.staying(&holds_p)[0], no),
        (format!("A<> {q}"), avoiding[0], yes),
        (
            format!("{p} --> {q}"),
            is_open.any(|(p, avoiding)| *p && *avoiding),
            yes,
        ),
    ] {
        let answer = ask(&mut model, &text, &query);
        tally.count(answer.verdict);
        let is_wrong = is_met && is_exact && answer.verdict == contradiction;
        assert!(!is_wrong, "{query}: {:?}\n{text}", answer.verdict);
        for witness in &answer.evidence.witnesses {
            let is_right = !matches!(witness.run, Some(Proof::Violated(..) | Proof::Impossible));
            assert!(is_right, "{query}: {:?}\n{text}", witness.run);
        }
        if let Some(certificate) = &answer.evidence.certificate {
            let subject = (&model, text.as_str());
            let goal = (query.as_str(), &predicates[0]);
            check_certificate(random, subject, goal, &certificate.states, &walk, tally);
        }
    }
    let clock = random.below(CLOCKS.len());
    let verdict = check_values((&mut model, &text), &walk, (&p, &holds_p), clock, is_exact);
    tally.count(verdict);
}

#[test]
fn nothing_that_a_walk_meets_contradicts_an_answer() {
    let networks = networks(NETWORKS);
    let mut random = Random::of_network(1);
    let mut tally = Tally::default();
    for _ in 0..networks {
        check_network(&mut random, &mut tally);
    }
    assert!(tally.certificates > networks / 10, "{tally:?}");
    assert!(tally.verified > tally.certificates * 9 / 10, "{tally:?}");
    assert!(tally.doubtful < tally.sure / 10, "{tally:?}");
}
