//! Other values for the constants of a model.
//!
//! The values are replaced in the text of the model, which is then loaded like any other: sizes,
//! ranges and instances that depend on them follow, and diagnostics show the text that was loaded.

use std::ops::Range;

use super::Rejection;
use crate::diagnostics::{Diagnostic, Source, SourceMap, Span};
use crate::semantics::codes::NAME_UNKNOWN;
use crate::syntax::ast::{Declaration, Document, Initialiser, SystemItem, Variable};
use crate::syntax::{is_xml, read_model, read_value};

const CDATA: (&str, &str) = ("<![CDATA[", "]]>");

/// The text of a model in which constants have other values.
///
/// # Arguments
/// * `path`: the name of the file in diagnostics.
/// * `text`: the text of an accepted model.
/// * `values`: names with their new values, which are written as in a declaration. A name with a
///   dot is that of a constant in a template.
///
/// # Errors
/// There is no such constant, or a value cannot be one.
pub(super) fn replaced(
    path: &str,
    text: &str,
    values: &[(String, String)],
) -> Result<String, Rejection> {
    let mut sources = SourceMap::default();
    let document = read_model(path, text, &mut sources).document;
    let mut diagnostics = Vec::new();
    let mut edits: Vec<(Range<usize>, &str)> = Vec::new();
    for (name, value) in values {
        let span = added(value, format!("the value of {name}"), &mut sources);
        diagnostics.extend(read_value(span, &sources));
        let span = added(name, "the name of a constant".to_owned(), &mut sources);
        match found(&document, name) {
            _ if text.contains("<!ENTITY") => {
                let message = "the file declares entities of its own, so its text cannot be edited";
                diagnostics.push(Diagnostic::new(NAME_UNKNOWN, span, message));
            }
            Some((true, Some(initialiser))) => {
                edits.push((sources.file_range(initialiser), value));
            }
            Some(_) => {
                let message = format!("`{name}` is a variable, not a constant");
                let help = "declare it with `const`, if no edge changes it";
                diagnostics.push(Diagnostic::new(NAME_UNKNOWN, span, message).help(help));
            }
            None => {
                let message = format!("the model declares no constant `{name}`");
                let help = known(&document);
                diagnostics.push(Diagnostic::new(NAME_UNKNOWN, span, message).help(help));
            }
        }
    }
    if !diagnostics.is_empty() {
        return Err(Rejection::new(diagnostics, &sources));
    }
    // The last one first, so that places before it stay where they are.
    edits.sort_by_key(|(range, _)| std::cmp::Reverse(range.start));
    let mut edited = text.to_owned();
    for (range, value) in edits {
        let value = if is_escaped(text, range.start) {
            value.replace('&', "&amp;").replace('<', "&lt;")
        } else {
            value.to_owned()
        };
        edited.replace_range(range, &value);
    }
    Ok(edited)
}

fn added(text: &str, place: String, sources: &mut SourceMap) -> Span {
    sources.add(Source {
        place,
        text: text.into(),
        ..Source::default()
    })
}

/// Whether the bytes at this place of a file are those of XML outside of CDATA.
fn is_escaped(text: &str, at: usize) -> bool {
    let before = &text[..at];
    let is_in_cdata = before.rfind(CDATA.0) > before.rfind(CDATA.1);
    is_xml(text) && !is_in_cdata
}

/// Whether the name is that of a constant, and where its value stands; `None` if nothing has it.
fn found(document: &Document, name: &str) -> Option<(bool, Option<Span>)> {
    let mut variables = variables(document);
    let (_, variable) = variables.find(|(full_name, _)| full_name == name)?;
    let value = variable.initialiser.as_ref().map(|value| match value {
        Initialiser::Expr(value) => value.span,
        Initialiser::List(_, span) | Initialiser::Table(span) => *span,
    });
    Some((variable.ty.prefixes.constant, value))
}

/// The constants of the model, for a hint.
fn known(document: &Document) -> String {
    let constants = variables(document).filter(|(_, one)| one.ty.prefixes.constant);
    let names: Vec<String> = constants.map(|(name, _)| name).collect();
    match &names[..] {
        [] => "the model has no constants".to_owned(),
        names => format!("it has {}", names.join(", ")),
    }
}

/// All variables and constants outside of functions; those of templates have its name before a dot.
fn variables(document: &Document) -> impl Iterator<Item = (String, &Variable)> {
    let of_system = document.system.items.iter().filter_map(|item| match item {
        SystemItem::Declaration(declaration) => Some(declaration),
        SystemItem::Instantiation { .. } => None,
    });
    let outside = document.declarations.iter().chain(of_system);
    let outside = outside.map(|declaration| (String::new(), declaration));
    let inside = document.templates.iter().flat_map(|template| {
        let prefix = format!("{}.", template.name.text);
        let declarations = template.declarations.iter();
        declarations.map(move |declaration| (prefix.clone(), declaration))
    });
    outside
        .chain(inside)
        .filter_map(|(prefix, declaration)| match declaration {
            Declaration::Variable(variable) => Some((prefix + &variable.name.text, variable)),
            _ => None,
        })
}
