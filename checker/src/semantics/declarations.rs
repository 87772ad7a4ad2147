//! Declarations: types, variables, constants and their initialisers.

use super::checker::Checker;
use super::codes;
use super::initialisers::InitialPart;
use super::left_out::causes::declared_at;
use super::scope::Entity;
use super::typed::{Expr, Kind, Place, Root};
use super::types::{self, SIZE_LIMIT, Size, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::syntax::ast::{self, Declaration, Dimension, Name, TypeExpr};

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
                Declaration::Import(import) => self.import(import),
                Declaration::Dynamic(dynamic) => self.dynamic_template(dynamic),
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

    /// A variable, constant, clock or channel outside functions.
    fn variable_declaration(&mut self, variable: &ast::Variable) {
        let outer = std::mem::take(&mut self.free_parameter_seen);
        let carried = self.carried(&variable.ty);
        let ty = self.dimensioned(&variable.ty, &variable.dimensions);
        let parts = variable
            .initialiser
            .as_ref()
            .map(|initialiser| self.initialiser(initialiser, &ty, false));
        if matches!(ty, Type::Void) || (ty == Type::String && !carried.constant) {
            self.misplaced_type(variable.ty.span, &ty);
        }
        self.expect_values(&ty, variable.ty.span);
        let entity = if ty == Type::String && carried.constant {
            self.text_constant(variable, parts)
        } else if ty.is_error() || ty == Type::Void || ty == Type::String {
            Entity::Broken
        } else if carried.constant {
            self.constant(variable, &ty, parts)
        } else {
            self.state_variable(variable, &ty, carried.meta, parts)
        };
        self.free_parameter_seen = outer;
        self.declare(&variable.name, entity);
    }

    /// Reports a constant without a value.
    pub(super) fn report_no_value(&mut self, name: &ast::Name) {
        self.error(
            codes::CONSTANT_NOT_INITIALISED,
            name.span,
            format!("the constant '{}' has no value", name.text),
            "write = and a value",
        );
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
        let Some(mut parts) = parts else {
            self.report_no_value(&variable.name);
            return Entity::Broken;
        };
        let free = self.free_parameter_seen;
        match self.initial_words(&mut parts, ty) {
            Some(words) => self.constant_entity(words, ty, free, variable.name.span),
            None => Entity::Broken,
        }
    }

    /// A text, which only imported functions take.
    fn text_constant(
        &mut self,
        variable: &ast::Variable,
        parts: Option<Vec<InitialPart>>,
    ) -> Entity {
        let Some(parts) = parts else {
            self.report_no_value(&variable.name);
            return Entity::Broken;
        };
        match parts.first().and_then(InitialPart::expr) {
            Some(text) if matches!(text.kind, Kind::Text(_)) => Entity::Constant {
                value: text.clone(),
                free: false,
            },
            _ => Entity::Broken,
        }
    }

    /// A constant with these words.
    pub(super) fn constant_entity(
        &mut self,
        words: Vec<i32>,
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
        self.distinguish_parts(ty, &words, span);
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
        Entity::Variable {
            place: Place::unnamed(Root::Constants, Size::of_words(offset), false),
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
        let mut parts = parts.unwrap_or_default();
        let words = self.initial_words(&mut parts, ty);
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
        let ast::Name { text, span } = &variable.name;
        let place = self.allocate(text, *span, ty, meta, &words);
        for part in parts.iter().filter(|part| part.ty.is_clock()) {
            if let Some(value) = part.expr()
                && let Some(words) =
                    self.known_words(value, &Type::CLOCK_VALUE, "the start of a clock")
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
                &format!("the limit is {limit}, parts of arrays and structs included"),
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
}
