//! From text to syntax trees: lexer, parser, and the readers of the file formats.
//!
//! Parsing never fails and never panics: it returns a tree and a list of diagnostics. It knows no
//! types and resolves no names; the locations that an edge refers to are text like everything else.
//!
//! Source: the UPPAAL language reference, and the behaviour of utap where the reference is silent.
//! Where we differ:
//! * Names of built-in functions may be declared (warning); words of the query language may name
//!   locations (warning).
//! * The order of the parts of a textual process and of an XML template is free; `for` may leave
//!   parts out.
//! * Comments in a label do not cut it off; a label that holds only comments counts as absent.
//! * The old syntax is recognised by constructs that only it has; no switch is needed.
//!
//! Cost: linear in the text, apart from one token of lookahead more here and there.

pub mod ast;
pub mod codes;

mod lexer;

mod keywords;

mod parser;

mod tables;

mod expressions;
mod foreign;

mod types;

mod declarations;

mod statements;

mod formulas;

mod learning;

mod statistical;

mod processes;

mod queries;

mod encoding;

mod q_file;

mod xml_text;

mod xml_tables;

mod xml;

mod xml_template;

mod xta;

mod prelude;

mod print;

use codes::MOST_MISTAKES;
use keywords::Dialect;
use parser::Parser;

use crate::diagnostics::{Diagnostic, Source, SourceMap, Span, Text};

pub use prelude::prelude;
pub use print::{print_dimension, print_expr, print_type};
pub use queries::{add_query_text, parse_query};
pub(crate) use queries::{parse_expression, parse_features};
pub use tables::{Piece, TableReader};

/// A model as read: the tree is complete where no diagnostic says otherwise.
pub struct Parsed {
    /// The text, whatever its encoding was.
    pub text: Text,
    /// The tree.
    pub document: ast::Document,
    /// What is wrong, by source and place in it.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a model. The format is found from the content: XML begins with `<`; everything else is a
/// textual model, in the old syntax if it uses what only that one has.
pub fn read_model(path: &str, bytes: impl Into<Vec<u8>>, sources: &mut SourceMap) -> Parsed {
    let mut diagnostics = Vec::new();
    let decoded = encoding::decode_model(path, bytes.into(), sources, &mut diagnostics);
    let text = Text::from(decoded.unwrap_or_default());
    let document = if text.is_empty() {
        ast::Document::default()
    } else if is_xml(&text) {
        xml::read(path, &text, sources, &mut diagnostics)
    } else {
        xta::read(path, text.clone(), sources, &mut diagnostics)
    };
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.source, diagnostic.span.start));
    limit(&mut diagnostics);
    Parsed {
        text,
        document,
        diagnostics,
    }
}

/// Whether the text of a model is XML.
pub fn is_xml(text: &str) -> bool {
    text.trim_start().starts_with('<')
}

/// Reads the initial value of a variable or constant, for what is wrong with it.
pub fn read_value(span: Span, sources: &SourceMap) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut parser = Parser::new(span, sources, Dialect::New, &mut diagnostics);
    parser.initialiser();
    if !parser.at_end() {
        parser.expected("the end of the value");
    }
    diagnostics
}

/// Splits a `.q` file into the texts of its queries.
pub fn read_queries(
    path: &str,
    bytes: impl Into<Vec<u8>>,
    sources: &mut SourceMap,
) -> (Vec<ast::QueryText>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let queries = match encoding::decode(path, bytes.into(), sources, &mut diagnostics) {
        Some(text) => {
            let span = add_file(path, text, sources);
            let mut queries = q_file::split(span, sources, &mut diagnostics);
            if let Some(plain) = q_file::plain(sources.text(span), &queries) {
                let plain = add_file(path, plain, sources);
                for query in &mut queries {
                    query.span.source = plain.source;
                }
            }
            queries
        }
        None => Vec::new(),
    };
    (queries, diagnostics)
}

/// Keeps the mistakes that anybody may read.
fn limit(diagnostics: &mut Vec<Diagnostic>) {
    diagnostics.dedup();
    if diagnostics.len() > MOST_MISTAKES {
        diagnostics.truncate(MOST_MISTAKES);
        if let Some(span) = diagnostics.last().map(|last| last.span) {
            diagnostics.push(Diagnostic::new(
                codes::TOO_MANY_MISTAKES,
                span,
                format!("more than {MOST_MISTAKES} mistakes; the others are not reported"),
            ));
        }
    }
}

/// Adds a whole file as one source and returns the span of all of it.
fn add_file(path: &str, text: impl Into<Text>, sources: &mut SourceMap) -> Span {
    sources.add(Source {
        path: path.into(),
        text: text.into(),
        ..Source::default()
    })
}
