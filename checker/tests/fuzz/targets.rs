//! What is done with an input: it is loaded, asked a query, and walked through for a few moves;
//! evidence is checked.

use std::time::Duration;

use checker::engine::session::walk::Point;
use checker::engine::{CodeEngine, LoadedModel, Options};

use super::seeds::Seeds;

/// What an input is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Xml,
    Xta,
    Declarations,
    Expression,
    Query,
    QueryFile,
    Evidence,
}

impl Kind {
    pub(crate) const ALL: [Kind; 7] = [
        Kind::Xml,
        Kind::Xta,
        Kind::Declarations,
        Kind::Expression,
        Kind::Query,
        Kind::QueryFile,
        Kind::Evidence,
    ];
}

/// What queries are asked of, and expressions are put into.
const MODEL: &str = "const int N = 3; typedef int[0, N - 1] id_t; typedef scalar[2] s_t; int v = 1; int[0,5] w; bool b; int a[N];
    bool c[id_t]; double d = 0.5; struct { int x; bool y; id_t z[2]; } r; s_t s; clock x, y, z[2]; hybrid clock h;
    chan ch, cs[N]; urgent chan u; broadcast chan bc; meta int m; const int k[N] = {1, 2, 3};
    int f(int p) { return p + v; } void g(int &p, int q[N]) { p = q[0]; } bool even(id_t p) { return p % 2 == 0; }
    process P(const id_t id, int &ref) { clock t; int[0,3] l; state A { t <= 5 && x <= 9 }, B, C; commit C; urgent B; init A;
      trans A -> B { select i : id_t; guard v > 0 && t >= 1; sync ch!; assign t = 0, l = 1; }, B -> C { }, C -> A { assign v = f(v); }; }
    process Q() { state L; init L; trans L -> L { sync ch?; }; }
    P1 = P(0, v); P2 = P(1, a[1]); system P1, P2, Q;";
/// The most moves of a walk.
const MOVES: usize = 5;
/// Larger models are only loaded: their zones alone take longer than an input may.
const MOST_PROCESSES: usize = 40;
const MOST_CLOCKS: usize = 40;
const MOST_WORDS: usize = 100_000;
const MOST_CHANNELS: usize = 10_000;
/// States without number may lie between two that are stored.
const LONGEST_SEARCH: Duration = Duration::from_millis(100);

/// The targets, with the model that queries are asked of.
pub(crate) struct Targets {
    model: LoadedModel,
    queries: usize,
}

impl Targets {
    pub(crate) fn new() -> Targets {
        let model = LoadedModel::load("model.xta", MODEL.as_bytes());
        let model = model.unwrap_or_else(|rejection| panic!("{}", rejection.rendered.join("\n")));
        Targets { model, queries: 0 }
    }

    pub(crate) fn run(&mut self, kind: Kind, input: &[u8], seeds: &Seeds) {
        match kind {
            Kind::Xml | Kind::Xta => whole(input),
            Kind::Declarations => {
                let system = b"\nprocess Zz() { state A; init A; trans A -> A { }; } system Zz;";
                whole(&[input, system].concat());
            }
            Kind::Expression => whole(&with_expression(input)),
            Kind::Evidence => seeds.evidence.run(input),
            Kind::Query => self.query(&String::from_utf8_lossy(input)),
            Kind::QueryFile => {
                if let Ok(queries) = self.model.read_queries("queries.q", input) {
                    for query in queries {
                        self.ask(&query);
                    }
                }
            }
        }
        self.queries += 1;
        if self.queries > 2_000 {
            // Every text that is asked stays with the model.
            *self = Targets::new();
        }
    }

    fn query(&mut self, text: &str) {
        let query = self.model.add_query(text);
        self.ask(&query);
    }

    fn ask(&mut self, query: &checker::syntax::ast::QueryText) {
        let _ = self.model.check(query, &few_states());
    }
}

fn few_states() -> Options {
    let mut options = Options {
        code: CodeEngine::Interpreter,
        ..Options::default()
    };
    options.limits.states = Some(5);
    options.limits.timeout = Some(LONGEST_SEARCH);
    options
}

/// A model with the text as guard, invariant, update and select; which of them is up to its first
/// byte.
fn with_expression(input: &[u8]) -> Vec<u8> {
    let hole: &[u8] = match input.first().map_or(0, |byte| byte % 5) {
        0 | 1 => b"trans A -> B { guard ",
        2 => b"trans A -> B { assign ",
        3 => b"trans A -> B { select ",
        _ => b"trans A -> B { sync ",
    };
    let (before, after) = MODEL
        .split_once("process Q()")
        .expect("the model has a process Q");
    let parts: [&[u8]; 6] = [
        before.as_bytes(),
        b"process Q() { clock t; int l; state A, B; init A; ",
        hole,
        input,
        b"; }; } process Zz() ",
        after.as_bytes(),
    ];
    parts.concat()
}

/// Loads a whole model, asks it whether it has a state, and walks.
fn whole(input: &[u8]) {
    let Ok(mut model) = LoadedModel::load("model", input) else {
        return;
    };
    let network = model.network();
    let is_large = network.processes.len() > MOST_PROCESSES
        || network.clocks.len() > MOST_CLOCKS
        || network.initial.len() > MOST_WORDS
        || network.channels.len() > MOST_CHANNELS;
    if is_large {
        return;
    }
    let query = model.add_query("E<> true");
    if model.check(&query, &few_states()).is_err() {
        return;
    }
    for query in model.queries.clone().iter().take(3) {
        let _ = model.check(query, &few_states());
    }
    let Ok(mut point) = model.start() else {
        return;
    };
    for step in 0..MOVES {
        let Ok(mut successors) = model.successors(&point) else {
            return;
        };
        if successors.is_empty() {
            return;
        }
        let index = step % successors.len();
        let (_, next): (_, Point) = successors.swap_remove(index);
        point = next;
    }
}
