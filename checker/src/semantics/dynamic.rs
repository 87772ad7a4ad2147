//! Dynamic templates: instances come and go while the model runs.
//!
//! A dynamic template has a *pool* of slots, each a process of the network. A slot that is not in
//! use is in a location of its own behind all others, `absent`, that no edge leaves. `spawn`
//! is a function that takes the first slot that is free: it gives its variables their initial
//! values and the arguments, and puts it into its initial location. An edge with `exit()` leads to
//! `absent`. So nothing but this file knows of dynamic templates, and a run does not depend on the
//! size of the pool, as long as that is great enough; if it is not, `spawn` ends in
//! [`RunTimeErrorKind::NoRoom`], and whoever asks takes a greater pool.
//!
//! Invariants
//! * The slots of a template follow each other, and so do their variables: all are equally large.
//! * A variable counts the slots that are in use: `numOf(T)`.
//! * Parameters are variables of the slot; one that is a channel holds its number.
//!
//! Source: A. David, K. G. Larsen, A. Legay, D. B. Poulsen, "Statistical Model Checking of Dynamic
//! Networks of Stochastic Hybrid Automata", Electronic Communications of the
//! EASST 66 (2013).
//!
//! Cost: that of as many processes as the pool has slots.

use std::collections::HashSet;
use std::sync::Arc;

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::groups::Member;
use super::operators::compare_integers;
use super::pools::{Dynamic, Slots};
use super::scope::{Entity, Scope};
use super::typed::{
    Effects, Element, Expr, Kind, LOCATION_WORDS, Local, META_WORDS, Parameter, Place, Root,
    Signature,
};
use super::types::{Size, Type};
use crate::cancellation;
use crate::diagnostics::Span;
use crate::ir::{
    self, Block, Function, FunctionId, Guard, IntegerOperator, LocationChances, LocationId,
    Network, ProcessId, Relation, Terminator, Urgency,
};
use crate::syntax::ast::{self, Document, ExprKind, Name, Quantifier};

/// The work of making a slot: see [`cancellation::work`].
const UNITS_FOR_SLOT: usize = 1 << 14;

/// The type of the counter.
const COUNT: Type = Type::Int {
    low: 0,
    high: i32::MAX,
};

impl Checker<'_> {
    /// `dynamic T(parameters);`
    pub(super) fn dynamic_template(&mut self, declared: &ast::DynamicTemplate) {
        let name = &declared.name;
        if self.dynamic(&name.text).is_some() {
            self.error(
                codes::NAME_DECLARED_TWICE,
                name.span,
                format!("'{}' is declared twice", name.text),
                "remove one of the two declarations",
            );
            return;
        }
        let outer_locals = std::mem::take(&mut self.locals);
        self.scopes.push(Scope::default());
        let parameters = declared.parameters.iter();
        let parameters = parameters.map(|written| self.dynamic_parameter(written));
        let parameters: Vec<Parameter> = parameters.collect();
        self.scopes.pop();
        self.locals = outer_locals;
        let text = format!("numOf({})", name.text);
        let counter = self.allocate(&text, name.span, &COUNT, false, &[0]);
        // What it writes besides is added when the slots are known.
        let effects = Effects {
            writes: vec![(counter.base.words, 1)],
            ..Effects::default()
        };
        let signature = Signature {
            name: name.text.clone(),
            parameters,
            result: Type::Void,
            effects,
            is_external: false,
            unknown: None,
        };
        let functions = &mut self.world.network.functions;
        functions.push(unwritten(&name.text));
        let dynamic = Dynamic {
            name: name.clone(),
            spawn: FunctionId(functions.len() as u32 - 1),
            signature: Arc::new(signature),
            counter,
            slots: None,
            is_spawned: false,
        };
        self.world.dynamics.push(dynamic);
    }

    fn dynamic_parameter(&mut self, written: &ast::Parameter) -> Parameter {
        let ty = self.dimensioned(&written.ty, &written.dimensions);
        self.check_parameter_type(written, &ty);
        let is_channel = ty.size().channels > 0;
        if written.reference && !is_channel && !ty.is_error() {
            self.error(
                codes::DYNAMIC_MISUSED,
                written.name.span,
                format!(
                    "{} cannot be given to an instance by reference",
                    ty.described()
                ),
                "pass it by value, or let the template use the global variable itself",
            );
        }
        Parameter {
            passes_channel: is_channel,
            ..self.parameter_of_type(written, ty)
        }
    }

    /// The dynamic template with this name.
    pub(super) fn dynamic(&self, name: &str) -> Option<&Dynamic> {
        self.world.dynamics.iter().find(|one| one.name.text == name)
    }

    fn known_dynamic(&mut self, name: &Name) -> Option<Dynamic> {
        let known = self.dynamic(&name.text).cloned();
        if known.is_none() {
            self.error(
                codes::DYNAMIC_MISUSED,
                name.span,
                format!("'{}' is no dynamic template", name.text),
                "declare it before: dynamic T(const int n);",
            );
        }
        known
    }

    /// `spawn T(arguments)`
    pub(super) fn spawn(&mut self, name: &Name, arguments: &[ast::Expr], span: Span) -> Expr {
        match self.known_dynamic(name) {
            Some(_) if self.reading == Reading::Symbolic => self.unknown_to_zones(name, span),
            Some(dynamic) => self.call_function(dynamic.spawn, &dynamic.signature, arguments, span),
            None => {
                for argument in arguments {
                    self.expression(argument);
                }
                Expr::error(span)
            }
        }
    }

    /// Something about instances in the symbolic reading.
    fn unknown_to_zones(&mut self, name: &Name, span: Span) -> Expr {
        let mut all = self.world.dynamics.iter_mut();
        if let Some(dynamic) = all.find(|one| one.name.text == name.text) {
            dynamic.is_spawned = true;
        }
        self.error(
            codes::DYNAMIC_SYMBOLIC,
            span,
            format!(
                "'{}' is a dynamic template: only statistical queries know its instances",
                name.text
            ),
            "list its processes in the system line, if there is a greatest number of them",
        )
    }

    /// `numOf(T)`
    pub(super) fn number_of(&mut self, name: &Name, span: Span) -> Expr {
        match self.known_dynamic(name) {
            Some(_) if self.reading == Reading::Symbolic => self.unknown_to_zones(name, span),
            Some(dynamic) => {
                let place = Place {
                    mutable: false,
                    ..dynamic.counter
                };
                Expr::new(Kind::Variable(place), COUNT, span)
            }
            None => Expr::error(span),
        }
    }

    /// `exit()` as an update of an edge.
    pub(super) fn exit(&mut self, span: Span) -> Expr {
        let Some(counter) = self.leaving.clone() else {
            return self.misplaced_exit(span);
        };
        let counter = Expr::new(Kind::Variable(counter), COUNT, span);
        let one = Expr::int(1, Type::ANY_INT, span);
        let operator = IntegerOperator::Subtract;
        let kind = Kind::Compound(operator, Box::new(counter), Box::new(one));
        Expr::new(kind, COUNT, span)
    }

    /// `exit()` anywhere else.
    pub(super) fn misplaced_exit(&mut self, span: Span) -> Expr {
        self.error(
            codes::DYNAMIC_MISUSED,
            span,
            "exit() ends the instance that takes the edge: it is an update of a dynamic template",
            "write it into the list of updates of an edge, not into a function or a condition",
        )
    }

    /// Where an edge with these updates leads that would lead to `target`. `others` counts the
    /// `exit()` before.
    pub(super) fn unless_exit(
        &mut self,
        template: &ast::Template,
        updates: &[ast::Expr],
        others: usize,
        target: LocationId,
    ) -> LocationId {
        let mut exits = updates.iter().filter(|one| is_exit(one));
        let (Some(first), second) = (exits.next(), exits.next()) else {
            return target;
        };
        if let Some(again) = second.or((others > 0).then_some(first)) {
            self.error(
                codes::DYNAMIC_MISUSED,
                again.span,
                "an instance ends only once",
                "remove this exit()",
            );
        }
        absent(template)
    }

    /// What counts the instances of a template, if it is a dynamic one.
    pub(super) fn counter_of(&self, template: &ast::Template) -> Option<Place> {
        let dynamic = self.dynamic(&template.name.text);
        dynamic.map(|one| one.counter.clone())
    }

    /// Makes the slots of all dynamic templates, the last processes of the network.
    pub(super) fn instances(&mut self, document: &Document, used: &mut [bool]) {
        for number in 0..self.world.dynamics.len() {
            let dynamic = self.world.dynamics[number].clone();
            let name = &dynamic.name;
            let templates = document.templates.iter();
            let Some(i) = templates.clone().position(|one| one.name.text == name.text) else {
                self.error(
                    codes::DYNAMIC_MISUSED,
                    name.span,
                    format!("there is no template '{}'", name.text),
                    "add the template, or remove the declaration",
                );
                continue;
            };
            if self.reading == Reading::Symbolic {
                if !dynamic.is_spawned {
                    let note = "not supported in symbolic queries: a dynamic template";
                    let what = format!("the template '{}'", name.text);
                    self.warn_of_unused(name.span, &what, note.to_owned());
                }
                continue;
            }
            used[i] = true;
            let template = &document.templates[i];
            if self.world.processes.groups.contains_key(&name.text) {
                self.error(
                    codes::DYNAMIC_MISUSED,
                    name.span,
                    format!("'{}' stands in the system line too", name.text),
                    "let a process of the system line spawn the first instances",
                );
                continue;
            }
            if !self.has_parameters_of(template, &dynamic) {
                continue;
            }
            let slots = self.slots(template, &dynamic);
            self.world.dynamics[number].slots = Some(slots.clone());
            if self.can_lower() {
                self.write_spawn(&dynamic, &slots);
            }
        }
    }

    /// Whether a template has the parameters that its declaration says.
    fn has_parameters_of(&mut self, template: &ast::Template, dynamic: &Dynamic) -> bool {
        self.scopes.push(Scope::default());
        let formals = template.parameters.iter();
        let types: Vec<(Type, bool)> = formals
            .map(|one| (self.dimensioned(&one.ty, &one.dimensions), one.reference))
            .collect();
        self.scopes.pop();
        let declared = &dynamic.signature.parameters;
        let fits = types.len() == declared.len()
            && types
                .iter()
                .zip(declared)
                .all(|((ty, reference), declared)| {
                    ty.is_equivalent(&declared.ty) && *reference == declared.reference
                });
        if !fits {
            self.error(
                codes::DYNAMIC_MISUSED,
                dynamic.name.span,
                format!("the template '{}' has other parameters", dynamic.name.text),
                "declare the parameters as the template does",
            );
        }
        fits
    }

    fn slots(&mut self, template: &ast::Template, dynamic: &Dynamic) -> Slots {
        let ends = |checker: &Checker<'_>| {
            let world = &checker.world;
            (world.initial.len() as u32, world.initial_meta.len() as u32)
        };
        let start = ends(self);
        let mut slots = Slots {
            first: self.world.network.processes.len() as u32,
            count: self.pool,
            words: (start.0, 0),
            meta_words: (META_WORDS + start.1, 0),
            parameters: Vec::new(),
            initial: LocationId(0),
            absent: absent(template),
        };
        for number in 0..slots.count {
            cancellation::work(UNITS_FOR_SLOT);
            let id = ProcessId(slots.first + number);
            let name = format!("{}({number})", dynamic.name.text);
            let outer = self.process.replace((id, name));
            self.hides_system = true;
            let (scope, parameters) = self.slot_parameters(template, dynamic);
            self.scopes.push(scope);
            self.leaving = Some(dynamic.counter.clone());
            let mut process = self.template(template, 0);
            self.leaving = None;
            let scope = self.scopes.pop().expect("the scope was just opened");
            self.hides_system = false;
            self.process = outer;
            slots.initial = std::mem::replace(&mut process.initial, slots.absent);
            process.locations.push(absent_location(template));
            process.group = ProcessId(slots.first);
            self.world.processes.scopes.push(scope);
            self.world.network.processes.push(process);
            if number == 0 {
                let end = ends(self);
                (slots.words.1, slots.meta_words.1) = (end.0 - start.0, end.1 - start.1);
                slots.parameters = parameters;
            }
        }
        slots
    }

    /// The parameters of a slot: variables, and channels whose numbers variables hold.
    fn slot_parameters(
        &mut self,
        template: &ast::Template,
        dynamic: &Dynamic,
    ) -> (Scope, Vec<Place>) {
        let mut scope = Scope::default();
        let mut places = Vec::new();
        for (formal, declared) in template
            .parameters
            .iter()
            .zip(&dynamic.signature.parameters)
        {
            let (name, span) = (formal.name.text.as_str(), formal.name.span);
            let channels = self.world.network.channels.len() as u32;
            let ty = if declared.passes_channel {
                Type::below(channels)
            } else {
                declared.ty.clone()
            };
            let words = vec![0; ty.size().words as usize];
            let mut place = self.allocate(name, span, &ty, false, &words);
            places.push(place.clone());
            place.mutable = !self.carried(&formal.ty).constant;
            let entity = if declared.passes_channel {
                let number = Expr::new(Kind::Variable(place), ty, span);
                let value = channel_of(number, channels, &declared.ty, span);
                Entity::Constant { value, free: false }
            } else {
                Entity::Variable { place, ty }
            };
            scope.set(name, entity, span);
        }
        (scope, places)
    }

    /// Writes the function that makes an instance in the place that was kept for it.
    fn write_spawn(&mut self, dynamic: &Dynamic, slots: &Slots) {
        let image = |(first, count): (u32, u32), words: &[i32]| {
            words[first as usize..][..count as usize].to_vec()
        };
        let (meta, count) = slots.meta_words;
        let initial = [
            image(slots.words, &self.world.initial),
            image((meta - META_WORDS, count), &self.world.initial_meta),
        ];
        let locals = dynamic.signature.parameters.iter();
        let locals: Vec<Local> = locals
            .map(|parameter| Local {
                ty: parameter.ty.clone(),
                addressed: false,
                reference: parameter.reference,
            })
            .collect();
        let signature = &dynamic.signature;
        let mut builder = self.builder_over(locals);
        builder.signature(&signature.parameters, &Type::Void);
        let counter = &dynamic.counter;
        let written = builder.spawn(signature, slots, initial, counter, dynamic.name.span);
        let functions = &mut self.world.network.functions;
        functions.swap(dynamic.spawn.0 as usize, written.0 as usize);
        functions.truncate(written.0 as usize);
    }

    /// Adds what `spawn` writes to the updates that call it.
    pub(super) fn spawned_writes(&mut self) {
        let mut ranges = Vec::new();
        for dynamic in &self.world.dynamics {
            if let Some(slots) = &dynamic.slots {
                for (first, count) in [slots.words, slots.meta_words] {
                    ranges.push((first, count * slots.count));
                }
                ranges.push((LOCATION_WORDS + slots.first, slots.count));
            }
        }
        ranges.retain(|&(_, count)| count > 0);
        let spawns = self.world.dynamics.iter().map(|one| one.spawn);
        let network = &mut self.world.network;
        let callers = callers_of(network, spawns.collect());
        if callers.is_empty() {
            return;
        }
        for update in network.updates_mut() {
            if update.function.is_some_and(|one| callers.contains(&one)) {
                update.writes.extend(&ranges);
            }
        }
    }

    /// `forall (c : T) body` and its kin over the instances of a dynamic template; `None` if `ty`
    /// is none.
    pub(super) fn over_instances(
        &mut self,
        quantifier: Quantifier,
        name: &Name,
        ty: &ast::TypeExpr,
        body: &ast::Expr,
        span: Span,
    ) -> Option<Expr> {
        let ast::TypeKind::Named(template) = &ty.kind else {
            return None;
        };
        let dynamic = self.dynamic(&template.text)?.clone();
        if self.reading == Reading::Symbolic {
            return Some(self.unknown_to_zones(template, span));
        }
        let slots = dynamic.slots.as_ref().filter(|_| self.is_query);
        let Some(slots) = slots else {
            self.error(
                codes::DYNAMIC_MISUSED,
                span,
                "only queries quantify over the instances of a dynamic template",
                "let the instances count what they do in a global variable; numOf(T) counts them",
            );
            return Some(Expr::error(span));
        };
        let number = Type::below(slots.count);
        let local = self.new_local(number.clone());
        let index = Expr::new(Kind::Variable(Place::bound(local)), number, name.span);
        let member = Member::of_instance(dynamic.group(), index);
        let entity = Entity::Instance(Arc::new(member.clone()));
        let outer = std::mem::take(&mut self.needs_unrolling);
        let checked = self.scoped(name, entity, |checker| checker.expression(body));
        let is_unknown = std::mem::replace(&mut self.needs_unrolling, outer);
        if is_unknown {
            self.error(
                codes::DYNAMIC_MISUSED,
                body.span,
                "this asks an instance for something else than its locations and variables",
                "name its locations and variables only",
            );
            return Some(Expr::error(span));
        }
        self.expect_pure(&checked, "the body of a quantifier");
        let Some(ty) = self.quantified_type(quantifier, &checked) else {
            return Some(Expr::error(span));
        };
        let place = self.location_number(&member, None, span);
        let absent = Expr::int(slots.absent.0 as i32, place.ty.clone(), span);
        let kind = Kind::Quantifier {
            quantifier,
            local,
            range: (0, slots.count as i32 - 1),
            body: Box::new(if_used(quantifier, place, absent, checked, &ty, span)),
        };
        Some(Expr::new(kind, ty, span))
    }
}

/// The body of a quantifier, of a slot that counts only if its place is not the absent one.
fn if_used(
    quantifier: Quantifier,
    place: Expr,
    absent: Expr,
    body: Expr,
    ty: &Type,
    span: Span,
) -> Expr {
    let compared = |relation, place, absent| {
        let compared = compare_integers(relation, place, absent, span);
        Box::new(compared)
    };
    let body = Box::new(body);
    let kind = match quantifier {
        Quantifier::ForAll => Kind::Or(compared(Relation::Equal, place, absent), body),
        Quantifier::Exists => Kind::And(compared(Relation::NotEqual, place, absent), body),
        Quantifier::Sum => {
            let zero = if *ty == Type::Double {
                Expr::new(Kind::Double(0.0), Type::Double, span)
            } else {
                Expr::int(0, Type::ANY_INT, span)
            };
            let is_used = compared(Relation::NotEqual, place, absent);
            Kind::Ternary(is_used, body, Box::new(zero))
        }
    };
    Expr::new(kind, ty.clone(), span)
}

fn is_exit(update: &ast::Expr) -> bool {
    matches!(update.kind, ExprKind::Exit)
}

/// How many of these updates are `exit()`.
pub(super) fn exits(updates: &[ast::Expr]) -> usize {
    updates.iter().filter(|one| is_exit(one)).count()
}

/// The location of slots that are not in use.
fn absent(template: &ast::Template) -> LocationId {
    LocationId(template.locations.len() as u32)
}

fn absent_location(template: &ast::Template) -> ir::Location {
    ir::Location {
        name: String::from("absent"),
        urgency: Urgency::Normal,
        invariant: Guard::default(),
        rates: Vec::new(),
        chances: LocationChances::default(),
        edges: Vec::new(),
        span: template.name.span,
    }
}

/// A function that keeps a place.
fn unwritten(template: &str) -> Function {
    Function {
        name: format!("spawn {template}"),
        registers: Vec::new(),
        parameters: 0,
        frame_words: 0,
        result: None,
        blocks: vec![Block {
            instructions: Vec::new(),
            terminator: Terminator::Return(None),
        }],
    }
}

/// The channel with this number, or the array of channels that begins there.
fn channel_of(number: Expr, channels: u32, ty: &Type, span: Span) -> Expr {
    let first = Place::unnamed(Root::State, Size::default(), true);
    let kind = Kind::Index(Element {
        array: Box::new(Expr::new(Kind::Variable(first), ty.clone(), span)),
        index: Box::new(number),
        first: 0,
        // All channels of the array are there.
        length: (channels + 1).saturating_sub(ty.size().channels),
        stride: Size {
            channels: 1,
            ..Size::default()
        },
    });
    Expr::new(kind, ty.clone(), span)
}

/// The functions that call one of these, directly or not.
fn callers_of(network: &Network, mut found: HashSet<FunctionId>) -> HashSet<FunctionId> {
    if found.is_empty() {
        return found;
    }
    loop {
        let before = found.len();
        for (number, function) in (0..).zip(&network.functions) {
            if function.callees().any(|callee| found.contains(&callee)) {
                found.insert(FunctionId(number));
            }
        }
        if found.len() == before {
            return found;
        }
    }
}
