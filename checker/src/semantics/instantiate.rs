//! The system section: instantiations, process sets, and the processes of the network.
//!
//! A name in the system line that has parameters left stands for a set of processes, one for each
//! combination of their values, the first parameter changing slowest. Arguments by value are
//! constants; arguments by reference stand for the variable, clock or channel itself.

use crate::cancellation;

use super::assigned::assigned_names;
use super::checker::Checker;
use super::codes;
use super::expressions::read;
use super::groups::{Group, parameter_count};
use super::offsets::known_offset;
use super::scope::{Entity, Scope};
use super::typed::{Expr, Kind, Place, Root};
use super::types::{DEFAULT_INT, Memory, Size, Type};
use crate::diagnostics::{Diagnostic, Span};
use crate::exec::arithmetic;
use crate::ir::{Coordinate, ProcessId};
use crate::syntax::ast::{self, Document, Name, Parameter, SystemItem, UnsupportedPart};

/// The most processes of a network.
const PROCESS_LIMIT: u64 = 1 << 16;

/// What is instantiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Instantiated {
    Template(usize),
    Instantiation(usize),
}

impl Checker<'_> {
    /// Checks the system section and makes the processes.
    pub(super) fn system(&mut self, document: &Document) {
        for (i, item) in document.system.items.iter().enumerate() {
            match item {
                SystemItem::Declaration(declaration) => {
                    self.declarations(std::slice::from_ref(declaration));
                }
                SystemItem::Instantiation { name, .. } => {
                    // Without its template it is broken: it must not mean a template that is named
                    // like it later on.
                    let entity = match self.check_instantiation(document, i) {
                        Some(_) => Entity::Instantiation(i),
                        None if self.is_of_chart(document, i) => Entity::Chart,
                        None => Entity::Broken,
                    };
                    self.declare(name, entity);
                }
            }
        }
        let mut used = vec![false; document.templates.len()];
        for (level, names) in document.system.processes.iter().enumerate() {
            for name in names {
                self.system_line_name(document, name, level as u32, &mut used);
            }
        }
        self.expect_processes(document);
        self.instances(document, &mut used);
        for (template, _) in document
            .templates
            .iter()
            .zip(&used)
            .filter(|(_, used)| !**used)
        {
            self.unused_template(template);
        }
        self.unsupported_parts(document, &used);
    }

    /// Refuses a system line of empty sets of processes and of charts.
    fn expect_processes(&mut self, document: &Document) {
        if !self.world.network.processes.is_empty() {
            return;
        }
        let mut groups = self.world.processes.groups.values();
        let has_empty_set = groups.any(|group| group.count() == 0);
        let names = || document.system.processes.iter().flatten();
        let has_chart = names().any(|name| matches!(self.lookup(&name.text), Some(Entity::Chart)));
        let (message, help) = if has_empty_set {
            (
                "the system has no process: its sets of processes are empty",
                "give their parameters at least one value",
            )
        } else if has_chart {
            (
                "the system has no process: live sequence charts are not processes",
                "name the processes that the charts observe",
            )
        } else {
            return;
        };
        if let Some(name) = names().next() {
            self.error(codes::SYSTEM_EMPTY, name.span, message, help);
        }
    }

    /// Whether it instantiates a live sequence chart.
    fn is_of_chart(&mut self, document: &Document, item: usize) -> bool {
        match &document.system.items[item] {
            SystemItem::Instantiation { template, .. } => {
                matches!(self.lookup(&template.text), Some(Entity::Chart))
            }
            SystemItem::Declaration(_) => false,
        }
    }

    /// Checks an instantiation without knowing the values of its parameters; returns what it
    /// instantiates.
    fn check_instantiation(&mut self, document: &Document, item: usize) -> Option<Instantiated> {
        let SystemItem::Instantiation {
            parameters,
            template,
            arguments,
            ..
        } = &document.system.items[item]
        else {
            return None;
        };
        self.scopes.push(Scope::default());
        for parameter in parameters {
            let ty = self.dimensioned(&parameter.ty, &parameter.dimensions);
            self.check_parameter_type(parameter, &ty);
            let entity = if parameter.reference {
                unknown_variable(ty)
            } else {
                Entity::Broken
            };
            self.declare(&parameter.name, entity);
        }
        for argument in arguments {
            let argument = self.place(argument);
            let argument = self.place_left_out(argument);
            self.expect_pure(&argument, "an argument of a template");
        }
        self.scopes.pop();
        let target = self.target(template)?;
        let wanted = formal_parameters(document, target).len();
        if wanted != arguments.len() {
            self.wrong_count(&template.text, wanted, arguments.len(), template.span);
        }
        Some(target)
    }

    /// The template or instantiation with a name.
    fn target(&mut self, name: &Name) -> Option<Instantiated> {
        match self.lookup(&name.text) {
            Some(Entity::Template(i)) => Some(Instantiated::Template(i)),
            Some(Entity::Instantiation(i)) => Some(Instantiated::Instantiation(i)),
            Some(Entity::Broken | Entity::Chart) => None,
            Some(entity) => self.refused(
                codes::TEMPLATE_EXPECTED,
                name.span,
                format!("'{}' is {}, not a template", name.text, entity.kind()),
                "name a template or an instantiation",
            ),
            None => {
                self.unknown_name(&name.text, name.span);
                None
            }
        }
    }

    fn system_line_name(
        &mut self,
        document: &Document,
        name: &Name,
        level: u32,
        used: &mut [bool],
    ) {
        let Some(target) = self.target(name) else {
            return;
        };
        mark_used(document, self, target, used);
        if self.world.processes.groups.contains_key(&name.text) {
            self.error(
                codes::PROCESS_TWICE,
                name.span,
                format!("the system line names '{}' twice", name.text),
                "give the second process its own name, with an instantiation",
            );
            return;
        }
        let formals = formal_parameters(document, target);
        let Some(types) = self.free_parameters(formals, name, target) else {
            return;
        };
        let group = Group {
            first: self.world.network.processes.len() as u32,
            parameters: types.clone(),
        };
        let count: u64 = types
            .iter()
            .map(|ty| u64::from(parameter_count(ty)))
            .fold(1, u64::saturating_mul);
        if count.saturating_add(self.world.network.processes.len() as u64) > PROCESS_LIMIT {
            self.error(
                codes::RANGE_TOO_LARGE,
                name.span,
                format!("'{}' stands for {count} processes", name.text),
                "use smaller ranges for its parameters",
            );
            return;
        }
        self.world.processes.groups.insert(name.text.clone(), group);
        if count == 0 {
            return;
        }
        let first = self.world.network.processes.len() as u32;
        for values in combinations(&types) {
            cancellation::work(UNITS_FOR_PROCESS);
            let scope = free_values(formals, &types, &values);
            if let Some((template, scope)) = self.bind(document, target, scope) {
                let template = &document.templates[template];
                self.make_process(template, scope, process_name(name, &values), level);
            }
        }
        self.place_in_group(first, &types);
    }

    /// Notes of the processes of a set, the last of the network, which they are.
    fn place_in_group(&mut self, first: u32, types: &[Type]) {
        let mut stride: u32 = types.iter().map(parameter_count).product();
        let processes = &mut self.world.network.processes[first as usize..];
        for process in &mut *processes {
            process.group = ProcessId(first);
        }
        for ty in types {
            let count = parameter_count(ty);
            stride /= count;
            let Some(set) = ty.scalar_set() else { continue };
            for (number, process) in (0..).zip(&mut *processes) {
                process.coordinates.push(Coordinate {
                    set,
                    member: number / stride % count,
                    stride,
                });
            }
        }
    }

    /// The types of the parameters that the system line leaves free.
    fn free_parameters(
        &mut self,
        formals: &[Parameter],
        name: &Name,
        target: Instantiated,
    ) -> Option<Vec<Type>> {
        let mut types = Vec::new();
        for formal in formals {
            let ty = self.formal_type(formal, target, &mut Scope::default());
            let bounds = ty.bounds();
            let is_bounded = matches!(ty, Type::Scalar { .. })
                || (matches!(ty, Type::Int { .. })
                    && bounds != DEFAULT_INT
                    && bounds != (i32::MIN, i32::MAX));
            if ty.is_error() {
                return None;
            }
            if !is_bounded || formal.reference {
                return self.refused(
                    codes::FREE_PARAMETER_UNBOUNDED,
                    name.span,
                    format!(
                        "'{}' cannot stand in the system line: its parameter '{}' has no value and is not a bounded integer or scalar",
                        name.text, formal.name.text
                    ),
                    "instantiate it with arguments, or give the parameter a range",
                );
            }
            types.push(ty);
        }
        Some(types)
    }

    /// The type of a formal parameter, seen from where it is declared; earlier parameters may stand
    /// in it.
    fn formal_type(
        &mut self,
        formal: &Parameter,
        target: Instantiated,
        earlier: &mut Scope,
    ) -> Type {
        let hidden = std::mem::replace(
            &mut self.hides_system,
            matches!(target, Instantiated::Template(_)),
        );
        self.scopes.push(std::mem::take(earlier));
        let ty = self.dimensioned(&formal.ty, &formal.dimensions);
        self.check_parameter_type(formal, &ty);
        *earlier = self.scopes.pop().expect("the scope was just opened");
        self.hides_system = hidden;
        ty
    }

    fn make_process(
        &mut self,
        template: &ast::Template,
        scope: Scope,
        full_name: String,
        level: u32,
    ) {
        let id = ProcessId(self.world.network.processes.len() as u32);
        let outer = self.process.replace((id, full_name));
        self.hides_system = true;
        let scope = self.own_parameters(template, scope);
        self.scopes.push(scope);
        let process = self.template(template, level);
        let scope = self.scopes.pop().expect("the scope was just opened");
        self.hides_system = false;
        self.process = outer;
        self.world.processes.scopes.push(scope);
        self.world.network.processes.push(process);
    }

    /// Makes variables of the parameters by value that the template assigns to.
    fn own_parameters(&mut self, template: &ast::Template, mut scope: Scope) -> Scope {
        let assigned = assigned_names(template);
        for formal in &template.parameters {
            let is_own = !formal.reference && !self.carried(&formal.ty).constant;
            if !is_own || !assigned.contains(&formal.name.text) {
                continue;
            }
            let (ty, words) = match scope.get(&formal.name.text).map(|(entity, _)| entity) {
                Some(Entity::Constant { value, .. }) => {
                    let words = match value.kind {
                        Kind::Int(value) => vec![value],
                        Kind::Double(value) => arithmetic::double_words(value).to_vec(),
                        _ => continue,
                    };
                    (value.ty.clone(), words)
                }
                Some(Entity::Variable { place, ty }) if place.root == Root::Constants => {
                    let words = &self.world.network.constants[place.base.words as usize..];
                    (ty.clone(), words[..ty.size().words as usize].to_vec())
                }
                _ => continue,
            };
            let ast::Name { text, span } = &formal.name;
            self.warn_if_left_out(text, &ty, *span);
            let place = self.allocate(text, *span, &ty, false, &words);
            scope.set(text, Entity::Variable { place, ty }, *span);
        }
        scope
    }

    /// Follows instantiations down to a template; returns it with the scope of its parameters.
    fn bind(
        &mut self,
        document: &Document,
        target: Instantiated,
        scope: Scope,
    ) -> Option<(usize, Scope)> {
        let item = match target {
            Instantiated::Template(i) => return Some((i, scope)),
            Instantiated::Instantiation(item) => item,
        };
        let SystemItem::Instantiation {
            template,
            arguments,
            ..
        } = &document.system.items[item]
        else {
            return None;
        };
        let next = self.target(template)?;
        let formals = formal_parameters(document, next);
        if formals.len() != arguments.len() {
            return None;
        }
        let mut bound = Scope::default();
        for (formal, argument) in formals.iter().zip(arguments) {
            let ty = self.formal_type(formal, next, &mut bound);
            self.scopes.push(scope.clone());
            self.free_parameter_seen = false;
            let argument = self.place(argument);
            let argument = self.place_left_out(argument);
            let entity = self.bind_argument(formal, &ty, argument);
            self.scopes.pop();
            bound.set(&formal.name.text, entity?, formal.name.span);
        }
        self.bind(document, next, bound)
    }

    fn bind_argument(&mut self, formal: &Parameter, ty: &Type, argument: Expr) -> Option<Entity> {
        if argument.is_error() || ty.is_error() {
            return None;
        }
        self.expect_pure(&argument, "an argument of a template");
        let constant = self.carried(&formal.ty).constant;
        if !formal.reference || (constant && !is_fixed_place(&argument)) {
            let free = self.free_parameter_seen;
            let span = argument.span;
            let argument = self.converted(read(argument), ty)?;
            let words = self.known_words(&argument, ty, "an argument of a template")?;
            return Some(self.constant_entity(words, ty, free, span));
        }
        if !self.can_be_referred_to(formal, ty, constant, &argument) {
            return None;
        }
        let variable = argument.variable()?;
        let (root, declared) = (variable.root, variable.declared);
        let base = Size {
            words: known_offset(&argument, Memory::Words)?,
            clocks: known_offset(&argument, Memory::Clocks)?,
            channels: known_offset(&argument, Memory::Channels)?,
        };
        let place = Place {
            root,
            base,
            mutable: !constant,
            declared,
        };
        // Ranges are checked against the variable's own type; hybrid clocks stay hybrid.
        Some(Entity::Variable {
            place,
            ty: argument.ty,
        })
    }

    /// Whether an argument can be given to a reference parameter; reports it otherwise.
    fn can_be_referred_to(
        &mut self,
        formal: &Parameter,
        ty: &Type,
        constant: bool,
        argument: &Expr,
    ) -> bool {
        if !is_fixed_place(argument) {
            self.error(
                codes::REFERENCE_NOT_UNIQUE,
                argument.span,
                "a reference parameter needs one variable that is known when the model is loaded",
                "name a variable, or a part of an array with a constant index",
            );
            return false;
        }
        if !constant && !argument.is_mutable_place() && argument.ty.size().words > 0 {
            self.expect_mutable(argument);
            return false;
        }
        let fits = if constant {
            ty.accepts(&argument.ty) && ty.size() == argument.ty.size()
        } else {
            let given = argument.ty.with_hybrid_clocks();
            ty.with_hybrid_clocks().is_equivalent(&given) && ty.accepts_channel(&argument.ty)
        };
        if !fits {
            self.error(
                codes::REFERENCE_MISMATCHED,
                argument.span,
                format!(
                    "the reference parameter '{}' needs {}, but this is {}",
                    formal.name.text,
                    ty.described(),
                    argument.ty.described()
                ),
                "a reference needs a variable of the same type, range included",
            );
        }
        fits
    }

    /// Checks a template that no process uses: what is not supported there does no harm.
    fn unused_template(&mut self, template: &ast::Template) {
        let held = self.hold_reports();
        self.check_unused_template(template);
        // What is still unknown is said of this template.
        self.can_lower();
        let found = self.release_reports(held);
        let mut unsupported = Vec::new();
        for diagnostic in found {
            if is_unsupported(&diagnostic) {
                unsupported.push(diagnostic);
            } else {
                self.report(diagnostic);
            }
        }
        unsupported.sort_by_key(|diagnostic| diagnostic.span);
        if let Some(first) = unsupported.first() {
            let line = self.sources.position(first.span).line;
            let note = format!("line {line}: {}", first.message);
            self.warn_of_unused(
                template.name.span,
                &format!("the template '{}'", template.name.text),
                note,
            );
        }
    }

    pub(super) fn warn_of_unused(&mut self, span: Span, what: &str, note: String) {
        self.report(
            Diagnostic::new(
                codes::UNSUPPORTED_UNUSED,
                span,
                format!("{what} has parts that are not supported; no process of the system is made of it"),
            )
            .note(note)
            .help("do nothing, unless you want to use it"),
        );
    }

    /// Reports unsupported constructs that the processes of the system use, and warns of the
    /// others.
    fn unsupported_parts(&mut self, document: &Document, used: &[bool]) {
        for construct in &document.unsupported {
            let name = match &construct.part {
                UnsupportedPart::Template(i) => Some(document.templates[*i].name.text.as_str()),
                UnsupportedPart::Whole => None,
                UnsupportedPart::Chart(_) => continue,
            };
            let mut templates = document.templates.iter().zip(used);
            let is_used = name.is_none_or(|name| {
                templates.any(|(template, used)| *used && template.name.text == name)
            });
            if is_used {
                self.error(
                    codes::CONSTRUCT_UNSUPPORTED,
                    construct.span,
                    format!("not supported: {}", construct.text),
                    "remove them from the model",
                );
            } else {
                let name = name.unwrap_or_default();
                let note = format!("not supported: {}", construct.text);
                self.warn_of_unused(construct.span, &format!("the template '{name}'"), note);
            }
        }
    }

    /// Checks a template that no process uses; nothing of it enters the network.
    fn check_unused_template(&mut self, template: &ast::Template) {
        let network = &self.world.network;
        let lengths = (
            network.clocks.len(),
            network.channels.len(),
            network.layout.variables.len(),
            self.world.initial.len(),
            self.world.initial_meta.len(),
            network.chances.clocks.len(),
        );
        self.is_generic = true;
        self.hides_system = true;
        self.scopes.push(Scope::default());
        let assigned = assigned_names(template);
        for formal in &template.parameters {
            let ty = self.dimensioned(&formal.ty, &formal.dimensions);
            self.check_parameter_type(formal, &ty);
            let is_variable = formal.reference || assigned.contains(&formal.name.text);
            let entity = if is_variable && !ty.is_error() {
                unknown_variable(ty)
            } else {
                Entity::Broken
            };
            self.declare(&formal.name, entity);
        }
        self.leaving = self.counter_of(template);
        self.template(template, 0);
        self.leaving = None;
        self.scopes.pop();
        self.hides_system = false;
        self.is_generic = false;
        let network = &mut self.world.network;
        network.clocks.truncate(lengths.0);
        network.initial_clocks.truncate(lengths.0);
        network.channels.truncate(lengths.1);
        network.layout.variables.truncate(lengths.2);
        network.chances.clocks.truncate(lengths.5);
        self.world.initial.truncate(lengths.3);
        self.world.initial_meta.truncate(lengths.4);
    }
}

/// Whether it says that something is not supported, and not that something is wrong.
fn is_unsupported(diagnostic: &Diagnostic) -> bool {
    diagnostic.code == codes::CONSTRUCT_UNSUPPORTED || super::is_symbolic(diagnostic)
}

/// The work of making a process, without its functions: see [`cancellation::work`].
const UNITS_FOR_PROCESS: usize = 1 << 14;

/// A variable of a template without instance: its type is known, its place is not.
fn unknown_variable(ty: Type) -> Entity {
    let place = Place::unnamed(Root::State, Size::default(), true);
    Entity::Variable { place, ty }
}

/// Whether it is a part of a variable that does not depend on the state.
fn is_fixed_place(expr: &Expr) -> bool {
    expr.variable().is_some()
        && known_offset(expr, Memory::Words).is_some()
        && !matches!(expr.kind, Kind::Error)
}

fn formal_parameters(document: &Document, target: Instantiated) -> &[Parameter] {
    match target {
        Instantiated::Template(i) => &document.templates[i].parameters,
        Instantiated::Instantiation(i) => match &document.system.items[i] {
            SystemItem::Instantiation { parameters, .. } => parameters,
            SystemItem::Declaration(_) => &[],
        },
    }
}

/// Notes the template that an instantiation comes down to.
fn mark_used(
    document: &Document,
    checker: &mut Checker<'_>,
    target: Instantiated,
    used: &mut [bool],
) {
    match target {
        Instantiated::Template(i) => used[i] = true,
        Instantiated::Instantiation(i) => {
            if let SystemItem::Instantiation { template, .. } = &document.system.items[i]
                && let Some(next) = checker.target(template)
                && next != target
            {
                mark_used(document, checker, next, used);
            }
        }
    }
}

/// All combinations of values of the types, the first changing slowest.
pub(super) fn combinations(types: &[Type]) -> Vec<Vec<i32>> {
    let mut all = vec![Vec::new()];
    for ty in types {
        let (low, high) = ty.bounds();
        all = all
            .into_iter()
            .flat_map(|start: Vec<i32>| {
                (low..=high).map(move |value| {
                    let mut combination = start.clone();
                    combination.push(value);
                    combination
                })
            })
            .collect();
    }
    all
}

/// A scope with the values of the free parameters of a process.
fn free_values(formals: &[Parameter], types: &[Type], values: &[i32]) -> Scope {
    let mut scope = Scope::default();
    for (formal, (ty, &value)) in formals.iter().zip(types.iter().zip(values)) {
        let value = Expr::int(value, ty.clone(), formal.name.span);
        let entity = Entity::Constant { value, free: true };
        scope.set(&formal.name.text, entity, formal.name.span);
    }
    scope
}

/// `P`, or `P(0,1)` for a process of a set.
fn process_name(name: &Name, values: &[i32]) -> String {
    if values.is_empty() {
        return name.text.clone();
    }
    let values: Vec<String> = values.iter().map(i32::to_string).collect();
    format!("{}({})", name.text, values.join(","))
}
