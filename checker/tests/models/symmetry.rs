//! Searches that take states that differ only by exchanged members of scalar sets for the same,
//! against searches of all states.
//!
//! Random networks have three processes that are told apart by scalars, one beside them, variables,
//! arrays and clocks of and over the set, and constructs that tell members apart. Every run that is
//! found must pass its replay, which knows nothing of symmetry.
//!
//! `NETWORKS=50000 cargo test --release --test models symmetry::` runs more of them than the usual
//! number.

use std::fmt::Write as _;

use checker::engine::evidence::witness::Proof;
use checker::engine::{Answer, Options, Reductions, Verdict};
use checker::search::reachability::report::Manner;

use crate::checks::{check, interpreted};
use crate::random::{Random, networks};
use crate::searches::{self, BREADTH_FIRST, Total};

/// Networks without the environment variable `NETWORKS`.
const NETWORKS: u64 = 120;

fn answer(text: &str, query: &str, manner: Manner, symmetry: bool) -> Answer {
    let adjust = |options: &mut Options| {
        options.reductions.symmetry = symmetry;
        // Where states are counted, symmetry alone is to be seen; the other searches do both.
        options.reductions.live_variables = manner != BREADTH_FIRST;
    };
    searches::answer_in(manner, (text, query), adjust, |run| {
        matches!(run, Some(Proof::Replayed(..)))
    })
}

/// The answers without and with symmetry reduction, which must be the same.
fn answers(text: &str, query: &str) -> (Answer, Answer) {
    let compare = |manner: Manner, full: &Answer, reduced: &Answer| {
        assert_eq!(full.verdict, reduced.verdict, "{manner:?}: {query}\n{text}");
        assert_eq!(full.value, reduced.value, "{manner:?}: {query}\n{text}");
        assert!(
            full.evidence.witnesses.is_empty() == reduced.evidence.witnesses.is_empty(),
            "{manner:?}: {query}\n{text}"
        );
    };
    let answer = |manner, symmetry| answer(text, query, manner, symmetry);
    searches::answers(answer, compare)
}

fn stored(text: &str, query: &str) -> (u64, u64) {
    let (full, reduced) = answers(text, query);
    (full.counters.stored, reduced.counters.stored)
}

fn fischer(processes: u32) -> String {
    format!(
        "typedef scalar[{processes}] pid; pid id; bool free = true;
         process P(const pid me) {{
           clock x;
           state idle, asked {{ x <= 2 }}, waits, cs;
           init idle;
           trans idle -> asked {{ guard free; assign x = 0; }},
                 asked -> waits {{ guard x <= 2; assign x = 0, id = me, free = false; }},
                 waits -> asked {{ guard free; assign x = 0; }},
                 waits -> cs {{ guard x > 2 && !free && id == me; }},
                 cs -> idle {{ assign free = true; }};
         }}
         system P;"
    )
}

#[test]
fn orbits_of_processes_are_stored_about_once() {
    let exclusion = "A[] forall (i : pid) forall (j : pid) P(i).cs && P(j).cs imply i == j";
    for (processes, factor) in [(3, 4), (4, 10), (5, 20)] {
        let (full, reduced) = stored(&fischer(processes), exclusion);
        assert!(
            reduced * factor <= full,
            "{processes} processes: {full} states, {reduced} with symmetry"
        );
    }
}

#[test]
fn two_sets_are_reduced_both() {
    let text = "typedef scalar[3] S; typedef scalar[3] T; bool owns[S][T]; T last[S];
        process P(const S i) { state a; init a; trans
            a -> a { select t : T; guard forall (j : S) !owns[j][t]; assign owns[i][t] = true, last[i] = t; },
            a -> a { select t : T; guard owns[i][t]; assign owns[i][t] = false; }; }
        system P;";
    let (full, reduced) = stored(text, "E<> exists (i : S) owns[i][last[i]] && deadlock");
    assert!(
        reduced * 10 <= full,
        "{full} states, {reduced} with symmetry"
    );
}

/// In each of these something tells members apart, so that the numbers of states must be the same.
#[test]
fn members_that_are_told_apart_are_not_exchanged() {
    let cases = [
        // The last one in order.
        ("void act(S i) { for (j : S) if (mark[j]) who = j; }", "true", "mark[i] = !mark[i]", false),
        // One after the other.
        (
            "void act(S i) { for (j : S) n = (2 * n + mark[j]) % 8; who = i; }",
            "true",
            "mark[i] = !mark[i]",
            false,
        ),
        // A member that nothing chose.
        (
            "bool may(S i) { S first; return i != first || n < 3; } void act(S i) { n = n < 9 ? n + 1 : 0; who = i; }",
            "may(i)",
            "mark[i] = true",
            false,
        ),
        // Constants.
        (
            "const int weight[S] = { 1, 2, 4 }; void act(S i) { n += weight[i]; who = i; }",
            "n + weight[i] < 8",
            "mark[i] = true",
            false,
        ),
        // Receivers in order.
        ("void act(S i) { mark[i] = !mark[i]; }", "true", "who = i", false),
        // A variable that keeps its first value.
        (
            "S first; void act(S i) { mark[i] = !mark[i]; who = i; }",
            "i != first",
            "mark[i] = false",
            false,
        ),
        // Nothing.
        ("void act(S i) { mark[i] = !mark[i]; who = i; }", "true", "mark[i] = !mark[i]", true),
        // Nothing: loops whose order does not matter.
        (
            "bool may(S i) { for (j : S) if (mark[j] && j != i) return false; return true; }
             void act(S i) { n = 0; for (j : S) { if (!mark[j]) n++; } for (j : S) mark[j] = i == j; who = i; }",
            "may(i)",
            "mark[i] = false",
            true,
        ),
    ];
    for (functions, guard, heard, is_reduced) in cases {
        let text = format!(
            "typedef scalar[3] S; S who; int[0,9] n; bool mark[S]; broadcast chan go; {functions}
             process P(const S i) {{ state a, b; init a; trans
               a -> b {{ guard {guard}; assign act(i); }}, b -> a {{ sync go?; assign {heard}; }}; }}
             process Q() {{ state a; init a; trans a -> a {{ sync go!; }}; }}
             system P, Q;"
        );
        let (full, reduced) = stored(&text, "E<> n > 0 && deadlock && mark[who]");
        assert_eq!(reduced < full, is_reduced, "{full}, {reduced}\n{text}");
    }
}

const HEAD: &str = "
typedef scalar[3] S;
S who; int[0,2] n; int[0,1] a[S]; S next[S]; clock g[S]; clock t;
struct { S s; int[0,1] b[S]; } z;
chan c[S]; broadcast chan b; chan d;
void clear() { for (i : S) a[i] = 0; }
int ones() { int k = 0; for (i : S) if (a[i] == 1) k++; return k; }
void copy() { for (i : S) { z.b[i] = a[i]; g[i] = 0; } }
bool any() { for (i : S) if (z.b[i] == 1) return true; return false; }
";

/// What a network may have beside it, none of which leaves members alike.
const APART: [&str; 3] = [
    "void pass() { for (i : S) if (a[i] == 1) who = i; }",
    "void pass() { S first; a[first] = 1 - a[first]; }",
    "const int weight[S] = { 0, 1, 1 }; void pass() { n = weight[who]; }",
];

const GUARDS: [&str; 16] = [
    "who == ME",
    "who != ME",
    "a[ME] == 1",
    "a[ME] == 0",
    "a[K] == 0 && K != ME",
    "x <= 1",
    "x >= 1",
    "g[ME] < 2",
    "g[K] >= 1",
    "next[ME] == who",
    "(exists (i : S) i != ME && a[i] == 1)",
    "(forall (i : S) a[i] == 0)",
    "ones() == 2",
    "any()",
    "(z.s == ME || z.b[K] == 1)",
    "n < 2",
];

const UPDATES: [&str; 15] = [
    "who = ME",
    "who = K",
    "a[ME] = 1",
    "a[K] = 1",
    "a[ME] = 0",
    "g[K] = 0",
    "x = 0",
    "n = n < 2 ? n + 1 : 0",
    "next[ME] = K",
    "next[K] = ME",
    "clear()",
    "copy()",
    "z.s = next[K]",
    "t = 0",
    "pass()",
];

const OWN_UPDATES: [&str; 5] = [
    "a[ME] = 1",
    "a[ME] = 0",
    "x = 0",
    "g[ME] = 0",
    "next[ME] = K",
];

/// Writes every scalar, since one that keeps its first value tells that member apart.
const CHOOSER: &str = "process C() { state p; init p; trans p -> p { select K : S, L : S;
  guard n == 2 && K != L; assign who = K, next[L] = K, z.s = L, n = 0; }; }
";

fn process(random: &mut Random, text: &mut String, name: &str, me: Option<&str>) {
    let parameter = me.map_or(String::new(), |me| format!("const S {me}"));
    let me = me.unwrap_or("who");
    let _ = write!(text, "process {name}({parameter}) {{ clock x; state ");
    let places: Vec<String> = (0..3)
        .map(|place| {
            let invariant = if random.chance(30) { " { x <= 2 }" } else { "" };
            format!("{}{invariant}", ["p", "q", "r"][place])
        })
        .collect();
    let _ = write!(text, "{};", places.join(", "));
    if random.chance(25) {
        let _ = write!(text, " {} r;", random.one_of(&["commit", "urgent"]));
    }
    let edges: Vec<String> = (0..4 + random.below(3))
        .map(|edge| {
            let source = if edge < 3 { edge } else { random.below(3) };
            let guards: Vec<&str> = (0..random.below(3))
                .map(|_| random.one_of(&GUARDS))
                .collect();
            let sync = match random.below(9) {
                0 => "sync c[ME]?;",
                1 => "sync c[K]!;",
                2 => "sync b!;",
                3 => "sync b?;",
                4 => "sync d!;",
                5 => "sync d?;",
                _ => "",
            };
            // Receivers mostly touch what is their own, so that their order does not matter.
            let pool = if sync == "sync b?;" && random.chance(85) {
                &OWN_UPDATES[..]
            } else {
                &UPDATES[..]
            };
            let updates: Vec<&str> = (0..random.below(4)).map(|_| random.one_of(pool)).collect();
            let part = |keyword: &str, parts: &[&str], glue: &str| {
                let text = parts.join(glue);
                let keyword = if parts.is_empty() { "" } else { keyword };
                let end = if parts.is_empty() { "" } else { ";" };
                format!("{keyword} {text}{end}")
            };
            // Receivers may only ask for clocks in ways that leave the deadlock predicate defined.
            let guards: Vec<&str> = guards
                .into_iter()
                .filter(|guard| {
                    sync != "sync b?;" || !(guard.starts_with('x') || guard.starts_with('g'))
                })
                .collect();
            format!(
                "{} -> {} {{ select K : S; {} {sync} {} }}",
                ["p", "q", "r"][source],
                ["p", "q", "r"][random.below(3)],
                part("guard", &guards, " && "),
                part("assign", &updates, ", "),
            )
            .replace("ME", me)
        })
        .collect();
    let _ = writeln!(text, " init p; trans {}; }}", edges.join(",\n  "));
}

const QUERIES: [&str; 8] = [
    "E<> exists (i : S) P(i).r && a[i] == 1 && who != i",
    "A[] forall (i : S) forall (j : S) P(i).r && P(j).r imply i == j",
    "E<> P(who).q && next[who] == who && ones() > 1",
    "E<> deadlock",
    "A[] any() imply exists (i : S) g[i] < 3 && !P(i).q",
    "E<> forall (i : S) P(i).q && next[i] != i",
    "sup{exists (i : S) P(i).r}: n, ones(), t",
    "inf{n == 2 && z.b[who] == 0}: t, g[who], z.b[next[who]]",
];

#[test]
fn verdicts_are_those_of_all_states() {
    let networks = networks(NETWORKS);
    let mut total = Total::default();
    for seed in 1..=networks {
        let mut random = Random::of_network(seed);
        let mut text = String::from(HEAD);
        text += if random.chance(15) {
            random.one_of(&APART)
        } else {
            "void pass() { a[who] = 1 - a[who]; }"
        };
        text.push('\n');
        process(&mut random, &mut text, "P", Some("me"));
        process(&mut random, &mut text, "Q", None);
        text += CHOOSER;
        text += "system P, Q, C;\n";
        let query = random.one_of(&QUERIES);
        let few = answer_with_limit(&text, query);
        if few.verdict == Verdict::Unknown(checker::search::StopReason::States) {
            continue;
        }
        let (full, reduced) = answers(&text, query);
        total.add(full.counters.stored, reduced.counters.stored);
    }
    assert!(
        total.reduced * 4 < total.full * 3,
        "without and with symmetry: {total:?}"
    );
}

/// Large networks are left out.
fn answer_with_limit(text: &str, query: &str) -> Answer {
    let mut options = Options {
        reductions: Reductions {
            symmetry: false,
            live_variables: false,
            ..Reductions::ALL
        },
        ..interpreted()
    };
    options.limits.states = Some(800);
    check(text, query, &options)
}
