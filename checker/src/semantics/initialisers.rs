//! What variables and constants start with.

use super::checker::Checker;
use super::clock_expressions::integral_double;
use super::codes;
use super::typed::Expr;
use super::types::{Size, StructType, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::syntax::ast::{self, ExprKind, Initialiser, Name, UnaryOp};
use crate::syntax::codes::{MOST_MISTAKES, TOO_MANY_MISTAKES};
use crate::syntax::{Piece, TableReader};

/// What one part of a variable starts with.
pub(super) struct InitialPart {
    /// Where the part lies in the variable.
    pub(super) offset: Size,
    /// The type of the part.
    pub(super) ty: Type,
    /// Its value.
    pub(super) value: InitialValue,
}

/// The value that a part of a variable starts with.
pub(super) enum InitialValue {
    /// One that was written as an expression.
    Expr(Expr),
    /// All words of an array or struct, from a table. Parts of it that have no words, or whose
    /// values are not plain words of their type, follow as parts of their own.
    Words(Vec<i32>, Span),
}

impl InitialPart {
    /// The expression; nothing for words.
    pub(super) fn expr(&self) -> Option<&Expr> {
        match &self.value {
            InitialValue::Expr(expr) => Some(expr),
            InitialValue::Words(..) => None,
        }
    }
}

/// Numbers of a table that are no words of their type: starts of clocks, and mistakes. No model has
/// more clocks, and nobody reads more mistakes.
const MOST_NUMBERS_APART: usize = 5_000;

/// What a table gives: the words, and the parts that are no words.
struct Filled {
    words: Vec<i32>,
    apart: Vec<InitialPart>,
    /// How many mistakes were reported before.
    reported: usize,
}

impl Checker<'_> {
    /// The words of a variable with these initial parts, which are used up.
    pub(super) fn initial_words(
        &mut self,
        parts: &mut [InitialPart],
        ty: &Type,
    ) -> Option<Vec<i32>> {
        let size = ty.size().words as usize;
        let mut words = Vec::new();
        let mut is_complete = true;
        let reported = self.diagnostics.len();
        for part in parts.iter_mut().filter(|part| part.ty.size().words > 0) {
            if self.diagnostics.len() > reported + MOST_MISTAKES {
                self.too_many_mistakes();
                return None;
            }
            let known = match &mut part.value {
                InitialValue::Words(table, _) => Some(std::mem::take(table)),
                InitialValue::Expr(value) => self.known_words(value, &part.ty, "an initial value"),
            };
            match known {
                Some(whole) if whole.len() == size => words = whole,
                Some(known) => {
                    fill(&mut words, ty);
                    let start = part.offset.words as usize;
                    words[start..start + known.len()].copy_from_slice(&known);
                }
                None => is_complete = false,
            }
        }
        fill(&mut words, ty);
        is_complete.then_some(words)
    }

    /// Says that no more is reported about a list of values.
    fn too_many_mistakes(&mut self) {
        if let Some(span) = self.diagnostics.last().map(|last| last.span) {
            let message =
                format!("more than {MOST_MISTAKES} values are wrong; the others are not reported");
            self.report(Diagnostic::new(TOO_MANY_MISTAKES, span, message));
        }
    }

    /// The initial values of the parts of a variable; those of a local of a function may be drawn
    /// at random.
    pub(super) fn initialiser(
        &mut self,
        initialiser: &Initialiser,
        ty: &Type,
        is_local: bool,
    ) -> Vec<InitialPart> {
        let mut parts = Vec::new();
        self.initial_parts(initialiser, ty, Size::default(), &mut parts);
        for value in parts.iter().filter_map(InitialPart::expr) {
            if !is_local || value.changes() {
                self.expect_pure(value, "an initial value");
            }
        }
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
                let value = InitialValue::Expr(self.initial_value(expr, ty));
                parts.push(InitialPart {
                    offset,
                    ty: ty.clone(),
                    value,
                });
            }
            (Initialiser::Table(span), _) => self.table(*span, ty, offset, parts),
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
        let value = if ty.is_clock() {
            self.initial_clock(value, ty)
        } else if ty.size().channels > 0 || *ty == Type::Void {
            self.misplaced_initialiser(expr.span, ty);
            None
        } else if *ty == Type::String {
            self.text(value)
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
        self.converted(value, &Type::CLOCK_VALUE)
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
                self.misfitting_fields(record, span);
                continue;
            }
            let before = &record.fields[..field];
            let offset = before
                .iter()
                .fold(offset, |sum, (_, ty)| sum.plus(ty.size()));
            self.initial_parts(item, &record.fields[field].1, offset, parts);
        }
        if let Some(missing) = given.iter().position(|given| !given) {
            self.missing_field(&record.fields[missing].0, span);
        }
    }

    fn misfitting_fields(&mut self, record: &StructType, span: Span) {
        let message = format!(
            "the struct has {} fields, but other values are given",
            record.fields.len()
        );
        let help = "give one value for each field";
        self.error(codes::INITIALISER_COUNT, span, message, help);
    }

    fn missing_field(&mut self, field: &str, span: Span) {
        let message = format!("the field '{field}' has no value");
        let help = "give one value for each field";
        self.error(codes::INITIALISER_COUNT, span, message, help);
    }

    /// The parts that a table gives: words as far as it can be, the same as the expressions would.
    fn table(&mut self, span: Span, ty: &Type, offset: Size, parts: &mut Vec<InitialPart>) {
        if ty.is_error() {
            return;
        }
        let mut filled = Filled {
            words: Vec::new(),
            apart: Vec::new(),
            reported: self.diagnostics.len(),
        };
        fill(&mut filled.words, ty);
        let mut reader = TableReader::new(span, self.sources);
        let first = reader.read();
        self.table_piece(first, &mut reader, ty, Size::default(), &mut filled);
        if self.diagnostics.len() > filled.reported + MOST_MISTAKES {
            self.too_many_mistakes();
        }
        if !filled.words.is_empty() {
            parts.push(InitialPart {
                offset,
                ty: ty.clone(),
                value: InitialValue::Words(filled.words, span),
            });
        }
        parts.extend(filled.apart.into_iter().map(|mut part| {
            part.offset = offset.plus(part.offset);
            part
        }));
    }

    /// Takes one piece of a table, with what belongs to it, as the value of this type.
    fn table_piece(
        &mut self,
        piece: Piece,
        reader: &mut TableReader,
        ty: &Type,
        offset: Size,
        filled: &mut Filled,
    ) {
        let at = offset.words as usize;
        match (piece, ty) {
            (Piece::Number(value), Type::Int { low, high }) if (*low..=*high).contains(&value) => {
                filled.words[at] = value;
            }
            (Piece::Number(value), Type::Bool) => filled.words[at] = i32::from(value != 0),
            (Piece::Number(value), Type::Double) => {
                let words = arithmetic::double_words(f64::from(value));
                filled.words[at..at + words.len()].copy_from_slice(&words);
            }
            (Piece::Number(value), _) => {
                if self.takes_apart(filled) {
                    let number = Initialiser::Expr(number(value, reader.place()));
                    self.initial_parts(&number, ty, offset, &mut filled.apart);
                }
            }
            (Piece::List(length), Type::Array(array)) => {
                let (given, wanted) = (length as usize, array.index.length as usize);
                if given != wanted {
                    let span = reader.whole_list(reader.place());
                    if !self.has_fitting_length(given, wanted, span) {
                        filled.apart.push(broken_part(offset, ty, span));
                        return reader.skip_list();
                    }
                }
                let stride = array.part.size();
                for i in 0..length {
                    let piece = reader.read();
                    let offset = offset.plus(stride.times(i));
                    self.table_piece(piece, reader, &array.part, offset, filled);
                }
                reader.read();
            }
            (Piece::List(length), Type::Struct(record)) => {
                self.table_fields(length as usize, reader, record, offset, filled);
            }
            (Piece::List(_), Type::Error) => reader.skip_list(),
            (Piece::List(_), _) => {
                let span = reader.whole_list(reader.place());
                self.misplaced_initialiser(span, ty);
                if self.takes_apart(filled) {
                    filled.apart.push(broken_part(offset, ty, span));
                }
                reader.skip_list();
            }
            (Piece::End, _) => {}
        }
    }

    /// Whether one more part is looked at that is no words.
    fn takes_apart(&self, filled: &Filled) -> bool {
        filled.apart.len() < MOST_NUMBERS_APART
            && self.diagnostics.len() <= filled.reported + MOST_MISTAKES
    }

    fn table_fields(
        &mut self,
        given: usize,
        reader: &mut TableReader,
        record: &StructType,
        mut offset: Size,
        filled: &mut Filled,
    ) {
        let wanted = record.fields.len();
        if given > wanted {
            let span = reader.whole_list(reader.place());
            self.misfitting_fields(record, span);
        }
        if given < wanted {
            let span = reader.whole_list(reader.place());
            self.missing_field(&record.fields[given].0, span);
        }
        for (_, ty) in record.fields.iter().take(given) {
            let piece = reader.read();
            self.table_piece(piece, reader, ty, offset, filled);
            offset = offset.plus(ty.size());
        }
        reader.skip_list();
    }
}

/// A number as the grammar reads it.
fn number(value: i32, span: Span) -> ast::Expr {
    let whole = |value: i64, span| ast::Expr {
        kind: ExprKind::Int(value),
        span,
    };
    if value >= 0 {
        return whole(value.into(), span);
    }
    let digits = Span {
        start: span.start + 1,
        ..span
    };
    let inner = Box::new(whole(-i64::from(value), digits));
    ast::Expr {
        kind: ExprKind::Unary(UnaryOp::Minus, inner),
        span,
    }
}

/// Makes words those of a value without an initialiser, unless there are words.
fn fill(words: &mut Vec<i32>, ty: &Type) {
    if words.is_empty() {
        words.reserve_exact(ty.size().words as usize);
        ty.default_words(words);
    }
}

fn broken_part(offset: Size, ty: &Type, span: Span) -> InitialPart {
    InitialPart {
        offset,
        ty: ty.clone(),
        value: InitialValue::Expr(Expr::error(span)),
    }
}
