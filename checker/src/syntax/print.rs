//! Expressions and types back as text, with no more parentheses than needed.
//!
//! Invariant: reading the text again gives the same tree, places aside. Two trees that differ in
//! how long runs of `&&` and `||` are bracketed may give one text.

use super::ast::{BinaryOp, Expr, ExprKind, Prefixes, Quantifier, TypeExpr, TypeKind, UnaryOp};
use super::ast::{Dimension, StructField};
use super::expressions::{level, level_of};
use std::fmt::Write;

/// The text of an expression.
pub fn print_expr(expr: &Expr) -> String {
    let mut printer = Printer::default();
    printer.expr(expr, level::ASSIGNMENT, true);
    printer.text
}

/// The text of a type.
pub fn print_type(ty: &TypeExpr) -> String {
    let mut printer = Printer::default();
    printer.type_expr(ty);
    printer.text
}

/// The text of one `[…]` after a declared name.
pub fn print_dimension(dimension: &Dimension) -> String {
    let mut printer = Printer::default();
    printer.dimension(dimension);
    printer.text
}

#[derive(Default)]
struct Printer {
    text: String,
}

impl Printer {
    fn push(&mut self, text: &str) {
        self.text.push_str(text);
    }

    fn display(&mut self, value: impl std::fmt::Display) {
        write!(self.text, "{value}").expect("writing to a string never fails");
    }

    /// `open` says that nothing follows that a quantifier's body could swallow.
    fn expr(&mut self, expr: &Expr, least: u8, open: bool) {
        let is_quantifier = matches!(expr.kind, ExprKind::Quantifier { .. });
        if level_of_expr(expr) < least || (is_quantifier && !open) {
            self.push("(");
            self.kind(&expr.kind, true);
            self.push(")");
        } else {
            self.kind(&expr.kind, open);
        }
    }

    fn kind(&mut self, kind: &ExprKind, open: bool) {
        match kind {
            ExprKind::Int(value) => self.display(value),
            ExprKind::Double(value) => {
                write!(self.text, "{value:?}").expect("writing to a string never fails");
            }
            ExprKind::Bool(value) => self.display(value),
            ExprKind::String(text) => self.display(format_args!("\"{text}\"")),
            ExprKind::Name(name) => self.push(name),
            ExprKind::Deadlock => self.push("deadlock"),
            ExprKind::Exit => self.push("exit()"),
            ExprKind::NumberOf(name) => self.display(format_args!("numOf({})", name.text)),
            ExprKind::Spawn(name, arguments) => {
                self.display(format_args!("spawn {}", name.text));
                self.arguments(arguments);
            }
            ExprKind::Error | ExprKind::Unsupported => self.push("<error>"),
            ExprKind::Field(object, name) => {
                self.expr(object, level::POSTFIX, false);
                self.push(".");
                self.push(&name.text);
            }
            ExprKind::Index(array, index) => {
                self.expr(array, level::POSTFIX, false);
                self.push("[");
                self.expr(index, level::ASSIGNMENT, true);
                self.push("]");
            }
            ExprKind::Call(function, arguments) => self.call(function, arguments),
            ExprKind::Rate(clock) => {
                self.expr(clock, level::POSTFIX, false);
                self.push("'");
            }
            ExprKind::Unary(operator, operand) => self.unary(*operator, operand, open),
            ExprKind::Binary(operator, left, right) => self.binary(*operator, left, right, open),
            ExprKind::Ternary(condition, then, otherwise) => {
                self.expr(condition, level::OR, false);
                self.push(" ? ");
                self.expr(then, level::ASSIGNMENT, true);
                self.push(" : ");
                self.expr(otherwise, level::ASSIGNMENT, open);
            }
            ExprKind::Assign(operator, target, value) => {
                self.expr(target, level::OR, false);
                let operator = operator.map_or("", symbol);
                self.display(format_args!(" {operator}= "));
                self.expr(value, level::ASSIGNMENT, open);
            }
            ExprKind::Step {
                target,
                delta,
                postfix,
            } => self.step(target, *delta, *postfix),
            ExprKind::Quantifier {
                quantifier,
                name,
                ty,
                body,
            } => {
                self.push(match quantifier {
                    Quantifier::ForAll => "forall",
                    Quantifier::Exists => "exists",
                    Quantifier::Sum => "sum",
                });
                self.display(format_args!(" ({} : ", name.text));
                self.type_expr(ty);
                self.push(") ");
                self.expr(body, level::ASSIGNMENT, true);
            }
        }
    }

    fn call(&mut self, function: &Expr, arguments: &[Expr]) {
        self.expr(function, level::POSTFIX, false);
        self.arguments(arguments);
    }

    fn arguments(&mut self, arguments: &[Expr]) {
        self.push("(");
        for (index, argument) in arguments.iter().enumerate() {
            self.push(if index == 0 { "" } else { ", " });
            self.expr(argument, level::ASSIGNMENT, true);
        }
        self.push(")");
    }

    fn unary(&mut self, operator: UnaryOp, operand: &Expr, open: bool) {
        let sign = match operator {
            UnaryOp::Not => "!",
            UnaryOp::Minus => "-",
            UnaryOp::Plus => "+",
        };
        self.push(sign);
        let start = self.text.len();
        self.expr(operand, level::PREFIX, open);
        // `--x` would be a decrement.
        if self.text[start..].starts_with(sign) && operator != UnaryOp::Not {
            self.text.insert(start, '(');
            self.push(")");
        }
    }

    fn binary(&mut self, operator: BinaryOp, left: &Expr, right: &Expr, open: bool) {
        let level = level_of(operator);
        self.expr(left, level, false);
        self.display(format_args!(" {} ", symbol(operator)));
        self.expr(right, level + 1, open);
    }

    fn step(&mut self, target: &Expr, delta: i32, postfix: bool) {
        let symbol = if delta < 0 { "--" } else { "++" };
        if postfix {
            self.expr(target, level::POSTFIX, false);
            self.push(symbol);
        } else {
            self.push(symbol);
            let start = self.text.len();
            self.expr(target, level::PREFIX, false);
            if self.text[start..].starts_with(['+', '-']) {
                self.text.insert(start, '(');
                self.push(")");
            }
        }
    }

    fn type_expr(&mut self, ty: &TypeExpr) {
        self.prefixes(ty.prefixes);
        match &ty.kind {
            TypeKind::Void => self.push("void"),
            TypeKind::Int => self.push("int"),
            TypeKind::Bool => self.push("bool"),
            TypeKind::Double => self.push("double"),
            TypeKind::String => self.push("string"),
            TypeKind::Clock => self.push("clock"),
            TypeKind::Channel => self.push("chan"),
            TypeKind::Named(name) => self.push(&name.text),
            TypeKind::Range(low, high) => {
                self.push("int[");
                self.expr(low, level::ASSIGNMENT, true);
                self.push(", ");
                self.expr(high, level::ASSIGNMENT, true);
                self.push("]");
            }
            TypeKind::Scalar(size) => {
                self.push("scalar[");
                self.expr(size, level::ASSIGNMENT, true);
                self.push("]");
            }
            TypeKind::Struct(fields) => self.struct_fields(fields),
        }
    }

    fn prefixes(&mut self, prefixes: Prefixes) {
        let words = [
            (prefixes.constant, "const "),
            (prefixes.meta, "meta "),
            (prefixes.urgent, "urgent "),
            (prefixes.broadcast, "broadcast "),
            (prefixes.hybrid, "hybrid "),
        ];
        for (is_set, word) in words {
            if is_set {
                self.push(word);
            }
        }
    }

    fn struct_fields(&mut self, fields: &[StructField]) {
        self.push("struct { ");
        for field in fields {
            self.type_expr(&field.ty);
            self.display(format_args!(" {}", field.name.text));
            for dimension in &field.dimensions {
                self.dimension(dimension);
            }
            self.push("; ");
        }
        self.push("}");
    }

    fn dimension(&mut self, dimension: &Dimension) {
        self.push("[");
        match dimension {
            Dimension::Size(size) => self.expr(size, level::ASSIGNMENT, true),
            Dimension::Type(ty) => self.type_expr(ty),
        }
        self.push("]");
    }
}

fn level_of_expr(expr: &Expr) -> u8 {
    match &expr.kind {
        ExprKind::Assign(..) => level::ASSIGNMENT,
        ExprKind::Ternary(..) => level::TERNARY,
        ExprKind::Binary(operator, ..) => level_of(*operator),
        // A quantifier stands where an operand can; what follows it is the concern of `open`.
        ExprKind::Unary(..)
        | ExprKind::Step { postfix: false, .. }
        | ExprKind::Quantifier { .. } => level::PREFIX,
        _ => level::POSTFIX,
    }
}

fn symbol(operator: BinaryOp) -> &'static str {
    match operator {
        BinaryOp::Add => "+",
        BinaryOp::Subtract => "-",
        BinaryOp::Multiply => "*",
        BinaryOp::Divide => "/",
        BinaryOp::Remainder => "%",
        BinaryOp::Power => "**",
        BinaryOp::ShiftLeft => "<<",
        BinaryOp::ShiftRight => ">>",
        BinaryOp::Minimum => "<?",
        BinaryOp::Maximum => ">?",
        BinaryOp::Less => "<",
        BinaryOp::LessEqual => "<=",
        BinaryOp::Greater => ">",
        BinaryOp::GreaterEqual => ">=",
        BinaryOp::Equal => "==",
        BinaryOp::NotEqual => "!=",
        BinaryOp::BitAnd => "&",
        BinaryOp::BitXor => "^",
        BinaryOp::BitOr => "|",
        BinaryOp::And => "&&",
        BinaryOp::Or => "||",
        BinaryOp::Xor => "xor",
        BinaryOp::Imply => "imply",
    }
}
