//! Functions of the model and the statements of their bodies.

use std::sync::Arc;

use super::checker::Checker;
use super::codes;
use super::initialisers::{InitialPart, InitialValue};
use super::left_out::causes::declared_at;
use super::scalars::is_order_irrelevant;
use super::scope::{Carried, Entity, Scope};
use super::typed::{
    Effects, Expr, Kind, LocalId, Parameter, Place, Root, Signature, Statement, Unknown,
};
use super::types::{Size, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::FunctionId;
use crate::syntax::ast::{self, Declaration, Name};

/// The function of a declaration that could not be lowered; never called, because nothing is
/// lowered after a mistake.
pub(super) const NO_FUNCTION: FunctionId = FunctionId(u32::MAX);

impl Checker<'_> {
    /// Checks a function, lowers it, and declares its name.
    pub(super) fn function(&mut self, function: &ast::Function) {
        let outer_locals = std::mem::take(&mut self.locals);
        let unknowns = self.unknowns.len();
        let result = self.result_type(&function.return_type);
        self.function_span = function.name.span;
        self.declare(&function.name, Entity::OpenFunction);
        self.scopes.push(Scope::default());
        let parameters: Vec<Parameter> = function
            .parameters
            .iter()
            .map(|parameter| self.function_parameter(parameter))
            .collect();
        let body = self.block_in_scope(&function.body, &result);
        self.scopes.pop();
        if result != Type::Void && !result.is_error() && !returns(&body) {
            self.error(
                codes::RETURN_MISSING,
                function.name.span,
                format!("'{}' can end without returning a value", function.name.text),
                "return a value on every path",
            );
        }
        let mut signature = Signature {
            name: function.name.text.clone(),
            parameters,
            result,
            effects: Effects::default(),
            is_external: false,
            unknown: None,
        };
        if self.unknowns.len() > unknowns {
            // Such a function can only be called where nothing depends on the result.
            let first = self.unknowns.swap_remove(unknowns);
            self.unknowns.truncate(unknowns);
            signature.unknown = Some(Unknown::of(&body, first));
        }
        let id = self.lower_function(&mut signature, &body);
        self.locals = outer_locals;
        let entity = Entity::Function(id, Arc::new(signature));
        let scope = self
            .scopes
            .last_mut()
            .expect("the scope of the declaration is open");
        if matches!(
            scope.get(&function.name.text),
            Some((Entity::OpenFunction, _))
        ) {
            scope.set(&function.name.text, entity, function.name.span);
        }
    }

    fn lower_function(&mut self, signature: &mut Signature, body: &Statement) -> FunctionId {
        if signature.unknown.is_some() || !self.can_lower() {
            return NO_FUNCTION;
        }
        let name = match &self.process {
            Some((_, process)) => format!("{process}.{}", signature.name),
            None => signature.name.clone(),
        };
        let locals = std::mem::take(&mut self.locals);
        let mut builder = self.builder_over(locals);
        builder.signature(&signature.parameters, &signature.result);
        let (id, effects) = builder.function(name, body);
        signature.effects = effects;
        id
    }

    pub(super) fn result_type(&mut self, ty: &ast::TypeExpr) -> Type {
        let result = self.type_of(ty);
        let is_value = result.is_number()
            || matches!(
                result,
                Type::Void | Type::Error | Type::Scalar { .. } | Type::Struct(_)
            );
        let is_data = result.size().clocks + result.size().channels == 0;
        if is_value && is_data {
            return result;
        }
        self.error(
            codes::RESULT_TYPE,
            ty.span,
            format!("a function cannot return {}", result.described()),
            "pass it by reference, or put it into a struct",
        );
        Type::Error
    }

    fn function_parameter(&mut self, parameter: &ast::Parameter) -> Parameter {
        let ty = self.dimensioned(&parameter.ty, &parameter.dimensions);
        self.check_parameter_type(parameter, &ty);
        self.parameter_of_type(parameter, ty)
    }

    /// A parameter of this type; its name is declared.
    pub(super) fn parameter_of_type(&mut self, parameter: &ast::Parameter, ty: Type) -> Parameter {
        let local = self.new_local(ty.clone());
        self.locals[local.0 as usize].reference = parameter.reference;
        let constant = self.carried(&parameter.ty).constant;
        let declared = declared_at(&ty, parameter.name.span);
        let place = Place {
            mutable: !constant,
            declared,
            ..Place::bound(local)
        };
        let entity = if ty.is_error() {
            Entity::Broken
        } else {
            Entity::Variable {
                place,
                ty: ty.clone(),
            }
        };
        self.declare(&parameter.name, entity);
        Parameter {
            name: parameter.name.text.clone(),
            ty,
            reference: parameter.reference,
            constant,
            passes_channel: false,
            declared,
        }
    }

    /// Checks that clocks and channels come by reference.
    pub(super) fn check_parameter_type(&mut self, parameter: &ast::Parameter, ty: &Type) {
        let size = ty.size();
        if !parameter.reference && size.clocks + size.channels > 0 {
            self.error(
                codes::PARAMETER_BY_VALUE,
                parameter.name.span,
                format!("{} cannot be passed by value", ty.described()),
                "write & before the name",
            );
        }
        if matches!(ty, Type::Void | Type::String) {
            self.error(
                codes::TYPE_MISPLACED,
                parameter.ty.span,
                format!("{ty} cannot be the type of a parameter"),
                "use another type",
            );
        }
    }

    fn block(&mut self, block: &ast::Block, result: &Type) -> Statement {
        self.scopes.push(Scope::default());
        let checked = self.block_in_scope(block, result);
        self.scopes.pop();
        checked
    }

    fn block_in_scope(&mut self, block: &ast::Block, result: &Type) -> Statement {
        let mut statements = Vec::new();
        for declaration in &block.declarations {
            match declaration {
                Declaration::Typedef {
                    ty,
                    name,
                    dimensions,
                } => self.typedef(ty, name, dimensions),
                Declaration::Variable(variable) => {
                    statements.extend(self.local_variable(variable));
                }
                // The parser has refused these.
                Declaration::Function(_)
                | Declaration::Import(_)
                | Declaration::Dynamic(_)
                | Declaration::ChannelPriority { .. }
                | Declaration::BeforeUpdate(..)
                | Declaration::AfterUpdate(..) => {}
            }
        }
        for statement in &block.statements {
            statements.push(self.statement(statement, result));
        }
        Statement::Block(statements)
    }

    fn local_variable(&mut self, variable: &ast::Variable) -> Option<Statement> {
        let ty = self.dimensioned(&variable.ty, &variable.dimensions);
        let before = self.unknowns.len();
        let mut parts = variable
            .initialiser
            .as_ref()
            .map(|initialiser| self.initialiser(initialiser, &ty, true));
        self.expect_values(&ty, variable.ty.span);
        let prefixes = self.carried(&variable.ty);
        if !self.can_be_local(&ty, variable, prefixes) {
            self.declare(&variable.name, Entity::Broken);
            return None;
        }
        if prefixes.constant && parts.is_none() {
            self.report_no_value(&variable.name);
        }
        let declared = declared_at(&ty, variable.name.span);
        for part in parts.iter().flatten() {
            if let Some(value) = part.expr() {
                self.takes_unknown(declared, value, before);
            }
        }
        if self.cause_of(declared).is_some()
            && let Some(parts) = &mut parts
            && !parts
                .iter()
                .filter_map(InitialPart::expr)
                .any(Expr::has_effect)
        {
            parts.clear();
            self.unknowns.truncate(before);
            return Some(self.declare_local(variable, ty, Vec::new()));
        }
        let mut parts = parts.unwrap_or_default();
        let is_known = parts
            .iter()
            .filter_map(InitialPart::expr)
            .all(|value| Self::is_computable(value) && !value.is_unknown());
        if prefixes.constant && is_known {
            let entity = match self.initial_words(&mut parts, &ty) {
                Some(words) => self.constant_entity(words, &ty, false, variable.name.span),
                None => Entity::Broken,
            };
            self.declare(&variable.name, entity);
            return None;
        }
        Some(self.declare_local(variable, ty, parts))
    }

    /// Whether a variable of a type may be a local of a function; reports it otherwise.
    fn can_be_local(&mut self, ty: &Type, variable: &ast::Variable, prefixes: Carried) -> bool {
        let size = ty.size();
        let is_refused = size.clocks + size.channels > 0
            || prefixes.meta
            || matches!(ty, Type::Void | Type::String);
        if is_refused {
            self.error(
                codes::TYPE_MISPLACED,
                variable.ty.span,
                format!("{} cannot be a local of a function", ty.described()),
                "declare it outside the function",
            );
        }
        !is_refused && !ty.is_error()
    }

    fn declare_local(
        &mut self,
        variable: &ast::Variable,
        ty: Type,
        parts: Vec<InitialPart>,
    ) -> Statement {
        // Without a value, a scalar is the first member; in a list of values, the first comes
        // first.
        if parts.is_empty() {
            self.distinguish_scalars(&ty, variable.name.span);
        } else {
            self.distinguish_indices(&ty, variable.name.span);
        }
        let local = self.new_local(ty.clone());
        let root = Root::Local(local);
        let assignments = parts
            .into_iter()
            .filter_map(|part| {
                let value = match part.value {
                    InitialValue::Expr(value) => value,
                    InitialValue::Words(words, span) => self.constant_value(words, &part.ty, span),
                };
                let is_known = !value.is_error();
                is_known.then(|| initial_assignment(root, part.offset, part.ty, value))
            })
            .collect();
        let place = Place {
            mutable: !self.carried(&variable.ty).constant,
            declared: declared_at(&ty, variable.name.span),
            ..Place::bound(local)
        };
        self.declare(&variable.name, Entity::Variable { place, ty });
        Statement::Declare(local, assignments)
    }

    /// An array or struct of these words, which lie among the constants.
    fn constant_value(&mut self, words: Vec<i32>, ty: &Type, span: Span) -> Expr {
        match self.constant_entity(words, ty, false, span) {
            Entity::Variable { place, ty } => Expr::new(Kind::Variable(place), ty, span),
            _ => Expr::error(span),
        }
    }

    fn statement(&mut self, statement: &ast::Statement, result: &Type) -> Statement {
        match statement {
            ast::Statement::Empty => Statement::Block(Vec::new()),
            ast::Statement::Block(block) => self.block(block, result),
            ast::Statement::Expr(expr) => Statement::Expr(self.effect_expression(expr)),
            ast::Statement::For {
                init,
                condition,
                step,
                body,
            } => {
                let init = init.as_ref().map(|init| self.effect_expression(init));
                let condition = condition
                    .as_ref()
                    .map(|condition| self.condition(condition));
                let step = step.as_ref().map(|step| self.effect_expression(step));
                let body = Box::new(self.statement(body, result));
                let parts = [&condition, &step, &init];
                let span = parts.into_iter().flatten().map(|part| part.span).next();
                let repeat = Statement::Loop {
                    condition,
                    step,
                    body,
                    tested_first: true,
                    span: span.unwrap_or(self.function_span),
                };
                Statement::Block(
                    init.map(Statement::Expr)
                        .into_iter()
                        .chain([repeat])
                        .collect(),
                )
            }
            ast::Statement::While(condition, body) => Statement::Loop {
                condition: Some(self.condition(condition)),
                step: None,
                body: Box::new(self.statement(body, result)),
                tested_first: true,
                span: condition.span,
            },
            ast::Statement::DoWhile(body, condition) => {
                let body = Box::new(self.statement(body, result));
                Statement::Loop {
                    condition: Some(self.condition(condition)),
                    step: None,
                    body,
                    tested_first: false,
                    span: condition.span,
                }
            }
            ast::Statement::Iterate { name, ty, body } => self.iterate(name, ty, body, result),
            ast::Statement::If(branches, otherwise) => {
                let branch = |(condition, then): &(ast::Expr, ast::Statement)| {
                    (self.condition(condition), self.statement(then, result))
                };
                let branches = branches.iter().map(branch).collect();
                let otherwise = otherwise.as_ref();
                let otherwise = otherwise.map(|one| Box::new(self.statement(one, result)));
                Statement::If(branches, otherwise)
            }
            ast::Statement::Return(value, span) => {
                self.return_statement(value.as_ref(), *span, result)
            }
            ast::Statement::Assert(condition, span) => {
                let condition = self.condition(condition);
                self.expect_pure(&condition, "an assertion");
                Statement::Assert(condition, *span)
            }
        }
    }

    fn iterate(
        &mut self,
        name: &Name,
        ty: &ast::TypeExpr,
        body: &ast::Statement,
        result: &Type,
    ) -> Statement {
        let iterated = self.iterated(ty);
        self.scopes.push(Scope::default());
        let (range, local) = if let Some((ty, range)) = iterated {
            let local = self.new_local(ty.clone());
            let place = Place::bound(local);
            self.declare(name, Entity::Variable { place, ty });
            (range, local)
        } else {
            self.declare(name, Entity::Broken);
            ((0, 0), LocalId(0))
        };
        let span = ty.span;
        let body = Box::new(self.statement(body, result));
        self.scopes.pop();
        if let Some(ty) = self.locals.get(local.0 as usize).map(|one| one.ty.clone())
            && ty.scalar_set().is_some()
            && !is_order_irrelevant(&body, local, &self.locals)
        {
            self.distinguish_members(&ty, span);
        }
        Statement::Iterate { local, range, body }
    }

    /// An expression that stands for its effect.
    pub(super) fn effect_expression(&mut self, expr: &ast::Expr) -> Expr {
        let before = self.unknowns.len();
        let checked = self.expression(expr);
        if matches!(checked.ty, Type::Channel { .. } | Type::Constraint(_)) {
            return self.error(
                codes::NOT_A_STATEMENT,
                checked.span,
                format!("{} is not a statement", checked.ty.described()),
                "write an assignment or a call; channels stand in synchronisations, conditions in guards",
            );
        }
        self.warn_without_effect(&checked);
        let is_work = matches!(checked.kind, Kind::Assign(..) | Kind::Call { .. });
        if is_work && checked.is_unknown() && !checked.has_effect() {
            // All that it does, it does to what nothing depends on.
            self.unknowns.truncate(before);
            return Expr::new(Kind::Int(0), Type::Void, checked.span);
        }
        checked
    }

    /// Warns of an expression whose value is dropped and that changes nothing.
    fn warn_without_effect(&mut self, expr: &Expr) {
        // A call of a function without effect is common in libraries of models; a dropped
        // comparison is a typing mistake.
        let is_silent = expr.is_error() || expr.ty == Type::Void || expr.has_effect();
        if !is_silent && !matches!(expr.kind, Kind::Call { .. } | Kind::Assign(..)) {
            self.report(
                crate::diagnostics::Diagnostic::new(
                    codes::EFFECT_MISSING,
                    expr.span,
                    "this changes nothing",
                )
                .help("did you mean an assignment?"),
            );
        }
    }

    /// The condition of a statement.
    fn condition(&mut self, expr: &ast::Expr) -> Expr {
        let checked = self.expression(expr);
        if checked.is_error() {
            return checked;
        }
        if matches!(checked.ty, Type::Constraint(_)) {
            let diagnostic = Diagnostic::new(
                codes::CONDITION_EXPECTED,
                checked.span,
                "functions cannot read clocks: their values are known only symbolically",
            );
            let diagnostic = diagnostic.help("test the clock in the guard of an edge");
            return self.unknown(diagnostic, checked, Type::Bool);
        }
        if !checked.ty.is_integral() {
            return self.error(
                codes::CONDITION_EXPECTED,
                checked.span,
                format!(
                    "a condition is needed, but this is {}",
                    checked.ty.described()
                ),
                "compare it with something",
            );
        }
        checked
    }

    fn return_statement(
        &mut self,
        value: Option<&ast::Expr>,
        span: Span,
        result: &Type,
    ) -> Statement {
        let value = value.map(|value| self.expression(value));
        match (value, result) {
            (None, Type::Void | Type::Error) => Statement::Return(None),
            (None, _) => {
                self.error(
                    codes::RETURN_MISMATCHED,
                    span,
                    format!(
                        "the function returns {}, but no value stands here",
                        result.described()
                    ),
                    "write the value after return",
                );
                Statement::Return(None)
            }
            (Some(value), Type::Void) => {
                self.error(
                    codes::RETURN_MISMATCHED,
                    value.span,
                    "the function returns nothing, but a value stands here",
                    "write return; or change the type of the function",
                );
                Statement::Return(None)
            }
            (Some(value), _) => {
                let value_span = value.span;
                let value = self.converted(value, result);
                Statement::Return(Some(value.unwrap_or_else(|| Expr::error(value_span))))
            }
        }
    }
}

/// The assignment that gives a part of a local its initial value.
fn initial_assignment(root: Root, offset: Size, ty: Type, value: Expr) -> Expr {
    let place = Place::unnamed(root, offset, true);
    let span = value.span;
    let target = Expr::new(Kind::Variable(place), ty.clone(), span);
    let kind = Kind::Assign(Box::new(target), Box::new(value));
    Expr::new(kind, ty, span)
}

/// Whether a statement always ends in `return`.
fn returns(statement: &Statement) -> bool {
    match statement {
        Statement::Block(statements) => statements.iter().any(returns),
        Statement::If(branches, Some(otherwise)) => {
            branches.iter().all(|(_, then)| returns(then)) && returns(otherwise)
        }
        Statement::Return(..) => true,
        Statement::Loop {
            body, tested_first, ..
        } => !tested_first && returns(body),
        _ => false,
    }
}
