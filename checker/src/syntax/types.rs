//! Types, declared names with dimensions, parameters.

use super::ast::{Dimension, Name, Parameter, Prefixes, StructField, TypeExpr, TypeKind};
use super::keywords::{self, Dialect};
use super::lexer::TokenKind;
use super::parser::Parser;
use crate::diagnostics::Span;

impl Parser<'_> {
    /// Whether the current word begins a type that is more than a name.
    pub(super) fn at_type_word(&self) -> bool {
        let word = self.word();
        matches!(
            word,
            "const"
                | "meta"
                | "urgent"
                | "broadcast"
                | "hybrid"
                | "void"
                | "int"
                | "bool"
                | "double"
                | "string"
                | "clock"
                | "chan"
                | "scalar"
                | "struct"
        ) && (keywords::is_reserved(word, self.dialect) || self.dialect == Dialect::Query)
    }

    /// A type with its prefixes; its height is that of its highest expression.
    pub(super) fn type_expr(&mut self) -> TypeExpr {
        let start = self.here();
        let prefixes = self.prefixes();
        self.height = 0;
        let kind = match self.nested(Parser::type_kind) {
            Some(kind) => kind,
            None => TypeKind::Void,
        };
        TypeExpr {
            prefixes,
            kind,
            span: self.since(start),
        }
    }

    fn prefixes(&mut self) -> Prefixes {
        let mut prefixes = Prefixes::default();
        while self.at_type_word() {
            let flag = match self.word() {
                "const" => &mut prefixes.constant,
                "meta" => &mut prefixes.meta,
                "urgent" => &mut prefixes.urgent,
                "broadcast" => &mut prefixes.broadcast,
                "hybrid" => &mut prefixes.hybrid,
                _ => break,
            };
            if *flag {
                self.expected("a type");
            }
            *flag = true;
            self.bump();
        }
        prefixes
    }

    fn type_kind(&mut self) -> TypeKind {
        if !self.at_type_word() {
            return TypeKind::Named(self.name("a type"));
        }
        let word = self.word();
        self.bump();
        match word {
            "int" => self.int_range(),
            "bool" => TypeKind::Bool,
            "double" => TypeKind::Double,
            "string" => TypeKind::String,
            "clock" => TypeKind::Clock,
            "chan" => TypeKind::Channel,
            "scalar" => {
                if !self.expect(TokenKind::LeftBracket, "after `scalar`") {
                    return TypeKind::Scalar(Box::new(self.error_expr()));
                }
                let size = self.expression();
                self.closing(TokenKind::RightBracket, "after the size");
                TypeKind::Scalar(Box::new(size))
            }
            "struct" => self.struct_fields(),
            _ => TypeKind::Void,
        }
    }

    fn int_range(&mut self) -> TypeKind {
        if !self.eat(TokenKind::LeftBracket) {
            return TypeKind::Int;
        }
        let low = self.expression();
        let height = self.height;
        let both = self.expect(TokenKind::Comma, "between the bounds of the range");
        let high = if both {
            self.expression()
        } else {
            self.error_expr()
        };
        self.height = self.height.max(height);
        self.closing(TokenKind::RightBracket, "after the range");
        TypeKind::Range(Box::new(low), Box::new(high))
    }

    fn struct_fields(&mut self) -> TypeKind {
        let mut fields = Vec::new();
        let mut highest = 0;
        if !self.expect(TokenKind::LeftBrace, "after `struct`") {
            return TypeKind::Struct(fields);
        }
        while !self.at_end() && !self.at(TokenKind::RightBrace) {
            let before = self.progress();
            let ty = self.type_expr();
            highest = highest.max(self.height);
            self.declarators("the name of a field", |parser, name, dimensions| {
                highest = highest.max(parser.height);
                fields.push(StructField {
                    ty: ty.clone(),
                    name,
                    dimensions,
                });
            });
            self.end_of_declaration("after the field", before);
        }
        self.expect(TokenKind::RightBrace, "after the fields");
        self.height = highest + 1;
        TypeKind::Struct(fields)
    }

    /// `name[…], name[…], …`
    pub(super) fn declarators(
        &mut self,
        what: &str,
        mut each: impl FnMut(&mut Self, Name, Vec<Dimension>),
    ) {
        loop {
            let name = self.declared_name(what);
            if name.text.is_empty() {
                return;
            }
            let dimensions = self.dimensions();
            each(self, name, dimensions);
            if !self.eat(TokenKind::Comma) {
                return;
            }
        }
    }

    /// The `;` behind a declaration that began at token `before`; recovers when it is missing.
    pub(super) fn end_of_declaration(&mut self, context: &str, before: usize) {
        if self.eat(TokenKind::Semicolon) {
            return;
        }
        self.missing(&format!("`;` {context}"));
        self.recover();
        if self.progress() == before {
            self.bump();
        }
    }

    /// `[…][…]…`; the height is that of the highest expression.
    pub(super) fn dimensions(&mut self) -> Vec<Dimension> {
        let mut dimensions = Vec::new();
        let mut highest = 0;
        while self.eat(TokenKind::LeftBracket) {
            dimensions.push(if self.at_type_word() {
                Dimension::Type(self.type_expr())
            } else {
                Dimension::Size(self.expression())
            });
            highest = highest.max(self.height);
            self.closing(TokenKind::RightBracket, "after the size of the array");
        }
        self.height = highest;
        dimensions
    }

    /// The parameters up to the end of the text or a `)`, which is not consumed.
    pub(super) fn parameters(&mut self) -> Vec<Parameter> {
        let mut parameters = Vec::new();
        if self.at_end() || self.at(TokenKind::RightParenthesis) {
            return parameters;
        }
        if self.dialect == Dialect::Old {
            self.old_parameters(&mut parameters);
            return parameters;
        }
        self.comma_separated(|parser| {
            parameters.push(Parameter {
                ty: parser.type_expr(),
                reference: parser.eat(TokenKind::And),
                name: parser.declared_name("the name of a parameter"),
                dimensions: parser.dimensions(),
            });
        });
        parameters
    }

    /// `clock x, y; const n`: groups of one type; all but constants are passed by reference.
    fn old_parameters(&mut self, parameters: &mut Vec<Parameter>) {
        loop {
            let constant = self.at_word("const") && !self.is_type_at(1);
            let ty = if constant {
                self.old_constant_type()
            } else {
                self.type_expr()
            };
            self.declarators("the name of a parameter", |_, name, dimensions| {
                parameters.push(Parameter {
                    ty: ty.clone(),
                    reference: !ty.prefixes.constant,
                    name,
                    dimensions,
                });
            });
            if !self.eat(TokenKind::Semicolon) || self.at_end() {
                return;
            }
        }
    }

    fn is_type_at(&self, distance: usize) -> bool {
        matches!(self.word_at(distance), "int" | "bool" | "clock" | "chan")
    }

    /// The type that the old syntax means by `const` alone.
    pub(super) fn old_constant_type(&mut self) -> TypeExpr {
        let token = self.bump();
        let span: Span = self.span_of(token);
        TypeExpr {
            prefixes: Prefixes {
                constant: true,
                ..Prefixes::default()
            },
            kind: TypeKind::Int,
            span,
        }
    }

    /// `( parameters )`; reports when the parenthesis is missing.
    pub(super) fn parameter_list(&mut self) -> Vec<Parameter> {
        if !self.expect(TokenKind::LeftParenthesis, "before the parameters") {
            return Vec::new();
        }
        let parameters = self.parameters();
        self.closing(TokenKind::RightParenthesis, "after the parameters");
        parameters
    }
}
