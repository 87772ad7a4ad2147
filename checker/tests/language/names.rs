//! What names stand for, by the scopes alone: held against what the model means once each name is
//! another one.

use std::fmt::Write as _;
use std::fs;

use checker::diagnostics::{SourceMap, Span};
use checker::engine::LoadedModel;
use checker::names::{Names, SymbolKind, names_of};
use checker::syntax::{self, parse_query, read_model};

use crate::checks::load;
use crate::corpus;

const LIFT: &str = "\
// How many floors there are.
const int N = 3;
typedef struct { int[0,N] floor; struct { bool open; int n; } door[2]; } State;
typedef int[0,N-1] floor_t;
State s = { floor: 1, { { false, 2 }, { n: 3, open: true } } };
chan call[N], up;
clock t; // since the last call

/* Where it
 * goes. */
int next(int at, const State &s) {
    int N = at;
    for (i : floor_t) { int at = i; N = N + at; }
    { bool up = s.door[0].open; if (up) return N; }
    return s.floor + N;
}

process Lift(const int[0,N-1] id, int &s) {
    int N;
    state up, Idle { t <= 5 };
    init Idle;
    trans Idle -> up { select N : floor_t; guard N != id && forall (id : floor_t) id < 9; sync call[N]?; assign s = N; },
          up -> Idle { guard N == s; assign t = 0, N = next(N, s2), s2.door[1].open = true; };
}
State s2;
int k;
One = Lift(0, k);
process Other() { state A; init A; }
system One, Other;
";

struct Read {
    sources: SourceMap,
    names: Names,
}

fn read(text: &str, queries: &[&str]) -> Read {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let parsed = read_model("a.xta", text, &mut sources);
    let asked = queries.iter().map(|query| {
        let span = syntax::add_query_text(query, &mut sources);
        parse_query(span, &sources).0.expect("a query")
    });
    let asked: Vec<_> = asked.collect();
    let names = names_of(&parsed.document, &prelude, &asked, &sources);
    Read { sources, names }
}

impl Read {
    /// The line and text of the declaration of the name that stands `nth` behind some text.
    fn declared(&self, text: &str, behind: &str) -> (usize, String, SymbolKind) {
        let start = text.find(behind).expect("it is there") + behind.len();
        let uses = self.names.uses.iter();
        let mut found =
            uses.filter(|one| self.in_file(one.span) && one.span.start as usize == start);
        let symbol = &self.names.symbols[found.next().expect("a use").symbol];
        let line = self.sources.position(symbol.span).line as usize;
        (line, symbol.detail.clone(), symbol.kind)
    }

    fn in_file(&self, span: Span) -> bool {
        &*self.sources.get(span.source).path == "a.xta"
    }
}

#[test]
fn the_innermost_scope_counts() {
    let read = read(LIFT, &[]);
    let line = |behind| read.declared(LIFT, behind).0;
    assert_eq!(line("{\n    int N = "), 11);
    assert_eq!(line("N = N + "), 13);
    assert_eq!(line("if ("), 14);
    assert_eq!(line("guard "), 22);
    assert_eq!(line("forall (id : floor_t) "), 22);
    assert_eq!(line("up -> Idle { guard "), 19);
    assert_eq!(line("sync call["), 22);
    assert_eq!(line("const int[0,"), 2);
    assert_eq!(
        read.declared(LIFT, "trans Idle -> ").2,
        SymbolKind::Location
    );
}

#[test]
fn fields_are_those_of_their_record() {
    let read = read(LIFT, &[]);
    let field = |behind| read.declared(LIFT, behind);
    assert_eq!(
        field("bool up = s.").1,
        "struct { bool open; int n; } door[2]"
    );
    assert_eq!(
        field("s.door[0]."),
        (3, "bool open".to_owned(), SymbolKind::Field)
    );
    assert_eq!(field("{ n: 3, ").1, "bool open");
    assert_eq!(field("State s = { ").1, "int[0, N] floor");
}

#[test]
fn comments_belong_to_what_they_stand_beside() {
    let read = read(LIFT, &[]);
    let comment = |name: &str| {
        let mut symbols = read.names.symbols.iter();
        let found = symbols.find(|one| one.name == name && read.in_file(one.span));
        found.expect("a symbol").comment.clone()
    };
    assert_eq!(comment("N"), "How many floors there are.");
    assert_eq!(comment("next"), "Where it\ngoes.");
    assert_eq!(comment("t"), "since the last call");
    assert_eq!(comment("State"), "");
}

#[test]
fn queries_know_processes_and_earlier_strategies() {
    let queries = [
        "strategy S = control: A[] One.up",
        "E<> One.N > s2.floor && Other.A under S",
    ];
    let read = read(LIFT, &queries);
    let used: Vec<&str> = (read.names.uses.iter())
        .filter(|one| {
            let source = read.sources.get(one.span.source);
            source.path.is_empty() && source.place != "the prelude"
        })
        .map(|one| read.sources.text(one.span))
        .collect();
    assert_eq!(
        used,
        ["One", "up", "S", "One", "N", "s2", "floor", "Other", "A"]
    );
}

#[test]
fn names_may_be_used_where_their_scope_reaches() {
    let read = read(LIFT, &[]);
    let usable = |behind: &str| {
        let at = (LIFT.find(behind).expect("it is there") + behind.len()) as u32;
        let areas = read.names.areas.iter();
        let here = areas
            .filter(|one| read.in_file(one.span) && (one.span.start..=one.span.end).contains(&at));
        let symbols = here.flat_map(|one| &read.names.scopes[one.scope]);
        let mut names: Vec<&str> = symbols
            .map(|&one| read.names.symbols[one].name.as_str())
            .collect();
        names.sort_unstable();
        names
    };
    assert_eq!(usable("return s.floor + N"), ["N", "at", "s"]);
    assert_eq!(
        usable("for (i : floor_t) { int at = i; N"),
        ["N", "at", "at", "i", "s"]
    );
    assert_eq!(usable("sync call[N]?"), ["Idle", "N", "N", "id", "s", "up"]);
    assert_eq!(usable("init Idle;"), ["Idle", "N", "id", "s", "up"]);
}

#[test]
fn a_text_with_mistakes_has_names() {
    let text = "int a; int f(int b) { return a + ; }\nprocess P() { state A; init A; trans A -> A { guard a > ; }; }\nsystem P;";
    let read = read(text, &["E<> P.A"]);
    assert!(
        read.names
            .uses
            .iter()
            .any(|one| read.sources.text(one.span) == "A")
    );
}

/// The text with another name for each symbol.
fn renamed(text: &str, path: &str) -> String {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let document = read_model(path, text, &mut sources).document;
    let asked = document.queries.iter();
    let queries: Vec<_> = asked
        .filter_map(|query| parse_query(query.span, &sources).0)
        .collect();
    let names = names_of(&document, &prelude, &queries, &sources);
    let declared = names
        .symbols
        .iter()
        .enumerate()
        .map(|(number, one)| (one.span, number));
    let used = names.uses.iter().map(|one| (one.span, one.symbol));
    let is_here = |span: Span| &*sources.get(span.source).path == path;
    let mut edits: Vec<_> = (declared.chain(used))
        .filter(|&(span, number)| is_here(span) && is_here(names.symbols[number].span))
        .map(|(span, number)| (sources.file_range(span), number))
        .collect();
    edits.sort_unstable_by_key(|(range, _)| range.start);
    edits.dedup();
    let mut written = String::new();
    let mut end = 0;
    for (range, number) in edits {
        written += &text[end..range.start];
        let _ = write!(written, "zq{number}");
        end = range.end;
    }
    written + &text[end..]
}

/// What a model is, names aside.
fn sizes(model: &LoadedModel) -> Vec<usize> {
    let network = model.network();
    let processes = network.processes.iter();
    let graphs = processes.flat_map(|one| [one.locations.len(), one.edges.len()]);
    let mut sizes: Vec<usize> = graphs.collect();
    sizes.extend([
        network.clocks.len(),
        network.channels.len(),
        network.layout.variables.len(),
    ]);
    sizes
}

#[test]
fn a_model_of_other_names_is_the_same_model() {
    let mut seen = 0;
    for file in corpus::files_and_more("NAMES_MODELS") {
        let path = file.display().to_string();
        let Ok(text) = fs::read_to_string(&file) else {
            continue;
        };
        let Ok(model) = LoadedModel::load(&path, text.as_bytes()) else {
            continue;
        };
        let other = load(&renamed(&text, &path));
        assert_eq!(sizes(&model), sizes(&other), "{path}");
        seen += 1;
    }
    assert!(seen > 5, "only {seen} models");
}
