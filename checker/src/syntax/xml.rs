//! XML models, of every DTD version: the DTD itself is never fetched and its version does not
//! matter.
//!
//! Every text that is parsed becomes a source with its place in words. Unknown elements, attributes
//! and kinds of labels are skipped, an empty label is an absent one, and the order of elements is
//! free.
//!
//! Source: the UPPAAL manual on file formats, and how utap reads what it leaves open.

use super::ast::{Document, Expectation, Name, QueryText, Unsupported, UnsupportedPart};
use super::codes;
use super::keywords::Dialect;
use super::keywords::is_reserved;
use super::lexer::{end_of_word, lex};
use super::parser::Parser;
use super::processes::{Part, query_texts};
use super::q_file::{collapsed, expectation_in, trimmed};
use super::xml_tables::Cuts;
use super::xml_text::{XmlFile, end_of_tag};
use super::xta::is_old_syntax;
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span, Text};
use roxmltree::{Node, ParsingOptions};

/// No model of 100 MB has as many nodes; it bounds the memory for files that are nothing but tags.
const MOST_NODES: u32 = 5_000_000;

/// How much text the entities that a file declares may expand to.
const MOST_EXPANDED_BYTES: usize = 1 << 30;

/// Reads an XML model.
pub(super) fn read(
    path: &str,
    text: &Text,
    sources: &mut SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Document {
    let (left, cuts) = Cuts::of(text);
    let file = XmlFile::new(path, text, cuts);
    let options = || ParsingOptions {
        allow_dtd: true,
        nodes_limit: MOST_NODES,
        ..ParsingOptions::default()
    };
    if expands_too_much(text) {
        let span = file.add_raw(0..0, String::new(), sources);
        let message = "the entities of this file expand to too much text";
        diagnostics.push(Diagnostic::new(codes::MALFORMED_XML, span, message));
        return Document::default();
    }
    match roxmltree::Document::parse_with_options(&left, options()) {
        Ok(tree) => {
            let mut reader = Reader {
                file,
                sources,
                diagnostics,
                dialect: dialect_of(tree.root_element()),
                document: Document::default(),
            };
            reader.root(tree.root_element());
            reader.document
        }
        Err(error) => {
            // Places in the whole text are asked for.
            let whole = roxmltree::Document::parse_with_options(text, options());
            let error = whole.err().unwrap_or(error);
            let diagnostic = malformed(&error, &file, sources);
            diagnostics.push(diagnostic);
            Document::default()
        }
    }
}

/// roxmltree bounds the nesting of entities (10) and their references in one expansion (255), not
/// their sum.
fn expands_too_much(text: &str) -> bool {
    let declared = text.find("<!ENTITY").map(|start| {
        let end = text.rfind("]>").unwrap_or(text.len());
        end.saturating_sub(start)
    });
    declared.is_some_and(|bytes| {
        let references = text.matches('&').count();
        bytes.saturating_mul(255).saturating_mul(references) > MOST_EXPANDED_BYTES
    })
}

fn malformed(error: &roxmltree::Error, file: &XmlFile, sources: &mut SourceMap) -> Diagnostic {
    let position = error.pos();
    let (row, column) = (position.row.max(1) as usize, position.col.max(1) as usize);
    let mut line_start = 0;
    let mut line = "";
    for (index, candidate) in file.text.split_inclusive('\n').enumerate() {
        line_start += line.len();
        line = candidate;
        if index + 1 == row {
            break;
        }
    }
    let column = line
        .char_indices()
        .nth(column - 1)
        .map_or(line.len(), |(index, _)| index);
    let range = line_start..line_start + line.len();
    let span = file.add_raw(range, String::new(), sources);
    let span = span.part(column..column);
    let text = error.to_string();
    let cause = text
        .rsplit_once(" at ")
        .map_or(text.as_str(), |(cause, _)| cause);
    let diagnostic = Diagnostic::new(
        codes::MALFORMED_XML,
        span,
        format!("the file is not well-formed XML: {cause}"),
    );
    match error {
        roxmltree::Error::UnknownEntityReference(..)
        | roxmltree::Error::MalformedEntityReference(_) => diagnostic
            .help("write `&amp;` for `&`, and characters instead of entities such as `&nbsp;`"),
        roxmltree::Error::InvalidAttributeValue(_) | roxmltree::Error::InvalidName(_) => {
            diagnostic.help("write `&lt;` for `<`")
        }
        _ => diagnostic,
    }
}

/// Old if a declaration or a parameter list uses what only the old syntax has.
fn dialect_of(root: Node) -> Dialect {
    let is_old = root
        .descendants()
        .filter(|node| matches!(node.tag_name().name(), "declaration" | "parameter"))
        .filter_map(|node| node.text())
        .filter(|text| text.contains("const"))
        .any(|text| {
            let span = Span::default().part(0..text.len());
            is_old_syntax(text, &lex(text, span, &mut Vec::new()))
        });
    if is_old { Dialect::Old } else { Dialect::New }
}

pub(super) fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| is_element(*child, name))
}

pub(super) fn is_element(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

/// The state of reading one file.
pub(super) struct Reader<'a, 's> {
    file: XmlFile<'a>,
    sources: &'s mut SourceMap,
    pub(super) diagnostics: &'s mut Vec<Diagnostic>,
    dialect: Dialect,
    pub(super) document: Document,
}

impl Reader<'_, '_> {
    fn root(&mut self, root: Node) {
        let name = root.tag_name().name();
        if !matches!(name, "nta" | "project") {
            let span = self.tag(root, "");
            let message = format!("this XML file is not a UPPAAL model: its root is `<{name}>`");
            self.diagnostics.push(
                Diagnostic::new(codes::NOT_A_MODEL, span, message)
                    .help("a model has the root element `<nta>`"),
            );
            return;
        }
        let mut has_system = false;
        for node in root.children().filter(Node::is_element) {
            match node.tag_name().name() {
                "declaration" => self.part(node, Part::Declarations, "global declarations"),
                "template" => {
                    self.template(node);
                    // Some generators close the last template only behind the system section.
                    for inner in node.children().filter(Node::is_element) {
                        has_system |= self.system_section(inner);
                    }
                }
                "lsc" => self.sequence_chart(node),
                "queries" => self.queries(node),
                _ => has_system |= self.system_section(node),
            }
        }
        if !has_system {
            let span = self.tag(root, "");
            self.diagnostics.push(
                Diagnostic::new(codes::MISSING_SYSTEM, span, "no `<system>` element")
                    .help("name the processes of the system: `<system>system P, Q;</system>`"),
            );
        }
    }

    /// Reads an element of the system section, if it is one; returns whether it holds the system
    /// line.
    fn system_section(&mut self, node: Node) -> bool {
        match node.tag_name().name() {
            "instantiation" => self.part(node, Part::Instantiations, "instantiations"),
            "system" => {
                self.part(node, Part::System, "system declarations");
                return true;
            }
            _ => {}
        }
        false
    }

    /// A source for an element's start tag.
    pub(super) fn tag(&mut self, node: Node, place: &str) -> Span {
        let range = self.file.range(node);
        let raw = self.file.text.get(range.clone()).unwrap_or("");
        let end = range.start + end_of_tag(raw);
        self.file
            .add_raw(range.start..end, place.to_owned(), self.sources)
    }

    pub(super) fn error(&mut self, code: Code, span: Span, message: impl Into<String>) {
        self.diagnostics.push(Diagnostic::new(code, span, message));
    }

    fn part(&mut self, node: Node, part: Part, place: &str) {
        let span = self.file.add_text(node, place.to_owned(), self.sources);
        let mut parser = Parser::new(span, self.sources, self.dialect, self.diagnostics);
        let queries = parser.model(part, &mut self.document);
        let queries = query_texts(&queries, self.sources);
        self.document.queries.extend(queries);
    }

    /// Parses the text of an element; `None` if it holds nothing but blanks and comments.
    pub(super) fn parse<T>(
        &mut self,
        node: Node,
        place: String,
        read: impl FnOnce(&mut Parser<'_>) -> T,
    ) -> Option<T> {
        node.first_child()?;
        let span = self.file.add_text(node, place, self.sources);
        let mut parser = Parser::new(span, self.sources, self.dialect, self.diagnostics);
        if parser.at_end() {
            return None;
        }
        let tree = read(&mut parser);
        parser.expect_end("of the text");
        self.document.unsupported.append(&mut parser.unsupported);
        Some(tree)
    }

    fn sequence_chart(&mut self, node: Node) {
        let name = child(node, "name").and_then(|name| name.text());
        let name = name.unwrap_or("").trim().to_owned();
        let text = format!("live sequence chart `{name}`");
        let span = self.tag(node, &text);
        let name = Name { text: name, span };
        let part = UnsupportedPart::Chart(name);
        let construct = Unsupported { text, span, part };
        self.document.unsupported.push(construct);
    }

    /// The name that stands in an element; `None` if it is blank.
    pub(super) fn identifier(&mut self, node: Node, place: String) -> Option<Name> {
        let span = self.file.add_text(node, place, self.sources);
        let text = self.sources.text(span);
        let start = text.len() - text.trim_start().len();
        let word = text.trim().to_owned();
        if word.is_empty() {
            return None;
        }
        let span = span.part(start..start + word.len());
        let begins = |byte: u8| byte.is_ascii_alphabetic() || byte == b'_';
        let bytes = word.as_bytes();
        if !begins(bytes[0]) || end_of_word(bytes, 0) != bytes.len() {
            let shown: String = word.chars().take(40).collect();
            let message = format!("`{}` is not an identifier", shown.escape_debug());
            self.diagnostics.push(
                Diagnostic::new(codes::INVALID_NAME, span, message)
                    .help("a name has letters, digits and `_`, and does not begin with a digit"),
            );
        } else if is_reserved(&word, Dialect::Old) {
            let message = format!("the reserved word `{word}` cannot be a name");
            self.error(codes::KEYWORD_AS_NAME, span, message);
        }
        Some(Name { text: word, span })
    }

    fn queries(&mut self, node: Node) {
        let for_all = options_of(node);
        for (index, query) in node
            .children()
            .filter(|n| is_element(*n, "query"))
            .enumerate()
        {
            if let Some(formula) = child(query, "formula") {
                let place = format!("query {}", index + 1);
                if let Some(mut text) = self.query(query, formula, place) {
                    text.options.splice(0..0, for_all.iter().cloned());
                    self.document.queries.push(text);
                }
            }
        }
    }

    /// `None` for a formula that is empty or only a comment.
    fn query(&mut self, query: Node, formula: Node, place: String) -> Option<QueryText> {
        let span = self.file.add_text(formula, place, self.sources);
        let text = self.sources.text(span);
        let (start, end) = trimmed(text)?;
        let comment = child(query, "comment").and_then(|comment| comment.text());
        let expected = child(query, "expect").and_then(expected_outcome);
        // UPPAAL keeps the last result of a query in the file.
        let expected = expected.or_else(|| child(query, "result").and_then(expected_outcome));
        Some(QueryText {
            span: span.part(start..end),
            text: collapsed(text),
            comment: comment.unwrap_or("").trim().to_owned(),
            expect: expected.or_else(|| expectation_in(text)),
            options: options_of(query),
        })
    }
}

/// The options that stand in a node, such as `<option key="--epsilon" value="0.01"/>`.
fn options_of(node: Node) -> Vec<(String, String)> {
    node.children()
        .filter(|one| is_element(*one, "option"))
        .filter_map(|one| {
            let (key, value) = (one.attribute("key")?, one.attribute("value")?);
            Some((key.trim().to_owned(), value.trim().to_owned()))
        })
        .collect()
}

fn expected_outcome(node: Node) -> Option<Expectation> {
    let value = node.attribute("value").unwrap_or("").trim();
    match node.attribute("outcome")?.trim() {
        "success" if node.attribute("type") == Some("quantity") => {
            value.parse().ok().map(Expectation::Number)
        }
        "success" | "true" => Some(Expectation::True),
        "failure" | "false" => Some(Expectation::False),
        "maybe_true" => Some(Expectation::MaybeTrue),
        "maybe_false" => Some(Expectation::MaybeFalse),
        "error" => Some(Expectation::Error),
        _ => None,
    }
}
