//! What variables and constants start with.

use super::checker::Checker;
use super::clock_expressions::integral_double;
use super::codes;
use super::typed::Expr;
use super::types::{Size, StructType, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::CLOCK_LIMIT;
use crate::syntax::ast::{self, Initialiser, Name};

/// The value that one part of a variable starts with.
pub(super) struct InitialPart {
    /// Where the part lies in the variable.
    pub(super) offset: Size,
    /// The type of the part.
    pub(super) ty: Type,
    /// Its value.
    pub(super) value: Expr,
}

impl Checker<'_> {
    /// The words of a variable with these initial parts.
    pub(super) fn initial_words(&mut self, parts: &[InitialPart], ty: &Type) -> Option<Vec<i32>> {
        let mut words = Vec::with_capacity(ty.size().words as usize);
        ty.default_words(&mut words);
        let mut is_complete = true;
        for part in parts.iter().filter(|part| part.ty.size().words > 0) {
            match self.known_words(&part.value, &part.ty, "an initial value") {
                Some(known) => {
                    let start = part.offset.words as usize;
                    words[start..start + known.len()].copy_from_slice(&known);
                }
                None => is_complete = false,
            }
        }
        is_complete.then_some(words)
    }

    /// The initial values of the parts of a variable.
    pub(super) fn initialiser(&mut self, initialiser: &Initialiser, ty: &Type) -> Vec<InitialPart> {
        let mut parts = Vec::new();
        self.initial_parts(initialiser, ty, Size::default(), &mut parts);
        parts
    }

    fn initial_parts(
        &mut self,
        initialiser: &Initialiser,
        ty: &Type,
        offset: Size,
        parts: &mut Vec<InitialPart>,
    ) {
        match (initialiser, ty) {
            (Initialiser::Expr(expr), _) => {
                let value = self.initial_value(expr, ty);
                parts.push(InitialPart {
                    offset,
                    ty: ty.clone(),
                    value,
                });
            }
            (Initialiser::List(items, span), Type::Array(array)) => {
                if !self.has_fitting_length(items.len(), array.index.length as usize, *span) {
                    parts.push(broken_part(offset, ty, *span));
                    return;
                }
                let stride = array.part.size();
                for (i, (label, item)) in items.iter().enumerate() {
                    if let Some(label) = label {
                        self.unknown_label(label);
                    }
                    let offset = offset.plus(stride.times(i as u32));
                    self.initial_parts(item, &array.part, offset, parts);
                }
            }
            (Initialiser::List(items, span), Type::Struct(record)) => {
                self.initial_fields(items, record, offset, parts, *span);
            }
            (Initialiser::List(_, _), Type::Error) => {}
            (Initialiser::List(_, span), _) => {
                self.misplaced_initialiser(*span, ty);
                parts.push(broken_part(offset, ty, *span));
            }
        }
    }

    /// The value of one part. A mistake leaves an error, so that the variable is known to have no
    /// value.
    fn initial_value(&mut self, expr: &ast::Expr, ty: &Type) -> Expr {
        let value = self.expression(expr);
        self.expect_pure(&value, "an initial value");
        let value = if ty.is_clock() {
            self.initial_clock(value, ty)
        } else if ty.size().channels > 0 || *ty == Type::Void {
            self.misplaced_initialiser(expr.span, ty);
            None
        } else if *ty == Type::String {
            None
        } else {
            self.converted(value, ty)
        };
        value.unwrap_or_else(|| Expr::error(expr.span))
    }

    /// Whether an array of this length can take this number of values; too few are a warning.
    fn has_fitting_length(&mut self, given: usize, length: usize, span: Span) -> bool {
        if given < length {
            let message =
                format!("the array has {length} parts, but only {given} values are given");
            self.report(
                Diagnostic::new(codes::INITIALISER_INCOMPLETE, span, message)
                    .note("the other parts start with the value of an array without initialiser")
                    .help("give one value for each part"),
            );
        }
        if given > length {
            let message = format!("the array has {length} parts, but {given} values are given");
            self.error(
                codes::INITIALISER_COUNT,
                span,
                message,
                "give one value for each part",
            );
        }
        given <= length
    }

    /// The value that a clock starts with; that of a hybrid clock does not matter.
    fn initial_clock(&mut self, value: Expr, ty: &Type) -> Option<Expr> {
        let value = integral_double(value);
        if *ty == (Type::Clock { hybrid: true }) && value.ty == Type::Double {
            return Some(Expr::int(0, Type::ANY_INT, value.span));
        }
        if value.ty == Type::Double {
            self.clock_with_double(value.span);
            return None;
        }
        self.converted(
            value,
            &Type::Int {
                low: 0,
                high: CLOCK_LIMIT,
            },
        )
    }

    fn misplaced_initialiser(&mut self, span: Span, ty: &Type) {
        self.error(
            codes::INITIALISER_MISMATCHED,
            span,
            format!("this cannot be the initial value of {}", ty.described()),
            "lists initialise arrays and structs, expressions everything else; channels have no value",
        );
    }

    fn unknown_label(&mut self, label: &Name) {
        self.error(
            codes::FIELD_UNKNOWN,
            label.span,
            format!("there is no field '{}' here", label.text),
            "only the values of structs have labels",
        );
    }

    fn initial_fields(
        &mut self,
        items: &[(Option<Name>, Initialiser)],
        record: &StructType,
        offset: Size,
        parts: &mut Vec<InitialPart>,
        span: Span,
    ) {
        let mut given = vec![false; record.fields.len()];
        for (i, (label, item)) in items.iter().enumerate() {
            let field = match label {
                None => i,
                Some(label) => {
                    let known = record
                        .fields
                        .iter()
                        .position(|(name, _)| *name == label.text);
                    let Some(known) = known else {
                        self.unknown_label(label);
                        continue;
                    };
                    known
                }
            };
            if field >= given.len() || std::mem::replace(&mut given[field], true) {
                let message = format!(
                    "the struct has {} fields, but other values are given",
                    given.len()
                );
                self.error(
                    codes::INITIALISER_COUNT,
                    span,
                    message,
                    "give one value for each field",
                );
                continue;
            }
            let before = &record.fields[..field];
            let offset = before
                .iter()
                .fold(offset, |sum, (_, ty)| sum.plus(ty.size()));
            self.initial_parts(item, &record.fields[field].1, offset, parts);
        }
        if let Some(missing) = given.iter().position(|given| !given) {
            let message = format!("the field '{}' has no value", record.fields[missing].0);
            self.error(
                codes::INITIALISER_COUNT,
                span,
                message,
                "give one value for each field",
            );
        }
    }
}

fn broken_part(offset: Size, ty: &Type, span: Span) -> InitialPart {
    InitialPart {
        offset,
        ty: ty.clone(),
        value: Expr::error(span),
    }
}
