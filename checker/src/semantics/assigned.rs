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
    let mut names = HashSet::new();
    for expr in template.edges.iter().flat_map(|edge| &edge.update) {
        in_expr(expr, &mut names);
    }
    for declaration in &template.declarations {
        if let Declaration::Function(function) = declaration {
            in_function(function, &mut names);
        }
    }
    names
}

fn in_function(function: &Function, names: &mut HashSet<String>) {
    let mut own = HashSet::new();
    in_block(&function.body, &mut own);
    let mut declared: HashSet<String> = HashSet::new();
    for parameter in &function.parameters {
        declared.insert(parameter.name.text.clone());
    }
    declared_in_block(&function.body, &mut declared);
    names.extend(own.difference(&declared).cloned());
}

fn in_block(block: &Block, names: &mut HashSet<String>) {
    for declaration in &block.declarations {
        if let Declaration::Variable(variable) = declaration
            && let Some(Initialiser::Expr(value)) = &variable.initialiser
        {
            in_expr(value, names);
        }
    }
    for statement in &block.statements {
        in_statement(statement, names);
    }
}

fn in_statement(statement: &Statement, names: &mut HashSet<String>) {
    each_expr(statement, &mut |expr| in_expr(expr, names));
    each_block(statement, &mut |block| in_block(block, names));
}

fn declared_in_block(block: &Block, names: &mut HashSet<String>) {
    for declaration in &block.declarations {
        if let Declaration::Variable(variable) = declaration {
            names.insert(variable.name.text.clone());
        }
    }
    for statement in &block.statements {
        each_block(statement, &mut |block| declared_in_block(block, names));
    }
}

/// The expressions of a statement, outside the blocks in it.
fn each_expr(statement: &Statement, visit: &mut dyn FnMut(&Expr)) {
    match statement {
        Statement::Empty | Statement::Block(_) | Statement::Return(None, _) => {}
        Statement::Expr(expr) | Statement::Return(Some(expr), _) | Statement::Assert(expr, _) => {
            visit(expr);
        }
        Statement::For {
            init,
            condition,
            step,
            body,
        } => {
            [init, condition, step]
                .into_iter()
                .flatten()
                .for_each(&mut *visit);
            each_expr(body, visit);
        }
        Statement::Iterate { body, .. } => each_expr(body, visit),
        Statement::While(condition, body) | Statement::DoWhile(body, condition) => {
            visit(condition);
            each_expr(body, visit);
        }
        Statement::If(branches, otherwise) => {
            for (condition, then) in branches {
                visit(condition);
                each_expr(then, visit);
            }
            if let Some(otherwise) = otherwise {
                each_expr(otherwise, visit);
            }
        }
    }
}

/// The outermost blocks of a statement.
fn each_block(statement: &Statement, visit: &mut dyn FnMut(&Block)) {
    match statement {
        Statement::Block(block) => visit(block),
        Statement::For { body, .. }
        | Statement::Iterate { body, .. }
        | Statement::While(_, body)
        | Statement::DoWhile(body, _) => each_block(body, visit),
        Statement::If(branches, otherwise) => {
            for (_, then) in branches {
                each_block(then, visit);
            }
            if let Some(otherwise) = otherwise {
                each_block(otherwise, visit);
            }
        }
        _ => {}
    }
}

fn in_expr(expr: &Expr, names: &mut HashSet<String>) {
    match &expr.kind {
        ExprKind::Assign(_, target, value) => {
            names.extend(root(target));
            in_expr(target, names);
            in_expr(value, names);
        }
        ExprKind::Step { target, .. } => {
            names.extend(root(target));
            in_expr(target, names);
        }
        ExprKind::Field(inner, _) | ExprKind::Unary(_, inner) | ExprKind::Rate(inner) => {
            in_expr(inner, names);
        }
        ExprKind::Index(left, right) | ExprKind::Binary(_, left, right) => {
            in_expr(left, names);
            in_expr(right, names);
        }
        ExprKind::Call(_, arguments) | ExprKind::Spawn(_, arguments) => {
            for argument in arguments {
                in_expr(argument, names);
            }
        }
        ExprKind::Ternary(condition, then, otherwise) => {
            in_expr(condition, names);
            in_expr(then, names);
            in_expr(otherwise, names);
        }
        _ => {}
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
