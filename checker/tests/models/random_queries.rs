//! The answers to queries on random networks against a search of the region graph, written from the
//! definitions and sharing nothing with the engine but the text of the model.
//!
//! A region fixes the integer parts of all clocks up to [`TOP`], which of them have no fraction,
//! and the order of the fractions (Alur and Dill, "A Theory of Timed Automata", 1994). Networks
//! have two processes of two or three locations, two clocks, one channel of any kind, constants up
//! to 3, committed and urgent locations, and priorities.
//!
//! `NETWORKS=50000 cargo test --release --test models random_queries::` runs more of them than the
//! usual number.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use checker::engine::evidence::witness::Proof;
use checker::engine::{Limits, Options, Rules, TraceWanted, Verdict};
use checker::search::optimum::extremum::Extreme;
use checker::verify::replay::End;

use crate::checks::{interpreted, load, try_ask};
use crate::random::{Random, networks};

/// No network needs so many states: a search that stores them does not end.
const MOST_STATES: u64 = 5000;

/// Above this the region graph does not tell values of clocks apart.
const TOP: i32 = 6;

/// `clock relation constant`, with the relations `<`, `<=`, `>=`, `>`.
#[derive(Clone, Copy)]
struct Atom {
    clock: usize,
    relation: usize,
    constant: i32,
}

const RELATIONS: [&str; 4] = ["<", "<=", ">=", ">"];
const CLOCKS: [&str; 2] = ["x", "y"];

impl Atom {
    fn random(random: &mut Random) -> Atom {
        Atom {
            clock: random.below(2),
            relation: random.below(4),
            constant: random.below(4) as i32,
        }
    }

    fn text(self) -> String {
        let Atom {
            clock,
            relation,
            constant,
        } = self;
        format!("{} {} {constant}", CLOCKS[clock], RELATIONS[relation])
    }

    fn holds(self, region: &Region) -> bool {
        // Twice the value, with 1 for any fraction.
        let (whole, rank) = region[self.clock];
        let value = 2 * whole + i32::from(rank > 0);
        let constant = 2 * self.constant;
        match self.relation {
            0 => value < constant,
            1 => value <= constant,
            2 => value >= constant,
            _ => value > constant,
        }
    }
}

struct Location {
    invariant: Vec<Atom>,
    /// 0 normal, 1 urgent, 2 committed.
    urgency: u64,
}

struct Edge {
    source: usize,
    target: usize,
    guard: Vec<Atom>,
    resets: Vec<usize>,
    /// 0 internal, 1 sends, 2 receives.
    sync: usize,
}

struct Network {
    locations: [Vec<Location>; 2],
    edges: [Vec<Edge>; 2],
    is_urgent: bool,
    is_broadcast: bool,
    /// 0 none, 1 the channel above internal edges, 2 below, 3 the second process above the first.
    priority: usize,
}

/// Of each clock the integer part and the rank of its fraction, 0 for none; `(TOP, 1)` is anything
/// above.
type Region = [(i32, i32); 2];
type State = ([usize; 2], Region);

impl Network {
    fn random(random: &mut Random) -> Network {
        let locations = [(); 2].map(|()| {
            let count = 2 + random.below(2);
            let location = |index: usize, random: &mut Random| Location {
                invariant: if random.chance(45) {
                    let mut atom = Atom::random(random);
                    atom.relation %= 2;
                    atom.constant += i32::from(atom.relation == 0 && index == 0);
                    vec![atom]
                } else {
                    Vec::new()
                },
                urgency: match random.below(12) {
                    0 => 2,
                    1 => 1,
                    _ => 0,
                },
            };
            (0..count)
                .map(|index| location(index, random))
                .collect::<Vec<_>>()
        });
        let edges = [0, 1].map(|process: usize| {
            let places = locations[process].len();
            let edge = |random: &mut Random| Edge {
                source: random.below(places),
                target: random.below(places),
                guard: (0..random.below(3)).map(|_| Atom::random(random)).collect(),
                resets: (0..2).filter(|_| random.chance(35)).collect(),
                sync: random.below(2) * (1 + process),
            };
            (0..2 + random.below(3))
                .map(|_| edge(random))
                .collect::<Vec<_>>()
        });
        Network {
            locations,
            edges,
            is_urgent: random.chance(25),
            is_broadcast: random.chance(40),
            priority: random.below(8),
        }
    }

    fn text(&self) -> String {
        let mut text = String::from("clock x, y;\n");
        let urgent = if self.is_urgent { "urgent " } else { "" };
        let broadcast = if self.is_broadcast { "broadcast " } else { "" };
        let _ = writeln!(text, "{urgent}{broadcast}chan c;");
        match self.priority {
            1 => text.push_str("chan priority default < c;\n"),
            2 => text.push_str("chan priority c < default;\n"),
            _ => {}
        }
        for process in 0..2 {
            let _ = write!(text, "process P{process}() {{ state ");
            for (index, location) in self.locations[process].iter().enumerate() {
                let invariant: Vec<_> = location.invariant.iter().map(|atom| atom.text()).collect();
                let comma = if index > 0 { ", " } else { "" };
                let _ = write!(text, "{comma}L{index}");
                if !invariant.is_empty() {
                    let _ = write!(text, " {{ {} }}", invariant.join(" && "));
                }
            }
            text.push(';');
            for (index, location) in self.locations[process].iter().enumerate() {
                match location.urgency {
                    1 => drop(write!(text, " urgent L{index};")),
                    2 => drop(write!(text, " commit L{index};")),
                    _ => {}
                }
            }
            text.push_str(" init L0; trans\n");
            for (index, edge) in self.edges[process].iter().enumerate() {
                let guard: Vec<_> = edge.guard.iter().map(|atom| atom.text()).collect();
                let resets: Vec<_> = edge
                    .resets
                    .iter()
                    .map(|&clock| format!("{} = 0", CLOCKS[clock]))
                    .collect();
                let comma = if index > 0 { ",\n" } else { "" };
                let _ = write!(text, "{comma}  L{} -> L{} {{", edge.source, edge.target);
                if !guard.is_empty() {
                    let _ = write!(text, " guard {};", guard.join(" && "));
                }
                match edge.sync {
                    1 => text.push_str(" sync c!;"),
                    2 => text.push_str(" sync c?;"),
                    _ => {}
                }
                if !resets.is_empty() {
                    let _ = write!(text, " assign {};", resets.join(", "));
                }
                text.push_str(" }");
            }
            text.push_str(";\n}\n");
        }
        text.push_str(if self.priority == 3 {
            "system P0 < P1;\n"
        } else {
            "system P0, P1;\n"
        });
        text
    }

    fn is_valid(&self, (places, region): &State) -> bool {
        (0..2).all(|process| {
            let invariant = &self.locations[process][places[process]].invariant;
            invariant.iter().all(|atom| atom.holds(region))
        })
    }

    /// The combinations of edges whose guards hold, with whether they synchronise.
    fn enabled(&self, (places, region): &State) -> Vec<(Vec<(usize, usize)>, bool)> {
        let open = |process: usize, sync: usize| {
            let edges = self.edges[process].iter().enumerate();
            let is_open = |edge: &Edge| {
                edge.source == places[process]
                    && edge.sync == sync
                    && edge.guard.iter().all(|atom| atom.holds(region))
            };
            edges
                .filter(|(_, edge)| is_open(edge))
                .map(|(index, _)| index)
                .collect::<Vec<_>>()
        };
        let mut found = Vec::new();
        for process in 0..2 {
            found.extend(
                open(process, 0)
                    .into_iter()
                    .map(|edge| (vec![(process, edge)], false)),
            );
        }
        let receivers = open(1, 2);
        for sender in open(0, 1) {
            if self.is_broadcast && receivers.is_empty() {
                found.push((vec![(0, sender)], true));
            }
            found.extend(
                receivers
                    .iter()
                    .map(|&receiver| (vec![(0, sender), (1, receiver)], true)),
            );
        }
        found
    }

    fn is_committed(&self, places: [usize; 2], process: usize) -> bool {
        self.locations[process][places[process]].urgency == 2
    }

    fn successors(&self, state: &State) -> Vec<State> {
        let some_committed = (0..2).any(|process| self.is_committed(state.0, process));
        let mut found: Vec<((u64, u64), State)> = Vec::new();
        for (parts, is_sync) in self.enabled(state) {
            if some_committed && !parts.iter().any(|part| self.is_committed(state.0, part.0)) {
                continue;
            }
            let mut next = *state;
            for &(process, edge) in &parts {
                let edge = &self.edges[process][edge];
                next.0[process] = edge.target;
                edge.resets.iter().for_each(|&clock| next.1[clock] = (0, 0));
            }
            next.1 = normal(next.1);
            if self.is_valid(&next) {
                let level = match self.priority {
                    1 => (u64::from(is_sync), 0),
                    2 => (u64::from(!is_sync), 0),
                    3 => (0, parts.iter().map(|part| part.0 as u64).max().unwrap_or(0)),
                    _ => (0, 0),
                };
                found.push((level, next));
            }
        }
        let highest = found.iter().map(|one| one.0).max();
        found
            .into_iter()
            .filter(|one| Some(one.0) == highest)
            .map(|one| one.1)
            .collect()
    }

    fn is_stopped(&self, state: &State) -> bool {
        self.is_urgent
            && self.enabled(state).iter().any(|(parts, is_sync)| {
                let may_go = !(0..2).any(|process| self.is_committed(state.0, process))
                    || parts.iter().any(|part| self.is_committed(state.0, part.0));
                *is_sync && may_go
            })
    }

    /// The next region in time, if time may pass; the last region is its own.
    fn later(&self, state: &State) -> Option<State> {
        let is_urgent = (0..2).any(|process| self.locations[process][state.0[process]].urgency > 0);
        if is_urgent || self.is_stopped(state) {
            return None;
        }
        let next = (state.0, passed(state.1));
        // A delay into a region without a first moment passes through the region itself.
        let has_no_first_moment = next.1.iter().all(|clock| clock.1 > 0);
        let is_barred = has_no_first_moment && next != *state && self.is_stopped(&next);
        (self.is_valid(&next) && !is_barred).then_some(next)
    }

    fn reachable(&self) -> BTreeSet<State> {
        let start = ([0, 0], [(0, 0); 2]);
        let mut found = BTreeSet::from([start]);
        let mut open = vec![start];
        while let Some(state) = open.pop() {
            for next in self
                .successors(&state)
                .into_iter()
                .chain(self.later(&state))
            {
                if found.insert(next) {
                    open.push(next);
                }
            }
        }
        found
    }

    /// The fewest moves on a way to a state that is wanted.
    fn fewest_moves(&self, is_wanted: &dyn Fn(&State) -> bool) -> Option<usize> {
        let start = ([0, 0], [(0, 0); 2]);
        let mut found = BTreeSet::from([start]);
        let mut layer = vec![start];
        for moves in 0.. {
            let mut next = Vec::new();
            while let Some(state) = layer.pop() {
                if is_wanted(&state) {
                    return Some(moves);
                }
                next.extend(self.successors(&state));
                layer.extend(self.later(&state).filter(|later| found.insert(*later)));
            }
            next.retain(|state| found.insert(*state));
            if next.is_empty() {
                return None;
            }
            layer = next;
        }
        None
    }

    /// Whether no move is possible now or after any wait.
    fn is_dead(&self, state: &State) -> bool {
        let mut state = *state;
        while self.successors(&state).is_empty() {
            match self.later(&state) {
                Some(later) if later != state => state = later,
                _ => return true,
            }
        }
        false
    }

    /// Whether the engine has to decide deadlocks: not with priorities or guarded receivers of a
    /// broadcast.
    fn has_deadlock_queries(&self) -> bool {
        let has_guard = |edge: &Edge| edge.sync == 2 && !edge.guard.is_empty();
        let is_refused = (1..=3).contains(&self.priority)
            || self.is_broadcast && self.edges[1].iter().any(has_guard);
        !is_refused
    }

    /// The states from which a run stays in `keep` for ever: what remains when states without a way
    /// on are taken away again and again.
    fn staying(&self, states: &BTreeSet<State>, keep: &dyn Fn(&State) -> bool) -> BTreeSet<State> {
        // Time alone goes on for ever only in the last region; all other cycles have a move.
        let goes_on = |state: &State| {
            let (moves, later) = (self.successors(state), self.later(state));
            let is_end = moves.is_empty() && later.is_none();
            (moves, later, is_end || later == Some(*state))
        };
        let facts: BTreeMap<State, _> = states
            .iter()
            .filter(|state| keep(state))
            .map(|state| (*state, goes_on(state)))
            .collect();
        let mut staying: BTreeSet<State> = facts.keys().copied().collect();
        loop {
            let lost: Vec<State> = staying
                .iter()
                .filter(|state| {
                    let (moves, later, ends) = &facts[*state];
                    let mut next = moves.iter().chain(later);
                    !ends && !next.any(|next| staying.contains(next))
                })
                .copied()
                .collect();
            if lost.is_empty() {
                return staying;
            }
            for state in &lost {
                staying.remove(state);
            }
        }
    }
}

/// The region with ranks from 1 without gaps, and all values above [`TOP`] alike.
fn normal(region: Region) -> Region {
    let above = |clock: (i32, i32)| clock.0 >= TOP && (clock.0 > TOP || clock.1 > 0);
    let ranks: BTreeSet<i32> = region
        .iter()
        .filter(|clock| clock.1 > 0 && !above(**clock))
        .map(|clock| clock.1)
        .collect();
    region.map(|clock| {
        if above(clock) {
            return (TOP, 1);
        }
        let rank = ranks.iter().position(|rank| *rank == clock.1);
        (clock.0, rank.map_or(0, |rank| rank as i32 + 1))
    })
}

fn passed(region: Region) -> Region {
    let is_above = |clock: (i32, i32)| clock == (TOP, 1);
    if region.iter().any(|clock| clock.1 == 0) {
        return normal(
            region.map(|(whole, rank)| (whole, if is_above((whole, rank)) { 1 } else { rank + 1 })),
        );
    }
    let greatest = region
        .iter()
        .filter(|clock| !is_above(**clock))
        .map(|clock| clock.1)
        .max();
    normal(region.map(|clock| {
        if !is_above(clock) && Some(clock.1) == greatest {
            (clock.0 + 1, 0)
        } else {
            clock
        }
    }))
}

/// Two conditions, each on a location or a clock, joined by "and" or "or".
struct Condition {
    parts: [Result<Atom, (usize, usize)>; 2],
    is_and: bool,
}

impl Condition {
    fn random(random: &mut Random) -> Condition {
        let mut part = || {
            if random.chance(50) {
                Ok(Atom::random(random))
            } else {
                Err((random.below(2), random.below(2)))
            }
        };
        let parts = [part(), part()];
        Condition {
            parts,
            is_and: random.chance(50),
        }
    }

    fn text(&self) -> String {
        let part = |part: &Result<Atom, (usize, usize)>| match part {
            Ok(atom) => atom.text(),
            Err((process, place)) => format!("P{process}.L{place}"),
        };
        let word = if self.is_and { "and" } else { "or" };
        format!("({} {word} {})", part(&self.parts[0]), part(&self.parts[1]))
    }

    fn holds(&self, (places, region): &State) -> bool {
        let mut parts = self.parts.iter().map(|part| match part {
            Ok(atom) => atom.holds(region),
            Err((process, place)) => places[*process] == *place,
        });
        if self.is_and {
            parts.all(|holds| holds)
        } else {
            parts.any(|holds| holds)
        }
    }
}

fn answer(text: &str, query: &str) -> checker::engine::Answer {
    answer_with(text, query, TraceWanted::Any)
}

fn answer_with(text: &str, query: &str, trace: TraceWanted) -> checker::engine::Answer {
    let mut model = load(text);
    let options = Options {
        limits: Limits {
            states: Some(MOST_STATES),
            ..Limits::default()
        },
        runs: true,
        certificate: true,
        trace,
        // One number of threads after the other.
        threads: [1, 2, 4][(text.len() + query.len()) % 3],
        ..interpreted()
    };
    let answer = try_ask(&mut model, query, &options)
        .unwrap_or_else(|rejection| panic!("{}\n{text}", rejection.rendered.join("\n")));
    for witness in &answer.evidence.witnesses {
        assert!(
            matches!(witness.run, Some(Proof::Replayed(..))),
            "{query}: {:#?}\n{:?}\n{text}",
            witness.run,
            witness.ending
        );
    }
    if let Some(certificate) = &answer.evidence.certificate {
        let certificate = certificate.head(model.network(), query)
            + &certificate.lines(0..certificate.state_count());
        let checked = model.verify_evidence("certificate", &certificate, Rules::default());
        let checked = checked.expect("the file is one of this model");
        let is_covered = !query.contains("deadlock") || !text.contains("urgent ");
        let expected = if is_covered {
            Some(true)
        } else {
            checked.holds.and(Some(true))
        };
        assert_eq!(
            checked.holds, expected,
            "{query}: {:?}\n{text}",
            checked.lines
        );
    }
    answer
}

fn check_verdict(text: &str, query: &str, expected: bool) {
    let found = answer(text, query).verdict;
    let wanted = if expected {
        Verdict::Satisfied
    } else {
        Verdict::NotSatisfied
    };
    assert!(
        found == wanted,
        "{query}: {found:?}, expected {wanted:?}\n{text}"
    );
}

/// A greatest value up to [`TOP`] is exact in the region graph, one above is only known to be
/// there. A shortest trace has as many moves as the way through the region graph with the fewest; a
/// fastest one takes the least time, as a clock that nothing sets says.
fn check_best_traces(network: &Network, text: &str, condition: &Condition) {
    let query = format!("E<> {}", condition.text());
    let run_of = |trace| {
        let answer = answer_with(text, &query, trace);
        let mut witnesses = answer.evidence.witnesses.into_iter();
        match witnesses.next().and_then(|witness| witness.run) {
            Some(Proof::Replayed(run, ..)) => Some(run),
            None => None,
            other => panic!("{query}: {other:#?}\n{text}"),
        }
    };
    let shortest = run_of(TraceWanted::Shortest).map(|run| run.steps.len());
    let fewest = network.fewest_moves(&|state| condition.holds(state));
    assert!(
        shortest == fewest,
        "{query}: {shortest:?} moves, expected {fewest:?}\n{text}"
    );
    let Some(run) = run_of(TraceWanted::Fastest) else {
        return;
    };
    let last = match run.end {
        End::After(wait) => wait,
        other => panic!("{query}: {other:?}\n{text}"),
    };
    let ticks = run.steps.iter().map(|step| step.wait).sum::<i64>() + last;
    let timed = text.replacen("clock x, y;", "clock x, y, total;", 1);
    let least = answer(&timed, &format!("inf{{{}}}: total", condition.text()));
    let least = least.value.and_then(|values| values.items[0].least);
    let Some(Extreme::Value { value, is_reached }) = least else {
        panic!("{query}: {least:?}\n{text}");
    };
    let least = i64::from(value) * run.ticks_per_unit;
    let is_right = if is_reached {
        ticks == least
    } else {
        least < ticks && ticks < least + run.ticks_per_unit
    };
    assert!(
        is_right,
        "{query}: {run:?} takes longer than {value}\n{text}"
    );
}

fn check_extremes(text: &str, condition: &Condition, states: &BTreeSet<State>) {
    let counting: Vec<&State> = states
        .iter()
        .filter(|state| condition.holds(state))
        .collect();
    for (clock, name) in CLOCKS.iter().enumerate() {
        let query = format!("bounds{{{}}}: {name}", condition.text());
        let answer = answer(text, &query);
        let verdict = answer.verdict;
        let Some(values) = answer.value else {
            panic!("{query}: {verdict:?}\n{text}")
        };
        let values = values.items[0];
        let doubled = counting.iter().map(|state| {
            let (whole, rank) = state.1[clock];
            2 * whole + i32::from(rank > 0)
        });
        let low = |extreme| match extreme {
            Extreme::Value { value, is_reached } => 2 * value + i32::from(!is_reached),
            Extreme::Infinite => i32::MAX,
        };
        let high = |extreme| match extreme {
            Extreme::Value { value, is_reached } => 2 * value - i32::from(!is_reached),
            Extreme::Infinite => i32::MAX,
        };
        let beyond = |value: i32| value.min(2 * TOP + 1);
        let (least, greatest) = (
            values.least.map(low).map(beyond),
            values.greatest.map(high).map(beyond),
        );
        let expected = (doubled.clone().min(), doubled.max());
        assert!(
            (least, greatest) == expected,
            "{query}: {values:?}, expected twice {expected:?}\n{text}"
        );
    }
}

fn check_network(random: &mut Random) {
    let network = Network::random(random);
    if !network.is_valid(&([0, 0], [(0, 0); 2])) {
        return;
    }
    let text = network.text();
    let (p, q) = (Condition::random(random), Condition::random(random));
    let states = network.reachable();
    let start = ([0, 0], [(0, 0); 2]);
    check_verdict(
        &text,
        &format!("E<> {}", p.text()),
        states.iter().any(|state| p.holds(state)),
    );
    let staying = network.staying(&states, &|state| p.holds(state));
    check_verdict(
        &text,
        &format!("E[] {}", p.text()),
        staying.contains(&start),
    );
    let avoiding = network.staying(&states, &|state| !q.holds(state));
    check_verdict(
        &text,
        &format!("A<> {}", q.text()),
        !avoiding.contains(&start),
    );
    let answered = !avoiding.iter().any(|state| p.holds(state));
    check_verdict(&text, &format!("{} --> {}", p.text(), q.text()), answered);
    check_extremes(&text, &p, &states);
    check_best_traces(&network, &text, &p);
    if network.has_deadlock_queries() {
        let is_dead = states
            .iter()
            .any(|state| p.holds(state) && network.is_dead(state));
        check_verdict(&text, &format!("E<> deadlock and {}", p.text()), is_dead);
    }
}

#[test]
fn answers_agree_with_the_region_graph() {
    let mut random = Random(0x5eed_1234_5678_9abc);
    for _ in 0..networks(1500) {
        check_network(&mut random);
    }
}
