//! Names and what they stand for.
//!
//! One namespace per scope, names of locations included; an inner scope hides an outer one. The
//! scopes of a template are the prelude, the global declarations and its own; the declarations of
//! the system section are seen by the system line and by queries only. The prelude is a scope of
//! its own, so a model may declare its names again.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::groups::Member;
use super::typed::{Expr, Place, Signature};
use super::types::Type;
use crate::diagnostics::Span;
use crate::ir::FunctionId;

/// What a name stands for.
#[derive(Clone, Debug)]
pub(super) enum Entity {
    /// A scalar whose value is known; `free` if it depends on a free parameter of a process set.
    Constant { value: Expr, free: bool },
    /// A variable, clock or channel, or an array or struct of any.
    Variable { place: Place, ty: Type },
    /// A type, and which prefixes come with it.
    Type(Type, Carried),
    /// A function.
    Function(FunctionId, Arc<Signature>),
    /// The function whose body is being checked.
    OpenFunction,
    /// A template, by its place in the file.
    Template(usize),
    /// An instantiation, by its place in the system section.
    Instantiation(usize),
    /// A live sequence chart, or an instance of one.
    Chart,
    /// A location of the template.
    Location(u32),
    /// An instance of a dynamic template, in a quantifier.
    Instance(Arc<Member>),
    /// Something about which a mistake was reported, or of which nothing is known.
    Broken,
}

impl Entity {
    /// What it is, for messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Entity::Type(..) => "a type",
            Entity::Function(..) | Entity::OpenFunction => "a function",
            Entity::Template(_) => "a template",
            Entity::Instantiation(_) => "a process",
            Entity::Chart => "a live sequence chart",
            Entity::Location(_) => "a location",
            Entity::Instance(_) => "an instance of a template",
            Entity::Constant { .. } => "a constant",
            Entity::Variable { .. } => "a variable",
            Entity::Broken => "unknown",
        }
    }
}

/// The prefixes that a name given by `typedef` passes on to what is declared with it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carried {
    /// `const`
    pub(super) constant: bool,
    /// `meta`
    pub(super) meta: bool,
}

/// The names of one scope.
#[derive(Clone, Debug, Default)]
pub(super) struct Scope {
    names: FxHashMap<String, (Entity, Span)>,
}

impl Scope {
    /// What a name stands for in this scope, and where it was declared.
    pub(super) fn get(&self, name: &str) -> Option<&(Entity, Span)> {
        self.names.get(name)
    }

    /// Declares a name, or declares it again.
    pub(super) fn set(&mut self, name: &str, entity: Entity, span: Span) {
        self.names.insert(name.to_owned(), (entity, span));
    }

    /// The declared name that is most like the given one, for a hint. Of two letters or fewer,
    /// only the case may differ.
    pub(super) fn similar(&self, name: &str) -> Option<(usize, &str)> {
        let limit = match name.len() {
            0..=2 => 0,
            length => length.div_ceil(3),
        };
        self.names
            .keys()
            .filter(|known| *known != name)
            .map(|known| (distance(known, name), known.as_str()))
            .filter(|&(distance, _)| distance <= limit)
            .min()
    }

    /// The names of locations, in their order.
    pub(super) fn locations(&self) -> Vec<&str> {
        let mut found: Vec<(u32, &str)> = self
            .names
            .iter()
            .filter_map(|(name, (entity, _))| match entity {
                Entity::Location(place) => Some((*place, name.as_str())),
                _ => None,
            })
            .collect();
        found.sort_unstable();
        found.into_iter().map(|(_, name)| name).collect()
    }
}

/// The edit distance of two names; letters that differ in their case, and characters that look
/// alike, count as the same.
fn distance(left: &str, right: &str) -> usize {
    let right: Vec<char> = right.chars().collect();
    let mut row: Vec<usize> = (0..=right.len()).collect();
    for (i, a) in left.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &b) in right.iter().enumerate() {
            let replaced = diagonal + usize::from(looks_like(a) != looks_like(b));
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[right.len()]
}

/// One of the characters that look like this one.
pub(super) fn looks_like(character: char) -> char {
    match character.to_ascii_lowercase() {
        '1' | 'i' => 'l',
        '0' => 'o',
        other => other,
    }
}
