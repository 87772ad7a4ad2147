//! Runs of the stochastic semantics against closed forms, and the interpreter against compiled
//! code.
//!
//! Each model is small enough that its probability is known. 20,000 runs must come within what a
//! risk of one in a million allows (Hoeffding's bound); the seed is fixed, so a test that passes
//! passes always.

use checker::diagnostics::{Diagnostic, SourceMap};
use checker::engine::{JointQuery, LoadedModel};
use checker::exec::{Executor, Interpreter, Jit, Libraries};
use checker::ir::{Asked, Network, QueryKind, Statistical};
use checker::semantics::{self, FIRST_POOL, Reading};
use checker::stochastic::{Failure, Precision, RunId, Runner};
use checker::syntax;

mod bad_input;
mod certainties;
#[path = "../common/checks.rs"]
#[allow(dead_code, reason = "this program asks in some of the ways only")]
mod checks;
mod comparisons;
mod dynamic;
#[cfg(unix)]
mod externals;
mod flows;
mod formulas;
mod intervals;
mod known;
mod networks;
mod race_code;
#[path = "../common/random.rs"]
#[allow(dead_code, reason = "this program draws in some of the ways only")]
mod random;
mod random_networks;
mod rare_events;
mod refusals;
mod under;
mod values;

/// A compiled query with its text.
struct StatisticalQuery {
    text: String,
    kind: Statistical,
}

/// A model in the stochastic reading, with a compiled query.
fn load(model: &str, query: &str) -> Result<(Network, StatisticalQuery), String> {
    let (network, mut queries) = load_all(model, &[query])?;
    Ok((network, queries.remove(0)))
}

/// A model in the stochastic reading, with what all these queries ask, compiled into it.
fn together(model: &str, queries: &[&str]) -> (Network, Vec<Statistical>) {
    match load_all(model, queries) {
        Ok((network, queries)) => {
            let kinds = queries.into_iter().map(|query| query.kind);
            (network, kinds.collect())
        }
        Err(message) => panic!("{message}"),
    }
}

/// A model in the stochastic reading, with compiled queries.
fn load_all(model: &str, queries: &[&str]) -> Result<(Network, Vec<StatisticalQuery>), String> {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let parsed = syntax::read_model("model.xta", model.as_bytes(), &mut sources);
    let mut found = parsed.diagnostics;
    let text = |found: &[Diagnostic], sources: &SourceMap| -> Result<(), String> {
        let errors: Vec<String> = found
            .iter()
            .filter(|one| one.is_error())
            .map(|one| format!("{}: {}", one.code.code, one.render(sources)))
            .collect();
        if errors.is_empty() {
            Ok(())
        } else {
            Err(errors.join("\n"))
        }
    };
    let (model, more) = semantics::analyse(
        &parsed.document,
        &prelude,
        &sources,
        Reading::Stochastic,
        &Libraries::default(),
        FIRST_POOL,
    );
    found.extend(more);
    text(&found, &sources)?;
    let mut model = model.ok_or("no model")?;
    let mut compiled = Vec::new();
    for query in queries {
        let span = syntax::add_query_text(query, &mut sources);
        let (parsed, found) = syntax::parse_query(span, &sources);
        text(&found, &sources)?;
        let parsed = parsed.ok_or("no query")?;
        let (query, found) = model.compile_query(&parsed, &sources, &[]);
        text(&found, &sources)?;
        let query = query.ok_or("no query")?;
        let QueryKind::Statistical(kind) = query.kind else {
            return Err("not statistical".to_owned());
        };
        compiled.push(StatisticalQuery {
            text: query.text,
            kind: *kind,
        });
    }
    Ok((model.network, compiled))
}

/// A query that is answered together with others, as exactly as usual.
fn joint(model: &mut LoadedModel, query: &str) -> JointQuery {
    JointQuery {
        text: model.add_query(query),
        precision: Precision::default(),
    }
}

fn executors(network: &Network) -> [Box<dyn Executor>; 2] {
    let interpreter = Interpreter::new(&network.functions, &network.constants);
    let jit = Jit::new(&network.functions, &network.constants).expect("the code compiles");
    [Box::new(interpreter), Box::new(jit)]
}

/// How many of `runs` runs satisfy a query for a probability, in compiled code.
fn satisfied(network: &Network, query: &StatisticalQuery, runs: u64) -> Result<u64, Failure> {
    let (Statistical::Probability(bound, path) | Statistical::Hypothesis { bound, path, .. }) =
        &query.kind
    else {
        panic!("{} asks for no probability", query.text);
    };
    let [interpreter, jit] = executors(network);
    let count = |executor: &dyn Executor, runs: u64| -> Result<(u64, Vec<u64>), Failure> {
        let mut runner = Runner::new(network, executor);
        let mut moves = Vec::new();
        let mut satisfied = 0;
        for run in 0..runs {
            let outcome = runner.observe(RunId { seed: 1, run }, bound, Asked::Path(path))?;
            satisfied += u64::from(outcome.value != 0.0);
            moves
                .push(outcome.time.to_bits() ^ outcome.moves ^ outcome.at.to_bits().rotate_left(7));
        }
        Ok((satisfied, moves))
    };
    let few = runs.min(300);
    let (left, right) = (count(&*interpreter, few), count(&*jit, few));
    assert_eq!(left, right, "the interpreter and compiled code differ");
    Ok(count(&*jit, runs)?.0)
}

/// Checks the probability of a query.
#[track_caller]
fn expect(model: &str, query: &str, probability: f64) {
    const RUNS: u64 = 20_000;
    let (network, query) = match load(model, query) {
        Ok(loaded) => loaded,
        Err(message) => panic!("{message}"),
    };
    let satisfied = satisfied(&network, &query, RUNS).expect("no run fails");
    let estimate = satisfied as f64 / RUNS as f64;
    // Two-sided, at a risk of one in a million.
    let margin = ((2e6_f64).ln() / (2.0 * RUNS as f64)).sqrt();
    assert!(
        (estimate - probability).abs() <= margin,
        "{}: {estimate} instead of {probability}, more than {margin} apart",
        query.text
    );
}
