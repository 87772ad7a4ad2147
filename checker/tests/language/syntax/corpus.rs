//! Every file of `tests/corpus/syntax`: those in `ok` are read without errors, those in `err` are
//! not, and each says in comments what the readers find in it.
//!
//! Directives stand in lines of their own, `// word: …` or `<!-- word: … -->`:
//! * `expect: CODE at LINE:COLUMN "message"`: a diagnostic; all of them must be listed.
//! * `templates: N`, `edges: N`, `processes: N`, `queries: N`: what was read.
//! * `unsupported: NAME`: a construct that was recognised.
//!
//! `UPDATE_EXPECT=1 cargo test --test language` rewrites the `expect:` lines.

use std::path::Path;

use checker::diagnostics::SourceMap;
use checker::syntax::ast::Document;
use checker::syntax::{parse_query, read_model, read_queries};

use crate::corpus;
use crate::syntax::support::shown;

/// The text of the directive that a line holds.
fn directive(line: &str) -> Option<(&str, &str)> {
    let line = line.trim();
    let comment = line
        .strip_prefix("// ")
        .or_else(|| line.strip_prefix("<!-- ")?.strip_suffix(" -->"))?;
    let (word, rest) = comment.split_once(": ")?;
    let is_word = word.chars().all(|c| c.is_ascii_lowercase());
    (is_word && !word.is_empty()).then_some((word, rest))
}

/// What the readers find in a file.
struct Reading {
    diagnostics: Vec<String>,
    document: Document,
}

fn read(path: &Path, bytes: &[u8]) -> Reading {
    let mut sources = SourceMap::default();
    let name = path.to_string_lossy();
    let (document, mut diagnostics) = if path.extension().is_some_and(|e| e == "q") {
        let (queries, diagnostics) = read_queries(&name, bytes, &mut sources);
        let document = Document {
            queries,
            ..Document::default()
        };
        (document, diagnostics)
    } else {
        let parsed = read_model(&name, bytes, &mut sources);
        (parsed.document, parsed.diagnostics)
    };
    for query in &document.queries {
        diagnostics.extend(parse_query(query.span, &sources).1);
    }
    for diagnostic in &diagnostics {
        assert!(!diagnostic.render(&sources).is_empty());
    }
    let diagnostics = diagnostics.iter().map(|d| shown(d, &sources)).collect();
    Reading {
        diagnostics,
        document,
    }
}

fn check_file(path: &Path, has_errors: bool) -> Result<(), String> {
    let bytes = std::fs::read(path).expect("the file can be read");
    let text = String::from_utf8_lossy(&bytes).into_owned();
    let reading = read(path, &bytes);
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        rewrite(path, &text, &reading.diagnostics);
        return Ok(());
    }
    let errors = reading.diagnostics.iter().any(|d| d.starts_with('E'));
    if errors != has_errors {
        return Err(format!("found {:#?}", reading.diagnostics));
    }
    let mut expected = Vec::new();
    for (word, rest) in text.lines().filter_map(directive) {
        if word == "expect" {
            expected.push(rest.to_owned());
        } else {
            check_count(&reading.document, word, rest)?;
        }
    }
    if expected == reading.diagnostics {
        return Ok(());
    }
    Err(format!(
        "expected {expected:#?}\nfound {:#?}",
        reading.diagnostics
    ))
}

fn check_count(document: &Document, word: &str, rest: &str) -> Result<(), String> {
    let found = match word {
        "templates" => document.templates.len(),
        "edges" => document.templates.iter().map(|t| t.edges.len()).sum(),
        "processes" => document.system.processes.iter().map(Vec::len).sum(),
        "queries" => document.queries.len(),
        "unsupported" => {
            let names: Vec<&str> = document
                .unsupported
                .iter()
                .map(|n| n.text.as_str())
                .collect();
            return if names.contains(&rest) {
                Ok(())
            } else {
                Err(format!("`{rest}` is not among {names:?}"))
            };
        }
        _ => return Err(format!("unknown directive `{word}:`")),
    };
    if rest.parse() == Ok(found) {
        Ok(())
    } else {
        Err(format!("expected {rest} {word}, found {found}"))
    }
}

/// The old directives out, the new ones behind the text: places in the text stay the same.
fn rewrite(path: &Path, text: &str, diagnostics: &[String]) {
    let is_xml = path.extension().is_some_and(|e| e == "xml");
    let kept: String = text
        .split_inclusive('\n')
        .filter(|line| directive(line).is_none_or(|(word, _)| word != "expect"))
        .collect();
    let lines: String = diagnostics
        .iter()
        .map(|d| {
            if is_xml {
                format!("<!-- expect: {d} -->\n")
            } else {
                format!("// expect: {d}\n")
            }
        })
        .collect();
    std::fs::write(path, kept + &lines).expect("the corpus can be written");
}

fn check_folder(folder: &str, has_errors: bool) {
    let failures: Vec<String> = corpus::files(&format!("syntax/{folder}"))
        .iter()
        .filter_map(|path| {
            let failure = check_file(path, has_errors).err()?;
            Some(format!("{}: {failure}", path.display()))
        })
        .collect();
    assert!(
        failures.is_empty(),
        "{}\nrun with UPDATE_EXPECT=1 to rewrite the `expect:` lines",
        failures.join("\n")
    );
}

#[test]
fn models_and_queries_without_mistakes_are_read() {
    check_folder("ok", false);
}

#[test]
fn mistakes_are_reported_at_their_places() {
    check_folder("err", true);
}

#[test]
fn an_unknown_directive_is_a_failure() {
    let document = Document::default();
    assert!(check_count(&document, "templats", "0").is_err());
    assert!(check_count(&document, "templates", "1").is_err());
    assert!(check_count(&document, "templates", "0").is_ok());
}
