//! `foreach` in `simulate`: an expression for each value of a range, or for each instance of a
//! dynamic template. An instance is shown by its place, whose value is 0 while nobody is there.

use std::sync::Arc;

use super::checker::Checker;
use super::codes;
use super::groups::Member;
use super::labels::collapse;
use super::operators::compare_integers;
use super::scope::Entity;
use super::typed::{Expr, Kind};
use super::types::Type;
use crate::ir::{LocationId, Relation};
use crate::syntax::ast;

/// The most values that one `foreach` ranges over.
const MOST_VALUES: i64 = 4096;

impl Checker<'_> {
    /// The expressions that an item of `simulate` shows, with their texts.
    pub(super) fn shown(&mut self, item: &ast::Shown) -> Vec<(Expr, String)> {
        let text = collapse(self.sources.text(item.value.span));
        let Some((name, ty)) = &item.each else {
            return vec![(self.expression(&item.value), text)];
        };
        let texts = |value: i32| format!("{text} for {} = {value}", name.text);
        if let ast::TypeKind::Named(template) = &ty.kind
            && let Some(dynamic) = self.dynamic(&template.text).cloned()
        {
            let Some(slots) = dynamic.slots.clone() else {
                return Vec::new();
            };
            let places = 0..slots.count as i32;
            let shown = places.map(|place| {
                let index = Expr::int(place, Type::below(slots.count), name.span);
                let member = Member::of_instance(dynamic.group(), index);
                let shown = self.at_place(&item.value, name, &member, slots.absent);
                (shown, texts(place))
            });
            return shown.collect();
        }
        let Some((range, (low, high))) = self.iterated(ty) else {
            return Vec::new();
        };
        if i64::from(high) - i64::from(low) >= MOST_VALUES {
            self.error(
                codes::RANGE_TOO_LARGE,
                ty.span,
                format!("this foreach ranges over more than {MOST_VALUES} values"),
                "use a smaller range",
            );
            return Vec::new();
        }
        let shown = (low..=high).map(|number| {
            let value = Expr::int(number, range.clone(), name.span);
            let entity = Entity::Constant { value, free: false };
            let shown = self.scoped(name, entity, |checker| checker.expression(&item.value));
            (shown, texts(number))
        });
        shown.collect()
    }

    /// What an expression is worth to the instance at a place; 0 if there is none.
    fn at_place(
        &mut self,
        value: &ast::Expr,
        name: &ast::Name,
        member: &Member,
        absent: LocationId,
    ) -> Expr {
        let span = value.span;
        let entity = Entity::Instance(Arc::new(member.clone()));
        let shown = self.scoped(name, entity, |checker| checker.expression(value));
        let shown = self.clock_value(shown);
        if shown.is_error() || !shown.ty.is_number() {
            // What is wrong is reported where it is shown.
            return shown;
        }
        let place = self.location_number(member, None, span);
        let absent = Expr::int(absent.0 as i32, place.ty.clone(), span);
        let is_there = compare_integers(Relation::NotEqual, place, absent, span);
        let ty = shown.ty.clone();
        let nothing = match ty {
            Type::Double => Expr::new(Kind::Double(0.0), Type::Double, span),
            Type::Bool => Expr::bool(false, span),
            _ => Expr::int(0, Type::ANY_INT, span),
        };
        let (shown, nothing) = (Box::new(shown), Box::new(nothing));
        let ty = if ty.is_integral() && ty != Type::Bool {
            Type::ANY_INT
        } else {
            ty
        };
        Expr::new(Kind::Ternary(Box::new(is_there), shown, nothing), ty, span)
    }
}
