//! Random networks with stopwatches and `meta` variables: nothing that a walk in concrete states meets may contradict an answer or
//! lie outside a certificate that was verified, mutilated ones included.
//!
//! Reachability with stopwatches is undecidable, so that a walk cannot prove that something does not come; it stays below a value of
//! clocks and a number of states. It takes steps of half a unit, which meets all values that closed and strict bounds on two
//! clocks tell apart.
//!
//! `NETWORKS=20000 cargo test --release --test stopwatches` runs more of them than the usual number.

use std::collections::HashSet;
use std::fmt::Write as _;

use checker::engine::certificate::verify;
use checker::engine::evidence::Proof;
use checker::engine::{Answer, CodeEngine, Limits, LoadedModel, Options, Verdict};
use checker::ir::{Predicate, QueryKind};
use checker::verify::certificate::States;
use checker::verify::{Semantics, State};

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

struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 20) as usize % limit
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn one_of<'t>(&mut self, texts: &[&'t str]) -> &'t str {
        texts[self.below(texts.len())]
    }
}

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
fn walk(semantics: &Semantics<'_>) -> Vec<State> {
    let Ok(start) = semantics.initial() else {
        return Vec::new();
    };
    let mut seen = HashSet::from([start.clone()]);
    let mut met = vec![start];
    let mut next_open = 0;
    while next_open < met.len() && met.len() < LONGEST_WALK {
        let state = met[next_open].clone();
        next_open += 1;
        let moves = semantics.moves(&state).expect("guards do not fail");
        let successors = semantics.successors(&state).expect("updates do not fail");
        let mut next: Vec<State> = successors.into_iter().map(|(_, target)| target).collect();
        if !semantics.is_time_stopped(&state, &moves) {
            next.push(semantics.after(&state, 1).expect("rates are 0 or 1"));
        }
        for state in next {
            let is_near = state
                .clocks
                .iter()
                .all(|&clock| clock <= GREATEST_VALUE * TICKS);
            let is_valid = semantics
                .invariants_hold(&state)
                .expect("invariants do not fail");
            if is_near && is_valid && seen.insert(state.clone()) {
                met.push(state);
            }
        }
    }
    met
}

/// Whether a state lies in one of the zones of a certificate.
fn is_inside(states: &[States], state: &State) -> bool {
    let same = states.iter().find(|one| one.words == state.words);
    same.is_some_and(|one| {
        one.zones.iter().any(|zone| {
            zone.iter().all(|one| {
                let difference = state.clocks[one.left] - state.clocks[one.right];
                let bound = i64::from(one.bound) * TICKS;
                difference < bound || (!one.strict && difference == bound)
            })
        })
    })
}

fn load(text: &str) -> LoadedModel {
    LoadedModel::load("random.xta", text.as_bytes())
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

fn ask(model: &mut LoadedModel, text: &str, query: &str) -> Answer {
    let query_text = model.add_query(query);
    let options = Options {
        code: CodeEngine::Interpreter,
        limits: Limits {
            states: Some(MOST_STATES),
            ..Limits::default()
        },
        runs: true,
        certificate: true,
        ..Options::default()
    };
    model
        .check(&query_text, &options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")))
}

fn compiled(model: &mut LoadedModel, query: &str) -> QueryKind {
    let text = model.add_query(query);
    let (query, _) = model.compile(text.span).expect("the query is right");
    query.kind
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

/// How many certificates there were, and how many of them the check passed.
#[derive(Default)]
struct Certificates {
    made: u64,
    verified: u64,
}

fn check_certificate(
    random: &mut Random,
    (model, text): (&LoadedModel, &str),
    (query, goal): (&str, &Predicate),
    states: &[States],
    met: &[State],
) -> bool {
    let network = model.network();
    let semantics = Semantics::new(network, TICKS);
    let check = |states: &[States]| {
        let checked = verify(network, states, goal);
        if checked.holds == Some(true) {
            for state in met {
                assert!(is_inside(states, state), "{query}: {state:?}\n{text}");
                let is_met = semantics.holds(goal, state).expect("it can be evaluated");
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
    checked.holds == Some(true)
}

fn check_network(random: &mut Random, certificates: &mut Certificates) {
    let text = network(random);
    let mut model = load(&text);
    let met = walk(&Semantics::new(model.network(), TICKS));
    if met.is_empty() {
        return;
    }
    let has_meta = text.contains("meta");
    let p = condition(random);
    let query = format!("E<> {p}");
    let answer = ask(&mut model, &text, &query);
    let QueryKind::Reachable(goal) = compiled(&mut model, &query) else {
        panic!("{query}");
    };
    let semantics = Semantics::new(model.network(), TICKS);
    let is_met = met
        .iter()
        .any(|state| semantics.holds(&goal, state).expect("it can be evaluated"));
    match answer.verdict {
        Verdict::NotSatisfied => assert!(!is_met || has_meta, "{query}\n{text}"),
        Verdict::Satisfied => {
            let run = &answer.evidence.witnesses[0].run;
            assert!(
                matches!(run, Some(Proof::Replayed(..))),
                "{query}: {run:?}\n{text}"
            );
        }
        _ => {}
    }
    if let Some(certificate) = &answer.evidence.certificate {
        certificates.made += 1;
        let subject = (&model, text.as_str());
        let verified =
            check_certificate(random, subject, (&query, &goal), &certificate.states, &met);
        certificates.verified += u64::from(verified);
    }
}

#[test]
fn nothing_that_a_walk_meets_contradicts_an_answer() {
    let networks = std::env::var("NETWORKS").map_or(NETWORKS, |number| {
        number.parse().expect("a number of networks")
    });
    let mut random = Random(0x57_0b_3a_7c_11_e5);
    let mut certificates = Certificates::default();
    for _ in 0..networks {
        check_network(&mut random, &mut certificates);
    }
    let Certificates { made, verified } = certificates;
    assert!(
        made > networks / 10,
        "{made} certificates of {networks} networks"
    );
    assert!(
        verified > made * 9 / 10,
        "{verified} of {made} certificates verified"
    );
}
