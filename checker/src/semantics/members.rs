//! Processes in queries: `P.location`, `P.l`, `P.x`, `P(1).x`, `P(i).l`.
//!
//! The members of a process set come from one template and lie one behind the other, so `P(i).x`
//! with a computed `i` is an index into them. Where members differ (a constant that depends on the
//! parameter), and for clocks, the quantifier that binds `i` is unrolled.

use super::checker::Checker;
use super::codes;
use super::groups::{Group, Member};
use super::hints::first_member;
use super::operators::compare_integers;
use super::scope::Entity;
use super::typed::{Element, Expr, Kind, LOCATION_WORDS, Place, Root};
use super::types::{Size, Type};
use crate::diagnostics::Span;
use crate::ir::Relation;
use crate::syntax::ast::{self, ExprKind, Name};

impl Checker<'_> {
    /// `record.name` where `record` is a process; `None` if it is not.
    pub(super) fn process_member(
        &mut self,
        record: &ast::Expr,
        name: &Name,
        span: Span,
    ) -> Option<Expr> {
        if !self.is_query {
            return None;
        }
        let member = self.member(record)?;
        Some(match member {
            Ok(member) => self.part_of_member(&member, name, span),
            Err(()) => Expr::error(span),
        })
    }

    /// `P.f(arguments)`
    pub(super) fn call_of_member(
        &mut self,
        callee: &ast::Expr,
        arguments: &[ast::Expr],
        span: Span,
    ) -> Expr {
        if let ExprKind::Field(record, name) = &callee.kind
            && self.is_query
            && let Some(member) = self.member(record)
        {
            let Ok(member) = member else {
                return Expr::error(span);
            };
            let Some(process) = known_process(&member) else {
                self.needs_unrolling = true;
                return Expr::error(span);
            };
            let entity = self.entity_of(process, &name.text);
            if let Some(Entity::Function(function, signature)) = entity {
                return self.call_function(function, &signature, arguments, span);
            }
        }
        let help = if matches!(callee.kind, ExprKind::Deadlock) {
            "write `deadlock` without parentheses"
        } else {
            "only functions can be called"
        };
        self.error(
            codes::CALL_OF_NO_FUNCTION,
            callee.span,
            "this is no function",
            help,
        );
        Expr::error(span)
    }

    /// The process that an expression names: `None` if it names none, an error if it was reported.
    fn member(&mut self, record: &ast::Expr) -> Option<Result<Member, ()>> {
        let (callee, arguments) = match &record.kind {
            ExprKind::Name(name) => (name, &[][..]),
            ExprKind::Call(callee, arguments) => match &callee.kind {
                ExprKind::Name(name) => (name, arguments.as_slice()),
                _ => return None,
            },
            _ => return None,
        };
        match self.lookup(callee) {
            None | Some(Entity::Template(_) | Entity::Instantiation(_)) => {}
            Some(Entity::Instance(member)) if arguments.is_empty() => {
                return Some(Ok(Member::clone(&member)));
            }
            Some(_) => return None,
        }
        let Some(group) = self.world.processes.groups.get(callee).cloned() else {
            if self.lookup(callee).is_some() {
                self.error(
                    codes::PROCESS_NOT_IN_SYSTEM,
                    record.span,
                    format!("'{callee}' is not in the system line"),
                    &match self.process_of_template(callee) {
                        Some(process) => {
                            format!("{callee} is the template of the process: write `{process}`")
                        }
                        None => String::from("only processes of the system have a state"),
                    },
                );
                return Some(Err(()));
            }
            return None;
        };
        let arguments: Vec<Expr> = arguments
            .iter()
            .map(|argument| self.expression(argument))
            .collect();
        if arguments.len() != group.parameters.len() {
            let member = first_member(callee, &group);
            self.error(
                codes::ARGUMENT_COUNT,
                record.span,
                format!(
                    "'{callee}' takes {} arguments, but {} are given",
                    group.parameters.len(),
                    arguments.len()
                ),
                &if group.parameters.is_empty() {
                    format!("it is one process, not a set: write `{member}`")
                } else {
                    format!("name one process of the set: {member}")
                },
            );
            return Some(Err(()));
        }
        Some(self.checked_member(group, arguments))
    }

    fn checked_member(&mut self, group: Group, arguments: Vec<Expr>) -> Result<Member, ()> {
        if group.count() == 0 {
            let span = arguments[0].span;
            self.error(
                codes::CONSTANT_OUT_OF_RANGE,
                span,
                "this set of processes is empty",
                "give the range of its parameter at least one value",
            );
            return Err(());
        }
        for (argument, ty) in arguments.iter().zip(&group.parameters) {
            if argument.is_error() {
                return Err(());
            }
            let (low, high) = ty.bounds();
            let set = ty.scalar_set();
            let index = super::types::Index {
                first: low,
                length: high.abs_diff(low) + 1,
                set,
            };
            self.check_index_type(index, argument);
            if let Some(value) = argument.constant()
                && !(low..=high).contains(&value)
            {
                self.error(
                    codes::CONSTANT_OUT_OF_RANGE,
                    argument.span,
                    format!("there is no process with the number {value}"),
                    &format!("the numbers go from {low} to {high}"),
                );
                return Err(());
            }
        }
        Ok(Member {
            group,
            arguments,
            is_instance: false,
        })
    }

    /// What a name stands for in a process.
    fn entity_of(&self, process: u32, name: &str) -> Option<Entity> {
        let scope = self.world.processes.scopes.get(process as usize)?;
        scope.get(name).map(|(entity, _)| entity.clone())
    }

    fn part_of_member(&mut self, member: &Member, name: &Name, span: Span) -> Expr {
        let first = member.group.first;
        let process = known_process(member);
        let entity = self.entity_of(process.unwrap_or(first), &name.text);
        let entity = entity.or_else(|| self.unnamed_location(first, &name.text));
        match entity {
            None if name.text == "location" => self.location_number(member, process, span),
            Some(Entity::Location(location)) => {
                let number = self.location_number(member, process, span);
                let location = Expr::int(location as i32, number.ty.clone(), span);
                compare_integers(Relation::Equal, number, location, span)
            }
            Some(Entity::Variable { place, ty }) if process.is_some() => {
                self.variable(place, ty, span)
            }
            Some(Entity::Variable { place, ty }) => {
                match self.member_stride(member, name, &place) {
                    Some(stride) => {
                        let first = Expr::new(Kind::Variable(place), ty, span);
                        let first = self.unless_left_out(first);
                        chosen_member(first, member, stride, span)
                    }
                    None => self.unroll_members(span),
                }
            }
            Some(Entity::Constant { value, .. }) if process.is_some() => Expr { span, ..value },
            // It is the same in all slots, unless a channel is meant.
            Some(Entity::Constant { value, .. })
                if member.is_instance && value.variable().is_none() =>
            {
                Expr { span, ..value }
            }
            Some(Entity::Constant { .. }) => self.unroll_members(span),
            Some(Entity::Broken) => Expr::error(span),
            Some(_) | None => {
                let help = self.instead_of_member(first, &name.text);
                self.error(
                    codes::MEMBER_UNKNOWN,
                    name.span,
                    format!("the process has no location or variable '{}'", name.text),
                    &help,
                );
                Expr::error(span)
            }
        }
    }

    /// The location without a name that `_` and its id mean, as UPPAAL calls it.
    fn unnamed_location(&self, process: u32, name: &str) -> Option<Entity> {
        let locations = &self.world.network.processes[process as usize].locations;
        let found = locations
            .iter()
            .position(|one| name.starts_with('_') && one.name == name)?;
        Some(Entity::Location(found as u32))
    }

    fn unroll_members(&mut self, span: Span) -> Expr {
        self.needs_unrolling = true;
        Expr::error(span)
    }

    /// The number of the location that a process is in.
    pub(super) fn location_number(
        &mut self,
        member: &Member,
        process: Option<u32>,
        span: Span,
    ) -> Expr {
        let first = member.group.first;
        let count = self.world.network.processes[first as usize].locations.len();
        let word = Size::of_words(LOCATION_WORDS + process.unwrap_or(first));
        let place = Place::unnamed(Root::State, word, false);
        let number = Expr::new(Kind::Variable(place), Type::below(count as u32), span);
        if process.is_some() {
            return number;
        }
        chosen_member(number, member, Size::of_words(1), span)
    }

    /// How far apart a variable lies in the members of a set, if that is the same everywhere.
    fn member_stride(&self, member: &Member, name: &Name, first: &Place) -> Option<Size> {
        let base = |i: u32| match self.entity_of(member.group.first + i, &name.text) {
            Some(Entity::Variable { place, .. }) if place.root == first.root => Some(place.base),
            _ => None,
        };
        let count = member.group.count();
        let stride = if count > 1 {
            let second = base(1)?;
            Size {
                words: second.words.checked_sub(first.base.words)?,
                clocks: second.clocks.checked_sub(first.base.clocks)?,
                channels: second.channels.checked_sub(first.base.channels)?,
            }
        } else {
            Size::default()
        };
        let fits = |i: u32| base(i) == Some(first.base.plus(stride.times(i)));
        (0..count).all(fits).then_some(stride)
    }
}

/// The process, if all arguments are known.
fn known_process(member: &Member) -> Option<u32> {
    let mut position = 0;
    for (argument, ty) in member.arguments.iter().zip(&member.group.parameters) {
        let (low, high) = ty.bounds();
        let value = argument.constant()?;
        position = position * (high.abs_diff(low) + 1) + value.abs_diff(low);
    }
    Some(member.group.first + position)
}

/// The place in the member that the arguments choose, given that in the first member.
fn chosen_member(first: Expr, member: &Member, stride: Size, span: Span) -> Expr {
    let mut place = first;
    let mut later = member.group.count();
    for (argument, ty) in member.arguments.iter().zip(&member.group.parameters) {
        let (low, high) = ty.bounds();
        let length = high.abs_diff(low) + 1;
        later /= length;
        let part = place.ty.clone();
        let kind = Kind::Index(Element {
            array: Box::new(place),
            index: Box::new(argument.clone()),
            first: low,
            length,
            stride: stride.times(later),
        });
        place = Expr::new(kind, part, span);
    }
    place
}
