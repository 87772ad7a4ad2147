//! Which parameters by value a template assigns to: they are variables of the process; all others
//! are constants.
//!
//! Found on the syntax tree, because it decides what the names mean while the template is checked.
//! A function that declares the name itself is left out.

use std::collections::HashSet;

use crate::syntax::ast::{
    Block, Declaration, Expr, ExprKind, Function, Initialiser, Statement, Template,
};

/// The names that the edges and functions of a template assign to.
pub(super) fn assigned_names(template: &Template) -> HashSet<String> {
    let mut names = Names::default();
    names.exprs(template.edges.iter().flat_map(|edge| &edge.update));
    for declaration in &template.declarations {
        if let Declaration::Function(function) = declaration {
            names.assigned.extend(assigned_outside(function));
        }
    }
    names.assigned
}

/// The names that a function assigns to and does not declare.
fn assigned_outside(function: &Function) -> HashSet<String> {
    let parameters = function.parameters.iter();
    let mut names = Names {
        declared: parameters.map(|one| one.name.text.clone()).collect(),
        ..Names::default()
    };
    names.block(&function.body);
    &names.assigned - &names.declared
}

/// The names that a piece of code assigns to, and those that it declares.
#[derive(Default)]
struct Names {
    assigned: HashSet<String>,
    declared: HashSet<String>,
}

impl Names {
    fn block(&mut self, block: &Block) {
        for declaration in &block.declarations {
            if let Declaration::Variable(variable) = declaration {
                self.declared.insert(variable.name.text.clone());
                if let Some(Initialiser::Expr(value)) = &variable.initialiser {
                    self.expr(value);
                }
            }
        }
        for statement in &block.statements {
            self.statement(statement);
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match statement {
            Statement::Empty | Statement::Return(None, _) => {}
            Statement::Block(block) => self.block(block),
            Statement::Expr(expr)
            | Statement::Return(Some(expr), _)
            | Statement::Assert(expr, _) => self.expr(expr),
            Statement::For {
                init,
                condition,
                step,
                body,
            } => {
                self.exprs([init, condition, step].into_iter().flatten());
                self.statement(body);
            }
            Statement::Iterate { body, .. } => self.statement(body),
            Statement::While(condition, body) | Statement::DoWhile(body, condition) => {
                self.expr(condition);
                self.statement(body);
            }
            Statement::If(branches, otherwise) => {
                for (condition, then) in branches {
                    self.expr(condition);
                    self.statement(then);
                }
                if let Some(otherwise) = otherwise {
                    self.statement(otherwise);
                }
            }
        }
    }

    fn exprs<'e>(&mut self, exprs: impl IntoIterator<Item = &'e Expr>) {
        for expr in exprs {
            self.expr(expr);
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Assign(_, target, value) => {
                self.assigned.extend(root(target));
                self.expr(target);
                self.expr(value);
            }
            ExprKind::Step { target, .. } => {
                self.assigned.extend(root(target));
                self.expr(target);
            }
            ExprKind::Field(inner, _) | ExprKind::Unary(_, inner) | ExprKind::Rate(inner) => {
                self.expr(inner);
            }
            ExprKind::Index(left, right) | ExprKind::Binary(_, left, right) => {
                self.expr(left);
                self.expr(right);
            }
            ExprKind::Call(_, arguments) | ExprKind::Spawn(_, arguments) => self.exprs(arguments),
            ExprKind::Ternary(condition, then, otherwise) => {
                self.expr(condition);
                self.expr(then);
                self.expr(otherwise);
            }
            _ => {}
        }
    }
}

/// The variable that a place is part of.
fn root(place: &Expr) -> Option<String> {
    match &place.kind {
        ExprKind::Name(name) => Some(name.clone()),
        ExprKind::Field(inner, _) | ExprKind::Index(inner, _) => root(inner),
        _ => None,
    }
}
