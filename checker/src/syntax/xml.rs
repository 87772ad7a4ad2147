//! XML models, of every DTD version: the DTD itself is never fetched and its version does not matter.
//!
//! Every text that is parsed becomes a source with its place in words. Unknown elements, attributes and kinds of labels
//! are skipped, an empty label is an absent one, and the order of elements is free.
//!
//! Source: uppaal.md A1. A transition is controllable if its attribute is absent or exactly `true`.

#![expect(
    clippy::redundant_closure_for_method_calls,
    reason = "the path of a method is not general over the lifetime of the parser"
)]

use super::ast::{
    Branchpoint, Document, Edge, Expectation, Location, Name, Point, QueryText, Template,
};
use super::codes;
use super::keywords::{is_built_in_function, is_reserved};
use super::lexer::{end_of_word, lex, to_u32};
use super::parser::{Dialect, Parser};
use super::processes::{Part, query_texts};
use super::q_file::{collapsed, expectation_in, trimmed};
use super::xml_text::{XmlFile, end_of_tag};
use super::xta::is_old_syntax;
use crate::diagnostics::{Code, Diagnostic, SourceMap, Span};
use roxmltree::{Node, ParsingOptions};
use std::collections::{HashMap, HashSet};

/// No model of 100 MB has as many nodes; it bounds the memory for files that are nothing but tags.
const MOST_NODES: u32 = 5_000_000;

/// How much text the entities that a file declares may expand to.
const MOST_EXPANDED_BYTES: usize = 1 << 30;

/// The kinds of labels that mean something; the others are notes of people and tools.
const LABELS: [&str; 7] = [
    "invariant",
    "exponentialrate",
    "select",
    "guard",
    "synchronisation",
    "assignment",
    "probability",
];

/// Reads an XML model.
pub(super) fn read(
    path: &str,
    text: &str,
    sources: &mut SourceMap,
    diagnostics: &mut Vec<Diagnostic>,
) -> Document {
    let file = XmlFile::new(path, text);
    let options = ParsingOptions {
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
    match roxmltree::Document::parse_with_options(text, options) {
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
            let diagnostic = malformed(&error, &file, sources);
            diagnostics.push(diagnostic);
            Document::default()
        }
    }
}

/// roxmltree bounds the nesting of entities (10) and their references in one expansion (255), not their sum.
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
    let span = Span {
        start: to_u32(column),
        end: to_u32(column),
        ..span
    };
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
            let span = Span {
                end: to_u32(text.len()),
                ..Span::default()
            };
            is_old_syntax(text, &lex(text, span, &mut Vec::new()))
        });
    if is_old { Dialect::Old } else { Dialect::New }
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| is_element(*child, name))
}

fn is_element(node: Node, name: &str) -> bool {
    node.is_element() && node.tag_name().name() == name
}

fn point(node: Node) -> Option<Point> {
    let coordinate = |name| -> Option<i32> {
        let text = node.attribute(name)?.trim();
        text.parse().ok().or_else(|| {
            let value: f64 = text.parse().ok()?;
            #[expect(
                clippy::cast_possible_truncation,
                reason = "the cast saturates, and a drawing needs no more"
            )]
            let rounded = value.round() as i32;
            Some(rounded)
        })
    };
    Some(Point {
        x: coordinate("x")?,
        y: coordinate("y")?,
    })
}

struct Reader<'a, 's> {
    file: XmlFile<'a>,
    sources: &'s mut SourceMap,
    diagnostics: &'s mut Vec<Diagnostic>,
    dialect: Dialect,
    document: Document,
}

impl Reader<'_, '_> {
    fn root(&mut self, root: Node) {
        let name = root.tag_name().name();
        if !matches!(name, "nta" | "project") {
            let span = self.tag(root, "");
            let message = format!("this XML file is no UPPAAL model: its root is `<{name}>`");
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
                "template" => self.template(node),
                "lsc" => self.sequence_chart(node),
                "instantiation" => self.part(node, Part::Instantiations, "instantiations"),
                "system" => {
                    has_system = true;
                    self.part(node, Part::System, "system declarations");
                }
                "queries" => self.queries(node),
                _ => {}
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

    /// A source for an element's start tag.
    fn tag(&mut self, node: Node, place: &str) -> Span {
        let range = node.range();
        let raw = self.file.text.get(range.clone()).unwrap_or("");
        let end = range.start + end_of_tag(raw);
        self.file
            .add_raw(range.start..end, place.to_owned(), self.sources)
    }

    fn error(&mut self, code: Code, span: Span, message: impl Into<String>) {
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
    fn parse<T>(
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
        let text = format!("live sequence chart `{}`", name.unwrap_or("").trim());
        let span = self.tag(node, &text);
        self.document.unsupported.push(Name { text, span });
    }

    /// The name that stands in an element; `None` if it is blank.
    fn identifier(&mut self, node: Node, place: String) -> Option<Name> {
        let span = self.file.add_text(node, place, self.sources);
        let text = self.sources.text(span);
        let start = text.len() - text.trim_start().len();
        let word = text.trim().to_owned();
        if word.is_empty() {
            return None;
        }
        let span = Span {
            start: to_u32(start),
            end: to_u32(start + word.len()),
            ..span
        };
        let begins = |byte: u8| byte.is_ascii_alphabetic() || byte == b'_';
        let bytes = word.as_bytes();
        if !begins(bytes[0]) || end_of_word(bytes, 0) != bytes.len() {
            let shown: String = word.chars().take(40).collect();
            let message = format!("`{}` is no identifier", shown.escape_debug());
            self.diagnostics.push(
                Diagnostic::new(codes::INVALID_NAME, span, message)
                    .help("a name has letters, digits and `_`, and begins with no digit"),
            );
        } else if is_reserved(&word, Dialect::Old) {
            let message = format!("the reserved word `{word}` cannot be a name");
            self.error(codes::KEYWORD_AS_NAME, span, message);
        }
        Some(Name { text: word, span })
    }

    fn template(&mut self, node: Node) {
        let shown = child(node, "name").and_then(|name| name.text());
        let place = format!("template {}", shown.unwrap_or("").trim());
        let name =
            child(node, "name").and_then(|name| self.identifier(name, format!("{place}, name")));
        let name = name.unwrap_or_else(|| {
            let span = self.tag(node, "");
            self.error(codes::MISSING_PART, span, "this template has no name");
            let text = String::new();
            Name { text, span }
        });
        if is_built_in_function(&name.text) {
            let message = format!("`{}` is the name of a built-in function", name.text);
            self.error(codes::BUILT_IN_AS_NAME, name.span, message);
        }
        let parameters = child(node, "parameter").and_then(|n| {
            self.parse(n, format!("{place}, parameters"), |parser| {
                parser.parameters()
            })
        });
        let declarations = child(node, "declaration").and_then(|n| {
            self.parse(n, format!("{place}, declarations"), |parser| {
                parser.local_declarations()
            })
        });
        let mut template = Template {
            name,
            parameters: parameters.unwrap_or_default(),
            declarations: declarations.unwrap_or_default(),
            locations: Vec::new(),
            branchpoints: Vec::new(),
            initial: None,
            edges: Vec::new(),
        };
        self.nodes_of_graph(node, &place, &mut template);
        let names = names_of_locations(&template);
        for transition in node.children().filter(|n| is_element(*n, "transition")) {
            if let Some(edge) = self.transition(transition, &place, &names) {
                template.edges.push(edge);
            }
        }
        template.initial = self.initial(node, &place);
        self.document.templates.push(template);
    }

    fn nodes_of_graph(&mut self, node: Node, place: &str, template: &mut Template) {
        let mut ids = HashSet::new();
        for node in node.children().filter(Node::is_element) {
            let is_location = match node.tag_name().name() {
                "location" => true,
                "branchpoint" => false,
                _ => continue,
            };
            let (id, span) = self.id_of(node, place);
            let Some(id) = id else { continue };
            if !ids.insert(id.clone()) {
                let message = format!("the id `{id}` is used twice");
                self.error(codes::DUPLICATE_ID, span, message);
            }
            if is_location {
                let location = self.location(node, place, id, span);
                template.locations.push(location);
            } else {
                template.branchpoints.push(Branchpoint {
                    id,
                    position: point(node),
                    span,
                });
            }
        }
    }

    fn id_of(&mut self, node: Node, place: &str) -> (Option<String>, Span) {
        let kind = match node.tag_name().name() {
            "location" => "location",
            _ => "branch point",
        };
        let id = node.attribute("id").unwrap_or("").trim();
        let shown = child(node, "name")
            .and_then(|n| n.text())
            .map_or(id, str::trim);
        let span = self.tag(node, &format!("{place}, {kind} {shown}"));
        if id.is_empty() {
            let message = format!("this {kind} has no `id`");
            self.error(codes::MISSING_PART, span, message);
            return (None, span);
        }
        (Some(id.to_owned()), span)
    }

    fn location(&mut self, node: Node, place: &str, id: String, span: Span) -> Location {
        let place = format!("{place}, {}", location_in_words(node, &id));
        let name = child(node, "name").and_then(|n| self.identifier(n, format!("{place}, name")));
        if let Some(name) = &name
            && is_reserved(&name.text, Dialect::Query)
            && !is_reserved(&name.text, Dialect::Old)
        {
            let message = format!("`{}` is a word of the query language", name.text);
            self.diagnostics.push(
                Diagnostic::new(codes::QUERY_WORD_AS_NAME, name.span, message)
                    .help("rename the location: no query can name it, and UPPAAL refuses it"),
            );
        }
        let mut location = Location {
            id,
            name,
            invariant: None,
            exponential_rate: None,
            urgent: child(node, "urgent").is_some(),
            committed: child(node, "committed").is_some(),
            position: point(node),
            span,
        };
        if location.urgent && location.committed {
            let message = "this location is both urgent and committed";
            self.error(codes::URGENT_AND_COMMITTED, span, message);
        }
        for (kind, label) in self.labels(node, &place) {
            match kind {
                "invariant" => {
                    let place = format!("{place}, invariant");
                    location.invariant = self.parse(label, place, |parser| parser.condition_list());
                }
                "exponentialrate" => {
                    let place = format!("{place}, rate");
                    location.exponential_rate =
                        self.parse(label, place, |parser| parser.exponential_rate());
                }
                _ => {}
            }
        }
        location
    }

    /// The labels of an element that are read, by kind; of two of one kind the last one.
    fn labels<'a, 'input>(
        &mut self,
        node: Node<'a, 'input>,
        place: &str,
    ) -> Vec<(&'a str, Node<'a, 'input>)> {
        let mut labels: Vec<(&'a str, Node<'a, 'input>)> = Vec::new();
        for label in node.children().filter(|n| is_element(*n, "label")) {
            let Some(kind) = label.attribute("kind") else {
                let span = self.tag(label, place);
                self.error(codes::MISSING_PART, span, "this label has no `kind`");
                continue;
            };
            let is_blank = label
                .children()
                .filter(Node::is_text)
                .filter_map(|child| child.text())
                .all(|text| text.trim().is_empty());
            if is_blank || !LABELS.contains(&kind) {
                continue;
            }
            let earlier = labels.iter_mut().find(|(other, _)| *other == kind);
            if let Some(earlier) = earlier {
                earlier.1 = label;
                let span = self.tag(label, place);
                let message = format!("a second `{kind}` label replaces the first one");
                self.error(codes::DUPLICATE_LABEL, span, message);
            } else {
                labels.push((kind, label));
            }
        }
        labels
    }

    fn initial(&mut self, node: Node, place: &str) -> Option<Name> {
        let Some(init) = child(node, "init") else {
            let span = self.tag(node, place);
            self.diagnostics.push(
                Diagnostic::new(
                    codes::MISSING_INITIAL_LOCATION,
                    span,
                    "this template has no initial location",
                )
                .help("mark one location as initial: `<init ref=\"…\"/>`"),
            );
            return None;
        };
        self.reference(init, &format!("{place}, init"))
    }

    /// The name in the `ref` attribute.
    fn reference(&mut self, node: Node, place: &str) -> Option<Name> {
        let tag = self.tag(node, place);
        let Some(attribute) = node.attribute_node("ref") else {
            let message = format!("`<{}>` has no `ref`", node.tag_name().name());
            self.error(codes::MISSING_PART, tag, message);
            return None;
        };
        let start = node.range().start;
        let value = attribute.range_value();
        Some(Name {
            text: attribute.value().trim().to_owned(),
            span: Span {
                start: to_u32(value.start.saturating_sub(start)),
                end: to_u32(value.end.saturating_sub(start)),
                ..tag
            },
        })
    }

    fn transition(
        &mut self,
        node: Node,
        place: &str,
        names: &HashMap<String, String>,
    ) -> Option<Edge> {
        let place = format!("{place}, edge {}", edge_in_words(node, names));
        let span = self.tag(node, &place);
        let mut end = |element: &str, verb: &str| {
            if let Some(node) = child(node, element) {
                return self.reference(node, &place);
            }
            let message = format!("this edge {verb} no location: `<{element}>` is missing");
            self.error(codes::MISSING_PART, span, message);
            None
        };
        let source = end("source", "leaves");
        let target = end("target", "enters");
        let mut edge = Edge {
            source: source?,
            target: target?,
            select: Vec::new(),
            guard: None,
            sync: None,
            update: Vec::new(),
            probability: None,
            controllable: matches!(node.attribute("controllable"), None | Some("true")),
            nails: Vec::new(),
            span,
        };
        for (kind, label) in self.labels(node, &place) {
            self.edge_label(kind, label, &place, &mut edge);
        }
        let nails = node.children().filter(|n| is_element(*n, "nail"));
        edge.nails = nails.filter_map(point).collect();
        Some(edge)
    }

    fn edge_label(&mut self, kind: &str, label: Node, place: &str, edge: &mut Edge) {
        match kind {
            "select" => {
                let select = self.parse(label, format!("{place}, select"), |parser| {
                    parser.select_list()
                });
                edge.select = select.unwrap_or_default();
            }
            "guard" => {
                edge.guard = self.parse(label, format!("{place}, guard"), |parser| {
                    parser.condition_list()
                });
            }
            "synchronisation" => {
                let place = format!("{place}, synchronisation");
                edge.sync = self.parse(label, place, |parser| parser.synchronisation());
            }
            "assignment" => {
                let place = format!("{place}, update");
                let update = self.parse(label, place, |parser| parser.expression_list());
                edge.update = update.unwrap_or_default();
            }
            "probability" => {
                let place = format!("{place}, probability");
                edge.probability = self.parse(label, place, |parser| parser.expression());
            }
            _ => {}
        }
    }

    fn queries(&mut self, node: Node) {
        for (index, query) in node
            .children()
            .filter(|n| is_element(*n, "query"))
            .enumerate()
        {
            if let Some(formula) = child(query, "formula") {
                let place = format!("query {}", index + 1);
                if let Some(text) = self.query(query, formula, place) {
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
        Some(QueryText {
            span: Span {
                start: to_u32(start),
                end: to_u32(end),
                ..span
            },
            text: collapsed(text),
            comment: comment.unwrap_or("").trim().to_owned(),
            expect: expected.or_else(|| expectation_in(text)),
        })
    }
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

fn names_of_locations(template: &Template) -> HashMap<String, String> {
    template
        .locations
        .iter()
        .filter_map(|location| Some((location.id.clone(), location.name.as_ref()?.text.clone())))
        .collect()
}

fn location_in_words(node: Node, id: &str) -> String {
    let name = child(node, "name").and_then(|n| n.text());
    match name.map(str::trim) {
        Some(name) if !name.is_empty() => format!("location {name}"),
        _ => format!("location {id}"),
    }
}

fn edge_in_words(node: Node, names: &HashMap<String, String>) -> String {
    let end = |element| {
        let id = child(node, element).and_then(|n| n.attribute("ref"));
        let id = id.unwrap_or("?").trim();
        names.get(id).map_or(id, String::as_str).to_owned()
    };
    format!("{} → {}", end("source"), end("target"))
}
