//! Declarations: types, variables, constants and their initialisers.

use std::sync::Arc;

use super::checker::Checker;
use super::clock_expressions::integral_double;
use super::codes;
use super::left_out::declared_at;
use super::scope::{Carried, Entity};
use super::typed::{Expr, Kind, Place, Root};
use super::types::{self, DEFAULT_INT, Index, SIZE_LIMIT, Size, StructType, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::ir::{CLOCK_LIMIT, ScalarSet};
use crate::syntax::ast::{self, Declaration, Dimension, Initialiser, Name, TypeExpr, TypeKind};

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
    /// Checks declarations outside functions. `before_update`, `after_update` and `chan priority`
    /// are left to the caller.
    pub(super) fn declarations(&mut self, declarations: &[Declaration]) {
        for declaration in declarations {
            match declaration {
                Declaration::Typedef {
                    ty,
                    name,
                    dimensions,
                } => self.typedef(ty, name, dimensions),
                Declaration::Variable(variable) => self.variable_declaration(variable),
                Declaration::Function(function) => self.function(function),
                Declaration::ChannelPriority { .. }
                | Declaration::BeforeUpdate(..)
                | Declaration::AfterUpdate(..) => {}
            }
        }
    }

    /// A `typedef`. `const` and `meta` in it say nothing: they belong to variables.
    pub(super) fn typedef(&mut self, ty: &TypeExpr, name: &Name, dimensions: &[Dimension]) {
        let carried = self.carried(ty);
        let ty = self.dimensioned(ty, dimensions);
        self.declare(name, Entity::Type(ty, carried));
    }

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

    /// Says that an array has no parts, which generated models have for what there is none of.
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

    fn misplaced_type(&mut self, span: Span, ty: &Type) {
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
                    self.error(
                        codes::ARRAY_TOO_LARGE,
                        span,
                        "this array has too many parts",
                        "use a smaller range",
                    );
                    return None;
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
                self.error(
                    codes::TYPE_MISPLACED,
                    span,
                    message,
                    "write [size] or [int[a,b]]",
                );
                None
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
            self.error(
                codes::SIZE_NOT_POSITIVE,
                expr.span,
                format!("the size of an array cannot be negative, but this is {value}"),
                "write the number of its parts",
            );
            return None;
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
        if prefixes.hybrid && !(resolved.is_clock() || resolved.is_error()) {
            self.misplaced_prefix(ty.span, "hybrid belongs to clocks");
        }
        if (prefixes.constant || prefixes.meta)
            && matches!(
                resolved,
                Type::Clock { .. } | Type::Channel { .. } | Type::Void
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
            other => {
                self.error(
                    codes::RANGE_EXPECTED,
                    ty.span,
                    format!(
                        "only bounded integers and scalars can be run through, not {}",
                        other.described()
                    ),
                    "write int[a,b]",
                );
                None
            }
        }
    }

    /// A variable, constant, clock or channel outside functions.
    fn variable_declaration(&mut self, variable: &ast::Variable) {
        let outer = std::mem::take(&mut self.free_parameter_seen);
        let carried = self.carried(&variable.ty);
        let ty = self.dimensioned(&variable.ty, &variable.dimensions);
        let parts = variable
            .initialiser
            .as_ref()
            .map(|initialiser| self.initialiser(initialiser, &ty));
        if matches!(ty, Type::Void) || (ty == Type::String && !carried.constant) {
            self.misplaced_type(variable.ty.span, &ty);
        }
        self.expect_values(&ty, variable.ty.span);
        let entity = if ty.is_error() || ty == Type::Void || ty == Type::String {
            Entity::Broken
        } else if carried.constant {
            self.constant(variable, &ty, parts)
        } else {
            self.state_variable(variable, &ty, carried.meta, parts)
        };
        self.free_parameter_seen = outer;
        self.declare(&variable.name, entity);
    }

    fn constant(
        &mut self,
        variable: &ast::Variable,
        ty: &Type,
        parts: Option<Vec<InitialPart>>,
    ) -> Entity {
        if ty.size().clocks + ty.size().channels > 0 {
            return Entity::Broken;
        }
        let Some(parts) = parts else {
            self.error(
                codes::CONSTANT_NOT_INITIALISED,
                variable.name.span,
                format!("the constant '{}' has no value", variable.name.text),
                "write = and a value",
            );
            return Entity::Broken;
        };
        let free = self.free_parameter_seen;
        match self.initial_words(&parts, ty) {
            Some(words) => self.constant_entity(&words, ty, free, variable.name.span),
            None => Entity::Broken,
        }
    }

    /// A constant with these words.
    pub(super) fn constant_entity(
        &mut self,
        words: &[i32],
        ty: &Type,
        free: bool,
        span: Span,
    ) -> Entity {
        if !ty.is_register()
            && !self.has_room(
                self.world.network.constants.len() + words.len(),
                "constants",
                SIZE_LIMIT,
                span,
            )
        {
            return Entity::Broken;
        }
        self.tell_parts_apart(ty, words, span);
        if ty.is_register() {
            let value = match ty {
                Type::Double => {
                    let value = arithmetic::double_of_words(words[0], words[1]);
                    Expr::new(Kind::Double(value), Type::Double, span)
                }
                _ => Expr::int(words[0], ty.clone(), span),
            };
            return Entity::Constant { value, free };
        }
        let world = &mut self.world;
        let offset = super::lower::store_constant(&mut world.network, &mut world.images, words);
        let place = Place {
            root: Root::Constants,
            base: Size {
                words: offset,
                ..Size::default()
            },
            mutable: false,
            declared: Span::default(),
        };
        Entity::Variable {
            place,
            ty: ty.clone(),
        }
    }

    fn state_variable(
        &mut self,
        variable: &ast::Variable,
        ty: &Type,
        meta: bool,
        parts: Option<Vec<InitialPart>>,
    ) -> Entity {
        if !self.has_room_for(ty, variable.name.span) {
            return Entity::Broken;
        }
        let parts = parts.unwrap_or_default();
        let words = self.initial_words(&parts, ty);
        let declared = declared_at(ty, variable.name.span);
        let abstracted = ty.with_hybrid_clocks();
        let (ty, is_left_out) = match self.cause_of(declared) {
            Some(_) => (&abstracted, true),
            None => (ty, false),
        };
        if is_left_out {
            self.warn_if_left_out(&variable.name.text, ty, declared);
        } else {
            self.warn_of_doubles(variable, ty, meta);
        }
        if !is_left_out && ty.any(&|part| *part == Type::Clock { hybrid: true }) {
            let name = variable.name.text.clone();
            self.hybrid_clocks.push((name, variable.name.span));
        }
        let words = words.unwrap_or_else(|| vec![0; ty.size().words as usize]);
        let name = (variable.name.text.as_str(), variable.name.span);
        let place = self.allocate(name, ty, meta, &words);
        let clock_start = Type::Int {
            low: 0,
            high: CLOCK_LIMIT,
        };
        for part in parts.iter().filter(|part| part.ty.is_clock()) {
            if let Some(words) = self.known_words(&part.value, &clock_start, "the start of a clock")
            {
                let clock = place.base.clocks + part.offset.clocks;
                self.world.network.initial_clocks[clock as usize] = words[0];
            }
        }
        Entity::Variable {
            place,
            ty: ty.clone(),
        }
    }

    /// Whether the state has room for one more variable; reports if it has not.
    fn has_room_for(&mut self, ty: &Type, span: Span) -> bool {
        let size = ty.size();
        let words = self.world.initial.len() + self.world.initial_meta.len();
        let clocks = self.world.network.clocks.len();
        let channels = self.world.network.channels.len();
        self.has_room(words + size.words as usize, "variables", SIZE_LIMIT, span)
            && self.has_room(
                clocks + size.clocks as usize - 1,
                "clocks",
                types::CLOCK_LIMIT,
                span,
            )
            && self.has_room(
                channels + size.channels as usize,
                "channels",
                types::CHANNEL_LIMIT,
                span,
            )
    }

    fn has_room(&mut self, count: usize, what: &str, limit: u64, span: Span) -> bool {
        let fits = count as u64 <= limit;
        if !fits {
            self.error(
                codes::ARRAY_TOO_LARGE,
                span,
                format!("the model has more {what} than the engine takes"),
                &format!("the limit is {limit} of them, parts of arrays and structs included"),
            );
        }
        fits
    }

    fn warn_of_doubles(&mut self, variable: &ast::Variable, ty: &Type, meta: bool) {
        if ty.any(&|part| *part == Type::Double) && !meta {
            self.report(
                Diagnostic::new(
                    codes::DOUBLE_IN_STATE,
                    variable.name.span,
                    format!(
                        "the double '{}' is part of the state, bit for bit",
                        variable.name.text
                    ),
                )
                .note("UPPAAL leaves doubles out of the states of symbolic queries")
                .help("declare it const or meta, or use integers"),
            );
        }
    }

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
                // A mistake leaves an error, so that the variable is known to have no value.
                let value = value.unwrap_or_else(|| Expr::error(expr.span));
                parts.push(InitialPart {
                    offset,
                    ty: ty.clone(),
                    value,
                });
            }
            (Initialiser::List(items, span), Type::Array(array)) => {
                if items.len() < array.index.length as usize {
                    self.report(
                        Diagnostic::new(
                            codes::INITIALISER_INCOMPLETE,
                            *span,
                            format!(
                                "the array has {} parts, but only {} values are given",
                                array.index.length,
                                items.len()
                            ),
                        )
                        .note(
                            "the other parts start with the value of an array without initialiser",
                        )
                        .help("give one value for each part"),
                    );
                }
                if items.len() > array.index.length as usize {
                    let message = format!(
                        "the array has {} parts, but {} values are given",
                        array.index.length,
                        items.len()
                    );
                    self.error(
                        codes::INITIALISER_COUNT,
                        *span,
                        message,
                        "give one value for each part",
                    );
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

fn dimension_span(dimension: &Dimension) -> Span {
    match dimension {
        Dimension::Size(expr) => expr.span,
        Dimension::Type(ty) => ty.span,
    }
}
