//! Types as they are written: names, ranges, prefixes, dimensions.

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::scope::{Carried, Entity};
use super::types::{DEFAULT_INT, Index, StructType, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::ScalarSet;
use crate::syntax::ast::{self, Dimension, Name, TypeExpr, TypeKind};
use std::sync::Arc;

impl Checker<'_> {
    /// The prefixes of a type, those that come with its name included.
    pub(super) fn carried(&mut self, ty: &TypeExpr) -> Carried {
        let named = match &ty.kind {
            TypeKind::Named(name) => self.lookup(&name.text),
            _ => None,
        };
        let Some(Entity::Type(_, carried)) = named else {
            return Carried {
                constant: ty.prefixes.constant,
                meta: ty.prefixes.meta,
            };
        };
        Carried {
            constant: ty.prefixes.constant || carried.constant,
            meta: ty.prefixes.meta || carried.meta,
        }
    }

    fn misplaced_prefix(&mut self, span: Span, message: &str) {
        self.error(
            codes::PREFIX_MISPLACED,
            span,
            message,
            "leave the prefix out, or change the type",
        );
    }

    /// A type with the dimensions that stand after the name.
    pub(super) fn dimensioned(&mut self, ty: &TypeExpr, dimensions: &[Dimension]) -> Type {
        let mut result = self.type_of(ty);
        let mut indices = Vec::new();
        for dimension in dimensions {
            indices.push(self.dimension(dimension));
        }
        for (index, dimension) in indices.into_iter().zip(dimensions).rev() {
            let Some(index) = index else {
                return Type::Error;
            };
            if result.is_error() {
                return Type::Error;
            }
            if matches!(result, Type::Void | Type::String) {
                self.misplaced_type(ty.span, &result);
                return Type::Error;
            }
            if index.length == 0 {
                self.note_emptiness(&result, dimension_span(dimension));
            }
            result = Type::array(result, index);
            if result.checked_size().is_none() {
                self.error(
                    codes::ARRAY_TOO_LARGE,
                    dimension_span(dimension),
                    "this array has too many parts",
                    "the limit is 16777216 words",
                );
                return Type::Error;
            }
        }
        result
    }

    /// Warns of an array without parts, which generated models have for things that do not occur.
    fn note_emptiness(&mut self, part: &Type, span: Span) {
        if part.size().clocks + part.size().channels > 0 {
            self.error(
                codes::SIZE_NOT_POSITIVE,
                span,
                "an array of clocks or channels cannot be empty",
                "give it at least one part",
            );
            return;
        }
        self.report(
            Diagnostic::new(codes::ARRAY_EMPTY, span, "this array has no parts")
                .note("whatever index is used on it is a run-time error"),
        );
    }

    /// Refuses a variable for which there is no value.
    pub(super) fn expect_values(&mut self, ty: &Type, span: Span) {
        let is_empty = |part: &Type| part.bounds().0 > part.bounds().1;
        if ty.any_stored(&is_empty) {
            self.error(
                codes::RANGE_EMPTY,
                span,
                format!("there is no value of the type {ty}"),
                "give the range at least one value",
            );
        }
    }

    pub(super) fn misplaced_type(&mut self, span: Span, ty: &Type) {
        self.error(
            codes::TYPE_MISPLACED,
            span,
            format!("{ty} cannot be the type here"),
            "use another type",
        );
    }

    fn dimension(&mut self, dimension: &Dimension) -> Option<Index> {
        let outer = std::mem::take(&mut self.free_parameter_seen);
        let index = match dimension {
            Dimension::Type(ty) => self.index_type(ty),
            Dimension::Size(expr) => self.size(expr),
        };
        if self.free_parameter_seen {
            self.error(
                codes::SIZE_HANGS_ON_FREE_PARAMETER,
                dimension_span(dimension),
                "the size of an array must not depend on a free parameter of a process set",
                "give the template an argument for this parameter",
            );
        }
        self.free_parameter_seen = outer;
        index
    }

    fn index_type(&mut self, ty: &TypeExpr) -> Option<Index> {
        let resolved = self.type_of(ty);
        self.index_of(&resolved, ty.span)
    }

    fn index_of(&mut self, ty: &Type, span: Span) -> Option<Index> {
        match ty {
            Type::Error => None,
            Type::Int { low, high } => {
                let length = i64::from(*high) - i64::from(*low) + 1;
                let Ok(length) = u32::try_from(length) else {
                    return self.refused(
                        codes::ARRAY_TOO_LARGE,
                        span,
                        "this array has too many parts",
                        "use a smaller range",
                    );
                };
                Some(Index {
                    first: *low,
                    length,
                    set: None,
                })
            }
            Type::Scalar { set, size } => Some(Index {
                first: 0,
                length: *size,
                set: Some(*set),
            }),
            other => {
                let message = format!(
                    "arrays are indexed by ranges and scalars, not by {}",
                    other.described()
                );
                self.refused(
                    codes::TYPE_MISPLACED,
                    span,
                    message,
                    "write [size] or [int[a,b]]",
                )
            }
        }
    }

    fn size(&mut self, expr: &ast::Expr) -> Option<Index> {
        if let ast::ExprKind::Name(name) = &expr.kind
            && let Some(Entity::Type(ty, _)) = self.lookup(name)
        {
            return self.index_of(&ty, expr.span);
        }
        let size = self.expression(expr);
        self.expect_pure(&size, "the size of an array");
        let value = self.known_int(&size, "the size of an array")?;
        let Ok(length) = u32::try_from(value) else {
            return self.refused(
                codes::SIZE_NOT_POSITIVE,
                expr.span,
                format!("the size of an array cannot be negative, but this is {value}"),
                "write the number of its parts",
            );
        };
        Some(Index {
            first: 0,
            length,
            set: None,
        })
    }

    /// The type that a type expression means.
    pub(super) fn type_of(&mut self, ty: &TypeExpr) -> Type {
        let prefixes = ty.prefixes;
        let resolved = match &ty.kind {
            TypeKind::Void => Type::Void,
            TypeKind::Int if prefixes.constant => Type::ANY_INT,
            TypeKind::Int => Type::Int {
                low: DEFAULT_INT.0,
                high: DEFAULT_INT.1,
            },
            TypeKind::Range(low, high) => self.range(low, high, ty.span),
            TypeKind::Bool => Type::Bool,
            TypeKind::Double => Type::Double,
            TypeKind::String => Type::String,
            TypeKind::Clock if self.reading == Reading::Stochastic => Type::RealClock,
            TypeKind::Clock => Type::Clock {
                hybrid: prefixes.hybrid,
            },
            TypeKind::Channel => Type::Channel {
                urgent: prefixes.urgent,
                broadcast: prefixes.broadcast,
            },
            TypeKind::Scalar(size) => self.scalar(size),
            TypeKind::Struct(fields) => self.structure(fields),
            TypeKind::Named(name) => self.named_type(name),
        };
        self.prefixed(resolved, ty)
    }

    fn prefixed(&mut self, mut resolved: Type, ty: &TypeExpr) -> Type {
        let prefixes = ty.prefixes;
        let is_channel = matches!(resolved, Type::Channel { .. } | Type::Error);
        if (prefixes.urgent || prefixes.broadcast) && !is_channel {
            self.misplaced_prefix(ty.span, "urgent and broadcast belong to channels");
        }
        let is_clock = resolved.is_clock() || resolved == Type::RealClock;
        if prefixes.hybrid && !(is_clock || resolved.is_error()) {
            self.misplaced_prefix(ty.span, "hybrid belongs to clocks");
        }
        if (prefixes.constant || prefixes.meta)
            && matches!(
                resolved,
                Type::Clock { .. } | Type::RealClock | Type::Channel { .. } | Type::Void
            )
        {
            self.misplaced_prefix(
                ty.span,
                "const and meta do not belong to clocks and channels",
            );
        }
        match &mut resolved {
            Type::Channel { urgent, broadcast } => {
                *urgent |= prefixes.urgent;
                *broadcast |= prefixes.broadcast;
            }
            Type::Clock { hybrid } => *hybrid |= prefixes.hybrid,
            _ => {}
        }
        resolved
    }

    fn range(&mut self, low: &ast::Expr, high: &ast::Expr, span: Span) -> Type {
        let (low, high) = (self.expression(low), self.expression(high));
        self.expect_pure(&low, "the bound of a range");
        self.expect_pure(&high, "the bound of a range");
        let (Some(low), Some(high)) = (self.known_bound(&low), self.known_bound(&high)) else {
            return Type::Error;
        };
        // As long as there is exactly nothing in between, it is the range of a number that happens
        // to be zero.
        if low > high && i64::from(low) != i64::from(high) + 1 {
            self.error(
                codes::RANGE_EMPTY,
                span,
                format!("the range from {low} to {high} is empty"),
                "the lower bound comes first",
            );
            return Type::Error;
        }
        Type::Int { low, high }
    }

    fn scalar(&mut self, size: &ast::Expr) -> Type {
        let Some(index) = self.size(size) else {
            return Type::Error;
        };
        if index.length == 0 {
            self.error(
                codes::SIZE_NOT_POSITIVE,
                size.span,
                "a scalar set cannot be empty",
                "give it at least one member",
            );
            return Type::Error;
        }
        let sets = &mut self.world.network.scalar_sets;
        sets.push(ScalarSet {
            size: index.length,
            // The sets of a template are others in each process.
            told_apart_by: self.process.is_some().then_some(size.span),
        });
        Type::Scalar {
            set: sets.len() as u32 - 1,
            size: index.length,
        }
    }

    fn structure(&mut self, fields: &[ast::StructField]) -> Type {
        let mut known: Vec<(String, Type)> = Vec::new();
        let mut is_broken = false;
        for field in fields {
            if field.ty.prefixes.constant {
                self.misplaced_prefix(field.ty.span, "fields of a struct cannot be const");
            }
            let ty = self.dimensioned(&field.ty, &field.dimensions);
            if matches!(ty, Type::String | Type::Void) {
                self.misplaced_type(field.ty.span, &ty);
            }
            is_broken |= ty.is_error();
            if known.iter().any(|(name, _)| *name == field.name.text) {
                self.error(
                    codes::NAME_DECLARED_TWICE,
                    field.name.span,
                    format!("the struct has two fields '{}'", field.name.text),
                    "give one of the two another name",
                );
            }
            known.push((field.name.text.clone(), ty));
        }
        let record = Type::Struct(Arc::new(StructType { fields: known }));
        if is_broken || record.checked_size().is_none() {
            return Type::Error;
        }
        record
    }

    fn named_type(&mut self, name: &Name) -> Type {
        match self.lookup(&name.text) {
            Some(Entity::Type(ty, _)) => ty,
            Some(Entity::Broken) => Type::Error,
            Some(entity) => {
                self.error(
                    codes::TYPE_EXPECTED,
                    name.span,
                    format!("'{}' is {}, not a type", name.text, entity.kind()),
                    "name types with typedef",
                );
                Type::Error
            }
            None => {
                self.unknown_name(&name.text, name.span);
                Type::Error
            }
        }
    }

    /// The type and the least and greatest value that a `select`, a quantifier or a range-for runs
    /// over.
    pub(super) fn iterated(&mut self, ty: &TypeExpr) -> Option<(Type, (i32, i32))> {
        let resolved = self.type_of(ty);
        // `const int` is the type of every integer, which has no bounds.
        let is_unbounded = resolved == Type::ANY_INT && self.carried(ty).constant;
        match resolved {
            Type::Error => None,
            Type::Int { .. } | Type::Scalar { .. } if !is_unbounded => {
                let bounds = resolved.bounds();
                Some((resolved, bounds))
            }
            other => self.refused(
                codes::RANGE_EXPECTED,
                ty.span,
                format!(
                    "loops and quantifiers run over bounded integers and scalars only, not over {}",
                    other.described()
                ),
                "write int[a,b]",
            ),
        }
    }
}

fn dimension_span(dimension: &Dimension) -> Span {
    match dimension {
        Dimension::Size(expr) => expr.span,
        Dimension::Type(ty) => ty.span,
    }
}
