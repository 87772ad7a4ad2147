//! The walk through a model: declarations, templates, statements, expressions.

use super::declared::SymbolKind;
use super::resolver::{Reach, Resolver, Shape};
use crate::diagnostics::Span;
use crate::syntax::ast::{
    Block, Declaration, Dimension, Document, Edge, Expr, ExprKind, Function, ImportedFunction,
    Initialiser, Location, Name, Parameter, Statement, StructField, System, SystemItem, Template,
    TypeExpr, TypeKind, Variable,
};
use crate::syntax::{print_dimension, print_type};

/// Longer initial values are not shown.
const SHOWN_BYTES: usize = 60;

impl Resolver<'_> {
    /// A whole model. The scope of the system section stays open, for queries.
    pub(super) fn document(&mut self, document: &Document) {
        // Declarations of dynamic templates stand before the templates.
        let symbols: Vec<usize> = document
            .templates
            .iter()
            .map(|one| self.template_name(one))
            .collect();
        self.declarations(&document.declarations);
        for (template, symbol) in document.templates.iter().zip(symbols) {
            self.template(template, symbol);
        }
        self.enter(Reach::Pieces);
        self.system(&document.system);
    }

    fn template_name(&mut self, template: &Template) -> usize {
        let name = &template.name;
        self.names.groups.push(Vec::new());
        let shape = Shape {
            members: Some(self.names.groups.len() - 1),
            ..Shape::default()
        };
        let detail = format!(
            "{}({})",
            name.text,
            printed_parameters(&template.parameters)
        );
        self.declare(name, SymbolKind::Template, name.span, detail, shape)
    }

    fn template(&mut self, template: &Template, symbol: usize) {
        self.enter(Reach::Pieces);
        self.note(template.name.span);
        self.parameters(&template.parameters);
        self.declarations(&template.declarations);
        for location in &template.locations {
            self.location_name(location);
        }
        if let Some(group) = self.names.symbols[symbol].members {
            self.names.groups[group] = self.group_of_scope();
        }
        for location in &template.locations {
            let texts = [&location.invariant, &location.exponential_rate];
            self.values(texts.into_iter().flatten());
        }
        for name in template.initial.iter().chain(&template.marked) {
            self.location_use(name);
        }
        for edge in &template.edges {
            self.edge(edge);
        }
        self.leave();
    }

    fn location_name(&mut self, location: &Location) {
        if let Some(name) = &location.name {
            let kind = match (location.urgent, location.committed) {
                (_, true) => "committed location",
                (true, _) => "urgent location",
                _ => "location",
            };
            let detail = format!("{kind} {}", name.text);
            self.declare(
                name,
                SymbolKind::Location,
                name.span,
                detail,
                Shape::default(),
            );
        }
    }

    /// Where a textual model names a location; XML refers to its `id`.
    fn location_use(&mut self, name: &Name) {
        if self.sources.get(name.span.source).place.is_empty() {
            self.use_name(&name.text, name.span);
        }
    }

    fn edge(&mut self, edge: &Edge) {
        self.location_use(&edge.source);
        self.location_use(&edge.target);
        self.enter(Reach::Pieces);
        for (name, ty) in &edge.select {
            self.bound(name, ty);
        }
        self.values(&edge.guard);
        self.values(edge.sync.iter().map(|sync| &sync.channel));
        self.values(&edge.update);
        self.values(&edge.probability);
        self.leave();
    }

    fn system(&mut self, system: &System) {
        for item in &system.items {
            match item {
                SystemItem::Declaration(one) => self.declaration(one),
                SystemItem::Instantiation {
                    name,
                    parameters,
                    template,
                    arguments,
                } => {
                    self.enter(Reach::Walked);
                    self.parameters(parameters);
                    let shape = self.use_name(&template.text, template.span);
                    self.values(arguments);
                    self.leave();
                    let parameters = printed_parameters(parameters);
                    let detail = format!("{}({parameters}) = {}(…)", name.text, template.text);
                    self.declare(name, SymbolKind::Process, name.span, detail, shape);
                }
            }
        }
        for name in system.processes.iter().flatten() {
            self.use_name(&name.text, name.span);
        }
        self.values(&system.progress);
    }

    pub(super) fn declarations(&mut self, declarations: &[Declaration]) {
        for declaration in declarations {
            self.declaration(declaration);
        }
    }

    fn declaration(&mut self, declaration: &Declaration) {
        match declaration {
            Declaration::Typedef {
                ty,
                name,
                dimensions,
            } => {
                let shape = self.shape(ty, dimensions);
                let detail = format!("typedef {}", printed(ty, false, name, dimensions));
                self.declare(name, SymbolKind::Type, ty.span, detail, shape);
            }
            Declaration::Variable(one) => self.variable(one),
            Declaration::Function(function) => self.function(function),
            Declaration::ChannelPriority { levels, .. } => {
                let channels = levels.iter().flatten().flatten();
                self.values(channels);
            }
            Declaration::Import(import) => {
                for function in &import.functions {
                    self.imported(function);
                }
            }
            Declaration::Dynamic(one) => {
                self.use_name(&one.name.text, one.name.span);
                self.enter(Reach::Walked);
                self.parameters(&one.parameters);
                self.leave();
            }
            Declaration::BeforeUpdate(updates, _) | Declaration::AfterUpdate(updates, _) => {
                self.values(updates);
            }
        }
    }

    fn variable(&mut self, one: &Variable) {
        let shape = self.shape(&one.ty, &one.dimensions);
        let kind = if one.ty.prefixes.constant {
            SymbolKind::Constant
        } else {
            shape.kind.unwrap_or(SymbolKind::Variable)
        };
        let mut detail = printed(&one.ty, false, &one.name, &one.dimensions);
        if let Some(Initialiser::Expr(value)) = &one.initialiser {
            let text = self.sources.text(value.span);
            if text.len() <= SHOWN_BYTES {
                detail.push_str(" = ");
                detail.push_str(text);
            }
        }
        // Its own name is not known in its initial value.
        if let Some(value) = &one.initialiser {
            self.initialiser(value, shape);
        }
        self.declare(&one.name, kind, one.ty.span, detail, shape);
    }

    fn initialiser(&mut self, value: &Initialiser, shape: Shape) {
        match value {
            Initialiser::Expr(value) => self.value(value),
            Initialiser::Table(span) => self.note(*span),
            Initialiser::List(items, span) => {
                self.note(*span);
                for (number, (name, item)) in items.iter().enumerate() {
                    let inner = if let Some(arrays) = shape.arrays.checked_sub(1) {
                        Shape { arrays, ..shape }
                    } else if let Some(name) = name {
                        self.use_member(shape.members, name)
                    } else {
                        let group = shape.members.map(|group| &self.names.groups[group]);
                        let field = group.and_then(|fields| fields.get(number));
                        field.map(|&field| self.shapes[field]).unwrap_or_default()
                    };
                    self.initialiser(item, inner);
                }
            }
        }
    }

    fn function(&mut self, function: &Function) {
        let shape = self.shape(&function.return_type, &[]);
        let name = &function.name;
        let detail = printed_function(&function.return_type, name, &function.parameters);
        self.declare(
            name,
            SymbolKind::Function,
            function.return_type.span,
            detail,
            shape,
        );
        self.enter(Reach::Braces);
        self.note(name.span);
        self.parameters(&function.parameters);
        self.block(&function.body);
        self.leave();
    }

    fn imported(&mut self, function: &ImportedFunction) {
        let shape = self.shape(&function.return_type, &[]);
        let name = &function.name;
        let detail = printed_function(&function.return_type, name, &function.parameters);
        self.declare(
            name,
            SymbolKind::Function,
            function.return_type.span,
            detail,
            shape,
        );
        self.enter(Reach::Walked);
        self.parameters(&function.parameters);
        self.leave();
    }

    fn parameters(&mut self, parameters: &[Parameter]) {
        for one in parameters {
            let shape = self.shape(&one.ty, &one.dimensions);
            let detail = printed(&one.ty, one.reference, &one.name, &one.dimensions);
            self.declare(&one.name, SymbolKind::Parameter, one.ty.span, detail, shape);
        }
    }

    /// A value that is bound to a name, and the type that it comes from.
    fn bound(&mut self, name: &Name, ty: &TypeExpr) {
        let shape = self.shape(ty, &[]);
        let detail = format!("{} : {}", name.text, print_type(ty));
        self.declare(name, SymbolKind::Bound, name.span, detail, shape);
    }

    /// What is known of values of a type.
    fn shape(&mut self, ty: &TypeExpr, dimensions: &[Dimension]) -> Shape {
        let known = self.types.get(&ty.span).copied();
        let mut shape = known.unwrap_or_else(|| self.new_shape(ty));
        self.types.insert(ty.span, shape);
        for dimension in dimensions {
            match dimension {
                Dimension::Size(size) => self.value(size),
                Dimension::Type(ty) => {
                    self.shape(ty, &[]);
                }
            }
        }
        shape.arrays += dimensions.len();
        shape
    }

    fn new_shape(&mut self, ty: &TypeExpr) -> Shape {
        self.note(ty.span);
        let mut shape = Shape::default();
        match &ty.kind {
            TypeKind::Range(low, high) => {
                self.value(low);
                self.value(high);
            }
            TypeKind::Scalar(size) => self.value(size),
            TypeKind::Clock => shape.kind = Some(SymbolKind::Clock),
            TypeKind::Channel => shape.kind = Some(SymbolKind::Channel),
            TypeKind::Struct(fields) => {
                let symbols = fields.iter().map(|field| self.field(field)).collect();
                self.names.groups.push(symbols);
                shape.members = Some(self.names.groups.len() - 1);
            }
            TypeKind::Named(name) => shape = self.use_name(&name.text, name.span),
            TypeKind::Void
            | TypeKind::Int
            | TypeKind::Bool
            | TypeKind::Double
            | TypeKind::String => {}
        }
        shape
    }

    fn field(&mut self, field: &StructField) -> usize {
        let shape = self.shape(&field.ty, &field.dimensions);
        let detail = printed(&field.ty, false, &field.name, &field.dimensions);
        self.add(&field.name, SymbolKind::Field, field.ty.span, detail, shape)
    }

    fn block(&mut self, block: &Block) {
        self.declarations(&block.declarations);
        for statement in &block.statements {
            self.statement(statement);
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Empty => {}
            Statement::Block(block) => {
                self.enter(Reach::Braces);
                self.block(block);
                self.leave();
            }
            Statement::Expr(value) | Statement::Assert(value, _) => self.value(value),
            Statement::For {
                init,
                condition,
                step,
                body,
            } => {
                let parts = [init, condition, step];
                self.values(parts.into_iter().flatten());
                self.statement(body);
            }
            Statement::Iterate { name, ty, body } => {
                self.enter(Reach::Walked);
                self.bound(name, ty);
                self.statement(body);
                self.leave();
            }
            Statement::While(condition, body) | Statement::DoWhile(body, condition) => {
                self.value(condition);
                self.statement(body);
            }
            Statement::If(branches, otherwise) => {
                for (condition, then) in branches {
                    self.value(condition);
                    self.statement(then);
                }
                if let Some(otherwise) = otherwise {
                    self.statement(otherwise);
                }
            }
            Statement::Return(value, span) => {
                self.note(*span);
                self.values(value);
            }
        }
    }

    pub(super) fn values<'e>(&mut self, exprs: impl IntoIterator<Item = &'e Expr>) {
        for expr in exprs {
            self.value(expr);
        }
    }

    /// An expression on whose shape nothing depends.
    pub(super) fn value(&mut self, expr: &Expr) {
        self.expr(expr);
    }

    fn expr(&mut self, expr: &Expr) -> Shape {
        self.note(expr.span);
        match &expr.kind {
            ExprKind::Name(name) => self.use_name(name, self.bare(expr.span, name)),
            ExprKind::Field(record, name) => {
                let shape = self.expr(record);
                self.use_member(shape.members, name)
            }
            ExprKind::Index(array, index) => {
                self.value(index);
                let shape = self.expr(array);
                Shape {
                    arrays: shape.arrays.saturating_sub(1),
                    ..shape
                }
            }
            ExprKind::Call(function, arguments) => {
                self.values(arguments);
                self.expr(function)
            }
            ExprKind::Unary(_, inner) | ExprKind::Rate(inner) => self.expr(inner),
            ExprKind::Step { target, .. } => self.expr(target),
            ExprKind::Binary(_, left, right) => {
                self.chain(left, right);
                Shape::default()
            }
            ExprKind::Ternary(condition, then, otherwise) => {
                self.value(condition);
                self.value(otherwise);
                self.expr(then)
            }
            ExprKind::Assign(_, target, value) => {
                self.value(value);
                self.expr(target)
            }
            ExprKind::Quantifier { name, ty, body, .. } => {
                self.within_bound(name, ty, |resolver| resolver.value(body));
                Shape::default()
            }
            ExprKind::Spawn(name, arguments) => {
                self.values(arguments);
                self.use_name(&name.text, name.span)
            }
            ExprKind::NumberOf(name) => {
                self.use_name(&name.text, name.span);
                Shape::default()
            }
            ExprKind::Int(_)
            | ExprKind::Double(_)
            | ExprKind::Bool(_)
            | ExprKind::String(_)
            | ExprKind::Exit
            | ExprKind::Deadlock
            | ExprKind::Error
            | ExprKind::Unsupported => Shape::default(),
        }
    }

    /// Both sides of an operator; a long chain of operators leans to the left, and is no recursion.
    fn chain(&mut self, left: &Expr, right: &Expr) {
        let mut sides = vec![right];
        let mut left = left;
        while let ExprKind::Binary(_, inner, right) = &left.kind {
            self.note(left.span);
            sides.push(right);
            left = inner;
        }
        self.value(left);
        self.values(sides.into_iter().rev());
    }

    /// Walks what may use a bound value.
    pub(super) fn within_bound(
        &mut self,
        name: &Name,
        ty: &TypeExpr,
        walk: impl FnOnce(&mut Self),
    ) {
        self.enter(Reach::Walked);
        self.bound(name, ty);
        walk(self);
        self.leave();
    }

    /// The place of a name without the parentheses around it.
    fn bare(&self, span: Span, name: &str) -> Span {
        let text = self.sources.text(span);
        match text.find(name) {
            Some(start) if text.len() > name.len() => span.part(start..start + name.len()),
            _ => span,
        }
    }
}

fn printed(ty: &TypeExpr, reference: bool, name: &Name, dimensions: &[Dimension]) -> String {
    let mark = if reference { "&" } else { "" };
    let dimensions: String = dimensions.iter().map(print_dimension).collect();
    format!("{} {mark}{}{dimensions}", print_type(ty), name.text)
}

fn printed_parameters(parameters: &[Parameter]) -> String {
    let texts = parameters
        .iter()
        .map(|one| printed(&one.ty, one.reference, &one.name, &one.dimensions));
    texts.collect::<Vec<_>>().join(", ")
}

fn printed_function(ty: &TypeExpr, name: &Name, parameters: &[Parameter]) -> String {
    format!(
        "{} {}({})",
        print_type(ty),
        name.text,
        printed_parameters(parameters)
    )
}
