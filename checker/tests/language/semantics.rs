//! The corpus of `tests/corpus/language`: models with the diagnostics, values and run-time errors
//! that they must give.
//!
//! Directives are comments that begin with a word and a colon:
//! * `// expect: E0201 at 3:5 "part of the message"`: a diagnostic; a file gives exactly those that
//!   it expects. With `at next:5` or `at this:5` the line is that after, or of, the directive.
//! * `// run: condition`: the condition holds in the initial state.
//! * `// fails: condition with DivisionByZero at 1 / n`: evaluating it there ends in that error, in
//!   that expression; results that do not fit are errors.
//! * `// wraps: condition at n * n`: the condition holds there, and that result does not fit and
//!   wraps round.
//! * `// accept: query`, `// refuse: query with E0271 "part of the message"`: whether a query can
//!   be asked.
//! * `// warn: query with W0204`: the query can be asked, and gives this warning. There is a
//!   strategy with the name `known`.
//!
//! Models below `ok` give no error; those below `err` give at least one.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use checker::diagnostics::{Diagnostic, SourceMap};
use checker::exec::{Context, Executor, Interpreter, Libraries, RunTimeError};
use checker::ir::{self, Network, Overflow, Predicate, QueryKind, SiteId};
use checker::semantics::{self, FIRST_POOL, Model, Reading};
use checker::syntax;

use crate::corpus;

/// A model with its texts.
struct Loaded {
    model: Option<Model>,
    sources: SourceMap,
    diagnostics: Vec<Diagnostic>,
}

fn load(path: &str, text: &str) -> Loaded {
    let mut sources = SourceMap::default();
    let prelude = syntax::prelude(&mut sources);
    let parsed = syntax::read_model(path, text.as_bytes(), &mut sources);
    let (model, found) = semantics::analyse(
        &parsed.document,
        &prelude,
        &sources,
        Reading::Symbolic,
        &Libraries::default(),
        FIRST_POOL,
    );
    let mut diagnostics = parsed.diagnostics;
    diagnostics.extend(found);
    Loaded {
        model,
        sources,
        diagnostics,
    }
}

/// Compiles a query; the diagnostics as text are the error.
fn compile(loaded: &mut Loaded, text: &str) -> Result<ir::Query, String> {
    compile_with_warnings(loaded, text).map(|(query, _)| query)
}

/// Compiles a query; its warnings as text, or the diagnostics if it is refused.
fn compile_with_warnings(loaded: &mut Loaded, text: &str) -> Result<(ir::Query, String), String> {
    let span = syntax::add_query_text(text, &mut loaded.sources);
    let (query, mut diagnostics) = syntax::parse_query(span, &loaded.sources);
    let model = loaded.model.as_mut().ok_or("the model is refused")?;
    let compiled = query.and_then(|query| {
        let strategies = [String::from("known")];
        let (compiled, found) = model.compile_query(&query, &loaded.sources, &strategies);
        diagnostics.extend(found);
        compiled
    });
    let texts = rendered(&diagnostics, &loaded.sources);
    match compiled {
        Some(query) => Ok((query, texts)),
        None => Err(texts),
    }
}

fn rendered(diagnostics: &[Diagnostic], sources: &SourceMap) -> String {
    diagnostics.iter().map(|d| d.render(sources)).collect()
}

/// Evaluates a predicate on the words of the initial state.
fn evaluate(
    network: &Network,
    interpreter: &Interpreter,
    predicate: &Predicate,
) -> Result<bool, RunTimeError> {
    let evaluate = |part: &Predicate| evaluate(network, interpreter, part);
    Ok(match predicate {
        Predicate::Constant(value) => *value,
        Predicate::Data(function) => {
            let mut context = Context {
                state: &mut network.initial.clone(),
                constraints: &mut Vec::new(),
                assignments: &mut Vec::new(),
            };
            interpreter.call(*function, &[], &mut context)? != 0
        }
        Predicate::Location(process, location) => {
            network.initial[process.0 as usize] == location.0 as i32
        }
        Predicate::Not(inner) => !evaluate(inner)?,
        Predicate::And(parts) => parts
            .iter()
            .try_fold(true, |all, part| Ok(all && evaluate(part)?))?,
        Predicate::Or(parts) => parts
            .iter()
            .try_fold(false, |any, part| Ok(any || evaluate(part)?))?,
        other => panic!("conditions on clocks have no value here: {other:?}"),
    })
}

/// The value of a condition, and the first place where a result wrapped round.
type Ran = (Result<bool, RunTimeError>, Option<SiteId>);

fn run(loaded: &mut Loaded, condition: &str, overflow: Overflow) -> Result<Ran, String> {
    let query = compile(loaded, &format!("E<> {condition}"))?;
    let QueryKind::Reachable(predicate) = &query.kind else {
        return Err(String::from("it is no condition"));
    };
    let model = loaded.model.as_ref().expect("the query was compiled");
    let network = &model.network;
    let interpreter =
        Interpreter::new(&network.functions, &network.constants).with_overflow(overflow);
    let result = evaluate(network, &interpreter, predicate);
    Ok((result, interpreter.wraps().first()))
}

/// The text of a site.
fn text_of(loaded: &Loaded, site: SiteId) -> &str {
    let model = loaded.model.as_ref().expect("the query was compiled");
    loaded
        .sources
        .text(model.network.sites[site.0 as usize].span)
}

/// What a directive finds wrong; empty if nothing.
fn check_directive(
    loaded: &mut Loaded,
    key: &str,
    value: &str,
    line: usize,
    expected: &mut Vec<String>,
) -> Option<String> {
    match key {
        "expect" => {
            expected.push(
                value
                    .replace("next:", &format!("{}:", line + 1))
                    .replace("this:", &format!("{line}:")),
            );
            None
        }
        "run" => match run(loaded, value, Overflow::Wrap) {
            Ok((Ok(true), None)) => None,
            Ok((Ok(true), Some(_))) => Some(format!("wraps round: {value}")),
            Ok((Ok(false), _)) => Some(format!("is false: {value}")),
            Ok((Err(error), _)) => Some(format!("ends in {:?}: {value}", error.kind)),
            Err(message) => Some(format!("cannot be compiled: {value}\n{message}")),
        },
        "fails" => {
            let (condition, wanted) = value.split_once(" with ").expect("fails: … with …");
            match run(loaded, condition, Overflow::Error) {
                Ok((Err(error), _)) => {
                    let found = format!("{:?} at {}", error.kind, text_of(loaded, error.site));
                    (found != wanted).then(|| format!("fails with {found}: {condition}"))
                }
                Ok((Ok(value), _)) => Some(format!("is {value} and does not fail: {condition}")),
                Err(message) => Some(format!("cannot be compiled: {condition}\n{message}")),
            }
        }
        "wraps" => {
            let (condition, wanted) = value.split_once(" at ").expect("wraps: … at …");
            match run(loaded, condition, Overflow::Wrap) {
                Ok((Ok(true), Some(site))) => {
                    let found = text_of(loaded, site);
                    (found != wanted).then(|| format!("wraps round at {found}: {condition}"))
                }
                Ok(other) => Some(format!("gives {other:?}: {condition}")),
                Err(message) => Some(format!("cannot be compiled: {condition}\n{message}")),
            }
        }
        "accept" => compile(loaded, value)
            .err()
            .map(|message| format!("is refused: {value}\n{message}")),
        "refuse" => {
            let (query, wanted) = value.split_once(" with ").expect("refuse: … with …");
            let (code, part) = wanted.split_once(' ').unwrap_or((wanted, ""));
            match compile(loaded, query) {
                Ok(_) => Some(format!("is accepted: {query}")),
                Err(message) => {
                    let fits = message.contains(&format!("[{code}]"))
                        && message.contains(part.trim_matches('"'))
                        && message.matches("error[").count() == 1;
                    (!fits).then(|| format!("is refused otherwise: {query}\n{message}"))
                }
            }
        }
        "warn" => {
            let (query, code) = value.split_once(" with ").expect("warn: … with …");
            match compile_with_warnings(loaded, query) {
                Ok((_, warnings)) => {
                    let fits = warnings.contains(&format!("warning[{code}]"));
                    (!fits).then(|| format!("gives no such warning: {query}\n{warnings}"))
                }
                Err(message) => Some(format!("is refused: {query}\n{message}")),
            }
        }
        other => Some(format!("unknown directive '{other}'")),
    }
}

/// Whether a diagnostic is the one that `E0201 at 3:5 "part"` describes.
fn is_described(diagnostic: &Diagnostic, sources: &SourceMap, wanted: &str) -> bool {
    let place = sources.position(diagnostic.span);
    let start = format!(
        "{} at {}:{}",
        diagnostic.code.code, place.line, place.column
    );
    match wanted.split_once('"') {
        Some((wanted, part)) => {
            start == wanted.trim()
                && diagnostic
                    .message
                    .contains(part.trim_end().trim_end_matches('"'))
        }
        None => start == wanted.trim(),
    }
}

fn check_file(path: &Path, is_legal: bool) -> String {
    let text = fs::read_to_string(path).expect("the corpus is text");
    let name = path.file_name().expect("it is a file").to_string_lossy();
    let mut loaded = load(&name, &text);
    let mut problems = String::new();
    let mut expected = Vec::new();
    let mut directives = 0;
    for (i, line) in text.lines().enumerate() {
        let Some((_, comment)) = line.split_once("// ") else {
            continue;
        };
        let Some((key, value)) = comment.split_once(": ") else {
            continue;
        };
        if !key.chars().all(|c| c.is_ascii_lowercase()) {
            continue;
        }
        directives += 1;
        if let Some(problem) = check_directive(&mut loaded, key, value.trim(), i + 1, &mut expected)
        {
            let _ = writeln!(problems, "{name}:{}: {problem}", i + 1);
        }
    }
    if directives == 0 {
        let _ = writeln!(problems, "{name}: no directive");
    }
    if is_legal == loaded.diagnostics.iter().any(Diagnostic::is_error) {
        let _ = writeln!(problems, "{name}: is in the wrong folder");
    }
    for diagnostic in &loaded.diagnostics {
        match expected
            .iter()
            .position(|wanted| is_described(diagnostic, &loaded.sources, wanted))
        {
            Some(i) => {
                expected.remove(i);
            }
            None => {
                let _ = writeln!(
                    problems,
                    "unexpected:\n{}",
                    diagnostic.render(&loaded.sources)
                );
            }
        }
    }
    for wanted in expected {
        let _ = writeln!(problems, "{name}: missing {wanted}");
    }
    problems
}

fn check_folder(folder: &str, is_legal: bool) {
    let problems: String = corpus::files(folder)
        .iter()
        .map(|path| check_file(path, is_legal))
        .collect();
    assert!(problems.is_empty(), "\n{problems}");
}

#[test]
fn legal_models_are_accepted_and_mean_what_they_say() {
    check_folder("language/ok", true);
}

#[test]
fn illegal_models_are_refused_with_all_their_mistakes() {
    check_folder("language/err", false);
}

#[test]
fn every_code_is_unique() {
    let mut codes: Vec<&str> = semantics::codes::ALL.iter().map(|code| code.code).collect();
    let count = codes.len();
    codes.sort_unstable();
    codes.dedup();
    assert_eq!(codes.len(), count);
}

/// Codes of files that no corpus can hold: 256 MiB, a hundred mistakes, nothing at all, other
/// encodings, a thousand brackets, libraries. `tests/syntax/limits.rs`, `models.rs` and the pages
/// of `ntagen explain` have them.
const OUTSIDE_CORPUS: [&str; 16] = [
    "E0106", "E0111", "E0122", "E0123", "E0129", "E0144", "W0106", "E0285", "E0286", "E0294",
    "E0295", "E0299", "E0289", "W0217", "W0219", "W0220",
];

#[test]
fn every_code_has_a_line_in_the_corpus() {
    let mut paths = Vec::new();
    for folder in ["language/ok", "language/err", "syntax/ok", "syntax/err"] {
        paths.extend(corpus::files(folder));
    }
    let texts = paths
        .iter()
        .map(|path| fs::read(path).expect("it is a file"));
    let lines: Vec<String> = texts
        .flat_map(|bytes| {
            let text = String::from_utf8_lossy(&bytes).into_owned();
            text.lines().map(str::to_owned).collect::<Vec<_>>()
        })
        .filter(|line| {
            ["expect: ", "refuse: ", "warn: "]
                .iter()
                .any(|key| line.contains(key))
        })
        .collect();
    let codes = syntax::codes::ALL.iter().chain(semantics::codes::ALL);
    let missing: Vec<&str> = codes
        .map(|code| code.code)
        .filter(|code| !lines.iter().any(|line| line.contains(code)))
        .collect();
    assert_eq!(missing, OUTSIDE_CORPUS);
}

/// Whether static analysis takes comparisons of clocks in a guard for able to matter, and the guard
/// for able to hold.
fn matters(guard: &str) -> (bool, bool) {
    let text = format!(
        "const bool late[3] = {{false, false, false}};
         const bool mixed[int[2, 4]] = {{false, true, true}};
         const struct {{ int low; int rows[2][2]; }} table[2] = {{{{1, {{{{2, 3}}, {{4, 5}}}}}}, {{6, {{{{7, 8}}, {{9, 9}}}}}}}};
         int[0, 2] who; int[3, 4] last; int[0, 1] side; bool b; clock x; clock y[2];
         process P() {{ state A, B; init A; trans A -> B {{ guard {guard}; assign who = 1, last = 4, side = 1, b = true; }}; }}
         system P;"
    );
    let loaded = load("guard.xta", &text);
    let model = loaded.model.unwrap_or_else(|| {
        panic!(
            "{guard}: {}",
            rendered(&loaded.diagnostics, &loaded.sources)
        )
    });
    let guard = &model.network.processes[0].edges[0].guard;
    (!guard.atoms.is_empty(), !guard.never_holds)
}

#[test]
fn comparisons_behind_what_is_known_do_not_matter() {
    for (guard, expected) in [
        ("x < 5", (true, true)),
        ("late[who] && x < 5", (false, false)),
        ("x < 5 && late[who]", (false, false)),
        ("late[who] && (b || x < 5)", (false, false)),
        ("!late[who] || x < 5", (false, true)),
        ("!late[who] && x < 5", (true, true)),
        ("mixed[last] || x < 5", (false, true)),
        ("mixed[last - 1] || x < 5", (true, true)),
        ("table[side].low > 6 && x < 5", (false, false)),
        ("table[side].low > 5 && x < 5", (true, true)),
        ("table[side].rows[1][side] >= 4 imply b", (false, true)),
        (
            "table[side].rows[1][side] < 4 && x == y[side]",
            (false, false),
        ),
        (
            "table[side].rows[side][0] == 9 && x == y[side]",
            (true, true),
        ),
        ("who + last < 3 && x >= 5", (false, false)),
        ("who + last <= 3 && x >= 5", (true, true)),
        (
            "forall (i : int[0, 1]) (late[i] && y[i] < 5)",
            (false, true),
        ),
        ("(exists (i : int[0, 2]) late[i]) && x > 1", (false, false)),
        ("(b || (late[who] && x > 1)) && true", (false, true)),
        ("(b || x > 1) && who != 3", (true, true)),
        ("(b || x > 1) && who == 3", (false, false)),
    ] {
        assert_eq!(matters(guard), expected, "{guard}");
    }
}
