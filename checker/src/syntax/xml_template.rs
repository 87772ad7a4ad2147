//! Templates of XML models: locations, branch points, edges and their labels.
//!
//! A transition is controllable if its attribute is absent or exactly `true`; every other value
//! makes it the environment's, as in utap.

#![expect(
    clippy::redundant_closure_for_method_calls,
    reason = "the path of a method is not general over the lifetime of the parser"
)]

use super::ast::{Branchpoint, Edge, LabelKind, Location, Name, Point, Template, UnsupportedPart};
use super::codes;
use super::keywords::Dialect;
use super::keywords::{is_built_in_function, is_reserved};

use super::xml::{Reader, child, is_element};
use crate::diagnostics::{Diagnostic, Span};
use roxmltree::Node;
use std::collections::{HashMap, HashSet};

impl Reader<'_, '_> {
    pub(super) fn template(&mut self, node: Node) {
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
        let unsupported = self.document.unsupported.len();
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
            ..Template::default()
        };
        self.nodes_of_graph(node, &place, &mut template);
        let names = names_of_locations(&template);
        for transition in node.children().filter(|n| is_element(*n, "transition")) {
            if let Some(edge) = self.transition(transition, &place, &names) {
                template.edges.push(edge);
            }
        }
        template.initial = self.initial(node, &place);
        for construct in &mut self.document.unsupported[unsupported..] {
            construct.part = UnsupportedPart::Template(self.document.templates.len());
        }
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
            urgent: child(node, "urgent").is_some(),
            committed: child(node, "committed").is_some(),
            position: point(node),
            labels: child(node, "name")
                .and_then(point)
                .map(|at| (LabelKind::Name, at))
                .into_iter()
                .collect(),
            color: color(node),
            span,
            ..Location::default()
        };
        if location.urgent && location.committed {
            let message = "this location is both urgent and committed";
            self.error(codes::URGENT_AND_COMMITTED, span, message);
        }
        for (kind, label) in self.labels(node, &place) {
            location.labels.extend(point(label).map(|at| (kind, at)));
            match kind {
                LabelKind::Invariant => {
                    let place = format!("{place}, invariant");
                    location.invariant = self.parse(label, place, |parser| parser.condition_list());
                }
                LabelKind::ExponentialRate => {
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
    ) -> Vec<(LabelKind, Node<'a, 'input>)> {
        let mut labels: Vec<(LabelKind, Node<'a, 'input>)> = Vec::new();
        for label in node.children().filter(|n| is_element(*n, "label")) {
            let Some(name) = label.attribute("kind") else {
                let span = self.tag(label, place);
                self.error(codes::MISSING_PART, span, "this label has no `kind`");
                continue;
            };
            let is_blank = label
                .children()
                .filter(Node::is_text)
                .filter_map(|child| child.text())
                .all(|text| text.trim().is_empty());
            let Some(kind) = label_kind(name).filter(|_| !is_blank) else {
                continue;
            };
            let earlier = labels.iter_mut().find(|(other, _)| *other == kind);
            if let Some(earlier) = earlier {
                earlier.1 = label;
                let span = self.tag(label, place);
                let message = format!("a second `{name}` label replaces the first one");
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
        let value = attribute.range_value();
        let behind_start = |at: usize| at.saturating_sub(node.range().start);
        Some(Name {
            text: attribute.value().trim().to_owned(),
            span: tag.part(behind_start(value.start)..behind_start(value.end)),
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
            controllable: matches!(node.attribute("controllable"), None | Some("true")),
            color: color(node),
            span,
            ..Edge::default()
        };
        for (kind, label) in self.labels(node, &place) {
            edge.labels.extend(point(label).map(|at| (kind, at)));
            self.edge_label(kind, label, &place, &mut edge);
        }
        let nails = node.children().filter(|n| is_element(*n, "nail"));
        edge.nails = nails.filter_map(point).collect();
        Some(edge)
    }

    fn edge_label(&mut self, kind: LabelKind, label: Node, place: &str, edge: &mut Edge) {
        match kind {
            LabelKind::Select => {
                let select = self.parse(label, format!("{place}, select"), |parser| {
                    parser.select_list()
                });
                edge.select = select.unwrap_or_default();
            }
            LabelKind::Guard => {
                edge.guard = self.parse(label, format!("{place}, guard"), |parser| {
                    parser.condition_list()
                });
            }
            LabelKind::Synchronisation => {
                let place = format!("{place}, synchronisation");
                edge.sync = self.parse(label, place, |parser| parser.synchronisation());
            }
            LabelKind::Update => {
                let place = format!("{place}, update");
                let update = self.parse(label, place, |parser| parser.expression_list());
                edge.update = update.unwrap_or_default();
            }
            LabelKind::Probability => {
                let place = format!("{place}, probability");
                edge.probability = self.parse(label, place, |parser| parser.expression());
            }
            _ => {}
        }
    }
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

/// A colour as the editor writes it: `#rrggbb`.
fn color(node: Node) -> Option<u32> {
    let digits = node.attribute("color")?.trim().strip_prefix('#')?;
    let is_color = digits.len() == 6 && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_color.then(|| u32::from_str_radix(digits, 16).ok())?
}

/// Where a label stands, if the file says so.
fn label_kind(name: &str) -> Option<LabelKind> {
    Some(match name {
        "invariant" => LabelKind::Invariant,
        "exponentialrate" => LabelKind::ExponentialRate,
        "select" => LabelKind::Select,
        "guard" => LabelKind::Guard,
        "synchronisation" => LabelKind::Synchronisation,
        "assignment" => LabelKind::Update,
        "probability" => LabelKind::Probability,
        _ => return None,
    })
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
