//! Models with the verdicts of their queries: `tests/corpus/verdicts` and `tests/corpus/games`.
//!
//! A file begins with lines `// query: …`, each followed by `// verdict: …` (`// verdict neutral:
//! …` and `// verdict product: …` where the rule for forced moves matters, `// verdict priorities:
//! …` where priorities are to count) and `// origin: …`, which says how the verdict is known. A
//! line `// given: …` is a query that is answered before those below it, for the strategy that it
//! defines. Other comment lines are prose. The verdict of a query for values is the values. Every
//! trace must pass its replay. Every query is answered with every search order, by several threads,
//! and with the interpreter and compiled code, and must come out the same.

use std::fs;
use std::path::Path;

use checker::engine::answer::Values;
use checker::engine::{CodeEngine, Options, Verdict};
use checker::game::{Forced, Priorities};
use checker::search::optimum::extremum::Extreme;
use checker::search::reachability::report::Order;

use crate::checks::{ask, load, try_ask};
use crate::corpus;

type Rules = (Forced, Priorities);

struct Case {
    /// The queries that come before it.
    given: Vec<String>,
    query: String,
    verdicts: Vec<(Rules, String)>,
    origin: String,
}

fn cases(path: &Path, text: &str) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    let mut given: Vec<String> = Vec::new();
    for line in text
        .lines()
        .map_while(|line| line.strip_prefix("//"))
        .map(str::trim)
    {
        let Some((key, value)) = line.split_once(':') else {
            continue;
        };
        let (key, value) = (key.trim(), value.trim().to_owned());
        let rules = match key {
            "query" => {
                cases.push(Case {
                    given: given.clone(),
                    query: value,
                    verdicts: Vec::new(),
                    origin: String::new(),
                });
                continue;
            }
            "given" => {
                given.push(value);
                continue;
            }
            "origin" => {
                cases
                    .last_mut()
                    .unwrap_or_else(|| panic!("{}: origin without query", path.display()))
                    .origin = value;
                continue;
            }
            "verdict" => Rules::default(),
            "verdict neutral" => (Forced::Neutral, Priorities::Ignored),
            "verdict product" => (Forced::Product, Priorities::Ignored),
            "verdict priorities" => (Forced::Tiga, Priorities::Kept),
            _ if key.starts_with("verdict") => {
                panic!("{}: unknown directive {key}", path.display())
            }
            _ => continue,
        };
        let case = cases
            .last_mut()
            .unwrap_or_else(|| panic!("{}: verdict without query", path.display()));
        case.verdicts.push((rules, value));
    }
    cases
}

fn engines() -> Vec<CodeEngine> {
    if cfg!(feature = "jit") {
        vec![CodeEngine::Interpreter, CodeEngine::Jit]
    } else {
        vec![CodeEngine::Interpreter]
    }
}

fn verdict_of(text: &str, case: &Case, options: &Options) -> String {
    let mut model = load(text);
    for given in &case.given {
        ask(&mut model, given, options);
    }
    match try_ask(&mut model, &case.query, options) {
        Err(_) => "rejected".to_owned(),
        Ok(answer) if answer.evidence.is_verified() == Some(false) => {
            let runs = answer.evidence.witnesses.iter().map(|one| &one.run);
            format!(
                "a strategy or a trace that fails its check: {:?}",
                runs.collect::<Vec<_>>()
            )
        }
        Ok(answer) => match answer.verdict {
            Verdict::Satisfied => match &answer.value {
                Some(values) => value_text(values),
                None => "satisfied".to_owned(),
            },
            Verdict::NotSatisfied => "not satisfied".to_owned(),
            Verdict::Maybe => "maybe".to_owned(),
            Verdict::Unknown(reason) => format!("stopped: {reason:?}"),
            Verdict::Error(_) => "error".to_owned(),
        },
    }
}

/// The values of a query for them: `3`, `> 3` and `< 3` for one that is not reached, `inf`, `none`;
/// bounds as `1..3`.
fn value_text(values: &Values) -> String {
    let one = |extreme: Option<Extreme>, strict: &str| match extreme {
        None => "none".to_owned(),
        Some(Extreme::Infinite) => "inf".to_owned(),
        Some(Extreme::Value {
            value,
            is_reached: true,
        }) => value.to_string(),
        Some(Extreme::Value { value, .. }) => format!("{strict} {value}"),
    };
    let items = values.items.iter().map(|item| {
        let (least, greatest) = (one(item.least, ">"), one(item.greatest, "<"));
        match (values.least, values.greatest) {
            (true, true) => format!("{least}..{greatest}"),
            (true, false) => least,
            _ => greatest,
        }
    });
    items.collect::<Vec<_>>().join(", ")
}

/// Orders of the search and numbers of threads.
type Manners<'m> = &'m [(Order, usize)];

const EVERY_MANNER: Manners<'_> = &[
    (Order::BreadthFirst, 1),
    (Order::DepthFirst, 1),
    (Order::Random(7), 1),
    (Order::BreadthFirst, 2),
    (Order::BreadthFirst, 4),
];

fn check_case(
    path: &Path,
    text: &str,
    case: &Case,
    (codes, manners): (&[CodeEngine], Manners<'_>),
    failures: &mut Vec<String>,
) {
    for (rules, expected) in &case.verdicts {
        for &code in codes {
            for &(order, threads) in manners {
                let options = Options {
                    order,
                    threads,
                    code,
                    forced: rules.0,
                    priorities: rules.1,
                    strategy: true,
                    verify: true,
                    runs: true,
                    ..Options::default()
                };
                let found = verdict_of(text, case, &options);
                if &found != expected {
                    failures.push(format!(
                        "{}: {}\n  expected {expected} ({}), found {found} with {order:?}, {threads} threads, {code:?}, {rules:?}",
                        path.display(),
                        case.query,
                        case.origin
                    ));
                }
            }
        }
    }
}

/// Checks the models of a folder, each behind some more text.
fn check_folder(name: &str, before: &str, how: (&[CodeEngine], Manners<'_>)) {
    let mut failures = Vec::new();
    let mut count = 0;
    for path in &corpus::files(name) {
        let text = fs::read_to_string(path).expect("the corpus can be read");
        if !before.is_empty() && text.contains("' ==") {
            // Beside stopwatches each clock more can make zones too large.
            continue;
        }
        let cases = cases(path, &text);
        let text = format!("{before}{text}");
        assert!(!cases.is_empty(), "{}: no query", path.display());
        for case in &cases {
            assert!(
                !case.verdicts.is_empty(),
                "{}: no verdict for {}",
                path.display(),
                case.query
            );
            assert!(
                !case.origin.is_empty(),
                "{}: no origin for {}",
                path.display(),
                case.query
            );
            check_case(path, &text, case, how, &mut failures);
            count += 1;
        }
    }
    assert!(count > 0, "the corpus {name} is empty");
    assert!(
        failures.is_empty(),
        "{} of the queries:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

#[test]
fn symbolic_verdicts_hold() {
    check_folder("verdicts", "", (&engines(), EVERY_MANNER));
}

#[test]
fn game_verdicts_hold() {
    check_folder("games", "", (&engines(), EVERY_MANNER));
}

/// Beyond the first 256 clocks other code is at work.
const MANY_CLOCKS: &str = "clock nobody_looks_at[270];\n";

#[test]
fn verdicts_hold_behind_many_clocks() {
    let how: (&[CodeEngine], Manners<'_>) =
        (&[CodeEngine::Interpreter], &[(Order::BreadthFirst, 1)]);
    check_folder("verdicts", MANY_CLOCKS, how);
}
