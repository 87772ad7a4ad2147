//! Every diagnostic has a page, the wrong example of which gives that diagnostic and the right one
//! none.

use std::collections::BTreeSet;

use checker::engine::format::explain::explanations;
use checker::engine::{LoadedModel, Rejection};
use checker::syntax::ast::QueryText;

use crate::checks::interpreted;

/// What an example is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Role {
    /// The model that the queries of the page are about.
    Model,
    /// It has the mistake.
    Wrong,
    /// It is fixed.
    Right,
}

/// An example of a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Example {
    /// `xta`, `xml`, `query` or `q`.
    language: &'static str,
    /// What it is.
    role: Role,
    /// The text between the fences.
    text: &'static str,
}

/// The examples of a page, in order.
fn examples(page: &'static str) -> Vec<Example> {
    // Outside and inside of fences alternate.
    let blocks = page.split("```").skip(1).step_by(2);
    let examples = blocks.filter_map(|block| {
        let (heading, text) = block.split_once('\n')?;
        let (language, role) = heading.split_once(' ')?;
        let role = match role {
            "model" => Role::Model,
            "wrong" => Role::Wrong,
            "right" => Role::Right,
            _ => return None,
        };
        let text = text.strip_suffix('\n').unwrap_or(text);
        Some(Example {
            language,
            role,
            text,
        })
    });
    examples.collect()
}

/// Codes that no short text can give: a file of 256 MiB, a machine without compiler, and libraries
/// that are not as the model says.
const WITHOUT_EXAMPLE: [&str; 4] = ["E0129", "E0803", "E0294", "E0295"];

/// A code that comes with others only: the hundred mistakes before it.
const NEVER_ALONE: &str = "E0111";

/// The bytes that an example stands for.
fn bytes(text: &str) -> Vec<u8> {
    let mut parts = text.split("\\x");
    let mut bytes = parts.next().unwrap_or("").as_bytes().to_vec();
    for part in parts {
        bytes.push(u8::from_str_radix(&part[..2], 16).expect("two hexadecimal digits"));
        bytes.extend(&part.as_bytes()[2..]);
    }
    bytes
}

fn codes_of(texts: &[String]) -> BTreeSet<String> {
    let codes = texts.iter().map(|text| {
        let start = text.find('[').expect("a diagnostic shows its code") + 1;
        text[start..start + 5].to_owned()
    });
    codes.collect()
}

/// The codes that an example on the page of a code gives, warnings included.
fn codes(code: &str, model: Option<&Example>, example: &Example) -> BTreeSet<String> {
    let result = match example.language {
        "query" => ask(model, |loaded| Ok(vec![loaded.add_query(example.text)])),
        "q" => ask(model, |loaded| {
            loaded.read_queries("example.q", example.text.as_bytes())
        }),
        _ => LoadedModel::load("example", bytes(example.text)).map(|loaded| {
            // Such a model is read, and refused as soon as a symbolic query comes.
            let refusal = loaded.expect_symbolic().err();
            let refusal = refusal.filter(|_| code.starts_with('E'));
            refusal.map_or(loaded.warnings, |refusal| refusal.rendered)
        }),
    };
    codes_of(&result.unwrap_or_else(|rejection| rejection.rendered))
}

/// All warnings of the queries about a model.
fn ask(
    model: Option<&Example>,
    queries: impl FnOnce(&mut LoadedModel) -> Result<Vec<QueryText>, Rejection>,
) -> Result<Vec<String>, Rejection> {
    let model = model.expect("queries are about a model");
    let mut loaded = LoadedModel::load("example", model.text.as_bytes())?;
    // What a page about queries says is not about the model.
    let of_model = loaded.warnings.len();
    let options = interpreted();
    let mut warnings = Vec::new();
    for query in queries(&mut loaded)? {
        warnings.extend(loaded.check(&query, &options)?.warnings);
    }
    warnings.extend(loaded.warnings.split_off(of_model));
    Ok(warnings)
}

#[test]
fn every_page_shows_its_mistake_and_the_way_out() {
    let mut problems = Vec::new();
    for (code, page) in explanations() {
        let examples = examples(page);
        let of = |role| examples.iter().find(|example| example.role == role);
        if WITHOUT_EXAMPLE.contains(&code.code) {
            assert!(
                examples.is_empty(),
                "{}: it can be shown after all",
                code.code
            );
            continue;
        }
        let (Some(wrong), Some(right)) = (of(Role::Wrong), of(Role::Right)) else {
            problems.push(format!("{}: an example is missing", code.code));
            continue;
        };
        let found = codes(code.code, of(Role::Model), wrong);
        let is_right = if code.code == NEVER_ALONE {
            found.contains(code.code)
        } else {
            found == BTreeSet::from([code.code.to_owned()])
        };
        if !is_right {
            problems.push(format!("{}: the wrong example gives {found:?}", code.code));
        }
        let found = codes(code.code, of(Role::Model), right);
        if !found.is_empty() {
            problems.push(format!("{}: the right example gives {found:?}", code.code));
        }
    }
    assert!(problems.is_empty(), "\n{}", problems.join("\n"));
}

#[test]
fn every_page_begins_with_what_the_code_means() {
    for (code, page) in explanations() {
        let first = page.lines().next().unwrap_or("");
        assert!(first.ends_with(['.', '`']), "{}: {first}", code.code);
        assert!(
            page.matches("```").count() % 2 == 0,
            "{}: a fence is open",
            code.code
        );
    }
}

#[test]
fn codes_are_unique() {
    let codes: Vec<&str> = explanations().map(|(code, _)| code.code).collect();
    let distinct: BTreeSet<&str> = codes.iter().copied().collect();
    assert_eq!(codes.len(), distinct.len());
}
