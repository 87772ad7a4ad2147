//! The parts of textual models: process definitions, instantiations, the system line, and what may
//! follow it.

use super::ast::{
    BinaryOp, Branchpoint, Declaration, Document, Edge, Expr, ExprKind, Location, Name, QueryText,
    Sync, System, SystemItem, Template, TypeExpr, UnsupportedPart,
};
use super::codes;
use super::declarations::Scope;
use super::expressions::join_all;
use super::keywords::Dialect;
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::{Diagnostic, SourceMap, Span};
use std::collections::HashMap;

/// Which part of a model a text is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// The `<declaration>` of an XML file.
    Declarations,
    /// The `<instantiation>` of an XML file.
    Instantiations,
    /// The `<system>` of an XML file.
    System,
    /// A whole textual model.
    Whole,
}

/// `commit` or `urgent`.
#[derive(Clone, Copy, Debug)]
enum Mark {
    Committed,
    Urgent,
}

impl Parser<'_> {
    /// Everything that stands outside templates; the spans of queries are returned.
    pub(super) fn model(&mut self, part: Part, document: &mut Document) -> Vec<Span> {
        let mut queries = Vec::new();
        let mut has_system = false;
        while !self.at_end() {
            let before = self.progress();
            match self.word() {
                "process" => self.process_definition(document),
                "system" if !has_system && matches!(part, Part::System | Part::Whole) => {
                    self.system_line(&mut document.system);
                    has_system = true;
                }
                "progress" if has_system => self.progress_measures(&mut document.system),
                "gantt" if has_system => self.gantt(),
                "IO" if has_system => self.interface(),
                "query" if has_system => queries.extend(self.query_block()),
                _ if has_system => {
                    self.expected("the end of the model after the system line");
                    self.bump();
                    self.recover();
                }
                _ if self.at_instantiation() => self.instantiation(&mut document.system),
                _ => self.declaration_of(part, document),
            }
            if self.progress() == before {
                self.bump();
            }
        }
        document.unsupported.append(&mut self.unsupported);
        if !has_system && matches!(part, Part::System | Part::Whole) {
            let end = self.behind_previous();
            self.report_earlier(
                Diagnostic::new(codes::MISSING_SYSTEM, end, "no `system` line")
                    .help("name the processes of the system, for example `system P, Q;`"),
            );
        }
        queries
    }

    fn declaration_of(&mut self, part: Part, document: &mut Document) {
        let mut declarations = Vec::new();
        self.declaration(Scope::Global, &mut declarations);
        // In a textual model, declarations are global as long as a process may follow that uses
        // them.
        let is_global = match part {
            Part::Declarations => true,
            Part::Whole => document.system.items.is_empty(),
            Part::Instantiations | Part::System => false,
        };
        if is_global {
            document.declarations.append(&mut declarations);
        } else {
            let items = declarations.into_iter().map(SystemItem::Declaration);
            document.system.items.extend(items);
        }
    }

    /// `P = …` or `P(…) = …`: a name that no second one follows, as in a declaration.
    fn at_instantiation(&self) -> bool {
        self.is_name_at(0)
            && matches!(
                self.peek(1).kind,
                TokenKind::Assign | TokenKind::ColonAssign | TokenKind::LeftParenthesis
            )
    }

    /// `P(parameters) = T(arguments);`
    fn instantiation(&mut self, system: &mut System) {
        let before = self.progress();
        let name = self.declared_name("the name of the process");
        let parameters = if self.at(TokenKind::LeftParenthesis) {
            self.parameter_list()
        } else {
            Vec::new()
        };
        if !self.eat(TokenKind::ColonAssign) {
            self.expect(TokenKind::Assign, "after the name of the process");
        }
        let template = self.name("the name of a template");
        let arguments = if self.at(TokenKind::LeftParenthesis) {
            self.arguments()
        } else {
            self.expected("`(` before the arguments");
            Vec::new()
        };
        system.items.push(SystemItem::Instantiation {
            name,
            parameters,
            template,
            arguments,
        });
        self.end_of_declaration("after the instantiation", before);
    }

    /// `system A, B < C;`
    fn system_line(&mut self, system: &mut System) {
        let before = self.progress();
        self.bump();
        if system.processes.is_empty() {
            system.processes.push(Vec::new());
        }
        loop {
            let name = self.name("the name of a process");
            if !name.text.is_empty()
                && let Some(level) = system.processes.last_mut()
            {
                level.push(name);
            }
            if self.eat(TokenKind::Less) {
                system.processes.push(Vec::new());
            } else if !self.eat(TokenKind::Comma) {
                break;
            }
        }
        self.end_of_declaration("after the system line", before);
    }

    fn progress_measures(&mut self, system: &mut System) {
        self.bump();
        self.expect(TokenKind::LeftBrace, "after `progress`");
        while !self.at_end() && !self.at(TokenKind::RightBrace) {
            let before = self.progress();
            system.progress.push(self.expression());
            if self.eat(TokenKind::Colon) {
                system.progress.push(self.expression());
            }
            self.end_of_declaration("after the progress measure", before);
        }
        self.closing(TokenKind::RightBrace, "after the progress measures");
    }

    /// `IO P(1) { a!, b? }`: which channels are a process's outputs and inputs. Only Ecdar's
    /// queries look at it, so the tree does not keep it.
    fn interface(&mut self) {
        let start = self.here();
        self.bump();
        self.name("the name of a process");
        if self.at(TokenKind::LeftParenthesis) {
            self.arguments();
        }
        self.report_earlier(
            Diagnostic::new(
                codes::INTERFACE_IGNORED,
                self.since(start),
                "the interface of a process (`IO`) is read and has no effect",
            )
            .note(
                "only queries of Ecdar, such as `refinement:`, use it, and they are not supported",
            ),
        );
        self.expect(TokenKind::LeftBrace, "after `IO` and the process");
        while !self.at_end() && !self.at(TokenKind::RightBrace) {
            // Not a whole expression: `?` would begin a choice.
            self.expression_at(super::expressions::level::POSTFIX);
            if !self.eat(TokenKind::Exclamation) {
                self.eat(TokenKind::Question);
            }
            if !self.eat(TokenKind::Comma) {
                break;
            }
        }
        self.closing(TokenKind::RightBrace, "after the channels");
    }

    /// `gantt { … }`: only drawn by the editor, so the tree does not keep it.
    fn gantt(&mut self) {
        self.bump();
        self.expect(TokenKind::LeftBrace, "after `gantt`");
        while !self.at_end() && !self.at(TokenKind::RightBrace) {
            let before = self.progress();
            self.gantt_line();
            self.end_of_declaration("after the line of the chart", before);
        }
        self.closing(TokenKind::RightBrace, "after the chart");
    }

    /// `G(i : T) : condition -> value, for (j : U) condition -> value`
    fn gantt_line(&mut self) {
        self.name("the name of a line of the chart");
        if self.eat(TokenKind::LeftParenthesis) {
            self.select_list();
            self.closing(TokenKind::RightParenthesis, "after the bound names");
        }
        self.expect(TokenKind::Colon, "before the bars of the line");
        self.comma_separated(|parser| {
            if parser.eat_word("for") {
                parser.expect(TokenKind::LeftParenthesis, "after `for`");
                parser.select_list();
                parser.closing(TokenKind::RightParenthesis, "after the bound names");
            }
            parser.expression();
            parser.expect(TokenKind::Arrow, "between condition and value of a bar");
            parser.expression();
        });
    }

    /// `query { … }`: the span of the formula.
    fn query_block(&mut self) -> Option<Span> {
        self.bump();
        self.expect(TokenKind::LeftBrace, "after `query`");
        let start = self.here();
        self.skip_to(&[TokenKind::RightBrace]);
        let is_empty = self.here().start == start.start;
        let span = self.since(start);
        self.expect(TokenKind::RightBrace, "after the query");
        (!is_empty).then_some(span)
    }

    /// `process Name(parameters) { … }`
    fn process_definition(&mut self, document: &mut Document) {
        let start = self.here();
        let unsupported = self.unsupported.len();
        self.bump();
        let name = self.declared_name("the name of the process");
        let parameters = if self.at(TokenKind::LeftParenthesis) || self.dialect == Dialect::New {
            self.parameter_list()
        } else {
            Vec::new()
        };
        if !self.expect(TokenKind::LeftBrace, "before the body of the process") {
            self.recover();
            return;
        }
        keep_declarations_global(document);
        let mut template = Template {
            name,
            parameters,
            declarations: self.local_declarations(),
            ..Template::default()
        };
        let mut marks = Vec::new();
        while !self.at_end() && !self.at(TokenKind::RightBrace) {
            let before = self.progress();
            self.process_part(&mut template, &mut marks);
            if self.progress() == before {
                self.bump();
            }
        }
        self.expect(TokenKind::RightBrace, "at the end of the process");
        self.set_marks(&marks, &mut template.locations);
        template.marked = marks.into_iter().map(|(_, name)| name).collect();
        if template.initial.is_none() {
            let message = format!("process `{}` has no initial location", template.name.text);
            self.report_earlier(
                Diagnostic::new(codes::MISSING_INITIAL_LOCATION, start, message)
                    .help("add `init L;` after the states"),
            );
        }
        for construct in &mut self.unsupported[unsupported..] {
            construct.part = UnsupportedPart::Template(document.templates.len());
        }
        document.templates.push(template);
    }

    fn process_part(&mut self, template: &mut Template, marks: &mut Vec<(Mark, Name)>) {
        let before = self.progress();
        match self.word() {
            "state" => self.states(template),
            "branchpoint" => self.branchpoints(template),
            "commit" => self.marks(Mark::Committed, marks),
            "urgent" => self.marks(Mark::Urgent, marks),
            "init" => {
                self.bump();
                template.initial = Some(self.name("the name of the initial location"));
            }
            "trans" => self.transitions(template),
            _ => {
                let mut late: Vec<Declaration> = Vec::new();
                self.expected("`state`, `init`, `trans` or the end of the process");
                self.declaration(Scope::Template, &mut late);
                template.declarations.append(&mut late);
                return;
            }
        }
        self.end_of_declaration("at the end of this part of the process", before);
    }

    /// `state A{invariant; rate}, B;`
    fn states(&mut self, template: &mut Template) {
        self.bump();
        self.comma_separated(|parser| {
            let name = parser.name("the name of a location");
            let mut location = Location {
                id: name.text.clone(),
                span: name.span,
                name: Some(name),
                ..Location::default()
            };
            if parser.eat(TokenKind::LeftBrace) {
                if !parser.at(TokenKind::Semicolon) {
                    location.invariant = Some(parser.condition_list());
                }
                if parser.eat(TokenKind::Semicolon) {
                    location.exponential_rate = Some(parser.exponential_rate());
                }
                parser.closing(TokenKind::RightBrace, "after the invariant");
            }
            if !location.id.is_empty() {
                template.locations.push(location);
            }
        });
    }

    /// `a` or `a : b`, the rate a/b.
    pub(super) fn exponential_rate(&mut self) -> Expr {
        let start = self.here();
        let rate = self.expression();
        if !self.eat(TokenKind::Colon) {
            return rate;
        }
        let divisor = self.expression();
        let span = self.since(start);
        let joined = |operator, left, right| Expr {
            kind: ExprKind::Binary(operator, Box::new(left), Box::new(right)),
            span,
        };
        // A quotient of doubles, also of integers.
        let one = Expr {
            kind: ExprKind::Double(1.0),
            span,
        };
        let rate = joined(BinaryOp::Multiply, one, rate);
        joined(BinaryOp::Divide, rate, divisor)
    }

    /// A guard or invariant; the old syntax has a list, all of which must hold.
    pub(super) fn condition_list(&mut self) -> Expr {
        let start = self.here();
        let mut conditions = vec![self.expression()];
        while self.at(TokenKind::Comma) {
            if self.dialect == Dialect::New {
                let message = "expected `&&` between two conditions, found `,`";
                self.report(
                    Diagnostic::new(codes::UNEXPECTED_TOKEN, self.here(), message)
                        .help("write `&&`; only the old syntax knows lists of conditions"),
                );
            }
            self.bump();
            conditions.push(self.expression());
        }
        let mut joined = match join_all(BinaryOp::And, conditions) {
            Some(expr) => expr,
            None => self.error_expr(),
        };
        joined.span = self.since(start);
        joined
    }

    fn branchpoints(&mut self, template: &mut Template) {
        self.bump();
        self.comma_separated(|parser| {
            let name = parser.name("the name of a branch point");
            template.branchpoints.push(Branchpoint {
                id: name.text,
                position: None,
                span: name.span,
            });
        });
    }

    /// `commit A, B` and `urgent A, B`
    fn marks(&mut self, mark: Mark, marks: &mut Vec<(Mark, Name)>) {
        self.bump();
        self.comma_separated(|parser| marks.push((mark, parser.name("the name of a location"))));
    }

    /// Sets the marks once all locations are known.
    fn set_marks(&mut self, marks: &[(Mark, Name)], locations: &mut [Location]) {
        let index: HashMap<String, usize> = locations
            .iter()
            .enumerate()
            .map(|(index, location)| (location.id.clone(), index))
            .collect();
        for (mark, name) in marks {
            if name.text.is_empty() {
                continue;
            }
            let Some(&index) = index.get(&name.text) else {
                let message = format!("`{}` is not a location of this process", name.text);
                self.report_earlier(Diagnostic::new(codes::UNKNOWN_LOCATION, name.span, message));
                continue;
            };
            let location = &mut locations[index];
            match mark {
                Mark::Committed => location.committed = true,
                Mark::Urgent => location.urgent = true,
            }
            if location.urgent && location.committed {
                let message = format!("location `{}` is both urgent and committed", name.text);
                let code = codes::URGENT_AND_COMMITTED;
                self.report_earlier(Diagnostic::new(code, name.span, message));
            }
        }
    }

    fn transitions(&mut self, template: &mut Template) {
        self.bump();
        let mut source: Option<Name> = None;
        self.comma_separated(|parser| {
            let start = parser.here();
            let reused = matches!(
                parser.kind(),
                TokenKind::Arrow | TokenKind::UncontrollableArrow
            );
            let from = match (&source, reused) {
                (Some(source), true) => source.clone(),
                _ => parser.name("the location that the edge leaves"),
            };
            match parser.transition(start, from.clone()) {
                Some(edge) => template.edges.push(edge),
                None => parser.skip_to(&[TokenKind::Comma, TokenKind::Semicolon]),
            }
            source = Some(from);
        });
    }

    /// `-> B { … }`
    fn transition(&mut self, start: Span, source: Name) -> Option<Edge> {
        let controllable = !self.at(TokenKind::UncontrollableArrow);
        if !self.eat(TokenKind::Arrow) && !self.eat(TokenKind::UncontrollableArrow) {
            self.expected("`->` or `-u->` after the location");
            return None;
        }
        let target = self.name("the location that the edge enters");
        let mut edge = Edge {
            source,
            target,
            controllable,
            ..Edge::default()
        };
        if self.expect(TokenKind::LeftBrace, "before the labels of the edge") {
            while !self.at_end() && !self.at(TokenKind::RightBrace) {
                let before = self.progress();
                self.edge_label(&mut edge);
                self.end_of_declaration("after the label", before);
            }
            self.expect(TokenKind::RightBrace, "after the labels of the edge");
        }
        edge.span = self.since(start);
        Some(edge)
    }

    fn edge_label(&mut self, edge: &mut Edge) {
        match self.word() {
            "select" => {
                self.bump();
                edge.select = self.select_list();
            }
            "guard" => {
                self.bump();
                edge.guard = Some(self.condition_list());
            }
            "sync" => {
                self.bump();
                edge.sync = Some(self.synchronisation());
            }
            "assign" => {
                self.bump();
                edge.update = self.expression_list();
            }
            "probability" => {
                self.bump();
                edge.probability = Some(self.expression());
            }
            _ => {
                let what = "`select`, `guard`, `sync`, `assign` or `probability`";
                if self.is_name_at(0) && self.peek(1).kind != TokenKind::Word {
                    let hint = "write a comma between updates: `assign a = 0, b = 1;`";
                    self.expected_with_hint(what, hint);
                } else {
                    self.expected(what);
                }
            }
        }
    }

    /// `i : T, j : U`
    pub(super) fn select_list(&mut self) -> Vec<(Name, TypeExpr)> {
        let mut bindings = Vec::new();
        loop {
            let name = self.declared_name("the name of a selected value");
            if !self.expect(TokenKind::Colon, "between the name and its type") {
                return bindings;
            }
            bindings.push((name, self.type_expr()));
            if !self.eat(TokenKind::Comma) {
                return bindings;
            }
        }
    }

    /// `c!` or `c?`
    pub(super) fn synchronisation(&mut self) -> Sync {
        let start = self.here();
        let channel = self.expression();
        let send = self.at(TokenKind::Exclamation);
        if send || self.at(TokenKind::Question) {
            self.bump();
        } else if self.at_end() || self.at(TokenKind::Semicolon) {
            let message =
                "this synchronisation has no direction (CSP synchronisation is not supported)";
            self.report(
                Diagnostic::new(codes::MISSING_DIRECTION, channel.span, message)
                    .help("write `!` after the channel to send, `?` to receive"),
            );
        } else {
            self.expected("`!` or `?` after the channel");
        }
        let span = self.since(start);
        Sync {
            channel,
            send,
            span,
        }
    }
}

/// Declarations between instantiations are visible to this process, so they are global.
fn keep_declarations_global(document: &mut Document) {
    let mut kept = Vec::new();
    for item in document.system.items.drain(..) {
        match item {
            SystemItem::Declaration(declaration) => document.declarations.push(declaration),
            instantiation @ SystemItem::Instantiation { .. } => kept.push(instantiation),
        }
    }
    document.system.items = kept;
}

/// The query texts of the formulas that stand at `spans`.
pub(super) fn query_texts(spans: &[Span], sources: &SourceMap) -> Vec<QueryText> {
    spans
        .iter()
        .map(|&span| QueryText {
            span,
            text: super::q_file::collapsed(sources.text(span)),
            ..QueryText::default()
        })
        .collect()
}
